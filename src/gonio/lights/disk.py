"""A disk that shines evenly: a round lamp, the opening of an integrating sphere."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.frames import Frame
from ..base.light import Light
from ..formula.direction import Direction, dot, normalize, on_circle
from ..formula.fields import param
from ..formula.projected import disk_projected
from ..formula.world import vector
from ._flat import by_area, met, shines, sides


class DiskLight(Light):
    r"""Disk of constant radiance: $E = \pi L r^2/(r^2 + h^2)$ on its axis at distance h, for a surface parallel to it;
    everywhere L times the projected solid angle of what is above the horizon.

    It shines to the side of its normal. `sample` is uniform in area.

    Looks    `DiskLight([-1.3, -1.3, 1.7], [1.0, 1.0, -1.2], 0.8, 6.0)`: a round window in the metal, a pool on the
             floor.
    Shapes   centre, normal: (3,), the normal of any length; radius: a number; radiance: a number or (C,).
    Units    centre, radius: m; radiance: W m-2 sr-1.
    Error    rounding.
    Source   irradiance: the contour integral, see `gonio.formula.projected`.

    Example
    >>> lamp = gn.DiskLight([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], radius=1.0, radiance=2.0)
    >>> print(gn.irradiance(lamp, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).round(4))  # pi
    3.1416
    """

    centre = vector((0.0, 0.0, 1.0), "its centre [m]")
    normal = vector((0.0, 0.0, -1.0), "where it shines to", unit=True)
    radius = param(0.5, 1e-30, 1e30, "radius", unit="m")
    radiance = param(1.0, 0.0, 1e30, "radiance", unit="W m-2 sr-1")
    sides = sides()

    has_edges: ClassVar[bool] = True
    can_sample: ClassVar[bool] = True

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        m = met(p, w, self.centre.vector, self.normal.unit)
        within = dot(m.at, m.at) <= self.radius * self.radius
        return ops.where(m.ahead & within & shines(self.sides, m.in_front), self.radiance, 0.0), m.distance

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        at = Frame.of(self.normal.unit).world(on_circle(self.radius * ops.sqrt(u1), u0, 0.0 * u1))
        return normalize(self.centre.vector + at - p)

    def density(self, p: Direction, w: Direction) -> Any:
        m = met(p, w, self.centre.vector, self.normal.unit)
        r2 = self.radius * self.radius
        return ops.where(dot(m.at, m.at) <= r2 * (1.0 + 1e-5), by_area(m, math.pi * r2), 0.0)

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        to, axis = self.centre.vector - p, self.normal.unit
        projected = ops.absolute(disk_projected(to, axis, self.radius, n))
        return self.radiance * ops.where(shines(self.sides, dot(to, axis) < 0.0), projected, 0.0)

    def holds(self, p: Direction) -> Any:
        to = self.centre.vector - p
        return (dot(to, self.normal.unit) == 0.0) & (dot(to, to) <= self.radius * self.radius)

    def strength(self, p: Direction) -> Any:
        to, axis = self.centre.vector - p, self.normal.unit
        height, d2 = dot(to, axis), dot(to, to)
        towards = ops.where(shines(self.sides, height < 0.0), ops.absolute(height), 0.0) / ops.sqrt(d2)
        return math.pi * self.radiance * towards * self.radius * self.radius / (d2 + self.radius * self.radius)
