"""Integrals of a reflectance over the hemisphere, as callers ask for them: batches, both sides, delta lobes, errors."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..arrays.kinds import with_channels
from ..base.angles import check_unit
from ..base.kernels import with_holes
from ..base.reflectance import Reflectance
from ..base.sides import is_lit, sign_of_light
from ..base.sums import lobes_on
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
from ..formula.direction import HORIZON
from ..formula.warp import cosine_hemisphere
from ..machine import memory
from ..numerics.lattice import lattice
from ..numerics.quadrature import Goal, Integrals
from .cones import Hemisphere
from .maps import Wanted, over_places
from .over_directions import Over, Radiance, over_directions
from .places import Places

TIGHTEST = 1e-13
"""The smallest tolerance."""

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
    sides: str = "front",
) -> Integral:
    """Integral over the hemisphere of f cos, times `radiance(w', index)` if given, lobe by lobe; see `albedo`.

    `incident`: whether w is the incident direction and the integral runs over wo, or the other way round. Under a
    radiance the tolerance is relative to its mean over the hemisphere. `sides`: "front" for the hemisphere of w,
    "across" for the other one.
    """
    check_tolerance(tolerance)
    w = directions(w, is_lit(m, -1.0) or sides != "front")
    across = incident and sides == "across"  # then the viewer is on the other side of the surface
    parts = []
    behind = w[..., 2] < 0.0
    for back in (False, True):
        if behind.any() if back else not (behind.size and behind.all()):
            seen = lobes_on(m, sides, back != across)
            light = radiance if radiance is None or not back else _turned(radiance)
            parts.append(_integrate(seen, turned(w) if back else w, tolerance, incident, light, m))
    value, errors = (sum(x[1:], x[0]) for x in zip(*parts, strict=True))
    return Integral(value, errors)


def turned(w: np.ndarray) -> np.ndarray:
    """Directions turned half a turn about the y axis: what is behind the surface as that side sees it."""
    return w * np.array([-1.0, 1.0, -1.0], w.dtype)


def _turned(radiance: Radiance) -> Radiance:
    return lambda w, index: radiance(turned(w), index)


def _integrate(
    m: Reflectance,
    w: np.ndarray,
    tolerance: float,
    incident: bool,
    radiance: Radiance | None,
    whole: Reflectance | None = None,
) -> Integral:
    """The integral of lobes of one side; `whole`: the reflectance that they are of."""
    whole = m if whole is None else whole
    shape = batch.full_shape(m, w.shape[:-1])
    memory.check((*shape, 3), np.float64, "an array of directions")
    flat, unit = in_double(w), np.ones(math.prod(w.shape[:-1]))
    if radiance is not None:
        unit = mean_radiance(radiance, len(flat))

    def direct(lobe: Reflectance, number: np.ndarray, places: Places, tolerance: float) -> Integrals:
        light = None if radiance is None else lambda there, index: radiance(there, number[index])
        over, goal = Over(incident, radiance=light), Goal(tolerance, unit[number])
        return over_directions(lobe, flat[number], places, over, goal)

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
            part = places.values(with_channels(_delta(lobe, double, incident), len(shape)))
            if radiance is not None:
                mirrored = lobe.sample(double, np.zeros(2)).wi
                owner = np.broadcast_to(np.arange(len(flat)).reshape(w.shape[:-1]), shape).reshape(-1)
                part = part * radiance(mirrored.reshape(-1, 1, 3), owner)[:, 0]
            value = value + places.values(weight) * part
    unit = np.broadcast_to(unit.reshape(w.shape[:-1]), shape).reshape(-1)
    report(integrals, tolerance * np.maximum(unit, np.abs(value).max(axis=-1, initial=0.0)))
    if len(value) == 0:
        value = np.zeros((0, whole.channels or 1))
    channels = radiance is not None or whole.channels is not None
    value = (value.reshape(*shape, value.shape[-1]) + absent).astype(w.dtype)
    errors = integrals.error.reshape(shape)
    if whole is not m:
        value, errors = of_whole(value, errors, whole, w.shape[:-1])
    value = value if channels else value[..., 0][()]
    return Integral(value, errors[()])


def of_whole(
    value: np.ndarray, errors: np.ndarray, whole: Reflectance, directions: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Integrals (..., C) and errors (...) of the lobes of one side, which may have fewer channels and no maps, with the
    axes and the holes of the whole."""
    shape = batch.full_shape(whole, directions)
    value = np.broadcast_to(value, (*shape, max(value.shape[-1], whole.channels or 1)))
    value = (value + with_holes(np.zeros((*shape, 1)), whole)).astype(value.dtype)
    return value, np.broadcast_to(errors, shape)


def _delta(lobe: Reflectance, w: np.ndarray, incident: bool) -> Any:
    """The share of light from w that a delta lobe lets leave, or of the radiance towards w."""
    if sign_of_light(lobe) > 0.0:
        return lobe.delta_reflectance(w)
    w = np.where(w[..., 2:] < 0.0, [0.0, 0.0, 0.0], w)  # what is behind is the other view's
    if not incident:
        return lobe.delta_reflectance(w, across=True)
    reverse = lobe.turned(True)  # radiance the other way, and flux this way
    return reverse.delta_reflectance(w, across=True) * np.square(reverse.index)


def mean_radiance(radiance: Radiance, count: int) -> np.ndarray:
    """The mean over the hemisphere (count,), weighed by the cosine, of the channel that has most."""
    around = np.broadcast_to(_SIDES, (count, *_SIDES.shape))
    mean: np.ndarray = np.abs(radiance(around, np.arange(count))).mean(axis=1).max(axis=-1)
    return mean


def check_tolerance(tolerance: float) -> None:
    """Raises ParameterError for an error of an integral that double precision does not reach, or that says nothing."""
    if not TIGHTEST <= tolerance < 1.0:
        raise ParameterError(f"tolerance={tolerance!r}: expected a number between {TIGHTEST:g} and 1, such as 1e-4")


def directions(w: Any, behind: bool = False) -> np.ndarray:
    """Directions (..., 3) as a NumPy array of floating-point numbers; `behind`: also those behind the surface."""
    lib, (w,) = ops.as_arrays(w)
    if lib.name != "numpy":
        raise ArrayTypeError(f"integrals take NumPy directions; got {lib.name}; convert them first")
    if w.shape[-1:] != (3,):
        raise ShapeError(f"directions: got shape {w.shape}, expected (..., 3)")
    check_unit("directions", w)
    if w.size and not behind and (w[..., 2] <= HORIZON).all():
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
