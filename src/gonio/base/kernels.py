"""Kernels: f, pdf, samples and delta lobes of a material on components of directions; `batch.run` gives them arrays.

`m` computes values per channel; `mean`, the same material with merged channels, one number for sampling.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..arrays import ops
from ..formula.direction import HORIZON, NORMAL, Direction, dot, select, served

if TYPE_CHECKING:
    from .reflectance import Reflectance


def _nan_of(*directions: Direction) -> Any:
    """0, or NaN where a component is NaN or infinite: keeps NaN through the horizon mask."""
    w = directions[0]
    for other in directions[1:]:
        w = w + other
    total = dot(w, w)  # formulas that need the half vector have this sum already
    return total - total  # not 0 * total, which Dr.Jit replaces by 0


def with_holes(value: Any, m: Reflectance) -> Any:
    """The value, NaN where a parameter is missing, for formulas do not use each parameter everywhere."""
    for number in m.holed():
        value = value + (number - number)
    return value


def value(m: Reflectance, mean: Reflectance, wi: Any, wo: Any) -> tuple[Any, ...]:
    wi, wo = Direction(*wi), Direction(*wo)
    below, wi_up, wo_up = served(wi, wo)
    value = m.formula(wi_up, wo_up)
    return (with_holes(ops.where(below, 0.0, value) + _nan_of(wi, wo), m),)


def shares_of(mean: Reflectance, wo: Direction) -> list[tuple[Any, Reflectance]]:
    """The lobes, each with the probability of being sampled."""
    lobes = list(mean.lobes())
    if len(lobes) == 1:
        return [(1.0, lobes[0][1])]
    estimates = [weight * lobe.estimate(wo) + 1e-6 for weight, lobe in lobes]
    total = estimates[0]
    for estimate in estimates[1:]:
        total = total + estimate
    return [(estimate / total, lobe) for estimate, (_, lobe) in zip(estimates, lobes, strict=True)]


def _mixture(shares: list[tuple[Any, Reflectance]], wi: Direction, wo: Direction) -> Any:
    densities = [share * lobe.density(wi, wo) for share, lobe in shares if not lobe.is_delta]
    return sum(densities[1:], densities[0]) if densities else 0.0 * wi.z


def pdf(m: Reflectance, mean: Reflectance, wi: Any, wo: Any) -> tuple[Any, ...]:
    wi, wo = Direction(*wi), Direction(*wo)
    below, wi_up, wo_up = served(wi, wo)
    mixture = _mixture(shares_of(mean, wo_up), wi_up, wo_up)
    return (with_holes(ops.where(below, 0.0, mixture) + _nan_of(wi, wo), mean),)


_BELOW_ONE = 1.0 - 6e-8  # the largest float32 below 1; random float64 numbers in [0, 1) may round to 1.0f


def _drawn(
    m: Reflectance, shares: list[tuple[Any, Reflectance]], wo: Direction, u0: Any, u1: Any
) -> tuple[Direction, Any, Any]:
    """A direction from the lobe that u0 falls to, whether that is a delta lobe, and its weight; None without any."""
    deltas = any(lobe.is_delta for _, lobe in shares)
    wi, mirrored, weight = wo, u0 < -1.0, 0.0 * wo.z
    start = 0.0
    for i, ((share, lobe), (factor, chromatic)) in enumerate(zip(shares, m.lobes(), strict=True)):
        v = u0 if len(shares) == 1 else u0 / share if i == 0 else ops.maximum((u0 - start) / share, 0.0)
        drawn = lobe.mirrored(wo) if lobe.is_delta else lobe.warp(wo, ops.minimum(v, _BELOW_ONE), u1)
        here = u0 >= start  # and in no later lobe
        wi = select(here, drawn, wi) if i > 0 else drawn
        if lobe.is_delta:
            mirrored = mirrored | here
            weight = ops.where(here, factor * chromatic.mirror(wo) / share, weight)
        elif deltas:
            mirrored = mirrored & ~here
        start = start + share
    return wi, mirrored, weight if deltas else None


def sample(m: Reflectance, mean: Reflectance, wo: Any, u: Any) -> tuple[Any, ...]:
    wo, (u0, u1) = Direction(*wo), u
    nan = with_holes(_nan_of(wo) + ((u0 + u1) - (u0 + u1)), mean)
    hidden, wo_up = served(wo)
    shares = shares_of(mean, wo_up)
    u1 = ops.where(u1 >= 1.0, _BELOW_ONE, u1)
    wi, mirrored, delta_weight = _drawn(m, shares, wo_up, u0, u1)
    lost = (wi.z <= HORIZON) | hidden
    wi_up = select(lost, NORMAL, wi)
    pdf = _mixture(shares, wi_up, wo_up)
    useless = ~((pdf > 0.0) & (pdf < float("inf")))
    weight = ops.where(useless, 0.0, m.formula(wi_up, wo_up) * wi_up.z / ops.where(useless, 1.0, pdf))
    if delta_weight is not None:
        weight, pdf = ops.where(mirrored, delta_weight, weight), ops.where(mirrored, 1.0, pdf)
    return (
        Direction(wi.x + nan, wi.y + nan, wi.z + nan),
        ops.where(lost, 0.0, weight) + nan,
        ops.where(lost, 0.0, pdf) + nan,
        mirrored & ~lost,
    )


def delta_reflectance(m: Reflectance, mean: Reflectance, wo: Any) -> tuple[Any, ...]:
    wo = Direction(*wo)
    below, wo_up = served(wo)
    total = 0.0 * wo_up.z
    for weight, lobe in m.lobes():
        if lobe.is_delta:
            total = total + weight * lobe.mirror(wo_up)
    return (with_holes(ops.where(below, 0.0, total) + _nan_of(wo), m),)
