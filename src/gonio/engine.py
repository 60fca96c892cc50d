"""Kernels for materials: a formula is traced once for its structure, compiled once, and called with arrays.

A trace depends on the classes, options and parts of a material and on which parameters have channels, not on their
values: these are arguments of the compiled kernel.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from .blocks import Box, cut
from .bounds import COMPILED
from .compile import image, machine
from .compile.batches import Plan, Result, carry_out, prepare
from .compile.program import EACH, ONCE, TOTAL
from .errors import DependencyError, EngineError, EngineWarning, Error, ParameterError, TraceError
from .libraries import LIBRARIES, Fixed, Roomy, contiguous
from .param import Channels, Option, Param
from .parametrised import Parametrised
from .trace.derive import gradient
from .trace.graph import Graph
from .trace.interpret import evaluate
from .trace.symbol import Symbol, TableSymbol

UNROLLED = 8  # channels up to which each has its own copy of a formula; more are an axis of the batch
PLANS_KEPT = 64  # for a material
TRACES_KEPT = 1000

Kernel = Callable[..., tuple]


_GIVEN_UP: list[str] = []


def available() -> bool:
    """Whether formulas are compiled here: not with GONIO_ENGINE=numpy, nor on a processor without fused multiply-adds.

    Where llvmlite is missing or does not load, or memory may not be made executable, an EngineWarning says so, once.
    Raises ParameterError for another GONIO_ENGINE.
    """
    return not _GIVEN_UP and _possible()


@cache
def _possible() -> bool:
    asked = os.environ.get("GONIO_ENGINE", "")
    if asked not in ("", "numpy"):
        raise ParameterError(f"GONIO_ENGINE={asked!r}: expected numpy, which compiles nothing; or unset it")
    if asked:
        return False
    try:
        machine.compiler()
        if machine.lane_bits() == 0:
            return False
        image.require_executable()
    except (DependencyError, EngineError) as error:
        _give_up(error)
        return False
    return True


def _give_up(error: Exception) -> None:
    if not _GIVEN_UP:
        _GIVEN_UP.append(str(error))
        text = f"formulas are computed by NumPy, about twenty times slower: {error}"
        warnings.warn(f"{text}; mend that, or set GONIO_ENGINE=numpy to silence this", EngineWarning, stacklevel=2)


class Trace(NamedTuple):
    """A kernel's graph. Its arrays are the inputs, then the parameters, then the parameters with channels merged."""

    graph: Graph
    results: tuple[tuple[int, ...], ...]  # the nodes of each result
    inputs: int
    read: frozenset[int]  # the arrays that anything depends on
    looked_up: frozenset[int]  # and the tables
    operations: int


class _Content(NamedTuple):
    """The numbers and tables of a material, in the order in which `bind` meets them."""

    leaves: list[Any]
    tables: list[Fixed]


def _content(material: Parametrised) -> _Content:
    found = _Content([], [])
    material.bind(found.leaves.append, found.tables.append)
    return found


def _structure(material: Parametrised) -> tuple:
    """What a trace of a material depends on."""
    parts: list[Any] = [type(material), tuple(material._tied.items()), material.identity(), material._holed]
    for name, field in material.fields.items():
        value = material.__dict__[name]
        if isinstance(value, Parametrised):
            parts.append(_structure(value))
        elif isinstance(field, Option):
            parts.append(value)
        elif isinstance(field, (Param, Channels)):
            parts.append(np.shape(value)[-1] if np.ndim(value) else 0)
    return tuple(parts)


_TRACES: dict[tuple, Trace | TraceError] = {}
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
    key = (kernel, tuple(kinds), tuple(widths), channels, _structure(material))
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
    graph, own, first = Graph(), _content(material), len(widths)
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
    for c in range(channels or 1) if {"value", "total"} & set(kinds) else [0]:
        m = mean if channels is None else bound(first, c)
        runs.append(kernel(m, mean, *parts))

    def node(value: Any) -> int:
        return value.node if isinstance(value, Symbol) else graph.constant(value)

    results = []
    for i, kind in enumerate(kinds):
        if kind in ("value", "total"):
            results.append(tuple(node(run[i]) for run in runs))
        elif kind == "vector":
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
    key = (kernel, tuple(widths), channels, tuple(leaves), tuple(inputs), _structure(material))
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
    trace = traced(kernel, ("value",), material, widths, channels)
    graph, first = trace.graph, trace.inputs
    lengths = [_length(v) for v in _content(material).leaves]
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


