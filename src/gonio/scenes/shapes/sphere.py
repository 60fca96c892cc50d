"""A sphere."""

from __future__ import annotations

import math

from ...arrays import ops
from ...formula.direction import Direction, dot, polar_angle, select
from ..hit import Hit

LOW = -1.0
"""Where it stands on the ground."""


def sphere(o: Direction, d: Direction) -> Hit:
    """The unit sphere; tangents point towards increasing azimuth, east."""
    nearest = o - d * dot(o, d)  # of the ray's line to the centre
    depth2 = 1.0 - dot(nearest, nearest)
    met = (depth2 > 0.0) & (dot(o, d) < 0.0)
    depth = ops.sqrt(ops.maximum(depth2, 1e-12))
    n = select(met, nearest - d * depth, Direction(0.0, -1.0, 0.0))
    ring2 = n.x * n.x + n.y * n.y
    pole = ring2 < 1e-18
    scale = 1.0 / ops.sqrt(ops.where(pole, 1.0, ring2))
    tangent = Direction(ops.where(pole, 1.0, -n.y * scale), ops.where(pole, 0.0, n.x * scale), 0.0)
    u = ops.arctan2(n.y, ops.where(pole, 1.0, n.x)) * (0.5 / math.pi)
    v = polar_angle(n) * (1.0 / math.pi)
    return Hit(met, n, n, tangent, ops.where(u < 0.0, u + 1.0, u), v, n, -dot(o, d) - depth)
