"""Starts of fits: spread over the bounds, tried on a part of the data, the best of them carried on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..numerics.lattice import lattice
from .losses import of_starts
from .problem import Problem
from .solver import minimize, with_linear_solved
from .unknowns import likely

STARTS = 16
"""Starts at least; 3/8 of the cube of the number of unknowns that do not enter linearly more, up to `MOST`: their space
has as many corners more."""

MOST = 96

SAME_COST = 1.01
"""Ratio of costs up to which two optima count as one."""

NOTHING = 1e-7
"""Share of the sum of squares of what is compared that counts for nothing."""

FEW = 1024
"""Rows on which starts are tried."""

ROUGH = 1e-5
"""Tolerance of the fits that only choose a start."""


def starts(problem: Problem, count: int | None, seed: int) -> np.ndarray:
    """Unknowns (S, n) from which fits begin: the model's own numbers first, then others spread over the bounds."""
    u = problem.unknowns
    curved = np.flatnonzero(~u.is_linear)
    if count is None:
        count = min(STARTS + 3 * len(curved) ** 3 // 8, MOST) if len(curved) else 1
    x = np.tile(u.start, (count, 1))
    if count > 1 and len(curved):
        bounds = np.array([likely(f) for f, n in u.widths for _ in range(n)])
        low, high = (np.where(u.is_log, np.log(np.where(u.is_log, b, 1.0)), b)[curved] for b in bounds.T)
        shift = np.random.default_rng(seed).random(len(curved))
        spread = (lattice(count - 1, max(len(curved), 2))[:, : len(curved)] + shift) % 1.0
        x[1:, curved] = low + spread * (high - low)
    x[:, u.is_linear] = np.clip(0.0, u.low, u.high)[u.is_linear]  # before they are solved for: nothing cancels then
    return x


def chosen_rows(problem: Problem, seed: int) -> Problem:
    """The problem on a part of its rows: half of them at random, half where the data are largest."""
    s = problem.samples
    if len(s) <= FEW:
        return problem
    random = np.random.default_rng(seed)
    size = np.abs(s.f).max(axis=1) * s.wi[:, 2] + 1e-30
    keys = random.standard_exponential(len(s), np.float32) / np.sqrt(size)  # the least are a draw by these weights
    bright = np.argpartition(keys, FEW // 2)[: FEW // 2]
    even = (random.random(FEW - FEW // 2) * len(s)).astype(int)
    return problem.at(np.unique(np.concatenate([bright, even])))


def best_starts(problem: Problem, count: int | None, seed: int, keep: int) -> tuple[np.ndarray, float]:
    """The best `keep` distinct unknowns (K, n) after fits to a part of the data, and the share of the starts whose fits
    ended as well as the best."""
    x = starts(problem, count, seed)
    part = replace(chosen_rows(problem, seed), single=True)
    plain = replace(part, loss=of_starts(part.loss))
    x = with_linear_solved(plain.squares, x, plain.box)
    found = minimize(part.squares, x, part.box, steps=60, tolerance=ROUGH)
    cost = np.where(np.isfinite(found.squares.cost), found.squares.cost, np.inf)
    order = np.argsort(cost, kind="stable")
    kept: list[int] = []
    for k in order:
        scale = np.maximum(np.abs(found.x[k]), 1e-3)
        if all((np.abs(found.x[k] - found.x[j]) > 0.02 * scale).any() for j in kept):
            kept.append(int(k))
        if len(kept) == keep:
            break
    return found.x[kept], float(np.mean(cost <= SAME_COST * cost.min() + NOTHING * part.size))
