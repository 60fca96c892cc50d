"""Places of rays on a part of a surface: 4 x 4 parts, whose results differ as those of independent surfaces do."""

from __future__ import annotations

import numpy as np


def tiles(points: np.ndarray, k: int, mirrored: bool) -> np.ndarray:
    """Points of the unit square moved into part k of 16; `mirrored`: of a surface whose halves are mirror images, into
    a part of the original and its three images."""
    column, row = k % 4, k // 4
    if not mirrored:
        return ((points + np.array([column, row], np.float32)) * np.float32(0.25)).astype(np.float32)
    twice = 2.0 * points
    whole = np.floor(twice)
    inner = (np.array([column, row], np.float32) + twice - whole) * np.float32(0.125)
    return np.where(whole > 0.0, 1.0 - inner, inner).astype(np.float32)
