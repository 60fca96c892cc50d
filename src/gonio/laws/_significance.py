"""Whether a failure is more than the uncertainty of a measurement explains: a verdict of all its values together.

A law fails where what was measured of a lawful surface would be less likely than `CHANCE`, and the breach is larger
than a stated size; else it is not significant. Files say how large errors are, not which they share. So a chance is one
of the least favourable mixture of errors of every value of its own and one that is common; of chi-squares both have all
of the uncertainty, and the sum of both covariances is above that of any mixture. Channels may share both: their chances
are added up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree
from scipy.special import gammaincc, log_ndtr, ndtr

from ..base.angles import direction
from ..formula import tree
from ..integrals.albedo import albedo, white_sky_albedo
from ..integrals.cones import Hemisphere
from ..integrals.nine import reflectance_factor
from ..tables.gridded import Gridded
from ..tables.interpolation import places_of
from ..tables.nodes import above
from ..tables.scattered import Scattered
from ..uncertainty.functionals import Linear, WeightedPairs, linear, named, pointwise
from ..uncertainty.sensitivity import around, by_channel
from ..uncertainty.table import TableErrors, has_uncertainty
from . import cavity
from ._probes import difference, incidence, largest, values
from ._verdict import Law

CHANCE = 1e-3
"""Chance of a lawful surface below which a breach is significant."""

EFFECT = 1e-3
"""Least size of a significant breach of reciprocity, of f, and of positivity, of the median of f."""

SAME_PAIR = 1e-3
"""Distance [rad] up to which two measurements are of one pair of directions."""

MOST = 1 << 18
"""Values of a table, about, of which pairs that were measured both ways are looked for."""

NEAR = 3.0
"""Standard uncertainties above 0 from which on a value says nothing about positivity."""


def judged(m: Gridded, law: Law) -> Law:
    """The verdict with the uncertainty of its number, and the significance of a failure."""
    judge = _JUDGES.get(law.name)
    return law if judge is None or not math.isfinite(law.value) else judge(m, law)


def _decided(law: Law, significant: bool, text: str) -> Law:
    """The verdict of the set: what a table's class declares of single numbers is no reason for it."""
    words = f"{text}: {'significant' if significant else 'not significant'}"
    return replace(law, passed=not significant, significant=significant, declared="", significance=words)


class Errors(NamedTuple):
    """Standard uncertainties of a result: by errors of every value of its own, by one that is common to all, NaN where
    unknown, and by interpolation."""

    independent: float
    common: float
    interpolation: float

    @property
    def noise(self) -> float:
        """The larger one of both ends: what a report quotes."""
        return float(np.max([self.independent, self.common]))

    def times(self, x: float) -> Errors:
        return Errors(*(x * u for u in self))

    def and_as_much(self, more: Errors) -> Errors:
        """Of a sum, whose terms err alike."""
        return Errors(*(a + b for a, b in zip(self, more, strict=True)))

    def chance(self, excess: float, looks: int, channels: int) -> float:
        """The chance that the largest of so many results exceeds its bound by this much, of the mixture of independent
        errors and one that is common to a channel that makes it most likely; interpolation errs alike in a channel."""
        x, share = np.linspace(-9.0, 9.0, 2001), np.linspace(0.0, 1.0, 11)[:, None]
        spread = np.maximum(self.independent * np.sqrt(1.0 - share), 1e-9 * abs(excess) + 1e-300)
        beyond = (excess - x * np.hypot(self.common * np.sqrt(share), self.interpolation)) / spread
        normal = np.exp(-0.5 * x * x) * (x[1] - x[0]) / math.sqrt(2.0 * math.pi)
        one = float((-np.expm1(looks * log_ndtr(beyond)) @ normal).max())
        return -math.expm1(channels * math.log1p(-min(one, 1.0 - 1e-15)))


def _errors(m: Gridded, at: int, of: Linear, value: np.ndarray, minus: Linear | None = None) -> Errors:
    """Those of a linear result (1, C), or of a difference of such, in channel `at`."""
    noises, interpolations = [], []
    for correlation in ("independent", "common") if has_uncertainty(m) else (None,):
        errors = TableErrors(m, correlation)
        interpolations.append(float(np.sqrt((errors.interpolation(of, minus)[0, at] ** 2).sum())))
        noises.append(float(errors.noise(of, value, minus).u.reshape(value.shape)[0, at]))
    return Errors(noises[0], noises[-1], max(interpolations))


