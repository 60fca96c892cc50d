"""The dependence of results on every number of a table: the coefficients c of result = sum of c_k v_k."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from ..arrays import ops
from ..arrays.kinds import SCALAR
from ..base.reflectance import Reflectance
from ..evaluate import batch
from ..evaluate.tracing import Task
from ..formula.direction import Direction, served
from ..tables._lookup import LEAST_KNOWN
from ..tables.gridded import Gridded
from .functionals import Linear, WeightedPairs

FEWEST, MOST = 1 << 13, 1 << 18
"""Pairs of directions for an integral, at first and at most."""

STEADY = 5e-3
"""Relative change of uncertainties on doubling the pairs, below which there are enough."""

TRIED = 3
"""Results that decide on that."""


class Coefficients(NamedTuple):
    """Matrices `rows` (n, nodes), one for each pattern of holes; `pattern` (C,) is the number of a channel's."""

    rows: list[sparse.csr_array]
    pattern: np.ndarray

    def of(self, channel: int) -> sparse.csr_array:
        """The coefficients (n, nodes) of f [1/sr] at the nodes, in a channel."""
        return self.rows[self.pattern[channel]]


class Around(NamedTuple):
    """The K nodes of the grid around each of n pairs.

    node     (K, n): their numbers, and `weight` (K, n): those of interpolation
    closed   (axes, K, n): the number along each axis, in the grid with its circles closed
    angles   (axes, n) [rad]: of the pairs
    served   (n,): 0 for pairs below the horizon, and `within`: 0 for pairs beyond the grid that have no value, else 1
    """

    node: np.ndarray
    weight: np.ndarray
    closed: np.ndarray
    angles: np.ndarray
    served: np.ndarray
    within: np.ndarray

    @property
    def kept(self) -> np.ndarray:
        """1 for pairs with a value, else 0."""
        return self.served * self.within


def by_channel(values: np.ndarray, m: Gridded) -> np.ndarray:
    """A table (grid...[, C]) as (nodes, C)."""
    return np.reshape(values, (-1, 1 if m.channel_names is None else values.shape[-1]))


def coefficients(m: Gridded, of: Linear, n: int, only: int | None = None) -> Coefficients:
    """The coefficients of results, with n pairs for each; of the first `only` of them.

    Holes count as 0 in an integral and make f unknown; nodes around them share their weights, as in `Gridded`.
    """
    valid, pattern = _patterns(~np.isnan(by_channel(m.brdf(), m)))
    count = int(np.prod(of.shape)) if only is None else only
    parts: list[list[Any]] = [[] for _ in valid]
    for pairs in of.pairs(n):
        if only is not None and np.max(pairs.row) >= only:
            break
        near = around(m, pairs)
        for part, usable in zip(parts, valid, strict=True):
            part.append(row(near.node, _shares(m, near.node, near.weight, usable) * near.kept, pairs, valid.shape[1]))
    empty = sparse.csr_array((count, valid.shape[1]))
    return Coefficients([sparse.vstack(p, format="csr") if p else empty for p in parts], pattern)


def _patterns(valid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The different columns of (nodes, C), as rows, and the number of each channel's."""
    numbers: dict[bytes, int] = {}
    pattern = [numbers.setdefault(column.tobytes(), len(numbers)) for column in valid.T]
    return np.stack([np.frombuffer(key, dtype=bool) for key in numbers]), np.array(pattern)


def around(m: Gridded, pairs: WeightedPairs) -> Around:
    """The nodes of the grid around pairs."""
    corners = (1 if m.interpolation == "nearest" else 2) ** sum(axis.size > 1 for axis in m.layout)
    inputs = [np.ascontiguousarray(w) for w in (pairs.wi, pairs.wo)]
    outputs = (SCALAR,) * (2 * corners + len(m.layout) + 2)
    arrays = [np.asarray(x) for x in batch.run(Task(_kernel, outputs, (3, 3)), m, inputs)]
    closed = np.unravel_index(np.rint(arrays[:corners]).astype(np.int64), [axis.size for axis in m.layout])
    grid = [len(x) for x in m.axes.values()]
    node = np.ravel_multi_index([i % k for i, k in zip(closed, grid, strict=True)], grid)
    *angles, served_, within = arrays[2 * corners :]
    return Around(
        node, np.asarray(arrays[corners : 2 * corners]), np.asarray(closed), np.asarray(angles), served_, within
    )


def _kernel(m: Reflectance, mean: Any, wi: Any, wo: Any) -> tuple:
    wi, wo = Direction(*wi), Direction(*wo)
    corners, beyond = mean.corners(wi, wo)
    zero = 0.0 * (wi.z + wo.z)
    lost, *_ = served(wi, wo)
    above, within = (
        ops.where(lost, 0.0, 1.0 + zero),
        1.0 + zero if beyond is False else ops.where(beyond, 0.0, 1.0 + zero),
    )
    angles = mean.system.angles(wi, wo, len(mean.layout) == 4)
    places = (*(at + zero for at, _ in corners), *(w + zero for _, w in corners))
    return (*places, *(angle + zero for angle in angles), above, within)


def _shares(m: Gridded, node: np.ndarray, weight: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Weights with holes left out, as in `Gridded`."""
    if usable.all():
        return weight
    valid = usable[node]
    if not m.holes or len(node) == 1:
        return np.where(valid.all(axis=0), weight, 0.0)
    weight = np.where(valid, weight, 0.0)
    left = weight.sum(axis=0)
    enough = left > LEAST_KNOWN
    return np.where(enough, weight / np.where(enough, left, 1.0), 0.0)


def row(node: np.ndarray, weight: np.ndarray, pairs: WeightedPairs, nodes: int) -> sparse.csr_array:
    """Sums (n, nodes) over pairs of their weights times those (K, n) of the nodes (K, n) around them."""
    weight = weight * pairs.weight
    if isinstance(pairs.row, int):
        return sparse.csr_array(np.bincount(node.reshape(-1), weight.reshape(-1), nodes)[None])
    number = np.broadcast_to(np.arange(node.shape[1]), node.shape)
    sums = sparse.coo_array((weight.reshape(-1), (number.reshape(-1), node.reshape(-1))), (node.shape[1], nodes))
    return sparse.csr_array(sums)
