"""Evaluation of a graph on NumPy arrays, node by node: what compiled kernels are held against."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import ops
from ..trace.graph import INDEX, MASK, Graph

_OPERATORS: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": operator.neg,
    "and": operator.and_,
    "or": operator.or_,
    "xor": operator.xor,
    **{name: getattr(operator, name) for name in ("lt", "le", "gt", "ge", "eq", "ne")},
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
            kind = graph.kinds[node]
            values[node] = np.bool_(arguments[0]) if kind == MASK else np.asarray(arguments[0], _dtype(kind, dtype))[()]
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


def _dtype(kind: str, dtype: Any) -> Any:
    return np.intp if kind == INDEX else dtype
