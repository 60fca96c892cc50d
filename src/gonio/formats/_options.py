"""Options of readers and writers: declared in the signature of `read` and `write`, checked and listed here.

    def write(m: Reflectance, path: Path, nodes: Annotated[int, Declared("cosines of either sign", 4, 2048)] = 64): ...

The type is bool, int, float, str, Path, dict (JSON) or another class; a tuple of fixed length, a Sequence of any; or
several of these with `|`. `Declared` holds the bounds and the meaning. A default of None makes the option optional.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import math
import os
import re
import sys
import typing
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cache
from inspect import Parameter, signature
from itertools import pairwise
from pathlib import Path
from types import ModuleType, NoneType, UnionType
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..errors import ParameterError
from ..formula.text import shown
from ..tables.axes import fits
from ._reading import plain_text

ABOVE_ZERO, BELOW_ONE = sys.float_info.min, math.nextafter(1.0, 0.0)
"""Bounds of numbers that may not be 0, or 1."""

LARGEST, LONGEST = 1 << 63, 1000
"""Bound below which whole numbers are; largest number of characters of a word."""

NOUNS = {bool: "true or false", int: "a whole number", float: "a number", str: "a word", Path: "a file name"}
NOUNS |= {dict: "a JSON object", datetime.date: "a date"}
UNFIT = (TypeError, ValueError, OverflowError, RecursionError, KeyError)
"""Errors of conversions of unfit values."""


class Declared(NamedTuple):
    """The meaning and the bounds of an option, in `Annotated[type, Declared(...)]`.

    low, high   bounds of every number, in the `unit`
    words       the only values; text in any case
    lengths     of a Sequence of node counts, one for each axis of a grid, which must fit into memory
    multiple    divisor of whole numbers
    rising      whether a Sequence increases
    usual       the meaning of a default of None
    """

    doc: str
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    words: Collection[Any] = ()
    lengths: tuple[int, ...] = ()
    multiple: int = 1
    rising: bool = False
    usual: Any = None


class Option(NamedTuple):
    """An option of a reader or a writer; `kinds`: the types of its value, None aside."""

    name: str
    kinds: tuple[Any, ...]
    default: Any
    declared: Declared

    @property
    def expected(self) -> str:
        """The allowed values, in words."""
        return ", or ".join(_in_words(kind, self.declared) for kind in self.kinds)

    @property
    def usual(self) -> str:
        """The default value, as typed on the command line; "" for none."""
        return _typed(self.declared.usual if self.default is None else self.default)

    def checked(self, value: Any, advice: str = "") -> Any:
        """The value, converted for a reader or a writer. Raises ParameterError; TooLargeError for too large a grid."""
        if value is None and self.default is None:
            return None
        for kind in self.kinds:
            with contextlib.suppress(*UNFIT):
                converted = _converted(kind, value, self.declared)
                break
        else:
            raise ParameterError(f"{self.name}={shown(value)}: expected {self.expected}: {self.declared.doc}{advice}")
        if self.declared.lengths:
            fits(math.prod(converted), f"{self.name}={shown(value)}")
        return converted

    def of_text(self, text: str) -> Any:
        """The value typed on the command line; where no kind fits, a value that `checked` refuses."""
        if text.lower() == "none" and self.default is None:
            return None
        value: Any = text
        for kind in self.kinds:
            with contextlib.suppress(*UNFIT):
                value = _of_text(kind, text)
                return _converted(kind, value, self.declared)
        return value

    def to_json(self) -> dict[str, str]:
        return {"expected": self.expected, "default": self.usual, "doc": self.declared.doc}


def _converted(kind: Any, value: Any, d: Declared) -> Any:
    """The value as this kind. Raises one of UNFIT for another value."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        return _converted(inner[0], value, inner[1])
    if typing.get_origin(kind) is tuple:
        return tuple(_converted(of, x, d) for of, x in zip(inner, _items(value), strict=True))
    if inner:
        values = tuple(_converted(inner[0], x, d) for x in _items(value))
        fitting = len(values) in d.lengths if d.lengths else len(values) > 0
        if not fitting or (d.rising and not all(a < b for a, b in pairwise(values))):
            raise ValueError
        return values
    if kind in (int, float):
        return _number(kind, value, d)
    if kind is Path:
        return Path(_converted(str, os.fspath(value), d))
    if not isinstance(value, (bool, np.bool_) if kind is bool else kind):
        raise TypeError
    if isinstance(value, str):
        if d.words:
            return {word.lower(): word for word in d.words}[value.lower()]
        if not value.isprintable() or len(value) > LONGEST:
            raise ValueError
        return value
    if isinstance(value, dict):
        json.dumps(value, ensure_ascii=False, allow_nan=False).encode()
    return bool(value) if kind is bool else value


def _items(value: Any) -> list[Any]:
    """The items of a list, a tuple or an array of any library; of anything else itself alone."""
    if isinstance(value, (list, tuple, range)):
        return list(value)
    return list(ops.numbers(value).tolist()) if hasattr(value, "__array__") and np.ndim(value) else [value]


def _number(kind: type, value: Any, d: Declared) -> float:
    whole, real = (int, np.integer), (int, float, np.integer, np.floating)
    if isinstance(value, bool) or not isinstance(value, whole if kind is int else real):
        raise TypeError
    number = kind(value)
    if not (d.low <= number <= d.high and math.isfinite(number)) or (d.words and number not in d.words):
        raise ValueError
    if kind is int and (abs(number) >= LARGEST or number % d.multiple):
        raise ValueError
    return number


