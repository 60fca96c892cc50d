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

from ...errors import FormatError, MissingDataWarning, NotFoundError, ShapeError, TooLargeError, needed, warn

DENSE = 2**14
"""Pixels that a byte may stand for: one colour, 8192 x 4096, comes to 8089 as 1-bit PNG."""

_BESIDE = 6  # bytes a pixel that libraries take beside their results
_BLOCK = 1 << 18  # pixels that are converted at a time


class Picture(NamedTuple):
    """What is in a file: linear pixels (H, W, C), coverage (H, W), names of the channels (R, G, B first), and
    primaries, if known, as in `colour.SRGB_XY`; whether the pixels are multiplied by the coverage, and come from codes;
    what a caller should hear."""

    pixels: NDArray[np.float32]
    alpha: NDArray[np.float32] | None = None
    names: tuple[str, ...] | None = None
    primaries: tuple[float, ...] | None = None
    premultiplied: bool = False
    coded: bool = False
    notes: tuple[str, ...] = ()


class Unsettled(FormatError):
    """A sound file that says several things, or none that this reader takes: the message says what would settle it."""


class Limits(NamedTuple):
    """What a caller says of a picture: how many pixels it may have; which layer is meant; whether its codes are linear,
    or those of sRGB."""

    most: int
    layer: str | None = None
    linear: bool | None = None


@dataclass(frozen=True, slots=True)
class PictureFile:
    """A picture's open file; its name, its size in bytes, and what the caller says of it."""

    file: BinaryIO
    path: str
    size: int
    limits: Limits

    def check(self, width: int, height: int, each: int, dense: int) -> None:
        """Refuse a picture that has more pixels than are allowed, than its bytes can hold (`dense`) or, at `each` bytes
        a pixel, than fit into memory."""
        header = f"the header says {width} x {height} pixels"
        if min(width, height) < 1 or width * height > min(self.limits.most, dense):
            raise FormatError(f"{header}, expected 1 to {self.limits.most} pixels, and what {self.size} bytes can hold")
        needed, free = width * height * (each + _BESIDE), available()
        if needed > free:
            raise TooLargeError(f"{header}, which take up to {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB are free")

    def expect_one_layer(self) -> None:
        """Refuse a file of a format without layers where one is asked for by name."""
        if self.limits.layer:
            raise Unsettled(f"layer={self.limits.layer!r:.60}: it has no layers; expected layer=None or ''")


def gray_or_rgb(pixels: NDArray[np.float32], path: str) -> NDArray[np.float32]:
    """The pixels; raises ShapeError where they are neither."""
    if (count := pixels.shape[2]) in (1, 3):
        return pixels
    raise ShapeError(f"{path}: {count} channels, expected 1 or 3; pick some of them, or write .exr")


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
    with needed(f"{package} reads and writes this format", f"pip install {package}"):
        return importlib.import_module(module)
