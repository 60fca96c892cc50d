"""Directions drawn from tables of cells of equal or known projected solid angle, constant within a cell."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import ops
from ..geometry import Direction

COSINE_SHARE = 0.1
"""Share of the samples that is cosine-distributed: weights are at most 10 pi f."""


def chances(weights: np.ndarray, solid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Probability per projected solid angle [1/sr] of cells, and the sums of probabilities before each, for rows.

    weights  (rows, cells), not negative: value times projected solid angle; rows of zeros are drawn by the cosine
    solid    (cells,) projected solid angles [sr], pi in all
    Shapes   densities: (rows, cells); sums: (rows, cells).
    """
    total = weights.sum(axis=1, keepdims=True)
    by_cosine = solid / solid.sum()
    shares = np.where(total > 0.0, weights / np.where(total > 0.0, total, 1.0), by_cosine)
    probability = (1.0 - COSINE_SHARE) * shares + COSINE_SHARE * by_cosine
    before = np.zeros(probability.shape)
    np.cumsum(probability[:, :-1], axis=1, out=before[:, 1:])
    return probability / solid, before


def magnitude(values: np.ndarray) -> np.ndarray:
    """|f| as samples are drawn by: 0 where there is no number, and never so large that sums overflow."""
    return np.minimum(np.abs(np.where(np.isfinite(values), values, 0.0)), 1e100)


def choose(before: Any, start: Any, count: int, u: Any) -> tuple[Any, Any]:
    """The cell that the uniform number u falls into, and where in it, from 0 to 1.

    before  sums of probabilities, flat; `start` is where the row of `count` cells begins.
    """
    cell = ops.to_index(0.0 * u)
    step = 1 << (max(count - 1, 1).bit_length() - 1)
    while step:
        further = ops.minimum(cell + step, count - 1)
        cell = ops.where(ops.take(before, start + further) <= u, further, cell)
        step >>= 1
    low = ops.take(before, start + cell)
    is_last = cell > count - 2
    high = ops.where(is_last, 1.0, ops.take(before, start + ops.where(is_last, cell, cell + 1)))
    return cell, ops.clip((u - low) / (high - low), 0.0, 1.0)


def lifted(x: Any, y: Any) -> Direction:
    """The direction above a point of the unit disc."""
    return Direction(x, y, ops.sqrt(ops.maximum(1.0 - x * x - y * y, 1e-20)))
