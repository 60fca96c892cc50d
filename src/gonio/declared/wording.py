"""Types and bounds of arguments in words, and what a value that does not fit may have been meant as."""

from __future__ import annotations

import datetime
import math
import os
import re
import typing
from collections.abc import Callable, Mapping
from contextlib import suppress
from fractions import Fraction
from operator import ge, le
from pathlib import Path
from types import NoneType, UnionType
from typing import Any

from ..errors import ParameterError, suggestion
from .declaration import ABOVE_ZERO, BELOW, TYPED, UNFIT, Declared, Real, alternatives, declared_in
from .typed import all_in_degrees
from .values import ANGLES, items

NOUNS: dict[Any, str] = {
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    str: "a word",
    dict: "a JSON object",
    Path: "a file name",
    os.PathLike: "a path",
    "direction": "unit vectors (..., 3)",
    TYPED["direction"][1]: f"a {TYPED['direction'][1]}, such as 45,0",
    Callable: "a function",
    datetime.date: "a date",
}
"""Types in words; classes of gonio have theirs in `_noun`."""


def in_words(kind: Any, d: Declared | None = None, typed: bool = False) -> str:
    """The values of a kind, in words: "a number from 0.001 to 90 degrees"; `typed`: in the units that people type."""
    inner = typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        own = next((x for x in kind.__metadata__ if isinstance(x, Declared)), d)
        declared = own.typed if typed and own is not None else own
        if Real in kind.__metadata__:
            return "numbers" if declared is None else f"numbers{bounds(declared)}"
        return in_words(inner[0], declared, typed)
    origin = typing.get_origin(kind)
    if origin is os.PathLike:
        return NOUNS[os.PathLike]
    if origin in (UnionType, typing.Union):
        return " or ".join(dict.fromkeys(in_words(of, d) for of in inner if of is not NoneType))
    if origin is Callable or kind is Callable:
        return NOUNS[Callable]
    if origin is not None and issubclass(origin, Mapping):
        most = f", at most {d.longest}" if d is not None and d.longest else ""
        return f"a dictionary from {in_words(inner[0])} to {in_words(inner[1])}{most}"
    if origin is not None:
        return _several(origin, inner, d, typed)
    if kind is Any:
        return "anything" if d is None else NOUNS[d.unit] if d.unit in NOUNS else f"numbers{bounds(d)}"
    if d is not None and d.words and kind in (str, int):
        return " or ".join(map(repr, d.words)) if len(d.words) < 3 else f"one of {', '.join(map(repr, d.words))}"
    article = "an" if kind.__name__[0] in "AEIOU" else "a"
    if kind is str and d is not None and d.longest:
        return f"a text of 1 to {d.longest} characters"
    noun = NOUNS.get(kind) or str(getattr(kind, "_noun", f"{article} {kind.__name__}"))
    return noun if d is None or kind not in (int, float) else f"{noun}{bounds(d)}"


def _several(origin: type, inner: tuple[Any, ...], d: Declared | None, typed: bool) -> str:
    """Lists and tuples in words."""
    if d is None:
        each = [in_words(of) for of in inner]
        return f"({', '.join(each)})" if origin is tuple else f"a list of which each is {each[0]}"
    if len({*inner}) > 1:
        return " and ".join(in_words(of, d, typed) for of in inner)
    several = re.sub(r"\ba (whole number|number|file name|word)", r"\1s", in_words(inner[0], d, typed))
    several = re.sub(r"^one of", "some of", several)
    if origin is tuple:
        return f"{len(inner)} {several}"
    if typing.get_origin(inner[0]) is tuple:
        return f"a list of {several} each"
    lengths = " or ".join(map(str, d.lengths)) or (f"1 to {d.longest}" if d.longest else "")
    return f"{lengths} {several}" if lengths else f"{several}, rising" if d.rising else several


