"""Arguments of public functions, checked by their annotations before the function runs.

    @checked
    def render(m: Reflectance, shape: str = "sphere", size: Annotated[int, Within(1, 16384)] = 512) -> Image: ...

An annotation is a type (bool, int, float, str, a class), a sequence, a mapping or a tuple of such, several with `|`, or
`Annotated` with bounds; `Numbers` is a number, an array or a list. `Any` is left to the function.
"""

from __future__ import annotations

import functools
import inspect
import math
import os
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, TypeVar, cast

import numpy as np

from ..errors import ParameterError, TooLargeError, shown
from .numbers import numbers

F = TypeVar("F", bound=Callable[..., Any])

NOUNS: dict[Any, str] = {
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    str: "a word",
    os.PathLike: "a path",
    Callable: "a function",
}
"""Types in words; classes of gonio have theirs in `noun`."""

UNFIT = (TypeError, ValueError, OverflowError, RecursionError)
"""Errors of conversions of unfit values."""


class Within(NamedTuple):
    """Bounds of every number, in `Annotated[float, Within(0.0, 1.0)]`."""

    low: float
    high: float


class _Real:
    """Marks `Numbers`."""


Numbers = Annotated[Any, _Real]
"""A number, or an array or list of real numbers; the function gets a NumPy array."""


def checked(function: F) -> F:
    """The function, with arguments checked by its annotations: a ParameterError names the one that does not fit."""
    parameters = inspect.signature(function).parameters
    names = [name for name, p in parameters.items() if p.kind is p.POSITIONAL_OR_KEYWORD]
    scope = getattr(function, "__globals__", {})
    kinds = {name: _kind(p.annotation, scope) for name, p in parameters.items() if p.kind is not p.VAR_KEYWORD}
    defaults = {name: p.default for name, p in parameters.items()}
    title = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]

    def fitting(name: str, value: Any) -> Any:
        kind = kinds.get(name, Any)
        if kind is Any or value is defaults.get(name):
            return value
        with suppress(*UNFIT):
            return _fit(kind, value)
        raise ParameterError(f"{title}({name}={shown(value)}): expected {_words(kind)}{_advice(kind, value)}")

    @functools.wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        rest = args[len(names) :]
        args = tuple([fitting(name, value) for name, value in zip(names, args, strict=False)])
        named = {name: fitting(name, value) for name, value in named.items()}
        try:
            return function(*args, *rest, **named)
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


def _fit(kind: Any, value: Any) -> Any:
    """The value as this kind. Raises one of UNFIT for another value."""
    if kind is Any:
        return value
    if hasattr(kind, "__metadata__"):
        (of,), (rule, *_) = typing.get_args(kind)[:1], kind.__metadata__
        return numbers(value) if rule is _Real else _bounded(_fit(of, value), rule)
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is os.PathLike:
        return _fit(os.PathLike, value)
    if origin in (UnionType, typing.Union):
        return _fit_any(inner, value)
    if origin is tuple:
        items = _items(value)
        return tuple(_fit(of, x) for of, x in zip(inner, items, strict=True))
    if origin is Callable or kind is Callable:
        if not callable(value) or hasattr(type(value), "noun"):
            raise TypeError
        return value
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise TypeError
        return {_fit(inner[0], name): _fit(inner[1], x) for name, x in value.items()}
    if origin is not None:
        if isinstance(value, str) and issubclass(origin, Sequence):
            return _fit(inner[0], value)  # a sequence of letters, too: the function says what it means
        return [_fit(inner[0], x) for x in _items(value)]
    if kind in (int, float):
        return _number(kind, value)
    if kind is os.PathLike and isinstance(value, bytes):
        return os.fsdecode(value)
    if not isinstance(value, (bool, np.bool_) if kind is bool else kind):
        raise TypeError
    return bool(value) if kind is bool else value


def _fit_any(kinds: tuple[Any, ...], value: Any) -> Any:
    for kind in kinds:
        with suppress(*UNFIT):
            return _fit(kind, value)
    raise TypeError


def _bounded(value: Any, bounds: Within) -> Any:
    if not bounds.low <= value <= bounds.high:
        raise ValueError
    return value


def _number(kind: type, value: Any) -> Any:
    """A number of this type; NaN is none, and neither are True and False."""
    if hasattr(value, "__array__"):  # a number in an array without axes, of any library
        value = numbers(value)[()]
    whole, real = (int, np.integer), (int, float, np.integer, np.floating)
    if isinstance(value, bool) or not isinstance(value, whole if kind is int else real) or math.isnan(value):
        raise TypeError
    return kind(value)


def _items(value: Any) -> list[Any]:
    """The items of something that has several; of a word or a value itself alone."""
    if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Iterable):
        return [value]
    return list(value)


def _words(kind: Any) -> str:
    """A kind of argument, in words."""
    if hasattr(kind, "__metadata__"):
        of, rule = typing.get_args(kind)[0], kind.__metadata__[0]
        return "numbers" if rule is _Real else f"{_words(of)} from {rule.low:g} to {rule.high:g}"
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is os.PathLike:
        return NOUNS[os.PathLike]
    if origin in (UnionType, typing.Union):
        return " or ".join(dict.fromkeys(_words(of) for of in inner if of is not NoneType))
    if origin is tuple:
        return f"({', '.join(map(_words, inner))})"
    if origin is Callable or kind is Callable:
        return NOUNS[Callable]
    if origin is not None and issubclass(origin, Mapping):
        return f"a dictionary from {_words(inner[0])} to {_words(inner[1])}"
    if origin is not None:
        return f"a list of which each is {_words(inner[0])}"
    if kind is Any:
        return "anything"
    article = "an" if kind.__name__[0] in "AEIOU" else "a"
    return NOUNS.get(kind) or str(getattr(kind, "noun", f"{article} {kind.__name__}"))


def _advice(kind: Any, value: Any) -> str:
    """What to write in the place of a value that is not of a class of gonio, where the class says so."""
    several = typing.get_args(kind) if typing.get_origin(kind) in (UnionType, typing.Union) else (kind,)
    advice = [instead(value) for of in several if (instead := getattr(of, "instead", None)) is not None]
    return f"; {advice[0]}" if advice else ""
