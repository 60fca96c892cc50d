"""Writing files so that a failure leaves what was there untouched."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .errors import NotFoundError, ParameterError


@contextlib.contextmanager
def replacing(path: str | os.PathLike) -> Iterator[Path]:
    """A temporary file beside `path` to write to; it takes the place of `path` if the block ends well, else it goes.

    Raises NotFoundError if the directory does not exist.
    """
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise NotFoundError(f"{path}: the directory {target.parent} does not exist; create it first")
    if not os.access(target.parent, os.W_OK):
        raise NotFoundError(f"{path}: the directory {target.parent} may not be written to; choose another")
    if target.is_dir():
        raise ParameterError(f"{path}: is a directory, expected a file name; choose another")
    handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        yield temporary
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
