"""WINDOW XML: what f is, by hand and against Radiance; sampling. Files themselves: test_window_xml_files.py.

Numbers of Radiance are those of pyradiance 1.3.1, `bsdf.query` and `bsdf.direct_hemi`, on the files that this test
makes or on real ones; `test_radiance_reads_what_is_written` asks it again where it is installed.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from format_cases import MODEL, file_of
from places import real
from window_xml_texts import (
    TINY,
    full,
    grid_of,
    numbers_of,
    tiny,
    tree3,
    tree4,
)

import gonio as gn
from gonio.errors import ParameterError
from gonio.formats import load, save, window_xml
from gonio.formats.window_xml import means, tree_nodes
from gonio.formats.window_xml.klems import FULL, HALF, HALF_2021, QUARTER, AngleBasis, Klems
from gonio.formats.window_xml.tensor_tree import TensorTree, disc
from gonio.pictures.colour import RELATIVE_XYZ, WHITE, rgb_of, to_xyz

BRUSHED = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(alpha_x=0.3, alpha_y=0.6), 0.8)


def directions(seed: int, n: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return gn.direction(np.arccos(1.0 - 0.99 * rng.random(n)), 2.0 * np.pi * rng.random(n))


def over_the_disc(n: int) -> np.ndarray:
    """Directions of equal projected solid angle, n on each side of the square."""
    u = (np.arange(n) + 0.5) / n
    x, y = disc(*np.meshgrid(u, u))
    return np.stack([x, y, np.sqrt(1.0 - x * x - y * y)], -1)


# The convention, against an implementation for one pair of numbers at a time.


def scalar_patch(basis: AngleBasis, x: float, y: float, z: float) -> int:
    theta = math.degrees(math.acos(z))
    ring = max(k for k, edge in enumerate(basis.edges[:-1]) if edge <= theta)
    turn = (math.degrees(math.atan2(y, x)) % 360.0) / 360.0 * basis.counts[ring]
    return sum(basis.counts[:ring]) + int(turn + 0.5) % basis.counts[ring]


@pytest.mark.parametrize("structure", ["Columns", "Rows"])
@pytest.mark.parametrize("basis", [FULL, HALF, QUARTER, HALF_2021], ids=lambda b: f"{b.name} {b.size}")
@pytest.mark.parametrize("side", ["front", "back"])
def test_patches_against_a_scalar_implementation(basis, structure, side, tmp_path, evaluation):
    m = window_xml.read(file_of(tmp_path, full(basis, structure)), side=side)
    values = numbers_of(basis.size, basis.size, ("front", "back").index(side))
    assert np.array_equal(m.values, values)
    s = 1.0 if side == "back" else -1.0
    wi, wo = directions(1, 500), directions(2, 500)
    expected = [
        values[scalar_patch(basis, s * o[0], o[1], o[2]), scalar_patch(basis, -s * i[0], -i[1], i[2])]
        for i, o in zip(wi.tolist(), wo.tolist(), strict=True)
    ]
    assert np.array_equal(m.f(wi, wo), expected)


def test_the_file_s_own_basis_is_used(tmp_path):
    """Also where it is one of the well-known names, of other rings, as older files have."""
    other = TINY._replace(name="LBNL/Klems Full")
    text = tiny().replace("Tiny", other.name)
    m = load(file_of(tmp_path, text))
    assert m.incident == other
    assert m.about["Name"] == "Shade & co"
    assert m.about["Thickness"] == "1 Millimeter"
    # The front is seen turned about y: wi from +x is the file's azimuth 0, wo towards -x too.
    for phi_i, i in ((0.0, 1), (np.pi / 2, 4), (np.pi, 3), (-np.pi / 2, 2)):
        for phi_o, o in ((0.0, 3), (np.pi / 2, 2), (np.pi, 1), (-np.pi / 2, 4)):
            f = m.f(gn.direction(1.0, phi_i), gn.direction(0.8, phi_o))
            assert f == numbers_of(5, 5)[o, i], (phi_i, phi_o)
    up = gn.direction(0.1, 2.0)
    assert m.f(up, up) == numbers_of(5, 5)[0, 0]


def test_the_mirror_direction_is_the_diagonal(tmp_path):
    for side in ("front", "back"):
        m = Klems(np.eye(145), side=side)
        wi = directions(3, 300)
        assert (m.f(wi, wi * [-1.0, -1.0, 1.0]) == 1.0).all()


def test_projected_solid_angles_and_totals(tmp_path):
    for basis in (FULL, HALF, QUARTER, TINY):
        assert basis.solid_angles.sum() == pytest.approx(math.pi, rel=1e-14)
    assert (FULL.size, HALF.size, HALF_2021.size, QUARTER.size) == (145, 77, 73, 41)
    assert FULL.solid_angles[0] == pytest.approx(0.0238638, rel=1e-5)  # pi sin^2(5 degrees)
    m = load(file_of(tmp_path, full()))
    wo = over_the_disc(400)
    wi = gn.direction(0.61, -2.2)
    direct = m.f(wi, wo).mean() * math.pi
    column = scalar_patch(FULL, wi[0], -wi[1], wi[2])
    assert m.hemispherical_totals()[column] == pytest.approx(direct, rel=2e-3)
    assert m.hemispherical_totals()[column] == pytest.approx(gn.albedo(m, wi, 1e-3), abs=1e-3)


def scalar_square(x: float, y: float) -> tuple[float, float]:
    """Shirley and Chiu's map by its four wedges."""
    r, phi = math.hypot(x, y), math.atan2(y, x)
    if phi < -math.pi / 4:
        phi += 2 * math.pi
    wedge = min(int((phi + math.pi / 4) / (math.pi / 2)), 3)
    t = (phi - wedge * math.pi / 2) / (math.pi / 4) * r
    a, b = ((r, t), (-t, r), (-r, -t), (t, -r))[wedge]
    return (a + 1) / 2, (b + 1) / 2


