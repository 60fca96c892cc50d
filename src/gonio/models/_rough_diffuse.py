"""What the models of rough diffuse surfaces share: they are sampled towards the side of the viewer."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, azimuth


class _RoughDiffuse(Reflectance):
    """Sampling of lobes A + B s/max(z_i, z_o) for s > 0, s = sin(theta_i) sin(theta_o) cos(phi_i - phi_o).

    z_i is drawn from a mixture of the densities 2 z and 1, then phi_i - phi_o from a wrapped Cauchy distribution whose
    concentration kappa follows s/max. Both have inverses; weights stay below 4 times their mean at all angles.
    """

    @property
    @abstractmethod
    def back(self) -> Any:
        """B/A, how strongly the surface scatters back."""

    def _level(self, wo: Direction) -> Any:
        """Share of the density 1 in that of z_i."""
        return self.back / (2.0 + self.back) * (1.0 - wo.z)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        level = self._level(wo)
        z = 2.0 * u0 / (level + ops.sqrt(level * level + 4.0 * (1.0 - level) * u0 + 1e-30))
        s = ops.sqrt(ops.maximum(1.0 - z * z, 0.0))
        so = ops.sqrt(wo.x * wo.x + wo.y * wo.y + 1e-24)
        kappa = _kappa(self.back * s * so, ops.maximum(z, wo.z))
        (c, t), norm = ops.turn(u1), 1.0 + kappa * kappa
        along = (norm * c + 2.0 * kappa) / (norm + 2.0 * kappa * c)
        across = (1.0 - kappa * kappa) * t / (norm + 2.0 * kappa * c)
        ex, ey = azimuth(wo, so)
        return Direction(s * (ex * along - ey * across), s * (ey * along + ex * across), z)

    def density(self, wi: Direction, wo: Direction) -> Any:
        level = self._level(wo)
        s = wi.x * wo.x + wi.y * wo.y
        si2, so2 = wi.x * wi.x + wi.y * wi.y, wo.x * wo.x + wo.y * wo.y
        largest = self.back * ops.sqrt(si2 * so2 + 1e-30)
        top = ops.maximum(wi.z, wo.z)
        kappa = _kappa(largest, top)
        around = (1.0 - kappa * kappa) / (1.0 + kappa * kappa - self.back * s / (top + largest))
        return (2.0 * wi.z * (1.0 - level) + level) * around * (0.5 / math.pi)


def _kappa(largest: Any, top: Any) -> Any:
    return 0.5 * largest / (top + largest)
