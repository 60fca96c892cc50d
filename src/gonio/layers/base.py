"""The matrices of a reflectance, as the lowest layer of a stack."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..base import kernels
from ..base.calls import variables
from ..base.reflectance import Reflectance
from ..evaluate import batch
from .grid import NodeGrid
from .interfaces import classes, poles, turns

STEP = 1e-20
"""Imaginary part of a number that is differentiated by: so small that its square is nothing beside 1."""

RINGS = 1e-13
"""Orders that are this little beside the first are rounding, and so are those after them."""

LEAST = 2.0**-4
"""The strongest map of azimuths: lobes without a peak are still integrated to rounding with it."""


def reflected(
    base: Reflectance, grid: NodeGrid, n: complex, by: str | None = None
) -> tuple[Callable[[range], np.ndarray], np.ndarray]:
    """Matrices (C, orders, nodes, nodes), of such orders, of f in a medium of index n; and the reflectances (C, nodes)
    of delta lobes.

    `by`: a parameter; the results are then complex, their imaginary parts `STEP` times the derivatives by it. An index
    with an imaginary part moves the nodes: the derivatives by direction then count, too.
    """
    mu, root = grid.mu(n), grid.root(n)
    i, o = np.indices((len(mu), len(mu))).reshape(2, -1)
    s, k = np.sqrt(grid.s2[: len(mu)].real), np.ones(len(i))
    spreads = [spread for _, lobe in base.lobes() if not lobe.is_delta and (spread := lobe.hints.spread) is not None]
    if spreads:
        alpha = min(float(np.min(x)) for spread in spreads for x in (spread.alpha_x, spread.alpha_y))
        k = classes(poles(s, (n * (mu[i] + mu[o])).real, i, o, alpha), LEAST)
    spent = [math.inf]

    def matrices(orders: range) -> np.ndarray:
        if orders.start >= spent[0]:
            return np.zeros((1, len(orders), len(mu), len(mu)))
        series = _series(base, mu, NodePairs(i, o, k), orders, by)
        size = np.abs(series).max(axis=(0, 2))
        if orders.start == 0 and (size[len(size) // 2 :] < RINGS * size[0]).all():
            spent[0] = orders.stop
        return series.reshape(-1, len(orders), len(mu), len(mu)) * (np.outer(root, root) / (n * n))

    return matrices, _mirror(base, mu, by)


class NodePairs(NamedTuple):
    """Pairs of nodes: the places of light and viewer, and the class of each (`interfaces.classes`)."""

    i: np.ndarray
    o: np.ndarray
    k: np.ndarray


def _series(m: Reflectance, mu: np.ndarray, pairs: NodePairs, orders: range, by: str | None) -> np.ndarray:
    """Integrals of f cos(m phi) over the circle, (C, orders, pairs)."""
    result: Any = None
    i, o, k = pairs
    wi = _direction(mu, np.zeros(1))
    for shared in np.unique(k):
        of_class = np.flatnonzero(k == shared)
        phi, weights = turns(float(shared), orders)
        wo = _direction(mu, np.pi + phi)
        for part in np.array_split(of_class, max(1, len(of_class) * len(phi) // 500_000)):
            f = _values(m, wi[i[part]], wo[o[part]], mu[i[part]], mu[o[part]], by)
            values = np.moveaxis(f.reshape(len(part), len(phi), -1), -1, 0) @ weights
            if result is None:
                result = np.zeros((len(values), len(orders), len(i)), values.dtype)
            result[..., part] = values.swapaxes(1, 2)
    return result


def _values(m: Reflectance, wi: np.ndarray, wo: np.ndarray, mu_i: np.ndarray, mu_o: np.ndarray, by: Any) -> np.ndarray:
    """f; with its changes by a parameter, and by cosines that have imaginary parts."""
    moved = bool(np.iscomplexobj(mu_i) and (mu_i.imag.any() or mu_o.imag.any()))
    if by is None and not moved:
        return m.f(wi, wo)
    jacobian = m.jacobian(wi, wo, [*([] if by is None else [by]), *(["wi", "wo"] if moved else [])])
    change: Any = 0.0 if by is None else STEP * jacobian.by[by]
    if moved:
        for name, w, mu in (("wi", wi, mu_i), ("wo", wo, mu_o)):
            z, s2 = w[..., 2:], w[..., 0] ** 2 + w[..., 1] ** 2
            along = np.concatenate([-z * w[..., :2] / s2[..., None], np.ones_like(z)], axis=-1)  # dw/dmu
            slopes = jacobian.by[name]
            along = along[..., None, :] if slopes.ndim > w.ndim else along
            step = (slopes * along).sum(axis=-1)
            change = change + step * mu.imag.reshape(-1, *([1] * (step.ndim - 1)))
    return jacobian.f + 1j * change


def _direction(mu: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Directions (nodes, angles, 3)."""
    z, s = mu.real[:, None], np.sqrt(1.0 - mu.real * mu.real)[:, None]
    return np.stack(np.broadcast_arrays(s * np.cos(phi), s * np.sin(phi), z), axis=-1)


def _mirror(base: Reflectance, mu: np.ndarray, by: str | None) -> np.ndarray:
    if not base.has_delta:
        return np.zeros((1, len(mu)))
    wo = np.ascontiguousarray(_direction(mu, np.zeros(1))[:, 0])
    moved = bool(np.iscomplexobj(mu) and mu.imag.any())
    if by is None and not moved:
        return base.delta_reflectance(wo).reshape(len(mu), -1).T
    leaves = () if by is None else variables(base, [by])[1]
    task = kernels.DELTA_REFLECTANCE.derivatives(leaves, (0,) if moved else ())
    value, *slopes = batch.compute(task, base, (wo,))
    change = 0.0 if by is None else STEP * slopes[0].reshape(len(mu), -1)
    if moved:
        s = np.sqrt(1.0 - mu.real**2)
        along = np.stack([-mu.real / s, 0.0 * s, np.ones_like(s)], axis=-1)
        change = change + np.einsum("ncx,nx->nc", slopes[-1].reshape(len(mu), -1, 3), along) * mu.imag[:, None]
    return (value.reshape(len(mu), -1) + 1j * change).T
