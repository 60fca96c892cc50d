"""Pictures whose light is one formula: the scene as one value, and the sums of runs of its pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..base.identity import identity
from ..base.light import Light
from ..base.one_channel import of_channel
from ..base.reflectance import Reflectance
from ..base.textured import mapped
from ..evaluate import batch
from ..evaluate.call import UNROLLED
from ..evaluate.computation import Computation, composite
from ..formula import tree
from ..pictures.colour import transformed
from .estimator import direct, shares
from .passes import Found
from .pixels import Pixels
from .points import points

PIXELS = 1 << 12
"""Pixels of a part, which a thread computes at a time, of up to `CHANNELS` channels; with more, so many fewer."""

CHANNELS = 64

PARTS = 8
"""Parts that small pictures have."""


class PictureJob(NamedTuple):
    """A picture to be computed, of one material. `matrix`: that by which its channels become those of the picture, of
    `colours` sums if the lights have channels of their own. `glows`: pictures of what it re-radiates, to be added."""

    scene: Any
    computation: Computation
    pixels: Pixels
    matrix: np.ndarray | None
    colours: int
    own: int  # channels of the scene
    channels: int  # of the picture
    glows: tuple[PictureJob, ...] = ()

    @classmethod
    def of(
        cls,
        m: Reflectance,
        lights: list[Light],
        pixels: Pixels,
        before: np.ndarray | None,
        after: np.ndarray | None,
        part: int | None = None,
        glowing: Sequence[tuple[Reflectance, list[Light]]] = (),
        is_glow: bool = False,
    ) -> PictureJob:
        """The picture of a material; the matrices make RGB of its f, or of the radiance. `part`: the number of the
        part that alone counts. `glowing`: what it re-radiates, under which lights; `is_glow`: whether this is such,
        before which lights are not seen."""
        lights = pixels.stage.lit_by(lights)
        lit = [batch.channels(light) or 1 for light in lights]
        colours = 3 if before is not None and 3 in lit else 1
        sources: list[Any] = [*lights]
        if colours > 1:
            sources = [composite(**{str(j): of_channel(light, j) for j in range(colours)}) for light in lights]
        values = pixels.stage.values(pixels.size) | ({} if part is None else {"part": float(part)})
        scene = composite(**mapped(m._unlabelled), lights=sources, **values)
        scene_channels = batch.channels(scene) or 1
        matrix = after if before is None else before
        channels = scene_channels if matrix is None else matrix.shape[1]
        backdrop = pixels.stage.backdrop and not part and not is_glow
        computation = direct(colours, scene_channels > UNROLLED, part is not None, backdrop)
        glows = tuple(cls.of(glow, lit, pixels, before, after, part, is_glow=True) for glow, lit in glowing)
        return cls(scene, computation, pixels, matrix, colours, scene_channels, channels, glows)

    def identity(self) -> str:
        """A hash of all that the picture depends on."""
        stage = self.pixels.stage
        shown = {
            name: getattr(self.scene, name) for name in ("material", "maps", "lights") if name in self.scene.fields
        }
        told = composite(**shown, camera=stage.camera)
        bodies = [(type(body).__name__, *tree.leaves(body)) for body in stage.bodies]
        rest = (stage.identity, bodies, stage.margin, stage.backdrop, self.pixels.size, self.pixels.seed)
        return identity(told, rest, self.colours, self.matrix, *(glow.identity() for glow in self.glows))

    def parts(self) -> list[slice]:
        """Runs of pixels, of one length but for the last one."""
        return runs(len(self.pixels.places), self.own)

    def part(self, at: slice, start: int, stop: int) -> Found:
        """The sums of samples start to stop for a run of pixels."""
        return tile(self, at, start, stop)

    def slopes(self, by: Sequence[str], at: slice, start: int, stop: int) -> tuple[list[np.ndarray], np.ndarray, int]:
        """The sums of samples start to stop for a run of pixels, and their derivatives by numbers of the scene, in the
        channels of the material."""
        arrays = {"pixel": self.pixels.numbers[at], "point": points(start, stop)[None]}
        sums, slopes = self.computation.derivatives(self.scene, by, **arrays)
        return [sums["light"], *slopes], *_counted(sums)

    def coloured(self, sums: dict[str, np.ndarray]) -> np.ndarray:
        """The sums of pixels, of one channel at least, in the channels of the picture."""
        several = [x if x.ndim > 1 else x[:, None] for x in list(sums.values())[: self.colours]]
        if self.matrix is None:
            return several[0]
        if self.colours == 1:
            return transformed(several[0], self.matrix)
        columns = [transformed(x, self.matrix[:, j : j + 1]) for j, x in enumerate(several)]
        return np.concatenate(columns, axis=-1)


def runs(pixels: int, channels: int) -> list[slice]:
    """Runs of pixels, of one length but for the last one."""
    most = PIXELS * CHANNELS // max(channels, CHANNELS)
    length = math.ceil(pixels / max(math.ceil(pixels / most), min(PARTS, pixels)))
    return [slice(start, min(start + length, pixels)) for start in range(0, pixels, length)]


def tile(job: PictureJob, at: slice | np.ndarray, start: int, stop: int) -> Found:
    """The sums of samples start to stop for a run of pixels."""
    sums = job.computation(job.scene, pixel=job.pixels.numbers[at], point=points(start, stop)[None])
    light, (met, holes) = job.coloured(sums), _counted(sums)
    for glow in job.glows:
        more, _, missing = tile(glow, at, start, stop)
        light, holes = light + more, holes + missing
    return light, met, holes


def _counted(sums: dict[str, np.ndarray]) -> tuple[np.ndarray, int]:
    """How many samples of each pixel met the shape, and how many directions are without data."""
    met = sums["seen"] if sums["seen"].ndim == 1 else sums["seen"][:, 0]
    return met, int(sums["holes"].reshape(len(met), -1).sum(axis=0).max())


class Several(NamedTuple):
    """A picture to be computed, of several materials: of each the pixels that show it, and which these are is counted
    before, by the same rays."""

    jobs: tuple[PictureJob, ...]
    pixels: Pixels
    channels: int

    def identity(self) -> str:
        """A hash of all that the picture depends on."""
        return identity(*(job.identity() for job in self.jobs))

    def parts(self) -> list[slice]:
        """Runs of pixels, of one length but for the last one."""
        return runs(len(self.pixels.places), max(job.own for job in self.jobs))

    def part(self, at: slice, start: int, stop: int) -> Found:
        """The sums of samples start to stop for a run of pixels."""
        arrays = {"pixel": self.pixels.numbers[at], "point": points(start, stop)[None]}
        counts = shares(len(self.jobs))(self.jobs[0].scene, **arrays)
        # Where bodies touch, kernels may disagree about which one is nearer: what is seen is counted by one of them.
        seen = np.sum([*counts.values()], axis=0, dtype=float)
        light, holes = np.zeros((at.stop - at.start, self.channels)), 0
        if self.pixels.stage.backdrop:  # the first one shows it
            counts["0"] = counts["0"] + (seen < stop - start)
            seen[:] = stop - start
        for job, count in zip(self.jobs, counts.values(), strict=True):
            shown = np.flatnonzero(count)
            if len(shown):
                radiance, _, missing = tile(job, at.start + shown, start, stop)
                light[shown] += radiance
                holes += missing
        return light, seen, holes
