"""Whether a failure is more than the uncertainty of a measurement explains.

A verdict is that of the numbers. Beside it stands the standard uncertainty u of its number: by interpolation, and by
the larger one of what independent errors and an error common to all values make, because files do not say which.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from ..base.angles import direction
from ..integrals.albedo import albedo
from ..integrals.cones import Hemisphere
from ..integrals.nine import reflectance_factor
from ..tables.gridded import Gridded
from ..tables.interpolation import places_of
from ..tables.nodes import above
from ..tables.scattered import Scattered
from ..uncertainty.functionals import Linear, Pairs, linear, named, pointwise
from ..uncertainty.sensitivity import around, by_channel
from ..uncertainty.table import TableErrors, has_uncertainty
from ._probes import difference, pairs, values
from ._verdict import Law

K = 2.0
"""Coverage factor from which on a deviation counts as significant, at one place."""

FAR = 5.0
"""The same, in u, for the largest of many: one of 10^5 normal errors lies beyond with a probability of 6 %."""

PAIRS = 1 << 14
"""Pairs of directions behind a share."""

SAME_PAIR = 1e-3
"""Distance [rad] up to which two measurements are of one pair of directions."""

MOST = 1 << 18
"""Values of a table, about, of which pairs that were measured both ways are looked for."""

SIGNIFICANT = {True: "significant", False: "within the uncertainty"}


def judged(m: Gridded, law: Law) -> Law:
    """The verdict with the uncertainty of its number, and the significance of a failure."""
    judge = _JUDGES.get(law.name)
    return law if judge is None or not math.isfinite(law.value) else judge(m, law)


def _with_u(
    law: Law, m: Gridded, at: int, over: float, of: Linear, value: np.ndarray, minus: Linear | None = None
) -> Law:
    """The verdict with the uncertainty of a linear result (1, C), or of a difference of such, in channel `at`, relative
    to a number."""
    noises, interpolations = [], []
    stated = has_uncertainty(m)
    for correlation in ("independent", "common") if stated else (None,):
        errors = TableErrors(m, correlation)
        interpolations.append(_norm(errors.interpolation(of, minus)[0, at]) / over)
        noises.append(float(errors.noise(of, value, minus).u.reshape(value.shape)[0, at]) / over)
    noise, interpolation = (float(np.max(x)) for x in (noises, interpolations))
    u = math.hypot(noise, interpolation)
    return replace(law, u=u, u_noise=noise if stated else None, u_interpolation=interpolation)


def _norm(parts: np.ndarray) -> float:
    return float(np.sqrt((parts**2).sum()))


def _integral(function: Callable, *args: object) -> Callable[[Gridded, Law], Law]:
    """The judge of an integral at one place; its value is the law's, but for the quadrature."""

    def judge(m: Gridded, law: Law) -> Law:
        where = [math.radians(x) for x in law.where.values()]
        if len(where) != 2:
            return law
        theta, phi = where
        at = (*args, direction(theta, phi))
        value = np.atleast_1d(function(m, *at, tolerance=1e-3))
        of = linear(function, named(function, m, at, {}))
        assert of is not None
        law = _with_u(law, m, int(np.nanargmax(value)), 1.0, of, value[None])
        if law.u is None or law.u_noise is None or math.isnan(law.u) or law.passed:
            return law
        z = (law.value - 1.0) / law.u if law.u > 0.0 else math.inf
        return replace(law, significance=f"exceeds 1 by {z:.2g} u: {SIGNIFICANT[z > K]}")

    return judge


