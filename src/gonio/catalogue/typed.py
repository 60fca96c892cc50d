"""Materials by one word, as the command line and scenes of other programs name them."""

from __future__ import annotations

import difflib
import os
from collections.abc import Sequence
from pathlib import Path

from ..base.reflectance import Reflectance
from ..errors import NotFoundError, ParameterError
from ..formats import formats, load_as_typed
from ..formula.json_form import names
from . import builtin
from .expressions import expression

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
    if _is_store(text) if os.path.isdir(text) else os.path.exists(text):
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


def _is_store(path: str) -> bool:
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
