"""Rays and triangles: in kernels and on arrays, against the intersection of each ray with each triangle by NumPy."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from gonio.arrays import Fixed, ops
from gonio.arrays.kinds import SCALAR, TOTAL
from gonio.errors import ArrayTypeError, ParameterError, ShapeError, TraceError
from gonio.evaluate import batch, tracing
from gonio.evaluate.computation import Computation, composite
from gonio.numerics.embree import EmbreeTriangles

pytest.importorskip("embreex")
RNG = np.random.default_rng(4)
VERTICES = RNG.uniform(-1.0, 1.0, (90, 3)).astype("float32")
CORNERS = RNG.permutation(90).reshape(30, 3)
ORIGINS, TARGETS = 3.0 * RNG.normal(size=(501, 3)), RNG.uniform(-0.8, 0.8, (501, 3))
DIRECTIONS = TARGETS - ORIGINS
NEAR, FAR = 0.3, 1.2


def by_numpy(o, d, near=NEAR, far=FAR):
    """The nearest hit (t, u, v, number) of each ray, and how close each comes to an edge, or to near or far.

    The solution of o + t d = a + u (b - a) + v (c - a) by linear algebra.
    """
    a, b, c = (VERTICES[CORNERS[:, k]].astype(float) for k in range(3))
    columns = np.stack(np.broadcast_arrays(-d[:, None], b - a, c - a), axis=-1)
    t, u, v = np.moveaxis(np.linalg.solve(columns, (o[:, None] - a)[..., None])[..., 0], -1, 0)
    margins = np.stack([u, v, 1.0 - u - v, t - near, far - t])
    inside = (margins > 0.0).all(0)
    t = np.where(inside, t, np.inf)
    first = t.argmin(1)
    rows = np.arange(len(o))
    hit = inside.any(1)
    found = [np.where(hit, x[rows, first], 0.0) for x in (u, v, np.broadcast_to(np.arange(30), t.shape))]
    return (t[rows, first], *found), np.abs(margins).min(0).min(1)


def kernel(scene, mean, o, d):
    met = ops.nearest(scene.mesh, o, d, scene.near, FAR)
    return *met[:3], 1.0 * met[3], ops.where(ops.blocked(scene.mesh, o, d, scene.near, FAR), 1.0, 0.0)


SHOT = Computation(kernel, {"o": 3, "d": 3}, dict.fromkeys(("t", "u", "v", "number", "blocked"), SCALAR))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("count", [1, 5, 16, 501])
@pytest.mark.parametrize("robust", [False, True])
def test_every_ray_meets_its_triangle(evaluation, dtype, count, robust):
    o, d = ORIGINS[:count].astype(dtype), DIRECTIONS[:count].astype(dtype)
    scene = composite(mesh=Fixed(EmbreeTriangles(VERTICES, CORNERS, robust).handle), near=NEAR)
    gc.collect()  # the handle keeps the triangles
    found = SHOT(scene, o=o, d=d)
    want, margin = by_numpy(o.astype(float), d.astype(float))
    sure = margin > 1e-5
    assert sure.sum() >= 0.95 * count
    for name, expected in zip(("t", "u", "v", "number"), want, strict=True):
        assert found[name].dtype == dtype
        np.testing.assert_allclose(found[name][sure], expected[sure], atol=2e-5, err_msg=name)
    np.testing.assert_array_equal(found["blocked"][sure], np.isfinite(want[0])[sure])
    assert count < 100 or 0.2 < found["blocked"].mean() < 0.9


def test_rays_in_a_loop(evaluation):
    """Each ray goes on behind what it met, as often as it meets anything: it counts the triangles on its way."""

    def crossed(scene, mean, o, d):
        def step(near, count):
            t, _, _, _ = ops.nearest(scene.mesh, o, d, near, 2.0)
            return t < 2.0, t + 1e-5, count + ops.where(t < 2.0, 1.0, 0.0)

        _, count = ops.loop(step, 0.0 * o[0], 0.0)
        return (count,)

    scene = composite(mesh=Fixed(EmbreeTriangles(VERTICES, CORNERS).handle))
    o, d = (x.astype("float32")[:200] for x in (ORIGINS, DIRECTIONS))
    found = Computation(crossed, {"o": 3, "d": 3}, {"count": SCALAR})(scene, o=o, d=d)["count"]
    a, b, c = (VERTICES[CORNERS[:, k]].astype(float) for k in range(3))
    columns = np.stack(np.broadcast_arrays(-d[:, None].astype(float), b - a, c - a), axis=-1)
    t, u, v = np.moveaxis(np.linalg.solve(columns, (o[:, None] - a)[..., None].astype(float))[..., 0], -1, 0)
    margins = np.stack([u, v, 1.0 - u - v, t, 2.0 - t])
    sure = np.abs(margins).min(0).min(1) > 1e-4
    np.testing.assert_array_equal(found[sure], (margins > 0.0).all(0).sum(1)[sure])
    assert found.max() > 3


def test_shadows_in_sums(evaluation):
    """The share of a sphere of directions that is blocked, of many rows, in threads."""

    def seen(scene, mean, p, w):
        return (ops.where(ops.blocked(scene.mesh, p, w, 1e-4, 10.0), 0.0, scene.gain),)

    w = RNG.normal(size=(1, 333, 3)).astype("float32")
    p = RNG.uniform(-0.5, 0.5, (700, 1, 3)).astype("float32")
    scene = composite(mesh=Fixed(EmbreeTriangles(VERTICES, CORNERS).handle), gain=[1.0, 2.0])
    found = Computation(seen, {"p": 3, "w": 3}, {"sum": TOTAL})(scene, p=p, w=w)["sum"]
    np.testing.assert_array_equal(found[:, 1], 2.0 * found[:, 0])
    for k in range(0, 700, 100):
        (t, *_), margin = by_numpy(np.broadcast_to(p[k], (333, 3)).astype(float), w[0].astype(float), 1e-4, 10.0)
        assert abs(found[k, 0] - np.isinf(t).sum()) <= (margin < 1e-5).sum()


def test_refusals():
    with pytest.raises(ShapeError, match=r"vertices: got shape \(0, 3\), expected \(n, 3\)"):
        EmbreeTriangles(np.zeros((0, 3)), CORNERS)
    with pytest.raises(ShapeError, match="triangles: got shape"):
        EmbreeTriangles(VERTICES, CORNERS.reshape(-1))
    with pytest.raises(ParameterError, match="whole numbers of vertices"):
        EmbreeTriangles(VERTICES, CORNERS.astype(float))
    for bad in (-1, 90):
        with pytest.raises(ParameterError, match=f"vertex number {bad}, expected 0 to 89"):
            EmbreeTriangles(VERTICES, np.array([[0, 1, bad]]))
    with pytest.raises(ParameterError, match="NaN or infinite"):
        EmbreeTriangles(np.full((3, 3), np.nan), np.array([[0, 1, 2]]))
    torch = pytest.importorskip("torch")
    x = torch.zeros(3)
    with pytest.raises(ArrayTypeError, match="rays are shot by NumPy arrays alone; got torch"):
        ops.nearest(None, (x, x, x), (x, x, x), 0.0, 1.0)
    task = batch.Task(lambda m, mean, o: (ops.blocked(np.zeros(12), o, o, 0.0, 1.0),), (SCALAR,), (3,))
    with pytest.raises(TraceError, match="expected a table with their handle"):
        tracing.traced(task, composite(), None)
