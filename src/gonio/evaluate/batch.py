"""From arrays to formulas and back: a kernel written on components is run over any batch, channels and library.

A kernel is a function `kernel(m, mean, *inputs)`: `m` is the material with parameters ready to compute with, `mean`
the same with channels merged (what sampling uses), each input a tuple of components. The kinds of its results are
declared: see `arrays/kinds.py`. Kernels see no axis, no channel and no library.

For NumPy arrays kernels are compiled (`planning.py`). Where that cannot be, or a formula cannot be traced, batches are
cut into blocks that stay in the processor's cache and are shared out to threads.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from ..arrays import LIBRARIES, Fixed, Later, labels, ops
from ..arrays.kinds import SCALAR, SQUARE, SUMMED, TERMS
from ..errors import ArrayTypeError, EngineError, MeaningWarning, ParameterError, ShapeError, TraceError, warn
from ..formula.parametrised import Parametrised
from ..formula.spectrum import Spectrum
from ..formula.texture import Texture
from . import labelled, planning
from .blocks import Box, cut, in_blocks, result_shape
from .planning import Call
from .tracing import Kernel, Task, traced


def run(task: Task, material: Parametrised, inputs: Sequence[Any], out: np.ndarray | None = None) -> list[Any]:
    """The results of a task over the broadcast batch of `inputs`; `out` takes the first."""
    if type(inputs[0]) is np.ndarray and material._labels is None:
        plan = planning.known(task, material, inputs)
        if plan is not None:
            if out is not None:
                _check_out(out, *plan.outputs[0][1:3])
            return planning.carried_out(plan, inputs, out)
    if labelled.concern(material, inputs):
        return _labelled(task, material, inputs, out)
    lib, inputs = _checked(inputs, task.widths)
    if lib.known(inputs[0]) is not None:
        _suspect_map(material, lib, inputs)
    if lib.name != "numpy":
        if out is not None:
            raise ArrayTypeError(f"out= is for NumPy arrays; got {lib.name} directions")
        return (_by_channel if lib.channel_loop else _at_once)(task.kernel, task.kinds, material, lib, inputs)
    call = Call(task, material, inputs, *_batch(material.leaves(), lib, inputs))
    if out is not None:
        _check_out(out, result_shape(task.kinds[0], call.batch, call.channels), inputs[0].dtype)
    results = _compiled(call, out)
    if results is not None:
        return results
    results = _in_blocks(call)
    if out is None:
        return results
    out[...] = results[0]
    return [out]


def _labelled(task: Task, material: Parametrised, inputs: Sequence[Any], out: np.ndarray | None) -> list[Any]:
    """The results where axes have names, or arrays are computed later."""
    special = [x for x in inputs if labels.is_named(x) or labels.is_lazy(x)]
    if len(task.kinds) == 1 and out is None:
        return labelled.call(lambda m, *arrays: run(task, m, arrays), task.kinds, material, inputs, task.widths)
    if special or material._lazy:
        what = "out=" if len(task.kinds) == 1 else "sample"
        kind = type(special[0]).__name__ if special else "Dask parameters"
        raise ArrayTypeError(f"{what} is for plain arrays; got {kind}; take x.values, or x.compute()")
    return run(task, material.unlabelled, inputs, out)


def compute(
    task: Task, material: Parametrised, inputs: Sequence[Any], into: Sequence[np.ndarray] | None = None
) -> list[Any]:
    """The results of a task, and its derivatives; what are sums is added to the arrays `into` where the task says so.

    Raises TraceError where a formula that is to be differentiated cannot be traced.
    """
    if type(inputs[0]) is np.ndarray and material._labels is None:
        plan = planning.known(task, material, inputs)
        if plan is not None:
            _check_sums(into, [shape for _, shape, _, _ in plan.outputs])
            return planning.summed_up(plan, inputs, into)
    lib, inputs = _checked(inputs, task.widths)
    if lib.name != "numpy":
        if task.differentiates:
            raise ArrayTypeError(f"jacobian takes NumPy directions; got {lib.name}, which differentiates m.f by itself")
        if into is not None:
            raise ArrayTypeError(f"sums are added to by NumPy arrays; got {lib.name} arrays; add the results")
        return (_by_channel if lib.channel_loop else _at_once)(task.kernel, task.kinds, material, lib, inputs)
    call = Call(task, material, inputs, *_batch(material.leaves(), lib, inputs))
    if into is not None:
        _check_sums(into, [result_shape(kind, call.batch, call.channels) for kind in task.kinds])
    results = _compiled(call, into)
    if results is not None:
        return results
    results = _differentiated(call) if task.differentiates else _in_blocks(call)
    if into is None:
        return results
    for total, result in zip(into, results, strict=True):
        total += result
    return list(into)


def _differentiated(call: Call) -> list[Any]:
    """The results of a task and the derivatives, computed by NumPy from its trace."""
    task, results = call.task, []
    trace = traced(task, call.material, call.channels)
    kinds = [*task.kinds, *[task.kinds[0]] * (len(trace.results) - len(task.kinds))]
    flat = [kind if kind in SUMMED else SCALAR for kind, of in zip(kinds, trace.results, strict=True) for _ in of]
    found = in_blocks(lambda _, __, at: planning.interpreted(trace, call, at), flat, call.inputs, call.batch, None)
    parts, elements = iter(found), task.elements((call.channels,) if call.channels else ())
    for kind, nodes, element in zip(kinds, trace.results, elements, strict=True):
        result = np.stack(list(islice(parts, len(nodes))), -1)
        results.append(result.reshape((*(call.batch[:-1] if kind in SUMMED else call.batch), *element))[()])
    return results


def _check_sums(into: Sequence[np.ndarray] | None, shapes: Sequence[tuple[int, ...]]) -> None:
    for total, shape in zip(into or (), shapes, strict=into is not None):
        if total.shape != shape:
            raise ShapeError(f"an array to add to has shape {total.shape}, expected {shape}")


def _compiled(call: Call, out: np.ndarray | Sequence[np.ndarray] | None) -> list[Any] | None:
    """The results of compiled code; None where nothing can be compiled. `out`: for the first, or sums to add to."""
    if planning.available() and 0 not in call.batch:
        with suppress(TraceError, EngineError):
            plan = planning.known(call.task, call.material, call.inputs) or planning.plan(call)
            if out is None or isinstance(out, np.ndarray):
                return planning.carried_out(plan, call.inputs, out)
            return planning.summed_up(plan, call.inputs, out)
    return None


def _checked(inputs: Sequence[Any], widths: Sequence[int]) -> tuple[ops.Library, list[Any]]:
    """The inputs of a call as arrays of one library, with last axes of these lengths."""
    lib, arrays = ops.as_arrays(*inputs)
    for x, width in zip(arrays, widths, strict=True):
        shape = lib.shape(x)
        if not shape or shape[-1] != width:
            what = {3: "directions", 2: "random numbers"}.get(width, "weights")
            raise ShapeError(f"{what}: got shape {shape}, expected (..., {width})")
    return lib, arrays


def _check_out(out: Any, shape: tuple[int, ...], dtype: np.dtype) -> None:
    if not isinstance(out, np.ndarray):
        raise ArrayTypeError(f"out: got {type(out).__name__}, expected a NumPy array")
    if out.shape != shape or out.dtype != dtype:
        raise ShapeError(f"out: got {out.dtype} {out.shape}, expected {dtype} {shape}")
    if not out.flags.writeable:
        raise ArrayTypeError("out: the array is read-only; expected one that may be written to")


def _in_blocks(call: Call) -> list[np.ndarray]:
    """The results of the formula itself, on NumPy arrays."""
    lib, (task, material, inputs, channels, batch) = LIBRARIES["numpy"], call

    def evaluate(arrays: Sequence[np.ndarray], shape: tuple[int, ...], at: Box) -> list[np.ndarray]:
        def convert(value: Any) -> Any:
            value = value.numbers if isinstance(value, Fixed) else value
            return lib.convert(cut(value, batch, at) if isinstance(value, np.ndarray) else value, arrays[0])

        def bound(m: Parametrised) -> Parametrised:
            return m.bind(convert, lambda table: Later(table, arrays[0].dtype))

        m = bound(material)
        mean = bound(material.merged(lib.merge_channels)) if channels else m
        parts = [lib.split(x, shape, channels is not None) for x in arrays]
        terms = [TERMS.get(kind, kind) for kind in task.kinds]
        return lib.assemble(terms, [task.kernel(m, mean, *parts)], arrays[0], shape, channels is not None)

    return in_blocks(evaluate, task.kinds, inputs, batch, channels)


def _at_once(
    kernel: Kernel, kinds: Sequence[str], material: Parametrised, lib: ops.Library, inputs: Sequence[Any]
) -> list[Any]:
    """The results of a library that computes the whole batch at once.

    Such a library may be compiling: nothing here or below may depend on the values of arrays, or touch those of NumPy
    but through `Library.fixed`.
    """
    like = inputs[0]
    m = material.bind(partial(_converted, lib=lib, like=like), partial(lib.fixed, like=like))
    channels, batch = _batch(m.leaves(), lib, inputs)
    mean = m.merged(lib.merge_channels) if channels else m
    parts = [lib.split(x, batch, channels is not None) for x in inputs]
    terms = [TERMS.get(kind, kind) for kind in kinds]
    results = lib.assemble(terms, [kernel(m, mean, *parts)], like, batch, channels is not None)
    shapes = [result_shape(kind, batch, channels) for kind in terms]
    full = [lib.module.broadcast_to(r, shape) for r, shape in zip(results, shapes, strict=True)]
    return _sums(lib, kinds, full, len(batch) - 1)


def _sums(lib: ops.Library, kinds: Sequence[str], results: Sequence[Any], axis: int) -> list[Any]:
    """The results, of which those that are terms of sums are summed over an axis."""
    summed = [lib.module.sum(r, axis) if kind in SUMMED else r for kind, r in zip(kinds, results, strict=True)]
    return [r * r if kind == SQUARE else r for kind, r in zip(kinds, summed, strict=True)]


def _converted(value: Any, lib: ops.Library, like: Any) -> Any:
    _check_number(value, lib)
    return lib.convert(value, like)


def _by_channel(
    kernel: Kernel, kinds: Sequence[str], material: Parametrised, lib: ops.Library, inputs: Sequence[Any]
) -> list[Any]:
    """The results of a library whose arrays hold one component each: once per channel."""
    like = inputs[0]
    channels, batch = _batch(material.leaves(), lib, inputs)
    if 0 in batch:
        whole = [result_shape(kind, batch, channels) for kind in kinds]
        return [lib.empty(like, shape, len(shape) > len(batch)) for shape in whole]

    def bound(m: Parametrised, channel: int | None) -> Parametrised:
        def convert(value: Any) -> Any:
            return lib.convert(value.numbers if isinstance(value, Fixed) else value, like, channel, batch)

        return m.bind(convert, lambda table: lib.fixed(table, like))

    runs = []
    for c in range(channels or 1):
        m = bound(material, c)
        mean = bound(material.merged(lib.merge_channels), None) if channels else m
        runs.append(kernel(m, mean, *(lib.split(x, batch, channels is not None) for x in inputs)))
    terms = [TERMS.get(kind, kind) for kind in kinds]
    return _sums(lib, kinds, lib.assemble(terms, runs, like, batch, channels is not None), len(batch) - 1)


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


MANY = 1000
"""So many channels as directions are more likely a parameter for each direction."""


def _suspect_map(material: Parametrised, lib: ops.Library, inputs: Sequence[Any]) -> None:
    """Warns of a parameter (N,) beside N directions: its last axis is the channel axis, and the result is (N, N)."""
    for value in material.leaves():
        width = value.shape[-1] if getattr(value, "ndim", 0) == 1 else 0
        if width >= MANY and any(lib.shape(x)[:-1] == (width,) for x in inputs):
            text = f"a parameter of shape ({width},) beside {width} directions: its last axis is the channel axis, so "
            text += f"that each direction has {width} channels; a value for each direction is parameter[:, None]"
            warn(text, MeaningWarning)
            return


def _check_number(value: Any, lib: ops.Library) -> ops.Library | None:
    """The library of a parameter's value, None for a plain number. Raises where it is none, or of a wrong library."""
    of_value: ops.Library | None = ops.library_of_type(type(value))
    if of_value is not None:
        _check_library(of_value, lib)
    elif isinstance(value, Texture):
        raise ParameterError(
            f"a parameter is a {value!r:.90}: it has no number until there is a place; write m.f(wi, wo, uv=uv), "
            f"or m.at(uv=uv) for a material with the numbers at places uv (..., 2)"
        )
    elif value is None or isinstance(value, Spectrum):
        what = "a wavelength is not known yet" if value is None else f"a parameter is a {value!r:.60}"
        raise ParameterError(
            f"{what}: there is no f until wavelengths are; write m.at([450.0, 550.0, 650.0]) for three "
            f"channels, or m.at(550.0) for one without a channel axis"
        )
    return of_value


