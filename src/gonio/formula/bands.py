"""Bands about wavelengths: where they meet, and how light is shared out between the bands of two sets."""

from __future__ import annotations

import numpy as np

from ..errors import ParameterError
from .spectrum import Spectrum


def edges(wavelengths: np.ndarray) -> np.ndarray:
    """Ends [nm] (C, 2) of bands about wavelengths [nm] in any order: they meet halfway between two, and the outer ones
    reach as far out as in."""
    order = np.argsort(wavelengths)
    middle = wavelengths[order]
    inner = 0.5 * (middle[1:] + middle[:-1])
    ends = np.concatenate([[2.0 * middle[0] - inner[0]], inner, [2.0 * middle[-1] - inner[-1]]])
    found = np.empty((len(middle), 2))
    found[order] = np.stack([ends[:-1], ends[1:]], -1)
    return found


def shared(known: np.ndarray, new: np.ndarray) -> np.ndarray:
    """The share (new, known) of each known band that lies in each new one."""
    (a, b), (c, d) = edges(new).T[..., None], edges(known).T[:, None]
    found: np.ndarray = np.clip(np.minimum(b, d) - np.maximum(a, c), 0.0, None) / (d - c)
    return found


def interpolation(name: str, known: np.ndarray, new: np.ndarray) -> np.ndarray:
    """The weights (new, known) of numbers at known wavelengths in those at new ones, by straight lines."""
    low, high = known.min(), known.max()
    outside = new[(new < low) | (new > high)]
    if outside.size:
        raise ParameterError(
            f"{name}: known from {low:g} to {high:g} nm, asked for at {outside[0]:g} nm: nothing is extrapolated"
        )
    order = np.argsort(known)
    weights = np.empty((len(new), len(known)))
    weights[:, order] = np.stack([np.interp(new, known[order], row) for row in np.eye(len(known))], -1)
    return weights


def shares(name: str, spectrum: Spectrum, wavelengths: np.ndarray) -> np.ndarray:
    """The share (C,) of a whole spectrum, 0 where it is not given, that lies in each band about wavelengths [nm]."""
    x, y = spectrum.wavelengths, spectrum.values
    if y.min() < 0.0:
        raise ParameterError(f"{name}: a spectrum with {y.min():g} in it; expected numbers of 0 or more")
    ends = edges(wavelengths)
    inside = np.clip(ends, x[0], x[-1])
    places = np.union1d(inside, x)
    values = np.interp(places, x, y)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(places))])
    if integral[-1] <= 0.0:
        raise ParameterError(f"{name}: a spectrum without light; expected one above 0 somewhere")
    found: np.ndarray = np.diff(np.interp(inside, places, integral), axis=-1)[..., 0] / integral[-1]
    if not found.any():
        raise ParameterError(
            f"{name}: a spectrum from {x[0]:g} to {x[-1]:g} nm, and wavelengths from {wavelengths.min():g} to "
            f"{wavelengths.max():g} nm, in whose bands it has no light; expected spectra that overlap"
        )
    return found
