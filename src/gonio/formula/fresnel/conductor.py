"""Fresnel reflectance of a metal, exact and unpolarized."""

from __future__ import annotations

from typing import Any

from ...arrays import ops
from ..complex import Complex
from ..fields import param
from ..fresnel_term import Fresnel
from ..mueller import Mueller
from .dielectric import interface_amplitudes, interface_mueller


def fresnel_conductor(cos_theta: Any, eta: Any, k: Any) -> Any:
    """Unpolarized reflectance of a conductor of complex index eta + i k, seen from vacuum.

    With a + i b = sqrt((eta + i k)^2 - sin^2):
    R_s = ((a - c)^2 + b^2) / ((a + c)^2 + b^2),
    R_p = R_s ((a - s t)^2 + b^2) / ((a + s t)^2 + b^2),  s t = sin^2/cos.

    Shapes   any that broadcast.
    Units    1. `cos_theta` in [0, 1].
    Error    rounding (absolute): below 3e-7 in float32, 1e-15 in float64; for eta < 1 and k < 0.1, beside the
             critical angle, up to 4e-4 in float32.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 14.2.
    """
    c2 = cos_theta * cos_theta
    s2 = 1.0 - c2
    # eta^2 - s2, without cancellation for small eta and for eta near 1.
    real = ops.where(c2 > 0.5, eta * eta - s2, (eta - 1.0) * (eta + 1.0) + c2) - k * k
    ab = eta * k
    modulus = ops.sqrt(real * real + (4.0 * ab * ab + 1e-36))  # a^2 + b^2
    # The larger of a and b comes from a sum, the other from a b = eta k: no cancellation. Both are multiplied by the
    # larger, so that none is divided.
    larger2 = 0.5 * (modulus + ops.absolute(real))
    larger = ops.sqrt(larger2)
    a, b = ops.where(real >= 0.0, larger2, ab), ops.where(real >= 0.0, ab, larger2)
    c = cos_theta * larger
    s = ops.square(a - c) + b * b  # R_s = s / s_all
    s_all = s + 4.0 * a * c
    # R_p = R_s (p - q)/(p + q), multiplied through by cos^2 so that grazing stays finite; their mean is R_s p/(p + q).
    p, q = larger * (modulus * c2 + s2 * s2), 2.0 * a * cos_theta * s2
    return s * p / (s_all * (p + q))


class Conductor(Fresnel):
    """Exact Fresnel reflectance of a metal in vacuum, `fresnel_conductor`.

    Looks    `Conductor([0.14, 0.37, 1.4], [4.0, 2.4, 1.6])` is gold, `Conductor(3.1, 3.3)` chromium.
    Shapes   eta, k: numbers or (..., C).
    Units    1.
    Error    rounding, see `fresnel_conductor`.
    Source   Born & Wolf, section 14.2.

    Example
    >>> gold = gn.Conductor(eta=[0.14, 0.5, 1.47], k=[4.61, 2.26, 1.77])
    >>> print(gold.F(1.0).round(3), gold.F(0.1).round(3))
    [0.975 0.728 0.363] [0.976 0.893 0.723]
    """

    eta = param(0.2, 0.01, 20.0, "real part of the refractive index")
    k = param(3.9, 0.0, 50.0, "imaginary part of the refractive index (extinction)")

    def F(self, cos_theta: Any) -> Any:
        return fresnel_conductor(cos_theta, self.eta, self.k)

    def amplitudes(self, cos_theta: Any) -> tuple[Complex, Complex]:
        return interface_amplitudes(cos_theta, self._contrast)

    def polarized(self, cos_theta: Any) -> Mueller:
        return interface_mueller(cos_theta, self._contrast)

    @property
    def _contrast(self) -> Complex:
        return Complex((self.eta - 1.0) * (self.eta + 1.0) - self.k * self.k, 2.0 * self.eta * self.k)
