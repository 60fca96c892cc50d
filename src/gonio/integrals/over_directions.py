"""Integrals of a reflectance over directions, by adaptive quadrature in the coordinates of its own sampling."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..arrays.kinds import TOTAL, VALUE, VECTOR, with_channels
from ..base.angles import check_unit
from ..base.kernels import with_holes
from ..base.reflectance import Reflectance
from ..compile import memory
from ..errors import (
    ArrayTypeError,
    DirectionWarning,
    MissingDataWarning,
    ParameterError,
    ShapeError,
    ToleranceWarning,
    warn,
)
from ..evaluate import batch
from ..formula.direction import HORIZON, NORMAL, Direction, select, served
from ..formula.fields import Param
from ..formula.warp import cosine_hemisphere
from ..numerics.lattice import lattice
from ..numerics.quadrature import NODES, Evaluate, Integrals, Sums, cubature, in_order, of_squares, place, weighed
from . import half_vectors
from .cones import Hemisphere
from .domain import SAMPLED, Coordinates, Domain
from .peaks import GRAZING, SHARP, peaks
from .places import Places
from .sharing import Wanted, over_places

CHUNKS = (4096, 512, 64)
"""Numbers of cells that a kernel is given at a time: few, because each needs a plan of its own."""

RULED = (512, 64, 8)
"""Numbers of fixed directions that a kernel is given at a time, for rules that take hundreds of nodes for each."""

TIGHTEST = 1e-13
"""The smallest tolerance."""

TOGETHER = 128
"""Most channels that are integrated together."""

Radiance = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Radiance (n, k, 1 or C) from directions (n, k, 3), for the places (n,) of a flattened batch that they belong to."""

_SIDES = np.stack(cosine_hemisphere(*lattice(64).T[::-1]), axis=-1)
"""Directions spread over the hemisphere in proportion to the cosine."""


class Integral(NamedTuple):
    """An integral, and an estimate of its absolute error (without a channel axis: the largest of the channels)."""

    value: Any
    error: Any


def integrate(
    m: Reflectance,
    w: Any,
    tolerance: float = 1e-4,
    incident: bool = True,
    radiance: Radiance | None = None,
    error: bool = False,
) -> Any:
    """Integral over the hemisphere of f cos, times `radiance(w', index)` if given, lobe by lobe; see `albedo`.

    `incident`: whether w is the incident direction and the integral runs over wo, or the other way round. Under a
    radiance the tolerance is relative to its mean over the hemisphere. With `error` an `Integral`.
    """
    check_tolerance(tolerance)
    w = directions(w)
    shape = batch.full_shape(m, w.shape[:-1])
    memory.check((*shape, 3), np.float64, "an array of directions")
    flat, unit = in_double(w), np.ones(math.prod(w.shape[:-1]))
    if radiance is not None:
        unit = mean_radiance(radiance, len(flat))

    def direct(lobe: Reflectance, number: np.ndarray, places: Places, tolerance: float) -> Integrals:
        light = None if radiance is None else lambda there, index: radiance(there, number[index])
        return over_directions(lobe, flat[number], places, tolerance, incident, radiance=light, unit=unit[number])

    of, to = (flat, Hemisphere()) if incident else (Hemisphere(), flat)
    coloured = radiance is not None
    integrals = over_places(m, Wanted(w.shape[:-1], direct, of, to, tolerance, unit, coloured))
    absent = with_holes(np.zeros((*shape, 1)), m)  # the integrand's NaN count as 0
    hidden = np.isnan(absent).any(axis=-1).reshape(-1)
    integrals = integrals._replace(missing=np.where(hidden, 0.0, integrals.missing))
    value = integrals.value
    for weight, lobe in m.lobes():
        if lobe.is_delta:
            double = np.broadcast_to(w, (*shape, 3)).astype(float)
            index = np.arange(math.prod(shape))
            places = Places(shape, index)
            part = places.values(lobe.delta_reflectance(double))
            if radiance is not None:
                mirrored = lobe.sample(double, np.zeros(2)).wi
                owner = np.broadcast_to(np.arange(len(flat)).reshape(w.shape[:-1]), shape).reshape(-1)
                part = part * radiance(mirrored.reshape(-1, 1, 3), owner)[:, 0]
            value = value + places.values(weight) * part
    unit = np.broadcast_to(unit.reshape(w.shape[:-1]), shape).reshape(-1)
    report(integrals, tolerance * np.maximum(unit, np.abs(value).max(axis=-1, initial=0.0)))
    if len(value) == 0:
        value = np.zeros((0, m.channels or 1))
    channels = radiance is not None or m.channels is not None
    value = (value.reshape(*shape, value.shape[-1]) + absent).astype(w.dtype)
    value = value if channels else value[..., 0][()]
    return Integral(value, integrals.error.reshape(shape)[()]) if error else value


