"""Points spread evenly over the unit cube, in any number of dimensions."""

from __future__ import annotations

import numpy as np

from ..machine.caches import kept


@kept
def lattice(n: int, dimensions: int = 2) -> np.ndarray:
    """n points (n, dimensions) of the unit cube, evenly spread in all its dimensions at every n.

    Point k is the fractional part of 1/2 + k (1/g, 1/g^2, ...), g^(d + 1) = g + 1. For four numbers ask for four
    dimensions: two lattices of two dimensions differ by a constant, and fill only a surface.

    Source: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences" (R_d sequence).
    """
    g = 2.0
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (dimensions + 1))
    k = np.arange(1, n + 1)[:, None]
    points = (0.5 + k * g ** -np.arange(1.0, dimensions + 1)) % 1.0
    points.flags.writeable = False
    return points
