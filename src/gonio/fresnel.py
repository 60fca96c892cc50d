"""Fresnel reflectance of a smooth interface, exact for dielectrics and conductors, unpolarised.

A Fresnel term is a small value with `F(cos_theta)`; wherever one is expected a plain number means `Constant`.
"""

from __future__ import annotations

import math
from typing import Any

from . import ops
from .param import param
from .parametrised import Parametrised


def fresnel_dielectric(cos_theta: Any, eta: Any) -> Any:
    """Unpolarised reflectance of a dielectric: the mean of the squared s and p amplitudes.

    r_s = (c - eta c_t)/(c + eta c_t),  r_p = (eta c - c_t)/(eta c + c_t),  c_t = sqrt(1 - (1 - c^2)/eta^2)

    Shapes   any that broadcast. `eta`: index behind over index in front; below 1 there is total reflection.
    Units    1. `cos_theta` in [0, 1].
    Error    rounding (absolute): below 4e-7 in float32, 1e-15 in float64; for eta < 1, beside the critical angle,
             where the slope is infinite, 1e-4 and 1e-7.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 1.5.2.
    """
    c = cos_theta
    ct2 = ((eta - 1.0) * (eta + 1.0) + c * c) / (eta * eta)  # no cancellation where eta is near 1
    total = ct2 <= 0.0
    ct = ops.sqrt(ops.where(total, 1.0, ct2))
    rs = (c - eta * ct) / (c + eta * ct)
    rp = (eta * c - ct) / (eta * c + ct)
    return ops.where(total, 1.0, 0.5 * (rs * rs + rp * rp))


def dielectric_transmittance(cos_theta: Any, eta: Any) -> Any:
    """1 - `fresnel_dielectric` for eta >= 1, without the cancellation where that is near 1: at grazing."""
    ct = ops.sqrt((eta - 1.0) * (eta + 1.0) + cos_theta * cos_theta) / eta
    s, p = cos_theta + eta * ct, eta * cos_theta + ct
    return 2.0 * eta * cos_theta * ct * (1.0 / (s * s) + 1.0 / (p * p))


def fresnel_conductor(cos_theta: Any, eta: Any, k: Any) -> Any:
    """Unpolarised reflectance of a conductor of complex index eta + i k, seen from vacuum.

    With a + i b = sqrt((eta + i k)^2 - sin^2):
    R_s = ((a - c)^2 + b^2) / ((a + c)^2 + b^2),
    R_p = R_s ((a - s t)^2 + b^2) / ((a + s t)^2 + b^2),  s t = sin^2/cos.

    Shapes   any that broadcast.
    Units    1. `cos_theta` in [0, 1].
    Error    rounding (absolute): below 5e-7 in float32, 2e-14 in float64; for eta < 1 and k < 0.1, beside the
             critical angle, up to 4e-4 in float32.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 14.2.
    """
    c2 = cos_theta * cos_theta
    s2 = 1.0 - c2
    difference = ops.where(c2 > 0.5, eta * eta - s2, (eta - 1.0) * (eta + 1.0) + c2)  # eta^2 - s2, no cancellation
    real, imag = difference - k * k, 2.0 * eta * k
    modulus = ops.sqrt(real * real + imag * imag + 1e-36)  # a^2 + b^2
    # The larger of a and b comes from a sum, the other from a b = eta k: no cancellation.
    larger = ops.sqrt(0.5 * (modulus + ops.absolute(real)) + 1e-30)
    smaller = eta * k / larger
    a, b = ops.where(real >= 0.0, larger, smaller), ops.where(real >= 0.0, smaller, larger)
    b2 = b * b
    s, s_all = ops.square(a - cos_theta) + b2, ops.square(a + cos_theta) + b2  # R_s = s / s_all
    # R_p/R_s = p / p_all, multiplied through by cos^2 so that grazing stays finite.
    ac, b2 = a * cos_theta, b2 * c2
    p, p_all = ops.square(ac - s2) + b2, ops.square(ac + s2) + b2
    return 0.5 * s * (p_all + p) / (s_all * p_all)


class Fresnel(Parametrised):
    """Base of the Fresnel terms: how much a mirror facet reflects."""

    def F(self, cos_theta: Any) -> Any:
        """Reflectance [1] at the cosine of the angle between direction and facet normal."""
        raise NotImplementedError


class Constant(Fresnel):
    """A mirror with the same reflectance at every angle: F = reflectance.

    Shapes   reflectance: a number or (..., C).
    Units    1.
    Error    none.
    Source   definition (k of lecture 4, eq. 4.5, docs/equations.md).
    """

    reflectance = param(1.0, 0.0, 1.0, "reflectance at every angle")

    def F(self, cos_theta: Any) -> Any:
        return self.reflectance + 0.0 * cos_theta


