"""f of any reflectance at pairs of directions of which some are below the horizon, such as the nodes of a grid."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..formula.direction import HORIZON


def above(wi: np.ndarray, wo: np.ndarray, least: float = HORIZON) -> np.ndarray:
    """Whether both directions of pairs (..., 3) have cosines above `least`."""
    return (wi[..., 2] > least) & (wo[..., 2] > least)


def f_at(m: Any, wi: np.ndarray, wo: np.ndarray, below: float = np.nan, least: float = HORIZON) -> np.ndarray:
    """f (...) or (..., C) at pairs of directions (..., 3); `below` where one of the two is below the horizon."""
    wi, wo = np.broadcast_arrays(wi, wo)
    up = above(wi, wo, least)
    values = m.f(wi[up], wo[up])
    f = np.full((*up.shape, *values.shape[1:]), below)
    f[up] = values
    return f


def channels_named(count: int) -> tuple[str, ...]:
    """Names for channels without names: those of colours if there are three, else numbers."""
    return ("R", "G", "B") if count == 3 else tuple(map(str, range(count)))
