"""What models share that are sampled by a power of cos(theta_i), whatever the azimuth."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.warp import power_cosine, power_cosine_density


class PowerCosine(Reflectance):
    """Sampling with a density proportional to cos(theta_i)^n; n = 0 is uniform over the hemisphere."""

    @abstractmethod
    def exponent(self, wo: Direction) -> Any:
        """n."""

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return power_cosine(self.exponent(wo), u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return power_cosine_density(self.exponent(wo), wi.z)
