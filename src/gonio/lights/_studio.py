"""A made-up place to look at materials in: sun, sky, hills, a tiled floor, a window and a light strip."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._panorama import pixel_directions

Array = NDArray[np.float64]

# Radiances in linear RGB; _FACTOR, on all of them, makes the largest irradiance pi.
_SUN, _GLOW = (500.0, 405.0, 285.0), (1.1, 0.62, 0.26)
_ZENITH, _HORIZON = (0.08, 0.16, 0.36), (0.56, 0.60, 0.64)
_HILL = (0.10, 0.12, 0.13)
_LIGHT_TILE, _DARK_TILE = (0.36, 0.32, 0.28), (0.07, 0.065, 0.06)
_WINDOW, _STRIP = (4.2, 4.6, 5.1), (7.0, 7.5, 8.2)
_FACTOR = 0.53


def studio_pixels(sun: Array, height: int) -> NDArray[np.float32]:
    """Pixels (H, 2H, 3) of the studio of `EnvironmentLight.studio`; `sun`: a unit vector. Angles in radians.

    sky      from the horizon to the zenith by (1 - z)^3, and a glow exp(-angle to the sun/0.3)
    sun      a disc of radius 0.05, its edge 0.02 wide
    hills    up to the elevation 0.07 + 0.03 sin(3 phi) + 0.02 sin(7 phi + 1) + 0.012 sin(16 phi + 2)
    floor    a plane below, of square tiles, 2/3 of its distance wide, which fade with distance
    window   2 by 2 panes, 53 x 37 degrees, 85 degrees of azimuth from the sun, 32 degrees up
    strip    a lamp, 5 x 58 degrees, 105 degrees of azimuth the other way, 30 degrees up
    """
    w = pixel_directions(height, 2 * height)
    z = w[..., 2]
    soft = math.pi / height  # edges are one pixel wide
    azimuth = math.atan2(sun[1], sun[0])
    phi = np.arctan2(w[..., 1], w[..., 0]) - azimuth
    to_sun = np.arctan2(np.linalg.norm(np.cross(w, sun), axis=-1), w @ sun)

    sky = _mix(_ZENITH, _HORIZON, (1.0 - np.maximum(z, 0.0)) ** 3) + np.exp(-to_sun / 0.3)[..., None] * _GLOW
    hills = 0.07 + 0.03 * np.sin(3 * phi) + 0.02 * np.sin(7 * phi + 1) + 0.012 * np.sin(16 * phi + 2)
    sky = _mix(sky, _HILL, _below(np.arcsin(z), hills, soft))

    down = np.maximum(-z, 1e-3)
    x, y = np.sin(1.5 * math.pi * w[..., 0] / down), np.sin(1.5 * math.pi * w[..., 1] / down)
    blur = 0.75 * soft * math.pi / down**2  # of the pattern, seen at a slant
    tiles = np.clip(x / np.maximum(blur, 0.02), -1, 1) * np.clip(y / np.maximum(blur, 0.02), -1, 1)
    floor = _mix(_DARK_TILE, _LIGHT_TILE, 0.5 + 0.5 * tiles * np.exp(-blur))
    floor = _mix(floor, _HILL, np.exp(-8.0 * down))
    image = _mix(floor, sky, _below(-np.arcsin(z), 0.0, soft))

    a, b = _seen(w, azimuth + math.radians(85.0), math.radians(32.0))
    panes = np.minimum(np.abs(a), np.abs(b))
    window = _below(np.abs(a), 0.5, 0.03) * _below(np.abs(b), 0.33, 0.03) * _below(-panes, -0.025, 0.02)
    image = _mix(image, _WINDOW, window)
    a, b = _seen(w, azimuth - math.radians(105.0), math.radians(30.0))
    image = _mix(image, _STRIP, _below(np.abs(a), 0.045, 0.02) * _below(np.abs(b), 0.55, 0.1))
    image += _below(to_sun, 0.05, 0.02)[..., None] * _SUN
    return (_FACTOR * image).astype(np.float32)


def _mix(a: Any, b: Any, part: Array) -> Array:
    """(1 - part) a + part b of colours."""
    return np.asarray(a) + part[..., None] * (np.asarray(b) - np.asarray(a))


def _below(value: Array, limit: Any, width: float) -> Array:
    """1 where the value is below the limit, 0 above, with a smooth step of the given width between."""
    t = np.clip(0.5 + (limit - value) / width, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _seen(w: Array, azimuth: float, elevation: float) -> tuple[Array, Array]:
    """Where directions meet the plane at distance 1 that faces us from there: to the left, and up."""
    cos_a, sin_a = math.cos(azimuth), math.sin(azimuth)
    cos_e, sin_e = math.cos(elevation), math.sin(elevation)
    ahead = w @ np.array([cos_a * cos_e, sin_a * cos_e, sin_e])
    side, up = w @ np.array([-sin_a, cos_a, 0.0]), w @ np.array([-cos_a * sin_e, -sin_a * sin_e, cos_e])
    seen = ahead > 1e-3
    ahead = np.where(seen, ahead, 1.0)
    return np.where(seen, side / ahead, np.inf), np.where(seen, up / ahead, np.inf)
