"""From rows of angles to grids: the grid whose nodes the rows are, or one to interpolate them in."""

from __future__ import annotations

import math

import numpy as np

from ..numerics.unique_rows import unique_rows
from .angle_systems import SYSTEMS

ROW_ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
"""The angles of a row, in this order."""

SAME = 1e-6
"""Angles [rad] closer than this are one node."""

RESOLUTION = {3: (24, 37, 37), 4: (13, 19, 16, 36)}
"""Nodes of the grid for rows in no grid, by its number of axes; azimuths of three axes are mirrored."""


def turned(phi: np.ndarray, same: float = SAME) -> np.ndarray:
    """Azimuths in [0, 2 pi), those closer than `same` to a whole turn at 0."""
    phi = np.mod(phi, 2.0 * math.pi)
    return np.where(phi > 2.0 * math.pi - same, 0.0, phi)


def distinct(x: np.ndarray, same: float = SAME) -> np.ndarray:
    """Increasing numbers, those closer than `same` once."""
    x = np.unique(x)
    return x[np.diff(x, prepend=-math.inf) > same]


def oriented(rows: np.ndarray) -> bool:
    """Whether light came from several azimuths, other than along the normal."""
    return len(distinct(turned(rows[rows[:, 0] > SAME, 1]))) > 1


def as_grid(rows: np.ndarray, four: bool) -> tuple[list[np.ndarray], np.ndarray, bool] | None:
    """Nodes of the axes, the row at each node, and whether azimuths are mirrored; None if the rows fill no grid."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    if four:
        azimuths, free = [turned(phi_i), turned(phi_o)], [theta_i <= SAME, theta_o <= SAME]
    else:
        phi = turned(phi_o - phi_i)
        on_one_side = phi[phi > SAME].min(initial=4.0) >= math.pi - SAME
        azimuths, free = [turned(-phi) if on_one_side else phi], [(theta_i <= SAME) | (theta_o <= SAME)]
    axes = [distinct(theta_i), distinct(theta_o)]
    axes += [distinct(phi[~pole]) if not pole.all() else np.zeros(1) for phi, pole in zip(azimuths, free, strict=True)]
    shape = tuple(map(len, axes))
    if math.prod(shape) > 4 * len(rows) + 64:
        return None
    angles = [theta_i, theta_o, *azimuths]
    at = [np.searchsorted(0.5 * (x[1:] + x[:-1]), angle) for x, angle in zip(axes, angles, strict=True)]
    single = ~np.any(free, axis=0) | _written_out(at, axes, azimuths, free)
    index, rows_at = np.zeros(shape, int), np.zeros(shape, int)
    nodes = tuple(number[single] for number in at)
    index[nodes] = np.flatnonzero(single)
    np.add.at(rows_at, nodes, 1)
    for row in np.flatnonzero(~single):  # along the normal, where one row stands for all azimuths
        around = [slice(None) if pole[row] else k[row] for k, pole in zip(at[2:], free, strict=True)]
        index[at[0][row], at[1][row], *around] = row
        rows_at[at[0][row], at[1][row], *around] += 1
    if (rows_at != 1).any():
        return None
    return axes, index, not four and len(axes[2]) > 1 and bool(axes[2][-1] <= math.pi + SAME)


def _written_out(at: list, axes: list, azimuths: list, free: list) -> np.ndarray:
    """Whether a row along the normal is one of several there, each at azimuths that are nodes."""
    on_nodes = [np.abs(x[k] - phi) <= SAME for x, k, phi in zip(axes[2:], at[2:], azimuths, strict=True)]
    places = np.stack([*at[:2], *(np.where(pole, -1, k) for k, pole in zip(at[2:], free, strict=True))], axis=1)
    _, place, count = unique_rows(places)
    return np.all(on_nodes, axis=0) & (count[place] > 1)


def grid_for(rows: np.ndarray, four: bool) -> tuple[dict[str, np.ndarray], bool]:
    """Axes of a grid to interpolate rows in, and whether its azimuths are mirrored."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    counts = RESOLUTION[4 if four else 3]
    axes = []
    for theta, count in ((theta_i, counts[0]), (theta_o, counts[1])):
        nodes = distinct(theta)
        axes.append(nodes if len(nodes) <= count else np.linspace(nodes[0], nodes[-1], count))
    mirrored = False
    if four:
        axes += [2.0 * math.pi * np.arange(n) / n for n in counts[2:]]
    else:
        phi = turned(phi_o - phi_i)
        in_plane = np.minimum(phi, np.abs(phi - math.pi)).max() <= SAME
        mirrored = bool(in_plane or phi.max() <= math.pi + SAME or phi[phi > SAME].min() >= math.pi - SAME)
        if mirrored:
            axes.append(np.linspace(0.0, math.pi, 2 if in_plane else counts[2]))
        else:
            axes.append(math.pi * np.arange(2 * counts[2]) / counts[2])
    return dict(zip(SYSTEMS["angles"].axes(four), axes, strict=True)), mirrored
