"""Integrals along the outlines of two polygons, of which the form factor between them is made."""

import numpy as np

from ..declared.arrays import Array
from ..errors import ParameterError
from .kinds import _dot

GAUSS = 24
"""Nodes along an edge that is at least half its length away from the other polygon."""

STEP, REACH = 0.09, 3.3
"""Of the tanh-sinh rule, which takes singular ends: x ln x to 1e-15."""

BLOCK = 1 << 21
"""Logarithms computed together."""


def _tanh_sinh() -> tuple[Array, Array]:
    """Nodes and weights of [0, 1] by the substitution x = ½ (1 + tanh(π/2 sinh t))."""
    t = np.arange(-REACH, REACH + 0.5 * STEP, STEP)
    slope = 0.5 * np.pi * np.cosh(t)
    x = 1.0 / (1.0 + np.exp(-np.pi * np.sinh(t)))
    weight = STEP * slope / (2.0 * np.square(np.cosh(0.5 * np.pi * np.sinh(t))))
    return x, weight / weight.sum()


def _area_vector(vertices: Array) -> Array:
    """Normal of a polygon times its area, (..., 3)."""
    fan = vertices[..., 1:, :] - vertices[..., :1, :]
    return 0.5 * np.sum(np.cross(fan[..., :-1, :], fan[..., 1:, :]), axis=-2)


def _in_front(vertices: Array, height: Array) -> Array:
    """Polygons (..., V, 3) cut at height 0, with corners that coincide: (..., 2 V, 3)."""
    up, up_after = height > 0.0, np.roll(height, -1, axis=-1) > 0.0
    after = np.roll(vertices, -1, axis=-2)
    if np.any(np.sum(up & ~up_after, axis=-1) > 1):
        raise ParameterError("a polygon goes behind the other in several places: divide it into convex polygons")
    fall = height - np.roll(height, -1, axis=-1)
    cut = vertices + (height / np.where(up != up_after, fall, 1.0))[..., None] * (after - vertices)
    leaving = np.sum(np.where((up & ~up_after)[..., None], cut, 0.0), axis=-2, keepdims=True)
    start = np.where(up[..., None], vertices, np.where(up_after[..., None], cut, leaving))
    end = np.where(up_after[..., None], after, np.where(up[..., None], cut, leaving))
    return np.stack([start, end], axis=-2).reshape(*vertices.shape[:-2], -1, 3)


def _edge_logarithm(x: Array, start: Array, u: Array, length: Array) -> Array:
    """∫ ln|x − y| dy along an edge: ½ (t₁ ln(t₁²+d²) − t₀ ln(t₀²+d²)) − L + d (atan(t₁/d) − atan(t₀/d))."""
    away = start - x
    t0 = _dot(away, u)
    t1 = t0 + length
    d = np.linalg.norm(np.cross(away, u), axis=-1)
    d2 = d * d
    logs = [0.5 * t * np.log(np.where(t * t + d2 > 0.0, t * t + d2, 1.0)) for t in (t0, t1)]
    return logs[1] - logs[0] - length + d * np.arctan2(length * d, d2 + t0 * t1)


def _pieces(p: Array, u: Array, length: Array, q: Array, v: Array, size: Array) -> Array:
    """Where an edge comes nearest to the ends of the other and to its line: ends of pieces in [0, length], (..., 5)."""
    w = q - p
    first, cosine = _dot(w, u), _dot(u, v)
    last, sine2 = first + size * cosine, np.maximum(1.0 - cosine * cosine, 0.0)
    nearest = (first - cosine * _dot(w, v)) / np.where(sine2 > 1e-12, sine2, 1.0)
    inner = np.stack(np.broadcast_arrays(first, last, np.where(sine2 > 1e-12, nearest, 0.0)), axis=-1)
    inner = np.sort(np.clip(inner, 0.0, length[..., None]), axis=-1)
    return np.concatenate([np.zeros_like(inner[..., :1]), inner, np.broadcast_to(length, cosine.shape)[..., None]], -1)