def _with(law: Law, errors: Errors, m: Gridded) -> Law:
    u = math.hypot(errors.noise, errors.interpolation)
    return replace(law, u=u, u_noise=errors.noise if has_uncertainty(m) else None, u_interpolation=errors.interpolation)


def _of_integral(function: Callable, m: Gridded, *args: object) -> tuple[np.ndarray, int, Errors]:
    """An integral (C,), the channel where it is largest, and its errors there."""
    value = np.atleast_1d(function(m, *args, tolerance=1e-3))
    of = linear(function, named(function, m, args, {}))
    assert of is not None
    at = int(np.nanargmax(value))
    return value, at, _errors(m, at, of, value[None])


def _exceeding(m: Gridded, law: Law, errors: Errors, excess: float, looks: int, channels: int) -> Law:
    """The verdict of a number that exceeds 1; without stated uncertainties that of the number, unless interpolation
    alone explains it."""
    if law.passed or math.isnan(errors.noise):
        return law
    p = errors.chance(excess, looks, channels)
    if not has_uncertainty(m) and p < CHANCE:
        return law
    u = math.hypot(errors.noise, errors.interpolation)
    z = excess / u if u > 0.0 else math.inf
    return _decided(law, p < CHANCE, f"exceeds 1 by {z:.2g} u, p = {p:.2g}")


def _integral(function: Callable, *args: object) -> Callable[[Gridded, Law], Law]:
    """The judge of an integral at one place, the largest of several; its value is the law's, but for the quadrature."""

    def judge(m: Gridded, law: Law) -> Law:
        if len(law.where) != 2:
            return law
        theta, phi = (math.radians(x) for x in law.where.values())
        value, _, errors = _of_integral(function, m, *args, direction(theta, phi))
        return _exceeding(m, _with(law, errors, m), errors, law.value - 1.0, len(incidence(m)), len(value))

    return judge


def _cavity(m: Gridded, law: Law) -> Law:
    """Radiance after k + 1 bounces errs, relative to itself, as a reflectance factor, and k times as the white-sky
    albedo: light that was scattered comes from everywhere."""
    if law.passed:
        return law
    mean, error = cavity.radiance(m)
    _, (k, at, _) = largest(mean - 3.0 * error)
    (first, c, errors), (later, d, more) = (
        _of_integral(*of) for of in ((reflectance_factor, m, Hemisphere(), cavity.starts()[at]), (white_sky_albedo, m))
    )
    errors = errors.times(1.0 / first[c]).and_as_much(more.times(k / later[d]))
    law = _with(law, errors.times(law.value), m)
    return _exceeding(m, law, errors, math.log(law.value), cavity.STARTS, len(first))


def _there(law: Law) -> tuple[np.ndarray, np.ndarray]:
    """The pair (1, 3) at which the law has its number."""
    theta_i, phi_i, theta_o, phi_o = (np.radians([x]) for x in law.where.values())
    return direction(theta_i, phi_i), direction(theta_o, phi_o)


def _positivity(m: Gridded, law: Law) -> Law:
    if law.passed:
        return law
    wi, wo = _there(law)
    f = values(m, wi, wo)
    law = _with(law, _errors(m, int(np.nanargmin(f)), pointwise(wi, wo), f), m)
    f, u = _measured(m)
    if u is None:
        return law
    with np.errstate(invalid="ignore", divide="ignore"):
        z = np.where(u > 0.0, -f / u, np.nan)
    by_channel = [_below(column[column > -NEAR]) for column in z.T]
    if not any(n for n, *_ in by_channel):
        return law
    n, chi2, worst, p = min(by_channel, key=lambda channel: channel[-1])
    p = min(1.0, z.shape[1] * p)
    large = bool(-np.nanmin(f) > EFFECT * np.nanmedian(np.abs(f)))
    text = f"of {n} values about or below 0: chi2 below 0 {chi2:.4g}, up to {0.5 * n:.4g} expected, the lowest by "
    return _decided(law, p < CHANCE and large, f"{text}{worst:.2g} u, p = {p:.2g}")


