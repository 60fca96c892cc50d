"""Merging of scans in planes of incidence into one grid, with averages where they overlap."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import angles, direction
from ..base.measured import Measured
from ..base.provenance import derived
from ..declared.arguments import checked
from ..errors import ParameterError
from ..formula import tree
from ..tables.gridded import Gridded
from ..tables.nodes import above, bracketed
from ..tables.rows import distinct, turned
from ..tables.scattered import Scattered
from ._cells import GridCells, reported, spread

SAME = 1e-4
"""Angles [rad] closer than this (0.006 degrees) are one node."""


class _Line(NamedTuple):
    """One scan along theta_o: its plane, increasing theta_o [rad] (n,), f (n, C) and u (n, C) or None."""

    theta_i: float
    phi_i: float
    phi: float
    theta_o: np.ndarray
    f: np.ndarray
    u: np.ndarray | None


@checked
def merge_scans(scans: Sequence[Measured], oriented: bool = False) -> Gridded:
    """Several measurements along theta_o, at one or more theta_i and azimuths each, as one grid of "angles".

    The merged grid has every theta_i, theta_o and phi = phi_o - phi_i at which there is a scan (with `oriented`: every
    theta_i, theta_o, phi_i and phi_o). Along theta_o each scan is interpolated linearly to the nodes of the others, and
    nowhere extrapolated; cells without a scan are holes. A measurement's value at theta_o = 0 belongs to all its
    azimuths, and a scan at theta_i = 0 to all azimuths of the grid (unless `oriented`).

    Where scans overlap, the result is their mean, weighted by 1/u^2, with u = 1/sqrt(sum 1/u^2); a plain mean if no
    scan has uncertainties. `figures`: "overlapping", the number of cells with several scans; "scatter_rms" and
    "scatter_largest", of their |f - mean|/mean; and "chi2", sum of (f - mean)^2/u^2 over the degrees of freedom: about
    1 if the uncertainties explain the scatter, more if scans differ by their scale or alignment.

    Raises ParameterError where channels differ, or only some of the scans have uncertainties.

    Example
    >>> theta_o = np.radians(np.arange(0.0, 81.0, 10.0))
    >>> scans = [
    ...     gn.Gridded("angles", {"theta_i": [theta_i], "theta_o": theta_o, "phi": [np.pi]}, np.full((1, 9, 1), 0.1))
    ...     for theta_i in np.radians([20.0, 40.0])
    ... ]
    >>> m = gn.repair.merge_scans(scans)
    >>> print(m.brdf().shape, np.degrees(m.axes["theta_i"]).round(1))
    (2, 9, 1) [20. 40.]
    """
    lines, names, quantities = _lines(scans, oriented)
    theta_i = distinct(np.array([x.theta_i for x in lines]), SAME)
    theta_o = distinct(np.concatenate([x.theta_o for x in lines]), SAME)
    phi = _circle([x.phi for x in lines if oriented or x.theta_i > SAME] or [0.0])
    phi_i = _circle([x.phi_i for x in lines] if oriented else [0.0])
    nodes = (theta_i, theta_o, phi_i, phi)
    total, weights, squares, counts = (np.zeros((*map(len, nodes), lines[0].f.shape[1])) for _ in range(4))
    on_nodes = [_on_nodes(line, *nodes, oriented) for line in lines]
    for index, f, w in on_nodes:
        total[index] += w * f
        weights[index] += w
        counts[index] += 1.0
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = total / weights
        u = np.sqrt(1.0 / weights)
    off = []
    for index, f, w in on_nodes:
        squares[index] += w * (f - mean[index]) ** 2
        several = counts[index] > 1
        off.append(((f - mean[index]) / np.abs(mean[index]))[several])
    rms, largest = spread(np.concatenate([x.ravel() for x in off]))
    several = counts > 1
    figures = {"overlapping": int(several.any(axis=-1).sum()), "scatter_rms": rms, "scatter_largest": largest}
    certain = lines[0].u is not None
    if certain:
        freedom = float((counts - 1.0)[several].sum())
        figures["chi2"] = float(squares[several].sum()) / freedom if freedom else math.nan
    axes: dict[str, Any] = {"theta_i": theta_i, "theta_o": theta_o}
    axes |= {"phi_i": phi_i, "phi_o": phi} if oriented else {"phi": phi}
    shape = (*map(len, axes.values()), *(() if names is None else (-1,)))
    values, u = (x.reshape(shape) for x in (mean, u))
    about = {"merged_from": [repr(m) for m in scans], "quantities": quantities}
    table = Gridded("angles", axes, values, uncertainty=u if certain else None, channels=names, about=about)
    covered, changes_of = (counts > 0).any(axis=-1), [np.abs(f - mean[index]) for index, f, _ in on_nodes if f.size]
    changes = {
        "cells": int(covered.sum()),
        "share": float(covered.mean()),
        "filled": 0,
        "largest": float(max((x.max() for x in changes_of), default=0.0)),
        "mean": float(np.mean([x.mean() for x in changes_of] or [0.0])),
    }
    table = tree.with_notes(table, provenance=derived(*scans))
    return reported(table, None, "merge_scans", {"scans": len(scans), "oriented": oriented}, changes, figures)


def _lines(scans: Sequence[Measured], oriented: bool) -> tuple[list[_Line], tuple | None, list[str]]:
    if not scans:
        raise ParameterError("merge_scans: got no scans, expected at least one measurement")
    names = {m.channel_names for m in scans}
    if len(names) > 1:
        raise ParameterError(f"merge_scans: channels differ: {' and '.join(map(repr, names)):.120}; expected the same")
    lines = [line for m in scans for line in _lines_of(m, oriented)]
    certain = [line.u is not None for line in lines]
    if any(certain) != all(certain):
        raise ParameterError(
            "merge_scans: some of the scans have uncertainties and others not; expected all or none, to weight them by"
        )
    if not lines:
        raise ParameterError("merge_scans: no scan holds a value; expected some")
    return lines, names.pop(), [m.quantity for m in scans]


def _lines_of(m: Measured, oriented: bool) -> Iterable[_Line]:
    """The lines along theta_o of a measurement."""
    wi, wo, f, u = _rows(m)
    (theta_i, phi_i), (theta_o, phi_o) = angles(wi), angles(wo)
    phi = phi_o if oriented else phi_o - phi_i
    turn = phi_i if oriented else 0.0 * phi_i
    rows = np.stack([theta_i, turn, phi], axis=-1)
    pole = theta_o < SAME
    keys = [_rounded(rows[:, k], k > 0) for k in range(3)]
    for key in sorted(set(zip(*(k[~pole].tolist() for k in keys), strict=True))):
        same = (keys[0] == key[0]) & ((keys[1] == key[1]) | (not oriented))
        at = np.flatnonzero(same & (pole | (keys[2] == key[2])))
        at = at[np.argsort(theta_o[at], kind="stable")]
        at = at[np.diff(theta_o[at], prepend=-1.0) > SAME]
        first = at[~pole[at]][0]
        yield _Line(theta_i[first], turn[first], phi[first], theta_o[at], f[at], None if u is None else u[at])


def _rows(m: Measured) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]:
    """wi, wo (n, 3), f (n, C) and u of all measured pairs."""
    if isinstance(m, Scattered):
        wi, wo = direction(m.rows[:, 0], m.rows[:, 1]), direction(m.rows[:, 2], m.rows[:, 3])
        f, u = (None if x is None else with_channels(x, 1) for x in m.row_brdf())
    elif isinstance(m, Gridded):
        cells = GridCells(m)
        wi, wo, f, u = cells.wi, cells.wo, cells.f, cells.u
    else:
        raise ParameterError(f"merge_scans: got {m!r:.80}, expected Gridded or Scattered measurements")
    assert f is not None
    use = above(wi, wo) & np.isfinite(f).all(axis=-1)
    return wi[use], wo[use], f[use], None if u is None else u[use]


def _rounded(values: np.ndarray, turning: bool) -> np.ndarray:
    """Whole numbers that are equal for equal angles."""
    steps = np.rint(values / SAME).astype(np.int64)
    return steps % round(2.0 * math.pi / SAME) if turning else steps


def _circle(phi: list[float]) -> np.ndarray:
    """Azimuths in [0, 2 pi), increasing, those closer than `SAME` once."""
    return distinct(turned(np.array(phi), SAME), SAME)


def _on_nodes(
    line: _Line, theta_i: np.ndarray, theta_o: np.ndarray, phi_i: np.ndarray, phi: np.ndarray, oriented: bool
) -> tuple[Any, np.ndarray, np.ndarray]:
    """Index of the cells that a line covers, with f and weights there (cells..., C)."""
    inside = np.flatnonzero((theta_o >= line.theta_o[0] - SAME) & (theta_o <= line.theta_o[-1] + SAME))
    at = np.clip(theta_o[inside], line.theta_o[0], line.theta_o[-1])
    f, u2 = _interpolated(at, line)
    i = _nearest(theta_i, line.theta_i, 0.0)
    everywhere = not oriented and line.theta_i <= SAME
    k = np.arange(len(phi)) if everywhere else np.array([_nearest(phi, line.phi, 2.0 * math.pi)])
    j = _nearest(phi_i, line.phi_i, 2.0 * math.pi)
    index = np.ix_(np.array([i]), inside, np.array([j]), k)
    f, w = (np.repeat(x[None, :, None, None, :], len(k), axis=3) for x in (f, 1.0 / u2))
    return index, f, w


def _interpolated(at: np.ndarray, line: _Line) -> tuple[np.ndarray, np.ndarray]:
    """f and variances (n, C) of a line at angles within it; variances 1 if it has no uncertainties."""
    x = line.theta_o
    if len(x) == 1:
        lower, upper, w = np.zeros(len(at), int), np.zeros(len(at), int), np.zeros(len(at))
    else:
        lower, w, _ = bracketed(x, at)
        upper = lower + 1
    w = w[:, None]
    f = (1.0 - w) * line.f[lower] + w * line.f[upper]
    if line.u is None:
        return f, np.ones(f.shape)
    return f, (1.0 - w) ** 2 * line.u[lower] ** 2 + w**2 * line.u[upper] ** 2


def _nearest(nodes: np.ndarray, angle: float, period: float) -> int:
    apart = np.abs(nodes - angle)
    if period:
        apart = np.minimum(apart % period, period - apart % period)
    return int(apart.argmin())
