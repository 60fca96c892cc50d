"""The facets of rough interfaces: how they reflect, are spread and shadow, and the shares of light they pass on."""

from __future__ import annotations

from typing import Any

import numpy as np

from .grid import gauss

NODES = 14
"""Nodes between two places where the integrals of `shares` have a kink: 2e-6."""

SOME = 4
"""Directions of which `shares` are computed at a time: the arrays of more do not stay in a processor's cache."""

NEVER = 1e9
"""A slope that is as good as infinite."""


def fresnel(cos: Any, eta: complex) -> Any:
    """Unpolarized reflectance of a facet, 1 where it is total; `eta`: index behind over index in front."""
    c2 = 1.0 - (1.0 - cos * cos) / (eta * eta)
    total = c2.real <= 0.0
    t = np.sqrt(np.where(total, 1.0, c2))
    s, p = (cos - eta * t) / (cos + eta * t), (eta * cos - t) / (eta * cos + t)
    return np.where(total, 1.0, 0.5 * (s * s + p * p))


def spread(z2: Any, across: Any, alpha: complex) -> Any:
    """GGX's D of a vector of any length, by the squares of its component along the normal and across."""
    d = alpha * alpha * z2 + across
    return alpha * alpha * (z2 + across) ** 2 / (np.pi * d * d)


def masking(mu: Any, alpha: complex) -> Any:
    """Smith's G_1 of GGX."""
    return 2.0 / (1.0 + np.sqrt(1.0 + alpha * alpha * (1.0 - mu * mu) / (mu * mu)))


def shares(mu: np.ndarray, eta: complex, alpha: complex) -> tuple[np.ndarray, np.ndarray]:
    """The shares of light from these directions that facets reflect, and refract, once: integrals over the facets.

    With slopes alpha tan(chi) sin^2(chi) of GGX's facets is uniform, and so is their azimuth phi. Rules of Gauss stand
    between the places where a facet is seen edge on, sends light along the horizon, or begins to reflect totally:
    there the integrand has a kink, or begins by a square root.
    """
    parts = [_shares(some, eta, alpha) for some in np.split(mu, range(SOME, len(mu), SOME))]
    return tuple(map(np.concatenate, zip(*parts, strict=True)))  # type: ignore[return-value]  # of two: two


def _shares(mu: np.ndarray, eta: complex, alpha: complex) -> tuple[np.ndarray, np.ndarray]:
    s = np.sqrt(1.0 - mu * mu)
    chi, weight = _between(np.arctan(np.stack(_slopes(mu, s, eta), axis=-1) / alpha), 0.5 * np.pi)
    weight = weight * np.sin(2.0 * chi)
    slope = alpha * np.tan(chi)
    length, tilted = np.sqrt(1.0 + slope * slope), s[:, None] * slope
    cosines = np.stack(_cosines(mu[:, None] * length, eta), axis=-1)
    turn = (mu[:, None, None] - cosines * length[..., None]) / tilted[..., None]  # cos(phi) where wi.wm is one of these
    inside = np.abs(turn.real) < 1.0
    ends = np.where(inside, np.arccos(np.where(inside, turn, 0.0)), np.where(turn.real > 0.0, 0.0, np.pi))
    phi, width = _between(ends, np.pi)
    facing = mu[:, None, None] - tilted[..., None] * np.cos(phi)  # wi.wm/wm.z
    z, mu_i = 1.0 / length[..., None], mu[:, None, None]
    seen = facing.real > 0.0
    cos = np.where(seen, facing * z, 1.0)
    up = 2.0 * cos * z - mu_i
    once = fresnel(cos, eta)
    c2 = 1.0 - (1.0 - cos * cos) / (eta * eta)
    down = mu_i / eta + (np.sqrt(np.where(c2.real > 0.0, c2, 1.0)) - cos / eta) * z

    def whole(share: Any, out: Any) -> Any:
        leaves = seen & (out.real > 0.0)
        f = np.where(leaves, facing * share * masking(np.where(leaves, out, 1.0), alpha), 0.0)
        return ((f * width).sum(axis=-1) * weight).sum(axis=-1) * masking(mu, alpha) / (np.pi * mu)

    return whole(once, up), whole(1.0 - once, down)


def _slopes(mu: Any, s: Any, eta: complex) -> list[Any]:
    """Slopes of facets, towards the light or away from it, where one of `_cosines` is met first or last."""
    found = [mu / s, (1.0 - s) / mu, mu / (1.0 - s)]
    if eta.real < 1.0:
        cos = np.sqrt(1.0 - eta * eta)  # of the critical angle
        for sign in (1.0, -1.0):
            across, along = s * cos + sign * mu * eta, mu * cos - sign * s * eta  # the angle +- critical
            steep = np.abs(along.real) < 1.0 / NEVER
            found += [np.where(steep, NEVER, across / np.where(steep, 1.0, along)), (eta + sign * s) / mu]
    return [np.where(x.real < 0.0, -x, x) for x in found]


def _cosines(k: Any, eta: complex) -> list[Any]:
    """wi.wm of facets seen edge on; that reflect along the horizon; that begin to reflect totally, or refract along the
    horizon. k: mu_i/wm.z."""
    found = [0.0 * k, 0.5 * k]
    if eta.real < 1.0:
        least = 1.0 - eta * eta
        found += [np.sqrt(least) + 0.0 * k, 0.5 * (k + least / k)]
    return found


def _between(ends: np.ndarray, last: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights from 0 to `last`, Gauss's between any two of the ends (..., k), close at both: their squares,
    or roots, are as smooth."""
    x, w = gauss(NODES)
    x, w = x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) * w
    edge = np.zeros((*ends.shape[:-1], 1))
    ends = np.sort(np.concatenate([edge, ends, edge + last], axis=-1), axis=-1)
    low, size = ends[..., :-1, None], np.diff(ends, axis=-1)[..., None]
    shape = (*ends.shape[:-1], -1)
    return (low + size * x).reshape(shape), (size * w).reshape(shape)