@pytest.mark.parametrize("side", ["front", "back"])
def test_trees_against_a_scalar_implementation(side, tmp_path, evaluation):
    s = 1.0 if side == "back" else -1.0
    wi, wo = directions(4, 400), directions(5, 400)
    g3, g4 = grid_of(3, 3), grid_of(4, 2)
    trees = {n: TensorTree([tree_nodes.from_grid(g, 0.0)], side) for n, g in ((3, g3), (4, g4))}
    three, four = [], []
    for i, o in zip(wi.tolist(), wo.tolist(), strict=True):
        at = (*scalar_square(-s * i[0], -i[1]), *scalar_square(s * o[0], o[1]))
        four.append(g4[tuple(min(int(4 * x), 3) for x in at)])
        alpha = math.atan2(-i[1], -s * i[0])
        x, y = s * o[0] * math.cos(alpha) + o[1] * math.sin(alpha), o[1] * math.cos(alpha) - s * o[0] * math.sin(alpha)
        at = (0.5 - 0.5 * math.hypot(i[0], i[1]), *scalar_square(x, y))
        three.append(g3[tuple(min(int(8 * x), 7) for x in at)])
    assert np.mean(trees[3].f(wi, wo) == three) > 0.995  # rounding at edges of cells
    assert np.mean(trees[4].f(wi, wo) == four) > 0.995


def test_nested_trees_and_grids(tmp_path):
    """Children count their dimensions from the first bit, grids from the last."""
    m = load(file_of(tmp_path, tree3()))
    (tree,) = m.trees
    nodes, corners, sides = tree_nodes.leaf_places(tree)
    found = {(*c, s): v for c, s, v in zip(corners.tolist(), sides.tolist(), tree.values[nodes].tolist(), strict=True)}
    assert found[0.0, 0.0, 0.0, 0.5] == 0.25
    assert found[0.0, 0.5, 0.5, 0.5] == 0.15
    assert found[0.0, 0.5, 0.0, 0.125] == grid_of(3, 2)[0, 0, 0]
    assert found[0.125, 0.75, 0.375, 0.125] == grid_of(3, 2)[1, 2, 3]
    assert found[0.25, 0.0, 0.5, 0.25] == 0.1 + 0.01 * 1  # child 4, its child 1
    assert found[0.0, 0.25, 0.5, 0.25] == 0.1 + 0.01 * 2
    assert found[0.375, 0.25, 0.875, 0.125] == grid_of(3, 1)[1, 0, 1]
    assert (sides**3).sum() == pytest.approx(1.0)
    assert tree.values[0] == pytest.approx((sides**3 * tree.values[nodes]).sum())
    flat = m.data
    assert flat["value"].sizes["leaf"] == len(nodes)


