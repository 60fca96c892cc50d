"""Least squares of photometric stereo: a unit normal, a factor for each channel, thousands of texels at a time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

TURNS = 60
"""Steps between normals and albedos of several channels at most."""

STILL = 1e-10
"""Change of a normal [rad] with which they end."""

PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Elements of a symmetric matrix, in the order of its six numbers."""


class NormalEquations(NamedTuple):
    """Normal equations of T texels: A (C or 1, 6, T), as xx, yy, zz, xy, xz, yz; q (C, 3, T); squares (C, T)."""

    A: np.ndarray
    q: np.ndarray
    squares: np.ndarray

    def at(self, texels: Any) -> NormalEquations:
        return NormalEquations(*(x[..., texels] for x in self))


def solved(sums: NormalEquations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The unit n (3, T) and f (C, T) of the least sum over channels of f^2 n.A n - 2 f q.n; whether they were found."""
    A, q, squares = sums
    if len(q) == 1:
        g = _solution(A[0], q[0])
        length = np.sqrt((g * g).sum(axis=0))
        return g / length, length[None], np.ones(len(length), bool)
    n, f, ended = np.full(q.shape[1:], np.nan), np.full(squares.shape, np.nan), np.ones(q.shape[-1], bool)
    moving, before = np.arange(q.shape[-1]), np.zeros(q.shape[1:])
    f_now = np.sqrt(squares / A[:, :3].sum(axis=1))
    for _ in range(TURNS):
        weighted = (f_now * f_now * np.swapaxes(A, 0, 1)).sum(axis=1), (f_now[:, None] * q).sum(axis=0)
        g = _solution(*weighted)
        n_now = g / np.sqrt((g * g).sum(axis=0))
        f_now = (q * n_now).sum(axis=1) / (times(A, n_now) * n_now).sum(axis=1)
        n[:, moving], f[:, moving] = n_now, f_now
        further = np.abs(n_now - before).max(axis=0) > STILL  # not for NaN
        moving, before, f_now = moving[further], n_now[:, further], f_now[:, further]
        A, q = A[..., further], q[..., further]
        if not len(moving):
            break
    ended[moving] = False
    return n, f, ended


def _solution(A: np.ndarray, q: np.ndarray) -> np.ndarray:
    """A^-1 q (3, T) of symmetric matrices (6, T)."""
    co = cofactors(A)
    solution: np.ndarray = times(co[None], q)[0] / (A[0] * co[0] + A[3] * co[3] + A[4] * co[4])
    return solution


def cofactors(A: np.ndarray) -> np.ndarray:
    """The matrix of minors (6, T) of symmetric ones."""
    xx, yy, zz, xy, xz, yz = A
    return np.stack(
        [
            yy * zz - yz * yz,
            xx * zz - xz * xz,
            xx * yy - xy * xy,
            xz * yz - xy * zz,
            xy * yz - xz * yy,
            xy * xz - xx * yz,
        ]
    )


def times(A: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A x (C, 3, T) of symmetric matrices (C, 6, T) and vectors (3, T) or (C, 3, T)."""
    x, y, z = (x[..., k, :] for k in range(3))
    xx, yy, zz, xy, xz, yz = (A[:, k] for k in range(6))
    return np.stack([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z], axis=1)
