"""Exact derivatives of a graph, by reverse accumulation: the chain rule from an output back to everything it reads."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from .graph import REAL, Graph

Builder = Callable[..., int]


def gradient(graph: Graph, output: int, inputs: Sequence[int]) -> list[int]:
    """Nodes of the derivatives of `output` with respect to the nodes `inputs`, added to the graph.

    A choice passes the derivative of the chosen side; floor, comparisons, table entries and stopped gradients have
    derivative 0; so has a minimum or maximum by the side that is not taken (at a tie, the first is taken).
    """
    apply, constant = graph.apply, graph.constant
    sums: dict[int, int] = {output: constant(1.0)}
    for node in reversed(_between(graph, output, inputs)):
        slope, rule = sums.get(node), _RULES.get(graph.operations[node])
        if slope is None or rule is None or graph.kinds[node] != REAL or (node in inputs and node != output):
            continue
        arguments = graph.arguments[node]
        for source, term in zip(arguments, rule(apply, constant, slope, node, *arguments), strict=True):
            if term is not None:
                sums[source] = apply("add", sums[source], term) if source in sums else term
    zero = constant(0.0)
    return [sums.get(node, zero) for node in inputs]


def _between(graph: Graph, output: int, inputs: Sequence[int]) -> list[int]:
    """Nodes that `output` depends on and that depend on `inputs`, in order."""
    between: set[int] = set(inputs)
    order = []
    for node in graph.reachable([output]):
        if node in between or any(source in between for source in graph.inputs(node)):
            between.add(node)
            order.append(node)
    return order


Terms = Sequence[int | None]
Rule = Callable[..., Terms]
"""(apply, constant, slope, result, *arguments) -> the slope times the derivative by each argument."""


def _unary(derivative: Callable[[Builder, Builder, int, int], int]) -> Rule:
    """A rule from the derivative of a function of one number: (apply, constant, argument, result) -> node."""
    return lambda do, number, slope, r, x: [do("mul", slope, derivative(do, number, x, r))]


def _div(do: Builder, number: Builder, slope: int, r: int, x: int, y: int) -> Terms:
    part = do("div", slope, y)
    return part, do("neg", do("mul", part, r))


def _select(do: Builder, number: Builder, slope: int, r: int, condition: int, *_: int) -> Terms:
    zero = number(0.0)
    return None, do("select", condition, slope, zero), do("select", condition, zero, slope)


def _extremum(comparison: str) -> Rule:
    def rule(do: Builder, number: Builder, slope: int, r: int, a: int, b: int) -> Terms:
        zero, first = number(0.0), do(comparison, a, b)
        return do("select", first, slope, zero), do("select", first, zero, slope)

    return rule


def _power(do: Builder, number: Builder, slope: int, r: int, x: int, y: int) -> Terms:
    by_x = do("mul", y, do("power", x, do("sub", y, number(1.0))))
    by_y = do("mul", r, do("log", x))
    return do("mul", slope, by_x), do("mul", slope, by_y)


def _arctan2(do: Builder, number: Builder, slope: int, r: int, y: int, x: int) -> Terms:
    part = do("div", slope, do("add", do("mul", x, x), do("mul", y, y)))
    return do("mul", part, x), do("neg", do("mul", part, y))


_RULES: dict[str, Rule] = {
    "add": lambda do, number, slope, r, x, y: (slope, slope),
    "sub": lambda do, number, slope, r, x, y: (slope, do("neg", slope)),
    "mul": lambda do, number, slope, r, x, y: (do("mul", slope, y), do("mul", slope, x)),
    "neg": lambda do, number, slope, r, x: (do("neg", slope),),
    "div": _div,
    "select": _select,
    "minimum": _extremum("le"),
    "maximum": _extremum("ge"),
    "power": _power,
    "arctan2": _arctan2,
    "sqrt": _unary(lambda do, number, x, r: do("div", number(0.5), r)),
    "exp": _unary(lambda do, number, x, r: r),
    "log": _unary(lambda do, number, x, r: do("div", number(1.0), x)),
    "sin": _unary(lambda do, number, x, r: do("cos", x)),
    "cos": _unary(lambda do, number, x, r: do("neg", do("sin", x))),
    "tan": _unary(lambda do, number, x, r: do("add", number(1.0), do("mul", r, r))),
    "sin_turn": _unary(lambda do, number, x, r: do("mul", number(2.0 * math.pi), do("cos_turn", x))),
    "cos_turn": _unary(lambda do, number, x, r: do("mul", number(-2.0 * math.pi), do("sin_turn", x))),
    "arccos": _unary(
        lambda do, number, x, r: do("div", number(-1.0), do("sqrt", do("sub", number(1.0), do("mul", x, x))))
    ),
    "erf": _unary(
        lambda do, number, x, r: do("mul", number(2.0 / math.sqrt(math.pi)), do("exp", do("neg", do("mul", x, x))))
    ),
    "erfinv": _unary(lambda do, number, x, r: do("mul", number(0.5 * math.sqrt(math.pi)), do("exp", do("mul", r, r)))),
    "ierfc": _unary(lambda do, number, x, r: do("sub", do("erf", x), number(1.0))),
    "absolute": _unary(lambda do, number, x, r: do("select", do("lt", x, number(0.0)), number(-1.0), number(1.0))),
}
