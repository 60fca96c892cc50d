"""Fresnel reflectance of a dielectric, exact and unpolarised."""

from __future__ import annotations

from typing import Any

from ...arrays import ops
from ..fields import param
from ..fresnel_term import Fresnel


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
