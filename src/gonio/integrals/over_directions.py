"""Integrals of a reflectance over directions, by adaptive quadrature in the coordinates of its own sampling."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..arrays.kinds import TOTAL, VALUE, VECTOR
from ..base.kernels import with_holes
from ..base.reflectance import Reflectance
from ..compile import memory
from ..errors import ArrayTypeError, MissingDataWarning, ShapeError, ToleranceWarning
from ..evaluate import batch
from ..formula.direction import HORIZON, NORMAL, Direction, select
from ..numerics.lattice import lattice
from ..numerics.quadrature import NODES, Found, Sums, cubature, place, weighed

CHUNKS = (4096, 512, 64)
"""How many cells a kernel is given at a time: always the same few numbers, because each needs a plan of its own."""

TOGETHER = 8
"""How many channels are integrated together at most."""

Radiance = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Radiance (n, k, 1 or C) from directions (n, k, 3), for the places (n,) of a flattened batch that they belong to."""


class Integral(NamedTuple):
    """An integral, and an estimate of its absolute error (without a channel axis: the largest of the channels)."""

    value: Any
    error: Any


def integrate(
    m: Reflectance, w: Any, tolerance: float = 1e-4, incident: bool = True, radiance: Radiance | None = None
) -> Any:
    """Integral over the hemisphere of f cos, times `radiance(w', index)` if given, lobe by lobe; see `albedo`.

    `incident`: whether w is the incident direction and the integral runs over wo, or the other way round. Under a
    radiance the tolerance is relative to its mean over the hemisphere.
    """
    return integral_over(m, w, tolerance, incident, radiance).value


def integral_over(m: Reflectance, w: Any, tolerance: float, incident: bool, radiance: Radiance | None) -> Integral:
    w = directions(w)
    shape = batch.full_shape(m, w.shape[:-1])
    memory.check((*shape, 3), np.float64, "an array of directions")
    flat = in_double(np.broadcast_to(w, (*shape, 3)))
    index = np.arange(len(flat))
    unit: Any = 1.0
    if radiance is not None:
        around = np.broadcast_to(_SIDES, (len(flat), *_SIDES.shape))
        unit = np.abs(radiance(around, index)).mean(axis=1).max(axis=-1)
    found = over_directions(m, flat, Place(shape, index), tolerance, incident, radiance=radiance, unit=unit)
    value, absent = found.value, with_holes(np.zeros((*shape, 1)), m)  # the integrand's NaN count as 0
    found = found._replace(missing=np.where(np.isnan(absent).any(axis=-1).reshape(-1), 0.0, found.missing))
    for weight, lobe in m.lobes():
        if lobe.is_delta:
            part = of_places(lobe.delta_reflectance(np.broadcast_to(w, (*shape, 3)).astype(float)), shape, index)
            if radiance is not None:
                mirrored = lobe.sample(np.broadcast_to(w, (*shape, 3)).astype(float), np.zeros(2)).wi
                part = part * radiance(mirrored.reshape(-1, 1, 3), index)[:, 0]
            value = value + of_places(weight, shape, index) * part
    report(found, tolerance * np.maximum(unit, np.abs(value).max(axis=-1, initial=0.0)), stacklevel=4)
    if len(flat) == 0:
        value = np.zeros((0, max((np.shape(v)[-1] for v in m.leaves() if np.ndim(v)), default=1)))
    channels = radiance is not None or any(getattr(v, "ndim", 0) for v in m.leaves())
    value = (value.reshape(*shape, value.shape[-1]) + absent).astype(w.dtype)
    return Integral(value if channels else value[..., 0][()], found.error.reshape(shape)[()])


def directions(w: Any) -> np.ndarray:
    """Directions (..., 3) as a NumPy array of floating-point numbers."""
    lib, (w,) = ops.as_arrays(w)
    if lib.name != "numpy":
        raise ArrayTypeError(f"integrals take NumPy directions; got {lib.name}; convert them first")
    if w.shape[-1:] != (3,):
        raise ShapeError(f"directions: got shape {w.shape}, expected (..., 3)")
    return w


def in_double(w: np.ndarray) -> np.ndarray:
    """Directions (n, 3) in double precision; those of single precision get their unit length back."""
    flat = w.reshape(-1, 3)
    if w.dtype == np.float64:
        return np.ascontiguousarray(flat)
    flat = flat.astype(np.float64)
    return flat / np.sqrt((flat * flat).sum(axis=-1, keepdims=True))


