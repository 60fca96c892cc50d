"""Integrals of a reflectance over directions, by adaptive quadrature in the coordinates of its own sampling."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..arrays.kinds import TOTAL, VALUE, VECTOR, with_channels
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..base.sides import sign_of_light
from ..evaluate import batch
from ..evaluate.tracing import Task
from ..formula import tree
from ..formula.direction import BEHIND, HORIZON, NORMAL, Direction, select, served
from ..formula.fields import Channels, Numbers
from ..numerics.quadrature import (
    NODES,
    CellSums,
    Evaluate,
    Goal,
    Integrals,
    cubature,
    in_order,
    of_squares,
    place,
    weighed,
)
from . import half_vectors
from .by_polar_angle import Direct, by_polar_angle, is_even
from .domain import SAMPLED, Coordinates, Domain
from .peaks import GRAZING, SHARP, peaks
from .places import Places

CHUNKS = (4096, 512, 64)
"""Numbers of cells that a kernel is given at a time: few, because each needs a plan of its own."""

RULED = (512, 64, 8)
"""Numbers of fixed directions that a kernel is given at a time, for rules that take hundreds of nodes for each."""

TOGETHER = 128
"""Most channels that are integrated together."""

Radiance = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Radiance (n, k, 1 or C) from directions (n, k, 3), for the places (n,) of a flattened batch that they belong to."""


class Over(NamedTuple):
    """What is integrated over: the directions of a domain, of the viewer where the fixed ones are `incident`, else of
    light, whose `radiance` is a factor then."""

    incident: bool
    domain: Domain = SAMPLED
    radiance: Radiance | None = None


def over_directions(m: Reflectance, fixed: np.ndarray, places: Places, over: Over, goal: Goal) -> Integrals:
    """Integrals (n, C) of f cos over directions, for fixed ones (n, 3) at places, without delta lobes."""
    count = len(fixed)
    tolerance, unit = (np.broadcast_to(np.asarray(x, dtype=float), count) for x in goal[:2])
    goal = Goal(tolerance, unit, goal.side)
    lobes = [(places.values(w), lobe) for w, lobe in m.lobes() if not lobe.is_delta]
    value, error, missing = np.zeros((count, 1)), np.zeros(count), np.zeros(count)
    for weight, lobe in lobes:
        largest = np.abs(weight).max(axis=-1)
        if not largest.any():
            continue
        of_lobe = goal._replace(tolerance=goal.tolerance / (len(lobes) * np.fmax(largest, 1e-300)))
        whole = _Integrand(lobe, fixed, places, over)
        of_part = None
        if count and over.domain is SAMPLED and over.radiance is None:
            of_part = lobe._collected(fixed, over.incident, float(of_lobe.tolerance.min()), whole.each)
        if of_part is None:
            of_part = _beside(part.integrals(of_lobe) for part in whole.alike())
        value = value + weight * of_part.value
        error = error + largest * of_part.error
        missing = np.maximum(missing, of_part.missing)
    return Integrals(value, error, missing)


def _beside(groups: Iterable[Integrals]) -> Integrals:
    """Integrals of all channels, of those of groups of them."""
    values, errors, missing = zip(*groups, strict=True)
    return Integrals(np.concatenate(values, axis=-1), np.max(errors, axis=0), np.max(missing, axis=0))


def _alike(lobe: Reflectance) -> Iterator[tuple[int, int]]:
    """First channels and ends of the groups that are integrated together, because their lobes are equally wide;
    (0, 0) for a lobe without channels, or of one, which lights may have more of."""
    plain = ((f, x) for _, f, x, _ in tree.walk(lobe) if isinstance(f, Numbers) and not isinstance(f, Channels))
    numbers = [(getattr(f, "sampled", "mean"), x) for f, x in plain if np.ndim(x)]
    count = max((x.shape[-1] for _, x in numbers), default=0)
    widths = [x for sampled, x in numbers if sampled != "mean" and x.shape[-1] > 1]
    first = 0
    for c in range(1, count):
        if c - first == TOGETHER or any((x[..., c] != x[..., first]).any() for x in widths):
            yield first, c
            first = c
    yield first, count if count > 1 else 0


