"""Elements of a batch of directions, and what a material with maps is there."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..base.reflectance import Reflectance
from ..evaluate import batch


class Place(NamedTuple):
    """Which elements `of` (n,) a flattened batch of a material with maps are meant."""

    shape: tuple[int, ...]
    of: np.ndarray


def texels(m: Reflectance, shape: tuple[int, ...], index: np.ndarray) -> Reflectance:
    """The material at elements of a flattened batch, to meet directions (n, k, 3)."""
    found = batch.texels(m, shape, index)
    assert isinstance(found, Reflectance)
    return found


def of_places(value: Any, shape: tuple[int, ...], index: np.ndarray) -> np.ndarray:
    """A weight or a reflectance, a number or (...[, C]), at elements of a flattened batch: (n or 1, C or 1)."""
    value = np.asarray(value, dtype=float)
    if value.ndim <= 1 and value.shape != shape:
        return value.reshape(1, -1)
    if value.ndim == len(shape):
        value = value[..., None]
    return np.broadcast_to(value, (*shape, value.shape[-1])).reshape(-1, value.shape[-1])[index]
