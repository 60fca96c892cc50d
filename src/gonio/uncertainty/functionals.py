"""What is linear in a table: f, albedo and the nine reflectances, as weighted sums over pairs of directions."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..integrals import nine, under_sky
from ..integrals.albedo import albedo
from ..integrals.cones import Cone, Hemisphere
from ..integrals.over_directions import directions, in_double
from ..numerics.lattice import lattice


class Pairs(NamedTuple):
    """Pairs of directions (n, 3) and their weights (n,), for the results number `row`: (n,), or one for all."""

    row: np.ndarray | int
    wi: np.ndarray
    wo: np.ndarray
    weight: np.ndarray


class Linear(NamedTuple):
    """Results of this shape (without channels), each a sum of weight times f over pairs.

    `pairs(n)` gives them, `n` for each result where it is an integral (`sampled`), in any order of results.
    """

    shape: tuple[int, ...]
    sampled: bool
    pairs: Callable[[int], Iterator[Pairs]]


def linear(function: Callable, arguments: dict[str, Any]) -> Linear | None:
    """The function of these arguments, if it is known to be linear in f; None if it is not."""
    make = _KNOWN.get(function)
    return None if make is None else make(**arguments)


def named(function: Callable, m: Any, args: tuple, named_args: dict[str, Any]) -> dict[str, Any]:
    """The arguments of a call by name, with defaults, without the reflectance."""
    bound = inspect.signature(function).bind(m, *args, **named_args)
    bound.apply_defaults()
    return dict(list(bound.arguments.items())[1:])


def pointwise(wi: Any, wo: Any, out: Any = None) -> Linear:
    """f at pairs of directions."""
    if out is not None:
        raise ParameterError("out=...: expected None; a result with its uncertainty is an object of its own")
    sides = directions(wi), directions(wo)
    shape = np.broadcast_shapes(*(w.shape[:-1] for w in sides))
    flat = [in_double(np.broadcast_to(w, (*shape, 3))) for w in sides]

    def pairs(n: int) -> Iterator[Pairs]:
        for start in range(0, len(flat[0]), 1 << 16):
            wi, wo = (w[start : start + (1 << 16)] for w in flat)
            yield Pairs(np.arange(start, start + len(wi)), wi, wo, np.ones(len(wi)))

    return Linear(shape, False, pairs)


def _values_by_angles(theta_i: Any, phi_i: Any, theta_o: Any, phi_o: Any) -> Linear:
    return pointwise(direction(theta_i, phi_i), direction(theta_o, phi_o))


def _factor(incident: Any, collected: Any, share: float) -> Linear:
    """`share` times the reflectance factor pi/(Omega_i Omega_o) integral f."""
    sides = [x if isinstance(x, (Cone, Hemisphere)) else directions(x) for x in (incident, collected)]
    shape = np.broadcast_shapes(*(x.shape[:-1] for x in sides if isinstance(x, np.ndarray)))
    ends = [in_double(np.broadcast_to(x, (*shape, 3))) if isinstance(x, np.ndarray) else x for x in sides]
    count, free = math.prod(shape), sum(not isinstance(x, np.ndarray) for x in ends)

    def pairs(n: int) -> Iterator[Pairs]:
        u = lattice(n if free else 1, max(2 * free, 2))
        spread: list[Any] = []
        weight = np.full(len(u), math.pi * share / len(u))
        for x in ends:
            if isinstance(x, np.ndarray):
                spread.append(x)
                continue
            w, solid = x.points(*u[:, -2:].T) if len(spread) else x.points(*u[:, :2].T)
            weight = weight * np.nan_to_num(solid / x.projected)
            spread.append(np.nan_to_num(w))
        for row in range(count):
            wi, wo = (w[row : row + 1] if isinstance(x, np.ndarray) else w for x, w in zip(ends, spread, strict=True))
            yield Pairs(row, wi, wo, weight)

    return Linear(shape, free > 0, pairs)


def _albedo(wi: Any, tolerance: float, error: bool) -> Linear:
    _no_error(error)
    return _factor(wi, Hemisphere(), 1.0)


def _no_error(error: bool) -> None:
    if error:
        raise ParameterError("error=True: expected False; the error of quadrature is kept below u/10 here")


def _no_sky(sky: Any) -> None:
    if sky is not None:
        raise ParameterError("sky=...: first order knows uniform light only; take method='Monte Carlo'")


def _reflectance(incident: Any, collected: Any, sky: Any, tolerance: float, error: bool) -> Linear:
    _no_error(error)
    _no_sky(sky)
    if not isinstance(collected, (Cone, Hemisphere)):
        return _factor(incident, collected, 1.0)  # which `reflectance` itself refuses
    return _factor(incident, collected, collected.projected / math.pi)


def _reflectance_factor(incident: Any, collected: Any, sky: Any, tolerance: float, error: bool) -> Linear:
    _no_error(error)
    _no_sky(sky)
    return _factor(incident, collected, 1.0)


def _black_sky(theta: Any, phi: Any, tolerance: float) -> Linear:
    return _factor(direction(np.asarray(theta, dtype=float), np.asarray(phi, dtype=float)), Hemisphere(), 1.0)


def _white_sky(tolerance: float) -> Linear:
    return _factor(Hemisphere(), Hemisphere(), 1.0)


_KNOWN: dict[Any, Callable[..., Linear]] = {
    Reflectance.f: pointwise,
    Reflectance.f_angles: _values_by_angles,
    albedo: _albedo,
    nine.reflectance: _reflectance,
    nine.reflectance_factor: _reflectance_factor,
    under_sky.black_sky_albedo: _black_sky,
    under_sky.white_sky_albedo: _white_sky,
}
"""What is linear in f -> how it is a sum."""

KNOWN_NAMES = tuple(f.__name__ for f in _KNOWN)
