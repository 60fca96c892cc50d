"""Whether a failure is more than the uncertainty of a measurement explains.

A verdict is that of the numbers. Beside it stands the standard uncertainty u of its number: the larger one of those by
independent errors and by an error common to all values, because files do not say which they mean.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..base.angles import direction
from ..integrals.albedo import albedo
from ..integrals.cones import Hemisphere
from ..integrals.nine import reflectance_factor
from ..tables.gridded import Gridded
from ..uncertainty.functionals import Linear, linear, named, pointwise
from ..uncertainty.sensitivity import Coefficients, by_channel, coefficients
from ..uncertainty.table import TableErrors
from ._probes import difference, pairs, values
from ._verdict import Law

K = 2.0
"""Coverage factor from which on a deviation counts as significant, at one place."""

FAR = 5.0
"""The same, in u, for the largest of many: one of 10^5 normal errors lies beyond with a probability of 6 %."""

PAIRS = 1 << 14
"""Pairs of directions behind a share."""

SIGNIFICANT = {True: "significant", False: "within the uncertainty"}


def judged(m: Gridded, law: Law) -> Law:
    """The verdict with the uncertainty of its number, and the significance of a failure."""
    judge = _JUDGES.get(law.name)
    return law if judge is None or not math.isfinite(law.value) else judge(m, law)


def _u(m: Gridded, of: Linear, value: np.ndarray, minus: Linear | None = None) -> np.ndarray:
    """Standard uncertainties (n, C) of linear results, or of differences of such."""
    uncertainties = []
    for correlation in ("independent", "common"):
        errors = TableErrors(m, correlation)
        if minus is None:
            latent = errors.results(of, value)
        else:
            first, second = coefficients(m, of, 1), coefficients(m, minus, 1)
            rows = [a - b for a, b in zip(first.rows, second.rows, strict=True)]
            latent = errors.latent(Coefficients(rows, first.pattern), value)
        uncertainties.append(latent.u)
    return np.maximum(*uncertainties).reshape(value.shape)


def _integral(function: Callable, *args: object) -> Callable[[Gridded, Law], Law]:
    """The judge of an integral at one place; its value is the law's, but for the quadrature."""

    def judge(m: Gridded, law: Law) -> Law:
        where = [math.radians(x) for x in law.where.values()]
        if len(where) != 2:
            return law
        at = (*args, direction(*where))
        value = np.atleast_1d(function(m, *at, tolerance=1e-3))
        of = linear(function, named(function, m, at, {}))
        assert of is not None
        channel = int(np.nanargmax(value))
        u = float(_u(m, of, value[None])[0, channel])
        if math.isnan(u) or law.passed:
            return replace(law, u=u)
        z = (law.value - 1.0) / u if u > 0.0 else math.inf
        return replace(law, u=u, significance=f"exceeds 1 by {z:.2g} u: {SIGNIFICANT[z > K]}")

    return judge


def _some(m: Gridded) -> tuple[np.ndarray, np.ndarray]:
    count = max(1 << 10, PAIRS // by_channel(m.stored, m).shape[1])
    return pairs(min(count, PAIRS))


def _there(law: Law) -> tuple[np.ndarray, np.ndarray]:
    """The pair (1, 3) at which the law has its number."""
    theta_i, phi_i, theta_o, phi_o = (np.radians([x]) for x in law.where.values())
    return direction(theta_i, phi_i), direction(theta_o, phi_o)


def _pointwise(m: Gridded, wi: np.ndarray, wo: np.ndarray, swapped: bool) -> tuple[np.ndarray, np.ndarray]:
    """f at pairs, less f of the swapped pairs if so, and the standard uncertainties: each (n, C)."""
    value = values(m, wi, wo) - values(m, wo, wi) if swapped else values(m, wi, wo)
    return value, _u(m, pointwise(wi, wo), value, pointwise(wo, wi) if swapped else None)


def _positivity(m: Gridded, law: Law) -> Law:
    if law.passed:
        return law
    f, u = _pointwise(m, *_there(law), False)
    many, spread = _pointwise(m, *_some(m), False)
    with np.errstate(invalid="ignore", divide="ignore"):
        text = _shares(m, -many / spread, "values", "are more than 2 u below 0", 0.023, "where f is 0")
    return replace(law, u=float(u[0, int(np.nanargmin(f))]), significance=text)


def _reciprocity(m: Gridded, law: Law) -> Law:
    if law.passed:
        return law
    wi, wo = _there(law)
    there, back = values(m, wi, wo), values(m, wo, wi)
    channel = int(difference(there, back)[0].argmax())
    u = float(_pointwise(m, wi, wo, True)[1][0, channel])
    mean = 0.5 * float(np.abs(there[0, channel]) + np.abs(back[0, channel]))
    many, spread = _pointwise(m, *_some(m), True)
    with np.errstate(invalid="ignore", divide="ignore"):
        text = _shares(m, np.abs(many) / spread, "pairs", "differ by more than 2 u", 0.046, "of a reciprocal surface")
    return replace(law, u=u / mean if mean > 0.0 else None, significance=text)


def _shares(m: Gridded, z: np.ndarray, what: str, do: str, expected: float, when: str) -> str:
    """The share of deviations, in standard uncertainties, that are large, and whether errors explain it.

    Of the deviations, however many are interpolated, only as many as the table has values are independent: the expected
    share gets three standard deviations of a binomial distribution.
    """
    quoted = z[~np.isnan(z)]
    if quoted.size == 0:
        return "no uncertainty is known"
    share, most = float((quoted > K).mean()), float(quoted.max())
    most_expected = expected + 3.0 * math.sqrt(expected * (1.0 - expected) / max(1.0, 0.5 * float(m.valid.sum())))
    significant = share > most_expected or most > FAR
    return (
        f"{share:.1%} of the {what} {do} (up to {expected:.1%} {when}, by normal errors), the worst by {most:.2g} u: "
        f"{SIGNIFICANT[significant]}"
    )


_JUDGES: dict[str, Callable[[Gridded, Law], Law]] = {
    "positivity": _positivity,
    "reciprocity": _reciprocity,
    "energy": _integral(albedo),
    "furnace": _integral(reflectance_factor, Hemisphere()),
}
