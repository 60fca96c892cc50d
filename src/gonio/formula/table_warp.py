"""Tables over the unit square that depend on parameters, and the warp that has such a table as its density.

A table is bilinear over the square and linear in its parameters. The warp maps a uniform point (sx, sy) to (x, y):
first y by the marginal density of the rows, then x by the density along the row; its inverse is the pair of
distribution functions. Interpolating normalised tables interpolates these functions, so the warp is exact between the
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


def bilinear(table: Any, at: Slices, shape: tuple[int, int], x: Any, y: Any, plane: Any = 0, planes: int = 1) -> Any:
    """Value at (x, y) in [0, 1]^2 of a table with entries from 0 to 1; x runs along a row.

    `shape`: (rows, columns); one column stands for all x. An entry may hold several `planes`, side by side; the value
    is that of `plane`.
    """
    rows, columns = shape
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
    """The warp with its three flat tables, as `tables` makes them.

    Shapes   x, y, sx, sy: any batch, values in [0, 1]; density per unit of the square's area, 1 on average.
    Error    rounding; where a whole row of the table is 0 the inverse puts sx = 0.
    """

    density: Any
    conditional: Any
    marginal: Any
    shape: tuple[int, int]
    beside: int = 1  # entries side by side: of one table, or (2) of the next one too

    def eval(self, at: Slices, x: Any, y: Any) -> Any:
        """Density at (x, y)."""
        rows, columns = self.shape
        (row, v), (column, u) = _cell(y, rows), _cell(x, columns)
        left, right = self._edges(at, row, column, v)
        return _lerp(left, right, u)

    def invert(self, at: Slices, x: Any, y: Any) -> tuple[Any, Any, Any]:
        """(sx, sy) that `sample` maps to (x, y), and the density there: the Jacobian of this inverse."""
        rows, columns = self.shape
        (row, v), (column, u) = _cell(y, rows), _cell(x, columns)
        left, right = self._edges(at, row, column, v)
        before = self._between_rows(self.conditional, at, row, column, v)
        low, high = self._row_totals(at, row)
        total = _lerp(low, high, v)
        empty = total <= 0.0
        along = before + _segment(u, left, right) * (1.0 / (columns - 1))
        sx = ops.where(empty, 0.0, along / ops.where(empty, 1.0, total))
        below = _weighted(self.marginal, self._starts(at, rows), row * self.beside)
        sy = below + _segment(v, low, high) * (1.0 / (rows - 1))
        return sx, sy, _lerp(left, right, u)

    def sample(self, at: Slices, sx: Any, sy: Any) -> tuple[Any, Any]:
        """(x, y) for two uniform numbers."""
        rows, columns = self.shape
        beside = self.beside
        # What the searches look up at every step is prepared outside them: they take most of the time.
        starts = self._starts(at, rows)
        row, row_start, below = _last(rows - 1, lambda k: _weighted(self.marginal, starts, k * beside), sy)
        low, high = self._row_totals(at, row)
        v = _invert_segment((sy - below) * (rows - 1.0), low, high)
        starts = [
            (start + row * beside + k * beside, w * weight)
            for start, weight in self._starts(at, rows * columns)
            for k, w in ((0, 1.0 - v), (1, v))
        ]
        wanted = sx * _lerp(low, high, v)
        column, column_start, before = _last(
            columns - 1, lambda k: _weighted(self.conditional, starts, k * (rows * beside)), wanted
        )
        left, right = (_weighted(self.density, starts, column * (rows * beside) + k * rows * beside) for k in (0, 1))
        u = _invert_segment((wanted - before) * (columns - 1.0), left, right)
        return (column_start + u) * (1.0 / (columns - 1)), (row_start + v) * (1.0 / (rows - 1))

    def _starts(self, at: Slices, size: int) -> Slices:
        """Where the entries of the tables begin, `size` of each, with the tables' weights."""
        if self.beside == 1:
            return [(number * size, weight) for number, weight in at]
        pairs = zip(at[::2], at[1::2], strict=True)
        return [
            (number * (size * 2) + k, weight)
            for (number, first), (_, second) in pairs
            for k, weight in enumerate((first, second))
        ]

    def _between_rows(self, table: Any, at: Slices, row: Any, column: Any, v: Any, step: int = 0) -> Any:
        rows, columns = self.shape
        starts, first = self._starts(at, rows * columns), (column * rows + row) * self.beside
        low, high = (_weighted(table, starts, first + (k + step * rows) * self.beside) for k in (0, 1))
        return _lerp(low, high, v)

    def _edges(self, at: Slices, row: Any, column: Any, v: Any) -> tuple[Any, Any]:
        """The density at both columns of a cell, between its rows."""
        left, right = (self._between_rows(self.density, at, row, column, v, step) for step in (0, 1))
        return left, right

    def _row_totals(self, at: Slices, row: Any) -> tuple[Any, Any]:
        rows, columns = self.shape
        starts, end = self._starts(at, rows * columns), (columns - 1) * rows * self.beside
        low, high = (_weighted(self.conditional, starts, row * self.beside + end + k * self.beside) for k in (0, 1))
        return low, high


