"""Difference of a reflectance from its original, at pairs of directions and in albedo."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..base.angles import angles, direction, lattice_pairs
from ..base.reflectance import Reflectance
from ..errors import MissingDataWarning, ToleranceWarning
from ..formula import tree
from ..integrals.over_hemisphere import integrate
from ..numerics.lattice import lattice
from ..tables.gridded import Gridded
from ..tables.nodes import own_nodes

PAIRS = 1 << 15
"""Number of pairs of directions that are compared; fewer of many channels, see `pairs_for`."""

VALUES, FEWEST = 1 << 21, 1 << 10
"""Most values of f that are compared at once, and the fewest pairs whatever their channels."""

LEAST = 0.1
"""Cosine above which f is compared."""

ROUNDS = (0.1, 0.03, 0.01, 0.003)
"""How far [rad] from the worst pairs worse ones are looked for, one after the other."""

HIGHEST = math.radians(80.0)
"""Largest polar angle at which albedos are compared, but for those of the source."""

ALONG = 17
"""Number of polar angles at which albedos are compared beside those of the source and between those of the table."""

CHANNELS = 8
"""Channels whose albedos are compared, of many: those whose f changes most, and some spread over all."""

TOLERANCES = (1e-3, 1e-4)
"""Of the albedos among which the most changed ones are looked for, and of these."""

Channels = Sequence[int] | np.ndarray | None
"""The channels that are compared: their numbers, a matrix to multiply them by, or None for all."""

Pair = tuple[np.ndarray, np.ndarray]


class ResamplingError(NamedTuple):
    """Difference of a table from its original.

    mean, high   of |f - true f|/true f, or relative to 1/1000 of the mean true f where that is larger, at pairs of
                 directions spread evenly over those with cosines above 0.1; `high` is the 99th percentile; pairs
                 without data in one of both are left out
    largest      the same, at these pairs, at the source's own incidences, about the mirror direction, and around the
                 worst of all of them
    albedo       largest difference of albedos, at the source's own incidences, between those of the table, and at
                 others up to 80 degrees
    at           theta_i, theta_o, phi_o - phi_i [rad] of the largest error
    albedo_at    theta_i, phi_i [rad] of the largest difference of albedos

    Error        beside 8e5 random pairs and albedos every half degree up to 80, of 13 conversions: largest 0.84 to
                 1.4 of the largest of those; albedo 0.82 to 1.04, and once 1.5, found at an incidence beyond 80
    """

    mean: float
    high: float
    largest: float
    albedo: float
    at: tuple[float, float, float]
    albedo_at: tuple[float, float]


def pairs_for(*compared: Reflectance) -> int:
    """How many pairs of directions are compared, by the number of channels."""
    width = max(m.channels or 1 for m in compared)
    return min(PAIRS, max(FEWEST, VALUES // width))


def resampling_error(m: Reflectance, other: Reflectance, of: Channels = None, to: Channels = None) -> ResamplingError:
    """Difference of `other` in its channels `to` from `m` in its channels `of`; one channel is compared with all."""
    count = pairs_for(m, other)
    pairs = lattice_pairs(count)
    true, tabulated = _both(m, other, of, to, pairs)
    known = np.isfinite(true) & np.isfinite(tabulated)
    albedo, albedo_at = _albedo_change(m, other, of, to, np.where(known, np.abs(tabulated - true), 0.0).mean(axis=0))
    if not known.any():
        nothing = (math.nan, math.nan, math.nan)
        return ResamplingError(*nothing, albedo, nothing, albedo_at)
    floor = 1e-3 * np.abs(true[known]).mean() + 1e-30

    def worst(pairs: Pair) -> np.ndarray:
        true, tabulated = _both(m, other, of, to, pairs)
        return _relative(true, tabulated, floor).max(axis=1, initial=0.0)

    off = _relative(true, tabulated, floor)
    largest, (wi, wo) = _searched(worst, [(off.max(axis=1), pairs), *_special(worst, m, other, count)])
    (theta_i, phi_i), (theta_o, phi_o) = angles(wi), angles(wo)
    phi = (phi_o - phi_i + math.pi) % (2.0 * math.pi) - math.pi
    at = (float(theta_i), float(theta_o), float(phi))
    off = off[known]
    return ResamplingError(float(off.mean()), float(np.quantile(off, 0.99)), largest, albedo, at, albedo_at)


def _both(m: Reflectance, other: Reflectance, of: Channels, to: Channels, pairs: Pair) -> tuple[np.ndarray, np.ndarray]:
    """f (n, C) of both at pairs."""
    true, tabulated = (_picked(x.f(*pairs), len(pairs[0]), c) for x, c in ((m, of), (other, to)))
    return tuple(np.broadcast_arrays(true, tabulated))  # type: ignore[return-value]  # as many as are given: two


def _relative(true: np.ndarray, tabulated: np.ndarray, floor: float) -> np.ndarray:
    """|tabulated - true|/true, 0 where one of both is unknown."""
    with np.errstate(invalid="ignore"):
        off = np.abs(tabulated - true) / np.maximum(np.abs(true), floor)
    return np.where(np.isfinite(off), off, 0.0)


def _special(worst: Callable, m: Reflectance, other: Reflectance, count: int) -> list[tuple[np.ndarray, Pair]]:
    """Further pairs at which f is compared: at the source's own incidences and between the table's, with wo anywhere,
    and about the mirror direction, near it at all scales."""
    count //= 4
    u = lattice(count, 4)
    theta = np.arccos(1.0 - (1.0 - LEAST) * u[:, :2])
    own = _incidences(m, other, math.acos(LEAST))
    lit = direction(own[np.arange(count) % len(own)], 2.0 * math.pi * u[:, 2])
    anywhere = lit, direction(theta[:, 1], 2.0 * math.pi * u[:, 3])
    found = [anywhere]
    for wi in (lit, direction(theta[:, 0], 2.0 * math.pi * u[:, 2])):
        step = 10.0 ** (-3.0 + 2.7 * u[:, :1])
        across = np.stack([np.cos(2.0 * math.pi * u[:, 3]), np.sin(2.0 * math.pi * u[:, 3]), 0.0 * u[:, 3]], -1)
        found.append((wi, _unit(wi * [-1.0, -1.0, 1.0] + step * across)))
    kept = [(wi[high], wo[high]) for wi, wo in found for high in [np.minimum(wi[:, 2], wo[:, 2]) >= LEAST]]
    return [(worst(pairs), pairs) for pairs in kept if len(pairs[0])]


def _searched(worst: Callable, found: list[tuple[np.ndarray, Pair]]) -> tuple[float, tuple[np.ndarray, np.ndarray]]:
    """The largest error and its pair, after a search around the worst pairs."""
    off, wi, wo = (np.concatenate(x) for x in zip(*((off, *pairs) for off, pairs in found), strict=True))
    u = lattice(64, 6)
    for size in ROUNDS:
        best = np.argsort(off)[-8:]
        off, wi, wo = off[best], wi[best], wo[best]
        near = [_unit(w[:, None] + size * (2.0 * u[:, k : k + 3] - 1.0)).reshape(-1, 3) for w, k in ((wi, 0), (wo, 3))]
        high = np.minimum(near[0][:, 2], near[1][:, 2]) >= LEAST
        pair = near[0][high], near[1][high]
        off = np.concatenate([off, worst(pair)])
        wi, wo = np.concatenate([wi, pair[0]]), np.concatenate([wo, pair[1]])
    k = int(off.argmax())
    return float(off[k]), (wi[k], wo[k])


def _unit(w: np.ndarray) -> np.ndarray:
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


def _incidences(m: Reflectance, other: Reflectance, highest: float) -> np.ndarray:
    """Polar angles of wi [rad]: the source's own, those halfway between the table's and the source's, and others."""
    own, nodes = (own_nodes(x).get("theta_i", np.zeros(0)) for x in (m, other))
    between = [0.5 * (x[1:] + x[:-1]) for x in (own, nodes)]
    thinned = [
        x[np.unique(np.linspace(0, len(x) - 1, 2 * ALONG).round().astype(int))] for x in (own, *between) if len(x)
    ]
    theta = np.unique(np.concatenate([*thinned, np.linspace(0.0, HIGHEST, ALONG)]))
    return theta[theta <= highest]


