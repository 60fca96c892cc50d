"""Evaluation of a graph on NumPy arrays, node by node: the reference for compiled kernels."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import ops
from ..trace.graph import COMPARISONS, INDEX, MASK, Graph

_OPERATORS: dict[str, Callable[..., Any]] = {
    **{name: getattr(operator, name) for name in ("add", "sub", "mul", "neg", "xor", *COMPARISONS)},
    "div": operator.truediv,
    "and": operator.and_,
    "or": operator.or_,
    "select": np.where,
    "stop": lambda x: x,
}


def evaluate(
    graph: Graph, outputs: Sequence[int], load: Callable[[int, int], Any], tables: Sequence[np.ndarray], dtype: Any
) -> list[Any]:
    """Values of the nodes `outputs`; `load(array, component)` gives the inputs, as arrays of `dtype` that broadcast."""
    values: dict[int, Any] = {}
    order = graph.reachable(outputs)
    last = {source: node for node in order for source in graph.inputs(node)}
    kept = set(outputs)
    for node in order:
        operation, arguments = graph.operations[node], graph.arguments[node]
        if operation == "constant":
            values[node] = np.asarray(arguments[0], {MASK: bool, INDEX: np.intp}.get(graph.kinds[node], dtype))[()]
        elif operation == "load":
            values[node] = load(*arguments)
        elif operation == "take":
            values[node] = np.take(tables[arguments[0]], values[arguments[1]], mode="clip")
        elif operation == "to_real":
            values[node] = np.asarray(values[arguments[0]], dtype)[()]
        else:
            function = _OPERATORS.get(operation) or getattr(ops, operation)
            values[node] = function(*(values[a] for a in arguments))
        for source in set(graph.inputs(node)):
            if last[source] == node and source not in kept:
                del values[source]
    return [values[node] for node in outputs]
