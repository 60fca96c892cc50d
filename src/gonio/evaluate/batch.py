"""From arrays to formulas and back: a kernel written on components is run over any batch, channels and library.

A kernel is a function `kernel(m, mean, *inputs)`: `m` is the material with parameters ready to compute with, `mean`
the same with channels merged (what sampling uses), each input a tuple of components. The kinds of its results are
declared: see `arrays/kinds.py`. Kernels see no axis, no channel and no library.

For NumPy arrays kernels are compiled (`planning.py`). Where that cannot be, or a formula cannot be traced, batches are
cut into blocks that stay in the processor's cache and are shared out to threads. `WAYS` lists all that may happen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays import labels, ops
from ..errors import ArrayTypeError, MeaningWarning, ShapeError, warn
from ..formula import tree
from ..formula.parametrised import Parametrised
from ..formula.texture import Texture
from . import blocks, labelled, libraries, planning
from .blocks import result_shape
from .call import Call, batch_of, channels_of
from .staged import Staged
from .tracing import Task
from .turned import Turned, pays
from .whole import Whole


def run(task: Task, material: Parametrised, inputs: Sequence[Any], out: np.ndarray | None = None) -> list[Any]:
    """The results of a task over the broadcast batch of `inputs`; `out` takes the first."""
    if type(inputs[0]) is np.ndarray and material._labels is None:
        plan = planning.known(task, material, inputs)
        if plan is not None:
            if out is not None:
                _check_out(out, *plan.outputs[0][1:3])
            return plan.stored(inputs, out)
    if labelled.concern(material, inputs):
        return _first(Call(task, material, inputs, out=out))
    lib, arrays = _checked(inputs, task.widths)
    if lib.known(arrays[0]) is not None:
        _suspect_map(material, lib, arrays)
    if out is not None and lib.name != "numpy":
        raise ArrayTypeError(f"out= is for NumPy arrays; got {lib.name} directions")
    call = _call(task, material, inputs, arrays, lib)
    if out is not None:
        _check_out(out, result_shape(task.kinds[0], call.batch, call.channels), arrays[0].dtype)
        call.out = out
    return _first(call)


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
            return plan.stored(inputs, None) if into is None else plan.added(inputs, into)
    lib, arrays = _checked(inputs, task.widths)
    if lib.name != "numpy":
        if task.differentiates:
            raise ArrayTypeError(f"jacobian takes NumPy directions; got {lib.name}, which differentiates m.f by itself")
        if into is not None:
            raise ArrayTypeError(f"sums are added to by NumPy arrays; got {lib.name} arrays; add the results")
    call = _call(task, material, inputs, arrays, lib)
    if into is not None:
        _check_sums(into, [result_shape(kind, call.batch, call.channels) for kind in task.kinds])
        call.into = into
    return _first(call)


def _call(task: Task, material: Parametrised, inputs: Sequence[Any], arrays: Sequence[Any], lib: ops.Library) -> Call:
    """A call with the arrays that inputs were converted to; its batch is known where a library does not compute that
    itself."""
    if lib.name != "numpy":
        return Call(task, material, arrays, lib)
    channels, batch = batch_of(tree.leaves(material), lib, arrays)
    is_new = material._labels is not None or any(x is not a for x, a in zip(inputs, arrays, strict=True))
    return Call(task, material, arrays, lib, channels, batch, planning.available() and 0 not in batch, is_new)


def _named(call: Call) -> list[Any]:
    """The results where axes have names: these are taken off, and put back."""
    if not _takes_labels(call):
        return run(call.task, call.material._unlabelled, call.inputs, call.out)
    return labelled.named(_again(call), call.task.kinds, call.material, call.inputs, call.task.widths)


def _later(call: Call) -> Sequence[Any]:
    """The results where arrays are computed later: so are they, in chunks."""
    _takes_labels(call)
    return labelled.later(_again(call), call.task.kinds, call.material, call.inputs, call.task.widths)


def _again(call: Call) -> Callable[..., list[Any]]:
    return lambda m, *arrays: run(call.task, m, arrays)


def _takes_labels(call: Call) -> bool:
    """Whether results may have names, or be computed later. Raises ArrayTypeError where they may not, and would."""
    if len(call.task.kinds) == 1 and call.out is None:
        return True
    special = [x for x in call.inputs if labels.is_named(x) or labels.is_lazy(x)]
    if special or call.material._lazy:
        what = "out=" if len(call.task.kinds) == 1 else "sample"
        type_name = type(special[0]).__name__ if special else "Dask parameters"
        raise ArrayTypeError(f"{what} is for plain arrays; got {type_name}; take x.values, or x.compute()")
    return False


class _Way(NamedTuple):
    """A way of computing calls: whether it can, and the results; None where it finds that it does not pay."""

    can: Callable[[Call], Any]
    do: Callable[[Call], Sequence[Any] | None]


WAYS = (
    _Way(lambda c: c.lib is None and labelled.has_names(c.material, c.inputs), _named),  # xarray, pandas
    _Way(lambda c: c.lib is None, _later),  # Dask, each chunk by itself
    _Way(lambda c: c.lib.channel_loop, libraries.by_channel),  # arrays of one component each: Dr.Jit
    _Way(lambda c: c.lib.name != "numpy", libraries.at_once),  # PyTorch, JAX ...
    _Way(lambda c: c.compiles and c.is_new, planning.again),  # NumPy, by a plan that there is
    _Way(lambda c: c.compiles and c.draft and c.draft.as_axis, planning.by(Staged)),  # what many channels share first
    _Way(lambda c: c.compiles and c.draft and pays(c), planning.by(Turned)),  # sums over a short axis
    _Way(lambda c: c.compiles and c.draft, planning.by(Whole)),  # one kernel
    _Way(lambda c: c.task.differentiates, blocks.by_trace),  # NumPy alone, node by node
    _Way(lambda c: True, blocks.by_formula),  # NumPy alone, in blocks that stay in the processor's cache
)
"""All ways, in the order in which they are tried. Before them comes a plan of an earlier call: see `run`."""


def _first(call: Call) -> list[Any]:
    """The results by the first way that has them."""
    for way in WAYS:
        if way.can(call):
            results = way.do(call)
            if results is not None:
                return list(results)
    raise AssertionError("the last way takes every call")


def _check_sums(into: Sequence[np.ndarray] | None, shapes: Sequence[tuple[int, ...]]) -> None:
    for total, shape in zip(into or (), shapes, strict=into is not None):
        if total.shape != shape:
            raise ShapeError(f"an array to add to has shape {total.shape}, expected {shape}")


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


def full_shape(material: Parametrised, shape: tuple[int, ...]) -> tuple[int, ...]:
    """The batch shape of directions together with the maps (parameters with batch axes) of a material."""
    maps = [tuple(v.shape[:-1]) for v in tree.leaves(material) if getattr(v, "ndim", 0) > 1]
    return ops.broadcast_shape([shape, *maps], "directions and parameters") if maps else shape


def texels(material: Parametrised, batch: tuple[int, ...], index: np.ndarray) -> Parametrised:
    """The material at elements `index` (n,) of a flattened batch: its maps as (n, 1, C), to meet (n, 1, 3)."""

    def pick(value: Any) -> Any:
        if getattr(value, "ndim", 0) < 2:
            return value
        return np.broadcast_to(value, (*batch, value.shape[-1])).reshape(-1, 1, value.shape[-1])[index]

    return tree.each(material, pick) if full_shape(material, ()) else material


MANY = 1000
"""So many channels as directions are more likely a parameter for each direction."""


def _suspect_map(material: Parametrised, lib: ops.Library, inputs: Sequence[Any]) -> None:
    """Warns of a parameter (N,) beside N directions: its last axis is the channel axis, and the result is (N, N)."""
    for value in tree.leaves(material):
        width = value.shape[-1] if getattr(value, "ndim", 0) == 1 else 0
        if width >= MANY and any(lib.shape(x)[:-1] == (width,) for x in inputs):
            text = f"a parameter of shape ({width},) beside {width} directions: its last axis is the channel axis, so "
            text += f"that each direction has {width} channels; a value for each direction is parameter[:, None]"
            warn(text, MeaningWarning)
            return


def channels(material: Parametrised) -> int | None:
    """The number of channels of a material's results, None without a channel axis."""
    libraries = [(ops.library_of_type(type(value)), value) for value in tree.leaves(material)]
    textures = [(value.channels,) for value in tree.leaves(material) if isinstance(value, Texture)]
    return channels_of([lib.shape(value) for lib, value in libraries if lib is not None] + textures)
