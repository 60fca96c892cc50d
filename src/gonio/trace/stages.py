"""A graph in two stages: what does not depend on some arrays is computed first, once for all of their entries."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

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


def stages(
    graph: Graph, outputs: Sequence[int], inputs: int, within: Collection[int], around: Collection[int]
) -> Stages:
    """A computation for arrays `within`, which change fastest, and arrays `around`, among these the first `inputs`.

    What depends on arrays around and on none within is the first stage.
    """
    order = graph.reachable(outputs)
    on_within, on_around = (_dependent(graph, order, arrays) for arrays in (within, around))
    early = [node for node in order if node in on_around and node not in on_within]
    late = {node for node in order if node not in on_around or node in on_within}
    wanted = {source for node in late for source in graph.inputs(node)} | set(outputs)
    cut = [node for node in early if node in wanted and graph.operations[node] != "load"]
    first = tuple(_as_real(graph, node) for node in cut)
    places = {node: inputs + i for i, node in enumerate(cut)}
    second, new = Graph(), {}
    for node in order:
        operation, arguments, kind = graph.operations[node], graph.arguments[node], graph.kinds[node]
        if node in places:
            number = second.load(places[node], 0)
            if kind == MASK:
                number = second.apply("ne", number, second.constant(0.0))
            elif kind == INDEX:
                number = second.apply("to_index", number)
            new[node] = number
        elif operation == "load":
            k, component = arguments
            new[node] = second.load(k if k < inputs else k + len(cut), component)
        elif node not in late:
            continue
        elif operation == "constant":
            new[node] = second.constant(arguments[0], kind)
        elif operation == "take":
            new[node] = second.take(arguments[0], new[arguments[1]])
        else:
            new[node] = second.apply(operation, *(new[source] for source in arguments))
    saved = len(graph.reachable(cut))
    return Stages(first, saved, second, tuple(new[node] for node in outputs))


def _as_real(graph: Graph, node: int) -> int:
    if graph.kinds[node] == MASK:
        return graph.apply("select", node, graph.constant(1.0), graph.constant(0.0))
    return graph.apply("to_real", node) if graph.kinds[node] == INDEX else node


def _dependent(graph: Graph, order: Sequence[int], arrays: Collection[int]) -> set[int]:
    """The nodes that depend on any of some arrays."""
    found: set[int] = set()
    for node in order:
        loaded = graph.operations[node] == "load" and graph.arguments[node][0] in arrays
        if loaded or any(source in found for source in graph.inputs(node)):
            found.add(node)
    return found
