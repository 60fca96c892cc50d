"""Fourier coefficients as a table that formulas look up: cubic splines in both polar angles and in the azimuth."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays import ops
from ..formula.direction import Direction
from .grid import Grid
from .response import Block, Response

FEWEST_CELLS, FEWEST_CELLS_OF_KINKS = 32, 128


def shape_for(responses: list[Response]) -> tuple[int, int]:
    """How many cells a table has along a polar angle, and along half the circle."""
    nodes, orders = responses[0].nodes, max(r.orders for r in responses)
    kinks = any(r.has_kinks for r in responses)
    return max(FEWEST_CELLS_OF_KINKS if kinks else FEWEST_CELLS, nodes + nodes // 4), 2 * orders + 6


def tabulated(grid: Grid, block: Block, cells: int, turns: int) -> np.ndarray:
    """The coefficients of the splines of (mu_i + mu_o) f/n_o^2, (cells + 3, cells + 3, turns + 3).

    Polar angles count by psi, mu = (1 - cos psi)/2, in which f of either parity in the order goes on evenly or oddly
    beyond both ends; orders but the first are 0 along the normal. Factors (mu_i + mu_o) take away the pole where both
    are at the horizon.
    """
    c = block.coefficients
    orders = np.arange(len(c))
    c = c * (grid.mu(block.rows)[:, None] + grid.mu(block.columns))
    up, left = (_angles(grid, n, cells) for n in (block.rows, block.columns))
    found = np.empty((len(c), cells + 3, cells + 3), np.result_type(c, *up, *left))
    for kind, part in enumerate((slice(0, 1), slice(1, None, 2), slice(2, None, 2))):
        found[part] = up[kind] @ c[part] @ left[kind].T
    # A series of orders has splines whose coefficients are a series, too: each order over its response.
    phi = np.pi * np.arange(-1, turns + 2) / turns
    series = np.cos(orders[:, None] * phi) * (3.0 / (2.0 + np.cos(orders * np.pi / turns)))[:, None]
    return np.tensordot(found, series, ((0,), (0,)))


def _angles(grid: Grid, n: complex, cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The matrices from nodes in a medium of index n to splines: of the first order, of odd and of even ones."""
    mu, psi = grid.mu(n), np.linspace(0.0, np.pi, cells + 1)
    sine, at = np.sqrt(1.0 - mu * mu), 0.5 - 0.5 * np.cos(psi)
    across = between(grid, n, at)
    up = np.maximum(1.0 - at * at, 0.0)[:, None]
    return (
        _splines(across, 1.0),
        _splines(np.sqrt(up) * across / sine, -1.0),
        _splines(up * across / sine**2, 1.0),
    )


def between(grid: Grid, n: complex, at: np.ndarray) -> np.ndarray:
    """The matrix (places, nodes) of Lagrange's interpolation from the nodes in a medium of index n to cosines `at`.

    Each panel has its own polynomial, in the cosine in the medium that the panel ends with, as its nodes have.
    """
    mu, s2 = grid.mu(n), n * n * (1.0 - at * at)
    result = np.zeros((len(at), len(mu)), mu.dtype)
    low, start = -math.inf, 0
    for index, stop in grid.panels:
        if stop > len(mu):
            break
        high = math.inf if stop == len(mu) else (index * index).real
        here = np.flatnonzero((s2.real >= low) & (s2.real < high))
        nodes = np.sqrt(1.0 - grid.s2[start:stop] / (index * index))
        places = at[here] if stop == len(mu) else np.sqrt(1.0 - s2[here] / (index * index))
        scale = 4.0 / np.ptp(nodes.real)
        weights = np.array([1.0 / np.prod(scale * (x - np.delete(nodes, k))) for k, x in enumerate(nodes)])
        away = places[:, None] - nodes
        hit = np.abs(away) < 1e-14
        terms = np.where(hit.any(axis=1, keepdims=True), hit, weights / np.where(hit, 1.0, away))
        result[np.ix_(here, np.arange(start, stop))] = terms / terms.sum(axis=1, keepdims=True)
        low, start = high, stop
    return result


def _splines(values: np.ndarray, parity: float) -> np.ndarray:
    """Coefficients of cubic B-splines through rows of values, which go on evenly before the first, beyond the last
    by their parity; one row more at both ends."""
    count = len(values)
    matrix = (np.diag(np.full(count, 4.0)) + np.eye(count, k=1) + np.eye(count, k=-1)) / 6.0
    matrix[0, 1] *= 2.0
    matrix[-1, -2] *= 1.0 + parity
    inner = np.linalg.solve(matrix, values)
    return np.concatenate([inner[1:2], inner, parity * inner[-2:-1]])


def lookup(table: Any, first: Any, cells: Any, turns: Any, wi: Direction, wo: Direction) -> Any:
    """f/n_o^2 of a table, whose entries begin at `first`; the directions are on one side, or on both."""
    across = ops.absolute(wi.x * wo.y - wi.y * wo.x)
    along = wi.x * wo.x + wi.y * wo.y
    flat = along * along + across * across < 1e-30
    # Along the normal, where the azimuth means nothing, the half way: the first order is 0 there.
    phi = ops.arctan2(ops.where(flat, 1.0, across), ops.where(flat, 0.0, -along)) * (1.0 / math.pi)
    mu_i, mu_o = ops.absolute(wi.z), ops.absolute(wo.z)
    (i, u), (o, v), (k, w) = _cell(_psi(mu_i), cells), _cell(_psi(mu_o), cells), _cell(phi, turns)
    turn_stride = ops.to_index(turns) + 3
    stride = (ops.to_index(cells) + 3) * turn_stride
    start = ops.to_index(first) + i * stride + o * turn_stride + k
    total: Any = 0.0
    for a in range(4):
        row: Any = 0.0
        for b in range(4):
            at = start + a * stride + b * turn_stride
            line = sum((w[c] * ops.take(table, at + c) for c in range(1, 4)), w[0] * ops.take(table, at))
            row = row + v[b] * line
        total = total + u[a] * row
    return total / (mu_i + mu_o)


def _psi(mu: Any) -> Any:
    """arccos(1 - 2 mu)/pi."""
    mu = ops.clip(mu, 1e-12, 1.0 - 1e-7)
    return ops.arctan2(ops.sqrt(mu), ops.sqrt(1.0 - mu)) * (2.0 / math.pi)


def _cell(x: Any, count: Any) -> tuple[Any, list[Any]]:
    """The cell that a number in [0, 1] falls to, and the weights of the four splines there."""
    x = x * count
    cell = ops.minimum(ops.floor(x), count - 1.0)
    t = x - cell
    s, t2 = 1.0 - t, t * t
    t3 = t2 * t
    weights = [s * s * s, 3.0 * t3 - 6.0 * t2 + 4.0, 3.0 * (t + t2 - t3) + 1.0, t3]
    return ops.to_index(cell), [weight * (1.0 / 6.0) for weight in weights]
