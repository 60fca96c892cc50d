"""Sums and products that leave out exact zeros and ones: what is known to vanish costs nothing in a formula."""

from __future__ import annotations

from typing import Any

_EXACT = (int, float)


def is_zero(x: Any) -> bool:
    """Whether x is Python's own 0: written so in a formula, and no value that happens to be 0."""
    return type(x) in _EXACT and x == 0


def _is_one(x: Any) -> bool:
    return type(x) in _EXACT and x == 1


def plus(a: Any, b: Any) -> Any:
    """a + b."""
    return b if is_zero(a) else a if is_zero(b) else a + b


def minus(a: Any, b: Any) -> Any:
    """a - b."""
    return a if is_zero(b) else -b if is_zero(a) else a - b


def times(a: Any, b: Any) -> Any:
    """a b."""
    if is_zero(a) or is_zero(b):
        return 0.0
    return b if _is_one(a) else a if _is_one(b) else a * b


def like(x: Any, other: Any) -> Any:
    """x, as an array or symbol where the other is one: for functions that take no plain numbers."""
    return x + 0.0 * other if type(x) in _EXACT else x
