"""Beckmann: the slopes of a Gaussian random surface."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..formula.direction import Direction, azimuth, normalize
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution, stretched
from ..formula.fields import param


class Beckmann(Distribution):
    """Beckmann: slopes distributed as a Gaussian.

    D = exp(-(x^2/ax^2 + y^2/ay^2)/z^2) / (pi ax ay z^4),   Lambda = (erf(a) - 1)/2 + exp(-a^2)/(2 a sqrt(pi)),
    a = z / sqrt(ax^2 x^2 + ay^2 y^2)

    Looks    `Beckmann(0.3)` is satin metal, its highlight without a halo; `Beckmann(0.05, 0.3)` is
             brushed.
    Shapes   alpha_x, alpha_y: numbers or (..., C).
    Units    D: 1/sr; alpha: 1, sqrt(2) times the RMS slope.
    Error    rounding; sampling inverts the distribution of visible slopes to 1e-6 in u (median 1e-17, float64).
    Source   Beckmann & Spizzichino 1963; Walter et al. 2007, EGSR; Lambda: Heitz 2014, JCGT 3(2). Visible normals:
             the slope integral of Heitz & d'Eon 2014, CGF 33(4), inverted by safeguarded Newton steps.

    Example
    >>> rough = gn.Microfacet(gn.Beckmann(0.3))
    >>> print(rough.f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    [0.8842 0.6591 0.242 ]
    """

    oriented: ClassVar[bool] = True

    alpha_x = param(0.2, ALPHA_LOW, ALPHA_HIGH, "slope scale along x", alias="alpha", sampled="max")
    alpha_y = param("alpha_x", ALPHA_LOW, ALPHA_HIGH, "slope scale along y", sampled="max")

    def D(self, wm: Direction) -> Any:
        sx, sy, z2 = wm.x / self.alpha_x, wm.y / self.alpha_y, wm.z * wm.z
        # Divided one by one: derivatives square the divisor, which must stay representable in float32 at grazing.
        return ops.exp(-(sx * sx + sy * sy) / z2) / z2 / z2 / (math.pi * self.alpha_x * self.alpha_y)

    def Lambda(self, w: Direction) -> Any:
        sx, sy = self.alpha_x * w.x, self.alpha_y * w.y
        a = w.z / ops.sqrt(sx * sx + sy * sy + 1e-24)
        return ops.ierfc(a) / (2.0 * a)  # which is (erf(a) - 1)/2 + exp(-a^2)/(2 a sqrt(pi)), without cancellation

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        s = normalize(stretched(wo, self.alpha_x, self.alpha_y))
        sin_theta = ops.sqrt(s.x * s.x + s.y * s.y + 1e-24)
        x, y = _visible_gaussian_slope(sin_theta / s.z, u0), ops.clip(ops.erfinv(2.0 * u1 - 1.0), -6.0, 6.0)
        cos_phi, sin_phi = azimuth(s, sin_theta)
        slope_x, slope_y = cos_phi * x - sin_phi * y, sin_phi * x + cos_phi * y
        return normalize(Direction(-self.alpha_x * slope_x, -self.alpha_y * slope_y, 1.0 + 0.0 * x))


def _visible_gaussian_slope(tan_theta: Any, u: Any) -> Any:
    """Slope x along the view, seen at angle theta, of a surface with slope density exp(-x^2)/sqrt(pi).

    Inverts  u = C(x)/C(cot),  C(x) = (1 + erf x)/2 + tan(theta) exp(-x^2)/(2 sqrt(pi)),  x < cot(theta),
    in b = erf(x), where C is concave and C' = (1 - x tan)/2.
    """
    cot = ops.minimum(1.0 / ops.maximum(tan_theta, 1e-3), 6.0)
    scale = tan_theta * (0.5 / math.sqrt(math.pi))
    top = ops.erf(cot)
    goal = u * (0.5 * (1.0 + top) + scale * ops.exp(-cot * cot))
    low, high = -1.0 + 0.0 * goal, top + 0.0 * goal
    b = low + (high - low) * u
    for _ in range(_NEWTON_STEPS):
        x = ops.clip(ops.erfinv(b), -6.0, cot)
        over = 0.5 * (1.0 + b) + scale * ops.exp(-x * x) - goal
        low, high = ops.where(over < 0.0, b, low), ops.where(over < 0.0, high, b)
        newton = b - over / ops.maximum(0.5 * (1.0 - x * tan_theta), 1e-7)
        b = ops.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
    # The libraries' inverse error functions differ in their last digits; one step in x itself removes that.
    x = ops.clip(ops.erfinv(b), -6.0, cot)
    bell = ops.exp(-x * x)
    over = 0.5 * (1.0 + ops.erf(x)) + scale * bell - goal
    slope = (1.0 - x * tan_theta) * bell * (1.0 / math.sqrt(math.pi))
    steady = slope > 1e-5
    return ops.clip(x - ops.where(steady, over / ops.where(steady, slope, 1.0), 0.0), -6.0, cot)


_NEWTON_STEPS = 9