def tables(values: np.ndarray, beside: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Density, conditional and marginal distribution functions, and integrals of tables (..., rows, columns).

    Entries that a lookup needs together lie side by side: density and conditional functions are (..., columns, rows,
    beside), the marginal ones (..., rows, beside), where the last axis are this table and, if two lie beside each
    other, the next one along the axis before rows. Distribution functions start with 0, so that a lookup needs no
    special case. `values` are not negative, and every table has a positive integral; computed in float64.
    """
    values = np.asarray(values, dtype=np.float64)
    rows, columns = values.shape[-2:]
    conditional = np.zeros(values.shape)
    np.cumsum((values[..., :-1] + values[..., 1:]) * (0.5 / (columns - 1)), axis=-1, out=conditional[..., 1:])
    totals = conditional[..., -1]
    marginal = np.zeros(totals.shape)
    np.cumsum((totals[..., :-1] + totals[..., 1:]) * (0.5 / (rows - 1)), axis=-1, out=marginal[..., 1:])
    integral = marginal[..., -1].copy()
    scale = integral[..., None, None]
    density, conditional = ((t / scale).swapaxes(-2, -1) for t in (values, conditional))
    marginal = marginal / integral[..., None]
    return (*(_beside(t, n, beside) for t, n in ((density, 2), (conditional, 2), (marginal, 1))), integral)


def _beside(tables: np.ndarray, axes: int, count: int) -> np.ndarray:
    """Tables with as many axes, each entry followed by that of the next table (of the last one by its own)."""
    if count == 1:
        return np.ascontiguousarray(tables)
    following = np.concatenate([tables, tables[(..., slice(-1, None), *(slice(None),) * axes)]], -1 - axes)
    following = following[(..., slice(1, None), *(slice(None),) * axes)]
    return np.stack([tables, following], -1)


def tables_when_needed(names: Sequence[str], make: Callable[[], np.ndarray], beside: int) -> dict[str, Fixed]:
    """`tables` of the values that `make` returns, by name and flat; it is called when the first one is looked up."""
    flat = cache(lambda: [table.reshape(-1) for table in tables(make(), beside)])
    return {name: Fixed(partial(lambda k: flat()[k], k)) for k, name in enumerate(names)}


def _last(count: int, reached: Callable[[Any], Any], wanted: Any) -> tuple[Any, Any, Any]:
    """The last k < count for which the monotone `reached(k)` is below `wanted`, or 0; as a whole number and a real one,
    and what is reached there."""
    real = 0.0 * wanted
    k, value = ops.to_index(real), real
    while count > 1:
        # Of `count` places from k on, the first is below or the last resort. Halving takes as many steps as a search
        # that ends early at best, and leaves no bounds to be checked.
        step = count // 2
        there = reached(k + step)
        passed = there < wanted
        k, real, value = ops.where(passed, k + step, k), ops.where(passed, real + step, real), ops.where(passed, there, value)
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
