"""Exact solid angles, and projected solid angles: the irradiance by uniform light of radiance 1."""

import numpy as np

from ..declared.arrays import Array
from ..declared.arrays import formula as _formula
from ..errors import ParameterError
from .kinds import _Azimuth, _dot, _NotNegative, _Polar, _Polygon, _Positive, _Vector

# Solid angles


@_formula
def solid_angle_cone(half_angle: _Polar) -> Array:
    """Solid angle of a circular cone: ω = 2π (1 − cos a) = 4π sin²(a/2).

    Shapes any. Units rad -> sr. Error rounding, also for a = 1e-8.
    Source Archimedes, On the Sphere and Cylinder: the area of a cap.

    Example
    >>> print(gn.radiometry.solid_angle_cone(half_angle=np.radians(0.266)).round(8))  # the sun
    6.771e-05
    """
    return 4.0 * np.pi * np.square(np.sin(0.5 * half_angle))


@_formula
def solid_angle_cap(theta_0: _Polar, theta_1: _Polar) -> Array:
    """Solid angle between two polar angles, all around: ω = 2π (cosθ₀ − cosθ₁); negative for θ₁ < θ₀.

    Shapes broadcast. Units rad -> sr. Error rounding, also for thin belts.
    Source Archimedes, On the Sphere and Cylinder: the area of a cap.

    Example
    >>> print(gn.radiometry.solid_angle_cap(0.0, np.pi / 2).round(4))
    6.2832
    """
    return solid_angle_latlong_pixel(theta_0, theta_1, 2.0 * np.pi)


@_formula
def solid_angle_latlong_pixel(theta_0: _Polar, theta_1: _Polar, width: _Azimuth) -> Array:
    """Solid angle of a latitude–longitude pixel: ω = Δφ (cosθ₀ − cosθ₁) = 2Δφ sin((θ₀+θ₁)/2) sin((θ₁−θ₀)/2).

    Shapes broadcast. Units polar angles and width Δφ in rad -> sr. Error rounding, also for thin pixels.
    Source The integral of sinθ dθ dφ.

    Example
    >>> print(gn.radiometry.solid_angle_latlong_pixel(1.0, 1.1, width=0.1).round(5))
    0.00867
    """
    return 2.0 * width * np.sin(0.5 * (theta_0 + theta_1)) * np.sin(0.5 * (theta_1 - theta_0))


def latlong_pixels(height: int, width: int) -> tuple[Array, Array]:
    """Directions w of the pixel centres of an equirectangular map and the pixels' exact solid angles dw.

    z is up, θ = 0 at the upper edge of row 0, φ = 0 at the left edge of column 0, φ from +x towards +y.

    Shapes (height, width, 3), (height, width). Units 1, sr. Error rounding.
    Source The integral of sinθ dθ dφ.

    Example
    >>> w, dw = gn.radiometry.latlong_pixels(4, 8)
    >>> print(w.shape, dw.shape, np.isclose(dw.sum(), 4.0 * np.pi))
    (4, 8, 3) (4, 8) True
    """
    for name, value in (("height", height), ("width", width)):
        if not isinstance(value, int | np.integer) or value < 1:
            raise ParameterError(f"{name} must be a whole number from 1, got {value!r}: count the pixels")
    row, step = np.arange(height), np.pi / height
    polar, phi = (row + 0.5)[:, None] * step, (np.arange(width) + 0.5) * (2.0 * np.pi / width)
    # The sine of the mirrored angle: that of an angle near pi has few good digits.
    sine = np.sin((np.minimum(row, row[::-1]) + 0.5) * step)[:, None]
    w = np.stack(np.broadcast_arrays(sine * np.cos(phi), sine * np.sin(phi), np.cos(polar)), axis=-1)
    return w, np.broadcast_to(4.0 * np.pi / width * np.sin(0.5 * step) * sine, (height, width)).copy()


