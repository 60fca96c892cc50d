"""Trees that halve every dimension of a unit cube, as flat arrays; to and from nested braces of text."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...errors import FormatError
from ...machine.caches import kept
from .numbers import NumberText

DEEPEST = 16  # levels of a tree: 1/65536 of each side, as finely as Radiance samples them


class CubeTree(NamedTuple):
    """Values that are constant in cubes.

    first    (n,) number of a node's first child, the 2^dimensions of which lie side by side; 0 for a leaf
    values   (n,) of a leaf its value; of another node the mean over it, where NaN and infinity count as 0
    depth    levels below the root, which is node 0
    Bit d of a child's place says in which half of dimension d it lies.
    """

    first: np.ndarray
    values: np.ndarray
    dimensions: int
    depth: int


def parse(content: NumberText, dimensions: int, where: str) -> CubeTree:
    """The tree in a text: braces around 2^dimensions trees, or around the values of a grid, last dimension fastest."""
    stored = content.array(where)
    opens, before = content.braces()
    depth = np.cumsum(np.where(opens, 1, -1))
    if not len(opens) or not opens[0] or depth[-1] != 0 or (depth[:-1] <= 0).any():
        raise FormatError(f"{where}: braces that do not close one tree; expected {{ ... }}, nested")
    counts = np.diff(before, append=len(stored))
    groups = opens & ~np.concatenate([opens[1:], [False]])
    if before[0] or counts[~groups].any():
        raise FormatError(f"{where}: numbers beside braces; expected either numbers or trees between two braces")
    sizes = {1 << (dimensions * k): k for k in range(DEEPEST + 1)}
    wrong = sorted(set(counts[groups].tolist()) - sizes.keys())
    if wrong:
        raise FormatError(f"{where}: {wrong[0]} values in a grid, expected one of 1, {1 << dimensions}, ...")
    grids = np.array([sizes[n] for n in counts[groups].tolist()], np.int8)
    deepest = (depth[groups] - 1 + grids).max()
    if deepest > DEEPEST:
        raise FormatError(f"{where}: a tree {deepest} levels deep; expected at most {DEEPEST}")
    for k in set(grids.tolist()) - {0}:
        rows = before[groups][grids == k][:, None]
        stored[rows + np.arange(1 << (dimensions * k))] = stored[rows + _order(dimensions, k)]
    size = np.zeros(len(opens), np.int8)
    size[groups] = grids
    texts = [(groups[a], size[a], before[a]) for a in _levels(opens, depth, groups, dimensions, where)]
    return _with_means(*_nodes(texts, stored, dimensions), dimensions)


@kept
def _order(dimensions: int, k: int) -> np.ndarray:
    """Places in a grid of 2^k per side, last dimension fastest, in the order of a tree's leaves."""
    place = np.zeros(1, int)
    for level in range(k):
        child = np.arange(1 << dimensions)
        step = sum(((child >> d) & 1) << (k * (dimensions - 1 - d)) for d in range(dimensions))
        place = (place[:, None] + (step << (k - 1 - level))).ravel()
    return place


def _levels(opens: np.ndarray, depth: np.ndarray, groups: np.ndarray, dimensions: int, where: str) -> list[np.ndarray]:
    """The opening braces of each level, in order."""
    levels = []
    here = np.flatnonzero(opens & (depth == 1))
    while len(here):
        levels.append(here)
        closing = np.flatnonzero(~opens & (depth == len(levels) - 1))
        branch = ~groups[here]
        below = np.flatnonzero(opens & (depth == len(levels) + 1))
        counts = np.searchsorted(below, closing[branch]) - np.searchsorted(below, here[branch])
        wrong = counts[counts != 1 << dimensions]
        if len(wrong):
            raise FormatError(f"{where}: {wrong[0]} trees in a pair of braces, expected {1 << dimensions}")
        here = below
    return levels


Level = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Nodes of one level of a text: whether a node is a grid, its log2 size, and where its values are."""
Levels = list[np.ndarray]
"""Of a tree's nodes, one array per level from the root on."""


