"""A sphere that shines evenly: a globe lamp."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.light import Light
from ..formula.direction import Direction, cross, dot
from ..formula.fields import param
from ..formula.projected import disk_projected
from ..formula.world import vector
from ._cone import cone, cone_solid_angle, in_cone


class SphereLight(Light):
    r"""Sphere of constant radiance: $E = \pi L (r/d)^2 \cos\theta$ at distance d of its centre, where it is above the
    horizon; else the projected solid angle of the part that is.

    It shines outwards; inside it is dark. `sample` is uniform in the cone that it fills.

    Looks    `SphereLight([-1.2, -1.1, 1.6], 0.6, 8.0)`, a globe, which is round from everywhere.
    Shapes   centre: (3,); radius: a number; radiance: a number or (C,).
    Units    centre, radius: m; radiance: W m-2 sr-1.
    Error    rounding.
    Source   a sphere looks like the disk that fills the same cone, see `gonio.formula.projected`.

    Example
    >>> lamp = gn.SphereLight([0.0, 0.0, 2.0], radius=0.5, radiance=4.0)
    >>> print(gn.irradiance(lamp, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).round(4))  # pi 4 (0.5/2)^2
    0.7854
    """

    centre = vector((0.0, 0.0, 2.0), "its centre [m]")
    radius = param(0.5, 1e-30, 1e30, "radius", unit="m")
    radiance = param(1.0, 0.0, 1e30, "radiance", unit="W m-2 sr-1")

    has_edges: ClassVar[bool] = True
    can_sample: ClassVar[bool] = True

    def _cone(self, p: Direction) -> tuple[Direction, Any, Any]:
        """The direction to the centre, the squared sine of the half angle, and the distance."""
        to = self.centre.vector - p
        d2 = dot(to, to)
        distance = ops.sqrt(d2)
        return to / distance, ops.minimum(self.radius * self.radius / d2, 1.0), distance

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        to = self.centre.vector - p
        across = cross(w, to)
        deep = self.radius * self.radius - dot(across, across)
        along = dot(w, to)
        hit = (deep > 0.0) & (along > 0.0) & (dot(to, to) > self.radius * self.radius)
        return ops.where(hit, self.radiance, 0.0), along - ops.sqrt(ops.where(hit, deep, 0.0) + 1e-30)

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        axis, sin2, _ = self._cone(p)
        return cone(axis, sin2, u0, u1)

    def density(self, p: Direction, w: Direction) -> Any:
        axis, sin2, _ = self._cone(p)
        return ops.where(in_cone(axis, sin2, w), 1.0 / cone_solid_angle(sin2), 0.0)

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        axis, sin2, _ = self._cone(p)
        outside = sin2 < 1.0
        tan = ops.sqrt(sin2 / ops.where(outside, 1.0 - sin2, 1.0))
        return self.radiance * ops.where(outside, disk_projected(axis, axis, tan, n), 0.0)

    def holds(self, p: Direction) -> Any:
        to = self.centre.vector - p
        return dot(to, to) <= self.radius * self.radius

    def strength(self, p: Direction) -> Any:
        return math.pi * self.radiance * self._cone(p)[1]
