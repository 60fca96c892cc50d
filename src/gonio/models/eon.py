"""EON: Oren and Nayar's surface in the form that conserves energy, and Fujii's, on which it rests."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.fields import param
from ._rough_diffuse import _RoughDiffuse

C1 = 0.5 - 2.0 / (3.0 * math.pi)
C2 = 2.0 / 3.0 - 28.0 / (15.0 * math.pi)


class _Fujii(_RoughDiffuse):
    """Fujii's single scattering, and the albedo that it lacks."""

    rho = param(0.5, 0.0, 1.0, "albedo of a facet")
    r = param(0.5, 0.0, 1.0, "how rough: 0 is Lambertian, 1 the roughest", sampled="max")

    @property
    def back(self) -> Any:
        return self.r

    @property
    def A(self) -> Any:
        return 1.0 / (1.0 + C1 * self.r)

    def once(self, wi: Direction, wo: Direction) -> Any:
        """1 + r s/t, s = sin(theta_i) sin(theta_o) cos(phi_i - phi_o), t = max(z_i, z_o) where s > 0, else 1."""
        s = wi.x * wo.x + wi.y * wo.y
        # 1 + s as a sum of squares: exact where light and viewer graze on opposite sides.
        x, y = wi.x + wo.x, wi.y + wo.y
        rest = 0.5 * (x * x + y * y + wi.z * wi.z + wo.z * wo.z)
        behind = (1.0 - self.r) + self.r * rest
        return ops.where(s > 0.0, 1.0 + self.r * s / ops.maximum(wi.z, wo.z), behind)

    def estimate(self, wo: Direction) -> Any:
        return self.rho + 0.0 * wo.z


def lacking(w: Direction) -> Any:
    """(1 - E)/(r A), where E is the albedo of Fujii's model for rho = 1: 0 at grazing.

    E = A (1 + r G/pi),   G = s (theta - s z) + 2/3 (s/z (1 - s^3) - s),   s = sin(theta)
    """
    s = ops.sqrt(w.x * w.x + w.y * w.y + 1e-20)
    elevation = ops.arctan2(w.z, s)
    whole = (0.5 * math.pi - 2.0 / 3.0) * w.z * w.z / (1.0 + s)
    return (whole + s * elevation + s * w.z * (s - 2.0 / 3.0 * (1.0 + s + s * s) / (1.0 + s))) * (1.0 / math.pi)


class FujiiOrenNayar(_Fujii):
    """Rough diffuse surface, Fujii's form of Oren and Nayar's: f = rho/pi (1 + r s/t)/(1 + (1/2 - 2/(3 pi)) r).

    s = sin(theta_i) sin(theta_o) cos(phi_i - phi_o),   t = max(cos(theta_i), cos(theta_o)) where s > 0, else 1

    Looks    `FujiiOrenNayar(0.5, 1)` is clay: seen with the light brighter at the rim than in the middle;
             `FujiiOrenNayar(0.5, 0)` is Lambertian.
    Shapes   rho, r: numbers or (..., C).
    Units    f: 1/sr; rho: 1, the albedo of a facet; r: 1, no angle: Fujii's sigma'.
    Error    rounding: 3e-7 relative in float32. Light that is reflected twice is left out: for rho = r = 1 the albedo
             is 0.78 at normal incidence, and rises to 1 at grazing; `EON` puts it back.
    Source   Fujii, "A tiny improvement of Oren-Nayar reflectance model"; Portsmouth, Kutz & Hill 2025, JCGT 14(1).
             Sampling derived here.

    Example
    >>> clay = gn.FujiiOrenNayar(0.5, r=1.0)
    >>> print((np.pi * clay.f_angles([0.0, 1.2], 0.0, [0.0, 1.2], 0.0)).round(3))
    [0.388 1.319]
    """

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.rho * (1.0 / math.pi) * self.A * self.once(wi, wo)


class EON(_Fujii):
    """Rough diffuse surface that conserves energy: `FujiiOrenNayar`, and its loss, given back evenly.

    f = rho/pi A (1 + r s/t) + rho_ms/pi (1 - E(theta_i)) (1 - E(theta_o))/(1 - <E>),
    rho_ms = rho^2 <E>/(1 - rho (1 - <E>)),   A = 1/(1 + (1/2 - 2/(3 pi)) r)

    E and <E> are the exact albedo of the first term for rho = 1, and its hemispherical average: for rho = 1 all light
    returns.

    Looks    `EON(0.9, 1)` is chalk: seen with the light flat as the full moon, and as bright as a rough
             surface should be; `EON(0.5, 0)` is Lambertian.
    Shapes   rho, r: numbers or (..., C).
    Units    f: 1/sr; rho: 1, the albedo of a facet; r: 1, no angle.
    Error    rounding: 3e-7 relative in float32.
    Source   Portsmouth, Kutz & Hill 2025, "EON: a practical energy-preserving rough diffuse BRDF", JCGT 14(1), with the
             analytic albedo. Sampling derived here.

    Example
    >>> clay = gn.EON(1.0, r=1.0)
    >>> print((np.pi * clay.f_angles([0.0, 1.2], 0.0, [0.0, 1.2], 0.0)).round(3))
    [1.075 2.695]
    >>> print(gn.albedo(clay, gn.direction(1.2, 0.0)).round(3))
    1.0
    """

    def formula(self, wi: Direction, wo: Direction) -> Any:
        once = self.rho * self.once(wi, wo)
        average = self.A * (1.0 + C2 * self.r)
        # The factors r A that both albedos lack are taken out: r = 0 has no 0/0.
        again = self.rho * self.rho * average / (1.0 - self.rho * (1.0 - average))
        more = again * self.r / (C1 - C2) * lacking(wi) * lacking(wo)
        return self.A * (1.0 / math.pi) * (once + more)
