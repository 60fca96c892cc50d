"""Batched Levenberg-Marquardt: one solver for one fit and for a million, on normal equations alone.

Unknowns that enter linearly are eliminated: wherever the others are tried, these are at their optimum (variable
projection). The step of all unknowns from such a point is Kaufman's, so that the curved ones see the valley's floor.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from ..evaluate.squares import Squares

Evaluate = Callable[[np.ndarray, np.ndarray | None], Squares]
"""The normal equations of unknowns (B, n), of all fits, or of those with these numbers."""

STEPS = 100
"""Steps at most."""

TOLERANCE = 1e-10
"""A fit ends where the next step would lower its cost by less than this share of it."""

FIRST, LEAST, MOST = 1e-3, 1e-10, 1e12
"""Damping at the start, at least and at most, relative to the diagonal of the matrix."""

LONGEST = 1.5
"""Longest step of a logarithm."""


class Solved(NamedTuple):
    """Unknowns (B, n), their normal equations, whether each fit ended by its own, and the steps taken."""

    x: np.ndarray
    squares: Squares
    ended: np.ndarray
    steps: np.ndarray

    def only(self, k: int) -> Solved:
        """One of the fits, of which B is then 1."""
        at = slice(k, k + 1)
        return Solved(self.x[at], Squares(*(part[at] for part in self.squares)), self.ended[at], self.steps[at])


class Box(NamedTuple):
    """Bounds of the unknowns (n,), which of them are logarithms, and which enter linearly."""

    low: np.ndarray
    high: np.ndarray
    is_log: np.ndarray
    is_linear: np.ndarray


def minimize(evaluate: Evaluate, x: np.ndarray, box: Box, steps: int = STEPS, tolerance: float = TOLERANCE) -> Solved:
    """The least cost from each of the starts x (B, n) within bounds.

    A step solves (A + damping diag A) d = -g for the unknowns that are not held at a bound by their slope, and is
    clipped to the bounds. It is taken where it lowers the cost; damping falls and rises by how well the normal
    equations foretold that. Fits that have ended are left out as soon as they are half of the batch.

    Source   Levenberg 1944; Marquardt 1963, whose scale this is; damping: Nielsen 1999, IMM-REP-1999-05; elimination:
             Golub & Pereyra 1973, SIAM J. Numer. Anal. 10(2):413; Kaufman 1975, BIT 15:49.
    """
    x, now = _tried(evaluate, np.clip(x, box.low, box.high), box, None)
    count = len(x)
    cost, gradient, matrix = (np.array(part) for part in now)
    damping, growth = np.full(count, FIRST), np.full(count, 2.0)
    ended, taken = ~np.isfinite(cost), np.zeros(count, int)
    part: np.ndarray | None = None  # the numbers of the fits that go on; None: all
    for _ in range(steps):
        if ended.all():
            break
        active = ~ended if part is None else ~ended[part]
        if active.mean() <= 0.5:
            part = np.flatnonzero(active) if part is None else part[active]
        at: slice | np.ndarray = slice(None) if part is None else part
        d = _step(gradient[at], matrix[at], x[at], damping[at], box)
        new = np.clip(x[at] + d, box.low, box.high)
        d = new - x[at]
        foretold = -2.0 * (gradient[at] * d).sum(axis=1) - np.einsum("bi,bij,bj->b", d, matrix[at], d)
        new, tried = _tried(evaluate, new, box, part)
        lower = tried.cost < cost[at]
        done = ended[at]
        take = lower & ~done
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            gain = (cost[at] - tried.cost) / foretold
            shrink = np.clip(1.0 - (2.0 * gain - 1.0) ** 3, 1.0 / 3.0, 2.0)
            few = np.abs(foretold) <= tolerance * cost[at]
            smallest = np.abs(cost[at] - tried.cost) <= tolerance * cost[at]
        now_ended = done | few | (lower & smallest) | (cost[at] == 0.0)
        x[at] = np.where(take[:, None], new, x[at])
        cost[at] = np.where(take, tried.cost, cost[at])
        gradient[at] = np.where(take[:, None], tried.gradient, gradient[at])
        matrix[at] = np.where(take[:, None, None], tried.matrix, matrix[at])
        next_damping = np.where(
            lower, damping[at] * np.where(np.isfinite(shrink), shrink, 1.0), damping[at] * growth[at]
        )
        growth[at] = np.where(lower, 2.0, 2.0 * growth[at])
        damping[at] = np.clip(next_damping, LEAST, MOST)
        taken[at] += ~done
        ended[at] = now_ended | (damping[at] >= MOST)
    return Solved(x, Squares(cost, gradient, matrix), ended, taken)


def _tried(evaluate: Evaluate, x: np.ndarray, box: Box, part: np.ndarray | None) -> tuple[np.ndarray, Squares]:
    """The unknowns x (B, n), with those that enter linearly at their optimum where that lowers the cost, and their
    normal equations. Of a loss that bends f the optimum is one of its tangent, which may be worse."""
    sums = evaluate(x, part)
    if not box.is_linear.any() or box.is_linear.all():  # then the next step is the same
        return np.array(x), sums
    linear, d = linear_step(sums, x, box)
    moved = x.copy()
    moved[:, linear] = np.clip(x[:, linear] + d, box.low[linear], box.high[linear])
    other = evaluate(moved, part)
    lower = other.cost <= sums.cost
    cost = np.where(lower, other.cost, sums.cost)
    gradient = np.where(lower[:, None], other.gradient, sums.gradient)
    matrix = np.where(lower[:, None, None], other.matrix, sums.matrix)
    return np.where(lower[:, None], moved, x), Squares(cost, gradient, matrix)


def with_linear_solved(evaluate: Evaluate, x: np.ndarray, box: Box) -> np.ndarray:
    """The unknowns x (B, n) with those that enter linearly at the optimum of their tangent within bounds."""
    if not box.is_linear.any():
        return x
    linear, d = linear_step(evaluate(x, None), x, box)
    moved = x.copy()
    moved[:, linear] = np.clip(x[:, linear] + d, box.low[linear], box.high[linear])
    return moved


def linear_step(sums: Squares, x: np.ndarray, box: Box) -> tuple[np.ndarray, np.ndarray]:
    """The unknowns that enter linearly, and their step (B, L) to the optimum within bounds.

    Of the numbers that leave the bounds the farthest is held there, and the others are solved for again.
    """
    linear = np.flatnonzero(box.is_linear)
    a, g = sums.matrix[:, linear[:, None], linear], sums.gradient[:, linear]
    low, high = box.low[linear] - x[:, linear], box.high[linear] - x[:, linear]
    d, held = np.zeros_like(g), np.zeros(g.shape, bool)
    damping = np.full(len(x), LEAST)
    for _ in range(len(linear) + 1):
        rest = g + np.einsum("bij,bj->bi", a, np.where(held, d, 0.0))
        d = np.where(held, d, solved(a, -rest, held, damping))
        with np.errstate(invalid="ignore", over="ignore"):
            beyond = np.nan_to_num(
                np.where(held, 0.0, np.maximum(low - d, d - high) * np.sqrt(np.einsum("bii->bi", a)))
            )
        worst = beyond.argmax(axis=1) if len(linear) else np.zeros(0, int)
        outside = beyond.max(axis=1, initial=0.0) > 0.0
        if not outside.any():
            break
        rows = np.flatnonzero(outside)
        held[rows, worst[rows]] = True
        d = np.where(held, np.clip(d, low, high), d)
    return linear, np.clip(d, low, high)


def _step(gradient: np.ndarray, matrix: np.ndarray, x: np.ndarray, damping: np.ndarray, box: Box) -> np.ndarray:
    held = ((x <= box.low) & (gradient > 0.0)) | ((x >= box.high) & (gradient < 0.0))
    d = solved(matrix, -gradient, held, damping)
    return np.where(box.is_log, np.clip(d, -LONGEST, LONGEST), d)


def solved(matrix: np.ndarray, right: np.ndarray, held: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Solutions (B, n) of damped symmetric systems, 0 for the unknowns that are held; 0 where there is none."""
    diagonal = np.einsum("bii->bi", matrix)
    held = held | ~np.isfinite(diagonal)
    free = np.where(held | ~(diagonal > 0.0), 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        scaled = np.where(held[:, :, None] | held[:, None, :], 0.0, matrix * free[:, :, None] * free[:, None, :])
        if len(right) < FEW:
            np.einsum("bii->bi", scaled)[:] = 1.0 + damping[:, None]
            with suppress(np.linalg.LinAlgError):
                found = np.linalg.solve(scaled, (right * free)[..., None])[..., 0]
                return np.where(np.isfinite(found), found, 0.0) * free
        found = _by_factors(scaled, right * free, 1.0 + damping)
    return np.where(np.isfinite(found), found, 0.0) * free


FEW = 256
"""Systems below which a call of LAPACK for each is faster."""


def _by_factors(matrix: np.ndarray, right: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
    """Solutions of systems whose diagonals are one number each, by Cholesky's factors: all systems at once."""
    n = right.shape[1]
    columns = np.empty((n, n, len(right)))  # of the factor, the batch last: each operation is of one long row
    rows = np.ascontiguousarray(np.moveaxis(matrix, 0, -1))
    b = np.ascontiguousarray(right.T)
    for j in range(n):
        pivot = diagonal - (columns[j, :j] ** 2).sum(axis=0)
        root = columns[j, j] = np.sqrt(np.maximum(pivot, 1e-14))
        for i in range(j + 1, n):
            columns[i, j] = (rows[i, j] - (columns[i, :j] * columns[j, :j]).sum(axis=0)) / root
    for i in range(n):
        b[i] = (b[i] - (columns[i, :i] * b[:i]).sum(axis=0)) / columns[i, i]
    for i in reversed(range(n)):
        b[i] = (b[i] - (columns[i + 1 :, i] * b[i + 1 :]).sum(axis=0)) / columns[i, i]
    found: np.ndarray = b.T
    return found
