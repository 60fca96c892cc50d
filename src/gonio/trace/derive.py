"""Exact derivatives of a graph, by reverse accumulation: the chain rule from an output back to everything it reads."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from .graph import REAL, Graph

Builder = Callable[..., int]


def gradient(graph: Graph, output: int, inputs: Sequence[int]) -> list[int]:
    """Nodes of the derivatives of `output` with respect to the nodes `inputs`, added to the graph.

    A choice passes the derivative of the side that is chosen; floor, comparisons, table entries and what is stopped
    have derivative 0; so has a minimum or maximum on the side that is not taken (at a tie, the first side is).
    """
    apply, constant = graph.apply, graph.constant
    order = _between(graph, output, inputs)
    sums: dict[int, int] = {output: constant(1.0)}
    for node in reversed(order):
        slope = sums.get(node)
        if slope is None or (node in inputs and node != output):
            continue
        rule = _RULES.get(graph.operations[node])
        if rule is None:
            continue
        for source, term in rule(graph, node, slope):
            if source in sums:
                sums[source] = apply("add", sums[source], term)
            else:
                sums[source] = term
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


Terms = list[tuple[int, int]]


def _unary(derivative: Callable[[Builder, Builder, int, int], int]) -> Callable[[Graph, int, int], Terms]:
    """A rule from the derivative of a function of one number: (apply, constant, argument, result) -> node."""

    def rule(graph: Graph, node: int, slope: int) -> Terms:
        (x,) = graph.arguments[node]
        return [(x, graph.apply("mul", slope, derivative(graph.apply, graph.constant, x, node)))]

    return rule


def _add(graph: Graph, node: int, slope: int) -> Terms:
    return [(x, slope) for x in graph.arguments[node]]


def _sub(graph: Graph, node: int, slope: int) -> Terms:
    x, y = graph.arguments[node]
    return [(x, slope), (y, graph.apply("neg", slope))]


def _mul(graph: Graph, node: int, slope: int) -> Terms:
    x, y = graph.arguments[node]
    return [(x, graph.apply("mul", slope, y)), (y, graph.apply("mul", slope, x))]


def _div(graph: Graph, node: int, slope: int) -> Terms:
    x, y = graph.arguments[node]
    part = graph.apply("div", slope, y)
    return [(x, part), (y, graph.apply("neg", graph.apply("mul", part, node)))]


def _neg(graph: Graph, node: int, slope: int) -> Terms:
    return [(graph.arguments[node][0], graph.apply("neg", slope))]


def _select(graph: Graph, node: int, slope: int) -> Terms:
    condition, a, b = graph.arguments[node]
    if graph.kinds[node] != REAL:
        return []
    zero = graph.constant(0.0)
    return [(a, graph.apply("select", condition, slope, zero)), (b, graph.apply("select", condition, zero, slope))]


def _extremum(comparison: str) -> Callable[[Graph, int, int], Terms]:
    def rule(graph: Graph, node: int, slope: int) -> Terms:
        a, b = graph.arguments[node]
        if graph.kinds[node] != REAL:
            return []
        zero, first = graph.constant(0.0), graph.apply(comparison, a, b)
        return [(a, graph.apply("select", first, slope, zero)), (b, graph.apply("select", first, zero, slope))]

    return rule


def _power(graph: Graph, node: int, slope: int) -> Terms:
    apply = graph.apply
    x, y = graph.arguments[node]
    by_x = apply("mul", y, apply("power", x, apply("sub", y, graph.constant(1.0))))
    by_y = apply("mul", node, apply("log", x))
    return [(x, apply("mul", slope, by_x)), (y, apply("mul", slope, by_y))]


def _arctan2(graph: Graph, node: int, slope: int) -> Terms:
    apply = graph.apply
    y, x = graph.arguments[node]
    part = apply("div", slope, apply("add", apply("mul", x, x), apply("mul", y, y)))
    return [(y, apply("mul", part, x)), (x, apply("neg", apply("mul", part, y)))]


_RULES: dict[str, Callable[[Graph, int, int], Terms]] = {
    "add": _add,
    "sub": _sub,
    "mul": _mul,
    "div": _div,
    "neg": _neg,
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
    "arccos": _unary(
        lambda do, number, x, r: do("div", number(-1.0), do("sqrt", do("sub", number(1.0), do("mul", x, x))))
    ),
    "erf": _unary(
        lambda do, number, x, r: do("mul", number(2.0 / math.sqrt(math.pi)), do("exp", do("neg", do("mul", x, x))))
    ),
    "erfinv": _unary(lambda do, number, x, r: do("mul", number(0.5 * math.sqrt(math.pi)), do("exp", do("mul", r, r)))),
    "absolute": _unary(lambda do, number, x, r: do("select", do("lt", x, number(0.0)), number(-1.0), number(1.0))),
}