def known(kernel: Kernel, kinds: tuple[str, ...], material: Parametrised, inputs: Sequence[Any]) -> Plan | None:
    """The plan of an earlier call with arrays of these shapes, strides and dtypes."""
    plans = material.__dict__.get("_plans")
    return plans.get(_key(kernel, kinds, inputs)) if plans else None


def _key(kernel: Kernel, kinds: tuple[str, ...], inputs: Sequence[Any]) -> tuple:
    key: tuple = (kernel, kinds)
    for x in inputs:
        if type(x) is np.ndarray:
            key += (x.dtype, x.shape, x.strides)
    return key


def plan(
    kernel: Kernel,
    kinds: tuple[str, ...],
    material: Parametrised,
    inputs: Sequence[np.ndarray],
    widths: Sequence[int],
    batch: tuple[int, ...],
    channels: int | None,
) -> Plan:
    """A plan for calls with such arrays, kept for further ones.

    Raises TraceError if the formula cannot be traced or is too large to be compiled, EngineError where nothing can be
    compiled after all.
    """
    as_axis = channels is not None and channels > UNROLLED
    if as_axis and "total" in kinds:
        raise TraceError(f"sums over a batch are compiled for at most {UNROLLED} channels; got {channels}")
    trace = traced(kernel, kinds, material, widths, 1 if as_axis else channels)
    results = [_result(kind, nodes, channels, as_axis) for kind, nodes in zip(kinds, trace.results, strict=True)]
    made = _plan(trace, results, material, inputs, widths, batch, channels)
    plans = material.__dict__.setdefault("_plans", {})
    if len(plans) >= PLANS_KEPT:
        plans.clear()
    plans[_key(kernel, kinds, inputs)] = made
    return made


def jacobian_plan(
    kernel: Kernel,
    material: Parametrised,
    inputs: Sequence[np.ndarray],
    widths: Sequence[int],
    batch: tuple[int, ...],
    channels: int | None,
    leaves: tuple[int, ...],
    by_inputs: tuple[int, ...],
) -> Plan:
    """A plan for the results of `jacobian`: (...[, C]) for the value and each parameter, (...[, C], 3) for inputs.

    Raises as `plan`.
    """
    as_axis = channels is not None and channels > UNROLLED
    trace = jacobian(kernel, material, widths, 1 if as_axis else channels, leaves, by_inputs)
    own = () if as_axis or channels is None else (channels,)
    elements = [own] * (1 + len(leaves)) + [(*own, widths[k]) for k in by_inputs]
    results = [Result(nodes, EACH, element) for nodes, element in zip(trace.results, elements, strict=True)]
    return _plan(trace, results, material, inputs, widths, batch, channels)


def _plan(
    trace: Trace,
    results: Sequence[Result],
    material: Parametrised,
    inputs: Sequence[np.ndarray],
    widths: Sequence[int],
    batch: tuple[int, ...],
    channels: int | None,
) -> Plan:
    as_axis = channels is not None and channels > UNROLLED
    if trace.operations > COMPILED:
        raise TraceError(f"a formula of {trace.operations} operations, expected at most {COMPILED} to compile")
    dtype = inputs[0].dtype
    given = [(x[..., None, :] if as_axis else x, w) for x, w in zip(inputs, widths, strict=True)]
    arrays = [x if k in trace.read else None for k, x in enumerate(given)]
    arrays += _parameters(trace, material, dtype, as_axis, channels is not None)
    shape = batch if channels is None or not as_axis else (*batch, channels)
    tables = _tables(trace, material, dtype)
    try:
        return prepare(trace.graph, results, arrays, trace.inputs, tables, shape, dtype)
    except (DependencyError, EngineError) as error:
        _give_up(error)
        raise EngineError(str(error)) from None


