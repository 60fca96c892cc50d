"""Functions that are linear in a table: f, albedo, the nine reflectances, as weighted sums over pairs of directions."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..integrals import nine
from ..integrals.albedo import albedo, black_sky_albedo, white_sky_albedo
from ..integrals.cones import Cone, Hemisphere
from ..integrals.over_hemisphere import directions, in_double
from ..numerics.lattice import lattice


class WeightedPairs(NamedTuple):
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
    pairs: Callable[[int], Iterator[WeightedPairs]]


def linear(function: Callable, arguments: dict[str, Any]) -> Linear | None:
    """The function of these arguments as a sum over pairs; None if it is not one of `LINEAR`."""
    return None if function not in LINEAR else LINEAR[function](**arguments)


def named(function: Callable, m: Any, args: tuple, named_args: dict[str, Any]) -> dict[str, Any]:
    """The arguments of a call by name, with defaults, without the reflectance."""
    bound = inspect.signature(function).bind(m, *args, **named_args)
    bound.apply_defaults()
    return dict(list(bound.arguments.items())[1:])


def pointwise(wi: Any, wo: Any, out: Any = None, uv: Any = None) -> Linear:
    """f at pairs of directions."""
    if uv is not None:
        raise ParameterError("uv=...: expected None; a measurement has no textures")
    if out is not None:
        raise ParameterError("out=...: expected None; a result with its uncertainty is an object of its own")
    sides = directions(wi), directions(wo)
    shape = np.broadcast_shapes(*(w.shape[:-1] for w in sides))
    flat = [in_double(np.broadcast_to(w, (*shape, 3))) for w in sides]

    def pairs(n: int) -> Iterator[WeightedPairs]:
        for start in range(0, len(flat[0]), 1 << 16):
            wi, wo = (w[start : start + (1 << 16)] for w in flat)
            yield WeightedPairs(np.arange(start, start + len(wi)), wi, wo, np.ones(len(wi)))

    return Linear(shape, False, pairs)


def _factor(incident: Any, collected: Any, share: float = 1.0, sky: Any = None, return_error: bool = False) -> Linear:
    """`share` times the reflectance factor pi/(Omega_i Omega_o) integral f."""
    if return_error:
        raise ParameterError("return_error=True: expected False; the error of quadrature is kept below u/10 here")
    if sky is not None:
        raise ParameterError("sky=...: first order knows uniform light only; take method='Monte Carlo'")
    sides = [x if isinstance(x, (Cone, Hemisphere)) else directions(x) for x in (incident, collected)]
    shape = np.broadcast_shapes(*(x.shape[:-1] for x in sides if isinstance(x, np.ndarray)))
    ends = [in_double(np.broadcast_to(x, (*shape, 3))) if isinstance(x, np.ndarray) else x for x in sides]
    count, free = math.prod(shape), sum(not isinstance(x, np.ndarray) for x in ends)

    def pairs(n: int) -> Iterator[WeightedPairs]:
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
            yield WeightedPairs(row, wi, wo, weight)

    return Linear(shape, free > 0, pairs)


def _reflectance(incident: Any, collected: Any, sky: Any, tolerance: float, return_error: bool) -> Linear:
    # A direction that collects is refused by `reflectance` itself.
    share = collected.projected / math.pi if isinstance(collected, (Cone, Hemisphere)) else 1.0
    return _factor(incident, collected, share, sky, return_error)


LINEAR: dict[Any, Callable[..., Linear]] = {
    Reflectance.f: pointwise,
    Reflectance.f_angles: lambda theta_i, phi_i, theta_o, phi_o: pointwise(
        direction(theta_i, phi_i), direction(theta_o, phi_o)
    ),
    albedo: lambda wi, tolerance, return_error: _factor(wi, Hemisphere(), return_error=return_error),
    nine.reflectance: _reflectance,
    nine.reflectance_factor: lambda incident, collected, sky, tolerance, return_error: _factor(
        incident, collected, sky=sky, return_error=return_error
    ),
    black_sky_albedo: lambda theta_s, phi_s, tolerance: _factor(
        direction(np.asarray(theta_s, dtype=float), np.asarray(phi_s, dtype=float)), Hemisphere()
    ),
    white_sky_albedo: lambda tolerance: _factor(Hemisphere(), Hemisphere()),
}
"""Functions that are linear in f -> the sum over pairs for their arguments."""
