"""Absorptance: the fraction of light that does not leave."""

from __future__ import annotations

from typing import Any

from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from .asked import Incidence, ReturnError, Tolerance
from .fate import leaving
from .over_hemisphere import Integral
from .scattered_once import tell_of_lost_light


@checked
def absorptance(m: Reflectance, wi: Incidence, tolerance: Tolerance = 1e-4, return_error: ReturnError = False) -> Any:
    """The fraction of light from wi that is absorbed, 1 - reflected - transmitted.

    Light that facets scatter twice is lost by models of single scattering, such as `Microfacet`, and counts as
    absorbed: a LeftOutWarning says of which part, and how much. In thermal equilibrium the fraction is the emissivity
    towards wi. It is energy, by the wavelength that arrives, as in `fate`: what fluorescence sends out again is not
    absorbed, and of what fluoresces it is no emissivity.

    Shapes   wi: (..., 3), above or below the surface; result (...[, C]), or with `return_error` an `Integral` of it and
             (...).
    Units    1.
    Error    that of reflectance and transmittance together: twice `tolerance` at most, or a ToleranceWarning.
    Source   Kirchhoff 1860; Nicodemus 1965, Appl. Opt. 4:767.

    Example
    >>> print(gn.absorptance(gn.Lambertian(0.3), [0, 0, 1]).round(4))
    0.7
    """
    R, T = leaving(m, wi, tolerance, return_error)
    tell_of_lost_light("absorptance", m, wi)
    return Integral(1.0 - R.value - T.value, R.error + T.error) if return_error else 1.0 - R - T
