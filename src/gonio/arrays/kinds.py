"""Kinds of results of a kernel: their axes after those of the batch."""

from __future__ import annotations

VALUE, SCALAR, VECTOR, TOTAL = "value", "scalar", "vector", "total"
"""With the channel axis; with none; with three components; a value, summed over the last axis of the batch."""
