"""Fourier coefficients as a table that formulas look up: cubic splines in both polar angles and in the azimuth.

Of light that the thinner of two media reflects totally f goes its own way: each pair of panels of `grid` has a table,
in the cosines that its nodes are in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..formula.direction import Direction
from ..machine.caches import kept
from .grid import CUTS, NodeGrid, pieces, rule
from .response import FourierBlock, Response

CELLS = 48
"""Cells along a polar angle, at tolerances of 1e-3 and above: 4e-6 of energy."""

FAR = 1e3
"""An index that is not met."""


def shape_for(responses: list[Response], tolerance: float) -> tuple[int, int]:
    """How many cells a table has along a polar angle, and along half the circle."""
    finer = max(0.0, math.log10(1e-3 / tolerance))
    return math.ceil(CELLS * 1.8**finer), 2 * max(r.orders for r in responses) + 6


def tabulated(grid: NodeGrid, block: FourierBlock, reach: tuple[int, int], cells: int, turns: int) -> np.ndarray:
    """The coefficients of the splines of (mu_i + mu_o) f/n_o^2, (panels, panels, cells + 3, cells + 3, turns + 3).

    `reach`: the number of panels of rows and of columns; where light has fewer the table is 0. Polar angles count by
    psi, x = (1 - cos psi)/2, x the cosine over the widest of the panel: f goes on evenly beyond both ends of psi, or,
    along the normal, by the parity of the order; orders but the first are 0 there. Factors (mu_i + mu_o), cosines in
    the medium that the further panel ends with, take away the pole where both are at its horizon.
    """
    c = block.coefficients
    orders = np.arange(len(c))
    # A series of orders has splines whose coefficients are a series, too: each order over its response.
    phi = np.pi * np.arange(-1, turns + 2) / turns
    series = np.cos(orders[:, None] * phi) * (3.0 / (2.0 + np.cos(orders * np.pi / turns)))[:, None]
    kinds = (slice(0, 1), slice(1, None, 2), slice(2, None, 2))
    dtype = np.result_type(c, grid.s2)
    result = np.zeros((*reach, cells + 3, cells + 3, turns + 3), dtype)
    rows, columns = grid.parts(block.rows), grid.parts(block.columns)
    for p, at_p in enumerate(rows):
        for q, at_q in enumerate(columns):
            n = grid.panels[max(p, q)][0]
            mu_p, mu_q = (np.sqrt(1.0 - grid.s2[at] / (n * n)) for at in (at_p, at_q))
            part = c[:, at_p, at_q] * (mu_p[:, None] + mu_q)
            coefficients = np.empty((len(c), cells + 3, cells + 3), dtype)
            before, after = (to_splines(len(mu), not k, cells) for mu, k in ((mu_p, p), (mu_q, q)))
            for kind, of in enumerate(kinds):
                coefficients[of] = before[kind] @ part[of] @ after[kind].T
            result[p, q] = np.tensordot(coefficients, series, ((0,), (0,)))
    return result


@kept
def to_splines(count: int, first: bool, cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The matrices from the nodes of a panel to splines: of the first order, of odd and of even ones; `first`: whether
    the panel holds the normal, along which all but the first are 0."""
    at = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, cells + 1))
    across = interpolated(count, at)
    even = _splines(across, 1.0)
    if not first:
        return even, even, even
    up, sine = np.sqrt(np.maximum(1.0 - at * at, 0.0))[:, None], np.sqrt(1.0 - rule(count)[0][::-1] ** 2)
    return even, _splines(up * across / sine, -1.0), _splines(up * up * across / sine**2, 1.0)


def interpolated(count: int, at: np.ndarray) -> np.ndarray:
    """The matrix (places, nodes) of Lagrange's interpolation from the nodes of a panel, as `grid` has them, to cosines
    over the widest: a polynomial for each piece."""
    nodes, result = rule(count)[0][::-1], np.zeros((len(at), count))
    for piece, low, high in zip(pieces(count), CUTS, CUTS[1:], strict=False):
        here = np.flatnonzero((at >= low) & ((at < high) | (high == CUTS[-1])))
        x = nodes[piece]
        apart = 4.0 / (high - low) * (x[:, None] - x)
        np.fill_diagonal(apart, 1.0)
        weights = 1.0 / apart.prod(axis=1)
        away = at[here, None] - x
        hit = np.abs(away) < 1e-14
        terms = np.where(hit.any(axis=1, keepdims=True), hit, weights / np.where(hit, 1.0, away))
        result[here, piece] = terms / terms.sum(axis=1, keepdims=True)
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