class Dielectric(Fresnel):
    """Exact Fresnel reflectance of a dielectric, `fresnel_dielectric`.

    Shapes   eta: a number or (..., C).
    Units    1.
    Error    rounding, see `fresnel_dielectric`.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 1.5.2.
    """

    eta = param(1.5, 0.2, 5.0, "refractive index behind the surface over that in front")

    def F(self, cos_theta: Any) -> Any:
        return fresnel_dielectric(cos_theta, self.eta)


class Conductor(Fresnel):
    """Exact Fresnel reflectance of a metal in vacuum, `fresnel_conductor`.

    Shapes   eta, k: numbers or (..., C).
    Units    1.
    Error    rounding, see `fresnel_conductor`.
    Source   Born & Wolf, section 14.2.
    """

    eta = param(0.2, 0.01, 20.0, "real part of the refractive index")
    k = param(3.9, 0.0, 50.0, "imaginary part of the refractive index (extinction)")

    def F(self, cos_theta: Any) -> Any:
        return fresnel_conductor(cos_theta, self.eta, self.k)


class Schlick(Fresnel):
    """Schlick's approximation: F = F0 + (1 - F0)(1 - cos theta)^5.

    Shapes   F0: a number or (..., C).
    Units    1.
    Error    against the exact dielectric, eta = 1.5: at most 0.045 (near 86 degrees).
    Source   Schlick 1994, Computer Graphics Forum 13(3):233.
    """

    F0 = param(0.04, 0.0, 1.0, "reflectance at normal incidence")

    def F(self, cos_theta: Any) -> Any:
        m = ops.clip(1.0 - cos_theta, 0.0, 1.0)
        m2 = m * m
        return self.F0 + (1.0 - self.F0) * m2 * m2 * m


class F82Tint(Fresnel):
    """Schlick's approximation with a dip where metals have one: F = F_S - b mu (1 - mu)^6, mu = cos theta, not below 0.

    F_S = F0 + (1 - F0)(1 - mu)^5, and b such that F = tint F_S at mu = 1/7, near 82 degrees. tint = 1 is `Schlick`.

    Shapes   F0, tint: numbers or (..., C).
    Units    1.
    Error    against the exact conductor of eta, k with the same values at mu = 1 and 1/7: aluminium (1.37, 7.62) 0.018,
             gold (0.18, 3.43) 0.006; those of `Schlick` are 0.117 and 0.018. Cut off at 0 where both are small.
    Source   Kutz, Hašan & Edmondson 2021, "Novel aspects of the Adobe Standard Material"; the dip: Hoffman 2019.
    """

    F0 = param(0.9, 0.0, 1.0, "reflectance at normal incidence")
    tint = param(0.9, 0.0, 1.0, "reflectance at cos theta = 1/7, over that of Schlick's approximation")

    def F(self, cos_theta: Any) -> Any:
        m, edge = ops.clip(1.0 - cos_theta, 0.0, 1.0), 6.0 / 7.0
        m2 = m * m
        at_edge = self.F0 + (1.0 - self.F0) * edge**5
        # Near the edge by the distance from what F is there, for at the bottom of the dip little else is left.
        a = 7.0 * (edge - m)
        slope = (m - edge) * (m2 * m2 + edge * (m2 * m + edge * (m2 + edge * (m + edge))))  # m^5 - edge^5
        near = self.tint * at_edge + (1.0 - self.F0) * slope + (1.0 - self.tint) * at_edge * a * a * _dip(a)
        far = (
            self.F0 + (1.0 - self.F0) * m2 * m2 * m - (1.0 - self.tint) * at_edge * (1.0 + a) * m2 * m2 * m2 * edge**-6
        )
        return ops.maximum(ops.where(a * a < 0.25, near, far), 0.0)


def _dip(a: Any) -> Any:
    """(1 - (1 + a)(1 - a/6)^6)/a^2, the powers of a one by one."""
    total: Any = 0.0
    for k in range(7, 1, -1):
        total = total * a + -((-1) ** k) * (math.comb(6, k) / 6.0**k - math.comb(6, k - 1) / 6.0 ** (k - 1))
    return total


def as_fresnel(value: Any) -> Any:
    """A number (or array of numbers) as a `Constant` reflectance; anything else as it is."""
    numeric = isinstance(value, (int, float, list, tuple)) or ops.library_of_type(type(value)) is not None
    return Constant(value) if numeric else value
