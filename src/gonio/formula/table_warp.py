"""Tables over the unit square that depend on parameters, and the warp that has such a table as its density.

A table is bilinear over the square and linear in its parameters. The warp maps a uniform point (sx, sy) to (x, y):
first y by the marginal density of the rows, then x by the density along the row; its inverse is the pair of
distribution functions. Interpolating normalized tables interpolates these functions, so the warp is exact between the
parameters' nodes too.
Source: Dupuy & Jakob 2018, "An adaptive parameterization for efficient material acquisition and rendering",
ACM TOG 37(6):274; the inversion of the piecewise linear densities is derived here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Fixed, ops

Slices = Sequence[tuple[Any, Any]]
"""The tables that are interpolated: pairs of number and weight."""

FEW = 16  # up to so many nodes, comparing each is quicker than a search

ONE: Slices = ((0, 1.0),)
"""The only table of a set of one."""


def bracket(nodes: Any, count: int, x: Any) -> Slices:
    """The two of `count` increasing nodes around x, with linear weights; constant beyond the outermost."""
    if count == 1:
        return ONE
    i = ops.interval(nodes, count, x)
    if i is not None:
        low, high = ops.take(nodes, i), ops.take(nodes, i + 1)
    elif count <= FEW:
        i, low, high = ops.to_index(0.0 * x), ops.take(nodes, 0), ops.take(nodes, 1)
        for k in range(1, count - 1):
            node = ops.take(nodes, k)
            passed = node < x
            i, low = ops.where(passed, k, i), ops.where(passed, node, low)
            high = ops.where(passed, ops.take(nodes, k + 1), high)
    else:
        i, _, _ = _last(count - 1, lambda k: ops.take(nodes, k), x)
        low, high = ops.take(nodes, i), ops.take(nodes, i + 1)
    w = ops.clip((x - low) / (high - low), 0.0, 1.0)
    return ((i, 1.0 - w), (i + 1, w))


def both(outer: Slices, inner: Slices, count: int) -> Slices:
    """Slices of a set with two parameters; the inner one has `count` nodes."""
    return tuple((i * count + j, v * w) for i, v in outer for j, w in inner)


def gather(table: Any, at: Slices, size: int, index: Any) -> Any:
    """Entry `index` of the interpolated table; a table has `size` entries."""
    return _weighted(table, [(number * size, weight) for number, weight in at], index)


def _weighted(table: Any, starts: Slices, index: Any) -> Any:
    total: Any = None
    for start, weight in starts:
        entry = ops.take(table, start + index)
        term = entry if type(weight) is float and weight == 1.0 else weight * entry
        total = term if total is None else total + term
    return total


def bilinear(table: Any, at: Slices, shape: tuple[int, int], x: Any, y: Any, of: tuple[Any, int] = (0, 1)) -> Any:
    """Value at (x, y) in [0, 1]^2 of a table with entries from 0 to 1; x runs along a row.

    `shape`: (rows, columns); one column stands for all x. An entry may hold several planes, side by side; `of`: the
    number of the plane that the value is of, and how many there are.
    """
    (rows, columns), (plane, planes) = shape, of
    row, v = _cell(y, rows)
    if columns == 1:
        low, high = (gather(table, at, planes * rows, row * planes + plane + k) for k in (0, planes))
        return _lerp(low, high, v)
    column, u = _cell(x, columns)
    first = (row * columns + column) * planes + plane
    steps = (0, planes, columns * planes, (columns + 1) * planes)
    v00, v01, v10, v11 = (gather(table, at, planes * rows * columns, first + step) for step in steps)
    return _lerp(_lerp(v00, v01, u), _lerp(v10, v11, u), v)


class MarginalWarp(NamedTuple):
    """The warp with its flat tables, as `tables` makes them. `at`: those to interpolate, as `both` has them.

    Shapes   x, y, sx, sy: any batch, values in [0, 1]; density per unit of the square's area, 1 on average.
    Error    rounding; where a whole row of the table is 0 the inverse puts sx = 0.
    """

    cells: Any
    rows: Any
    conditional: Any
    marginal: Any
    shape: tuple[int, int]
    number: int  # of tables in the set

    def eval(self, at: Slices, x: Any, y: Any) -> Any:
        """Density at (x, y)."""
        rows, columns = self.shape
        (row, v), (column, u) = _cell(y, rows), _cell(x, columns)
        left, right = self._edges(self._starts(at, row, column), v)
        return _lerp(left, right, u)

    def invert(self, at: Slices, x: Any, y: Any) -> tuple[Any, Any, Any]:
        """(sx, sy) that `sample` maps to (x, y), and the density there: the Jacobian of this inverse."""
        rows, columns = self.shape
        (row, v), (column, u) = _cell(y, rows), _cell(x, columns)
        starts = self._starts(at, row, column)
        left, right = self._edges(starts, v)
        before = self._between(starts, DISTRIBUTION, v)
        low, high = self._totals(at, row)
        total = _lerp(low, high, v)
        empty = total <= 0.0
        along = before + _segment(u, left, right) * (1.0 / (columns - 1))
        sx = ops.where(empty, 0.0, along / ops.where(empty, 1.0, total))
        sy = self._row(at, row, DISTRIBUTION) + _segment(v, low, high) * (1.0 / (rows - 1))
        return sx, sy, _lerp(left, right, u)

    def sample(self, at: Slices, sx: Any, sy: Any) -> tuple[Any, Any]:
        """(x, y) for two uniform numbers."""
        (rows, columns), count = self.shape, self.number
        row, row_start, below = _last(rows - 1, lambda k: gather(self.marginal, at, 1, k * count), sy)
        low, high = self._totals(at, row)
        v = _invert_segment((sy - below) * (rows - 1.0), low, high)
        wanted = sx * _lerp(low, high, v)
        edges = ((0, 1.0 - v), (1, v))
        # What the search looks up at every step is prepared outside it: it takes most of the time.
        starts = [(row * count + number + k * count, w * weight) for number, weight in at for k, w in edges]
        column, column_start, before = _last(
            columns - 1, lambda k: _weighted(self.conditional, starts, k * (rows * count)), wanted
        )
        left, right = self._edges(self._starts(at, row, column), v)
        u = _invert_segment((wanted - before) * (columns - 1.0), left, right)
        return (column_start + u) * (1.0 / (columns - 1)), (row_start + v) * (1.0 / (rows - 1))

    def _starts(self, at: Slices, row: Any, column: Any) -> Slices:
        """Where the entries of a cell begin, in each table."""
        rows, columns = self.shape
        size, first = 2 * rows * columns, (column * rows + row) * 2
        return [(number * size + first, weight) for number, weight in at]

    def _between(self, starts: Slices, entry: int, v: Any) -> Any:
        """An entry between the rows of a cell."""
        low, high = (_weighted(self.cells, starts, entry + step) for step in (0, 2))
        return _lerp(low, high, v)

    def _edges(self, starts: Slices, v: Any) -> tuple[Any, Any]:
        """The density at both columns of a cell, between its rows."""
        return self._between(starts, 0, v), self._between(starts, 2 * self.shape[0], v)

    def _row(self, at: Slices, row: Any, entry: int) -> Any:
        """An entry of a row."""
        return gather(self.rows, at, 2, row * (2 * self.number) + entry)

    def _totals(self, at: Slices, row: Any) -> tuple[Any, Any]:
        """The integrals of a row and the next one."""
        return self._row(at, row, 0), self._row(at, row, 2 * self.number)


DISTRIBUTION = 1
"""Place of the distribution function in an entry, behind density or integral."""


def tables(values: np.ndarray) -> tuple[np.ndarray, ...]:
    """Tables (..., rows, columns) as a warp looks them up, and their integrals.

    Entries that a lookup needs together lie side by side: cells (..., columns, rows, 2) are density and conditional
    distribution function, rows (rows, ..., 2) integral and marginal distribution function. For searches these functions
    stand alone, (columns, rows, ...) and (rows, ...). They start with 0, so that a lookup needs no special case.
    `values` are not negative, and every table has a positive integral; computed in float64.
    """
    values = np.asarray(values, dtype=np.float64)
    rows, columns = values.shape[-2:]
    conditional = np.zeros(values.shape)
    np.cumsum((values[..., :-1] + values[..., 1:]) * (0.5 / (columns - 1)), axis=-1, out=conditional[..., 1:])
    totals = conditional[..., -1]
    marginal = np.zeros(totals.shape)
    np.cumsum((totals[..., :-1] + totals[..., 1:]) * (0.5 / (rows - 1)), axis=-1, out=marginal[..., 1:])
    integral = marginal[..., -1].copy()
    cells = np.stack([values, conditional], -1).swapaxes(-3, -2) / integral[..., None, None, None]
    ends = np.moveaxis(np.stack([totals, marginal], -1) / integral[..., None, None], -2, 0)
    alone = cells[..., DISTRIBUTION]
    return cells, ends, np.moveaxis(alone, (-2, -1), (0, 1)), ends[..., DISTRIBUTION], integral


def tables_when_needed(names: Sequence[str], make: Callable[[], np.ndarray]) -> dict[str, Fixed]:
    """`tables` of the values that `make` returns, by name and flat; it is called when the first one is looked up."""
    flat = cache(lambda: [table.reshape(-1) for table in tables(make())])
    return {name: Fixed(partial(lambda k: flat()[k], k)) for k, name in enumerate(names)}


def _last(count: int, reached: Callable[[Any], Any], wanted: Any) -> tuple[Any, Any, Any]:
    """The last k < count for which the monotone `reached(k)` is below `wanted`, or 0; as a whole number and a real one,
    and what is reached there, 0 at k = 0."""
    real = 0.0 * wanted
    k, value = ops.to_index(real), real
    while count > 1:  # places from k on; whichever half is left, the larger one is searched: no place is beyond the end
        step = count // 2
        there = reached(k + step)
        passed = there < wanted
        k, real = ops.where(passed, k + step, k), ops.where(passed, real + step, real)
        value = ops.where(passed, there, value)
        count -= step
    return k, real, value


def _cell(x: Any, count: int) -> tuple[Any, Any]:
    """The number of the cell of [0, 1], which has count - 1, that x lies in, and the place in it."""
    position = ops.clip(x, 0.0, 1.0) * (count - 1.0)
    start = ops.minimum(ops.floor(position), count - 2.0)
    return ops.to_index(start), position - start


def _lerp(a: Any, b: Any, t: Any) -> Any:
    return a + t * (b - a)


def _segment(t: Any, a: Any, b: Any) -> Any:
    """Integral from 0 to t of the linear function with values a at 0 and b at 1."""
    return t * (a + 0.5 * t * (b - a))


def _invert_segment(area: Any, a: Any, b: Any) -> Any:
    """t in [0, 1] for which `_segment(t, a, b)` is `area`: the root in the form without cancellation."""
    divisor = a + ops.sqrt(ops.maximum(a * a + 2.0 * area * (b - a), 1e-30))
    return ops.clip(2.0 * area / divisor, 0.0, 1.0)
