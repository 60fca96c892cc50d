"""A graph as a sum of products: factors that depend on some arrays alone, times factors that depend on others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

from ..arrays.ops import OPERATIONS
from .graph import Graph

MOST = 32
"""Products that a sum may have on the way."""

Pair = tuple[int, int]
"""The two factors of a product: nodes of a graph."""


def separated(graph: Graph, output: int, first: Collection[int], second: Collection[int]) -> list[Pair] | None:
    """Pairs of nodes (a, g), added to the graph, with output = sum of a g: a depends on no array number of `second`, g
    on none of `first`. What depends on neither may be in both.

    None where the graph is not written as such a sum (the square root of a product is not), or as one of more than
    `MOST` products.
    """
    one = graph.constant(1.0)
    on_first, on_second = (_dependent(graph, output, arrays) for arrays in (first, second))
    sums: dict[int, list[Pair]] = {}

    def pairs(node: int) -> list[Pair]:
        return sums.get(node) or [(node, one) if node in on_first else (one, node)]

    for node in graph.reachable([output]):
        if node in on_first and node in on_second:
            rule = _RULES.get(graph.operations[node])
            products = rule and rule(graph, *map(pairs, graph.inputs(node)))
            if not products:
                return None
            sums[node] = _joined(graph, products)
            if len(sums[node]) > MOST:
                return None
    exchanged = _joined(graph, [(g, a) for a, g in pairs(output)])
    return [(a, g) for g, a in exchanged]


def _dependent(graph: Graph, output: int, arrays: Collection[int]) -> set[int]:
    """The nodes that depend on any of some arrays."""
    dependent: set[int] = set()
    for node in graph.reachable([output]):
        loaded = graph.operations[node] == "load" and graph.arguments[node][0] in arrays
        if loaded or any(source in dependent for source in graph.inputs(node)):
            dependent.add(node)
    return dependent


def _joined(graph: Graph, pairs: Iterable[Pair]) -> list[Pair]:
    """The pairs with equal first factors as one, with the sum of their second ones."""
    sums: dict[int, int] = {}
    for a, g in pairs:
        sums[a] = graph.apply("add", sums[a], g) if a in sums else g
    return list(sums.items())


Rule = Callable[..., list[Pair] | None]
"""(graph, the pairs of each argument) -> the pairs of the result; None where it is no sum of products."""


def _add(graph: Graph, x: list[Pair], y: list[Pair]) -> list[Pair]:
    return x + y


def _neg(graph: Graph, x: list[Pair]) -> list[Pair]:
    return [(a, graph.apply("neg", g)) for a, g in x]


def _mul(graph: Graph, x: list[Pair], y: list[Pair]) -> list[Pair] | None:
    if len(x) * len(y) > MOST:
        return None
    return [(graph.apply("mul", a, b), graph.apply("mul", g, h)) for a, g in x for b, h in y]


def _div(graph: Graph, x: list[Pair], y: list[Pair]) -> list[Pair] | None:
    if len(y) > 1:
        return None
    ((b, h),) = y
    return [(graph.apply("div", a, b), graph.apply("div", g, h)) for a, g in x]


def _select(graph: Graph, condition: list[Pair], x: list[Pair], y: list[Pair]) -> list[Pair] | None:
    ((by_first, by_second),) = condition  # a mask is no sum: it depends on arrays of one kind
    one, zero = graph.constant(1.0), graph.constant(0.0)

    def kept(pair: Pair, left: bool) -> Pair:
        a, g = pair
        chosen = (lambda node: (node, zero)) if left else (lambda node: (zero, node))
        if by_first == one:
            return a, graph.apply("select", by_second, *chosen(g))
        return graph.apply("select", by_first, *chosen(a)), g

    return [kept(pair, True) for pair in x] + [kept(pair, False) for pair in y]


def _multiplicative(name: str) -> Rule:
    return lambda graph, x: [(graph.apply(name, a), graph.apply(name, g)) for a, g in x] if len(x) == 1 else None


_RULES: dict[str, Rule] = {
    "add": _add,
    "sub": lambda graph, x, y: x + _neg(graph, y),
    "neg": _neg,
    "mul": _mul,
    "div": _div,
    "select": _select,
    "stop": lambda graph, x: x,
    **{name: _multiplicative(name) for name, row in OPERATIONS.items() if row.multiplicative},
}