def _measured(m: Gridded) -> tuple[np.ndarray, np.ndarray | None]:
    """f (n, C) as it was measured, and its standard uncertainty."""
    f, u = m.row_brdf() if isinstance(m, Scattered) else (m.brdf(), m.brdf_uncertainty())
    return by_channel(f, m), None if u is None else by_channel(u, m)


def _below(z: np.ndarray) -> tuple[int, float, float, float]:
    """The number of values, their chi-square below 0 beside the common error that explains them best, the largest z,
    and the least chance of these and of the mean where all true values are 0, of the three together."""
    if not z.size:
        return 0, 0.0, 0.0, 1.0
    shared = 0.0
    for _ in range(50):  # the values below 0 lie on average by `shared` lower, as far as it is likely itself
        low = z[z > shared]
        shared, before = low.sum() / (1.0 + low.size), shared
        if shared == before:
            break
    n, worst = z.size, float(z.max())
    chi2 = float((np.maximum(z - shared, 0.0) ** 2).sum() + shared**2)
    mean, variance = 0.5 * n + 1.0, 1.25 * n + 2.0  # of squares of the half of normal errors above 0, and of a whole
    by_all = float(gammaincc(mean**2 / variance, chi2 * mean / variance))
    by_one = -math.expm1(n * float(log_ndtr(worst / math.sqrt(2.0))))
    by_mean = float(ndtr(-z.mean() / math.sqrt(1.0 + 1.0 / n)))
    return n, chi2, worst, 3.0 * min(by_all, by_one, by_mean)


def _reciprocity(m: Gridded, law: Law) -> Law:
    if law.passed:
        return law
    wi, wo = _there(law)
    there, back = values(m, wi, wo), values(m, wo, wi)
    channel = int(difference(there, back)[0].argmax())
    mean = 0.5 * float(np.abs(there[0, channel]) + np.abs(back[0, channel]))
    if mean > 0.0:
        errors = _errors(m, channel, pointwise(wi, wo), there - back, pointwise(wo, wi))
        law = _with(law, errors.times(1.0 / mean), m)
    pairs = both_ways(m)
    if not len(pairs.f):
        return _decided(law, False, "no pair was measured both ways, the difference is one of interpolation")
    return _of_pairs(law, pairs, "pairs that were measured both ways")


def _of_pairs(law: Law, pairs: BothWays, words: str) -> Law:
    """The verdict by pairs of values that should be equal; `words` say of what."""
    if pairs.u is None or pairs.u_back is None:
        half = float(np.nanmedian(difference(pairs.f, pairs.back)))
        text = f"of the {len(pairs.f)} {words} half differ by more than {half:.2g} of f"
        return replace(law, significance=f"{text}; no uncertainty is stated")
    by_channel = [_differing(*one) for one in zip(pairs.f.T, pairs.back.T, pairs.u.T, pairs.u_back.T, strict=True)]
    if not any(channel.n for channel in by_channel):
        return law
    worst = min(by_channel, key=lambda channel: channel.chance)
    chances = [len(by_channel) * p for p in (worst.by_all, worst.by_one)]
    significant = any(
        2.0 * p < CHANCE and size > EFFECT for p, size in zip(chances, (worst.rms, worst.off), strict=True)
    )
    text = (
        f"of {len(pairs.f)} {words}, which differ by {worst.rms:.2g} of f: chi2 "
        f"{worst.chi2:.4g} of {worst.n}, the largest difference {worst.z:.2g} u, p = {min(1.0, 2.0 * min(chances)):.2g}"
    )
    return _decided(law, significant, text)


def _isotropy(m: Gridded, law: Law) -> Law:
    """Of a table whose angles tell no turn: along the normal, where it has a value for each azimuth."""
    names = list(m.axes)
    if law.passed or isinstance(m, Scattered) or names != ["theta_i", "theta_o", "phi"]:
        return law
    size = tuple(map(len, m.axes.values()))
    number = np.arange(math.prod(size)).reshape(size)
    half = size[2] // 2
    normal = [np.abs(m.axes[name]) < SAME_PAIR for name in names[:2]]
    at_pole = number[normal[0][:, None] | normal[1][None, :]]
    ways = at_pole[:, :half].ravel(), at_pole[:, half : 2 * half].ravel()
    if not len(ways[0]):
        return law
    f, u = _measured(m)
    pairs = BothWays(*(f[way] for way in ways), *(None if u is None else u[way] for way in ways))
    return _of_pairs(law, pairs, "pairs of azimuths along the normal")


