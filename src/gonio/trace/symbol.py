"""Symbols: the arguments of a formula while it is traced. They record every operation in a graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..arrays import OF_TYPES
from ..arrays.ops import ELEMENTARY, OPERATIONS
from ..errors import TraceError
from .graph import INDEX, LOGIC, MASK, REAL, Graph

_NAMED = {row.operator: name for name, row in OPERATIONS.items()}
"""Python's operators -> operations."""


class Symbol:
    """A node of a graph, with the operators of a number."""

    __slots__ = ("graph", "node")
    __array_ufunc__ = None  # numpy.float64(0.5) * symbol is the symbol's to compute

    def __init__(self, graph: Graph, node: int):
        self.graph, self.node = graph, node

    @property
    def kind(self) -> str:
        return self.graph.kinds[self.node]

    def __repr__(self) -> str:
        return f"<{self.kind} symbol {self.node}: {self.graph.operations[self.node]}>"

    def __bool__(self) -> bool:
        raise TraceError("a formula decides on a value (if, and, or, min, max); expected ops.where and its like")

    def __float__(self) -> float:
        raise TraceError("a formula asks for the value of a number (math.*, float); expected functions of ops")

    __int__ = __index__ = __float__

    def __iter__(self) -> Any:
        raise TraceError("a formula takes a component apart; components are single numbers")

    __hash__ = None  # type: ignore[assignment]  # Python's own way to say so; mypy knows it as a function

    def __neg__(self) -> Symbol:
        return _apply("neg", self)

    def __pos__(self) -> Symbol:
        return self

    def __abs__(self) -> Symbol:
        return _apply(_NAMED["abs"], self)

    def __invert__(self) -> Symbol:
        return Symbol(self.graph, self.graph.apply("xor", self.node, self.graph.constant(1, MASK)))

    def __pow__(self, exponent: Any) -> Symbol:
        if exponent == 2:
            return _apply("mul", self, self)
        return _apply(_NAMED["pow"], self, exponent)

    def __rpow__(self, base: Any) -> Symbol:
        return _apply(_NAMED["pow"], base, self)


def _operator(name: str, swapped: bool = False) -> Callable[[Symbol, Any], Symbol]:
    def operator(self: Symbol, other: Any) -> Symbol:
        if type(other) is not Symbol and getattr(other, "__array_ufunc__", other) is None:
            return NotImplemented  # as NumPy's arrays do: symbol * direction is the direction's to compute
        return _apply(name, other, self) if swapped else _apply(name, self, other)

    return operator


