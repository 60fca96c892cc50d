"""The angle between light and viewer, on which the models of natural surfaces depend."""

from __future__ import annotations

from typing import Any

from ..arrays import ops
from ..formula.direction import Direction, length


def phase_angle(wi: Direction, wo: Direction) -> Any:
    """Angle between two directions [rad] in [0, pi], without cancellation where it is small; 0 is back-scatter."""
    return 2.0 * ops.arctan2(length(wi - wo), length(wi + wo))