# Radiance: theta and phi [degrees] of the incident, and of the outgoing direction in its frame, f, and the total.

RADIANCE = {
    "full": [
        (111.6, 290.9, 136.2, 102.9, 0.2199853, 0.50302114),
        (175.4, 138.0, 145.3, 16.3, 0.0699861, 0.50118369),
        (175.9, 359.7, 124.5, 84.4, 0.1099802, 0.50118369),
        (37.0, 350.7, 76.3, 303.9, 0.2699541, 0.50380306),
        (33.4, 177.5, 57.5, 21.9, 0.2400159, 0.49467479),
        (47.2, 97.7, 74.8, 23.1, 0.07998823, 0.49760102),
    ],
    "half": [
        (111.6, 290.9, 136.2, 102.9, 0.1499649, 0.50169638),
        (175.4, 138.0, 145.3, 16.3, 0.04000174, 0.5033479),
        (175.9, 359.7, 124.5, 84.4, 0.1899787, 0.5033479),
    ],
    "quarter": [
        (68.4, 290.9, 43.8, 102.9, 0.2399655, 0.49892004),
        (4.6, 138.0, 34.7, 16.3, 0.2899255, 0.49209714),
        (4.1, 359.7, 55.5, 84.4, 0.2499801, 0.49209714),
    ],
    "tiny": [
        (111.6, 290.9, 136.2, 102.9, 0.1500307, 0.61850105),
        (175.4, 138.0, 145.3, 16.3, 0.09998085, 0.36324664),
        (175.9, 359.7, 124.5, 84.4, 0.1800245, 0.36324664),
    ],
    "tree3": [
        (68.4, 290.9, 43.8, 102.9, 0.06999842, 0.5389795),
        (4.6, 138.0, 34.7, 16.3, 0.1500035, 0.55125135),
        (4.1, 359.7, 55.5, 84.4, 0.2499856, 0.55125135),
    ],
    "tree4": [
        (111.6, 290.9, 136.2, 102.9, 0.1200055, 0.51247229),
        (175.4, 138.0, 145.3, 16.3, 0.04000249, 0.53210726),
        (175.9, 359.7, 124.5, 84.4, 0.2000104, 0.51247231),
    ],
    "2011-SA1.XML": [
        (111.6, 290.9, 136.2, 102.9, 0.1876135, 0.58941306),
        (175.4, 138.0, 145.3, 16.3, 0.153571, 0.48245751),
        (175.9, 359.7, 124.5, 84.4, 0.153571, 0.48245751),
        (37.0, 350.7, 76.3, 303.9, 0.1882682, 0.59146766),
        (33.4, 177.5, 57.5, 21.9, 0.1838584, 0.57760696),
        (47.2, 97.7, 74.8, 23.1, 0.1940379, 0.60959778),
    ],
    "t3.xml": [
        (68.4, 290.9, 43.8, 102.9, 0.1547883, 0.48627865),
        (4.6, 138.0, 34.7, 16.3, 0.1233958, 0.38765934),
        (4.1, 359.7, 55.5, 84.4, 0.1233958, 0.38765934),
    ],
}
RADIANCE["rows"] = RADIANCE["full"]  # the same numbers, stored by rows


def in_gonio(theta: float, phi: float) -> np.ndarray:
    """A direction of Radiance's world; below the surface it is on WINDOW's front."""
    w = gn.direction(np.radians(theta), np.radians(phi))
    return w if theta < 90.0 else w * [-1.0, 1.0, -1.0]


MADE = {
    "full": full,
    "rows": lambda: full(structure="Rows"),
    "half": lambda: full(HALF),
    "quarter": lambda: full(QUARTER),
    "tiny": tiny,
    "tree3": tree3,
    "tree4": tree4,
}


