"""Pictures by arrays: of what is no formula, such as lights that are functions, and of polarized light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import SCALAR, VECTOR
from ..base.frames import Frame
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..compile.threads import share
from ..evaluate.computation import Computation, composite
from ..formula.direction import Direction
from ..integrals.illumination import delta_radiance, estimate, without_holes
from ..integrals.places import SeenPoints
from . import estimator
from .passes import warn_of_holes
from .pixels import Pixels
from .points import points, shifted

TILE = 1 << 14  # samples of a tile, the part of a picture that a thread takes: few enough for a processor's cache
BLOCK = 64  # channels up to which tiles are as large; with more they have so many fewer samples


def picture(
    gather: Callable[[SeenPoints], tuple[np.ndarray, int]],
    channels: int,
    pixels: Pixels,
    samples: int,
    progress: Callable[[int, int], None] | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Values (size, size, C) and coverage of a picture; `gather` gives values (..., C) at points, and how many of these
    met directions without data, of a material of so many `channels`."""
    per_tile = max(1, TILE * BLOCK // max(channels, BLOCK) // samples)
    starts = range(0, len(pixels.places), per_tile)
    tiles: dict[int, tuple[np.ndarray, np.ndarray, int]] = {}

    def work(start: int) -> None:
        tiles[start] = tile(gather, pixels, samples, slice(start, start + per_tile))

    announced = 0

    def announce() -> None:
        nonlocal announced
        while progress is not None and announced < len(tiles):
            announced += 1
            progress(announced, len(starts))

    share(work, [(start,) for start in starts], announce)
    announce()
    channels = max(radiance.shape[-1] for radiance, _, _ in tiles.values())
    ordered = [tiles[start] for start in sorted(tiles)]
    colour = np.concatenate([np.broadcast_to(radiance, (len(radiance), channels)) for radiance, _, _ in ordered])
    alpha = np.concatenate([coverage for _, coverage, _ in ordered])
    warn_of_holes(sum(holes for _, _, holes in ordered))
    return pixels.picture(colour), pixels.picture(alpha[:, None])[..., 0]


def tile(
    gather: Callable[[SeenPoints], tuple[np.ndarray, int]], pixels: Pixels, samples: int, at: slice
) -> tuple[np.ndarray, np.ndarray, int]:
    """Radiance (pixels, C), coverage (pixels,) and the number of samples without data, for a run of pixels."""
    numbers = pixels.numbers[at]
    u = shifted(points(0, samples), numbers[..., 2:])
    scene = composite(**pixels.stage.values(pixels.size))
    hits = _HITS(scene, place=numbers[..., :2] + u[..., :2])
    hit = hits["met"] > 0.5
    coverage = hit.mean(axis=-1)
    if not hit.any():
        return np.zeros((len(numbers), 1), np.float32), coverage, 0
    named = (hits[name] for name in ("point", "normal", "tangent", "back"))
    position, n, t, back, u = (x[hit].astype(np.float32) for x in (*named, u))
    local = Frame(*(Direction(*np.moveaxis(axis, -1, 0)) for axis in (t, np.cross(n, t), n)))
    wo = local.to_local(ops.library(n), back)
    total, missing = gather(SeenPoints(local, wo, position, u[:, 2:4], u[:, 4:6]))
    radiance = np.zeros((*hit.shape, total.shape[-1]), np.float32)
    radiance[hit] = total
    radiance = radiance.sum(axis=1) / np.maximum(hit.sum(axis=1), 1)[:, None]
    return radiance.astype(np.float32), coverage, missing


def _hits(scene: Any, mean: Any, place: Any) -> tuple[Any, ...]:
    """Where rays through places in the picture meet a shape, and the directions back to the camera."""
    o, d = estimator.ray(scene, *place)
    at, _ = estimator.first(scene.bodies.parts, o, d)
    return ops.where(at.met, 1.0 + 0.0 * place[0], 0.0), at.point, at.normal, at.tangent, -d


_HITS = Computation(
    _hits, {"place": 2}, {"met": SCALAR, **dict.fromkeys(("point", "normal", "tangent", "back"), VECTOR)}
)


def reflected(
    pairs: Sequence[tuple[Reflectance, Light]], colour: np.ndarray | None
) -> Callable[[SeenPoints], tuple[Any, int]]:
    """Radiance (..., C) at points, of reflectances each under a light of any kind, and how many samples met directions
    without data."""

    def gather(at: SeenPoints) -> tuple[Any, int]:
        total: Any = 0.0
        missing = 0
        for m, light in pairs:
            if light.is_delta:
                part, holes = without_holes(delta_radiance(m, light, at.local, at.wo, at.position, colour))
            else:
                part, holes = estimate(m, light, at, colour)
            total, missing = total + part, missing + holes
        return total, missing

    return gather
