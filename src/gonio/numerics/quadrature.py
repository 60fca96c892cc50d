"""Integrals over the unit square by adaptive subdivision, many at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

ORDER = 8
"""Nodes along each side of a cell."""

CORNER, SIDE = slice(2, 4), slice(4, 6)
"""Corner and sides of a cell (6,) in its panel; before them stand the panel's start and length on the first axis."""

SUMS = 5
"""Weighted sums over the nodes of a cell: the integral, and two estimates of its error along each axis."""

STAGES = ((1024, 1024), (16, 1 << 16))
"""Integrals computed together, and most cells of each; an integral that needs more goes to the next stage."""

SAFETY = 1.25
"""Factor from a cell's highest coefficients to its error: it covers a kink that crosses the cell."""

WIDER = 4.0
"""The same factor for a rule that stands alone for the whole square, of which no part is ever compared with it."""

SMALLEST, NARROWEST = 2.0**-40, 2.0**-22
"""Side of the smallest cells, and of the smallest first cells near seeds."""


def _rule() -> np.ndarray:
    """Nodes and weights (ORDER^2, 2 + SUMS) of a Gauss–Lobatto product on the unit square.

    The further weights give the coefficients of the two highest Legendre polynomials that the nodes can tell apart.
    Nodes on the edges matter: a jump between an edge and the first node inside would be seen from neither side.
    """
    legendre = np.polynomial.legendre
    highest = np.eye(ORDER)[ORDER - 1]
    inner = np.sort(legendre.legroots(legendre.legder(highest)).real)
    x = np.concatenate([[-1.0], inner, [1.0]])
    w = 1.0 / (ORDER * (ORDER - 1) * legendre.legval(x, highest) ** 2)
    odd, even = (w * np.sqrt(2 * k + 1) * legendre.legval(x, np.eye(ORDER)[k]) for k in (ORDER - 2, ORDER - 1))
    sums = [np.outer(w, w), np.outer(odd, w), np.outer(even, w), np.outer(w, odd), np.outer(w, even)]
    t = 0.5 * (x + 1.0)
    columns = [*np.broadcast_arrays(t[:, None], t[None, :]), *sums]
    return np.asfortranarray(np.stack([c.reshape(-1) for c in columns], axis=-1))


NODES = _rule()
NODES.flags.writeable = False


def place(cell: Any, node: Any) -> tuple[tuple[Any, Any], Any]:
    """The point of the unit square at a node of a cell, and the area per area of the node's square.

    Takes numbers, arrays or symbols. Cells lie on a square whose sides are stretched by 10 t^3 - 15 t^4 + 6 t^5. That
    widens the ends, where lobes have their tails and the maps from the square to directions have roots and powers.
    """
    t, u, area = node[0], node[1], cell[4] * cell[5]
    t, u = cell[2] + cell[4] * t, cell[3] + cell[5] * u
    for x in (t, u):
        area = area * (30.0 * x * x * (1.0 - x) * (1.0 - x))
    t, u = (1e-15 + (1.0 - 2e-15) * (x * x * x * (10.0 - x * (15.0 - 6.0 * x))) for x in (t, u))
    return (cell[0] + cell[1] * t, u), area * cell[1]


class Integrals(NamedTuple):
    """Integrals (n, C), estimates of their errors (n,), and the share of the square without data (n,)."""

    value: np.ndarray
    error: np.ndarray
    missing: np.ndarray


class CellSums(NamedTuple):
    """Sums over cells (k, SUMS, C), the error of the integrand itself (k,), and the share without data (k,)."""

    totals: np.ndarray
    error: np.ndarray | float
    missing: np.ndarray | float


Evaluate = Callable[[np.ndarray, np.ndarray], CellSums]
"""Sums over cells (k, 6), of the integrals with these numbers (k,)."""


def weighed(values: np.ndarray) -> np.ndarray:
    """Sums (k, SUMS, C) of values (k, nodes, C) times their areas."""
    return np.einsum("qs,kqc->ksc", NODES[:, 2:], values)


class Goal(NamedTuple):
    """What integrals are computed to: an error of `tolerance` times the larger of `unit` and their values, numbers or
    (n,). `side`: first cells along each side of the square; more of them find smaller details. Without it, as many as
    the smallest tolerance needs."""

    tolerance: Any
    unit: Any = 1.0
    side: int | None = None

    def at(self, rows: np.ndarray) -> Goal:
        """Of some of the integrals."""
        return Goal(self.tolerance[rows], self.unit[rows], self.side)


