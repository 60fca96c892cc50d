"""Filling the holes (NaN) of arrays, for tables that must hold a number everywhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import ParameterError


def filled(values: np.ndarray) -> np.ndarray:
    """An array with its NaNs replaced by `filled_in_layers`; none of its axes closes to a circle."""
    return filled_in_layers(values, (False,) * values.ndim)[0]


def filled_in_layers(values: np.ndarray, wraps: Sequence[bool]) -> tuple[np.ndarray, np.ndarray]:
    """Values (grid..., C) with each NaN replaced by the mean of its neighbours with a value, and the layer of each.

    Layer 1 touches values that were there (layer 0), layer 2 touches layer 1, and so on inwards.

    `wraps`: which axes of the grid close to a circle. Raises ParameterError for a channel without any value.
    """
    shape = values.shape
    full, depth = values.copy(), np.zeros(shape, np.int32)
    missing = np.argwhere(np.isnan(full))
    layer = 0
    while len(missing):
        layer += 1
        total, count = np.zeros(len(missing)), np.zeros(len(missing), np.int32)
        for axis, wrap in enumerate(wraps):
            for step in (1, -1):
                at = missing[:, axis] + step
                inside = np.full(len(at), True) if wrap else (at >= 0) & (at < shape[axis])
                index = [missing[:, k] for k in range(len(shape))]
                index[axis] = at % shape[axis]
                neighbour = full[tuple(index)]
                use = inside & ~np.isnan(neighbour)
                total += np.where(use, neighbour, 0.0)
                count += use
        reached = count > 0
        if not reached.any():
            raise ParameterError("a channel has no value in any cell; expected some to fill from")
        cells = tuple(missing[reached].T)
        full[cells] = total[reached] / count[reached]
        depth[cells] = layer
        missing = missing[~reached]
    return full, depth