class Differing(NamedTuple):
    """How far n pairs of a channel differ: chi-square, its chance, and the difference in all, of f, weighted by 1/u^2;
    the largest in u, its chance, and it, of f."""

    n: int
    chi2: float
    by_all: float
    rms: float
    z: float
    by_one: float
    off: float

    @property
    def chance(self) -> float:
        return min(self.by_all, self.by_one)


def _differing(f: np.ndarray, back: np.ndarray, u: np.ndarray, u_back: np.ndarray) -> Differing:
    """Of the values (n,) of pairs; a common error leaves the difference of its parts in both."""
    both = np.hypot(u, u_back)
    valid = np.isfinite(f - back) & (both > 0.0)
    n, both = int(valid.sum()), both[valid]
    if not n:
        return Differing(0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0)
    apart, mean = np.abs(f - back)[valid] / both, 0.5 * np.abs(f + back)[valid] / both
    shared = (np.sign(f - back) * (u - u_back))[valid] / both
    chi2 = float(apart @ apart - (apart @ shared) ** 2 / (1.0 + shared @ shared))  # of the matrix 1 + shared shared^T
    z = apart / np.sqrt(1.0 + shared * shared)
    k = int(z.argmax())
    by_one = -math.expm1(n * math.log1p(-min(2.0 * float(ndtr(-z[k])), 1.0 - 1e-15)))
    rms = math.sqrt(float(apart @ apart) / max(float(mean @ mean), 1e-300))
    return Differing(
        n, chi2, float(gammaincc(0.5 * n, 0.5 * chi2)), rms, float(z[k]), by_one, float(apart[k] / max(mean[k], 1e-300))
    )


class BothWays(NamedTuple):
    """f (n, C) of pairs, of the pairs with the directions exchanged, and the standard uncertainties of both."""

    f: np.ndarray
    back: np.ndarray
    u: np.ndarray | None
    u_back: np.ndarray | None


def both_ways(m: Gridded) -> BothWays:
    """The pairs of directions that were measured both ways, each once; of large tables of some of them."""
    if isinstance(m, Scattered):
        exchanged = m.rows[:, [2, 3, 0, 1]]
        places, places_back = (places_of(rows, tree.is_oriented(m), m.is_mirrored) for rows in (m.rows, exchanged))
        distance, back = KDTree(places).query(places_back)
        there, has_partner = np.arange(len(places)), distance < SAME_PAIR
    else:
        there = np.arange(0, math.prod(map(len, m.axes.values())), 1 + m.valid.size // MOST)
        wi, wo = (w.reshape(-1, 3)[there] for w in m.directions())
        up = above(wi, wo)
        there, wi, wo = there[up], wi[up], wo[up]
        near = around(m, WeightedPairs(0, wo, wi, np.ones(len(wi))))
        largest = near.weight.argmax(axis=0)[None]
        back = np.take_along_axis(near.node, largest, 0)[0]
        nodes = [
            x[i] for x, i in zip(m.axes.values(), np.unravel_index(back, tuple(map(len, m.axes.values()))), strict=True)
        ]
        away = [axis.apart(angle, x) for axis, angle, x in zip(m.layout, near.angles, nodes, strict=True)]
        pole = np.minimum(wi[:, 2], wo[:, 2]) > 1.0 - SAME_PAIR**2
        azimuth = np.array([bool(axis.period) for axis in m.layout])[:, None]
        has_partner = np.all((np.array(away) < SAME_PAIR) | azimuth & pole, axis=0)
    f, u = _measured(m)
    once = has_partner & (there < back) | has_partner & ~np.isin(back, there)
    once &= there != back
    ways = there[once], back[once]
    return BothWays(*(f[way] for way in ways), *(None if u is None else u[way] for way in ways))


_JUDGES: dict[str, Callable[[Gridded, Law], Law]] = {
    "positivity": _positivity,
    "reciprocity": _reciprocity,
    "isotropy": _isotropy,
    "energy": _integral(albedo),
    "furnace": _integral(reflectance_factor, Hemisphere()),
    "cavity": _cavity,
}
