"""Elementary functions for any array library, as formulas call them: `ops.sqrt(x)` is that of the library of x."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ..declared.numbers import is_masked as is_masked
from ..declared.numbers import numbers as numbers
from . import LIBRARIES as LIBRARIES
from . import Array
from . import Library as Library
from . import as_arrays as as_arrays
from . import broadcast_shape as broadcast_shape
from . import dtype_of as dtype_of
from . import library as library
from . import library_of_type as library_of_type
from . import plain as plain
from . import to_numpy as to_numpy
from .operations import STRUCTURAL, Builder, Operation, Rule, Terms, chain

OPERATIONS: dict[str, Operation] = {row.name: row for row in STRUCTURAL}
ELEMENTARY: dict[str, Operation] = {}
"""The table of operations, and of it the elementary functions: all that gonio knows of one stands here, but its code in
LLVM (`compile/llvm/elementary/`) and its formula for languages without it (`compile/source/elementary.py`)."""


def _function(name: str, doc: str) -> Callable[..., Array]:
    """That of the library of its arguments."""

    def function(*args: Array) -> Array:
        for x in args:
            lib = library_of_type(type(x))
            if lib is not None:
                return lib.function(name)(*args)
        return LIBRARIES["numpy"].function(name)(*args)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = doc
    return function


def _elementary(name: str, doc: str, arguments: tuple[str, ...] = ("x",), **facts: Any) -> Callable[..., Array]:
    """A row of the table, of which `Operation` says what its facts are."""
    OPERATIONS[name] = ELEMENTARY[name] = row = Operation(name, arguments, **facts)
    for lib in LIBRARIES.values():
        lib.add(row)
    return _function(name, doc)


sqrt = _elementary(
    "sqrt",
    "Square root.",
    cost=3.0,
    derivative=chain(lambda do, number, x, r: do("div", number(0.5), r)),
    positive=True,
    languages={"c": "sqrtf", "shading": "sqrt"},
)
exp = _elementary(
    "exp",
    "Exponential.",
    cost=10.0,
    derivative=chain(lambda do, number, x, r: r),
    wide=True,
    positive=True,
    zero="nowhere",
    languages={"c": "expf", "shading": "exp2"},  # of whole numbers, which its formula leaves
    rough=("shading",),
)
log = _elementary(
    "log",
    "Natural logarithm.",
    cost=14.0,
    derivative=chain(lambda do, number, x, r: do("div", number(1.0), x)),
    wide=True,
    languages={"c": "logf", "shading": "log"},
    rough=("shading",),
)
sin = _elementary(
    "sin",
    "Sine.",
    cost=16.0,
    derivative=chain(lambda do, number, x, r: do("cos", x)),
    bounded=True,
    languages={"c": "sinf"},
)
cos = _elementary(
    "cos",
    "Cosine.",
    cost=16.0,
    derivative=chain(lambda do, number, x, r: do("neg", do("sin", x))),
    bounded=True,
    languages={"c": "cosf"},
)


def _ratio(lib: Library, x: Array) -> Array:
    sine, cosine = lib.module.sincos(x)  # Dr.Jit's own tangent is right to 3e-9 only, in double precision too
    return sine / cosine


tan = _elementary(
    "tan",
    "Tangent.",
    cost=20.0,
    derivative=chain(lambda do, number, x, r: do("add", number(1.0), do("mul", r, r))),
    wide=True,
    libraries={"drjit": _ratio},
    languages={"c": "tanf"},
)
sin_turn = _elementary(
    "sin_turn",
    "Sine of 2 pi x: of x turns, up to which it is exact.",
    cost=9.0,
    derivative=chain(lambda do, number, x, r: do("mul", number(2.0 * math.pi), do("cos_turn", x))),
    bounded=True,
    libraries={"": lambda lib, x: lib.function("sin")(x * (2.0 * math.pi))},
)
cos_turn = _elementary(
    "cos_turn",
    "Cosine of 2 pi x.",
    cost=8.0,
    derivative=chain(lambda do, number, x, r: do("mul", number(-2.0 * math.pi), do("sin_turn", x))),
    bounded=True,
    libraries={"": lambda lib, x: lib.function("cos")(x * (2.0 * math.pi))},
)
arccos = _elementary(
    "arccos",
    "Inverse cosine, in [0, pi].",
    cost=17.0,
    derivative=chain(
        lambda do, number, x, r: do("div", number(-1.0), do("sqrt", do("sub", number(1.0), do("mul", x, x))))
    ),
    bounded=True,
    libraries={"drjit": "acos"},
    languages={"c": "acosf"},
)


def _of_angle(do: Builder, number: Builder, slope: int, r: int, y: int, x: int) -> Terms:
    part = do("div", slope, do("add", do("mul", x, x), do("mul", y, y)))
    return do("mul", part, x), do("neg", do("mul", part, y))


arctan2 = _elementary(
    "arctan2",
    "arctan2(y, x): the angle of (x, y), in (-pi, pi].",
    ("y", "x"),
    cost=30.0,
    derivative=_of_angle,
    bounded=True,
    libraries={"drjit": "atan2", "torch": lambda lib, y, x: lib.module.arctan2(*lib.pair(y, x))},
    languages={"c": "atan2f"},
)
erf = _elementary(
    "erf",
    "Error function.",
    cost=20.0,
    derivative=chain(
        lambda do, number, x, r: do("mul", number(2.0 / math.sqrt(math.pi)), do("exp", do("neg", do("mul", x, x))))
    ),
    bounded=True,
    special="erf",
    languages={"c": "erff"},
)


def _single_erfinv(lib: Library, x: Array) -> Array:
    """Dr.Jit's own, of single precision, which is NaN at -1 and 1."""
    dr = lib.module
    inside = dr.abs(x) < 1.0
    return dr.select(inside, dr.erfinv(dr.select(inside, x, 0.0)), x * math.inf)


