"""How other renderers lay out the sphere: Mitsuba 3's `envmap`, and pbrt-v4's equal-area square."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ParameterError, ShapeError, shown
from ._panorama import Panorama, pixel_count, pixel_directions

MITSUBA_TO_WORLD: NDArray[np.float64] = np.array(
    [[0.0, 0.0, -1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""The `to_world` of Mitsuba's `envmap` that turns pictures of `to_mitsuba` into gonio's world, z up."""
MITSUBA_TO_WORLD.flags.writeable = False

_BLOCK = 1 << 18  # directions that are looked up at a time


def to_mitsuba(picture: Panorama) -> NDArray[Any]:
    """Pixels (2H + 1, W, C) with which Mitsuba 3 interpolates to the same radiance in every direction.

    Mitsuba's rows lie at theta = pi i/(rows - 1), from pole to pole: with 2H + 1 rows, those of odd number are the
    rows of `picture`, the others lie half-way between two of them.
    Source: src/emitters/envmap.cpp of Mitsuba 3.
    """
    pixels = picture.pixels
    height, width, channels = pixels.shape
    out = np.empty((2 * height + 1, max(width, 2), channels), pixels.dtype)
    out[1::2] = pixels
    out[2:-1:2] = 0.5 * pixels[:-1] + 0.5 * pixels[1:]
    out[0], out[-1] = pixels[0], pixels[-1]
    return out


def from_mitsuba(picture: Panorama, height: int | None = None) -> NDArray[Any]:
    """Pixels (H, W, C) of Mitsuba 3's radiance in every direction, at the pixel centres of gonio's layout.

    `height`: rows of the result; without it, as many as `picture` has.
    """
    pixels = picture.pixels
    rows = pixels.shape[0]
    height = rows if height is None else pixel_count("height", height)
    if rows < 2:
        raise ShapeError(f"picture has {rows} row, expected at least 2 in Mitsuba's layout")
    at = (np.arange(height) + 0.5) * ((rows - 1) / height)
    upper = np.minimum(at.astype(np.intp), rows - 2)
    part = (at - upper).astype(pixels.dtype)[:, None, None]
    return (1.0 - part) * pixels[upper] + part * pixels[upper + 1]


