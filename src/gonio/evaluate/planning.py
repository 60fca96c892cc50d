"""Plans of calls: made once for a trace and for arrays of some shapes and strides, kept, and carried out.

To carry out the plan of a compiled kernel takes addresses alone; `available` says whether anything is compiled here.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..arrays import LIBRARIES, AsStored, Fixed, Roomy, contiguous
from ..arrays.kinds import COUNT, MATRIX, SQUARE, SUMMED, TOTAL, VALUE
from ..compile import elf
from ..compile.llvm import machine
from ..compile.llvm.program import EACH, ONCE, SQUARED
from ..compile.llvm.program import TOTAL as ADDED_UP
from ..compile.plans import Plan, Result, carry_out, prepare, renewed
from ..compile.store import size
from ..errors import DependencyError, EngineError, EngineWarning, ParameterError, TraceError, warn
from ..formula.bounds import COMPILED
from ..formula.parametrised import Parametrised
from ..machine.caches import Cache, Passing, made
from . import channels, turned
from .blocks import Box, cut
from .channels import Staged
from .interpret import evaluate
from .tracing import Task, Trace, brief, content, traced
from .turned import Turned

UNROLLED = 8  # channels up to which each has its own copy of a formula, if it looks up no matrices; more are an axis
PLANS_KEPT = 64  # for a material
PLAN = 3000
"""Bytes of memory that a plan takes, about: the arrays of its numbers belong to the material, but for single ones."""

Made = Plan | Staged | Turned
"""A plan of any kind."""

_GIVEN_UP: list[str] = []


class Call(NamedTuple):
    """A task for a material and NumPy arrays; how many channels it has (None: no such axis), and its batch shape."""

    task: Task
    material: Parametrised
    inputs: Sequence[np.ndarray]
    channels: int | None
    batch: tuple[int, ...]


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
        elf.require_executable()
    except (DependencyError, EngineError) as error:
        _give_up(error)
        return False
    return True


def _give_up(error: Exception) -> None:
    if not _GIVEN_UP:
        _GIVEN_UP.append(str(error))
        text = f"formulas are computed by NumPy, about twenty times slower: {error}"
        warn(f"{text}; mend that, or set GONIO_ENGINE=numpy to silence this", EngineWarning)


def known(task: Task, material: Parametrised, inputs: Sequence[Any]) -> Made | None:
    """The plan of an earlier call of a task with such arrays, of this material or one of its structure and shapes."""
    key = task.plan_key(inputs)
    plans = material._derived.get(known)
    return (plans and plans.get(key)) or _of_pattern(key, material, inputs[0].dtype)


class _Pattern(NamedTuple):
    """A plan without arrays, for other numbers of the same structure and shapes, and where these go in it."""

    plan: Made
    looked_up: frozenset[int]  # as those of its trace
    reach: dict[int, int]
    as_axis: bool
    numbers: tuple[int, ...]  # those of the material's leaves, then of the merged ones, that are read
    merged: bool  # whether any merged ones are
    places: tuple[int, ...]  # the arrays of the plan that they are


def _pattern(plan: Made, trace: Trace, as_axis: bool, leaves: int) -> _Pattern:
    places = tuple(sorted(k for k in trace.read if k >= trace.inputs))
    numbers = tuple(k - trace.inputs for k in places)
    bare: Made
    if isinstance(plan, Staged):
        bare = channels.without_numbers(plan)
    elif isinstance(plan, Turned):
        bare = plan._replace(plan=plan.plan._replace(keeper=None))
    else:
        bare = plan._replace(keeper=None)
    return _Pattern(bare, trace.looked_up, trace.reach, as_axis, numbers, any(k >= leaves for k in numbers), places)


def _size(pattern: _Pattern) -> int:
    """Bytes of a pattern, with the code that it holds and the graph of what is computed for each material."""
    plan = pattern.plan
    if isinstance(plan, Staged):
        plans = {id(p): p for _, _, parts in plan.blocks for p in parts if p is not None}.values()
        of_graph = plan.alone.graph.size() if plan.alone else 0
        return of_graph + sum(PLAN + size(p.function) for p in plans)
    return PLAN + size((plan.plan if isinstance(plan, Turned) else plan).function)


_PATTERNS: Cache[tuple[Any, ...], _Pattern] = Cache(_size)


def _of_pattern(key: tuple[Any, ...], material: Parametrised, dtype: np.dtype) -> Made | None:
    """A plan for the numbers of this material, if there was one for others of their shapes."""
    patterns = material.alike.get(known)
    if patterns is None:
        patterns = material.alike[known] = Passing()
    pattern = patterns.get(key)
    if pattern is None:
        whole = _pattern_key(key, material)
        pattern = _PATTERNS.find(whole) if whole else None
        if pattern is None:
            return None
        if len(patterns) >= PLANS_KEPT:
            patterns.clear()
        patterns[key] = pattern
    tables = _tables(pattern.looked_up, material, dtype)
    if not _within(pattern.reach, tables):
        return None
    leaves = _leaves(material, pattern.merged)
    if isinstance(pattern.plan, Staged):
        return _remembered(key, material, channels.of_numbers(pattern.plan, leaves, tables, dtype))
    arrays, row, numbered = [], [], []
    for k, place in zip(pattern.numbers, pattern.places, strict=True):
        value = leaves[k]
        if type(value) is float:
            row.append(value)
            numbered.append(place)
        else:
            arrays.append((_parameter(value, dtype, pattern.as_axis)[0], (place,)))
    arrays.append((np.array(row, dtype), tuple(numbered)))  # numbers side by side: one array for all
    if isinstance(pattern.plan, Turned):
        new = renewed(pattern.plan.plan, arrays, tables)
        return _remembered(key, material, pattern.plan._replace(plan=new))
    return _remembered(key, material, renewed(pattern.plan, arrays, tables))


def _pattern_key(key: tuple[Any, ...], material: Parametrised) -> tuple[Any, ...] | None:
    """All that a pattern depends on: the key of its plan, and the structure of the material with the shapes of its
    numbers. None where some of these are of another library than NumPy."""
    shapes: list[tuple[int, ...]] = []
    for x in content(material).leaves:
        if type(x) is float:
            shapes.append(())
        elif isinstance(x, (Fixed, np.ndarray)):
            shapes.append((x.numbers if isinstance(x, Fixed) else x).shape)
        else:
            return None
    return (key, content(material).structure, tuple(shapes))


def _remembered(key: tuple[Any, ...], material: Parametrised, plan: Made) -> Made:
    plans = material._derived.get(known)
    if plans is None:
        plans = material._derived[known] = Passing()
    elif len(plans) >= PLANS_KEPT:
        plans.clear()
    plans[key] = plan
    made(PLAN)
    return plan


def plan(call: Call) -> Made:
    """A plan for calls with such arrays, kept for further ones.

    Raises TraceError if the formula cannot be traced or is too large to be compiled, EngineError where nothing can be
    compiled after all.
    """
    task, material, inputs, count, _ = call
    as_axis = count is not None and count > (1 if MATRIX in task.kinds and content(material).tables else UNROLLED)
    if not SUMMED.isdisjoint(task.kinds) and (task.by or task.adds or not channels.sums_only(task.kinds)):
        as_axis = False  # sums run over the last axis of the batch, which the channels would be
    trace = traced(task, material, 1 if as_axis else count)
    if as_axis and trace.loops:  # channels share them
        as_axis, trace = False, traced(task, material, count)
    if trace.operations > COMPILED:
        raise TraceError(f"a formula of {trace.operations} operations, expected at most {COMPILED} to compile")
    tables = _tables(trace.looked_up, material, inputs[0].dtype)
    if not _within(trace.reach, tables):
        raise TraceError("a formula looks up places beyond a table")
    try:
        new = (_of_stages(call, trace, tables) if as_axis else None) or _of_one(call, trace, tables, as_axis)
    except (DependencyError, EngineError) as error:
        _give_up(error)
        raise EngineError(str(error)) from None
    key = task.plan_key(call.inputs)
    if whole := _pattern_key(key, material):
        _PATTERNS.keep(whole, _pattern(new, trace, as_axis, len(content(material).leaves)))
    return _remembered(key, material, new)


def _of_stages(call: Call, trace: Trace, tables: Sequence[np.ndarray]) -> Staged | None:
    """A plan for many channels, where it pays to compute what they share first."""
    task, material, inputs, count, batch = call
    if task.by or count is None:
        return None
    own = len(content(material).leaves)
    leaves = _leaves(material, any(k >= trace.inputs + own for k in trace.read))
    arrays = list(zip(inputs, task.widths, strict=True))
    return channels.staged(trace, task.kinds, arrays, leaves, tables, batch, count, brief())


def _of_one(call: Call, trace: Trace, tables: Sequence[np.ndarray], as_axis: bool) -> Plan | Turned:
    """A plan of one kernel: each channel has its own copy of the formula, or (`as_axis`) is an element of the batch."""
    task, material, inputs, count, batch = call
    shape = (*batch, count) if as_axis and count is not None else batch
    inputs = [x[..., None, :] for x in inputs] if as_axis else inputs
    dtype = inputs[0].dtype
    arrays = [(x, w) if k in trace.read else None for k, (x, w) in enumerate(zip(inputs, task.widths, strict=True))]
    arrays += _parameters(trace, material, dtype, as_axis)
    if turned.pays(task, shape, dtype):
        return turned.turned(trace, task, arrays, tables, shape, count)
    elements = task.elements(() if as_axis or count is None else (count,))
    uses = [_USES.get(kind, ONCE if as_axis else EACH) for kind in task.kinds]
    uses += uses[:1] * (len(elements) - len(uses))
    results = [Result(*parts) for parts in zip(trace.results, uses, elements, strict=True)]
    return prepare(trace.graph, results, arrays, trace.inputs, tables, shape, dtype, brief(), task.adds)


_USES = {VALUE: EACH, MATRIX: EACH, TOTAL: ADDED_UP, COUNT: ADDED_UP, SQUARE: SQUARED}


def _tables(looked_up: Collection[int], material: Parametrised, dtype: np.dtype) -> list[np.ndarray]:
    """The tables in their order; those that are not looked up, which may take long to make, are left empty."""
    tables = content(material).tables
    if not tables:
        return []
    with np.errstate(all="ignore"):
        return [_table(t, dtype) if k in looked_up else np.zeros(2, dtype) for k, t in enumerate(tables)]


def _within(reach: dict[int, int], tables: Sequence[np.ndarray]) -> bool:
    """Whether the constant places that are looked up are in the tables, and places that differ by constants can be:
    compiled code reads them as they are."""
    return all(place < len(tables[k]) - 1 for k, place in reach.items())


def _table(table: Fixed, dtype: np.dtype) -> np.ndarray:
    if isinstance(table, AsStored) and table.numbers.dtype.itemsize < dtype.itemsize:
        raise TraceError("a formula looks up a table that is too large to be converted to double precision")
    if isinstance(table, Roomy) and table.whole.dtype == dtype:
        return table.whole
    padded: np.ndarray = table.once(_padded, dtype)
    return padded


def _padded(numbers: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """A table with an entry more: kernels read two at a time."""
    padded = np.empty(len(numbers) + 1, dtype)
    padded[:-1], padded[-1] = numbers, 0.0
    return padded


def interpreted(trace: Trace, call: Call, at: Box) -> list[np.ndarray]:
    """The nodes of all results of a trace, computed by NumPy for a box of the batch of a call."""
    dtype = call.inputs[0].dtype
    arrays = [*call.inputs, *(x and x[0] for x in _parameters(trace, call.material, dtype, False))]

    def load(k: int, c: int) -> Any:
        array = arrays[k]
        assert array is not None  # an array that the graph reads
        return cut(array, call.batch, at)[..., c]

    nodes = [n for result in trace.results for n in result]
    with np.errstate(all="ignore"):
        return evaluate(trace.graph, nodes, load, _tables(trace.looked_up, call.material, dtype), dtype)


def _parameters(
    trace: Trace, material: Parametrised, dtype: np.dtype, as_axis: bool
) -> list[tuple[np.ndarray, int] | None]:
    """The arrays of the parameters, and of the merged ones, as far as they are read."""
    count, first = len(content(material).leaves), trace.inputs
    every = range(2 * count if trace.merged else count)
    leaves = _leaves(material, any(k >= first + count for k in trace.read))
    return [_parameter(leaves[k], dtype, as_axis) if first + k in trace.read else None for k in every]


def _leaves(material: Parametrised, merged: bool) -> list[Any]:
    """The numbers of a material, and where they are wanted those with channels merged."""
    leaves = content(material).leaves
    return leaves + content(material.merged(LIBRARIES["numpy"].merge_channels)).leaves if merged else leaves


def _parameter(value: Any, dtype: np.dtype, as_axis: bool) -> tuple[np.ndarray, int]:
    if isinstance(value, Fixed):
        array = value.once(contiguous, dtype)
    elif type(value) is float:
        array = np.array((value,), dtype)
    else:
        array = np.ascontiguousarray(value, dtype).reshape(np.shape(value) or 1)
    if as_axis:
        array = array[..., None]
    return array, array.shape[-1]


def carried_out(plan: Made, inputs: Sequence[np.ndarray], out: np.ndarray | None) -> list[Any]:
    """The results of a plan; those of a single direction as numbers. `out` takes the first one."""
    if type(plan) is Turned:
        return turned.carried_out(plan, inputs)
    carry: Any = carry_out if type(plan) is Plan else channels.carried_out
    if out is not None:
        direct = out.flags.c_contiguous and not any(np.may_share_memory(out, x) for x in inputs)
        results = carry(plan, inputs, (out,) if direct else ())
        if not direct:
            out[...] = results[0]
        return [out, *results[1:]]
    results = carry(plan, inputs)
    return [r if r.ndim else r[()] for r in results] if type(plan) is Plan and plan.scalar else results


def summed_up(plan: Made, inputs: Sequence[np.ndarray], into: Sequence[np.ndarray] | None) -> list[Any]:
    """The results of a plan; with `into` those of a plan that adds to arrays."""
    if into is None:
        return carried_out(plan, inputs, None)
    if type(plan) is Turned:
        return turned.carried_out(plan, inputs, into)
    assert type(plan) is Plan  # sums that add are no stages
    return carry_out(plan, inputs, into)
