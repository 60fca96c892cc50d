"""Arguments of public functions, readers and writers: declared in the signature, checked before the function runs.

    @checked
    def plan(m: Reflectance, n: Annotated[int, Declared("how many pairs of directions", 1, 200)]) -> Plan: ...

The annotation is a type (bool, int, float, str, a path, a class), a sequence, a mapping or a tuple of such, or several
with `|`; `Numbers` is a number, an array or a list; `Any` is left to the function. `Declared` holds what an argument
means, its bounds and its unit. The errors of the function, its help, its option on the command line and its field in
the explorer are made from it.
"""

from __future__ import annotations

import datetime
import functools
import inspect
import json
import math
import os
import re
import sys
import typing
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, TypeVar, cast

import numpy as np

from ..errors import REFUSALS, ParameterError, TooLargeError, shown, suggestion
from .numbers import numbers
from .typed import all_in_degrees, is_number, is_whole

F = TypeVar("F", bound=Callable[..., Any])

ABOVE_ZERO, BELOW_ONE = sys.float_info.min, math.nextafter(1.0, 0.0)
"""Bounds of numbers that may not be 0, or 1."""

BELOW_HORIZON = math.nextafter(0.5 * math.pi, 0.0)
"""Bound of polar angles that may not be those of the horizon [rad]."""

BELOW = {math.nextafter(x, 0.0): x for x in (1.0, 0.5 * math.pi, 90.0, 100.0)}
"""Bounds of numbers that are below others -> the others; also as typed."""

LARGEST, LONGEST = 1 << 63, 1000
"""Bound below which declared whole numbers are; largest number of characters of a declared word."""

NOUNS: dict[Any, str] = {
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    str: "a word",
    dict: "a JSON object",
    Path: "a file name",
    os.PathLike: "a path",
    "direction": "a unit vector, typed as its polar angle and azimuth in degrees, such as 45,0",
    Callable: "a function",
    datetime.date: "a date",
}
"""Types in words; classes of gonio have theirs in `noun`."""

UNFIT = REFUSALS
"""Errors of conversions of unfit values."""

TYPED = {"rad": (180.0 / math.pi, "degrees"), "share": (100.0, "%")}
"""Units of Python -> how many of the unit that people type they are, and its name."""


