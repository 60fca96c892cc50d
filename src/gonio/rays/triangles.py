"""Triangles that rays are shot at, in threads: by Embree, or by a tree of our own where embreex is not installed."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from ..compile.threads import share
from ..declared.numbers import numbers
from ..errors import ArrayTypeError, ParameterError, ShapeError

CHUNK = 1 << 16
"""Rays that a thread takes at a time, and faces that are checked at a time."""

MANIFOLD = "expected at most 2 at each edge (a manifold): divide the mesh there into several"


class Hits(NamedTuple):
    """What rays meet first: faces (N,) int32, -1 for nothing; distances (N,), infinite for nothing; places on the
    triangle: (1 - u - v) a + u b + v c of its corners."""

    face: np.ndarray
    distance: np.ndarray
    u: np.ndarray
    v: np.ndarray


class Place(NamedTuple):
    """Where things are in the world: the middle of the box about them, and as a unit the power of 2 next above half of
    its longest side. About that middle, in that unit, single precision has all its digits."""

    middle: np.ndarray
    unit: float

    @classmethod
    def of(cls, points: np.ndarray) -> Self:
        """That of points (N, 3)."""
        low, high = points.min(axis=0), points.max(axis=0)
        half = 0.5 * high - 0.5 * low
        return cls(low + half, math.ldexp(1.0, math.frexp(float(half.max()))[1]))

    def local(self, points: Any) -> np.ndarray:
        """Points of the world, in double precision, as seen from there: within 1."""
        return (np.asarray(points) - self.middle) / self.unit

    def world(self, points: np.ndarray) -> np.ndarray:
        """Such points in the world."""
        return self.middle + points * self.unit


class Triangles:
    """Triangles of vertices (V, 3), a face (F, 3) being three numbers of vertices, counterclockwise from its front.

    Rays may be given anywhere in the world, in double precision: single precision sees them from the triangles'
    `place`.

    Errors   ShapeError; ParameterError for none, for vertices that are not finite, faces that name no vertex or have no
             area, and an edge of more than two faces.
    """

    def __init__(self, vertices: Any, faces: Any):
        self.vertices, self.faces = _checked(vertices, faces)

    @cached_property
    def corners(self) -> np.ndarray:
        """(F, 3, 3) float64."""
        return self.vertices[self.faces]

    @cached_property
    def areas(self) -> np.ndarray:
        """(F,)"""
        return 0.5 * np.linalg.norm(_cross(self.corners), axis=1)

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals (F, 3) of the fronts."""
        return _cross(self.corners) / (2.0 * self.areas[:, None])

    @cached_property
    def place(self) -> Place:
        """Where they are in the world."""
        return Place.of(self.vertices)

    @cached_property
    def local(self) -> Triangles:
        """The same triangles as seen from their place."""
        local = Triangles.__new__(Triangles)
        local.vertices, local.faces = self.place.local(self.vertices), self.faces
        return local

    @cached_property
    def _caster(self) -> Any:
        vertices = self.place.local(self.vertices).astype(np.float32)
        faces = np.ascontiguousarray(self.faces, np.int32)
        try:
            from .embree import Embree

            return Embree(vertices, faces)
        except ImportError:
            from .tree import BoxTree

            return BoxTree(vertices, faces)

    def shoot(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """What rays from (N, 3) in directions (N, 3) meet first, on either side; distances in their lengths."""
        n = len(origins)
        hits = Hits(np.empty(n, np.int32), *(np.empty(n, np.float32) for _ in range(3)))

        def work(at: slice, o: np.ndarray, d: np.ndarray, far: np.ndarray) -> None:
            for whole, part in zip(hits, self._caster.first(o, d, far), strict=True):
                whole[at] = part

        self._in_threads(work, origins, directions, np.full(n, np.inf, np.float32))
        hits.distance[hits.face < 0] = np.inf
        return hits

    def faces_met(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The same, faces (N,) alone; on the thread that calls."""
        far = np.full(len(origins), 1e37, np.float32)
        return self._caster.face(*self._single(origins, directions), far)

    def any_met(self, origins: np.ndarray, directions: np.ndarray, far: float) -> np.ndarray:
        """Whether rays meet any triangle within `far` lengths, (N,); on the thread that calls."""
        return self._caster.any(*self._single(origins, directions), np.full(len(origins), far, np.float32))

    def occluded(self, origins: np.ndarray, directions: np.ndarray, far: np.ndarray) -> np.ndarray:
        """Whether rays meet any triangle within `far` lengths of their directions: (N,) of bool."""
        met = np.empty(len(origins), bool)

        def work(at: slice, o: np.ndarray, d: np.ndarray, limit: np.ndarray) -> None:
            met[at] = self._caster.any(o, d, limit)

        self._in_threads(work, origins, directions, np.broadcast_to(np.asarray(far, np.float32), len(origins)))
        return met

    def _in_threads(self, work: Callable[..., None], origins: Any, directions: Any, far: np.ndarray) -> None:
        shapes = np.shape(origins), np.shape(directions)
        if shapes[0] != shapes[1] or shapes[0][1:] != (3,):
            raise ShapeError(f"rays have origins {shapes[0]} and directions {shapes[1]}, expected (N, 3) of both")
        (o, d), limit = self._single(origins, directions), np.minimum(far, np.float32(1e37))
        _ = self._caster  # on one thread
        slices = [slice(start, start + CHUNK) for start in range(0, len(o), CHUNK)]
        share(lambda at: work(at, o[at], d[at], limit[at]), [(at,) for at in slices])

    def _single(self, origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray]:
        """Rays as seen from the place of the triangles, in single precision; their lengths count as before."""
        both = self.place.local(origins), np.asarray(directions) / self.place.unit
        return np.ascontiguousarray(both[0], np.float32), np.ascontiguousarray(both[1], np.float32)


def _cross(corners: np.ndarray) -> np.ndarray:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _numbers(name: str, value: Any) -> np.ndarray:
    try:
        return numbers(value)
    except ValueError as error:
        raise ArrayTypeError(f"{name} are {error}; expected rows of numbers") from None


def _checked(vertices: Any, faces: Any) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = (_numbers(name, value) for name, value in (("vertices", vertices), ("faces", faces)))
    vertices = np.array(vertices, np.float64, order="C")  # its own: results made of it are kept
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ShapeError(f"vertices are {vertices.shape}, expected (V, 3): a row x, y, z for each")
    if faces.ndim != 2 or faces.shape[1] not in (3, 4):
        raise ShapeError(f"faces are {faces.shape}, expected (F, 3), or (F, 4) for quadrilaterals: numbers of vertices")
    if not len(vertices) or not len(faces):
        raise ParameterError(f"a mesh of {len(vertices)} vertices and {len(faces)} faces, expected some: is it empty?")
    if not np.isfinite(vertices).all():
        bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
        raise ParameterError(f"vertex {bad[0]} is {vertices[bad[0]]} ({len(bad)} such), expected finite numbers")
    if (faces != np.floor(faces)).any() or faces.min() < 0 or faces.max() >= len(vertices):
        raise ParameterError(
            f"faces name vertices {faces.min():g} to {faces.max():g}, expected 0 to {len(vertices) - 1}"
        )
    if len(faces) * (faces.shape[1] - 2) > most_faces(len(vertices)):
        raise ParameterError(f"{len(faces)} faces of {len(vertices)} vertices, {MANIFOLD}")
    faces = faces.astype(np.int32)
    if faces.shape[1] == 4:
        faces = faces[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    flat = np.concatenate([_flat(vertices, faces, start) for start in range(0, len(faces), CHUNK)])
    if len(flat):
        raise ParameterError(f"face {flat[0]} has no area ({len(flat)} such), expected triangles: remove it")
    edges = np.empty(3 * len(faces), np.int64)
    for k, edge in enumerate(edges.reshape(3, -1)):
        a, b = faces[:, k], faces[:, k - 2]
        np.multiply(np.minimum(a, b), len(vertices), out=edge, dtype=np.int64)
        edge += np.maximum(a, b)
    edges.sort()
    shared = edges[2:][edges[2:] == edges[:-2]]
    if len(shared):
        raise ParameterError(f"{len(np.unique(shared))} edges have more than two faces, {MANIFOLD}")
    return vertices, faces


def most_faces(vertices: int) -> int:
    """The most faces that so many vertices have if no edge has more than two."""
    return vertices * (vertices - 1) // 3


def _flat(vertices: np.ndarray, faces: np.ndarray, start: int) -> np.ndarray:
    """The faces without area, of a piece of them."""
    corners = vertices[faces[start : start + CHUNK]]
    size = np.linalg.norm(_cross(corners), axis=1)
    return start + np.flatnonzero(size <= 1e-12 * np.square(np.ptp(corners, axis=1).max(axis=1)))
