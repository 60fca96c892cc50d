"""Arguments of the command line: the materials, lights and parameters that their words stand for."""

from __future__ import annotations

import difflib
import math
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..catalogue.expressions import describe, read
from ..catalogue.typed import as_typed, files_like
from ..declared.typed import in_degrees
from ..errors import ExpressionError, NotFoundError, ParameterError
from ..formats import load_as_typed
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


def layer_of(text: str) -> tuple[str, str | None]:
    """The name of a picture's file, and the layer after a colon behind it, FILE:LAYER, or None."""
    file, colon, layer = text.rpartition(":")
    is_layer = colon and not os.path.exists(text) and os.path.isfile(file) and Path(file).suffix.lower() in SUFFIXES
    return (file, layer) if is_layer else (text, None)


def resolve_light(text: str) -> Light:
    """The light of the argument LIGHT: the file of a picture or a luminaire, a word declared in `lights/` with its
    numbers, or an expression such as DistantLight([1, 0, 1], 3)."""
    by_name = {name: word for word in words() for name in (word.name, *word.aliases) if name[:4] != "FILE"}
    by_suffix = {suffix: word for word in words() for suffix in word.suffixes}
    (photograph,) = (word for word in words() if word.name == "FILE")
    suffix = Path(text).suffix.lower()
    if os.path.isfile(text):
        return by_suffix.get(suffix, photograph).light(text)
    if (parts := layer_of(text))[1] is not None:
        return photograph.light(*parts)
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


ANGLES = ("THETA", "PHI")
"""Numbers of the words for lights that are angles."""


def _numbers(text: str, word: Word) -> list[float]:
    parts = text.split(",")
    names = re.findall(r"[A-Z]+", word.usage.partition(":")[2])
    names += [""] * (len(parts) - len(names))
    try:
        numbers = [
            in_degrees(part) if name in ANGLES else float(part) for name, part in zip(names, parts, strict=False)
        ]
    except ValueError:
        raise ParameterError(f"{text!r:.60} is not a list of numbers; expected {word.usage}") from None
    if not all(map(math.isfinite, numbers)):
        raise ParameterError("NaN or infinite; expected finite numbers")
    return numbers
