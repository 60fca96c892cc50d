"""Kernels for materials: a formula is traced once for its structure, compiled once, and called with arrays.

A trace depends on the classes, options and parts of a material and on which parameters have channels, not on their
values: these are arguments of the compiled kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Fixed
from ..arrays.kinds import TOTAL, VALUE, VECTOR
from ..errors import Error, TraceError
from ..formula.fields import Channels, Param, Part
from ..formula.parametrised import Parametrised
from ..formula.state import State
from ..trace.derive import gradient
from ..trace.graph import Graph
from ..trace.symbol import Symbol, TableSymbol

TRACES_KEPT = 1000

Kernel = Callable[..., tuple[Any, ...]]


class Trace(NamedTuple):
    """A kernel's graph. Its arrays are the inputs, then the parameters, then the parameters with channels merged."""

    graph: Graph
    results: tuple[tuple[int, ...], ...]  # the nodes of each result
    inputs: int
    read: frozenset[int]  # the arrays that anything depends on
    looked_up: frozenset[int]  # and the tables
    operations: int


class Content(NamedTuple):
    """What kernels are made of and called with: see `content`."""

    structure: tuple[Any, ...]
    """What a trace of the material depends on."""
    leaves: list[Any]
    """Its numbers and its tables, in the order in which `bind` meets them."""
    tables: list[Fixed]


def content(material: Parametrised) -> Content:
    """The numbers and tables of a material, and all else that its formulas depend on."""
    gathered: Content | None = material._derived.get(content)
    if gathered is None:
        gathered = material._derived[content] = _gathered(material)
    return gathered


def _gathered(material: Parametrised) -> Content:
    own, tied, kept, fields = material.__dict__, material._tied, material._kept, material.fields
    structure: list[Any] = [type(material), tuple(tied.items()), material._holed]
    leaves: list[Any] = []
    tables: list[Fixed] = []
    for name, field in fields.items():
        value = own[name]
        if isinstance(field, Part):
            part = content(value)
            structure.append(part.structure)
            leaves += part.leaves
            tables += part.tables
            continue
        structure.append(field.traced(value))
        if name not in tied and isinstance(field, (Param, Channels)):
            leaves.append(kept.get(name, value))
    tables += [kept[name] for name in kept if not isinstance(fields.get(name), (Param, Channels))]
    structure += [own.get(name, d.default) for name, d in material.beside.items() if isinstance(d, State)]
    return Content(tuple(structure), leaves, tables)


_TRACES: dict[tuple[Any, ...], Trace | TraceError] = {}
_OF_FORMULAS = (
    *(Error, ArithmeticError, AssertionError, AttributeError, LookupError),
    *(NameError, RuntimeError, TypeError, ValueError),
)
"""What formulas raise that are given symbols. Anything else, a timeout's own exception above all, is not theirs."""


def traced(
    kernel: Kernel, kinds: Sequence[str], material: Parametrised, widths: Sequence[int], channels: int | None
) -> Trace:
    """The trace of a kernel over a material, with a copy of the formula for each of `channels` (None: no such axis).

    Raises TraceError where the formula cannot be traced.
    """
    key = (kernel, tuple(kinds), tuple(widths), channels, content(material).structure)
    found = _TRACES.get(key)
    if found is None:
        try:
            found = _trace(kernel, kinds, material, widths, channels)
        except TraceError as error:
            found = error
        except _OF_FORMULAS as error:  # on arrays the formula says itself what is wrong
            found = TraceError(f"the formula of {type(material).__name__} fails on symbols: {error!r}")
        if len(_TRACES) >= TRACES_KEPT:
            _TRACES.clear()
        _TRACES[key] = found
    if isinstance(found, TraceError):
        raise found
    return found


