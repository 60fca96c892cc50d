"""Fresnel reflectance of a dielectric, exact and unpolarized."""

from __future__ import annotations

from typing import Any

from ...arrays import ops
from ..complex import Complex, as_complex
from ..fields import param
from ..fresnel_term import Fresnel
from ..mueller import Mueller


def fresnel_dielectric(cos_theta: Any, eta: Any) -> Any:
    """Unpolarized reflectance of a dielectric: the mean of the squared s and p amplitudes.

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


def interface_amplitudes(cos_theta: Any, contrast: Any) -> tuple[Complex, Complex]:
    """Fresnel's amplitudes (r_s, r_p) of an interface, from its contrast n^2 - 1, n the index behind over in front.

    With q = sqrt(n^2 - sin^2): r_s = (c - q)/(c + q), r_p = r_s (sin^2 - c q)/(sin^2 + c q).

    Shapes   any that broadcast.
    Units    1. `cos_theta` in [0, 1].
    Error    rounding.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 1.5.2, with r_p over r_s multiplied out.
    """
    c = as_complex(cos_theta)
    q = (c * c + contrast).sqrt()
    r_s = (c - q) / (c + q)
    s2 = 1.0 - c * c
    return r_s, r_s * ((s2 - c * q) / (s2 + c * q))


def interface_mueller(cos_theta: Any, contrast: Any) -> Mueller:
    """`of_amplitudes` of `interface_amplitudes`, with fewer operations.

    With q = a + ib and w = r_p/r_s = (s^4 - c^2 |q|^2 - 2i s^2 c b)/N, N = (s^2 + ca)^2 + (cb)^2, all elements are
    |r_s|^2 times (1 + |w|^2)/2, (1 - |w|^2)/2, Re w and -Im w.

    Error    rounding (absolute).
    """
    c = cos_theta
    c2 = c * c
    s2 = 1.0 - c2
    a, b = (as_complex(c2) + contrast).sqrt()
    b2, ca = b * b, c * a
    R_s = (ops.square(a - c) + b2) / (ops.square(a + c) + b2)
    across = c2 * b2
    scale = R_s / (ops.square(s2 + ca) + across)  # R_s/N
    R_p = (ops.square(s2 - ca) + across) * scale
    U, V = (s2 * s2 - (ca * ca + across)) * scale, 2.0 * s2 * c * b * scale
    A, B = 0.5 * (R_s + R_p), 0.5 * (R_s - R_p)
    return Mueller(((A, B, 0.0, 0.0), (B, A, 0.0, 0.0), (0.0, 0.0, U, -V), (0.0, 0.0, V, U)))


def dielectric_transmittance(cos_theta: Any, eta: Any) -> Any:
    """1 - `fresnel_dielectric` for eta >= 1, without the cancellation where that is near 1: at grazing."""
    ct = ops.sqrt((eta - 1.0) * (eta + 1.0) + cos_theta * cos_theta) / eta
    s, p = cos_theta + eta * ct, eta * cos_theta + ct
    return 2.0 * eta * cos_theta * ct * (1.0 / (s * s) + 1.0 / (p * p))


class Dielectric(Fresnel):
    """Exact Fresnel reflectance of a dielectric, `fresnel_dielectric`.

    Looks    `Dielectric(1.5)` is black glass, dark in the middle and bright at the rim; `Dielectric(2.4)`
             is polished as diamond.
    Shapes   eta: a number or (..., C).
    Units    1.
    Error    rounding, see `fresnel_dielectric`.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 1.5.2.

    Example
    >>> glass = gn.Dielectric(1.5)
    >>> print(glass.F(np.cos([0.0, 1.0, 1.5])).round(4))
    [0.04   0.0775 0.6704]
    """

    eta = param(1.5, 0.2, 5.0, "refractive index behind the surface over that in front")

    def F(self, cos_theta: Any) -> Any:
        return fresnel_dielectric(cos_theta, self.eta)

    def amplitudes(self, cos_theta: Any) -> tuple[Complex, Complex]:
        return interface_amplitudes(cos_theta, (self.eta - 1.0) * (self.eta + 1.0))

    def polarized(self, cos_theta: Any) -> Mueller:
        return interface_mueller(cos_theta, (self.eta - 1.0) * (self.eta + 1.0))
