"""A part of a scene: triangles with a material, from arrays or a file."""

from __future__ import annotations

import math
import os
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import Declared, Numbers, checked
from ..declared.notebooks import repr_html
from ..declared.numbers import numbers
from ..errors import AccessError, ParameterError, ShapeError
from ..rays.triangles import Triangles
from . import mesh_file

CREASE = math.radians(40.0)
"""The angle between faces up to which their edge is smoothed, where nobody says another."""


class Mesh:
    """Triangles with a material, and light of their own: `gn.scenes.Mesh("bunny.ply", material)`.

    `shape`: a file (.ply, .obj, .stl, .off; its triangles alone, no other file that it names), or vertices (V, 3) and
    faces (F, 3), or (F, 4) for quadrilaterals: numbers of vertices, counterclockwise as seen from the front.
    `material`: without one it is that of the picture, `gn.render(m, shape=mesh)`. `exitance`: what the front sends out
    by itself, diffusely; a number or one per channel.

    Pictures smooth edges at which faces turn by less than `crease`: normals are those of the vertices, interpolated.
    0 shows every face flat. `uv`: places (V, 2) of the vertices on a texture, from (0, 0) at its upper left; those of a
    file are taken from there. Without any, u and v are those of the box about the mesh, seen along +y.

    Units    vertices in any one length; exitance in W m-2, or per nm, as that of all parts; crease in rad.
    Errors   ParameterError for meshes that are empty, have vertices that are not finite, faces without area, or edges
             of more than two faces; ShapeError; NotFoundError; FormatError for damaged files and other kinds.

    Example
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
    >>> gn.scenes.Mesh(square, gn.Lambertian(0.5))
    Mesh(4 vertices, 2 triangles, Lambertian(rho=0.5))
    """

    _repr_html_ = repr_html

    @checked
    def __init__(
        self,
        shape: Any,
        material: Reflectance | None = None,
        exitance: Numbers = 0.0,
        crease: Annotated[
            float, Declared("normals are joined across edges of smaller angles", 0.0, math.pi, "rad")
        ] = CREASE,
        uv: Any = None,
    ):
        if isinstance(shape, (str, os.PathLike)):
            vertices, faces, found = mesh_file.read(shape)
            if uv is None and found is not None:
                uv = found * (1.0, -1.0) + (0.0, 1.0)  # files count v from below
        else:
            vertices, faces = _pair(shape)
        self.triangles = Triangles(vertices, faces)
        self.material, self.crease = material, crease
        self.uv = None if uv is None else _places(uv, len(self.triangles.vertices))
        self.exitance = np.asarray(exitance, np.float64)
        if self.exitance.ndim > 1:
            raise ShapeError(f"exitance is {self.exitance.shape}, expected a number, or one per channel")
        if not np.isfinite(self.exitance).all() or (self.exitance < 0.0).any():
            raise ParameterError(f"exitance={exitance!r:.60}: expected finite numbers from 0")

    def __setattr__(self, name: str, value: Any) -> None:
        if name in vars(self):
            raise AccessError("a Mesh is a value and cannot be changed; make a new one")
        object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        light = f", exitance={self.exitance.tolist()}" if self.exitance.any() else ""
        counts = f"{len(self.triangles.vertices)} vertices, {len(self.triangles.faces)} triangles"
        material = "" if self.material is None else f", {self.material!r}"
        return f"Mesh({counts}{material}{light})"

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals of the faces (F, 3), and where some edges are smoothed those of their corners too, (F, 12).

        Example
        >>> print(gn.scenes.Mesh(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).normals)
        [[0. 0. 1.]]
        """
        smooth = smoothed(self.triangles, self.crease)
        return self.triangles.normals if smooth is None else np.concatenate([self.triangles.normals, smooth], axis=1)

    @cached_property
    def places(self) -> np.ndarray | None:
        """u and v of the corners of the faces, and the direction in which u grows: (F, 9), or None without any.

        Example
        >>> corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
        >>> print(gn.scenes.Mesh(corner, uv=[[0, 1], [1, 1], [0, 0]]).places)
        [[0. 1. 1. 1. 0. 0. 1. 0. 0.]]
        """
        if self.uv is None:
            return None
        uv, corners = self.uv[self.triangles.faces], self.triangles.corners
        e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        (a, b), (c, d) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
        area = a * d - b * c
        along = (e * d[:, None] - f * b[:, None]) * np.sign(area)[:, None]
        length = np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
        return np.concatenate([uv.reshape(-1, 6), along / length], axis=1)


def smoothed(triangles: Triangles, crease: float) -> np.ndarray | None:
    """Unit normals (F, 9) of the corners: the mean, by the angle at the corner, over the faces that meet there and
    are turned by less than `crease` against this one; None where no two are.

    Source   weights: Thürmer & Wüthrich 1998, J. Graphics Tools 3(1):43.
    """
    faces, corners = triangles.faces, triangles.corners
    sides = np.roll(corners, -1, axis=1) - corners
    sides = sides / np.sqrt(np.einsum("fki,fki->fk", sides, sides))[..., None]
    cosines = -np.einsum("fki,fki->fk", sides, np.roll(sides, 1, axis=1))
    weights = np.arccos(np.clip(cosines, -1.0, 1.0)).reshape(-1)
    vertex = _positions(triangles.local.vertices)[faces.reshape(-1)]
    normals = np.repeat(triangles.normals, 3, axis=0)
    axes = np.stack([np.bincount(vertex, weights * normals[:, i]) for i in range(3)], -1)
    axes = axes / np.maximum(np.sqrt(np.einsum("vi,vi->v", axes, axes)), 1e-300)[:, None]
    found = axes[vertex]
    away = np.einsum("ci,ci->c", found, normals)
    # Faces within half the angle of the mean are within the angle of each other; at other vertices each pair is tried.
    rough = np.zeros(len(axes), bool)
    rough[vertex[away <= math.cos(0.5 * crease)]] = True
    left = np.flatnonzero(rough[vertex])
    turned = bool((away[~rough[vertex]] < 1.0 - 1e-10).any())
    if len(left):
        found[left], more = _by_pairs(vertex[left], weights[left], normals[left], math.cos(crease))
        turned |= more
    return found.reshape(-1, 9) if turned else None


def _by_pairs(vertex: np.ndarray, weights: np.ndarray, normals: np.ndarray, least: float) -> tuple[np.ndarray, bool]:
    """Unit normals (N, 3) of corners, each the mean over those at its vertex whose cosine with it is above `least`; and
    whether any two such differ."""
    order = np.argsort(vertex, kind="stable")
    vertex, weight, normal = vertex[order], weights[order, None], normals[order]
    total, turned = weight * normal, False
    here = np.arange(len(order))
    for step in range(1, len(order)):  # pairs of corners at one vertex, so far apart in the order
        here = here[: np.searchsorted(here, len(order) - step)]
        here = here[vertex[here] == vertex[here + step]]
        if not len(here):
            break
        cosine = np.einsum("ni,ni->n", normal[here], normal[here + step])
        near = cosine > least
        turned |= bool((cosine[near] < 1.0 - 1e-10).any())
        a, b = here[near], here[near] + step
        total[a] += weight[b] * normal[b]
        total[b] += weight[a] * normal[a]
    found = np.empty_like(total)
    found[order] = total / np.linalg.norm(total, axis=1, keepdims=True)
    return found, turned


def _positions(vertices: np.ndarray) -> np.ndarray:
    """A number of each vertex (V,), the same for those in one place: files repeat vertices along seams."""
    words = (vertices.astype(np.float32) + np.float32(0.0)).view(np.uint32).astype(np.uint64)  # 0 and -0 are one place
    mixed = np.zeros(len(vertices), np.uint64)
    for word in words.T:
        mixed = (mixed ^ word) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return np.unique(mixed, return_inverse=True)[1].reshape(-1)


def _places(uv: Any, count: int) -> np.ndarray:
    """Places (V, 2) on a texture."""
    try:
        array = np.asarray(numbers(uv), float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (count, 2):
        raise ShapeError(f"uv: got shape {array.shape}, expected ({count}, 2): u and v of each vertex")
    if not np.isfinite(array).all():
        raise ParameterError("uv: some are NaN or infinite; expected numbers")
    return array


def _pair(shape: Any) -> tuple[Any, Any]:
    try:
        vertices, faces = shape
    except (TypeError, ValueError):
        raise ParameterError(f"Mesh({shape!r:.60}): expected a file, or vertices and faces in a pair") from None
    return vertices, faces
