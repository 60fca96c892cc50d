"""`gn.planning.plan`: the directions in which to measure, so that the numbers of a model become as sure as can be."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any

import numpy as np

from ...base.angles import angles
from ...base.reflectance import Reflectance
from ...base.sides import require_finite
from ...declared.arguments import Declared, Seed, checked
from ...errors import ParameterError, ShapeError, TraceError, shown
from ...fitting.asked import PerChannel
from ...fitting.covariance import NOTHING, PART, correlations
from ...fitting.problem import Problem
from ...fitting.result import Fit
from ...fitting.samples import Samples, real, samples, suspected_lengths
from ...fitting.unknowns import Unknowns, unknowns
from ...formula.text import listed
from .asked import Floor, Noise
from .exchange import Information, best_choice, covariance_of, goodness_of
from .goniometer import Goniometer
from .misfit import ERRORS, smooth_errors
from .plan import CRITERIA, Plan

MOST = 200
"""Directions that are planned at most: a choice of so many takes so many times as long. More are repeats of a plan."""

FAINT = 1e-3
"""Share of the largest value below which a planned one is told: relative noise may not hold there."""


@checked
def plan(
    model: Reflectance | Sequence[Reflectance],
    count: Annotated[int, Declared("how many pairs of directions", 1, MOST)],
    criterion: Annotated[
        str,
        Declared(
            "D, least determinant of the covariance; or A, least sum of squares of the relative errors",
            words=(*CRITERIA,),
        ),
    ] = "D",
    *,
    goniometer: Goniometer | None = None,
    noise: Noise = 0.01,
    floor: Floor = 0.0,
    misfit: Annotated[
        float, Declared("standard error of the model itself, smooth in the angles", 0.0, 1.0, "share")
    ] = 0.0,
    by: Annotated[Iterable[str], Declared("parameters that will be fitted, all without it")] | None = None,
    per_channel: PerChannel | None = None,
    repeats: Annotated[bool, Declared("a pair of directions may be taken more than once")] = False,
    measured: Annotated[str | os.PathLike[str] | Any, Declared("what is known already: a file, say")] | None = None,
    candidates: Any = None,
    starts: Annotated[int, Declared("random sets of pairs to begin from", 1, 10_000)] = 8,
    seed: Seed = 0,
) -> Plan:
    """The `count` pairs of directions that a goniometer can set, of which f tells most about the numbers of a model.

    The information of a plan is J^T J, J the exact derivatives of f over its uncertainty u,
    u^2 = (noise f)^2 + floor^2, at the numbers of `model`, those to be expected; its inverse is the covariance of a
    fit. Pairs are chosen one by one, then each is exchanged for the best other one until none helps, from several
    starts.

    `model`: with several, of one structure, the criterion is the mean over all.
    `criterion`: "D", the least determinant of the covariance, which no unit or scale of a parameter enters; or "A", the
    least sum of squares of the relative standard errors.
    `goniometer`: the limits; without it polar angles to 75 degrees in steps of 2.5, azimuths in steps of 5, light and
    detector 5 degrees apart. `candidates`: (wi, wo) with (N, 3) each, in its place: the pairs to choose from.
    `noise`: relative standard uncertainty of a value. `floor`: absolute [1/sr].
    `misfit`: by how much the model itself may be off, relative, root mean square: no material is its model. The
    error is a smooth function of the half and difference angles, the same wherever these are alike, and enters the
    expected errors. A plan without it leans on directions where only an exact model can be trusted.
    `by`, `per_channel`: what will be fitted, as for `gn.fit`.
    `repeats`: whether a pair may be taken more than once.
    `measured`: what is known already: a `Fit` of the same parameters, a measurement, (wi, wo, f) or (wi, wo, f, u);
    without u its uncertainty is that of `noise` and `floor`.
    `starts`: how many; `seed`: of the random ones.

    Shapes   wi, wo of the plan: (count, 3).
    Units    f and floor: 1/sr.
    Error    the plan is a local optimum, of several starts. What it promises, and what it is worth beside regular
             directions: see `Plan`. It is as good as the model: `misfit`, several expected models and a floor make it
             hold more.
    Source   Fedorov 1972, "Theory of Optimal Experiments"; Cook & Nachtsheim 1980, Technometrics 22, 315 (exchanges of
             one at a time); Atkinson, Donev & Tobias 2007, "Optimum Experimental Designs, with SAS".

    Example
    >>> paint = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.04))
    >>> planned = gn.planning.plan(paint, 12)
    >>> print(len(planned), planned.names)
    12 ('0.rho', '1.distribution.alpha_x', '1.fresnel.F0')
    """
    models = [model] if isinstance(model, Reflectance) else list(model)
    if not models:
        raise ParameterError("model: got no models; expected one, or several of one structure")
    check_noise(noise, floor)
    if isinstance(measured, Fit) and by is None and per_channel is None:
        fitted = measured.problem.unknowns
        by = [f.path for f in fitted.free]
        per_channel = [f.path for f in fitted.free if f.by_channel] or None
    every = [_unknowns(m, models[0], by, per_channel) for m in models]
    isotropic = all(m.is_isotropic() for m in models)
    wi, wo = pairs_of(goniometer, candidates, isotropic)
    tellers = [_Teller(u, noise, floor, misfit) for u in every]
    expected = [teller.f(wi, wo) for teller in tellers]
    usable = np.all([_usable(f, noise, floor) for f in expected], axis=0)
    if not usable.any():
        raise ParameterError(
            f"{models[0]!r:.80}: f is 0 or no number at all {len(wi)} pairs of directions; expected a floor above 0, "
            f"or other limits of the goniometer"
        )
    wi, wo = wi[usable], wo[usable]
    known_before = [_known(measured, teller) for teller in tellers]
    infos = [
        Information.of(teller.rows(wi, wo), before, teller.values)
        for teller, before in zip(tellers, known_before, strict=True)
    ]
    names = every[0].names
    _require_enough(infos, names, count, repeats, models, isotropic)
    if criterion == "A":
        for teller in tellers:
            for name, value in zip(names, teller.values, strict=True):
                if value == 0.0:
                    raise ParameterError(
                        f"criterion='A': {name} is 0, and has no relative error; expected another number, "
                        f"criterion='D', or `by` without it"
                    )
    chosen = best_choice(infos, count, criterion, repeats, starts, seed)
    chosen = chosen[order_of(wi[chosen], wo[chosen])]
    matrices = [info.matrix(chosen) for info in infos]
    _require_determined(matrices, names, count)
    covariances = [
        covariance_of(matrix) * info.size[:, None] * info.size for matrix, info in zip(matrices, infos, strict=True)
    ]
    if criterion == "D":
        value = float(np.mean([np.linalg.slogdet(c)[1] for c in covariances]))
    else:
        value = float(np.mean([(np.diag(c) / t.values**2).sum() for c, t in zip(covariances, tellers, strict=True)]))
    goodness = goodness_of(matrices, infos, criterion)
    flat = np.abs(wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]) < 1e-9
    covariance = np.mean(covariances, axis=0)
    f = tellers[0].f(wi[chosen], wo[chosen])
    return Plan(
        wi[chosen],
        wo[chosen],
        f if models[0].channels is not None else f[:, 0],
        names,
        tellers[0].values,
        covariance,
        criterion,
        value,
        _equivalent(infos, goodness, criterion),
        _equivalent([info.at(flat) for info in infos], goodness, criterion) if flat.any() else math.inf,
        {} if measured is None else _errors_before(infos, names),
        noise,
        floor,
        misfit,
        tuple(_notes(every[0], f, usable, noise, floor, misfit, covariance)),
        models[0],
    )


def check_noise(noise: float, floor: float) -> None:
    """Raises ParameterError where values would be exact."""
    if not noise + floor > 0.0:
        raise ParameterError(f"noise={noise:g}, floor={floor:g}: expected one of them above 0")


def _unknowns(m: Reflectance, first: Reflectance, by: Any, per_channel: Any) -> Unknowns:
    require_finite(m)
    if m.channels != first.channels:
        raise ParameterError(
            f"model: {m!r:.80} has channels {m.channels}, the first model {first.channels}; expected one structure"
        )
    try:
        free = unknowns(m, m.channels or 1, by, per_channel)
        names = free.names if m is first else unknowns(first, m.channels or 1, by, per_channel).names
    except TraceError as error:
        raise ParameterError(f"{m!r:.80}: has no derivatives: {error}") from None
    if free.names != names:
        raise ParameterError(
            f"model: {m!r:.80} has the parameters {listed(free.names)}, the first model {listed(names)}; expected one "
            f"structure"
        )
    return free


def pairs_of(goniometer: Goniometer | None, candidates: Any, isotropic: bool) -> tuple[np.ndarray, np.ndarray]:
    """The pairs of directions (N, 3) to choose from."""
    if candidates is None:
        return (goniometer or Goniometer()).pairs(isotropic)
    if goniometer is not None:
        raise ParameterError("candidates and goniometer: expected one of them; select those within the limits yourself")
    if not isinstance(candidates, (tuple, list)) or len(candidates) != 2:
        raise ParameterError(f"candidates={shown(candidates)}: expected (wi, wo) with directions (N, 3)")
    wi, wo = (real(name, w) for name, w in zip(("wi", "wo"), candidates, strict=True))
    if wi.ndim != 2 or wi.shape != wo.shape or wi.shape[1] != 3 or not len(wi):
        raise ShapeError(f"candidates: got shapes {wi.shape} and {wo.shape}; expected (N, 3) for both")
    for name, w in (("wi", wi), ("wo", wo)):
        suspected_lengths(f"candidates, {name}", w)
    up = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
    if not up.any():
        raise ParameterError(
            f"candidates: none of {len(wi)} pairs is above the surface; expected directions with z > 0"
        )
    return wi[up], wo[up]


class _Teller:
    """What values tell of the unknowns of a model: derivatives over uncertainties."""

    def __init__(self, unknowns: Unknowns, noise: float, floor: float, misfit: float):
        self.unknowns, self.noise, self.floor, self.misfit = unknowns, noise, floor, misfit
        self.values = unknowns.numbers(unknowns.start)
        self.errors = unknowns.channels * ERRORS if misfit else 0

    def f(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """(N, C) expected values."""
        u = self.unknowns
        return np.array(np.broadcast_to(np.reshape(u.model.f(wi, wo), (len(wi), -1)), (len(wi), u.channels)))

    def rows(self, wi: np.ndarray, wo: np.ndarray, u: np.ndarray | None = None, valid: Any = True) -> np.ndarray:
        """(N, C, n + q) derivatives over the uncertainties u (N, C), or over those of the noise.

        By the unknowns, then by the coefficients of the model's own error in each channel, which are of the size of 1.
        """
        f = self.f(wi, wo)
        u = np.hypot(self.noise * f, self.floor) if u is None else u
        valid = np.broadcast_to(valid, f.shape) & (u > 0.0)
        data = Samples(wi, wo, f, np.where(valid, u, 1.0), valid, None, {}, "")
        jacobian = Problem(data, self.unknowns, "likelihood", "none", 1.0).jacobian(self.values)
        rows = np.moveaxis(jacobian.reshape(f.shape[1], len(wi), -1), 0, 1)
        if self.misfit:
            share = np.where(valid, self.misfit * f / np.where(valid, u, 1.0), 0.0)
            off = share[:, :, None, None] * np.eye(f.shape[1])[:, :, None] * smooth_errors(wi, wo)[:, None, None]
            rows = np.concatenate([rows, off.reshape(*f.shape, -1)], axis=2)
        return np.where(np.isfinite(rows), rows, 0.0)


def _usable(f: np.ndarray, noise: float, floor: float) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return (np.isfinite(f) & (np.hypot(noise * f, floor) > 0.0)).all(axis=1)


def _known(measured: Any, teller: _Teller) -> np.ndarray:
    """The information (n, n + q) of what was measured."""
    names = teller.unknowns.names
    nothing = np.zeros((len(names), len(names) + teller.errors))
    if measured is None:
        return nothing
    if isinstance(measured, Fit):
        if measured.names != names:
            raise ParameterError(
                f"measured: a fit of {listed(measured.names)}; expected one of {listed(names)}: "
                f"gn.planning.plan(fit.model, count, measured=fit)"
            )
        nothing[:, : len(names)] = _of_fit(measured)
        return nothing
    data = samples(measured, called="measured")
    if data.f.shape[1] != teller.unknowns.channels:
        raise ShapeError(
            f"measured: {data.source} has {data.f.shape[1]} channels; expected {teller.unknowns.channels}, as the model"
        )
    rows = teller.rows(data.wi, data.wo, data.u, data.valid)
    rows = rows.reshape(-1, rows.shape[2])
    information: np.ndarray = rows[:, : len(names)].T @ rows
    return information


def _of_fit(fit: Fit) -> np.ndarray:
    """The information of a fit: the inverse of its covariance, without those parts that the data say nothing about.

    Of a likelihood A = J^T J; otherwise A S^-1 A (N - n)/N, S the sum of squared slopes of the costs. Numbers at their
    bounds are counted as if they were not.
    """
    problem = fit.problem
    u = problem.unknowns
    x = u.internal(fit.values)[None]
    slopes = u.slopes(x[0])
    found = problem.squares(x).matrix[0] / slopes[:, None] / slopes
    if problem.loss == "likelihood" and problem.robust == "none":
        return found
    scores = problem.score_squares(x)[0] / slopes[:, None] / slopes
    size = np.sqrt(np.where(np.diag(scores) > 0.0, np.diag(scores), 1.0))
    inverse = np.linalg.pinv(scores / size[:, None] / size, rcond=NOTHING, hermitian=True) / size[:, None] / size
    information: np.ndarray = found @ inverse @ found * (max(fit.free, 1) / fit.used)
    return 0.5 * (information + information.T)


def _unsure(matrix: np.ndarray, names: Sequence[str]) -> list[str]:
    """Names of the unknowns that an information matrix (n, n) or (n, n + q) does not determine."""
    matrix = matrix[:, : len(matrix)]
    diagonal = np.diag(matrix)
    size = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(matrix / size[:, None] / size)
    lost = (np.abs(vectors[:, values <= NOTHING * max(values[-1], 1e-300)]) > PART).any(axis=1) | ~(diagonal > 0.0)
    return [name for name, out in zip(names, lost, strict=True) if out]


def _require_enough(
    infos: Sequence[Information],
    names: Sequence[str],
    count: int,
    repeats: bool,
    models: Sequence[Reflectance],
    isotropic: bool,
) -> None:
    """Raises ParameterError where no plan can determine all unknowns, which are then said."""
    candidates, channels = infos[0].rows.shape[:2]
    for info, m in zip(infos, models, strict=True):
        if unsure := _unsure(info.known + info.mean, names):
            advice = "" if isotropic else "; a range of phi_i lets the sample be turned"
            raise ParameterError(
                f"{m!r:.80}: no choice of {candidates} pairs of directions determines {listed(unsure)}; expected `by` "
                f"without some of them, or wider limits of the goniometer{advice}"
            )
    rank = max(int(np.linalg.matrix_rank(info.known[:, : len(names)], tol=1e-12, hermitian=True)) for info in infos)
    if count * channels < len(names) - rank:
        least = math.ceil((len(names) - rank) / channels)
        raise ParameterError(
            f"count={count}: expected at least {least} pairs of directions for {len(names)} unknowns "
            f"({listed(names[:12])}); more, or fix some by `by`"
        )
    if not repeats and count > candidates:
        raise ParameterError(
            f"count={count}: expected at most {candidates}, the pairs of directions there are; "
            f"smaller steps, or repeats=True"
        )


def _require_determined(matrices: Sequence[np.ndarray], names: Sequence[str], count: int) -> None:
    for matrix in matrices:
        if unsure := _unsure(matrix, names):
            raise ParameterError(
                f"count={count}: so few pairs of directions do not determine {listed(unsure)}; expected more, or `by` "
                f"without some"
            )


def order_of(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """An order for the arms: theta_i, phi_i, phi, theta_o."""
    (theta_i, phi_i), (theta_o, phi_o) = (angles(w) for w in (wi, wo))
    keys = (theta_o, (phi_o - phi_i + 1e-9) % (2.0 * math.pi), phi_i, theta_i)
    return np.lexsort([key.round(9) for key in keys])


def _equivalent(infos: Sequence[Information], goodness: float, criterion: str) -> float:
    """How many directions, taken alike from all candidates, have a goodness; inf where none have."""
    means = [info.mean for info in infos]
    if any(_unsure(info.known + mean, [""] * len(mean)) for info, mean in zip(infos, means, strict=True)):
        return math.inf
    low, most = -3.0, 12.0
    high = most
    for _ in range(60):
        middle = 0.5 * (low + high)
        matrices = [info.known + 10.0**middle * mean for info, mean in zip(infos, means, strict=True)]
        if goodness_of(matrices, infos, criterion) < goodness:
            low = middle
        else:
            high = middle
    return 10.0**high if high < most else math.inf


def _errors_before(infos: Sequence[Information], names: Sequence[str]) -> dict[str, float]:
    """Standard errors of what was measured before; inf for what it does not determine."""
    before, size = infos[0].known[:, : len(names)], infos[0].size
    unsure = _unsure(before, names)
    variance = np.diag(np.linalg.pinv(before, rcond=NOTHING, hermitian=True)) * size**2
    return {
        name: math.inf if name in unsure else float(math.sqrt(max(v, 0.0)))
        for name, v in zip(names, variance, strict=True)
    }


def _notes(
    u: Unknowns, f: np.ndarray, usable: np.ndarray, noise: float, floor: float, misfit: float, covariance: np.ndarray
) -> Iterator[str]:
    """Sentences about a plan."""
    if not misfit:
        yield "the model is taken for exact, which no material is: misfit=0.03 expects it to be off by 3 %"
    if out := int((~usable).sum()):
        yield f"{out} of {len(usable)} pairs of directions were left out: f is 0 or no number there"
    if not floor and f.min() < FAINT * f.max():
        yield (
            f"f falls to {f.min():.2g} /sr, {f.min() / f.max():.1g} of the largest; where noise does not fall with it, "
            f"give a floor"
        )
    spread = np.sqrt(np.diag(covariance))
    numbers, low, high = (u.numbers(x) for x in (u.start, u.low, u.high))
    for name, value, s, a, b in zip(u.names, numbers, spread, low, high, strict=True):
        if min(value - a, b - value) < 2.0 * s:
            yield (
                f"{name} = {value:.4g} is within two standard errors of a bound, "
                f"{a if value - a < b - value else b:g}: a fit will be surer than this, and not symmetric"
            )
        elif value and s > 0.5 * abs(value):
            yield f"{name} would be known to {s / abs(value):.0%} only: more directions, or a fixed number, would help"
    correlation = correlations(covariance)
    for i, j in zip(*np.triu_indices(len(u.names), 1), strict=True):
        if abs(correlation[i, j]) > 0.95:
            yield f"{u.names[i]} and {u.names[j]} will be hard to tell apart (correlation {correlation[i, j]:+.3f})"
