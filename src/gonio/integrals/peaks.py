"""Peaks of a lobe in a part of the directions, and how narrow they are: by the samples that the lobe draws."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays.kinds import VECTOR
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..evaluate import batch
from ..evaluate.tracing import Task
from ..formula.direction import Direction, served
from ..numerics.lattice import lattice
from .domain import Domain
from .places import Places

SHARP = 0.02
"""From which width on, in the coordinates of a part of the directions, a lobe is narrow."""

GRAZING = 0.5
"""Cosine below which narrow lobes are drawn out in length as well."""

NARROW = 0.4
"""How wide cells near a peak may be, in the coordinates of the lobe's own sampling."""

_STEP = 4e-3
_GRID = np.stack(np.meshgrid(*2 * [np.array([0.005, 0.1, 0.35, 0.65, 0.9, 0.99])]), axis=-1).reshape(-1, 1, 2)
_STEPS = np.array([[0.0, 0.0], [_STEP, 0.0], [0.0, _STEP]])
_SEEDS = len(_GRID) * len(_STEPS)
_DRAWN = np.concatenate([(_GRID + _STEPS).reshape(-1, 2), lattice(256)])


def _drawn(m: Reflectance, mean: Reflectance, w: Any, u: Any) -> tuple:
    _, fixed = served(Direction(*w))
    return (mean.warp(fixed, *u),)


_WARPED = Task(_drawn, (VECTOR,), (3, 2))


def peaks(lobe: Reflectance, fixed: np.ndarray, places: Places, domain: Domain) -> tuple[np.ndarray, np.ndarray]:
    """Seeds (n, K, 4) for `cubature`: the points of a domain next to a lobe's samples, and the widths of cells there,
    over which the lobe's own coordinates change by `NARROW`. And whether more than one sample falls into it (n,)."""
    assert domain.inverse is not None and domain.contains is not None
    m = places.material(lobe) if map_shape(lobe) else lobe
    (there,) = batch.run(_WARPED, m, (fixed[:, None], _DRAWN))
    sent = domain.contains(there[:, _SEEDS:]).sum(axis=-1) > 1
    x, y, period = (v.reshape(len(fixed), -1, 3) for v in domain.inverse(there[:, :_SEEDS]))
    with np.errstate(divide="ignore", invalid="ignore"):
        dx, dy = x[..., 1:] - x[..., :1], y[..., 1:] - y[..., :1]
        dy = dy - period[..., :1] * np.round(dy / period[..., :1])
        area = NARROW * np.abs(dx[..., 0] * dy[..., 1] - dx[..., 1] * dy[..., 0]) / _STEP
        wide, high = area / np.hypot(*np.moveaxis(dy, -1, 0)), area / np.hypot(*np.moveaxis(dx, -1, 0))
    sizes = [np.maximum(v, 0.1 * np.median(np.nan_to_num(v, nan=1.0), axis=-1, keepdims=True)) for v in (wide, high)]
    at = [np.clip(v[..., 0], 0.0, 1.0) for v in (x, y)]
    return np.nan_to_num(np.stack([*at, *sizes], axis=-1), nan=1.0), sent
