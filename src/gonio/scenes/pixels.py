"""The pixels of a picture that show something, and the numbers that their rays are made of."""

from __future__ import annotations

from typing import Any, NamedTuple, Self

import numpy as np

from ..arrays import ops
from ..arrays.kinds import SCALAR
from ..evaluate.computation import Computation, composite
from ._bodies import Ground
from .camera import FRONT
from .estimator import ray
from .points import DIMENSIONS
from .shapes.sphere import sphere
from .stage import Stage


class Pixels(NamedTuple):
    """Pixels of a square picture in which rays may meet something: their places in it (N,), row by row, and of each the
    column, the row and six random numbers in [0, 1) (N, 1, 8), by which its points are shifted."""

    stage: Stage
    size: int
    seed: int
    places: np.ndarray
    numbers: np.ndarray

    @classmethod
    def of(cls, stage: Stage, size: int, seed: int) -> Self:
        """Those of a picture."""
        places = np.flatnonzero(_near(stage, size))
        numbers = np.empty((len(places), 1, 2 + DIMENSIONS), np.float32)
        numbers[:, 0, 1], numbers[:, 0, 0] = np.divmod(places, size)
        numbers[:, 0, 2:] = np.random.default_rng(seed).random((len(places), DIMENSIONS), np.float32)
        return cls(stage, size, seed, places, numbers)

    def picture(self, values: np.ndarray) -> np.ndarray:
        """Values (N, C) of the pixels as a picture (H, W, C), 0 elsewhere."""
        whole = np.zeros((self.size**2, values.shape[1]), np.float32)
        whole[self.places] = values
        return whole.reshape(self.size, self.size, -1)


def _near(stage: Stage, size: int) -> np.ndarray:
    """Whether a ray through each pixel (N,) may meet something."""
    if stage.backdrop or any(isinstance(body, Ground) for body in stage.bodies):
        return np.ones(size * size, bool)
    near = _near_ball(stage, size) if stage.hulls is None else _near_hulls(stage, size, stage.hulls)
    return near.reshape(-1) if near.any() else np.ones(size * size, bool)


def _near_ball(stage: Stage, size: int) -> np.ndarray:
    """Whether a ray through any corner of each pixel (H, W), or of one beside it, meets the unit sphere."""

    def corners(scene: Any, mean: Any, place: Any) -> tuple[Any, ...]:
        return (ops.where(sphere(*ray(scene, *place)).met, 1.0 + 0.0 * place[0], 0.0),)

    if stage.camera is FRONT:  # the unit disk: nothing to be compiled
        scale, margin = np.float32(2.0 * stage.margin / size), np.float32(stage.margin)
        of_corners = np.arange(-1, size + 2, dtype=np.float32) * scale - margin
        met = np.add.outer(of_corners**2, of_corners**2) < 1.0
    else:
        y, x = np.mgrid[-1 : size + 2, -1 : size + 2].astype(np.float32)
        scene = composite(**stage.values(size))
        met = Computation(corners, {"place": 2}, {"met": SCALAR})(scene, place=np.stack([x, y], -1))["met"] > 0.5
    near = met[:-3] | met[1:-2] | met[2:-1] | met[3:]
    return near[:, :-3] | near[:, 1:-2] | near[:, 2:-1] | near[:, 3:]


def _near_hulls(stage: Stage, size: int, hulls: np.ndarray) -> np.ndarray:
    """Whether each pixel (H, W) is in the rectangle about a hull of points (N, K, 3), as the camera sees it."""
    places = stage.camera.places(hulls.reshape(-1, 3))
    if places is None:
        return np.ones((size, size), bool)
    columns, rows = ((1.0 + sign * places[:, i]) * (0.5 * size) for i, sign in ((0, 1.0), (1, -1.0)))
    bounds = []
    for at in (rows, columns):
        at = np.clip(at, -2.0, size + 2.0).reshape(hulls.shape[:2])
        low, high = np.floor(at.min(axis=1) - 1e-2), np.floor(at.max(axis=1) + 1e-2) + 1.0
        bounds += [np.clip(x, 0, size).astype(np.intp) for x in (low, high)]
    top, bottom, left, right = bounds
    steps = np.zeros((size + 1) ** 2)
    for y, x, sign in ((top, left, 1), (top, right, -1), (bottom, left, -1), (bottom, right, 1)):
        steps += sign * np.bincount(y * (size + 1) + x, minlength=len(steps))
    covering = steps.reshape(size + 1, size + 1).cumsum(axis=0).cumsum(axis=1)
    return covering[:-1, :-1] > 0.5
