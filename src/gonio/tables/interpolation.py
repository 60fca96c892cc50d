"""Scattered data interpolation: values at the nodes of a grid from measurements at any pairs of directions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..base.angles import direction
from ..numerics.unique_rows import first_alike, unique_rows
from .rows import SAME

NEIGHBOURS = 24
"""How many of the nearest measurements a value is interpolated from."""

TOGETHER = 1024
"""How many values are interpolated at a time."""

ENOUGH = 10_000
"""Rows, about, that tell the usual distance to the next one."""


def places_of(rows: np.ndarray, four: bool, mirrored: bool) -> np.ndarray:
    """Places of rows: projections of both directions on the surface, turned together if the material is isotropic."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    wi, wo = direction(theta_i, phi_i), direction(theta_o, phi_o if four else phi_o - phi_i)
    if four:
        return np.concatenate([wi[:, :2], wo[:, :2]], axis=-1)
    across = np.abs(wo[:, 1]) if mirrored else wo[:, 1]
    return np.stack([np.sin(theta_i), wo[:, 0], across], axis=-1)


class Rows(NamedTuple):
    """Rows of measurements: angles (n, 4), f (n[, C]) and its standard uncertainty; whether the material turns with
    `four` angles, or is `mirrored`, and what holds `outside` of the rows."""

    angles: np.ndarray
    f: np.ndarray
    u: np.ndarray | None
    four: bool
    mirrored: bool
    outside: str


def interpolated(rows: Rows, axes: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """f (grid...[, C]) at the nodes of a grid, the standard uncertainty of the nearest row, and which row that is.

    Each channel is interpolated from the rows with a number in it; the nearest row returned has one in some channel.
    """
    grid = tuple(map(len, axes.values()))
    shape = (*grid, *rows.f.shape[1:])
    values, spread, nearest = at_angles(rows, angles_of(axes, rows.four))
    return values.reshape(shape), None if spread is None else spread.reshape(shape), nearest.reshape(grid)


def angles_of(axes: Mapping[str, np.ndarray], four: bool) -> np.ndarray:
    """Angles (nodes, 4) of the nodes of a grid, as those of rows."""
    theta_i, theta_o, *phis = (x.reshape(-1) for x in np.meshgrid(*axes.values(), indexing="ij"))
    phi_i, phi_o = phis if four else (0.0 * theta_i, phis[0])
    return np.stack([theta_i, phi_i, theta_o, phi_o], axis=-1)


def at_angles(rows: Rows, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """As `interpolated`, at any angles (m, 4): (m, C), (m, C) and (m,)."""
    known_at, f, u, four, mirrored, outside = rows
    targets = places_of(angles, four, mirrored)
    places, values = places_of(known_at, four, mirrored), f.reshape(len(f), -1)
    spread = None if u is None else u.reshape(values.shape)
    f_there = np.full((len(targets), values.shape[1]), np.nan)
    u_there = None if u is None else f_there.copy()
    known = np.isfinite(values)
    some = known.any(axis=1)
    nearest_of_all = None
    for pattern in known.T[unique_rows(known.T)[0]]:
        channels = (known == pattern[:, None]).all(axis=0)
        if pattern.any():
            at = np.ix_(pattern, channels)
            merged = _merged(places[pattern], values[at], None if spread is None else spread[at])
            f_there[:, channels], nearest = _between(*merged[:2], targets, outside)
            if u_there is not None and merged[2] is not None:
                u_there[:, channels] = merged[2][nearest]
            if (pattern == some).all():
                nearest_of_all = nearest
    if nearest_of_all is None:
        nearest_of_all = _tree(_merged(places[some], values[some], None)[0]).query(targets)[1]
    return f_there, u_there, nearest_of_all


def _tree(places: np.ndarray) -> Any:
    from scipy.spatial import KDTree

    return KDTree(places)


def _between(places: np.ndarray, values: np.ndarray, targets: np.ndarray, outside: str) -> tuple[np.ndarray, ...]:
    """Values (m, C) at the targets, interpolated from those (n, C) at places; and the number of the nearest place."""
    tree = _tree(places)
    distance, nearest = tree.query(targets)
    result = values[nearest]
    if len(places) > 1:
        usual = np.median(tree.query(places[:: -(-len(places) // ENOUGH)], k=2)[0][:, 1])
        near = distance <= 2.0 * usual
        if near.any():
            result[near] = _by_radial_functions(tree, values, targets[near])
        if outside == "missing":
            result[~near] = np.nan
    return result, nearest


def _by_radial_functions(tree: Any, values: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Values (m, C) at the targets, by sum_k c_k |x - x_k| + d through the nearest of the points of a tree, (n, C).

    Source   `scipy.interpolate.RBFInterpolator(kernel="linear", degree=0)`: the same but for rounding, and faster, as
             it solves for many neighbourhoods at once.
    """
    count = min(NEIGHBOURS, len(values))
    result = np.empty((len(targets), values.shape[1]))
    for start in range(0, len(targets), TOGETHER):
        part = slice(start, start + TOGETHER)
        distance, index = tree.query(targets[part], k=count)
        order = np.argsort(index, axis=1)
        distance, index = (np.take_along_axis(x, order, axis=1) for x in (distance, index))
        rows = index.astype(np.int32).view(np.dtype((np.void, 4 * count)))  # one thing each, not `count` fields
        _, first, which = np.unique(rows.reshape(-1), return_index=True, return_inverse=True)
        around = index[first]
        squares = sum((x[:, :, None] - x[:, None]) ** 2 for x in np.moveaxis(tree.data[around], -1, 0))
        system = np.ones((len(around), count + 1, count + 1))
        right = np.zeros((len(around), count + 1, values.shape[1]))
        system[:, :-1, :-1], system[:, -1, -1], right[:, :-1] = np.sqrt(squares), 0.0, values[around]
        c = np.linalg.solve(system, right)
        result[part] = np.einsum("mk,mkc->mc", distance, c[which, :-1]) + c[which, -1]
    return result


def _merged(places: np.ndarray, values: np.ndarray, u: np.ndarray | None) -> tuple[np.ndarray, Any, Any]:
    """Places, values (n, C) and uncertainties of rows; rows at the same place become their mean."""
    rounded = np.round(places / SAME)
    if (first_alike(rounded) == np.arange(len(rounded))).all():
        return places, values, u
    first, which, count = unique_rows(rounded)
    count = count[:, None]
    mean = np.zeros((len(first), values.shape[1]))
    np.add.at(mean, which, values)
    if u is not None:
        squares = np.zeros(mean.shape)
        np.add.at(squares, which, u**2)
        u = np.sqrt(squares) / count
    return places[first], mean / count, u