def albedos(grid: NodeGrid, block: FourierBlock, w_z: np.ndarray, by_rows: bool) -> np.ndarray:
    """What a block sends, in all, of light from directions of these cosines in the medium of its rows, or columns."""
    c, n, other = block.coefficients[0], block.rows.real, block.columns.real
    if not by_rows:
        c, n, other = c.T, other, n
    at_nodes = 2.0 * math.pi * (c @ grid.etendue[: grid.count(other)])
    s2, low, result = n * n * (1.0 - w_z * w_z), 0.0, np.zeros(len(w_z))
    for (index, _), of in zip(grid.panels, grid.parts(n), strict=False):
        high, last = index.real**2, of.stop == grid.count(n)
        here = np.flatnonzero((s2 >= low) & ((s2 < high) | last))
        x2 = w_z[here] ** 2 + (1.0 - w_z[here] ** 2) * (1.0 - n * n / high)
        x = np.sqrt(np.maximum(x2, 0.0) / (1.0 - low / high))
        for some in np.array_split(np.arange(len(here)), 1 + len(here) // 10_000):
            result[here[some]] = interpolated(of.stop - of.start, x[some]) @ at_nodes[of]
        low = high
    return result


class Tables(NamedTuple):
    """Splines of all panels, where those of a block begin, and how many there are along each axis.

    first     number of the first table
    reach     numbers of panels of rows and of columns
    ends      the index that each panel ends with, increasing; what is not there is `FAR`
    """

    splines: Any
    first: Any
    reach: tuple[Any, Any]
    cells: Any
    turns: Any
    ends: Sequence[Any]

    def at(self, wi: Direction, n_i: Any, wo: Direction, n_o: Any) -> Any:
        """f/n_o^2 for directions in media of these indices; they are on one side, or on both."""
        across = ops.absolute(wi.x * wo.y - wi.y * wo.x)
        along = wi.x * wo.x + wi.y * wo.y
        flat = along * along + across * across < 1e-30
        # Along the normal, where the azimuth means nothing, the half way: the first order is 0 there.
        phi = ops.arctan2(ops.where(flat, 1.0, across), ops.where(flat, 0.0, -along)) * (1.0 / math.pi)
        rows, columns = self.reach
        (p, x_i, end_i), (q, x_o, end_o) = self._place(wi, n_i, rows), self._place(wo, n_o, columns)
        (i, u), (o, v), (k, w) = (_cell(y, n) for y, n in ((x_i, self.cells), (x_o, self.cells), (phi, self.turns)))
        turns, cells = ops.to_index(self.turns) + 3, ops.to_index(self.cells) + 3
        stride = cells * turns
        table = ops.to_index(self.first)
        if len(self.ends) > 1:
            table = table + ops.to_index(p) * ops.to_index(columns) + ops.to_index(q)
        start = table * (cells * stride) + i * stride + o * turns + k
        total: Any = 0.0
        for a in range(4):
            row: Any = 0.0
            for b in range(4):
                at = start + a * stride + b * turns
                line = sum(
                    (w[c] * ops.take(self.splines, at + c) for c in range(1, 4)), w[0] * ops.take(self.splines, at)
                )
                row = row + v[b] * line
            total = total + u[a] * row
        if len(self.ends) == 1:
            return total / (ops.absolute(wi.z) + ops.absolute(wo.z))
        further = ops.maximum(end_i, end_o)
        return total / (_cosine(wi, n_i, further) + _cosine(wo, n_o, further))

    def _place(self, w: Direction, n: Any, reach: Any) -> tuple[Any, Any, Any]:
        """The number of the panel that light along w, in a medium of index n, is in, psi/pi there, and the index that
        the panel ends with."""
        if len(self.ends) == 1:
            return 0.0, _psi(ops.absolute(w.z)), self.ends[0]
        number, low, end = 0.0 * w.z, 0.0 * w.z, self.ends[0]
        for k, (here, further) in enumerate(zip(self.ends, self.ends[1:], strict=False)):
            beyond = (_squared(w, n, here) <= 0.0) & (reach > k + 1.5)
            number, low, end = (ops.where(beyond, *both) for both in ((k + 1.0, number), (here, low), (further, end)))
        return number, _psi(_cosine(w, n, end) / ops.sqrt(1.0 - (low * low) / (end * end))), end


def _squared(w: Direction, n: Any, other: Any) -> Any:
    """The squared cosine in a medium of another index of light along w, in one of index n; below 0: none gets there."""
    return w.z * w.z + (w.x * w.x + w.y * w.y) * (1.0 - (n * n) / (other * other))


def _cosine(w: Direction, n: Any, other: Any) -> Any:
    return ops.sqrt(ops.maximum(_squared(w, n, other), 1e-24))


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
