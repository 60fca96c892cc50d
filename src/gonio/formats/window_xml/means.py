"""Means of f over pairs of patches and over cells of trees, weighted by projected solid angle, by Gauss rules.

Nodes of incident and of outgoing directions are never as many along an axis: where they coincide, as mirror directions
of each other, the peak of every lobe would be counted at each of them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...base.reflectance import Reflectance
from ._cell_tables import MIRRORED
from .klems import AngleBasis
from .tensor_tree import disc

INCIDENT, COARSE, FINE, FINEST = 4, 3, 5, 40
"""Nodes along an axis of patches: of incident ones; of outgoing ones first, second, then twice as many up to this."""

TOLERANCE = 2e-6
"""Error of a patch's share of the reflectance at which that ends."""


def averages(m: Reflectance, basis: AngleBasis, side: str) -> np.ndarray:
    """Means of f over pairs of patches: (patches of wo, patches of wi, C).

    NaN is left out; where f has no value at all nodes of a pair, so has the mean.
    """
    solid = basis.solid_angles[:, None]
    incident = _nodes(basis, INCIDENT)
    outgoing = {points: _nodes(basis, points) for points in (COARSE, FINE)}
    columns = []
    for patch in range(basis.size):
        wi, of_wi = _turned(incident, patch, -MIRRORED[side], -1.0)

        def seen(nodes: np.ndarray, patches: Any, wi: np.ndarray = wi, of_wi: np.ndarray = of_wi) -> np.ndarray:
            wo, of_wo = _turned(nodes, patches, MIRRORED[side], 1.0)
            f = m.f(wi[:, None], wo.reshape(-1, 3)).reshape(len(wi), *of_wo.shape, -1)
            known = np.isfinite(f)
            if known.all():
                return np.einsum("i,ko,ikoc->kc", of_wi, of_wo, f)
            total = np.einsum("i,ko,ikoc->kc", of_wi, of_wo, np.where(known, f, 0.0))
            share = np.einsum("i,ko,ikoc->kc", of_wi, of_wo, known.astype(float))
            return np.where(share > 0.0, total / np.where(share > 0.0, share, 1.0), np.nan)

        points, todo = FINE, np.arange(basis.size)
        before, column = (seen(outgoing[p], slice(None)) for p in (COARSE, FINE))
        while points < FINEST:
            off = np.abs(column[todo] - before) * solid[todo] > TOLERANCE
            todo = todo[off.any(axis=1)]
            if not len(todo):
                break
            points *= 2
            if points not in outgoing:
                outgoing[points] = _nodes(basis, points)
            before = column[todo]
            column[todo] = seen(outgoing[points], todo)
        columns.append(column)
    return np.stack(columns, axis=1)


def _nodes(basis: AngleBasis, points: int) -> np.ndarray:
    """x, y, z in the file's frame and weights (sum 1 over a patch) of `points`^2 nodes per patch: (size, nodes, 4)."""
    node, weight = np.polynomial.legendre.leggauss(points)
    low, high, turn, width = (a[:, None] for a in basis.patches.T)
    around = width == 1.0  # a whole turn is periodic: its nodes are evenly spaced
    v = np.where(around, (np.arange(points) + 0.5) / points, 0.5 * (node + 1.0))
    along = np.where(around, 1.0 / points, 0.5 * weight)
    sin2, phi = (low + high * 0.5 * (node + 1.0))[:, :, None], 2.0 * math.pi * (turn + width * v)[:, None]
    s, one = np.sqrt(sin2), np.ones_like(phi)
    parts = (s * np.cos(phi), s * np.sin(phi), np.sqrt(1.0 - sin2) * one, 0.5 * weight[:, None] * along[:, None])
    return np.stack(parts, -1).reshape(basis.size, points * points, 4)


def _turned(nodes: np.ndarray, patches: Any, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    """Directions and weights of the nodes of some patches, x and y multiplied as the side asks."""
    return nodes[patches][..., :3] * np.array([x, y, 1.0]), nodes[patches][..., 3]


def grids(m: Reflectance, dimensions: int, resolution: int, side: str) -> np.ndarray:
    """Means of f over the cells of a grid of `resolution` per side: (resolution, ..., C), 0 in the unused half of 3."""
    sign = MIRRORED[side]
    fine, weight = _along(resolution, 3)
    x, y = disc(*np.meshgrid(fine, fine, indexing="ij"))
    wo = np.stack([sign * x, y, np.sqrt(1.0 - x * x - y * y)], -1)
    shape = (resolution, 3)
    out_weight = (weight[:, None] * weight).reshape(*shape, *shape)

    def seen(wi: np.ndarray) -> np.ndarray:
        return np.einsum("apbq,apbqc->abc", out_weight, m.f(wi, wo).reshape(*shape, *shape, -1))

    fine, weight = _along(resolution, 2)
    if dimensions == 3:
        s = 1.0 - 2.0 * fine[:resolution]  # the half of the axis that is used
        w = s * weight[:resolution]
        rows = [a * seen(np.array([-sign * k, 0.0, math.sqrt(1.0 - k * k)])) for a, k in zip(w, s, strict=True)]
        half = np.add.reduceat(rows, np.arange(0, resolution, 2), axis=0)
        half /= np.add.reduceat(w, np.arange(0, resolution, 2))[:, None, None, None]
        return np.concatenate([half, np.zeros_like(half)])
    x, y = disc(*np.meshgrid(fine, fine, indexing="ij"))
    wi = np.stack([-sign * x, -y, np.sqrt(1.0 - x * x - y * y)], -1).reshape(resolution, 2, resolution, 2, 3)
    columns = wi.swapaxes(1, 2).reshape(resolution * resolution, 4, 3)  # both rules of two have equal weights
    found = np.stack([np.mean([seen(w) for w in cell], axis=0) for cell in columns])
    return found.reshape(resolution, resolution, *found.shape[1:])


def _along(resolution: int, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of all cells along an axis of the unit square, and their weights, of sum 1 in a cell."""
    node, weight = np.polynomial.legendre.leggauss(points)
    nodes = (np.arange(resolution)[:, None] + 0.5 * (node + 1.0)) / resolution
    return nodes.ravel(), np.tile(0.5 * weight, resolution)
