"""Pictures in passes: sums that grow, their noise, and the file that they are kept in meanwhile."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..compile.threads import share
from ..errors import FormatError, MissingDataWarning, warn
from .kept import ADVICE, WorkFile

PASS = 32
"""Samples of a pass, or those that are left."""

SETTLED = 4
"""Passes after which the noise is judged."""

Found = tuple[np.ndarray, np.ndarray, int]
"""Of some pixels and one pass: sums of radiance (n, C), the number of samples that meet the shape (n,), and holes."""


class PixelSums(NamedTuple):
    """Sums of all passes for each pixel: radiance (N, C), samples that met the shape (N,), the sum of squares of
    radiance over these (N, C); and in all: samples a pixel, passes, directions without data."""

    light: np.ndarray
    seen: np.ndarray
    squares: np.ndarray
    counts: np.ndarray

    @classmethod
    def zero(cls, pixels: int, channels: int) -> PixelSums:
        """Before the first pass."""
        return cls(np.zeros((pixels, channels)), np.zeros(pixels), np.zeros((pixels, channels)), np.zeros(3, np.int64))

    @property
    def samples(self) -> int:
        """Samples a pixel."""
        return int(self.counts[0])

    @property
    def holes(self) -> int:
        """Samples that met directions without data."""
        return int(self.counts[2])

    def mean(self) -> np.ndarray:
        """Radiance (N, C) of what is seen."""
        mean: np.ndarray = self.light / np.maximum(self.seen, 1.0)[:, None]
        return mean

    def noise(self) -> np.ndarray | None:
        """The standard error (N, C) of `mean`, from the spread of the passes; None after one pass."""
        passes = int(self.counts[1])
        if passes < 2:
            return None
        seen = np.maximum(self.seen, 1.0)[:, None]
        return np.sqrt(np.maximum(self.squares - self.light**2 / seen, 0.0) / (seen * (passes - 1)))

    def relative_noise(self) -> float:
        """The root mean square of the noise over the pixels of the shape, over their mean radiance."""
        noise = self.noise()
        if noise is None or self.counts[1] < SETTLED:
            return math.inf
        inside = self.seen > 0.0
        level = float(self.mean()[inside].mean()) if inside.any() else 0.0
        return math.sqrt(float(np.square(noise[inside]).mean())) / level if level > 0.0 else 0.0


def passes(
    sums: PixelSums,
    work: Callable[[slice, int, int], Found],
    parts: list[slice],
    samples: int,
    tolerance: float | None,
    progress: Callable[[int, int], None] | None,
    checkpoint: RenderCheckpoint | None,
) -> None:
    """Add passes to sums until there are so many samples, or until the noise is low enough.

    `work(part, start, stop)` gives what samples start to stop come to for some pixels. Parts are shared out to threads.
    """
    total = math.ceil((samples - sums.samples) / PASS) * len(parts)
    done: list[int] = []  # holes of each part of each pass
    announced = 0

    def announce() -> None:
        nonlocal announced
        while progress is not None and announced < len(done):
            announced += 1
            progress(announced, total)

    while sums.samples < samples and not (tolerance is not None and sums.relative_noise() <= tolerance):
        start = sums.samples
        stop = min(start + PASS, samples)
        before = len(done)

        def one(part: slice, start: int = start, stop: int = stop) -> None:
            light, seen, missing = work(part, start, stop)
            sums.light[part] += light
            sums.seen[part] += seen
            sums.squares[part] += light * light / np.maximum(seen, 1.0)[:, None]
            done.append(missing)

        share(one, [(part,) for part in parts], announce)
        announce()
        sums.counts[:] += (stop - start, 1, sum(done[before:]))
        if checkpoint is not None:
            checkpoint.keep(sums, stop >= samples)
    if progress is not None and announced < total:
        progress(total, total)


class RenderCheckpoint(WorkFile):
    """A file that holds the sums of a picture, for a render that goes on where another was ended.

    `identity`: of the picture; a file with another one is refused.
    """

    def __init__(self, path: str | os.PathLike[str], identity: str):
        what = "material, lights, shape, size, seed, channels and version of gonio"
        super().__init__(path, identity, "a picture", what)

    def read(self, pixels: int, channels: int) -> PixelSums:
        """The sums in the file, or those before the first pass where there is none."""
        sums = PixelSums.zero(pixels, channels)
        held = self.arrays(PixelSums._fields)
        if held is None:
            return sums
        stored = PixelSums(**held)
        if any(a.shape != b.shape or a.dtype != b.dtype for a, b in zip(stored, sums, strict=True)):
            raise FormatError(f"{self.path}: a checkpoint whose arrays have the wrong shapes; {ADVICE}")
        return stored

    def keep(self, sums: PixelSums, is_last: bool) -> None:
        """Write the sums, unless the last time was just now."""
        self.write(sums._asdict(), is_last)


def warn_of_holes(count: int) -> None:
    """Say how many samples met directions without measured data."""
    if count:
        text = f"{count} samples met directions without measured data, which count as black"
        warn(text, MissingDataWarning)
