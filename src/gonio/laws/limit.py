"""Limit: as the widths of a lobe go to their narrow bounds it becomes the mirror that the class says.

A width is a parameter whose channels sampling merges by "max" (narrow at its lower bound: alpha) or by "min" (narrow at
its upper: n). A class that has widths and defines `mirror` is held to it; a delta lobe is there already.

Measured   with all widths at their narrow bounds: light outside 6° of the mirror direction, albedo against the mirror's
Holds if   <= 0.02
Tolerance  ten times what the tails of GGX leave at alpha = 1e-3
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import Param, Part
from ._probes import degrees, largest, samples, weights
from ._verdict import Findings, Law, at_most

ORDER = 43
COUNT = 1 << 14
STEPS = 5
VIEWS = np.radians([0.0, 40.0, 70.0])
CONE = np.radians(6.0)  # about the mirror direction; lobes at n = 1e4 and alpha = 1e-3 are narrower than 2 degrees
TOLERANCE = 0.02  # of the light outside the cone, or of albedo: ten times what GGX's tails leave at alpha = 1e-3


class Narrowing(NamedTuple):
    """A lobe on its way to the limit: share of the light outside CONE, albedo and the mirror's, each (STEPS, V)."""

    lobe: Reflectance
    outside: np.ndarray
    albedo: np.ndarray
    mirror: np.ndarray


def narrow_ends(m: Reflectance) -> Iterator[tuple[str, Any, float]]:
    """Path, value and narrow bound of every width."""
    for path, field, value in tree.settable(m):
        if isinstance(field, Param) and field.sampled in ("max", "min") and path in m.parameters:
            yield path, value, field.low if field.sampled == "max" else field.high


def lobes(m: Reflectance) -> list[Reflectance]:
    """The lobes of a material that declare a mirror as their limit, without those that wrap another reflectance."""
    declared = (lobe for _, lobe in m.lobes() if type(lobe).mirror is not Reflectance.mirror and not lobe.is_delta)
    return [lobe for lobe in declared if not _wraps(lobe) and [*narrow_ends(lobe)]]


def _wraps(m: Reflectance) -> bool:
    return any(isinstance(field, Part) and field.kind is Reflectance for field in m.fields.values())


def narrowing(lobe: Reflectance) -> Narrowing:
    """The lobe followed to its limit, all widths together, in equal ratios."""
    views = []
    for t in np.linspace(0.0, 1.0, STEPS):
        changes = {
            path: np.clip(_between(value, end, float(t)), min(np.min(value), end), max(np.max(value), end))
            for path, value, end in narrow_ends(lobe)
        }
        m = lobe.replace(changes)
        views.append([_seen(m, view) for view in direction(VIEWS, 0.3)])
    return Narrowing(lobe, *np.moveaxis(np.array(views), -1, 0))


def _between(value: Any, end: float, t: float) -> Any:
    """From value to end in equal ratios; a bound of 0 is reached in the last step."""
    if t == 1.0:
        return np.full_like(value, end) if np.ndim(value) else end
    goal = end if end > 0.0 else 1e-3 * np.maximum(value, 1e-30)
    start = np.maximum(value, 1e-3 * goal)
    return start * (goal / start) ** t


def _seen(m: Reflectance, view: np.ndarray) -> tuple[float, float, float]:
    """Share of the light outside the cone, albedo and reflectance of the mirror, of the channel that is worst."""
    total, far = np.zeros(m.channels or 1), np.zeros(m.channels or 1)
    for s in samples(m, view, COUNT):
        weight = weights(s)
        away = _angle(m.mirrored(Direction(*view)), s.wi)
        total, far = total + weight.sum(axis=0), far + weight[away > CONE].sum(axis=0)
    far = far / np.maximum(total, 1e-300)
    mean = total / COUNT
    mirror = np.broadcast_to(np.asarray(m.mirror(Direction(*view)), dtype=float), mean.shape)
    c = int(np.abs(mean - mirror).argmax())
    return float(far.max()), float(mean[c]), float(mirror[c])


def _angle(mirrored: Direction, w: np.ndarray) -> np.ndarray:
    """The angles [rad] between directions and the one that the limit of a lobe mirrors or refracts."""
    to = np.array([float(x) for x in mirrored])
    return np.arctan2(np.linalg.norm(np.cross(w, to), axis=-1), w @ to)


def law(m: Reflectance) -> Findings:
    """Light outside the cone, or the albedo's distance from the mirror's, whichever is larger, at the narrow end."""
    verdicts: list[Law] = []
    for n in map(narrowing, lobes(m)):
        off = np.abs(n.albedo[-1] - n.mirror[-1])
        if n.outside[-1].max() >= off.max():
            value, (v,) = largest(n.outside[-1])
            why = f"{value:.1%} of the light stays away from the mirror"
        else:
            value, (v,) = largest(off)
            why = f"the albedo goes to {n.albedo[-1, v]:.4g}, the mirror's is {n.mirror[-1, v]:.4g}"
        ends = ", ".join(f"{path} = {end:g}" for path, _, end in narrow_ends(n.lobe))
        place, rule = degrees(wo=direction(VIEWS[v], 0.3)), "distance from a mirror = {value} <= {tolerance}"
        verdicts.append(at_most("limit", value, TOLERANCE, rule, place, f"at {ends} {why}"))
    if verdicts:
        yield max(verdicts, key=lambda law: law.value)
