"""Parameters of reflectances and of their pieces: declared in one line each, checked once.

The same line is read by the constructor, `repr`, the manual, the command line, fits and the random tests.
"""

from __future__ import annotations

import inspect
import math
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..arrays import frozen, ops
from ..declared.numbers import NANOMETRES
from ..errors import Error, ParameterError, TooLargeError
from .spectrum import Spectrum, as_wavelengths
from .text import few, shown
from .texture import Texture


@dataclass(frozen=True)
class Parameter:
    """One number (or array) that a material depends on, as `m.parameters` lists it."""

    value: Any
    low: float
    high: float
    doc: str
    unit: str


class Ours(NamedTuple):
    """An array that nobody else holds, such as a reader makes: values keep it without a copy."""

    array: np.ndarray


def kept(value: Any) -> np.ndarray:
    """The numbers of an argument (see `ops.numbers`) as a value keeps them: read-only, and shared with nobody."""
    array = value.array if isinstance(value, Ours) else ops.numbers(value)
    if not isinstance(value, (Ours, list, tuple)):
        try:
            array = np.array(array)
        except MemoryError:
            raise TooLargeError(f"there is no memory for an array of shape {array.shape}") from None
    frozen(array)
    return array


class Field:
    """One declared attribute of a `Parametrised` class."""

    name = ""
    opens_files = False
    """Whether a word is the path of a file, which is opened."""
    is_table = False
    """Whether tables are made of its value: a copy with another one makes them again."""
    accepts = "Any"
    """The annotation of the argument."""
    range = ""
    """The values that it may have, in words."""

    def __init__(self, default: Any, doc: str):
        self.default, self.doc = default, doc

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def check(self, owner: str, value: Any) -> Any:
        """The value as it is stored, or a ParameterError."""
        return value

    @property
    def meaning(self) -> str:
        """Its documentation, with the range."""
        return f"{self.doc}; {self.range}" if self.range else self.doc

    def __repr__(self) -> str:
        return f"<{self.meaning}>"

    def kept(self, value: np.ndarray) -> Any:
        """The numbers of an array that libraries convert once, or a function that gives them."""
        return value

    def traced(self, value: Any) -> Any:
        """The part of a value that traces depend on: a trace holds for arrays of any numbers."""
        return None if isinstance(value, np.ndarray) else value


class Numbers(Field):
    """One whose numbers are arguments of formulas: a number, or an array whose last axis is the channel axis."""

    def traced(self, value: Any) -> int:
        """The number of channels, 0 without a channel axis."""
        shape = () if type(value) is float else np.shape(value)
        return shape[-1] if shape else 0


class Param(Numbers):
    """A real number, or an array of them whose last axis is the channel axis."""

    accepts = "float | Array"

    def __init__(
        self,
        default: Any,
        low: float,
        high: float,
        doc: str,
        unit: str,
        alias: str | None,
        sampled: str,
        fitted: bool,
    ):
        super().__init__(default, doc)
        self.low, self.high, self.unit, self.alias, self.sampled = low, high, unit, alias, sampled
        self.fitted = fitted
        bounds = f"{low:g} to {high:g}" if high < 1e30 else f"at least {low:g}" if low > -1e30 else "any"
        self.range = bounds + (f" [{unit}]" if unit != "1" else "")

    def check(self, owner: str, value: Any) -> Any:
        if type(value) is float:
            if self.low <= value <= self.high and math.isfinite(value):
                return value
        elif type(value) is np.ndarray and value.dtype == np.float64 and value.flags.c_contiguous and value.size > 1:
            low, high = value.min(), value.max()  # NaN, if there is one
            if self.low <= low and high <= self.high and math.isfinite(low) and math.isfinite(high):
                with suppress(MemoryError):  # what follows says so
                    return frozen(value.copy())
        if isinstance(value, (list, tuple, np.ndarray, np.generic, int, float)):
            try:
                array = np.array(ops.numbers(value), dtype=float)
            except (TypeError, ValueError, OverflowError) as error:
                raise self._wrong(owner, value, f"not a number: {error}") from None
            except MemoryError:
                reason = f"there is no memory for {np.size(value)} numbers"
                raise self._wrong(owner, value, reason, TooLargeError) from None
            unmasked = array[~np.ma.getmaskarray(value)] if ops.is_masked(value) else array
            if not np.isfinite(unmasked).all():
                missing = ", for missing places of a map numpy.ma.masked_invalid(map)" if unmasked.ndim else ""
                raise self._wrong(owner, value, "NaN or infinite", cure=missing)
            if unmasked.size == 0:
                raise self._wrong(owner, value, f"no numbers{', all are masked' if array.size else ''}")
            low, high = unmasked.min(), unmasked.max()
            if low < self.low or high > self.high:
                out = float(low if low < self.low else high)
                raise self._wrong(owner, value, f"{out:g} is out of bounds", cure=self._unit_meant(out))
            return float(array) if array.ndim == 0 else frozen(array)
        if isinstance(value, Spectrum):  # numbers only where it is bound: see `at`
            if not self.allows(value.values).any():
                self.check(owner, value.values)
            return value
        if isinstance(value, Texture):
            if outside := value.outside(self.low, self.high):
                raise self._wrong(owner, value, outside)
            return value
        dtype = ops.dtype_of(value)
        if not dtype:
            raise self._wrong(owner, value, f"a {type(value).__name__}")
        if dtype.startswith("complex"):
            raise self._wrong(owner, value, "complex")
        return value  # an array of another library: its values may not be concrete, and reading them may be slow

    def allows(self, values: Any) -> np.ndarray:
        """Where numbers are within the bounds."""
        allowed: np.ndarray = np.logical_and(values >= self.low, values <= self.high)
        return allowed

    def check_at(self, owner: str, values: Any, wavelengths: Any) -> None:
        """Raises ParameterError where those of a spectrum at wavelengths [nm] are out of bounds."""
        outside = np.flatnonzero(~self.allows(np.atleast_1d(values)))
        if outside.size:
            got = f"{np.ravel(values)[outside[0]]:g} at {np.ravel(wavelengths)[outside[0]]:g} nm is out of bounds"
            rule = f"expected {self.low:g} <= {self.name} <= {self.high:g} ({self.doc})"
            raise ParameterError(f"at: {owner}.{self.name}: {got}; {rule}; take other wavelengths of the spectrum")

    def _unit_meant(self, out: float) -> str:
        """The unit that a number out of bounds is likely in, as the end of a message."""
        if self.unit == "rad" and abs(out) <= 360.0:
            return f"; in degrees? numpy.radians({out:g}) = {math.radians(out):.4g}"
        percent = self.unit == "1" and self.low == 0.0 and 1.0 <= self.high <= 2.0 and 2.0 * self.high <= out <= 100.0
        return f"; in percent? {out:g} % is {out / 100.0:g}" if percent else ""

    def _wrong(self, owner: str, value: Any, reason: str, error: type[Error] = ParameterError, cure: str = "") -> Error:
        rule = f"expected a number or an array with {self.low:g} <= {self.name} <= {self.high:g} ({self.doc})"
        return error(f"{owner}({self.name}={shown(value)}): {reason}; {rule}{cure}")


