"""Integrals of materials with maps: those of a few places, from which the others follow.

An integral is linear in f, whatever its directions, cones and lights. So the integrals of all places are known from
those of a few wherever f is a combination, the same one for all directions, of f at these. Two ways find it:

- `_by_factors`: f is written as a sum of products, a number of the place times a function of the directions (all
  kernel models, albedos, weights). Exact: as many places as products decide.
- `_by_nodes`: f at some pairs of directions (nodes), chosen among many by how much they differ between places, is
  fitted to the integrals of some hundred places: nodes and weights of a rule for this map alone. Its error is measured
  at places that had no part in the fit, and at each that had by the fit without it. It grows with a place's leverage:
  how far its values at the nodes lie from those of the fitted. Places whose error may be too large join these, or are
  integrated by themselves.

Source   derived here, after empirical interpolation: Barrault, Maday, Nguyen & Patera 2004, C. R. Acad. Sci. Paris
         Ser. I 339:667 (nodes and weights from the functions themselves).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..base.reflectance import Reflectance
from ..evaluate import batch
from ..evaluate.factors import factors
from ..formula.fields import Channels
from ..numerics.lattice import lattice
from ..numerics.quadrature import Integrals
from .places import Places

BLOCK = 1 << 16
"""Places whose integrals are combined together."""

SPREAD = 4096
"""Places, beside those with the least and the largest numbers, among which the few are chosen."""

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


class Wanted(NamedTuple):
    """The integrals wanted: of one batch of directions (or of none: shape ()) with each place of a map.

    direct      (material, number of the direction for each place, places, tolerance) -> Integrals: one by one
    of, to      a geometry, or directions (n, 3), for light and viewer
    tolerance   absolute, times the larger of `unit` (n,) and the value
    coloured    whether lights have channels
    """

    shape: tuple[int, ...]
    direct: Callable[[Reflectance, np.ndarray, Places, Any], Integrals]
    of: Any
    to: Any
    tolerance: float
    unit: np.ndarray
    coloured: bool = False

    def only(self, k: int) -> Wanted:
        """The integrals for one of the directions."""

        def direct(m: Reflectance, number: np.ndarray, places: Places, tolerance: Any) -> Integrals:
            return self.direct(m, number + k, places, tolerance)

        of, to = (x[k : k + 1] if isinstance(x, np.ndarray) else x for x in (self.of, self.to))
        return self._replace(shape=(), direct=direct, of=of, to=to, unit=self.unit[k : k + 1])


def over_places(m: Reflectance, wanted: Wanted) -> Integrals:
    """Integrals (k, C) for all elements of the flattened batch of directions and places; NaN at places with holes."""
    shape = batch.full_shape(m, wanted.shape)
    if not batch.full_shape(m, ()):
        number = np.arange(len(wanted.unit))
        return wanted.direct(m, number, Places(shape, number), wanted.tolerance)
    lobes = list(m.lobes())
    share = max(1, sum(not lobe.is_delta for _, lobe in lobes))
    value: np.ndarray = np.zeros((*shape, 1))
    error, missing = np.zeros(shape), np.zeros(shape)
    for weight, lobe in lobes:
        w = np.abs(np.asarray(weight, dtype=float))
        largest = np.fmax.reduce(w, axis=None, initial=0.0)
        if largest == 0.0:
            continue
        goal = wanted._replace(tolerance=wanted.tolerance / (share * largest))
        part = _of_lobe(lobe, goal)
        value = value + weight * part.value
        error = error + (w.max(axis=-1) if w.ndim else w) * part.error
        missing = np.maximum(missing, part.missing)
    return Integrals(
        value.reshape(-1, value.shape[-1]),
        np.broadcast_to(error, shape).reshape(-1),
        np.broadcast_to(missing, shape).reshape(-1),
    )


def _of_lobe(lobe: Reflectance, wanted: Wanted) -> Integrals:
    """Integrals of a lobe: value (..., C), error and missing (...), for the batch of directions and its own places."""
    shape, own = batch.full_shape(lobe, wanted.shape), batch.full_shape(lobe, ())
    deep = len(shape)
    axes = [(1,) * (deep - len(x)) + x for x in (wanted.shape, own)]
    apart = all(1 in pair for pair in zip(*axes, strict=True))
    plain = not lobe.is_delta and not any(isinstance(field, Channels) for _, field, _, _ in lobe.walk())
    if math.prod(own) <= 1 or not apart or not plain:
        number = np.broadcast_to(np.arange(math.prod(wanted.shape)).reshape(wanted.shape), shape).reshape(-1)
        found = wanted.direct(lobe, number, Places(shape, np.arange(len(number))), wanted.tolerance)
        return Integrals(found.value.reshape(*shape, -1), found.error.reshape(shape), found.missing.reshape(shape))
    order = [axis for pair in zip(range(deep), range(deep, 2 * deep), strict=True) for axis in pair]

    def arranged(x: np.ndarray) -> np.ndarray:
        """(directions, places, ...) in the shape of the batch."""
        rest = x.shape[2:]
        x = x.reshape(*axes[0], *axes[1], *rest)
        return x.transpose(*order, *range(2 * deep, x.ndim)).reshape(*shape, *rest)

    return Integrals(*map(arranged, _of_maps(lobe, own, wanted)))


def _of_maps(lobe: Reflectance, own: tuple[int, ...], wanted: Wanted) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value (directions, places, C), error and missing (directions, places). Channels that differ by numbers on maps
    alone are treated as places of a map of one channel."""
    channels, places = batch.channels(lobe) or 1, math.prod(own)
    shared = [x for x in lobe.leaves() if np.ndim(x) == 1 and len(x) > 1]
    if not shared and not wanted.coloured:

        def flat(x: Any) -> Any:
            return np.broadcast_to(x, (*own, channels)).reshape(-1, 1) if np.ndim(x) > 1 else x

        value, error, missing = _of_rows(lobe.each(flat), places * channels, wanted)
        shape = len(value), places, channels
        return value.reshape(shape), error.reshape(shape).max(axis=-1), missing.reshape(shape).max(axis=-1)
    parts = []
    for c in range(channels):

        def of_channel(x: Any, c: int = c) -> Any:
            if np.ndim(x) == 0:
                return x
            x = x[..., c : c + 1] if x.shape[-1] > 1 else x
            return np.broadcast_to(x, (*own, 1)).reshape(-1, 1) if x.ndim > 1 else x

        value, error, missing = _of_rows(lobe.each(of_channel), places, wanted)
        parts.append((value[..., c : c + 1] if channels > 1 and value.shape[-1] > 1 else value, error, missing))
    values, errors, absent = zip(*parts, strict=True)
    return np.concatenate(values, axis=-1), np.max(errors, axis=0), np.max(absent, axis=0)


