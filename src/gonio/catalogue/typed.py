"""Materials by one word, as the command line and scenes of other programs name them."""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ..base.reflectance import Reflectance
from ..declared.typed import in_degrees, typed_angle
from ..errors import Error, ExpressionError, NotFoundError, ParameterError
from ..formats import formats, load_as_typed
from ..formula import tree
from ..formula.fields import Channels, Table
from ..formula.json_form import names
from . import builtin
from .expressions import expression, read

LONGEST = 255
"""Characters of a file's name that are compared with other names."""


def as_typed(text: str, reading: Sequence[str] = ()) -> Reflectance:
    """A material by a word: a path to read with these options, else the name of a built-in one, else an expression,
    which may open files.

    Example
    >>> from gonio.catalogue.typed import as_typed
    >>> print(as_typed("Lambertian(0.5)"), as_typed("gold").channels)
    Lambertian(rho=0.5) 3
    """
    if is_store(text) if os.path.isdir(text) else os.path.exists(text):
        return load_as_typed(text, reading)
    if reading and (builtin.find(text) is not None or "(" in text):
        raise ParameterError(f"-O {reading[0]!r:.60}: options to read a file with, and {text!r:.60} is none")
    if builtin.find(text) is not None:
        return builtin.material(text)
    suffixes = {suffix for module in formats() for suffix in module.SUFFIXES}
    if ("(" in text or text in names()) and Path(text).suffix.lower() not in suffixes:
        return expression(text, files=True)
    raise NotFoundError(
        f'{text!r:.90}: no such file, no built-in material, and no expression such as "Lambertian(0.5)"'
        f"{files_like(text) or builtin.hint(text)}; `gonio materials` lists the built-in ones"
    )


def with_parameters(m: Reflectance, assignments: Iterable[str]) -> Reflectance:
    """The material with parameters replaced, each given as "name=value".

    A name is one of `replace`: `alpha`, or a path such as `1.distribution.alpha`. A value is a number, a list
    (`0.1,0.2,0.3`), a word, or a piece such as `Dielectric(1.4)`; an angle is in radians, or has its unit (`30deg`).
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
        if (angle := _angle(m, name, value)) is not None:
            changes[name] = angle
            continue
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


def _angle(m: Reflectance, name: str, text: str) -> float | None:
    """The number [rad] of an angle that was typed with its unit; None for other texts."""
    try:
        number, unit = typed_angle(text)
    except ParameterError:
        return None
    if not unit:
        return None
    units = set()
    for path, declared, _ in tree.settable(m):
        alias = getattr(declared, "alias", None)
        if name in (path, declared.name, alias, path.removesuffix(declared.name) + (alias or declared.name)):
            units.add(getattr(declared, "unit", ""))
    if units and units != {"rad"}:
        raise ParameterError(f"-p {name}={text.strip()}: {name} is no angle; expected a number without {unit}")
    return number if unit.startswith("rad") else math.radians(in_degrees(text))


def is_store(path: str | Path) -> bool:
    """Whether a folder is a material: a store of a format."""
    return any(module.matches_folder(Path(path)) for module in formats() if hasattr(module, "matches_folder"))


def files_like(text: str) -> str:
    """The end of a message about a file that is not there: what stands in the way, or a name like it."""
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
