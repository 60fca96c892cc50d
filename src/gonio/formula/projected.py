"""Solid angles and projected solid angles of polygons and disks, cut by the horizon of a surface: irradiance over
radiance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..arrays import ops
from .direction import Direction, cross, dot, normalize, select
from .special import log1p_over

TINY = 1e-30


def triangle_solid_angle(a: Direction, b: Direction, c: Direction) -> Any:
    """The solid angle [sr] of a triangle with these corners seen from the origin, below 0 where they run clockwise;
    2 arctan2(a . (b x c), abc + (a . b) c + (b . c) a + (c . a) b).

    Source: Van Oosterom & Strackee 1983, "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30(2):125.

    Example
    >>> from gonio.authoring import Direction
    >>> from gonio.formula.projected import triangle_solid_angle
    >>> axes = (Direction(*map(np.float64, row)) for row in np.eye(3))
    >>> print((triangle_solid_angle(*axes) / (np.pi / 2)).round(4))  # an eighth of the sphere
    1.0
    """
    la, lb, lc = (ops.sqrt(dot(x, x)) for x in (a, b, c))
    volume = dot(a, cross(b, c))
    flat = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return 2.0 * ops.arctan2(volume, ops.where((volume == 0.0) & (flat == 0.0), 1.0, flat))


def polygon_projected(corners: Sequence[Direction], n: Direction) -> Any:
    r"""$\int \cos\theta \, d\omega$ over the part above the horizon of a plane convex polygon that is seen from the
    origin, by a surface with normal n: above 0 where its corners run clockwise as seen from there, below 0 else.

    $-\frac12 \sum_i \Theta_i \, n \cdot \Gamma_i$: each edge has the angle $\Theta_i$ and the normal $\Gamma_i$ of the
    plane through it and the origin. Edges are cut by the horizon, and an edge along it closes the polygon.
    Source: Lambert 1760, Photometria, as in Arvo 1995, "Analytic methods for simulated light transport".

    Example
    >>> from gonio.authoring import NORMAL, Direction
    >>> from gonio.formula.projected import polygon_projected
    >>> square = [Direction(np.float64(x), y, 1.0) for x, y in ((1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0))]
    >>> print((polygon_projected(square, NORMAL) / np.pi).round(4))  # the form factor
    0.5541
    """
    heights = [dot(n, corner) for corner in corners]
    total: Any = 0.0
    leaves = enters = Direction(0.0, 0.0, 0.0)
    for i, a in enumerate(corners):
        b, ha, hb = corners[(i + 1) % len(corners)], heights[i], heights[(i + 1) % len(corners)]
        a_up, b_up = ha > 0.0, hb > 0.0
        apart = a_up & ~b_up | b_up & ~a_up
        crossing = a + (b - a) * (ha / ops.where(apart, ha - hb, 1.0))
        total = total + ops.where(a_up | b_up, _edge(select(a_up, a, crossing), select(b_up, b, crossing), n), 0.0)
        leaves = leaves + _masked(a_up & ~b_up, crossing)
        enters = enters + _masked(b_up & ~a_up, crossing)
    closing = dot(n, cross(leaves, enters))
    along = dot(leaves, enters)
    total = total + ops.arctan2(closing, ops.where((closing == 0.0) & (along == 0.0), 1.0, along))
    return -0.5 * total


def _masked(condition: Any, a: Direction) -> Direction:
    return Direction(*(ops.where(condition, x, 0.0) for x in a))


def _edge(a: Direction, b: Direction, n: Direction) -> Any:
    """The angle of an edge times the cosine between n and the normal of its plane."""
    across = cross(a, b)
    sin2, along = dot(across, across), dot(a, b)
    sin = ops.sqrt(sin2 + TINY)
    flat = (sin2 == 0.0) & (along == 0.0)
    return ops.arctan2(sin, ops.where(flat, 1.0, along)) / sin * dot(n, across)


def disk_projected(centre: Direction, axis: Direction, radius: Any, n: Direction) -> Any:
    r"""$\int \cos\theta \, d\omega$ over the part above the horizon of a disk that is seen from the origin, by a
    surface with normal n; axis: the disk's unit normal. Above 0 where the axis points away from the origin.

    The contour integral $\frac12 \oint n \cdot (r \times dr)/r^2$: on the circle its integrand is a rational function
    of the azimuth, which is integrated over the arc above the horizon; the chord along the horizon closes it.

    Example
    >>> from gonio.authoring import NORMAL, Direction
    >>> from gonio.formula.projected import disk_projected
    >>> print((disk_projected(Direction(0.0, 0.0, np.float64(1.0)), NORMAL, 1.0, NORMAL) / np.pi).round(4))
    0.5
    """
    h = dot(centre, axis)
    offset = centre - axis * h
    rho = ops.sqrt(dot(offset, offset) + TINY)
    t = _tangent(offset, axis, rho, ops.absolute(h))
    b = cross(axis, t)
    n_t, n_b, n_m = dot(n, t), dot(n, b), dot(n, axis)
    C, D = rho * rho + h * h + radius * radius, 2.0 * radius * rho
    W = ops.sqrt(((rho - radius) * (rho - radius) + h * h) * ((rho + radius) * (rho + radius) + h * h) + TINY)
    q = D / (C + W)
    across = radius * ops.sqrt(n_t * n_t + n_b * n_b + TINY)
    share = -dot(n, centre) / across
    all_up, none_up = share <= -1.0, share >= 1.0
    cut = ~(all_up | none_up)
    middle = ops.arctan2(n_b, ops.where((n_t == 0.0) & (n_b == 0.0), 1.0, n_t))
    half = ops.arccos(ops.where(cut, share, 0.0))
    first, last = middle - half, middle + half

    def integrals(phi: Any) -> tuple[Any, Any]:
        """Of 1 and of cos(phi), over C + D cos(phi), times W."""
        s, c = ops.sin(phi), ops.cos(phi)
        angle = _angle_over(q * s, 1.0 + q * c, s)
        return phi - 2.0 * q * angle, 2.0 * C / (C + W) * angle - q * phi

    (one_0, cos_0), (one_1, cos_1) = integrals(first), integrals(last)
    one = ops.where(all_up, 2.0 * math.pi, one_1 - one_0) / W
    cosine = ops.where(all_up, -2.0 * math.pi * q, cos_1 - cos_0) / W
    step, at = ops.cos(last) - ops.cos(first), C + D * ops.cos(first)
    sine = ops.where(all_up, 0.0, -step / at * log1p_over(ops.maximum(D * step / at, -0.999999)))
    arc = radius * ((rho * n_m - h * n_t) * cosine - h * n_b * sine) + radius * radius * n_m * one
    start, end = (centre + (t * ops.cos(phi) + b * ops.sin(phi)) * radius for phi in (first, last))
    chord = ops.arctan2(dot(n, cross(end, start)), ops.where(cut, dot(end, start), 1.0))
    return 0.5 * ops.where(none_up, 0.0, arc + ops.where(cut, chord, 0.0))


def _tangent(offset: Direction, axis: Direction, length: Any, reach: Any) -> Direction:
    """The unit vector along an offset, or any one perpendicular to the axis where it is rounding of numbers as large
    as `reach`."""
    short = length < 3e-7 * reach
    flat = ops.absolute(axis.z) > 0.5
    other = cross(axis, select(flat, Direction(1.0, 0.0, 0.0), Direction(0.0, 0.0, 1.0)))
    t = select(short, other, offset * (1.0 / ops.where(short, 1.0, length)))
    return normalize(t - axis * dot(axis, t))


def _angle_over(y: Any, x: Any, s: Any) -> Any:
    """arctan2(q s, x)/q for y = q s and small q too; x > 0."""
    r = y / x
    small = ops.absolute(r) < 1e-2
    series = 1.0 - r * r * (1.0 / 3.0 - r * r * 0.2)
    safe = ops.where(small, 1.0, r)
    return s / x * ops.where(small, series, ops.arctan2(safe, 1.0 + 0.0 * safe) / safe)