def _contours(first: Array, second: Array, apart: bool) -> Array:
    """1/(2π) ∮∮ ln r dr₁·dr₂ of polygons (n, V, 3) and (n, W, 3)."""
    p, q = first[:, :, None], second[:, None, :]
    edge, other = np.roll(first, -1, axis=1)[:, :, None] - p, np.roll(second, -1, axis=1)[:, None, :] - q
    length, size = np.linalg.norm(edge, axis=-1), np.linalg.norm(other, axis=-1)
    u = edge / np.where(length > 0.0, length, 1.0)[..., None]
    v = other / np.where(size > 0.0, size, 1.0)[..., None]
    x: Array
    weight: Array
    if apart:
        x, weight = np.polynomial.legendre.leggauss(GAUSS)
        at, weight = 0.5 * (x + 1.0) * length[..., None], 0.5 * weight * length[..., None]
    else:
        x, weight = _tanh_sinh()
        ends = _pieces(p, u, length, q, v, size)
        step = np.diff(ends, axis=-1)[..., None]
        at = (ends[..., :-1, None] + x * step).reshape(*ends.shape[:-1], -1)
        weight = (weight * step).reshape(at.shape)
    points = p[..., None, :] + at[..., None] * u[..., None, :]
    inner = _edge_logarithm(points, q[..., None, :], v[..., None, :], size[..., None])
    return np.einsum("nij,nij->n", _dot(u, v), np.sum(weight * inner, axis=-1)) / (2.0 * np.pi)


def exchanged(first: tuple[str, Array], second: tuple[str, Array]) -> Array:
    """Form factors (n,) from polygons (n, V, 3) to others, which errors call by these names.

    Raises ParameterError for polygons without area, not plane to 1e-6 of their size, or cut into several parts.
    """
    both = (first, second)
    centre = both[0][1].mean(axis=1, keepdims=True)
    scale = np.max([np.abs(c - centre).max(axis=(1, 2)) for _, c in both], axis=0)[:, None, None]
    corners = [(c - centre) / np.where(scale > 0.0, scale, 1.0) for _, c in both]
    areas = [_area_vector(c) for c in corners]
    normals = []
    for (name, _), c, area in zip(both, corners, areas, strict=True):
        size = np.linalg.norm(area, axis=-1)
        span = np.ptp(c, axis=1).max(axis=-1)
        if np.any(size <= 1e-12 * span * span):
            raise ParameterError(f"{name} has no area: its corners must not lie on a line")
        normals.append(area / np.where(size > 0.0, size, 1.0)[:, None])
        if np.any(np.abs(_dot(c - c[:, :1], normals[-1][:, None])) > 1e-6 * span[:, None]):
            raise ParameterError(f"{name} is not plane to 1e-6 of its size: divide it into triangles")
    area = np.linalg.norm(areas[0], axis=-1)
    for one, other in ((0, 1), (1, 0)):
        height = _dot(corners[one] - corners[other][:, :1], normals[other][:, None])
        height = np.where(np.abs(height) < 1e-13, 0.0, height)
        if np.any(height < 0.0):
            cut = height.min(axis=1) < 0.0
            repeated = np.repeat(corners[one], 2, axis=1)  # an outline with corners that coincide is the same outline
            repeated[cut] = _in_front(corners[one][cut], height[cut])
            corners[one] = repeated
    middles = [c.mean(axis=1) for c in corners]
    around = [np.linalg.norm(c - m[:, None], axis=-1).max(axis=1) for c, m in zip(corners, middles, strict=True)]
    longest = np.linalg.norm(np.roll(corners[0], -1, axis=1) - corners[0], axis=-1).max(axis=1)
    gap = np.linalg.norm(middles[0] - middles[1], axis=-1) - around[0] - around[1]
    exchange = np.zeros(len(area))
    for apart in (True, False):
        rows = np.flatnonzero((gap >= 0.5 * longest) == apart)
        nodes = GAUSS if apart else 4 * len(_tanh_sinh()[0])
        block = max(1, BLOCK // (corners[0].shape[1] * corners[1].shape[1] * nodes))
        for start in range(0, len(rows), block):
            pick = rows[start : start + block]
            exchange[pick] = _contours(corners[0][pick], corners[1][pick], apart)
    share: Array = np.maximum(exchange / area, 0.0)
    return share
