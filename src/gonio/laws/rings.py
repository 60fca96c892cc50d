"""A polar grid about the mirror direction, fine enough for lobes of any width: for densities and histograms."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

SECTORS = 192
PARTS, TOGETHER = 8, 4
"""A bin is an eighth of four rings."""

# The quarter circle is an edge, for there seen along the normal is the horizon, where densities may jump.
EDGES = np.concatenate([[0.0], np.geomspace(1e-5, 0.5 * np.pi, 85), np.linspace(0.5, 1.0, 13)[1:] * np.pi])


class Rings(NamedTuple):
    """Directions (K, 3), their solid angles (K,), distances from the mirror direction (K,) and bin numbers (K,)."""

    w: np.ndarray
    solid: np.ndarray
    radius: np.ndarray
    bins: np.ndarray


def mirror_axes(view: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mirror direction of `view` and two axes across it."""
    mirror = view * np.array([-1.0, -1.0, 1.0])
    t = np.array([mirror[2], 0.0, -mirror[0]]) if abs(mirror[0]) < 0.9 else np.array([-mirror[1], mirror[0], 0.0])
    t = t / np.linalg.norm(t)
    return mirror, t, np.cross(mirror, t)


@cache
def _polar() -> tuple[np.ndarray, ...]:
    x, gauss = np.polynomial.legendre.leggauss(4)
    r = 0.5 * (EDGES[:-1, None] + EDGES[1:, None] + (EDGES[1:, None] - EDGES[:-1, None]) * x)
    dr = 0.5 * (EDGES[1:, None] - EDGES[:-1, None]) * gauss
    psi = (np.arange(SECTORS) + 0.5) * (2.0 * np.pi / SECTORS)
    r, dr = r.reshape(-1, 1), dr.reshape(-1, 1)
    ring = np.repeat(np.arange(len(EDGES) - 1), 4)[:, None]
    bins = (ring // TOGETHER) * PARTS + (np.arange(SECTORS) * PARTS // SECTORS)[None, :]
    solid = np.broadcast_to(np.sin(r) * dr * (2.0 * np.pi / SECTORS), bins.shape)
    radius = np.broadcast_to(r, bins.shape)
    along, across, sideways = np.cos(r) + 0.0 * psi, np.sin(r) * np.cos(psi), np.sin(r) * np.sin(psi)
    return tuple(x.reshape(-1) for x in (along, across, sideways, solid, radius, bins))


def rings(view: np.ndarray) -> Rings:
    """The grid for a view: radii are spaced logarithmically; directions below the horizon are among it."""
    along, across, sideways, solid, radius, bins = _polar()
    mirror, t, b = mirror_axes(view)
    w = along[:, None] * mirror + across[:, None] * t + sideways[:, None] * b
    return Rings(w, solid, radius, bins)


def distance(view: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polar coordinates of directions about the mirror direction of `view`: distance [rad] and angle in [0, 2 pi)."""
    mirror, t, b = mirror_axes(view)
    x, y = w @ t, w @ b
    return np.arctan2(np.hypot(x, y), w @ mirror), np.arctan2(y, x) % (2.0 * np.pi)


def bins_of(view: np.ndarray, w: np.ndarray) -> np.ndarray:
    """The bin number of `rings` that each direction falls in."""
    r, psi = distance(view, w)
    ring = np.clip(np.searchsorted(EDGES, r, side="right") - 1, 0, len(EDGES) - 2)
    return (ring // TOGETHER) * PARTS + np.minimum((psi * PARTS / (2.0 * np.pi)).astype(int), PARTS - 1)