def cubature(
    evaluate: Evaluate, count: int, goal: Goal, seam: float = 0.0, seeds: np.ndarray | None = None
) -> Integrals:
    """`count` integrals over the unit square, each to its goal.

    Cells are halved along the axes that their errors come from, those of the largest errors first, until all errors
    together are small enough. The error of a cell is the size of the highest coefficients of the integrand by Legendre
    polynomials, times `SAFETY`, or a quarter of the change by its division, if that is more. All first cells are
    divided once.

    `seam`: where the integrand jumps along the first axis, or 0. `seeds` (count, K, 4): points near which cells are
    made as narrow as the two lengths that come with them before anything is evaluated, because the integrand may have a
    peak there.

    Error    the estimate (of many cells: twice the root of the sum of their squared errors) is typically 10 times the
             error; of 2580 albedos to 1e-3 and 1e-4, four exceeded it, none the tolerance. A detail on less than
             `tolerance` of the square may be missed, and a kink along the diagonals of cells exceeds the estimate by
             1.6.
    Source   Gander & Gautschi 2000, BIT 40:84, for Lobatto's rule; Berntsen & Espelid 1991, ACM TOMS 17:233, for error
             estimates by rules that are zero for polynomials; the rest is derived here.
    """
    tolerance, unit = (np.broadcast_to(np.asarray(x, dtype=float), count) for x in goal[:2])
    side = goal.side or _first_side(tolerance.min(initial=1.0))
    todo = np.arange(count)
    groups: list[tuple[np.ndarray, Integrals]] = []
    for block, most in STAGES:
        unfinished = [todo[:0]]
        for start in range(0, len(todo), block):
            rows = todo[start : start + block]
            cells = _first_cells(len(rows), side, seam, None if seeds is None else seeds[rows])
            integrals, done = _refined(evaluate, rows, cells, Goal(tolerance[rows], unit[rows]), most)
            if block == STAGES[-1][0]:
                done[:] = True
            groups.append((rows[done], Integrals(*(x[done] for x in integrals))))
            unfinished.append(rows[~done])
        todo = np.concatenate(unfinished)
    return in_order(groups)


def in_order(groups: list[tuple[np.ndarray, Integrals]]) -> Integrals:
    """Groups of integrals, each with their numbers (k,), as one, by these numbers."""
    if not groups:
        return Integrals(np.zeros((0, 1)), np.zeros(0), np.zeros(0))
    order = np.argsort(np.concatenate([numbers for numbers, _ in groups]))
    return Integrals(*(np.concatenate(x)[order] for x in zip(*(group for _, group in groups), strict=True)))


class _Cells(NamedTuple):
    """Cells: the number of each one's integral, its place, and its contributions."""

    row: np.ndarray
    cell: np.ndarray
    value: np.ndarray
    error: np.ndarray
    along: np.ndarray  # the axes to halve it by: 1, 2, or 3 for both
    missing: np.ndarray
    inherent: np.ndarray

    def at(self, index: np.ndarray) -> _Cells:
        return _Cells(*(x[index] for x in self))


def _refined(
    evaluate: Evaluate,
    rows: np.ndarray,
    first: tuple[np.ndarray, np.ndarray],
    goal: Goal,
    most: int,
) -> tuple[Integrals, np.ndarray]:
    """The integrals number `rows` from their first cells, of at most `most` each, and which reach the tolerance."""
    n = len(rows)
    live = _evaluated(evaluate, rows, *first)
    live = live._replace(along=np.full(len(live.row), 3))
    settled: list[_Cells] = []
    divide = np.arange(len(live.row))
    while len(divide):
        parents = live.at(divide)
        kept = np.ones(len(live.row), bool)
        kept[divide] = False
        row, cell, family = _halved(parents.row, parents.cell, parents.along)
        new = _evaluated(evaluate, rows, row, cell)
        change = np.abs(_totals(family, new.value, len(divide)) - parents.value).max(axis=-1)
        share = 0.25 * change / np.bincount(family, minlength=len(divide))
        new = new._replace(error=np.maximum(new.error, share[family]))
        live = _Cells(*(np.concatenate([a[kept], b]) for a, b in zip(live, new, strict=True)))
        error = _together(live.row, live.error, n)
        allowed = goal.tolerance * np.maximum(goal.unit, np.abs(_totals(live.row, live.value, n)).max(axis=-1))
        size = np.bincount(live.row, minlength=n)
        open_row = (error > allowed) & (size < most)
        if not open_row.all():
            out = ~open_row[live.row]
            settled.append(live.at(out))
            live = live.at(~out)
        # Of a row's cells, those with the smallest errors stay that together have less than the error allowed.
        order = np.lexsort((live.error, live.row))
        row, squared = live.row[order], np.square(live.error[order] / allowed[live.row[order]])
        up_to = np.cumsum(squared)
        start = np.searchsorted(row, row)
        up_to -= up_to[start] - squared[start]
        divide = order[(up_to > 0.125) & (live.cell[order][:, SIDE].max(axis=-1) > SMALLEST)]
        stuck = np.ones(n, bool)
        stuck[live.row[divide]] = False
        if stuck[live.row].any():
            settled.append(live.at(stuck[live.row]))
            number = np.cumsum(~stuck[live.row]) - 1
            divide, live = number[divide], live.at(~stuck[live.row])
    every = _Cells(*(np.concatenate(x) for x in zip(*settled, strict=True)))
    value = _totals(every.row, every.value, n)
    error = _together(every.row, every.error, n)
    done = ~(error > goal.tolerance * np.maximum(goal.unit, np.abs(value).max(axis=-1)))
    error = error + np.bincount(every.row, every.inherent, n)
    return Integrals(value, error, np.bincount(every.row, every.missing, n)), done