def _albedo_change(
    m: Reflectance, other: Reflectance, of: Channels, to: Channels, changes: np.ndarray
) -> tuple[float, tuple[float, float]]:
    """The largest difference of albedos, and theta_i, phi_i [rad] of it. `changes` (C,): mean changes of f."""
    of, to = (_few(x, c, changes) for x, c in ((m, of), (other, to)))
    own = own_nodes(m).get("theta_i", np.zeros(1)).max()
    theta = _incidences(m, other, max(HIGHEST, own))
    isotropic = m.is_isotropic() and other.is_isotropic()
    phi = np.full(len(theta), 0.3) if isotropic else 2.0 * math.pi * lattice(len(theta), 1)[:, 0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)  # both have holes: what both know is compared
        warnings.simplefilter("ignore", ToleranceWarning)  # the tolerance is tightened where they differ most
        for tolerance in TOLERANCES:
            w = direction(theta, phi)
            before, after = (_albedos(x, w, c, tolerance) for x, c in ((m, of), (other, to)))
            off = np.abs(after - before).max(axis=-1)
            off = np.where(np.isfinite(off), off, 0.0)
            most = np.argsort(off)[-4:]
            if tolerance != TOLERANCES[-1]:
                theta, phi = theta[most], phi[most]
    k = int(off.argmax())
    return float(off[k]), (float(theta[k]), float(phi[k]))


