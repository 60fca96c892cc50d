"""Kinds of results of a kernel: their axes after those of the batch."""

from __future__ import annotations

from typing import Any

VALUE, SCALAR, VECTOR, TOTAL = "value", "scalar", "vector", "total"
"""With the channel axis; with none; with three components; a value, summed over the last axis of the batch."""


def with_channels(f: Any, axes: int) -> Any:
    """Values with a channel axis, which those of as many axes as the batch lack."""
    return f if f.ndim > axes else f[..., None]
