"""NumPy evaluation in blocks that fit the processor's cache, shared out to threads, where formulas are not compiled."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from threading import Lock
from typing import Any

import numpy as np

from ..arrays import LIBRARIES, Fixed, Later
from ..arrays.kinds import MATRIX, SCALAR, SQUARE, SUMMED, TERMS, VECTOR
from ..compile.threads import share
from ..formula import tree
from ..formula.parametrised import Parametrised
from ..machine import memory
from .call import Call, parameters, tables_of
from .interpret import evaluate
from .tracing import Trace, traced

BLOCK = 1 << 16  # directions per block: so many that the cost of Python vanishes, so few that they fit the cache

Box = tuple[slice, ...]


def in_blocks(
    evaluate: Callable[[Sequence[np.ndarray], tuple[int, ...], Box], Sequence[np.ndarray]],
    kinds: Sequence[str],
    inputs: Sequence[np.ndarray],
    batch: tuple[int, ...],
    channels: int | None,
) -> list[np.ndarray]:
    """Results of these kinds (see `batch`) over a batch, by `evaluate(inputs of a box, its shape, box)`."""
    dtype, lock = inputs[0].dtype, Lock()
    for kind in kinds:
        memory.check(result_shape(kind, batch, channels), dtype)
    outs: list[np.ndarray] = []

    def work(at: Box) -> list[np.ndarray]:
        with np.errstate(all="ignore"):
            shape = tuple(s.stop - s.start for s in at)
            parts = evaluate([cut(x, batch, at) for x in inputs], shape, at)
            shapes = [result_shape(TERMS.get(kind, kind), shape, channels) for kind in kinds]
            return [np.broadcast_to(part, s) for part, s in zip(parts, shapes, strict=True)]

    def store(at: Box, parts: Sequence[np.ndarray]) -> None:
        for out, part, kind in zip(outs, parts, kinds, strict=True):
            if kind in SUMMED:
                with lock:
                    out[at[:-1]] += part.sum(axis=len(at) - 1, dtype=np.float64)
            else:
                out[at] = part

    everything = tuple(slice(0, n) for n in batch)
    boxes = list(_boxes(everything, max(BLOCK // (channels or 1), 1024)))
    first = work(boxes[0] if boxes else everything)
    for part, kind in zip(first, kinds, strict=True):
        shape = result_shape(kind, batch, channels)
        new = (
            memory.empty(shape, part.dtype if part.dtype == bool else dtype) if kind not in SUMMED else np.zeros(shape)
        )
        outs.append(new)
    if boxes:
        store(boxes[0], first)
        share(lambda at: store(at, work(at)), [(box,) for box in boxes[1:]])
    return [(out * out if kind == SQUARE else out)[()] for out, kind in zip(outs, kinds, strict=True)]


def result_shape(kind: str, batch: tuple[int, ...], channels: int | None) -> tuple[int, ...]:
    """The shape of a result of a kernel."""
    if kind in SUMMED:
        batch, kind = batch[:-1], TERMS[kind]
    of_channels = (channels,) if channels else ()
    return batch + {SCALAR: (), VECTOR: (3,), MATRIX: (*of_channels, 4, 4)}.get(kind, of_channels)


def _boxes(box: Box, size: int) -> Iterator[Box]:
    """Boxes of at most `size` elements that tile a box, longest runs along the last axes; none of an empty box."""
    lengths = [s.stop - s.start for s in box]
    if math.prod(lengths) <= size:
        if 0 not in lengths:
            yield box
        return
    axis = next(i for i, n in enumerate(lengths) if n > 1)
    inner = math.prod(lengths[axis + 1 :])
    step = max(size // inner, 1) if inner < size else 1
    for start in range(box[axis].start, box[axis].stop, step):
        stop = min(start + step, box[axis].stop)
        yield from _boxes((*box[:axis], slice(start, stop), *box[axis + 1 :]), size)


def cut(x: np.ndarray, batch: tuple[int, ...], at: Box) -> np.ndarray:
    """The part of `x` (batch axes broadcastable to `batch`, then one more) that belongs to the box `at`."""
    axes = x.ndim - 1
    index = [slice(None) if x.shape[i] == 1 else at[len(batch) - axes + i] for i in range(axes)]
    return x[tuple(index)] if axes > 0 else x


def by_trace(call: Call) -> list[Any]:
    """The results of a task and its derivatives, computed from its trace. Raises TraceError where it has none."""
    task, results = call.task, list[Any]()
    trace = traced(task, call.material, call.channels)
    kinds = [*task.kinds, *[task.kinds[0]] * (len(trace.results) - len(task.kinds))]
    flat = [kind if kind in SUMMED else SCALAR for kind, of in zip(kinds, trace.results, strict=True) for _ in of]
    found = in_blocks(lambda _, __, at: interpreted(trace, call, at), flat, call.inputs, call.batch, None)
    parts, elements = iter(found), task.elements((call.channels,) if call.channels else ())
    for kind, nodes, element in zip(kinds, trace.results, elements, strict=True):
        result = np.stack(list(islice(parts, len(nodes))), -1)
        results.append(result.reshape((*(call.batch[:-1] if kind in SUMMED else call.batch), *element))[()])
    return call.put(results)


def interpreted(trace: Trace, call: Call, at: Box) -> list[np.ndarray]:
    """The nodes of all results of a trace, for a box of the batch of a call."""
    dtype = call.inputs[0].dtype
    arrays = [*call.inputs, *(x and x[0] for x in parameters(trace, call.material, dtype, False))]

    def load(k: int, c: int) -> Any:
        array = arrays[k]
        assert array is not None  # an array that the graph reads
        return cut(array, call.batch, at)[..., c]

    nodes = [n for result in trace.results for n in result]
    with np.errstate(all="ignore"):
        return evaluate(trace.graph, nodes, load, tables_of(trace.looked_up, call.material, dtype), dtype)


def by_formula(call: Call) -> list[Any]:
    """The results of the formula itself."""
    lib, (task, material, channels, batch) = LIBRARIES["numpy"], (call.task, call.material, call.channels, call.batch)

    def of_box(arrays: Sequence[np.ndarray], shape: tuple[int, ...], at: Box) -> list[np.ndarray]:
        def convert(value: Any) -> Any:
            value = value.numbers if isinstance(value, Fixed) else value
            return lib.convert(cut(value, batch, at) if isinstance(value, np.ndarray) else value, arrays[0])

        def bound(m: Parametrised) -> Parametrised:
            return tree.bind(m, convert, lambda table: Later(table, arrays[0].dtype))

        m = bound(material)
        mean = bound(tree.merged(material, lib.merge_channels)) if channels else m
        parts = [lib.split(x, shape, channels is not None) for x in arrays]
        terms = [TERMS.get(kind, kind) for kind in task.kinds]
        return lib.assemble(terms, [task.kernel(m, mean, *parts)], arrays[0], shape, channels is not None)

    return call.put(in_blocks(of_box, task.kinds, call.inputs, batch, channels))
