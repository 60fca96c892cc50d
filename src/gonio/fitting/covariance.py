"""Covariance of fitted numbers, and which of them the data cannot tell apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .losses import ROBUST
from .problem import Problem

NOTHING = 1e-13
"""Eigenvalue of the scaled normal matrix, relative to the largest, below which data say nothing along its vector."""

PART = 0.05
"""Share of such a vector from which a number is not determined."""


class Spread(NamedTuple):
    """Covariance (n, n) of numbers: inf on the diagonal of those that are not determined, 0 of those at a bound.

    condition: square root of the ratio of the largest to the least eigenvalue of the scaled normal matrix.
    """

    covariance: np.ndarray
    condition: float
    at_bound: np.ndarray


def spread_of(problem: Problem, x: np.ndarray, gradient: np.ndarray, matrix: np.ndarray) -> Spread:
    """The covariance at the optimum x (n,), of the normal equations there.

    Of a likelihood A^-1, A = J^T J; otherwise A^-1 S A^-1, S the sum of squared slopes of the costs (Huber 1967; White
    1980), which needs no knowledge of the noise and holds where it differs between rows.
    """
    u = problem.unknowns
    box = problem.box
    at_bound = ((x <= box.low) & (gradient >= 0.0)) | ((x >= box.high) & (gradient <= 0.0))
    free = np.flatnonzero(~at_bound)
    n = len(x)
    covariance = np.zeros((n, n))
    if not len(free):
        return Spread(covariance, 1.0, at_bound)
    a = matrix[np.ix_(free, free)]
    size = np.sqrt(np.where(np.diag(a) > 0.0, np.diag(a), 1.0))
    values, vectors = np.linalg.eigh(a / size[:, None] / size)
    kept = values > NOTHING * values[-1]
    root = vectors[:, kept] / np.sqrt(values[kept])
    inverse = root @ root.T / size[:, None] / size
    if problem.loss == "likelihood" and problem.robust == "none":
        found = inverse
    else:
        found = inverse @ _scores(problem, x, free, inverse) @ inverse
    slopes = u.slopes(x)[free]
    found = found * slopes[:, None] * slopes
    for vector in vectors[:, ~kept].T:
        lost = np.abs(vector) > PART
        found[lost, lost] = np.inf
    covariance[np.ix_(free, free)] = found
    condition = float(np.sqrt(values[-1] / values[0])) if values[0] > 0.0 and kept.all() else float("inf")
    return Spread(covariance, condition, at_bound)


def _scores(problem: Problem, x: np.ndarray, free: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """The sum of squared slopes of the costs, for the free unknowns.

    Of few values each residual is divided by 1 - h, h its leverage: what it would be if its row were left out
    (MacKinnon & White 1985, HC3). Of many values, whose leverages are small, all are scaled by N/(N - n).
    """
    count = problem.samples.count
    if count * len(x) > FEW:
        sums: np.ndarray = problem.score_squares(x[None])[0][np.ix_(free, free)]
        return sums * (count / max(count - len(free), 1))
    u = problem.unknowns
    numbers = u.numbers(x)
    slopes = (problem.jacobian(numbers) * u.slopes(x))[:, free]
    r = problem.residuals(numbers)
    weight = ROBUST[problem.robust].weight(r * r)
    leverage = np.einsum("ki,ij,kj->k", slopes, inverse, slopes, optimize=True) * weight
    scaled = slopes * (weight * r / np.maximum(1.0 - leverage, LEAST_FREE))[:, None]
    return scaled.T @ scaled


FEW = 100_000
"""Slopes up to which leverages are computed."""

LEAST_FREE = 0.05
"""Least 1 - h by which a residual is divided."""


def correlations(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix; NaN for numbers whose variance is 0 or infinite."""
    spread = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        found: np.ndarray = covariance / spread[:, None] / spread
    unknown = ~np.isfinite(spread) | (spread == 0.0)
    found[unknown] = found[:, unknown] = np.nan
    np.fill_diagonal(found, 1.0)
    return found
