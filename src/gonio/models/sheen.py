"""Sheen: light that the fibres of a cloth add towards grazing."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, half_vector
from ..formula.fields import param
from ..formula.warp import power_positive


class CharlieSheen(Reflectance):
    """Microfacets whose normals lie near the horizon, as fibres have them: f = rho D G / (4 cos(theta_i) cos(theta_o)).

    D = (2 + 1/r) sin(theta_m)^(1/r)/(2 pi),  G = 1/(1 + Lambda_i + Lambda_o),  Lambda = exp(L(cos theta)) below
    cos theta = 1/2 and exp(2 L(1/2) - L(1 - cos theta)) above,  L(x) = a/(1 + b x^c) + d x + e.
    The paper's softening of the terminator, a power of Lambda for the light alone, is left out: it is not reciprocal.

    Looks    `CharlieSheen(0.5, 0.2)` is velvet: black in the middle, bright at the rim; `CharlieSheen(0.5, 1)` has a
             softer, wider rim.
    Shapes   rho, r: numbers or (..., C).
    Units    f: 1/sr; r, rho: 1. r is the paper's; glTF's sheen roughness is its square root.
    Error    Lambda is the paper's fit to the Smith function of D; here rounding, 2e-6 relative in float32.
    Source   Estevez & Kulla 2017, "Production friendly microfacet sheen BRDF", with the five numbers of their table
             interpolated by (1 - r)^2.

    Example
    >>> velvet = gn.CharlieSheen(0.5, r=0.2)
    >>> print(velvet.f_angles(0.3, 0.0, [0.0, 1.4], np.pi).round(4))
    [0.     0.0046]
    """

    rho = param(0.5, 0.0, 1.0, "reflectance of the fibres")
    r = param(0.3, 0.1, 1.0, "how far from the horizon the normals spread")

    def _smooth(self) -> Any:
        return (1.0 - self.r) * (1.0 - self.r)

    def _exponent(self, x: Any) -> Any:
        """L(x) - a/2 - e: a small number where Lambda matters, so that little is lost by rounding it."""
        a, b, c, d, _ = (rough + self._smooth() * (smooth - rough) for rough, smooth in _TABLE)
        t = b * ops.power(x, c)
        return a * (1.0 - t) / (2.0 + 2.0 * t) + d * x

    def _lambda(self, w: Direction) -> Any:
        low = w.z < 0.5
        opposite = (w.x * w.x + w.y * w.y) / (1.0 + w.z)  # 1 - cos, without cancellation
        exponent = self._exponent(ops.where(low, w.z, ops.maximum(opposite, 1e-10)))
        rough, smooth = (0.5 * a + e for a, e in zip(_TABLE[0], _TABLE[4], strict=True))
        factor = math.exp(rough) * ops.exp((smooth - rough) * self._smooth())
        return factor * ops.exp(ops.where(low, exponent, 2.0 * self._exponent(0.5 + 0.0 * w.z) - exponent))

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wm = half_vector(wi, wo)
        sin2 = ops.where(wm.z < 0.5, 1.0 - wm.z * wm.z, wm.x * wm.x + wm.y * wm.y)
        D = (2.0 + 1.0 / self.r) * (0.5 / math.pi) * power_positive(sin2, 0.5 / self.r)
        return self.rho * D / (4.0 * wi.z * wo.z * (1.0 + self._lambda(wi) + self._lambda(wo)))

    def estimate(self, wo: Direction) -> Any:
        m = 1.0 - wo.z
        return self.rho * (0.1 + 0.6 * m * m * m)


# a to e at r = 1 and at r = 0.
_TABLE = ((21.5473, 25.3245), (3.82987, 3.32435), (0.19823, 0.16801), (-1.97760, -1.27393), (-4.32054, -4.85967))


class AshikhminVelvet(Reflectance):
    """Velvet: normals that avoid the pole, over a denominator that needs no masking.

    f = rho D / (4 (cos(theta_i) + cos(theta_o) - cos(theta_i) cos(theta_o))),
    D = (1 + 4 exp(-cot(theta_m)^2/alpha^2)/sin(theta_m)^4) / (pi (1 + 4 alpha^2))

    Looks    `AshikhminVelvet(0.5, 1)` is velvet: dark in the middle, bright at the rim; `AshikhminVelvet(0.5, 0.1)` is
             flat, but for the very rim.
    Shapes   rho, alpha: numbers or (..., C).
    Units    f: 1/sr; rho, alpha: 1.
    Error    rounding.
    Source   Ashikhmin, Premože & Shirley 2000, "A microfacet-based BRDF generator" (the inverted Gaussian); normalized
             and with this denominator: Neubelt & Pettineo 2013, "Crafting a next-gen material pipeline for The Order:
             1886".

    Example
    >>> velvet = gn.AshikhminVelvet(0.5, alpha=1.0)
    >>> print(velvet.f_angles(0.3, 0.0, [0.0, 1.4], np.pi).round(4))
    [0.008  0.0392]
    """

    rho = param(0.5, 0.0, 1.0, "reflectance of the fibres")
    alpha = param(0.3, 0.01, 1.0, "width of the Gaussian: how far from the horizon the normals spread")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wm = half_vector(wi, wo)
        s2 = ops.maximum(wm.x * wm.x + wm.y * wm.y, 1e-3)  # where nothing is left of the Gaussian
        a2 = self.alpha * self.alpha
        D = (1.0 + 4.0 * ops.exp(-wm.z * wm.z / (s2 * a2)) / (s2 * s2)) / (math.pi * (1.0 + 4.0 * a2))
        return self.rho * D / (4.0 * (wi.z + wo.z - wi.z * wo.z))

    def estimate(self, wo: Direction) -> Any:
        m = 1.0 - wo.z
        return self.rho * (0.2 + 0.6 * m * m * m)