class Declared(NamedTuple):
    """The meaning and the bounds of an argument, in `Annotated[type, Declared(...)]`.

    low, high   bounds of every number, in the `unit`
    unit        "rad" is typed in degrees on the command line, "share" (a part of 1) in %, and "direction" as its
                polar angle and azimuth
    words       the only values; text in any case
    lengths     of a Sequence of node counts, one for each axis of a grid, which must fit into memory
    multiple    divisor of whole numbers
    rising      whether a Sequence increases
    longest     characters of a word, items of a list or a mapping; a text of more than 1000 characters may have lines
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
    longest: int = 0
    usual: Any = None

    @property
    def typed(self) -> Declared:
        """The same, in the unit that people type."""
        factor, unit = TYPED.get(self.unit, (1.0, self.unit))
        low, high = (x if x == ABOVE_ZERO else float(f"{BELOW.get(x, x) * factor:.12g}") for x in (self.low, self.high))
        high = math.nextafter(high, 0.0) if self.high in BELOW else high
        return self if factor == 1.0 else self._replace(low=low, high=high, unit=unit)


Seed = Annotated[int, Declared("of the random numbers: the same seed gives the same result", 0, LARGEST - 1)]
"""Where random numbers begin."""


class _Real:
    """Marks `Numbers`."""


Numbers = Annotated[Any, _Real]
"""A number, or an array or list of real numbers; the function gets a NumPy array."""


class Argument(NamedTuple):
    """An argument of a function; `kinds`: the types of its value, None aside."""

    name: str
    kinds: tuple[Any, ...]
    default: Any
    declared: Declared

    @property
    def expected(self) -> str:
        """The allowed values, in words."""
        return ", or ".join(_words(kind, self.declared) for kind in self.kinds)

    @property
    def expected_typed(self) -> str:
        """The allowed values in words, in the units of the command line."""
        return ", or ".join(_words(kind, self.declared.typed) for kind in self.kinds)

    @property
    def usual(self) -> str:
        """The default value, as typed on the command line; "" for none."""
        value = self.declared.usual if self.default is None else self.default
        return "" if value is inspect.Parameter.empty else _typed(value, self.declared.unit)

    @property
    def words(self) -> list[str]:
        """The only values, where there are a few."""
        return [str(word).lower() for word in self.declared.words or ((True, False) if self.kinds == (bool,) else ())]

    @property
    def is_typed(self) -> bool:
        """Whether people can type its values, and none of them names a file."""
        return bool(self.words) or all(_scalar(kind) in (int, float, Any) for kind in self.kinds)

    def checked(self, value: Any, advice: str = "", of: str = "") -> Any:
        """The value, converted. Raises ParameterError, with the call of a function `of` this name."""
        if value is None and self.default is None:
            return None
        for kind in self.kinds:
            with suppress(*UNFIT):
                return _fit(kind, value, self.declared)
        advice = suspected(value, self.declared) + advice
        given = f"{of}({self.name}={shown(value)})" if of else f"{self.name}={shown(value)}"
        raise ParameterError(f"{given}: expected {self.expected}: {self.declared.doc}{advice}")

    def of_text(self, text: str) -> Any:
        """The value typed on the command line; where no kind fits, a value that `checked` refuses."""
        if text.lower() == "none" and self.default is None:
            return None
        value: Any = text
        for kind in self.kinds:
            with suppress(*UNFIT, ParameterError):
                value = _of_text(kind, text, self.declared)
                return _fit(kind, value, self.declared)
        return value

    def checked_text(self, text: str, of: str = "") -> Any:
        """The value of what was typed. Raises ParameterError, in the units of the command line."""
        for kind in self.kinds:
            with suppress(*UNFIT):
                return _fit(kind, _of_text(kind, text, self.declared), self.declared)
        raise ParameterError(f"{of or self.name} {text!r:.60}: expected {self.expected_typed}: {self.declared.doc}")

    def to_json(self) -> dict[str, str]:
        return {"expected": self.expected, "default": self.usual, "doc": self.declared.doc}


@functools.cache
def arguments(function: Callable) -> dict[str, Argument]:
    """The declared arguments of a function, or of the constructor of a class, by name."""
    hinted = hints(function)
    found = {p.name: _argument(p, hinted[p.name]) for p in inspect.signature(function).parameters.values()}
    return {name: argument for name, argument in found.items() if argument is not None}


def hints(function: Callable) -> dict[str, Any]:
    """The types of the parameters of a function, or of the constructor of a class, with what they declare, by name;
    `Any` where only a type checker sees them."""
    signed = inspect.unwrap(attrgetter("__init__")(function) if isinstance(function, type) else function)
    return {p.name: _kind(p.annotation, signed.__globals__) for p in inspect.signature(function).parameters.values()}


def check_fields(value: Any) -> None:
    """Check the declared fields of a frozen dataclass, for its `__post_init__`. Raises ParameterError."""
    kind: Callable = type(value)
    for name, argument in arguments(kind).items():
        object.__setattr__(value, name, argument.checked(getattr(value, name), of=type(value).__name__))


def _argument(parameter: inspect.Parameter, hint: Any) -> Argument | None:
    """A parameter, where it is declared; None in its type stands for its absence."""
    declared = _declared(hint)
    if declared is None:
        return None
    kinds = tuple(kind for of in _alternatives(hint) for kind in _alternatives(of) if kind is not NoneType)
    return Argument(parameter.name, kinds, parameter.default, declared)


def _alternatives(kind: Any) -> tuple[Any, ...]:
    """The kinds of `Annotated[A | B, ...]` and of `A | B`, else the kind alone."""
    inner = typing.get_args(kind)[0] if hasattr(kind, "__metadata__") and _Real not in kind.__metadata__ else kind
    return typing.get_args(inner) if typing.get_origin(inner) in (UnionType, typing.Union) else (inner,)


def checked(function: F) -> F:
    """The function, with arguments checked by its annotations: a ParameterError names the one that does not fit."""
    parameters = inspect.signature(function).parameters
    names = [name for name, p in parameters.items() if p.kind is p.POSITIONAL_OR_KEYWORD]
    scope = getattr(function, "__globals__", {})
    kinds = {name: _kind(p.annotation, scope) for name, p in parameters.items() if p.kind is not p.VAR_KEYWORD}
    defaults = {name: p.default for name, p in parameters.items()}
    title = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]

    def fitting(name: str, value: Any, args: tuple[Any, ...], named: dict[str, Any]) -> Any:
        kind = kinds.get(name, Any)
        if kind is Any or value is defaults.get(name):
            return value
        with suppress(*UNFIT):
            return _fit(kind, value)
        advice = _swapped(name, kind, dict(zip(names, args, strict=False)) | named) or _advice(kind, value)
        raise ParameterError(f"{title}({name}={shown(value)}): expected {_words(kind)}{advice}")

    @functools.wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        rest = args[len(names) :]
        fit = tuple([fitting(name, value, args, named) for name, value in zip(names, args, strict=False)])
        named = {name: fitting(name, value, args, named) for name, value in named.items()}
        try:
            return function(*fit, *rest, **named)
        except TooLargeError:
            raise
        except MemoryError as error:
            raise TooLargeError(f"{title}: {str(error) or 'not enough memory'}; ask for less at a time") from None
        except RuntimeError as error:
            if "allocate memory" not in str(error):  # PyTorch's words
                raise
            raise TooLargeError(f"{title}: not enough memory; ask for less at a time") from None

    return cast(F, call)


def _kind(annotation: Any, scope: dict[str, Any]) -> Any:
    """The type that an annotation means; `Any` where only a type checker sees it."""
    if not isinstance(annotation, str):
        return Any if annotation is inspect.Parameter.empty else annotation
    try:
        return eval(annotation, scope)
    except NameError:
        return Any


def _fit(kind: Any, value: Any, d: Declared | None = None) -> Any:
    """The value as this kind. Raises one of UNFIT for another value."""
    if kind is Any:
        return value
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        declared = next((x for x in kind.__metadata__ if isinstance(x, Declared)), d)
        return _within(numbers(value), declared) if _Real in kind.__metadata__ else _fit(inner[0], value, declared)
    origin = typing.get_origin(kind)
    if origin is os.PathLike:
        return _fit(os.PathLike, value, d)
    if origin in (UnionType, typing.Union):
        for one in inner:
            with suppress(*UNFIT):
                return _fit(one, value, d)
        raise TypeError
    if origin is Callable or kind is Callable:
        if not callable(value) or hasattr(type(value), "noun"):
            raise TypeError
        return value
    if origin is tuple:
        return tuple(_fit(of, x, d) for of, x in zip(inner, _items(value, d), strict=True))
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping) or (d is not None and d.longest and len(value) > d.longest):
            raise TypeError
        return {_fit(inner[0], name): _fit(inner[1], x) for name, x in value.items()}
    if origin is not None:
        if isinstance(value, str) and issubclass(origin, Sequence) and d is None:
            return _fit(inner[0], value)  # a sequence of letters, too: the function says what it means
        return _counted([_fit(inner[0], x, d) for x in _items(value, d)], d)
    if kind in (int, float):
        return _number(kind, value, d)
    if kind is Path:
        return Path(_fit(str, os.fspath(value), d))
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


def _items(value: Any, d: Declared | None = None) -> list[Any]:
    """The items of something that has several, where it is declared a list, a tuple or an array; else itself."""
    if hasattr(value, "__array__"):
        array = value if isinstance(value, np.ndarray) and d is None else numbers(value)
        return list(value if d is None else array.tolist()) if array.ndim else [value]
    kinds = Iterable if d is None else (list, tuple, range)
    return list(value) if isinstance(value, kinds) and not isinstance(value, (str, bytes, Mapping)) else [value]


def _of_text(kind: Any, text: str, d: Declared) -> Any:
    """The value of a text as this kind, in the unit of Python; the text itself if it has none."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        return _of_text(inner[0], text, next((x for x in kind.__metadata__ if isinstance(x, Declared)), d))
    if kind is Any and d.unit == "direction":
        theta, phi = map(math.radians, all_in_degrees(text))
        return np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
    if kind is Any:
        values = _of_text(Sequence[float], text, d)
        _within(np.array(values, dtype=float), d)
        return values[0] if len(values) == 1 else values
    if inner:
        text = text.removesuffix(",")
        if d.unit == "rad":
            return [math.radians(x) for x in all_in_degrees(text)]
        return [_of_text(inner[0], part.strip(), d) for part in text.split(",")]
    if kind is dict:
        return json.loads(text)
    if kind is int and is_whole(text.removeprefix("-")):
        return int(text)
    if kind is float and d.unit == "rad":
        (degrees,) = all_in_degrees(text)
        return math.radians(degrees)
    if kind is float and d.unit == "share" and is_number(text.removesuffix("%").strip()):
        return float(text.removesuffix("%")) / 100.0
    if kind is float and is_number(text):
        return float(text)
    return {"true": True, "false": False}.get(text.lower(), text) if kind is bool else text


