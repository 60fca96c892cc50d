"""Kernels for materials: a formula is traced once for its structure, compiled once, and called with arrays.

A trace depends on the classes, options and parts of a material and on which parameters have channels, not on their
values: these are arguments of the compiled kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Fixed
from ..arrays.kinds import MATRIX, SCALAR, TERMS, TOTAL, VALUE, VECTOR
from ..errors import Error, TraceError
from ..formula import tree
from ..formula.fields import Channels, Numbers, Part
from ..formula.parametrised import Parametrised
from ..formula.state import State
from ..machine.caches import Cache
from ..trace.derive import gradient
from ..trace.graph import Graph
from ..trace.symbol import Symbol, TableSymbol, nodes

FEW = 1 << 22
"""Elements up to which code that is made sooner serves better than code that runs faster: a kernel of 1000 operations
computes so many in a tenth of a second, is compiled in two, and by one vector at a time in one."""

_BRIEF: ContextVar[bool] = ContextVar("brief", default=False)
brief = _BRIEF.get
"""Whether the kernels of plans that are made here and now have little to do, and so take one vector at a time, which
are made in half of the time: see `at_most`."""


@contextmanager
def at_most(elements: int) -> Iterator[None]:
    """Who calls this knows that a kernel which runs within computes so many elements, or fewer: see `FEW`.

    Example
    >>> from gonio.evaluate.tracing import at_most
    >>> with at_most(64):
    ...     f = gn.Lambertian(0.5).f(gn.direction(0.5, 0.0), gn.direction(np.linspace(0.0, 1.5, 64), 0.0))
    ...
    """
    before = _BRIEF.set(elements <= FEW)
    try:
        yield
    finally:
        _BRIEF.reset(before)


Kernel = Callable[..., tuple[Any, ...]]


class Task(NamedTuple):
    """A kernel to be traced, with the kinds of its results; for derivatives of the first one, a value or its total,
    also the arguments. With `adds` the results are added to arrays that a call brings.

    A task is a part of the keys of its traces and plans, and makes them: nobody else spells one.

    `squares`: the kernel gives a residual r, a cost and a weight w. The results are sums in their place: of the cost,
    of w r dr/dp for each of these parameters p, and of w (dr/dp)(dr/dq) for each pair, as `numpy.triu_indices` does.
    """

    kernel: Kernel
    kinds: tuple[str, ...]
    widths: tuple[int, ...]  # of the inputs, whose last axes have these lengths
    by: tuple[tuple[int, ...], ...] = ()  # places of parameters and of inputs to differentiate by
    adds: bool = False
    squares: tuple[int, ...] = ()  # places of parameters

    @property
    def differentiates(self) -> bool:
        """Whether any result is a derivative, or made of derivatives: only a trace has them."""
        return bool(self.by or self.squares)

    def derivatives(self, parameters: tuple[int, ...], inputs: tuple[int, ...]) -> Task:
        """The task with derivatives, by parameters and inputs at these places."""
        return self._replace(by=(parameters, inputs))

    def trace_key(self, material: Parametrised, channels: int | None) -> tuple[Any, ...]:
        """All that a trace depends on."""
        return (self._replace(adds=False), channels, content(material).structure)

    def plan_key(self, inputs: Sequence[Any]) -> tuple[Any, ...]:
        """All that a plan depends on beside the material."""
        if len(inputs) == 2:
            a, b = inputs
            if type(a) is type(b) is np.ndarray:
                return (self, brief(), a.dtype, a.shape, a.strides, b.dtype, b.shape, b.strides)
        key: tuple[Any, ...] = (self, brief())
        for x in inputs:
            if type(x) is np.ndarray:
                key += (x.dtype, x.shape, x.strides)
        return key

    def pattern_key(self, plan_key: tuple[Any, ...], material: Parametrised) -> tuple[Any, ...] | None:
        """All that a plan depends on but for the values of numbers: its key, and the material's structure with their
        shapes. None where some numbers are of another library than NumPy."""
        held, shapes = content(material), list[tuple[int, ...]]()
        for x in held.leaves:
            if type(x) is float:
                shapes.append(())
            elif isinstance(x, (Fixed, np.ndarray)):
                shapes.append((x.numbers if isinstance(x, Fixed) else x).shape)
            else:
                return None
        return (plan_key, held.structure, tuple(shapes))

    def elements(self, channels: tuple[int, ...]) -> list[tuple[int, ...]]:
        """The shape of one element of each result; `channels`: of a value."""
        shapes = {VALUE: channels, VECTOR: (3,), SCALAR: (), MATRIX: (*channels, 4, 4)}
        leaves, inputs = self.by or ((), ())
        slopes = [channels for _ in leaves] + [(*channels, self.widths[k]) for k in inputs]
        return [shapes[TERMS.get(kind, kind)] for kind in self.kinds] + slopes


def sums_only(kinds: Sequence[str]) -> bool:
    """Whether all results are sums of values over the last axis of the batch."""
    return all(kind == TOTAL for kind in kinds)


class Trace(NamedTuple):
    """A kernel's graph. Its arrays are the inputs, then the parameters, then the parameters with channels merged."""

    graph: Graph
    results: tuple[tuple[int, ...], ...]  # the nodes of each result
    inputs: int
    merged: bool  # whether there are merged parameters
    read: frozenset[int]  # the arrays that anything depends on
    looked_up: frozenset[int]  # and the tables
    reach: dict[int, int]  # table -> the largest constant place, or distance of places, that is looked up in it
    operations: int
    loops: bool