@_formula
def solid_angle_sphere(radius: _NotNegative, distance: _Positive) -> Array:
    """Solid angle of a sphere from a distance to its centre: ω = 2π (1 − √(1 − r²/d²)), 4π from inside it.

    On the surface it is 2π, the limit from outside.

    Shapes broadcast. Units m, m -> sr. Error rounding, also for d/r = 1e12.
    Source The tangent cone, sin a = r/d.

    Example
    >>> print(gn.radiometry.solid_angle_sphere(radius=0.1, distance=2.0).round(5))
    0.00786
    """
    sine = np.minimum(radius / distance, 1.0)
    cosine = np.sqrt(np.maximum(distance - radius, 0.0)) * np.sqrt(distance + radius) / distance
    return np.where(np.less(distance, radius), 4.0 * np.pi, 2.0 * np.pi * sine * sine / (1.0 + cosine))[()]


def _scaled(*vectors: Array) -> Array:
    """The vectors on axis −2, over a power of two near the largest: exact, and no product overflows."""
    v = np.stack(np.broadcast_arrays(*vectors), axis=-2)
    return np.ldexp(v, -np.frexp(np.max(np.abs(v), axis=(-2, -1), keepdims=True))[1])


def _triangle(volume: Array, a: Array, b: Array, c: Array) -> Array:
    """Signed solid angle from the triple product a·(b×c), which the callers compute with care."""
    u, v, w = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
    return 2.0 * np.arctan2(volume, u * v * w + _dot(a, b) * w + _dot(b, c) * u + _dot(c, a) * v)


@_formula
def solid_angle_triangle(a: _Vector, b: _Vector, c: _Vector, signed: bool = False) -> Array:
    """Solid angle of a triangle: tan(ω/2) = a·(b×c)/(|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|).

    With `signed` it has the sign of a·(b×c): over a closed mesh it sums to ±4π from inside, 0 from outside.
    In the plane of the triangle it is 2π inside and 0 outside.

    Shapes vertices (..., 3) broadcast -> ... Units any length -> sr.
    Error  Of 300 random triangles each of size 1 to 1e-8 at distance 1, relative: median 1.3e-16, largest
           6e-14 (seen from the side). From 1e-12 above a triangle, absolute: 6e-13, next to an edge.
    Source Van Oosterom & Strackee 1983, doi:10.1109/TBME.1983.325207.

    Example
    >>> print(gn.radiometry.solid_angle_triangle([1, 0, 0], [0, 1, 0], [0, 0, 1]).round(4))  # an eighth of 4 pi
    1.5708
    """
    corners = _scaled(a, b, c)
    nearest = np.argmin(np.linalg.norm(corners, axis=-1), axis=-1, keepdims=True)
    turn = (nearest + np.arange(3)) % 3
    p, q, r = np.moveaxis(np.take_along_axis(corners, turn[..., None], axis=-2), -2, 0)
    # p·(q×r) = p·((q−p)×(r−p)): differences of neighbours are exact, and p, the nearest, loses least.
    angle = _triangle(_dot(p, np.cross(q - p, r - p)), p, q, r)
    return angle if signed else np.abs(angle)


