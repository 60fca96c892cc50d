"""A disk that faces the camera."""

from __future__ import annotations

import math

from ...arrays import ops
from ...formula.direction import Direction
from ..hit import Hit

LOW = -1.0
"""Where it stands on the ground."""


def disk(o: Direction, d: Direction) -> Hit:
    """The unit disk in y = 0, its front towards -y; tangents run around it, counterclockwise as seen.

    u = phi/(2 pi), from the right counterclockwise, and v = 1 - r: 1 in the middle, 0 at the rim.
    """
    ahead = ops.absolute(d.y) > 1e-6
    t = -o.y / ops.where(ahead, d.y, 1.0)
    x, z = o.x + t * d.x, o.z + t * d.z
    r2 = x * x + z * z
    met = ahead & (t > 0.0) & (r2 < 1.0)
    middle = r2 < 1e-18
    r = ops.sqrt(ops.where(middle, 1e-18, r2))
    front = Direction(0.0, -1.0, 0.0)
    around = Direction(ops.where(middle, 1.0, -z / r), 0.0, ops.where(middle, 0.0, x / r))
    u = ops.arctan2(z, ops.where(middle, 1.0, x)) * (0.5 / math.pi)
    v = ops.clip(1.0 - r, 0.0, 1.0)
    return Hit(met, Direction(x, 0.0 * t, z), front, around, ops.where(u < 0.0, u + 1.0, u), v, front, t)