class _Content(NamedTuple):
    """Everything that formulas depend on: the structure, which a trace depends on, and numbers and tables, in the order
    of `bind`."""

    structure: tuple[Any, ...]
    leaves: list[Any]
    tables: list[Fixed]


def content(material: Parametrised) -> _Content:
    """The structure, numbers and tables of a material."""
    gathered: _Content | None = material._derived.get(content)
    if gathered is None:
        gathered = material._derived[content] = _gathered(material)
    return gathered


def _gathered(material: Parametrised) -> _Content:
    values, tied, kept, fields = material.__dict__, material._tied, material._kept, material.fields
    leaves: list[Any] = []
    tables: list[Fixed] = []
    for name, field in fields.items():
        if isinstance(field, Part):
            part = content(values[name])
            leaves += part.leaves
            tables += part.tables
        elif name not in tied and isinstance(field, Numbers):
            leaves.append(kept[name] if name in kept else values[name])
    if len(kept):
        tables += [kept[name] for name in kept if not isinstance(fields.get(name), Numbers)]
    return _Content(_structure(material), leaves, tables)


def _structure(material: Parametrised) -> tuple[Any, ...]:
    """What a trace depends on."""
    structure: tuple[Any, ...] | None = material._alike.get(_structure)
    if structure is None:
        values = material.__dict__
        of_fields = [
            _structure(values[name]) if isinstance(field, Part) else field.traced(values[name])
            for name, field in material.fields.items()
        ]
        state = [values.get(name, d.default) for name, d in material._beside.items() if isinstance(d, State)]
        structure = (type(material), tuple(material._tied.items()), material._holed, *of_fields, *state)
        material._alike[_structure] = structure
    return structure


_TRACES: Cache[tuple[Any, ...], Trace | str] = Cache(lambda trace: 0 if isinstance(trace, str) else trace.graph.size())
"""Traces, or for what cannot be traced the reason."""
_OF_FORMULAS = (
    *(Error, ArithmeticError, AssertionError, AttributeError, LookupError),
    *(NameError, RuntimeError, TypeError, ValueError),
)
"""Exceptions of formulas that are called with symbols. Any other, such as a timeout's own, is not theirs."""


def traced(task: Task, material: Parametrised, channels: int | None) -> Trace:
    """The trace of a task for a material, with a copy of the formula for each of `channels` (None: no such axis).

    Raises TraceError where the formula cannot be traced.
    """
    key = task.trace_key(material, channels)
    trace = _TRACES.find(key)
    if trace is None:
        try:
            trace = (_squares if task.squares else _jacobian if task.by else _trace)(task, material, channels)
        except TraceError as error:
            trace = str(error)
        except _OF_FORMULAS as error:  # called with arrays, the formula raises its own error
            trace = f"the formula of {type(material).__name__} fails on symbols: {error!r}"
        _TRACES.keep(key, trace)
    if isinstance(trace, str):
        raise TraceError(trace)  # a new one: an error holds the arrays of all calls that it came out of
    return trace


def _trace(task: Task, material: Parametrised, channels: int | None) -> Trace:
    graph, (_, leaves, tables), first = Graph(), content(material), len(task.widths)
    table_numbers = {id(table): i for i, table in enumerate(tables)}
    lengths = [_length(v) for v in leaves]
    numbered = [isinstance(field, Channels) for _, field, _, _ in tree.numbers(material)]

    def bound(start: int, channel: int) -> Parametrised:
        order = iter(range(len(leaves)))

        def convert(_: Any) -> Symbol:
            k = next(order)
            if numbered[k] and start == first and lengths[k] == (channels or 1):
                return Symbol(graph, graph.constant(channel))
            return Symbol(graph, graph.load(start + k, min(channel, lengths[k] - 1)))

        return tree.bind(material, convert, lambda table: TableSymbol(graph, table_numbers[id(table)]))

    parts = [tuple(Symbol(graph, graph.load(k, c)) for c in range(w)) for k, w in enumerate(task.widths)]
    mean = bound(first if channels is None else first + len(leaves), 0)
    runs = []
    kinds = [TERMS.get(kind, kind) for kind in task.kinds]
    for c in range(channels or 1) if {VALUE, MATRIX} & set(kinds) else [0]:
        m = mean if channels is None else bound(first, c)
        runs.append(task.kernel(m, mean, *parts))

    def node(value: Any, kind: str) -> int:
        if kind in TERMS:
            (number,) = nodes(graph, value, 1.0)[:1]
            return number
        return value.node if isinstance(value, Symbol) else graph.constant(value)

    results = []
    for i, kind in enumerate(kinds):
        if kind == MATRIX:
            numbers = [x for run in runs for row in run[i] for x in row]
        else:
            numbers = [r[i] for r in runs] if kind == VALUE else runs[0][i] if kind == VECTOR else [runs[0][i]]
        results.append(tuple(node(x, task.kinds[i]) for x in numbers))
    return _complete(graph, results, first, channels)


