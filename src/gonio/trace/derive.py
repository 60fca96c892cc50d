"""Exact derivatives of a graph, by reverse accumulation: the chain rule from an output back to everything it reads."""

from __future__ import annotations

from collections.abc import Sequence

from ..arrays.ops import OPERATIONS
from .graph import REAL, Graph


def gradient(graph: Graph, output: int, inputs: Sequence[int]) -> list[int]:
    """Nodes of the derivatives of `output` with respect to the nodes `inputs`, added to the graph.

    A choice passes the derivative of the chosen side; floor, comparisons, table entries and stopped gradients have
    derivative 0; so has a minimum or maximum by the side that is not taken (at a tie, the first is taken).
    """
    apply, constant = graph.apply, graph.constant
    sums: dict[int, int] = {output: constant(1.0)}
    for node in reversed(_between(graph, output, inputs)):
        slope, rule = sums.get(node), OPERATIONS[graph.operations[node]].derivative
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
