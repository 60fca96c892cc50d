"""Integrals of materials with maps: those of a few places, from which the others follow.

An integral is linear in f, whatever its directions, cones and lights. So the integrals of all places are known from
those of a few wherever f is a combination, the same one for all directions, of f at these. Two ways find it:

- `by_factors.py`: f is written as a sum of products, a number of the place times a function of the directions
  (all kernel models, albedos, weights). Exact: as many places as products decide.
- `by_nodes.py`: f at some pairs of directions (nodes), chosen among many by how much they differ between
  places, is fitted to the integrals of some hundred places: nodes and weights of a rule for this map alone. Its error
  is measured at places that had no part in the fit, and at each that had by the fit without it. It grows with a place's
  leverage: how far its values at the nodes lie from those of the fitted. Places whose error may be too large join
  these, or are integrated by themselves.

Source   derived here, after empirical interpolation: Barrault, Maday, Nguyen & Patera 2004, C. R. Acad. Sci. Paris
         Ser. I 339:667 (nodes and weights from the functions themselves).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...base.map_shape import map_shape
from ...base.reflectance import Reflectance
from ...base.sides import is_lit
from ...base.sums import drawn_apart
from ...evaluate import batch
from ...evaluate.factors import factors
from ...formula import tree
from ...formula.fields import Channels
from ...numerics.quadrature import Integrals
from ..places import Places
from .by_factors import by_factors
from .by_nodes import by_nodes
from .rows import MaterialRows, Wanted


def over_places(m: Reflectance, wanted: Wanted) -> Integrals:
    """Integrals (k, C) for all elements of the flattened batch of directions and places; NaN at places with holes."""
    shape = batch.full_shape(m, wanted.shape)
    if not map_shape(m):
        number = np.arange(len(wanted.unit))
        return wanted.direct(m, number, Places(shape, number), wanted.tolerance)
    lobes = list(drawn_apart(m))
    share = max(1, sum(not lobe.is_delta for _, lobe in lobes))
    value: np.ndarray = np.zeros((*shape, 1))
    error, missing = np.zeros(shape), np.zeros(shape)
    for weight, lobe in lobes:
        w = np.abs(np.asarray(weight, dtype=float))
        largest = np.fmax.reduce(w, axis=None, initial=0.0)
        if largest == 0.0:
            continue
        goal = wanted._replace(tolerance=wanted.tolerance / (share * largest))
        part = _of_lobe(lobe, goal)
        value = value + weight * part.value
        error = error + (w.max(axis=-1) if w.ndim else w) * part.error
        missing = np.maximum(missing, part.missing)
    return Integrals(
        value.reshape(-1, value.shape[-1]),
        np.broadcast_to(error, shape).reshape(-1),
        np.broadcast_to(missing, shape).reshape(-1),
    )


def _of_lobe(lobe: Reflectance, wanted: Wanted) -> Integrals:
    """Integrals of a lobe: value (..., C), error and missing (...), for the batch of directions and its own places."""
    shape, map_axes = batch.full_shape(lobe, wanted.shape), map_shape(lobe)
    deep = len(shape)
    axes = [(1,) * (deep - len(x)) + x for x in (wanted.shape, map_axes)]
    apart = all(1 in pair for pair in zip(*axes, strict=True))
    plain = (
        not lobe.is_delta
        and not is_lit(lobe, -1.0)
        and not any(isinstance(field, Channels) for _, field, _, _ in tree.walk(lobe))
    )
    if math.prod(map_axes) <= 1 or not apart or not plain:
        number = np.broadcast_to(np.arange(math.prod(wanted.shape)).reshape(wanted.shape), shape).reshape(-1)
        integrals = wanted.direct(lobe, number, Places(shape, np.arange(len(number))), wanted.tolerance)
        return Integrals(
            integrals.value.reshape(*shape, -1), integrals.error.reshape(shape), integrals.missing.reshape(shape)
        )
    order = [axis for pair in zip(range(deep), range(deep, 2 * deep), strict=True) for axis in pair]

    def arranged(x: np.ndarray) -> np.ndarray:
        """(directions, places, ...) in the shape of the batch."""
        rest = x.shape[2:]
        x = x.reshape(*axes[0], *axes[1], *rest)
        return x.transpose(*order, *range(2 * deep, x.ndim)).reshape(*shape, *rest)

    return Integrals(*map(arranged, _of_maps(lobe, map_axes, wanted)))


def _of_maps(lobe: Reflectance, map_axes: tuple[int, ...], wanted: Wanted) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value (directions, places, C), error and missing (directions, places). Channels that differ by numbers on maps
    alone are treated as places of a map of one channel."""
    channels, places = batch.channels(lobe) or 1, math.prod(map_axes)
    shared = [x for x in tree.leaves(lobe) if np.ndim(x) == 1 and len(x) > 1]
    if not shared and not wanted.coloured:

        def flat(x: Any) -> Any:
            return np.broadcast_to(x, (*map_axes, channels)).reshape(-1, 1) if np.ndim(x) > 1 else x

        value, error, missing = _of_rows(tree.each(lobe, flat), places * channels, wanted)
        shape = len(value), places, channels
        return value.reshape(shape), error.reshape(shape).max(axis=-1), missing.reshape(shape).max(axis=-1)
    parts = []
    for c in range(channels):

        def of_channel(x: Any, c: int = c) -> Any:
            if np.ndim(x) == 0:
                return x
            x = x[..., c : c + 1] if x.shape[-1] > 1 else x
            return np.broadcast_to(x, (*map_axes, 1)).reshape(-1, 1) if x.ndim > 1 else x

        value, error, missing = _of_rows(tree.each(lobe, of_channel), places, wanted)
        parts.append((value[..., c : c + 1] if channels > 1 and value.shape[-1] > 1 else value, error, missing))
    values, errors, absent = zip(*parts, strict=True)
    return np.concatenate(values, axis=-1), np.max(errors, axis=0), np.max(absent, axis=0)


def _of_rows(m: Reflectance, count: int, wanted: Wanted) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value (directions, count, C), error and missing (directions, count), for maps (length, 1)."""
    rows = MaterialRows(m, count)
    exact = factors(m)
    if exact is not None and len(exact) < count:
        return by_factors(rows, [np.broadcast_to(x, count) for x in exact], wanted)
    groups = [by_nodes(rows, wanted.only(k)) for k in range(len(wanted.unit))]
    value, error, missing = (np.stack(x) for x in zip(*groups, strict=True))
    return value, error, missing
