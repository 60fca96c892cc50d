"""Kernels: f, pdf, samples and delta lobes of a material on components of directions; `batch.run` gives them arrays,
by the tasks at the end.

`m` computes values per channel; `mean`, the same material with merged channels, one number for sampling. Each kernel
brings the viewer above the surface, and the material with it, and then asks for light from either side.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from functools import partial, reduce
from typing import Any, NamedTuple

from ..arrays import ops
from ..arrays.kinds import MATRIX, SCALAR, VALUE, VECTOR
from ..evaluate.tracing import Task
from ..formula import tree
from ..formula.direction import BEHIND, HORIZON, NORMAL, Direction, dot, select, served
from ..formula.mueller import Mueller
from ..formula.sparse import is_zero
from .sides import lit_sides


def _nan_of(*directions: Direction) -> Any:
    """0, or NaN where a component is NaN or infinite: keeps NaN through the horizon mask."""
    w = directions[0]
    for other in directions[1:]:
        w = w + other
    total = dot(w, w)  # formulas that need the half vector have this sum already
    return total - total  # not 0 * total, which Dr.Jit replaces by 0


def with_holes(value: Any, m: Any) -> Any:
    """The value, NaN where a parameter is missing, for formulas do not use each parameter everywhere."""
    for number in tree.holed(m):
        value = value + (number - number)
    return value


def from_viewer(wo: Direction, *materials: Any) -> tuple[Any, ...]:
    """Where the viewer is behind the surface, and where hidden, at the horizon; wo as `turned_over` brings it above;
    the materials as seen from there. What is black behind needs no turn: a viewer there is hidden too."""
    if materials[0].sides == "front":
        hidden = wo.z <= HORIZON
        return False, hidden, wo, *materials
    behind = wo.z < 0.0
    up = turned_over(behind, wo)
    hidden = up.z <= HORIZON
    back = ops.where(behind, 1.0 + 0.0 * wo.z, 0.0 * wo.z)
    return behind, hidden, up, *(m.turned(back) for m in materials)


def turned_over(behind: Any, w: Direction) -> Direction:
    """w, turned half a turn about the y axis where the viewer is behind; `behind` is False where nobody can be."""
    return w if behind is False else Direction(ops.where(behind, -w.x, w.x), w.y, ops.where(behind, -w.z, w.z))


def _height(side: str, wi: Direction) -> Any:
    """How far wi is on this side of the surface, "front" or "across"."""
    return wi.z if side == "front" else -wi.z


def _light(m: Any, wi: Direction, hidden: Any) -> Iterator[tuple[str, Any, Any, Direction]]:
    """Each side that the material has lobes for; where it is dark there or hidden; where another direction may stand in
    for that of the viewer, which is as much where no other side is lit; and wi, with one in its place likewise."""
    sides = lit_sides(m)
    for side in sides:
        dark, there = _height(side, wi) <= HORIZON, NORMAL if side == "front" else BEHIND
        unlit = dark | hidden
        of_light, of_viewer = (unlit, unlit) if len(sides) == 1 else (dark, hidden)
        yield side, unlit, of_viewer, select(of_light, there, wi)


def _spread(m: Any, side: str) -> list[tuple[Any, Any]]:
    """What has f for light on this side, with weights: lobes that are no delta lobes, or the material of one side."""
    if m.sides == "front":
        return [(1.0, m)]
    return [(weight, lobe) for weight, lobe in m.lobes() if lobe.sides == side and not lobe.is_delta]


def _sum(terms: list[Any], none: Any) -> Any:
    return reduce(operator.add, terms) if terms else none


def _over_light(m: Any, wi: Direction, hidden: Any, terms: Callable[[str, Any, Direction], list[Any]]) -> Any:
    """The sum of the terms for the side that wi is on; 0 where that is hidden."""
    total: Any = None
    for side, unlit, unseen, safe in _light(m, wi, hidden):
        if several := terms(side, unseen, safe):
            total = ops.where(unlit, 0.0 if total is None else total, _sum(several, 0.0))
    return 0.0 * wi.z if total is None else total


def _f(m: Any, wi: Direction, hidden: Any, viewer: Callable[[Any], Direction]) -> Any:
    """f of all lobes; `viewer`: wo, or another direction where it may be replaced."""

    def terms(side: str, unseen: Any, safe: Direction) -> list[Any]:
        return [weight * lobe.formula(safe, viewer(unseen)) for weight, lobe in _spread(m, side)]

    return _over_light(m, wi, hidden, terms)


def value(m: Any, mean: Any, wi: Any, wo: Any) -> tuple[Any, ...]:
    wi, wo = Direction(*wi), Direction(*wo)
    behind, hidden, up, viewed = from_viewer(wo, m)
    f = _f(viewed, turned_over(behind, wi), hidden, lambda unseen: select(unseen, NORMAL, up))
    return (with_holes(f + _nan_of(wi, wo), m),)


def _matrix(parts: list[tuple[Any, Mueller]], nan: Any, m: Any) -> list[list[Any]]:
    """The elements of each matrix where it is not masked, else 0; those that are written 0 stay so, but for NaN."""
    nan = with_holes(nan, m)
    rows = [[nan] * 4 for _ in range(4)]
    for mask, M in parts:
        seen = ~mask & (nan == 0.0)  # one choice for each element instead of a choice and a sum
        pairs = [zip(*row, strict=True) for row in zip(M.rows, rows, strict=True)]
        rows = [[other if is_zero(x) else ops.where(seen, x, other) for x, other in row] for row in pairs]
    return rows


def mueller(m: Any, mean: Any, wi: Any, wo: Any) -> tuple[Any, ...]:
    # Half a turn leaves the axes of both directions as they are, but for their signs, which change nothing.
    wi, wo = Direction(*wi), Direction(*wo)
    behind, hidden, up, viewed = from_viewer(wo, m)
    parts = []
    for side, unlit, unseen, safe in _light(viewed, turned_over(behind, wi), hidden):
        lobes = _spread(viewed, side)
        matrices = [lobe.polarized(safe, select(unseen, NORMAL, up)) * weight for weight, lobe in lobes]
        parts.append((unlit, _sum(matrices, Mueller.depolarizer(0.0))))
    return (_matrix(parts, _nan_of(wi, wo), m),)


def _mirrors(m: Any, wo: Direction, side: str) -> tuple[Any, Direction, list[tuple[Any, Any]]]:
    """Where the viewer is hidden, wo above the surface, and the delta lobes for light on this side."""
    _, hidden, up, viewed = from_viewer(wo, m)
    wo_up = select(hidden, NORMAL, up)
    return hidden, wo_up, [(weight, lobe) for weight, lobe in viewed.lobes() if lobe.is_delta and lobe.sides == side]


def delta(m: Any, mean: Any, wo: Any, side: str) -> tuple[Any, ...]:
    wo = Direction(*wo)
    hidden, wo_up, lobes = _mirrors(m, wo, side)
    share = _sum([weight * lobe.mirror(wo_up) for weight, lobe in lobes], 0.0 * wo_up.z)
    return (with_holes(ops.where(hidden, 0.0, share) + _nan_of(wo), m),)


def delta_mueller(m: Any, mean: Any, wo: Any, side: str) -> tuple[Any, ...]:
    wo = Direction(*wo)
    hidden, wo_up, lobes = _mirrors(m, wo, side)
    total = _sum([lobe.polarized_mirror(wo_up) * weight for weight, lobe in lobes], Mueller.depolarizer(0.0))
    return (_matrix([(hidden, total)], _nan_of(wo), m),)


def reradiation(m: Any, mean: Any, wi: Any, wo: Any) -> tuple[Any, ...]:
    """Fluorescence: `m` is a material for a pair of wavelengths, as `base/reradiation.py` makes it."""
    wi, wo = Direction(*wi), Direction(*wo)
    below, wi_up, wo_up = served(wi, wo)
    value = m.leaves_at.reradiated(m.arrives_at, wi_up, wo_up)
    return (with_holes(ops.where(below, 0.0, value) + _nan_of(wi, wo), m),)


def together(m: Any) -> list[list[tuple[Any, Any]]]:
    """The lobes with their weights, in groups: a lobe with the next one, where they share a draw."""
    groups: list[list[tuple[Any, Any]]] = [[]]
    for weight, lobe in m.lobes():
        before = groups[-1][-1][1] if len(groups[-1]) == 1 else lobe
        if before._split and before.sides != lobe.sides:
            groups[-1].append((weight, lobe))
        else:
            groups.append([(weight, lobe)])
    return groups[1:]


def shares_of(mean: Any, wo: Direction) -> list[tuple[Any, Any]]:
    """The lobes, each with the probability of being sampled; of those that share a draw the first one."""
    lobes = [group[0] for group in together(mean)]
    if len(lobes) == 1:
        return [(1.0, lobes[0][1])]
    estimates = [weight * lobe.estimate(wo) + 1e-6 for weight, lobe in lobes]
    total = _sum(estimates, 0.0)
    return [(estimate / total, lobe) for estimate, (_, lobe) in zip(estimates, lobes, strict=True)]


def _density(mean: Any, wi: Direction, hidden: Any, viewer: Callable[[Any], Direction]) -> Any:
    """The density of draws from all lobes; `viewer` as for `_f`."""

    def terms(side: str, unseen: Any, safe: Direction) -> list[Any]:
        wo = viewer(unseen)
        shares = zip(shares_of(mean, wo), together(mean), strict=True)
        lobes = [(share, x, len(group) > 1) for (share, _), group in shares for _, x in group if not x.is_delta]
        densities = [(share * x.density(safe, wo), x, split) for share, x, split in lobes if x.sides == side]
        return [x._chance(safe, wo) * density if split else density for density, x, split in densities]

    return _over_light(mean, wi, hidden, terms)


def pdf(m: Any, mean: Any, wi: Any, wo: Any) -> tuple[Any, ...]:
    wi, wo = Direction(*wi), Direction(*wo)
    behind, hidden, up, viewed = from_viewer(wo, mean)
    density = _density(viewed, turned_over(behind, wi), hidden, lambda unseen: select(unseen, NORMAL, up))
    return (with_holes(density + _nan_of(wi, wo), mean),)


_BELOW_ONE = 1.0 - 6e-8  # the largest float32 below 1; random float64 numbers in [0, 1) may round to 1.0f


def third_of(u0: Any, u1: Any) -> Any:
    """A third number in [0, 1) of two: where they are along a line that winds round the unit square thousands of times,
    so that it is even in any small part of it, and for points on any grid."""
    winds = 3571.3091 * u0 + 5227.7237 * u1
    return winds - ops.floor(winds)


class _Draw(NamedTuple):
    """A draw among lobes: a direction, how far it is on the side of their light, and for that of a delta lobe
    (`mirrored`: False where no lobe is one) its weight."""

    wi: Direction
    height: Any
    mirrored: Any
    weight: Any

    def unless(self, here: Any, other: _Draw) -> _Draw:
        """The other one where the condition holds."""
        wi, height = select(here, other.wi, self.wi), ops.where(here, other.height, self.height)
        if self.mirrored is other.mirrored is False:
            return _Draw(wi, height, False, 0.0)
        rest = zip(other[2:], self[2:], strict=True)
        return _Draw(wi, height, *(ops.where(here, a, b) for a, b in rest))


def _choice(lobe: Any, factor: Any, chromatic: Any, wo: Direction, u: tuple[Any, Any]) -> _Draw:
    """What a lobe draws; `factor`: its weight over the probability of choosing it."""
    wi = lobe.mirrored(wo) if lobe.is_delta else lobe.warp(wo, *u)
    delta = (True, factor * chromatic.mirror(wo)) if lobe.is_delta else (False, 0.0)
    return _Draw(wi, _height(lobe.sides, wi), *delta)


def sample(m: Any, mean: Any, wo: Any, u: Any) -> tuple[Any, ...]:
    """Of two numbers both draw from the lobe that the first one falls to; a third number chooses it by itself."""
    wo, (u0, u1, *third) = Direction(*wo), u
    nan = with_holes(_nan_of(wo) + ((u0 + u1) - (u0 + u1)), mean)
    for u2 in third:
        nan = nan + (u2 - u2)
    behind, hidden, up, m, mean = from_viewer(wo, m, mean)
    wo_up = select(hidden, NORMAL, up)
    shares, start = shares_of(mean, wo_up), 0.0
    aside, u1 = third_of(u0, u1), ops.where(u1 >= 1.0, _BELOW_ONE, u1)
    chooser = third[0] if third else u0
    draw: Any = None
    for (share, _), group, colours in zip(shares, together(mean), together(m), strict=True):
        v = chooser if len(shares) == 1 else chooser / share if draw is None else (chooser - start) / share
        v = v if draw is None else ops.maximum(v, 0.0)
        u = (ops.minimum(u0 if third else v, _BELOW_ONE), u1)
        part, *other = [
            _choice(x, factor / share, colour, wo_up, u)
            for (_, x), (factor, colour) in zip(group, colours, strict=True)
        ]
        if other:
            part = other[0].unless((v if third else aside) < group[0][1]._chance(part.wi, wo_up), part)
        draw = part if draw is None else draw.unless(chooser >= start, part)
        start = start + share
    wi, height, mirrored, weight_of_delta = draw
    lost = (height <= HORIZON) | hidden
    pdf = ops.where(lost, 0.0, _density(mean, wi, hidden, lambda _: wo_up))
    useless = ~((pdf > 0.0) & (pdf < float("inf")))
    weight = ops.where(useless, 0.0, _f(m, wi, hidden, lambda _: wo_up) * height / ops.where(useless, 1.0, pdf))
    delta = ~lost & mirrored
    if mirrored is not False:
        weight, pdf = ops.where(delta, weight_of_delta, weight), ops.where(delta, 1.0, pdf)
    wi = turned_over(behind, wi)
    return Direction(wi.x + nan, wi.y + nan, wi.z + nan), weight + nan, pdf + nan, delta


F = Task(value, (VALUE,), (3, 3))
PDF = Task(pdf, (SCALAR,), (3, 3))
SAMPLE = {numbers: Task(sample, (VECTOR, VALUE, SCALAR, SCALAR), (3, numbers)) for numbers in (2, 3)}
"""By how many uniform numbers there are."""
MUELLER = Task(mueller, (MATRIX,), (3, 3))
RERADIATION = Task(reradiation, (VALUE,), (3, 3))
DELTA_REFLECTANCE, DELTA_TRANSMISSION = (Task(partial(delta, side=x), (VALUE,), (3,)) for x in ("front", "across"))
DELTA_MUELLER, DELTA_MUELLER_ACROSS = (
    Task(partial(delta_mueller, side=x), (MATRIX,), (3,)) for x in ("front", "across")
)
