"""NumPy evaluation in blocks that fit the processor's cache, shared out to threads, where formulas are not compiled."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from threading import Lock

import numpy as np

from ..arrays.kinds import MATRIX, SCALAR, SQUARE, SUMMED, TERMS, VECTOR
from ..compile.threads import share
from ..machine import memory

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
