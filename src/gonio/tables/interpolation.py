"""Scattered data interpolation: values at the nodes of a grid from measurements at any pairs of directions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..base.angles import direction
from .rows import SAME

NEIGHBOURS = 24
"""How many of the nearest measurements a value is interpolated from."""

TOGETHER = 1024
"""How many values are interpolated at a time."""


def _places(rows: np.ndarray, four: bool, mirrored: bool) -> np.ndarray:
    """Where rows lie for interpolation: projections of the directions on the surface, turned together if isotropic."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    wi, wo = direction(theta_i, phi_i), direction(theta_o, phi_o if four else phi_o - phi_i)
    if four:
        return np.concatenate([wi[:, :2], wo[:, :2]], axis=-1)
    across = np.abs(wo[:, 1]) if mirrored else wo[:, 1]
    return np.stack([np.sin(theta_i), wo[:, 0], across], axis=-1)


def interpolated(
    rows: np.ndarray,
    f: np.ndarray,
    spread: np.ndarray | None,
    axes: Mapping[str, np.ndarray],
    four: bool,
    mirrored: bool,
    outside: str,
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """f at the nodes of a grid (grid...[, C]), its standard uncertainty: that of the nearest row; and which that is.

    Each channel is interpolated from the rows with a number in it; the nearest row returned has one in some channel.
    """
    from scipy.spatial import KDTree

    nodes = np.meshgrid(*axes.values(), indexing="ij")
    grid = nodes[0].shape
    theta_i, theta_o, *phis = (x.reshape(-1) for x in nodes)
    phi_i, phi_o = phis if four else (0.0 * theta_i, phis[0])
    wanted = _places(np.stack([theta_i, phi_i, theta_o, phi_o], axis=-1), four, mirrored)
    places, values = _places(rows, four, mirrored), f.reshape(len(f), -1)
    spreads = None if spread is None else spread.reshape(values.shape)
    found = np.full((len(wanted), values.shape[1]), np.nan)
    found_spread = None if spread is None else found.copy()
    known = np.isfinite(values)
    for pattern in np.unique(known, axis=1).T:
        same = (known == pattern[:, None]).all(axis=0)
        if pattern.any():
            at = np.ix_(pattern, same)
            merged = _merged(places[pattern], values[at], None if spreads is None else spreads[at])
            found[:, same], around = _between(*merged[:2], wanted, outside)
            if found_spread is not None and merged[2] is not None:
                found_spread[:, same] = merged[2][around]
    some = known.any(axis=1)
    nearest = KDTree(_merged(places[some], values[some], None)[0]).query(wanted)[1]
    shape = (*grid, *f.shape[1:])
    spread = None if found_spread is None else found_spread.reshape(shape)
    return found.reshape(shape), spread, nearest.reshape(grid)


def _between(places: np.ndarray, values: np.ndarray, wanted: np.ndarray, outside: str) -> tuple[np.ndarray, np.ndarray]:
    """Values (n, C) at the places wanted, interpolated from those at others; and the number of the nearest of these."""
    from scipy.spatial import KDTree

    tree = KDTree(places)
    distance, nearest = tree.query(wanted)
    found = values[nearest]
    if len(places) > 1:
        usual = np.median(tree.query(places, k=2)[0][:, 1])
        near = distance <= 2.0 * usual
        if near.any():
            found[near] = _by_radial_functions(tree, values, wanted[near])
        if outside == "missing":
            found[~near] = np.nan
    return found, nearest


def _by_radial_functions(tree: Any, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Values (m, C) at the places wanted, by sum_k c_k |x - x_k| + d through the nearest of those (n, C) in a tree.

    Source   `scipy.interpolate.RBFInterpolator(kernel="linear", degree=0)`: the same but for rounding, and faster, as
             it solves for many neighbourhoods at once.
    """
    count = min(NEIGHBOURS, len(values))
    found = np.empty((len(wanted), values.shape[1]))
    for start in range(0, len(wanted), TOGETHER):
        part = slice(start, start + TOGETHER)
        distance, index = tree.query(wanted[part], k=count)
        order = np.argsort(index, axis=1)
        distance, index = (np.take_along_axis(x, order, axis=1) for x in (distance, index))
        around, which = np.unique(index, axis=0, return_inverse=True)
        which = which.reshape(-1)
        squares = sum((x[:, :, None] - x[:, None]) ** 2 for x in np.moveaxis(tree.data[around], -1, 0))
        system, right = np.ones((len(around), count + 1, count + 1)), np.zeros((len(around), count + 1, found.shape[1]))
        system[:, :-1, :-1], system[:, -1, -1], right[:, :-1] = np.sqrt(squares), 0.0, values[around]
        c = np.linalg.solve(system, right)
        found[part] = np.einsum("mk,mkc->mc", distance, c[which, :-1]) + c[which, -1]
    return found


def _merged(
    places: np.ndarray, values: np.ndarray, spread: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Rows with those at the same place taken as their mean."""
    _, first, which = np.unique(np.round(places / SAME), axis=0, return_index=True, return_inverse=True)
    which = which.reshape(-1)
    if len(first) == len(places):
        return places, values, spread
    count = np.bincount(which).reshape(-1, *(1,) * (values.ndim - 1))
    mean = np.zeros((len(first), *values.shape[1:]))
    np.add.at(mean, which, values)
    if spread is not None:
        squares = np.zeros(mean.shape)
        np.add.at(squares, which, spread**2)
        spread = np.sqrt(squares) / count
    return places[first], mean / count, spread
