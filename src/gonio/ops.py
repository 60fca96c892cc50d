"""Elementary functions for any array library, as formulas call them: `ops.sqrt(x)` is that of the library of x."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from .errors import ArrayTypeError, ShapeError
from .libraries import LIBRARIES, Array, Library, NumPy, library, library_of_type


def _call(name: str, *args: Array) -> Array:
    for x in args:
        own = library_of_type(type(x))
        if own is not None:
            return own.function(name)(*args)
    return LIBRARIES["numpy"].function(name)(*args)


def _elementary(name: str, doc: str) -> Callable[..., Array]:
    def function(*args: Array) -> Array:
        return _call(name, *args)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = doc
    return function


sqrt = _elementary("sqrt", "Square root.")
exp = _elementary("exp", "Exponential.")
log = _elementary("log", "Natural logarithm.")
sin = _elementary("sin", "Sine.")
cos = _elementary("cos", "Cosine.")
tan = _elementary("tan", "Tangent.")
arccos = _elementary("arccos", "Inverse cosine, in [0, pi].")
arctan2 = _elementary("arctan2", "arctan2(y, x): the angle of (x, y), in (-pi, pi].")
erf = _elementary("erf", "Error function.")
erfinv = _elementary("erfinv", "Inverse of the error function.")
absolute = _elementary("absolute", "Magnitude.")
floor = _elementary("floor", "Largest integer not above, as a floating-point number.")
power = _elementary("power", "power(x, y): x to the y.")
minimum = _elementary("minimum", "The smaller of two.")
maximum = _elementary("maximum", "The larger of two.")
where = _elementary("where", "where(condition, a, b): a where the condition holds, else b.")
take = _elementary(
    "take",
    "take(table, index): gather from a flat table, of indices that are in it (others give any number, or an error).",
)
to_index = _elementary("to_index", "Whole number for `take`; NaN and infinity become 0.")
stop_gradient = _elementary("stop_gradient", "The value, as a constant for differentiation.")


def clip(x: Array, low: Array, high: Array) -> Array:
    """x limited to [low, high]."""
    return minimum(maximum(x, low), high)


def square(x: Array) -> Array:
    """x times itself."""
    return x * x


def as_arrays(*arrays: Array, name: str = "directions") -> tuple[Library, list[Array]]:
    """The arrays of one call with their library: lists join the others, dtypes must agree and be floating point."""
    like = next((x for x in arrays if library_of_type(type(x)) is not None), np.zeros(0))
    try:
        lists = [np.asarray(x, dtype=float) if isinstance(x, (list, tuple)) else None for x in arrays]
        own = library(like)
        arrays = tuple(x if a is None else own.vectors(a, like) for x, a in zip(arrays, lists, strict=True))
    except (TypeError, ValueError):
        raise ArrayTypeError(f"{name}: got a list that is no array of numbers; expected rows of equal length") from None
    lib = library(*arrays)
    out = []
    for x in arrays:
        if library_of_type(type(x)) is None:
            raise ArrayTypeError(f"{name}: got {type(x).__name__}, expected an array of float32 or float64")
        if isinstance(lib, NumPy) and lib.dtype(x).startswith(("int", "uint")):
            x = np.asarray(x, dtype=float)
        out.append(x)
    dtypes = sorted({lib.dtype(x) for x in out})
    if len(dtypes) > 1 or dtypes[0] not in ("float32", "float64"):
        raise ArrayTypeError(
            f"{name}: got dtype {' and '.join(dtypes)}, expected one of float32, float64 for all; convert first"
        )
    return lib, out


def to_numpy(x: Array) -> np.ndarray:
    """The values of an array of any library, without their derivatives."""
    return library(x).to_numpy(x)


def broadcast_shape(shapes: Sequence[tuple[int, ...]], what: str) -> tuple[int, ...]:
    """The shape that all broadcast to, or a ShapeError that names them."""
    # By hand, because lengths may be symbols of a compiler.
    found = [1] * max([len(shape) for shape in shapes])
    for shape in shapes:
        for i, n in enumerate(shape, len(found) - len(shape)):
            if found[i] == 1:
                found[i] = n
            elif n not in (1, found[i]):
                listed = ", ".join(str(s) for s in shapes)
                raise ShapeError(f"{what}: shapes {listed} do not broadcast against each other")
    return tuple(found)