def report(found: Found, goal: Any, stacklevel: int) -> None:
    """Warns of missing data, and of errors that are larger than what was asked for."""
    missing = found.missing.max(initial=0.0)
    if missing > 0.0:
        warnings.warn(
            f"{missing:.1%} of the directions of an integral hold no measured data and counted as 0",
            MissingDataWarning,
            stacklevel=stacklevel,
        )
    over = found.error > goal
    if over.any():
        worst = found.error[over].max()
        warnings.warn(
            f"the error of {over.sum()} of {over.size} integrals may be up to {worst:.2g}, more than the tolerance "
            f"asked for; ask for a larger one",
            ToleranceWarning,
            stacklevel=stacklevel,
        )


class Place(NamedTuple):
    """Which elements `of` (n,) a flattened batch of a material with maps are meant."""

    shape: tuple[int, ...]
    of: np.ndarray


def texels(m: Reflectance, shape: tuple[int, ...], index: np.ndarray) -> Reflectance:
    """The material at elements of a flattened batch, to meet directions (n, k, 3)."""
    found = batch.texels(m, shape, index)
    assert isinstance(found, Reflectance)
    return found


def of_places(value: Any, shape: tuple[int, ...], index: np.ndarray) -> np.ndarray:
    """A weight or a reflectance, a number or (...[, C]), at elements of a flattened batch: (n or 1, C or 1)."""
    value = np.asarray(value, dtype=float)
    if value.ndim <= 1 and value.shape != shape:
        return value.reshape(1, -1)
    if value.ndim == len(shape):
        value = value[..., None]
    return np.broadcast_to(value, (*shape, value.shape[-1])).reshape(-1, value.shape[-1])[index]


Coordinates = Callable[..., tuple[Direction, Callable[[Direction], Any]]]
"""Coordinates on directions, for kernels: `(mean, known, u0, u1, numbers)` gives the direction for a point of the unit
square, and a function that gives the density [1/sr] at a direction, 0 for one that does not count."""


class Domain(NamedTuple):
    """Directions to integrate over: all (`SAMPLED`), or a part, with coordinates of its own.

    within      a lobe's own sampling, with density 0 outside
    own         the part's coordinates
    numbers     (16,), for both
    seam        of `own`
    contains    whether directions (..., 3) are inside
    inverse     place x, y in the plane of the unit square of directions (n, K, 3), and the period of y: each (n, K)
    """

    within: Coordinates
    own: Coordinates | None
    numbers: np.ndarray
    seam: float = 0.0
    contains: Callable[[np.ndarray], np.ndarray] | None = None
    inverse: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]] | None = None


def _sampled(mean: Any, known: Direction, u0: Any, u1: Any, numbers: Any) -> tuple[Direction, Callable]:
    return mean.warp(known, u0, u1), lambda there: mean.density(there, known)


SAMPLED = Domain(_sampled, None, np.zeros(16))
"""All directions, in the coordinates of a lobe's own sampling."""


def over_directions(
    m: Reflectance,
    known: np.ndarray,
    place: Place,
    tolerance: Any,
    incident: bool,
    domain: Domain = SAMPLED,
    radiance: Radiance | None = None,
    unit: Any = 1.0,
    side: int | None = None,
) -> Found:
    """Integrals (n, C) of f cos over the directions of a domain, for known directions (n, 3), without delta lobes.

    `tolerance`, `unit`, `side`: see `cubature`.
    """
    count = len(known)
    tolerance, unit = (np.broadcast_to(np.asarray(x, dtype=float), count) for x in (tolerance, unit))
    lobes = [(of_places(w, *place), lobe) for w, lobe in m.lobes() if not lobe.is_delta]
    value, error, missing = np.zeros((count, 1)), np.zeros(count), np.zeros(count)
    for weight, lobe in lobes:
        largest = np.abs(weight).max(axis=-1)
        if not largest.any():
            continue
        goal = tolerance / (len(lobes) * np.fmax(largest, 1e-300))
        groups = []
        for first, last in _alike(lobe):
            part = lobe.each(partial(_channels, first=first, last=last)) if last else lobe
            light = None if radiance is None else partial(_coloured, radiance, place.of, first, last)
            groups.append(_integrals(part, known, place, goal, incident, domain, light, unit, side))
        wide = np.concatenate([g.value for g in groups], axis=-1)
        value = value + weight * wide
        error = error + largest * np.max([g.error for g in groups], axis=0)
        missing = np.maximum(missing, np.max([g.missing for g in groups], axis=0))
    return Found(value, error, missing)


