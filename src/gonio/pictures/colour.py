"""Colour: sRGB and its transfer function, luminance, CIE XYZ, and spectra as linear sRGB."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ShapeError

SRGB_XY = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""Chromaticities x, y of sRGB's red, green, blue and white (D65): IEC 61966-2-1, ITU-R BT.709."""


def _xyz_of_rgb() -> NDArray[np.float64]:
    """The matrix whose columns are red, green and blue, scaled to add up to a white of Y = 1."""
    x, y = np.reshape(SRGB_XY, (4, 2)).T
    red, green, blue, white = np.stack([x / y, np.ones(4), (1.0 - x - y) / y], -1)
    primaries = np.stack([red, green, blue], -1)
    return primaries * np.linalg.solve(primaries, white)


XYZ_OF_RGB = _xyz_of_rgb()
"""CIE 1931 X, Y, Z of linear sRGB."""

RGB_OF_XYZ = np.linalg.inv(XYZ_OF_RGB)
"""Linear sRGB of X, Y, Z."""

LUMINANCE = XYZ_OF_RGB[1]
"""Weights of linear red, green and blue in Y."""

WHITE = XYZ_OF_RGB.sum(axis=1)
"""X, Y, Z of a white surface: (1, 1, 1) in linear sRGB, D65."""

XYZ = ("X", "Y", "Z")
"""Names of channels in which a white surface has X, Y, Z of D65."""

RELATIVE_XYZ = ("X/Xn", "Y/Yn", "Z/Zn")
"""Names of channels in which a white surface has 1, as in WINDOW and Radiance."""

RGB_WAVELENGTHS = (630.0, 532.0, 465.0)
"""Wavelengths [nm] at which optical constants are taken where three channels stand for RGB."""

KNEE = 0.04045
"""Code value below which sRGB's transfer function is a straight line."""

_UNSHARED = 1 << 17  # multiplications up to which BLAS keeps to one thread (OpenBLAS: twice as many)


def srgb_encode(linear: ArrayLike) -> NDArray[Any]:
    r"""Linear value to sRGB code value, both 1 at white.

    $$V = 12.92\,L \;\; (L \le 0.0031308), \qquad V = 1.055\,L^{1/2.4} - 0.055 \;\; \text{otherwise}$$

    Shapes   any, elementwise; floats keep their dtype, integers become float64.
    Units    none. Nothing is clamped: negative values follow the straight line, NaN stays NaN.
    Error    rounding, and 3e-8 where the two rounded thresholds of the standard do not quite meet.
    Source   IEC 61966-2-1:1999, 5.2.
    """
    x = np.asarray(linear) * 1.0
    power = 1.055 * np.maximum(x, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(x <= 0.0031308, 12.92 * x, power)[()]


def srgb_decode(encoded: ArrayLike, knee: float = KNEE) -> NDArray[Any]:
    r"""sRGB code value to linear value, both 1 at white: the inverse of `srgb_encode`.

    $$L = V / 12.92 \;\; (V \le 0.04045), \qquad L = ((V + 0.055) / 1.055)^{2.4} \;\; \text{otherwise}$$

    Shapes, units, error, source: as `srgb_encode`. An 8-bit code is divided by 255 first. `knee`: in place of 0.04045,
    for files of programs that have another.
    """
    x = np.asarray(encoded) * 1.0
    return np.where(x <= knee, x / 12.92, ((np.maximum(x, knee) + 0.055) / 1.055) ** 2.4)[()]


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
    weights = (colour_matching(x) * width[:, None]) @ RGB_OF_XYZ.T
    return weights / weights.sum(axis=0)


def rgb_of(names: tuple | None) -> np.ndarray | None:
    """Matrix (C, 3) that turns channels of these names into linear sRGB: wavelengths [nm], `XYZ` or `RELATIVE_XYZ`.

    None for channels that are RGB or unknown.
    """
    if names is None or len(names) < 2:
        return None
    if tuple(names) in (XYZ, RELATIVE_XYZ):
        return (RGB_OF_XYZ * (WHITE if tuple(names) == RELATIVE_XYZ else 1.0)).T
    return None if isinstance(names[0], str) else to_rgb(names)


def transformed(values: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Channels (..., C) turned into others by a matrix (C, K): `values @ matrix`, on this thread alone.

    BLAS gets small products only: large ones it shares out to threads of its own, which `gn.threads` does not limit.
    """
    count, wide = matrix.shape
    rows = max(1, _UNSHARED // matrix.size)
    flat = values.reshape(-1, count)
    whole = len(flat) // rows * rows
    out = np.empty((len(flat), wide), np.result_type(values, matrix))
    np.matmul(flat[:whole].reshape(-1, rows, count), matrix, out=out[:whole].reshape(-1, rows, wide))
    np.matmul(flat[whole:], matrix, out=out[whole:])
    return out.reshape(*values.shape[:-1], wide)
