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
from ..formula.direction import HORIZON, NORMAL, Direction, select, served
from ..formula.warp import cosine_hemisphere
from ..numerics.lattice import lattice
from ..numerics.quadrature import NODES, Found, Sums, cubature, place, weighed
from .domain import SAMPLED, Coordinates, Domain
from .peaks import GRAZING, SHARP, peaks
from .places import Place, of_places, texels

CHUNKS = (4096, 512, 64)
"""How many cells a kernel is given at a time: always the same few numbers, because each needs a plan of its own."""

TOGETHER = 8
"""How many channels are integrated together at most."""

Radiance = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Radiance (n, k, 1 or C) from directions (n, k, 3), for the places (n,) of a flattened batch that they belong to."""

_SIDES = np.stack(cosine_hemisphere(*lattice(64).T[::-1]), axis=-1)
"""Directions that are spread over the hemisphere as the cosine."""


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
        value = np.zeros((0, m.channels or 1))
    channels = radiance is not None or m.channels is not None
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
    seeds, sent = peaks(lobe, known, place, domain)
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
        hidden, up = served(known)
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
