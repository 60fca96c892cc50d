"""Albedo: the directional-hemispherical reflectance of any BRDF, by integration."""

from __future__ import annotations

from typing import Any

from ..base.reflectance import Reflectance
from .over_directions import integral_over


def albedo(m: Reflectance, wi: Any, tolerance: float = 1e-4, error: bool = False) -> Any:
    """Directional-hemispherical reflectance: the fraction of light arriving from wi that leaves, to all sides.

    rho(wi) = integral of f(wi, wo) cos(theta_o) dwo, delta lobes included exactly.

    Shapes   wi: (..., 3) NumPy array; result (...[, C]), or with `error` an `Integral` of it and (...).
    Units    1.
    Error    at most `tolerance`, absolute (relative where the result is above 1), or a ToleranceWarning that says what
             was reached. `error=True` returns the estimate too, typically 10 times the error, rarely below it. Computed
             in double precision. Measured at alpha from 0.001 to 1 and 0 to 89.99 degrees: at most 4e-5 for 1e-4.
    Source   lecture 4, eq. 4.2; Nicodemus et al. 1977, NBS Monograph 160; the quadrature: `quadrature.cubature`.
             Directions without measured data count as 0 and are reported by a MissingDataWarning.
    """
    rho = integral_over(m, wi, tolerance, True, None)
    return rho if error else rho.value
