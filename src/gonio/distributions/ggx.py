"""GGX, by Trowbridge and Reitz: long tails, and everything in closed form."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction, normalize, on_circle
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution, Spread, stretched
from ..formula.fields import param


class GGX(Distribution, oriented=True):
    """Trowbridge–Reitz (GGX): facets oriented as on a half ellipsoid.

    D = 1 / (pi ax ay (x^2/ax^2 + y^2/ay^2 + z^2)^2),   Lambda = (sqrt(1 + (ax^2 x^2 + ay^2 y^2)/z^2) - 1)/2

    Looks    `GGX(0.3)` is satin metal, its highlight in a halo; `GGX(0.1, 0.4)` is brushed, rougher along
             y.
    Shapes   alpha_x, alpha_y: numbers or (..., C).
    Units    D: 1/sr; alpha: 1. `GGX(0.3)` is isotropic, `GGX(0.1, 0.4)` is rougher along y.
    Error    rounding.
    Source   Trowbridge & Reitz 1975, J. Opt. Soc. Am. 65(5):531; Walter et al. 2007, EGSR. Lambda: Heitz 2014,
             JCGT 3(2). Visible normals: Dupuy & Benyoub 2023, "Sampling visible GGX normals with spherical caps".

    Example
    >>> rough = gn.Microfacet(gn.GGX(0.3))
    >>> print(rough.f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    [0.8842 0.4885 0.1932]
    >>> print(gn.albedo(gn.Microfacet(gn.GGX(1.0)), [0, 0, 1]).round(4))  # 1 - log(2)
    0.3069
    """

    alpha_x = param(0.2, ALPHA_LOW, ALPHA_HIGH, "slope scale along x", alias="alpha", sampled="max")
    alpha_y = param("alpha_x", ALPHA_LOW, ALPHA_HIGH, "slope scale along y", sampled="max")

    @property
    def slope_spread(self) -> Spread:
        return Spread(self.alpha_x, self.alpha_y)

    def D(self, wm: Direction) -> Any:
        sx, sy = wm.x / self.alpha_x, wm.y / self.alpha_y
        s = sx * sx + sy * sy + wm.z * wm.z
        return 1.0 / (math.pi * self.alpha_x * self.alpha_y * s * s)

    def Lambda(self, w: Direction) -> Any:
        sx, sy = self.alpha_x * w.x, self.alpha_y * w.y
        s2 = sx * sx + sy * sy
        return 0.5 * s2 / (w.z * (ops.sqrt(w.z * w.z + s2) + w.z))  # (sqrt(1 + s2/z^2) - 1)/2 without cancellation

    def projected_area(self, w: Direction) -> Any:
        sx, sy = self.alpha_x * w.x, self.alpha_y * w.y
        return 0.5 * (w.z + ops.sqrt(sx * sx + sy * sy + w.z * w.z))

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        s = normalize(stretched(wo, self.alpha_x, self.alpha_y))
        z = 1.0 - u1 * (1.0 + s.z)
        cap = on_circle(ops.sqrt(ops.clip(1.0 - z * z, 0.0, 1.0)), u0, z)
        return normalize(stretched(cap + s, self.alpha_x, self.alpha_y))
