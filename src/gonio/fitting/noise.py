"""The noise of data whose uncertainty is not known: how its variance depends on the value, told by residuals."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from .losses import LOSSES
from .problem import Problem

ROUNDS = 8
"""Rounds of weights from equal shares, after which variances change by less than 1 % of their standard error; half as
many from shares that are nearly right."""

FAINTEST = 1e-10
"""Least variance of a residual, of the largest, by whose inverse it is weighed."""

STEEP = 0.02
"""Least cosine by which noise at grazing angles is divided."""

ENOUGH = 2000
"""Residuals from which shares are told, where there are more: every so many in the order of their size by the parts."""


def parts_of(problem: Problem, f: np.ndarray) -> np.ndarray:
    """Variances (C N, 5) that residuals may have, each in a scale of its own; f (N, C) of the model.

    Those of a noise in f that is constant, in proportion to the root of f (photons), to f, and to f/(cos(theta_i)
    cos(theta_o)) (alignment at grazing angles); and of a constant noise in what is compared.
    """
    s = problem.samples
    cos_i, cos_o = (np.maximum(w[:, 2:], STEEP) for w in (s.wi, s.wo))
    step = 1e-4 * np.maximum(np.abs(f), 1e-6)
    compared = LOSSES[problem.loss].compared
    slope = (compared(f + step, cos_i) - compared(f - step, cos_i)) / (2.0 * step)
    in_f = np.ones_like(f), np.sqrt(np.abs(f)), f, f / (cos_i * cos_o)
    parts = np.stack([*(np.square(slope * noise) for noise in in_f), np.ones_like(f)])
    parts *= s.valid if s.weights is None else s.valid * s.weights
    found: np.ndarray = parts.transpose(2, 1, 0).reshape(-1, len(parts))
    return found / np.maximum(found.max(axis=0), 1e-300)


UNLIKELY = 12.0
"""Excess of the Bayesian information criterion from which sums of parts are not looked for: a weight of 1/400."""


class Noise(NamedTuple):
    """What the noise may be: variances (M, R) of the residuals, and how likely each is (M,)."""

    variances: np.ndarray
    weights: np.ndarray


def noise(slopes: np.ndarray, residuals: np.ndarray, parts: np.ndarray) -> Noise:
    """Variances of the residuals (R,) of a linear problem with these slopes (R, n): sums of some of `parts`.

    Parts are left out one by one. Each sum on the way is as likely as its likelihood over R to the power of half its
    parts (Schwarz 1978): many values choose one, few leave several, which are averaged (Raftery 1995).

    Source   derived here; see `_Shares`.
    """
    scale = float(np.mean(residuals * residuals))
    if len(slopes) <= slopes.shape[1] or not scale > 0.0 or not parts.any():
        return Noise(residuals[None] ** 2, np.ones(1))  # no value is to spare, or none is off
    residuals = residuals / math.sqrt(scale)
    slopes = slopes / np.maximum(np.abs(slopes).max(axis=0), 1e-300)
    some = np.argsort(parts.sum(axis=1), kind="stable")[:: -(-len(parts) // ENOUGH)]
    kept = _Shares.of(slopes[some], residuals[some], parts[some])
    tried, least = [kept], kept.criterion
    while np.count_nonzero(kept.values) > 1 and kept.criterion < least + UNLIKELY:
        fewer = [kept.without(k) for k in np.flatnonzero(kept.values)]
        kept = min(fewer, key=lambda shares: shares.criterion)
        tried, least = tried + fewer, min(least, kept.criterion)
    likely = np.exp(-0.5 * (np.array([shares.criterion for shares in tried]) - least))
    return Noise(np.stack([scale * (parts @ shares.values) for shares in tried]), likely / likely.sum())


class _Shares:
    """Shares of the parts in the variances of residuals, and their Bayesian information criterion.

    Each round weighs least squares by the inverse of the variances, so that bright rows do not spread their noise over
    faint ones, and compares the squares of what is left with their expectations, which are linear in the shares: of
    the matrix M that makes residuals of noise, and a part p, the sum over k of M_ik^2 p_k. A share of 0 stays 0.
    """

    def __init__(self, slopes: np.ndarray, residuals: np.ndarray, parts: np.ndarray, values: np.ndarray, rounds: int):
        from scipy.optimize import nnls

        self._linear = slopes, residuals
        used = np.flatnonzero(values)
        for _ in range(rounds):
            left, weighed, spread = self._left(parts @ values)
            leverage = np.einsum("ij,ij->i", spread, weighed)
            expected = parts * (1.0 - 2.0 * leverage)[:, None]
            for k in used:
                moved = spread @ (weighed.T @ (weighed * parts[:, k, None]))
                expected[:, k] += np.einsum("ij,ij->i", moved, spread)
            usual = _above_faintest(expected @ values)
            with suppress(RuntimeError, ValueError):  # SciPy 1.13 gives up on some: shares then stay as they are
                values[used], _ = nnls((expected / usual[:, None])[:, used], left * left / usual)
        self._parts, self.values = parts, values
        usual = _above_faintest(parts @ values)
        deviance = float((np.log(usual) + self._left(usual)[0] ** 2 / usual).sum())
        self.criterion = deviance + math.log(len(residuals)) * np.count_nonzero(values)

    @classmethod
    def of(cls, slopes: np.ndarray, residuals: np.ndarray, parts: np.ndarray) -> _Shares:
        alike = np.full(parts.shape[1], float(residuals @ residuals) / parts.sum())
        return cls(slopes, residuals, parts, alike, ROUNDS)

    def without(self, k: Any) -> _Shares:
        """The shares without one of the parts."""
        whole = self._parts.sum(axis=0) * self.values
        values = self.values * (whole.sum() / (whole.sum() - whole[k]))
        values[k] = 0.0
        return _Shares(*self._linear, self._parts, values, ROUNDS // 2)

    def _left(self, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residuals of weighed least squares; slopes over variances, and the matrix that makes residuals of weighed
        sums."""
        slopes, residuals = self._linear
        weighed = slopes / _above_faintest(variance)[:, None]
        spread = slopes @ np.linalg.pinv(slopes.T @ weighed)
        return residuals - spread @ (weighed.T @ residuals), weighed, spread


def _above_faintest(variance: np.ndarray) -> np.ndarray:
    return np.maximum(variance, max(FAINTEST * float(variance.max()), 1e-300))
