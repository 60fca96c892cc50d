"""A convex polygon that shines evenly; with three corners a triangle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from ..arrays import ops
from ..base.light import Light
from ..errors import ParameterError
from ..formula.direction import Direction, cross, dot, normalize, select
from ..formula.fields import Field, param, part
from ..formula.parametrised import Parametrised
from ..formula.projected import polygon_projected, triangle_solid_angle
from ..formula.text import shown
from ..formula.world import Vector
from ._flat import SMALL, by_area, met, refuse_flat, shines, sides

MOST = 32


class Corners(Parametrised):
    """The corners of a polygon, in turn: parameters "0.x", "0.y" ...

    Source   Cartesian components.

    Example
    >>> light = gn.PolygonLight([[0, 0, 1], [1, 0, 1], [0, -1, 1]])
    >>> print(light.corners, light.parameters["corners.1.x"].value)
    [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, -1.0, 1.0]] 1.0
    """

    def __init__(self, *corners: Any):
        if not 3 <= len(corners) <= MOST:
            raise ParameterError(f"PolygonLight: {len(corners)} corners, expected 3 to {MOST}")
        fields: dict[str, Field] = {str(i): Vector(None, f"corner {i} [m]") for i in range(len(corners))}
        for name, field in fields.items():
            field.name = name
        self._set(dict(zip(fields, corners, strict=True)), fields=fields)

    @property
    def vectors(self) -> list[Direction]:
        """The corners as formulas take them.

        Example
        >>> print(len(gn.PolygonLight([[0, 0, 1], [1, 0, 1], [0, -1, 1]]).corners.vectors))
        3
        """
        return [self.__dict__[name].vector for name in self.fields]

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        return np.array([np.asarray(self.__dict__[name]) for name in self.fields], dtype)

    def __repr__(self) -> str:
        return f"[{', '.join(repr(self.__dict__[name]) for name in self.fields)}]"

    def to_json(self) -> Any:
        """The corners as lists.

        Example
        >>> print(gn.PolygonLight([[0, 0, 1], [1, 0, 1], [0, -1, 1]]).corners.to_json()[1])
        [1.0, 0.0, 1.0]
        """
        return np.asarray(self).tolist()


def _corners(value: Any) -> Corners:
    """Corners of a list of them, or of an array (N, 3) of any library."""
    try:
        return Corners(*(value[i] for i in range(len(value))))
    except (TypeError, KeyError, IndexError):
        raise ParameterError(f"corners={shown(value)}: expected a list of corners, or an array (N, 3)") from None


class PolygonLight(Light):
    """Plane convex polygon of constant radiance: E = L times the projected solid angle of what is above the horizon.

    It shines to the side from which its corners run counterclockwise. `sample` is uniform in solid angle, triangle by
    triangle; below 0.01 sr, in area.

    Looks    `PolygonLight([[-2.2, -0.6, 0.9], [-1.6, -1.6, 2.6], [-0.6, -2.2, 0.9]], 6.0)`: a triangle in the
             metal.
    Shapes   corners: (N, 3), N = 3 to 32; radiance: a number or (C,).
    Units    corners: m; radiance: W m-2 sr-1.
    Error    rounding.
    Source   sampling: Arvo 1995, "Stratified sampling of spherical triangles", SIGGRAPH. Irradiance: Lambert 1760, see
             `gonio.formula.projected`.

    Example
    >>> light = gn.PolygonLight([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]], radiance=2.0)
    >>> print(gn.irradiance(light, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).round(4))
    0.6046
    """

    corners = part(Corners, ((0.0, 0.0, 1.0), (0.0, 1.0, 1.0), (1.0, 0.0, 1.0)), "its corners [m]", _corners)
    radiance = param(1.0, 0.0, 1e30, "radiance", unit="W m-2 sr-1")
    sides = sides()

    has_edges: ClassVar[bool] = True
    can_sample: ClassVar[bool] = True

    def validate(self) -> None:
        if self.like() is not None:
            return
        at = np.asarray(self.corners)
        size = float(np.ptp(at, axis=0).max())
        turns = np.cross(np.roll(at, -1, axis=0) - at, np.roll(at, -2, axis=0) - np.roll(at, -1, axis=0))
        normal = np.cross(at[1:-1] - at[0], at[2:] - at[0]).sum(axis=0)
        refuse_flat("PolygonLight", float(np.linalg.norm(normal)) / 2.0, size * size)
        normal /= np.linalg.norm(normal)
        if np.abs((at - at[0]) @ normal).max() > 1e-6 * size:
            raise ParameterError("PolygonLight: its corners are in no plane; write a PolygonLight for each triangle")
        if (turns @ normal).min() < -1e-9 * size * size:
            raise ParameterError("PolygonLight: its corners turn inwards; expected a convex one, or one for each part")

    @property
    def _normal(self) -> Direction:
        corners = self.corners.vectors
        total = Direction(0.0, 0.0, 0.0)
        for b, c in pairwise(corners[1:]):
            total = total + cross(b - corners[0], c - corners[0])
        return total

    def _triangles(self, p: Direction) -> list[tuple[Direction, Direction, Direction]]:
        at = [corner - p for corner in self.corners.vectors]
        return [(at[0], b, c) for b, c in pairwise(at[1:])]

    def _solid_angles(self, p: Direction) -> list[Any]:
        return [ops.absolute(triangle_solid_angle(*triangle)) for triangle in self._triangles(p)]

    def _in_front(self, p: Direction) -> Any:
        return dot(p - self.corners.vectors[0], self._normal) > 0.0

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        m = met(p, w, self.corners.vectors[0], normalize(self._normal))
        lit = m.ahead & shines(self.sides, m.in_front) & self._inside(m.at, 0.0)
        return ops.where(lit, self.radiance, 0.0), m.distance

    def _inside(self, at: Direction, margin: float) -> Any:
        """Whether a point of the plane, from the first corner, is inside; or no further out than this share."""
        corners, normal = self.corners.vectors, self._normal
        area2 = ops.sqrt(dot(normal, normal))
        inside: Any = None
        for i, a in enumerate(corners):
            b = corners[(i + 1) % len(corners)]
            left = dot(cross(b - a, at + corners[0] - a), normal) >= -margin * area2 * area2
            inside = left if inside is None else inside & left
        return inside

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        triangles, solids = self._triangles(p), self._solid_angles(p)
        small = _sum(solids) < SMALL
        areas = [_area(*triangle) for triangle in triangles]
        shares = [ops.where(small, area, solid) for area, solid in zip(areas, solids, strict=True)]
        wanted, chosen, reached = u0 * _sum(shares), triangles[0], 0.0
        start: Any = 0.0 * wanted
        share = shares[0]
        for before, triangle, own in zip(shares, triangles[1:], shares[1:], strict=False):
            reached = reached + before
            later = wanted >= reached
            a, b, c = (select(later, new, old) for new, old in zip(triangle, chosen, strict=True))
            chosen = (a, b, c)
            start, share = ops.where(later, reached, start), ops.where(later, own, share)
        u = ops.clip((wanted - start) / ops.where(share > 0.0, share, 1.0), 0.0, 1.0)
        axes = (Direction(1.0, 0.0, 0.0), Direction(0.0, 1.0, 0.0), Direction(0.0, 0.0, 1.0))
        units = (select(small, axis, normalize(x)) for axis, x in zip(axes, chosen, strict=True))
        a, b, c = units
        # Swept about the corner that the triangles share: from each to the next without a jump.
        spherical = _spherical(b, a, c, u, u1)
        a, b, c = chosen
        flat = a + (b + (c - b) * u - a) * ops.sqrt(u1)
        return select(small, normalize(flat), spherical)

    def density(self, p: Direction, w: Direction) -> Any:
        m = met(p, w, self.corners.vectors[0], normalize(self._normal))
        solid = _sum(self._solid_angles(p))
        small = solid < SMALL
        area = 0.5 * ops.sqrt(dot(self._normal, self._normal))
        density = ops.where(small, by_area(m, area), 1.0 / ops.where(small, 1.0, solid))
        return ops.where(m.ahead & self._inside(m.at, 1e-5), density, 0.0)

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        projected = ops.absolute(polygon_projected([corner - p for corner in self.corners.vectors], n))
        return self.radiance * ops.where(shines(self.sides, self._in_front(p)), projected, 0.0)

    def holds(self, p: Direction) -> Any:
        at = p - self.corners.vectors[0]
        return (dot(at, self._normal) == 0.0) & self._inside(at, 0.0)

    def strength(self, p: Direction) -> Any:
        return self.radiance * ops.where(shines(self.sides, self._in_front(p)), _sum(self._solid_angles(p)), 0.0)


def _sum(values: Sequence[Any]) -> Any:
    return sum(values[1:], values[0])


def _area(a: Direction, b: Direction, c: Direction) -> Any:
    across = cross(b - a, c - a)
    return 0.5 * ops.sqrt(dot(across, across))


def _spherical(a: Direction, b: Direction, c: Direction, u0: Any, u1: Any) -> Direction:
    """A direction that is uniform in the solid angle of a spherical triangle with these corners, unit vectors.

    A smaller triangle with the corners a and b and the share u0 of the area is cut off, whose third corner is on the
    arc from a to c; the direction is on the arc from b to there.
    """
    ab, bc, ca = (cross(x, y) for x, y in ((a, b), (b, c), (c, a)))
    alpha, beta, gamma = (_angle(x, y) for x, y in ((ca, ab), (ab, bc), (bc, ca)))
    area = u0 * (alpha + beta + gamma - math.pi)
    cos_alpha, sin_alpha = ops.cos(alpha), ops.sin(alpha)
    s, t = ops.sin(area - alpha), ops.cos(area - alpha)
    u, v = t - cos_alpha, s + sin_alpha * dot(a, b)
    below = (v * s + u * t) * sin_alpha
    flat = ops.absolute(below) < 1e-20
    q = ops.clip(((v * t - u * s) * cos_alpha - v) / ops.where(flat, 1.0, below), -1.0, 1.0)
    q = ops.where(flat, 1.0, q)
    third = a * q + _perpendicular(c, a) * ops.sqrt(ops.maximum(1.0 - q * q, 0.0))
    down = u1 * (1.0 - dot(third, b))
    return b * (1.0 - down) + _perpendicular(third, b) * ops.sqrt(ops.maximum(down * (2.0 - down), 0.0))


def _angle(x: Direction, y: Direction) -> Any:
    """The inner angle of a spherical triangle between two planes through its sides, told by their normals."""
    across = cross(x, y)
    return ops.arctan2(ops.sqrt(dot(across, across) + 1e-30), -dot(x, y))


def _perpendicular(x: Direction, axis: Direction) -> Direction:
    """The unit vector along the part of x perpendicular to a unit vector; 0 for x along it."""
    rest = x - axis * dot(x, axis)
    return rest * (1.0 / ops.sqrt(dot(rest, rest) + 1e-30))
