"""What should be known before the numbers of a fit are used: suspected units, numbers at bounds, other optima."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..formula.text import listed
from ..integrals.albedo import albedo
from .problem import Problem
from .solver import minimise
from .starts import chosen_rows

if TYPE_CHECKING:
    from .result import Fit

SHOWN = 4
"""Pairs of correlated numbers that are told."""


def notes_of(fit: Fit) -> Iterator[str]:
    """Sentences about a fit."""
    if not fit.converged:
        yield "the solver stopped before an optimum: more data, or fewer unknowns, would help"
    if kept := fit.problem.unknowns.kept:
        yield f"kept as they are, as is usual for this model: {listed(kept)}; `by` asks for them"
    for name, _, remark in fit.rows():
        if remark:
            yield f"{name} is {remark}"
    for a, b, r in fit.alike[:SHOWN]:
        yield f"the data hardly tell {a} and {b} apart (correlation {r:+.3f}): only their combination is sure"
    if fit.agreeing < 0.2 and fit.problem.unknowns.is_linear.sum() < len(fit.names):
        yield f"{fit.agreeing:.0%} of the starts ended here: other optima are about; more starts may find a better one"
    if fit.loss == "likelihood" and fit.free > 0:
        ratio = fit.cost / fit.free
        high = 1.0 + 5.0 * math.sqrt(2.0 / fit.free)
        if ratio > max(high, 1.2):
            yield (
                f"chi2/free is {ratio:.3g}: the uncertainties are too small, or the model is wrong; times "
                f"{math.sqrt(ratio):.3g} the standard errors would allow for that"
            )
        elif ratio < 0.3 and fit.free > 10:
            yield f"chi2/free is {ratio:.2g}: the uncertainties are larger than the scatter of the data"
    s = fit.problem.samples
    values = s.f[s.valid]
    if np.ptp(values) <= 1e-9 * np.abs(values).max(initial=0.0):
        yield f"all values are {values.flat[0]:g}: they hold no more than an albedo"
    elif len(s) >= 16 and len(fit.names) > 0:
        yield from _suspected(fit)


def _suspected(fit: Fit) -> Iterator[str]:
    """Suspicions that the values are not f [1/sr]. Nothing is changed by them."""
    s = fit.problem.samples
    median = float(np.median(s.f[s.valid]))
    try:
        reflected = float(np.max(albedo(fit.model, [0.0, 0.0, 1.0], tolerance=1e-2)))
    except Exception:  # a model without an integral is no reason to fail
        reflected = math.nan
    if reflected > 1.05:
        text = f"the model reflects {reflected:.2f} of the light at normal incidence, more than there is"
        yield f"{text}; are the values reflectance factors (pi f)? values/pi would reflect {reflected / math.pi:.2f}"
    elif median > 1.5:
        yield f"half of the values are above {median:.3g} /sr; a white surface has 0.32; in percent, or pi f?"
    cosines = _with_cosine(fit)
    if cosines is not None:
        yield cosines


def _with_cosine(fit: Fit) -> str | None:
    """A sentence where the data divided by cos(theta_o) are fitted much better: they may hold f cos(theta_o)."""
    part = chosen_rows(fit.problem.least_squares(), 0)
    s = part.samples
    if np.ptp(s.wo[:, 2]) < 0.3 or (s.f < 0.0).any():
        return None
    as_f = replace(part, loss="cosine", scale=1.0, samples=replace(s, u=None))
    divided = replace(as_f, samples=replace(s, u=None, f=s.f / s.wo[:, 2:]))
    start = fit.problem.unknowns.internal(fit.values)[None]
    shares = [_unexplained(problem, start) for problem in (as_f, divided)]
    if shares[0] > 1e-4 and shares[1] < 0.25 * shares[0]:
        return (
            f"f cos(theta_o) in place of f? Divided by cos(theta_o) the data are fitted better: {shares[1]:.2%} of "
            f"their variance is left in place of {shares[0]:.2%}"
        )
    return None


def _unexplained(problem: Problem, x: np.ndarray) -> float:
    """The share of the variance of what is compared that is left."""
    found = minimise(lambda at, _: problem.squares(at), x, problem.box, steps=30, tolerance=1e-4)
    target = problem._arrays[2][problem.samples.valid.T]
    total = float(((target - target.mean()) ** 2).sum())
    return float(found.squares.cost.min()) / total if total > 0.0 else 0.0
