"""BSDFs in trees over two discs mapped to squares, Radiance's tensor trees."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...arrays import Fixed, ops
from ...errors import ParameterError
from ...formula.direction import Direction, azimuth
from ...formula.fields import Ours, table
from ...formula.state import state
from ...pictures.colour import RELATIVE_XYZ
from . import _cell_tables, tree_nodes
from ._cell_tables import MIRRORED, Cellwise
from .tree_nodes import CubeTree

if TYPE_CHECKING:
    import xarray

FINEST = 5  # sampling tables have at most 2^5 cells per side of a square


class TensorTree(Cellwise):
    """f in a tree over squares of directions, fine where it varies: from Radiance's XML.

    f is constant in cubes of 3 or 4 dimensions. Shirley and Chiu's map takes the unit disc to the unit square, equal
    areas to equal areas, so that areas are projected solid angles over pi.

    4   squares of -wi (x, y of a propagating ray) and of wo
    3   isotropic: (1 - sin(theta_i))/2, and the square of wo, turned with -wi to azimuth 0

    Values are kept as they are in the file, negative ones too (Radiance takes them for 0). With trees for u' and v',
    channels are X, Y, Z: of Y, and of these chromaticities. Sides are as for `Klems`.

    Sampling draws wi from a table of f over 32^2 cells of its square, for each cell of wo (each sin(theta_o) of
    isotropic trees), uniformly within a cell, with a cosine-distributed share of 0.1.

    Shapes   f: (...), or (..., C) for several trees.
    Units    f: 1/sr.
    Error    none of its own; against Radiance (pyradiance 1.3.1): f 2e-4 relative, which Radiance adds on purpose to
             each cube, hemispherical totals 1e-7. X and Z too, where f comes near 0; elsewhere Radiance takes off a
             Lambertian part, and then has the luminance right and colours that are wrong (Z < 0, even).
    Source   Radiance's bsdf_t.c, read for the conventions; Shirley & Chiu 1997, "A low distortion map between disk and
             square", J. Graphics Tools 2(3):45.
    """

    breaks: ClassVar[dict[str, str]] = {
        **Cellwise.breaks,
        "reciprocity": "a tree holds both orders of every pair, measured or computed on their own",
        "isotropy": "cells of four-dimensional trees have edges, which do not turn with the directions",
    }

    first = table("number of each node's first child, 0 for leaves; of all trees")
    values = table("f of leaves [1/sr], means in other nodes; of all trees")
    roots = table("number of each tree's root")

    dimensions: int = state()
    depth: int = state()
    """Levels of the deepest tree."""
    colour: str = state()
    """"" for a tree per channel, "uv" for trees of Y, u' and v'."""

    def __init__(
        self,
        trees: Sequence[CubeTree],
        side: str = "front",
        colour: str = "",
        channel_names: Sequence[str | float] | None = None,
        **notes: Any,
    ):
        """`notes`: path and about."""
        trees = tuple(trees)
        if not trees or len({t.dimensions for t in trees}) != 1 or trees[0].dimensions not in (3, 4):
            raise ParameterError("TensorTree: expected one or more trees, all of 3 or all of 4 dimensions")
        roots = np.cumsum([0, *(len(t.first) for t in trees[:-1])])
        size = sum(len(t.first) for t in trees)
        if size >= 1 << 24:
            most = f"expected fewer than {1 << 24}, which single precision can number"
            raise ParameterError(
                f"TensorTree: {size} nodes, {most}; prune it, with Radiance's rttree_reduce for example"
            )
        first = np.empty(size)
        for t, root in zip(trees, roots.tolist(), strict=True):
            first[root : root + len(t.first)] = np.where(t.first > 0, t.first + root, 0)
        names = tuple(channel_names) if channel_names is not None else RELATIVE_XYZ if colour else None
        depth = max(t.depth for t in trees)
        self._hold(dimensions=trees[0].dimensions, depth=depth, colour=colour, channel_names=names)
        values = np.concatenate([ops.numbers(t.values) for t in trees])
        tables = {"first": Ours(first), "values": Ours(values), "roots": roots.astype(float)}
        super().__init__(side, **tables, channel=len(names) if names else 0.0, **notes)

    def validate(self) -> None:
        super().validate()
        if self.values.shape != self.first.shape:
            raise ParameterError(f"TensorTree(values): got shape {self.values.shape}, expected {self.first.shape}")

    @property
    def trees(self) -> tuple[CubeTree, ...]:
        """The trees, one per channel or those of Y, u' and v'."""
        roots = self.roots.astype(int).tolist()
        trees = []
        for start, end in zip(roots, [*roots[1:], len(self.first)], strict=True):
            first = self.first[start:end].astype(int)
            first = np.where(first > 0, first - start, 0)
            trees.append(CubeTree(first, self.values[start:end], self.dimensions, self.depth))
        return tuple(trees)

    @property
    def data(self) -> xarray.Dataset:
        """Variables `value`, `side` and `corner` of the leaves: cubes in the unit square's coordinates, by tree."""
        import xarray

        parts = [
            (tree_nodes.leaf_places(t), np.full(int((t.first == 0).sum()), k), t.values)
            for k, t in enumerate(self.trees)
        ]
        variables = {
            "value": ("leaf", np.concatenate([v[n] for (n, _, _), _, v in parts]), {"units": "sr-1"}),
            "corner": (("leaf", "dimension"), np.concatenate([corner for (_, corner, _), _, _ in parts])),
            "side": ("leaf", np.concatenate([side for (_, _, side), _, _ in parts])),
            "tree": ("leaf", np.concatenate([k for _, k, _ in parts])),
        }
        return xarray.Dataset(variables, attrs={"quantity": self.quantity, "source": self.path})

    def rough_albedo(self) -> float:
        """Of light from everywhere: the mean over the unit cube, whose cells are as large as they count."""
        totals = []
        for tree in self.trees[:1] if self.colour else self.trees:
            nodes, _, sides = tree_nodes.leaf_places(tree)
            totals.append(math.pi * float(np.nansum(tree.values[nodes] * sides**tree.dimensions)))
        return max(totals)

    def _keep(self) -> dict[str, Fixed]:
        kept = super()._keep()
        solid = np.full(4**self._fineness, math.pi / 4**self._fineness)
        kept["values"] = Fixed(_cell_tables.with_holes(self.values))
        return kept | _cell_tables.sampling(self._weights, solid)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        place = self._place(wi, wo)
        roots = range(3) if self.colour else [ops.to_index(self.channel)]
        nodes = _descend(self.first, [ops.to_index(ops.take(self.roots, k)) for k in roots], place, self.depth)
        values = [ops.take(self.values, node) for node in nodes]
        if not self.colour:
            return values[0]
        Y, u, v = values
        scale = Y / ops.where(ops.absolute(v) < 1e-6, 1.0, 4.0 * v)
        X, Z = 9.0 * u * scale, (12.0 - 3.0 * u - 20.0 * v) * scale
        return ops.where(self.channel < 0.5, X, ops.where(self.channel < 1.5, Y, Z))

    def _place(self, wi: Direction, wo: Direction) -> list[Any]:
        """The point in the unit cube that a pair of directions is looked up at."""
        sign = MIRRORED[self.side]
        if self.dimensions == 4:
            return [*_square(-sign * wi.x, -wi.y), *_square(sign * wo.x, wo.y)]
        s = ops.sqrt(wi.x * wi.x + wi.y * wi.y + 1e-30)
        c, d = azimuth(wi, s)
        x, y = -(c * wo.x + d * wo.y), -(c * wo.y - d * wo.x)
        return [ops.minimum(0.5 - 0.5 * s, 0.5 - 1e-6), *_square(x, sign * y)]

    @property
    def _fineness(self) -> int:
        """log2 of the cells per side of the sampling tables."""
        return min(self.depth, FINEST) if self.dimensions == 4 else FINEST

    def _weights(self) -> np.ndarray:
        """Projected solid angle times |f|, mean of the trees, by cell of wo and cell of wi."""
        k = self._fineness
        centres = (np.arange(1 << k) + 0.5) / (1 << k)
        roots = self.roots[:1] if self.colour else self.roots
        if self.dimensions == 4:
            a, b, c, d = np.meshgrid(centres, centres, centres, centres, indexing="ij")
            place, depth = [c, d, a, b], k
        else:
            fine = (np.arange(2 << k) + 0.5) / (2 << k)
            s, x, y = np.meshgrid(centres, fine, fine, indexing="ij")
            wo = Direction(s, 0.0 * s, np.sqrt(1.0 - s * s))
            wi = _cell_tables.lifted(*disc(x, y))
            place, depth = self._place(wi, wo), self.depth
        nodes = _descend(self.first, [np.full(place[0].shape, int(root)) for root in roots], place, depth)
        means = np.mean(_cell_tables.magnitude(self.values)[nodes], axis=0)
        if self.dimensions == 3:
            means = means.reshape(1 << k, 1 << k, 2, 1 << k, 2).mean(axis=(2, 4))
        return means.reshape(-1, 4**k) * (math.pi / 4**k)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        k, (row, c, d) = self._fineness, self._seen_from(wo)
        cell, left = _cell_tables.choose(self.sums, row * 4**k, 4**k, u0)
        i = ops.floor((cell + 0.5) * 0.5**k)
        x, y = disc((i + u1) * 0.5**k, (cell - i * 2.0**k + left) * 0.5**k)
        if self.dimensions == 4:
            return _cell_tables.lifted(-MIRRORED[self.side] * x, -y)
        return _cell_tables.lifted(c * x - d * y, d * x + c * y)

    def density(self, wi: Direction, wo: Direction) -> Any:
        k, (row, c, d) = self._fineness, self._seen_from(wo)
        if self.dimensions == 4:
            point = _square(-MIRRORED[self.side] * wi.x, -wi.y)
        else:
            point = _square(c * wi.x + d * wi.y, c * wi.y - d * wi.x)
        return ops.take(self.densities, row * 4**k + _cell(point, k)) * wi.z

    def estimate(self, wo: Direction) -> Any:
        return ops.take(self.reflected, self._seen_from(wo)[0])

    def _seen_from(self, wo: Direction) -> tuple[Any, Any, Any]:
        """Number of the sampling table for wo, and cosine and sine of the azimuth that it is turned by."""
        k = self._fineness
        if self.dimensions == 4:
            return _cell(_square(MIRRORED[self.side] * wo.x, wo.y), k), 1.0, 0.0
        s = ops.sqrt(wo.x * wo.x + wo.y * wo.y + 1e-30)
        c, d = azimuth(wo, s)
        return ops.to_index(ops.minimum(s, 1.0 - 1e-7) * 2.0**k), c, d


