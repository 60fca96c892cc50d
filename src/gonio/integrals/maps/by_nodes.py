"""Integrals of all places by a rule that is fitted to those of some: nodes and weights for this map alone."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...numerics.lattice import lattice
from .rows import BLOCK, SPREAD, MaterialRows, Wanted

FITTED, TESTED, MOST = 128, 48, 1024
"""Places that nodes are fitted to at first, those that test them, and the most of the first."""

CANDIDATES, NODES = 1024, (16, 24, 32, 48, 64, 96, 128, 192)
"""Pairs of directions of either kind among which nodes are chosen, and numbers of nodes that are tried."""

ALONE = 512
"""Places that are integrated by themselves, at most, before more of them are fitted."""

SAFETY = 2.5
"""Factor from the largest error at places that had no part in a fit to the estimate."""

INNER = 0.3
"""Share of the tolerance for the integrals of the few places."""


def by_nodes(rows: MaterialRows, wanted: Wanted) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value (count, C), error and missing (count,), for one direction."""
    rng, order = np.random.default_rng(0), rows.whole()
    value, error, missing = np.full((rows.length, 1), np.nan), np.zeros(rows.length), np.zeros(rows.length)

    def alone(these: np.ndarray) -> None:
        nonlocal value
        integrals = rows.integrals(these, wanted, 1.0)
        value = np.broadcast_to(value, (rows.length, integrals.value.shape[-1])).copy()
        value[these], error[these], missing[these] = integrals.value[0], integrals.error[0], integrals.missing[0]

    order = rng.permutation(order)
    if len(order) <= 2 * (FITTED + TESTED):
        alone(order)
        return value, error, missing
    tested, order = order[:TESTED], order[TESTED:]
    sample = _Known(rows, wanted, tested)
    sample.add(np.unique(np.concatenate([order[:FITTED], np.array(rows.extremes(), int)])))
    for these in (order[:SPREAD], order):
        while True:
            value_here, error_here, leverage = sample.rule().applied(sample, these)
            goal = wanted.tolerance * np.maximum(wanted.unit, np.abs(value_here).max(axis=-1))
            bad = np.flatnonzero(~(error_here <= goal))
            if len(bad) * (len(order) / len(these)) <= ALONE or len(sample.fitted) >= MOST:
                break
            worst = bad[leverage[bad].argsort()[-FITTED // 2 :]]
            sample.add(these[np.union1d(worst, rng.choice(bad, min(len(bad), len(sample.fitted)), replace=False))])
    value = np.full((rows.length, value_here.shape[-1]), np.nan)
    value[order], error[order], missing[order] = value_here, error_here, sample.missing
    value[sample.numbers] = sample.values
    error[sample.numbers] = SAFETY * sample.errors  # estimates of adaptive integrals are now and then a little low
    if len(bad):
        alone(order[bad])
    return value, error, missing


class _Known:
    """Rows whose integrals are known, first those that test a rule and then those it is fitted to, with f there at
    pairs of directions that may become its nodes."""

    def __init__(self, rows: MaterialRows, wanted: Wanted, tested: np.ndarray):
        self.rows, self.wanted = rows, wanted
        self.wi, self.wo = _candidates(rows, wanted, tested)
        self.numbers = np.zeros(0, int)
        self.add(tested)

    def add(self, new: np.ndarray) -> None:
        """Integrate further rows."""
        new = np.setdiff1d(new, self.numbers)
        integrals = self.rows.integrals(new, self.wanted, INNER)
        nodes = self.at(self.wi, self.wo, new) * (self.wi[:, 2] * self.wo[:, 2])
        if not len(self.numbers):
            self.values, self.errors, self.nodes, self.missing = integrals.value[0], integrals.error[0], nodes, 0.0
        else:
            self.values = np.concatenate([self.values, integrals.value[0]])
            self.errors = np.concatenate([self.errors, integrals.error[0]])
            self.nodes = np.concatenate([self.nodes, nodes])
        self.missing = max(self.missing, float(integrals.missing.max(initial=0.0)))
        self.numbers = np.concatenate([self.numbers, new])

    @property
    def fitted(self) -> np.ndarray:
        return self.numbers[TESTED:]

    def at(self, wi: np.ndarray, wo: np.ndarray, rows: Any) -> np.ndarray:
        """f of rows at pairs of directions: (rows, pairs)."""
        return self.rows.at(rows).f(wi[:, None], wo[:, None])[..., 0].T

    def rule(self) -> _Rule:
        """The rule of fewest nodes that keeps to the tolerance at the rows that test it, or the best."""
        scale = np.maximum(self.wanted.unit[0], np.abs(self.values).max(axis=-1))
        usable = np.flatnonzero(np.isfinite(self.nodes).all(axis=0))
        order = usable[_most_different(self.nodes[TESTED:, usable], NODES[-1])]
        best, least = None, math.inf
        for n in NODES:
            if best is not None and n > min(len(self.fitted) // 2, len(order)):
                break
            rule = _fit(self, order[:n], scale)
            worst = float((rule.spread * np.sqrt(1.0 + rule.tested)).max())
            if worst < least:
                best, least = rule, worst
            if SAFETY * worst <= 0.9 * (1.0 - INNER) * self.wanted.tolerance:
                break
        assert best is not None
        return best


class _Rule(NamedTuple):
    """Nodes, what turns f there into coordinates in which the fitted rows have unit spread, and these into results."""

    wi: np.ndarray
    wo: np.ndarray
    whitened: np.ndarray  # (nodes, k)
    weights: np.ndarray  # (k, C)
    spread: float  # largest error at a row that had no part in it, over max(unit, value) sqrt(1 + leverage)
    tested: np.ndarray  # leverage of the tested rows

    def applied(self, sample: _Known, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Integrals (rows, C), their errors, and the leverage of each."""
        values, errors, leverages = [], [], []
        size = max(1, (BLOCK << 4) // len(self.wi))
        for start in range(0, len(rows), size):
            at = sample.at(self.wi, self.wo, rows[start : start + size]) @ self.whitened
            value, leverage = at @ self.weights, np.einsum("ij,ij->i", at, at)
            scale = np.maximum(sample.wanted.unit, np.abs(value).max(axis=-1))
            errors.append((SAFETY * self.spread * np.sqrt(1.0 + leverage) + INNER * sample.wanted.tolerance) * scale)
            values.append(value)
            leverages.append(leverage)
        return np.concatenate(values), np.concatenate(errors), np.concatenate(leverages)


def _fit(sample: _Known, nodes: np.ndarray, scale: np.ndarray) -> _Rule:
    at, share = sample.nodes[:, nodes], 1.0 / scale[TESTED:, None]
    left, sizes, right = np.linalg.svd(at[TESTED:] * share, full_matrices=False)
    kept = sizes > 1e-11 * sizes[:1]
    whitened = right[kept].T / sizes[kept]
    weights = left[:, kept].T @ (sample.values[TESTED:] * share)
    tested = at[:TESTED] @ whitened
    leverage = np.square(tested).sum(axis=-1)
    misses = np.abs(tested @ weights - sample.values[:TESTED]).max(axis=-1) / scale[:TESTED]
    hat = np.minimum(np.square(left[:, kept]).sum(axis=-1), 0.99)
    rest = np.abs((at[TESTED:] @ whitened) @ weights - sample.values[TESTED:]).max(axis=-1) * share[:, 0]
    # The error at a fitted row by the fit without it is rest/(1 - hat), its leverage in that hat/(1 - hat).
    spread = float(max((misses / np.sqrt(1.0 + leverage)).max(), (rest / np.sqrt(1.0 - hat)).max()))
    wi, wo = sample.wi[nodes], sample.wo[nodes]
    return _Rule(wi, wo, (wi[:, 2:] * wo[:, 2:]) * whitened, weights, spread, leverage)


def _most_different(values: np.ndarray, most: int) -> np.ndarray:
    """Columns of (rows, columns) that differ most from combinations of those before: pivoted orthogonalisation."""
    rest, chosen = values.copy(), []
    size = np.square(rest).sum(axis=0)
    floor = 1e-28 * size.max(initial=0.0)
    for _ in range(min(most, *rest.shape)):
        column = int(size.argmax())
        if not size[column] > floor:
            break
        chosen.append(column)
        unit = rest[:, column] / math.sqrt(size[column])
        rest -= np.outer(unit, unit @ rest)
        size = np.square(rest).sum(axis=0)
    return np.array(chosen or [0])


def _candidates(rows: MaterialRows, wanted: Wanted, some: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions (k, 3): evenly spread over light and viewer, and with one of them drawn by the material."""
    u, v = lattice(CANDIDATES, 4), lattice(CANDIDATES, 2)
    wi, wo = _points(wanted.of, u[:, :2]), _points(wanted.to, u[:, 2:])
    there = rows.at(some[np.arange(CANDIDATES) % len(some)])
    drawn, fixed = (wo, wanted.to) if isinstance(wanted.of, np.ndarray) else (wi, wanted.of)
    other = wi if drawn is wo else wo
    sampled = there.sample(other, v[:, ::-1]).wi
    inside = fixed.contains(sampled) if not isinstance(fixed, np.ndarray) else np.zeros(len(sampled), bool)
    new, old = sampled[inside], other[inside]
    pairs = (old, new) if drawn is wo else (new, old)
    wi, wo = np.concatenate([wi, pairs[0]]), np.concatenate([wo, pairs[1]])
    up = (wi[:, 2] > 1e-3) & (wo[:, 2] > 1e-3)
    return (wi[up], wo[up]) if up.any() else (wi, wo)


def _points(side: Any, u: np.ndarray) -> np.ndarray:
    """Directions of a geometry, or the one direction there is."""
    if isinstance(side, np.ndarray):
        return np.broadcast_to(side[0], (len(u), 3))
    points: np.ndarray = side.points(u[:, 0], u[:, 1])[0]
    return points