def mean_radiance(radiance: Radiance, count: int) -> np.ndarray:
    """The mean over the hemisphere (count,), weighed by the cosine, of the channel that has most."""
    around = np.broadcast_to(_SIDES, (count, *_SIDES.shape))
    mean: np.ndarray = np.abs(radiance(around, np.arange(count))).mean(axis=1).max(axis=-1)
    return mean


def check_tolerance(tolerance: float) -> None:
    """Raises ParameterError for an error of an integral that double precision does not reach, or that says nothing."""
    if not TIGHTEST <= tolerance < 1.0:
        raise ParameterError(f"tolerance={tolerance!r}: expected a number between {TIGHTEST:g} and 1, such as 1e-4")


def directions(w: Any) -> np.ndarray:
    """Directions (..., 3) as a NumPy array of floating-point numbers."""
    lib, (w,) = ops.as_arrays(w)
    if lib.name != "numpy":
        raise ArrayTypeError(f"integrals take NumPy directions; got {lib.name}; convert them first")
    if w.shape[-1:] != (3,):
        raise ShapeError(f"directions: got shape {w.shape}, expected (..., 3)")
    check_unit("directions", w)
    if w.size and (w[..., 2] <= HORIZON).all():
        text = "all directions are below the horizon, where a surface neither receives nor sends light: results are 0"
        warn(f"{text}; directions leave the surface, and z is its normal", DirectionWarning)
    return w


def in_double(w: np.ndarray) -> np.ndarray:
    """Directions (n, 3) in double precision; those typed, or of single precision, get their unit length back."""
    flat = np.ascontiguousarray(w.reshape(-1, 3), dtype=np.float64)
    length = np.sqrt((flat * flat).sum(axis=-1, keepdims=True))
    with np.errstate(invalid="ignore"):  # infinite components
        return np.where(np.abs(length - 1.0) > 1e-12, flat / length, flat)


def report(integrals: Integrals, goal: Any) -> None:
    """Warns of missing data, and of errors above the goal, at the call of a public function that called the caller."""
    missing = integrals.missing.max(initial=0.0)
    if missing > 0.0:
        text = f"{missing:.1%} of the directions of an integral hold no measured data and counted as 0"
        warn(text, MissingDataWarning)
    over = integrals.error > goal
    if over.any():
        text = (
            f"the error of {over.sum()} of {over.size} integrals may be up to {integrals.error[over].max():.2g}, more "
            f"than the tolerance asked for; ask for a larger one"
        )
        warn(text, ToleranceWarning)


def over_directions(
    m: Reflectance,
    fixed: np.ndarray,
    places: Places,
    tolerance: Any,
    incident: bool,
    domain: Domain = SAMPLED,
    radiance: Radiance | None = None,
    unit: Any = 1.0,
    side: int | None = None,
) -> Integrals:
    """Integrals (n, C) of f cos over the directions of a domain, for fixed directions (n, 3), without delta lobes.

    `tolerance`, `unit`, `side`: see `cubature`.
    """
    count = len(fixed)
    tolerance, unit = (np.broadcast_to(np.asarray(x, dtype=float), count) for x in (tolerance, unit))
    lobes = [(places.values(w), lobe) for w, lobe in m.lobes() if not lobe.is_delta]
    value, error, missing = np.zeros((count, 1)), np.zeros(count), np.zeros(count)
    for weight, lobe in lobes:
        largest = np.abs(weight).max(axis=-1)
        if not largest.any():
            continue
        goal = tolerance / (len(lobes) * np.fmax(largest, 1e-300))
        integrands = [_Integrand(lobe, fixed, places, incident, domain, radiance).of(*c) for c in _alike(lobe)]
        groups = [integrand.integrals(goal, unit, side) for integrand in integrands]
        value = value + weight * np.concatenate([g.value for g in groups], axis=-1)
        error = error + largest * np.max([g.error for g in groups], axis=0)
        missing = np.maximum(missing, np.max([g.missing for g in groups], axis=0))
    return Integrals(value, error, missing)