def _jacobian(task: Task, material: Parametrised, channels: int | None) -> Trace:
    """The trace of a kernel, and then of the derivatives of its first value: by parameters (each channel's by that
    channel's number), and by all components of inputs."""
    trace, (leaves, inputs) = traced(task._replace(by=()), material, channels), task.by
    graph, lengths = trace.graph, [_length(v) for v in content(material).leaves]
    slopes: list[list[int]] = [[] for _ in (*leaves, *inputs)]
    for c, node in enumerate(trace.results[0]):
        by = [[graph.load(trace.inputs + k, min(c, lengths[k] - 1))] for k in leaves]
        by += [[graph.load(k, i) for i in range(task.widths[k])] for k in inputs]
        derivatives = iter(gradient(graph, node, [x for group in by for x in group]))
        for slope, group in zip(slopes, by, strict=True):
            slope += islice(derivatives, len(group))
    return _complete(graph, [*trace.results, *map(tuple, slopes)], trace.inputs, channels)


def _squares(task: Task, material: Parametrised, channels: int | None) -> Trace:
    """The trace of a residual, and then of the terms of a fit's normal equations: see `Task`."""
    kernel = traced(task._replace(squares=(), kinds=(SCALAR,) * 3), material, channels)
    graph, ((residual,), (cost,), (weight,)) = kernel.graph, kernel.results
    slopes = gradient(graph, residual, [graph.load(kernel.inputs + k, 0) for k in task.squares])
    weighed = [graph.apply("mul", weight, slope) for slope in slopes]
    results = [cost, *(graph.apply("mul", w, residual) for w in weighed)]
    results += [graph.apply("mul", w, slope) for i, w in enumerate(weighed) for slope in slopes[i:]]
    return _complete(graph, [(node,) for node in results], kernel.inputs, channels)


def linear(kernel: Kernel, widths: tuple[int, ...], material: Parametrised, leaves: Sequence[int]) -> list[int]:
    """Of the parameters at these places those in which the first result of a kernel is linear, all of them together.

    Raises TraceError where the formula cannot be traced.
    """
    trace = traced(Task(kernel, (SCALAR,), widths), material, None)
    graph, (node,) = trace.graph, trace.results[0]
    loads = [graph.load(trace.inputs + k, 0) for k in leaves]
    reached = [set(graph.reachable([slope])) for slope in gradient(graph, node, loads)]
    chosen: list[int] = []
    for i, load in enumerate(loads):
        if not any(load in reached[j] or loads[j] in reached[i] for j in (*chosen, i)):
            chosen.append(i)
    return [leaves[i] for i in chosen]


def _complete(graph: Graph, results: Sequence[tuple[int, ...]], inputs: int, channels: int | None) -> Trace:
    ends = [n for nodes in results for n in nodes]
    order = graph.reachable(ends)
    within = graph.steps(order)
    if any(within[node] for node in ends):
        raise TraceError("a formula keeps a number of a step of a loop; expected what ops.loop gives")
    read = frozenset(graph.arguments[n][0] for n in order if graph.operations[n] == "load")
    looked_up = frozenset(graph.arguments[n][0] for n in order if graph.operations[n] in ("take", "rays"))
    reach: dict[int, int] = {}
    for table, index in (graph.arguments[n] for n in order if graph.operations[n] == "take"):
        place = graph.value(index)
        if place is not None:
            if place < 0:
                raise TraceError(f"a formula looks up entry {int(place)} of a table; expected one from 0")
            reach[table] = max(reach.get(table, 0), int(place))
    for (table, _), members in graph.neighbours(order).items():
        reach[table] = max(reach.get(table, 0), max(members) - min(members))
    return Trace(
        graph,
        tuple(results),
        inputs,
        channels is not None,
        read,
        looked_up,
        reach,
        len(order),
        any(graph.operations[n] == "loop" for n in order),
    )


def _length(value: Any) -> int:
    """How many channels a parameter has."""
    numbers = value.numbers if isinstance(value, Fixed) else value
    return np.shape(numbers)[-1] if np.ndim(numbers) else 1
