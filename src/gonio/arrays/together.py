"""Lookups, searches and layers of networks as few operations on long arrays: for libraries in which each costs time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .fixed import Array
from .interface import Library

SHORT = 1 << 18
"""Numbers of the result of a sum of lookups up to which they are made together; longer ones would leave the cache."""


class Together(Library):
    """A library that has several operations of `ops` as one."""

    def one_interval(self, nodes: Array, count: int, x: Array) -> Array:
        """The interval of `count` increasing nodes that x is in, from 0; outside the nearest."""
        return self.module.searchsorted(nodes[1 : count - 1], self.op_stop_gradient(x))

    def one_interpolated(
        self, table: Array, places: Sequence[Array], weights: Sequence[Array], steps: Sequence[int]
    ) -> Sequence[Array] | None:
        """See `ops.interpolated`; None for few lookups, or many numbers."""
        arrays = [x for x in places if not isinstance(x, int)]
        if len(places) * len(steps) < 3 or not arrays:
            return None
        start, share = self._stacked(places, arrays[0]), self._stacked(weights, table)
        deep = max(start.ndim, share.ndim)
        start, share = (x.reshape(len(x), *(deep - x.ndim) * (1,), *x.shape[1:]) for x in (start, share))
        size = 1
        for n in start.shape:
            size *= n
        if size * len(steps) > SHORT:
            return None
        further = self._listed(steps, start).reshape(-1, *start.ndim * (1,))
        total = (table[further + start] * share).sum(1)
        return [total[k] for k in range(len(steps))]

    def one_network(self, layers: Sequence[tuple[Array, Array, int]], x: Sequence[Array], chosen: Array) -> Array:
        """See `ops.network`."""
        h = self._stacked(x, layers[0][0], last=True)
        *inner, (kernel, bias, width) = layers
        for weights, shift, n in inner:
            h = self.op_maximum(h @ weights.reshape(-1, n) + shift, self._listed([0.0], h))
        out = h @ kernel.reshape(-1, width)[:, chosen] + bias[chosen]
        return out[..., 0, :] if getattr(chosen, "ndim", 0) else out

    def _listed(self, numbers: Sequence[float], like: Array) -> Array:
        return self.module.asarray(numbers, dtype=like.dtype)

    def _stacked(self, values: Sequence[Any], like: Array, last: bool = False) -> Array:
        """Numbers and arrays along a new first axis, or the last."""
        arrays = [self._listed([x], like)[0] if isinstance(x, (int, float)) else x for x in values]
        return self.module.stack(self.broadcast(*arrays), -1 if last else 0)