def _descend(first: Any, nodes: list[Any], place: list[Any], depth: int) -> list[Any]:
    """The nodes around a point of the unit cube in the trees with these roots: `depth` levels down, or leaves."""
    place = [ops.clip(x, 0.0, 1.0 - 1e-7) for x in place]
    for _ in range(depth):
        halves = [ops.floor(2.0 * x) for x in place]
        children = [ops.take(first, node) for node in nodes]
        step = sum(((1 << d) * half for d, half in enumerate(halves)), 0.0)
        nodes = [ops.where(c > 0.0, ops.to_index(c + step), n) for c, n in zip(children, nodes, strict=True)]
        place = [2.0 * x - half for x, half in zip(place, halves, strict=True)]
    return nodes


def _cell(point: tuple[Any, Any], k: int) -> Any:
    """Number of the cell of a point of the unit square, rows first."""
    i, j = (ops.to_index(ops.clip(x, 0.0, 1.0 - 1e-7) * 2.0**k) for x in point)
    return i * 2**k + j


def _square(x: Any, y: Any) -> tuple[Any, Any]:
    """The point of the unit square for a point of the unit disc."""
    wide, high = ops.absolute(x), ops.absolute(y)
    r = ops.sqrt(x * x + y * y + 1e-20)
    t = ops.arctan2(ops.minimum(wide, high), ops.maximum(wide, high) + 1e-20) * (4.0 / math.pi)
    a, b = ops.where(wide >= high, r, t * r), ops.where(wide >= high, t * r, r)
    return 0.5 + 0.5 * ops.where(x < 0.0, -a, a), 0.5 + 0.5 * ops.where(y < 0.0, -b, b)


def disc(u: Any, v: Any) -> tuple[Any, Any]:
    """The point of the unit disc for a point of the unit square: the inverse of `_square`."""
    a, b = 2.0 * u - 1.0, 2.0 * v - 1.0
    wide, high = ops.absolute(a), ops.absolute(b)
    r = ops.maximum(wide, high)
    angle = ops.minimum(wide, high) / ops.where(r > 0.0, r, 1.0) * (0.25 * math.pi)
    near, far = r * ops.cos(angle), r * ops.sin(angle)
    x, y = ops.where(wide >= high, near, far), ops.where(wide >= high, far, near)
    return ops.where(a < 0.0, -x, x), ops.where(b < 0.0, -y, y)
