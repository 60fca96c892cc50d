"""Options of readers and writers: declared in the signature of `read` and `write`, checked and listed here.

    def write(m: Reflectance, path: Path, nodes: Annotated[int, Declared("cosines of either sign", 4, 2048)] = 64): ...

The type is bool, int, float, str, Path, dict (JSON) or another class; a tuple of so many, a Sequence of any number, or
several of these with `|`. `Declared` says the bounds and the meaning. A default of None: the option may be left out.
"""

from __future__ import annotations

import contextlib
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
"""Whole numbers are smaller, and words have at most so many characters."""

NOUNS = {bool: "true or false", int: "a whole number", float: "a number", str: "a word", Path: "a file name"}
NOUNS |= {dict: "a JSON object"}
UNFIT = (TypeError, ValueError, OverflowError, RecursionError, KeyError)
"""Errors of conversions of unfit values."""


class Declared(NamedTuple):
    """The meaning and the bounds of an option, in `Annotated[type, Declared(...)]`.

    low, high   bounds of every number, in the `unit`
    words       the only values; those that are text, in any case
    lengths     of a Sequence: it holds the nodes along each axis of a grid, which must fit into memory
    multiple    whole numbers are multiples of it
    rising      a Sequence increases
    usual       what a default of None stands for
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
    """An option of a reader or a writer; `kinds`: the types that its value may have, None aside."""

    name: str
    kinds: tuple[Any, ...]
    default: Any
    declared: Declared

    @property
    def expected(self) -> str:
        """The values it may have, in words."""
        return ", or ".join(_in_words(kind, self.declared) for kind in self.kinds)

    @property
    def usual(self) -> str:
        """The value it has where it is not given, as typed on the command line; "" for none."""
        return _typed(self.declared.usual if self.default is None else self.default)

    def checked(self, value: Any, advice: str = "") -> Any:
        """The value as a reader or a writer takes it. Raises ParameterError; TooLargeError for too large a grid."""
        if value is None and self.default is None:
            return None
        for kind in self.kinds:
            with contextlib.suppress(*UNFIT):
                taken = _taken(kind, value, self.declared)
                break
        else:
            raise ParameterError(f"{self.name}={shown(value)}: expected {self.expected}: {self.declared.doc}{advice}")
        if self.declared.lengths:
            fits(math.prod(taken), f"{self.name}={shown(value)}")
        return taken

    def of_text(self, text: str) -> Any:
        """The value of a text of the command line, or what `checked` refuses where it is none of this option."""
        if text.lower() == "none" and self.default is None:
            return None
        meant: Any = text
        for kind in self.kinds:
            with contextlib.suppress(*UNFIT):
                meant = _of_text(kind, text)
                return _taken(kind, meant, self.declared)
        return meant

    def to_json(self) -> dict[str, str]:
        return {"expected": self.expected, "default": self.usual, "doc": self.declared.doc}


def _taken(kind: Any, value: Any, d: Declared) -> Any:
    """The value as this kind. Raises one of UNFIT where it is none."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        return _taken(inner[0], value, inner[1])
    if typing.get_origin(kind) is tuple:
        return tuple(_taken(of, x, d) for of, x in zip(inner, _items(value), strict=True))
    if inner:
        return _sequence(tuple(_taken(inner[0], x, d) for x in _items(value)), d)
    if kind in (int, float):
        return _number(kind, value, d)
    if kind is Path:
        return Path(_taken(str, os.fspath(value), d))
    if not isinstance(value, (bool, np.bool_) if kind is bool else kind):
        raise TypeError
    if isinstance(value, str):
        return _word(value, d)
    if isinstance(value, dict):
        json.dumps(value, ensure_ascii=False, allow_nan=False).encode()
    return bool(value) if kind is bool else value


def _items(value: Any) -> list[Any]:
    """The items of a list, a tuple or an array of any library; anything else is the only one."""
    if isinstance(value, (list, tuple, range)):
        return list(value)
    return list(ops.numbers(value).tolist()) if hasattr(value, "__array__") and np.ndim(value) else [value]


def _sequence(values: tuple, d: Declared) -> tuple:
    fitting = len(values) in d.lengths if d.lengths else len(values) > 0
    if not fitting or (d.rising and not all(a < b for a, b in pairwise(values))):
        raise ValueError
    return values


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


def _word(value: str, d: Declared) -> str:
    if not value.isprintable() or len(value) > LONGEST:
        raise ValueError
    return {word.lower(): word for word in d.words}[value.lower()] if d.words else value


def _of_text(kind: Any, text: str) -> Any:
    """The value of a text as this kind; the text itself where it has none."""
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
        several = re.sub(r"\ba (whole number|number|file name)", r"\1s", _in_words(inner[0], d))
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
    """The options of a module's `read` or `write`, by name. Raises ParameterError where one is not declared."""
    where = f"{function.__module__}.{function.__name__}"
    try:
        hints = typing.get_type_hints(function, include_extras=True)
    except (NameError, TypeError, SyntaxError) as error:
        raise ParameterError(f"{where}: a type in its signature cannot be read: {error}; import its name") from None
    first = {"read": 1, "write": 2}[function.__name__]
    taken = list(signature(function).parameters.values())[first:]
    return {p.name: _declared(p, hints.get(p.name), where) for p in taken}


def _declared(parameter: Parameter, hint: Any, where: str) -> Option:
    kind, *said = typing.get_args(hint) if hasattr(hint, "__metadata__") else (hint,)
    declared = next((x for x in said if isinstance(x, Declared)), None)
    if declared is None or not declared.doc or parameter.default is Parameter.empty:
        raise ParameterError(
            f"{where}: the option {parameter.name} is not declared; expected "
            f'{parameter.name}: Annotated[type, Declared("what it means")] = default'
        )
    kinds = typing.get_args(kind) if isinstance(kind, UnionType) or typing.get_origin(kind) is typing.Union else (kind,)
    return Option(parameter.name, tuple(k for k in kinds if k is not NoneType), parameter.default, declared)


def checked(module: ModuleType, does: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """The options given to "read" or "write" a format, as its module takes them.

    Raises ParameterError for an option that it has not, or of a value that this may not have.
    """
    known = options(getattr(module, does))
    advice = f"; `gonio formats {module.NAME}` lists the options"
    for name in given:
        if name not in known:
            expected = f"expected one of {', '.join(known)}{advice}" if known else "expected none"
            raise ParameterError(f"{name}={shown(given[name])}: no option to {does} {module.NAME} files; {expected}")
    return {name: known[name].checked(value, advice) for name, value in given.items()}


def of_texts(module: ModuleType, does: str, texts: Iterable[str]) -> dict[str, Any]:
    """The options typed as "name=value" on the command line, checked."""
    known = options(getattr(module, does))
    given: dict[str, Any] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        name = name.replace("-", "_")
        if not equals or not name:
            raise ParameterError(f"--option {text!r:.60}: expected name=value, such as interpolation=linear")
        if name in given:
            raise ParameterError(f"--option {text!r:.60}: {name} is given twice, expected once")
        given[name] = known[name].of_text(value) if name in known else value
    return checked(module, does, given)