def _few(m: Reflectance, channels: Channels, changes: np.ndarray) -> Channels:
    """`CHANNELS` of many: those that change most, and some spread over all."""
    if isinstance(channels, np.ndarray) or (m.channels or 1) <= CHANNELS:
        return channels
    numbers = np.arange(m.channels or 1) if channels is None else np.asarray(list(channels))
    if len(numbers) <= CHANNELS:
        return channels
    half = CHANNELS // 2
    chosen = {
        *np.argsort(changes)[-half:].tolist(),
        *np.linspace(0, len(numbers) - 1, half).round().astype(int).tolist(),
    }
    return numbers[sorted(chosen)].tolist()


def _albedos(m: Reflectance, w: np.ndarray, channels: Channels, tolerance: float) -> np.ndarray:
    """Albedos (n, C)."""
    if isinstance(channels, list) and len(channels) < (m.channels or 1):
        values = integrate(_of_channels(m, channels), w, tolerance).value.reshape(len(w), -1)
        return values if values.shape[1] == len(channels) else values[:, channels]  # not all tables can leave some out
    return _picked(integrate(m, w, tolerance).value, len(w), channels)


def _of_channels(m: Reflectance, channels: list[int]) -> Reflectance:
    """A reflectance with some of its channels, where it can leave the others out."""
    if isinstance(m, Gridded):
        names = [str(c) for c in channels]
        kept = {name: getattr(m, name) for name in ("periods", "interpolation", "outside")}
        return Gridded(
            m.parameterization, m.axes, m.brdf()[..., channels], channels=names, mirrored=m.is_mirrored, **kept
        )
    return tree.each(m, lambda x: x[..., channels] if np.ndim(x) and np.shape(x)[-1] > 1 else x)


def _picked(values: np.ndarray, count: int, channels: Channels) -> np.ndarray:
    values = values.reshape(count, -1)
    if isinstance(channels, np.ndarray):
        return values @ channels.T
    return values if channels is None else values[:, list(channels)]
