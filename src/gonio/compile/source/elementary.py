"""Elementary functions that languages lack, or have with too few digits, as formulas of sums, products and roots.

Each is written with `ops` and so becomes a graph, which any language writes as a function. The polynomials are those of
compiled kernels in float32.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from ...arrays import ops
from ...trace.graph import Graph
from ...trace.symbol import Symbol
from ..llvm.elementary import angles, error_function
from ..llvm.lanes import FLOAT32


def _polynomial(x: Any, coefficients: Sequence[float]) -> Any:
    """c0 + x (c1 + x (c2 + ...))."""
    *rest, total = coefficients
    for c in reversed(rest):
        total = total * x + c
    return total


def _signed(magnitude: Any, like: Any) -> Any:
    return ops.where(like < 0.0, -magnitude, magnitude)


def _sine_of_turns(a: Any) -> Any:
    return a * _polynomial(a * a, angles.SIN_TURN[FLOAT32])


def sin_turn(x: Any) -> Any:
    """Sine of x turns."""
    r = x - ops.floor(x + 0.5)
    magnitude = ops.absolute(r)
    return _signed(_sine_of_turns(ops.minimum(magnitude, 0.5 - magnitude)), r)


def cos_turn(x: Any) -> Any:
    """Cosine of x turns."""
    return _sine_of_turns(0.25 - ops.absolute(x - ops.floor(x + 0.5)))


_TURN = 0.15915494309189535
_REMAINDER = (6.28125, 0.0019353071795864769)
"""2 pi as a number of few digits, whose multiples are exact, and the rest."""


def _turns(x: Any) -> Any:
    """x less whole turns, in turns."""
    n = ops.floor(x * _TURN + 0.5)
    return ((x - n * _REMAINDER[0]) - n * _REMAINDER[1]) * _TURN


def sin(x: Any) -> Any:
    """Sine."""
    return sin_turn(_turns(x))


def cos(x: Any) -> Any:
    """Cosine."""
    return cos_turn(_turns(x))


def tan(x: Any) -> Any:
    """Tangent."""
    return sin(x) / cos(x)


_EXP = (1.0, 1.0, 0.5, 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040)
_LOG_2 = (0.693145751953125, 1.4286068203094172e-06)
"""log 2 as a number of few digits, whose multiples are exact, and the rest."""


def exp(x: Any) -> Any:
    """Exponential: those of shaders lose digits with the size of x, but for powers of 2."""
    x = ops.minimum(ops.maximum(x, -150.0), 90.0)
    n = ops.floor(x * (1.0 / math.log(2.0)) + 0.5)
    r = (x - n * _LOG_2[0]) - n * _LOG_2[1]
    return _polynomial(r, _EXP) * ops.exp(n)


def log(x: Any) -> Any:
    """Natural logarithm: near 1, where those of shaders keep few digits, 2 artanh((x - 1)/(x + 1))."""
    s = (x - 1.0) / (x + 1.0)
    z = s * s
    near = 2.0 * s * (1.0 + z * (1 / 3 + z * (1 / 5 + z * (1 / 7 + z * (1 / 9 + z * (1 / 11))))))
    return ops.where(ops.absolute(s) < 0.2, near, ops.log(x))


def power(x: Any, y: Any) -> Any:
    """x to the y for x >= 0."""
    return ops.where(x > 0.0, ops.exp(y * ops.log(x)), ops.where(y > 0.0, 0.0, 1.0))


def arccos(x: Any) -> Any:
    """Inverse cosine."""
    magnitude = ops.absolute(x)
    outer = magnitude >= 0.5
    z = ops.where(outer, ops.maximum(0.5 - 0.5 * magnitude, 0.0), x * x)
    s = _signed(ops.where(outer, ops.sqrt(z), magnitude), x)
    arcsin = s + s * z * _polynomial(z, angles.ARCSIN[FLOAT32])
    return ops.where(outer, ops.where(x < 0.0, math.pi, 0.0) + 2.0 * arcsin, math.pi / 2 - arcsin)


def arctan2(y: Any, x: Any) -> Any:
    """Angle of (x, y)."""
    ax, ay = ops.absolute(x), ops.absolute(y)
    a, b = ops.maximum(ax, ay), ops.minimum(ax, ay)
    near = b > 0.5 * a
    bottom = ops.where(near, b + a, a)
    t = ops.where(near, b - a, b) / ops.where(bottom > 0.0, bottom, 1.0)
    z = t * t
    r = t + t * z * _polynomial(z, angles.ARCTAN[FLOAT32]) + ops.where(near, math.pi / 4, 0.0)
    r = ops.where(ay > ax, math.pi / 2 - r, r)
    return _signed(ops.where(x < 0.0, math.pi - r, r), y)


def erf(x: Any) -> Any:
    """Error function."""
    end, centre = error_function.ERF_END[FLOAT32], error_function.ERF_CENTRE[FLOAT32]
    magnitude = ops.minimum(ops.absolute(x), end)
    root = _polynomial(magnitude - centre, error_function.ERF_FAR[FLOAT32])
    square = root * root
    near = x + x * _polynomial(x * x, error_function.ERF_NEAR[FLOAT32])
    return ops.where(magnitude < 1.125, near, _signed(1.0 - square * square, x))


def erfinv(x: Any) -> Any:
    """Inverse of the error function."""
    centre, tail = error_function.ERFINV_CENTRE[FLOAT32], error_function.ERFINV_TAIL_CENTRE[FLOAT32]
    w = -ops.log((1.0 - x) * (1.0 + x))
    near = 0.5 * math.sqrt(math.pi) + w * _polynomial(w - centre, error_function.ERFINV_NEAR[FLOAT32])
    far = _polynomial(ops.sqrt(ops.maximum(w, 0.0)) - tail, error_function.ERFINV_TAIL[FLOAT32])
    return x * ops.where(w < 2.0 * centre, near, far)


def ierfc(x: Any) -> Any:
    """Integral of 1 - erf from x to infinity."""
    root = _polynomial(x, error_function.IERFC[FLOAT32])
    square = root * root
    return ops.where(x >= error_function.IERFC_END[FLOAT32], 0.0, square * square)


FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: formula for name, formula in tuple(globals().items()) if name in ops.ELEMENTARY
}
"""Operation -> its formula: those of `ops` that stand above."""


@cache
def graph_of(operation: str) -> tuple[Graph, int, tuple[str, ...]]:
    """The graph of a function, its result, and its arguments: loads (i, 0)."""
    names, graph = ops.ELEMENTARY[operation].arguments, Graph()
    result = FUNCTIONS[operation](*(Symbol(graph, graph.load(i, 0)) for i in range(len(names))))
    return graph, result.node, names
