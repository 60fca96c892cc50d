"""What rays meet, as formulas: a shape by its name, triangles, the ground."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import AsStored, Fixed, ops
from ..errors import DependencyError
from ..formula.direction import NORMAL, Direction, cross, dot, normalize, select
from ..formula.fields import option, param
from ..formula.parametrised import Parametrised
from ..formula.state import note
from ..numerics.embree import EmbreeTriangles
from ..rays.tree import BoxTree
from ..rays.walk import nearest, tables
from .hit import Hit
from .shapes import SHAPES

FAR = 1e30


class Body(Parametrised, has_text=False):
    """What rays meet."""

    _noun: ClassVar[str] = "a body"

    @abstractmethod
    def first(self, o: Direction, d: Direction) -> tuple[Hit, Any]:
        """Where rays first meet it, and the number of the material there."""

    @abstractmethod
    def blocks(self, p: Direction, w: Direction, far: Any) -> Any:
        """Whether it is between points and what is so far away; of rays with far < 0 nothing is asked."""


class Solid(Body):
    """A convex shape by its name, within the unit sphere."""

    shape = option(*SHAPES, doc="its name")
    part = param(0.0, 0.0, 1e6, "the number of its material")

    def first(self, o: Direction, d: Direction) -> tuple[Hit, Any]:
        return SHAPES[self.shape](o, d), self.part

    def blocks(self, p: Direction, w: Direction, far: Any) -> Any:
        at = SHAPES[self.shape](p, w)
        return at.met & (at.distance < far)


class Ground(Body):
    """A level plane without end, seen and lit from above."""

    level = param(-1.0, -1e30, 1e30, "its height", unit="m")
    scale = param(1.0, 0.0, 1e30, "the length that u and v repeat after", unit="m")
    part = param(0.0, 0.0, 1e6, "the number of its material")

    def first(self, o: Direction, d: Direction) -> tuple[Hit, Any]:
        falls = (d.z < -1e-6) & (o.z > self.level)
        t = ops.where(falls, (self.level - o.z) / ops.where(falls, d.z, -1.0), 1.0)
        x, y = o.x + d.x * t, o.y + d.y * t
        u, v = x / self.scale + 0.5, 0.5 - y / self.scale
        p = Direction(x, y, self.level + 0.0 * t)
        return Hit(falls, p, NORMAL, Direction(1.0, 0.0, 0.0), u - ops.floor(u), v - ops.floor(v), NORMAL, t), self.part

    def blocks(self, p: Direction, w: Direction, far: Any) -> Any:
        falls = (w.z < -1e-6) & (p.z > self.level)
        return falls & (self.level - p.z > w.z * far)


class TriangleBody(Body):
    """Triangles."""

    look = option("flat", "smooth", doc="normals of triangles, or those of their corners interpolated")
    places = option("box", "file", doc="u and v of the box about all, seen from the front, or of the corners")
    parts = option("one", "several", doc="materials: the first one, or of each triangle its own")
    found_by = option("Embree", "tree", doc="the tree of boxes, where Embree is not installed")
    low_x = param(-1.0, -1e30, 1e30, "left of the box")
    high_z = param(1.0, -1e30, 1e30, "top of the box")
    wide = param(2.0, 0.0, 1e30, "width of the box")
    tall = param(2.0, 0.0, 1e30, "height of the box")

    tables: Mapping[str, Fixed] = note()
    tree: Any  # tables, as formulas have them
    leaves: Any
    normals: Any
    corners: Any
    materials: Any

    @classmethod
    def of(
        cls,
        vertices: np.ndarray,
        faces: np.ndarray,
        normals: np.ndarray,
        places: np.ndarray | None,
        materials: np.ndarray | None,
        box: np.ndarray,
    ) -> Self:
        """Triangles with normals (F, 3), or (F, 12) with those of their corners; places (F, 9): u and v of the corners
        and the tangent; materials (F,); the box about all as its low and high corner."""
        try:
            trees, found_by = {"tree": Fixed(EmbreeTriangles(vertices, faces).handle)}, "Embree"
        except DependencyError:
            held = zip(("tree", "leaves"), tables(BoxTree(vertices, faces)), strict=True)
            trees, found_by = {name: AsStored(x) for name, x in held}, "tree"
        (x, _, z), (wide, _, tall) = box[0], np.maximum(box[1] - box[0], 1e-30)
        new = cls(
            "smooth" if normals.shape[1] > 3 else "flat",
            "box" if places is None else "file",
            "one" if materials is None else "several",
            found_by,
            *map(float, (x, z + tall, wide, tall)),
        )
        optional = {"normals": normals, "corners": places, "materials": materials}
        stored = {name: AsStored(x.astype(np.float32).reshape(-1)) for name, x in optional.items() if x is not None}
        new._hold(tables={**trees, **stored})
        new._kept.update(new.tables)
        return new

    def _keep(self) -> dict[str, Fixed]:
        return {**super()._keep(), **(self.tables or {})}

    def first(self, o: Direction, d: Direction) -> tuple[Hit, Any]:
        if self.found_by == "tree":
            t, a, b, number = nearest(self.tree, self.leaves, o, d, FAR)
        else:
            t, a, b, number = ops.nearest(self.tree, o, d, 0.0, FAR)
        met = t < FAR
        t = ops.where(met, t, 1.0)
        p = o + d * t
        count = 12 if self.look == "smooth" else 3
        rows = [ops.take(self.normals, count * number + k) for k in range(count)]
        face = n = Direction(*rows[:3])
        if self.look == "smooth":
            n = normalize(Direction(*rows[3:6]) * (1.0 - a - b) + Direction(*rows[6:9]) * a + Direction(*rows[9:]) * b)
        if self.places == "file":
            x = [ops.take(self.corners, 9 * number + k) for k in range(9)]
            u, v = ((1.0 - a - b) * x[i] + a * x[2 + i] + b * x[4 + i] for i in (0, 1))
            along = Direction(*x[6:])
            along = along - n * dot(along, n)
        else:
            u = ops.clip((p.x - self.low_x) / self.wide, 0.0, 1.0)
            v = ops.clip((self.high_z - p.z) / self.tall, 0.0, 1.0)
            along = Direction(-n.y, n.x, 0.0 * n.x)
        short = dot(along, along) < 1e-12
        along = normalize(select(short, cross(Direction(0.0, 1.0, 0.0), n), along))
        part = 0.0 if self.parts == "one" else ops.take(self.materials, number)
        return Hit(met, p, n, along, u, v, face, t), part

    def blocks(self, p: Direction, w: Direction, far: Any) -> Any:
        if self.found_by == "tree":
            return nearest(self.tree, self.leaves, p, w, far, any_will_do=True)[0] < FAR
        return ops.blocked(self.tree, p, w, 0.0, far)
