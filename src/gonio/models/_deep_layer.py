"""What the models of deep scattering layers share: their sampling."""

from __future__ import annotations

from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.warp import power_cosine, power_cosine_density


class _DeepLayer(Reflectance):
    """Sampling of z_i/(z_i + z_o) by the power of z_i that has its slope at z_i = 1/2."""

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return power_cosine(_slope(wo), u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return power_cosine_density(_slope(wo), wi.z)


def _slope(wo: Direction) -> Any:
    return wo.z / (0.5 + wo.z)