def _of_rows(m: Reflectance, count: int, wanted: Wanted) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value (directions, count, C), error and missing (directions, count), for maps (length, 1)."""
    rows = _Rows(m, count)
    exact = factors(m)
    if exact is not None and len(exact) < count:
        return _by_factors(rows, [np.broadcast_to(x, count) for x in exact], wanted)
    groups = [_by_nodes(rows, wanted.only(k)) for k in range(len(wanted.unit))]
    value, error, missing = (np.stack(x) for x in zip(*groups, strict=True))
    return value, error, missing


class _Rows(NamedTuple):
    """A material of one channel with maps (length, 1)."""

    m: Reflectance
    length: int

    def at(self, rows: Any) -> Reflectance:
        """The material at some rows."""
        return self.m.each(lambda x: x[rows] if np.ndim(x) > 1 else x)

    def integrals(self, rows: np.ndarray, wanted: Wanted, share: float) -> Integrals:
        """Integrals (directions, rows[, C]) to a share of the tolerance, one by one."""
        number = np.repeat(np.arange(len(wanted.unit)), len(rows))
        material, places = self.at(np.tile(rows, len(wanted.unit))), Places((len(number),), np.arange(len(number)))
        found = wanted.direct(material, number, places, share * wanted.tolerance)
        shape = len(wanted.unit), len(rows)
        return Integrals(found.value.reshape(*shape, -1), found.error.reshape(shape), found.missing.reshape(shape))

    def whole(self) -> np.ndarray:
        """The numbers of the rows without holes."""
        ok = np.ones(self.length, bool)
        for x in self.m.holed():
            ok &= np.isfinite(x[:, 0]) if np.ndim(x) > 1 else bool(np.isfinite(x).all())
        return np.flatnonzero(ok)

    def extremes(self) -> list[int]:
        """Rows with the least and the largest numbers."""
        maps = (x[:, 0] for x in self.m.leaves() if np.ndim(x) > 1)
        return [row for x in maps for row in _extremes(x)]


def _extremes(x: np.ndarray) -> tuple[int, int]:
    low, high = int(x.argmin()), int(x.argmax())
    return (
        (low, high)
        if np.isfinite(x[[low, high]]).all()
        else (int(_filled(x, 1).argmin()), int(_filled(x, -1).argmax()))
    )


def _filled(x: np.ndarray, sign: int) -> np.ndarray:
    return np.where(np.isfinite(x), x, sign * np.inf)


def _by_factors(rows: _Rows, columns: list[np.ndarray], wanted: Wanted) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    extra = [row for x in columns for row in _extremes(x)]
    spread = np.linspace(0, rows.length - 1, min(rows.length, SPREAD)).astype(int)
    sample, share = np.unique(np.concatenate([spread, np.array(extra, int)])), 1.0
    while True:
        table = np.stack([x[sample] for x in columns], axis=-1)
        sample, table = sample[np.isfinite(table).all(axis=-1)], table[np.isfinite(table).all(axis=-1)]
        few = sample[_independent(table)]
        found = rows.integrals(few, wanted, share / max(1.5 * len(few), 1.0))
        value, error, misfit = _combined(columns, few, found)
        goal = wanted.tolerance * np.maximum(wanted.unit[:, None], np.abs(value).max(axis=-1))
        worst = float(np.nanmax(error / goal, initial=0.0))
        if len(misfit):
            sample = np.concatenate([few, misfit[:: max(1, len(misfit) // SPREAD)]])
        elif worst > 1.0 and share > 1e-4:
            share *= 0.5 / worst
        else:
            break
    missing = np.broadcast_to(found.missing.max(axis=-1, initial=0.0)[:, None], error.shape)
    return value, np.nan_to_num(error), missing


def _independent(table: np.ndarray) -> list[int]:
    """Rows that others are combinations of, with small coefficients: Gauss's elimination with the largest pivots."""
    rest = table / np.maximum(np.abs(table).max(axis=0, initial=0.0), 1e-300)
    few: list[int] = []
    for _ in range(min(rest.shape)):
        row, column = np.unravel_index(np.abs(rest).argmax(), rest.shape)
        pivot = rest[row, column]
        if abs(pivot) < 1e-12:
            break
        few.append(int(row))
        rest = rest - np.outer(rest[:, column], rest[row] / pivot)
    return few