def _nodes(texts: list[Level], stored: np.ndarray, dimensions: int) -> tuple[Levels, Levels]:
    """`first` and `values` of a tree's nodes, every grid taken apart."""
    many, first, values, start = 1 << dimensions, [], [], 0
    below = iter(texts)
    is_grid, k, at = next(below)
    while True:
        branch = ~is_grid | (k > 0)
        start += len(k)
        first.append(np.where(branch, start + many * (np.cumsum(branch) - 1), 0))
        values.append(np.where(branch, 0.0, stored[np.where(branch, 0, at)]))
        if not branch.any():
            return first, values
        grown = [np.empty((branch.sum(), many), a.dtype) for a in (is_grid, k, at)]
        split = is_grid[branch]
        if not split.all():
            for children, level in zip(grown, next(below), strict=True):
                children[~split] = level.reshape(-1, many)
        k_below = k[branch][split][:, None].astype(int) - 1
        grown[0][split], grown[1][split] = True, k_below
        grown[2][split] = at[branch][split][:, None] + (1 << (dimensions * k_below)) * np.arange(many)
        is_grid, k, at = (a.reshape(-1) for a in grown)


def _with_means(first: Levels, values: Levels, dimensions: int) -> CubeTree:
    """The tree of these nodes, with means in its branches."""
    many = 1 << dimensions
    for k in reversed(range(len(first) - 1)):
        branch = first[k] > 0
        below = values[k + 1].reshape(-1, many)
        values[k][branch] = np.where(np.abs(below) < 1e100, below, 0.0).mean(axis=1)
    return CubeTree(np.concatenate(first), np.concatenate(values), dimensions, len(first) - 1)


def from_grid(grid: np.ndarray, tolerance: float) -> CubeTree:
    """The tree of a grid of 2^k per side, in which cubes of nearly equal values are one leaf.

    `tolerance`: how far the values in a cube may spread, relative to their largest magnitude; such a leaf holds their
    mean, so means over cubes, and hemispherical totals, stay as they are.
    """
    dimensions, depth = grid.ndim, len(grid).bit_length() - 1
    many = 1 << dimensions
    means = [grid.reshape(-1)[_order(dimensions, depth)]]
    low = high = means[0]
    merged = []
    for _ in range(depth):
        low, high = low.reshape(-1, many).min(axis=1), high.reshape(-1, many).max(axis=1)
        merged.append(high - low <= tolerance * np.maximum(np.abs(low), np.abs(high)))
        means.append(means[-1].reshape(-1, many).mean(axis=1))
    first, values, start = [], [], 0
    here = np.zeros(1, int)
    for level in range(depth, -1, -1):
        branch = ~merged[level - 1][here] if level else np.zeros(len(here), bool)
        start += len(here)
        first.append(np.where(branch, start + many * (np.cumsum(branch) - 1), 0))
        values.append(means[level][here])
        if not branch.any():
            break
        here = (many * here[branch][:, None] + np.arange(many)).ravel()
    return _with_means(first, values, dimensions)


def text(tree: CubeTree) -> str:
    """The tree in nested braces, every value so that it is read as the same number."""
    many = 1 << tree.dimensions
    first, order = tree.first.tolist(), _order(tree.dimensions, 1).argsort().tolist()
    words = list(map(repr, tree.values.tolist()))

    def written(node: int, indent: str) -> list[str]:
        child = first[node]
        if not child:
            return [f"{indent}{{ {words[node]} }}"]
        if not any(first[child : child + many]):
            return [f"{indent}{{ {' '.join(words[child + k] for k in order)} }}"]
        lines = [f"{indent}{{"]
        for k in range(many):
            lines += written(child + k, indent + "\t")
        return [*lines, f"{indent}}}"]

    return "\n" + "\n".join(written(0, "")) + "\n"


def leaf_places(tree: CubeTree) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Leaves of a tree: their numbers (n,), lowest corners (n, dimensions) and sides (n,)."""
    node, corner, side, leaves = np.zeros(1, int), np.zeros((1, tree.dimensions)), 1.0, []
    bits = (np.arange(1 << tree.dimensions)[:, None] >> np.arange(tree.dimensions)) & 1
    while len(node):
        leaf = tree.first[node] == 0
        leaves.append((node[leaf], corner[leaf], np.full(leaf.sum(), side)))
        side *= 0.5
        node, corner = node[~leaf], corner[~leaf]
        node = (tree.first[node][:, None] + np.arange(len(bits))).ravel()
        corner = (corner[:, None] + side * bits).reshape(-1, tree.dimensions)
    nodes, corners, sides = (np.concatenate(parts) for parts in zip(*leaves, strict=True))
    return nodes, corners, sides
