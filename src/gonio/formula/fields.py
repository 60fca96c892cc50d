"""Parameters of reflectances and of their pieces: declared in one line each, checked once.

The same line is read by the constructor, `repr`, the manual, the command line, fits and the random tests.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..arrays import frozen, ops
from ..errors import Error, ParameterError, TooLargeError
from .text import few, shown


@dataclass(frozen=True)
class Parameter:
    """One number (or array) that a material depends on, as `m.parameters` lists it."""

    value: Any
    low: float
    high: float
    doc: str
    unit: str


class Ours(NamedTuple):
    """An array that nobody else holds, such as a reader makes: values keep it as it is, where they copy others."""

    array: np.ndarray


def kept(value: Any) -> np.ndarray:
    """The numbers of an argument (see `ops.numbers`) as a value may keep them: read-only, and out of others' reach."""
    if isinstance(value, Ours):
        array = value.array
    else:
        array = ops.numbers(value)
        array = array if isinstance(value, (list, tuple)) else np.array(array)
    frozen(array)
    return array


class Field:
    """One declared attribute of a `Parametrised` class."""

    name = ""
    opens_files = False
    """Whether a word given for it is the path of a file, which is opened."""
    accepts = "Any"
    """The type of what is given for it, as an annotation says it."""
    range = ""
    """Which values it may have, in words."""

    def __init__(self, default: Any, doc: str):
        self.default, self.doc = default, doc

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def check(self, owner: str, value: Any) -> Any:
        """The value as it is stored, or a ParameterError."""
        return value

    def __repr__(self) -> str:
        return f"<{self.doc}{self.range and '; '}{self.range}>"

    def traced(self, value: Any) -> Any:
        """What a trace of a formula depends on in a value of this field: on all of it, but not on arrays."""
        return None if isinstance(value, np.ndarray) else value


class Param(Field):
    """A real number, or an array of them whose last axis is the channel axis."""

    accepts = "float | Array"

    def __init__(self, default: Any, low: float, high: float, doc: str, unit: str, alias: str | None, sampled: str):
        super().__init__(default, doc)
        self.low, self.high, self.unit, self.alias, self.sampled = low, high, unit, alias, sampled
        bounds = f"{low:g} to {high:g}" if high < 1e30 else f"at least {low:g}" if low > -1e30 else "any"
        self.range = bounds + (f" [{unit}]" if unit != "1" else "")

    def check(self, owner: str, value: Any) -> Any:
        if isinstance(value, (list, tuple, np.ndarray, np.generic, int, float)):
            try:
                array = np.array(ops.numbers(value), dtype=float)
            except (TypeError, ValueError, OverflowError) as error:
                raise self._wrong(owner, value, f"not a number: {error}") from None
            except MemoryError:
                what = f"there is no memory for {np.size(value)} numbers"
                raise self._wrong(owner, value, what, TooLargeError) from None
            there = array[~np.ma.getmaskarray(value)] if ops.is_masked(value) else array
            if not np.all(np.isfinite(there)):
                raise self._wrong(owner, value, "NaN or infinite")
            if there.size == 0:
                raise self._wrong(owner, value, f"no numbers{', all are masked' if array.size else ''}")
            if there.min() < self.low or there.max() > self.high:
                got = there.min() if there.min() < self.low else there.max()
                raise self._wrong(owner, value, f"{got:g} is out of bounds")
            return float(array) if array.ndim == 0 else frozen(array)
        library = ops.library_of_type(type(value))
        if library is None:
            raise self._wrong(owner, value, f"a {type(value).__name__}")
        if library.dtype(value).startswith("complex"):
            raise self._wrong(owner, value, "complex")
        return value  # an array of another library: its values may not be concrete, and reading them may be slow

    def traced(self, value: Any) -> int:
        """The number of channels, 0 without a channel axis."""
        shape = () if type(value) is float else np.shape(value)
        return shape[-1] if shape else 0

    def _wrong(self, owner: str, value: Any, what: str, kind: type[Error] = ParameterError) -> Error:
        rule = f"expected a number or an array with {self.low:g} <= {self.name} <= {self.high:g} ({self.doc})"
        return kind(f"{owner}({self.name}={shown(value)}): {what}; {rule}")


