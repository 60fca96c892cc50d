"""Pictures and what is seen in them: images, differences, meshes, scenes, light on patches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...interreflection.result import Radiosity
from ...pictures.difference import PictureDifference
from ...pictures.image import Image
from ...rays.triangles import Triangles
from ...scenes.mesh import Mesh
from ...scenes.scene import Scene
from ...scenes.stokes import StokesPicture
from . import _sphere
from ._html import Cut, image, paragraph, table
from ._things import html_of, numbers, png_of

WIDTH, FINEST = 320, 640
"""Pixels across: as shown, and of what is sent at most."""

CAST = 200
"""Pixels across of pictures of meshes."""

PARTS = ((0.55, 0.62, 0.70), (0.80, 0.52, 0.30), (0.40, 0.62, 0.45), (0.72, 0.55, 0.68), (0.75, 0.70, 0.40))
"""Colours of the parts of a scene, which tell them apart."""


@html_of.register
def _image(picture: Image) -> Cut:
    height, width, count = picture.pixels.shape
    names = ", ".join(picture.channels) if picture.channels and count <= 4 else f"{count} channels"
    known = picture.pixels[np.isfinite(picture.pixels)]
    rows = [("pixels", f"{width} x {height}, {names}"), ("alpha", _coverage(picture))]
    if known.size:
        rows.append(("values", f"{known.min():.4g} to {known.max():.4g}, mean {known.mean():.4g}"))
    if known.size < picture.pixels.size:
        rows.append(("not finite", f"{picture.pixels.size - known.size} values"))
    if picture.samples is not None:
        rows.append(
            ("samples", f"{picture.samples} a pixel{', with their errors' if picture.error is not None else ''}")
        )
    shown = image(_png(picture), min(max(width, 64), WIDTH), "the picture")
    return Cut("Image", "linear; shown as sRGB", shown, (table(("", ""), rows),))


def _coverage(picture: Image) -> str:
    if picture.alpha is None:
        return "none"
    return "coverage, multiplied into the pixels" if picture.premultiplied else "coverage, not multiplied in"


@png_of.register
def _png(picture: Image) -> bytes:
    step = max(1, -(-max(picture.pixels.shape[:2]) // FINEST))
    pixels = picture.colour[::step, ::step]
    pixels = pixels if pixels.shape[-1] in (1, 3) else pixels.mean(axis=-1, keepdims=True)
    return _sphere.png(pixels, None if picture.alpha is None else picture.alpha[::step, ::step])


@html_of.register
def _difference(found: PictureDifference) -> Cut:
    size = np.abs(found.pixels).mean(axis=-1)
    scale = float(np.quantile(size[found.inside], 0.995)) or 1.0
    signed = np.clip(found.pixels.mean(axis=-1) / scale, -1.0, 1.0)[..., None]
    red, blue = np.array([0.75, 0.03, 0.05]), np.array([0.02, 0.12, 0.62])
    shown = np.where(signed > 0.0, 1.0 - signed * (1.0 - red), 1.0 + signed * (1.0 - blue))
    step = max(1, -(-max(shown.shape[:2]) // FINEST))
    png = _sphere.png(shown[::step, ::step], found.inside[::step, ::step].astype(np.float32))
    beside = image(png, min(max(shown.shape[1], 64), WIDTH), "b - a: red where b is brighter, blue where it is darker")
    words = "red where b is brighter, blue where it is darker; gn.figures.difference(found) has a scale"
    return Cut("Difference", "b - a", beside, (paragraph(found), paragraph(words, quiet=True)))


@html_of.register
def _stokes(picture: StokesPicture) -> Cut:
    stokes = {name: getattr(picture, name) for name in ("pixels", "stokes") if hasattr(picture, name)}
    rows = [(name, " x ".join(map(str, np.shape(value)))) for name, value in stokes.items()]
    return Cut("StokesPicture", repr(picture)[:120], parts=(table(("", ""), rows),))


def _material(mesh: Mesh) -> str:
    return "that of the picture" if mesh.material is None else repr(mesh.material)[:120]


@html_of.register
def _mesh(mesh: Mesh) -> Cut:
    low, high = mesh.triangles.vertices.min(axis=0), mesh.triangles.vertices.max(axis=0)
    rows: list[Sequence[Any]] = [
        ("triangles", len(mesh.triangles.faces)),
        ("vertices", len(mesh.triangles.vertices)),
        ("from", numbers(low)),
        ("to", numbers(high)),
        ("area", f"{mesh.triangles.areas.sum():.4g}"),
        ("material", _material(mesh)),
    ]
    if mesh.exitance.any():
        rows.append(("exitance", numbers(mesh.exitance) + " W m-2"))
    if mesh.uv is not None:
        rows.append(("texture", "places of its own"))
    return Cut("Mesh", "", _cast([mesh]), (table(("", ""), rows),))


@html_of.register
def _scene(scene: Scene) -> Cut:
    rows = [
        (
            k,
            len(mesh.triangles.faces),
            _material(mesh),
            numbers(mesh.exitance) if mesh.exitance.any() else "",
        )
        for k, mesh in enumerate(scene.parts)
    ]
    parts = (table(("part", "triangles", "material", "exitance"), rows, "scene.parts"),)
    return Cut("Scene", f"{len(scene.parts)} parts", _cast(scene.parts), parts)


@html_of.register
def _radiosity(light: Radiosity) -> Cut:
    area = 0.5 * np.linalg.norm(
        np.cross(light.corners[:, 1] - light.corners[:, 0], light.corners[:, 2] - light.corners[:, 0]), axis=1
    )
    rows = []
    for part in range(int(light.part.max()) + 1):
        of = light.part == part
        leaves, arrives = (np.average(x[of], axis=0, weights=area[of]) for x in (light.radiosity, light.irradiance))
        rows.append((part, int(of.sum()), *(numbers(values[:4]) for values in (leaves, arrives))))
    balance, escaped = (", ".join(f"{b:.4f}" for b in shares[:3]) for shares in (light.balance, light.escaped))
    words = f"{len(light.part)} patches; energy balance {balance}, escaped {escaped}"
    head = ("part", "patches", "leaves [W m-2]", "arrives [W m-2]")
    return Cut("Radiosity", words, parts=(table(head, rows), paragraph("means over area", quiet=True)))


def _cast(parts: Sequence[Mesh]) -> str:
    """A quick picture of meshes from above and in front, lit from beside the viewer: what shape they have."""
    vertices = np.concatenate([mesh.triangles.vertices for mesh in parts])
    first = np.cumsum([0, *(len(mesh.triangles.vertices) for mesh in parts)])
    faces = np.concatenate([mesh.triangles.faces + at for mesh, at in zip(parts, first, strict=False)])
    of = np.repeat(np.arange(len(parts)), [len(mesh.triangles.faces) for mesh in parts])
    if len(parts) > 1:  # the edges of parts may meet
        triangles = Triangles.__new__(Triangles)
        triangles.vertices, triangles.faces = vertices, np.ascontiguousarray(faces, np.int32)
    else:
        triangles = parts[0].triangles
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    centre, size = 0.5 * (low + high), float(np.linalg.norm(high - low)) or 1.0
    towards = np.array([0.45, -0.8, 0.4]) / np.linalg.norm([0.45, -0.8, 0.4])
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    across = 0.56 * size * ((np.arange(CAST) + 0.5) / CAST * 2.0 - 1.0)
    origins = centre + size * towards + across[None, :, None] * right - across[:, None, None] * up
    rays = np.broadcast_to(-towards, origins.shape).reshape(-1, 3)
    hits = triangles.shoot(origins.reshape(-1, 3), np.ascontiguousarray(rays))
    met = hits.face >= 0
    n = triangles.normals[np.maximum(hits.face, 0)]
    n = np.where((n @ towards)[:, None] < 0.0, -n, n)
    lamp = towards + 0.6 * up - 0.5 * right
    shade = 0.25 + 0.75 * np.clip(n @ (lamp / np.linalg.norm(lamp)), 0.0, 1.0)
    colours = np.asarray(PARTS)[of[np.maximum(hits.face, 0)] % len(PARTS)] ** 2.2
    pixels = (shade[:, None] * colours).reshape(CAST, CAST, 3)
    return image(_sphere.png(pixels, met.reshape(CAST, CAST).astype(np.float32)), CAST, "the shape")
