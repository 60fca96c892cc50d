"""Elements of a batch of directions, a material with maps at them, and points that are seen."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..base.frames import Frame
from ..base.reflectance import Reflectance
from ..evaluate import batch


class SeenPoints(NamedTuple):
    """Points that are seen: frames, directions to the viewer in these (..., 3), world positions (..., 3), and two pairs
    of random numbers (..., 2)."""

    local: Frame
    wo: Any
    position: Any
    u: Any
    v: Any


class Places(NamedTuple):
    """Elements (n,) of a flattened batch of this shape, each with its texel of a material with maps."""

    shape: tuple[int, ...]
    elements: np.ndarray

    def of(self, rows: np.ndarray) -> Places:
        """Some of the places."""
        return Places(self.shape, self.elements[rows])

    def material(self, m: Reflectance) -> Reflectance:
        """The material at the places, to meet directions (n, k, 3)."""
        there = batch.texels(m, self.shape, self.elements)
        assert isinstance(there, Reflectance)
        return there

    def values(self, x: Any) -> np.ndarray:
        """A number, or an array whose last axis is that of channels, as parameters are, at the places: (n or 1, C)."""
        x = np.asarray(x, dtype=float)
        if x.ndim <= 1:
            return x.reshape(1, -1)
        return np.broadcast_to(x, (*self.shape, x.shape[-1])).reshape(-1, x.shape[-1])[self.elements]
