"""A small sphere of a material, for display: one light path a sample, in a few hundredths of a second.

Pictures to be judged by are made by `gn.render`.
"""

from __future__ import annotations

import io
import math
from collections import OrderedDict
from functools import cache
from threading import Lock
from typing import Any

import numpy as np

from ...arrays.kinds import with_channels
from ...base.angles import direction
from ...base.frames import to_local, to_world
from ...base.map_shape import map_shape
from ...base.reflectance import Reflectance
from ...base.shown_channels import is_rgb, shown_as
from ...evaluate.tracing import at_most
from ...formula import tree
from ...lights.environment import EnvironmentLight
from ...numerics.lattice import lattice
from ...pictures.files import png_jpeg
from ...pictures.image import Image

SIZE = 120
"""Pixels across."""

SAMPLES = 24
"""Samples of a pixel."""

KEPT = 64
"""Pictures that are kept."""

MAP = 160
"""The most places of a map across its picture."""

SUN = (-0.8, -0.7, 0.8)
BRIGHTEST = 5.0
"""Radiance from which on the studio belongs to the sun, which is lit by itself: a small lamp is noise."""

_pictures: OrderedDict[Reflectance, bytes | None] = OrderedDict()
_lock = Lock()


def picture(m: Reflectance) -> bytes | None:
    """PNG of a lit sphere, of a map of its places; kept for materials that are equal. None where there is nothing."""
    with _lock:
        if m in _pictures:
            _pictures.move_to_end(m)
            return _pictures[m]
    with at_most(SIZE * SIZE * SAMPLES):
        pixels, alpha = _map(m) if map_shape(m) else _sphere(m)
    found = None if not np.isfinite(pixels).any() else png(pixels, alpha)
    with _lock:
        _pictures[m] = found
        while len(_pictures) > KEPT:
            _pictures.popitem(last=False)
    return found


def png(pixels: np.ndarray, alpha: np.ndarray | None, exposure: float = 0.0) -> bytes:
    """Linear pixels (H, W, 1 or 3) as the bytes of a PNG file."""
    stream: Any = io.BytesIO()
    known = np.nan_to_num(pixels.astype(np.float32), posinf=1e4)
    png_jpeg.encode(Image(known, alpha), "picture", exposure)(stream)
    return bytes(stream.getvalue())


@cache
def _studio() -> tuple[EnvironmentLight, np.ndarray, np.ndarray]:
    """The studio without its sun, the direction to the sun, and its irradiance."""
    pixels = EnvironmentLight.studio(SUN, height=64).image.pixels
    rows = math.pi / len(pixels)
    angle = rows * rows * np.sin((np.arange(len(pixels)) + 0.5) * rows)[:, None, None]
    dimmed = np.minimum(pixels, BRIGHTEST)
    sun = ((pixels - dimmed) * angle).sum(axis=(0, 1))
    return EnvironmentLight(dimmed), np.asarray(SUN) / np.linalg.norm(SUN), sun


def _sphere(m: Reflectance) -> tuple[np.ndarray, np.ndarray]:
    """Linear pixels of a sphere, and what of each it covers."""
    light, to_sun, irradiance = _studio()
    across = (np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0
    x, z = np.broadcast_arrays(1.02 * across, -1.02 * across[:, None])
    radius = np.hypot(x, z)
    alpha = np.clip((1.0 - radius) * SIZE / 2.0 + 0.5, 0.0, 1.0).astype(np.float32)
    rows, columns = np.nonzero(alpha)
    shrunk = np.minimum(1.0, 0.9995 / np.maximum(radius[rows, columns], 1e-9))  # pixels on the edge see the edge
    nx, nz = x[rows, columns] * shrunk, z[rows, columns] * shrunk
    n = np.stack([nx, -np.sqrt(np.maximum(1.0 - nx * nx - nz * nz, 0.0)), nz], axis=-1)
    t = np.stack([-n[:, 1], n[:, 0], 0.0 * nx], axis=-1)
    t /= np.maximum(np.linalg.norm(t, axis=-1, keepdims=True), 1e-9)
    wo = to_local(np.array([0.0, -1.0, 0.0]), n, t)
    u = lattice(SAMPLES)
    u = np.mod(u[:, None, :] + np.random.default_rng(1).random((1, len(n), 2)), 1.0)  # other ones in each pixel
    many = np.broadcast_to(wo, (SAMPLES, *wo.shape))
    drawn = m.sample(many, u)
    weight = with_channels(drawn.weight, 2)
    hit = np.isfinite(weight).all(axis=-1) & (np.abs(drawn.wi).sum(axis=-1) > 0.0)
    wi = to_world(np.where(hit[..., None], drawn.wi, [0.0, 0.0, 1.0]), n, t)
    sky = (_colour(m, np.where(hit[..., None], weight, 0.0)) * light.incident(wi)).mean(axis=0)
    wi = np.ascontiguousarray(to_local(to_sun, n, t))
    f = np.nan_to_num(_colour(m, with_channels(m.f(wi, wo), 1)))
    pixels = np.zeros((SIZE, SIZE, 3), np.float32)
    pixels[rows, columns] = sky + f * np.maximum(wi[:, 2:], 0.0) * irradiance
    return pixels, alpha


def _colour(m: Reflectance, values: np.ndarray) -> np.ndarray:
    """Values by channel as red, green and blue, or as gray."""
    if (matrix := shown_as(m, None)) is not None:
        return np.asarray(np.maximum(values @ matrix, 0.0))
    return values if values.shape[-1] == 3 and is_rgb(m) else values.mean(axis=-1, keepdims=True)


def _map(m: Reflectance) -> tuple[np.ndarray, None]:
    """Linear pixels of the places of a map, seen along the normal."""
    shape = map_shape(m)
    steps = tuple(slice(None, None, max(1, -(-n // MAP))) for n in shape[-2:])

    def thinned(value: Any) -> Any:
        if getattr(value, "ndim", 0) < 2:
            return value
        whole = np.broadcast_to(value, (*shape, value.shape[-1]))
        place: tuple[Any, ...] = (*(0,) * (len(shape) - len(steps)), *steps)
        return np.ascontiguousarray(whole[place])

    few = tree.each(m, thinned)
    of = map_shape(few)
    f = with_channels(few.f(direction(math.radians(45.0), math.pi), direction(0.0, 0.0)), len(of))
    pixels = math.pi * _colour(m, f)
    return np.reshape(pixels, (-1, *pixels.shape[-2:]) if len(of) > 1 else (1, *pixels.shape)), None
