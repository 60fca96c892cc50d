"""The pictures of a report: lit spheres, and lobes as solid bodies for where no script runs, such as on paper."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...base.angles import direction
from ...base.light import Light
from ...base.reflectance import Reflectance
from ...base.shown_channels import is_coloured
from ...formula.texture import Texture
from ...lights.cie_sky import CIESky
from ...lights.constant import ConstantLight
from ...lights.distant import DistantLight
from ...lights.point import PointLight
from ...lights.preetham_sky import PreethamSky
from ...lights.sun import SunLight
from ...models.lambertian import Lambertian
from ...pictures.image import Image
from ...scenes.camera import OrthographicCamera
from ...scenes.mesh import Mesh
from ...scenes.rendering import default_light, render
from . import lobes
from .encoded import photograph
from .guarded import Guarded

SIZE, SAMPLES = 300, 24
"""Width and height [pixels] of a sphere, and samples of a pixel."""

ELEMENTS = SIZE * SIZE * SAMPLES
"""What is computed for a sphere, and for no other part of a report more."""

SPHERES = 0.6
"""Share of the time of all pictures that the spheres take."""

SUN = (-0.6, -0.6, 0.55)
"""Direction to the sun of the sky."""

STILL = (15.0, 45.0, 75.0)
"""Angles of incidence [degrees] at which lobes are shown as solid bodies, or those next to them."""

STILL_SIZE, STILL_SAMPLES = 300, 8
"""Width and height [pixels] of the picture of a solid lobe, and samples of a pixel."""

STILL_LIGHTS: list[Light] = [DistantLight((-0.6, -0.6, 0.7), 2.2), ConstantLight(0.3)]
"""The lights of solid lobes."""

Solid = tuple[np.ndarray, np.ndarray]
"""Vertices (V, 3), and faces (F, 3) as numbers of vertices."""

LEAST = 0.015
"""The least radius of a solid lobe."""


def usual_lights(m: Reflectance) -> list[tuple[str, list[Light]]]:
    """Caption -> lights of the spheres: a point, a studio, the sky. A white matt sphere is about white in each."""
    place = (-2.0, -3.0, 3.0)
    point = PointLight(place, math.pi * sum(x * x for x in place))
    studio: Light = default_light(m)
    sky: Light = PreethamSky(3.0, SUN, 0.045) if is_coloured(m) else CIESky(12, SUN, 0.25)
    return [
        ("Point light, from the upper left", [point]),
        ("Studio: soft boxes on all sides", [studio]),
        ("Clear sky, with the sun", [sky, SunLight(SUN, 1.6)]),
    ]


def spheres(
    m: Reflectance, lights: Sequence[tuple[str, Iterable[Light]]], progress: Callable[[float], None]
) -> list[dict[str, Any]]:
    """A sphere under each light: caption and picture, or the reason why there is none."""
    found = []
    for k, (caption, several) in enumerate(lights):
        made = Guarded()
        made.add("src", partial(_sphere, m, several))
        lit = {"reason": made.left_out["src"]} if made.left_out else made.parts
        found.append({"caption": caption, **lit, "notes": made.notes.get("src", [])})
        progress(SPHERES * (k + 1) / len(lights))
    return found


def _sphere(m: Reflectance, lights: Iterable[Light]) -> str:
    return photograph(render(m, list(lights), size=SIZE, samples=SAMPLES))


def stills(given: dict[str, Any]) -> list[dict[str, Any]]:
    """Lobes as solid bodies, rendered: angle of incidence and picture."""
    chosen = sorted({min(given["lobes"], key=lambda x: abs(x["theta_i"] - theta))["theta_i"] for theta in STILL})
    found = []
    for lobe in given["lobes"]:
        if lobe["theta_i"] not in chosen:
            continue
        bodies = [_body(lobe, given, side) for side in ("codes", "through") if side in lobe]
        shown = [body for body in bodies if body is not None]
        if shown:
            found.append(
                {"theta_i": lobe["theta_i"], "src": photograph(_photographed(shown, lobe["theta_i"], len(bodies)))}
            )
    return found


def _photographed(bodies: Sequence[Solid], theta: float, sides: int) -> Image:
    toward, away = direction(math.radians(theta), math.pi), direction(math.radians(theta), 0.0)
    light = _tube([(1.22 * toward).tolist(), (0.01 * toward).tolist()], 0.014)
    mirror = _tube([(0.01 * away).tolist(), (1.22 * away).tolist()], 0.009)
    disc = [_disc(1.12)] if sides == 1 else []
    parts = [
        (bodies, [0.05, 0.32, 0.40]),
        (disc, [0.62, 0.62, 0.62]),
        ([mirror, *(_tube(_ring(r)) for r in (0.25, 0.5, 0.75, 1.0))], [0.28, 0.28, 0.28]),
        ([light], [0.8, 0.45, 0.02]),
    ]
    # One material, with a texel for the colour of each part: kernels are compiled for one, not for four.
    every = [(solid, k) for k, (solids, _) in enumerate(parts) for solid in solids]
    texels = np.concatenate([np.full(len(vertices), k + 0.5) for (vertices, _), k in every])
    mesh = Mesh(
        _together([solid for solid, _ in every]), uv=np.stack([texels / len(parts), np.full(len(texels), 0.5)], -1)
    )
    matt = Lambertian(Texture([[rho for _, rho in parts]], filter="nearest"))
    middle = 0.42 if sides == 1 else 0.1
    camera = OrthographicCamera((1.1, -3.6, middle + 1.28), (0.0, 0.0, middle), width=2.55)
    return render(matt, STILL_LIGHTS, mesh, size=STILL_SIZE, samples=STILL_SAMPLES, camera=camera)


def _together(solids: Sequence[Solid]) -> Solid:
    """Several solids as one."""
    before = np.cumsum([0, *(len(vertices) for vertices, _ in solids)])
    faces = [faces + first for (_, faces), first in zip(solids, before, strict=False)]
    return np.concatenate([vertices for vertices, _ in solids]), np.concatenate(faces)


def _body(lobe: dict[str, Any], given: dict[str, Any], side: str) -> Solid | None:
    """The lobe of one side with a logarithmic radius; None where there is nothing of it."""
    up = 1.0 if side == "codes" else -1.0
    polar, around = (np.radians(lobe[name]) for name in ("polar", "around"))
    codes = np.frombuffer(base64.b64decode(lobe[side]), "<u2").reshape(len(polar), len(around)).astype(float)
    log = given["floor"] + (codes - 1.0) / (lobes.LARGEST - 1) * (given["high"] - given["floor"])
    share = (log - given["low"]) / (given["high"] - given["low"])
    r = np.where(codes > 0.0, np.maximum(share, LEAST), np.nan)
    if not np.nanmax(r, initial=0.0) > LEAST:
        return None
    t, p = np.meshgrid(polar[1:], around[:-1], indexing="ij")
    ring = r[1:, :-1, None] * np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), up * np.cos(t)], -1)
    vertices = np.concatenate([[[0.0, 0.0, up * r[0, 0]]], ring.reshape(-1, 3)])
    rows, columns = t.shape
    at = 1 + np.arange(rows * columns).reshape(rows, columns)
    after = np.roll(at, -1, axis=1)
    corners = [
        (np.zeros(columns, int), at[0], after[0]),
        (at[:-1].ravel(), at[1:].ravel(), after[1:].ravel()),
        (at[:-1].ravel(), after[1:].ravel(), after[:-1].ravel()),
    ]
    every = np.concatenate([np.stack(three, -1) for three in corners])[:, :: int(up)]
    a, b, c = (vertices[every[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=-1)
    kept = every[np.isfinite(area) & (area > 1e-12)]
    if not len(kept):
        return None
    used, numbered = np.unique(kept, return_inverse=True)
    return vertices[used], numbered.reshape(-1, 3)


def _disc(radius: float) -> Solid:
    turn = np.linspace(0.0, 2.0 * math.pi, 72, endpoint=False)
    rim = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn - 0.012], -1)
    k = np.arange(72)
    return np.concatenate([[[0.0, 0.0, -0.012]], rim]), np.stack([0 * k, 1 + k, 1 + (k + 1) % 72], -1)


def _ring(radius: float) -> list[list[float]]:
    turn = np.linspace(0.0, 2.0 * math.pi, 73)
    return [[radius * math.cos(t), radius * math.sin(t), -0.008] for t in turn]


def _tube(points: Sequence[Sequence[float]], radius: float = 0.004) -> Solid:
    """A tube along points, of six sides, open at its ends."""
    at = np.array(points, float)
    along = np.gradient(at, axis=0)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    aside = np.cross(along, [0.3, 0.2, 0.9])
    aside /= np.linalg.norm(aside, axis=-1, keepdims=True)
    other = np.cross(along, aside)
    turn = np.linspace(0.0, 2.0 * math.pi, 6, endpoint=False)
    around = np.cos(turn)[None, :, None] * aside[:, None] + np.sin(turn)[None, :, None] * other[:, None]
    vertices = (at[:, None] + radius * around).reshape(-1, 3)
    faces = []
    for i in range(len(at) - 1):
        for j in range(6):
            a, b = 6 * i + j, 6 * i + (j + 1) % 6
            faces += [[a, b, b + 6], [a, b + 6, a + 6]]
    return vertices, np.array(faces)