class _Integrand(NamedTuple):
    """f cos of a lobe over directions, for fixed ones (n, 3) at places."""

    lobe: Reflectance
    fixed: np.ndarray
    places: Places
    over: Over

    def of(self, first: int, last: int) -> _Integrand:
        """That of channels from `first` to before `last`; (0, 0): of all."""
        lobe, radiance = self.lobe, self.over.radiance
        if not last:
            return self

        def channels(value: Any) -> Any:
            return value[..., first:last] if np.ndim(value) and value.shape[-1] > 1 else value

        light = None if radiance is None else lambda there, index: channels(radiance(there, index))
        only = tree.rebuilt(lobe, lambda _, field, value: channels(value))
        return self._replace(lobe=only, over=self.over._replace(radiance=light))

    def alike(self) -> Iterator[_Integrand]:
        """Those of the groups of channels that are integrated together."""
        return (self.of(*channels) for channels in _alike(self.lobe))

    def each(self, fixed: np.ndarray, goal: float) -> Integrals:
        """Over the hemisphere for other fixed directions, each by itself, of all channels of a lobe without maps."""
        goals, unit = np.full(len(fixed), goal), np.ones(len(fixed))
        return _beside(part.at(None)(fixed, goals, unit) for part in self.alike())

    def integrals(self, goal: Goal) -> Integrals:
        """Over a part of the directions in that part's coordinates, in which its rim is no jump; but in the lobe's own
        where it is narrow and leaves at grazing: too thin then to be found in others."""
        domain, lobe = self.over.domain, self.lobe
        if domain.coordinates is None:
            if len(self.fixed) > 1 and self.over.radiance is None and not map_shape(lobe) and is_even(lobe):
                return by_polar_angle(lobe, self.fixed, goal.tolerance, goal.unit, self.at(goal.side))
            return self.over_hemisphere(goal)
        seeds, sent = peaks(lobe, self.fixed, self.places, domain)
        narrow = (np.median(seeds[..., 2:].min(axis=-1), axis=-1) < SHARP) & (self.fixed[:, 2] < GRAZING) & sent
        groups = []
        for rows in filter(len, (np.flatnonzero(narrow), np.flatnonzero(~narrow))):
            here = len(rows), goal.at(rows)
            if narrow[rows[0]]:
                group = cubature(self.sums(domain.within, rows), *here, lobe.hints.seam)
            else:
                group = cubature(self.sums(domain.coordinates, rows), *here, domain.seam, seeds[rows])
            groups.append((rows, group))
        return in_order(groups)

    def at(self, side: int | None) -> Direct:
        """`over_hemisphere` for other fixed directions."""
        return lambda fixed, goal, unit: self._replace(fixed=fixed).over_hemisphere(Goal(goal, unit, side))

    def over_hemisphere(self, goal: Goal) -> Integrals:
        """By rules in coordinates of half vectors, where the lobe has these; the rest in the lobe's own sampling.

        A finer rule is for errors that promise to shrink enough: with twice the nodes those of smooth integrands
        become their squares, and those at kinks or jumps a part.
        """
        every, groups = np.arange(len(self.fixed)), []
        finer, before = every, np.full(len(every), math.inf)
        kernel = _kernel(half_vectors.coordinates, _whole, self.over.incident, False)
        for nodes in half_vectors.rules(self.lobe) if self.over.radiance is None else ():
            if not len(finer):
                break
            integrals = of_squares(
                self.summed(kernel, RULED, nodes, finer, np.zeros((len(finer), 6))), half_vectors.HIGHEST[0]
            )
            allowed = goal.tolerance[finer] * np.maximum(goal.unit[finer], np.abs(integrals.value).max(axis=-1))
            done = ~(integrals.error > allowed)
            smooth = (integrals.error**2 < allowed) & (integrals.error < 0.1 * before[finer])
            groups.append((finer[done], Integrals(*(x[done] for x in integrals))))
            before[finer] = np.where(done, -1.0, integrals.error)
            finer = finer[~done & smooth]
        left = np.flatnonzero(before >= 0.0)
        if len(left):
            sums = self.sums(self.over.domain.within, left)
            rest = cubature(sums, len(left), goal.at(left), self.lobe.hints.seam)
            groups.append((left, rest))
        return in_order(groups)

    def sums(self, coordinates: Coordinates, used: np.ndarray) -> Evaluate:
        """The function that `cubature` evaluates, for the fixed directions number `used`."""
        across = sign_of_light(self.lobe) < 0.0
        kernel = _kernel(coordinates, place, self.over.incident, self.over.radiance is not None, across)
        return lambda rows, cells: self.summed(kernel, CHUNKS, NODES, used[rows], cells)

    def summed(
        self, kernel: Callable, chunks: Sequence[int], nodes: np.ndarray, rows: np.ndarray, cells: np.ndarray
    ) -> CellSums:
        """Sums over the nodes of cells (k, 6), each for the fixed direction of its number (k,)."""
        mapped = map_shape(self.lobe) != ()
        parts, start = [], 0
        while start < len(rows):
            left = len(rows) - start
            size = next((n for n in chunks if n <= left), chunks[-1])
            here, square = rows[start : start + size], cells[start : start + size]
            start += size
            if mapped:
                parts.append(self._run(kernel, nodes, self.places.of(here).material(self.lobe), here, square))
            else:
                filled = np.arange(size) % len(here)
                part = self._run(kernel, nodes, self.lobe, here[filled], square[filled])
                parts.append([x[: len(here)] for x in part])
        totals, missing = (np.concatenate(x) for x in zip(*parts, strict=True))
        return CellSums(totals, 0.0, missing)

    def _run(
        self, kernel: Callable, nodes: np.ndarray, m: Reflectance, rows: np.ndarray, cells: np.ndarray
    ) -> Sequence[np.ndarray]:
        """Sums (k, SUMS, C) over cells, and the share of each without data (k,)."""
        inputs = (self.fixed[rows][:, None], cells[:, None], nodes, self.over.domain.numbers[None, None])
        widths = (3, 6, nodes.shape[1], 16)
        if self.over.radiance is None:
            *totals, absent = batch.run(Task(kernel, (TOTAL,) * (nodes.shape[1] - 1), widths), m, inputs)
            return np.stack([with_channels(t, 1) for t in totals], axis=1), with_channels(absent, 1).max(axis=-1)
        there, values, absent = batch.run(Task(kernel, (VECTOR, VALUE, VALUE), widths), m, inputs)
        light = self.over.radiance(there, self.places.elements[rows])
        return weighed(with_channels(values, 2) * light), with_channels(absent, 2).max(axis=-1) @ NODES[:, 2]


