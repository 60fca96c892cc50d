"""Difference of a reflectance from its original, at pairs of directions and in albedo."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..base.angles import angles, direction
from ..base.reflectance import Reflectance
from ..errors import MissingDataWarning
from ..integrals.over_directions import integrate
from ..numerics.lattice import lattice

PAIRS = 1 << 15
"""Number of pairs of directions that are compared."""

INCIDENCE = (0.0, 20.0, 40.0, 60.0, 80.0)
"""Polar angles [degrees] at which albedos are compared."""

Channels = Sequence[int] | np.ndarray | None
"""The channels that are compared: their numbers, a matrix to multiply them by, or None for all."""


class ResamplingError(NamedTuple):
    """Difference of a table from its original, at pairs of directions with cosines above 0.1.

    mean, high, largest   of |f - true f|/true f, or relative to 1/1000 of the mean true f where that is larger; `high`
                          is the 99th percentile; pairs without data in one of both are left out
    albedo                largest difference of albedos at polar angles from 0 to 80 degrees
    at                    theta_i, theta_o, phi_o - phi_i [rad] of the largest error
    """

    mean: float
    high: float
    largest: float
    albedo: float
    at: tuple[float, float, float]


def lattice_pairs(count: int, least: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Evenly spread pairs of directions with cosines of at least `least`."""
    u = lattice(count, 4)
    theta = np.arccos(1.0 - (1.0 - least) * u[:, :2])
    return direction(theta[:, 0], 2.0 * math.pi * u[:, 2]), direction(theta[:, 1], 2.0 * math.pi * u[:, 3])


def resampling_error(m: Reflectance, other: Reflectance, of: Channels = None, to: Channels = None) -> ResamplingError:
    """Difference of `other` in its channels `to` from `m` in its channels `of`; one channel is compared with all."""
    wi, wo = lattice_pairs(PAIRS)
    true, tabulated = (_picked(x.f(wi, wo), len(wi), c) for x, c in ((m, of), (other, to)))
    true, tabulated = np.broadcast_arrays(true, tabulated)
    known = np.isfinite(true) & np.isfinite(tabulated)
    albedo = _albedo_change(m, other, of, to)
    if not known.any():
        return ResamplingError(math.nan, math.nan, math.nan, albedo, (math.nan, math.nan, math.nan))
    pair, _ = np.nonzero(known)
    true, tabulated = true[known], tabulated[known]
    off = np.abs(tabulated - true) / np.maximum(np.abs(true), 1e-3 * np.abs(true).mean() + 1e-30)
    worst = pair[off.argmax()]
    (theta_i, phi_i), (theta_o, phi_o) = angles(wi[worst]), angles(wo[worst])
    phi = (phi_o - phi_i + math.pi) % (2.0 * math.pi) - math.pi
    at = (float(theta_i), float(theta_o), float(phi))
    return ResamplingError(float(off.mean()), float(np.quantile(off, 0.99)), float(off.max()), albedo, at)


def _albedo_change(m: Reflectance, other: Reflectance, of: Channels, to: Channels) -> float:
    w = direction(np.radians(INCIDENCE), 0.3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)
        before, after = (_picked(integrate(x, w, 1e-3), len(w), c) for x, c in ((m, of), (other, to)))
    return float(np.abs(after - before).max())


def _picked(values: np.ndarray, count: int, channels: Channels) -> np.ndarray:
    values = values.reshape(count, -1)
    if isinstance(channels, np.ndarray):
        return values @ channels.T
    return values if channels is None else values[:, list(channels)]
