"""Kinds of results of a kernel: their axes after those of the batch."""

from __future__ import annotations

from typing import Any

VALUE, SCALAR, VECTOR, TOTAL, MATRIX, PAIRS = "value", "scalar", "vector", "total", "matrix", "pairs"
"""With the channel axis; with none; with three components; a value, summed over the last axis of the batch; 4 x 4
numbers of each channel; a number for each pair of channels, the one that leaves first."""

COUNT, SQUARE = "count", "square"
"""A scalar, summed over the last axis of the batch; the square of the total of a value."""

TERMS = {TOTAL: VALUE, COUNT: SCALAR, SQUARE: VALUE}
"""Kinds of sums over the last axis of the batch -> the kind of their terms."""

SUMMED = frozenset(TERMS)


def with_channels(f: Any, axes: int) -> Any:
    """Values with a channel axis, which those of as many axes as the batch lack."""
    return f if f.ndim > axes else f[..., None]
