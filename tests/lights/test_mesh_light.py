"""Lamps of triangles against closed forms: polygons, form factors, the sphere; and two ways to look at them."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

import gonio as gn
from gonio.errors import ParameterError
from gonio.numerics.lattice import lattice
from gonio.radiometry import form_factors

CUBE = np.array([[x, y, z] for z in (1.0, 2.0) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def globe(count: int, radius: float, centre: list[float]) -> tuple[np.ndarray, list[list[int]]]:
    """Corners on a sphere: rings of 2 count, and the poles."""
    theta, phi = np.pi * np.arange(1, count) / count, np.pi * np.arange(2 * count) / count
    rings = [[np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)] for t in theta for p in phi]
    corners, wide, last = np.array([[0, 0, 1], *rings, [0, 0, -1]]), 2 * count, 2 * count * (count - 1) + 1
    faces = [[0, 1 + j, 1 + (j + 1) % wide] for j in range(wide)]
    for i in range(count - 2):
        for j in range(wide):
            a, b = (1 + i * wide + k % wide for k in (j, j + 1))
            faces += [[a, a + wide, b], [b, a + wide, b + wide]]
    faces += [[last, last - wide + (j + 1) % wide, last - wide + j] for j in range(wide)]
    return radius * corners + centre, faces


def by_samples(light: gn.MeshLight, place: np.ndarray, normal: np.ndarray, count: int = 1 << 16) -> float:
    w, pdf = light.sample(lattice(count), place)
    return float((light.incident(w, place)[..., 0] * np.maximum(w @ normal, 0.0) / pdf).mean())


@pytest.mark.parametrize("seed", range(4))
def test_a_cube_is_the_rectangles_that_are_seen(seed):
    """... at any place and for any normal, cut by the horizon or not; and samples say the same."""
    random = np.random.default_rng(seed)
    place, normal = (
        random.normal(size=3) * [1.5, 1.5, 1.0] + [0.0, 0.0, -1.0],
        gn.directions.normalize(random.normal(size=3)),
    )
    lamp = gn.MeshLight((CUBE, SIDES), 3.0)
    assert lamp.has_closed_form and len(lamp.shape.faces) == 12
    expected = sum(gn.irradiance(gn.PolygonLight(CUBE[side], 3.0), place, normal) for side in SIDES)
    assert gn.irradiance(lamp, place, normal) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert by_samples(lamp, place, normal) == pytest.approx(expected, rel=2e-2, abs=2e-3)


def test_the_irradiance_of_a_floor_is_the_form_factor():
    """The mean of E over a square is pi L times the factor from it to the lamp."""
    lamp = CUBE[SIDES[0]]
    floor = np.array([[-1.0, -0.7, 0.0], [0.8, -0.7, 0.0], [0.8, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    t, share = np.polynomial.legendre.leggauss(24)
    x, y = np.meshgrid(-0.1 + 0.9 * t, 0.15 + 0.85 * t)
    E = gn.irradiance(gn.MeshLight((lamp, [[0, 1, 2, 3]]), 2.0), np.stack([x, y, 0.0 * x], -1), [0.0, 0.0, 1.0])
    mean = np.sum(E * share * share[:, None]) / 4.0
    assert mean == pytest.approx(2.0 * math.pi * form_factors.polygon_to_polygon(floor, lamp), rel=1e-9)


def test_a_globe_of_many_triangles_becomes_a_sphere():
    """As 1/count^2; these are looked at in a loop."""
    sphere, up = gn.SphereLight([0.3, 0.2, 2.0], 0.5, 4.0), np.array([0.0, 0.6, 0.8])
    exact = gn.irradiance(sphere, np.zeros(3), up)
    off = []
    for count in (8, 16):
        lamp = gn.MeshLight(globe(count, 0.5, [0.3, 0.2, 2.0]), 4.0)
        assert lamp.has_closed_form and len(lamp.shape.faces) > 64
        E = gn.irradiance(lamp, np.zeros(3), up)
        assert by_samples(lamp, np.zeros(3), up, 1 << 14) == pytest.approx(E, rel=2e-2)
        off.append(1.0 - E / exact)
    assert 0.0 < off[1] < 0.02 and off[0] / off[1] == pytest.approx(4.0, rel=0.1)


def test_the_density_is_one_in_all_and_counts_what_is_hidden():
    lamp = gn.MeshLight((CUBE + np.array([0.2, 0.1, -0.4]), SIDES))
    u = lattice(1 << 18)
    s = 2.0 * np.sqrt(u[:, 1] * (1.0 - u[:, 1]))
    w = np.stack([s * np.cos(2 * np.pi * u[:, 0]), s * np.sin(2 * np.pi * u[:, 0]), 1.0 - 2.0 * u[:, 1]], -1)
    assert 4.0 * np.pi * lamp.pdf(w).mean() == pytest.approx(1.0, rel=5e-3)
    drawn, pdf = lamp.sample(u[:4096])
    np.testing.assert_allclose(lamp.pdf(drawn), pdf, rtol=1e-9)
    assert (lamp.incident(drawn) > 0.0).all()


def test_fronts_alone_shine_and_what_is_before_hides():
    lamp = gn.MeshLight((CUBE, SIDES), 3.0)
    inside = np.array([0.0, 0.0, 1.5])
    w = gn.directions.normalize(np.random.default_rng(1).normal(size=(100, 3)))
    assert not lamp.incident(w, inside).any() and gn.irradiance(lamp, inside) == 0.0
    dent = [[-0.5, -0.5, 1.0], [0.5, -0.5, 1.0], [0.5, 0.5, 1.0], [-0.5, 0.5, 1.0], [0.0, 0.0, 2.0]]
    tent = gn.MeshLight((dent, [[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]]), 2.0)  # open below, seen from inside
    assert not tent.has_closed_form  # of one triangle hides another from places beside
    rectangle = gn.RectangleLight([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], 2.0)
    assert gn.irradiance(tent, samples=1 << 15) == pytest.approx(float(gn.irradiance(rectangle)), rel=2e-3)
    np.testing.assert_array_equal(tent.incident(w) > 0.0, rectangle.incident(w) > 0.0)
    assert lamp.distance(np.array([0.0, 0.0, 1.0])) == pytest.approx(1.0)


def test_loops_and_lines_say_the_same(monkeypatch):
    from gonio.lights import mesh

    place = np.array([0.1, 0.2, 0.3])
    w = gn.directions.normalize(np.random.default_rng(2).normal(size=(500, 3)) + np.array([0.0, 0.0, 2.0]))

    def numbers() -> list[np.ndarray]:
        lamp = gn.MeshLight((CUBE, SIDES), 3.0)
        E = gn.irradiance(lamp, 0.1 * w, [0.0, 0.6, 0.8])
        return [lamp.incident(w, place), lamp.distance(w, place), lamp.pdf(w, place), E]

    written = numbers()
    monkeypatch.setattr(mesh, "UNROLLED", 0)
    monkeypatch.setattr(mesh._Shape, "traced", lambda self, value: ("in a loop", len(value.faces)))
    for one, other in zip(written, numbers(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_torch_derives_by_the_place_in_spite_of_many_triangles(torch):
    lamp, up = gn.MeshLight(globe(8, 0.5, [0.3, 0.2, 2.0]), 4.0), [0.0, 0.6, 0.8]
    place = torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64, requires_grad=True)
    (slope,) = torch.autograd.grad(gn.irradiance(lamp, place, torch.tensor(up, dtype=torch.float64)).sum(), place)
    for k, h in enumerate(1e-5 * np.eye(3)):
        E = [gn.irradiance(lamp, np.array([0.1, 0.2, 0.3]) + s * h, up) for s in (1.0, -1.0)]
        assert slope[k].item() == pytest.approx((E[0] - E[1]) / 2e-5, rel=1e-5)


def test_a_picture_is_that_of_the_rectangle_that_it_is():
    corners = [[-1.5, -1.2, 0.8], [-0.5, -2.0, 0.8], [-0.6, -2.2, 1.8], [-1.6, -1.4, 1.8]]
    m = gn.Lambertian(0.5) + gn.Microfacet(gn.GGX(0.3), 0.5)
    lamps = gn.MeshLight((corners, [[0, 3, 2, 1]]), 5.0), gn.PolygonLight(corners[::-1], 5.0)
    one, other = (gn.render(m, lamp, size=32, samples=256) for lamp in lamps)
    found = gn.scenes.picture_difference(other, one)
    assert found.rms < 0.02 and abs(found.bias[0]) < 0.002


def test_lamps_are_values(tmp_path):
    lamp = gn.MeshLight((CUBE, SIDES), [3.0, 2.0])
    assert lamp == gn.MeshLight(gn.scenes.Mesh((CUBE, SIDES), gn.Lambertian(0.0)), [3.0, 2.0])
    assert lamp != gn.MeshLight((CUBE + 1.0, SIDES), [3.0, 2.0])
    assert pickle.loads(pickle.dumps(lamp)) == lamp and "8 vertices, 12 triangles" in repr(lamp)
    data = lamp.to_json()
    assert gn.MeshLight(data["shape"], data["radiance"]) == lamp


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (3.0, "in a pair"),
        ("lamp.ply", "in a pair"),
        ((CUBE, []), "faces"),
        ((CUBE * np.nan, SIDES), "finite"),
        (([[0, 0, 1], [1, 0, 1], [2, 0, 1]], [[0, 1, 2]]), "area"),
        (globe(46, 1.0, [0.0, 0.0, 3.0]), "expected up to 4096 triangles"),
    ],
)
def test_bad_meshes_are_refused(shape, words):
    with pytest.raises(gn.Error, match=words):
        gn.MeshLight(shape)
    with pytest.raises(ParameterError):
        gn.MeshLight((CUBE, SIDES), -1.0)