def _alike(lobe: Reflectance) -> Iterator[tuple[int, int]]:
    """First channels and ends of the groups that are integrated together, because their lobes are equally wide;
    (0, 0) for a lobe without channels."""
    lengths: list[int] = []
    lobe.each(lambda value: lengths.append(np.shape(value)[-1] if np.ndim(value) else 0))
    count = max(lengths, default=0)
    widths = [
        v for _, field, v, _ in lobe.walk() if getattr(field, "sampled", "mean") != "mean" and np.shape(v)[-1:] > (1,)
    ]
    first = 0
    for c in range(1, count):
        if c - first == TOGETHER or any((v[..., c] != v[..., first]).any() for v in widths):
            yield first, c
            first = c
    yield first, count


def _channels(value: Any, first: int, last: int) -> Any:
    return value[..., first:last] if np.ndim(value) and value.shape[-1] > 1 else value


def _coloured(
    radiance: Radiance, index: np.ndarray, first: int, last: int, there: np.ndarray, rows: np.ndarray
) -> np.ndarray:
    found = radiance(there, index[rows])
    return found[..., first:last] if last and found.shape[-1] > 1 else found


def _integrals(
    lobe: Reflectance,
    known: np.ndarray,
    place: Place,
    tolerance: np.ndarray,
    incident: bool,
    domain: Domain,
    radiance: Radiance | None,
    unit: np.ndarray,
    side: int | None,
) -> Found:
    """`over_directions` of one lobe, for channels that are integrated together.

    Over a part of the directions in that part's coordinates, in which its rim is no jump; but in the lobe's own ones
    where it is narrow and leaves at grazing: too thin then to be found in others.
    """
    evaluate = partial(_evaluator, lobe, known, place, incident, radiance, domain.numbers)
    if domain.own is None:
        return cubature(
            evaluate(domain.within, np.arange(len(known))), len(known), tolerance, unit, lobe.seam, side=side
        )
    seeds, sent = _peaks(lobe, known, place, domain)
    narrow = (np.median(seeds[..., 2:].min(axis=-1), axis=-1) < SHARP) & (known[:, 2] < GRAZING) & sent
    results = []
    for rows in (np.flatnonzero(narrow), np.flatnonzero(~narrow)):
        of = tolerance[rows], unit[rows]
        if narrow[rows].any():
            found = cubature(evaluate(domain.within, rows), len(rows), *of, lobe.seam, side=side)
        else:
            found = cubature(evaluate(domain.own, rows), len(rows), *of, domain.seam, seeds[rows], side)
        results.append(found)
    return _merged(narrow, *results)


def _merged(first: np.ndarray, a: Found, b: Found) -> Found:
    """Results of which `first` says where they are from."""
    if len(a.error) == 0 or len(b.error) == 0:
        return a if len(b.error) == 0 else b
    found = []
    for x, y in zip(a, b, strict=True):
        both = np.empty((len(first), *x.shape[1:]))
        both[first], both[~first] = x, y
        found.append(both)
    return Found(*found)


