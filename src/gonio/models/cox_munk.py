"""Cox and Munk's sea: sun glint on facets whose slopes the wind makes."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..distributions.beckmann import Beckmann
from ..formula import tree
from ..formula.direction import Direction, half_and_cosine
from ..formula.fields import option, param
from ..formula.fresnel.dielectric import Dielectric
from ._facets import Facets


class CoxMunk(Facets, oriented=True):
    """Wind-ruffled sea: f = p(z_u, z_c) F(wo . wm) G / (4 cos(theta_i) cos(theta_o) cos(theta_m)^4).

    p is the density of slopes, z_u along the direction that the wind comes from, z_c across; W the wind speed:
    "isotropic"      Gaussian, sigma^2 = 0.003 + 0.00512 W for both together;
    "anisotropic"    Gaussian, sigma_u^2 = 0.00316 W (not below 1e-4), sigma_c^2 = 0.003 + 0.00192 W;
    "gram_charlier"  the latter times 1 - c21 (x^2 - 1) y/2 - c03 (y^3 - 3 y)/6 + 0.40 (x^4 - 6 x^2 + 3)/24
                     + 0.12 (x^2 - 1)(y^2 - 1)/4 + 0.23 (y^4 - 6 y^2 + 3)/24, x = z_c/sigma_c, y = z_u/sigma_u,
                     c21 = 0.01 - 0.0086 W, c03 = 0.04 - 0.033 W, and 0 where that is negative: lee faces are steeper.
    G is Smith's for the Gaussian slopes, or 1 ("none") as in 6S. The glint's BRF, the reflectance of
    ocean colour, is pi f. Foam and water below: `(1 - a) * CoxMunk(W) + a * Lambertian(0.2) + Lambertian(0.02)`.

    Looks    `CoxMunk(1)` is a calm sea with a narrow glitter of the sun; `CoxMunk(15)` spreads it over a large, dim
             patch.
    Shapes   wind_speed, wind_azimuth, eta: numbers or (..., C).
    Units    f: 1/sr; wind_speed: m/s, 12.5 m above the sea; wind_azimuth: rad; eta: 1.
    Error    rounding. Slopes were measured for 1 to 14 m/s, and the series for |x|, |y| < 2.5; negative density cut
             off adds nothing to the integral of p at 5 m/s, 0.04 % at 14 and 0.22 % at 20. No light is reflected twice.
    Source   Cox & Munk 1954, J. Opt. Soc. Am. 44(11):838. Equations as in two independent descriptions; the sign
             of z_u makes the most probable slope ascend downwind, as the paper's abstract says. Smith's G: see
             `Beckmann`, whose visible normals are sampled.

    Example
    >>> for wind_speed in (1.0, 15.0):
    ...     print(gn.CoxMunk(wind_speed).f_angles(0.5, 0.0, [0.5, 0.9], np.pi).round(4))
    ...
    [0.3195 0.0012]
    [0.0325 0.0279]
    """

    wind_speed = param(5.0, 0.0, 20.0, "wind speed 12.5 m above the sea", unit="m s-1", sampled="max")
    wind_azimuth = param(0.0, -math.pi, math.pi, "azimuth of the direction that the wind comes from", unit="rad")
    eta = param(1.34, 1.0, 5.0, "refractive index of the water")
    slopes = option("gram_charlier", "anisotropic", "isotropic", doc="density of the slopes")
    masking = option("height_correlated", "separable", "none", doc="which facets are lit and seen")

    breaks: ClassVar[dict[str, str]] = {
        "energy": 'with masking="none" the glint grows as 1/cos(theta) towards grazing: 13 times the light that '
        "arrives at 89.9 degrees for W = 5 m/s; with Smith's masking nothing is gained",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wi, wo = self._to_wind(wi), self._to_wind(wo)
        wm, cos_d = half_and_cosine(wi, wo)
        D = self.facets.D(wm) * self._skewed(wm)
        G = 1.0 if self.masking == "none" else self.G(wi, wo, wm)
        return D * self.fresnel.F(cos_d) * G / (4.0 * wi.z * wo.z)

    def without_fresnel(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        wi, wo, wm = self._to_wind(wi), self._to_wind(wo), self._to_wind(wm)
        G = 1.0 if self.masking == "none" else self.G(wi, wo, wm)
        return self.facets.D(wm) * self._skewed(wm) * G / (4.0 * wi.z * wo.z)

    def _variances(self) -> tuple[Any, Any]:
        """sigma_u^2, sigma_c^2."""
        if self.slopes == "isotropic":
            each = 0.5 * (0.003 + 0.00512 * self.wind_speed)
            return each, each
        return ops.maximum(0.00316 * self.wind_speed, 1e-4), 0.003 + 0.00192 * self.wind_speed

    @property
    def facets(self) -> Beckmann:
        upwind, crosswind = self._variances()
        return tree.unchecked(Beckmann, alpha_x=ops.sqrt(2.0 * upwind), alpha_y=ops.sqrt(2.0 * crosswind))

    @property
    def fresnel(self) -> Any:
        return tree.unchecked(Dielectric, eta=self.eta)

    def _skewed(self, wm: Direction) -> Any:
        """The Gram–Charlier series in the slopes of a facet, -x/z and -y/z of its normal."""
        if self.slopes != "gram_charlier":
            return 1.0
        upwind, crosswind = self._variances()
        # Beyond 12 standard deviations nothing is left, and fourth powers of slopes overflow at grazing.
        y = ops.clip(-wm.x / (wm.z * ops.sqrt(upwind)), -12.0, 12.0)
        x = ops.clip(-wm.y / (wm.z * ops.sqrt(crosswind)), -12.0, 12.0)
        c21, c03 = 0.01 - 0.0086 * self.wind_speed, 0.04 - 0.033 * self.wind_speed
        x2, y2 = x * x, y * y
        skewness = c21 * (1.0 / 2) * (x2 - 1.0) * y + c03 * (1.0 / 6) * (y2 - 3.0) * y
        peakedness = (0.40 / 24) * (x2 * (x2 - 6.0) + 3.0) + (0.23 / 24) * (y2 * (y2 - 6.0) + 3.0)
        return ops.maximum(1.0 - skewness + peakedness + (0.12 / 4) * (x2 - 1.0) * (y2 - 1.0), 0.0)

    # The frame of the wind: x points to where it comes from.

    def _to_wind(self, w: Direction) -> Direction:
        c, s = ops.cos(self.wind_azimuth), ops.sin(self.wind_azimuth)
        return Direction(c * w.x + s * w.y, c * w.y - s * w.x, w.z)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        wi = super().warp(self._to_wind(wo), u0, u1)
        c, s = ops.cos(self.wind_azimuth), ops.sin(self.wind_azimuth)
        return Direction(c * wi.x - s * wi.y, c * wi.y + s * wi.x, wi.z)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return super().density(self._to_wind(wi), self._to_wind(wo))
