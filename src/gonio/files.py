"""Writing files so that a failure leaves what was there untouched."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .errors import NotFoundError, ParameterError


def target(path: str | os.PathLike) -> Path:
    """Where a file of this name is written to, links followed.

    Raises NotFoundError or ParameterError where it cannot be: work that takes long asks this first.
    """
    found = Path(os.path.realpath(path))
    if not found.parent.is_dir():
        raise NotFoundError(f"{path}: the directory {found.parent} does not exist; create it first")
    if not os.access(found.parent, os.W_OK):
        raise NotFoundError(f"{path}: the directory {found.parent} may not be written to; choose another")
    if found.is_dir():
        raise ParameterError(f"{path}: is a directory, expected a file name; choose another")
    return found


@contextlib.contextmanager
def replacing_folder(path: str | os.PathLike) -> Iterator[Path]:
    """As `replacing`, for a folder and what is in it. A folder that was there goes only once the new one is complete.

    Raises what `target` raises, ParameterError where there is a file of this name.
    """
    final = Path(os.path.realpath(path))
    if final.exists() and not final.is_dir():
        raise ParameterError(f"{path}: is a file, expected a folder or nothing; choose another name, or remove it")
    target(final.parent / f".{final.name}")
    with tempfile.TemporaryDirectory(prefix=f".{final.name}-", dir=final.parent) as beside:
        new, old = Path(beside) / "new", Path(beside) / "old"
        new.mkdir()
        yield new
        if final.exists():
            os.replace(final, old)
        os.replace(new, final)


@contextlib.contextmanager
def replacing(path: str | os.PathLike) -> Iterator[Path]:
    """A temporary file beside `path` to write to; it replaces `path` if the block ends well, else it goes.

    Raises what `target` raises.
    """
    final = target(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{final.stem}-", suffix=final.suffix, dir=final.parent)
    except OSError as error:
        raise NotFoundError(f"{path}: no file can be made in {final.parent}: {error.strerror}") from None
    os.close(handle)
    temporary = Path(name)
    try:
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        yield temporary
        os.replace(temporary, final)
    finally:
        temporary.unlink(missing_ok=True)
