"""What flat lights share: where a direction meets their plane, which side shines, densities of points on them."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..arrays import ops
from ..errors import ParameterError
from ..formula.direction import Direction, dot
from ..formula.fields import option

SMALL = 0.1
"""The solid angle [sr] below which points of a flat light are drawn by area, which makes little difference there: in
single precision the angles of small spherical figures have too few digits."""


def sides() -> Any:
    """The field that says which sides shine."""
    return option("front", "both", doc="which sides shine: the one that its normal points from, or both")


class Met(NamedTuple):
    """Where directions from p meet a plane: the distance, |cos| between direction and normal, whether they meet it,
    whether p is on the side of its normal, and the point, from the plane's centre."""

    distance: Any
    cos: Any
    ahead: Any
    in_front: Any
    at: Direction


def met(p: Direction, w: Direction, centre: Direction, normal: Direction) -> Met:
    """See `Met`."""
    to = centre - p
    height, slope = dot(to, normal), dot(w, normal)
    ahead = height * slope > 0.0
    t = ops.where(ahead, height / ops.where(ahead, slope, 1.0), 1.0)
    return Met(t, ops.absolute(slope), ahead, height < 0.0, w * t - to)


def shines(side: str, in_front: Any) -> Any:
    """Whether the side that a point is on shines."""
    return in_front if side == "front" else in_front | ~in_front


def by_area(m: Met, area: Any) -> Any:
    """The density [1/sr] of directions to points spread evenly over an area."""
    return ops.where(m.ahead, m.distance * m.distance / (area * ops.where(m.ahead, m.cos, 1.0)), 0.0)


def refuse_flat(kind: str, area: float, scale: float) -> None:
    """Raises ParameterError for a light without area."""
    if not area > 1e-12 * scale:
        raise ParameterError(f"{kind}: its area is {area:g} m2; expected edges that span one")