class Option(Field):
    """One of a few words."""

    def __init__(self, default: str, choices: tuple[str, ...], doc: str):
        super().__init__(default, doc)
        self.choices = choices
        words = ", ".join(map(repr, dict.fromkeys(choices)))
        self.range, self.accepts = f"one of {words}", f"Literal[{words}]"

    def check(self, owner: str, value: Any) -> Any:
        if not isinstance(value, str) or value not in self.choices:
            raise ParameterError(f"{owner}({self.name}={shown(value)}): expected {self.range}")
        return value


def _annotation(coerce: Callable[[Any], Any]) -> str:
    """The annotation of a function's first parameter."""
    first = next(iter(inspect.signature(coerce).parameters.values()))
    return "Any" if first.annotation is first.empty else inspect.formatannotation(first.annotation).strip("'")


class Part(Field):
    """A component that is parametrised itself, such as a distribution of normals."""

    def __init__(self, kind: type, default: Any, doc: str, coerce: Callable[[Any], Any] | None, sides: str):
        super().__init__(default, doc)
        self.kind: type[Any] = kind
        self.coerce, self.is_one_sided = coerce, sides == "front"
        self.range = self.accepts = kind.__name__ if coerce is None else _annotation(coerce)

    def check(self, owner: str, value: Any) -> Any:
        if self.coerce is not None and not isinstance(value, self.kind):
            value = self.coerce(value)
        if not isinstance(value, self.kind):
            rule = f"expected a {self.kind.__name__} ({self.doc}): one of {subclasses(self.kind)}"
            raise ParameterError(f"{owner}({self.name}={shown(value)}): {rule}")
        if self.is_one_sided and (rule := value._lit_behind):
            advice = "gn.TwoSided, gn.Sheet and sums take those that transmit"
            raise ParameterError(f"{owner}({self.name}={shown(value)}): {rule} ({self.doc}); {advice}")
        return value


class Table(Field):
    """Fixed numbers of a measurement: no parameter; formulas have them flat, for `ops.take`."""

    accepts = "Array | None"
    is_table = True

    def check(self, owner: str, value: Any) -> Any:
        try:
            return kept(value)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"{owner}({self.name}): {error}; expected numbers ({self.doc})") from None

    def kept(self, value: np.ndarray) -> Any:
        return partial(np.reshape, value, -1)


class Channels(Numbers):
    """The numbers 0, 1, ... of a table's channels, along the channel axis; made from their count."""

    accepts = "int | None"

    def check(self, owner: str, value: Any) -> Any:
        if not isinstance(value, int):
            return value
        if abs(value) > sys.maxsize // 8:  # bytes of a number
            raise MemoryError(f"{owner}({self.name}={shown(value)})")
        return frozen(np.arange(value, dtype=float))


