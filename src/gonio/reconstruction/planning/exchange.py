"""The best choice of directions: greedy starts, then exchanges of one for another until none helps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

TRIED = 20_000
"""Values, in all channels and models, from which every start chooses; the best goes on with all."""

PASSES = 50
"""Times that each direction may be exchanged."""

LEAST = 1e-10
"""Eigenvalue of the scaled information, from below which an exchange looks at what it would become."""

GAIN = 1e-9
"""Relative gain from which an exchange is made."""


class Information(NamedTuple):
    """What candidates tell of the n unknowns of one expected model, in units in which all together tell 1 of each.

    The values share q errors of the model itself, each with a coefficient of its own whose standard deviation is 1.

    rows      (N, C, n + q) derivatives of each value over its uncertainty: by the unknowns J, by those coefficients E
    known     (n, n + q) information from before
    weights   (n,) of the variances in the criterion "A"
    size      (n,) unit of each unknown
    """

    rows: np.ndarray
    known: np.ndarray
    weights: np.ndarray
    size: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, known: np.ndarray, values: np.ndarray) -> Information:
        n = len(values)
        every = np.einsum("kci,kci->i", rows[..., :n], rows[..., :n]) / len(rows) + np.diag(known)
        size = 1.0 / np.sqrt(np.where(every > 0.0, every, 1.0))
        with np.errstate(divide="ignore"):
            weights = (size / values) ** 2
        units = np.concatenate([size, np.ones(rows.shape[-1] - n)])
        return cls(rows * units, known * size[:, None] * units, weights, size)

    def at(self, which: np.ndarray) -> Information:
        return self._replace(rows=self.rows[which])

    def matrix(self, chosen: np.ndarray) -> np.ndarray:
        """The information (n, n + q) of some candidates and of what is known: sums of J^T J and of J^T E."""
        rows = self.rows[chosen].reshape(-1, self.rows.shape[-1])
        return self.known + rows[:, : len(self.size)].T @ rows

    @property
    def mean(self) -> np.ndarray:
        """The information (n, n + q) of a direction on average."""
        rows = self.rows.reshape(-1, self.rows.shape[-1])
        return rows[:, : len(self.size)].T @ rows / len(self.rows)


def covariance_of(matrix: np.ndarray) -> np.ndarray:
    """The covariance (n, n) of a fit with this information (n, n + q): A^-1 + (A^-1 G)(A^-1 G)^T, A = J^T J, G = J^T E.

    The fit itself takes all values for independent: errors of the model that they share move its numbers by A^-1 G.
    """
    n = len(matrix)
    values, vectors = np.linalg.eigh(matrix[:, :n])
    root = vectors / np.sqrt(np.maximum(values, LEAST))
    inverse = root @ root.T
    moved = inverse @ matrix[:, n:]
    found: np.ndarray = inverse + moved @ moved.T
    return found


def goodness_of(matrices: Sequence[np.ndarray], infos: Sequence[Information], criterion: str) -> float:
    """What is largest for the best plan: less ln det of the covariance, or less the sum of relative variances; the mean
    over models."""
    found = []
    for matrix, info in zip(matrices, infos, strict=True):
        covariance = covariance_of(matrix)
        worth = np.linalg.slogdet(covariance)[1] if criterion == "D" else info.weights @ np.diag(covariance)
        found.append(-float(worth))
    return float(np.mean(found))


def _gains(matrices: Sequence[np.ndarray], infos: Sequence[Information], criterion: str) -> np.ndarray:
    """What each candidate (N,), added, would make of the goodness, up to a constant: all candidates at once."""
    total = np.zeros(len(infos[0].rows))
    for matrix, info in zip(matrices, infos, strict=True):
        if info.rows.shape[-1] > len(info.size):
            total += _with_shared_errors(matrix, info, criterion)
            continue
        values, vectors = np.linalg.eigh(matrix)
        root = vectors / np.sqrt(np.maximum(values, LEAST))
        turned = info.rows @ root
        if turned.shape[1] == 1:
            turned = turned[:, 0]
            leverage = np.einsum("ki,ki->k", turned, turned)
            if criterion == "D":
                total += np.log1p(leverage)
            else:
                variance = (turned @ root.T) ** 2 @ info.weights
                total += variance / (1.0 + leverage)
            continue
        turns = np.swapaxes(turned, 1, 2)
        leverage = np.eye(turned.shape[1]) + turned @ turns
        if criterion == "D":
            total += np.linalg.slogdet(leverage)[1]
        else:
            effect = turned @ root.T * np.sqrt(info.weights)
            total += np.trace(np.linalg.solve(leverage, effect @ np.swapaxes(effect, 1, 2)), axis1=1, axis2=2)
    return total / len(infos)


def _with_shared_errors(matrix: np.ndarray, info: Information, criterion: str) -> np.ndarray:
    """The goodness (N,) with each candidate added, where values share errors of the model."""
    n = len(info.size)
    added = np.swapaxes(info.rows[..., :n], 1, 2) @ info.rows
    together = matrix + added
    inverse = np.linalg.inv(together[..., :n] + LEAST * np.eye(n))
    moved = inverse @ together[..., n:]
    covariance = inverse + moved @ np.swapaxes(moved, 1, 2)
    if criterion == "D":
        found: np.ndarray = -np.linalg.slogdet(covariance)[1]
        return found
    return -np.einsum("kii,i->k", covariance, info.weights)


def _start(
    infos: Sequence[Information], count: int, criterion: str, repeats: bool, random: np.random.Generator | None
) -> np.ndarray:
    """Candidates (count,) chosen greedily, the first half of them by chance."""
    candidates = len(infos[0].rows)
    chosen: list[int] = []
    if random is not None:
        chosen = random.choice(candidates, max(count // 2, 1), replace=repeats).tolist()
    while len(chosen) < count:
        gains = _gains([info.matrix(np.array(chosen, int)) for info in infos], infos, criterion)
        if not repeats:
            gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
    return np.array(chosen)


def _exchanged(
    infos: Sequence[Information], chosen: np.ndarray, criterion: str, repeats: bool
) -> tuple[np.ndarray, float]:
    """Candidates after exchanges, one at a time for the best other one, until none helps; and the goodness."""
    chosen = chosen.copy()
    best = goodness_of([info.matrix(chosen) for info in infos], infos, criterion)
    for _ in range(PASSES):
        before = best
        for k in range(len(chosen)):
            others = np.delete(chosen, k)
            gains = _gains([info.matrix(others) for info in infos], infos, criterion)
            if not repeats:
                gains[others] = -np.inf
            trial = chosen.copy()
            trial[k] = int(np.argmax(gains))
            if trial[k] == chosen[k]:
                continue
            found = goodness_of([info.matrix(trial) for info in infos], infos, criterion)
            if found > best + GAIN * max(abs(best), 1.0):
                chosen, best = trial, found
        if best == before:
            break
    return chosen, best


def best_choice(
    infos: Sequence[Information], count: int, criterion: str, repeats: bool, starts: int, seed: int
) -> np.ndarray:
    """The best choice of all starts."""
    random = np.random.default_rng(seed)
    candidates, channels, width = infos[0].rows.shape
    few = max(TRIED * len(infos[0].size) // (width * channels * len(infos)), 4 * count)
    part = np.arange(candidates)
    if few < candidates:
        part = np.sort(random.choice(candidates, few, replace=False))
    some = [info.at(part) for info in infos]
    ends = [
        _exchanged(some, _start(some, count, criterion, repeats, random if k else None), criterion, repeats)
        for k in range(starts)
    ]
    chosen = part[max(ends, key=lambda end: end[1])[0]]
    return chosen if few >= candidates else _exchanged(infos, chosen, criterion, repeats)[0]