def _tables(trace: Trace, material: Parametrised, dtype: np.dtype) -> list[np.ndarray]:
    """The tables in their order; those that are not looked up, which may take long to make, are left empty."""
    with np.errstate(all="ignore"):
        return [
            _table(table, dtype) if k in trace.looked_up else np.zeros(2, dtype)
            for k, table in enumerate(_content(material).tables)
        ]


def _table(table: Fixed, dtype: np.dtype) -> np.ndarray:
    if isinstance(table, Roomy) and table.whole.dtype == dtype:
        return table.whole
    return table.once(_padded, dtype)


def _padded(numbers: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """A table with an entry more: kernels read two at a time."""
    made = np.empty(len(numbers) + 1, dtype)
    made[:-1], made[-1] = numbers, 0.0
    return made


def interpreted(
    trace: Trace, material: Parametrised, inputs: Sequence[np.ndarray], batch: tuple[int, ...], at: Box
) -> list[np.ndarray]:
    """The nodes of all results of a trace, computed by NumPy for a box of a batch."""
    like = inputs[0]
    parameters = _parameters(trace, material, like.dtype, False, True)
    arrays = [*inputs, *(x and x[0] for x in parameters)]

    def load(k: int, c: int) -> Any:
        array = arrays[k]
        assert array is not None  # what the graph reads is there
        return cut(array, batch, at)[..., c]

    nodes = [n for result in trace.results for n in result]
    with np.errstate(all="ignore"):
        return evaluate(trace.graph, nodes, load, _tables(trace, material, like.dtype), like.dtype)


def _parameters(
    trace: Trace, material: Parametrised, dtype: np.dtype, as_axis: bool, channels: bool
) -> list[tuple[np.ndarray, int] | None]:
    """The arrays of the parameters, and of the merged ones, as far as they are read."""
    leaves = _content(material).leaves
    first = trace.inputs
    arrays = [_parameter(v, dtype, as_axis) if first + k in trace.read else None for k, v in enumerate(leaves)]
    if channels:
        first += len(leaves)
        merged: list[Any] = [None] * len(leaves)
        if any(k >= first for k in trace.read):
            merged = _content(material.merged(LIBRARIES["numpy"].merge_channels)).leaves
        arrays += [_parameter(v, dtype, as_axis) if first + k in trace.read else None for k, v in enumerate(merged)]
    return arrays


def _parameter(value: Any, dtype: np.dtype, as_axis: bool) -> tuple[np.ndarray, int]:
    if isinstance(value, Fixed):
        array = value.once(contiguous, dtype)
    else:
        array = np.ascontiguousarray(value, dtype).reshape(np.shape(value) or 1)
    if as_axis:
        array = array[..., None]
    return array, array.shape[-1]


def _length(value: Any) -> int:
    """How many channels a parameter has."""
    numbers = value.numbers if isinstance(value, Fixed) else value
    return np.shape(numbers)[-1] if np.ndim(numbers) else 1


def _result(kind: str, nodes: tuple[int, ...], channels: int | None, as_axis: bool) -> Result:
    if kind == "total":
        return Result(nodes, TOTAL, (len(nodes),) if channels else ())
    if as_axis:
        return Result(nodes, EACH, ()) if kind == "value" else Result(nodes, ONCE, (3,) if kind == "vector" else ())
    has_axis = kind == "vector" or (kind == "value" and channels is not None)
    return Result(nodes, EACH, (len(nodes),) if has_axis else ())


def call(found: Plan, inputs: Sequence[np.ndarray], out: np.ndarray | None) -> list[Any]:
    """The results of a plan; those of a single direction as numbers. `out` takes the first one."""
    if out is not None:
        direct = out.flags.c_contiguous and not any(np.may_share_memory(out, x) for x in inputs)
        results = carry_out(found, inputs, out if direct else None)
        if not direct:
            out[...] = results[0]
        return [out, *results[1:]]
    return [r if r.ndim else r[()] for r in carry_out(found, inputs)]
