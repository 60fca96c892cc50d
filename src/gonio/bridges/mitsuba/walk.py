"""A traced formula carried out with Mitsuba's numbers: each operation of the graph is one operation of Dr.Jit."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any

from ...arrays import LIBRARIES
from ...trace.graph import COMPARISONS, INDEX, MASK, REAL, Graph


def _erfinv(x: Any) -> Any:
    """Dr.Jit's, whose single precision is what Mitsuba computes with; it is NaN at -1 and 1."""
    import drjit as dr

    inside = dr.abs(x) < 1.0
    return dr.select(inside, dr.erfinv(dr.select(inside, x, 0.0)), x * dr.inf)


_OPERATORS: dict[str, Callable[..., Any]] = {
    **{name: getattr(operator, name) for name in ("add", "sub", "mul", "neg", "xor", *COMPARISONS)},
    "div": operator.truediv,
    "and": operator.and_,
    "or": operator.or_,
}
_ITS_OWN = {"erfinv": _erfinv}
_NAMES = {"select": "where", "stop": "stop_gradient"}


def walk(
    mi: Any, graph: Graph, outputs: Sequence[int], load: Callable[[int, int], Any], tables: Sequence[Any]
) -> list[Any]:
    """Values of the nodes `outputs`; `load(array, component)` gives the inputs and parameters.

    Constants become numbers of Mitsuba, which Dr.Jit folds: operations on Python's own would mix with NumPy's.
    """
    kinds = {REAL: mi.Float, INDEX: mi.UInt32, MASK: mi.Bool}
    functions = LIBRARIES["drjit"].function
    values: dict[int, Any] = {}
    for node in graph.reachable(outputs):
        operation, arguments = graph.operations[node], graph.arguments[node]
        if operation == "constant":
            values[node] = kinds[graph.kinds[node]](arguments[0])
        elif operation == "load":
            values[node] = load(*arguments)
        elif operation == "take":
            values[node] = functions("take")(tables[arguments[0]], values[arguments[1]])
        elif operation == "sub" and arguments[0] == arguments[1]:
            values[node] = mi.Float(0.0)  # how kernels pass on NaN, which Mitsuba's directions and numbers are not
        elif operation == "to_real":
            values[node] = mi.Float(values[arguments[0]])
        else:
            own = _OPERATORS.get(operation) or _ITS_OWN.get(operation)
            function = own or functions(_NAMES.get(operation, operation))
            values[node] = function(*(values[a] for a in arguments))
    return [values[node] for node in outputs]
