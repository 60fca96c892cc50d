"""Patches: triangles of one radiosity each, which all parts of a scene are divided into."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from ..numerics.unique_rows import unique_rows
from ..rays.triangles import Triangles
from ..scenes.scene import Scene

LEVEL = 1e-9
"""The distance, in units of the scene's place, up to which corners of faces are one."""


class Halvings(NamedTuple):
    """How faces were divided: a tree for each, by which the patch at a place is found.

    lines   (K, 3): a, b, c of a u + b v + c, which is 0 on the line that a triangle was divided along; (u, v) is the
            place (1 - u - v) A + u B + v C of the face
    links   (F + 2 K,): what faces, and the two sides of each line (below 0, then from 0), lead to: the number of a
            line, or -1 - that of a patch
    slot    (n,): where in `links` a patch stands
    """

    lines: np.ndarray
    links: np.ndarray
    slot: np.ndarray

    @classmethod
    def none(cls, faces: int) -> Halvings:
        """Of faces that are patches."""
        return cls(np.empty((0, 3)), -1 - np.arange(faces), np.arange(faces))

    def then(self, chosen: np.ndarray, lines: np.ndarray) -> Halvings:
        """And patches `chosen` (k,) divided along lines (k, 3): what is above these are new patches, in their order."""
        k, n, more = len(self.lines), len(self.slot), np.arange(len(chosen))
        links, slot = self.links.copy(), np.append(self.slot, len(self.links) + 2 * more + 1)
        links[slot[chosen]] = k + more
        slot[chosen] = len(self.links) + 2 * more
        below_and_above = np.stack([-1 - chosen, -1 - n - more], axis=1).reshape(-1)
        return Halvings(np.concatenate([self.lines, lines]), np.concatenate([links, below_and_above]), slot)


@dataclass(eq=False)
class Patches:
    """Triangles `corners` (n, 3, 3), each of a part and a face (n,) of the scene, whose triangles are `faces`: as seen
    from their place, but for those of `world`.

    `places` (n, 3, 2): the corners (u, v) on the face; `halvings`: how the faces became patches.
    """

    faces: Triangles
    corners: np.ndarray
    part: np.ndarray
    face: np.ndarray
    places: np.ndarray
    halvings: Halvings

    def __len__(self) -> int:
        return len(self.corners)

    @cached_property
    def triangles(self) -> Triangles:
        """What rays meet: face k is patch k."""
        return Triangles(self.corners.reshape(-1, 3), np.arange(3 * len(self)).reshape(-1, 3))

    @cached_property
    def areas(self) -> np.ndarray:
        """(n,)"""
        return 0.5 * np.linalg.norm(self._cross, axis=1)

    @cached_property
    def normals(self) -> np.ndarray:
        """(n, 3)"""
        return self._cross / (2.0 * self.areas[:, None])

    @cached_property
    def centres(self) -> np.ndarray:
        """(n, 3)"""
        return self.corners.mean(axis=1)

    @property
    def world(self) -> Patches:
        """These patches in the world."""
        corners = self.faces.place.world(self.corners)
        return Patches(self.faces, corners, self.part, self.face, self.places, self.halvings)

    @cached_property
    def lift(self) -> float:
        """How far above a patch its rays begin: enough that rounding leaves none below it."""
        return 4e-6 * float(np.ptp(self.corners, axis=(0, 1)).max())

    @cached_property
    def _cross(self) -> np.ndarray:
        return np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])

    def split(self, chosen: np.ndarray, first: np.ndarray, share: np.ndarray) -> Patches:
        """With these patches, numbers (k,), divided from a point of their edge number `first`, a share of the way along
        it, to the corner opposite; the pieces at the ends of these edges come last."""
        rows, order = np.arange(len(chosen)), (first[:, None] + np.arange(3)) % 3
        wholes, pieces = (self.corners, self.places), []
        for whole in wholes:
            a, b, tip = (whole[chosen][rows, order[:, k]] for k in range(3))
            middle = (1.0 - share[:, None]) * a + share[:, None] * b
            pieces.append((np.stack([a, middle, tip], axis=1), np.stack([middle, b, tip], axis=1)))
        (_, middle, tip), (_, end, _) = (np.moveaxis(piece, 1, 0) for piece in pieces[1])
        way = tip - middle
        line = np.stack([-way[:, 1], way[:, 0], way[:, 1] * middle[:, 0] - way[:, 0] * middle[:, 1]], axis=1)
        line *= np.sign(np.sum(line[:, :2] * end, axis=1) + line[:, 2])[:, None]
        corners, places = (np.concatenate([x, after]) for x, (_, after) in zip(wholes, pieces, strict=True))
        corners[chosen], places[chosen] = pieces[0][0], pieces[1][0]
        part, face = (np.concatenate([x, x[chosen]]) for x in (self.part, self.face))
        return Patches(self.faces, corners, part, face, places, self.halvings.then(chosen, line))

    def halved(self, chosen: np.ndarray) -> Patches:
        """With these patches, numbers (k,), halved at the middle of their longest edges; second halves come last."""
        c = self.corners[chosen]
        lengths = np.linalg.norm(np.roll(c, -1, axis=1) - c, axis=2)
        longest = np.argmax(_in_steps(lengths, lengths.max(axis=1, keepdims=True)), axis=1)
        return self.split(chosen, longest, np.full(len(chosen), 0.5))

    def divided(self, count: int) -> Patches:
        """With the largest patches divided until there are `count`."""
        patches = self
        while len(patches) < count:
            areas = _in_steps(patches.areas, patches.areas.max())
            large = np.flatnonzero(areas > 0.5 * areas.max())
            order = large[np.argsort(-areas[large], kind="stable")]
            patches = patches.halved(order[: count - len(patches)])
        return patches


