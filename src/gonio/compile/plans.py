"""Plans: kernels run over arrays, with the axes to loop over, the place of every array, and the shares of threads.

A plan holds all that shapes and strides decide; to carry it out takes addresses only.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from ctypes import c_int64, c_ssize_t, c_void_p, cast
from functools import partial
from operator import mul
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..machine import memory
from ..trace.graph import MASK, Graph
from . import store
from .llvm.program import ADDED, EACH, PACKED, PLANES, ROW, SAME, STRIDED, SUMS, Array, Output, Program
from .threads import threads
from .workers import awake, busy, possible, together, wake

# Work is counted in operations of a graph on elements; a thread does 5e7 in a millisecond.
PARALLEL = 1 << 21  # work from which on helpers that are awake share it
WAKING = 1 << 24  # work from which on it pays to wake helpers that sleep: that takes as long as 1 << 23 on one thread
AGAIN = 2e-4  # seconds; a call that follows another so soon wakes helpers for those to come
GRAIN = 1 << 18  # work of a part, at least
PIECES = 8  # parts of a batch for each thread, so that none waits long for another
CACHED = 1 << 24  # bytes read and written up to which results are left in the caches, where a caller finds them sooner
LINE = 64  # of so many elements parts of the inner axis begin: each writes whole lines of the cache, of any dtype
PIECE = 1 << 28  # work of the first call of a kernel: some hundredths of a second
TILE = 2048  # elements of the inner axis whose sums in memory stay in the cache along the outer one
LOOPED = 32  # steps of loops, about; a ray costs more
QUICK = 0.02  # seconds; after a shorter call the next one does twice as much

DTYPES = {np.dtype(np.float32): "float32", np.dtype(np.float64): "float64"}


class Result(NamedTuple):
    """A result of a kernel: nodes side by side, their use (see `program`), and the shape of one element."""

    nodes: tuple[int, ...]
    use: str
    element: tuple[int, ...]


class _View(NamedTuple):
    """An array over the axes of a batch: the length of its vectors, and bytes from one element to the next."""

    width: int
    strides: tuple[int, ...]
    component: int


class _Axis(NamedTuple):
    """An axis to loop over, or several joined into one: its length, and every array's step in bytes."""

    length: int
    steps: tuple[int, ...]


class KernelPlan(NamedTuple):
    """Calls with arrays of the same shapes and strides: everything but the addresses."""

    function: store.Function
    entry: int  # its address
    block: Any  # makes a copy of the block of arguments, without addresses that a call brings
    ready: list[tuple[Any, ...]]  # arguments of a call of the kernel, each used by one thread at a time
    inputs: tuple[tuple[int, int], ...]  # word and number of the arrays that a call brings
    outputs: tuple[tuple[int, tuple[int, ...], np.dtype, int], ...]  # word, shape, dtype and bytes
    scalar: bool  # whether a result has no axes
    above: tuple[tuple[int, tuple[int, ...]], ...]  # further axes: length, and the step of each address
    addresses: tuple[int, ...]  # the words that hold addresses
    outer: int
    inner: int
    work: int
    divisible: bool  # whether the inner axis may be shared out
    rows: bool  # whether the outer axis may be
    piece: int  # elements that one call computes at first
    grain: int  # elements of a part, at least
    keeper: Any  # owns the arrays whose addresses are in the words


class Data(NamedTuple):
    """What a graph is evaluated over: arrays that broadcast to the `shape` of a batch, and tables.

    `arrays`: (array, length of its vectors), whose other axes broadcast to `shape`; None for one that nothing reads.
    The first `brought` arrays come with each call, in the same shapes and strides. `tables` are padded by one entry.
    """

    arrays: Sequence[tuple[np.ndarray, int] | None]
    brought: int
    tables: Sequence[np.ndarray]
    shape: tuple[int, ...]
    dtype: np.dtype


