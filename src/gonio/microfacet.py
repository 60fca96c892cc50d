"""Microfacet surfaces in pieces: distributions of normals (D, Lambda, visible-normal sampling) and maskings (G).

Every model with facets is D F G / (4 cos cos) with these pieces. `alpha` is the slope scale of the surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from . import ops
from .errors import ParameterError
from .geometry import Direction, azimuth, dot, normalize, polar_angle
from .param import param
from .parametrised import Parametrised

ALPHA_LOW, ALPHA_HIGH = 1e-3, 1.0


class Distribution(Parametrised):
    """Base of the distributions of facet normals, normalised to one: integral of D(wm) cos(theta_m) dwm = 1."""

    def D(self, wm: Direction) -> Any:
        """Area of facets per solid angle of their normals and per area of the surface [1/sr]."""
        raise NotImplementedError

    def Lambda(self, w: Direction) -> Any:
        """Smith's auxiliary function of this distribution: G1 = 1/(1 + Lambda)."""
        raise NotImplementedError

    has_lambda = True

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        """A facet normal for two uniform numbers; its density is `normal_density`."""
        raise NotImplementedError

    def normal_density(self, wo: Direction, wm: Direction) -> Any:
        """Density [1/sr] of `warp_normal`: of the normals visible from wo, D_v = G1 D (wo . wm)/cos(theta_o)."""
        return self.D(wm) * dot(wo, wm) / ((1.0 + self.Lambda(wo)) * wo.z)


def _stretched(w: Direction, ax: Any, ay: Any) -> Direction:
    return Direction(ax * w.x, ay * w.y, w.z)


class GGX(Distribution):
    """Trowbridge–Reitz (GGX): facets oriented as on a half ellipsoid.

    D = 1 / (pi ax ay (x^2/ax^2 + y^2/ay^2 + z^2)^2),   Lambda = (sqrt(1 + (ax^2 x^2 + ay^2 y^2)/z^2) - 1)/2

    Shapes   alpha_x, alpha_y: numbers or (..., C).
    Units    D: 1/sr; alpha: 1. `GGX(0.3)` is isotropic, `GGX(0.1, 0.4)` is rougher along y.
    Error    rounding.
    Source   Trowbridge & Reitz 1975, J. Opt. Soc. Am. 65(5):531; Walter et al. 2007, EGSR. Lambda: Heitz 2014,
             JCGT 3(2). Visible normals: Dupuy & Benyoub 2023, "Sampling visible GGX normals with spherical caps".
    """

    alpha_x = param(0.2, ALPHA_LOW, ALPHA_HIGH, "slope scale along x", alias="alpha", sampled="max")
    alpha_y = param("alpha_x", ALPHA_LOW, ALPHA_HIGH, "slope scale along y", sampled="max")

    def D(self, wm: Direction) -> Any:
        sx, sy = wm.x / self.alpha_x, wm.y / self.alpha_y
        s = sx * sx + sy * sy + wm.z * wm.z
        return 1.0 / (math.pi * self.alpha_x * self.alpha_y * s * s)

    def Lambda(self, w: Direction) -> Any:
        sx, sy = self.alpha_x * w.x, self.alpha_y * w.y
        s2 = sx * sx + sy * sy
        return 0.5 * s2 / (w.z * (ops.sqrt(w.z * w.z + s2) + w.z))  # (sqrt(1 + s2/z^2) - 1)/2 without cancellation

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        s = normalize(_stretched(wo, self.alpha_x, self.alpha_y))
        phi = 2.0 * math.pi * u0
        z = 1.0 - u1 * (1.0 + s.z)
        r = ops.sqrt(ops.clip(1.0 - z * z, 0.0, 1.0))
        h = Direction(r * ops.cos(phi) + s.x, r * ops.sin(phi) + s.y, z + s.z)
        return normalize(_stretched(h, self.alpha_x, self.alpha_y))


class Beckmann(Distribution):
    """Beckmann: slopes distributed as a Gaussian.

    D = exp(-(x^2/ax^2 + y^2/ay^2)/z^2) / (pi ax ay z^4),   Lambda = (erf(a) - 1)/2 + exp(-a^2)/(2 a sqrt(pi)),
    a = z / sqrt(ax^2 x^2 + ay^2 y^2)

    Shapes   alpha_x, alpha_y: numbers or (..., C).
    Units    D: 1/sr; alpha: 1, sqrt(2) times the RMS slope.
    Error    rounding; sampling inverts the distribution of visible slopes to 1e-6 in u (median 1e-17, float64).
    Source   Beckmann & Spizzichino 1963; Walter et al. 2007, EGSR; Lambda: Heitz 2014, JCGT 3(2). Visible normals:
             the slope integral of Heitz & d'Eon 2014, CGF 33(4), inverted by safeguarded Newton steps.
    """

    alpha_x = param(0.2, ALPHA_LOW, ALPHA_HIGH, "slope scale along x", alias="alpha", sampled="max")
    alpha_y = param("alpha_x", ALPHA_LOW, ALPHA_HIGH, "slope scale along y", sampled="max")

    def D(self, wm: Direction) -> Any:
        sx, sy, z2 = wm.x / self.alpha_x, wm.y / self.alpha_y, wm.z * wm.z
        # Divided one by one: derivatives square the divisor, which must stay representable in float32 at grazing.
        return ops.exp(-(sx * sx + sy * sy) / z2) / z2 / z2 / (math.pi * self.alpha_x * self.alpha_y)

    def Lambda(self, w: Direction) -> Any:
        sx, sy = self.alpha_x * w.x, self.alpha_y * w.y
        a = w.z / ops.sqrt(sx * sx + sy * sy + 1e-24)
        a = ops.minimum(a, 10.0)  # Lambda(10) = 2e-46: nothing is left, and exp(-a^2) stays representable
        return 0.5 * (ops.erf(a) - 1.0) + ops.exp(-a * a) / (a * (2.0 * math.sqrt(math.pi)))

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        s = normalize(_stretched(wo, self.alpha_x, self.alpha_y))
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


