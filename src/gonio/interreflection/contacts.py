"""Where faces touch or pass through each other: patches are divided along these lines, so that none is in part covered.

A patch of which a part is within a block would send a part of its light into the block: it has one radiosity.
"""

from __future__ import annotations

import numpy as np

from .patches import Patches

FACES = 2000
"""Faces up to which contacts are looked for: all pairs are compared."""

LEVEL = 1e-6
"""Heights over a face, and lengths on it, in sizes of the face, that count as none."""

BLOCK = 1 << 20
"""Pairs compared together."""


def divided_at_contacts(patches: Patches) -> Patches:
    """Undivided faces, divided along the lines where others touch them."""
    if len(patches) > FACES:
        return patches
    patch, ends = _contacts(patches.corners)
    while len(patch):
        crossed, edge, share = _cuts(patches.places[patch], ends)
        patch, ends = patch[crossed], ends[crossed]
        cut, first = np.unique(patch, return_index=True)
        new = np.full(len(patches), -1)
        new[cut] = len(patches) + np.arange(len(cut))
        patches = patches.split(cut, edge[crossed][first], share[crossed][first])
        patch, ends = np.concatenate([patch, new[patch]]), np.concatenate([ends, ends])
    return patches


def _contacts(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of faces (m,), and ends (m, 2, 2), as (u, v), of the lines where other faces meet their planes."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normals = np.cross(b - a, c - a)
    twice = np.sum(normals * normals, axis=1)[:, None]
    along = np.stack([np.cross(c - a, normals), np.cross(normals, b - a)], axis=1) / twice[:, None]
    normals /= np.sqrt(twice)
    level = LEVEL * np.ptp(corners, axis=1).max(axis=1)
    low, high = corners.min(axis=1) - level[:, None], corners.max(axis=1) + level[:, None]
    found: list[tuple[np.ndarray, np.ndarray]] = []
    step = max(1, BLOCK // len(corners))
    for start in range(0, len(corners), step):
        rows = slice(start, start + step)
        near = ((low[rows, None] <= high) & (high[rows, None] >= low)).all(axis=2)
        i, j = np.nonzero(near)
        i, j = (i + start)[i + start != j], j[i + start != j]
        height = np.einsum("mvx,mx->mv", corners[j] - a[i, None], normals[i])
        height[np.abs(height) < level[i, None]] = 0.0
        for k in range(3):
            one, other = height[:, k], height[:, (k + 1) % 3]
            lies = (one == 0.0) & (other == 0.0)
            found.append((i[lies], corners[j[lies]][:, [k, (k + 1) % 3]]))
        passes = (height.min(axis=1) < 0.0) & (height.max(axis=1) > 0.0)
        i, j, height = i[passes], j[passes], height[passes]
        # the corner alone on its side, or one in the plane; the others in their order
        sides = np.sign(height)
        apex = np.argmax(np.where(sides == 0.0, 2.0, -sides * sides.sum(axis=1)[:, None]), axis=1)
        order = (apex[:, None] + np.arange(3)) % 3
        p, q, r = np.moveaxis(np.take_along_axis(corners[j], order[..., None], axis=1), 1, 0)
        hp, hq, hr = np.take_along_axis(height, order, axis=1).T[..., None]
        flat = hp == 0.0
        first = np.where(flat, p, p + (q - p) * (hp / np.where(flat, 1.0, hp - hq)))
        second = np.where(
            flat, q + (r - q) * (hq / np.where(flat, hq - hr, 1.0)), p + (r - p) * (hp / np.where(flat, 1.0, hp - hr))
        )
        found.append((i, np.stack([first, second], axis=1)))
    face = np.concatenate([f for f, _ in found])
    offset = np.concatenate([e for _, e in found]) - a[face, None]
    return face, np.einsum("mex,mkx->mek", offset, along[face])


def _cuts(corners: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whether a line (m, 2, 2) passes through a triangle (m, 3, 2); the edge to divide first, and where."""
    way = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(way, axis=1)
    way = way / np.where(length > 0.0, length, 1.0)[:, None]
    offset = corners - ends[:, :1]
    side = offset[..., 1] * way[:, None, 0] - offset[..., 0] * way[:, None, 1]
    side[np.abs(side) < LEVEL] = 0.0
    after = np.roll(side, -1, axis=1)
    crosses = side * after < 0.0
    share = np.where(crosses, side / np.where(crosses, side - after, 1.0), 0.0)
    there = np.einsum("mvk,mk->mv", offset + share[..., None] * (np.roll(offset, -1, axis=1) - offset), way)
    on_line = crosses | (side == 0.0)
    begin = np.where(on_line, there, np.inf).min(axis=1)
    end = np.where(on_line, there, -np.inf).max(axis=1)
    both_sides = (side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0)
    crossed = both_sides & (np.minimum(end, length) - np.maximum(begin, 0.0) > LEVEL)
    edge = np.argmax(np.where(crosses, 1.0 - np.abs(share - 0.5), 0.0), axis=1)
    return crossed, edge, np.take_along_axis(share, edge[:, None], axis=1)[:, 0]
