"""How much a reflectance differs from another that it was made of: by pairs of directions, and in albedo."""

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
COSINE = 0.1
"""Pairs of directions that are compared have cosines above this."""

INCIDENCE = (0.0, 20.0, 40.0, 60.0, 80.0)
"""Polar angles [degrees] at which albedos are compared."""


Channels = Sequence[int] | np.ndarray | None
"""What of a reflectance's channels is compared: their numbers, a matrix that they are multiplied by, or all."""


class ResamplingError(NamedTuple):
    """How much a table differs from what it was made of, at pairs of directions with cosines above 0.1.

    mean, high, largest   of |f - true f|/true f, where true f is at least 1/1000 of its mean, else relative to that;
                          `high` is the 99th percentile; pairs without data on either side are left out
    albedo                largest difference of albedos at polar angles from 0 to 80 degrees
    at                    theta_i, theta_o, phi_o - phi_i [rad] where the error is largest
    """

    mean: float
    high: float
    largest: float
    albedo: float
    at: tuple[float, float, float]


def lattice_pairs(count: int, least: float = COSINE) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions whose cosines are at least `least`, evenly spread."""
    u = lattice(count, 4)
    theta = np.arccos(1.0 - (1.0 - least) * u[:, :2])
    return direction(theta[:, 0], 2.0 * math.pi * u[:, 2]), direction(theta[:, 1], 2.0 * math.pi * u[:, 3])


def resampling_error(m: Reflectance, made: Reflectance, of: Channels = None, to: Channels = None) -> ResamplingError:
    """What `made` differs from `m` by, in the channels `of` one and `to` those of the other; one channel is compared
    with every one."""
    wi, wo = lattice_pairs(PAIRS)
    true, tabulated = (_picked(x.f(wi, wo), len(wi), c) for x, c in ((m, of), (made, to)))
    true, tabulated = np.broadcast_arrays(true, tabulated)
    known = np.isfinite(true) & np.isfinite(tabulated)
    albedo = _albedo_change(m, made, of, to)
    if not known.any():
        return ResamplingError(math.nan, math.nan, math.nan, albedo, (math.nan, math.nan, math.nan))
    off = np.zeros(known.shape)
    np.subtract(tabulated, true, out=off, where=known)
    off = np.abs(off) / np.maximum(np.abs(np.where(known, true, 0.0)), 1e-3 * np.abs(true[known]).mean() + 1e-30)
    worst = np.unravel_index(np.argmax(off), off.shape)[0]
    (theta_i, phi_i), (theta_o, phi_o) = angles(wi[worst]), angles(wo[worst])
    turn = (phi_o - phi_i + math.pi) % (2.0 * math.pi) - math.pi
    every = off[known]
    at = (float(theta_i), float(theta_o), float(turn))
    return ResamplingError(float(every.mean()), float(np.quantile(every, 0.99)), float(every.max()), albedo, at)


def _albedo_change(m: Reflectance, made: Reflectance, of: Channels, to: Channels) -> float:
    w = direction(np.radians(INCIDENCE), 0.3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)
        before, after = (_picked(integrate(x, w, 1e-3), len(w), c) for x, c in ((m, of), (made, to)))
    return float(np.abs(after - before).max())


def _picked(values: np.ndarray, count: int, channels: Channels) -> np.ndarray:
    values = values.reshape(count, -1)
    if isinstance(channels, np.ndarray):
        return values @ channels.T
    return values if channels is None else values[:, list(channels)]
