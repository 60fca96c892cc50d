"""Ranges and shapes of arguments as type annotations, enforced by one decorator: bodies are formulas."""

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from ..declared.numbers import NANOMETRES, numbers
from ..errors import ArrayTypeError, MeaningWarning, ParameterError, ShapeError, TooLargeError, shown, warn

Array = NDArray[np.floating[Any]]


class _Range(NamedTuple):
    """The values that a number may have; it stands in the signature, and `_checked` enforces it."""

    low: float
    high: float
    rule: str
    hint: str = "check the sign, the unit and the order of the arguments"
    open: bool = False  # True: the low end itself is excluded
    likely: float = 0.0  # numbers that are all below are likely of another unit

    def __repr__(self) -> str:
        return self.rule


class _Points(NamedTuple):
    """Vectors x, y, z on the last axis; `axes` counts the axes that do not broadcast."""

    rule: str
    axes: int = 1

    def __repr__(self) -> str:
        return self.rule


_RADIANS = "angles are in radians, numpy.radians(degrees)"
_NOT_AN_ANGLE = "pass a cosine, not an angle, of the lit side"
_ONE = 1.0 + 1e-6  # dot products of unit vectors exceed 1 by rounding; this is enough for float32
_Real = Annotated[Any, _Range(-np.inf, np.inf, "a real number")]
_Positive = Annotated[Any, _Range(0.0, np.inf, "greater than 0", open=True)]
_Wavelength = Annotated[
    Any,
    _Range(
        0.0,
        np.inf,
        "greater than 0",
        "in micrometres? wavelengths are in nanometres: multiply by 1000",
        True,
        NANOMETRES,
    ),
]
_NotNegative = Annotated[Any, _Range(0.0, np.inf, "0 or greater")]
_Reflectance = Annotated[Any, _Range(0.0, 1.0, "in [0, 1]", "no surface reflects more than arrives")]
_Cosine = Annotated[Any, _Range(0.0, _ONE, "in [0, 1]", _NOT_AN_ANGLE)]
_Divisor = Annotated[Any, _Range(0.0, _ONE, "in (0, 1]", "leave grazing directions out", open=True)]
_EitherSide = Annotated[Any, _Range(-_ONE, _ONE, "in [-1, 1]", _NOT_AN_ANGLE)]
_Polar = Annotated[Any, _Range(0.0, np.pi, "in [0, pi]", _RADIANS)]
_Azimuth = Annotated[Any, _Range(0.0, 2.0 * np.pi, "in [0, 2 pi]", _RADIANS)]
_VECTOR = _Points("of shape (..., 3)")
_Vector = Annotated[Any, _VECTOR]
_Polygon = Annotated[Any, _Points("of shape (..., V, 3), V >= 3", axes=2)]

_F = TypeVar("_F", bound=Callable[..., Any])


def _numbers(name: str, value: Any) -> Array:
    try:
        array = numbers(value)
    except ValueError as error:
        raise ArrayTypeError(f"{name} must be real numbers, got {error}: make it an array of floats") from None
    if array.dtype.kind not in "iuf":
        raise ArrayTypeError(f"{name} must be real numbers, got dtype {array.dtype}: convert it to float64")
    return array if array.dtype.kind == "f" and array.dtype.itemsize >= 4 else array.astype(np.float64)


def _in_range(name: str, value: Any, allowed: _Range) -> Array:
    array = _numbers(name, value)
    wrong = (array < allowed.low) | (array > allowed.high) | (allowed.open & (array == allowed.low))
    if np.any(wrong):
        got = f"{array[wrong][0]:.9g}" + (f" ({np.sum(wrong)} of {array.size} values)" if array.ndim else "")
        raise ParameterError(f"{name} must be {allowed.rule}, got {got}: {allowed.hint}")
    if array.size and array.max() < allowed.likely:
        warn(f"{name}: up to {array.max():g}; {allowed.hint}", MeaningWarning)
    return array


def _points(name: str, value: Any, allowed: _Points) -> Array:
    array = _numbers(name, value)
    if array.ndim < allowed.axes or array.shape[-1] != 3 or (allowed.axes == 2 and array.shape[-2] < 3):
        raise ShapeError(f"{name} must be {allowed.rule}, got {array.shape}: put x, y, z on the last axis")
    if np.any(np.isinf(array)):
        raise ParameterError(f"{name} must be finite, got inf: use a distant point, or a direction")
    return array


def _one_dtype(arrays: dict[str, Array], arguments: dict[str, Any]) -> dict[str, Array]:
    """Python numbers and lists take the dtype of the arrays: they must not turn float32 into float64."""
    dtypes = [array.dtype for name, array in arrays.items() if hasattr(arguments[name], "dtype")]
    dtype = np.result_type(*dtypes) if dtypes else np.dtype(np.float64)
    with np.errstate(over="ignore"):  # 1e300 is infinite in single precision, and so is what follows from it
        return {name: array.astype(dtype, copy=False) for name, array in arrays.items()}


def _checked(function: _F) -> _F:
    """Check each call against the `_Range` and `_Points` in the signature, and that the shapes broadcast."""
    signature = inspect.signature(function)
    marked = [p for p in signature.parameters.values() if p.annotation not in (str, bool)]
    rules = {p.name: p.annotation.__metadata__[0] for p in marked}
    kinds = {p.name: p.annotation for p in signature.parameters.values() if p.annotation in (str, bool)}

    @functools.wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        try:
            return carried_out(*args, **kwargs)
        except MemoryError as error:
            raise TooLargeError(f"{function.__name__}: {error}; take a part at a time") from None

    def carried_out(*args: Any, **kwargs: Any) -> Any:
        try:
            call = signature.bind(*args, **kwargs)
        except TypeError:
            return function(*args, **kwargs)  # Python's own words about the number and names of arguments
        call.apply_defaults()
        for name, kind in kinds.items():
            if not isinstance(call.arguments[name], kind):
                got = shown(call.arguments[name])
                raise ParameterError(f"{name} must be {'True or False' if kind is bool else 'a word'}, got {got}")
        arrays, shapes = {}, {}
        for name, rule in rules.items():
            if call.arguments[name] is not None or signature.parameters[name].default is not None:
                array = (_in_range if isinstance(rule, _Range) else _points)(name, call.arguments[name], rule)
                arrays[name], shapes[name] = array, array.shape[: array.ndim - getattr(rule, "axes", 0)]
        call.arguments |= _one_dtype(arrays, call.arguments)
        try:
            np.broadcast_shapes(*shapes.values())
        except ValueError:
            got = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
            raise ShapeError(f"shapes must broadcast (axes equal or 1), got {got}: add axes of 1") from None
        with np.errstate(all="ignore"):  # of infinite and of huge numbers
            return function(*call.args, **call.kwargs)

    return cast(_F, checked)


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)
