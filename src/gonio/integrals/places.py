"""Elements of a batch of directions, and a material with maps at them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..base.reflectance import Reflectance
from ..evaluate import batch


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
        """A weight or a reflectance, a number or (...[, C]), at the places: (n or 1, C or 1)."""
        x = np.asarray(x, dtype=float)
        if x.ndim <= 1 and x.shape != self.shape:
            return x.reshape(1, -1)
        if x.ndim == len(self.shape):
            x = x[..., None]
        return np.broadcast_to(x, (*self.shape, x.shape[-1])).reshape(-1, x.shape[-1])[self.elements]
