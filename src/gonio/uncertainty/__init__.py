"""Measurement uncertainty: results of a measured table with the uncertainty that its values imply."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np

from ..declared.arguments import Declared, Seed, checked
from ..errors import MissingDataWarning, ParameterError, ShapeError, warn
from .functionals import LINEAR, linear, named
from .quoted import Quoted as Quoted
from .table import TableErrors

METHODS = ("first order", "Monte Carlo")

EXACT, TIGHTEST = 0.3, 1e-6
"""The largest error of an integral as a share of u, and the smallest tolerance that may follow from it."""


@checked
def with_uncertainty(
    function: Callable,
    *args: Any,
    correlation: str | float | Mapping[str, float] | None = None,
    method: Annotated[
        str, Declared("exact where the result is linear in the table; Monte Carlo for any function", words=(*METHODS,))
    ] = "first order",
    scale: Annotated[
        float, Declared("relative standard uncertainty of all values together, in addition", 0.0, unit="share")
    ]
    | None = None,
    draws: Annotated[int, Declared("tables that Monte Carlo draws", 2, 10_000_000)] = 1000,
    seed: Seed = 0,
    progress: Callable[[int, int], None] | None = None,
    **named_args: Any,
) -> Quoted:
    """`function(m, ...)` of a measured table m, with its standard uncertainty: by noise, and by interpolation.

        gn.with_uncertainty(gn.albedo, m, wi, correlation="independent")
        gn.with_uncertainty(m.f, wi, wo, correlation="common")

    u^2 = u_noise^2 + u_interpolation^2.

    u_noise          follows from the uncertainties of the values and from `scale`; 0 where none are stated.
      first order    f and its integrals are linear in the table, rho = sum c_k v_k, so that u^2 = c^T V c is exact,
                     with the covariance matrix V of the values: sum c_k^2 u_k^2 for independent errors,
                     (sum c_k u_k)^2 for one common to all. Of `f`, `f_angles`, `albedo`, `black_sky_albedo`,
                     `white_sky_albedo`, `reflectance`, `reflectance_factor` (without a sky). GUM, JCGM 100:2008, 5.2.
      Monte Carlo    any function that returns a number or an array: it is called with `draws` tables as they may have
                     been measured, values with normally distributed errors. JCGM 101:2008.
    u_interpolation  is rehearsed: nodes (of rows in no grid: half-planes, angles, rows) are left out, and the change
                     of the result is scaled to the spacing that there is; beyond the outermost nodes f may go on as it
                     rises or falls there, twice as fast; directions without data count by what is around them. What
                     noise alone makes of a change is taken off. See docs/uncertainty.md.

    `correlation`: that of the errors of the values, which no file says and which matters most: "independent"
    (repeatability), "common" to all values (calibration), common within a "channel", a correlation length [rad] along
    all angles, or a mapping from axes of the table and "channel" to correlation lengths [rad, nm], math.inf for errors
    that are common along an axis: R = product of exp(-d^2 / 2 length^2). Only a table that states no uncertainties
    needs none. `scale`: relative standard uncertainty of all values together, in addition; without it that of the
    measurement (`m.about["scale_uncertainty"]`).

    Error    u_noise: first order to 1 % (a sum over 2^13 to 2^18 pairs of directions, doubled until u changes by less
             than 0.5 %; measured: 0.3 %); Monte Carlo to a relative standard error of 1/sqrt(2 draws), 2 % for 1000.
             u_interpolation is an estimate. Of 1000 synthetic measurements 99 % of the results are within 3 u of the
             truth, 97 % within 2 u; it is 1.8 times the error in the median (benchmarks/uncertainty_campaign.txt).

    Example
    >>> theta = np.radians([0.0, 30.0, 60.0])
    >>> axes = {"theta_i": theta, "theta_o": theta, "phi": np.radians([0.0, 90.0, 180.0])}
    >>> m = gn.Gridded("angles", axes, np.full((3, 3, 3), 0.3), mirrored=True)
    >>> gn.with_uncertainty(gn.albedo, m, gn.direction(0.5, 0.0), scale=0.01)
    0.9425 ± 0.0094 (noise 0.0094, interpolation 0)
    """
    bound: Any = function
    if inspect.ismethod(bound):
        function, args = bound.__func__, (bound.__self__, *args)
    if not args:
        raise ParameterError("with_uncertainty(function, m, ...): got no measurement; expected it behind the function")
    errors, args = TableErrors(args[0], correlation, scale), args[1:]
    if method == "Monte Carlo":
        return _drawn(function, errors, args, named_args, draws, seed, progress)
    return _first_order(function, errors, args, named_args)


def _first_order(function: Callable, errors: TableErrors, args: tuple, named_args: dict[str, Any]) -> Quoted:
    of = linear(function, named(function, errors.m, args, named_args))
    if of is None:
        raise ParameterError(
            f"{getattr(function, '__name__', function)!s:.40}: not known to be linear in the table; expected one of "
            f"{', '.join(f.__name__ for f in LINEAR)}, or method='Monte Carlo'"
        )
    interpolation = errors.interpolation(of)
    if of.sampled and "tolerance" in inspect.signature(function).parameters and "tolerance" not in named_args:
        least = errors.least(of, interpolation)
        named_args = {**named_args, "tolerance": min(1e-4, max(TIGHTEST, EXACT * least))}
    value = function(errors.m, *args, **named_args)
    latent = errors.results(of, value, interpolation)
    u, u_noise, u_interpolation = (
        x.reshape(np.shape(value))[()] for x in (latent.u, latent.u_noise, latent.u_interpolation)
    )
    unknown = np.isnan(u) & ~np.isnan(value)
    if unknown.any():
        text = (
            f"the uncertainty of {unknown.sum()} of {unknown.size} results is unknown (NaN), because some values "
            f"behind them have none; fill it in, as m.with_brdf(m.brdf(), u)"
        )
        warn(text, MissingDataWarning)
    return Quoted(value, u, u_noise, u_interpolation, value, "first order", errors.assumed, latent)


def _drawn(
    function: Callable,
    errors: TableErrors,
    args: tuple,
    named_args: dict[str, Any],
    draws: int,
    seed: int,
    progress: Callable[[int, int], None] | None,
) -> Quoted:
    if np.isnan(errors.u[~np.isnan(errors.m.brdf().reshape(errors.u.shape))]).any():
        raise ParameterError(
            "Monte Carlo: the uncertainty of some values is unknown (NaN); fill those in, as m.with_brdf(m.brdf(), u)"
        )
    random = np.random.default_rng(seed)
    at_estimate = _numbers(function(errors.m, *args, **named_args))
    results: list[np.ndarray] = []
    for done in range(draws):
        results.append(_numbers(function(errors.draw(random), *args, **named_args)))
        if results[-1].shape != at_estimate.shape:
            raise ShapeError(
                f"Monte Carlo: the function gave shape {at_estimate.shape} for the table as it is, but "
                f"{results[-1].shape} for a drawn one; expected the same for every table"
            )
        if progress is not None:
            progress(done + 1, draws)
    drawn = np.stack(results)
    value, u_noise = drawn.mean(axis=0)[()], drawn.std(axis=0, ddof=1)[()]
    parts = _interpolation(function, errors, args, named_args, at_estimate)
    u_interpolation = np.sqrt((parts**2).sum(axis=-1))[()]
    unseen = np.random.default_rng([seed, 1]).standard_normal((draws, parts.shape[-1]))
    drawn = drawn + np.tensordot(unseen, parts, (1, -1))
    u = np.hypot(u_noise, u_interpolation)[()]
    method = f"Monte Carlo, {draws} draws"
    return Quoted(value, u, u_noise, u_interpolation, at_estimate[()], method, errors.assumed, draws=drawn)


def _interpolation(
    function: Callable, errors: TableErrors, args: tuple, named_args: dict[str, Any], at_estimate: np.ndarray
) -> np.ndarray:
    """Standard uncertainties (..., parts) by interpolation; of functions not known to be linear by rehearsals alone."""
    of = linear(function, named(function, errors.m, args, named_args)) if function in LINEAR else None
    if of is not None:
        return errors.interpolation(of).reshape(*at_estimate.shape, -1)
    changes = []
    for share, tables in errors.rehearsal.left_out():
        odd, even = (np.nan_to_num(at_estimate - _numbers(function(t, *args, **named_args))) for t in tables)
        changes += [share * (odd + even), 0.5 * (odd - even)]
    return np.stack([np.zeros(at_estimate.shape), *changes], axis=-1)


def _numbers(result: Any) -> np.ndarray:
    try:
        return np.asarray(result, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(
            f"Monte Carlo: the function returned {type(result).__name__}; expected a number or an array of numbers"
        ) from None