def bounds(d: Declared) -> str:
    """Bounds, unit and divisor in words: " from 0 to 90 degrees"."""
    multiple = f", a multiple of {d.multiple}" if d.multiple > 1 else ""
    between = _between(d)
    named = f"[{d.unit}]" if d.unit[:1].isdigit() else d.unit
    unit = "" if d.unit in ("", "share") else f"{'' if d.unit == '%' else ' ' if between else ' in '}{named}"
    return f"{between}{unit}{multiple}"


def _between(d: Declared) -> str:
    low, high = d.low, d.high
    lowest = "" if low == -math.inf else " above 0" if low == ABOVE_ZERO else f" from {_number(low, d.unit, ge)}"
    highest = f" below {_number(BELOW[high], d.unit, le)}" if high in BELOW else f" to {_number(high, d.unit, le)}"
    highest = "" if high == math.inf else highest
    return lowest + (f" up{highest}" if highest and lowest in ("", " above 0") else highest)


def _number(x: float, unit: str, is_within: Callable[[float, float], bool]) -> str:
    """A bound, rounded only to what is within, for those who type what is written; parts of pi by its name."""
    part = Fraction(x / math.pi).limit_denominator(36) if unit == "rad" else Fraction(0)
    if part and math.isclose(part * math.pi, x, rel_tol=1e-14):
        times = {1: "", -1: "-"}.get(part.numerator, f"{part.numerator} ")
        return f"{times}pi{'' if part.denominator == 1 else f'/{part.denominator}'}"
    rounded = () if isinstance(x, int) else (f"{x:g}", f"{x:.12g}")
    return next((text for text in rounded if is_within(float(text), x)), f"{x}")


def as_typed(value: Any, unit: str = "") -> str:
    """A value as it is typed on the command line."""
    if isinstance(value, (tuple, list)):
        return ",".join(as_typed(x, unit) for x in value)
    if isinstance(value, float):
        return f"{value * TYPED.get(unit, (1.0, ''))[0]:g}"
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def swapped(name: str, kind: Any, given: Mapping[str, Any]) -> str:
    """What to say where another argument is what is expected of this one: a model in the place of the data."""
    if not hasattr(kind, "_noun") or hasattr(given[name], "_noun"):  # a class of gonio says what to write instead
        return ""
    others = [other for other, value in given.items() if other != name and isinstance(value, kind)]
    return f"; that is what {others[0]} is: are both in each other's place?" if len(others) == 1 else ""


def advised(kind: Any, value: Any) -> str:
    """What an argument means, and what to write in the place of a value that does not fit."""
    if (declared := declared_in(kind)) is not None:
        return f": {declared.doc}{suspected(value, declared)}"
    advice = [instead(value) for of in alternatives(kind) if (instead := getattr(of, "_instead", None)) is not None]
    return f"; {advice[0]}" if advice else ""


def suspected(value: Any, d: Declared) -> str:
    """What a value beyond its bounds may have been meant as: another word, degrees for radians, percent for a share."""
    with suppress(*UNFIT):
        if d.words:
            return suspected_text(",".join(items(value)), d)
        for number in map(float, items(value)):
            if d.unit == "rad" and max(1.0, 1.001 * d.high) < abs(number) <= 360.0:
                return f"; in degrees? numpy.radians({number:g}) = {math.radians(number):.4g}"
            if d.unit == "share" and d.high < number <= 100.0:
                return f"; in percent? {number:g} % is {number / 100.0:g}"
    return ""


def suspected_text(text: str, d: Declared) -> str:
    """Which word a typed one may have been meant as, of several the first that is none."""
    words = {word.lower(): word for word in d.words if isinstance(word, str)}
    wrong = [part for typed in text[:60].split(",") if (part := typed.strip().lower()) not in words]
    return suggestion(wrong[0], [*words.values()]) if words and wrong else ""


def taken(text: str, d: Declared) -> str:
    """What a typed angle was taken for, where it has a unit; or why it is none."""
    if d.unit not in ANGLES:
        return ""
    try:
        degrees = all_in_degrees(text)
    except ParameterError as error:
        return f": {error}"
    has_unit = any(mark in text.lower() for mark in ("d", "°"))
    return f", which is {', '.join(f'{x:.5g}°' for x in degrees)[:60]}" if has_unit else ""
