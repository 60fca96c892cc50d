"""Colours that are stored as luminance Y and, at every second row and column, chroma RY = (R - Y)/Y, BY = (B - Y)/Y.

Source   "Technical Introduction to OpenEXR", luminance/chroma images; taps, and what is done where a filter of chroma
         overshoots: OpenEXR's own reader of such files (ImfRgbaYca.cpp).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...errors import FormatError

NAMES = ("BY", "RY", "Y")

_TAPS = np.array([0.002128, -0.007540, 0.019597, -0.043159, 0.087929, -0.186077, 0.627123], np.float32)


def weights(primaries: Sequence[float]) -> NDArray[np.float64]:
    """What red, green and blue count in Y, by the chromaticities x, y of these and of white."""
    x, y = np.reshape(primaries, (4, 2)).astype(float).T
    columns = np.stack([x, y, 1.0 - x - y])
    found: NDArray[np.float64] = y[:3] * np.linalg.solve(columns[:, :3], columns[:, 3] / y[3])
    if not (np.isfinite(found).all() and found[1] > 0.0):
        raise FormatError(f"chromaticities are {np.round(primaries, 4).tolist()}, expected those of colours")
    return found


def colours(
    Y: NDArray[np.float32], RY: NDArray[np.float32], BY: NDArray[np.float32], share: NDArray[np.float64]
) -> NDArray[np.float32]:
    """R, G, B (3, H, W) of luminance (H, W) and chroma; `share`: what R, G, B count in Y."""
    height, width = Y.shape
    red, blue = (_filled(_filled(c, height, 0), width, 1) for c in (RY, BY))
    w = share.astype(np.float32)
    rgb = np.empty((3, height, width), np.float32)
    rgb[0], rgb[2] = (red + 1.0) * Y, (blue + 1.0) * Y
    rgb[1] = np.where((red == 0.0) & (blue == 0.0), Y, (Y - w[0] * rgb[0] - w[2] * rgb[2]) / w[1])
    return _settled(rgb, w)


def _filled(c: NDArray[np.float32], count: int, axis: int) -> NDArray[np.float32]:
    """Chroma at every row or column, of that at every second one."""
    c = np.moveaxis(c, axis, 0)
    full = np.empty((count, *c.shape[1:]), np.float32)
    full[::2] = c
    between = full[1::2]
    between[:] = 0.0
    k = np.arange(len(between))
    for away, tap in enumerate(_TAPS[::-1]):
        between += tap * (c[np.maximum(k - away, 0)] + c[np.minimum(k + 1 + away, len(c) - 1)])
    return np.moveaxis(full, 0, axis)


def _settled(rgb: NDArray[np.float32], w: NDArray[np.float32]) -> NDArray[np.float32]:
    """Colours that are much more saturated than those diagonally beside them, less so, at the same luminance."""
    most = rgb.max(axis=0)
    s = np.where(most > 0.0, 1.0 - rgb.min(axis=0) / np.where(most > 0.0, most, 1.0), 0.0)
    around = np.pad(s, 1, mode="edge")
    mean = np.minimum(1.0, 0.25 * (around[:-2, :-2] + around[:-2, 2:] + around[2:, :-2] + around[2:, 2:]))
    bound = np.minimum(1.0, 0.75 + 0.25 * mean)
    odd = (s > mean) & (s > bound)
    before, top = rgb[:, odd], most[odd]
    after = np.maximum(top - (top - before) * (bound[odd] / s[odd]), 0.0)
    light = w @ after
    rgb[:, odd] = after * np.where(light > 0.0, (w @ before) / np.where(light > 0.0, light, 1.0), 1.0)
    return rgb