def from_mitsuba_turned(picture: Panorama, to_world: Any, height: int | None = None) -> NDArray[Any]:
    """The same of Mitsuba's `envmap` with another `to_world`, interpolated between its pixels.

    Source: src/emitters/envmap.cpp of Mitsuba 3: u = atan2(x, -z)/(2 pi), v = acos(y)/pi of directions turned back.
    """
    pixels, turn = picture.pixels, _rotation(to_world)
    rows, width, channels = pixels.shape
    height = rows if height is None else pixel_count("height", height)
    if rows < 2:
        raise ShapeError(f"picture has {rows} row, expected at least 2 in Mitsuba's layout")
    out = np.empty((height, width, channels), pixels.dtype)
    step = max(1, _BLOCK // width)
    for start in range(0, height, step):
        block = slice(start, min(start + step, height))
        x, y, z = np.moveaxis(pixel_directions(height, width, block) @ turn, -1, 0)
        across = np.arctan2(x, -z) * (width / (2.0 * math.pi)) - 0.5
        down = np.arctan2(np.hypot(x, z), y) * ((rows - 1) / math.pi)
        left, upper = np.floor(across).astype(np.intp), np.minimum(down.astype(np.intp), rows - 2)
        a, b = ((c - k).astype(pixels.dtype)[..., None] for c, k in ((across, left), (down, upper)))
        above, below = (
            (1.0 - a) * pixels[row, left % width] + a * pixels[row, (left + 1) % width] for row in (upper, upper + 1)
        )
        out[block] = (1.0 - b) * above + b * below
    return out


def _rotation(to_world: Any) -> NDArray[np.float64]:
    """The rotation, perhaps with a mirror, of a transform (4, 4) or (3, 3), or of one of Mitsuba's."""
    try:
        matrix = np.array(getattr(to_world, "matrix", to_world), dtype=float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape not in ((3, 3), (4, 4)):
        raise ShapeError(f"to_world={shown(to_world)}: expected a transform (4, 4), as in Mitsuba's scene, or (3, 3)")
    turn = matrix[:3, :3]
    if not np.allclose(turn @ turn.T, np.eye(3), atol=1e-5):
        raise ParameterError(f"to_world={shown(turn.tolist())}: expected a rotation, which directions are turned by")
    return turn


def square_to_direction(s: NDArray[Any]) -> NDArray[Any]:
    """Unit directions (..., 3) of points (..., 2) of the unit square, by an area-preserving map.

    The centre of the square is +z, its corners are -z, the middles of its sides +x, -x, +y, -y. With both
    coordinates from -1 to 1, |u| + |v| = r <= 1 is the upper hemisphere: the square of radius r has the area
    2 r^2 and becomes the cap of area 2 pi r^2, 1 - z = r^2; along its sides the azimuth grows evenly. The
    triangles beyond are folded over their diagonals to the lower hemisphere.

    Source: Clarberg 2008, "Fast equal-area mapping of the (hemi)sphere using SIMD", J. Graphics Tools 13(3),
    as used in PBRT-4 section 3.8.3.
    """
    u, v = (2.0 * s[..., i] - 1.0 for i in range(2))
    a, b = np.abs(u), np.abs(v)
    upper = a + b <= 1.0
    a, b = np.where(upper, a, 1.0 - b), np.where(upper, b, 1.0 - a)
    r = a + b
    phi = 0.5 * math.pi * b / np.where(r > 0.0, r, 1.0)
    sin = r * np.sqrt(2.0 - r * r)
    z = 1.0 - r * r
    x, y = np.copysign(sin * np.cos(phi), u), np.copysign(sin * np.sin(phi), v)
    return np.stack([x, y, np.where(upper, z, -z)], -1)


def direction_to_square(w: NDArray[Any]) -> NDArray[Any]:
    """Points (..., 2) of the unit square for unit directions (..., 3): undoes `square_to_direction`."""
    x, y, z = (w[..., i] for i in range(3))
    r = np.sqrt((x * x + y * y) / (1.0 + np.abs(z)))  # 1 - |z|, without cancellation at the poles
    b = r * np.arctan2(np.abs(y), np.abs(x)) * (2.0 / math.pi)
    a = r - b
    a, b = np.where(z < 0.0, 1.0 - b, a), np.where(z < 0.0, 1.0 - a, b)
    return 0.5 * np.stack([np.copysign(a, x), np.copysign(b, y)], -1) + 0.5


def to_pbrt(picture: Panorama, incident: Callable[[NDArray[Any]], NDArray[Any]], size: int | None) -> NDArray[Any]:
    """Texels (N, N, C) of pbrt-v4's equal-area layout, each the mean radiance over its solid angle 4 pi/N^2.

    `size`: N; without it, 2H/sqrt(pi), which gives texels the solid angle of the pixels at the equator. pbrt
    takes the radiance of the texel that a direction lies in, without interpolation. `incident`: the radiance of
    `picture` from directions.
    """
    height, width, channels = picture.pixels.shape
    size = round(2.0 * height / math.sqrt(math.pi)) if size is None else pixel_count("size", size)
    # At least four points per texel, and two across a pixel.
    fine = max(2, math.ceil(4.0 * max(height, width / 2.0) / (math.sqrt(math.pi) * size)))
    along = (np.arange(size * fine) + 0.5) / (size * fine)
    out = np.empty((size, size, channels), picture.pixels.dtype)
    step = max(1, _BLOCK // (size * fine * fine))
    for start in range(0, size, step):
        v, u = np.meshgrid(along[start * fine : (start + step) * fine], along, indexing="ij")
        radiance = incident(square_to_direction(np.stack([u, v], -1)))
        out[start : start + step] = radiance.reshape(-1, fine, size, fine, channels).mean(axis=(1, 3))
    return out


def from_pbrt(picture: Panorama, height: int | None = None) -> NDArray[Any]:
    """Pixels (H, 2H, C) of a picture in pbrt-v4's equal-area layout: the mean of pbrt's radiance in each.

    `height`: H; without it, sqrt(pi) N/2, which undoes `to_pbrt`.
    """
    size, width, channels = picture.pixels.shape
    if size != width:
        raise ShapeError(f"picture is {width} x {size}, expected a square in pbrt-v4's layout")
    height = round(0.5 * math.sqrt(math.pi) * size) if height is None else pixel_count("height", height)
    fine = max(2, math.ceil(math.sqrt(math.pi) * size / height))
    out = np.empty((height, 2 * height, channels), picture.pixels.dtype)
    step = max(1, _BLOCK // (2 * height * fine * fine))
    for start in range(0, height, step):
        rows = min(step, height - start)
        w = pixel_directions(height * fine, 2 * height * fine, slice(start * fine, (start + rows) * fine))
        texel = np.minimum((direction_to_square(w) * size).astype(np.intp), size - 1)
        texels = picture.pixels[texel[..., 1], texel[..., 0]].reshape(rows, fine, 2 * height, fine, channels)
        sin = np.hypot(w[:, 0, 0], w[:, 0, 1]).reshape(rows, fine)
        weight = sin / (fine * sin.sum(axis=1, keepdims=True))  # solid angles of finer pixels
        out[start : start + rows] = np.einsum("rf,rfcgk->rck", weight, texels)
    return out
