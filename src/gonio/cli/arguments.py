"""Arguments of the command line: the materials, lights and parameters that their words stand for."""

from __future__ import annotations

import difflib
import math
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..catalogue.expressions import describe, read
from ..catalogue.typed import as_typed, files_like
from ..errors import Error, ExpressionError, NotFoundError, ParameterError
from ..formats import load_as_typed
from ..formula.fields import Channels, Table
from ..formula.parametrised import Parametrised
from ..lights._words import Word, words
from ..pictures.image import SUFFIXES


def resolve(text: str, reading: Sequence[str] = ()) -> Reflectance:
    """The material of the argument MATERIAL: "-" is standard input, to read with these options; else `as_typed`."""
    if text == "-":
        if sys.stdin is None:
            raise NotFoundError("-: standard input is closed; lead a file or a pipe to it")
        return load_as_typed("/dev/stdin", reading)
    return as_typed(text, reading)


def resolve_light(text: str) -> Light:
    """The light of the argument LIGHT: the file of a picture or a luminaire, a word declared in `lights/` with its
    numbers, or an expression such as DistantLight([1, 0, 1], 3)."""
    by_name = {name: word for word in words() for name in (word.name, *word.aliases) if name[:4] != "FILE"}
    by_suffix = {suffix: word for word in words() for suffix in word.suffixes}
    (photograph,) = (word for word in words() if word.name == "FILE")
    suffix = Path(text).suffix.lower()
    if os.path.isfile(text):
        return by_suffix.get(suffix, photograph).light(text)
    if os.path.exists(text) and not os.path.isdir(text):
        raise NotFoundError(f"light {text!r:.90}: a pipe or a device, expected a file; write it to one first")
    kind, colon, rest = text.partition(":")
    kind = kind.strip().lower()
    if kind in by_name:
        try:
            return by_name[kind].of(_numbers(rest, by_name[kind]) if colon else [])
        except ParameterError as error:
            raise ParameterError(f"light {text!r:.90}: {error}") from None
    if suffix in SUFFIXES or suffix in by_suffix:
        raise NotFoundError(f"light {text!r:.90}: no such file{files_like(text)}")
    if "(" in text:
        value = read(text, files=True)
        if not isinstance(value, Light):
            what = type(value).__name__ if isinstance(value, Parametrised) else describe(value)
            raise ExpressionError(f"light {text!r:.90}: {what}, expected a light such as ConstantLight(1.0)")
        return value
    close = difflib.get_close_matches(kind, by_name, n=1)
    guess = f"; did you mean {close[0]}?" if close else ";"
    usages = ", ".join(word.usage for word in words())
    raise NotFoundError(f"light {text!r:.90}: no such file and no such light{guess} expected one of {usages}")


def _numbers(text: str, word: Word) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise ParameterError(f"{text!r:.60} is not a list of numbers; expected {word.usage}") from None
    if not all(map(math.isfinite, numbers)):
        raise ParameterError("NaN or infinite; expected finite numbers")
    return numbers


def with_parameters(m: Reflectance, assignments: Iterable[str]) -> Reflectance:
    """The material with parameters replaced, each given as "name=value".

    A name is one of `replace`: `alpha`, or a path such as `1.distribution.alpha`. A value is a number, a list
    (`0.1,0.2,0.3`), a word, or a piece such as `Dielectric(1.4)`.
    """
    changes: dict[str, Any] = {}
    for text in assignments:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise ParameterError(f"-p {text!r:.60}: expected name=value, such as alpha=0.2")
        name = name.strip()
        if isinstance(m.fields.get(name), (Table, Channels)):
            raise ParameterError(f"-p {name}: a table of the measurement, expected one of its parameters or words")
        if name in changes:
            raise ParameterError(f"-p {text!r:.60}: {name} is given twice")
        try:
            changes[name] = read(value, words=True, files=True)
        except ExpressionError as error:
            raise ExpressionError(f"-p {name}: {error}") from None
    try:
        return m.replace(changes) if changes else m
    except Error as error:
        raise type(error)(f"-p {', '.join(changes)}: {error}") from None
    except (TypeError, ValueError) as error:
        raise ParameterError(f"-p {', '.join(changes)}: {error}") from None
