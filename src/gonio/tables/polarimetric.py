"""Mueller matrices between the nodes of a grid: the other 15 elements of a table whose f is the first one."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

import numpy as np

from ..arrays import Fixed, Roomy, ops
from ..formula.direction import Direction
from ..formula.mueller import Mueller, about_facet
from ._lookup import Interpolated

KEPT = "measured matrices, and interpolations between them, are kept as they are"
"""Why tables may break the law of realizability."""
MIRRORED = np.outer([1, 1, -1, -1], [1, 1, -1, -1])
"""Signs of the elements as both directions are mirrored in a plane through the normal."""


class Polarimetric(Interpolated):
    """Base of tables of Mueller matrices, in the axes of the facet: these are smooth where directions meet the normal.

    Each element is interpolated as f is; nodes without f are left out.
    """

    polarizes = True
    is_mirrored: bool
    elements: Any  # of the matrices at the nodes, flat; of bound materials only

    @abstractmethod
    def facet_matrices(self) -> np.ndarray:
        """Mueller matrices at the nodes (grid...[, C], 4, 4) [1/sr], in the axes of the facet."""

    def _looked_up(self) -> dict[str, Fixed]:
        elements = Roomy(lambda: self._flat(self.facet_matrices(), self.width * 16))
        return {**super()._looked_up(), "elements": elements}

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        (corners, beyond), channel = self.corners(wi, wo), ops.to_index(self.channel)
        places = [(at * self.width + channel, weight) for at, weight in corners]
        if self.holes:
            known = []
            for at, weight in places:
                f = ops.take(self.values, at)
                known.append((at, ops.where(f == f, weight, 0.0)))
            share: Any = sum(weight for _, weight in known)
            scale = 1.0 / ops.where(share > 0.0, share, 1.0)
            places = [(at, weight * scale) for at, weight in known]
        f = self.formula(wi, wo)
        rows = [[self._element(places, 4 * i + j) if i or j else f for j in range(4)] for i in range(4)]
        if self.outside != "hold":
            rest = math.nan if self.outside == "missing" else 0.0
            rows = [[ops.where(beyond, rest, x) for x in row] for row in rows]
        if self.is_mirrored:
            side = ops.where(wi.x * wo.y - wi.y * wo.x < 0.0, -1.0, 1.0)
            rows = [[x if MIRRORED[i, j] > 0 else side * x for j, x in enumerate(r)] for i, r in enumerate(rows)]
        return about_facet(Mueller(tuple(map(tuple, rows))), wi, wo)  # type: ignore[arg-type]  # 4 x 4, which `map` does not say

    def _element(self, places: list[tuple[Any, Any]], which: int) -> Any:
        total: Any = 0.0
        for at, weight in places:
            value = ops.take(self.elements, at * 16 + which)
            total = total + weight * (ops.where(weight == 0.0, 0.0, value) if self.holes else value)
        return total