def _evaluator(
    lobe: Reflectance,
    known: np.ndarray,
    place: Place,
    incident: bool,
    radiance: Radiance | None,
    numbers: np.ndarray,
    coordinates: Coordinates,
    used: np.ndarray,
) -> Callable[[np.ndarray, np.ndarray], Sums]:
    """What `cubature` needs for the known directions number `used`."""
    kernel = _kernel(coordinates, incident, radiance is not None)
    mapped = batch.full_shape(lobe, ()) != ()

    def run(m: Reflectance, rows: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        inputs = (known[rows][:, None], cells[:, None], NODES, numbers[None, None])
        if radiance is None:
            *totals, absent = batch.run(kernel, _TOTALS, m, inputs, _WIDTHS)
            sums = np.stack([t if t.ndim == 2 else t[:, None] for t in totals], axis=1)
            return sums, absent if absent.ndim == 1 else absent.max(axis=-1)
        there, values, absent = batch.run(kernel, (VECTOR, VALUE, VALUE), m, inputs, _WIDTHS)
        values, absent = (x if x.ndim == 3 else x[..., None] for x in (values, absent))
        sums = weighed(values * radiance(there, rows))
        return sums, absent.max(axis=-1) @ NODES[:, 2]

    def evaluate(rows: np.ndarray, cells: np.ndarray) -> Sums:
        rows, start = used[rows], 0
        totals, missing = [], []
        while start < len(rows):
            left = len(rows) - start
            size = next((n for n in CHUNKS if n <= left), CHUNKS[-1])
            part = slice(start, start + size)
            here, square = rows[part], cells[part]
            start += size
            if mapped:
                sums, absent = run(texels(lobe, place.shape, place.of[here]), here, square)
            else:
                filled = np.arange(size) % len(here)
                sums, absent = (x[: len(here)] for x in run(lobe, here[filled], square[filled]))
            totals.append(sums)
            missing.append(absent)
        return Sums(np.concatenate(totals), 0.0, np.concatenate(missing))

    return evaluate


_TOTALS = (TOTAL,) * 6
_WIDTHS = (3, 6, NODES.shape[1], 16)


@cache
def _kernel(coordinates: Callable, incident: bool, lit: bool) -> Callable:
    """The kernel for cells: sums over their nodes, or for light the directions and values times areas at the nodes;
    and the area without data."""

    def kernel(m: Reflectance, mean: Reflectance, w: Any, cell: Any, node: Any, numbers: Any) -> tuple:
        known = Direction(*w)
        u, area = place(cell, node)
        hidden = known.z <= HORIZON
        up = select(hidden, NORMAL, known)
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
            return there, value, absent
        return (*(weight * value for weight in node[2:]), node[2] * absent)

    return kernel


# Places where a lobe may have a peak: what its sampling draws, and how directions move with the numbers drawn.

SHARP = 0.02
"""From which width on, in the coordinates of a part of the directions, a lobe is narrow."""

GRAZING = 0.5
"""Cosine below which narrow lobes are drawn out in length as well."""

NARROW = 0.4
"""How wide cells near a peak may be, in the coordinates of the lobe's own sampling."""

_STEP = 4e-3
_GRID = np.stack(np.meshgrid(*2 * [np.array([0.005, 0.1, 0.35, 0.65, 0.9, 0.99])]), axis=-1).reshape(-1, 1, 2)
_STEPS = np.array([[0.0, 0.0], [_STEP, 0.0], [0.0, _STEP]])
_SEEDS = len(_GRID) * len(_STEPS)
_DRAWN = np.concatenate([(_GRID + _STEPS).reshape(-1, 2), lattice(256)])


def _drawn(m: Reflectance, mean: Reflectance, w: Any, u: Any) -> tuple:
    known = Direction(*w)
    return (mean.warp(select(known.z <= HORIZON, NORMAL, known), *u),)


def _peaks(lobe: Reflectance, known: np.ndarray, place: Place, domain: Domain) -> tuple[np.ndarray, np.ndarray]:
    """Seeds (n, K, 4) for `cubature`: points of a domain where a lobe's samples lie, or nearest to them, and how narrow
    cells may be there: along an axis of the domain the lobe's own coordinates change by `NARROW`. And whether any but
    very few samples fall into it (n,)."""
    assert domain.inverse is not None
    assert domain.contains is not None
    m = texels(lobe, place.shape, place.of) if batch.full_shape(lobe, ()) else lobe
    (there,) = batch.run(_drawn, (VECTOR,), m, (known[:, None], _DRAWN), (3, 2))
    sent = domain.contains(there[:, _SEEDS:]).sum(axis=-1) > 1
    x, y, period = (v.reshape(len(known), -1, 3) for v in domain.inverse(there[:, :_SEEDS]))
    with np.errstate(divide="ignore", invalid="ignore"):
        dx, dy = x[..., 1:] - x[..., :1], y[..., 1:] - y[..., :1]
        dy = dy - period[..., :1] * np.round(dy / period[..., :1])
        area = NARROW * np.abs(dx[..., 0] * dy[..., 1] - dx[..., 1] * dy[..., 0]) / _STEP
        wide, high = area / np.hypot(*np.moveaxis(dy, -1, 0)), area / np.hypot(*np.moveaxis(dx, -1, 0))
    wide, high = (
        np.maximum(v, 0.1 * np.median(np.nan_to_num(v, nan=1.0), axis=-1, keepdims=True)) for v in (wide, high)
    )
    at = [np.clip(v[..., 0], 0.0, 1.0) for v in (x, y)]
    return np.nan_to_num(np.stack([*at, wide, high], axis=-1), nan=1.0), sent


_u, _v = lattice(64).T
_SIDES = np.stack(
    [np.sqrt(_u) * np.cos(2 * np.pi * _v), np.sqrt(_u) * np.sin(2 * np.pi * _v), np.sqrt(1 - _u)], axis=-1
)
"""Directions that are spread over the hemisphere as the cosine."""
