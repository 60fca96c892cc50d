"""What the words on a command line stand for: materials, lights and `name=value`."""

from __future__ import annotations

import difflib
import math
import os
import sys
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..catalogue import builtin
from ..catalogue.expressions import describe, expression, names, read
from ..errors import Error, ExpressionError, MissingDataWarning, NotFoundError, ParameterError
from ..formats import formats, load
from ..formula.fields import Option, Param, Part
from ..formula.parametrised import Parametrised
from ..lights._panorama import Panorama
from ..lights.environment import EnvironmentLight
from .light_words import LISTED, WORDS, named

LONGEST = 255
"""Characters of a file's name that similar ones are looked for."""

PICTURES = (".exr", ".hdr", ".png", ".jpg", ".jpeg")


def resolve(text: str) -> Reflectance:
    """What MATERIAL means: what is to be read at this path ("-" is standard input), else the name of a built-in
    material, else an expression."""
    if text == "-":
        if sys.stdin is None:
            raise NotFoundError("-: standard input is closed; lead a file or a pipe to it")
        return load("/dev/stdin")
    if _is_store(text) if os.path.isdir(text) else os.path.exists(text):
        return load(text)
    if builtin.find(text) is not None:
        return builtin.material(text)
    suffixes = {suffix for module in formats() for suffix in module.SUFFIXES}
    if ("(" in text or text in names()) and Path(text).suffix.lower() not in suffixes:
        return expression(text, files=True)
    raise NotFoundError(
        f'{text!r:.90}: no such file, no built-in material, and no expression such as "Lambertian(0.5)"'
        f"{_files_like(text) or builtin.hint(text)}; `gonio materials` lists the built-in ones"
    )


def _is_store(path: str) -> bool:
    return any(module.matches_folder(Path(path)) for module in formats() if hasattr(module, "matches_folder"))


def _files_like(text: str) -> str:
    folder, name = os.path.split(text)
    if os.path.isdir(text):
        return "; it is a directory, and no store that gonio has written"
    if os.path.islink(text):
        return f"; it is a link to {os.readlink(text)!r:.90}, which is not there"
    try:
        close = difflib.get_close_matches(name[:LONGEST], os.listdir(folder or "."), n=1, cutoff=0.8)
    except PermissionError:
        return f"; the directory {folder!r:.90} may not be read"
    except (OSError, ValueError):
        return f"; there is no directory {folder!r:.90}"
    if name in close:
        return f"; it cannot be reached: ask what may be done in the directory {folder or '.'!r:.90}"
    return f"; did you mean {os.path.join(folder, close[0])}?" if close else ""


def resolve_light(text: str) -> Light:
    """What LIGHT means.

    FILE              an environment map, .exr or .hdr
    a word            and numbers, as lights declare them: `FORMS`
    an expression     DistantLight([1, 0, 1], 3), EnvironmentLight("studio.exr", scale=2), ...
    """
    if os.path.isfile(text):
        return _photograph(text)
    if os.path.exists(text) and not os.path.isdir(text):
        raise NotFoundError(f"light {text!r:.90}: a pipe or a device, expected a picture's file; write it to one first")
    word, colon, numbers = text.partition(":")
    word = word.strip().lower()
    if word in WORDS:
        return named(text, word, numbers if colon else None)
    if Path(text).suffix.lower() in PICTURES:
        raise NotFoundError(f"light {text!r:.90}: no such file{_files_like(text)}")
    if "(" in text:
        found = read(text, files=True)
        if not isinstance(found, Light):
            kind = type(found).__name__ if isinstance(found, Parametrised) else describe(found)
            raise ExpressionError(f"light {text!r:.90}: {kind}, expected a light such as ConstantLight(1.0)")
        return found
    close = difflib.get_close_matches(word, WORDS, n=1)
    guess = f"; did you mean {close[0]}?" if close else ";"
    raise NotFoundError(f"light {text!r:.90}: no such file and no such light{guess} expected one of {LISTED}")


def _photograph(path: str) -> Light:
    """An environment map from a file. Resampled photographs often hold values a little below 0: these count as 0 and
    are announced; NaN and infinity are errors."""
    picture = Panorama.of(path)
    least, most = picture.pixels.min(), picture.pixels.max()
    if not (-math.inf < least < 0.0 and most < math.inf):
        return EnvironmentLight(picture)
    negative = sum(int((row < 0.0).any(axis=-1).sum()) for row in picture.pixels)
    count = picture.pixels[..., 0].size
    warnings.warn(
        f"{path}: {negative} of {count} pixels are negative (down to {least:.3g}) and count as 0",
        MissingDataWarning,
        stacklevel=2,
    )
    return EnvironmentLight(picture, invalid="zero")


def with_parameters(m: Reflectance, assignments: Iterable[str]) -> Reflectance:
    """The material with parameters replaced, each given as "name=value".

    A name is a path of `settable`, or its end where that is unique: `alpha` for `1.distribution.alpha`. A
    value is a number, a list (`0.1,0.2,0.3`), a word, or a piece such as `Dielectric(1.4)`.
    """
    changes: dict[str, Any] = {}
    for text in assignments:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise ParameterError(f"-p {text!r:.60}: expected name=value, such as alpha=0.2")
        path = _path(m, name.strip())
        for other in changes:
            if other == path or other.startswith(f"{path}.") or path.startswith(f"{other}."):
                raise ParameterError(f"-p {text!r:.60}: {other} is given already")
        try:
            changes[path] = read(value, words=True, files=True)
        except ExpressionError as error:
            raise ExpressionError(f"-p {name.strip()}: {error}") from None
    try:
        return m.replace(changes) if changes else m
    except Error:
        raise
    except (TypeError, ValueError) as error:
        raise ParameterError(f"-p {', '.join(changes)}: {error}") from None


def _path(m: Reflectance, name: str) -> str:
    paths = []
    for path, declared, _ in m.settable():
        paths.append(path)
        if isinstance(declared, Param) and declared.alias:
            paths.append(path.removesuffix(declared.name) + declared.alias)
    if name in paths:
        return name
    found = [p for p in paths if p.endswith(f".{name}")]
    if len(found) == 1:
        return found[0]
    if found:
        raise ParameterError(f"-p {name}: stands for several parameters; name one of {', '.join(found)}")
    ends = {p.rpartition(".")[2]: p for p in paths}
    close = difflib.get_close_matches(name, [*paths, *ends], n=1)
    guess = f"; did you mean {close[0]}?" if close else ";"
    known = [p for p, declared, _ in m.settable() if isinstance(declared, (Param, Option, Part)) and not p.isdigit()]
    listed = f" expected one of {', '.join(known)}" if known else " this material has none"
    raise NotFoundError(f"-p {name}: no such parameter{guess}{listed}")
