"""Errors and warnings of gonio. Every error says the rule, the value got, the value expected and the next step."""

import sys
import unicodedata
import warnings
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar


def visible(text: str, keep: str = "") -> str:
    """Text with invisible characters written as in Python, such as \\x1b: control characters, which a terminal obeys,
    marks that turn the direction of writing, halves of characters. `keep`: characters that stay."""
    if text.isprintable():
        return text
    odd = [c for c in {*text} if not (c.isprintable() or c in keep or unicodedata.category(c) == "Zs")]
    return text.translate({ord(c): repr(c)[1:-1] for c in odd}) if odd else text


def suggestion(name: str, names: Iterable[str]) -> str:
    """The end of a message about an unknown name: "; did you mean 'GGX'?", or nothing where no name is alike."""
    from difflib import get_close_matches  # late: messages alone need it

    close = get_close_matches(name, names, n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


REFUSALS = (TypeError, ValueError, ArithmeticError, AttributeError, LookupError, RuntimeError)
"""What objects of others raise where they are not what is asked of them. Not `Exception`: a timeout that a signal
raises must get out."""


def shown(value: object) -> str:
    """The beginning of a value, in one line, for messages."""
    try:
        return f"{' '.join(repr(value[:60] if isinstance(value, (list, tuple)) else value).split()):.60}"
    except REFUSALS:  # an integer of 5000 digits; a list in a list in a list ...; objects of others
        kind = type(value).__name__
        return f"{'an' if kind[:1] in 'aeiouAEIOU' else 'a'} {kind}"


class Error(Exception):
    """Base class of everything gonio raises on bad input. The message is `visible`: files and their names are in it.

    Example
    >>> try:
    ...     gn.Lambertian(1.2)
    ... except gn.Error as error:
    ...     print(type(error).__name__)
    ParameterError
    """

    def __str__(self) -> str:
        return visible(super().__str__(), keep="\n")


class ParameterError(Error, ValueError):
    """A parameter, an option or an argument has a value that is not allowed.

    Example
    >>> try:
    ...     gn.Lambertian(1.2)
    ... except gn.errors.ParameterError as error:
    ...     print(str(error)[:42])
    Lambertian(rho=1.2): 1.2 is out of bounds;
    """


class DirectionError(ParameterError):
    """A direction is no unit vector, or points to where the question has no answer; or an angle is no such angle."""


class ShapeError(Error, ValueError):
    """Array shapes do not fit together.

    Example
    >>> try:
    ...     gn.Lambertian(0.5).f([0.0, 1.0], [0.0, 0.0, 1.0])
    ... except gn.errors.ShapeError as error:
    ...     print(error)
    directions: got shape (2,), expected (..., 3)
    """


class ArrayTypeError(Error, TypeError):
    """An array has the wrong library, dtype or kind, or libraries are mixed in one call."""


class FormatError(Error, ValueError):
    """A file is damaged, or not of the format that it claims.

    Example
    >>> np.zeros(3).tofile("a.binary")
    >>> try:
    ...     gn.load("a.binary", format="MERL")
    ... except gn.errors.FormatError as error:
    ...     print(type(error).__name__)
    FormatError
    """


class NotFoundError(Error, LookupError):
    """A name (material, model, parameter, file) is not known."""


class WriteError(Error, OSError):
    """A file cannot be written: the disk is full, or the system refuses."""


class AccessError(Error, AttributeError):
    """An object has no attribute of this name, or one that cannot be changed."""


class UnwrittenError(Error, NotImplementedError):
    """A class lacks a method that this call needs."""


class ExpressionError(Error, ValueError):
    """A material expression cannot be read."""


class DependencyError(Error, ImportError):
    """An optional library that is needed is not installed."""


class TraceError(Error, TypeError):
    """A formula cannot be traced, and so not be compiled; it still runs on arrays."""


class EngineError(Error, RuntimeError):
    """Nothing can be compiled here; formulas still run on arrays."""


class WorkerError(Error, RuntimeError):
    """A process that computed something ended before it was done."""


class TooLargeError(Error, MemoryError):
    """A result would not fit into this machine's memory."""


def expect_one_of(words: Collection[object], name: str, value: object) -> None:
    """Raises ParameterError for a value that is none of the words."""
    if value not in words:
        raise ParameterError(f"{name}={value!r:.60}: expected one of {', '.join(map(repr, words))}")


@contextmanager
def needed(what: str, cure: str) -> Iterator[None]:
    """Imports within this that fail raise DependencyError: what needs them, and how they are installed."""
    try:
        yield
    except ImportError as error:
        raise DependencyError(f"{what} ({error}); {cure}") from None


@contextmanager
def held_by(where: object) -> Iterator[None]:
    """Within this, a ParameterError about what a file holds is a FormatError, which names the place."""
    try:
        yield
    except ParameterError as error:
        raise FormatError(f"{where}: {error}") from None


class MissingDataWarning(UserWarning):
    """Part of an integral or a picture needed directions that a measurement does not hold."""


class ToleranceWarning(UserWarning):
    """An integral is less exact than its tolerance."""


class DirectionWarning(UserWarning):
    """Directions are likely not what was meant: all of them lie below the horizon, or azimuths look like degrees."""


class MeaningWarning(UserWarning):
    """Numbers are likely not what was meant: percent, micrometres, a map in the place of channels."""


class LeftOutWarning(UserWarning):
    """A result leaves out some of the light: behind a surface, between shiny ones, or what facets scatter twice."""


class FluorescenceWarning(UserWarning):
    """A result has nothing of the light that leaves at another wavelength than it arrived at: no light is known."""


class EngineWarning(UserWarning):
    """Results take longer than necessary: formulas are not compiled, or compiled ones are not kept on disk."""


class WaitingWarning(UserWarning):
    """A call goes on when another run, which writes to the same place, has ended."""


_SAID: ContextVar[set[str] | None] = ContextVar("said", default=None)
"""What has been warned of within a call of many parts."""


@contextmanager
def said_once() -> Iterator[None]:
    """Within this, a warning of a text is given once: for a call that makes many of what warns."""
    before = _SAID.set(set() if _SAID.get() is None else _SAID.get())
    try:
        yield
    finally:
        _SAID.reset(before)


def warn(text: str, category: type[Warning]) -> None:
    """Warns at the line that called gonio, however deep inside the cause is."""
    said = _SAID.get()
    if said is not None:
        if text in said:
            return
        said.add(text)
    package, level = f"{__name__.partition('.')[0]}.", 2
    frame = sys._getframe(1)
    while frame.f_back is not None and f"{frame.f_globals.get('__name__', '')}.".startswith(package):
        frame, level = frame.f_back, level + 1
    warnings.warn(visible(text, keep="\n"), category, stacklevel=level)