def _words(kind: Any, d: Declared | None = None) -> str:
    """The values of a kind, in words: "a number from 0.001 to 90 degrees"."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        declared = d or next((x for x in kind.__metadata__ if isinstance(x, Declared)), None)
        if _Real in kind.__metadata__:
            return "numbers" if declared is None else f"numbers{bounds(declared)}"
        return _words(inner[0], declared)
    origin = typing.get_origin(kind)
    if origin is os.PathLike:
        return NOUNS[os.PathLike]
    if origin in (UnionType, typing.Union):
        return " or ".join(dict.fromkeys(_words(of, d) for of in inner if of is not NoneType))
    if origin is Callable or kind is Callable:
        return NOUNS[Callable]
    if origin is not None and issubclass(origin, Mapping):
        most = f", at most {d.longest}" if d is not None and d.longest else ""
        return f"a dictionary from {_words(inner[0])} to {_words(inner[1])}{most}"
    if origin is not None:
        return _several(origin, inner, d)
    if kind is Any:
        return "anything" if d is None else NOUNS[d.unit] if d.unit in NOUNS else f"numbers{bounds(d)}"
    if d is not None and d.words and kind in (str, int):
        return " or ".join(map(repr, d.words)) if len(d.words) < 3 else f"one of {', '.join(map(repr, d.words))}"
    article = "an" if kind.__name__[0] in "AEIOU" else "a"
    if kind is str and d is not None and d.longest:
        return f"a text of 1 to {d.longest} characters"
    noun = NOUNS.get(kind) or str(getattr(kind, "noun", f"{article} {kind.__name__}"))
    return noun if d is None or kind not in (int, float) else f"{noun}{bounds(d)}"


def _several(origin: type, inner: tuple[Any, ...], d: Declared | None) -> str:
    """Lists and tuples in words."""
    if d is None:
        each = [_words(of) for of in inner]
        return f"({', '.join(each)})" if origin is tuple else f"a list of which each is {each[0]}"
    if len({*inner}) > 1:
        return " and ".join(_words(of, d) for of in inner)
    several = re.sub(r"\ba (whole number|number|file name|word)", r"\1s", _words(inner[0], d))
    if origin is tuple:
        return f"{len(inner)} {several}"
    if typing.get_origin(inner[0]) is tuple:
        return f"a list of {several} each"
    lengths = " or ".join(map(str, d.lengths)) or (f"1 to {d.longest}" if d.longest else "")
    return f"{lengths} {several}" if lengths else f"{several}, rising" if d.rising else several


def bounds(d: Declared) -> str:
    """Bounds, unit and divisor in words: " from 0 to 90 degrees"."""
    multiple = f", a multiple of {d.multiple}" if d.multiple > 1 else ""
    between = _between(d.low, d.high)
    unit = "" if d.unit in ("", "share") else f"{'' if d.unit == '%' else ' ' if between else ' in '}{d.unit}"
    return f"{between}{unit}{multiple}"


def _between(low: float, high: float) -> str:
    lowest = "" if low == -math.inf else " above 0" if low == ABOVE_ZERO else f" from {low:g}"
    highest = "" if high == math.inf else f" below {BELOW[high]:g}" if high in BELOW else f" to {high:g}"
    return lowest + (f" up{highest}" if highest and lowest in ("", " above 0") else highest)


def _typed(value: Any, unit: str = "") -> str:
    """A value as it is typed on the command line."""
    if isinstance(value, (tuple, list)):
        return ",".join(_typed(x, unit) for x in value)
    if isinstance(value, float):
        return f"{value * TYPED.get(unit, (1.0, ''))[0]:g}"
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _scalar(kind: Any) -> Any:
    """The kind of the numbers or words of a kind, where all are of one."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__") or typing.get_origin(kind) is Sequence:
        return _scalar(inner[0])
    return _scalar(inner[0]) if typing.get_origin(kind) is tuple and len({*inner}) == 1 else kind


