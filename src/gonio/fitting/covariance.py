"""Covariance of fitted numbers, and which of them the data cannot tell apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .problem import Problem

NOTHING = 1e-13
"""Eigenvalue of the scaled normal matrix, relative to the largest, below which the data say nothing along its vector."""

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

    Of a likelihood A^-1, A = J^T J; otherwise A^-1 S A^-1 N/(N - n), S the sum of squared slopes of the costs (Huber
    1967; White 1980), which needs no knowledge of the noise and holds where it differs between rows.
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
        scores = problem.score_squares(x[None])[0][np.ix_(free, free)]
        count = problem.samples.count
        found = inverse @ scores @ inverse * (count / max(count - len(free), 1))
    slopes = u.slopes(x)[free]
    found = found * slopes[:, None] * slopes
    for vector in vectors[:, ~kept].T:
        lost = np.abs(vector) > PART
        found[lost, lost] = np.inf
    covariance[np.ix_(free, free)] = found
    condition = float(np.sqrt(values[-1] / values[0])) if values[0] > 0.0 and kept.all() else float("inf")
    return Spread(covariance, condition, at_bound)


def correlations(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix; NaN for numbers whose variance is 0 or infinite."""
    spread = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        found: np.ndarray = covariance / spread[:, None] / spread
    unknown = ~np.isfinite(spread) | (spread == 0.0)
    found[unknown] = found[:, unknown] = np.nan
    np.fill_diagonal(found, 1.0)
    return found
