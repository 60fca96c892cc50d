"""An upright cylinder."""

from __future__ import annotations

import math

from ...arrays import ops
from ...formula.direction import Direction, select
from ..hit import Hit

HALF = math.sqrt(0.5)
"""Half its height, and its radius."""
LOW = -HALF
"""Where it stands on the ground."""


def cylinder(o: Direction, d: Direction) -> Hit:
    """The closed cylinder about the z axis, as high as wide, on the unit sphere; tangents point east, on its ends too.

    u = phi/(2 pi); v = (1 - z/h)/2 on the side, with h = sqrt(1/2), and on the ends 1 - r/h: 1 in the middle.
    """
    across2 = d.x * d.x + d.y * d.y
    along = across2 < 1e-12
    a = ops.where(along, 1.0, across2)
    b = o.x * d.x + o.y * d.y
    c = o.x * o.x + o.y * o.y - HALF * HALF
    inside2 = b * b - a * c
    root = ops.sqrt(ops.maximum(inside2, 0.0))
    # Where the ray is within the round wall, and where it is between the ends.
    beside = ~along & (inside2 <= 0.0) | along & (c >= 0.0)
    wall_in, wall_out = ops.where(along, -1e30, (-b - root) / a), ops.where(along, 1e30, (-b + root) / a)
    level = ops.absolute(d.z) < 1e-6
    slope = ops.where(level, 1.0, d.z)
    p, q = (-HALF - o.z) / slope, (HALF - o.z) / slope
    outside = level & (ops.absolute(o.z) >= HALF)
    end_in, end_out = ops.where(level, -1e30, ops.minimum(p, q)), ops.where(level, 1e30, ops.maximum(p, q))
    t = ops.maximum(wall_in, end_in)
    met = ~beside & ~outside & (t < ops.minimum(wall_out, end_out)) & (t > 0.0)
    t = ops.where(met, t, 1.0)
    on_end = end_in > wall_in
    x, y, z = o.x + t * d.x, o.y + t * d.y, o.z + t * d.z
    r2 = x * x + y * y
    axis = r2 < 1e-18
    scale = 1.0 / ops.sqrt(ops.where(axis, 1.0, r2))
    east = Direction(ops.where(axis, 1.0, -y * scale), ops.where(axis, 0.0, x * scale), 0.0)
    cap = Direction(0.0, 0.0, ops.where(d.z < 0.0, 1.0, -1.0) + 0.0 * t)
    n = select(on_end, cap, Direction(east.y, -east.x, 0.0 * t))
    u = ops.arctan2(y, ops.where(axis, 1.0, x)) * (0.5 / math.pi)
    v = ops.where(on_end, 1.0 - ops.sqrt(r2) * (1.0 / HALF), 0.5 - (0.5 / HALF) * z)
    u, v = ops.where(u < 0.0, u + 1.0, u), ops.clip(v, 0.0, 1.0)
    return Hit(met, Direction(x, y, z), n, east, u, v, n, t)
