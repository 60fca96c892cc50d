"""A traced formula carried out with Mitsuba's numbers: each operation of the graph is one operation of Dr.Jit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from ...arrays import LIBRARIES
from ...arrays.operations import OPERATORS
from ...arrays.ops import ELEMENTARY, OPERATIONS
from ...trace.graph import INDEX, MASK, REAL, Graph

DR_JIT = LIBRARIES["drjit"]
_OWN = {
    name: partial(row.libraries["mitsuba"], DR_JIT) for name, row in ELEMENTARY.items() if "mitsuba" in row.libraries
}
"""What Mitsuba's numbers have another function for than Dr.Jit's arrays."""


def walk(
    mi: Any, graph: Graph, outputs: Sequence[int], load: Callable[[int, int], Any], tables: Sequence[Any]
) -> list[Any]:
    """Values of the nodes `outputs`; `load(array, component)` gives the inputs and parameters.

    Constants become numbers of Mitsuba, which Dr.Jit folds: operations on Python's own would mix with NumPy's.
    """
    kinds = {REAL: mi.Float, INDEX: mi.UInt32, MASK: mi.Bool}
    values: dict[int, Any] = {}
    for node in graph.reachable(outputs):
        operation, arguments = graph.operations[node], graph.arguments[node]
        if operation == "constant":
            values[node] = kinds[graph.kinds[node]](arguments[0])
        elif operation == "load":
            values[node] = load(*arguments)
        elif operation == "take":
            values[node] = DR_JIT.function("take")(tables[arguments[0]], values[arguments[1]])
        elif operation == "sub" and arguments[0] == arguments[1]:
            values[node] = mi.Float(0.0)  # how kernels pass on NaN, which Mitsuba's directions and numbers are not
        elif operation == "to_real":
            values[node] = mi.Float(values[arguments[0]])
        else:
            function = OPERATORS.get(operation) or _OWN.get(operation)
            function = function or DR_JIT.function(OPERATIONS[operation].function or operation)
            values[node] = function(*(values[a] for a in arguments))
    return [values[node] for node in outputs]
