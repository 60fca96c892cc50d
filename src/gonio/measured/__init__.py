"""Measured reflectances and their file formats, one file each: `load` recognises a file by its content.

A format's module has NAME, SUFFIXES, DESCRIPTION, `matches(head, size)`, `read(path)` and, where it can be written,
`write(m, path)`; where the format is a folder, also `matches_folder(path)`. It is found by being in this folder.
"""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from .. import discover
from ..errors import FormatError, NotFoundError, ParameterError
from ..interface import Reflectance

HEAD = 4096
"""How many of a file's first bytes `matches` is given."""


@cache
def formats() -> list[ModuleType]:
    """The modules of all file formats."""
    return discover.modules(__name__)


def load(path: str | os.PathLike) -> Reflectance:
    """The reflectance in a file, recognised by content and not by name.

    Raises NotFoundError if there is no such file, FormatError if it is of no known format or damaged.
    """
    path = Path(path)
    if path.is_dir():
        return _load_folder(path)
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(HEAD)
    except FileNotFoundError:
        raise NotFoundError(f"{path}: no such file; `gonio materials` lists the built-in names") from None
    except OSError as error:
        raise NotFoundError(f"{path}: cannot be read: {error.strerror}") from None
    for module in formats():
        if module.matches(head, size):
            return module.read(path)
    known = "; ".join(f"{m.NAME} ({', '.join(m.SUFFIXES)})" for m in formats())
    raise FormatError(f"{path}: not a known format: starts with {head[:16]!r}, {size} bytes; known formats: {known}")


def _load_folder(path: Path) -> Reflectance:
    for module in formats():
        if hasattr(module, "matches_folder") and module.matches_folder(path):
            return module.read(path)
    raise FormatError(f"{path}: a folder of no known format, expected a file, or a folder that gonio.save wrote")


def save(m: Reflectance, path: str | os.PathLike, format: str | None = None, **options: Any) -> None:
    """Write a reflectance to a file; the format is that of the suffix, or the one named.

    `options` are the format's own, see its `write`. A failed or interrupted write leaves an existing file as it was.
    Raises ParameterError where the suffix names no format, or several, and `format` is not given.
    """
    path = Path(path)
    writers = {m.NAME: m for m in formats() if hasattr(m, "write")}
    if format is not None:
        if format not in writers:
            raise ParameterError(f"format={format!r}: expected one of {', '.join(map(repr, writers))}")
        return writers[format].write(m, path, **options)
    named = [
        w for w in writers.values() if path.suffix.lower() in w.SUFFIXES and not getattr(w, "SHARED_SUFFIX", False)
    ]
    if len(named) != 1:
        listed = ", ".join(f"{n!r} ({' '.join(w.SUFFIXES)})" for n, w in writers.items())
        raise ParameterError(
            f"{path}: the suffix {path.suffix!r} does not say which format; give format=, one of {listed}"
        )
    return named[0].write(m, path, **options)
