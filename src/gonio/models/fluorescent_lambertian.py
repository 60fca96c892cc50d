"""A matt surface with a fluorescent dye."""

from __future__ import annotations

import math
from typing import Any, Self

import numpy as np

from ..errors import ParameterError
from ..formula import bands
from ..formula.direction import Direction
from ..formula.fields import param, wavelengths
from ..formula.spectrum import Spectrum
from ..formula.text import shown
from .lambertian import Lambertian


class FluorescentLambertian(Lambertian):
    """A matt surface with a dye: F[o, i] = (1 - rho_i) absorbed_i quantum_yield emission_o (lambda_i/lambda_o) / pi.

    rho is reflected, f = rho/pi; of the light that arrives at lambda_i and is not reflected, the dye takes the share
    `absorbed`. For `quantum_yield` of these photons another one leaves, in the band o with the chance `emission`,
    whatever lambda_i is (Kasha's rule). A photon of a longer wavelength has less energy: so lambda_i/lambda_o. No more
    photons leave than arrive. Where absorption and emission overlap some light also leaves at a shorter wavelength than
    it had, as it does from real dyes, weakly.

    Looks    `FluorescentLambertian([0.1, 0.2, 0.8], [0.9, 0.9, 0], [0, 0.1, 0.8], wavelength=[450, 550, 650])` is the
             orange of a traffic cone, brighter than any paint; with absorption below 400 nm and emission in the blue it
             is whitened textile, which shines under a lamp with ultraviolet light.
    Shapes   rho, absorbed, emission, quantum_yield: numbers, (..., C), or `gn.Spectrum`, bound by `m.at(wavelengths)`.
    Units    all 1; f: 1/sr. emission: the share of all photons sent out that are of the band; the sum is at most 1. As
             a Spectrum it is photons by wavelength, 1 at its peak say: `m.at` gives every band its share.
    Error    rounding.
    Source   Kasha 1950, Discuss. Faraday Soc. 9:14; the matrix: Donaldson 1954, Br. J. Appl. Phys. 5:210. Derived here.

    Example
    >>> dye = gn.FluorescentLambertian(
    ...     rho=[0.1, 0.6, 0.8], absorbed=[0.9, 0.2, 0.0], emission=[0.0, 0.6, 0.4], quantum_yield=0.9,
    ...     wavelength=[450.0, 550.0, 650.0])
    >>> print((np.pi * dye.reradiation([0, 0, 1], [0, 0, 1])).round(3))
    [[0.1   0.    0.   ]
     [0.358 0.643 0.   ]
     [0.202 0.024 0.8  ]]
    >>> print(gn.photon_albedo(dye, [0, 0, 1]).round(3))  # rho + (1 - rho) absorbed quantum_yield
    [0.829 0.672 0.8  ]
    """

    fluoresces = _glows_evenly = True

    rho = param(0.3, 0.0, 1.0, "the fraction of light that is reflected")
    absorbed = param(0.5, 0.0, 1.0, "the share of the other light that the dye takes")
    emission = param(0.5, 0.0, 1.0, "the share of the photons sent out that are of this band")
    quantum_yield = param(0.8, 0.0, 1.0, "photons sent out over photons taken")
    wavelength = wavelengths(550.0)

    def validate(self) -> None:
        self._require_bands(self.channels or 1)

    def _require_bands(self, channels: int) -> None:
        if isinstance(self.emission, (float, np.ndarray)):
            shares = np.asarray(self.emission)
            count = channels if np.shape(shares)[-1:] in ((), (1,)) else 1
            total = count * float(np.max(np.sum(shares, axis=-1) if shares.ndim else shares))
            if total > 1.0 + 1e-6:
                what = "the bands" if count == 1 else f"{count} bands"
                raise ParameterError(
                    f"FluorescentLambertian(emission={shown(self.emission)}): the shares of all {what} add up to "
                    f"{total:.6g}; expected at most 1: shares / sum(shares), one for each band, or a gn.Spectrum"
                )

    def reradiated(self, light: Any, wi: Direction, wo: Direction) -> Any:
        taken = (1.0 - light.rho) * light.absorbed
        sent = self.quantum_yield * self.emission * (1.0 / math.pi) / self.wavelength
        return taken * light.wavelength * sent

    def _at(self, wavelengths: Any, known: np.ndarray | None) -> Self:
        nm = self.wavelengths
        shares = self._shares(wavelengths, known if nm is None else nm)
        return super(FluorescentLambertian, self.replace(emission=0.0))._at(wavelengths, known).replace(emission=shares)

    def _shares(self, wavelengths: Any, known: np.ndarray | None) -> Any:
        """The share of the photons sent out per band about wavelengths; none at one wavelength, which has no band."""
        if np.ndim(wavelengths) == 0 or len(wavelengths) < 2:
            return 0.0
        if isinstance(self.emission, Spectrum):
            return bands.shares(f"{type(self).__name__}(emission)", self.emission, wavelengths)
        if known is None or np.ndim(self.emission) == 0 or self.emission.shape[-1] != len(known):
            return self.emission
        return self.emission @ bands.shared(known, wavelengths).T
