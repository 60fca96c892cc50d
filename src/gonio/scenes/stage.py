"""What a picture shows: bodies, the materials of their parts, and the camera."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from ..base.identity import identity
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..errors import ParameterError, suggestion
from ..formula.text import shown
from ..formula.world import moved
from ..machine.caches import at_end
from ..surfaces.height_field import HeightField
from ._bodies import Body, Ground, Solid, TriangleBody
from .camera import FRONT, MARGIN, View, facing
from .heights import laid
from .mesh import Mesh
from .scene import Scene
from .shapes import LOWEST, SHAPES

TILT = math.radians(20.0)
"""The angle from above in which the camera looks at things on the ground, where nobody chose a camera."""

LAID = math.radians(50.0)
"""The angle from above in which it looks at height fields."""

HULLS = 1 << 14
"""Hulls by which the pixels of large meshes are found."""

AROUND = 1.3
"""How much more it sees then."""


class Stage(NamedTuple):
    """Bodies, as seen from their middle; that middle in the world; materials by the numbers of parts, None for that of
    the picture; the camera, and half the width of what it sees; the size of the scene; points (N, K, 3) whose hulls
    hold all triangles, or None; what tells this stage from others, for checkpoints; whether all that rays miss is seen
    too."""

    bodies: tuple[Body, ...]
    middle: np.ndarray
    materials: tuple[Reflectance | None, ...]
    camera: View
    margin: float
    size: float
    hulls: np.ndarray | None
    identity: str
    backdrop: bool

    @classmethod
    def of(
        cls,
        shape: Any,
        camera: View | None = None,
        ground: Reflectance | None = None,
        backdrop: bool = False,
        glows: bool = False,
    ) -> Self:
        """That of a shape by its name, a mesh, the path of one, a scene, or a height field. `glows`: whether parts may
        send out light by themselves."""
        wide, tilt = (1.0, 0.0) if ground is None else (AROUND, TILT)
        bodies: list[Body] = []
        materials: list[Reflectance | None] = []
        if isinstance(shape, str) and shape in SHAPES:
            bodies.append(Solid(shape))
            materials.append(None)
            centre, radius, low, hulls, told = np.zeros(3), 1.0, LOWEST[shape], None, shape
        else:
            if isinstance(shape, HeightField):
                shape, tilt = laid(shape), LAID
            held = _holder(shape)
            if not glows:
                _refuse_glow(_parts(held))
            facets = _made.get(id(held))
            if facets is None:
                facets = _facets(_parts(held))
                at_end(held, _made.pop, id(held))
                _made[id(held)] = facets
            bodies.append(facets.body)
            materials += facets.materials
            centre, radius, low, hulls, told = facets.centre, facets.radius, facets.low, facets.hulls, facets.identity
        if ground is not None:
            materials.append(ground)
            bodies.append(Ground(low - float(centre[2]), 2.0 * radius, float(len(materials) - 1)))
        if camera is None and ground is None and hulls is None:
            view, margin = FRONT, MARGIN
        else:
            view, margin = facing(centre, wide * radius, tilt) if camera is None else camera, 1.0
        return cls(tuple(bodies), centre, tuple(materials), view, margin, radius, hulls, told, backdrop)

    @property
    def is_simple(self) -> bool:
        """Whether it is one convex shape, which nothing shadows."""
        return len(self.bodies) == 1 and isinstance(self.bodies[0], Solid)

    @property
    def is_centred(self) -> bool:
        """Whether the bodies are where the world has them."""
        return not self.middle.any()

    def lit_by(self, lights: Sequence[Light]) -> list[Light]:
        """Lights of the world where the bodies see them."""
        return [*lights] if self.is_centred else [light.moved((-self.middle).tolist()) for light in lights]

    def values(self, size: int) -> dict[str, Any]:
        """What kernels need of it, for pictures of so many pixels across."""
        camera = self.camera if self.is_centred else moved(self.camera, (-self.middle).tolist())
        scene = {"bodies": list(self.bodies), "camera": camera, "size": self.size}
        return {**scene, "scale": 2.0 * self.margin / size, "margin": self.margin, "part": 0.0}


def _holder(shape: Any) -> Mesh | Scene:
    """The mesh or the scene that is meant."""
    if isinstance(shape, (Mesh, Scene)):
        return shape
    if isinstance(shape, os.PathLike) or (isinstance(shape, str) and os.path.splitext(shape)[1]):
        return Mesh(shape)
    words = f"{', '.join(map(repr, SHAPES))}, or the file of a mesh"
    if isinstance(shape, str):
        raise ParameterError(f"shape={shape!r:.60}: expected one of {words}{suggestion(shape, SHAPES)}")
    kinds = f"{words}; or a gn.scenes.Mesh, a gn.Scene, a surface of gn.surfaces"
    raise ParameterError(f"render(shape={shown(shape)}): expected a word, one of {kinds}")


def _parts(held: Mesh | Scene) -> tuple[Mesh, ...]:
    return held.parts if isinstance(held, Scene) else (held,)


def _refuse_glow(meshes: Sequence[Mesh]) -> None:
    """Raises ParameterError for parts that send out light by themselves."""
    for number, mesh in enumerate(meshes):
        if mesh.exitance.any():
            rule = (
                "pictures take light from lights alone; expected exitance=0 and a light in its place, gn.PolygonLight"
            )
            raise ParameterError(f"render: part {number} sends out light by itself, {mesh!r:.90}; {rule}")


class _Facets(NamedTuple):
    """Meshes as one body; see `Stage`."""

    body: TriangleBody
    materials: tuple[Reflectance | None, ...]
    centre: np.ndarray
    radius: float
    low: float
    hulls: np.ndarray
    identity: str


_made: dict[int, _Facets] = {}
"""Meshes and scenes of earlier pictures, by their numbers, as bodies."""


def _facets(meshes: Sequence[Mesh]) -> _Facets:
    materials: list[Any] = []
    parts = []
    for mesh in meshes:
        same = [k for k, m in enumerate(materials) if m is mesh.material]
        parts.append(same[0] if same else len(materials))
        materials += [] if same else [mesh.material]
    offsets = np.cumsum([0, *(len(mesh.triangles.vertices) for mesh in meshes)])
    vertices = np.concatenate([mesh.triangles.vertices for mesh in meshes])
    faces = np.concatenate([mesh.triangles.faces + k for mesh, k in zip(meshes, offsets, strict=False)])
    smooth = any(mesh.normals.shape[1] > 3 for mesh in meshes)
    normals = np.concatenate([np.tile(x, 4) if smooth and x.shape[1] == 3 else x for x in (m.normals for m in meshes)])
    placed = any(mesh.places is not None for mesh in meshes)
    places = np.concatenate([_placed(mesh) for mesh in meshes]) if placed else None
    of_faces = np.repeat(np.array(parts, float), [len(mesh.triangles.faces) for mesh in meshes])
    told = identity(vertices, faces, normals, places, of_faces)
    box = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    centre = box.mean(axis=0)
    radius = float(np.linalg.norm(vertices - centre, axis=1).max())
    at = vertices - centre, faces, normals, places, of_faces if len(materials) > 1 else None, box - centre
    body = TriangleBody.of(*at)
    return _Facets(body, tuple(materials), centre, radius, float(box[0, 2]), _hulls(vertices[faces]), told)


def _hulls(corners: np.ndarray) -> np.ndarray:
    """Points (N, K, 3) whose hulls hold all triangles (F, 3, 3): each of these, or where they are many the boxes about
    runs of them, which lie together in most files."""
    run = len(corners) // HULLS
    if run < 2:
        return corners
    starts = np.arange(0, len(corners), run)
    low = np.minimum.reduceat(corners.min(axis=1), starts, axis=0)
    high = np.maximum.reduceat(corners.max(axis=1), starts, axis=0)
    upper = np.array([[bool(k >> axis & 1) for axis in range(3)] for k in range(8)])
    return np.where(upper, high[:, None], low[:, None])


def _placed(mesh: Mesh) -> np.ndarray:
    places = mesh.places
    return np.zeros((len(mesh.triangles.faces), 9)) if places is None else places