def _whole(cell: Any, node: Any) -> tuple[tuple[Any, Any], float]:
    """The point of the unit square at a node of a rule for the whole of it, and its area per area: see `place`."""
    return (node[0], node[1]), 1.0


def over(w: Direction) -> Direction:
    """w, turned half a turn about the y axis."""
    return Direction(-w.x, w.y, -w.z)


@cache
def _kernel(coordinates: Callable, placed: Callable, incident: bool, lit: bool, across: bool = False) -> Callable:
    """The kernel for cells: sums over their nodes, or under light the directions and values times areas at the nodes;
    and the area without data. `across`: of a lobe across the surface; light in front then has the viewer behind."""

    def kernel(m: Reflectance, mean: Reflectance, w: Any, cell: Any, node: Any, numbers: Any) -> tuple:
        fixed = Direction(*w)
        u, area = placed(cell, node)
        hidden, up = served(fixed)
        if across:
            there, density = coordinates(mean.turned(True) if incident else mean, up, *u, numbers)
            lost = (there.z >= -HORIZON) | hidden
            safe = select(lost, BEHIND, there)
        else:
            there, density = coordinates(mean, up, *u, numbers)
            lost = (there.z <= HORIZON) | hidden
            safe = select(lost, NORMAL, there)
        pdf = density(safe)
        usable = pdf > 0.0
        if across and incident:
            f = m.formula(over(up), over(safe))
        else:
            f = m.formula(up, safe) if incident else m.formula(safe, up)
        cos = -safe.z if across else safe.z
        value = ops.where(lost | ~usable, 0.0, f * cos / ops.where(usable, pdf, 1.0))
        nan = 0.0 * (w[0] + w[1] + w[2])
        missing = value != value
        value = area * ops.where(missing, 0.0, value) + nan
        absent = area * ops.where(missing & (nan == 0.0), 1.0, 0.0)
        if lit:
            return (
                select(usable & ~lost, safe, BEHIND if across else NORMAL),
                value,
                absent,
            )  # lights are not asked about NaN
        return (*(weight * value for weight in node[2:]), node[2] * absent)

    return kernel