def _alike(lobe: Reflectance) -> Iterator[tuple[int, int]]:
    """First channels and ends of the groups that are integrated together, because their lobes are equally wide;
    (0, 0) for a lobe without channels, or of one, which lights may have more of."""
    numbers = [(field.sampled, x) for _, field, x, _ in lobe.walk() if isinstance(field, Param) and np.ndim(x)]
    count = max((x.shape[-1] for _, x in numbers), default=0)
    widths = [x for sampled, x in numbers if sampled != "mean" and x.shape[-1] > 1]
    first = 0
    for c in range(1, count):
        if c - first == TOGETHER or any((x[..., c] != x[..., first]).any() for x in widths):
            yield first, c
            first = c
    yield first, count if count > 1 else 0


class _Integrand(NamedTuple):
    """f cos of a lobe over a domain, for fixed directions (n, 3) at places, times `radiance` of the light there."""

    lobe: Reflectance
    fixed: np.ndarray
    places: Places
    incident: bool
    domain: Domain
    radiance: Radiance | None

    def of(self, first: int, last: int) -> _Integrand:
        """That of channels from `first` to before `last`; (0, 0): of all."""
        lobe, radiance = self.lobe, self.radiance
        if not last:
            return self

        def channels(value: Any) -> Any:
            return value[..., first:last] if np.ndim(value) and value.shape[-1] > 1 else value

        light = None if radiance is None else lambda there, index: channels(radiance(there, index))
        return self._replace(lobe=lobe.each(channels), radiance=light)

    def integrals(self, tolerance: np.ndarray, unit: np.ndarray, side: int | None) -> Integrals:
        """Over a part of the directions in that part's coordinates, in which its rim is no jump; but in the lobe's own
        where it is narrow and leaves at grazing: too thin then to be found in others."""
        domain, lobe = self.domain, self.lobe
        if domain.coordinates is None:
            return self.over_hemisphere(tolerance, unit, side)
        seeds, sent = peaks(lobe, self.fixed, self.places, domain)
        narrow = (np.median(seeds[..., 2:].min(axis=-1), axis=-1) < SHARP) & (self.fixed[:, 2] < GRAZING) & sent
        groups = []
        for rows in filter(len, (np.flatnonzero(narrow), np.flatnonzero(~narrow))):
            goal = len(rows), tolerance[rows], unit[rows]
            if narrow[rows[0]]:
                group = cubature(self.sums(domain.within, rows), *goal, lobe.seam, side=side)
            else:
                group = cubature(self.sums(domain.coordinates, rows), *goal, domain.seam, seeds[rows], side)
            groups.append((rows, group))
        return in_order(groups)

    def over_hemisphere(self, tolerance: np.ndarray, unit: np.ndarray, side: int | None) -> Integrals:
        """By rules in coordinates of half vectors, where the lobe has these; the rest in the lobe's own sampling.

        A finer rule is for errors that promise to shrink enough: with twice the nodes those of smooth integrands
        become their squares, and those at kinks or jumps a part.
        """
        every, groups = np.arange(len(self.fixed)), []
        finer, before = every, np.full(len(every), math.inf)
        kernel = _kernel(half_vectors.coordinates, _whole, self.incident, False)
        for nodes in half_vectors.rules(self.lobe) if self.radiance is None else ():
            if not len(finer):
                break
            found = of_squares(
                self.summed(kernel, RULED, nodes, finer, np.zeros((len(finer), 6))), half_vectors.HIGHEST[0]
            )
            goal = tolerance[finer] * np.maximum(unit[finer], np.abs(found.value).max(axis=-1))
            done, smooth = ~(found.error > goal), (found.error**2 < goal) & (found.error < 0.1 * before[finer])
            groups.append((finer[done], Integrals(*(x[done] for x in found))))
            before[finer] = np.where(done, -1.0, found.error)
            finer = finer[~done & smooth]
        left = np.flatnonzero(before >= 0.0)
        if len(left):
            sums = self.sums(self.domain.within, left)
            rest = cubature(sums, len(left), tolerance[left], unit[left], self.lobe.seam, side=side)
            groups.append((left, rest))
        return in_order(groups)

    def sums(self, coordinates: Coordinates, used: np.ndarray) -> Evaluate:
        """The function that `cubature` evaluates, for the fixed directions number `used`."""
        kernel = _kernel(coordinates, place, self.incident, self.radiance is not None)
        return lambda rows, cells: self.summed(kernel, CHUNKS, NODES, used[rows], cells)

    def summed(
        self, kernel: Callable, chunks: Sequence[int], nodes: np.ndarray, rows: np.ndarray, cells: np.ndarray
    ) -> Sums:
        """Sums over the nodes of cells (k, 6), each for the fixed direction of its number (k,)."""
        mapped = batch.full_shape(self.lobe, ()) != ()
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
        return Sums(totals, 0.0, missing)

    def _run(
        self, kernel: Callable, nodes: np.ndarray, m: Reflectance, rows: np.ndarray, cells: np.ndarray
    ) -> Sequence[np.ndarray]:
        """Sums (k, SUMS, C) over cells, and the share of each without data (k,)."""
        inputs = (self.fixed[rows][:, None], cells[:, None], nodes, self.domain.numbers[None, None])
        widths = (3, 6, nodes.shape[1], 16)
        if self.radiance is None:
            *totals, absent = batch.run(kernel, (TOTAL,) * (nodes.shape[1] - 1), m, inputs, widths)
            return np.stack([with_channels(t, 1) for t in totals], axis=1), with_channels(absent, 1).max(axis=-1)
        there, values, absent = batch.run(kernel, (VECTOR, VALUE, VALUE), m, inputs, widths)
        light = self.radiance(there, self.places.elements[rows])
        return weighed(with_channels(values, 2) * light), with_channels(absent, 2).max(axis=-1) @ NODES[:, 2]


