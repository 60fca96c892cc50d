"""Values of arguments: converted to the type of an annotation, and read from what was typed."""

from __future__ import annotations

import json
import math
import os
import re
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from types import UnionType
from typing import Any

import numpy as np

from .declaration import LARGEST, LONGEST, UNFIT, Declared, Real
from .numbers import numbers
from .typed import all_in_degrees, is_number

ANGLES: dict[str, Callable[[float], float]] = {"rad": math.radians, "degrees": float}
"""Units of angles in Python -> what makes them of degrees."""

_INTEGER = re.compile(r"[-+]?\d{1,19}", re.ASCII)


def fit(kind: Any, value: Any, d: Declared | None = None) -> Any:
    """The value as this kind. Raises one of UNFIT for another value."""
    if kind is Any:
        if isinstance(value, str) and d is not None and d.unit:  # a text that stands for no number
            raise TypeError
        return value
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        declared = next((x for x in kind.__metadata__ if isinstance(x, Declared)), d)
        return _within(numbers(value), declared) if Real in kind.__metadata__ else fit(inner[0], value, declared)
    origin = typing.get_origin(kind)
    if origin is os.PathLike:
        return fit(os.PathLike, value, d)
    if origin in (UnionType, typing.Union):
        for one in inner:
            with suppress(*UNFIT):
                return fit(one, value, d)
        raise TypeError
    if origin is Callable or kind is Callable:
        if not callable(value) or hasattr(type(value), "_noun"):
            raise TypeError
        return value
    if origin is tuple:
        return tuple(fit(of, x, d) for of, x in zip(inner, items(value, d), strict=True))
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping) or (d is not None and d.longest and len(value) > d.longest):
            raise TypeError
        return {fit(inner[0], name): fit(inner[1], x) for name, x in value.items()}
    if origin is not None:
        if isinstance(value, str) and issubclass(origin, Sequence) and d is None:
            return fit(inner[0], value)  # a sequence of letters, too: the function says what it means
        return _counted([fit(inner[0], x, d) for x in items(value, d)], d)
    if kind in (int, float):
        return _number(kind, value, d)
    if kind is Path:
        return Path(fit(str, os.fspath(value), d))
    if kind is os.PathLike and isinstance(value, bytes):
        return os.fsdecode(value)
    if not isinstance(value, (bool, np.bool_) if kind is bool else kind):
        raise TypeError
    return _plain(value, d)


def _plain(value: Any, d: Declared | None) -> Any:
    """A value that has no parts, or a JSON object: as it is, but for words, which have a case."""
    if isinstance(value, str) and d is not None:
        if d.words:
            return {word.lower(): word for word in d.words}[value.lower()]
        longest = d.longest or LONGEST
        if len(value) > longest or not (value if longest <= LONGEST else "".join(value.split())).isprintable():
            raise ValueError
        if d.longest and not value.strip():
            raise ValueError
    if type(value) is dict:
        json.dumps(value, ensure_ascii=False, allow_nan=False).encode()
    return bool(value) if isinstance(value, np.bool_) else value


def _counted(values: list[Any], d: Declared | None) -> Sequence[Any]:
    """A list; a declared one is a tuple, not empty, of one of its lengths, rising if that is asked."""
    if d is None:
        return values
    fitting = len(values) in d.lengths if d.lengths else 0 < len(values) <= (d.longest or len(values))
    if not fitting or (d.rising and not all(a < b for a, b in pairwise(values))):
        raise ValueError
    return tuple(values)


def _within(value: Any, d: Declared | None) -> Any:
    """Numbers that are all within the declared bounds; NaN stands for what is missing."""
    if d is not None and ((value < d.low) | (value > d.high)).any():
        raise ValueError
    return value


def _number(kind: type, value: Any, d: Declared | None) -> Any:
    """A number of this type; NaN is none, neither are True and False, nor infinity where the number is declared."""
    if hasattr(value, "__array__"):  # a number in an array without axes, of any library
        value = numbers(value)[()]
    whole, real = (int, np.integer), (int, float, np.integer, np.floating)
    if isinstance(value, bool) or not isinstance(value, whole if kind is int else real) or math.isnan(value):
        raise TypeError
    number = kind(value)
    if d is not None:
        if not (d.low <= number <= d.high and math.isfinite(number)) or (d.words and number not in d.words):
            raise ValueError
        if kind is int and (abs(number) >= LARGEST or number % d.multiple):
            raise ValueError
    return number


def items(value: Any, d: Declared | None = None) -> list[Any]:
    """The items of something that has several, where it is declared a list, a tuple or an array; else itself."""
    if hasattr(value, "__array__"):
        array = value if isinstance(value, np.ndarray) and d is None else numbers(value)
        return list(value if d is None else array.tolist()) if array.ndim else [value]
    kinds = Iterable if d is None else (list, tuple, range)
    return list(value) if isinstance(value, kinds) and not isinstance(value, (str, bytes, Mapping)) else [value]


def of_text(kind: Any, text: str, d: Declared) -> Any:
    """The value of a text as this kind, in the unit of Python; the text itself if it has none."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        return of_text(inner[0], text, next((x for x in kind.__metadata__ if isinstance(x, Declared)), d))
    if kind is Any and d.unit == "direction":
        theta, phi = map(math.radians, all_in_degrees(text))
        return np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
    if kind is Any and not d.unit:
        return text
    if kind is Any:
        values = of_text(Sequence[float], text, d)
        _within(np.array(values, dtype=float), d)
        return values[0] if len(values) == 1 else values
    if inner:
        text = text.removesuffix(",")
        if d.unit in ANGLES:
            return [ANGLES[d.unit](x) for x in all_in_degrees(text)]
        return [of_text(inner[0], part.strip(), d) for part in text.split(",")]
    if kind is dict:
        return json.loads(text)
    if kind is int and _INTEGER.fullmatch(text):
        return int(text)
    if kind is float and d.unit in ANGLES:
        (degrees,) = all_in_degrees(text)
        return ANGLES[d.unit](degrees)
    if kind is float and d.unit == "share" and is_number(text.removesuffix("%").strip()):
        return float(text.removesuffix("%")) / 100.0
    if kind is float and is_number(text):
        return float(text)
    return {"true": True, "false": False}.get(text.lower(), text) if kind is bool else text


def scalar_of(kind: Any) -> Any:
    """The kind of the numbers or words of a kind, where all are of one."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__") or typing.get_origin(kind) is Sequence:
        return scalar_of(inner[0])
    return scalar_of(inner[0]) if typing.get_origin(kind) is tuple and len({*inner}) == 1 else kind
