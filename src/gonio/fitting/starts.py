"""Starts of fits: spread over the bounds, tried on a part of the data, the best of them carried on."""

from __future__ import annotations

import numpy as np

from ..numerics.lattice import lattice
from .problem import Problem
from .solver import minimise, with_linear_solved
from .unknowns import likely

STARTS = 24
"""Starts at least; 8 more for each unknown that does not enter linearly, up to `MOST`."""

MOST = 96

FEW = 1536
"""Rows on which starts are tried."""

ROUGH = 1e-5
"""Tolerance of the fits that only choose a start."""


def starts(problem: Problem, count: int | None, seed: int) -> np.ndarray:
    """Unknowns (S, n) from which fits begin: the model's own numbers first, then others spread over the bounds."""
    u = problem.unknowns
    curved = np.flatnonzero(~u.is_linear)
    if count is None:
        count = min(STARTS + 8 * len(curved), MOST) if len(curved) else 1
    x = np.tile(u.start, (count, 1))
    if count > 1 and len(curved):
        bounds = np.array([likely(f) for f, n in u._widths for _ in range(n)])
        low, high = (np.where(u.is_log, np.log(np.where(u.is_log, b, 1.0)), b)[curved] for b in bounds.T)
        shift = np.random.default_rng(seed).random(len(curved))
        spread = (lattice(count - 1, max(len(curved), 2))[:, : len(curved)] + shift) % 1.0
        x[1:, curved] = low + spread * (high - low)
    linear = u.is_linear
    x[:, linear] = np.where(u.start > 0.0, u.start, np.minimum(0.1, u.high))[linear]
    return x


def chosen_rows(problem: Problem, seed: int) -> Problem:
    """The problem on a part of its rows: half of them at random, half where the data are largest."""
    s = problem.samples
    if len(s) <= FEW:
        return problem
    random = np.random.default_rng(seed)
    size = np.abs(s.f * s.wi[:, 2:]).max(axis=1) + 1e-30
    keys = random.random(len(s)) ** (1.0 / size**0.5 * size.max() ** 0.5)  # Efraimidis & Spirakis 2006
    bright = np.argpartition(-keys, FEW // 2)[: FEW // 2]
    even = random.choice(len(s), FEW - FEW // 2, replace=False)
    return problem.at(np.unique(np.concatenate([bright, even])))


def best_starts(problem: Problem, count: int | None, seed: int, keep: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The best `keep` distinct unknowns (K, n) after fits to a part of the data; all ends of these, and their costs."""
    x = starts(problem, count, seed)
    part = chosen_rows(problem, seed)
    plain = part.least_squares()
    x = with_linear_solved(plain.squares, x, plain.box)
    found = minimise(_of_part(part), x, part.box, steps=60, tolerance=ROUGH)
    cost = np.where(np.isfinite(found.squares.cost), found.squares.cost, np.inf)
    order = np.argsort(cost, kind="stable")
    kept: list[int] = []
    for k in order:
        scale = np.maximum(np.abs(found.x[k]), 1e-3)
        if all((np.abs(found.x[k] - found.x[j]) > 0.02 * scale).any() for j in kept):
            kept.append(int(k))
        if len(kept) == keep:
            break
    return found.x[kept], found.x[order], cost[order]


def _of_part(problem: Problem):  # type: ignore[no-untyped-def]
    return lambda x, _: problem.squares(x)
