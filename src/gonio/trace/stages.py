"""A graph in two stages: what does not depend on some arrays is computed first, once for all of their entries."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from .graph import INDEX, MASK, Graph


class Stages(NamedTuple):
    """The first stage are nodes of the graph, reals; the second is a graph of its own, which loads them.

    In the second the arrays that inputs bring keep their numbers, then come those of the first stage, one number for
    each element, then all others.
    """

    first: tuple[int, ...]
    saved: int  # operations of the first stage
    second: Graph
    outputs: tuple[int, ...]  # nodes of the second graph


_KNOWN: WeakKeyDictionary[Graph, dict[Any, Stages]] = WeakKeyDictionary()


def stages(
    graph: Graph, outputs: Sequence[int], inputs: int, within: Collection[int], around: Collection[int]
) -> Stages:
    """A computation for arrays `within`, which change fastest, and arrays `around`, among these the first `inputs`.

    What depends on arrays around and on none within is the first stage. Kept with the graph.
    """
    kept = _KNOWN.setdefault(graph, {})
    key = (tuple(outputs), inputs, tuple(within), tuple(around))
    if key not in kept:
        kept[key] = _divided(graph, *key)
    return kept[key]


def _divided(
    graph: Graph, outputs: Sequence[int], inputs: int, within: Collection[int], around: Collection[int]
) -> Stages:
    order = graph.reachable(outputs)
    on_within, on_around = (_dependent(graph, order, arrays) for arrays in (within, around))
    wanted, late, cut = set(outputs), [], []
    for node in reversed(order):
        if node not in wanted:
            continue
        early = node in on_around and node not in on_within
        # Places in tables stay whole numbers, which float32 may not hold: the second stage computes them again.
        if early and graph.operations[node] != "load" and graph.kinds[node] != INDEX:
            cut.append(node)
        else:
            late.append(node)
            wanted.update(graph.inputs(node))
    first = tuple(_as_real(graph, node) for node in cut)
    second, new = Graph(), {}
    for i, node in enumerate(cut):
        number = second.load(inputs + i, 0)
        mask = graph.kinds[node] == MASK
        new[node] = second.apply("ne", number, second.constant(0.0)) if mask else number
    for node in reversed(late):
        operation, arguments = graph.operations[node], graph.arguments[node]
        if operation == "load":
            k, component = arguments
            new[node] = second.load(k if k < inputs else k + len(cut), component)
        elif operation == "constant":
            new[node] = second.constant(arguments[0], graph.kinds[node])
        elif operation == "take":
            new[node] = second.take(arguments[0], new[arguments[1]])
        else:
            new[node] = second.apply(operation, *(new[source] for source in arguments))
    return Stages(first, len(graph.reachable(cut)), second, tuple(new[node] for node in outputs))


def _as_real(graph: Graph, node: int) -> int:
    if graph.kinds[node] == MASK:
        return graph.apply("select", node, graph.constant(1.0), graph.constant(0.0))
    return node


def _dependent(graph: Graph, order: Sequence[int], arrays: Collection[int]) -> set[int]:
    """The nodes that depend on any of some arrays."""
    found: set[int] = set()
    for node in order:
        loaded = graph.operations[node] == "load" and graph.arguments[node][0] in arrays
        if loaded or any(source in found for source in graph.inputs(node)):
            found.add(node)
    return found
