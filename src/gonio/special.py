"""Special functions that formulas need and array libraries lack, written with those of `ops`."""

from __future__ import annotations

import math
from typing import Any

from . import ops


def expm1_over(x: Any) -> Any:
    """(exp(x) - 1)/x, 1 at x = 0, without cancellation."""
    small = ops.absolute(x) < 1e-2
    safe = ops.where(small, 1.0, x)
    series = 1.0 + x * (1.0 / 2 + x * (1.0 / 6 + x * (1.0 / 24 + x * (1.0 / 120 + x * (1.0 / 720)))))
    return ops.where(small, series, (ops.exp(safe) - 1.0) / safe)


def log1p_over(t: Any) -> Any:
    """log(1 + t)/t, 1 at t = 0, without cancellation; t > -1."""
    small = ops.absolute(t) < 1e-2
    safe = ops.where(small, 1.0, t)
    s = ops.where(small, t, 0.0)
    series = 1.0 - s * (1.0 / 2 - s * (1.0 / 3 - s * (1.0 / 4 - s * (1.0 / 5 - s * (1.0 / 6 - s * (1.0 / 7))))))
    return ops.where(small, series, ops.log(1.0 + safe) / safe)


def sin_minus_x_cos(x: Any) -> Any:
    """sin(x) - x cos(x), about x^3/3, without cancellation."""
    small = ops.absolute(x) < 0.7
    s = ops.where(small, x, 0.0)
    s2, series = s * s, 0.0 * s
    for n in (7, 6, 5, 4, 3, 2, 1):
        series = (-1.0) ** (n + 1) * 2.0 * n / math.factorial(2 * n + 1) + s2 * series
    return ops.where(small, s * s2 * series, ops.sin(x) - x * ops.cos(x))


def less_fifth_power(x: Any) -> Any:
    """1 - (1 - x)^5, without cancellation where x is small."""
    return x * (5.0 - x * (10.0 - x * (10.0 - x * (5.0 - x))))