def _combined(
    columns: list[np.ndarray], few: np.ndarray, found: Integrals
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values and errors of all rows from those of a few, and the numbers of rows that are no combination of these."""
    count, directions = len(columns[0]), len(found.value)
    value, error = np.empty((directions, count, found.value.shape[-1])), np.empty((directions, count))
    table = np.stack([x[few] for x in columns], axis=-1)
    scale = np.maximum(np.abs(table).max(axis=0, initial=0.0), 1e-300)
    inverse = np.linalg.pinv(table / scale, rcond=1e-14) if len(few) else np.zeros((len(columns), 0))
    misfit = []
    for start in range(0, count, BLOCK):
        part = slice(start, start + BLOCK)
        here = np.stack([x[part] for x in columns], axis=-1) / scale
        weights = here @ inverse
        if len(few) < len(columns):
            misfit.append(start + np.flatnonzero((np.abs(here - weights @ (table / scale)) > 1e-9).any(axis=-1)))
        for k in range(directions):
            value[k, part] = weights @ found.value[k]
            error[k, part] = np.abs(weights) @ found.error[k]
    return value, error, np.concatenate(misfit) if misfit else np.zeros(0, int)


def _by_nodes(rows: _Rows, wanted: Wanted) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value (count, C), error and missing (count,), for one direction."""
    rng, order = np.random.default_rng(0), rows.whole()
    value, error, missing = np.full((rows.length, 1), np.nan), np.zeros(rows.length), np.zeros(rows.length)

    def alone(these: np.ndarray) -> None:
        nonlocal value
        found = rows.integrals(these, wanted, 1.0)
        value = np.broadcast_to(value, (rows.length, found.value.shape[-1])).copy()
        value[these], error[these], missing[these] = found.value[0], found.error[0], found.missing[0]

    order = rng.permutation(order)
    if len(order) <= 2 * (FITTED + TESTED):
        alone(order)
        return value, error, missing
    tested, order = order[:TESTED], order[TESTED:]
    known = _Known(rows, wanted, tested)
    known.add(np.unique(np.concatenate([order[:FITTED], np.array(rows.extremes(), int)])))
    for these in (order[:SPREAD], order):
        while True:
            value_here, error_here, leverage = known.rule().applied(known, these)
            goal = wanted.tolerance * np.maximum(wanted.unit, np.abs(value_here).max(axis=-1))
            bad = np.flatnonzero(~(error_here <= goal))
            if len(bad) * (len(order) / len(these)) <= ALONE or len(known.fitted) >= MOST:
                break
            worst = bad[leverage[bad].argsort()[-FITTED // 2 :]]
            known.add(these[np.union1d(worst, rng.choice(bad, min(len(bad), len(known.fitted)), replace=False))])
    value = np.full((rows.length, value_here.shape[-1]), np.nan)
    value[order], error[order], missing[order] = value_here, error_here, known.missing
    value[known.numbers] = known.values
    error[known.numbers] = SAFETY * known.errors  # estimates of adaptive integrals are now and then a little low
    if len(bad):
        alone(order[bad])
    return value, error, missing


class _Known:
    """Rows whose integrals are known, first those that test a rule and then those it is fitted to, with f there at
    pairs of directions that may become its nodes."""

    def __init__(self, rows: _Rows, wanted: Wanted, tested: np.ndarray):
        self.rows, self.wanted = rows, wanted
        self.wi, self.wo = _candidates(rows, wanted, tested)
        self.numbers = np.zeros(0, int)
        self.add(tested)

    def add(self, new: np.ndarray) -> None:
        """Integrate further rows."""
        new = np.setdiff1d(new, self.numbers)
        found = self.rows.integrals(new, self.wanted, INNER)
        nodes = self.at(self.wi, self.wo, new) * (self.wi[:, 2] * self.wo[:, 2])
        if not len(self.numbers):
            self.values, self.errors, self.nodes, self.missing = found.value[0], found.error[0], nodes, 0.0
        else:
            self.values = np.concatenate([self.values, found.value[0]])
            self.errors = np.concatenate([self.errors, found.error[0]])
            self.nodes = np.concatenate([self.nodes, nodes])
        self.missing = max(self.missing, float(found.missing.max(initial=0.0)))
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

    def applied(self, known: _Known, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Integrals (rows, C), their errors, and the leverage of each."""
        values, errors, leverages = [], [], []
        size = max(1, (BLOCK << 4) // len(self.wi))
        for start in range(0, len(rows), size):
            at = known.at(self.wi, self.wo, rows[start : start + size]) @ self.whitened
            value, leverage = at @ self.weights, np.einsum("ij,ij->i", at, at)
            scale = np.maximum(known.wanted.unit, np.abs(value).max(axis=-1))
            errors.append((SAFETY * self.spread * np.sqrt(1.0 + leverage) + INNER * known.wanted.tolerance) * scale)
            values.append(value)
            leverages.append(leverage)
        return np.concatenate(values), np.concatenate(errors), np.concatenate(leverages)


def _fit(known: _Known, nodes: np.ndarray, scale: np.ndarray) -> _Rule:
    at, share = known.nodes[:, nodes], 1.0 / scale[TESTED:, None]
    left, sizes, right = np.linalg.svd(at[TESTED:] * share, full_matrices=False)
    kept = sizes > 1e-11 * sizes[:1]
    whitened = right[kept].T / sizes[kept]
    weights = left[:, kept].T @ (known.values[TESTED:] * share)
    tested = at[:TESTED] @ whitened
    leverage = np.square(tested).sum(axis=-1)
    misses = np.abs(tested @ weights - known.values[:TESTED]).max(axis=-1) / scale[:TESTED]
    own = np.minimum(np.square(left[:, kept]).sum(axis=-1), 0.99)
    rest = np.abs((at[TESTED:] @ whitened) @ weights - known.values[TESTED:]).max(axis=-1) * share[:, 0]
    # The error at a fitted row by the fit without it is rest/(1 - own), its leverage in that own/(1 - own).
    spread = float(max((misses / np.sqrt(1.0 + leverage)).max(), (rest / np.sqrt(1.0 - own)).max()))
    wi, wo = known.wi[nodes], known.wo[nodes]
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


def _candidates(rows: _Rows, wanted: Wanted, some: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions (k, 3): evenly spread over light and viewer, and with one of them drawn by the material."""
    u, v = lattice(CANDIDATES, 4), lattice(CANDIDATES, 2)
    wi, wo = _points(wanted.of, u[:, :2]), _points(wanted.to, u[:, 2:])
    there = rows.at(some[np.arange(CANDIDATES) % len(some)])
    drawn, fixed = (wo, wanted.to) if isinstance(wanted.of, np.ndarray) else (wi, wanted.of)
    given = wi if drawn is wo else wo
    sampled = there.sample(given, v[:, ::-1]).wi
    inside = fixed.contains(sampled) if not isinstance(fixed, np.ndarray) else np.zeros(len(sampled), bool)
    new, old = sampled[inside], given[inside]
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
