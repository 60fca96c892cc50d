"""Rays against every triangle one by one, by Embree and by the tree; meshes that are none."""

import sys

import numpy as np
import pytest

from gonio.errors import ParameterError, ShapeError
from gonio.rays.tree import BoxTree
from gonio.rays.triangles import Triangles


def bumpy(n=12):
    """A closed bumpy sphere."""
    theta, phi = np.meshgrid(np.linspace(0.05, np.pi - 0.05, n), np.arange(2 * n) * np.pi / n, indexing="ij")
    r = 1.0 + 0.2 * np.sin(3.0 * theta) * np.cos(4.0 * phi)
    x = r[..., None] * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    at = np.arange(n * 2 * n).reshape(n, 2 * n)
    right = np.roll(at, -1, axis=1)
    quads = np.stack([at[:-1], at[1:], right[1:], right[:-1]], -1).reshape(-1, 4)
    return x.reshape(-1, 3), quads


def rays(count, seed=0):
    rng = np.random.default_rng(seed)
    o, to = rng.normal(size=(2, count, 3))
    o *= 2.0 / np.linalg.norm(o, axis=1, keepdims=True)
    return o.astype(np.float32), (0.5 * to - o).astype(np.float32)


def one_by_one(mesh, o, d):
    """The nearest of all triangles, by solving o + t d = a + u (b - a) + v (c - a) for each."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    face, distance = np.full(len(o), -1), np.full(len(o), np.inf)
    for i in range(len(o)):
        system = np.stack([np.broadcast_to(-d[i].astype(float), a.shape), b - a, c - a], -1)
        t, u, v = np.linalg.solve(system, (o[i] - a)[..., None])[..., 0].T
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
        if np.isfinite(t.min()):
            face[i], distance[i] = np.argmin(t), t.min()
    return face, distance


@pytest.fixture(params=["embree", "tree"])
def way(request, monkeypatch):
    if request.param == "embree":
        pytest.importorskip("embreex")
    else:
        monkeypatch.setitem(sys.modules, "gonio.rays.embree", None)
    return request.param


def test_first_hits(way):
    mesh = Triangles(*bumpy())
    assert isinstance(mesh._caster, BoxTree) == (way == "tree")
    o, d = rays(2000)
    face, distance = one_by_one(mesh, o, d)
    hits = mesh.shoot(o, d)
    assert [x.dtype for x in hits] == [np.int32, *3 * [np.float32]]
    assert 500 < (face >= 0).sum() < 2000
    assert (hits.face == face).mean() > 0.999  # but for rays along an edge
    same = hits.face == face
    np.testing.assert_allclose(hits.distance[same], distance[same], rtol=1e-5)
    met = same & (face >= 0)
    a, b, c = np.moveaxis(mesh.corners[hits.face[met]], 1, 0)
    u, v = hits.u[met, None], hits.v[met, None]
    np.testing.assert_allclose(a + u * (b - a) + v * (c - a), (o + hits.distance[:, None] * d)[met], atol=1e-5)
    np.testing.assert_array_equal(mesh.faces_met(o, d), hits.face)


def test_occluded_up_to_a_distance(way):
    mesh = Triangles(*bumpy())
    o, d = rays(2000, seed=1)
    hits = mesh.shoot(o, d)
    assert ((hits.face >= 0) == mesh.occluded(o, d, np.inf)).all()
    assert not mesh.occluded(o, d, np.minimum(0.99 * hits.distance, 1e6)).any()
    assert mesh.occluded(o, d, np.minimum(1.01 * hits.distance, 1e6))[hits.face >= 0].all()


@pytest.mark.parametrize("count", [1, 2, 3, 5, 9])
def test_trees_of_few_triangles(count):
    x = np.arange(count)[:, None, None] * np.array([2.0, 0.0, 0.0]) + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    mesh = BoxTree(x.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    o = np.array([[2.0 * i + 0.2, 0.2, 1.0] for i in range(count)])
    d = np.tile([0.0, 0.0, -1.0], (count, 1))
    np.testing.assert_array_equal(mesh.face(o, d, np.full(count, 9.0)), np.arange(count))


SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    "vertices, faces, error, words",
    [
        (np.zeros((0, 3)), np.zeros((0, 3)), ParameterError, "0 vertices and 0 faces"),
        (SQUARE, np.zeros((0, 3)), ParameterError, "0 faces"),
        ([[0, 0], [1, 0], [1, 1]], [[0, 1, 2]], ShapeError, r"expected \(V, 3\)"),
        (SQUARE, [0, 1, 2], ShapeError, r"expected \(F, 3\)"),
        ([[0, 0, np.nan], *SQUARE], [[0, 1, 2]], ParameterError, "vertex 0 is .*finite"),
        (SQUARE, [[0, 1, 4]], ParameterError, "0 to 4, expected 0 to 3"),
        (SQUARE, [[0, 1, -1]], ParameterError, "-1 to 1"),
        (SQUARE, [[0, 1, 1]], ParameterError, "face 0 has no area"),
        ([*SQUARE, [0, 0, 1], [0, 0, -1]], [[0, 1, 2], [0, 1, 4], [1, 0, 5]], ParameterError, "more than two faces"),
    ],
)
def test_meshes_that_are_none(vertices, faces, error, words):
    with pytest.raises(error, match=words):
        Triangles(vertices, faces)


def test_rays_of_other_shapes():
    with pytest.raises(ShapeError, match=r"expected \(N, 3\)"):
        Triangles(SQUARE, [[0, 1, 2, 3]]).shoot(np.zeros((2, 3)), np.zeros((3, 3)))
