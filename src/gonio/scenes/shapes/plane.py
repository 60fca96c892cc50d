"""A square that faces the camera."""

from __future__ import annotations

import math

from ...arrays import ops
from ...formula.direction import Direction
from ..hit import Hit

HALF = math.sqrt(0.5)
LOW = -HALF
"""Where it stands on the ground."""


def plane(o: Direction, d: Direction) -> Hit:
    """The square of half-diagonal 1 in y = 0, its front towards -y; tangents point to the right.

    u = (x/h + 1)/2 and v = (1 - z/h)/2, with h = sqrt(1/2).
    """
    ahead = ops.absolute(d.y) > 1e-6
    t = -o.y / ops.where(ahead, d.y, 1.0)
    x, z = o.x + t * d.x, o.z + t * d.z
    met = ahead & (t > 0.0) & (ops.absolute(x) < HALF) & (ops.absolute(z) < HALF)
    front, right = Direction(0.0, -1.0, 0.0), Direction(1.0, 0.0, 0.0)
    u, v = (ops.clip(0.5 + (0.5 / HALF) * a, 0.0, 1.0) for a in (x, -z))
    return Hit(met, Direction(x, 0.0 * t, z), front, right, u, v, front, t)
