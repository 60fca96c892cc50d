"""The angle between light and viewer, on which the models of natural surfaces depend."""

from __future__ import annotations

from typing import Any

from ..arrays import ops
from ..formula.direction import Direction, add, dot


def difference(a: Direction, b: Direction) -> Direction:
    """a - b."""
    return Direction(a.x - b.x, a.y - b.y, a.z - b.z)


def length(a: Direction) -> Any:
    """|a|, with a finite derivative at 0."""
    return ops.sqrt(dot(a, a) + 1e-30)


def phase_angle(wi: Direction, wo: Direction) -> Any:
    """Angle between two directions [rad] in [0, pi], without cancellation where it is small; 0 is back-scatter."""
    return 2.0 * ops.arctan2(length(difference(wi, wo)), length(add(wi, wo)))
