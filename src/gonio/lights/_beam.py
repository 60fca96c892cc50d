"""Beams from a place: what lights without extent share."""

from __future__ import annotations

from typing import Any

from ..arrays import ops
from ..formula.direction import Direction, dot


def to_place(place: Direction, p: Direction) -> tuple[Direction, Any, Any]:
    """From p to a place: the unit direction, the squared distance, and the distance."""
    to = place - p
    r2 = dot(to, to)
    r = ops.sqrt(r2)
    return to / r, r2, r


def is_at(place: Direction, p: Direction) -> Any:
    """Whether p is that place, from where it has no direction."""
    to = place - p
    return dot(to, to) == 0.0
