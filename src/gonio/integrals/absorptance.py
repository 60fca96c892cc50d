"""Absorptance: the fraction of light that does not leave."""

from __future__ import annotations

from typing import Any

from ..arguments import checked
from ..base.reflectance import Reflectance
from .albedo import albedo
from .over_hemisphere import Integral
from .scattered_once import tell_of_lost_light
from .transmittance import transmittance


@checked
def absorptance(m: Reflectance, wi: Any, tolerance: float = 1e-4, error: bool = False) -> Any:
    """The fraction of light from wi that is absorbed, 1 - reflected - transmitted.

    In thermal equilibrium it is the emissivity towards wi. Light that facets scatter twice is lost by models of single
    scattering, such as `Microfacet`, and counts as absorbed: a LeftOutWarning says of which part, and how much.

    Shapes   wi: (..., 3), above or below the surface; result (...[, C]), or with `error` an `Integral` of it and (...).
    Units    1.
    Error    that of reflectance and transmittance together: twice `tolerance` at most, or a ToleranceWarning.
    Source   Kirchhoff 1860; Nicodemus 1965, Appl. Opt. 4:767.

    Example
    >>> print(gn.absorptance(gn.Lambertian(0.3), [0, 0, 1]).round(4))
    0.7
    """
    if not error:
        A = 1.0 - albedo(m, wi, tolerance) - transmittance(m, wi, tolerance)
        tell_of_lost_light("absorptance", m, wi)
        return A
    R, T = albedo(m, wi, tolerance, error=True), transmittance(m, wi, tolerance, error=True)
    tell_of_lost_light("absorptance", m, wi)
    return Integral(1.0 - R.value - T.value, R.error + T.error)
