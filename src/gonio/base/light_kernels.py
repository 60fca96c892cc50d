"""What kernels compute of lights: see `kernels.py`, of reflectances."""

from __future__ import annotations

from typing import Any

from ..arrays import ops
from ..arrays.kinds import SCALAR, VALUE, VECTOR
from ..evaluate.tracing import Task
from ..formula.direction import Direction, dot


def _nan_of(*numbers: Any) -> Any:
    """0, or NaN where a number is NaN or infinite."""
    total = numbers[0]
    for x in numbers[1:]:
        total = total + x
    return total - total


def _incident(light: Any, mean: Any, w: Any, p: Any) -> tuple[Any, ...]:
    return (light.seen(Direction(*p), Direction(*w))[0] + _nan_of(*w),)


def _distance(light: Any, mean: Any, w: Any, p: Any) -> tuple[Any, ...]:
    return (mean.seen(Direction(*p), Direction(*w))[1] + _nan_of(*w),)


def _pdf(light: Any, mean: Any, w: Any, p: Any) -> tuple[Any, ...]:
    return (mean.density(Direction(*p), Direction(*w)) + _nan_of(*w),)


def _sample(light: Any, mean: Any, u: Any, p: Any) -> tuple[Any, ...]:
    w, density = mean.drawn(Direction(*p), *u)
    nan = _nan_of(*u)
    return Direction(w.x + nan, w.y + nan, w.z + nan), density + nan


def _holds(light: Any, mean: Any, p: Any) -> tuple[Any, ...]:
    return (ops.where(mean.holds(Direction(*p)), 1.0, 0.0),)


def _irradiance(light: Any, mean: Any, p: Any, n: Any) -> tuple[Any, ...]:
    p, n = Direction(*p), Direction(*n)
    if light.is_delta:
        w, E, _ = light.beam(p)
        return (E * ops.maximum(dot(w, n), 0.0),)
    return (light.irradiance_on(p, n) + _nan_of(*n, *p),)


def _arrival(light: Any, mean: Any, p: Any) -> tuple[Any, ...]:
    w, _, distance = mean.beam(Direction(*p))
    none = 0.0 * _nan_of(*p)
    E = light.beam(Direction(*p))[1]
    return Direction(w.x + none, w.y + none, w.z + none), E + none, distance + none


def _placed(light: Any, mean: Any, p: Any, w: Any, u: Any) -> tuple[Any, ...]:
    p, w = Direction(*p), Direction(*w)
    if light.is_delta:
        towards, E, distance = light.beam(p)
        return towards, E, distance
    if not light.can_sample and not light.has_horizon:
        return w, *light.seen(p, w)
    drawn, density = light.drawn(p, *u)
    L, distance = light.seen(p, w)
    return drawn, L + 0.0 * density, distance


PLACED = Task(_placed, (VECTOR, SCALAR, SCALAR), (3, 3, 2))
INCIDENT = Task(_incident, (VALUE,), (3, 3))
DISTANCE = Task(_distance, (SCALAR,), (3, 3))
PDF = Task(_pdf, (SCALAR,), (3, 3))
SAMPLE = Task(_sample, (VECTOR, SCALAR), (2, 3))
HOLDS = Task(_holds, (SCALAR,), (3,))
IRRADIANCE = Task(_irradiance, (VALUE,), (3, 3))
ARRIVAL = Task(_arrival, (VECTOR, VALUE, SCALAR), (3,))
