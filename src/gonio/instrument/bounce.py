"""A bounce of many rays: to the next facet, or out into a cell of directions; and off the facet. A kernel for each."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..arrays.kinds import SCALAR, VALUE, VECTOR
from ..base import kernels
from ..evaluate.computation import Computation
from ..evaluate.tracing import Kernel
from ..formula.direction import Direction, dot, frame, normalize, polar_angle, reflect
from .march import RayPlace, facet, march

UNDERWAY, LOST, INSIDE = -3.0, -2.0, -1.0
"""Instead of the cell of directions that a ray leaves into: it has not come to an end, its mirror turns it inwards, or
it is on a facet."""


def _start(scene: Any, point: Any) -> RayPlace:
    """The place of a ray as high as the highest corner, at a point of the unit square, shifted."""
    x, y = point[0] + scene.shift_x, point[1] + scene.shift_y
    x, y = (x - ops.floor(x)) * scene.columns, (y - ops.floor(y)) * scene.rows
    column, row = ops.minimum(ops.floor(x), scene.columns - 1.0), ops.minimum(ops.floor(y), scene.rows - 1.0)
    return RayPlace(column, row, x - column, y - row, scene.highest + 0.0 * x)


def _cell_of(scene: Any, w: Direction) -> Any:
    """The number of the cell of directions; azimuths count from that of the incident light."""
    ring = ops.minimum(ops.floor(polar_angle(w) * scene.per_theta + 0.5), scene.rings - 1.0)
    flat = w.x * w.x + w.y * w.y < 1e-12
    across = ops.where(flat, 0.0, scene.cos_phi * w.y - scene.sin_phi * w.x)
    along = ops.where(flat, 1.0, scene.cos_phi * w.x + scene.sin_phi * w.y)
    sector = ops.floor(ops.arctan2(across, along) * scene.sectors * (0.5 / math.pi) + 0.5)
    sector = ops.where(sector < 0.0, sector + scene.sectors, sector)
    return ring * scene.sectors + ops.where(sector >= scene.sectors, 0.0, sector)


def _onward(scene: Any, place: RayPlace, w: Direction, mirrors: bool, leaves: bool) -> tuple[Any, ...]:
    """A ray from a place along w: where it is, the cell that it left into, and where a mirror there turns it.

    `leaves`: whether it may leave.
    """
    place, right, met, left = march(scene, place, w)
    bin = ops.where(met, INSIDE, ops.where(left, _cell_of(scene, w), UNDERWAY) if leaves else UNDERWAY)
    if mirrors:
        n, on = facet(scene, place, right)
        mirrored = normalize(reflect(-w, n))
        bin = ops.where(met & (dot(mirrored, n) <= 0.0), LOST, bin)
        place = place._replace(z=ops.where(met, on.z, place.z))
        w = Direction(*(ops.where(met, a, b) for a, b in zip(mirrored, w, strict=True)))
    stop = (place.column, place.row, place.z), (place.u, place.v, right), bin
    return (*stop, tuple(w)) if mirrors else stop


def _enter(mirrors: bool) -> Kernel:
    def enter(scene: Any, mean: Any, point: Any) -> tuple[Any, ...]:
        w = Direction(-scene.wi_x, -scene.wi_y, -scene.wi_z)
        return _onward(scene, _start(scene, point), w, mirrors, leaves=False)

    return enter


def _go_on(mirrors: bool) -> Kernel:
    def go_on(scene: Any, mean: Any, spot: Any, inside: Any, w: Any) -> tuple[Any, ...]:
        place = RayPlace(spot[0], spot[1], inside[0], inside[1], spot[2])
        return _onward(scene, place, Direction(*w), mirrors, leaves=True)

    return go_on


def _sampled(scene: Any, mean: Any, spot: Any, inside: Any, w: Any, u: Any) -> tuple[Any, ...]:
    n, place = facet(scene, RayPlace(spot[0], spot[1], inside[0], inside[1], spot[2]), inside[2])
    t, b = frame(n)
    d = Direction(*w)
    wo = Direction(-dot(d, t), -dot(d, b), -dot(d, n))
    wi, weight, pdf, _ = kernels.sample(scene.facet, mean.facet, wo, u)
    onward, goes_on = normalize(t * wi.x + b * wi.y + n * wi.z), pdf > 0.0
    # What is not reflected leaves along the normal, without light.
    up = (ops.where(goes_on, x, y) for x, y in zip(onward, (0.0, 0.0, 1.0), strict=True))
    return (place.column, place.row, place.z), tuple(up), ops.where(goes_on, weight, 0.0)


_RAY, _PLACED = {"spot": 3, "inside": 3, "w": 3}, {"spot": VECTOR, "inside": VECTOR, "bin": SCALAR}

_TURNED = {**_PLACED, "w": VECTOR}

ENTER = {
    mirrors: Computation(_enter(mirrors), {"point": 2}, _TURNED if mirrors else _PLACED) for mirrors in (False, True)
}
"""From the source to the first facet; of facets that are mirrors, where they turn a ray, too."""

GO_ON = {mirrors: Computation(_go_on(mirrors), _RAY, _TURNED if mirrors else _PLACED) for mirrors in (False, True)}
"""From a facet, or on the way, to the next facet or out; likewise."""

SAMPLE = Computation(_sampled, {**_RAY, "u": 2}, {"spot": VECTOR, "w": VECTOR, "weight": VALUE})
"""Off a facet of any reflectance: in a direction by chance, and the share of light left."""
