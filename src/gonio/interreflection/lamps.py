"""Light that comes straight from lamps: faces that emit and are few, for which rays of all directions are too rough."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import COUNT, SCALAR, VECTOR
from ..evaluate.computation import Computation, composite
from ..formula.direction import Direction, cross, dot, select
from ..machine.caches import kept
from .by_rays import at, barycentric, blockers, lifted, moved, points, quarters, shifts, which_shift
from .patches import Patches

NEAR, FAR = 0.44594849091596489, 0.09157621350977073
PLACES = np.array([np.roll([1.0 - 2.0 * x, x, x], k) for x in (NEAR, FAR) for k in range(3)])
WEIGHTS = np.repeat([0.22338158967801147, 0.10995174365532187], 3)
"""Points of a patch from which the closed form is taken, exact for polynomials of degree 4: Dunavant 1985, IJNME 21."""

LEVEL = 1e-9
"""Height over the horizon, in sizes of the triangle, that counts as none."""

BLOCK = 1 << 20
"""Shadow rays made together."""


def _edge(a: Direction, b: Direction, n: Direction) -> Any:
    """θ n·γ of an edge from a to b."""
    c = cross(a, b)
    sine = ops.sqrt(dot(c, c))
    angle = ops.arctan2(sine, dot(a, b))
    return dot(c, n) * ops.where(sine > 0.0, angle / ops.where(sine > 0.0, sine, 1.0), 0.0)


def lambert(p: Direction, n: Direction, corners: tuple[Direction, ...]) -> Any:
    """The form factor from an element at p to the front of a triangle, above the element's horizon.

    Lambert's formula, 1/(2π) Σ θ n·γ, along what is above the horizon: from each edge there is a part of it, or
    nothing, and one more edge leads along the horizon from where the outline goes down to where it comes up.
    """
    v = [corner - p for corner in corners]
    level = LEVEL * ops.sqrt(dot(v[1] - v[0], v[1] - v[0]))
    height = [dot(x, n) for x in v]
    up = [h > level for h in height]
    none = Direction(0.0, 0.0, 0.0)
    total, down, rise = 0.0 * height[0], none, none
    for i in range(3):
        j = (i + 1) % 3
        fall = height[i] - height[j]
        share = ops.clip(height[i] / ops.where(fall == 0.0, 1.0, fall), 0.0, 1.0)
        cut = v[i] + (v[j] - v[i]) * share
        begins, ends = select(up[i], v[i], cut), select(up[j], v[j], cut)
        total = total + ops.where(up[i] | up[j], _edge(begins, ends, n), 0.0)
        down, rise = select(up[i] & ~up[j], cut, down), select(up[j] & ~up[i], cut, rise)
    return ops.maximum(-(total + _edge(down, rise, n)), 0.0) * (0.5 / np.pi)


def three(corners: Any) -> tuple[Direction, ...]:
    """The corners of a triangle, of nine numbers."""
    return tuple(Direction(*corners[3 * k : 3 * k + 3]) for k in range(3))


def _mean_factor(scene: Any, mean: Any, patch: Any, normal: Any, place: Any, lamp: Any) -> tuple[Any]:
    p = Direction(*at(patch, place))
    return (place[3] * lambert(p, Direction(*normal), three(lamp)),)


def _mean_of_three(scene: Any, mean: Any, patch: Any, normal: Any, triangle: Any) -> tuple[Any]:
    places = (Direction(*at(patch, (u, v, 1.0 - u - v))) for u, v in ((2 / 3, 1 / 6), (1 / 6, 2 / 3), (1 / 6, 1 / 6)))
    corners = three(triangle)
    return (sum(lambert(p, Direction(*normal), corners) for p in places) / 3.0,)


MEAN_OF_THREE = Computation(_mean_of_three, {"patch": 9, "normal": 3, "triangle": 9}, {"factor": SCALAR})
MEAN_FACTOR = Computation(_mean_factor, {"patch": 9, "normal": 3, "place": 4, "lamp": 9}, {"factor": COUNT})


def factors_of_all(corners: np.ndarray, normals: np.ndarray, to: np.ndarray) -> np.ndarray:
    """Form factors (n, m) from triangles (n, 3, 3) to the fronts of others (m, 3, 3), of which nothing is hidden: the
    means of the closed form at three points, exact for polynomials of degree 2."""
    rows = {"patch": corners.reshape(-1, 1, 9), "normal": normals[:, None]}
    found: np.ndarray = MEAN_OF_THREE(composite(), **rows, triangle=to.reshape(1, -1, 9))["factor"]
    return found


def _carried(shift: Any, corners: Any, n: Any, lamp: Any, u: Any) -> tuple[Any, ...]:
    """A ray from a patch to a lamp, what it carries, and its place on the patch."""
    u = moved(u, shift)
    place = barycentric(u[0], u[1])
    o, to = (Direction(*at(x, y)) for x, y in ((corners, place), (lamp, barycentric(u[2], u[3]))))
    way = to - o
    r2 = dot(way, way)
    cosines = ops.maximum(dot(way, Direction(*n)), 0.0) * ops.maximum(-dot(way, Direction(*lamp[9:12])), 0.0)
    return o, way, cosines / ops.maximum(r2 * r2, 1e-30), place


def _summed(carried: Any, clear: Any, place: Any) -> tuple[Any, ...]:
    """What is carried, and what arrives, near each corner and in the middle."""
    arrives = ops.where(clear, carried, 0.0)
    near = [x > 0.5 for x in place]
    near.append(~(near[0] | near[1] | near[2]))
    return carried, *(ops.where(x, arrives, 0.0) for x in near)


def _whole(scene: Any, mean: Any, shift: Any, corners: Any, n: Any, lamp: Any, u: Any) -> tuple[Any, ...]:
    o, way, carried, place = _carried(shift, corners, n, lamp, u)
    return _summed(carried, ~ops.blocked(scene.triangles, o, way, 0.0, 1.0), place)


def _sent(scene: Any, mean: Any, shift: Any, corners: Any, n: Any, lamp: Any, u: Any) -> tuple[Any, ...]:
    return _carried(shift, corners, n, lamp, u)[:2]


def _sums(scene: Any, mean: Any, shift: Any, corners: Any, n: Any, lamp: Any, u: Any, clear: Any) -> tuple[Any, ...]:
    _, _, carried, place = _carried(shift, corners, n, lamp, u)
    return _summed(carried, clear[0] > 0.5, place)


INPUTS = {"shift": 4, "corners": 9, "n": 3, "lamp": 12, "u": 4}
SUMS = {"carried": COUNT, "a": COUNT, "b": COUNT, "c": COUNT, "middle": COUNT}
WHOLE = Computation(_whole, INPUTS, SUMS)
SENT = Computation(_sent, INPUTS, {"o": VECTOR, "way": VECTOR})
AFTER = Computation(_sums, {**INPUTS, "clear": 1}, SUMS)


@kept
def _in_quarters(rays: int) -> np.ndarray:
    """How many of the points of each shift are near each corner, and in the middle: (SHIFTS, 4)."""
    u = (points(rays, 4)[0, :, :2] + shifts(4)[:, None, :2]) % 1.0
    quarter = quarters(np.stack(barycentric(u[..., 0], u[..., 1]), axis=-1))
    return np.stack([(quarter == k).sum(axis=1) for k in range(4)], axis=1)


def from_lamps(patches: Patches, lamps: np.ndarray, strength: np.ndarray, rays: int) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance (n, C) by lamps, corners (L, 3, 3) that send out (L, C), and how uneven it is over each patch (n,).

    The factor is the mean of the closed form at PLACES, times the share that `rays` rays find, weighed by
    what they carry.
    """
    n = len(patches)
    light, uneven = np.zeros((n, strength.shape[1])), np.zeros((n, 4))
    which, u = which_shift(n), points(rays, 4)
    place = np.concatenate([PLACES, WEIGHTS[:, None]], axis=1)[None]
    begins = lifted(patches).reshape(n, 1, 9)
    tables = blockers(patches)
    scene, empty = composite(**tables), composite()
    for lamp, power, bright in zip(lamps, strength, strength.mean(axis=1), strict=True):
        n_lamp = np.cross(lamp[1] - lamp[0], lamp[2] - lamp[0])
        area = 0.5 * np.linalg.norm(n_lamp)
        n_lamp /= 2.0 * area
        whole = MEAN_FACTOR(
            empty,
            patch=patches.corners.reshape(n, 1, 9),
            normal=patches.normals[:, None],
            place=place,
            lamp=lamp.reshape(1, 1, 9),
        )["factor"]
        end = np.concatenate([(lamp + patches.lift * n_lamp).reshape(9), n_lamp]).astype(np.float32)
        lit = np.flatnonzero(whole)
        for start in range(0, len(lit), max(1, BLOCK // rays)):
            rows = lit[start : start + max(1, BLOCK // rays)]
            rays_of = {
                "shift": shifts(4)[which[rows], None],
                "corners": begins[rows].astype(np.float32),
                "n": patches.normals[rows, None].astype(np.float32),
                "lamp": end[None, None],
                "u": u,
            }
            if tables:
                found = WHOLE(scene, **rays_of)
            else:
                o, way = (x.reshape(-1, 3) for x in SENT(empty, **rays_of).values())
                clear = ~patches.faces.local.occluded(o, way, np.ones(len(o)))
                found = AFTER(empty, **rays_of, clear=clear.reshape(len(rows), rays, 1).astype(np.float32))
            arrives = np.stack([found[name] for name in ("a", "b", "c", "middle")], axis=1)
            carried = found["carried"]
            seen = arrives.sum(axis=1) / np.where(carried > 0.0, carried, 1.0)
            light[rows] += (whole[rows] * seen)[:, None] * power
            uneven[rows] += (bright * area / np.pi) * arrives
    return light, np.ptp(uneven / np.maximum(_in_quarters(rays)[which], 1), axis=1)
