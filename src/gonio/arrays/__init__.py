"""The array libraries that formulas run on: the only room (with `bridges`) that knows which exist.

Each is a file of libraries/, with the packages of its array types, its names of functions, and the way from vectors to
components. A library in the manner of NumPy is one line there. What callers give becomes arrays of one of them here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..declared import discover
from ..declared.numbers import numbers
from ..errors import ArrayTypeError, ShapeError
from .fixed import Array as Array
from .fixed import AsStored as AsStored
from .fixed import Fixed as Fixed
from .fixed import Later as Later
from .fixed import Roomy as Roomy
from .fixed import contiguous as contiguous
from .fixed import frozen as frozen
from .interface import Library as Library

LIBRARIES: dict[str, Library] = {
    name: module.LIBRARY for name, module in discover.by_name(f"{__name__}.libraries").items()
}
"""Name of a library -> how to use it."""

NAMED: Library = LIBRARIES["xarray"]
LAZY: Any = LIBRARIES["dask"]
"""Arrays with named axes, and arrays that are computed later."""

OF_TYPES: dict[type, Any] = dict.fromkeys((float, int, bool))
"""What is in no package of arrays: numbers, of no library; and symbols, which `trace` adds."""

_BY_PACKAGE: dict[str, Library | None] = {
    "builtins": None,
    **{package: lib for lib in LIBRARIES.values() for package in lib.packages},
}


def library_of_type(kind: Any) -> Any:
    """The library that arrays of this type belong to; None for numbers and other objects."""
    if kind in OF_TYPES:
        return OF_TYPES[kind]
    package = str(kind.__module__).partition(".")[0]  # `str`, because torch.compile knows it no other way
    return _BY_PACKAGE[package] if package in _BY_PACKAGE else library_of_type(kind.__base__)


def library(*arrays: Array) -> Library:
    """The one library that `arrays` belong to; numbers belong to any. Raises ArrayTypeError if they are mixed."""
    common: Library | None = None
    for x in arrays:
        lib = library_of_type(type(x))
        if lib is None or lib is common:
            continue
        if lib is NAMED:
            raise ArrayTypeError(
                f"a {type(x).__name__} where axes have no names; expected a plain array: x.values; parameters, f, pdf, "
                f"f_angles, direction, angles, albedo and its kin, and gonio.remote_sensing take axes with names"
            )
        if common is not None:
            raise ArrayTypeError(
                f"arrays of different libraries in one call: {common.name} and {lib.name}; "
                f"expected one library; convert one side first"
            )
        common = lib
    return common or LIBRARIES["numpy"]


def plain(x: Array) -> Array:
    """Lists, and NumPy's arrays of other kinds (masked, matrices), as plain arrays of numbers; others as they are."""
    if _is_listed(x):
        return numbers(x if isinstance(x, (list, tuple)) else np.asarray(x)).astype(float)
    return numbers(x) if isinstance(x, np.ndarray) and type(x) is not np.ndarray else x


def _is_listed(x: Any) -> bool:
    """Whether numbers are in lists, or in a value of ours that stands for an array."""
    if type(x) is np.ndarray:
        return False
    return isinstance(x, (list, tuple)) or getattr(type(x), "is_numbers", False)


def as_arrays(*arrays: Array, name: str = "directions") -> tuple[Library, list[Array]]:
    """The arrays of one call with their library: lists join the others, dtypes must agree and be floating point."""
    like = next((x for x in arrays if dtype_of(x)), np.zeros(0))
    try:
        first = library(like)
        arrays = tuple(first.vectors(plain(x), like) if _is_listed(x) else plain(x) for x in arrays)
    except ArrayTypeError:
        raise
    except (TypeError, ValueError) as error:
        raise ArrayTypeError(f"{name}: got {error}; expected an array of numbers (..., n), n in every row") from None
    for x in arrays:
        if not dtype_of(x):
            draw = "; draw numbers first: rng.random((n, 2))" if hasattr(x, "random") else ""
            raise ArrayTypeError(f"{name}: got {type(x).__name__}, expected an array of float32 or float64{draw}")
    lib = library(*arrays)
    out = [np.asarray(x, dtype=float) if lib.name == "numpy" and lib.dtype(x).startswith(_WHOLE) else x for x in arrays]
    dtypes = sorted({lib.dtype(x) for x in out})
    if len(dtypes) > 1 or dtypes[0] not in ("float32", "float64"):
        raise ArrayTypeError(
            f"{name}: got dtype {' and '.join(dtypes)}, expected one of float32, float64 for all; convert first"
        )
    return lib, out


_WHOLE = ("int", "uint")


def dtype_of(x: Array) -> str:
    """The dtype of an array; "" of anything else, which may be of an array library too (its dtypes, its generators)."""
    lib = library_of_type(type(x))
    try:
        return "" if lib is None else lib.dtype(x)
    except AttributeError:
        return ""


def to_numpy(x: Array) -> np.ndarray:
    """The values of an array of any library, without their derivatives."""
    return library(x).to_numpy(x)


def broadcast_shape(shapes: Sequence[tuple[int, ...]], what: str) -> tuple[int, ...]:
    """The shape that all broadcast to, or a ShapeError that names them."""
    # By hand, because lengths may be symbols of a compiler.
    lengths = [1] * max([len(shape) for shape in shapes])
    for shape in shapes:
        for i, n in enumerate(shape, len(lengths) - len(shape)):
            if lengths[i] == 1:
                lengths[i] = n
            elif n not in (1, lengths[i]):
                listed = ", ".join(str(s) for s in shapes)
                raise ShapeError(f"{what}: shapes {listed} do not broadcast against each other")
    return tuple(lengths)
