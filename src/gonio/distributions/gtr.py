"""GTR: Trowbridge and Reitz's distribution with a free exponent."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution, facing, facing_density
from ..formula.fields import param
from ..formula.smith import Nodes, cotangent, sinh_nodes, smith_of_angles
from ..formula.special import expm1_over, log1p_over


class GTR(Distribution):
    """Generalized Trowbridge-Reitz: D = c / (alpha^2 cos^2(theta_m) + sin^2(theta_m))^gamma.

    gamma = 2 is GGX, gamma = 1 Berry's distribution, larger gamma has shorter tails. c makes the integral of D cos 1:
    1/c = pi/(1 - alpha^2) times the integral of v^(-gamma) over [alpha^2, 1], at gamma = 1 log(1/alpha^2).

    Looks    `GTR(0.1, 1)` is a clear coat: a small highlight in a haze that reaches everywhere; `GTR(0.1,
             4)` is a clean one.
    Shapes   alpha, gamma: numbers or (..., C).
    Units    D: 1/sr; alpha, gamma: 1.
    Error    D: rounding, also at and beside gamma = 1 and alpha = 1. Lambda, by a 24-point rule: G1 relative 1e-6.
    Source   Burley 2012, "Physically-based shading at Disney", appendix B; gamma = 1: Berry 1923, as named there.
             Normals are drawn with the density D cos, as there, but of two that are opposite as they are seen. Lambda:
             Smith's integral (`gonio.formula.smith.smith`).

    Example
    >>> for gamma in (1.5, 2.0):  # 2 is GGX
    ...     print(gn.Microfacet(gn.GTR(0.3, gamma)).f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    ...
    [0.5747 0.3738 0.1952]
    [0.8842 0.4885 0.1932]
    """

    alpha = param(0.2, ALPHA_LOW, ALPHA_HIGH, "width of the lobe", sampled="max")
    gamma = param(2.0, 0.5, 10.0, "exponent: the smaller, the longer the tails", sampled="min")

    # With L(v) = -log v, k = gamma - 1 and g(x) = (1 - exp(-x))/x, the integral of v^(-gamma) from alpha^2 to v is
    # alpha^(-2k) m g(k m), m = log(v/alpha^2): without cancellation at k = 0. At alpha = 1 m and 1 - alpha^2 vanish.

    def _log_ratio(self) -> Any:
        """log(1/alpha^2)/(1 - alpha^2)."""
        gap = (1.0 - self.alpha) * (1.0 + self.alpha)
        near = gap < 0.5
        far = ops.where(near, 0.5, gap)
        return ops.where(near, log1p_over(-ops.where(near, gap, 0.0)), -2.0 * ops.log(self.alpha) / far)

    def _norm(self) -> Any:
        """The integral of (v/alpha^2)^(-gamma) dv/alpha^2 over [alpha^2, 1], over 1 - alpha^2."""
        return self._log_ratio() * expm1_over((self.gamma - 1.0) * 2.0 * ops.log(self.alpha))

    def D(self, wm: Direction) -> Any:
        x, y = wm.x / self.alpha, wm.y / self.alpha
        rho = wm.z * wm.z + x * x + y * y
        return ops.exp(-self.gamma * ops.log(rho)) / (math.pi * self.alpha * self.alpha * self._norm())

    def Lambda(self, w: Direction) -> Any:
        a2 = self.alpha * self.alpha
        scale = 1.0 / (math.pi * a2 * self._norm())

        def p(q: Any) -> Any:
            c2 = 1.0 / (1.0 + q)
            return scale * c2 * c2 * ops.exp(-self.gamma * ops.log((1.0 + q / a2) * c2))

        return smith_of_angles(p, cotangent(w), power_law_nodes(ops.log(self.alpha), self.gamma))

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        k, share = self.gamma - 1.0, u1 * self._norm()  # m g(k m) = h = share (1 - alpha^2)
        h = share * (1.0 - self.alpha) * (1.0 + self.alpha)
        log_over = log1p_over(ops.maximum(-k * h, -1.0 + 1e-7))
        sin2 = ops.minimum(self.alpha * self.alpha * share * log_over * expm1_over(h * log_over), 1.0)
        return facing(wo, ops.sqrt(sin2 + 1e-30), u0, ops.sqrt(1.0 - sin2))

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        return self.D(wm) * wm.z * facing_density(wo, wm, cos_d)


def power_law_nodes(log_alpha: Any, gamma: Any) -> Nodes:
    """Angles where D theta^2 is: about alpha for short tails (a large gamma), anywhere for long ones."""
    width = ops.exp(ops.minimum(gamma - 0.5, 1.0) * log_alpha) / ops.sqrt(ops.maximum(gamma - 1.0, 0.5))
    reach = 1.5 * ops.exp(ops.minimum(17.0 / ops.maximum(2.0 * gamma - 3.0, 0.5) + log_alpha, 1.0))
    return sinh_nodes(24, width, ops.minimum(reach, 0.5 * math.pi))