def total(m, wi):
    """Of all wo, for one wi: exact where f is constant in cells that 64 on each side divide."""
    if isinstance(m, Klems):
        x = -wi[0] if m.side == "back" else wi[0]
        return m.hemispherical_totals()[scalar_patch(m.incident, x, -wi[1], wi[2])]
    return m.f(wi, over_the_disc(128)).mean(axis=(0, 1)) * math.pi


@pytest.mark.parametrize("name", RADIANCE)
def test_radiance_gives_the_same(name, tmp_path):
    path = file_of(tmp_path, MADE[name]()) if name in MADE else real(f"window_xml/{name}")
    for theta_i, phi_i, theta_o, phi_o, f, hemispherical in RADIANCE[name]:
        m = window_xml.read(path, side="back" if theta_i < 90.0 else "front")
        wi, wo = in_gonio(theta_i, phi_i), in_gonio(theta_o, phi_o)
        # Radiance changes every patch by up to 3e-4, relative, on purpose.
        assert m.f(wi, wo) == pytest.approx(f, rel=4e-4)
        assert total(m, wi) == pytest.approx(hemispherical, abs=1e-6)


ASK = """
import json, sys
from pyradiance import bsdf
path, asked = json.load(sys.stdin)
sd = bsdf.load_file(path)
json.dump([[*bsdf.query(sd, *a).tolist(), bsdf.direct_hemi(sd, a[0], a[1], 13)] for a in asked], sys.stdout)
"""


def radiance(path: Path, asked: list) -> np.ndarray:
    """X, Y, Z of f, and totals; in a process of its own: pyradiance 1.3.1 ends in a fault after some files."""
    if find_spec("pyradiance") is None:
        pytest.skip("pyradiance is not installed (checked with 1.3.1): the numbers of Radiance in this file were its")
    told = json.dumps([str(path), asked])
    done = subprocess.run([sys.executable, "-c", ASK], input=told, capture_output=True, text=True, check=True)
    return np.array(json.loads(done.stdout))


