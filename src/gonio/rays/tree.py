"""Rays by a tree of boxes in NumPy, where embreex cannot be installed: right, and a hundred times slower."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

LEAF = 4
"""Triangles in a leaf."""


class _Hits(NamedTuple):
    """What rays met first, so far: face or -1, distance, and barycentric coordinates."""

    face: np.ndarray
    distance: np.ndarray
    u: np.ndarray
    v: np.ndarray


class BoxTree:
    """Triangles (F, 3) of vertices (V, 3) in a complete binary tree along a Morton curve.

    Node 1 is the root, 2 i and 2 i + 1 are the children of i. A ray that meets a box goes on to the first child, else,
    and after a leaf, to the next node that is not below (`after`); 0 is the end.

    Source   Möller & Trumbore 1997, J. Graphics Tools 2:21, for a ray and a triangle.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray):
        corners = vertices.astype(np.float64)[faces]
        centres = corners.mean(axis=1)
        span = np.ptp(centres, axis=0)
        cell = ((centres - centres.min(axis=0)) / np.where(span > 0.0, span, 1.0) * 1023.0).astype(np.int64)
        code = sum((cell[:, axis] >> bit & 1) << (3 * bit + axis) for axis in range(3) for bit in range(10))
        order = np.argsort(code, kind="stable")
        self.leaves = 1 << max(0, int(np.ceil(np.log2(len(faces) / LEAF))))
        places = np.arange(self.leaves * LEAF) * len(faces) // (self.leaves * LEAF)  # some twice
        self.inside = order[places].reshape(self.leaves, LEAF)
        self.start = corners[:, 0]
        self.u, self.v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        self.low, self.high = np.empty((2, 2 * self.leaves, 3))
        self.low[self.leaves :] = corners[self.inside].min(axis=(1, 2))
        self.high[self.leaves :] = corners[self.inside].max(axis=(1, 2))
        for node in range(self.leaves - 1, 0, -1):
            self.low[node] = np.minimum(self.low[2 * node], self.low[2 * node + 1])
            self.high[node] = np.maximum(self.high[2 * node], self.high[2 * node + 1])
        grow = 1e-6 * np.abs(corners).max()
        self.low, self.high = self.low - grow, self.high + grow
        after = np.arange(2 * self.leaves)
        while (climbing := (after & 1).astype(bool) & (after > 0)).any():
            after[climbing] //= 2
        self.after = np.where(after > 0, after + 1, 0)

    def first(self, origins: np.ndarray, directions: np.ndarray, far: np.ndarray) -> tuple[np.ndarray, ...]:
        """Face or -1, distance, and barycentric coordinates u, v of what each ray meets first."""
        return self._walk(origins, directions, far, False)

    def face(self, origins: np.ndarray, directions: np.ndarray, far: np.ndarray) -> np.ndarray:
        """The face alone."""
        return self._walk(origins, directions, far, False)[0]

    def any(self, origins: np.ndarray, directions: np.ndarray, far: np.ndarray) -> np.ndarray:
        """Whether a ray meets any triangle nearer than `far`."""
        return self._walk(origins, directions, far, True)[0] >= 0

    def _walk(self, origins: np.ndarray, directions: np.ndarray, far: np.ndarray, any_will_do: bool) -> tuple:
        o, d = origins.astype(np.float64), directions.astype(np.float64)
        with np.errstate(divide="ignore"):
            inverse = 1.0 / d
        hits = _Hits(np.full(len(o), -1, np.int32), far.astype(np.float64), *np.zeros((2, len(o))))
        rays, node = np.arange(len(o)), np.ones(len(o), np.int64)
        while len(rays):
            with np.errstate(invalid="ignore"):  # 0 · ∞ in the plane of a side: NaN, which fmin and fmax pass over
                a = (self.low[node] - o[rays]) * inverse[rays]
                b = (self.high[node] - o[rays]) * inverse[rays]
                enter = np.fmax.reduce(np.fmin(a, b), axis=1)
                leave = np.fmin.reduce(np.fmax(a, b), axis=1)
            met = (enter <= leave) & (leave >= 0.0) & (enter <= hits.distance[rays])
            leaf = met & (node >= self.leaves)
            if leaf.any():
                self._leaf(rays[leaf], node[leaf] - self.leaves, o, d, hits)
            node = np.where(met & ~leaf, 2 * node, self.after[node])
            go_on = (node > 0) & (hits.face[rays] < 0) if any_will_do else node > 0
            rays, node = rays[go_on], node[go_on]
        return hits.face, *(x.astype(np.float32) for x in hits[1:])

    def _leaf(self, rays: np.ndarray, leaf: np.ndarray, o: np.ndarray, d: np.ndarray, hits: _Hits) -> None:
        for k in range(LEAF):
            face = self.inside[leaf, k]
            p = np.cross(d[rays], self.v[face])
            volume = np.sum(p * self.u[face], axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                scale = 1.0 / volume
                s = o[rays] - self.start[face]
                u = np.sum(s * p, axis=1) * scale
                q = np.cross(s, self.u[face])
                v = np.sum(d[rays] * q, axis=1) * scale
                t = np.sum(self.v[face] * q, axis=1) * scale
                hit = (volume != 0.0) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0) & (t < hits.distance[rays])
            at = rays[hit]
            for x, new in zip(hits, (face, t, u, v), strict=True):
                x[at] = new[hit]
