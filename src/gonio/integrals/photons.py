"""Photons: of fluorescence, how many leave for each that arrives."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arguments import checked
from ..base.reflectance import Reflectance
from ..base.under_light import _OverBands
from ..errors import ParameterError
from ..formula.direction import Direction
from ..formula.fields import wavelengths
from .over_hemisphere import integrate


@checked
def photon_albedo(m: Reflectance, wi: Any, tolerance: float = 1e-4, error: bool = False) -> Any:
    """Photons that leave, to all sides and at all wavelengths, over photons that arrive from wi, by wavelength.

    N(wi)_i = sum_o (lambda_o/lambda_i) integral of F[o, i](wi, wo) cos(theta_o) dwo: a photon's energy is hc/lambda.
    Of a material that does not fluoresce it is the albedo. Fluorescence may send back more light of a wavelength than
    arrives, but never more photons: above 1 this is no matter that absorbs one photon for each that it sends out.

    Shapes   wi: (..., 3) NumPy array; result (..., C), or with `error` an `Integral` of it and (..., C).
    Units    1.
    Error    at most `tolerance`, as for `gn.albedo`.
    Raises   ParameterError for a material that fluoresces, and transmits light or does not know its wavelengths.
    Source   Donaldson 1954, Br. J. Appl. Phys. 5:210 (external quantum efficiency by wavelength).

    Example
    >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> print(gn.photon_albedo(ink, [0, 0, 1]).round(4))  # 0.2 + 0.3 550/400
    [0.6125 0.6   ]
    """
    return integrate(counted(m) if m.fluoresces else m, wi, tolerance, error=error)


def counted(m: Reflectance) -> Reflectance:
    """A fluorescent material as a reflectance of photons: of channel i, what leaves at all wavelengths."""
    if m.sides != "front":
        raise ParameterError(
            f"photons of {m!r:.60}: it transmits light, of which the photons are not counted; expected a material lit "
            f"and seen in front only"
        )
    if m.wavelengths is None:
        raise ParameterError(
            f"photons of {m!r:.60}: its wavelengths are not known, and photons of long ones have less energy; expected "
            f"m.with_channels(wavelengths) [nm]"
        )
    return _Photons(of=m, wavelength=m.wavelengths)


class _Photons(_OverBands):
    """Photons that leave at all wavelengths, for those that arrive at this channel's: per steradian, without the
    cosine."""

    wavelength = wavelengths()

    def _weights(self) -> Any:
        return self.wavelength

    def _summed_first(self, matrix: np.ndarray) -> np.ndarray:
        return matrix

    def _pair(self, own: Reflectance, summed: Reflectance) -> tuple[Reflectance, Reflectance]:
        return summed, own

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.formula(wi, wo) + self._total(wi, wo) / self.wavelength

    def lobes(self) -> Any:
        yield from self.of.lobes()
        yield 1.0, _Sent._made_of(self.__dict__, {"_derived": {}, "_alike": {}})


class _Sent(_Photons):
    """Those of other wavelengths."""

    lobes = Reflectance.lobes

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self._total(wi, wo) / self.wavelength
