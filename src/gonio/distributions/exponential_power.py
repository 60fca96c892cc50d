"""Exponential power: slopes whose distribution is anything from a peak with long tails to a flat disc."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution, facing_density, facing_slopes
from ..formula.fields import param
from ..formula.smith import cotangent, sinh_nodes, smith
from ..formula.special import log_gamma


class ExponentialPower(Distribution, oriented=True):
    """Exponential power distribution of slopes (EPD): D = p exp(-s^(2p)) / (pi ax ay Gamma(1/p) z^4).

    s^2 = (x^2/ax^2 + y^2/ay^2)/z^2. p = 1 is Beckmann; p below 1 has a sharper peak and longer tails.

    Looks    `ExponentialPower(0.3, p=0.4)` is metal with a small bright spot in a haze;
             `ExponentialPower(0.3, p=4)` has a flat disc for a highlight.
    Shapes   alpha_x, alpha_y, p: numbers or (..., C).
    Units    D: 1/sr; alpha, p: 1.
    Error    D: rounding. Lambda, by a 22-point rule: G1 relative 1e-6. Normals are drawn with a density close to
             D cos, of two that are opposite as they are seen: weights stay below 4 times those of exact inversion.
    Source   Holzschuch & Pacanowski 2017, ACM TOG 36(4):66 (their beta is alpha); after Brady et al. 2014, ACM TOG
             33(4):114. Lambda: Smith's integral (`gonio.formula.smith.smith`). Sampling derived here.

    Example
    >>> for p in (0.6, 1.0):  # 1 is Beckmann
    ...     print(gn.Microfacet(gn.ExponentialPower(0.3, p=p)).f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    ...
    [0.5877 0.3703 0.2586]
    [0.8842 0.6591 0.242 ]
    """

    alpha_x = param(0.2, ALPHA_LOW, ALPHA_HIGH, "slope scale along x", alias="alpha", sampled="max")
    alpha_y = param("alpha_x", ALPHA_LOW, ALPHA_HIGH, "slope scale along y", sampled="max")
    p = param(1.0, 0.25, 4.0, "shape: the smaller, the sharper the peak and the longer the tails", sampled="min")

    def _height(self) -> Any:
        return self.p * ops.exp(-log_gamma(1.0 / self.p)) * (1.0 / math.pi)

    def _fall(self, q: Any) -> Any:
        return ops.exp(-ops.exp(ops.minimum(self.p * ops.log(q), 6.7)))  # 0 from there on

    def D(self, wm: Direction) -> Any:
        q, z2 = self._squared_slope(wm), wm.z * wm.z
        some = q > 1e-28  # beside 0 the slope of q^p is infinite for p < 1
        fall = ops.where(some, self._fall(ops.where(some, q, 1.0)), 1.0)
        return self._height() * fall / z2 / z2 / (self.alpha_x * self.alpha_y)

    def _squared_slope(self, wm: Direction) -> Any:
        sx, sy = wm.x / self.alpha_x, wm.y / self.alpha_y
        return (sx * sx + sy * sy) / (wm.z * wm.z)

    def Lambda(self, w: Direction) -> Any:
        height, reach = self._height(), ops.exp(0.5 / self.p * ops.log(16.0 + 4.0 / self.p))

        def slopes(q: Any) -> Any:
            return height * self._fall(q)

        return smith(slopes, cotangent(w, self.alpha_x, self.alpha_y), sinh_nodes(22, 1.0, reach))

    # Drawn is q = s^2 with the survival function exp(-rate ((1 + q)^power - 1)), which has an inverse, the same tail
    # up to its rate, and at p = 1 is exact.

    def _proposal(self) -> tuple[Any, Any]:
        heavy = self.p < 1.0
        return ops.where(heavy, 0.5 * (1.0 + self.p), 2.4 - 1.4 / self.p), ops.minimum(self.p, 1.0)

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        rate, power = self._proposal()
        q = ops.power(1.0 - ops.log(1.0 - u1) / rate, 1.0 / power) - 1.0
        return facing_slopes(wo, ops.sqrt(q + 1e-30), u0, self.alpha_x, self.alpha_y)

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        rate, power = self._proposal()
        log_q = ops.log(1.0 + self._squared_slope(wm))
        fall = ops.exp((power - 1.0) * log_q - rate * (ops.exp(power * log_q) - 1.0))
        density = rate * power * fall / (math.pi * self.alpha_x * self.alpha_y) / wm.z / wm.z / wm.z
        return density * facing_density(wo, wm, cos_d)