@_formula
def solid_angle_rectangle(corner: _Vector, edge_u: _Vector, edge_v: _Vector) -> Array:
    """Solid angle of a rectangle anywhere, from one corner and the two edges that leave it.

    From above it, ω = Σ atan(|x y|/(z √(x²+y²+z²))) over its corners x, y in its own frame and z, the height
    over it, which is stable close to it; from beside it, two triangles, which are stable far away.

    Shapes (..., 3) broadcast -> ... Units any length -> sr.
    Error  Of 300 random rectangles each of size 1 to 1e-9 at distance 1, relative: median 1.4e-16, largest
           6e-14. From 1e-12 above its plane, absolute: 8e-15.
    Source The integral of z dx dy/(x²+y²+z²)^(3/2); Van Oosterom & Strackee 1983 for the triangles.

    Example
    >>> print(gn.radiometry.solid_angle_rectangle([-1.0, -1.0, 2.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]).round(4))
    0.8054
    """
    p, u, v = np.moveaxis(_scaled(corner, edge_u, edge_v), -2, 0)
    length_u, length_v = np.linalg.norm(u, axis=-1), np.linalg.norm(v, axis=-1)
    if np.any(np.abs(_dot(u, v)) > 1e-6 * length_u * length_v):
        raise ParameterError("edge_u and edge_v must be perpendicular to 1e-6, got others: use two triangles")
    safe_u, safe_v = np.where(length_u > 0.0, length_u, 1.0), np.where(length_v > 0.0, length_v, 1.0)
    x0, y0 = _dot(p, u) / safe_u, _dot(p, v) / safe_v
    x1, y1 = x0 + length_u, y0 + length_v
    z = np.abs(_dot(p, np.cross(u, v))) / (safe_u * safe_v)
    corners = [(x, y) for x in (x0, x1) for y in (y0, y1)]
    over = sum(np.arctan2(np.abs(x * y), z * np.sqrt(x * x + y * y + z * z)) for x, y in corners)
    flip_u, flip_v = (np.abs(x1) < np.abs(x0))[..., None], (np.abs(y1) < np.abs(y0))[..., None]
    p = p + np.where(flip_u, u, 0.0) + np.where(flip_v, v, 0.0)  # the nearest corner, as for a triangle
    u, v = np.where(flip_u, -u, u), np.where(flip_v, -v, v)
    volume = np.abs(_dot(p, np.cross(u, v)))
    beside = _triangle(volume, p, p + u, p + u + v) + _triangle(volume, p, p + u + v, p + v)
    return np.where((x0 <= 0.0) & (x1 >= 0.0) & (y0 <= 0.0) & (y1 >= 0.0), over, beside)[()]


# Projected solid angles: the irradiance by uniform light of radiance 1


@_formula
def projected_solid_angle_cone(half_angle: _Polar, theta: _Polar = 0.0) -> Array:
    """Projected solid angle of a cone about an axis at θ from the normal, above the horizon.

    π sin²a cosθ if the horizon does not cut it; in general, with s = √max(0, −cos(θ+a) cos(θ−a)),
    atan2(s, cos a) + atan2(s, −cos a cosθ) sin²a cosθ − s cos a. A sphere is the cone of sin a = r/d.

    Shapes broadcast. Units rad -> sr.
    Error  Absolute, 8e-16; relative, 3e-16 of a cone that the horizon does not cut, for a from 1e-8 to 0.1.
    Source Lambert 1760, Photometria: the contour integral, here along the circle and the horizon.

    Example
    >>> print(gn.radiometry.projected_solid_angle_cone(half_angle=np.radians(5.0), theta=0.7).round(5))
    0.01825
    """
    k, c = np.cos(half_angle), np.cos(theta)
    s = np.sqrt(np.maximum(-np.cos(theta + half_angle) * np.cos(theta - half_angle), 0.0))
    full = np.square(np.sin(half_angle)) * c
    return np.arctan2(s, k) + np.arctan2(s, -k * c) * full - k * s


@_formula
def projected_solid_angle_latlong_pixel(theta_0: _Polar, theta_1: _Polar, width: _Azimuth) -> Array:
    """Projected solid angle of a pixel about the normal: Ω = ½ Δφ (sin²θ₁ − sin²θ₀), above the horizon.

    Shapes broadcast. Units polar angles and width Δφ in rad -> sr.
    Error  Rounding, also for thin pixels; relative to π/2 − θ next to the horizon.
    Source The integral of cosθ sinθ dθ dφ.

    Example
    >>> print(gn.radiometry.projected_solid_angle_latlong_pixel(0.0, np.pi / 2, 2.0 * np.pi).round(4))
    3.1416
    """
    low, high = np.minimum(theta_0, 0.5 * np.pi), np.minimum(theta_1, 0.5 * np.pi)
    return 0.5 * width * np.sin(high + low) * np.sin(high - low)


def _above_horizon(offset: Array, height: Array) -> Array:
    """Triangles (..., 3, 3) cut at height 0: rings (..., 6, 3), whose corners may coincide."""
    after, height_after = np.roll(offset, -1, axis=-2), np.roll(height, -1, axis=-1)
    up, up_after = (height > 0.0)[..., None], (height_after > 0.0)[..., None]
    # Cuts run from the upper end: both triangles at an edge get the same bits, and their errors cancel.
    first = (height >= height_after)[..., None]
    upper, lower = np.where(first, offset, after), np.where(first, after, offset)
    fall = np.abs(height - height_after)
    share = np.maximum(height, height_after) / np.where(fall > 0.0, fall, 1.0)
    cut = upper + share[..., None] * (lower - upper)
    before = np.roll(cut, 1, axis=-2)
    start = np.where(up, offset, np.where(up_after, cut, before))
    end = np.where(up_after, after, np.where(up, cut, before))
    return np.stack([start, end], axis=-2).reshape(*end.shape[:-2], 6, 3)


