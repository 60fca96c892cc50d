"""Means of f over pairs of patches and over cells of trees, weighted by projected solid angle, by Gauss rules."""

from __future__ import annotations

import math

import numpy as np

from ..interface import Reflectance
from ._klems import MIRRORED, AngleBasis
from ._tensor_tree import disc


def averages(m: Reflectance, basis: AngleBasis, side: str, points: int) -> np.ndarray:
    """Means of f over pairs of patches, weighted by projected solid angle: (patches of wo, patches of wi, C).

    A patch has `points`^2 nodes of a Gauss rule in sin^2(theta) and phi. NaN is left out; where f has no value at all
    nodes of a pair, so has the mean.
    """
    x, y, weights, starts = _nodes(basis, points)
    z = np.sqrt(1.0 - x * x - y * y)
    sign = MIRRORED[side]
    wi, wo = np.stack([-sign * x, -y, z], -1), np.stack([sign * x, y, z], -1)
    columns = []
    for k, start in enumerate(starts):
        own = slice(start, starts[k + 1] if k + 1 < len(starts) else len(x))
        f = m.f(wi[own, None], wo)
        f = f.reshape(*f.shape[:2], -1)
        known = np.isfinite(f)
        w = weights[own, None, None] * weights[:, None]
        sums = [np.add.reduceat((w * a).sum(axis=0), starts, axis=0) for a in (np.where(known, f, 0.0), known)]
        columns.append(np.where(sums[1] > 0.0, sums[0] / np.where(sums[1] > 0.0, sums[1], 1.0), np.nan))
    return np.stack(columns, axis=1)


def _nodes(basis: AngleBasis, points: int) -> tuple[np.ndarray, ...]:
    """x, y and weights (sum 1 over a patch) of quadrature nodes, and where each patch's begin."""
    xs, ys, ws, sizes = [], [], [], []
    node, weight = np.polynomial.legendre.leggauss(points)
    for low, high, turn, width in basis.patches:
        u, v = 0.5 * (node + 1.0), 0.5 * (node + 1.0)
        across = 0.5 * weight
        if width == 1.0:  # a whole turn is periodic
            v = (np.arange(4 * points) + 0.5) / (4 * points)
            across = np.full(4 * points, 0.25 / points)
        s, phi = np.sqrt(low + u * high)[:, None], 2.0 * math.pi * (turn + v * width)
        xs.append((s * np.cos(phi)).ravel())
        ys.append((s * np.sin(phi)).ravel())
        ws.append((0.5 * weight[:, None] * across).ravel())
        sizes.append(xs[-1].size)
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    return np.concatenate(xs), np.concatenate(ys), np.concatenate(ws), starts


def grids(m: Reflectance, dimensions: int, resolution: int, side: str, points: int) -> np.ndarray:
    """Means of f over the cells of a grid of `resolution` per side: (resolution, ..., C), 0 in the unused half of 3."""
    node, weight = np.polynomial.legendre.leggauss(points)
    fine = ((np.arange(resolution)[:, None] + 0.5 * (node + 1.0)) / resolution).ravel()
    weight = np.tile(0.5 * weight, resolution)
    sign = MIRRORED[side]
    x, y = disc(*np.meshgrid(fine, fine, indexing="ij"))
    z = np.sqrt(1.0 - x * x - y * y)
    wo = np.stack([sign * x, y, z], -1)
    shape = (resolution, points)
    out_weight = (weight[:, None] * weight).reshape(*shape, *shape)

    def seen(wi: np.ndarray) -> np.ndarray:
        f = m.f(wi, wo)
        return np.einsum("apbq,apbqc->abc", out_weight, f.reshape(*shape, *shape, -1))

    if dimensions == 3:
        s = 1.0 - 2.0 * fine[: resolution // 2 * points]
        w = s * weight[: len(s)]
        rows = [a * seen(np.array([-sign * k, 0.0, math.sqrt(1.0 - k * k)])) for a, k in zip(w, s, strict=True)]
        starts = np.arange(0, len(s), points)
        half = np.add.reduceat(rows, starts, axis=0) / np.add.reduceat(w, starts)[:, None, None, None]
        return np.concatenate([half, np.zeros_like(half)])
    wi = np.stack([-sign * x, -y, z], -1).reshape(*shape, *shape, 3)
    result = []
    for i in range(resolution):
        for j in range(resolution):
            cells = [weight[p] * weight[q] * seen(wi[i, p, j, q]) for p in range(points) for q in range(points)]
            result.append(np.sum(cells, axis=0))
    found = np.stack(result)
    return found.reshape(resolution, resolution, *found.shape[1:])
