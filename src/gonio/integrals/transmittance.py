"""Transmittance: the fraction of light that leaves on the other side."""

from __future__ import annotations

from typing import Any

from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..evaluate.labelled import takes_labels
from .asked import Incidence, ReturnError, Tolerance
from .over_hemisphere import integrate


@takes_labels("wi")
@checked
def transmittance(m: Reflectance, wi: Incidence, tolerance: Tolerance = 1e-4, return_error: ReturnError = False) -> Any:
    """Directional-hemispherical transmittance: the fraction of light from wi that leaves on the other side.

    tau(wi) = integral of f(wi, wo) |cos(theta_o)| dwo over the hemisphere opposite to wi, delta lobes included exactly.
    It counts flux: refraction changes radiance by n_o^2/n_i^2, but loses none. 0 for what only reflects.

    Shapes   wi: (..., 3) NumPy array, above or below the surface; result (...[, C]), or with `return_error` an
             `Integral` of it and (...).
    Units    1.
    Error    as `albedo`: at most `tolerance`, or a ToleranceWarning.
    Source   Nicodemus et al. 1977, NBS Monograph 160, with the hemisphere behind; quadrature: `quadrature.cubature`.

    Example
    >>> glass = gn.RoughDielectric(gn.GGX(0.1), 1.5)
    >>> print(gn.transmittance(glass, gn.direction([0.0, 1.0, 2.0], 0.0)).round(4))
    [0.9592 0.9177 0.0159]
    """
    found = integrate(m, wi, tolerance, sides="across")
    return found if return_error else found.value
