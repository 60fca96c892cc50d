"""Where rays meet a shape."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ..formula.direction import Direction


class Hit(NamedTuple):
    """Where rays meet a shape: whether they do, the point, the unit normal and tangent, and the place (u, v) on the
    shape, from 0 to 1, u along the tangent and v down. `face`: the normal of the surface itself, where `normal` is
    smoothed; `distance`: from the origin of the ray. Where they do not, the rest is of any point."""

    met: Any
    point: Direction
    normal: Direction
    tangent: Direction
    u: Any
    v: Any
    face: Direction
    distance: Any


Shape = Callable[[Direction, Direction], Hit]
"""A shape takes the origin and the direction of rays, on components."""