def _contour(base: Array, ring: Array) -> Array:
    """Σ θ_i γ_i around the corners base + ring, (..., V, 3); the offsets are exact even if far and tiny."""
    v = base + ring
    r = np.linalg.norm(v, axis=-1, keepdims=True)
    r = np.where(r > 0.0, r, 1.0)
    unit = v / r
    # Unit vectors of neighbours differ by little: from their offsets then, not by subtraction.
    step, v_0, r_0, unit_0 = ring - ring[..., :1, :], v[..., :1, :], r[..., :1, :], unit[..., :1, :]
    near = np.linalg.norm(step, axis=-1, keepdims=True) < 0.5 * np.minimum(r, r_0)
    longer = _dot(step, v + v_0)[..., None] / (r + r_0)
    chord = np.where(near, (step - unit_0 * longer) / r, unit - unit_0)
    loop = np.cross(chord[..., 1:-1, :], chord[..., 2:, :])  # sums to Σ v̂_i × v̂_i₊₁
    after = np.roll(unit, -1, axis=-2)
    cross = np.cross(unit, after)
    sine = np.linalg.norm(cross, axis=-1, keepdims=True)
    t = np.arctan2(sine, _dot(unit, after)[..., None])
    q = t * t
    series = q * (1 / 6 + q * (7 / 360 + q * (31 / 15120 + q * (127 / 604800 + q * (73 / 3421440)))))
    excess = np.where(t < 0.1, series, t / np.where(sine > 0.0, sine, 1.0) - 1.0)
    return np.sum(loop, axis=-2) + np.sum(excess * cross, axis=-2)


@_formula
def projected_solid_angle_polygon(vertices: _Polygon, normal: _Vector = (0.0, 0.0, 1.0)) -> Array:
    """Projected solid angle of a plane polygon above the horizon; times L, its irradiance if it is uniform.

    Lambert's formula Ω = ½ Σ θ_i n·γ_i, θ_i the angle of an edge and γ_i along v_i × v_i₊₁, computed as
    ½ n·(Σ v̂_i × v̂_i₊₁ + Σ (θ_i/sinθ_i − 1) v̂_i × v̂_i₊₁), which keeps the digits of small polygons.

    Shapes vertices (..., V, 3) in order, convex or not; normal (..., 3) -> ... Units any length -> sr.
    Error  Of 300 random triangles and hexagons of size 1, absolute: 9e-16. Of 300 triangles each of size 1e-2
           to 1e-8 at distance 1, cosθ > 0.1, relative: median 3e-16, largest 7e-12 (seen from the side).
           From h above a polygon that the horizon cuts, absolute: 1e-15; below h = 1e-6 about (3e-16/h)².
    Source Lambert 1760, Photometria.

    Example
    >>> window = [[1.0, -1.0, 2.0], [1.0, 1.0, 2.0], [-1.0, 1.0, 2.0], [-1.0, -1.0, 2.0]]
    >>> print(gn.radiometry.projected_solid_angle_polygon(window).round(4))
    0.7523
    """
    corners = _scaled(*np.moveaxis(vertices, -2, 0))
    base, n = corners[..., None, :1, :], normal[..., None, None, :]
    offset = corners - corners[..., :1, :]
    fan = np.stack([np.zeros_like(offset[..., 2:, :]), offset[..., 1:-1, :], offset[..., 2:, :]], axis=-2)
    height = _dot(base + fan, n)
    part = 0.5 * _dot(_contour(base, _above_horizon(fan, height)), n[..., 0, :])
    return np.abs(np.sum(np.where(np.all(height <= 0.0, axis=-1), 0.0, part), axis=-1))
