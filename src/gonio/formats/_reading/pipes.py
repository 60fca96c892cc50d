"""Paths of files, folders and pipes: a pipe, which can be read once, is read from a private copy."""

from __future__ import annotations

import contextlib
import os
import re
import select
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...errors import Error, FormatError, NotFoundError, ParameterError

LIMIT = 1 << 32
"""Most bytes (4 GiB) that are read from a pipe; half of the free disk space if that is less."""

PATIENCE = 5.0
"""Seconds that a pipe may wait for its first writer."""

_KINDS = {
    stat.S_ISCHR: "a terminal or another character device",
    stat.S_ISBLK: "a block device",
    stat.S_ISSOCK: "a socket",
}


def named(path: Any) -> Path:
    """A path given as text, bytes or `os.PathLike`. Raises ParameterError for anything else, and for a NUL in it."""
    try:
        name = os.fsdecode(path)
    except TypeError:
        raise ParameterError(f"{path!r:.60}: a {type(path).__name__}, expected the path of a file") from None
    if "\0" in name:
        raise ParameterError(f"{name!r:.60}: a path with a NUL character in it; expected the path of a file")
    return Path(name)


def shown(path: Path) -> str:
    """A path in a message: as it is, or the start of its repr if it is long or cannot be printed."""
    text = str(path)
    return text if len(text) <= 1000 and text.isprintable() else f"{text[:200]!r}{'...' * (len(text) > 200)}"


@contextlib.contextmanager
def readable(path: Path) -> Iterator[Path]:
    """`path` itself for a file or a folder; for a pipe a copy of its content, which lasts as long as the block.

    Waits for the writer of a pipe, as `cat` does, and `PATIENCE` for its beginning. Messages of the block name `path`,
    not the copy. Raises NotFoundError where there is nothing to read, FormatError where a pipe holds too much.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise NotFoundError(f"{shown(path)}: no such file{_meant(path)}") from None
    except (OSError, ValueError) as error:
        raise NotFoundError(f"{shown(path)}: cannot be read: {_why(error)}") from None
    for is_kind, kind in _KINDS.items():
        if is_kind(mode):
            raise NotFoundError(f"{shown(path)}: {kind}, expected a file, a folder or a pipe")
    if not stat.S_ISFIFO(mode):
        try:
            yield path
        except OSError as error:  # gone, or taken away, since
            if error.errno is None:  # a timeout of the caller's, say
                raise
            raise NotFoundError(f"{shown(path)}: cannot be read: {_why(error)}") from None
        return
    with tempfile.TemporaryDirectory(prefix="gonio-pipe-", ignore_cleanup_errors=True) as folder:
        copy = Path(folder) / path.name
        try:
            _drain(path, copy)
            yield copy
        except Error as error:
            raise type(error)(str(error).replace(str(copy), shown(path))) from None


def _meant(path: Path) -> str:
    """What to write in place of something that is no path: the end of a message."""
    text = str(path)
    if re.match(r"[a-z][a-z0-9+]+:/", text):
        url = text.replace(":/", "://", 1)
        return f"; download it first: urllib.request.urlretrieve({url!r:.200}, {path.name!r:.100})"
    if "(" in text:
        return f"; for a material expression gn.expression({text!r:.100})"
    if len(path.parts) == 1 and not path.suffix:
        return f"; for a built-in material gn.material({text!r:.100}); `gonio materials` lists the built-in names"
    return "; `gonio materials` lists the built-in names"


def _why(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error).replace("\n", " ")


def _drain(path: Path, copy: Path) -> None:
    """Copy the content of a pipe to a file."""
    room = min(LIMIT, shutil.disk_usage(copy.parent).free // 2)
    try:
        pipe = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # or opening waits for a writer
    except OSError as error:
        raise NotFoundError(f"{shown(path)}: cannot be read: {_why(error)}") from None
    try:
        with copy.open("xb") as file:
            for piece in _pieces(pipe, path):
                if file.tell() + len(piece) > room:
                    raise FormatError(
                        f"{shown(path)}: more than {room} bytes come out of this pipe, as much as is kept of one in "
                        f"{copy.parent.parent}; write them to a file and load that"
                    )
                file.write(piece)
    except OSError as error:
        raise FormatError(
            f"{shown(path)}: what comes out of this pipe cannot be kept in {copy.parent.parent}: {_why(error)}; "
            f"write it to a file and load that, or set TMPDIR to a folder with room"
        ) from None
    finally:
        os.close(pipe)


def _pieces(pipe: int, path: Path) -> Iterator[bytes]:
    has_writer, events = False, select.poll()
    events.register(pipe, select.POLLIN)
    while True:
        try:
            piece = os.read(pipe, 1 << 20)
        except BlockingIOError:  # a writer has it open, and has not written yet
            has_writer = True
            events.poll()
            continue
        if piece:
            yield piece
        elif has_writer:
            return
        elif not events.poll(PATIENCE * 1000.0):
            raise NotFoundError(f"{shown(path)}: a pipe that nobody writes to; start what writes to it first")
        has_writer = True
