"""Colour: sRGB and its transfer function, luminance, CIE XYZ, and spectra as linear sRGB."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ParameterError, ShapeError

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

KNEE = 0.04045
"""Code value below which sRGB's transfer function is a straight line."""

SHORTEST, LONGEST = 380.0, 780.0
"""Wavelengths [nm] beyond which eyes see nothing to speak of."""

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


@cache
def _tabulated() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths [nm] (N,), the CIE 1931 colour-matching functions (N, 3), and the power of D65 (N,)."""
    text = (resources.files("gonio") / "data" / "cie_1931_d65.tsv").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if not line.startswith("#")][1:]
    wavelengths, *matching, power = np.array([row.split("\t") for row in rows], dtype=float).T
    return wavelengths, np.stack(matching, -1), power


@cache
def observer() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths [nm] (N,), and the CIE 1931 colour-matching functions x, y, z times the power of D65 there (N, 3).

    Scaled so that their sum, which is their integral by straight lines, is `WHITE`.
    """
    wavelengths, matching, power = _tabulated()
    weights = matching * power[:, None]
    return wavelengths, weights * (WHITE / np.trapezoid(weights, wavelengths, axis=0))


def to_xyz(wavelengths: Any) -> NDArray[np.float64]:
    r"""Matrix (C, 3) that turns reflectance at C wavelengths into CIE 1931 X, Y, Z under daylight, D65.

    $$X = k \int R(\lambda)\, S(\lambda)\, \bar x(\lambda)\, d\lambda$$

    and so Y and Z. R goes in straight lines from wavelength to wavelength, and keeps its value beyond the last ones;
    S is the power of D65. A reflectance of 1 becomes `WHITE`.

    Shapes   wavelengths: (C,), C at least 2, in any order and at any distances.
    Units    wavelengths: nm.
    Error    rounding, of the integral over straight lines; S x between the tabulated nanometres is one. A sum over the
             same table at every nanometre, as colour-science makes it, is within 5e-5 of the integral.
    Source   CIE 015; ASTM E308: 360 to 780 nm, what is missing at the ends held. Tables: `data/cie_1931_d65.tsv`.
    """
    return matrix_of(wavelengths, *observer())


def matrix_of(wavelengths: Any, table: NDArray[np.float64], matching: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrix (C, 3) that turns values at C wavelengths into integrals of three weights (N, 3), which a table (N,) has.

    Values go in straight lines from wavelength to wavelength and keep on beyond the last ones, weights go in straight
    lines too.
    """
    given = np.asarray(wavelengths, dtype=float)
    if given.ndim != 1 or len(given) < 2:
        raise ShapeError(f"wavelengths: got shape {given.shape}, expected (C,), at least two wavelengths [nm]")
    order = np.argsort(given)
    at = given[order]
    if not (np.isfinite(at).all() and (np.diff(at) > 0.0).all()):
        raise ParameterError(f"wavelengths={wavelengths!r:.60}: expected numbers [nm], none of them twice")
    ends = np.unique(np.concatenate([table, at[(at > table[0]) & (at < table[-1])]]))
    width = np.diff(ends)
    # Between two ends R and S x are straight lines: Simpson's rule is exact.
    places = np.concatenate([ends[:-1], 0.5 * (ends[:-1] + ends[1:]), ends[1:]])
    share = np.concatenate([width, 4.0 * width, width]) / 6.0
    parts = np.stack([np.interp(places, table, column) for column in matching.T]) * share
    lower = np.clip(np.searchsorted(at, places, side="right") - 1, 0, len(at) - 2)
    up = np.clip((places - at[lower]) / (at[lower + 1] - at[lower]), 0.0, 1.0)
    weights = np.empty((len(at), 3))
    for column, part in zip(weights.T, parts, strict=True):
        column[order] = np.bincount(lower, part * (1.0 - up), len(at))
        column[order] += np.bincount(lower + 1, part * up, len(at))
    return weights


_DAYLIGHT_BELOW = ((300.0, 310.0, 320.0, 330.0, 340.0, 350.0), (0.0341, 3.2945, 20.236, 37.0535, 39.9488, 44.9117))
"""The relative power of D65 at wavelengths [nm] before those of the observer: CIE 015, straight lines in between."""


def daylight(wavelengths: Any) -> NDArray[np.float64]:
    """The relative power of daylight, D65, at wavelengths [nm]: 100 at 560 nm, 0 below 300 nm, from 780 nm on as there.

    Fluorescence needs the ultraviolet too, which `to_xyz` leaves out.
    """
    known, _, power = _tabulated()
    below = np.array(_DAYLIGHT_BELOW)
    x, y = np.concatenate([below, [known, power]], axis=1)
    found: NDArray[np.float64] = np.interp(np.asarray(wavelengths, dtype=float), x, y, left=0.0)
    return found


@cache
def _matching() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths [nm] (N,), and the colour-matching functions (N, 3) over the integral of y."""
    wavelengths, matching, _ = _tabulated()
    return wavelengths, matching / np.trapezoid(matching[:, 1], wavelengths)


def light_to_rgb(wavelengths: Any) -> NDArray[np.float64]:
    """Matrix (C, 3) that turns radiance at C wavelengths [nm] into linear sRGB: light of equal power 1 has Y = 1.

    As `to_xyz`, but of light itself: under lamps, white is not white.
    """
    return matrix_of(wavelengths, *_matching()) @ RGB_OF_XYZ.T


def to_rgb(wavelengths: Any) -> NDArray[np.float64]:
    """Matrix (C, 3) that turns reflectance at C wavelengths [nm] into linear sRGB under D65: `to_xyz`, as sRGB.

    A reflectance of 1 becomes (1, 1, 1). Colours more vivid than sRGB's primaries are above 1 or below 0 in a channel.
    """
    return to_xyz(wavelengths) @ RGB_OF_XYZ.T


def rgb_of(names: tuple | None) -> np.ndarray | None:
    """Matrix (C, 3) that turns channels of these names into linear sRGB: wavelengths [nm], `XYZ` or `RELATIVE_XYZ`.

    None for channels that are RGB or unknown, and for wavelengths wholly outside the visible.
    """
    if names is None or len(names) < 2:
        return None
    if tuple(names) in (XYZ, RELATIVE_XYZ):
        return (RGB_OF_XYZ * (WHITE if tuple(names) == RELATIVE_XYZ else 1.0)).T
    if isinstance(names[0], str) or max(names) < SHORTEST or min(names) > LONGEST:
        return None
    return to_rgb(names)


def transformed(values: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Channels (..., C), or one that stands for all, turned into others by a matrix (C, K): `values @ matrix`, on this
    thread alone.

    BLAS gets small products only: large ones it shares out to threads of its own, which `gn.engine.threads` does not
    limit.
    """
    count, wide = matrix.shape
    values = np.broadcast_to(values, (*values.shape[:-1], count))
    rows = max(1, _UNSHARED // matrix.size)
    flat = values.reshape(-1, count)
    whole = len(flat) // rows * rows
    out = np.empty((len(flat), wide), np.result_type(values, matrix))
    np.matmul(flat[:whole].reshape(-1, rows, count), matrix, out=out[:whole].reshape(-1, rows, wide))
    np.matmul(flat[whole:], matrix, out=out[whole:])
    return out.reshape(*values.shape[:-1], wide)