def prepare(
    graph: Graph, results: Sequence[Result], data: Data, single: bool = False, adds: bool = False
) -> KernelPlan:
    """A plan to evaluate a graph over data.

    A result that is not stored for each element is stored once for the whole last axis. `single`, `adds`: see
    `Program`.
    """
    arrays, brought, tables, shape, dtype = data
    views = [_View(1, (0,) * len(shape), 0) if x is None else _view(*x, len(shape)) for x in arrays]
    shapes = [shape if r.use == EACH else shape[1:] if r.use == ADDED else shape[:-1] for r in results]
    dtypes = [
        np.dtype(np.float64 if r.use in (*SUMS, ADDED) else bool if graph.kinds[r.nodes[0]] == MASK else dtype)
        for r in results
    ]
    sizes = [math.prod(r.element) * d.itemsize for r, d in zip(results, dtypes, strict=True)]
    stores = [_contiguous(s, len(shape), size) for s, size in zip(shapes, sizes, strict=True)]
    stores = [(0, *s[:-1]) if r.use == ADDED else s for r, s in zip(results, stores, strict=True)]
    whole = all(r.use in (EACH, ADDED) for r in results)
    axes = _axes(shape, [v.strides for v in views] + stores, keep_last=not whole)
    layouts = tuple(_layout(v, axes, k, dtype.itemsize) for k, v in enumerate(views))
    uses = tuple(Output(r.nodes, r.use) for r in results)
    program = Program(graph, uses, layouts, len(tables), DTYPES[dtype], single, adds)
    inner, outer, above = axes[-1], axes[-2], axes[:-2]
    words: list[int] = []
    places, inputs, outputs = [], [], []
    for k, (array, view) in enumerate(zip(arrays, views, strict=True)):
        places.append(len(words))
        if array is not None and k < brought:
            inputs.append((len(words), k))
        address = 0 if array is None or k < brought else _address(array[0])
        words += [address, outer.steps[k], inner.steps[k], view.component]
    for table in tables:
        words += [_address(table), len(table) - 2]
    for k, (r, s, d) in enumerate(zip(results, shapes, dtypes, strict=True), len(arrays)):
        places.append(len(words))
        full = (*s, *r.element)
        outputs.append((len(words), full, d, math.prod(full) * d.itemsize))
        words += [0, outer.steps[k]]
    read = sum(math.prod(n for n, s in zip(shape, v.strides, strict=True) if s) * v.width for v in views)
    words.append(read * dtype.itemsize + sum(size for _, _, _, size in outputs) > CACHED)
    function: Any = store.kernel(program)
    operations = len(graph.operations) * (1 if {"loop", "rays"}.isdisjoint(graph.operations) else LOOPED)
    return KernelPlan(
        function,
        cast(function, c_void_p).value or 0,
        partial((c_int64 * (len(words) + 1)).from_buffer_copy, (c_int64 * (len(words) + 1))(*words)),
        [],
        tuple(inputs),
        tuple(outputs),
        any(not full for _, full, _, _ in outputs),
        tuple((axis.length, axis.steps) for axis in above),
        tuple(places),
        outer.length,
        inner.length,
        outer.length * inner.length * operations,
        whole,
        all(r.use != ADDED or outer.steps[k] for k, r in enumerate(results, len(arrays))),
        max(PIECE // operations, 1),
        max(GRAIN // operations, 1),
        (tuple(arrays[brought:]), tuple(tables)),
    )


def renewed(
    plan: KernelPlan, arrays: Sequence[tuple[np.ndarray, tuple[int, ...]]], tables: Sequence[np.ndarray]
) -> KernelPlan:
    """The plan with other parameters, of the same shapes and strides, and other tables.

    `arrays`: each with the place in `prepare` of the array that it is, or of several whose one number each it has side
    by side.
    """
    block, words = plan.block(), plan.addresses
    for array, places in arrays:
        address = _address(array)
        for i, place in enumerate(places):
            block[words[place]] = address + i * array.itemsize
    first = 4 * (len(words) - len(plan.outputs))
    for k, table in enumerate(tables):
        block[first + 2 * k], block[first + 2 * k + 1] = _address(table), len(table) - 2
    return plan._replace(block=partial(type(block).from_buffer_copy, block), ready=[], keeper=(arrays, tables))


def carry_out(
    plan: KernelPlan, inputs: Sequence[np.ndarray], destinations: Sequence[np.ndarray] = ()
) -> list[np.ndarray]:
    """The results of a plan for these arrays; `destinations` are those that take the first."""
    count = _crew(plan.work) if plan.work >= PARALLEL else 1
    try:
        arguments = plan.ready.pop()
    except IndexError:
        outer = plan.outer
        arguments = plan.block(), c_int64(outer), c_int64(plan.inner), c_int64(-outer if plan.rows else TILE)
    block = arguments[0]
    for word, k in plan.inputs:
        block[word] = _address(inputs[k])
    results, outputs = [], plan.outputs
    if destinations:
        results, outputs = [*destinations], outputs[len(destinations) :]
        for result, (word, *_) in zip(destinations, plan.outputs, strict=False):
            block[word] = _address(result)
    for word, shape, dtype, size in outputs:
        result = np.empty(shape, dtype) if size < memory.SMALL else memory.empty(shape, dtype)
        block[word] = _address(result)
        results.append(result)
    if not plan.above:
        _run(plan, arguments, count)
        plan.ready.append(arguments)
    else:
        for _ in _moved(plan, block):
            _run(plan, arguments, count)
    if plan.work >= PARALLEL:
        _ended[0] = perf_counter()
    return results


_ended = [0.0]
"""When the last call ended that threads may share."""


def _moved(plan: KernelPlan, block: Any) -> Iterator[None]:
    """The block of arguments at each step along the further axes: the addresses that a step moves are set."""
    steps = zip(*(steps for _, steps in plan.above), strict=True)
    words = [(word, block[word], by) for word, by in zip(plan.addresses, steps, strict=True) if any(by)]
    *others, (length, _) = plan.above
    for at in np.ndindex(*(n for n, _ in others)):
        row = [(word, start + sum(map(mul, at, by)), by[-1]) for word, start, by in words]
        for n in range(length):
            for word, start, step in row:
                block[word] = start + n * step
            yield


def _crew(work: int) -> int:
    """How many threads share so much work. Sleeping helpers are woken now: that takes longer than all else here."""
    count = threads()
    if count == 1 or busy() or not possible():
        return 1
    if work >= WAKING or perf_counter() - _ended[0] < AGAIN:
        wake(count - 1)
    elif not awake():
        return 1
    return count


def _run(plan: KernelPlan, arguments: tuple[Any, ...], count: int) -> None:
    block = arguments[0]
    if count == 1 and plan.work <= PIECE:
        block[-1] = 0
        plan.function(*arguments)
        return
    for outer_stop, inner_stop, grain in _pieces(plan, block, count):
        if count == 1:
            plan.function(block, c_int64(outer_stop), c_int64(inner_stop), c_int64(grain))
            continue
        together(count, plan.entry, block, outer_stop, inner_stop, grain)
        if plan.work > PIECE:
            wake(count - 1)  # again: idle helpers soon fall asleep


def _pieces(plan: KernelPlan, block: Any, count: int) -> Iterator[tuple[int, int, int]]:
    """The ends of a kernel's loops and its grain, call by call. Each call takes some hundredths of a second, and
    interrupts are answered between calls."""
    outer, inner = plan.outer, plan.inner
    rows = plan.rows and (outer >= PIECES * count or not plan.divisible)
    length, width = (outer, inner) if rows else (inner, outer)
    step = max(plan.piece // width, 1)
    if not rows:
        step += -step % LINE
    grain = max(min(step, length) // (PIECES * count), plan.grain // width, 1)
    if not plan.rows:
        grain = min(grain, TILE)
    done = 0
    while done < length:
        block[-1], done = done, min(done + step, length)
        began = perf_counter()
        yield (done, inner, -grain) if rows else (outer, done, grain + -grain % LINE)
        if perf_counter() - began < QUICK:
            step *= 2


_number_at, _HEAD = c_ssize_t.from_address, object.__basicsize__


def _slow_address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def _quick_address(array: np.ndarray) -> int:
    # The first field of a NumPy array after the head of every Python object: part of NumPy's binary interface.
    return _number_at(id(array) + _HEAD).value


def _works() -> bool:
    return all(_quick_address(x) == _slow_address(x) for x in (np.zeros(3), np.zeros((4, 3), np.float32)[1:]))


_address = _quick_address if sys.implementation.name == "cpython" and _works() else _slow_address
"""The address of an array's first number."""


def _view(array: np.ndarray, width: int, axes: int) -> _View:
    batch_axes = array.ndim - 1
    strides = [0 if array.shape[i] == 1 else array.strides[i] for i in range(batch_axes)]
    return _View(width, (0,) * (axes - batch_axes) + tuple(strides), array.strides[-1] if width > 1 else array.itemsize)


def _contiguous(shape: tuple[int, ...], axes: int, size: int) -> tuple[int, ...]:
    """Steps of a contiguous array whose elements have `size` bytes; 0 along an axis that it lacks at the end."""
    steps = []
    for length in reversed(shape):
        steps.append(size)
        size *= length
    return tuple(reversed(steps)) + (0,) * (axes - len(shape))


def _axes(shape: tuple[int, ...], strides: Sequence[tuple[int, ...]], keep_last: bool) -> list[_Axis]:
    """The axes to loop over, at least two: without those of length 1, and with contiguous ones joined."""
    axes: list[_Axis] = []
    for i in reversed(range(len(shape))):
        length, steps = shape[i], tuple(s[i] for s in strides)
        last = keep_last and i == len(shape) - 1
        if length == 1 and not last:
            continue
        if len(axes) > keep_last and steps == tuple(s * axes[-1].length for s in axes[-1].steps):
            axes[-1] = _Axis(length * axes[-1].length, axes[-1].steps)
        else:
            axes.append(_Axis(length, steps))
    while len(axes) < 2:
        axes.append(_Axis(1, (0,) * len(strides)))
    return axes[::-1]


def _layout(view: _View, axes: Sequence[_Axis], k: int, size: int) -> Array:
    step = axes[-1].steps[k]
    if step == 0:
        layout = ROW if any(axis.steps[k] for axis in axes[:-1]) else SAME
    elif step == view.width * size and view.component == size:
        layout = PACKED
    elif step == size:
        layout = PLANES
    else:
        layout = STRIDED
    return Array(view.width, layout)
