"""Cells of directions that light is counted in: rings about the normal, cut into sectors."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np


class Cells(NamedTuple):
    """Rings about the normal, of which the first is a cap and the last ends at the horizon, and sectors of each.

    All rings are equally wide but for the cap, which is half as wide: the middles of the others, and the normal, are
    the nodes of a table. Sectors have their middles at 0, 2 pi/n, ... from the azimuth of the incident light.
    """

    rings: int
    sectors: int

    @property
    def width(self) -> float:
        """The width of a ring [rad]."""
        return 0.5 * math.pi / (self.rings - 0.5)

    @property
    def theta_o(self) -> np.ndarray:
        """The polar angles (rings,) [rad] of the middles."""
        return self.width * np.arange(self.rings)

    @property
    def phi(self) -> np.ndarray:
        """The azimuths (sectors,) [rad] of the middles."""
        return 2.0 * math.pi * np.arange(self.sectors) / self.sectors

    @property
    def projected(self) -> np.ndarray:
        """The projected solid angle (rings, 1) [sr] of a cell: the integral of cos(theta)."""
        edges = self.width * np.maximum(np.arange(self.rings + 1) - 0.5, 0.0)
        edges[-1] = 0.5 * math.pi
        return (math.pi / self.sectors * np.diff(np.sin(edges) ** 2))[:, None]

    def f(self, light: np.ndarray, mirrored: bool, along_normal: bool) -> np.ndarray:
        """f [1/sr] (rings, sectors, C) of the shares of light in the cells: all the cap has one value.

        `mirrored`: where both sides of the plane of incidence are alike, their mean counts; `along_normal`: where all
        sectors are alike, theirs.
        """
        f = light / self.projected[..., None]
        if mirrored:
            f = 0.5 * (f + np.roll(f[:, ::-1], 1, axis=1))
        whole = slice(0, self.rings if mirrored and along_normal else 1)
        f[whole] = f[whole].mean(axis=1, keepdims=True)
        return f
