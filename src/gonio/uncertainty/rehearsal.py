"""What interpolation adds to the uncertainty of results: nodes are left out, and the results compared.

A result is a sum over the table, rho = sum c_k v_k. Each part of the interpolation's error is such a sum too, of other
coefficients or of another table: along each axis the differences of nodes from what is between their neighbours, the
slopes at the outermost nodes, the values of holes. A part may have either sign: it counts as a standard uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from ..numerics.filling import filled_in_layers
from ..tables.axes import INSIDE, Axis
from ..tables.gridded import Gridded
from ..tables.half_planes import APART
from ..tables.rows import SAME
from ..tables.scattered import Scattered
from .functionals import Linear
from .sensitivity import FEWEST, Around, around, by_channel, coefficients, row

UNRESOLVED = 3.0
"""Weight of what the two halves of the nodes differ by. Of a lobe narrower than the spacing the trapezoid rule is wrong
by as much as the result changes when every second node is left out; of what the nodes resolve by a third of that."""

UNIFORM = 12.0**-0.5
"""Standard deviation of a number evenly spread over an interval of length 1: of the distance to the nearest node."""

STEEPER = 2.0
"""How much faster f may rise or fall beyond the outermost nodes than between the last two, as towards grazing."""

FADES = 0.25 * math.pi
"""Distance [rad] from the only node of an axis from which on nothing is known."""


class ErrorPart(NamedTuple):
    """A part of the error of n results, by `name`.

    error      (n, C), of either sign
    of_values  the same as coefficients (n, nodes) of the values, for what noise makes of it; None where not
               asked
    """

    name: str
    error: np.ndarray
    of_values: sparse.csr_array | None = None

    def less(self, other: ErrorPart) -> ErrorPart:
        """The part of the error of a difference."""
        of_values = None if self.of_values is None or other.of_values is None else self.of_values - other.of_values
        return ErrorPart(self.name, self.error - other.error, of_values)


class Ruler(NamedTuple):
    """An axis as interpolation sees it.

    places     of the nodes with the circle closed, in the coordinate in which f is linear
    curvature  (nodes, nodes): -1/2 of the second derivative, from each node and its two neighbours
    step       (nodes, nodes): half the difference of the two neighbours
    slope      (nodes, nodes): the derivative at the outermost nodes [1/rad], outwards
    """

    axis: Axis
    places: np.ndarray
    curvature: sparse.csr_array
    step: sparse.csr_array
    slope: sparse.csr_array

    def between(self, closed: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """The product of the distances to the nodes on both sides, for pairs with these corners."""
        low = closed.min(axis=0)
        share = (weight * (closed > low)).sum(axis=0)
        step = np.diff(self.places)[np.minimum(low, len(self.places) - 2)]
        return share * (1.0 - share) * step**2

    def beyond(self, angle: np.ndarray) -> np.ndarray:
        """How far angles are beyond the outermost nodes [rad]."""
        axis = self.axis
        if axis.period:
            if not axis.mirrored:
                return np.zeros_like(angle)
            angle = np.mod(angle, axis.period)
            angle = np.minimum(angle, axis.period - angle)
        return np.maximum(np.maximum(axis.first - angle, angle - axis.last) - INSIDE, 0.0)


def _ruler(axis: Axis, nodes: np.ndarray) -> Ruler:
    count = len(nodes)
    if count == 1:
        nothing = sparse.csr_array((1, 1))
        return Ruler(axis, nodes, nothing, nothing, nothing)
    square_root = axis.spacing == "even in square root"
    x = np.sqrt(np.maximum(nodes, 0.0)) if square_root else nodes
    places = np.append(x, x[0] + axis.period)[: axis.size] if axis.period and not axis.mirrored else x
    before, after = np.arange(count) - 1, np.arange(count) + 1
    a, b = np.diff(x, prepend=np.nan), np.diff(x, append=np.nan)
    if axis.period and not axis.mirrored:
        if axis.size == count:  # the last node is the first one again
            before[0], after[-1] = count - 2, 1
            a[0], b[-1] = b[-2], b[0]
        else:
            before[0], after[-1] = count - 1, 0
            a[0] = b[-1] = x[0] + axis.period - x[-1]
    elif axis.mirrored:
        ends = 2.0 * x[0], axis.period - 2.0 * x[-1]
        before[0], a[0] = (0, ends[0]) if ends[0] > INSIDE else (1, b[0])
        after[-1], b[-1] = (count - 1, ends[1]) if ends[1] > INSIDE else (count - 2, a[-1])
    inside = np.arange(count)
    if np.isnan(a[0]):  # no circle: at the ends as beside them
        inside = np.clip(inside, 1, count - 2) if count > 2 else inside
    if count == 2 and np.isnan(a[0]):
        curvature = sparse.csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]]) / b[0] ** 2)
        step = sparse.coo_array(np.array([[-1.0, 1.0], [-1.0, 1.0]]))
    else:
        n, k = np.arange(count), inside
        total, product = a[k] + b[k], a[k] * b[k]
        values = np.concatenate([1.0 / product, -b[k] / total / product, -a[k] / total / product])
        at = (np.tile(n, 3), np.concatenate([k, before[k], after[k]]))
        curvature = sparse.csr_array(sparse.coo_array((values, at), (count, count)))
        halves = np.repeat([0.5, -0.5], count)
        step = sparse.coo_array((halves, (np.tile(n, 2), np.concatenate([after[k], before[k]]))), (count, count))
    slope = sparse.lil_array((count, count))
    if not axis.period or axis.mirrored:
        first, last = nodes[1] - nodes[0], nodes[-1] - nodes[-2]
        slope[0, 0], slope[0, 1] = 1.0 / first, -1.0 / first
        slope[-1, -1], slope[-1, -2] = 1.0 / last, -1.0 / last
    return Ruler(axis, places, curvature, sparse.csr_array(step), sparse.csr_array(slope))


class Rehearsal:
    """The errors that interpolation may make in results of a table."""

    def __init__(self, m: Gridded):
        self.m = m
        self.shape = tuple(map(len, m.axes.values()))
        self.rulers = [_ruler(axis, nodes) for axis, nodes in zip(m.layout, m.axes.values(), strict=True)]
        table = by_channel(m.brdf(), m)
        if m.holes:
            wraps = [bool(axis.period) and not axis.mirrored for axis in m.layout]
            empty = np.isnan(table).all(axis=0)
            table = filled_in_layers(np.where(empty, 0.0, table).reshape(*self.shape, -1), wraps)[0]
        self.table = table.reshape(math.prod(self.shape), -1)

    def parts(self, of: Linear, noisy: bool) -> list[ErrorPart]:
        """The parts of the error of results of a linear function."""
        n = FEWEST if of.sampled else 1
        kinds = self._kinds()
        sums: dict[Any, list[sparse.csr_array]] = {key: [] for key in kinds}
        for pairs in of.pairs(n):
            near = around(self.m, pairs)
            for key in kinds:
                sums[key].append(row(near.node, near.weight * self._share(key, near), pairs, len(self.table)))
        empty = sparse.csr_array((math.prod(of.shape), len(self.table)))
        rows = {key: sparse.csr_array(sparse.vstack(x, format="csr")) if x else empty for key, x in sums.items()}
        return [part for key in kinds for part in self._parts(key, rows[key], of, n, noisy)]

    def left_out(self) -> Iterator[tuple[float, list[Gridded]]]:
        """For each axis two tables: every second node, and then the others, replaced by what is between neighbours; and
        the share of the sum of both changes that is the error."""
        grid = self.table.reshape(*self.shape, -1)
        for k, ruler in enumerate(self.rulers):
            if len(ruler.places) == 1:
                continue
            scale = sparse.diags_array(1.0 / ruler.curvature.diagonal())
            off = self._along(sparse.csr_array(scale @ ruler.curvature), k).reshape(grid.shape)
            tables = []
            for first in (1, 0):
                left = (slice(None),) * k + (slice(first, None, 2),)
                made = grid.copy()
                made[left] -= off[left]
                tables.append(self.m.with_brdf(made.reshape(self.m.brdf().shape)))
            yield 1.0 / 6.0, tables

    def _kinds(self) -> list[tuple[str, int]]:
        """What there is to sum: a word and an axis."""
        kinds = []
        for k, ruler in enumerate(self.rulers):
            if len(ruler.places) == 1:
                kinds.append(("unseen", k))
                continue
            if not isinstance(self.m, Scattered):  # nodes between rows are not where f was measured
                kinds.append(("between", k))
            if not ruler.axis.period or ruler.axis.mirrored:
                kinds.append(("beyond", k))
        if self.m.holes or self.m.outside != "hold":
            kinds.append(("missing", 0))
        return kinds

    def _share(self, key: tuple[str, int], near: Around) -> np.ndarray:
        """Weights (n,) of pairs."""
        what, k = key
        ruler = self.rulers[k]
        if what == "between":
            nearest = self.m.interpolation == "nearest"
            return near.kept if nearest else near.kept * ruler.between(near.closed[k], near.weight)
        if what == "beyond":
            return near.served * ruler.beyond(near.angles[k])
        if what == "unseen":
            return near.served * np.minimum(ruler.axis.apart(near.angles[k], ruler.axis.first) / FADES, 1.0)
        return near.served

    def _parts(
        self, key: tuple[str, int], rows: sparse.csr_array, of: Linear, n: int, noisy: bool
    ) -> Iterator[ErrorPart]:
        what, k = key
        name = list(self.m.axes)[k]
        if what == "between":
            yield from self._between(rows, k, noisy)
        elif what == "beyond":
            yield self._part(f"beyond {name}", STEEPER * rows, self.rulers[k].slope, k, noisy)
        elif what == "unseen":
            axes = tuple(j for j in range(len(self.shape)) if self.shape[j] > 1)
            grid = self.table.reshape(*self.shape, -1)
            spread = np.abs(grid - grid.mean(axis=axes, keepdims=True)).reshape(self.table.shape)
            yield ErrorPart(f"only {name}", rows @ spread)
        else:
            linear = coefficients(self.m, of, n)
            table = np.nan_to_num(by_channel(self.m.brdf(), self.m))
            at_nodes = np.stack([linear.of(c) @ table[:, c] for c in range(table.shape[1])], axis=1)
            yield ErrorPart("missing", rows @ self.table - at_nodes)

    def _between(self, rows: sparse.csr_array, k: int, noisy: bool) -> Iterator[ErrorPart]:
        """Along an axis: by all nodes, and by the difference of every second one from the others."""
        ruler, name = self.rulers[k], f"between {list(self.m.axes)[k]}"
        if self.m.interpolation == "nearest":
            scale = sparse.diags_array(0.5 / ruler.curvature.diagonal())
            yield self._part(name, rows, sparse.csr_array(scale @ ruler.curvature), k, noisy)
            yield self._part(f"nearest {name}", UNIFORM * rows, ruler.step, k, noisy)
            return
        yield self._part(name, rows, ruler.curvature, k, noisy)
        if ruler.axis.period and np.diff(ruler.places).max(initial=0.0) > APART + SAME:
            off = self._beside_noise(self._along(ruler.curvature, k), ruler.curvature, k)
            yield ErrorPart(f"few {name}", UNRESOLVED * rows @ off)
            return
        sign = np.ones(self.shape)
        np.moveaxis(sign, k, 0)[1::2] = -1.0
        other = sparse.csr_array(rows.multiply(UNRESOLVED * sign.reshape(1, -1)))
        yield self._part(f"every second {name}", other, ruler.curvature, k, noisy)

    def _beside_noise(self, table: np.ndarray, along: sparse.csr_array, k: int) -> np.ndarray:
        """The size of the values that a matrix made along an axis, less what independent errors make of them."""
        u = self.m.brdf_uncertainty()
        if u is None:
            return np.abs(table)
        squares = np.moveaxis(np.nan_to_num(u).reshape(*self.shape, -1) ** 2, k, 0)
        noise = ((along * along) @ squares.reshape(len(squares), -1)).reshape(squares.shape)
        return np.sqrt(np.maximum(table**2 - np.moveaxis(noise, 0, k).reshape(table.shape), 0.0))

    def _part(self, name: str, rows: sparse.csr_array, along: sparse.csr_array, k: int, noisy: bool) -> ErrorPart:
        """Sums over the table that a matrix (nodes, nodes) makes along an axis."""
        of_values = None
        if noisy:
            before, behind = (sparse.eye_array(math.prod(part)) for part in (self.shape[:k], self.shape[k + 1 :]))
            full = sparse.kron(sparse.kron(before, along), behind, format="csr")
            of_values = sparse.csr_array(rows @ full)
        return ErrorPart(name, rows @ self._along(along, k), of_values)

    def _along(self, matrix: sparse.csr_array, k: int) -> np.ndarray:
        """The table (nodes, C) that a matrix makes along an axis."""
        grid = np.moveaxis(self.table.reshape(*self.shape, -1), k, 0)
        made = (matrix @ grid.reshape(len(grid), -1)).reshape(grid.shape)
        return np.moveaxis(made, 0, k).reshape(self.table.shape)