def _some(m: Gridded) -> tuple[np.ndarray, np.ndarray]:
    count = max(1 << 10, PAIRS // by_channel(m.stored, m).shape[1])
    return pairs(min(count, PAIRS))


def _there(law: Law) -> tuple[np.ndarray, np.ndarray]:
    """The pair (1, 3) at which the law has its number."""
    theta_i, phi_i, theta_o, phi_o = (np.radians([x]) for x in law.where.values())
    return direction(theta_i, phi_i), direction(theta_o, phi_o)


def _positivity(m: Gridded, law: Law) -> Law:
    if law.passed:
        return law
    wi, wo = _there(law)
    f = values(m, wi, wo)
    law = _with_u(law, m, int(np.nanargmin(f)), 1.0, pointwise(wi, wo), f)
    if not has_uncertainty(m):
        return law
    wi, wo = _some(m)
    many, of = values(m, wi, wo), pointwise(wi, wo)
    u = np.maximum(*(TableErrors(m, how).noise(of, many).u for how in ("independent", "common")))
    with np.errstate(invalid="ignore", divide="ignore"):
        z = -many / u.reshape(many.shape)
    text = _shares(z, "the values", "are more than 2 u below 0", 0.023, "where f is 0", 0.5 * float(m.valid.sum()))
    return replace(law, significance=text)


def _reciprocity(m: Gridded, law: Law) -> Law:
    if law.passed:
        return law
    wi, wo = _there(law)
    there, back = values(m, wi, wo), values(m, wo, wi)
    channel = int(difference(there, back)[0].argmax())
    mean = 0.5 * float(np.abs(there[0, channel]) + np.abs(back[0, channel]))
    if mean > 0.0:
        law = _with_u(law, m, channel, mean, pointwise(wi, wo), there - back, pointwise(wo, wi))
    pairs = both_ways(m)
    if not len(pairs.f):
        return replace(law, significance="no pair was measured both ways: the difference is one of interpolation")
    what = f"the {len(pairs.f)} pairs that were measured both ways"
    if pairs.u is None:
        half = float(np.nanmedian(difference(pairs.f, pairs.back)))
        return replace(
            law, significance=f"of {what} half differ by more than {half:.2g} of f; no uncertainty is stated"
        )
    with np.errstate(invalid="ignore", divide="ignore"):
        z = np.where(pairs.u > 0.0, np.abs(pairs.f - pairs.back) / pairs.u, np.nan)
    text = _shares(z, what, "differ by more than 2 u", 0.046, "of a reciprocal surface", float(np.isfinite(z).sum()))
    return replace(law, significance=text)


class BothWays(NamedTuple):
    """f (n, C) of pairs, of the pairs with the directions exchanged, and standard uncertainties of the difference."""

    f: np.ndarray
    back: np.ndarray
    u: np.ndarray | None


def both_ways(m: Gridded) -> BothWays:
    """The pairs of directions that were measured both ways, each once; of large tables of some of them."""
    if isinstance(m, Scattered):
        (f, u), exchanged = m.row_brdf(), m.rows[:, [2, 3, 0, 1]]
        places, turned = (places_of(rows, m.is_oriented(), m.is_mirrored) for rows in (m.rows, exchanged))
        distance, back = KDTree(places).query(turned)
        there, found = np.arange(len(places)), distance < SAME_PAIR
    else:
        f, u = m.brdf(), m.brdf_uncertainty()
        there = np.arange(0, math.prod(map(len, m.axes.values())), 1 + m.valid.size // MOST)
        wi, wo = (w.reshape(-1, 3)[there] for w in m.directions())
        up = above(wi, wo)
        there, wi, wo = there[up], wi[up], wo[up]
        near = around(m, Pairs(0, wo, wi, np.ones(len(wi))))
        largest = near.weight.argmax(axis=0)[None]
        back = np.take_along_axis(near.node, largest, 0)[0]
        nodes = [
            x[i] for x, i in zip(m.axes.values(), np.unravel_index(back, tuple(map(len, m.axes.values()))), strict=True)
        ]
        away = [axis.apart(angle, x) for axis, angle, x in zip(m.layout, near.angles, nodes, strict=True)]
        pole = np.minimum(wi[:, 2], wo[:, 2]) > 1.0 - SAME_PAIR**2
        azimuth = np.array([bool(axis.period) for axis in m.layout])[:, None]
        found = np.all((np.array(away) < SAME_PAIR) | azimuth & pole, axis=0)
    f = by_channel(f, m)
    once = found & (there < back) | found & ~np.isin(back, there)
    once &= there != back
    u = None if u is None else np.hypot(by_channel(u, m)[there[once]], by_channel(u, m)[back[once]])
    return BothWays(f[there[once]], f[back[once]], u)


def _shares(z: np.ndarray, what: str, do: str, expected: float, when: str, independent: float) -> str:
    """The share of deviations, in standard uncertainties, that are large, and whether errors explain it.

    Of the deviations, however many are interpolated, only as many as the table has values are `independent`: the
    expected share gets three standard deviations of a binomial distribution.
    """
    quoted = z[~np.isnan(z)]
    if quoted.size == 0:
        return f"of {what} no uncertainty is known"
    share, most = float((quoted > K).mean()), float(quoted.max())
    most_expected = expected + 3.0 * math.sqrt(expected * (1.0 - expected) / max(1.0, independent))
    significant = share > most_expected or most > FAR
    return (
        f"{share:.1%} of {what} {do} (up to {expected:.1%} {when}, by normal errors), the worst by {most:.2g} u: "
        f"{SIGNIFICANT[significant]}"
    )


_JUDGES: dict[str, Callable[[Gridded, Law], Law]] = {
    "positivity": _positivity,
    "reciprocity": _reciprocity,
    "energy": _integral(albedo),
    "furnace": _integral(reflectance_factor, Hemisphere()),
}
