"""Writing files so that a failure leaves what was there untouched."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .errors import NotFoundError


@contextlib.contextmanager
def replacing(path: str | os.PathLike) -> Iterator[Path]:
    """A temporary file beside `path` to write to; it takes the place of `path` if the block ends well, else it goes.

    Raises NotFoundError if the directory does not exist.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise NotFoundError(f"{target}: the directory {target.parent} does not exist; create it first")
    if target.is_dir():
        raise NotFoundError(f"{target}: is a directory; expected a file name")
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
