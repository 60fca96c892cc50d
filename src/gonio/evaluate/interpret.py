"""Evaluation of a graph on NumPy arrays, node by node: the reference for compiled kernels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.operations import OPERATORS
from ..arrays.packets import shot
from ..trace.graph import INDEX, MASK, Graph

_OPERATORS: dict[str, Callable[..., Any]] = {**OPERATORS, "select": np.where, "stop": lambda x: x}


def evaluate(
    graph: Graph, outputs: Sequence[int], load: Callable[[int, int], Any], tables: Sequence[np.ndarray], dtype: Any
) -> list[Any]:
    """Values of the nodes `outputs`; `load(array, component)` gives the inputs, as arrays of `dtype` that broadcast."""
    order = graph.reachable(outputs)
    last = {source: node for node in order for source in graph.inputs(node)}
    loops = "loop" in {graph.operations[node] for node in order}
    kept, within = set(order if loops else outputs), graph.steps(order)

    def computed(nodes: Sequence[int], values: dict[int, Any], open_loops: int) -> dict[int, Any]:
        """The values of nodes, of those that belong to the steps of no other loops than some."""
        for node in nodes:
            if node in values or within[node] & ~open_loops:
                continue
            operation, arguments = graph.operations[node], graph.arguments[node]
            if operation == "constant":
                values[node] = np.asarray(arguments[0], {MASK: bool, INDEX: np.intp}.get(graph.kinds[node], dtype))[()]
            elif operation == "load":
                values[node] = load(*arguments)
            elif operation == "take":
                values[node] = np.take(tables[arguments[0]], values[arguments[1]], mode="clip")
            elif operation == "to_real":
                values[node] = np.asarray(values[arguments[0]], dtype)[()]
            elif operation == "loop":
                values[node] = looped(node, values, open_loops)
            elif operation == "rays":
                table, way, *sources = arguments
                values[node] = shot(tables[table], way, *(values[n] for n in sources))
            elif operation == "result":
                values[node] = values[arguments[1]][arguments[0]]
            elif graph.kinds[node] == INDEX and operation in _OF_WORDS:
                values[node] = _OF_WORDS[operation](*(values[a] for a in arguments))
            else:
                function = _OPERATORS.get(operation) or getattr(ops, operation)
                values[node] = function(*(values[a] for a in arguments))
            for source in set(graph.inputs(node)):
                if last[source] == node and source not in kept:
                    del values[source]
        return values

    def looped(loop: int, values: dict[int, Any], open_loops: int) -> tuple[Any, ...]:
        first, go_on, states = graph.parts(loop)
        depth, nodes = graph.arguments[loop][0], graph.reachable((go_on, *states))
        mine = [n for n in nodes if graph.operations[n] == "state" and graph.arguments[n][0] == depth]

        def step(*now: Any) -> tuple[Any, ...]:
            inside = values | {node: now[graph.arguments[node][1]] for node in mine}
            done = computed(nodes, inside, open_loops | 1 << depth)
            return done[go_on], *(done[node] for node in states)

        return ops.loop(step, *(np.asarray(values[node]) for node in first))

    values = computed(order, {}, 0)
    return [values[node] for node in outputs]


def _signed(x: Any) -> Any:
    """A whole number as compiled code has it: of 32 bits, with a sign."""
    return np.asarray(x).astype(np.int32).astype(np.intp)[()]


_OF_WORDS: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: _signed(a + b),
    "sub": lambda a, b: _signed(a - b),
    "mul": lambda a, b: _signed(a * b),
    "shl": lambda a, b: _signed(ops.shift_left(a, b)),
    "lshr": lambda a, b: _signed(ops.shift_right(a, b)),
}
"""Operations on whole numbers, of 32 bits."""
