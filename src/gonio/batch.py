"""From arrays to formulas and back: a kernel written on components is run over any batch, channels and library.

A kernel is a function `kernel(m, mean, *inputs)`: `m` is the material with parameters ready to compute with, `mean`
the same with channels merged (what sampling uses), each input a tuple of components. What it returns is declared as
"value" (has the channel axis), "scalar" (has none), "vector", or "total": a value, summed over the last axis of the
batch. Kernels see no axis, no channel and no library.

For NumPy arrays kernels are compiled (`engine.py`). Where that cannot be, or a formula cannot be traced, batches are
cut into blocks that stay in the processor's cache and are shared out to threads.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from . import engine, ops
from .blocks import cut, in_blocks, result_shape
from .errors import ArrayTypeError, ShapeError, TraceError
from .parametrised import Parametrised

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
    plan = engine.known(kernel, kinds, material, inputs)
    if plan is not None and out is None:
        return engine.call(plan, inputs, None)
    lib, inputs, channels, batch = _checked(material, inputs, widths)

    def evaluate(arrays: Sequence[Any], shape: tuple[int, ...], at: tuple[slice, ...] | None) -> list[Any]:
        like = arrays[0]

        def convert(value: Any, channel: int | None) -> Any:
            if at is not None and isinstance(value, np.ndarray):
                value = cut(value, batch, at)
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
        whole = [result_shape(kind, batch, channels) for kind in kinds]
        if lib.channel_loop and 0 in batch:
            return [lib.empty(inputs[0], shape, len(shape) > len(batch)) for shape in whole]
        results = evaluate(inputs, batch, None)
        if lib.channel_loop:
            return results
        return [lib.module.broadcast_to(r, shape) for r, shape in zip(results, whole, strict=True)]
    if out is not None:
        _check_out(out, result_shape(kinds[0], batch, channels), inputs[0].dtype)
    if engine.available() and 0 not in batch:
        with suppress(TraceError):
            plan = engine.plan(kernel, tuple(kinds), material, inputs, tuple(widths), batch, channels)
            return engine.call(plan, inputs, out)
    results = in_blocks(evaluate, kinds, inputs, batch, channels)
    if out is None:
        return results
    out[...] = results[0]
    return [out]


def jacobian(
    kernel: Kernel,
    material: Parametrised,
    inputs: Sequence[Any],
    widths: Sequence[int],
    leaves: tuple[int, ...],
    by_inputs: tuple[int, ...],
) -> list[Any]:
    """The value of a kernel and its derivatives by the numbers of a material, and by inputs; see `engine.jacobian`.

    Raises TraceError where the formula cannot be traced.
    """
    lib, inputs, channels, batch = _checked(material, inputs, widths)
    if lib.name != "numpy":
        raise ArrayTypeError(f"jacobian takes NumPy directions; got {lib.name}, which differentiates m.f by itself")
    if engine.available() and 0 not in batch:
        plan = engine.jacobian_plan(kernel, material, inputs, widths, batch, channels, leaves, by_inputs)
        return engine.call(plan, inputs, None)
    trace = engine.jacobian(kernel, material, widths, channels, leaves, by_inputs)
    parts = in_blocks(
        lambda _, __, at: engine.interpreted(trace, material, inputs, batch, at),
        ["scalar"] * sum(map(len, trace.results)),
        inputs,
        batch,
        None,
    )
    results, start = [], 0
    for nodes in trace.results:
        stacked = np.stack(parts[start : start + len(nodes)], -1)
        start += len(nodes)
        results.append(stacked)
    own = (channels,) if channels else ()
    ends = [own] * (1 + len(leaves)) + [(*own, widths[k]) for k in by_inputs]
    return [r.reshape(*batch, *end)[()] for r, end in zip(results, ends, strict=True)]


def _checked(
    material: Parametrised, inputs: Sequence[Any], widths: Sequence[int]
) -> tuple[ops.Library, list[Any], int | None, tuple[int, ...]]:
    """The inputs of a call as arrays of one library, the number of channels, and the shape of the batch."""
    lib, arrays = ops.as_arrays(*inputs)
    shapes = [lib.shape(x) for x in arrays]
    for shape, width in zip(shapes, widths, strict=True):
        if not shape or shape[-1] != width:
            what = {3: "directions", 2: "random numbers"}.get(width, "weights")
            raise ShapeError(f"{what}: got shape {shape}, expected (..., {width})")
    channels, parameter_shapes = _parameter_shapes(material, lib, arrays[0])
    return (
        lib,
        arrays,
        channels,
        ops.broadcast_shape([s[:-1] for s in shapes] + parameter_shapes, "directions and parameters"),
    )


def _check_out(out: Any, shape: tuple[int, ...], dtype: np.dtype) -> None:
    if not isinstance(out, np.ndarray):
        raise ArrayTypeError(f"out: got {type(out).__name__}, expected a NumPy array")
    if out.shape != shape or out.dtype != dtype:
        raise ShapeError(f"out: got {out.dtype} {out.shape}, expected {dtype} {shape}")
    if not out.flags.writeable:
        raise ArrayTypeError("out: the array is read-only; expected one that may be written to")


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
