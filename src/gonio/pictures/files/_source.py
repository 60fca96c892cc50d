"""Shared by the formats of pictures: a file that is read, the picture in it, and limits on its size."""

from __future__ import annotations

import importlib
import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import DependencyError, FormatError, MissingDataWarning, NotFoundError, ShapeError, TooLargeError, warn

DENSE = 2**14
"""Pixels that a byte may stand for: one colour, 8192 x 4096, comes to 8089 as 1-bit PNG."""

_BESIDE = 6  # bytes a pixel that libraries take beside their results
_BLOCK = 1 << 18  # pixels that are converted at a time


class Picture(NamedTuple):
    """Linear pixels (H, W, C), coverage (H, W), names of the channels (R, G, B first), and primaries, if known, as in
    `colour.SRGB_XY`."""

    pixels: NDArray[np.float32]
    alpha: NDArray[np.float32] | None = None
    names: tuple[str, ...] | None = None
    primaries: tuple[float, ...] | None = None

    def over_black(self) -> NDArray[np.float32]:
        """The pixels times their coverage."""
        return self.pixels if self.alpha is None else self.pixels * self.alpha[..., None]

    def gray_or_rgb(self, path: str) -> NDArray[np.float32]:
        """The pixels; raises ShapeError where they are neither."""
        if (count := self.pixels.shape[2]) in (1, 3):
            return self.pixels
        raise ShapeError(f"{path}: {count} channels, expected 1 or 3; pick some of them, or write .exr")


@dataclass(frozen=True, slots=True)
class Source:
    """A picture's open file; its name, its size in bytes, and the most pixels that may be read."""

    file: BinaryIO
    path: str
    size: int
    most: int

    def check(self, width: int, height: int, each: int, dense: int) -> None:
        """Refuse a picture that has more pixels than are allowed, than its bytes can hold (`dense`) or, at `each` bytes
        a pixel, than fit into memory."""
        header = f"the header says {width} x {height} pixels"
        if min(width, height) < 1 or width * height > min(self.most, dense):
            raise FormatError(f"{header}, expected 1 to {self.most} pixels, and what {self.size} bytes can hold")
        needed, free = width * height * (each + _BESIDE), available()
        if needed > free:
            raise TooLargeError(f"{header}, which take up to {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB are free")


def opened(path: str | os.PathLike[str]) -> BinaryIO:
    """The file of this name, open, at its start; not a FIFO, a device or the like, which may never end."""
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise NotFoundError(f"{path}: {reason}; check the name and its permissions") from None
    mode = os.fstat(handle).st_mode
    if stat.S_ISREG(mode):
        return os.fdopen(handle, "rb")
    os.close(handle)
    if stat.S_ISDIR(mode):
        raise FormatError(f"{path}: is a directory, expected a picture; name a file in it")
    raise FormatError(f"{path}: is a FIFO, a device or the like, expected a file; copy what comes from it into one")


def available() -> float:
    """Bytes of memory that are free on this machine, as far as that is known."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            return next(1024.0 * int(line.split()[1]) for line in file if line.startswith("MemAvailable:"))
    except (OSError, ValueError, StopIteration):
        return float("inf")


def blocks(height: int, width: int) -> Iterator[slice]:
    """The rows of a picture, some at a time."""
    step = max(1, _BLOCK // width)
    return (slice(start, min(start + step, height)) for start in range(0, height, step))


def warn_lost(lost: NDArray[np.bool_], path: str, what: str) -> None:
    """Announce pixels whose values a format cannot hold, to who saves the picture."""
    if count := int(lost.any(axis=-1).sum()):
        message = f"{path}: {count} of {lost[..., 0].size} pixels are {what}; .exr keeps them"
        warn(message, MissingDataWarning)


def library(module: str, package: str) -> Any:
    """A module of a library; raises DependencyError where that is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        message = f"{package} reads and writes this format and is not installed; pip install {package}"
        raise DependencyError(message) from error
