"""Which integrals are wanted, and the places of a map as rows of a material of one channel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...base.reflectance import Reflectance
from ...formula import tree
from ...numerics.quadrature import Integrals
from ..places import Places

BLOCK = 1 << 16
"""Places whose integrals are combined together."""

SPREAD = 4096
"""Places, beside those with the least and the largest numbers, among which the few are chosen."""


class Wanted(NamedTuple):
    """The integrals wanted: of one batch of directions (or of none: shape ()) with each place of a map.

    direct      (material, number of the direction for each place, places, tolerance) -> Integrals: one by one
    of, to      a geometry, or directions (n, 3), for light and viewer
    tolerance   absolute, times the larger of `unit` (n,) and the value
    coloured    whether lights have channels
    """

    shape: tuple[int, ...]
    direct: Callable[[Reflectance, np.ndarray, Places, Any], Integrals]
    of: Any
    to: Any
    tolerance: float
    unit: np.ndarray
    coloured: bool = False

    def only(self, k: int) -> Wanted:
        """The integrals for one of the directions."""

        def direct(m: Reflectance, number: np.ndarray, places: Places, tolerance: Any) -> Integrals:
            return self.direct(m, number + k, places, tolerance)

        of, to = (x[k : k + 1] if isinstance(x, np.ndarray) else x for x in (self.of, self.to))
        return self._replace(shape=(), direct=direct, of=of, to=to, unit=self.unit[k : k + 1])


class MaterialRows(NamedTuple):
    """A material of one channel with maps (length, 1)."""

    m: Reflectance
    length: int

    def at(self, rows: Any) -> Reflectance:
        """The material at some rows."""
        return tree.each(self.m, lambda x: x[rows] if np.ndim(x) > 1 else x)

    def integrals(self, rows: np.ndarray, wanted: Wanted, share: float) -> Integrals:
        """Integrals (directions, rows[, C]) to a share of the tolerance, one by one."""
        number = np.repeat(np.arange(len(wanted.unit)), len(rows))
        material, places = self.at(np.tile(rows, len(wanted.unit))), Places((len(number),), np.arange(len(number)))
        integral = wanted.direct(material, number, places, share * wanted.tolerance)
        shape = len(wanted.unit), len(rows)
        return Integrals(
            integral.value.reshape(*shape, -1), integral.error.reshape(shape), integral.missing.reshape(shape)
        )

    def whole(self) -> np.ndarray:
        """The numbers of the rows without holes."""
        ok = np.ones(self.length, bool)
        for x in tree.holed(self.m):
            ok &= np.isfinite(x[:, 0]) if np.ndim(x) > 1 else bool(np.isfinite(x).all())
        return np.flatnonzero(ok)

    def extremes(self) -> list[int]:
        """Rows with the least and the largest numbers."""
        maps = (x[:, 0] for x in tree.leaves(self.m) if np.ndim(x) > 1)
        return [row for x in maps for row in least_and_most(x)]


def least_and_most(x: np.ndarray) -> tuple[int, int]:
    low, high = int(x.argmin()), int(x.argmax())
    return (
        (low, high)
        if np.isfinite(x[[low, high]]).all()
        else (int(_filled(x, 1).argmin()), int(_filled(x, -1).argmax()))
    )


def _filled(x: np.ndarray, sign: int) -> np.ndarray:
    return np.where(np.isfinite(x), x, sign * np.inf)
