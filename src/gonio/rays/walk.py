"""Rays through the tree of boxes as a formula: in compiled kernels and on arrays, where Embree is not installed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import ops
from ..errors import TooLargeError
from .tree import LEAF, BoxTree

NODE, SLOT = 8, 10
"""Numbers of a node (its box, the node after it, and its leaf or -1) and of a triangle in a leaf (a corner, two edges,
its number)."""

MOST = 1 << 24
"""Nodes and triangles at most: whole numbers that single precision holds."""


def tables(tree: BoxTree) -> tuple[np.ndarray, np.ndarray]:
    """The nodes and the triangles in the leaves of a tree, flat, float32."""
    if 2 * tree.leaves > MOST or len(tree.start) > MOST:
        rule = f"expected at most {MOST // 4} without Embree; pip install 'gonio[mesh]'"
        raise TooLargeError(f"a mesh of {len(tree.start)} triangles; {rule}")
    leaf = np.arange(2 * tree.leaves) - tree.leaves
    nodes = np.column_stack([tree.low, tree.high, tree.after, np.maximum(leaf, -1)])
    nodes[0] = (*[1.0] * 3, *[-1.0] * 3, 0.0, -1.0)  # no node: met by nothing
    inside = tree.inside.reshape(-1)
    slots = np.column_stack([tree.start[inside], tree.u[inside], tree.v[inside], inside])
    return nodes.astype(np.float32).reshape(-1), slots.astype(np.float32).reshape(-1)


def nearest(nodes: Any, slots: Any, o: Sequence[Any], d: Sequence[Any], far: Any, any_will_do: bool = False) -> Any:
    """What `ops.nearest` gives: distance, infinite where nothing is met, two coordinates on the triangle, its number.

    `any_will_do`: of any triangle that is nearer than `far`.

    Source   Möller & Trumbore 1997, J. Graphics Tools 2:21, for a ray and a triangle.
    """
    inverse = [1.0 / ops.where(ops.absolute(x) < 1e-12, 1e-12, x) for x in d]

    def step(node: Any, best: Any, a: Any, b: Any, number: Any) -> tuple[Any, ...]:
        row = [ops.take(nodes, NODE * node + k) for k in range(NODE)]
        enter, leave = 0.0 * best, best
        for k in range(3):
            p, q = (row[k] - o[k]) * inverse[k], (row[3 + k] - o[k]) * inverse[k]
            enter, leave = ops.maximum(enter, ops.minimum(p, q)), ops.minimum(leave, ops.maximum(p, q))
        met = enter <= leave
        leaf = row[7] > -0.5
        slot = ops.to_index(ops.maximum(row[7], 0.0)) * (LEAF * SLOT)
        for k in range(LEAF):
            t, u, v, hit, which = _triangle([ops.take(slots, slot + (SLOT * k + i)) for i in range(SLOT)], o, d)
            hit = hit & met & leaf & (t > 0.0) & (t < best)
            best, a, b, number = (
                ops.where(hit, new, old) for new, old in zip((t, u, v, which), (best, a, b, number), strict=True)
            )
        node = ops.where(met & ~leaf, 2 * node, ops.to_index(row[6]))
        go_on = node > 0
        return (go_on & (number < 0.0) if any_will_do else go_on), node, best, a, b, number

    none = 0.0 * (o[0] + d[0])
    _, t, a, b, number = ops.loop(step, ops.to_index(none + 1.0), far + none, none, none, none - 1.0)
    is_hit = number >= 0.0
    return ops.where(is_hit, t, float("inf")), a, b, ops.to_index(ops.maximum(number, 0.0))


def _triangle(slot: Sequence[Any], o: Sequence[Any], d: Sequence[Any]) -> tuple[Any, ...]:
    """Where a ray meets the plane of a triangle: distance, coordinates, whether within it; its number."""
    corner, e, f, which = slot[:3], slot[3:6], slot[6:9], slot[9]
    p = _cross(d, f)
    volume = _dot(p, e)
    flat = ops.absolute(volume) < 1e-30
    scale = 1.0 / ops.where(flat, 1.0, volume)
    s = [x - y for x, y in zip(o, corner, strict=True)]
    q = _cross(s, e)
    u, v, t = _dot(s, p) * scale, _dot(d, q) * scale, _dot(f, q) * scale
    return t, u, v, ~flat & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0), which


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
