"""From a material's channels to the colour that a variant of Mitsuba computes with: RGB, one number, or four
wavelengths that differ from ray to ray."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...base.reflectance import Reflectance
from ...catalogue.colours import basis
from ...errors import ParameterError
from ...formula.fields import Channels
from ...pictures.colour import LUMINANCE, rgb_of
from .numbers import MitsubaNumber

Evaluate = Callable[[Callable[[MitsubaNumber], Any]], list[Any]]
"""Evaluates the formula's channels with the value of each number that a function gives."""


class Colours:
    """How values of f become a colour of the variant.

    copies      number of channels that the formula is traced for
    """

    def __init__(self, mi: Any, m: Reflectance):
        self.mi, self.spectral = mi, mi.is_spectral
        channels, names = m.channels or 1, m.channel_names
        wavelengths = m.wavelengths
        self.lanes = self.spectral and wavelengths is not None and channels > 1
        self.copies = 1 if self.lanes else channels
        self._nodes: Any = None
        if self.lanes:
            if (np.diff(wavelengths) <= 0.0).any():
                raise ParameterError(f"mitsuba.bsdf: wavelengths {wavelengths} [nm]; expected them in ascending order")
            self._nodes = mi.Float(np.asarray(wavelengths, np.float32))
            self._count = channels
            return
        self._matrix = None if channels == 1 else _to_rgb(channels, names)
        if self._matrix is not None and mi.is_monochromatic:
            self._matrix = self._matrix @ LUMINANCE[:, None]
        if self._matrix is not None and self.spectral:
            nm, spectra = basis()
            self._first, self._step = float(nm[0]), float(nm[1] - nm[0])
            self._spectra = [mi.Float(np.asarray(spectrum, np.float32)) for spectrum in spectra.T]

    def of(self, values: Sequence[Any], wavelengths: Any) -> Any:
        """The colour of a value for each channel."""
        mi = self.mi
        if self._matrix is None:
            return mi.Spectrum(values[0])
        if not np.array_equal(self._matrix, np.eye(3)):
            values = [_weighed(values, weights) for weights in self._matrix.T]
        if not self.spectral:
            return mi.Spectrum(*values)
        return mi.Spectrum([self._at(values, w) for w in wavelengths])

    def _at(self, rgb: Sequence[Any], wavelength: Any) -> Any:
        """The value at a wavelength of a colour: a mean with the weights of the basis."""
        low, share = _place(self.mi, (wavelength - self._first) / self._step, len(self._spectra[0]))
        total = 0.0
        for value, spectrum in zip(rgb, self._spectra, strict=True):
            total = total + value * _between(self.mi, spectrum, low, share)
        return total

    def along(self, numbers: Sequence[MitsubaNumber], wavelengths: Any, evaluate: Evaluate) -> Any:
        """The colour of a material with wavelengths: numbers are taken at those of the ray, values of tables between
        the two next to it."""
        mi, between_values = self.mi, any(isinstance(n.field, Channels) for n in numbers)
        lanes = []
        for w in wavelengths:
            low, share = self._beside(w)
            if between_values:
                a, b = (
                    evaluate(partial(MitsubaNumber.between, mi=mi, channel=c, share=0.0))[0] for c in (low, low + 1)
                )
                lanes.append(a + (b - a) * share)
            else:
                lanes += evaluate(partial(MitsubaNumber.between, mi=mi, channel=low, share=share))
        return mi.Spectrum(lanes)

    def _beside(self, wavelength: Any) -> tuple[Any, Any]:
        """The channel below a wavelength, and how far it is on the way to the next one; held beyond the ends."""
        import drjit as dr

        mi, nodes = self.mi, self._nodes
        above = dr.binary_search(1, self._count - 1, lambda i: dr.gather(mi.Float, nodes, i) <= wavelength)
        low = mi.UInt32(above) - 1
        a, b = dr.gather(mi.Float, nodes, low), dr.gather(mi.Float, nodes, low + 1)
        return low, dr.clip((wavelength - a) / (b - a), 0.0, 1.0)


def _place(mi: Any, x: Any, count: int) -> tuple[Any, Any]:
    import drjit as dr

    low = mi.UInt32(dr.clip(x, 0.0, count - 2.0))
    return low, dr.clip(x - mi.Float(low), 0.0, 1.0)


def _between(mi: Any, table: Any, low: Any, share: Any) -> Any:
    import drjit as dr

    a, b = dr.gather(mi.Float, table, low), dr.gather(mi.Float, table, low + 1)
    return a + (b - a) * share


def _weighed(values: Sequence[Any], weights: np.ndarray) -> Any:
    total = 0.0
    for value, weight in zip(values, weights.tolist(), strict=True):
        total = total + value * weight
    return total


def _to_rgb(channels: int, names: tuple[Any, ...] | None) -> np.ndarray:
    """The matrix (channels, 3) that makes linear sRGB of them."""
    matrix = rgb_of(names)
    if matrix is not None:
        return np.asarray(matrix)
    if channels == 3:
        return np.eye(3)
    raise ParameterError(
        f"mitsuba.bsdf: {channels} channels without a meaning; expected 1, 3 (linear RGB) or wavelengths: "
        f"m.with_channels([450.0, 550.0, ...])"
    )