WRITTEN = {
    "matrix": (MODEL, {}),
    "matrix of the back": (BRUSHED, {"side": "back", "basis": "half"}),
    "quarter": (BRUSHED, {"basis": "quarter"}),
    "own basis": (BRUSHED, {"basis": TINY}),
    "tree of 3": (gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.3), 0.8), {"tree": 3, "tolerance": 0.02}),
    "tree of 4": (BRUSHED, {"tree": 4, "resolution": 16, "tolerance": 0.05, "side": "back"}),
    "tree of 3 in colour": (MODEL, {"tree": 3, "resolution": 16}),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_radiance_reads_what_is_written(name, tmp_path):
    model, options = WRITTEN[name]
    path = tmp_path / "a.xml"
    save(model, path, "WINDOW XML", **options)
    m = load(path)
    rng = np.random.default_rng(6)
    asked = (rng.random((40, 4)) * [85.0, 360.0, 85.0, 360.0]).tolist()
    if m.side == "front":
        asked = [[180.0 - a, b, 180.0 - c, d] for a, b, c, d in asked]
    found = radiance(path, asked)
    for (a, b, c, d), (_, y, _, hemispherical) in zip(asked, found, strict=True):
        f = np.atleast_1d(m.f(in_gonio(a, b), in_gonio(c, d)))
        # Of a coloured tree Radiance takes a Lambertian part off, after which only totals are right.
        if "colour" not in name:
            assert f[f.size // 2] == pytest.approx(y, rel=3e-3 if f.size == 3 else 4e-4)
        assert np.atleast_1d(total(m, in_gonio(a, b)))[f.size // 2] == pytest.approx(hemispherical, abs=1e-6)


def test_colours_of_trees_are_those_of_radiance(tmp_path):
    """Where f comes near 0: Radiance takes nothing off."""
    rng = np.random.default_rng(7)
    luminance = 0.05 + 0.2 * rng.random((8, 8, 8))
    luminance[:, 0, 0] = 1e-3
    u, v = 0.21 + 0.02 * rng.random((8, 8, 8)), 0.46 + 0.02 * rng.random((8, 8, 8))
    path = tmp_path / "a.xml"
    save(TensorTree([tree_nodes.from_grid(g, 0.0) for g in (luminance, u, v)], "back", "uv"), path, "WINDOW XML")
    m = load(path)
    assert m.channel_names == RELATIVE_XYZ
    asked = (rng.random((60, 4)) * [85.0, 360.0, 85.0, 360.0]).tolist()
    expected = radiance(path, asked)[:, :3]
    found = [m.f(in_gonio(a, b), in_gonio(c, d)) for a, b, c, d in asked]
    np.testing.assert_allclose(found, expected, rtol=5e-4)


# Means.


class _Twisted(gn.Reflectance):
    """Isotropic, neither reciprocal nor the same on both sides of the plane of incidence."""

    def formula(self, wi, wo):
        return 0.3 + 0.1 * (wi.x * wo.y - wi.y * wo.x) + 0.05 * (wi.x * wo.x + wi.y * wo.y) + 0.1 * wi.z


@pytest.mark.parametrize("side", ["front", "back"])
@pytest.mark.parametrize("basis", [QUARTER, TINY, AngleBasis("no common divisor", (0, 30, 60, 90), (4, 9, 6))])
def test_turned_pairs_of_an_isotropic_material_share_the_mean_that_each_has(basis, side, monkeypatch):
    shared = means.averages(_Twisted(), basis, side)
    monkeypatch.setattr(_Twisted, "is_isotropic", lambda self: False)
    np.testing.assert_allclose(shared, means.averages(_Twisted(), basis, side), rtol=1e-12)


# Sampling.


def measured(kind: str):
    if kind == "klems":
        return Klems(numbers_of(41, 41), QUARTER, side="back")
    if kind == "klems of three":
        values = np.stack([numbers_of(41, 41, seed) - 0.05 for seed in range(3)], axis=2)
        values[3, 5], values[4] = np.nan, np.inf
        return Klems(values, QUARTER)
    grid = grid_of(int(kind[0]), 3)
    return TensorTree([tree_nodes.from_grid(grid, 0.0)], kind[2:])


KINDS = ("klems", "klems of three", "3 front", "3 back", "4 front", "4 back")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("theta", [0.0, 0.7, 1.4])
def test_samples_are_drawn_as_the_density_says(kind, theta):
    m, wo, n = measured(kind), gn.direction(theta, 0.9), 400
    around = over_the_disc(n)
    assert (m.pdf(around, wo) / around[..., 2]).mean() * math.pi == pytest.approx(1.0, abs=3e-3)
    u = np.random.default_rng(8).random((40_000, 2))
    s = m.sample(np.broadcast_to(wo, (len(u), 3)), u)
    assert not s.delta.any()
    f = m.f(s.wi, wo)
    f = f if f.ndim == 1 else f[:, 1]
    weight = s.weight if s.weight.ndim == 1 else s.weight[:, 1]
    np.testing.assert_allclose(weight, f * s.wi[:, 2] / s.pdf, rtol=1e-9)
    of_disc = m.f(around, wo)
    of_disc = of_disc if of_disc.ndim == 2 else of_disc[..., 1]
    assert np.nanmean(weight) == pytest.approx(np.nanmean(of_disc) * math.pi, rel=0.03)
    assert (np.abs(weight[np.isfinite(weight)]) < 10.01 * math.pi * np.nanmax(np.abs(f))).all()
    # How many fall into each quarter, against the density there.
    for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        inside = (around[..., 0] * x > 0) & (around[..., 1] * y > 0)
        expected = np.where(inside, m.pdf(around, wo) / around[..., 2], 0.0).mean() * math.pi
        assert np.mean((s.wi[:, 0] * x > 0) & (s.wi[:, 1] * y > 0)) == pytest.approx(expected, abs=0.012)


@pytest.mark.parametrize("kind", KINDS)
def test_the_density_is_the_jacobian(kind):
    m, rng, h = measured(kind), np.random.default_rng(9), 1e-7
    wo, u = directions(10, 200), 0.01 + 0.98 * rng.random((200, 2))
    s = m.sample(wo, u)
    along = [m.sample(wo, u + h * step).wi - s.wi for step in np.eye(2)]
    area = np.linalg.norm(np.cross(*along), axis=-1) / h**2
    assert np.mean(np.abs(area * s.pdf - 1.0) < 1e-3) > 0.98  # a few steps cross an edge


def test_values_that_are_no_numbers():
    m = measured("klems of three")
    theta, phi = QUARTER.centres
    at = lambda k: gn.direction(theta[k], phi[k])  # noqa: E731  (short, and used at once)
    f = m.f(at(5) * [1.0, -1.0, 1.0], at(3) * [-1.0, 1.0, 1.0])
    assert np.isnan(f).all()
    assert np.isnan(m.f(at(7), at(4) * [-1.0, 1.0, 1.0])).all()
    assert m.valid.sum() == 3 * (41 * 41 - 42)
    assert (m.f(directions(11, 2000), directions(12, 2000)) < 0.0).any()


SMALL = {
    "klems": Klems(np.stack([numbers_of(5, 5, seed) for seed in range(3)], axis=2), TINY),
    "tree": TensorTree([tree_nodes.from_grid(grid_of(3, 1), 0.0)], "back"),
}


@pytest.mark.parametrize("kind", SMALL)
def test_every_library_gives_the_same(kind, library):
    m = SMALL[kind]
    wi, wo = directions(13, 50), directions(14, 50)
    u = np.random.default_rng(15).random((50, 2))
    expected, sampled = m.f(wi, wo), m.sample(wo, u)
    f, sample = library.whole(m.f), library.whole(m.sample)
    found = library.numpy(f(library.array(wi), library.array(wo)))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    s = sample(library.array(wo), library.array(u))
    np.testing.assert_allclose(library.numpy(s.wi), sampled.wi, atol=1e-9)
    np.testing.assert_allclose(library.numpy(s.pdf), sampled.pdf, rtol=1e-9)
    single = library.numpy(f(library.array(wi, "float32"), library.array(wo, "float32")))
    assert np.mean(np.isclose(single, expected, rtol=1e-5, equal_nan=True)) > 0.98


def test_laws():
    smooth = Klems(np.full((41, 41), 0.2), QUARTER)
    failed = [law.name for law in gn.check(smooth).laws if not law.passed]
    assert not failed, failed


def test_a_white_surface_in_colours_is_white_however_it_is_wrapped(tmp_path):
    path = tmp_path / "white.xml"
    save(gn.Lambertian([0.6, 0.6, 0.6]), path, "WINDOW XML")
    m = load(path)
    assert m.channel_names == RELATIVE_XYZ
    wi, wo = gn.direction(0.3, 0.1), gn.direction(0.8, 2.0)
    for each in (m, 0.5 * m, m + gn.Lambertian(0.2), gn.Rotated(m, 0.3), gn.Coated(m, eta=1.5)):
        matrix = rgb_of(each.channel_names)
        rgb = each.f(wi, wo) @ matrix
        assert np.ptp(rgb) < 1e-5 * rgb.mean(), each
    d65 = gn.Gridded(
        "angles", {"theta_i": [0.1], "theta_o": [0.1], "phi": [0.0]}, [[[WHITE]]], channels=["X", "Y", "Z"]
    )
    with pytest.raises(ParameterError, match="terms have channels"):
        m + d65


def test_colours_of_a_spectrum_are_its_integrals(tmp_path):
    """In whatever order its wavelengths are: the same X, Y, Z as of pictures."""
    names, rho = np.array([650.0, 420.0, 480.0, 560.0]), np.array([0.8, 0.1, 0.2, 0.5])
    axes = {"theta_i": [0.0, 1.5], "theta_o": [0.0, 1.5], "phi": [0.0]}
    m = gn.Gridded("angles", axes, np.broadcast_to(rho / np.pi, (2, 2, 1, 4)), channels=list(names))
    save(m, tmp_path / "a.xml", "WINDOW XML", basis="quarter")
    colours = load(tmp_path / "a.xml")
    assert colours.channel_names == RELATIVE_XYZ
    np.testing.assert_allclose(np.pi * colours.f_angles(0.3, 0.0, 0.3, 1.0), rho @ to_xyz(names) / WHITE, rtol=1e-5)
