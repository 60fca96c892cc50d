"""Disney's diffuse lobe, which darkens or brightens towards grazing with its roughness, and Frostbite's scaled one."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..base.reflectance import Reflectance
from ..formula.direction import Direction, dot
from ..formula.fields import param
from ..formula.special import less_fifth_power


def _towards(F90: Any, cos_theta: Any) -> Any:
    """1 + (F90 - 1) (1 - cos theta)^5."""
    return F90 + (1.0 - F90) * less_fifth_power(cos_theta)


class DisneyDiffuse(Reflectance):
    """Diffuse lobe with retro-reflection: f = rho/pi (1 + (F90 - 1)(1 - z_i)^5) (1 + (F90 - 1)(1 - z_o)^5).

    F90 = 1/2 + 2 roughness cos^2(theta_d), z = cos(theta). Fitted by eye to measured materials.

    Looks    `DisneyDiffuse(0.5, 1)` is cloth, brighter at grazing angles than Lambertian;
             `DisneyDiffuse(0.5, 0)` is matt, a little darker there.
    Shapes   rho, roughness: numbers or (..., C).
    Units    f: 1/sr; rho: 1 (the paper's base colour); roughness: 1, the square root of the GGX lobe's alpha.
    Error    rounding: 8e-7 relative in float32.
    Source   Burley 2012, "Physically-based shading at Disney", SIGGRAPH course notes.

    Example
    >>> cloth = gn.DisneyDiffuse(0.5, roughness=1.0)
    >>> print((np.pi * cloth.f_angles([0.0, 1.3], 0.0, [0.0, 1.3], 0.0)).round(3))
    [0.5   0.866]
    """

    rho = param(0.5, 0.0, 1.0, "base colour")
    roughness = param(0.5, 0.0, 1.0, "the paper's roughness: the square root of alpha")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "nothing normalizes it: for rho = roughness = 1 the albedo is 1.04 at normal incidence and reaches "
        "1.55 at grazing",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        F90 = 0.5 + self.roughness * (1.0 + dot(wi, wo))
        return self.rho * (1.0 / math.pi) * _towards(F90, wi.z) * _towards(F90, wo.z)

    def estimate(self, wo: Direction) -> Any:
        return self.rho * _towards(0.5 + self.roughness, wo.z)


class FrostbiteDiffuse(Reflectance):
    """`DisneyDiffuse` scaled to reflect less than arrives, nearly: with F90 = r (1/2 + 2 cos^2(theta_d)),

    f = rho/pi (1 - 0.51/1.51 r) (1 + (F90 - 1)(1 - z_i)^5) (1 + (F90 - 1)(1 - z_o)^5),   r = roughness

    Looks    `FrostbiteDiffuse(0.5, 1)` is a third darker in the middle than at grazing angles;
             `FrostbiteDiffuse(0.5, 0)` is matt, a little darker than Lambertian there.
    Shapes   rho, roughness: numbers or (..., C).
    Units    f: 1/sr; rho: 1; roughness: 1, the square root of the GGX lobe's alpha.
    Error    rounding: 8e-7 relative in float32.
    Source   Lagarde & de Rousiers 2014, "Moving Frostbite to physically based rendering", SIGGRAPH course notes.

    Example
    >>> cloth = gn.FrostbiteDiffuse(0.5, roughness=1.0)
    >>> print((np.pi * cloth.f_angles([0.0, 1.3], 0.0, [0.0, 1.3], 0.0)).round(3))
    [0.331 0.574]
    """

    rho = param(0.5, 0.0, 1.0, "base colour")
    roughness = param(0.5, 0.0, 1.0, "the paper's linear roughness: the square root of alpha")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "the scale is a fit: for rho = roughness = 1 the albedo exceeds 1 beyond 88.6 degrees, by up to 0.03",
    }

    @property
    def scale(self) -> Any:
        return self.rho * (1.0 - 0.51 / 1.51 * self.roughness)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        F90 = self.roughness * (1.5 + dot(wi, wo))
        return self.scale * (1.0 / math.pi) * _towards(F90, wi.z) * _towards(F90, wo.z)

    def estimate(self, wo: Direction) -> Any:
        return self.scale * _towards(1.5 * self.roughness, wo.z)