def _trace(
    kernel: Kernel, kinds: Sequence[str], material: Parametrised, widths: Sequence[int], channels: int | None
) -> Trace:
    graph, own, first = Graph(), content(material), len(widths)
    numbers = {id(table): i for i, table in enumerate(own.tables)}
    lengths = [_length(v) for v in own.leaves]
    numbered = [not path for path in material.leaf_paths()]

    def bound(start: int, channel: int) -> Parametrised:
        order = iter(range(len(own.leaves)))

        def convert(_: Any) -> Symbol:
            k = next(order)
            if numbered[k] and start == first and lengths[k] == (channels or 1):
                return Symbol(graph, graph.constant(channel))
            return Symbol(graph, graph.load(start + k, min(channel, lengths[k] - 1)))

        return material.bind(convert, lambda table: TableSymbol(graph, numbers[id(table)]))

    parts = [tuple(Symbol(graph, graph.load(k, c)) for c in range(w)) for k, w in enumerate(widths)]
    mean = bound(first if channels is None else first + len(own.leaves), 0)
    runs = []
    for c in range(channels or 1) if {VALUE, TOTAL} & set(kinds) else [0]:
        m = mean if channels is None else bound(first, c)
        runs.append(kernel(m, mean, *parts))

    def node(value: Any) -> int:
        return value.node if isinstance(value, Symbol) else graph.constant(value)

    results = []
    for i, kind in enumerate(kinds):
        if kind in (VALUE, TOTAL):
            results.append(tuple(node(run[i]) for run in runs))
        elif kind == VECTOR:
            results.append(tuple(node(x) for x in runs[0][i]))
        else:
            results.append((node(runs[0][i]),))
    return _complete(graph, results, len(widths))


def jacobian(
    kernel: Kernel,
    material: Parametrised,
    widths: Sequence[int],
    channels: int | None,
    leaves: Sequence[int],
    inputs: Sequence[int],
) -> Trace:
    """The trace of a kernel with one value, and then of its derivatives: by parameters number `leaves` (each channel's
    by that channel's number), and by all components of the inputs number `inputs`.

    Raises TraceError where the formula cannot be traced.
    """
    key = (kernel, tuple(widths), channels, tuple(leaves), tuple(inputs), content(material).structure)
    found = _TRACES.get(key)
    if not isinstance(found, Trace):
        found = _TRACES[key] = _jacobian(kernel, material, widths, channels, leaves, inputs)
    return found


def _jacobian(
    kernel: Kernel,
    material: Parametrised,
    widths: Sequence[int],
    channels: int | None,
    leaves: Sequence[int],
    inputs: Sequence[int],
) -> Trace:
    trace = traced(kernel, (VALUE,), material, widths, channels)
    graph, first = trace.graph, trace.inputs
    lengths = [_length(v) for v in content(material).leaves]
    slopes: list[list[int]] = [[] for _ in (*leaves, *inputs)]
    for c, node in enumerate(trace.results[0]):
        by = [graph.load(first + k, min(c, lengths[k] - 1)) for k in leaves]
        by += [graph.load(k, i) for k in inputs for i in range(widths[k])]
        found = gradient(graph, node, by)
        for k in range(len(leaves)):
            slopes[k].append(found[k])
        at = len(leaves)
        for k, number in enumerate(inputs, len(leaves)):
            slopes[k] += found[at : at + widths[number]]
            at += widths[number]
    return _complete(graph, [trace.results[0], *map(tuple, slopes)], trace.inputs)


def _complete(graph: Graph, results: Sequence[tuple[int, ...]], inputs: int) -> Trace:
    order = graph.reachable([n for nodes in results for n in nodes])
    read = frozenset(graph.arguments[n][0] for n in order if graph.operations[n] == "load")
    looked_up = frozenset(graph.arguments[n][0] for n in order if graph.operations[n] == "take")
    return Trace(graph, tuple(results), inputs, read, looked_up, len(order))


def _length(value: Any) -> int:
    """How many channels a parameter has."""
    numbers = value.numbers if isinstance(value, Fixed) else value
    return np.shape(numbers)[-1] if np.ndim(numbers) else 1
