"""Searches and layers of networks as few operations on long arrays, for libraries in which each costs time."""

from __future__ import annotations

from collections.abc import Sequence

from .fixed import Array
from .interface import Library


class Together(Library):
    """A library that has several operations of `ops` as one."""

    def one_interval(self, nodes: Array, count: int, x: Array) -> Array:
        """The interval of `count` increasing nodes that x is in, from 0; outside the nearest."""
        return self.module.searchsorted(nodes[1 : count - 1], self.op_stop_gradient(x))

    def one_network(self, layers: Sequence[tuple[Array, Array, int]], x: Sequence[Array], chosen: Array) -> Array:
        """See `ops.network`."""
        like = layers[0][0]
        h = self.module.stack(
            self.broadcast(*(self._listed([v], like)[0] if isinstance(v, float) else v for v in x)), -1
        )
        *inner, (kernel, bias, width) = layers
        for weights, shift, n in inner:
            h = self.function("maximum")(h @ weights.reshape(-1, n) + shift, 0.0)
        out = h @ kernel.reshape(-1, width)[:, chosen] + bias[chosen]
        return out[..., 0, :] if getattr(chosen, "ndim", 0) else out

    def _listed(self, numbers: Sequence[float], like: Array) -> Array:
        return self.module.asarray(numbers, dtype=like.dtype)