def _in_steps(x: np.ndarray, largest: Any) -> np.ndarray:
    """Numbers in steps of a millionth of the largest or so: those that differ by rounding alone are equal. Halves and
    quarters of the largest are not between two steps."""
    return np.round(x * (math.pi * 1e6 / largest))


def patches_of(scene: Scene) -> Patches:
    """The faces of all parts, undivided."""
    meshes = [part.triangles for part in scene.parts]
    counts = [len(mesh.vertices) for mesh in meshes]
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, np.cumsum([0, *counts]), strict=False)])
    triangles = Triangles(np.concatenate([mesh.vertices for mesh in meshes]), faces)
    n = len(faces)
    part = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    places = np.tile([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (n, 1, 1))
    return Patches(triangles, triangles.local.corners, part, np.arange(n), places, Halvings.none(n))


def enclosing(triangles: Triangles) -> np.ndarray:
    """Which faces (F,) are of surfaces that are closed and show their fronts within: no light of these escapes."""
    corners = triangles.local.corners
    _, vertex, _ = unique_rows(np.round(corners.reshape(-1, 3) / LEVEL))
    a, count = vertex.reshape(-1, 3), len(vertex)
    b = np.roll(a, -1, axis=1)
    edges, others = (a * count + b).reshape(-1), (b * count + a).reshape(-1)
    known, first, each = np.unique(edges, return_index=True, return_counts=True)
    at = np.minimum(np.searchsorted(known, others), len(known) - 1)
    shared = (known[at] == others) & (each[at] == 1)
    face, beside = np.repeat(np.arange(len(a)), 3)[shared], first[at[shared]] // 3
    graph = csr_matrix((np.ones(len(face), bool), (face, beside)), shape=(len(a), len(a)))
    _, surface = connected_components(graph, directed=False)
    opens = np.bincount(surface, ~shared.reshape(-1, 3).all(axis=1)) > 0.0
    volume = np.bincount(surface, np.linalg.det(corners))
    return (~opens & (volume < 0.0))[surface]
