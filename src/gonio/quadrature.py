"""Nodes and weights on the unit square: Gauss–Legendre products for smooth functions, a lattice for the others."""

from __future__ import annotations

from functools import cache

import numpy as np


@cache
def gauss_square(n: int, seam: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 2) and weights (N,) of an n by n Gauss–Legendre product on the unit square.

    A `seam` in (0, 1) splits the first axis in two panels there, n nodes each: for maps that jump at that value.
    """
    t, w = np.polynomial.legendre.leggauss(n)
    t, w = 0.5 * (t + 1.0), 0.5 * w
    u, wu = t, w
    if 0.0 < seam < 1.0:
        u = np.concatenate([seam * t, seam + (1.0 - seam) * t])
        wu = np.concatenate([seam * w, (1.0 - seam) * w])
    nodes = np.stack(np.broadcast_arrays(u[:, None], t[None, :]), -1).reshape(-1, 2)
    weights = (wu[:, None] * w[None, :]).reshape(-1)
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights


@cache
def lattice(n: int, dimensions: int = 2) -> np.ndarray:
    """n points (n, dimensions) of the unit cube, evenly spread in all its dimensions at every n.

    Point k is the fractional part of 1/2 + k (1/g, 1/g^2, ...), g^(d + 1) = g + 1. Two such sequences side by side
    differ by a constant, so they fill a surface only: what needs four numbers asks for four dimensions.

    Source: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences" (R_d sequence).
    """
    g = 2.0
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (dimensions + 1))
    k = np.arange(1, n + 1)[:, None]
    points = (0.5 + k * g ** -np.arange(1.0, dimensions + 1)) % 1.0
    points.flags.writeable = False
    return points