class GaussianFacets(Distribution):
    """Facets whose polar angle is distributed as a Gaussian: D = exp(-(theta_m/alpha)^2) / N(alpha).

    N = pi times the integral of exp(-(t/alpha)^2) sin(2t) over [0, pi/2], so that the facets' projected areas add up
    to the surface's area. Torrance and Sparrow's c is 1/alpha.

    Shapes   alpha: a number or (..., C).
    Units    D: 1/sr; alpha: rad.
    Error    N by 20-point Gauss–Legendre: relative 2e-12.
    Source   Torrance & Sparrow 1967, J. Opt. Soc. Am. 57(9):1105, who leave N as a free constant b.
    """

    alpha = param(0.2, ALPHA_LOW, ALPHA_HIGH, "angular width of the facets (1/c)", unit="rad", sampled="max")

    has_lambda = False  # no closed form: use it with masking="v_groove"

    def _norm(self) -> Any:
        end = ops.minimum(6.5 * self.alpha, 0.5 * math.pi)
        total: Any = 0.0
        for t, w in _GAUSS_NODES:
            s = end * t / self.alpha
            total = total + w * ops.exp(-s * s) * ops.sin(2.0 * end * t)
        return math.pi * end * total

    def D(self, wm: Direction) -> Any:
        s = polar_angle(wm) / self.alpha
        return ops.exp(-s * s) / self._norm()

    # Normals are drawn with density ~ exp(-(theta/alpha)^2) theta dtheta dphi, which has an inverse, and differs
    # from D cos(theta) by the bounded factor sin(2 theta)/(2 theta).

    def _tail(self) -> Any:
        end = 0.5 * math.pi / self.alpha
        return 1.0 - ops.exp(-end * end)

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        phi = 2.0 * math.pi * u0
        theta = self.alpha * ops.sqrt(-ops.log(1.0 - u1 * self._tail()) + 1e-24)
        s = ops.sin(theta)
        return Direction(s * ops.cos(phi), s * ops.sin(phi), ops.cos(theta))

    def normal_density(self, wo: Direction, wm: Direction) -> Any:
        theta = polar_angle(wm)
        s = theta / self.alpha
        flat = theta < 1e-4
        ratio = ops.where(flat, 1.0, theta / ops.sin(ops.where(flat, 1.0, theta)))
        return ratio * ops.exp(-s * s) / (math.pi * self.alpha * self.alpha * self._tail())


_GAUSS_NODES = [
    (0.5 * (float(t) + 1.0), 0.5 * float(w)) for t, w in zip(*np.polynomial.legendre.leggauss(20), strict=True)
]


# Maskings: the fraction of facets wm that is both lit from wi and seen from wo.


def height_correlated(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, heights correlated: G = 1/(1 + Lambda_i + Lambda_o). Source: Heitz 2014, JCGT 3(2), section 6."""
    return 1.0 / (1.0 + d.Lambda(wi) + d.Lambda(wo))


def separable(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, masking and shadowing independent: G = 1/((1 + Lambda_i)(1 + Lambda_o)). Source: Walter et al. 2007."""
    return 1.0 / ((1.0 + d.Lambda(wi)) * (1.0 + d.Lambda(wo)))


def v_groove(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """V-shaped grooves: G = min(1, 2 z_m z_o/(wo . wm), 2 z_m z_i/(wo . wm)).

    Source: Torrance & Sparrow 1967; in this form Blinn 1977, "Models of light reflection".
    """
    return ops.minimum(1.0, 2.0 * wm.z * ops.minimum(wi.z, wo.z) / dot(wo, wm))


MASKINGS: dict[str, Callable[..., Any]] = {f.__name__: f for f in (height_correlated, separable, v_groove)}


def check_masking(distribution: Distribution, masking: str) -> None:
    """Raises ParameterError where a distribution has no Smith function for the masking asked."""
    if masking != "v_groove" and not distribution.has_lambda:
        name = type(distribution).__name__
        raise ParameterError(
            f"{name} with masking={masking!r}: Smith's function of {name} has no closed form; use masking='v_groove'"
        )
