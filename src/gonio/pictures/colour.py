"""From spectra to colour: what a reflectance sampled at wavelengths looks like in linear sRGB."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ShapeError

RGB_WAVELENGTHS = (630.0, 532.0, 465.0)
"""Wavelengths [nm] at which optical constants are taken where three channels stand for RGB."""


def _lobe(x: np.ndarray, centre: float, below: float, above: float) -> np.ndarray:
    t = (x - centre) / np.where(x < centre, below, above)
    return np.exp(-0.5 * t * t)


def colour_matching(wavelengths: Any) -> np.ndarray:
    """CIE 1931 x, y, z colour-matching functions, shape (..., 3), as sums of Gaussian lobes.

    Units    wavelengths: nm.
    Error    at most 0.02 where the functions reach 1.8.
    Source   Wyman, Sloan & Shirley 2013, JCGT 2(2), multi-lobe fit.
    """
    x = np.asarray(wavelengths, dtype=float)
    return np.stack(
        [
            1.056 * _lobe(x, 599.8, 37.9, 31.0)
            + 0.362 * _lobe(x, 442.0, 16.0, 26.7)
            - 0.065 * _lobe(x, 501.1, 20.4, 26.2),
            0.821 * _lobe(x, 568.8, 46.9, 40.5) + 0.286 * _lobe(x, 530.9, 16.3, 31.1),
            1.217 * _lobe(x, 437.0, 11.8, 36.0) + 0.681 * _lobe(x, 459.0, 26.0, 13.8),
        ],
        axis=-1,
    )


XYZ_TO_SRGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)  # IEC 61966-2-1


XYZ = ("X", "Y", "Z")
"""Names of channels in which a white surface has X, Y, Z of D65."""

RELATIVE_XYZ = ("X/Xn", "Y/Yn", "Z/Zn")
"""Names of channels in which a white surface has 1, as in WINDOW and Radiance."""

WHITE = np.linalg.inv(XYZ_TO_SRGB).sum(axis=1)
"""X, Y, Z of a white surface: (1, 1, 1) in linear sRGB, D65."""


def to_rgb(wavelengths: Any) -> np.ndarray:
    """Matrix (C, 3) that turns reflectance at C increasing wavelengths [nm] into linear sRGB.

    Trapezoidal integration against the colour-matching functions under an equal-energy light; each RGB channel is
    scaled so that a reflectance of 1 at all wavelengths becomes (1, 1, 1).
    """
    x = np.asarray(wavelengths, dtype=float)
    if x.ndim != 1 or len(x) < 2 or not np.all(np.diff(x) > 0):
        raise ShapeError(f"wavelengths: got {x!r:.60}, expected at least two increasing numbers [nm]")
    width = np.gradient(x)
    width[0], width[-1] = 0.5 * (x[1] - x[0]), 0.5 * (x[-1] - x[-2])
    weights = (colour_matching(x) * width[:, None]) @ XYZ_TO_SRGB.T
    return weights / weights.sum(axis=0)


def rgb_of(names: tuple | None) -> np.ndarray | None:
    """Matrix (C, 3) that turns channels of these names into linear sRGB: wavelengths [nm], `XYZ` or `RELATIVE_XYZ`.

    None for channels that are RGB, or of which nothing is known.
    """
    if names is None or len(names) < 2:
        return None
    if tuple(names) in (XYZ, RELATIVE_XYZ):
        return (XYZ_TO_SRGB * (WHITE if tuple(names) == RELATIVE_XYZ else 1.0)).T
    return None if isinstance(names[0], str) else to_rgb(names)
