"""The diffuse part of Ashikhmin and Shirley's model: what the gloss above it leaves over."""

from __future__ import annotations

import math
from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.fields import param
from ..formula.special import less_fifth_power


class AshikhminShirleyDiffuse(Reflectance):
    """Diffuse reflection below a glossy lobe: f = 28 rho/(23 pi) (1 - F0) (1 - (1 - z_i/2)^5) (1 - (1 - z_o/2)^5).

    z = cos(theta). To be added to a lobe of Fresnel reflectance F0 at normal incidence: both together conserve energy.

    Looks    `AshikhminShirleyDiffuse(0.5)` is matt and darkens at the rim, where a glossy lobe beside it takes over;
             `F0=0.9` leaves little of it.
    Shapes   rho, F0: numbers or (..., C).
    Units    f: 1/sr; rho (the paper's R_d), F0 (R_s): 1.
    Error    rounding: 4e-7 relative in float32.
    Source   Ashikhmin & Shirley 2000, "An anisotropic Phong BRDF model", Journal of Graphics Tools 5(2).
    """

    rho = param(0.5, 0.0, 1.0, "diffuse albedo of the substrate")
    F0 = param(0.04, 0.0, 1.0, "reflectance of the glossy lobe at normal incidence")

    @property
    def scale(self) -> Any:
        return self.rho * (1.0 - self.F0)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        passed = less_fifth_power(0.5 * wi.z) * less_fifth_power(0.5 * wo.z)
        return 28.0 / (23.0 * math.pi) * self.scale * passed

    def estimate(self, wo: Direction) -> Any:
        return self.scale * less_fifth_power(0.5 * wo.z)
