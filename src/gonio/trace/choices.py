"""Choices that are made already: a formula of replaced directions whose result is masked needs no replacement.

Kernels give formulas the normal in place of a direction below the horizon, so that derivatives stay finite, and mask
the result by the same condition, or by one that holds wherever that does. Where nothing else is computed from the
replacement, the direction itself will do.
"""

from __future__ import annotations

from collections.abc import Sequence

from .graph import Graph


def fewer_choices(graph: Graph, outputs: Sequence[int]) -> tuple[Graph, list[int]]:
    """An equal graph, and its outputs, where a choice is left out if its result matters only where its condition does
    not hold, for where it holds others take their first sides: the second side stands in its place."""
    order = graph.reachable(outputs)
    decided = _decided(graph, order, outputs)
    if not decided:
        return graph, list(outputs)
    new, copies = Graph(), dict[int, int]()
    for node in order:
        if node in decided:
            copies[node] = copies[decided[node]]
        else:
            copies[node] = graph.copied(node, new, [copies[n] for n in graph.inputs(node)])
    return new, [copies[node] for node in outputs]


def _decided(graph: Graph, order: Sequence[int], outputs: Sequence[int]) -> dict[int, int]:
    """The choices that are made already -> the side that they take."""
    under: dict[int, list[int]] = {}
    for node in order:
        if graph.operations[node] == "select":
            under.setdefault(graph.arguments[node][0], []).append(node)
    sources = {node: graph.inputs(node) for node in order}
    loops = [n for node in order if graph.operations[node] == "loop" for n in sources[node]]  # they must end
    decided: dict[int, int] = {}
    weaker: dict[int, list[int]] = {}  # conditions that hold wherever another one does
    for condition in under:
        for part in _alternatives(graph, condition):
            weaker.setdefault(part, []).append(condition)
    for condition, choices in under.items():
        taking = [node for other in weaker[condition] for node in under[other]]
        if len(taking) < 2:
            continue
        taken = sources | {node: sources[node][:2] for node in taking}
        free = {*outputs, *loops}  # nodes whose value matters where the condition holds
        for node in reversed(order):
            if node in free:
                free.update(taken[node])
        decided.update((node, graph.arguments[node][2]) for node in choices if node not in free)
    return decided


def _alternatives(graph: Graph, condition: int) -> set[int]:
    """A condition and the parts of "or" of which one holding makes it hold."""
    parts, left = set[int](), [condition]
    while left:
        node = left.pop()
        if node not in parts:
            parts.add(node)
            left += graph.inputs(node) if graph.operations[node] == "or" else ()
    return parts
