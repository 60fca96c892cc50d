"""The form factors of patches by rays: cosine-distributed ones from points all over each patch."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from ..arrays import Fixed, ops
from ..arrays.kinds import SCALAR, VECTOR
from ..compile.threads import share
from ..errors import DependencyError
from ..evaluate.computation import Computation, composite
from ..evaluate.planning import available
from ..machine.caches import kept
from ..numerics.embree import EmbreeTriangles
from ..numerics.lattice import lattice
from .patches import Patches

SHIFTS = 64
"""Shifted copies of the lattice; each patch takes one."""

RAYS = 1 << 21
"""Rays made together."""

ENTRIES = 1 << 17
"""Entries of a block of the matrix."""

ASIDE = 1e-4
"""How far beside a ray that met nothing, for rounding leaves cracks between triangles, another one is shot."""

FAR = 1e30
"""Beyond all that rays meet."""

NOTHING, BACK = -1.0, -2.0
"""Instead of the number of a patch."""


def barycentric(u0: Any, u1: Any) -> tuple[Any, Any, Any]:
    """Coordinates of points spread over a triangle, of points of the unit square."""
    s = ops.sqrt(u0)
    return 1.0 - s, s * (1.0 - u1), s * u1


def at(corners: Any, place: Any) -> tuple[Any, ...]:
    """The point (x, y, z) of a triangle, nine numbers, at barycentric coordinates."""
    return tuple(place[0] * corners[k] + place[1] * corners[3 + k] + place[2] * corners[6 + k] for k in range(3))


def moved(u: Any, shift: Any) -> list[Any]:
    """The fractional parts of sums of numbers in [0, 1)."""
    return [x + y - ops.floor(x + y) for x, y in zip(u, shift, strict=True)]


def sent(scene: Any, corners: Any, axes: Any, shift: Any, u: Any) -> tuple[Any, Any]:
    """Origin and direction of a ray of a patch."""
    u = moved(u, shift)
    cos, sin = ops.turn(u[3])
    r, up = ops.sqrt(u[2]), ops.sqrt(1.0 - u[2])
    x, y = r * cos + scene.aside, r * sin
    return at(corners, barycentric(u[0], u[1])), tuple(
        x * axes[k] + y * axes[3 + k] + up * axes[6 + k] for k in range(3)
    )


def patch_at(scene: Any, face: Any, u: Any, v: Any) -> Any:
    """The number of the patch at a place of a face."""

    def step(link: Any) -> tuple[Any, Any]:
        line = ops.maximum(link, 0)
        a, b, c = (ops.take(scene.lines, 3 * line + k) for k in range(3))
        above = ops.to_index(ops.where(a * u + b * v + c >= 0.0, 1.0, 0.0))
        link = ops.where(link < 0, link, ops.to_index(ops.take(scene.links, 2 * line + above)))
        return link >= 0, link

    (link,) = ops.loop(step, ops.to_index(ops.take(scene.roots, face)))
    return -1.0 - link


def _seen(scene: Any, d: Any, met: Any, face: Any, u: Any, v: Any) -> Any:
    towards = sum(d[k] * ops.take(scene.normals, 3 * face + k) for k in range(3))
    return ops.where(met, ops.where(towards > 0.0, BACK, patch_at(scene, face, u, v)), NOTHING)


def _whole(scene: Any, mean: Any, corners: Any, axes: Any, shift: Any, u: Any) -> tuple[Any]:
    o, d = sent(scene, corners, axes, shift, u)
    t, at_u, at_v, face = ops.nearest(scene.triangles, o, d, 0.0, FAR)
    return (_seen(scene, d, t < FAR, face, at_u, at_v),)


def _sent(scene: Any, mean: Any, corners: Any, axes: Any, shift: Any, u: Any) -> tuple[Any, Any]:
    return sent(scene, corners, axes, shift, u)


def _placed(scene: Any, mean: Any, d: Any, hit: Any) -> tuple[Any]:
    return (_seen(scene, d, hit[0] >= 0.0, ops.to_index(ops.maximum(hit[0], 0.0)), hit[1], hit[2]),)


INPUTS = {"corners": 9, "axes": 9, "shift": 4, "u": 4}
WHOLE = Computation(_whole, INPUTS, {"patch": SCALAR})
SENT = Computation(_sent, INPUTS, {"o": VECTOR, "d": VECTOR})
PLACED = Computation(_placed, {"d": 3, "hit": 3}, {"patch": SCALAR})


@kept
def points(count: int, dimensions: int) -> np.ndarray:
    """Points (1, count, dimensions) of the unit cube, float32; neighbours are near each other in the last two."""
    spread = lattice(count, dimensions).astype(np.float32)
    cell = np.floor(spread[:, -2] * 4.0) * 8.0 + np.floor(spread[:, -1] * 8.0)
    return spread[np.argsort(cell, kind="stable")][None]


@cache
def shifts(dimensions: int) -> np.ndarray:
    """(SHIFTS, dimensions) in [0, 1)"""
    return np.random.default_rng(0).random((SHIFTS, dimensions), np.float32)


def which_shift(count: int) -> np.ndarray:
    """The number of the shift of each patch, (count,)."""
    return np.random.default_rng(1).integers(SHIFTS, size=count)


def lifted(patches: Patches) -> np.ndarray:
    """Corners (n, 3, 3) that rays begin between."""
    return patches.corners + patches.lift * patches.normals[:, None]


def frames(patches: Patches) -> np.ndarray:
    """Axes (n, 3, 3) of the patches: two in the plane, the normal last."""
    n = patches.normals
    x = patches.corners[:, 1] - patches.corners[:, 0]
    x /= np.linalg.norm(x, axis=1)[:, None]
    return np.stack([x, np.cross(n, x), n], axis=1)


class _Shooter:
    """What rays of patches meet."""

    def __init__(self, patches: Patches):
        tree, n = patches.halvings, len(patches)
        roots = len(tree.links) - 2 * len(tree.lines)
        flat = [np.append(x.reshape(-1), np.zeros(3)).astype(np.float32) for x in (tree.lines, tree.links[roots:])]
        self._tables = {
            "lines": Fixed(flat[0]),
            "links": Fixed(flat[1]),
            "roots": Fixed(tree.links[:roots].astype(np.float32)),
            "normals": Fixed(patches.faces.normals.astype(np.float32).reshape(-1)),
        }
        self._rows = {
            "corners": lifted(patches).reshape(n, 1, 9).astype(np.float32),
            "axes": frames(patches).reshape(n, 1, 9).astype(np.float32),
            "shift": shifts(4)[which_shift(n), None],
        }
        self._faces = patches.faces.local
        self._tables |= blockers(patches)

    def __call__(self, rows: Any, u: np.ndarray, aside: float = 0.0) -> np.ndarray:
        """Numbers of patches (m, count), or NOTHING, or BACK, of rays through points u (1 or m, count, 4)."""
        scene = composite(**self._tables, aside=aside)
        arrays = {name: x[rows] for name, x in self._rows.items()}
        if "triangles" in self._tables:
            return WHOLE(scene, **arrays, u=u)["patch"]
        rays = SENT(scene, **arrays, u=u)
        o, d = (rays[name].reshape(-1, 3) for name in ("o", "d"))
        hits = self._faces.shoot(o, d)
        hit = np.stack([hits.face.astype(np.float32), hits.u, hits.v], axis=1)
        return PLACED(scene, d=d, hit=hit)["patch"].reshape(rays["o"].shape[:-1])


def blockers(patches: Patches) -> dict[str, Fixed]:
    """The triangles that kernels shoot at; none where Embree is missing, or where kernels are not compiled."""
    if not available():
        return {}
    faces = patches.faces.local
    try:
        return {"triangles": Fixed(EmbreeTriangles(faces.vertices, faces.faces, robust=True).handle)}
    except DependencyError:
        return {}


class ByRays:
    """F x = mean of x over what `count` rays of each patch meet; x is 0 on backs and where there is nothing.

    `hits` (n, count): numbers of patches; n stands for nothing, n + 1 for backs. `first`: the first rows of it, from
    before; `keep`: is given all rows found so far, again and again.
    """

    def __init__(
        self,
        patches: Patches,
        count: int,
        first: np.ndarray | None = None,
        keep: Callable[[np.ndarray], None] | None = None,
    ):
        self.patches = patches
        n, u = len(patches), points(count, 4)
        done = 0 if first is None else len(first)
        self.hits = np.empty((n, count), np.int32)
        self.hits[:done] = 0 if first is None else first
        shoot = _Shooter(patches)
        for start in range(done, n, max(1, RAYS // count)):
            rows = slice(start, start + max(1, RAYS // count))
            met = shoot(rows, u)
            row, ray = np.nonzero(met == NOTHING)
            if len(row):
                met[row, ray] = shoot(start + row, u[0, ray, None], ASIDE)[:, 0]
            self.hits[rows] = np.where(met < 0.0, n + NOTHING - met, met)
            if keep is not None:
                keep(self.hits[: rows.stop])

    @property
    def rows(self) -> np.ndarray:
        """Sums of the factors of each patch (n,)."""
        return np.mean(self.hits < len(self.patches), axis=1)

    @property
    def escaping(self) -> np.ndarray:
        """The share of what each patch sends out that meets nothing, (n,)."""
        return np.mean(self.hits == len(self.patches), axis=1)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """F x, (n, C) of (n, C)."""
        from scipy.sparse import csr_matrix

        n, count = self.hits.shape
        padded = np.append(x, np.zeros((2, x.shape[1])), axis=0)
        result = np.empty(x.shape)
        step = max(1, ENTRIES // count)
        data, ends = np.full(step * count, 1.0 / count), np.arange(step + 1, dtype=np.int32) * count

        def work(start: int, stop: int) -> None:
            part = self.hits[start:stop].reshape(-1)
            size = stop - start
            matrix = csr_matrix((data[: len(part)], part, ends[: size + 1]), shape=(size, n + 2))
            result[start:stop] = matrix @ padded

        share(work, [(start, min(start + step, n)) for start in range(0, n, step)])
        return result

    def spread(self, x: np.ndarray) -> np.ndarray:
        """How much the irradiance by x differs between the four parts of a patch that its middle divides: (n,)."""
        n, count = self.hits.shape
        padded = np.append(x, [0.0, 0.0])
        places = barycentric(*np.moveaxis((points(count, 4)[..., :2] + shifts(4)[:, None, :2]) % 1.0, -1, 0))
        region = quarters(np.stack(places, axis=-1))
        shift = which_shift(n)
        result = np.empty(n)

        def work(start: int, stop: int) -> None:
            seen, where = padded[self.hits[start:stop]], region[shift[start:stop]]
            means = [(seen * (where == k)).sum(axis=1) / np.maximum((where == k).sum(axis=1), 1) for k in range(4)]
            result[start:stop] = np.ptp(means, axis=0)

        step = max(1, ENTRIES // count)
        share(work, [(start, min(start + step, n)) for start in range(0, n, step)])
        return result


def quarters(places: np.ndarray) -> np.ndarray:
    """Which of its three corners a place (..., 3) of a triangle is near, or 3 for its middle."""
    return np.where(places.max(axis=-1) > 0.5, places.argmax(axis=-1), 3)
