"""He, Torrance, Sillion and Greenberg's wave-optical model: light that a rough surface diffracts, and mirrors."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula import tree
from ..formula.direction import Direction, dot
from ..formula.fields import param, part
from ..formula.fresnel import as_fresnel
from ..formula.fresnel.conductor import Conductor
from ..formula.fresnel_term import Fresnel
from ..formula.special import expm1_over, lambert_w
from .abc import ABC

_TERMS = 40  # of the sum over m
_ROUGH = (14.0, 18.0)  # of g, where the sum is replaced by its expansion


class _GaussianHeights(Reflectance):
    """A surface of Gaussian heights and Gaussian autocorrelation."""

    sigma_0 = param(280.0, 0.0, 1e4, "RMS height of the surface", unit="nm", sampled="max")
    tau = param(1770.0, 300.0, 1e5, "autocorrelation length of the surface", unit="nm", sampled="min")
    wavelength = param(550.0, 100.0, 2e4, "wavelength in vacuum", unit="nm", sampled="max")
    fresnel = part(Fresnel, Conductor(), "reflectance of a smooth surface", coerce=as_fresnel)

    def _cot(self, w: Direction) -> tuple[Any, Any]:
        """tan(theta), and cot(theta) tau/(2 sigma_0), limited to where all functions of it have ended."""
        s = ops.sqrt(w.x * w.x + w.y * w.y + 1e-24)
        return s / w.z, ops.minimum(w.z * self.tau / (2.0 * self.sigma_0 * s + 1e-12), 9.0)

    def _shadowing(self, w: Direction) -> Any:
        """S_1 = (1 - erfc(a)/2)/(1 + Lambda), Lambda = exp(-a^2)/(2 a sqrt(pi)) - erfc(a)/2, a from `_cot`."""
        _, a = self._cot(w)
        return 1.0 / (1.0 + ops.exp(-a * a) / (math.sqrt(math.pi) * a * (1.0 + ops.erf(a))))

    def _g(self, wi: Direction, wo: Direction) -> Any:
        """((2 pi sigma/lambda)(cos(theta_i) + cos(theta_o)))^2, sigma the RMS height of the parts lit and seen."""
        (tan_i, a_i), (tan_o, a_o) = self._cot(wi), self._cot(wo)
        K = (tan_i * (1.0 - ops.erf(a_i)) + tan_o * (1.0 - ops.erf(a_o))) * (1.0 / math.sqrt(8.0 * math.pi))
        # With x = z_0/sigma_0 the paper's x exp(x^2/2) = K is x^2 exp(x^2) = K^2; sigma^2 = sigma_0^2/(1 + x^2).
        phase = 2.0 * math.pi * self.sigma_0 * (wi.z + wo.z) / self.wavelength
        return phase * phase / (1.0 + lambert_w(K * K))


class HeTorrance(_GaussianHeights):
    """Light that a rough surface diffracts to all sides, by the Kirchhoff theory: the directional diffuse part.

    f = F G S D / (pi cos(theta_i) cos(theta_o)),  v = wi + wo,  G = (|v|^2/v_z)^2,  S = S_1(wi) S_1(wo) (Smith),
    D = (pi tau/(2 lambda))^2 sum over m >= 1 of g^m exp(-g)/(m! m) exp(-(pi tau/lambda)^2 (v_x^2 + v_y^2)/m),
    g = ((2 pi sigma/lambda) v_z)^2, with the RMS height sigma <= sigma_0 of the parts that are lit and seen. What
    remains of the mirror is `HeTorranceSpecular`; the whole model is
    `HeTorrance(...) + HeTorranceSpecular(...) + Lambertian(...)`, with the same values for both.

    Looks    `HeTorrance(280, 1770)` is roughened metal with a wide highlight; `HeTorrance(100, 3000)` is smoother, with
             a narrow one.
    Shapes   sigma_0, tau, wavelength and the Fresnel term's parameters: numbers or (..., C).
    Units    f: 1/sr; lengths: nm.
    Error    the sum: 1e-6 for g < 14 (40 terms), at most 1.3e-3 beyond (an expansion for many terms, blended in up to
             g = 18), falling as 1/g^3. The theory's own: lobe and peak together reflect up to 1.04 times what arrives
             for tau >= 2 lambda, 1.2 times for tau = 0.3 lambda. For g -> infinity the lobe is that of facets,
             `Microfacet(Beckmann(2 sigma_0/tau), F)`, with this S.
    Source   He, Torrance, Sillion & Greenberg 1991, "A comprehensive physical model for light reflection", for
             unpolarized light; v in D in units of 2 pi/lambda and with exp(-a^2) in Lambda, which its summary omits.

    Example
    >>> metal = gn.HeTorrance(sigma_0=280.0, tau=1770.0, wavelength=550.0)
    >>> print(metal.f_angles(0.5, 0.0, [0.3, 0.5, 0.7], np.pi).round(3))
    [0.853 1.015 1.071]
    """

    def formula(self, wi: Direction, wo: Direction) -> Any:
        v = wi + wo
        v2 = dot(v, v)
        scale = math.pi * self.tau / self.wavelength
        S = self._shadowing(wi) * self._shadowing(wo)
        F = self.fresnel.F(ops.minimum(0.5 * ops.sqrt(v2), 1.0))
        factor = F * (v2 / v.z) * (v2 / v.z) * S * (0.25 * scale * scale) / (math.pi * wi.z * wo.z)
        return _series(self._g(wi, wo), scale * scale * (v.x * v.x + v.y * v.y), factor)

    # Sampled as a heavy-tailed lobe of |v_xy|, as wide as diffraction and slopes make it; no sample is lost.

    def _lobe(self, wo: Direction) -> ABC:
        diffraction, slope = self.wavelength / (math.pi * self.tau), 2.0 * self.sigma_0 / self.tau
        spread = 2.0 * slope * (wo.z + slope)
        width2 = ops.minimum(diffraction * diffraction + spread * spread, 4.0)  # |v_xy| ends at 2
        return tree.unchecked(ABC, B=1.0 / width2, C=2.0)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return self._lobe(wo).warp(wo, u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return self._lobe(wo).density(wi, wo)

    def estimate(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z) * (1.0 - ops.exp(-self._g(wo, wo)))


class HeTorranceSpecular(_GaussianHeights):
    """Light that a rough surface still mirrors: reflectance F exp(-g) S at the mirror direction, as in `HeTorrance`.

    Looks    `HeTorranceSpecular(50)` is a mirror of metal, dim in the middle and clear at the rim;
             `HeTorranceSpecular(20)` is clear all over, `HeTorranceSpecular(280)` mirrors at grazing
             angles only.
    Shapes   sigma_0, tau, wavelength and the Fresnel term's parameters: numbers or (..., C).
    Units    lengths: nm.
    Error    rounding.
    Source   He, Torrance, Sillion & Greenberg 1991, "A comprehensive physical model for light reflection".

    Example
    >>> mirror = gn.HeTorranceSpecular(sigma_0=280.0)
    >>> print(mirror.delta_reflectance(gn.direction([0.0, 1.2, 1.5], 0.0)).round(4))
    [0.     0.0041 0.107 ]
    """

    is_delta = True

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.0 * self.fresnel.F(wo.z)

    def mirror(self, wo: Direction) -> Any:
        S = self._shadowing(wo)
        return self.fresnel.F(wo.z) * ops.exp(-self._g(wo, wo)) * S * S

    def estimate(self, wo: Direction) -> Any:
        return self.mirror(wo)


def _series(g: Any, a: Any, factor: Any) -> Any:
    """`factor` times the sum over m >= 1 of g^m exp(-g)/(m! m) exp(-a/m).

    The factor is inside, and exponentials are squares: no intermediate is smaller than the result, and denormal.
    """
    low, high = _ROUGH
    few = ops.minimum(g, high)
    poisson, total = factor * few * ops.exp(-few), 0.0 * g
    for m in range(1, _TERMS + 1):
        root = ops.exp(-a * (0.5 / m))
        total = total + poisson * (1.0 / m) * root * root
        poisson = poisson * few * (1.0 / (m + 1))
        poisson = ops.where(poisson < 1e-30, 0.0, poisson)
    t = ops.clip((g - low) / (high - low), 0.0, 1.0)
    share = t * t * (3.0 - 2.0 * t)
    return (1.0 - share) * total + share * _many(ops.maximum(g, low), a, factor)


def _many(g: Any, a: Any, factor: Any) -> Any:
    """The same for many terms: by Laplace's method about its largest term, m = g exp(k), to second order in 1/m."""
    k = 0.5 * lambert_w(2.0 * a / (g * g))
    y = ops.exp(k)
    m, r = g * y, 1.0 / (1.0 + 2.0 * k)
    first = (5.0 / 6.0 * r + 0.25) * r * r - 1.0 / 12.0
    second = ((385.0 / 72.0 * r - 35.0 / 24.0) * r - 133.0 / 96.0) * r - 23.0 / 72.0
    second = ((second * r - 5.0 / 48.0) * r - 1.0 / 12.0) * r + 1.0 / 288.0
    root = ops.exp(-0.5 * g * k * (2.0 * y - expm1_over(k)))
    return factor * root * root * ops.sqrt(r) / m * (1.0 + (first + second / m) / m)
