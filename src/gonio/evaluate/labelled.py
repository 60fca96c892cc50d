"""Calls with arrays whose axes have names (xarray, pandas), and with arrays that are computed later (Dask).

`call` takes the names off, computes on plain arrays, and puts the names back: a result has the axes of the directions
that the material has not, then those of the material, then the channel axis. `later` computes in Dask's chunks. A
function takes such arrays where it is decorated with `takes_labels`; `f`, `pdf` and `delta_reflectance` of a material
come here by `batch.run`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import wraps
from inspect import signature
from typing import Any, TypeVar

import numpy as np

from ..arrays import LAZY, labels, ops
from ..arrays.kinds import MATRIX, PAIRS, SCALAR, VALUE, VECTOR
from ..arrays.labels import COMPONENTS, STOKES, Labels, is_lazy, is_named
from ..errors import ArrayTypeError, ShapeError
from ..formula import tree
from ..formula.parametrised import Parametrised

F = TypeVar("F", bound=Callable[..., Any])
Compute = Callable[..., Sequence[Any]]
"""`(material, *arrays)` -> the results, on plain arrays."""


def concern(material: Parametrised | None, inputs: Sequence[Any]) -> bool:
    """Whether a material, or arrays of a call, have named axes or are computed later."""
    if material is not None and (material._labels is not None or material._lazy):
        return True
    return any(is_named(x) or is_lazy(x) for x in inputs)


def has_names(material: Parametrised | None, inputs: Sequence[Any]) -> bool:
    """Whether a material, or arrays of a call, have named axes."""
    return (material is not None and material._labels is not None) or any(map(is_named, inputs))


def call(
    compute: Compute, kinds: Sequence[str], material: Parametrised | None, inputs: Sequence[Any], widths: Sequence[int]
) -> list[Any]:
    """The results of `compute`, of these kinds. `widths`: 3 for directions (..., 3), 0 for angles."""

    def plainly(m: Parametrised | None, *arrays: Any) -> Sequence[Any]:
        return later(compute, kinds, m, arrays, widths)

    return named(plainly, kinds, material, inputs, widths)


def named(
    compute: Compute, kinds: Sequence[str], material: Parametrised | None, inputs: Sequence[Any], widths: Sequence[int]
) -> list[Any]:
    """The same, with `compute` for arrays without names, which may be computed later."""
    own = None if material is None else material._labels
    with_names = [k for k, x in enumerate(inputs) if is_named(x)]
    plain = None if material is None else material._unlabelled
    if not with_names and (own is None or any(_has_axes(x, width) for x, width in zip(inputs, widths, strict=True))):
        return list(compute(plain, *inputs))  # axes without names: so are those of the result
    what = "directions and parameters"
    arrays = {k: _vectors(inputs[k]) if widths[k] else labels.data_array(inputs[k], "directions") for k in with_names}
    of = {k: Labels(x.isel({COMPONENTS: 0}, drop=True) if widths[k] else x) for k, x in arrays.items()}
    for k, x in of.items():
        if x.channel is not None:
            rule = (
                f"has the channel axis {x.channel}, which parameters alone have; select a channel, or rename the axis"
            )
            raise ArrayTypeError(f"a {type(inputs[k]).__name__} of directions or angles: {rule}")
    _refuse_nameless(plain, own, inputs, widths, with_names)
    whole = labels.union([*of.values(), *([] if own is None else [own])], what)
    if own is not None:  # the material's axes last, as they lie in it
        dims = [d for d in whole.dims if d not in own.dims] + [*own.dims]
        whole = Labels(whole.frame.transpose(*dims, *([] if whole.channel is None else [whole.channel])))
    taken = list(inputs)
    for k, x in arrays.items():
        x = x.transpose(*of[k].dims, *([COMPONENTS] if widths[k] else []))
        data = x.data.astype(float) if widths[k] == 0 or x.dtype.kind != "f" else x.data
        taken[k] = whole.laid(data, of[k]) if widths[k] else whole.laid(data[..., None], of[k])[..., 0]
    results = compute(plain, *taken)
    return [_wrapped(r, kind, whole, material) for r, kind in zip(results, kinds, strict=True)]


def _has_axes(x: Any, width: int) -> bool:
    """Whether an input has axes beside that of components. Of what is no array `compute` says so."""
    if isinstance(x, (list, tuple)):
        with suppress(ValueError):
            x = ops.numbers(x)
    return ops.library_of_type(type(x)) is not None and getattr(x, "ndim", 0) > bool(width)


def _vectors(x: Any) -> Any:
    x = labels.data_array(x, "directions")
    if x.sizes.get(COMPONENTS) != 3:
        rule = f"expected an axis {COMPONENTS!r} of length 3, as gonio.direction(theta, phi) makes of DataArrays"
        raise ShapeError(f"directions: a DataArray with the axes {dict(x.sizes)}, {rule}")
    return x


def _refuse_nameless(
    m: Parametrised | None, own: Labels | None, inputs: Sequence[Any], widths: Sequence[int], named: Sequence[int]
) -> None:
    rule = "expected names for all axes, of a DataArray each, or for none"
    for k, (x, width) in enumerate(zip(inputs, widths, strict=True)):
        if k not in named and _has_axes(x, width):
            raise ArrayTypeError(f"an array of shape {np.shape(x)} beside a {type(inputs[named[0]]).__name__}: {rule}")
    maps = [] if m is None or own is not None else [v.shape for v in tree.leaves(m) if getattr(v, "ndim", 0) > 1]
    if maps:
        raise ArrayTypeError(f"a parameter of shape {maps[0]} beside a {type(inputs[named[0]]).__name__}: {rule}")


def _wrapped(result: Any, kind: str, whole: Labels, m: Parametrised | None) -> Any:
    if not (isinstance(result, (np.ndarray, np.generic)) or is_lazy(result)):
        return result  # of another library, for directions of that
    axes = np.ndim(result) - len(whole.dims)
    if kind == MATRIX:
        return whole.of_matrices(result, axes == 3, getattr(m, "channel_names", None))
    if kind == PAIRS:
        return whole.of_pairs(result, getattr(m, "channel_names", None))
    if kind == VECTOR:
        return whole.with_axis(result, COMPONENTS, "xyz")
    if axes == 0:
        return whole.wrapped(result, False)
    if axes == 1 and kind == VALUE:
        return whole.wrapped(result, True, getattr(m, "channel_names", None))
    return result  # with axes of its own, of directions without names


# Dask.


def later(
    compute: Compute, kinds: Sequence[str], m: Parametrised | None, inputs: Sequence[Any], widths: Sequence[int]
) -> Sequence[Any]:
    """The results of `compute`; where an array is Dask's, arrays of Dask, computed in its chunks when they are needed.

    Parameters are checked then.
    """
    if not any(map(is_lazy, inputs)) and (m is None or not m._lazy):
        return compute(m, *inputs)
    leaves = {} if m is None else {p: v for p, v in zip(tree.leaf_paths(m), tree.leaves(m), strict=True) if p}
    # Maps too, that are no arrays of Dask: they are cut as those are.
    cut = {p: v for p, v in leaves.items() if is_lazy(v) or getattr(v, "ndim", 0) > 1}
    arrays = [x if is_lazy(x) else np.asarray(x, dtype=float) for x in inputs]
    channels = _channels(m)
    for x, width in zip(arrays, widths, strict=True):
        if width and x.shape[-1:] != (width,):
            raise ShapeError(f"directions: got shape {x.shape}, expected (..., {width})")
    batches = [x.shape[: x.ndim - bool(width)] for x, width in zip(arrays, widths, strict=True)]
    ops.broadcast_shape([*batches, *(v.shape[:-1] for v in cut.values())], "directions and parameters")

    def chunk(*parts: Any) -> tuple[Any, ...]:
        here = None if m is None else _with_numbers(m, dict(zip(cut, parts[len(inputs) :], strict=True)))
        return tuple(compute(here, *parts[: len(inputs)]))

    axes = [f"i{k}" if width else "" for k, width in enumerate(widths)]
    axes += [f"k{k}" if v.ndim else "" for k, v in enumerate(cut.values())]
    per_channel = ("c",) if channels else ()
    axes_of = {VALUE: per_channel, VECTOR: ("v",), MATRIX: (*per_channel, *STOKES), PAIRS: ("co", "ci")}
    of = [",".join(axes_of.get(kind, ())) for kind in kinds]
    lengths = {"c": channels or 1, "v": 3} | dict.fromkeys(STOKES, 4) | dict.fromkeys(("co", "ci"), channels or 1)
    sizes = {name: n for name, n in lengths.items() if any(name in axes_of.get(kind, ()) for kind in kinds)}
    results: Sequence[Any] = LAZY.in_chunks(chunk, [*arrays, *cut.values()], axes, of, **sizes)
    return results


def _channels(m: Parametrised | None) -> int | None:
    widths = [] if m is None else [v.shape[-1] for v in tree.leaves(m) if getattr(v, "ndim", 0)]
    return max(widths, default=None)


def _with_numbers(m: Parametrised, values: dict[str, np.ndarray]) -> Parametrised:
    """The material with these numbers, checked, of which NaN are missing."""
    missing = {path: np.isnan(x) for path, x in values.items()}
    numbers = {p: np.ma.MaskedArray(x, missing[p]) if missing[p].any() else x for p, x in values.items()}
    new = m.replace({p: x for p, x in numbers.items() if not missing[p].all()})
    new = tree.with_values(new, {p: x for p, x in values.items() if missing[p].all()})
    return new._made_of(new.__dict__, {"_lazy": False})


# Functions.


def takes_labels(*directions: str, angles: Sequence[str] = (), kinds: Sequence[str] = (VALUE,)) -> Callable[[F], F]:
    """Decorates a function: arguments of these names, directions (..., 3) and angles, may be arrays of xarray, pandas
    and Dask, and so may the parameters of the material `m`, if it takes one. `kinds`: of its results; with
    `return_error=True` it returns an error besides."""

    def decorated(function: F) -> F:
        parameters = signature(function)
        names = (*directions, *angles)
        widths = [3] * len(directions) + [0] * len(angles)

        @wraps(function)
        def wrapper(*args: Any, **kwargs: Any) -> Any:
            if not any(isinstance(x, Parametrised) or is_named(x) or is_lazy(x) for x in (*args, *kwargs.values())):
                return function(*args, **kwargs)
            try:
                bound = parameters.bind(*args, **kwargs)
            except TypeError:
                return function(*args, **kwargs)  # which says what is wrong
            bound.apply_defaults()
            m = bound.arguments.get("m")
            m = m if isinstance(m, Parametrised) else None
            given = [name for name in names if bound.arguments[name] is not None]
            inputs = [bound.arguments[name] for name in given]
            if not concern(m, inputs):
                return function(*args, **kwargs)

            kind: list[Any] = []

            def compute(m: Parametrised | None, *arrays: Any) -> Sequence[Any]:
                changed = dict(zip(given, arrays, strict=True)) | ({} if m is None else {"m": m})
                result = function(**(bound.arguments | changed))
                kind.append(type(result))
                return result if isinstance(result, tuple) else [result]

            return_error = bound.arguments.get("return_error")  # not checked yet
            several = (*kinds, SCALAR) if isinstance(return_error, (bool, np.bool_)) and return_error else kinds
            results = call(compute, several, m, inputs, [widths[names.index(name)] for name in given])
            if len(results) == 1:
                return results[0]
            return kind[0]._make(results) if kind and hasattr(kind[0], "_make") else tuple(results)

        return wrapper  # type: ignore[return-value]  # a wrapper of the same arguments

    return decorated
