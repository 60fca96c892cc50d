"""Functions of arrays that broadcast: ranges and shapes stand in the signature, so that bodies are formulas.

@formula
def solid_angle_cone(half_angle: Annotated[Any, Declared("of the cone", 0.0, math.pi, "rad")]) -> Array: ...
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from ..errors import ArrayTypeError, MeaningWarning, ParameterError, ShapeError, TooLargeError, shown, warn
from .arguments import Declared, checked
from .numbers import NANOMETRES, numbers
from .wording import bounds, suspected

Array = NDArray[np.floating[Any]]

F = TypeVar("F", bound=Callable[..., Any])


class VectorArrays(NamedTuple):
    """Vectors x, y, z on the last axis; `axes` counts the axes that do not broadcast."""

    shape: str = "(..., 3)"
    axes: int = 1


def real_numbers(name: str, value: Any) -> Array:
    """The value as floating point numbers, of single precision where it was. Raises ArrayTypeError."""
    try:
        array = numbers(value)
    except ValueError as error:
        raise ArrayTypeError(f"{name}={shown(value)}: {error}; expected real numbers") from None
    if array.dtype.kind not in "iuf":
        raise ArrayTypeError(f"{name}: dtype {array.dtype}; expected real numbers: convert it to float64")
    return array if array.dtype.kind == "f" and array.dtype.itemsize >= 4 else array.astype(np.float64)


def in_range(name: str, value: Any, d: Declared) -> Array:
    """Numbers within the declared bounds; NaN stays. Raises ParameterError."""
    array = real_numbers(name, value)
    with np.errstate(over="ignore"):  # a bound beyond float32 is infinite there
        wrong = (array < d.low) | (array > d.high)
    if np.any(wrong):
        first = array[wrong][0]
        got = f"{first:.9g}" + (f" ({np.sum(wrong)} of {array.size} values)" if array.ndim else "")
        raise ParameterError(f"{name}={got}: expected numbers{bounds(d)}: {d.doc}{suspected(first, d)}")
    if d.unit == "nm" and array.size and array.max() < NANOMETRES:
        warn(f"{name}: up to {array.max():g}; in micrometres? {d.doc}: multiply by 1000", MeaningWarning)
    return array


def points(name: str, value: Any, allowed: VectorArrays) -> Array:
    """Vectors that are finite, or NaN. Raises ShapeError, ParameterError."""
    array = real_numbers(name, value)
    if array.ndim < allowed.axes or array.shape[-1] != 3 or (allowed.axes == 2 and array.shape[-2] < 3):
        raise ShapeError(f"{name}: shape {array.shape}; expected {allowed.shape}: put x, y, z on the last axis")
    if np.any(np.isinf(array)):
        raise ParameterError(f"{name}: inf; expected finite numbers: use a distant point, or a direction")
    return array


def one_dtype(arrays: dict[str, Array], arguments: dict[str, Any]) -> dict[str, Array]:
    """Python numbers and lists take the dtype of the arrays: they must not turn float32 into float64."""
    dtypes = [array.dtype for name, array in arrays.items() if hasattr(arguments[name], "dtype")]
    dtype = np.result_type(*dtypes) if dtypes else np.dtype(np.float64)
    with np.errstate(over="ignore"):  # 1e300 is infinite in single precision, and so is what follows from it
        return {name: array.astype(dtype, copy=False) for name, array in arrays.items()}


def doubled(arrays: dict[str, Array]) -> dict[str, Any]:
    """In double precision, floats without axes."""
    return {name: x.astype(float) if x.ndim else float(x) for name, x in arrays.items()}


def broadcasting(shapes: dict[str, tuple[int, ...]]) -> None:
    """Raises ShapeError for shapes that do not broadcast."""
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError:
        got = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ShapeError(f"shapes must broadcast (axes equal or 1), got {got}: add axes of 1") from None


def formula(function: F, double: bool = False) -> F:
    """Each call gets arrays of one dtype that broadcast, held to the `Declared` and `VectorArrays` of the signature;
    with `double` those of double precision, and floats for numbers."""
    signature = inspect.signature(function, eval_str=True)
    rules = {
        p.name: next(x for x in p.annotation.__metadata__ if isinstance(x, (Declared, VectorArrays)))
        for p in signature.parameters.values()
        if hasattr(p.annotation, "__metadata__") and p.annotation.__origin__ is not str
    }

    @functools.wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        try:
            return carried_out(*args, **named)
        except MemoryError as error:
            raise TooLargeError(f"{function.__name__}: {error}; take a part at a time") from None

    def carried_out(*args: Any, **named: Any) -> Any:
        try:
            bound = signature.bind(*args, **named)
        except TypeError:
            return function(*args, **named)  # Python's own words about the number and names of arguments
        bound.apply_defaults()
        arrays, shapes = {}, {}
        for name, rule in rules.items():
            if bound.arguments[name] is not None or signature.parameters[name].default is not None:
                value = bound.arguments[name]
                array = points(name, value, rule) if isinstance(rule, VectorArrays) else in_range(name, value, rule)
                arrays[name], shapes[name] = array, array.shape[: array.ndim - getattr(rule, "axes", 0)]
        bound.arguments |= doubled(arrays) if double else one_dtype(arrays, bound.arguments)
        broadcasting(shapes)
        with np.errstate(all="ignore"):  # of infinite and of huge numbers
            return words(*bound.args, **bound.kwargs)

    words = checked(function)
    return cast(F, call)
