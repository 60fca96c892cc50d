"""Elementary functions for any array library, as formulas call them: `ops.sqrt(x)` is that of the library of x."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..declared.numbers import is_masked as is_masked
from ..declared.numbers import numbers as numbers
from ..errors import ArrayTypeError, ShapeError
from . import LIBRARIES as LIBRARIES
from . import Array
from . import Library as Library
from . import library as library
from . import library_of_type as library_of_type


def _elementary(name: str, doc: str) -> Callable[..., Array]:
    def function(*args: Array) -> Array:
        for x in args:
            lib = library_of_type(type(x))
            if lib is not None:
                return lib.function(name)(*args)
        return LIBRARIES["numpy"].function(name)(*args)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = doc
    return function


sqrt = _elementary("sqrt", "Square root.")
exp = _elementary("exp", "Exponential.")
log = _elementary("log", "Natural logarithm.")
sin = _elementary("sin", "Sine.")
cos = _elementary("cos", "Cosine.")
tan = _elementary("tan", "Tangent.")
sin_turn = _elementary("sin_turn", "Sine of 2 pi x: of x turns, up to which it is exact.")
cos_turn = _elementary("cos_turn", "Cosine of 2 pi x.")
arccos = _elementary("arccos", "Inverse cosine, in [0, pi].")
arctan2 = _elementary("arctan2", "arctan2(y, x): the angle of (x, y), in (-pi, pi].")
erf = _elementary("erf", "Error function.")
erfinv = _elementary("erfinv", "Inverse of the error function.")
ierfc = _elementary(
    "ierfc",
    "Integral of 1 - erf from x >= 0 to infinity, exp(-x^2)/sqrt(pi) - x erfc(x); error: rounding of 2x + ierfc(x).",
)
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

# Whole numbers of 32 bits without a sign, as hashes and random numbers are made of: of `to_index`, plain numbers, and
# of each other. They are no numbers to calculate with: `unit` makes one, and those below 2^31 are places of tables.
xor = _elementary("xor", "Bits that are set in one of two whole numbers alone.")
bit_and = _elementary("bit_and", "Bits that are set in both of two whole numbers.")
shift_left = _elementary("shift_left", "shift_left(x, n): the bits of x moved up by n, 0 to 31.")
shift_right = _elementary("shift_right", "shift_right(x, n): the bits of x moved down by n, 0 to 31.")
wrapped_sum = _elementary("wrapped_sum", "The sum of two whole numbers modulo 2^32.")
wrapped_product = _elementary("wrapped_product", "The product of two whole numbers modulo 2^32.")
unit = _elementary("unit", "unit(x, like): the upper 24 bits of a whole number as one in [0, 1), of the dtype of like.")


def nearest(table: Array, o: Sequence[Array], d: Sequence[Array], near: Array, far: Array) -> tuple[Array, ...]:
    """The nearest triangle that rays meet: (t, u, v, its number), t = infinity and 0 else where they meet none.

    `table`: the handle of `numerics.embree.EmbreeTriangles`. A ray is o + t d with near < t < far, its origin and
    direction of three components each; it meets the triangle (a, b, c) at a + u (b - a) + v (c - a). Computed in
    float32. No derivative passes: compute t anew from the triangle where there is to be one.
    """
    return _shoot("nearest", table, o, d, near, far)


def blocked(table: Array, o: Sequence[Array], d: Sequence[Array], near: Array, far: Array) -> Array:
    """Whether rays meet any triangle: see `nearest`."""
    return _shoot("blocked", table, o, d, near, far)


def _shoot(name: str, table: Array, o: Sequence[Array], d: Sequence[Array], near: Array, far: Array) -> Any:
    for x in (*o, *d, near, far):
        lib = library_of_type(type(x))
        if lib is not None:
            return lib.function(name)(table, o, d, near, far)
    return LIBRARIES["numpy"].function(name)(table, o, d, near, far)


def loop(step: Callable[..., tuple[Array, ...]], *states: Array) -> tuple[Array, ...]:
    """The states after as many steps as each element of the batch takes: `(go_on, *states) = step(*states)`.

    Every element takes a first step, and another one where `go_on` holds. Its states are numbers, whole numbers or
    conditions, and stay so; one of them at least is no plain number. A step may use whatever its formula knows, and
    have loops in itself. Compiled, all elements of a vector take steps until the last one stops, and what a step needs
    and does not change is computed before. A step must see to it that the loop ends, also for NaN, of which all
    comparisons are false. No derivative passes a loop: its results are constants for differentiation.
    """
    for x in states:
        lib = library_of_type(type(x))
        if lib is not None:
            return tuple(lib.function("loop")(step, *states))
    return tuple(LIBRARIES["numpy"].function("loop")(step, *states))


def _one(name: str, *arrays: Array) -> Callable[..., Array] | None:
    """What the library of these arrays has as one operation, if it has it (see `together`)."""
    for x in arrays:
        lib = library_of_type(type(x))
        if lib is not None:
            return getattr(lib, f"one_{name}", None)
    return None


def interval(nodes: Array, count: int, x: Array) -> Array | None:
    """The interval of `count` increasing nodes that x is in, from 0, the nearest outside; None where the library of x
    has no search of its own."""
    search = _one("interval", x)
    return None if search is None else search(nodes, count, x)


def network(layers: Sequence[tuple[Array, Array, int]], x: Sequence[Array], chosen: Array) -> Array:
    """Output number `chosen` of a network with max(., 0) between its layers, for inputs x: components, or numbers.

    Layers are (kernel, bias, width), kernels flat, by input and neuron. `chosen` is a whole number, or one for each
    channel.
    """
    together = _one("network", *x)
    if together is not None:
        return together(layers, x, chosen)
    *inner, last = layers
    for layer in inner:
        x = [maximum(_neuron(layer, x, j), 0.0) for j in range(layer[2])]
    return _neuron(last, x, chosen)


def _neuron(layer: tuple[Array, Array, int], x: Sequence[Array], j: Any) -> Array:
    """Weighted sum of the inputs, and the bias."""
    kernel, bias, width = layer
    total = take(bias, j)
    for i, value in enumerate(x):
        if not (isinstance(value, float) and value == 0.0):
            total = total + take(kernel, j + i * width) * value
    return total


def clip(x: Array, low: Array, high: Array) -> Array:
    """x limited to [low, high]."""
    return minimum(maximum(x, low), high)


def turn(x: Array) -> tuple[Array, Array]:
    """(cos 2 pi x, sin 2 pi x): a unit vector turned by x of a whole turn, as sampling needs it."""
    return cos_turn(x), sin_turn(x)


def square(x: Array) -> Array:
    """x times itself."""
    return x * x


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
