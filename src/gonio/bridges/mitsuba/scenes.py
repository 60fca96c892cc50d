"""Scenes for Mitsuba 3: what `gn.render` shows, as a dictionary for `mi.load_dict`."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...base.light import Light
from ...base.reflectance import Reflectance
from ...errors import ParameterError
from ...formula.text import listed
from ...lights._flat import shines
from ...lights.constant import ConstantLight
from ...lights.disk import DiskLight
from ...lights.distant import DistantLight
from ...lights.environment import EnvironmentLight
from ...lights.mesh import MeshLight
from ...lights.point import PointLight
from ...lights.polygon import PolygonLight
from ...lights.rectangle import RectangleLight
from ...lights.sphere import SphereLight
from ...scenes.camera import FRONT, MARGIN, Camera, OrthographicCamera, View
from ...scenes.heights import laid
from ...scenes.mesh import Mesh
from ...scenes.scene import Scene
from ...scenes.shapes import SHAPES
from ...scenes.stage import Stage
from ...surfaces.height_field import HeightField

HALF = math.sqrt(0.5)
"""Half the side of the shapes "plane" and "cylinder"."""

FAR = 1e4
"""Half the side of the ground, over the size of what stands on it."""


class SceneWriter:
    """What Mitsuba has for the things of a scene. `mi`: Mitsuba; `bsdf`: makes one of a reflectance."""

    def __init__(self, mi: Any, bsdf: Callable[[Reflectance], Any]):
        self.mi, self.bsdf, self.turn = mi, bsdf, mi.ScalarTransform4f

    def shapes(self, shape: Any, m: Reflectance | None) -> dict[str, Any]:
        """The shapes by name; those without a material have `m`."""
        if isinstance(shape, Scene):
            return {f"part_{k}": self._mesh(part, m) for k, part in enumerate(shape.parts)}
        if isinstance(shape, Mesh):
            return {"shape": self._mesh(shape, m)}
        bsdf = self.bsdf(_given(m))
        if shape in ("disk", "cylinder") and not _given(m).is_isotropic():
            rule = "whose tangents Mitsuba chooses otherwise; expected a sphere, a plane, or gn.scenes.Mesh(..., uv=uv)"
            raise ParameterError(f"mitsuba.scene: {m!r:.80} is anisotropic, on a {shape}, {rule}")
        upright = self.turn().rotate([1, 0, 0], 90.0)  # the front of a disk or rectangle, +z, becomes -y
        if shape == "sphere":
            return {"shape": {"type": "sphere", "bsdf": bsdf}}
        if shape == "disk":
            return {"shape": {"type": "disk", "to_world": upright, "bsdf": bsdf}}
        if shape == "plane":
            return {"shape": {"type": "rectangle", "to_world": upright @ self.turn().scale(HALF), "bsdf": bsdf}}
        wall = {"type": "cylinder", "p0": [0, 0, -HALF], "p1": [0, 0, HALF], "radius": HALF, "bsdf": bsdf}
        top = self.turn().translate([0, 0, HALF]) @ self.turn().scale(HALF)
        bottom = self.turn().rotate([1, 0, 0], 180.0) @ top
        ends = {name: {"type": "disk", "to_world": at, "bsdf": bsdf} for name, at in (("top", top), ("bottom", bottom))}
        return {"shape": wall, **ends}

    def ground(self, m: Reflectance, middle: np.ndarray, size: float) -> dict[str, Any]:
        """A large square, for a plane without end."""
        at = self.turn().translate(middle.tolist()) @ self.turn().scale(FAR * size)
        return {"type": "rectangle", "to_world": at, "bsdf": self.bsdf(m)}

    def sensor(self, camera: View, size: int, samples: int) -> dict[str, Any]:
        """A camera."""
        eye, target, up = (np.asarray(x).tolist() for x in (camera.eye, camera.target, camera.up))
        at = self.turn().look_at(origin=eye, target=target, up=up)
        projection: dict[str, Any] = {"type": "orthographic"}
        if isinstance(camera, Camera):
            projection = {"type": "perspective", "fov": math.degrees(float(camera.field_of_view))}
        elif isinstance(camera, OrthographicCamera):
            half = 0.5 * float(camera.width)
            at = at @ self.turn().scale([half, half, 1.0])
        else:
            rule = "expected gn.scenes.Camera, gn.scenes.OrthographicCamera or none"
            raise ParameterError(f"mitsuba.scene: {camera!r:.60} is a camera of its own kind; {rule}")
        film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
        sampler = {"type": "multijitter", "sample_count": samples}
        return {**projection, "to_world": at, "film": film, "sampler": sampler}

    def light(self, light: Light) -> dict[str, Any] | Any:
        """An emitter, or a shape that is one. Raises ParameterError for what Mitsuba has no equal of."""
        for light_class, write in LIGHTS.items():
            if type(light) is light_class:
                return write(self, light.in_numpy())
        rule = f"expected {listed([light_class.__name__ for light_class in LIGHTS])}, which Mitsuba has too"
        raise ParameterError(f"mitsuba.scene: {light!r:.80}; {rule}")

    def rgb(self, value: Any) -> dict[str, Any]:
        """A number, or three."""
        numbers = np.atleast_1d(np.asarray(value, np.float64))
        if numbers.shape not in ((1,), (3,)):
            rule = "expected one number or RGB"
            raise ParameterError(f"mitsuba.scene: a light of {numbers.size} channels; {rule}")
        return {"type": "rgb", "value": np.broadcast_to(numbers, 3).tolist()}

    def _area(self, radiance: Any) -> dict[str, Any]:
        return {"type": "area", "radiance": self.rgb(radiance)}

    def _point(self, light: PointLight) -> dict[str, Any]:
        return {"type": "point", "position": _list(light.position), "intensity": self.rgb(light.intensity)}

    def _distant(self, light: DistantLight) -> dict[str, Any]:
        towards = (-np.asarray(light.direction)).tolist()
        return {"type": "directional", "direction": towards, "irradiance": self.rgb(light.irradiance)}

    def _constant(self, light: ConstantLight) -> dict[str, Any]:
        return {"type": "constant", "radiance": self.rgb(light.radiance)}

    def _environment(self, light: EnvironmentLight) -> dict[str, Any]:
        pixels = np.asarray(light.to_mitsuba().pixels, np.float32)
        pixels = np.broadcast_to(pixels, (*pixels.shape[:2], 3)).copy()  # Mitsuba takes none that is read-only
        to_world = self.turn(light.MITSUBA_TO_WORLD.tolist())
        return {"type": "envmap", "bitmap": self.mi.Bitmap(pixels), "to_world": to_world}

    def _sphere(self, light: SphereLight) -> dict[str, Any]:
        at = {"center": _list(light.centre), "radius": float(light.radius)}
        return {"type": "sphere", **at, "emitter": self._area(light.radiance)}

    def _disk(self, light: DiskLight) -> dict[str, Any]:
        _front_alone(light)
        centre, normal = np.asarray(light.centre), np.asarray(light.normal)
        up = [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [0.0, 1.0, 0.0]
        at = self.turn().look_at(origin=centre.tolist(), target=(centre + normal).tolist(), up=up)
        at = at @ self.turn().scale([*[float(light.radius)] * 2, 1.0])
        return {"type": "disk", "to_world": at, "emitter": self._area(light.radiance)}

    def _rectangle(self, light: RectangleLight) -> dict[str, Any]:
        _front_alone(light)
        x, y = 0.5 * np.asarray(light.edge_x), 0.5 * np.asarray(light.edge_y)
        normal = np.cross(x, y)
        columns = [x, y, normal / np.linalg.norm(normal), np.asarray(light.centre)]
        matrix = np.vstack([np.stack(columns, axis=1), [0.0, 0.0, 0.0, 1.0]])
        return {"type": "rectangle", "to_world": self.turn(matrix.tolist()), "emitter": self._area(light.radiance)}

    def _polygon(self, light: PolygonLight) -> Any:
        _front_alone(light)
        corners = np.asarray(light.corners, np.float64)
        edges = np.roll(corners, -1, axis=0) - corners
        turns = np.cross(edges, np.roll(edges, -1, axis=0))
        if (turns @ turns.sum(axis=0) < 0.0).any():
            rule = "expected a convex one, or gn.MeshLight"
            raise ParameterError(f"mitsuba.scene: {light!r:.80}, a polygon with a corner that points inwards; {rule}")
        fan = [[0, k, k + 1] for k in range(1, len(corners) - 1)]
        return self._triangles(corners, np.array(fan), None, None, emitter=self._area(light.radiance))

    def _mesh_light(self, light: MeshLight) -> Any:
        shape = light.shape
        return self._triangles(shape.vertices, shape.faces, None, None, emitter=self._area(light.radiance))

    def _mesh(self, mesh: Mesh, m: Reflectance | None) -> Any:
        shown = _given(m if mesh.material is None else mesh.material)
        smooth = mesh.normals[:, 3:].reshape(-1, 3) if mesh.normals.shape[1] > 3 else None
        emitter = self._area(mesh.exitance / math.pi) if mesh.exitance.any() else None
        if mesh.places is None and not shown.is_isotropic():
            rule = "whose tangents Mitsuba chooses otherwise; expected gn.scenes.Mesh(..., uv=places)"
            raise ParameterError(f"mitsuba.scene: {shown!r:.80} is anisotropic, on a mesh without uv, {rule}")
        places = None if mesh.places is None else mesh.places[:, :6].reshape(-1, 2)
        corners = mesh.triangles.corners.reshape(-1, 3)
        faces = np.arange(len(corners)).reshape(-1, 3)
        return self._triangles(corners, faces, smooth, places, bsdf=self.bsdf(shown), emitter=emitter)

    def _triangles(
        self, vertices: Any, faces: Any, normals: np.ndarray | None, places: np.ndarray | None, **things: Any
    ) -> Any:
        mi, props = self.mi, self.mi.Properties()
        for name, thing in things.items():
            if thing is not None:
                props[name] = mi.load_dict(thing) if isinstance(thing, dict) else thing
        made = mi.Mesh("mesh", len(vertices), len(faces), props, normals is not None, places is not None)
        values = mi.traverse(made)
        values["vertex_positions"] = np.asarray(vertices, np.float32).reshape(-1)
        values["faces"] = np.asarray(faces, np.uint32).reshape(-1)
        if normals is not None:
            values["vertex_normals"] = np.asarray(normals, np.float32).reshape(-1)
        if places is not None:
            values["vertex_texcoords"] = np.asarray(places, np.float32).reshape(-1)
        values.update()
        return made


LIGHTS: dict[type[Light], Callable[[SceneWriter, Any], Any]] = {
    PointLight: SceneWriter._point,
    DistantLight: SceneWriter._distant,
    ConstantLight: SceneWriter._constant,
    EnvironmentLight: SceneWriter._environment,
    RectangleLight: SceneWriter._rectangle,
    DiskLight: SceneWriter._disk,
    SphereLight: SceneWriter._sphere,
    PolygonLight: SceneWriter._polygon,
    MeshLight: SceneWriter._mesh_light,
}
"""The lights that Mitsuba has too, and how they are written."""


def dictionary(
    writer: SceneWriter,
    m: Reflectance | None,
    shape: Any,
    lights: Sequence[Light],
    camera: View | None,
    ground: Reflectance | None,
    size: int,
    samples: int,
) -> dict[str, Any]:
    """The scene, see `scene` of this bridge."""
    if isinstance(shape, (str, os.PathLike)) and shape not in SHAPES:
        shape = Mesh(shape)
    stage = Stage.of(shape, camera, ground, glows=True)
    if isinstance(shape, HeightField):
        shape = laid(shape)
    parts = shape.parts if isinstance(shape, Scene) else [shape] if isinstance(shape, Mesh) else []
    glows = any(part.exitance.any() for part in parts)
    view = OrthographicCamera([0.0, -4.0, 0.0], width=2.0 * MARGIN) if stage.camera is FRONT else stage.camera
    things: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1, "hide_emitters": not glows},
        "sensor": writer.sensor(view, size, samples),
        **writer.shapes(shape, m),
    }
    if ground is not None:
        below = (0.0, 0.0, float(stage.bodies[-1].parameters["level"].value))
        things["ground"] = writer.ground(ground, stage.middle + below, stage.size)
    for k, light in enumerate(lights):
        things[f"light_{k}"] = writer.light(light)
    return things


def _given(m: Reflectance | None) -> Reflectance:
    if m is None:
        raise ParameterError("mitsuba.scene: a part has no material; expected one for each, or m with shape=scene")
    return m


def _front_alone(light: Any) -> None:
    if shines(light.sides, np.False_):  # to where its normal does not point
        rule = "expected sides='front', or two lights, back to back"
        raise ParameterError(f"mitsuba.scene: {light!r:.80} shines to both sides; {rule}")


def _list(vector: Any) -> list[float]:
    return [float(x) for x in np.asarray(vector)]
