"""The form factors of all pairs of patches: in closed form, times what rays see, symmetric, with rows that close."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..compile.threads import share
from ..numerics.lattice import lattice
from ..radiometry.form_factors import polygon_to_polygon
from .by_rays import ByRays
from .lamps import factors_of_all
from .patches import Patches

NEAR = 0.25
"""Gap of two patches, in sizes of the larger, below which the double contour integral is taken."""

FIRST, MORE = 4, 28
"""Rays between two patches, and further ones where some of the first are blocked."""

CLOSED = 256
"""Rays of each patch that all meet a front, in closed scenes."""

BLOCK = 1 << 18
"""Pairs taken together."""


class Dense:
    """F x, with the matrix `factors` (n, n): A_i F_ij = A_j F_ji exactly, and in closed scenes rows that sum to 1.

    `unseen`: the largest difference of a row's sum from 1 before it was corrected, in closed scenes.
    """

    def __init__(self, patches: Patches, factors: np.ndarray | None = None):
        self.patches = patches
        self.unseen = 0.0
        self.factors = self._found() if factors is None else factors

    def _found(self) -> np.ndarray:
        patches = self.patches
        n, areas = len(patches), patches.areas
        exchange = factors_of_all(patches.corners, patches.normals, patches.corners) * areas[:, None]
        exchange = 0.5 * (exchange + exchange.T)
        np.fill_diagonal(exchange, 0.0)
        i, j = np.nonzero(np.triu(exchange))
        seen = self._seen(i, j)
        radius = np.linalg.norm(patches.corners - patches.centres[:, None], axis=2).max(axis=1)
        gap = np.linalg.norm(patches.centres[i] - patches.centres[j], axis=1) - radius[i] - radius[j]
        near = (gap < NEAR * np.maximum(radius[i], radius[j])) & (seen > 0.0)
        i_near, j_near = i[near], j[near]
        exact = polygon_to_polygon(patches.corners[i_near], patches.corners[j_near]) * areas[i_near]
        exchange[i_near, j_near] = exchange[j_near, i_near] = exact
        exchange[i, j] *= seen
        exchange[j, i] *= seen
        rows = exchange.sum(axis=1) / areas
        if (self._by_rays.hits < n).all() and n > 1:
            self.unseen = float(np.abs(rows - 1.0).max())
            exchange = _closed(exchange, areas)
        return exchange / areas[:, None]

    def _seen(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Share of the light between the patches of each pair that nothing stops."""
        u = lattice(FIRST + MORE, 4)
        s = np.sqrt(u[:, [0, 2]])
        places = np.stack([1.0 - s, s * (1.0 - u[:, [1, 3]]), s * u[:, [1, 3]]], axis=-1).astype(np.float32)
        lifted = (self.patches.corners + self.patches.lift * self.patches.normals[:, None]).astype(np.float32)
        triangles = self.patches.faces.local
        triangles.faces_met(lifted[:1, 0], self.patches.normals[:1])
        seen = np.empty(len(i))

        def clear(rays: slice, a: np.ndarray, b: np.ndarray) -> np.ndarray:
            o, to = (np.einsum("sk,nkx->nsx", places[rays, side], lifted[x]) for side, x in ((0, a), (1, b)))
            blocked = triangles.any_met(o.reshape(-1, 3), (to - o).reshape(-1, 3), 1.0)
            return ~blocked.reshape(len(a), -1)

        def work(start: int, stop: int) -> None:
            a, b = i[start:stop], j[start:stop]
            share_seen = clear(slice(0, FIRST), a, b).mean(axis=1)
            part = np.flatnonzero((share_seen > 0.0) & (share_seen < 1.0))
            if len(part):
                rest = clear(slice(FIRST, FIRST + MORE), a[part], b[part]).sum(axis=1)
                share_seen[part] = (FIRST * share_seen[part] + rest) / (FIRST + MORE)
            seen[start:stop] = share_seen

        share(work, [(start, min(start + BLOCK // 4, len(i))) for start in range(0, len(i), BLOCK // 4)])
        return seen

    @cached_property
    def _by_rays(self) -> ByRays:
        return ByRays(self.patches, CLOSED)

    @property
    def rows(self) -> np.ndarray:
        """Sums of the factors of each patch (n,)."""
        return self.factors.sum(axis=1)

    @property
    def escaping(self) -> np.ndarray:
        """The share of what each patch sends out that meets nothing, (n,): of what meets no front, that of rays."""
        nothing, lost = self._by_rays.escaping, 1.0 - self._by_rays.rows
        return np.where(lost > 0.0, (1.0 - self.rows) * nothing / np.where(lost > 0.0, lost, 1.0), 0.0)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """F x, (n, C) of (n, C)."""
        return self.factors @ x


def _closed(exchange: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """The symmetric matrix d_i X_ij d_j whose rows sum to the areas, by Sinkhorn's iteration."""
    d = np.ones(len(areas))
    for _ in range(400):
        rows = d * (exchange @ d)
        if np.abs(rows / areas - 1.0).max() < 1e-13:
            break
        d *= np.sqrt(areas / rows)
    return d[:, None] * exchange * d
