"""Integrals of a reflectance over directions, by quadrature in the coordinates of its own sampling."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from . import batch, geometry, ops
from .errors import ArrayTypeError, MissingDataWarning, ShapeError
from .geometry import HORIZON, NORMAL, Direction
from .interface import Reflectance
from .quadrature import gauss_square

ORDERS = (16, 32, 64, 128, 256, 512)
"""Nodes per axis, tried in turn until two agree."""


def albedo(m: Reflectance, wi: Any, tolerance: float = 1e-4) -> Any:
    """Directional-hemispherical reflectance: the fraction of light arriving from wi that leaves, to all sides.

    rho(wi) = integral of f(wi, wo) cos(theta_o) dwo, delta lobes included exactly.

    Shapes   wi: (..., 3) NumPy array; result (...[, C]).
    Units    1.
    Error    Each lobe is integrated by Gauss–Legendre products in the unit square of its own sampling, with the
             number of nodes doubled until two results agree to a quarter of `tolerance`, absolute, and those
             before to 4 times `tolerance` (at most 512 by 512; at 89.9 degrees V-grooves then still err by up to 4e-4).
    Source   lecture 4, eq. 4.2; Nicodemus et al. 1977, NBS Monograph 160. Directions without measured data count
             as 0 and are reported by a MissingDataWarning.
    """
    return integrate(m, wi, tolerance, incident=True)


def integrate(
    m: Reflectance,
    w: Any,
    tolerance: float = 1e-4,
    incident: bool = True,
    radiance: Callable[[Any, Any], Any] | None = None,
) -> np.ndarray:
    """Integral over the hemisphere of f cos, times `radiance(w', index)` if given, lobe by lobe.

    `incident`: whether w is the incident direction and the integral runs over wo, or the other way round.
    `radiance` is given directions (n, k, 3) and the places (n,) in the flattened batch that they belong to, and
    returns (n, k, 1 or C).
    """
    lib, (w,) = ops.as_arrays(w)
    if lib.name != "numpy":
        raise ArrayTypeError(f"integrals take NumPy directions; got {lib.name}; convert them first")
    if w.shape[-1:] != (3,):
        raise ShapeError(f"directions: got shape {w.shape}, expected (..., 3)")
    w = np.broadcast_to(w, (*batch.full_shape(m, w.shape[:-1]), 3))
    total = np.zeros((1,), w.dtype)
    missing = 0.0
    channels = radiance is not None or any(getattr(v, "ndim", 0) for v in m.leaves())
    for weight, lobe in m.lobes():
        if lobe.is_delta:
            part = lobe.delta_reflectance(w)
            part = part if part.ndim == w.ndim else part[..., None]
            if radiance is not None:
                mirrored = lobe.sample(w, np.zeros(2, w.dtype)).wi.reshape(-1, 1, 3)
                light = radiance(mirrored, np.arange(len(mirrored)))
                part = part * light.reshape(*w.shape[:-1], -1)
        else:
            part, lost = _channels(lobe, w, tolerance, incident, radiance)
            missing = max(missing, lost)
        total = total + np.asarray(weight, w.dtype) * part
    if missing > 0.0:
        warnings.warn(
            f"{missing:.1%} of the directions of an integral hold no measured data and counted as 0",
            MissingDataWarning,
            stacklevel=3,
        )
    return total if channels else total[..., 0][()]


def _channels(
    lobe: Reflectance, w: np.ndarray, tolerance: float, incident: bool, radiance: Callable | None
) -> tuple[np.ndarray, float]:
    """`_lobe` channel by channel: each is integrated in the coordinates of its own sampling."""
    widths: list[int] = []
    lobe.each(lambda value: widths.append(np.shape(value)[-1] if np.ndim(value) else 1))
    count = max(widths, default=1)
    if count == 1:
        return _lobe(lobe, w, tolerance, incident, radiance)
    parts, lost = [], 0.0
    for c in range(count):
        one = lobe.each(partial(_channel, c=c))
        part, missing = _lobe(one, w, tolerance, incident, radiance)
        parts.append(part[..., min(c, part.shape[-1] - 1)])
        lost = max(lost, missing)
    return np.stack(parts, axis=-1), lost


def _channel(value: Any, c: int) -> Any:
    return value[..., min(c, value.shape[-1] - 1), None] if np.ndim(value) else value


def _lobe(
    lobe: Reflectance, w: np.ndarray, tolerance: float, incident: bool, radiance: Callable | None
) -> tuple[np.ndarray, float]:
    flat = w.reshape(-1, 3)
    todo = np.arange(len(flat))
    result: np.ndarray | None = None
    lost = 0.0
    for n in ORDERS:
        nodes, weights = gauss_square(n, lobe.seam)
        nodes, weights = nodes.astype(w.dtype), weights.astype(w.dtype)[:, None]
        if radiance is None:
            m: Any = batch.texels(lobe, w.shape[:-1], todo)
            new, absent = _total(m, flat[todo], nodes, weights, incident)
        else:
            new, absent = _lit_total(lobe, w, todo, nodes, weights, incident, radiance)
        lost = max(lost, absent)
        if result is None:
            result, before = new, np.full(len(flat), np.inf)
            continue
        change = np.abs(new - result[todo]).max(axis=-1)
        # Two results may agree by chance: those before must have come near too.
        settled = (change <= 0.25 * tolerance) & (before[todo] <= 4.0 * tolerance)
        result[todo], before[todo] = new, change
        todo = todo[~settled & ~np.isnan(change)]
        if len(todo) == 0:
            break
    assert result is not None
    return result.reshape(*w.shape[:-1], result.shape[-1]).astype(w.dtype), lost


def _total(
    m: Reflectance, known: np.ndarray, nodes: np.ndarray, weights: np.ndarray, incident: bool
) -> tuple[np.ndarray, float]:
    """Integrals (n, C) for known directions (n, 3), and which share of the directions holds no data."""
    kernel = _total_incident if incident else _total_outgoing
    inputs = (known[:, None, :], nodes, weights)
    total, absent = batch.run(kernel, ("total", "total"), m, inputs, (3, 2, 1))
    absent = absent.max(initial=0.0) / len(nodes)
    return (total if total.ndim == 2 else total[:, None]), float(absent)


def _lit_total(
    lobe: Reflectance,
    w: np.ndarray,
    todo: np.ndarray,
    nodes: np.ndarray,
    weights: np.ndarray,
    incident: bool,
    radiance: Callable,
) -> tuple[np.ndarray, float]:
    """`_total` under a radiance that is asked for the directions where light comes from."""
    kernel = _integrand_incident if incident else _integrand_outgoing
    flat = w.reshape(-1, 3)
    step = max(1, (1 << 21) // len(nodes))
    pieces, lost = [np.zeros((0, 1))], 0.0
    for start in range(0, len(todo), step):
        index = todo[start : start + step]
        known = flat[index, None, :]
        m = batch.texels(lobe, w.shape[:-1], index)
        there, values = batch.run(kernel, ("vector", "value"), m, (known, nodes), (3, 2))
        values = (values if values.ndim == 3 else values[..., None]) * radiance(there, index)
        absent = np.isnan(values) & ~np.isnan(known[..., :1])
        lost = max(lost, float(absent.mean())) if absent.any() else lost
        pieces.append(np.einsum("q,nqc->nc", weights[:, 0], np.where(absent, 0.0, values)))
    return np.concatenate(pieces[1:] or pieces), lost


def _integrand_incident(m: Reflectance, mean: Reflectance, w: Any, u: Any) -> tuple:
    return _integrand(mean, w, u, m.formula)


def _integrand_outgoing(m: Reflectance, mean: Reflectance, w: Any, u: Any) -> tuple:
    return _integrand(mean, w, u, lambda known, there: m.formula(there, known))


def _total_incident(m: Reflectance, mean: Reflectance, w: Any, u: Any, weight: Any) -> tuple:
    return _weighted(w, weight, *_integrand_incident(m, mean, w, u))


def _total_outgoing(m: Reflectance, mean: Reflectance, w: Any, u: Any, weight: Any) -> tuple:
    return _weighted(w, weight, *_integrand_outgoing(m, mean, w, u))


def _weighted(w: Any, weight: Any, there: Direction, value: Any) -> tuple:
    """A term of an integral, 0 where a measurement holds no data, and whether it is such a one."""
    known = w[0] + w[1] + w[2]
    absent = (value != value) & (known == known)
    return weight[0] * ops.where(absent, 0.0, value), ops.where(absent, 1.0, 0.0)


def _integrand(mean: Reflectance, w: Any, u: Any, value: Callable) -> tuple:
    """Kernel: the direction drawn for u, and f cos/pdf there."""
    w, (u0, u1) = Direction(*w), u
    hidden = w.z <= HORIZON
    known = geometry.where(hidden, NORMAL, w)
    there = mean.warp(known, u0, u1)
    lost = (there.z <= HORIZON) | hidden
    safe = geometry.where(lost, NORMAL, there)
    pdf = mean.density(safe, known)
    usable = pdf > 0.0
    result = value(known, safe) * safe.z / ops.where(usable, pdf, 1.0)
    nan = 0.0 * (w.x + w.y + w.z)
    return there, ops.where(lost | ~usable, 0.0, result) + nan
