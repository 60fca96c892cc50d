"""Where in a part of the directions a lobe may have a peak, and how narrow: found by what its sampling draws."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.reflectance import Reflectance
from ..evaluate import batch
from ..formula.direction import Direction, served
from ..numerics.lattice import lattice
from .domain import Domain
from .places import Place, texels

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
    _, known = served(Direction(*w))
    return (mean.warp(known, *u),)


def peaks(lobe: Reflectance, known: np.ndarray, place: Place, domain: Domain) -> tuple[np.ndarray, np.ndarray]:
    """Seeds (n, K, 4) for `cubature`: points of a domain where a lobe's samples lie, or nearest to them, and how narrow
    cells may be there: along an axis of the domain the lobe's own coordinates change by `NARROW`. And whether any but
    very few samples fall into it (n,)."""
    assert domain.inverse is not None
    assert domain.contains is not None
    m = texels(lobe, place.shape, place.of) if batch.full_shape(lobe, ()) else lobe
    (there,) = batch.run(_drawn, ("vector",), m, (known[:, None], _DRAWN), (3, 2))
    sent = domain.contains(there[:, _SEEDS:]).sum(axis=-1) > 1
    x, y, period = (v.reshape(len(known), -1, 3) for v in domain.inverse(there[:, :_SEEDS]))
    with np.errstate(divide="ignore", invalid="ignore"):
        dx, dy = x[..., 1:] - x[..., :1], y[..., 1:] - y[..., :1]
        dy = dy - period[..., :1] * np.round(dy / period[..., :1])
        area = NARROW * np.abs(dx[..., 0] * dy[..., 1] - dx[..., 1] * dy[..., 0]) / _STEP
        wide, high = area / np.hypot(*np.moveaxis(dy, -1, 0)), area / np.hypot(*np.moveaxis(dx, -1, 0))
    wide, high = (
        np.maximum(v, 0.1 * np.median(np.nan_to_num(v, nan=1.0), axis=-1, keepdims=True)) for v in (wide, high)
    )
    at = [np.clip(v[..., 0], 0.0, 1.0) for v in (x, y)]
    return np.nan_to_num(np.stack([*at, wide, high], axis=-1), nan=1.0), sent