def _whole(cell: Any, node: Any) -> tuple[tuple[Any, Any], float]:
    """The point of the unit square at a node of a rule for the whole of it, and its area per area: see `place`."""
    return (node[0], node[1]), 1.0


@cache
def _kernel(coordinates: Callable, placed: Callable, incident: bool, lit: bool) -> Callable:
    """The kernel for cells: sums over their nodes, or under light the directions and values times areas at the nodes;
    and the area without data."""

    def kernel(m: Reflectance, mean: Reflectance, w: Any, cell: Any, node: Any, numbers: Any) -> tuple:
        fixed = Direction(*w)
        u, area = placed(cell, node)
        hidden, up = served(fixed)
        there, density = coordinates(mean, up, *u, numbers)
        lost = (there.z <= HORIZON) | hidden
        safe = select(lost, NORMAL, there)
        pdf = density(safe)
        usable = pdf > 0.0
        f = m.formula(up, safe) if incident else m.formula(safe, up)
        value = ops.where(lost | ~usable, 0.0, f * safe.z / ops.where(usable, pdf, 1.0))
        nan = 0.0 * (w[0] + w[1] + w[2])
        missing = value != value
        value = area * ops.where(missing, 0.0, value) + nan
        absent = area * ops.where(missing & (nan == 0.0), 1.0, 0.0)
        if lit:
            return select(usable & ~lost, safe, NORMAL), value, absent  # lights are not asked about NaN
        return (*(weight * value for weight in node[2:]), node[2] * absent)

    return kernel
