"""Means of f over pairs of patches and over cells of trees, weighted by projected solid angle, by Gauss rules.

Nodes of incident and of outgoing directions are never as many along an axis: where they coincide, as mirror directions
of each other, the peak of every lobe would be counted at each of them.
"""

from __future__ import annotations

import math

import numpy as np

from ...base.measured import tabular_shape
from ...base.reflectance import Reflectance
from ._cell_tables import MIRRORED
from .klems import AngleBasis
from .tensor_tree import disc

INCIDENT, OUTGOING = 4, (3, 5, 10, 20, 40)
"""Nodes along an axis of incident patches; of outgoing ones, the next number only where the last two disagree."""

TOLERANCE = 2e-6  # difference of a patch's share of the reflectance up to which two rules agree


def averages(m: Reflectance, basis: AngleBasis, side: str) -> np.ndarray:
    """Means of f over pairs of patches: (patches of wo, patches of wi, C).

    NaN is left out; where f has no value at all nodes of a pair, so has the mean. Of isotropic materials pairs that are
    turned copies of each other share one mean.
    """
    sign, size = MIRRORED[side], basis.size
    wi, weight_i = _nodes(basis, INCIDENT, -sign, -1.0)
    outgoing = [_nodes(basis, points, sign, 1.0) for points in OUTGOING]
    copy_o, copy_i = _turned_copies(basis) if m.is_isotropic() else np.indices((size, size))

    def mean(patch: int, wo: np.ndarray, weight_o: np.ndarray) -> np.ndarray:
        f = m.f(wi[patch][:, None], wo.reshape(-1, 3)).reshape(len(wi[patch]), *weight_o.shape, -1)
        finite = np.isfinite(f)
        total = np.einsum("i,ko,ikoc->kc", weight_i[patch], weight_o, np.where(finite, f, 0.0))
        if finite.all():
            return total
        share = np.einsum("i,ko,ikoc->kc", weight_i[patch], weight_o, finite.astype(float))
        return np.where(share > 0.0, total / np.where(share > 0.0, share, 1.0), np.nan)

    values = np.empty((size, size, math.prod(tabular_shape(m))))
    for patch in range(size):
        todo = np.flatnonzero(copy_i[:, patch] == patch)
        for rule, (wo, weight_o) in enumerate(outgoing):
            if not len(todo):
                break
            before, after = values[todo, patch], mean(patch, wo[todo], weight_o[todo])
            values[todo, patch] = after
            if rule:
                off = np.abs(after - before) * basis.solid_angles[todo, None] > TOLERANCE
                todo = todo[off.any(axis=1)]
    return values[copy_o, copy_i]


def _turned_copies(basis: AngleBasis) -> tuple[np.ndarray, np.ndarray]:
    """For each pair of patches (wo, wi), the patch of wo and that of wi, first of its kind in the ring, of a pair that
    is turned to it. Patches of two rings become patches by turns through a common divisor of their numbers of azimuths.
    """
    counts = np.repeat(basis.counts, basis.counts)
    start = np.repeat(np.cumsum(basis.counts) - basis.counts, basis.counts)
    place = np.arange(basis.size) - start
    turns = np.gcd.outer(counts, counts)
    turn = place * turns // counts
    first_o = start[:, None] + (place[:, None] - turn * (counts[:, None] // turns)) % counts[:, None]
    return first_o, np.arange(basis.size) - turn * (counts // turns)


def _nodes(basis: AngleBasis, points: int, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    """Directions (size, nodes, 3) of `points`^2 nodes per patch, x and y multiplied as the side asks; and their weights
    (size, nodes), of sum 1 over a patch."""
    node, weight = np.polynomial.legendre.leggauss(points)
    low, high, turn, width = (a[:, None] for a in basis.patches.T)
    around = width == 1.0  # a whole turn is periodic: its nodes are evenly spaced
    v = np.where(around, (np.arange(points) + 0.5) / points, 0.5 * (node + 1.0))
    along = np.where(around, 1.0 / points, 0.5 * weight)
    sin2, phi = (low + high * 0.5 * (node + 1.0))[:, :, None], 2.0 * math.pi * (turn + width * v)[:, None]
    s, one = np.sqrt(sin2), np.ones_like(phi)
    w = np.stack([x * (s * np.cos(phi)), y * (s * np.sin(phi)), np.sqrt(1.0 - sin2) * one], -1)
    shape = (basis.size, points * points)
    return w.reshape(*shape, 3), (0.5 * weight[:, None] * along[:, None]).reshape(shape)


def grids(m: Reflectance, dimensions: int, resolution: int, side: str) -> np.ndarray:
    """Means of f over the cells of a grid of `resolution` per side: (resolution, ..., C), 0 in the unused half of 3."""
    sign = MIRRORED[side]
    fine, weight = _along(resolution, 3)
    x, y = disc(*np.meshgrid(fine, fine, indexing="ij"))
    wo = np.stack([sign * x, y, np.sqrt(1.0 - x * x - y * y)], -1)
    shape = (resolution, 3)
    out_weight = (weight[:, None] * weight).reshape(*shape, *shape)

    def means(wi: np.ndarray) -> np.ndarray:
        """For each of several wi, by cells of wo and channels."""
        f = m.f(wi[:, None, None], wo).reshape(len(wi), *shape, *shape, -1)
        return np.einsum("apbq,iapbqc->iabc", out_weight, f)

    fine, weight = _along(resolution, 2)
    if dimensions == 3:
        s = 1.0 - 2.0 * fine[:resolution]  # the half of the axis that is used
        w = s * weight[:resolution]
        wi = np.stack([-sign * s, 0.0 * s, np.sqrt(1.0 - s * s)], -1)
        rows = [a * means(each[None])[0] for a, each in zip(w, wi, strict=True)]
        half = np.add.reduceat(rows, np.arange(0, resolution, 2), axis=0)
        half /= np.add.reduceat(w, np.arange(0, resolution, 2))[:, None, None, None]
        return np.concatenate([half, np.zeros_like(half)])
    x, y = disc(*np.meshgrid(fine, fine, indexing="ij"))
    wi = np.stack([-sign * x, -y, np.sqrt(1.0 - x * x - y * y)], -1).reshape(resolution, 2, resolution, 2, 3)
    columns = wi.swapaxes(1, 2).reshape(resolution * resolution, 4, 3)  # both rules of two have equal weights
    values = np.stack([means(cell).mean(axis=0) for cell in columns])
    return values.reshape(resolution, resolution, *values.shape[1:])


def _along(resolution: int, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of all cells along an axis of the unit square, and their weights, of sum 1 in a cell."""
    node, weight = np.polynomial.legendre.leggauss(points)
    nodes = (np.arange(resolution)[:, None] + 0.5 * (node + 1.0)) / resolution
    return nodes.ravel(), np.tile(0.5 * weight, resolution)