def _together(row: np.ndarray, error: np.ndarray, n: int) -> np.ndarray:
    """The errors of the rows' sums: of many cells less than the sum, as errors have either sign."""
    return np.minimum(np.bincount(row, error, n), 2.0 * np.sqrt(np.bincount(row, error * error, n)))


def _totals(row: np.ndarray, value: np.ndarray, n: int) -> np.ndarray:
    return np.stack([np.bincount(row, value[:, c], n) for c in range(value.shape[1])], axis=-1)


def _first_side(tolerance: float) -> int:
    """First cells along each side: the smaller the tolerance, the smaller the details that matter."""
    return int(np.clip(np.ceil(-np.log10(max(tolerance, 1e-9)) - 1.01), 2, 6))


def _first_cells(n: int, side: int, seam: float, seeds: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    panels = [(0.0, seam), (seam, 1.0 - seam)] if 0.0 < seam < 1.0 else [(0.0, 1.0)]
    steps = np.arange(side) / side
    first = [(*panel, x, y, 1.0 / side, 1.0 / side) for panel in panels for x in steps for y in steps]
    row, cell = np.repeat(np.arange(n), len(first)), np.tile(np.array(first), (n, 1))
    if seeds is None:
        return row, cell
    narrow: list[tuple[np.ndarray, np.ndarray]] = []
    while len(row):
        low, _ = place(cell.T, (0.0, 0.0))
        high, _ = place(cell.T, (1.0, 1.0))
        width, height = high[0] - low[0], high[1] - low[1]
        along = np.zeros(len(row), int)
        for k in range(seeds.shape[1]):
            x, y, widest, highest = seeds[row, k].T
            dx, dy = np.abs(x - low[0] - 0.5 * width), np.abs(y - low[1] - 0.5 * height)
            close = (dx <= 1.2 * width) & (np.minimum(dy, 1.0 - dy) <= 1.2 * height)  # also beside the cell
            along |= close * ((width > widest) + 2 * (height > highest))
        along &= (cell[:, 4] > NARROWEST) + 2 * (cell[:, 5] > NARROWEST)
        near = along > 0
        narrow.append((row[~near], cell[~near]))
        row, cell, _ = _halved(row[near], cell[near], along[near])
    row, cell = (np.concatenate(x) for x in zip(*narrow, strict=True))
    return row, cell


def _halved(row: np.ndarray, cell: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The halves or quarters of cells: their rows, their places, and the number of the cell that each is a part of."""
    rows, cells, families = [], [], []
    first, second = (along & 1) > 0, (along & 2) > 0
    side = cell[:, SIDE] * np.where(np.stack([first, second], axis=-1), 0.5, 1.0)
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        used = np.flatnonzero((first | (i == 0)) & (second | (j == 0)))
        part = cell[used].copy()
        part[:, CORNER] += side[used] * (i, j)
        part[:, SIDE] = side[used]
        rows.append(row[used])
        cells.append(part)
        families.append(used)
    return np.concatenate(rows), np.concatenate(cells), np.concatenate(families)


def of_squares(sums: CellSums, first: int) -> Integrals:
    """The integrals that sums over a rule for the whole square are, with the same estimate of their errors.

    `first`: how many of the sums after the integral are coefficients along the first axis.
    """
    value, across, along = _read(sums.totals, first)
    return Integrals(value, WIDER * (across + along) + sums.error, np.broadcast_to(sums.missing, across.shape))


def _read(totals: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The integrals (k, C), and the size of the highest coefficients along either axis (k,)."""
    squared = totals[:, 1:] ** 2
    across, along = (np.sqrt(x.sum(axis=1).max(axis=-1)) for x in (squared[:, :first], squared[:, first:]))
    return totals[:, 0], across, along


def _evaluated(evaluate: Evaluate, rows: np.ndarray, row: np.ndarray, cell: np.ndarray) -> _Cells:
    totals, inherent, missing = evaluate(rows[row], cell)
    value, across, along = _read(totals, 2)
    error = SAFETY * (across + along)
    axes = np.where(across > 8.0 * along, 1, np.where(along > 8.0 * across, 2, 3))
    inherent, missing = (np.broadcast_to(x, error.shape) for x in (inherent, missing))
    return _Cells(row, cell, value, error, axes, missing, inherent)