def _check_library(of_value: ops.Library | None, lib: ops.Library) -> None:
    if of_value not in (None, lib, LIBRARIES["numpy"]):
        raise ArrayTypeError(
            f"a parameter is a {of_value.name} array but the directions are {lib.name} arrays; "
            f"expected {lib.name} or NumPy parameters"
        )


def _batch(values: Iterable[Any], lib: ops.Library, inputs: Sequence[Any]) -> tuple[int | None, tuple[int, ...]]:
    """The number of channels (None without a channel axis) of parameters, and the batch that they and inputs make."""
    shapes = []  # by plain loops: torch.compile takes no assignments in comprehensions
    for value in values:
        of_value = _check_number(value, lib)
        if of_value is not None:
            shapes.append(of_value.shape(value))
    batches = [lib.shape(x)[:-1] for x in inputs] + [shape[:-1] for shape in shapes if shape]
    return _channels(shapes), ops.broadcast_shape(batches, "directions and parameters")


def channels(material: Parametrised) -> int | None:
    """The number of channels of a material's results, None without a channel axis."""
    libraries = [(ops.library_of_type(type(value)), value) for value in material.leaves()]
    textures = [(value.channels,) for value in material.leaves() if isinstance(value, Texture)]
    return _channels([lib.shape(value) for lib, value in libraries if lib is not None] + textures)


def _channels(shapes: Sequence[tuple[int, ...]]) -> int | None:
    """The one number of channels of arrays of these shapes, some of one channel or without."""
    widths = {shape[-1] for shape in shapes if shape}
    if not widths:
        return None
    if widths - {1, max(widths)}:
        raise ShapeError(
            f"parameters have {sorted(widths)} channels (lengths of their last axes); expected 1 or one number"
        )
    return max(widths)