class Wavelengths(Numbers):
    """The wavelength [nm] of each channel, or of a material without channels; None until it is known."""

    accepts = "float | Array | None"
    range = f"at least {NANOMETRES:g} [nm]"

    def check(self, owner: str, value: Any) -> Any:
        if value is None:
            return None
        return as_wavelengths(f"{owner}({self.name}={shown(value)})", value)


def param(
    default: Any,
    low: float,
    high: float,
    doc: str,
    unit: str = "1",
    alias: str | None = None,
    sampled: str = "mean",
    fitted: bool = True,
) -> Any:
    """A parameter with its bounds. A default that names another parameter ties this one to it until it is given.

    `alias`: a keyword that sets this parameter and everything tied to it (`GGX(alpha=0.3)`).
    `sampled`: sampling uses one value for all channels: their "mean", or for the width of a lobe the "max" or "min",
    whichever makes it widest, so that no channel's weights run away.
    `fitted`: False for what those who fit the model keep, such as the shape of a kernel: a fit takes it where `by`
    names it.

    Example
    >>> from gonio.authoring import Reflectance, param
    >>> class Paint(Reflectance):
    ...     "Paint of one albedo."
    ...     rho = param(0.5, 0.0, 1.0, "albedo")
    ...
    ...     def formula(self, wi, wo):
    ...         return self.rho / np.pi
    ...
    >>> print(Paint(0.3).parameters["rho"].value)
    0.3
    """
    return Param(default, low, high, doc, unit, alias, sampled, fitted)


def option(default: str, *choices: str, doc: str) -> Any:
    """A choice between words, the default and others.

    Example
    >>> from gonio.authoring import Reflectance, option, param
    >>> class Paint(Reflectance):
    ...     "Matt paint, dry or wet."
    ...     rho = param(0.5, 0.0, 1.0, "albedo")
    ...     state = option("dry", "wet", doc="wet paint is half as bright")
    ...
    ...     def formula(self, wi, wo):
    ...         return self.rho / np.pi * (0.5 if self.state == "wet" else 1.0)
    ...
    >>> print(gn.albedo(Paint(0.6, state="wet"), [0, 0, 1]).round(3))
    0.3
    """
    return Option(default, tuple(dict.fromkeys((default, *choices))), doc)


def part(kind: type, default: Any, doc: str, coerce: Callable[[Any], Any] | None = None, sides: str = "front") -> Any:
    """A component of the given kind; `coerce` may turn other values (a number) into one.

    A reflectance that transmits is refused, unless the part is declared with `sides="any"`.

    Example
    >>> from gonio.authoring import Fresnel, Reflectance, dot, normalize, part
    >>> class Sheen(Reflectance):
    ...     "Bright where the angle between light and viewer is large."
    ...     fresnel = part(Fresnel, gn.Schlick(0.04), "reflectance")
    ...
    ...     def formula(self, wi, wo):
    ...         return self.fresnel.F(dot(normalize(wi + wo), wo)) / np.pi
    ...
    >>> print(Sheen(gn.Dielectric(1.3)).f_angles(1.4, 0.0, 1.4, [0.0, np.pi]).round(4))
    [0.0054 0.1094]
    """
    return Part(kind, default, doc, coerce, sides)


def table(doc: str) -> Any:
    """Fixed numbers of a measurement.

    Example
    >>> from gonio.authoring import table
    >>> print(table("values at the nodes").doc)
    values at the nodes
    """
    return Table(None, doc)


def channels(doc: str) -> Any:
    """The channel number, as a formula needs it to look up a table with channels.

    Example
    >>> from gonio.authoring import channels
    >>> print(channels("number of the channel").doc)
    number of the channel
    """
    return Channels(None, doc)


def wavelengths(default: float | None = None) -> Any:
    """The wavelength [nm] of the channel: one number to the formula.

    It is unknown until the material is bound, by `m.at(...)` or `wavelengths=`; until then there is no f, or where f
    does without it, it has the default.

    Example
    >>> from gonio.authoring import Reflectance, param, wavelengths
    >>> class Haze(Reflectance):
    ...     "Small particles: blue light is scattered most."
    ...     rho = param(0.5, 0.0, 1.0, "albedo at 400 nm")
    ...     wavelength = wavelengths()
    ...
    ...     def formula(self, wi, wo):
    ...         return self.rho * (400.0 / self.wavelength) ** 4 / np.pi
    ...
    >>> print(gn.albedo(Haze(0.5).at([400.0, 550.0, 700.0]), [0, 0, 1]).round(3))
    [0.5   0.14  0.053]
    """
    return Wavelengths(default, "wavelength")


CLASSES: dict[str, type[Any]] = {}
"""Every public class with parameters, by name: what material expressions and JSON files may name."""


def subclasses(kind: type[Any]) -> str:
    """The names of the classes of a kind, without abstract bases, for messages."""
    return few(name for name, c in CLASSES.items() if issubclass(c, kind) and not c._unwritten())
