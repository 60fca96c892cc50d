"""From arrays to formulas and back: a kernel written on components is run over any batch, channels and library.

A kernel is a function `kernel(m, mean, *inputs)`: `m` is the material with parameters ready to compute with, `mean`
the same with channels merged (what sampling uses), each input a tuple of components. What it returns is declared as
"value" (has the channel axis), "scalar" (has none) or "vector". Kernels see no axis, no channel and no library.

NumPy batches are cut into blocks that stay in the processor's cache and are shared out to threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from typing import Any

import numpy as np

from . import ops
from .errors import ArrayTypeError, ShapeError
from .parametrised import Parametrised

BLOCK = 1 << 16  # directions per block: large enough for the cost of Python to vanish, small enough for the cache

Kernel = Callable[..., tuple]


def run(
    kernel: Kernel,
    kinds: Sequence[str],
    material: Parametrised,
    inputs: Sequence[Any],
    widths: Sequence[int],
    out: np.ndarray | None = None,
) -> list[Any]:
    """Results of `kernel` over the broadcast batch of `inputs`, whose last axes have lengths `widths`."""
    lib, inputs = ops.as_arrays(*inputs)
    shapes = [lib.shape(x) for x in inputs]
    for shape, width in zip(shapes, widths, strict=True):
        if not shape or shape[-1] != width:
            what = "directions" if width == 3 else "random numbers"
            raise ShapeError(f"{what}: got shape {shape}, expected (..., {width})")
    channels, parameter_shapes = _parameter_shapes(material, lib, inputs[0])
    batch = ops.broadcast_shape([s[:-1] for s in shapes] + parameter_shapes, "directions and parameters")

    def evaluate(arrays: Sequence[Any], shape: tuple[int, ...], at: tuple[slice, ...] | None) -> list[Any]:
        like = arrays[0]

        def convert(value: Any, channel: int | None) -> Any:
            if at is not None and isinstance(value, np.ndarray):
                value = _cut(value, batch, at)
            return lib.convert(value, like, channel, shape)

        runs = []
        for c in range(channels or 1) if lib.channel_loop else [None]:
            m = material.bind(partial(convert, channel=c), lambda _, v, cache: lib.table(v, like, cache))
            mean = m
            if channels:
                mean = material.merged(lib.merge_channels).bind(
                    lambda v: convert(lib.merge_channels(v, "mean"), None),
                    lambda _, v, cache: lib.table(v, like, cache),
                )
            parts = [lib.split(x, shape, channels is not None) for x in arrays]
            runs.append(kernel(m, mean, *parts))
        return lib.assemble(kinds, runs, like, shape, channels is not None)

    if lib.name != "numpy":
        if out is not None:
            raise ArrayTypeError(f"out= is for NumPy arrays; got {lib.name} directions")
        whole = [_shape(kind, batch, channels) for kind in kinds]
        if lib.channel_loop and 0 in batch:
            return [lib.empty(inputs[0], shape, len(shape) > len(batch)) for shape in whole]
        results = evaluate(inputs, batch, None)
        if lib.channel_loop:
            return results
        return [lib.module.broadcast_to(r, shape) for r, shape in zip(results, whole, strict=True)]
    with np.errstate(all="ignore"):
        results = _in_blocks(evaluate, kinds, inputs, batch, channels)
    if out is None:
        return results
    if not isinstance(out, np.ndarray):
        raise ArrayTypeError(f"out: got {type(out).__name__}, expected a NumPy array")
    if out.shape != results[0].shape or out.dtype != results[0].dtype:
        raise ShapeError(f"out: got {out.dtype} {out.shape}, expected {results[0].dtype} {results[0].shape}")
    out[...] = results[0]
    return [out]


def full_shape(material: Parametrised, shape: tuple[int, ...]) -> tuple[int, ...]:
    """The batch shape of directions together with the maps (parameters with batch axes) of a material."""
    maps = [tuple(v.shape[:-1]) for v in material.leaves() if getattr(v, "ndim", 0) > 1]
    return ops.broadcast_shape([shape, *maps], "directions and parameters") if maps else shape


def texels(material: Parametrised, batch: tuple[int, ...], index: np.ndarray) -> Parametrised:
    """The material at elements `index` (n,) of a flattened batch: its maps as (n, 1, C), to meet (n, 1, 3)."""

    def pick(value: Any) -> Any:
        if getattr(value, "ndim", 0) < 2:
            return value
        return np.broadcast_to(value, (*batch, value.shape[-1])).reshape(-1, 1, value.shape[-1])[index]

    return material.each(pick) if full_shape(material, ()) else material


def _parameter_shapes(material: Parametrised, lib: ops.Library, like: Any) -> tuple[int | None, list]:
    """The number of channels (None without a channel axis) and the batch shapes of the parameters."""
    channels, batches, widths = None, [], set()
    for value in material.leaves():
        own = ops.library_of_type(type(value))
        if own is None:
            continue
        if own not in (lib, ops.LIBRARIES["numpy"]):
            raise ArrayTypeError(
                f"a parameter is a {own.name} array but the directions are {lib.name} arrays; "
                f"expected {lib.name} or NumPy parameters"
            )
        shape = own.shape(value)
        if shape:
            widths.add(shape[-1])
            batches.append(shape[:-1])
    if widths:
        channels = max(widths)
        if widths - {1, channels}:
            raise ShapeError(
                f"parameters have {sorted(widths)} channels (lengths of their last axes); expected 1 or one number"
            )
    return channels, batches


def _in_blocks(
    evaluate: Callable, kinds: Sequence[str], inputs: Sequence[np.ndarray], batch: tuple[int, ...], channels: int | None
) -> list[np.ndarray]:
    size = int(np.prod(batch, dtype=int))
    block = max(BLOCK // (channels or 1), 1024)
    if size <= block:
        results = evaluate(inputs, batch, None)
        return [_full(r, _shape(kind, batch, channels)) for r, kind in zip(results, kinds, strict=True)]
    dtype = inputs[0].dtype

    def work(at: tuple[slice, ...]) -> list[np.ndarray]:
        shape = tuple(s.stop - s.start for s in at)
        with np.errstate(all="ignore"):
            return evaluate([_cut(x, batch, at) for x in inputs], shape, at)

    def store(at: tuple[slice, ...], results: list[np.ndarray]) -> None:
        for whole, part in zip(outs, results, strict=True):
            whole[at] = part

    pieces = list(_pieces(batch, block))
    first = work(pieces[0])
    outs = [
        np.empty(_shape(kind, batch, channels), part.dtype if kind == "scalar" else dtype)
        for part, kind in zip(first, kinds, strict=True)
    ]
    store(pieces[0], first)
    list(_pool().map(lambda at: store(at, work(at)), pieces[1:]))
    return outs


@cache
def _pool() -> Any:
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="gonio")


def _pieces(shape: tuple[int, ...], size: int) -> Iterator[tuple[slice, ...]]:
    """Boxes of at most `size` elements that tile `shape`, longest runs along the last axes."""

    def cut(box: tuple[slice, ...]) -> Iterator[tuple[slice, ...]]:
        lengths = [s.stop - s.start for s in box]
        if np.prod(lengths, dtype=int) <= size:
            yield box
            return
        axis = next(i for i, n in enumerate(lengths) if n > 1)
        inner = int(np.prod(lengths[axis + 1 :], dtype=int))
        step = max(size // inner, 1) if inner < size else 1
        for start in range(box[axis].start, box[axis].stop, step):
            stop = min(start + step, box[axis].stop)
            yield from cut((*box[:axis], slice(start, stop), *box[axis + 1 :]))

    if 0 not in shape:
        yield from cut(tuple(slice(0, n) for n in shape))


def _cut(x: np.ndarray, batch: tuple[int, ...], at: tuple[slice, ...]) -> np.ndarray:
    """The part of `x` (batch axes broadcastable to `batch`, then one more) that belongs to the box `at`."""
    own = x.ndim - 1
    index = [slice(None) if x.shape[i] == 1 else at[len(batch) - own + i] for i in range(own)]
    return x[tuple(index)] if own > 0 else x


def _shape(kind: str, batch: tuple[int, ...], channels: int | None) -> tuple[int, ...]:
    return batch + {"value": (channels,) if channels else (), "scalar": (), "vector": (3,)}[kind]


def _full(r: Any, shape: tuple[int, ...]) -> np.ndarray:
    r = np.asarray(r)
    return r[()] if r.shape == shape else np.broadcast_to(r, shape).copy()[()]
