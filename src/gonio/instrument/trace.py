"""Light from one direction on one surface: where it goes, by the number of bounces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..evaluate.computation import composite
from ..formula import tree
from ..formula.parametrised import Parametrised
from ..machine.caches import kept
from ..numerics.lattice import lattice
from .bounce import ENTER, GO_ON, INSIDE, LOST, SAMPLE, UNDERWAY
from .cells import Cells
from .march import MOST_STEPS

BATCH = 1 << 16
"""Rays at a time: their arrays stay in the processor's cache."""

PATIENCE, FEW = (8, 24, MOST_STEPS), 4096
"""Steps that a ray may take before those that are still on their way are packed together, and again; and the number of
rays that are too few for that: all lanes of a vector wait for the one that takes longest."""

TILES = 64
"""The unit square is walked through in so many tiles along each side, so that neighbours in a batch are near."""


@kept
def points(count: int) -> np.ndarray:
    """Points (count, 2) spread evenly over the unit square, those that are near each other together."""
    spread = lattice(count, 2)
    tile = np.floor(spread * TILES)
    order = np.argsort(tile[:, 1] * TILES + tile[:, 0], kind="stable")
    ordered = np.ascontiguousarray(spread[order], np.float32)
    ordered.flags.writeable = False
    return ordered


class _LightShares(NamedTuple):
    """Shares of the incident light.

    cells       (rings, sectors, C): what leaves into each cell of directions, of all bounces
    bounces     (K, C): what leaves after one bounce, two, ...
    unfinished  (C,): what met the surface once more than it is followed
    lost        (C,): what got lost by rounding
    """

    cells: np.ndarray
    bounces: np.ndarray
    unfinished: np.ndarray
    lost: np.ndarray


class _Rays(NamedTuple):
    """Rays on facets or on their way, and where they go; `weight`: the light (n, C) of each, or the number of all."""

    spot: np.ndarray
    inside: np.ndarray
    w: np.ndarray
    weight: Any

    @classmethod
    def together(cls, several: Sequence[_Rays]) -> _Rays:
        """Several batches as one."""
        if len(several) == 1:
            return several[0]
        spot, inside, w, weights = zip(*several, strict=True)
        weight = weights[0] if isinstance(weights[0], float) else np.concatenate(weights)
        return cls(np.concatenate(spot), np.concatenate(inside), np.concatenate(w), weight)

    def chosen(self, mask: np.ndarray) -> _Rays:
        """Those of a mask."""
        places = np.flatnonzero(mask)
        if len(places) == len(mask):
            return self
        weight = self.weight if isinstance(self.weight, float) else self.weight.take(places, 0)
        return _Rays(self.spot.take(places, 0), self.inside.take(places, 0), self.w.take(places, 0), weight)

    def light(self) -> np.ndarray:
        """The light (C,) of all."""
        if isinstance(self.weight, float):
            return np.array([self.weight * len(self.spot)])
        return self.weight.sum(0, dtype=float)