def _of_text(kind: Any, text: str) -> Any:
    """The value of a text as this kind; the text itself if it has none."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        return _of_text(inner[0], text)
    if inner:
        return [_of_text(inner[0], part.strip()) for part in text.removesuffix(",").split(",")]
    if kind is dict:
        return json.loads(text)
    if kind is int and plain_text.is_whole(text.removeprefix("-")):
        return int(text)
    if kind is float and plain_text.is_number(text):
        return float(text)
    return {"true": True, "false": False}.get(text.lower(), text) if kind is bool else text


def _in_words(kind: Any, d: Declared) -> str:
    """The values of a kind, in words: "a number from 0.001 to 90 degrees"."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        return _in_words(inner[0], inner[1])
    if len({*inner}) > 1:
        return " and ".join(_in_words(of, d) for of in inner)
    if inner:
        several = re.sub(r"\ba (whole number|number|file name|word)", r"\1s", _in_words(inner[0], d))
        if typing.get_origin(kind) is tuple:
            return f"{len(inner)} {several}"
        if typing.get_origin(inner[0]) is tuple:
            return f"a list of {several} each"
        lengths = " or ".join(map(str, d.lengths))
        return f"{lengths} {several}" if lengths else f"{several}, rising" if d.rising else several
    if d.words and kind in (str, int):
        return " or ".join(map(repr, d.words)) if len(d.words) < 3 else f"one of {', '.join(map(repr, d.words))}"
    noun = NOUNS.get(kind) or f"an object of the class {kind.__name__}"
    if kind not in (int, float):
        return noun
    multiple = f", a multiple of {d.multiple}" if d.multiple > 1 else ""
    return f"{noun}{_between(d.low, d.high)}{f' {d.unit}' if d.unit else ''}{multiple}"


def _between(low: float, high: float) -> str:
    lowest = "" if low == -math.inf else " above 0" if low == ABOVE_ZERO else f" from {low:g}"
    highest = "" if high == math.inf else " below 1" if high == BELOW_ONE else f" to {high:g}"
    return lowest + (f" up{highest}" if highest and lowest in ("", " above 0") else highest)


def _typed(value: Any) -> str:
    """A value as it is typed on the command line."""
    if isinstance(value, (tuple, list)):
        return ",".join(map(_typed, value))
    if isinstance(value, float):
        return f"{value:g}"
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


@cache
def options(function: Callable) -> dict[str, Option]:
    """The options of a module's `read` or `write`, by name. Raises ParameterError for one without a declaration."""
    where = f"{function.__module__}.{function.__name__}"
    try:
        hints = typing.get_type_hints(function, include_extras=True)
    except (NameError, TypeError, SyntaxError) as error:
        raise ParameterError(f"{where}: a type in its signature cannot be read: {error}; import its name") from None
    first = {"read": 1, "write": 2}[function.__name__]
    return {p.name: _option(p, hints.get(p.name), where) for p in [*signature(function).parameters.values()][first:]}


def _option(parameter: Parameter, hint: Any, where: str) -> Option:
    kind, *metadata = typing.get_args(hint) if hasattr(hint, "__metadata__") else (hint,)
    declared = next((x for x in metadata if isinstance(x, Declared)), None)
    if declared is None or not declared.doc or parameter.default is Parameter.empty:
        raise ParameterError(
            f"{where}: the option {parameter.name} is not declared; expected "
            f'{parameter.name}: Annotated[type, Declared("what it means")] = default'
        )
    kinds = typing.get_args(kind) if isinstance(kind, UnionType) or typing.get_origin(kind) is typing.Union else (kind,)
    return Option(parameter.name, tuple(k for k in kinds if k is not NoneType), parameter.default, declared)


def checked(module: ModuleType, verb: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of options, converted for a format's `verb`, "read" or "write".

    Raises ParameterError for an option that the format has not, or a value that is not allowed.
    """
    declared = options(getattr(module, verb))
    advice = f"; `gonio formats {module.NAME}` lists the options"
    for name in values:
        if name not in declared:
            expected = f"expected one of {', '.join(declared)}{advice}" if declared else "expected none"
            raise ParameterError(f"{name}={shown(values[name])}: no option to {verb} {module.NAME} files; {expected}")
    return {name: declared[name].checked(value, advice) for name, value in values.items()}


def of_texts(module: ModuleType, verb: str, texts: Iterable[str]) -> dict[str, Any]:
    """The options typed as "name=value" on the command line, or "name.key=value" for one entry of an object, checked.

    An entry that is given again becomes a list.
    """
    declared = options(getattr(module, verb))
    values: dict[str, Any] = {}
    for text in texts:
        name, key, value = _parts(text)
        if key:
            entries = values.setdefault(name, {})
            if not isinstance(entries, dict):
                raise ParameterError(f"--option {text!r:.60}: {name} is given twice, expected once")
            entries[key] = [*_items(entries[key]), value] if key in entries else value
            continue
        if name in values:
            raise ParameterError(f"--option {text!r:.60}: {name} is given twice, expected once")
        values[name] = declared[name].of_text(value) if name in declared else value
    return checked(module, verb, values)


def names_in(texts: Iterable[str]) -> set[str]:
    """The names of options typed on the command line."""
    return {_parts(text)[0] for text in texts}


def _parts(text: str) -> tuple[str, str, str]:
    """Name, key and value of "name.key=value"; the key is "" in "name=value"."""
    name, equals, value = (part.strip() for part in text.partition("="))
    name, dot, key = name.partition(".")
    if not equals or not name or (dot and not key):
        raise ParameterError(f"--option {text!r:.60}: expected name=value, such as interpolation=linear")
    return name.replace("-", "_"), key, value
