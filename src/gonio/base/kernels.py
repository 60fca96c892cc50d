"""Kernels: f, pdf, samples and delta lobes of a material on components of directions; `batch.run` gives them arrays,
by the tasks at the end.

`m` computes values per channel; `mean`, the same material with merged channels, one number for sampling.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from ..arrays import ops
from ..arrays.kinds import MATRIX, SCALAR, VALUE, VECTOR
from ..evaluate.tracing import Task
from ..formula import tree
from ..formula.direction import BEHIND, HORIZON, NORMAL, Direction, dot, select, served
from ..formula.mueller import Mueller
from ..formula.sparse import is_zero

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
    for number in tree.holed(m):
        value = value + (number - number)
    return value


def value(m: Reflectance, mean: Reflectance, wi: Any, wo: Any) -> tuple[Any, ...]:
    wi, wo = Direction(*wi), Direction(*wo)
    if m.sides != "front":
        back, hidden, wi_seen, wo_up = upright(wi, wo)
        value = ops.where(hidden, 0.0, _total(m.turned(back), wi_seen, wo_up))
        return (with_holes(value + _nan_of(wi, wo), m),)
    below, wi_up, wo_up = served(wi, wo)
    value = m.formula(wi_up, wo_up)
    return (with_holes(ops.where(below, 0.0, value) + _nan_of(wi, wo), m),)


def together(m: Reflectance) -> list[list[tuple[Any, Any]]]:
    """The lobes with their weights, in groups: a lobe with the next one, where they share a draw."""
    groups: list[list[tuple[Any, Any]]] = []
    shared = False
    for pair in m.lobes():
        if shared:
            groups[-1].append(pair)
        else:
            groups.append([pair])
        shared = pair[1].split
    return groups


def _masked(M: Mueller, below: Any, nan: Any, m: Reflectance) -> list[list[Any]]:
    """The elements, 0 where a direction is below the horizon; those that are written 0 stay so, but for NaN."""
    nan = with_holes(nan, m)
    seen = ~below & (nan == 0.0)  # one choice for each element instead of a choice and a sum
    return [[nan if is_zero(x) else ops.where(seen, x, nan) for x in row] for row in M.rows]


def mueller(m: Reflectance, mean: Reflectance, wi: Any, wo: Any) -> tuple[Any, ...]:
    wi, wo = Direction(*wi), Direction(*wo)
    if m.sides != "front":
        # Half a turn leaves the axes of both directions as they are, but for their signs, which change nothing.
        back, hidden, wi_seen, wo_up = upright(wi, wo)
        return (_masked(_total_mueller(m.turned(back), wi_seen, wo_up), hidden, _nan_of(wi, wo), m),)
    below, wi_up, wo_up = served(wi, wo)
    return (_masked(m.polarized(wi_up, wo_up), below, _nan_of(wi, wo), m),)


def _total_mueller(m: Reflectance, wi: Direction, wo: Direction) -> Mueller:
    """The Mueller matrix of all lobes together, of light from either side."""
    total = Mueller.depolarizer(0.0 * wi.z)
    for weight, lobe in m.lobes():
        if not lobe.is_delta:
            lit, safe = on_its_side(lobe, wi)
            total = total + (lobe.polarized(safe, wo) * weight).where(lit)
    return total


def delta_mueller(m: Reflectance, mean: Reflectance, wo: Any) -> tuple[Any, ...]:
    return _delta_mueller(m, Direction(*wo), "front")


def delta_mueller_across(m: Reflectance, mean: Reflectance, wo: Any) -> tuple[Any, ...]:
    return _delta_mueller(m, Direction(*wo), "across")


def _delta_mueller(m: Reflectance, wo: Direction, sides: str) -> tuple[Any, ...]:
    if m.sides == "front":
        hidden, wo_up = served(wo)
        seen = m
    else:
        back, hidden, wo_up = upright(wo)
        seen = m.turned(back)
    total = Mueller.depolarizer(0.0 * wo_up.z)
    for weight, lobe in seen.lobes():
        if lobe.is_delta and lobe.sides == sides:
            total = total + lobe.polarized_mirror(wo_up) * weight
    return (_masked(total, hidden, _nan_of(wo), m),)


def reradiation(m: Any, mean: Any, wi: Any, wo: Any) -> tuple[Any, ...]:
    """Fluorescence: `m` is a material for a pair of wavelengths, as `base/reradiation.py` makes it."""
    wi, wo = Direction(*wi), Direction(*wo)
    below, wi_up, wo_up = served(wi, wo)
    value = m.leaves_at.reradiated(m.arrives_at, wi_up, wo_up)
    return (with_holes(ops.where(below, 0.0, value) + _nan_of(wi, wo), m),)


def shares_of(mean: Reflectance, wo: Direction) -> list[tuple[Any, Reflectance]]:
    """The lobes, each with the probability of being sampled; of those that share a draw the first one."""
    lobes = [group[0] for group in together(mean)]
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
    if m.sides != "front":
        back, hidden, wi_seen, wo_up = upright(wi, wo)
        seen = mean.turned(back)
        density = _density(seen, shares_of(seen, wo_up), wi_seen, wo_up)
        return (with_holes(ops.where(hidden, 0.0, density) + _nan_of(wi, wo), mean),)
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
    if m.sides != "front" or len(u) == 3:
        return _sample_of_lobes(m, mean, Direction(*wo), *u)
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
    if m.sides != "front":
        return _delta(m, Direction(*wo), "front")
    wo = Direction(*wo)
    below, wo_up = served(wo)
    total = 0.0 * wo_up.z
    for weight, lobe in m.lobes():
        if lobe.is_delta:
            total = total + weight * lobe.mirror(wo_up)
    return (with_holes(ops.where(below, 0.0, total) + _nan_of(wo), m),)


def delta_transmission(m: Reflectance, mean: Reflectance, wo: Any) -> tuple[Any, ...]:
    return _delta(m, Direction(*wo), "across")


# Materials that transmit: every pair is turned so that the viewer is above, and the material with it.


def upright(*directions: Direction) -> tuple[Any, ...]:
    """1 where the last of these directions, that of the viewer, is behind the surface, else 0; whether it is at the
    horizon; and the directions, turned half a turn about the y axis where it is behind. At the horizon it is the
    normal."""
    wo = directions[-1]
    behind = wo.z < 0.0
    back = ops.where(behind, 1.0 + 0.0 * wo.z, 0.0 * wo.z)
    flipped = [turned_over(behind, w) for w in directions]
    hidden = flipped[-1].z <= HORIZON
    return (back, hidden, *flipped[:-1], select(hidden, NORMAL, flipped[-1]))


def turned_over(back: Any, w: Direction) -> Direction:
    """w, turned half a turn about the y axis where `back` holds."""
    return Direction(ops.where(back, -w.x, w.x), w.y, ops.where(back, -w.z, w.z))


def on_its_side(lobe: Reflectance, wi: Direction) -> tuple[Any, Direction]:
    """Whether wi is where the lobe has light from, and wi if it is, else a direction there."""
    if lobe.sides == "across":
        lit = wi.z < -HORIZON
        return lit, select(lit, wi, BEHIND)
    lit = wi.z > HORIZON
    return lit, select(lit, wi, NORMAL)


def _total(m: Reflectance, wi: Direction, wo: Direction) -> Any:
    """The value of all lobes together, of light from either side."""
    total = 0.0 * wi.z
    for weight, lobe in m.lobes():
        if not lobe.is_delta:
            lit, safe = on_its_side(lobe, wi)
            total = total + ops.where(lit, weight * lobe.formula(safe, wo), 0.0)
    return total


def _density(mean: Reflectance, shares: list[tuple[Any, Reflectance]], wi: Direction, wo: Direction) -> Any:
    """The density of all lobes together, of light from either side."""
    total = 0.0 * wi.z
    for (share, _), group in zip(shares, together(mean), strict=True):
        for _, lobe in group:
            if not lobe.is_delta:
                lit, safe = on_its_side(lobe, wi)
                density = share * lobe.density(safe, wo)
                total = total + ops.where(lit, density if len(group) == 1 else lobe.chance(safe, wo) * density, 0.0)
    return total


def third_of(u0: Any, u1: Any) -> Any:
    """A third number in [0, 1) of two: where they are along a line that winds round the unit square thousands of times,
    so that it is even in any small part of it, and for points on any grid."""
    winds = 3571.3091 * u0 + 5227.7237 * u1
    return winds - ops.floor(winds)


class _Draw(NamedTuple):
    """A draw among lobes: a direction, whether it is from a delta lobe and with which weight, whether it is lost."""

    wi: Direction
    mirrored: Any
    weight: Any
    lost: Any

    def unless(self, here: Any, other: _Draw) -> _Draw:
        """The other one where the condition holds."""
        wi = select(here, other.wi, self.wi)
        rest = zip(other[1:], self[1:], strict=True)
        return _Draw(wi, *(ops.where(here, a, b) for a, b in rest))


def _choice(lobe: Reflectance, factor: Any, chromatic: Reflectance, wo: Direction, u: tuple[Any, Any]) -> _Draw:
    """What a lobe draws; `factor`: its weight over the probability of choosing it."""
    never, none = u[0] < -1.0, 0.0 * wo.z
    wi = lobe.mirrored(wo) if lobe.is_delta else lobe.warp(wo, *u)
    lost = ~on_its_side(lobe, wi)[0]
    return _Draw(wi, ~never, factor * chromatic.mirror(wo), lost) if lobe.is_delta else _Draw(wi, never, none, lost)


def _sample_of_lobes(
    m: Reflectance, mean: Reflectance, wo: Direction, u0: Any, u1: Any, u2: Any = None
) -> tuple[Any, ...]:
    """Samples of light from either side, or with a third number, which then chooses the lobe."""
    nan = with_holes(_nan_of(wo) + ((u0 + u1) - (u0 + u1)), mean)
    if u2 is not None:
        nan = nan + (u2 - u2)
    if m.sides == "front":
        back: Any = 0.0 * wo.z
        hidden, wo_up = served(wo)
    else:
        back, hidden, wo_up = upright(wo)
        m, mean = m.turned(back), mean.turned(back)
    shares, start = shares_of(mean, wo_up), 0.0
    u1 = ops.where(u1 >= 1.0, _BELOW_ONE, u1)
    chooser = u0 if u2 is None else u2
    aside = third_of(u0, u1)
    draw: Any = None
    for (share, _), group, colours in zip(shares, together(mean), together(m), strict=True):
        v = chooser if draw is None and len(shares) == 1 else ops.maximum((chooser - start) / share, 0.0)
        u = (ops.minimum(u0 if u2 is not None else v, _BELOW_ONE), u1)
        drawn = [
            _choice(x, factor / share, colour, wo_up, u)
            for (_, x), (factor, colour) in zip(group, colours, strict=True)
        ]
        part = drawn[0]
        if len(group) == 2:
            part = drawn[1].unless((aside if u2 is None else v) < group[0][1].chance(part.wi, wo_up), part)
        draw = part if draw is None else draw.unless(chooser >= start, part)
        start = start + share
    wi, mirrored, delta_weight, lost = draw
    lost = lost | hidden
    wi_safe = select(lost, NORMAL, wi)
    pdf = _density(mean, shares, wi_safe, wo_up)
    useless = ~((pdf > 0.0) & (pdf < float("inf")))
    weight = _total(m, wi_safe, wo_up) * ops.absolute(wi_safe.z) / ops.where(useless, 1.0, pdf)
    weight = ops.where(mirrored, delta_weight, ops.where(useless, 0.0, weight))
    wi = turned_over(back > 0.5, wi)
    return (
        Direction(wi.x + nan, wi.y + nan, wi.z + nan),
        ops.where(lost, 0.0, weight) + nan,
        ops.where(lost, 0.0, ops.where(mirrored, 1.0, pdf)) + nan,
        mirrored & ~lost,
    )


def _delta(m: Reflectance, wo: Direction, sides: str) -> tuple[Any, ...]:
    """The share of the light that delta lobes of these sides send to wo."""
    back, hidden, wo_up = upright(wo)
    seen = m if m.sides == "front" else m.turned(back)
    total = 0.0 * wo_up.z
    for weight, lobe in seen.lobes():
        if lobe.is_delta and lobe.sides == sides:
            total = total + weight * lobe.mirror(wo_up)
    return (with_holes(ops.where(hidden, 0.0, total) + _nan_of(wo), m),)


F = Task(value, (VALUE,), (3, 3))
PDF = Task(pdf, (SCALAR,), (3, 3))
SAMPLE = {numbers: Task(sample, (VECTOR, VALUE, SCALAR, SCALAR), (3, numbers)) for numbers in (2, 3)}
"""By how many uniform numbers there are."""
MUELLER = Task(mueller, (MATRIX,), (3, 3))
RERADIATION = Task(reradiation, (VALUE,), (3, 3))
DELTA_REFLECTANCE, DELTA_TRANSMISSION = (Task(k, (VALUE,), (3,)) for k in (delta_reflectance, delta_transmission))
DELTA_MUELLER, DELTA_MUELLER_ACROSS = (Task(k, (MATRIX,), (3,)) for k in (delta_mueller, delta_mueller_across))
