"""Files that are dropped onto the page: each in a folder of its own, with a name that is safe, up to a size."""

from __future__ import annotations

import contextlib
import itertools
import re
import shutil
from collections.abc import AsyncIterator
from pathlib import Path

from ..errors import ParameterError

MOST_BYTES = 256_000_000
"""Bytes of a file."""

ALL_BYTES = 4 * MOST_BYTES
"""Bytes of all files of a session together."""

LONGEST = 100
"""Characters of a name."""


class UploadError(ParameterError):
    """A file that is too large; `status` is that of HTTP."""

    status = 413


def safe(name: str) -> str:
    """The last part of a name with letters, digits, points, hyphens and underscores alone; its end stays."""
    last = re.split(r"[/\\]", name)[-1]
    kept = re.sub(r"[^A-Za-z0-9._-]+", "_", last).lstrip(".")[-LONGEST:].lstrip(".")
    return kept if kept.strip("._-") else "file"


class Uploads:
    """The files of a session, in a private folder."""

    def __init__(self, folder: Path, most: int = MOST_BYTES, in_all: int = ALL_BYTES):
        self.folder, self.most, self.in_all = folder, most, in_all
        self._numbers = itertools.count(1)
        self._bytes = 0

    def refuse(self, size: int) -> None:
        """UploadError where a file of this size is too large."""
        if size > self.most:
            raise UploadError(
                f"a file of {size} bytes or more, expected at most {self.most // 1_000_000} MB; "
                f"name it on the command line: gonio view FILE"
            )

    async def keep(self, name: str, content: AsyncIterator[bytes]) -> str:
        """Write a file; the text by which the page names it. What is incomplete or too large is removed."""
        number, name = next(self._numbers), safe(name)
        folder = self.folder / str(number)
        size = 0
        try:
            folder.mkdir(mode=0o700)
            with (folder / name).open("xb") as file:
                async for piece in content:
                    size += len(piece)
                    self._bytes += len(piece)
                    self.refuse(size)
                    if self._bytes > self.in_all:
                        raise UploadError(
                            f"more than {self.in_all // 1_000_000} MB of files in all; start gonio view anew, or name "
                            f"files on the command line"
                        )
                    file.write(piece)
        except BaseException:
            self._bytes -= size
            with contextlib.suppress(OSError):
                shutil.rmtree(folder)
            raise
        return f"upload:{number}/{name}"
