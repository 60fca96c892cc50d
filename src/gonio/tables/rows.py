"""From rows of angles to grids: the grid that rows are the nodes of, or one to interpolate them in."""

from __future__ import annotations

import math

import numpy as np

from .angle_systems import SYSTEMS

ROW_ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
"""What a row of measurements in no grid begins with."""

SAME = 1e-6
"""Angles [rad] closer than this are one node."""

RESOLUTION = {3: (24, 37, 37), 4: (13, 19, 16, 36)}
"""Nodes of the grid, by its number of axes, where the rows do not say which; azimuths of three axes are mirrored."""


def turned(phi: np.ndarray) -> np.ndarray:
    """Azimuths in [0, 2 pi), those that are a whole turn but for rounding at 0."""
    phi = np.mod(phi, 2.0 * math.pi)
    return np.where(phi > 2.0 * math.pi - SAME, 0.0, phi)


def oriented(rows: np.ndarray) -> bool:
    """Whether light came from several azimuths, other than along the normal."""
    phi = turned(rows[rows[:, 0] > SAME, 1])
    return len(distinct(phi)) > 1 if len(phi) else False


def distinct(x: np.ndarray) -> np.ndarray:
    """Increasing numbers, those closer than `SAME` taken as one."""
    x = np.unique(x)
    return x[np.concatenate([[True], np.diff(x) > SAME])]


def _of(nodes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The number of the node that each angle is."""
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    return np.searchsorted(middle, x)


def as_grid(rows: np.ndarray, four: bool) -> tuple[list[np.ndarray], np.ndarray, bool] | None:
    """Nodes of the axes, which row is at each, and whether azimuths are mirrored; None if the rows are no grid."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    if four:
        turns = [(turned(phi_i), theta_i <= SAME), (turned(phi_o), theta_o <= SAME)]
    else:
        phi = turned(phi_o - phi_i)
        turns = [(turned(-phi) if phi[phi > SAME].min(initial=4.0) >= math.pi - SAME else phi, _polar(rows))]
    axes = [distinct(theta_i), distinct(theta_o)]
    axes += [distinct(phi[~free]) if not free.all() else np.zeros(1) for phi, free in turns]
    size = math.prod(map(len, axes))
    if size > 4 * len(rows) + 64:
        return None
    index, taken = np.zeros(tuple(map(len, axes)), int), np.zeros(tuple(map(len, axes)), int)
    first, second = _of(axes[0], theta_i), _of(axes[1], theta_o)
    at = [_of(nodes, phi) for nodes, (phi, _) in zip(axes[2:], turns, strict=True)]
    anywhere = np.any([free for _, free in turns], axis=0)
    one = tuple(x[~anywhere] for x in (first, second, *at))
    index[one] = np.flatnonzero(~anywhere)
    np.add.at(taken, one, 1)
    own = _shared(first, second, at, turns, axes[2:]) & anywhere
    for row in np.flatnonzero(anywhere):
        around = [slice(None) if free[row] and not own[row] else k[row] for k, (_, free) in zip(at, turns, strict=True)]
        index[(first[row], second[row], *around)] = row
        taken[(first[row], second[row], *around)] += 1
    if (taken != 1).any():
        return None
    mirrored = not four and len(axes[2]) > 1 and axes[2][-1] <= math.pi + SAME
    return axes, index, bool(mirrored)


def _shared(first: np.ndarray, second: np.ndarray, at: list, turns: list, nodes: list) -> np.ndarray:
    """Whether a row along the normal is one of several at azimuths that are nodes, as grids are often written out."""
    on_nodes = [np.abs(x[k] - phi) <= SAME for x, k, (phi, _) in zip(nodes, at, turns, strict=True)]
    keys = [np.where(free, -1, k) for k, (_, free) in zip(at, turns, strict=True)]
    place = np.stack([first, second, *keys], axis=1)
    _, which, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
    return np.all(on_nodes, axis=0) & (count[which.reshape(-1)] > 1)


def _polar(rows: np.ndarray) -> np.ndarray:
    """Whether a direction is the normal, so that the azimuth between both is not determined."""
    return (rows[:, 0] <= SAME) | (rows[:, 2] <= SAME)


def grid_for(rows: np.ndarray, four: bool) -> tuple[dict[str, np.ndarray], bool]:
    """Axes of a grid for rows in no grid, and whether its azimuths are mirrored."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    counts = RESOLUTION[4 if four else 3]
    thetas = []
    for theta, count in ((theta_i, counts[0]), (theta_o, counts[1])):
        own = distinct(theta)
        thetas.append(own if len(own) <= count else np.linspace(own[0], own[-1], count))
    if four:
        turns = [2.0 * math.pi * np.arange(n) / n for n in counts[2:]]
        return dict(zip(SYSTEMS["angles"].oriented, [*thetas, *turns], strict=True)), False
    phi = turned(phi_o - phi_i)
    if np.minimum(phi, np.abs(phi - math.pi)).max() <= SAME:  # in the plane of incidence
        return dict(zip(SYSTEMS["angles"].isotropic, [*thetas, np.array([0.0, math.pi])], strict=True)), True
    mirrored = phi.max() <= math.pi + SAME or phi[phi > SAME].min() >= math.pi - SAME
    turn = np.linspace(0.0, math.pi, counts[2]) if mirrored else math.pi * np.arange(2 * counts[2]) / counts[2]
    return dict(zip(SYSTEMS["angles"].isotropic, [*thetas, turn], strict=True)), bool(mirrored)
