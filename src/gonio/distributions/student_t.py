"""Student's t: slopes with tails of any length, from those of GGX and beyond to Beckmann's."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution, Spread, facing_density, facing_slopes
from ..formula.fields import param
from ..formula.smith import cotangent, gauss
from ..formula.special import expm1_over, gamma_ratio, log1p


class StudentT(Distribution, oriented=True):
    """Student's t-distribution of slopes (STD): D = (1 + s^2/(gamma - 1))^(-gamma) / (pi ax ay z^4).

    s^2 = (x^2/ax^2 + y^2/ay^2)/z^2. gamma = 2 is GGX, gamma to infinity Beckmann; at gamma = 3/2 the mean slope, and
    with it Lambda, becomes infinite.

    Looks    `StudentT(0.1, gamma=1.6)` is polished metal in a haze; `StudentT(0.1, gamma=50)` has none, as
             Beckmann.
    Shapes   alpha_x, alpha_y, gamma: numbers or (..., C).
    Units    D: 1/sr; alpha: 1, the slope scale of both limits; gamma: 1.
    Error    D: rounding. Lambda, by a 16-point rule: G1 relative 1e-6. Normals are drawn with the density D cos,
             of two that are opposite as they are seen.
    Source   Ribardière et al. 2017, CGF 36(2):421, in slopes; Lambda there is a fitted approximation, here an
             integral. gamma = 2: Walter et al. 2007, EGSR.

    Example
    >>> for gamma in (2.0, 10.0):  # 2 is GGX, infinity Beckmann
    ...     print(gn.Microfacet(gn.StudentT(0.3, gamma=gamma)).f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    ...
    [0.8842 0.4885 0.1932]
    [0.8842 0.6343 0.2401]
    """

    alpha_x = param(0.2, ALPHA_LOW, ALPHA_HIGH, "slope scale along x", alias="alpha", sampled="max")
    alpha_y = param("alpha_x", ALPHA_LOW, ALPHA_HIGH, "slope scale along y", sampled="max")
    gamma = param(2.5, 1.55, 1e3, "shape: the smaller, the longer the tails", sampled="min")

    @property
    def slope_spread(self) -> Spread:
        return Spread(self.alpha_x, self.alpha_y)

    def D(self, wm: Direction) -> Any:
        sx, sy, z2 = wm.x / self.alpha_x, wm.y / self.alpha_y, wm.z * wm.z
        s2 = (sx * sx + sy * sy) / z2 / (self.gamma - 1.0)
        root = ops.exp(-0.5 * self.gamma * log1p(s2)) / z2  # squared last: its square may be too small for float32
        return root * (root / (math.pi * self.alpha_x * self.alpha_y))

    def Lambda(self, w: Direction) -> Any:
        return student_lambda(cotangent(w, self.alpha_x, self.alpha_y), self.gamma - 1.0)

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        k = self.gamma - 1.0
        e = -ops.log(1.0 - u1)  # the fraction of facets steeper than r is (1 + r^2/k)^(-k)
        return facing_slopes(wo, ops.sqrt(e * expm1_over(e / k) + 1e-30), u0, self.alpha_x, self.alpha_y)

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        return self.D(wm) * wm.z * facing_density(wo, wm, cos_d)


def student_lambda(a: Any, k: Any) -> Any:
    """Lambda at cot(theta) = a of the slopes of which a fraction S(q) = (1 + q/k)^(-k) has a square above q; k > 1/2.

    Lambda = (1/a) E[max(slope, 0)] (1 + a^2/k)^(1/2 - k) - P(slope > a), for the slope along w. The first part is
    in closed form, and P(slope > a) = (1/pi) integral of S(a^2/sin^2(t)) over [0, pi/2].
    """
    mean = ops.sqrt(k) / (gamma_ratio(k - 0.5) * (2.0 * math.sqrt(math.pi)))
    b2 = a * a / k
    beyond: Any = 0.0
    for sin2, weight in _ANGLES:
        beyond = beyond + weight * ops.exp(-k * log1p(b2 / sin2))
    return mean / a * ops.exp((0.5 - k) * log1p(b2)) - beyond


def _angles(count: int, width: float) -> list[tuple[float, float]]:
    """sin^2(t) and weight/pi of a rule on [0, pi/2] that is denser towards 0, where S(a^2/sin^2) rises for small a."""
    span = math.asinh(0.5 * math.pi / width)
    angles = []
    for u, w in gauss(count):
        v = span * u**1.5
        angles.append((math.sin(width * math.sinh(v)) ** 2, 1.5 * w * u**0.5 * span * width * math.cosh(v) / math.pi))
    return angles


_ANGLES = _angles(16, 0.1)
