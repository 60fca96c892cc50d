"""Real numbers that a caller gave, as plain NumPy arrays; the one place that says what is none."""

from __future__ import annotations

from typing import Any, TypeGuard

import numpy as np

from ..errors import REFUSALS

NANOMETRES = 50.0
"""Wavelengths [nm] below which they are taken for micrometres: soft X-rays, otherwise."""

_ADVICE = {
    "c": "take the real part or the modulus",
    "M": "subtract a date and divide by a unit of time",
    "m": "divide by a unit of time",
}


def numbers(value: Any) -> np.ndarray:
    """Real numbers that a caller gave, as a plain NumPy array, masked ones as NaN; not copied where that is not needed.

    Raises ValueError, which says why, for complex numbers, dates, words and other objects, and rows of unequal length.
    """
    array = value if type(value) is np.ndarray else _plain(value)
    kind = array.dtype.kind
    if kind in "fiub":
        return array.astype(np.float64) if kind == "f" and array.itemsize > 8 else array
    if kind == "O" and all(type(x) in (int, float) for x in array.flat):  # Python's integers have no bound
        try:
            return array.astype(float)
        except OverflowError:
            raise ValueError("an integer beyond the range of floating point") from None
    got = str(array.dtype) if array.ndim or kind != "O" else f"a {type(value).__name__}"
    verb = "are no real numbers" if array.ndim else "is no real number"
    raise ValueError(f"{got}, which {verb}; {_ADVICE.get(kind, 'convert first')}")


def _plain(value: Any) -> np.ndarray:
    if is_masked(value):
        array, masked = np.asarray(value.data), np.ma.getmaskarray(value)
        if array.dtype.kind not in "fiub" or not masked.any():
            return array
        array = array if array.dtype.kind == "f" else array.astype(float)
        return np.where(masked, array.dtype.type(np.nan), array)
    try:
        return np.array([_plain(x) for x in value]) if _holds_masks(value) else np.asarray(value)
    except MemoryError:
        raise
    except RecursionError:
        raise ValueError("a list that holds itself") from None
    except REFUSALS as error:  # arrays of other libraries say no in their own ways
        if isinstance(value, (list, tuple)):
            raise ValueError("rows of unequal length; expected as many numbers in each") from None
        raise ValueError(f"a {type(value).__name__}, which is no array of NumPy ({error})") from None


def _holds_masks(value: Any) -> bool:
    """Whether there are masked arrays in a list, which NumPy would read without their masks."""
    if not isinstance(value, (list, tuple)):
        return is_masked(value)
    kinds = set(map(type, value))
    return any(issubclass(k, (list, tuple, np.ndarray)) for k in kinds) and any(map(_holds_masks, value))


def is_masked(value: Any) -> TypeGuard[np.ma.MaskedArray]:
    """Whether this is a masked array of NumPy, which takes long to import: other things are not compared with it."""
    return isinstance(value, np.ndarray) and type(value) is not np.ndarray and isinstance(value, np.ma.MaskedArray)