class _Walk:
    """Light on its way over a surface, and what has become of it."""

    def __init__(
        self, scene: Parametrised, facet: float | Reflectance, size: int, bounces: int, rng: np.random.Generator
    ):
        self.scenes = [tree.with_values(scene, {"steps": float(steps)}) for steps in PATIENCE]
        self.facet, self.size, self.rng, self.mirrors = facet, size, rng, isinstance(facet, float)
        self.cells: Any = 0.0
        self.lost: Any = 0.0
        self.left: list[Any] = [0.0] * bounces

    def enter(self, points: np.ndarray, w: np.ndarray) -> tuple[_Rays, _Rays]:
        """Rays of direction w (n, 3) from the source, after their first bounce: as `onward` gives them."""
        hits = ENTER[self.mirrors](self.scenes[1], point=points)
        self.lost = self.lost + float(np.count_nonzero(hits["bin"] == LOST))
        first, late = self._sorted(hits, w, 1.0)
        return self.onward(self.turned(_Rays.together([first, self.met(late, 0)])), 0, 0)

    def met(self, rays: _Rays, k: int, tries: int = 0) -> _Rays:
        """Rays on the next facets; those that leave, after k + 1 bounces, are counted."""
        several = []
        while len(rays.spot) and tries < len(PATIENCE):
            on_facets, rays = self.onward(rays, k, tries)
            several.append(on_facets)
            tries += 1
        self.lost = self.lost + rays.light()
        return _Rays.together(several) if several else rays

    def onward(self, rays: _Rays, k: int, tries: int) -> tuple[_Rays, _Rays]:
        """Rays on the next facets, and those that are on their way after some steps."""
        scene = self.scenes[tries if len(rays.spot) > FEW else -1]
        steps = GO_ON[self.mirrors](scene, spot=rays.spot, inside=rays.inside, w=rays.w)
        lost, row = _counted(steps["bin"], rays.weight, self.size)
        self.cells, self.left[k], self.lost = self.cells + row, self.left[k] + row.sum(0), self.lost + lost
        return self._sorted(steps, rays.w, rays.weight)

    def _sorted(self, results: dict[str, np.ndarray], w: np.ndarray, weight: Any) -> tuple[_Rays, _Rays]:
        """Rays on facets, and those on their way."""
        bins, rays = results["bin"], _Rays(results["spot"], results["inside"], results.get("w", w), weight)
        return rays.chosen(bins == INSIDE), rays.chosen(bins == UNDERWAY)

    def turned(self, rays: _Rays) -> _Rays:
        """Rays off their facets."""
        if isinstance(self.facet, float):
            return rays._replace(weight=rays.weight * self.facet)
        u = self.rng.random((len(rays.spot), 2), np.float32)
        samples = SAMPLE(self.scenes[0], spot=rays.spot, inside=rays.inside, w=rays.w, u=u)
        weight = samples["weight"] if samples["weight"].ndim == 2 else samples["weight"][:, None]
        return _Rays(samples["spot"], rays.inside, samples["w"], rays.weight * weight)


def trace(
    tables: dict[str, Any],
    facet: float | Reflectance,
    theta_i: float,
    phi_i: float,
    cells: Cells,
    bounces: int,
    points: np.ndarray,
    shift: np.ndarray,
    rng: np.random.Generator,
) -> _LightShares:
    """Light from a direction [rad] through points of the unit square, on a surface as `march.tables` has it.

    `facet`: the reflectance of facets that are mirrors, or any reflectance, of C channels.
    """
    wi = direction(theta_i, phi_i)
    scene = composite(
        **tables,
        **({} if isinstance(facet, float) else {"facet": facet}),
        **dict(zip(("wi_x", "wi_y", "wi_z"), map(float, wi), strict=True)),
        cos_phi=math.cos(phi_i),
        sin_phi=math.sin(phi_i),
        rings=float(cells.rings),
        sectors=float(cells.sectors),
        per_theta=1.0 / cells.width,
        shift_x=float(shift[0]),
        shift_y=float(shift[1]),
    )
    walk = _Walk(scene, facet, cells.rings * cells.sectors, bounces, rng)
    w = np.tile((-wi).astype(np.float32), (min(BATCH, len(points)), 1))
    # A batch is in the cache until most of it has left; of all batches together few rays are left after that.
    batches = (points[start : start + BATCH] for start in range(0, len(points), BATCH))
    soon, late = zip(*(walk.enter(batch, w[: len(batch)]) for batch in batches), strict=True)
    rays = walk.turned(_Rays.together([*soon, walk.met(_Rays.together(late), 0, 1)]))
    for k in range(1, bounces):
        rays = walk.turned(walk.met(rays, k))
    count = len(points)
    shares = np.stack([x + 0.0 * walk.lost for x in walk.left]) / count
    tally = (walk.cells + np.zeros((cells.rings * cells.sectors, len(walk.lost)))) / count
    return _LightShares(tally.reshape(cells.rings, cells.sectors, -1), shares, rays.light() / count, walk.lost / count)


def _counted(bins: np.ndarray, weight: float | np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """The light (C,) that got lost, and the light (size, C) in each cell of directions."""
    before = -int(UNDERWAY)
    cells = (bins - UNDERWAY).astype(np.intp)
    if isinstance(weight, float):
        light = weight * np.bincount(cells, minlength=before + size)[:, None]
    else:
        each = [np.bincount(cells, weight[:, c], before + size) for c in range(weight.shape[1])]
        light = np.stack(each, axis=-1)
    return light[int(LOST - UNDERWAY)], light[before:]
