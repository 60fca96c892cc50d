"""Facets with Gaussian polar angles, as Torrance and Sparrow have them."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction, polar_angle
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution, facing, facing_density
from ..formula.fields import param
from ..formula.smith import cotangent, gauss, smith_of_angles


class GaussianFacets(Distribution):
    """Facets whose polar angle is distributed as a Gaussian: D = exp(-(theta_m/alpha)^2) / N(alpha).

    N = pi times the integral of exp(-(t/alpha)^2) sin(2t) over [0, pi/2], so that the facets' projected areas add up
    to the surface's area. Torrance and Sparrow's c is 1/alpha.

    Looks    `GaussianFacets(0.5)` is dull metal, bright at the rim; `GaussianFacets(0.1)` is polished.
    Shapes   alpha: a number or (..., C).
    Units    D: 1/sr; alpha: rad.
    Error    N by 20-point Gauss–Legendre: relative 2e-12. Lambda, by a 16-point rule: G1 relative 1e-6.
    Source   Torrance & Sparrow 1967, J. Opt. Soc. Am. 57(9):1105, who leave N as a free constant b. Lambda: Smith's
             integral (`gonio.formula.smith.smith`); they use V-grooves, masking="v_groove".

    Example
    >>> rough = gn.Microfacet(gn.GaussianFacets(0.3))
    >>> print(rough.f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    [0.9385 0.6533 0.2277]
    """

    alpha = param(0.2, ALPHA_LOW, ALPHA_HIGH, "angular width of the facets (1/c)", unit="rad", sampled="max")

    def _norm(self) -> Any:
        end = ops.minimum(6.5 * self.alpha, 0.5 * math.pi)
        total: Any = 0.0
        for t, w in gauss(20):
            s = end * t / self.alpha
            total = total + w * ops.exp(-s * s) * ops.sin(2.0 * end * t)
        return math.pi * end * total

    def D(self, wm: Direction) -> Any:
        s = polar_angle(wm) / self.alpha
        return ops.exp(-s * s) / self._norm()

    def Lambda(self, w: Direction) -> Any:
        scale = 1.0 / self._norm()

        def p(q: Any) -> Any:
            s, c2 = ops.arctan2(ops.sqrt(q), 1.0) / self.alpha, 1.0 / (1.0 + q)
            return scale * c2 * c2 * ops.exp(-s * s)

        reach = ops.minimum(4.2 * self.alpha, 0.5 * math.pi)
        nodes = [(reach * t**1.5, 1.5 * reach * weight * t**0.5) for t, weight in gauss(16)]
        return smith_of_angles(p, cotangent(w), nodes)

    # Tilts are drawn with density ~ exp(-(theta/alpha)^2) theta dtheta, which has an inverse, and differs
    # from D cos(theta) by the bounded factor sin(2 theta)/(2 theta).

    def _tail(self) -> Any:
        end = 0.5 * math.pi / self.alpha
        return 1.0 - ops.exp(-end * end)

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        theta = self.alpha * ops.sqrt(-ops.log(1.0 - u1 * self._tail()) + 1e-24)
        return facing(wo, ops.sin(theta), u0, ops.cos(theta))

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        theta = polar_angle(wm)
        s = theta / self.alpha
        flat = theta < 1e-4
        ratio = ops.where(flat, 1.0, theta / ops.sin(ops.where(flat, 1.0, theta)))
        density = ratio * ops.exp(-s * s) / (math.pi * self.alpha * self.alpha * self._tail())
        return density * facing_density(wo, wm, cos_d)
