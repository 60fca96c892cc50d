"""A graph for finite numbers: what only carries NaN and infinity through a formula is left out, constants are folded.

Kernels keep a NaN of a direction through the horizon's mask by adding x - x. A shader has no use for that, and its
compiler may drop it. Holes of tables stay: they are written as a number, since a shader may take x == x for true.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from ...arrays import ops
from ...trace.graph import COMPARISONS, LOGIC, MASK, REAL, Graph

_COMPARED = {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
}
_SAME = {"eq": True, "le": True, "ge": True, "ne": False, "lt": False, "gt": False}
"""A comparison of a finite number with itself."""
_CALCULATED = {"add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b}


HOLE = -1e30
"""Stands in tables for what is missing."""


def finite(
    graph: Graph,
    outputs: Sequence[int],
    shares: Collection[tuple[int, int]] = (),
    holed: Collection[int] = (),
) -> tuple[Graph, list[int]]:
    """A graph of the same values for finite numbers, and its outputs.

    `shares`: loads that are never negative. `holed`: tables in which NaN is written as `HOLE`.
    """
    new, copies = Graph(), dict[int, int]()
    there: dict[int, int] = {}  # an entry of a table with holes, as a choice -> whether it is there
    for node in graph.reachable(outputs):
        inputs = [copies[n] for n in graph.inputs(node)]
        operation = graph.operations[node]
        if operation == "take" and graph.arguments[node][0] in holed:
            entry = graph.copied(node, new, inputs)
            known = new.apply("gt", entry, new.constant(0.5 * HOLE))
            copies[node] = new.apply("select", known, entry, new.constant(math.nan))
            there[copies[node]] = known
            continue
        if operation in ("eq", "ne") and inputs[0] == inputs[1] and inputs[0] in there:
            known = there[inputs[0]]
            copies[node] = known if operation == "eq" else new.apply("xor", known, new.constant(1, MASK))
            continue
        if operation == "select" and there.get(inputs[1]) == inputs[0]:
            inputs[1] = new.arguments[inputs[1]][1]
        same = _folded(new, operation, graph.kinds[node], inputs)
        if (
            same is None
            and operation == "lt"
            and new.arguments[inputs[0]] in shares
            and new.operations[inputs[0]] == "load"
        ):
            limit = new.value(inputs[1])
            same = new.constant(False, MASK) if limit is not None and limit <= 0.0 else None
        copies[node] = graph.copied(node, new, inputs) if same is None else same
    return new, [copies[node] for node in outputs]


def _folded(g: Graph, operation: str, kind: str, inputs: Sequence[int]) -> int | None:
    """A node that has the value of an operation already, or a constant; None where there is neither."""
    if not inputs:
        return None
    values = [g.value(n) for n in inputs]
    known = all(v is not None for v in values)
    first, second = inputs[0], inputs[1] if len(inputs) > 1 else None
    if operation in COMPARISONS:
        if first == second:
            return g.constant(_SAME[operation], MASK)
        return g.constant(_COMPARED[operation](*values), MASK) if known else None
    if operation in LOGIC and kind == MASK and second is not None:
        return _of_masks(g, operation, first, second)
    if kind != REAL:
        return None
    if operation == "stop":
        return first
    if operation == "sub" and first == second:
        return g.constant(0.0)
    if operation in ("add", "sub") and values[1] == 0.0:
        return first
    if operation == "add" and values[0] == 0.0:
        return second
    if operation == "mul" and 0.0 in values:
        return g.constant(0.0)
    if operation == "div" and values[0] == 0.0:
        return g.constant(0.0)
    return _calculated(g, operation, values) if known else None


def _calculated(g: Graph, operation: str, values: Sequence[float | None]) -> int | None:
    """An operation on constants, as a constant if it is finite."""
    if operation in _CALCULATED:
        result = _CALCULATED[operation](*values)
    elif operation == "div" and values[1] != 0.0:
        result = values[0] / values[1]  # type: ignore[operator]  # both are known here
    elif operation in ops.ELEMENTARY:
        with np.errstate(all="ignore"):
            result = float(getattr(ops, operation)(*map(np.float64, values)))
    else:
        return None
    return g.constant(result) if math.isfinite(result) else None


def _of_masks(g: Graph, operation: str, first: int, second: int) -> int | None:
    if g.value(first) is None:
        first, second = second, first
    value = g.value(first)
    if value is None:
        return None
    if operation == "xor":
        return None if value else second
    decides = operation == "or"  # "or" with true is true, "and" with false is false
    return first if bool(value) == decides else second
