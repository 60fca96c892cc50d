"""Directions spread evenly over a cone, told by the squared sine of its half angle: small cones keep their digits."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.frames import Frame
from ..formula.direction import Direction, cross, dot, on_circle


def cone_solid_angle(sin2: Any) -> Any:
    """2 pi (1 - cos) [sr] of a cone of at most 90 degrees."""
    return 2.0 * math.pi * sin2 / (1.0 + ops.sqrt(1.0 - sin2))


def cone(axis: Direction, sin2: Any, u0: Any, u1: Any) -> Direction:
    """A direction within the cone about a unit vector."""
    down = u1 * (sin2 / (1.0 + ops.sqrt(1.0 - sin2)))  # 1 - cos
    radius = ops.sqrt(ops.maximum(down * (2.0 - down), 0.0))
    return Frame.of(axis).world(on_circle(radius, u0, 1.0 - down))


def in_cone(axis: Direction, sin2: Any, w: Direction) -> Any:
    """Whether w is in the cone; those of `cone` are, after rounding to single precision, which moves each by 1e-7."""
    across = cross(axis, w)
    rounding = 2e-7 * ops.sqrt(sin2) + 1e-14
    return (dot(axis, w) > 0.0) & (dot(across, across) <= sin2 * (1.0 + 1e-5) + rounding)


def upper_hemisphere(u0: Any, u1: Any) -> Direction:
    """A direction that is uniform over the upper half of the sphere."""
    return on_circle(ops.sqrt(ops.maximum(u1 * (2.0 - u1), 0.0)), u0, 1.0 - u1)


def upper_hemisphere_density(w: Direction) -> Any:
    """Its density [1/sr]."""
    return ops.where(w.z >= 0.0, 0.5 / math.pi, 0.0)
