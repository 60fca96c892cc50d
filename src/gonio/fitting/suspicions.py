"""Suspicions that the values of a fit are not f [1/sr]."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..base.reflectance import Reflectance
from ..integrals.albedo import albedo
from .problem import Problem
from .solver import minimize
from .starts import chosen_rows


def suspicions(problem: Problem, model: Reflectance, values: np.ndarray) -> Iterator[str]:
    """A sentence for each; `model` and the numbers `values` are what was fitted. Nothing is changed by them."""
    s = problem.samples
    median = float(np.median(s.f[s.valid]))
    try:
        reflected = float(np.max(albedo(model, [0.0, 0.0, 1.0], tolerance=1e-2)))
    except Exception:  # a model without an integral is no reason to fail
        reflected = math.nan
    if reflected > 1.05:
        text = f"the model reflects {reflected:.2f} of the light at normal incidence, more than there is"
        yield f"{text}; are the values reflectance factors (pi f)? values/pi would reflect {reflected / math.pi:.2f}"
    elif median > 1.5:
        yield f"half of the values are above {median:.3g} /sr; a white surface has 0.32; in percent, or pi f?"
    cosines = _with_cosine(problem, values)
    if cosines is not None:
        yield cosines


def _with_cosine(problem: Problem, values: np.ndarray) -> str | None:
    """A sentence where the data divided by cos(theta_o) are fitted much better: they may hold f cos(theta_o)."""
    part = chosen_rows(problem.least_squares(), 0)
    s = part.samples
    if np.ptp(s.wo[:, 2]) < 0.3 or (s.f < 0.0).any():
        return None
    as_f = replace(part, loss="cosine", scale=1.0, samples=replace(s, u=None))
    divided = replace(as_f, samples=replace(s, u=None, f=s.f / s.wo[:, 2:]))
    start = problem.unknowns.internal(values)[None]
    shares = [_unexplained(this, start) for this in (as_f, divided)]
    if shares[0] > 1e-4 and shares[1] < 0.25 * shares[0]:
        return (
            f"f cos(theta_o) in place of f? Divided by cos(theta_o) the data are fitted better: {shares[1]:.2%} of "
            f"their variance is left in place of {shares[0]:.2%}"
        )
    return None


def _unexplained(problem: Problem, x: np.ndarray) -> float:
    """The share of the variance of what is compared that is left."""
    found = minimize(lambda at, _: problem.squares(at), x, problem.box, steps=30, tolerance=1e-4)
    target = problem._arrays[2][problem.samples.valid.T]
    total = float(((target - target.mean()) ** 2).sum())
    return float(found.squares.cost.min()) / total if total > 0.0 else 0.0
