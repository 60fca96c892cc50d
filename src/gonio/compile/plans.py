"""Plans: kernels run over arrays, with the axes to loop over, the place of every array, and the shares of threads.

A plan holds all that shapes and strides decide; to carry it out takes addresses only.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from ctypes import addressof, c_int64, c_ssize_t, c_void_p, cast
from functools import partial
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..trace.graph import MASK, Graph
from . import memory, store
from .llvm.program import EACH, PACKED, PLANES, ROW, SAME, STRIDED, TOTAL, Array, Output, Program
from .threads import threads
from .workers import busy, possible, together, wake

PARALLEL = 32_768  # elements from which on threads are worth their start
PIECES = 8  # parts of a batch for each thread, so that none waits long for another
GRAIN = 4096  # elements of a part, at least
WAKING = 65_536  # elements from which on it pays to wake sleeping helpers
PIECE = 1 << 28  # operations on elements of the first call of a kernel: some hundredths of a second of work
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


class Plan(NamedTuple):
    """Calls with arrays of the same shapes and strides: everything but the addresses."""

    function: store.Function
    entry: int  # its address
    block: Any  # makes a copy of the block of arguments, without addresses that a call brings
    inputs: tuple[tuple[int, int], ...]  # word and number of the arrays that a call brings
    outputs: tuple[tuple[int, tuple[int, ...], np.dtype, int], ...]  # word, shape, dtype and bytes
    above: tuple[tuple[int, tuple[int, ...]], ...]  # further axes: length, and the step of each address
    addresses: tuple[int, ...]  # the words that hold addresses
    outer: int
    inner: int
    divisible: bool  # whether the inner axis may be shared out
    piece: int  # elements that one call computes at first
    keeper: Any  # owns the arrays whose addresses are in the words


def prepare(
    graph: Graph,
    results: Sequence[Result],
    arrays: Sequence[tuple[np.ndarray, int] | None],
    brought: int,
    tables: Sequence[np.ndarray],
    shape: tuple[int, ...],
    dtype: np.dtype,
) -> Plan:
    """A plan to evaluate a graph over a batch of this shape.

    `arrays`: (array, length of its vectors), whose other axes broadcast to `shape`; None for one that nothing reads.
    `tables` are padded by one entry. The first `brought` arrays come with each call, in the same shapes and strides. A
    result that is not stored for each element is stored once for the whole last axis.
    """
    views = [_View(1, (0,) * len(shape), 0) if x is None else _view(*x, len(shape)) for x in arrays]
    shapes = [shape if r.use == EACH else shape[:-1] for r in results]
    dtypes = [
        np.dtype(np.float64 if r.use == TOTAL else bool if graph.kinds[r.nodes[0]] == MASK else dtype) for r in results
    ]
    sizes = [math.prod(r.element) * d.itemsize for r, d in zip(results, dtypes, strict=True)]
    stores = [_contiguous(s, len(shape), size) for s, size in zip(shapes, sizes, strict=True)]
    whole = all(r.use == EACH for r in results)
    axes = _axes(shape, [v.strides for v in views] + stores, keep_last=not whole)
    layouts = tuple(_layout(v, axes, k, dtype.itemsize) for k, v in enumerate(views))
    program = Program(graph, tuple(Output(r.nodes, r.use) for r in results), layouts, len(tables), DTYPES[dtype])
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
    function: Any = store.kernel(program)
    return Plan(
        function,
        cast(function, c_void_p).value or 0,
        partial((c_int64 * (len(words) + 1)).from_buffer_copy, (c_int64 * (len(words) + 1))(*words)),
        tuple(inputs),
        tuple(outputs),
        tuple((axis.length, axis.steps) for axis in above),
        tuple(places),
        outer.length,
        inner.length,
        whole,
        max(PIECE // len(graph.operations), 1),
        (tuple(arrays[brought:]), tuple(tables)),
    )


def renewed(plan: Plan, arrays: Sequence[tuple[np.ndarray, int] | None], tables: Sequence[np.ndarray]) -> Plan:
    """The plan with other parameters, of the same shapes and strides, and other tables."""
    block, places = plan.block(), plan.addresses[: len(plan.addresses) - len(plan.outputs)]
    for place, array in zip(places[len(places) - len(arrays) :], arrays, strict=True):
        if array is not None:
            block[place] = _address(array[0])
    for k, table in enumerate(tables):
        place = 4 * len(places) + 2 * k
        block[place], block[place + 1] = _address(table), len(table) - 2
    return plan._replace(block=partial(type(block).from_buffer_copy, block), keeper=(arrays, tables))


def carry_out(plan: Plan, inputs: Sequence[np.ndarray], out: np.ndarray | None = None) -> list[np.ndarray]:
    """The results of a plan for these arrays; `out` takes the first."""
    block = plan.block()
    for word, k in plan.inputs:
        block[word] = _address(inputs[k])
    results = []
    for word, shape, dtype, size in plan.outputs:
        if out is not None:
            result, out = out, None
        elif size < memory.SMALL:
            result = np.empty(shape, dtype)
        else:
            result = memory.empty(shape, dtype)
        block[word] = _address(result)
        results.append(result)
    if not plan.above:
        _run(plan, block)
        return results
    start = [block[word] for word in plan.addresses]
    for at in np.ndindex(*(length for length, _ in plan.above)):
        for i, word in enumerate(plan.addresses):
            block[word] = start[i] + sum(n * steps[i] for n, (_, steps) in zip(at, plan.above, strict=True))
        _run(plan, block)
    return results


def _run(plan: Plan, block: Any) -> None:
    outer, inner = plan.outer, plan.inner
    size = outer * inner
    count = threads() if size >= PARALLEL and not busy() else 1
    shared = count > 1 and possible()
    if not shared and size <= plan.piece:
        block[-1] = 0
        plan.function(addressof(block), outer, inner, -outer)
        return
    for outer_stop, inner_stop, grain in _pieces(plan, block, count if shared else 1):
        if shared:
            wake(count - 1 if size >= WAKING else 0)  # each time: idle helpers soon fall asleep
            together(count, plan.entry, addressof(block), outer_stop, inner_stop, grain)
        else:
            plan.function(addressof(block), outer_stop, inner_stop, grain)


def _pieces(plan: Plan, block: Any, count: int) -> Iterator[tuple[int, int, int]]:
    """The ends of a kernel's loops and its grain, call by call. Each call takes some hundredths of a second, and
    interrupts are answered between calls."""
    outer, inner = plan.outer, plan.inner
    rows = outer >= PIECES * count or not plan.divisible
    length, width = (outer, inner) if rows else (inner, outer)
    step = max(plan.piece // width, 1)
    grain = max(min(step, length) // (PIECES * count), 1 if rows else GRAIN // outer)
    done = 0
    while done < length:
        block[-1], done = done, min(done + step, length)
        began = perf_counter()
        yield (done, inner, -grain) if rows else (outer, done, grain + -grain % 64)
        if perf_counter() - began < QUICK:
            step *= 2


def _slow_address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def _quick_address(array: np.ndarray) -> int:
    # The first field of a NumPy array after the head of every Python object: part of NumPy's binary interface.
    return c_ssize_t.from_address(id(array) + object.__basicsize__).value


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
