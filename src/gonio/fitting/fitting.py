"""`gn.fit`: the numbers of a model that come nearest to data, and how sure they are."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any

import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import Declared, Seed, checked
from ..errors import ParameterError
from ..evaluate.squares import Squares
from ..formula.text import listed
from .asked import By, LossName, PerChannel, RobustName, Starts, ThetaMax
from .losses import SCALES
from .problem import Problem, make_problem
from .result import Fit
from .samples import warn_of_missing
from .solver import Solved, minimize
from .starts import best_starts

KEPT = 2
"""Starts that are carried on with all data."""

TOGETHER, APART = 400, 4000
"""Unknowns at most: those that depend on each other, and all."""

SOLVERS = ("levenberg_marquardt", "scipy")

ROUNDS = 3
"""Times that the scale of residuals is taken from the residuals of a robust fit."""


@checked
def fit(
    data: Any,
    model: Reflectance,
    loss: LossName | None = None,
    *,
    robust: RobustName = "none",
    by: By | None = None,
    per_channel: PerChannel | None = None,
    weights: Any = None,
    theta_max: ThetaMax = 0.5 * math.pi,
    starts: Starts | None = None,
    seed: Seed = 0,
    solver: Annotated[
        str, Declared("ours, or scipy.optimize.least_squares from the best start", words=(*SOLVERS,))
    ] = "levenberg_marquardt",
) -> Fit:
    """The numbers of a model that come nearest to data: with standard errors, correlations, and where it is wrong.

    The sum of squares of weight * (compared(f of the model) - compared(f of the data)) is least. Bounds are those of
    the parameters. Numbers in which f is linear (albedos, weights of lobes) are solved for exactly at each start; the
    others start from many places within their bounds, on a part of the data, and the best go on with all of it.

    `data`: a measurement, or a path of one; arrays (wi, wo, f) or (wi, wo, f, u) with directions (N, 3), values (N,) or
    (N, C) [1/sr] and their standard uncertainties; an xarray.Dataset; a pandas.DataFrame with columns as those of a
    CSV table. A reflectance that is no table is sampled at 30 000 pairs.
    `loss`: what is compared: "plain" f; "cosine" f cos(theta_i); "log" ln(1 + f cos(theta_i)); "cube_root"
    (f cos(theta_i))^(1/3); "ratio" ln f; "likelihood" f over its uncertainty. Without it "likelihood" where the data
    have uncertainties, else "cosine".
    `robust`: "none"; or "huber", "soft_l1", "cauchy", with which outliers count less. Their scale is that of the
    residuals.
    `by`: names of the parameters that are fitted; all without it, but for those whose declaration says that fits keep
    them (`param(..., fitted=False)`): shapes of kernels. The others keep the numbers of `model`.
    `per_channel`: names of the parameters with a number for each channel, or True, or False. Without it those in
    which f is linear, and those of which the model has an array.
    `weights`: of the squares, (N,) or (N, C). `theta_max` [rad]: rows with a direction beyond it are left out.
    `starts`: how many; 1 goes from the numbers of `model` alone. `seed`: of where they are.
    `solver`: "levenberg_marquardt", ours; or "scipy", `scipy.optimize.least_squares` from the best start.

    Error    of the optimum: the next step would lower the cost by less than 1e-10 of it. Above 200 000 values f is
             computed in single precision, to 3e-6. Standard errors: see `Fit`.
    Source   Levenberg-Marquardt on normal equations, Nielsen 1999; elimination of linear unknowns: Golub & Pereyra
             1973. Losses: Ngan, Durand & Matusik 2005; Löw et al. 2012; Fores, Ferwerda & Gu 2012.

    Example
    >>> paint = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.05))
    >>> found = gn.fit(paint, gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick()))
    >>> for name, value in zip(found.names, found.values, strict=True):
    ...     print(name, value.round(6))
    ...
    0.rho 0.3
    1.distribution.alpha_x 0.2
    1.fresnel.F0 0.05
    """
    problem = make_problem(data, model, loss, robust, (by, per_channel), weights, theta_max)
    warn_of_missing(problem.samples)
    return fitted(problem, starts, seed, solver)


def fitted(problem: Problem, starts: int | None, seed: int, solver: str = SOLVERS[0]) -> Fit:
    """The fit of a problem."""
    _require_enough(problem)
    unknowns = problem.unknowns
    if unknowns.channels > 1 and problem.robust == "none" and all(f.by_channel for f in unknowns.free):
        return _channel_by_channel(problem, starts, seed, solver)
    if len(problem.names) > TOGETHER:
        several = listed([f.path for f in unknowns.free if not f.by_channel])
        raise ParameterError(
            f"{problem.samples.source}: {len(problem.names)} unknowns, expected at most {TOGETHER} that are found "
            f"together ({several} is shared by all channels); per_channel=True fits channels one by one, and m.at(...) "
            f"takes fewer"
        )
    wanted, problem = problem, problem.least_squares()
    solved, agreeing = _solved(problem, starts, seed, solver)
    if wanted.robust != "none":
        problem, solved = _robustly(wanted, solved, solver)
    return Fit.of(problem, solved, agreeing)


def _channel_by_channel(problem: Problem, starts: int | None, seed: int, solver: str) -> Fit:
    """The fit of a problem whose channels share no unknown."""
    u = problem.unknowns
    count = len(problem.names)
    if count > APART:
        rule = f"expected at most {APART}; m.at(...) takes fewer wavelengths"
        raise ParameterError(f"{problem.samples.source}: {count} unknowns in {u.channels} channels, {rule}")
    x, gradient, matrix = np.zeros(count), np.zeros(count), np.zeros((count, count))
    cost, ended, steps, agreeing = 0.0, True, 0, 1.0
    for c, at in enumerate(u.columns):
        one = problem.of_channel(c)
        found, share = _solved(one, starts, seed, solver)
        x[at], gradient[at], matrix[np.ix_(at, at)] = found.x[0], found.squares.gradient[0], found.squares.matrix[0]
        cost += float(found.squares.cost[0])
        ended, steps = ended and bool(found.ended[0]), max(steps, int(found.steps[0]))
        agreeing = min(agreeing, share)
    sums = Squares(np.array([cost]), gradient[None], matrix[None])
    return Fit.of(problem, Solved(x[None], sums, np.array([ended]), np.array([steps])), agreeing)


def _solved(problem: Problem, starts: int | None, seed: int, solver: str) -> tuple[Solved, float]:
    """The best optimum, and the share of the starts that came to it."""
    x, agreeing = best_starts(problem, starts, seed, KEPT)
    solved = _from(problem, x, solver)
    return solved.only(int(np.argmin(solved.squares.cost))), agreeing


def _from(problem: Problem, x: np.ndarray, solver: str) -> Solved:
    """The optima from starts (S, n) near them, where a step of all unknowns is as good as one of the curved alone."""
    if solver == "scipy":
        return _by_scipy(problem, x[:1])
    return minimize(problem.squares, x, problem.box._replace(is_linear=np.zeros(x.shape[1], bool)))


def _by_scipy(problem: Problem, x: np.ndarray) -> Solved:
    from scipy.optimize import least_squares

    u = problem.unknowns
    low, high = problem.bounds
    inside = np.clip(u.numbers(x[0]), np.nextafter(low, high), np.nextafter(high, low))
    found = least_squares(
        problem.residuals,
        inside,
        problem.jacobian,
        (low, high),
        x_scale="jac",
        loss={"none": "linear"}.get(problem.robust, problem.robust),
        ftol=1e-12,
        xtol=1e-12,
        gtol=1e-12,
    )
    at = u.internal(found.x)[None]
    return Solved(at, problem.squares(at), np.array([found.success]), np.array([found.nfev]))


def _robustly(wanted: Problem, solved: Solved, solver: str) -> tuple[Problem, Solved]:
    """The robust fit from the optimum of least squares, with the scale of its own residuals."""
    for _ in range(ROUNDS):
        x = solved.x
        r = replace(wanted, scale=1.0).residuals(wanted.unknowns.numbers(x[0]))
        r = np.abs(r[wanted.samples.valid.T.reshape(-1)])
        spread = 1.4826 * float(np.median(r))
        if not spread > 0.0:
            break
        wanted = replace(wanted, scale=SCALES[wanted.robust] * spread)
        solved = _from(wanted, x, solver) if solver == "scipy" else minimize(wanted.squares, x, wanted.box)
    return wanted, solved


def _require_enough(problem: Problem) -> None:
    s, n = problem.samples, len(problem.names)
    by_channel = s.valid.sum(axis=0)
    if s.count < n or (by_channel == 0).any():
        if (by_channel == 0).any() and s.count >= n:
            empty = [str(c) for c, k in zip(s.channels or ("",), by_channel, strict=True) if not k]
            raise ParameterError(
                f"{s.source}: channel {', '.join(empty)} holds no number; expected data in each channel"
            )
        rule = f"expected at least {n} for {n} unknowns ({listed(problem.names[:12])}); fix some by `by`"
        raise ParameterError(f"{s.source}: {s.count} values to fit; {rule}")
    for name, bound in zip(problem.names, zip(*problem.bounds, strict=True), strict=True):
        if not bound[0] < bound[1]:
            raise ParameterError(f"{name}: its bounds {bound} leave nothing to fit")
