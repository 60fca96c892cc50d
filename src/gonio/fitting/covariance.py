"""Covariance of fitted numbers, and which of them the data cannot tell apart."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .losses import ROBUST
from .noise import noise, parts_of
from .problem import Problem

NOTHING = 1e-13
"""Eigenvalue of the scaled normal matrix, relative to the largest, below which data say nothing along its vector."""

PART = 0.05
"""Share of such a vector from which a number is not determined."""


class _Covariance(NamedTuple):
    """Covariance (n, n) of numbers: inf on the diagonal of those that are not determined, 0 of those at a bound.

    freedom: degrees of freedom (n,) of the variances.
    condition: square root of the ratio of the largest to the least eigenvalue of the scaled normal matrix.
    """

    covariance: np.ndarray
    freedom: np.ndarray
    condition: float
    at_bound: np.ndarray


def spread_of(problem: Problem, x: np.ndarray, gradient: np.ndarray, matrix: np.ndarray) -> _Covariance:
    """The covariance at the optimum x (n,), of the normal equations there.

    Of a likelihood A^-1, A = J^T J; otherwise A^-1 S A^-1, S the sum of squared slopes times the variances of the
    residuals, from the scatter: see `_sandwich`.
    """
    u = problem.unknowns
    box = problem.box
    at_bound = ((x <= box.low) & (gradient >= 0.0)) | ((x >= box.high) & (gradient <= 0.0))
    free = np.flatnonzero(~at_bound)
    n = len(x)
    covariance, freedom = np.zeros((n, n)), np.full(n, max(problem.samples.count - n, 1.0))
    if not len(free):
        return _Covariance(covariance, freedom, 1.0, at_bound)
    a = matrix[np.ix_(free, free)]
    size = np.sqrt(np.where(np.diag(a) > 0.0, np.diag(a), 1.0))
    values, vectors = np.linalg.eigh(a / size[:, None] / size)
    kept = values > NOTHING * values[-1]
    root = vectors[:, kept] / np.sqrt(values[kept])
    inverse = root @ root.T / size[:, None] / size
    if problem.loss == "likelihood" and problem.robust == "none":
        of_free = inverse
    else:
        of_free, freedom[free] = _sandwich(problem, x, free, inverse, freedom[0])
    slopes = u.slopes(x)[free]
    of_free = of_free * slopes[:, None] * slopes
    for vector in vectors[:, ~kept].T:
        lost = np.abs(vector) > PART
        of_free[lost, lost] = np.inf
    covariance[np.ix_(free, free)] = of_free
    condition = float(np.sqrt(values[-1] / values[0])) if values[0] > 0.0 and kept.all() else float("inf")
    return _Covariance(covariance, freedom, condition, at_bound)


def _sandwich(
    problem: Problem, x: np.ndarray, free: np.ndarray, inverse: np.ndarray, freedom: float
) -> tuple[np.ndarray, Any]:
    """A^-1 S A^-1 of the free unknowns, for noise of unknown size that differs between rows, and the degrees of freedom
    of its diagonal: `freedom` of a noise whose size alone is unknown.

    Of many values S is the sum of squared slopes of the costs (Huber 1967; White 1980), times N/(N - n). Of few values
    a handful of bright rows may carry a number, and their squares scatter too much to tell its variance. So residuals
    have variances that depend smoothly on the value (`noise`), and that of a number is at least what the squares
    themselves say. Where several kinds of noise are likely, the variance is their mean, and by how much it differs
    between them takes degrees of freedom away, of which a variance V has 2 V^2/var(V) (Satterthwaite 1946): few
    are left where some bright rows carry a number. Of a robust cost S is that of squares over (1 - h)^2, h the
    leverage of each: those of residuals whose rows are left out (MacKinnon & White 1985, HC3).
    """
    count = problem.samples.count
    if count * len(x) > FEW:
        sums: np.ndarray = problem.score_squares(x[None])[0][np.ix_(free, free)]
        return inverse @ (sums * (count / max(count - len(free), 1))) @ inverse, freedom
    u = problem.unknowns
    numbers = u.numbers(x)
    slopes = (problem.jacobian(numbers) * u.slopes(x))[:, free]
    r = problem.residuals(numbers)
    moves = slopes @ inverse
    if problem.robust != "none":
        weight = ROBUST[problem.robust].weight(r * r)
        leverage = np.einsum("ki,ki->k", moves, slopes) * weight
        scaled = moves * (weight * r / np.maximum(1.0 - leverage, LEAST_FREE))[:, None]
        return scaled.T @ scaled, freedom
    s = problem.samples
    f = np.broadcast_to(np.reshape(u.fitted(numbers).f(s.wi, s.wo), (len(s), -1)), s.f.shape)
    likely = noise(slopes, r, parts_of(problem, f))
    smooth = moves.T @ (moves * (likely.weights @ likely.variances)[:, None])
    least, expected = (moves * r[:, None] ** 2 * moves).sum(axis=0), np.diag(smooth)
    between = likely.weights @ (likely.variances @ moves**2 - expected) ** 2
    row_freedom = 1.0 / (1.0 / freedom + 0.5 * between / np.where(expected > 0.0, expected, np.inf) ** 2)
    larger = np.sqrt(np.maximum(least / np.where(expected > 0.0, expected, np.inf), 1.0))
    return smooth * larger[:, None] * larger, np.maximum(row_freedom, 1.0)


FEW = 100_000
"""Slopes up to which the noise is fitted, and leverages are computed."""

LEAST_FREE = 0.05
"""Least 1 - h by which a residual is divided."""


def correlations(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix; NaN for numbers whose variance is 0 or infinite."""
    spread = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        matrix: np.ndarray = covariance / spread[:, None] / spread
    unknown = ~np.isfinite(spread) | (spread == 0.0)
    matrix[unknown] = matrix[:, unknown] = np.nan
    np.fill_diagonal(matrix, 1.0)
    return matrix