def _double_erfinv(lib: Library, x: Array) -> Array:
    """Dr.Jit's own, which two Newton steps amend."""
    dr = lib.module
    inside = dr.abs(x) < 1.0
    y = dr.erfinv(dr.select(inside, x, 0.0))
    for _ in range(2):
        y = y - (dr.erf(y) - x) * dr.exp(y * y) * (0.5 * math.sqrt(math.pi))
    return dr.select(inside, y, x * math.inf)


erfinv = _elementary(
    "erfinv",
    "Inverse of the error function.",
    cost=40.0,
    derivative=chain(lambda do, number, x, r: do("mul", number(0.5 * math.sqrt(math.pi)), do("exp", do("mul", r, r)))),
    wide=True,
    libraries={"drjit": _double_erfinv, "mitsuba": _single_erfinv},
    special="erfinv",
    languages={"cuda": "erfinvf"},
)


def _ierfc(lib: Library, x: Array, erfc: Callable[[Array], Array] | None = None) -> Array:
    erfc = erfc or lib.function("erfc")
    x = lib.function("where")(x > 30.0, 30.0, x)  # 0 from there on, infinity too; NaN stays
    return lib.function("exp")(-x * x) * (1.0 / math.sqrt(math.pi)) - x * erfc(x)


ierfc = _elementary(
    "ierfc",
    "Integral of 1 - erf from x >= 0 to infinity, exp(-x^2)/sqrt(pi) - x erfc(x); error: rounding of 2x + ierfc(x).",
    cost=12.0,
    derivative=chain(lambda do, number, x, r: do("sub", do("erf", x), number(1.0))),
    positive=True,
    libraries={"": _ierfc, "drjit": lambda lib, x: _ierfc(lib, x, lambda x: 1.0 - lib.module.erf(x))},
    special="erfc",
)
absolute = _elementary(
    "absolute",
    "Magnitude.",
    derivative=chain(lambda do, number, x, r: do("select", do("lt", x, number(0.0)), number(-1.0), number(1.0))),
    operator="abs",
    shown="abs",
    positive=True,
    zero="at 0",
    multiplicative=True,
    libraries={"": "abs"},
    languages={"c": "fabsf", "shading": "abs"},
    llvm="fabs",
)
floor = _elementary(
    "floor",
    "Largest integer not above, as a floating-point number.",
    languages={"c": "floorf", "shading": "floor"},
    llvm="floor",
)


def _of_power(do: Builder, number: Builder, slope: int, r: int, x: int, y: int) -> Terms:
    by_x = do("mul", y, do("power", x, do("sub", y, number(1.0))))
    by_y = do("mul", r, do("log", x))
    return do("mul", slope, by_x), do("mul", slope, by_y)


power = _elementary(
    "power",
    "power(x, y): x to the y.",
    ("x", "y"),
    cost=40.0,
    derivative=_of_power,
    operator="pow",
    wide=True,
    libraries={"torch": "pow"},
    languages={"c": "powf"},
)


def _of_extremum(comparison: str) -> Rule:
    """The first is taken at a tie."""

    def rule(do: Builder, number: Builder, slope: int, r: int, a: int, b: int) -> Terms:
        zero, first = number(0.0), do(comparison, a, b)
        return do("select", first, slope, zero), do("select", first, zero, slope)

    return rule


minimum = _elementary(
    "minimum",
    "The smaller of two.",
    ("x", "y"),
    derivative=_of_extremum("le"),
    languages={"c": "fminf", "shading": "min"},
)
maximum = _elementary(
    "maximum",
    "The larger of two.",
    ("x", "y"),
    derivative=_of_extremum("ge"),
    languages={"c": "fmaxf", "shading": "max"},
)
where = _function("where", "where(condition, a, b): a where the condition holds, else b.")
take = _function(
    "take",
    "take(table, index): gather from a flat table, of indices that are in it (others give any number, or an error).",
)
to_index = _function("to_index", "Whole number for `take`; NaN and infinity become 0.")
stop_gradient = _function("stop_gradient", "The value, as a constant for differentiation.")


# Whole numbers of 32 bits without a sign, as hashes and random numbers are made of: of `to_index`, plain numbers, and
# of each other. They are no numbers to calculate with: `unit` makes one, and those below 2^31 are places of tables.
xor = _function("xor", "Bits that are set in one of two whole numbers alone.")
bit_and = _function("bit_and", "Bits that are set in both of two whole numbers.")
shift_left = _function("shift_left", "shift_left(x, n): the bits of x moved up by n, 0 to 31.")
shift_right = _function("shift_right", "shift_right(x, n): the bits of x moved down by n, 0 to 31.")
wrapped_sum = _function("wrapped_sum", "The sum of two whole numbers modulo 2^32.")
wrapped_product = _function("wrapped_product", "The product of two whole numbers modulo 2^32.")
unit = _function("unit", "unit(x, like): the upper 24 bits of a whole number as one in [0, 1), of the dtype of like.")


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