class Option(Field):
    """One of a few words."""

    def __init__(self, default: str, choices: tuple[str, ...], doc: str):
        super().__init__(default, doc)
        self.choices = choices
        words = ", ".join(map(repr, dict.fromkeys(choices)))
        self.range, self.accepts = f"one of {words}", f"Literal[{words}]"

    def check(self, owner: str, value: Any) -> Any:
        if not isinstance(value, str) or value not in self.choices:
            listed = ", ".join(map(repr, self.choices))
            raise ParameterError(f"{owner}({self.name}={shown(value)}): expected one of {listed}")
        return value


def _annotation(coerce: Callable[[Any], Any]) -> str:
    """The type of what a function takes, as its first parameter says it."""
    first = next(iter(inspect.signature(coerce).parameters.values()))
    return "Any" if first.annotation is first.empty else inspect.formatannotation(first.annotation).strip("'")


class Part(Field):
    """A component that is parametrised itself, such as a distribution of normals."""

    def __init__(self, kind: type, default: Any, doc: str, coerce: Callable[[Any], Any] | None):
        super().__init__(default, doc)
        self.kind: type[Any] = kind
        self.coerce = coerce
        self.accepts = kind.__name__ if coerce is None else _annotation(coerce)
        self.range = self.accepts

    def check(self, owner: str, value: Any) -> Any:
        if self.coerce is not None and not isinstance(value, self.kind):
            value = self.coerce(value)
        if not isinstance(value, self.kind):
            raise ParameterError(
                f"{owner}({self.name}={shown(value)}): expected a {self.kind.__name__} ({self.doc}): one of "
                f"{few(k for k, c in CLASSES.items() if issubclass(c, self.kind) and not c.unwritten())}"
            )
        return value


class Table(Field):
    """Fixed numbers of a measurement: not a parameter, flat in formulas, ready for `ops.take`."""

    accepts = "Array | None"

    def check(self, owner: str, value: Any) -> Any:
        try:
            return kept(value)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"{owner}({self.name}): {error}; expected numbers ({self.doc})") from None


class Vector(Field):
    """Three numbers in world space; unit vectors are normalised."""

    accepts = "Array"
    range = "three numbers"

    def __init__(self, default: Any, doc: str, unit: bool):
        super().__init__(default, doc)
        self.unit = unit

    def check(self, owner: str, value: Any) -> Any:
        where = f"{owner}({self.name}={shown(value)})"
        try:
            array = np.array(ops.numbers(value), dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise ParameterError(f"{where}: expected three numbers ({self.doc})") from None
        if array.shape != (3,) or not np.all(np.isfinite(array)):
            raise ParameterError(f"{where}: expected three finite numbers ({self.doc})")
        if self.unit:
            length = float(np.linalg.norm(array))
            if length == 0.0:
                raise ParameterError(f"{where}: a vector of length 0 is no direction; expected {self.doc}")
            array = array / length
        return frozen(array)


class Channels(Field):
    """The numbers 0, 1, ... of the channels of a table, along the channel axis; set from the channel count."""

    accepts = "int | None"
    traced = Param.traced

    def check(self, owner: str, value: Any) -> Any:
        return frozen(np.arange(value, dtype=float)) if isinstance(value, int) else value


def param(
    default: Any,
    low: float,
    high: float,
    doc: str,
    unit: str = "1",
    alias: str | None = None,
    sampled: str = "mean",
) -> Any:
    """A parameter with its bounds. A default that names another parameter ties this one to it until it is given.

    `alias`: a keyword that sets this parameter and everything tied to it (`GGX(alpha=0.3)`).
    `sampled`: which of its channels' values sampling uses, which is one for all channels: the "mean", or for the
    width of a lobe the "max" or "min", whichever is the widest, so that no channel's weights run away.
    """
    return Param(default, low, high, doc, unit, alias, sampled)


def option(default: str, *choices: str, doc: str) -> Any:
    """A choice between words, the default and others."""
    return Option(default, tuple(dict.fromkeys((default, *choices))), doc)


def part(kind: type, default: Any, doc: str, coerce: Callable[[Any], Any] | None = None) -> Any:
    """A component of the given kind; `coerce` may turn other values (a number) into one."""
    return Part(kind, default, doc, coerce)


def vector(default: Any, doc: str, unit: bool = False) -> Any:
    """Three numbers in world space, a position or (`unit`) a direction."""
    return Vector(default, doc, unit)


def table(doc: str) -> Any:
    """Fixed numbers of a measurement."""
    return Table(None, doc)


def channels(doc: str) -> Any:
    """The channel number, as a formula needs it to look up a table with channels."""
    return Channels(None, doc)


CLASSES: dict[str, type[Any]] = {}
"""Every public class with parameters, by name: what material expressions and JSON files may name."""
