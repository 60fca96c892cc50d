"""The spectral radiance of a black body: Planck's law as a spectrum."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import ops
from ..errors import ParameterError
from .spectrum import Spectrum
from .text import shown

BOLTZMANN = 1.380649e-23
"""k [J/K]: exact, SI 2019."""

SAMPLES = np.sort(np.concatenate([np.arange(300.0, 831.0), np.geomspace(10.0, 1e6, 6001)]))
"""Wavelengths [nm] at which the formula is tabulated, for `wavelengths`, `values` and means over bands."""


class Blackbody(Spectrum):
    """What `gonio.spectra.blackbody` gives: a spectrum that is exact at every wavelength.

    Example
    >>> print(type(gn.spectra.blackbody(3000.0)).__name__, gn.spectra.blackbody(3000.0))
    Blackbody blackbody(3000.0)
    """

    temperature: float

    def __init__(self, temperature: Any):
        try:
            kelvin = float(temperature)
        except (TypeError, ValueError, OverflowError):
            kelvin = 0.0
        if not 100.0 <= kelvin <= 1e6:
            raise ParameterError(f"blackbody({shown(temperature)}): expected a temperature from 100 to 1e6 K")
        object.__setattr__(self, "temperature", kelvin)
        super().__init__(SAMPLES, self.at(SAMPLES))

    def at(self, wavelengths: Any) -> Any:
        """The radiance at wavelengths [nm], of their shape.

        Example
        >>> print(gn.spectra.blackbody(3000.0).at([500.0, 1000.0, 10000.0]).round(1))
        [260.3 992.4   1.9]
        """
        from ..radiometry import PLANCK, SPEED_OF_LIGHT  # late: few materials glow

        nm = np.asarray(ops.numbers(wavelengths), dtype=float)
        if not (np.isfinite(nm) & (nm > 0.0)).all():
            raise ParameterError(f"{self}.at({shown(wavelengths)}): expected wavelengths above 0 [nm]")
        metres = nm * 1e-9
        with np.errstate(all="ignore"):  # no light at the shortest ones
            exponent = PLANCK * SPEED_OF_LIGHT / (metres * BOLTZMANN * self.temperature)
            radiance = 2e-9 * PLANCK * SPEED_OF_LIGHT**2 / metres**5 / np.expm1(exponent)
        return np.where(exponent > 700.0, 0.0, radiance)[()]

    def _key(self) -> tuple[Any, ...]:
        return (self.temperature,)

    def __repr__(self) -> str:
        return f"blackbody({self.temperature!r})"

    def to_json(self) -> dict[str, Any]:
        """The temperature as JSON data.

        Example
        >>> print(gn.spectra.blackbody(3000.0).to_json())
        {'type': 'blackbody', 'temperature': 3000.0}
        """
        return {"type": "blackbody", "temperature": self.temperature}
