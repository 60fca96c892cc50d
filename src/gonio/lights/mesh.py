"""A mesh that shines evenly: lamps of any form."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ..arrays import Fixed, frozen, ops
from ..base.light import Light
from ..errors import ParameterError
from ..formula.direction import Direction, cross, dot, normalize
from ..formula.fields import Field, param
from ..formula.projected import polygon_projected
from ..formula.text import shown
from ..rays.triangles import Triangles

MOST = 4096
"""The most triangles: each is looked at for every direction."""

EDGE = 1e-6
"""By how much triangles reach over their edges, so that no direction passes between two of them."""


class _LightTriangles(Triangles):
    """The triangles of a light, which are compared by their numbers."""

    @cached_property
    def is_convex(self) -> bool:
        """Whether no triangle has a part of the mesh before it: each is seen whole from wherever its front is."""
        before = self.vertices @ self.normals.T - np.sum(self.corners[:, 0] * self.normals, axis=1)
        return bool(before.max() <= 1e-6 * np.ptp(self.vertices, axis=0).max())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _LightTriangles) and np.array_equal(self.corners, other.corners)

    def __hash__(self) -> int:
        return hash(self.corners.shape)

    def __reduce__(self) -> tuple[Any, ...]:
        return _LightTriangles, (self.vertices, self.faces)

    def __repr__(self) -> str:
        return f"<{len(self.vertices)} vertices, {len(self.faces)} triangles>"


class _Shape(Field):
    is_table = True
    accepts = "tuple[Array, Array] | Mesh"

    def check(self, owner: str, value: Any) -> _LightTriangles:
        if value is None:
            return _TETRAHEDRON
        if isinstance(value, _LightTriangles):
            return value
        try:
            triangles = getattr(value, "triangles", None)
            vertices, faces = value if triangles is None else (triangles.vertices, triangles.faces)
        except (TypeError, ValueError):
            rule = "expected vertices (V, 3) and faces (F, 3), in a pair, or a gn.scenes.Mesh, which reads files"
            raise ParameterError(f"{owner}({self.name}={shown(value)}): {rule}") from None
        facets = _LightTriangles(vertices, faces)
        if len(facets.faces) > MOST:
            rule = f"expected up to {MOST} triangles, each of which is looked at for every direction; simplify the mesh"
            raise ParameterError(f"{owner}: a mesh of {len(facets.faces)}; {rule}")
        return facets

    def traced(self, value: _LightTriangles) -> Any:
        return len(value.faces), value.is_convex


_TETRAHEDRON = _LightTriangles(
    [[0.0, 0.0, 0.7], [1.0, 0.0, 1.7], [-0.5, 0.8, 1.7], [-0.5, -0.8, 1.7]],
    [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]],
)


class MeshLight(Light):
    r"""Triangles of constant radiance: $L(p, \omega)$ is the radiance where the first triangle that is met from p along
    $\omega$ shows its front, else 0. Of a mesh without dents $E = L \sum_i \Omega_i$, with the projected solid angles
    of the triangles that show their fronts; of others samples give the irradiance.

    `sample` chooses a triangle and a point on it, evenly over the area, on backs too; the density counts every triangle
    along the direction: $q(\omega) = \sum_i r_i^2/(A \cos\theta_i)$ with the area A of all.

    Looks    `MeshLight(([[-1.6, -1.4, 2.2], [-1.6, -1.4, 0.6], [-2.1, -0.8, 1.4], [-0.9, -1.0, 1.4], [-1.1, -1.9, 1.4],
             [-2.2, -1.7, 1.4]], [[0, 2, 5], [0, 5, 4], [0, 4, 3], [0, 3, 2], [1, 5, 2], [1, 4, 5], [1, 3, 4], [1, 2,
             3]]), 7.0)`: a crystal of eight faces, which is of another shape from everywhere.
    Shapes   shape: vertices (V, 3) and faces (F, 3), numbers of vertices, counterclockwise from the front, up to 4096;
             or a `Mesh`, which reads files; radiance: a number or (C,).
    Units    vertices: m; radiance: W m-2 sr-1.
    Errors   those of `Mesh`.
    Error    rounding; triangles are 1e-6 of their size wider. Vertices are no parameters.
    Source   Lambert 1760 for the irradiance, see `gonio.formula.projected`; ray and triangle: Möller & Trumbore 1997,
             "Fast, minimum storage ray-triangle intersection", Journal of Graphics Tools 2(1):21.

    Example
    >>> square = [[-0.5, -0.5, 1.0], [-0.5, 0.5, 1.0], [0.5, 0.5, 1.0], [0.5, -0.5, 1.0]]
    >>> lamp = gn.MeshLight((square, [[0, 1, 2, 3]]), radiance=2.0)
    >>> print(gn.irradiance(lamp, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).round(4))  # as of a `RectangleLight`
    1.5045
    """

    shape: Any = _Shape(None, "vertices and faces")
    radiance = param(1.0, 0.0, 1e30, "radiance", unit="W m-2 sr-1")

    corners: Any  # tables, of bound lights only
    first: Any
    facts: Any

    has_edges: ClassVar[bool] = True
    can_sample: ClassVar[bool] = True

    def _keep(self) -> dict[str, Fixed]:
        t = self.shape
        share = np.concatenate([[0.0], np.cumsum(t.areas)[:-1]]) / t.areas.sum()
        facts = np.array([t.areas.sum(), *t.vertices.mean(axis=0)])
        return {
            **super()._keep(),
            "corners": Fixed(frozen(t.corners.reshape(-1))),
            "first": Fixed(frozen(share)),
            "facts": Fixed(frozen(facts)),
        }

    def _moved(self, by: Sequence[float]) -> MeshLight:
        return self.replace(shape=_LightTriangles(self.shape.vertices + np.asarray(by), self.shape.faces))

    def to_json(self) -> dict[str, Any]:
        t = self.shape
        return {**super().to_json(), "shape": [t.vertices.tolist(), t.faces.tolist()]}

    @property
    def has_closed_form(self) -> bool:
        return bool(self.shape.is_convex)

    def _triangle(self, k: Any) -> list[Direction]:
        start = k * 9
        return [Direction(*(ops.take(self.corners, start + 3 * i + j) for j in range(3))) for i in range(3)]

    def _over(self, step: Callable[..., tuple[Any, ...]], *states: Any) -> tuple[Any, ...]:
        """The states after `states = step(triangle, *states)` for each triangle."""
        count = len(self.shape.faces)
        if count <= UNROLLED or _derives(states[0]):
            for k in range(count):
                states = step(self._triangle(k), *states)
            return states

        def one(k: Any, *states: Any) -> tuple[Any, ...]:
            following = step(self._triangle(ops.to_index(k)), *states)
            return k + 1.0 < count, k + 1.0, *following

        return ops.loop(one, 0.0 * states[0], *states)[1:]

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        none = 0.0 * w.z + 0.0 * p.z

        def nearer(triangle: list[Direction], nearest: Any, front: Any) -> tuple[Any, ...]:
            t, slope, _, is_met = _met(triangle, p, w, EDGE)
            is_nearer = is_met & (t < nearest)
            return ops.where(is_nearer, t, nearest), ops.where(is_nearer, ops.where(slope < 0.0, 1.0, 0.0), front)

        nearest, front = self._over(nearer, none + NOWHERE, none)
        return ops.where(front > 0.5, self.radiance, 0.0), nearest

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        count = len(self.shape.faces)
        k, start = ops.to_index(0.0 * u0), 0.0 * u0
        left = count
        while left > 1:  # the last triangle whose share starts at u0 or before
            half = left // 2
            there = ops.take(self.first, k + half)
            passed = there <= u0
            k, start = ops.where(passed, k + half, k), ops.where(passed, there, start)
            left -= half
        a, b, c = self._triangle(k)
        normal = cross(b - a, c - a)
        share = 0.5 * ops.sqrt(dot(normal, normal)) / ops.take(self.facts, 0)
        u = ops.clip((u0 - start) / share, 0.0, 1.0)
        return normalize(a + (b + (c - b) * u1 - a) * ops.sqrt(u) - p)

    def density(self, p: Direction, w: Direction) -> Any:
        area = ops.take(self.facts, 0)

        def sum_of(triangle: list[Direction], total: Any) -> tuple[Any, ...]:
            t, slope, doubled, is_met = _met(triangle, p, w, 1e-5)
            return (total + ops.where(is_met, t * t * doubled / (area * ops.absolute(slope)), 0.0),)

        return self._over(sum_of, 0.0 * w.z + 0.0 * p.z)[0]

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        def sum_of(triangle: list[Direction], total: Any) -> tuple[Any, ...]:
            projected = polygon_projected([corner - p for corner in triangle], n)
            return (total + ops.maximum(projected, 0.0),)

        return self.radiance * self._over(sum_of, 0.0 * n.z + 0.0 * p.z)[0]

    def strength(self, p: Direction) -> Any:
        area = ops.take(self.facts, 0)
        to = Direction(*(ops.take(self.facts, 1 + i) for i in range(3))) - p
        return self.radiance * ops.minimum(area / ops.maximum(dot(to, to), 1e-20), 2.0 * math.pi)


def _derives(x: Any) -> bool:
    """Whether a number is of a library that derives, which loops do not let pass."""
    lib = ops.library_of_type(type(x))
    return lib is not None and lib.name in ("torch", "jax")


UNROLLED = 64
"""The most triangles that are written out in a formula, one after the other; more are looked at in a loop."""

NOWHERE = 1e30


def _met(triangle: list[Direction], p: Direction, w: Direction, margin: float) -> tuple[Any, Any, Any, Any]:
    """Where w from p meets the plane of a triangle: the distance, w times its normal of twice its area, that area, and
    whether the point is ahead and in the triangle, or no further out than this share."""
    a, b, c = triangle
    x, y, s = b - a, c - a, p - a
    normal = cross(x, y)
    slope = dot(w, normal)
    flat = slope == 0.0
    inverse = 1.0 / ops.where(flat, 1.0, slope)
    q = cross(s, w)
    u, v, t = -dot(y, q) * inverse, dot(x, q) * inverse, -dot(s, normal) * inverse
    inside = (u >= -margin) & (v >= -margin) & (u + v <= 1.0 + margin) & (t > 0.0) & ~flat
    return t, slope, ops.sqrt(dot(normal, normal)), inside