for _name in ("add", "sub", "mul", "truediv", "and", "or"):
    setattr(Symbol, f"__{_name}__", _operator(_NAMED[_name]))
    setattr(Symbol, f"__r{_name}__", _operator(_NAMED[_name], swapped=True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Symbol, f"__{_name}__", _operator(_name))


def nodes(graph: Graph, *values: Any) -> list[int]:
    """Nodes of one kind for symbols and numbers, as in NumPy: masks alone stay masks, beside numbers they are 1 or 0;
    whole numbers beside indices stay whole; all else becomes real."""
    kinds = {v.kind for v in values if isinstance(v, Symbol)}
    numbers = [v for v in values if not isinstance(v, Symbol)]
    if kinds <= {MASK} and all(isinstance(v, (bool, np.bool_)) for v in numbers):
        kind = MASK
    elif kinds - {MASK} == {INDEX} and all(isinstance(v, (int, np.integer)) for v in numbers):
        kind = INDEX
    else:
        kind = REAL
    return [_node(graph, v, kind) for v in values]


def _node(graph: Graph, value: Any, kind: str) -> int:
    if not isinstance(value, Symbol):
        try:
            return graph.constant(value, kind)
        except (TypeError, ValueError):
            raise TraceError(f"a formula combines a {type(value).__name__} with its components") from None
    if value.graph is not graph:
        raise TraceError("a formula combines symbols of two traces; it must not keep results between calls")
    if value.kind == INDEX and kind == REAL:
        return graph.apply("to_real", value.node)
    if value.kind == MASK and kind != MASK:
        return graph.apply("select", value.node, graph.constant(1.0, kind), graph.constant(0.0, kind))
    return value.node


_OF_MASKS = {"add": "or", "mul": "and", **{name: name for name in ("and", "or", "xor", "eq", "ne", "stop")}}
"""Operations on masks alone, as NumPy has them."""


def _apply(operation: str, *values: Any) -> Symbol:
    graph = next(v.graph for v in values if isinstance(v, Symbol))
    arguments = nodes(graph, *values)
    kind = graph.kinds[arguments[0]]
    if kind == MASK:
        if operation not in _OF_MASKS:
            raise TraceError(f"a formula takes {operation} of masks; expected numbers: ops.where(mask, 1.0, 0.0)")
        operation = _OF_MASKS[operation]
    elif operation in LOGIC and kind == REAL:
        raise TraceError(f"a formula takes {operation} of a mask and a number; expected masks: x != 0.0")
    return Symbol(graph, graph.apply(operation, *arguments))


class Symbols:
    """The functions of `ops` on symbols: their array library."""

    name = "symbols"

    def function(self, name: str) -> Callable[..., Any]:
        if name not in _FUNCTIONS:
            raise TraceError(f"ops.{name} cannot be traced")
        return _FUNCTIONS[name]


def _where(condition: Any, a: Any, b: Any) -> Any:
    if not isinstance(condition, Symbol):
        return a if condition else b
    graph = condition.graph
    return Symbol(graph, graph.apply("select", condition.node, *nodes(graph, a, b)))


def _to_index(x: Symbol) -> Symbol:
    return x if x.kind == INDEX else Symbol(x.graph, x.graph.apply("to_index", x.node))


def _of_words(operation: str) -> Callable[..., Symbol]:
    """An operation on whole numbers alone."""

    def function(a: Any, b: Any) -> Symbol:
        graph = next(x.graph for x in (a, b) if isinstance(x, Symbol))
        arguments = nodes(graph, a, b)
        if graph.kinds[arguments[0]] != INDEX:
            raise TraceError(f"a formula takes {operation} of numbers; expected whole numbers: ops.to_index(x)")
        return Symbol(graph, graph.apply(operation, *arguments))

    return function


def _unit(word: Any, like: Any) -> Symbol:
    return _apply("mul", _of_words("lshr")(word, 8), 2.0**-24)


def _loop(step: Callable[..., Any], *states: Any) -> tuple[Symbol, ...]:
    graph = next((x.graph for x in states if isinstance(x, Symbol)), None)
    if graph is None:
        raise TraceError("the states of a loop are all plain numbers; expected one that is computed: 0.0 * wi.z")
    first = [_node(graph, x, _kind(x)) for x in states]
    depth = graph.depth
    before = [Symbol(graph, graph.state(depth, i, graph.kinds[n])) for i, n in enumerate(first)]
    graph.depth += 1
    try:
        go_on, *after = step(*before)
    finally:
        graph.depth = depth
    if len(after) != len(first):
        raise TraceError(f"a step of a loop of {len(first)} states gives {len(after)}; expected (go_on, *states)")
    going = _node(graph, go_on, MASK)
    if graph.kinds[going] != MASK:
        raise TraceError("a step of a loop says by a number whether to go on; expected a condition: x < 1.0")
    new = []
    for i, (x, n) in enumerate(zip(after, first, strict=True)):
        node, kind = _node(graph, x, graph.kinds[n]), graph.kinds[n]
        if graph.kinds[node] != kind:
            raise TraceError(f"state {i} of a loop is of kind {kind} before a step, and {graph.kinds[node]} after it")
        new.append(node)
    return tuple(Symbol(graph, n) for n in graph.loop(depth, first, going, new))


def _rays(way: int) -> Callable[..., Any]:
    def function(table: Any, o: Sequence[Any], d: Sequence[Any], near: Any, far: Any) -> Any:
        if not isinstance(table, TableSymbol):
            raise TraceError(f"rays: the triangles are a {type(table).__name__}; expected a table with their handle")
        graph = table.graph
        met = graph.rays(table.number, way, [_node(graph, x, REAL) for x in (*o, *d, near, far)])
        results = tuple(Symbol(graph, n) for n in met)
        return results[0] if len(results) == 1 else results

    return function


def _kind(value: Any) -> str:
    if isinstance(value, Symbol):
        return value.kind
    return MASK if isinstance(value, (bool, np.bool_)) else INDEX if isinstance(value, (int, np.integer)) else REAL


def _take(table: Any, index: Any) -> Symbol:
    if not isinstance(table, TableSymbol):
        raise TraceError(f"ops.take: the table is a {type(table).__name__}; expected one declared with `table(...)`")
    graph = table.graph
    return Symbol(graph, graph.take(table.number, _node(graph, index, INDEX)))


class TableSymbol:
    """A lookup table of a material, by its number."""

    __slots__ = ("graph", "number")

    def __init__(self, graph: Graph, number: int):
        self.graph, self.number = graph, number


_FUNCTIONS: dict[str, Callable[..., Any]] = {name: partial(_apply, name) for name in ELEMENTARY}
_FUNCTIONS.update(where=_where, take=_take, to_index=_to_index, stop_gradient=partial(_apply, "stop"), loop=_loop)
_WORDS = {"xor": "xor", "bit_and": "and", "shift_left": "shl", "shift_right": "lshr"}
_WORDS |= {"wrapped_sum": "add", "wrapped_product": "mul"}
_FUNCTIONS |= {name: _of_words(operation) for name, operation in _WORDS.items()} | {"unit": _unit}
_FUNCTIONS |= {"nearest": _rays(0), "blocked": _rays(1)}

OF_TYPES.update(dict.fromkeys((Symbol, TableSymbol), Symbols()))
