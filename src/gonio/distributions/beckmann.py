"""Beckmann: the slopes of a Gaussian random surface."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction, normalize
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution, Spread
from ..formula.fields import param


class Beckmann(Distribution, oriented=True):
    """Beckmann: slopes distributed as a Gaussian.

    D = exp(-(x^2/ax^2 + y^2/ay^2)/z^2) / (pi ax ay z^4),   Lambda = (exp(-a^2)/sqrt(pi) - a erfc(a)) / (2 a),
    a = z / sqrt(ax^2 x^2 + ay^2 y^2)

    Looks    `Beckmann(0.3)` is satin metal, its highlight without a halo; `Beckmann(0.05, 0.3)` is
             brushed.
    Shapes   alpha_x, alpha_y: numbers or (..., C).
    Units    D: 1/sr; alpha: 1, sqrt(2) times the RMS slope.
    Error    rounding, of Lambda that of 1 + Lambda; sampling inverts the distribution of visible slopes to 3e-8 in u
             (median 1e-16) in float64, to 3e-7 (median 1e-8) in float32.
    Source   Beckmann & Spizzichino 1963; Walter et al. 2007, EGSR; Lambda: Heitz 2014, JCGT 3(2). Visible normals:
             the slope integral of Heitz & d'Eon 2014, CGF 33(4), inverted as in Jakob 2014, "An improved visible
             normal sampling routine for the Beckmann distribution": from a start in erf(slope), derived here, by two
             steps of Halley's.

    Example
    >>> rough = gn.Microfacet(gn.Beckmann(0.3))
    >>> print(rough.f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    [0.8842 0.6591 0.242 ]
    """

    alpha_x = param(0.2, ALPHA_LOW, ALPHA_HIGH, "slope scale along x", alias="alpha", sampled="max")
    alpha_y = param("alpha_x", ALPHA_LOW, ALPHA_HIGH, "slope scale along y", sampled="max")

    @property
    def slope_spread(self) -> Spread:
        return Spread(self.alpha_x, self.alpha_y, reach=7.0)

    def D(self, wm: Direction) -> Any:
        sx, sy, z2 = wm.x / self.alpha_x, wm.y / self.alpha_y, wm.z * wm.z
        # Divided one by one: derivatives square the divisor, which must stay representable in float32 at grazing.
        return ops.exp(-(sx * sx + sy * sy) / z2) / z2 / z2 / (math.pi * self.alpha_x * self.alpha_y)

    def _stretched(self, w: Direction) -> tuple[Any, Any, Any]:
        """x and y of w as seen by a surface of slope scale 1, and their length."""
        sx, sy = self.alpha_x * w.x, self.alpha_y * w.y
        return sx, sy, ops.sqrt(sx * sx + sy * sy + 1e-24)

    def Lambda(self, w: Direction) -> Any:
        a = w.z / self._stretched(w)[2]
        return ops.ierfc(a) / (2.0 * a)

    def projected_area(self, w: Direction) -> Any:
        r = self._stretched(w)[2]
        return w.z + 0.5 * r * ops.ierfc(w.z / r)

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        sx, sy, r = self._stretched(wo)
        x, y = _visible_slope(wo.z / r, u0), ops.erfinv(ops.maximum(2.0 * u1 - 1.0, -_LARGEST_ERF))
        pole = r < 1e-8  # where 1e-24 is not lost in r
        cos_phi, sin_phi = ops.where(pole, 1.0, sx / r), ops.where(pole, 0.0, sy / r)
        slope_x, slope_y = cos_phi * x - sin_phi * y, sin_phi * x + cos_phi * y
        return normalize(Direction(-self.alpha_x * slope_x, -self.alpha_y * slope_y, 1.0 + 0.0 * x))


def _visible_slope(cot: Any, u: Any) -> Any:
    """Slope x < cot along the view, seen at the angle of this cotangent; density of slopes: exp(-x^2)/sqrt(pi).

    Inverts  u = H(x)/H(cot),  H(x) = cot (1 + erf x) + exp(-x^2)/sqrt(pi),  H' = 2/sqrt(pi) (cot - x) exp(-x^2),
    by two steps of Halley's from a start in erf(x), which is exact at normal incidence.
    """
    rest = ops.ierfc(cot)
    goal = u * (2.0 * cot + rest)
    # erf(cot), or up to 6e-4 less: a start above the root may be beyond cot.
    top = 1.0 - rest * (2.3523 + cot * (0.35767 + 0.49665 * cot) - rest * (1.0261 + 0.46507 * cot))
    v, t = 1.0 / ops.sqrt(1.0 + cot * cot), ops.sqrt(1.0 - u)
    even, odd = (a + v * (b + v * c) for a, b, c in _START)
    share = t * (t + (1.0 - t) * v * v * (even + t * odd))
    b = ops.clip(top - (1.0 + top) * share, -_LARGEST_ERF, _LARGEST_ERF)
    x, b = ops.stop_gradient(ops.erfinv(b)), ops.stop_gradient(b)  # the steps have the derivatives of the root
    x = _halley(x, b, cot, goal)
    return ops.minimum(_halley(x, ops.erf(x), cot, goal), ops.minimum(cot, 6.0))


def _halley(x: Any, erf: Any, cot: Any, goal: Any) -> Any:
    """One step towards H(x) = goal. Its divisor is held above half of what it is at the root."""
    x = ops.minimum(x, cot - 1e-5)
    bell, w = ops.exp(-x * x) * (1.0 / math.sqrt(math.pi)), cot - x
    over, square = cot * (1.0 + erf) + bell - goal, bell * w * w
    divisor = 2.0 * square + over * (x * w + 0.5)
    return x - over * w / ops.maximum(divisor, square)


_LARGEST_ERF = 1.0 - 6e-8  # the largest float32 below 1, of x = 3.8
_START = (-0.292, 4.463, -3.211), (10.934, -22.344, 11.866)  # fitted to the root at all angles