def _declared(kind: Any) -> Declared | None:
    """The declaration in a kind, or in one of its alternatives."""
    metadata = [x for of in (kind, *_alternatives(kind)) for x in getattr(of, "__metadata__", ())]
    return next((x for x in metadata if isinstance(x, Declared)), None)


def _swapped(name: str, kind: Any, given: Mapping[str, Any]) -> str:
    """What to say where another argument is what is expected of this one: a model in the place of the data."""
    if not hasattr(kind, "noun") or hasattr(given[name], "noun"):  # a class of gonio says what to write instead
        return ""
    others = [other for other, value in given.items() if other != name and isinstance(value, kind)]
    return f"; that is what {others[0]} is: are both in each other's place?" if len(others) == 1 else ""


def _advice(kind: Any, value: Any) -> str:
    """What an argument means, and what to write in the place of a value that does not fit."""
    if (declared := _declared(kind)) is not None:
        return f": {declared.doc}{suspected(value, declared)}"
    advice = [instead(value) for of in _alternatives(kind) if (instead := getattr(of, "instead", None)) is not None]
    return f"; {advice[0]}" if advice else ""


def suspected(value: Any, d: Declared) -> str:
    """What a value beyond its bounds may have been meant as: another word, degrees for radians, percent for a share."""
    if d.words and isinstance(value, str):
        return suggestion(value[:60], list(map(str, d.words)))
    with suppress(*UNFIT):
        for number in map(float, _items(value)):
            if d.unit == "rad" and max(1.0, d.high) < abs(number) <= 360.0:
                return f"; in degrees? numpy.radians({number:g}) = {math.radians(number):.4g}"
            if d.unit == "share" and d.high < number <= 100.0:
                return f"; in percent? {number:g} % is {number / 100.0:g}"
    return ""
