"""A rectangle that shines evenly: a panel, a window, a screen."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from ..arrays import ops
from ..base.light import Light
from ..errors import ParameterError
from ..formula.direction import Direction, cross, dot, normalize
from ..formula.fields import param
from ..formula.projected import polygon_projected, triangle_solid_angle
from ..formula.world import vector
from ._flat import SMALL, by_area, met, refuse_flat, shines, sides


class RectangleLight(Light):
    """Rectangle of constant radiance: E = L times the projected solid angle of what is above the horizon.

    It shines to the side of edge_x x edge_y. `sample` is uniform in solid angle; below 0.1 sr, in area.

    Looks    `RectangleLight([-1.5, -1.5, 1.5], [1.2, -1.2, 0.0], [-0.7, -0.7, -1.2], 5.0)`, a soft box: the highlight
             has its corners.
    Shapes   centre, edge_x, edge_y: (3,), the edges as long as the sides; radiance: a number or (C,).
    Units    centre, edges: m; radiance: W m-2 sr-1.
    Error    rounding; irradiance in float32: 1e-6 of L times the angle between the edges.
    Source   sampling: Urena, Fajardo & King 2013, "An area-preserving parametrization for spherical rectangles", CGF
             32(4):59. Irradiance: Lambert 1760, see `gonio.formula.projected`.

    Example
    >>> panel = gn.RectangleLight([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], radiance=2.0)
    >>> print(gn.irradiance(panel, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).round(4))
    1.5045
    """

    centre = vector((0.0, 0.0, 1.0), "its centre [m]")
    edge_x = vector((1.0, 0.0, 0.0), "one side [m]", is_place=False)
    edge_y = vector((0.0, -1.0, 0.0), "the other side, perpendicular to it [m]", is_place=False)
    radiance = param(1.0, 0.0, 1e30, "radiance", unit="W m-2 sr-1")
    sides = sides()

    has_edges: ClassVar[bool] = True
    can_sample: ClassVar[bool] = True

    def validate(self) -> None:
        if self.like() is not None:
            return
        x, y = np.asarray(self.edge_x), np.asarray(self.edge_y)
        longest = max(x @ x, y @ y)
        refuse_flat("RectangleLight", float(np.linalg.norm(np.cross(x, y))), float(longest))
        if abs(x @ y) > 1e-6 * longest:
            angle = math.degrees(math.acos(x @ y / math.sqrt((x @ x) * (y @ y))))
            raise ParameterError(
                f"RectangleLight: its sides make an angle of {angle:.4g} degrees, expected 90; "
                f"gn.PolygonLight takes any corners"
            )

    @property
    def _axes(self) -> tuple[Direction, Direction, Direction, Any, Any]:
        """Unit vectors along the sides and of the normal, and the lengths of the sides."""
        x, y = self.edge_x.vector, self.edge_y.vector
        return normalize(x), normalize(y), normalize(cross(x, y)), ops.sqrt(dot(x, x)), ops.sqrt(dot(y, y))

    def _corners(self, p: Direction) -> list[Direction]:
        """The corners, in turn, as seen from p."""
        to, x, y = self.centre.vector - p, 0.5 * self.edge_x.vector, 0.5 * self.edge_y.vector
        return [to - x - y, to + x - y, to + x + y, to - x + y]

    def _solid_angle(self, p: Direction) -> Any:
        a, b, c, d = self._corners(p)
        return ops.absolute(triangle_solid_angle(a, b, c) + triangle_solid_angle(a, c, d))

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        x, y, n, length_x, length_y = self._axes
        m = met(p, w, self.centre.vector, n)
        within = (ops.absolute(dot(m.at, x)) <= 0.5 * length_x) & (ops.absolute(dot(m.at, y)) <= 0.5 * length_y)
        return ops.where(m.ahead & within & shines(self.sides, m.in_front), self.radiance, 0.0), m.distance

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        x, y, n, length_x, length_y = self._axes
        to = self.centre.vector - p
        x0, y0 = dot(to, x) - 0.5 * length_x, dot(to, y) - 0.5 * length_y
        x1, y1, z = x0 + length_x, y0 + length_y, -ops.absolute(dot(to, n))
        small = self._solid_angle(p) < SMALL
        z = ops.where(small, -1.0, z)
        near_x, far_x = ops.where(small, -1.0, x0), ops.where(small, 1.0, x1)  # of a square, where it is not looked at
        near_y, far_y = ops.where(small, -1.0, y0), ops.where(small, 1.0, y1)
        at_x, at_y = _spherical((near_x, far_x), (near_y, far_y), z, u0, u1)
        at_x, at_y = ops.where(small, x0 + u0 * length_x, at_x), ops.where(small, y0 + u1 * length_y, at_y)
        return normalize(x * at_x + y * at_y + n * dot(to, n))

    def density(self, p: Direction, w: Direction) -> Any:
        x, y, n, length_x, length_y = self._axes
        m = met(p, w, self.centre.vector, n)
        edge = 1.0 + 1e-5  # directions of `warp` are within it after rounding
        within = (ops.absolute(dot(m.at, x)) <= 0.5 * edge * length_x) & (
            ops.absolute(dot(m.at, y)) <= 0.5 * edge * length_y
        )
        solid = self._solid_angle(p)
        small = solid < SMALL
        density = ops.where(small, by_area(m, length_x * length_y), 1.0 / ops.where(small, 1.0, solid))
        return ops.where(m.ahead & within, density, 0.0)

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        in_front = dot(self.centre.vector - p, self._axes[2]) < 0.0
        projected = ops.absolute(polygon_projected(self._corners(p), n))
        return self.radiance * ops.where(shines(self.sides, in_front), projected, 0.0)

    def holds(self, p: Direction) -> Any:
        x, y, n, length_x, length_y = self._axes
        to = self.centre.vector - p
        within = (ops.absolute(dot(to, x)) <= 0.5 * length_x) & (ops.absolute(dot(to, y)) <= 0.5 * length_y)
        return (dot(to, n) == 0.0) & within

    def strength(self, p: Direction) -> Any:
        in_front = dot(self.centre.vector - p, self._axes[2]) < 0.0
        return self.radiance * ops.where(shines(self.sides, in_front), self._solid_angle(p), 0.0)


def _spherical(x: tuple[Any, Any], y: tuple[Any, Any], z: Any, u0: Any, u1: Any) -> tuple[Any, Any]:
    """The point (x, y) of the rectangle between these at height z < 0, uniform in solid angle."""
    (x0, x1), (y0, y1) = x, y
    corners = [Direction(a, b, z) for a, b in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    normals = [normalize(cross(a, b)) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    angles = [
        ops.arccos(ops.clip(-dot(a, b), -1.0, 1.0)) for a, b in zip(normals, [*normals[1:], normals[0]], strict=True)
    ]
    b0, b1 = normals[0].z, normals[2].z
    k = 2.0 * math.pi - angles[2] - angles[3]
    solid = angles[0] + angles[1] - k
    au = u0 * solid + k
    sin = ops.sin(au)
    fu = (ops.cos(au) * b0 - b1) / ops.where(sin == 0.0, 1e-20, sin)
    cu = ops.where(fu > 0.0, 1.0, -1.0) / ops.sqrt(fu * fu + b0 * b0 + 1e-30)
    cu = ops.clip(cu, -1.0, 1.0)
    at_x = ops.clip(-cu * z / ops.sqrt(ops.maximum(1.0 - cu * cu, 1e-12)), x0, x1)
    d2 = at_x * at_x + z * z
    h0, h1 = y0 / ops.sqrt(d2 + y0 * y0), y1 / ops.sqrt(d2 + y1 * y1)
    h = h0 + u1 * (h1 - h0)
    return at_x, ops.clip(h * ops.sqrt(d2 / ops.maximum(1.0 - h * h, 1e-12)), y0, y1)
