"""Nodes for tables of any reflectance: those of a measurement, no more than f needs; and f at them, also where some
are below the horizon."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..formula.direction import HORIZON
from ..numerics.lattice import lattice
from .angle_systems import AZIMUTHS, AngleSystem

GRAZING = 1e-3
"""Least cosine of the polar angles of `own_nodes`."""

PROBES = 512
"""Pairs of directions at which `needed` compares."""

COUNTS = (2, 3, 5, 9)
"""Numbers of nodes along an axis that `needed` tries."""

ROUNDING = 1e-9
"""Difference from f, relative to its mean, that `needed` takes for none."""


def above(wi: np.ndarray, wo: np.ndarray, least: float = HORIZON) -> np.ndarray:
    """Whether both directions of pairs (..., 3) have cosines above `least`."""
    return (wi[..., 2] > least) & (wo[..., 2] > least)


def f_at(m: Any, wi: np.ndarray, wo: np.ndarray, below: float = np.nan, least: float = HORIZON) -> np.ndarray:
    """f (...) or (..., C) at pairs of directions (..., 3); `below` where one of the two is below the horizon."""
    wi, wo = np.broadcast_arrays(wi, wo)
    up = above(wi, wo, least)
    values = m.f(wi[up], wo[up])
    f = np.full((*up.shape, *values.shape[1:]), below)
    f[up] = values
    return f


def channels_named(count: int) -> tuple[str, ...]:
    """Names for channels without names: those of colours if there are three, else numbers."""
    return ("R", "G", "B") if count == 3 else tuple(map(str, range(count)))


def own_nodes(m: Any) -> dict[str, np.ndarray]:
    """The nodes [rad] of the angles that a measurement was taken at, by their names, those on the horizon at a cosine
    of `GRAZING`; of azimuths only whole circles. Nothing for other reflectances."""
    axes = {name: np.asarray(x, float) for name, x in getattr(m, "axes", {}).items()}
    kept = {}
    for name, x in axes.items():
        if name in ("theta_i", "theta_o"):
            kept[name] = np.unique(np.minimum(x, np.arccos(GRAZING)))
        elif name in AZIMUTHS and len(x) > 2 and 2.0 * np.pi - np.ptp(x) < 1.5 * np.diff(x).max():
            kept[name] = x
    return {name: x for name, x in kept.items() if len(x)}


def needed(
    m: Any, system: AngleSystem, axes: Mapping[str, np.ndarray], periods: Mapping[str, float] | None = None
) -> dict[str, np.ndarray]:
    """The axes, each with the fewest nodes between which f is linear along it: two where f does not depend on it.

    Measured, at pairs of directions spread over the grid; an axis along which f bends keeps its nodes.
    """
    u = lattice(PROBES, len(axes))
    around = {name: float((periods or {}).get(name, 2.0 * np.pi)) for name in axes if name in AZIMUTHS}
    at = {
        name: x[0] + u[:, k] * (around.get(name, x[-1] - x[0]) if len(x) > 1 else 0.0)
        for k, (name, x) in enumerate(axes.items())
    }

    def f(**angles: np.ndarray) -> np.ndarray:
        return f_at(m, *system.pairs(*(at | angles).values())).reshape(PROBES, -1)

    true = f()
    known = np.isfinite(true).all(axis=1)
    tolerance = ROUNDING * np.abs(true[known]).mean() if known.any() else 0.0
    fewest = {}
    for name, x in axes.items():
        fewest[name] = x
        for count in COUNTS:
            if count >= len(x):
                break
            nodes = _spread(x, count, around.get(name))
            low, weight, closed = bracketed(nodes, at[name], around.get(name))
            ends = np.stack([f(**{name: closed[low + k]}) for k in (0, 1)])
            shares = np.where(np.isfinite(ends), np.stack([1.0 - weight, weight])[..., None], 0.0)
            with np.errstate(invalid="ignore", divide="ignore"):  # as a table leaves out nodes without data
                linear = (shares * np.nan_to_num(ends)).sum(axis=0) / shares.sum(axis=0)
            if (np.abs(linear - true)[known] <= tolerance).all():
                fewest[name] = nodes
                break
    return fewest


def _spread(x: np.ndarray, count: int, period: float | None) -> np.ndarray:
    """So many of the nodes of an axis with its ends; of a circle, so many around it."""
    if period is not None:
        return x[0] + period * np.arange(count) / count
    return x[np.linspace(0, len(x) - 1, count).round().astype(int)]


def bracketed(
    nodes: np.ndarray, angle: np.ndarray, period: float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The number of the node below each angle, the weight of the next, and the nodes, closed around a circle."""
    closed = nodes if period is None else np.append(nodes, nodes[0] + period)
    low = np.clip(np.searchsorted(closed, angle, side="right") - 1, 0, len(closed) - 2)
    return low, (angle - closed[low]) / (closed[low + 1] - closed[low]), closed
