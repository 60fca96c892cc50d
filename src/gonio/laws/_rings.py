"""A polar grid about the mirror direction that ends at the horizon, fine enough for lobes of any width.

The distance from the mirror direction is counted in units of the horizon's, so that no ring is cut by it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..base.sides import hemispheres
from ._probes import VIEWS

SECTORS, NODES = 192, 4
PARTS, TOGETHER = 8, 4
"""A bin is an eighth of four rings."""

# Even rings at the end: lobes that are not about the mirror direction (retroreflection) are found there.
EDGES = np.concatenate([[0.0], np.geomspace(1e-6, 0.2, 60), np.linspace(0.2, 1.0, 41)[1:]])


class _RingGrid(NamedTuple):
    """Directions (K, 3), their solid angles (K,) and bin numbers (K,)."""

    w: np.ndarray
    solid: np.ndarray
    bins: np.ndarray


def _axes(view: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mirror direction of `view` and two axes across it."""
    mirror = view * np.array([-1.0, -1.0, 1.0])
    t = np.array([mirror[2], 0.0, -mirror[0]]) if abs(mirror[0]) < 0.9 else np.array([-mirror[1], mirror[0], 0.0])
    t = t / np.linalg.norm(t)
    return mirror, t, np.cross(mirror, t)


def _horizon(view: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """The distance [rad] of the horizon from the mirror direction, on the way psi [rad]."""
    mirror, t, b = _axes(view)
    return np.arctan2(mirror[2], -(np.cos(psi) * t[2] + np.sin(psi) * b[2]))


def around(view: np.ndarray, r: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Directions (..., 3) at distances r from the mirror direction of `view`, on the ways psi [rad]."""
    mirror, t, b = _axes(view)
    r, psi = r[..., None], psi[..., None]
    return np.cos(r) * mirror + np.sin(r) * (np.cos(psi) * t + np.sin(psi) * b)


def rings(view: np.ndarray) -> _RingGrid:
    """The grid for a view."""
    psi = ((np.arange(SECTORS) + 0.5) * 2.0 * np.pi / SECTORS)[:, None]
    x, gauss = np.polynomial.legendre.leggauss(NODES)
    half, middle = 0.5 * np.diff(EDGES)[:, None], 0.5 * (EDGES[1:] + EDGES[:-1])[:, None]
    end = _horizon(view, psi)
    r, dr = end * (middle + half * x).ravel(), end * (half * gauss).ravel()
    w = around(view, r, psi)
    ring = np.arange(r.shape[1]) // (NODES * TOGETHER)
    bins = ring * PARTS + np.arange(SECTORS)[:, None] * PARTS // SECTORS
    solid = np.sin(r) * dr * (2.0 * np.pi / SECTORS)
    return _RingGrid(w.reshape(-1, 3), solid.ravel(), bins.ravel())


@cache
def grids() -> list[tuple[np.ndarray, _RingGrid]]:
    """Views (3,) at VIEWS, and the grid of each."""
    return [(view, rings(view)) for view in direction(VIEWS, 0.3)]


class _BinnedView(NamedTuple):
    """A view, the grid for it, and a function that finds the bin numbers of directions."""

    view: np.ndarray
    grid: _RingGrid
    bins_of: Callable[[np.ndarray], np.ndarray]


def places(m: Reflectance) -> Iterator[_BinnedView]:
    """The views and grids for a material: above the surface; of one that transmits the sphere, seen from both sides.

    The grid below is about the direction that a plane surface of the material's index refracts.
    """
    sides, index = hemispheres(m), float(np.mean(m.index))
    for z in sides:
        n = index if z > 0.0 else 1.0 / index
        for view, grid in grids():
            yield _seen_from(z, view, grid, [_refracted(view, n) for _ in sides[1:]])


def _refracted(view: np.ndarray, index: float) -> np.ndarray:
    """The view that is mirrored to where the light comes from which a plane surface refracts into `view`."""
    there = view / index
    across = there[0] ** 2 + there[1] ** 2
    return view if across >= 1.0 else np.array([there[0], there[1], np.sqrt(1.0 - across)])


def _seen_from(z: float, view: np.ndarray, above: _RingGrid, below: Sequence[np.ndarray]) -> _BinnedView:
    """A view from the side z, with the grid above and one below for each of these mirrored views."""
    turn, down, first = np.array([z, 1.0, z]), np.array([1.0, 1.0, -1.0]), int(above.bins.max()) + 1
    grids = [above, *(_RingGrid(w * down, solid, bins + first) for w, solid, bins in map(rings, below))]
    w, solid, bins = map(np.concatenate, zip(*grids, strict=True))

    def numbers(w: np.ndarray) -> np.ndarray:
        w = w * turn
        bin_of = bins_of(view, w)
        for straight in below:
            bin_of = np.where(w[:, 2] < 0.0, bins_of(straight, w * down) + first, bin_of)
        return bin_of

    return _BinnedView(view * turn, _RingGrid(w * turn, solid, bins), numbers)


def distance(view: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polar coordinates of directions about the mirror direction of `view`: distance [rad] and angle in [0, 2 pi)."""
    mirror, t, b = _axes(view)
    x, y = w @ t, w @ b
    return np.arctan2(np.hypot(x, y), w @ mirror), np.arctan2(y, x) % (2.0 * np.pi)


def bins_of(view: np.ndarray, w: np.ndarray) -> np.ndarray:
    """The bin number of `rings` that each direction falls in."""
    r, psi = distance(view, w)
    ring = np.clip(np.searchsorted(EDGES, r / _horizon(view, psi), side="right") - 1, 0, len(EDGES) - 2)
    return (ring // TOGETHER) * PARTS + np.minimum((psi * PARTS / (2.0 * np.pi)).astype(int), PARTS - 1)
