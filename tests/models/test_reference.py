"""Numbers with sources: closed forms, independent evaluations, and Mitsuba 3."""

from __future__ import annotations

import cmath
import math
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import materials
import numpy as np
import pytest
from materials import (
    DISTRIBUTIONS,
    FRESNELS,
    MODELS,
    REFERENCE,
    Draw,
    Sum,
    draws,
    number,
    on_sphere,
    random,
    structures,
)

import gonio as gn
from gonio.formula.direction import Direction
from gonio.formula.fields import Param
from gonio.formula.fresnel.conductor import fresnel_conductor
from gonio.formula.fresnel.dielectric import fresnel_dielectric

PI = math.pi


leggauss = cache(np.polynomial.legendre.leggauss)


def gauss(low: float, high: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    x, w = leggauss(n)
    return 0.5 * (high - low) * (x + 1.0) + low, 0.5 * (high - low) * w


def graded(high: float, panels: int = 60, smallest: float = 1e-5) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights on [0, high], dense towards 0."""
    edges = np.concatenate([[0.0], np.geomspace(smallest, high, panels)])
    nodes, weights = zip(*(gauss(a, b, 8) for a, b in pairwise(edges)), strict=True)
    return np.concatenate(nodes), np.concatenate(weights)


# One number for every class.


def test_every_model_has_a_reference():
    """A new model, distribution or Fresnel term needs its line in tests/tools/materials.py."""
    assert {row.model for row in REFERENCE} == {*MODELS, *DISTRIBUTIONS, *FRESNELS}
    assert all(row.source for row in REFERENCE)


@pytest.mark.parametrize("row", REFERENCE, ids=lambda row: row.model.__name__)
def test_reference(row):
    assert row.value(row.made) == pytest.approx(row.expected, rel=row.relative)


# GGX at alpha = 1, F = 1: closed forms by direct integration (shared by two derivations).

COSINES = [1.0, 0.5, 0.2, 0.05]


def closed_correlated(mu: float) -> float:
    return 1.0 - mu * math.log((1.0 + mu) / mu)


def closed_separable(mu: float) -> float:
    return 2.0 * (1.0 - math.log(2.0)) / (1.0 + mu)


@pytest.mark.parametrize("mu", COSINES)
@pytest.mark.parametrize(
    ("masking", "closed"), [("height_correlated", closed_correlated), ("separable", closed_separable)]
)
def test_ggx_albedo(mu, masking, closed):
    m = gn.Microfacet(gn.GGX(1.0), masking=masking)
    w = gn.direction(math.acos(mu), 0.8)
    assert gn.albedo(m, w, tolerance=1e-6) == pytest.approx(closed(mu), abs=1e-5)


@pytest.mark.parametrize(
    ("masking", "average"),
    [("height_correlated", 4.0 / 3.0 * (1.0 - math.log(2.0))), ("separable", 4.0 * (1.0 - math.log(2.0)) ** 2)],
)
def test_ggx_average_albedo(masking, average):
    mu, weight = gauss(0.0, 1.0, 12)
    a = gn.albedo(gn.Microfacet(gn.GGX(1.0), masking=masking), gn.direction(np.arccos(mu), 0.3), tolerance=1e-5)
    assert (2.0 * mu * weight) @ a == pytest.approx(average, abs=2e-5)


def test_ggx_values_in_the_table():
    """The numbers as published, so that the closed forms above are checked too."""
    assert closed_correlated(1.0) == pytest.approx(0.3068528194, abs=1e-10)
    assert closed_correlated(0.5) == pytest.approx(0.4506938557, abs=1e-10)


# Fresnel.


def test_dielectric():
    n = 1.5
    assert fresnel_dielectric(1.0, n) == pytest.approx(0.04)
    brewster = math.cos(math.atan(n))
    rs = (brewster - n * math.sqrt(1 - (1 - brewster**2) / n**2)) ** 2 / (
        brewster + n * math.sqrt(1 - (1 - brewster**2) / n**2)
    ) ** 2
    assert math.degrees(math.atan(n)) == pytest.approx(56.3099, abs=1e-4)
    assert fresnel_dielectric(brewster, n) == pytest.approx(0.5 * rs, rel=1e-12)
    assert fresnel_dielectric(math.cos(math.radians(60.0)), 1.0 / n) == 1.0
    critical = math.sqrt(1.0 - 1.0 / n**2)
    assert fresnel_dielectric(critical * 0.999, 1.0 / n) == 1.0
    assert fresnel_dielectric(critical * 1.001, 1.0 / n) < 0.9


def diffuse(F: Any) -> float:
    """Hemispherical average 2 int F(mu) mu dmu, with nodes dense at grazing and at the critical angle."""
    x, w = graded(1.0, 80, 1e-9)
    return float((2.0 * w * x) @ F(x))


def test_diffuse_fresnel_reflectance():
    n = 1.5
    external = diffuse(gn.Dielectric(n).F)
    assert external == pytest.approx(0.09177795934, abs=1e-9)
    critical = math.sqrt(1.0 - 1.0 / n**2)
    x, w = graded(1.0 - critical, 80, 1e-12)
    inside = float((2.0 * w * (critical + x)) @ gn.Dielectric(1.0 / n).F(critical + x))
    assert inside + critical**2 == pytest.approx(0.5963457598, abs=1e-9)
    assert inside + critical**2 == pytest.approx(1.0 - (1.0 - external) / n**2, abs=1e-9)


def test_diffuse_schlick_reflectance():
    assert diffuse(gn.Schlick(0.3).F) == pytest.approx(0.3 + 0.7 / 21.0, abs=1e-12)


def amplitudes(cos: float, index: complex) -> float:
    """Unpolarized reflectance by the complex amplitudes."""
    inside = cmath.sqrt(1.0 - (1.0 - cos * cos) / index**2)
    s = (cos - index * inside) / (cos + index * inside)
    p = (index * cos - inside) / (index * cos + inside)
    return 0.5 * (abs(s) ** 2 + abs(p) ** 2)


def test_conductor_against_complex_amplitudes():
    rng = np.random.default_rng(0)
    for _ in range(300):
        cos, eta, k = rng.random(), 10.0 ** rng.uniform(-2, 1.3), 50.0 * rng.random() ** 3
        assert fresnel_conductor(cos, eta, k) == pytest.approx(amplitudes(cos, complex(eta, k)), abs=2e-13)
        assert fresnel_dielectric(cos, eta) == pytest.approx(amplitudes(cos, complex(eta, 0.0)), abs=1e-10)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_no_interface_reflects_nothing(dtype):
    """An index of 1 is no surface at all, down to grazing: no rounding may invent total reflection."""
    cos = np.asarray(np.geomspace(1e-5, 1.0, 200), dtype)
    one, none = np.asarray(1.0, dtype), np.asarray(0.0, dtype)
    assert fresnel_dielectric(cos, one).max() < 1e-6
    assert fresnel_conductor(cos, one, none).max() < 1e-6
    assert fresnel_conductor(cos, one, none).min() >= 0.0


# Distributions of normals.


def distributions() -> list[Any]:
    """By default two random ones of each kind, and those at the ends."""
    made = [
        pytest.param(random(kind, np.random.default_rng(seed), None, {}), marks=pytest.mark.full if seed > 1 else ())
        for kind in DISTRIBUTIONS
        for seed in range(6)
    ]
    wide = [max(0.02, v) for v in (0.0, 0.3)]
    made += [gn.GGX(a, b) for a in (*wide, 1.0) for b in wide] + [gn.Beckmann(a, b) for a in (*wide, 1.0) for b in wide]
    return made + [gn.GaussianFacets(a) for a in (1e-3, 0.05, 0.4, 1.0)]


each_distribution = pytest.mark.parametrize("d", distributions(), ids=repr)  # of one table for all tests


def normals(d: Any, n: int = 180) -> tuple[Direction, np.ndarray]:
    """Normals over the hemisphere and their solid angles: a polar grid, dense at the pole and where facets are few."""
    theta, weight = graded(0.5 * PI, 80, 1e-6)
    r = math.sqrt(getattr(d, "alpha_y", 1.0) / getattr(d, "alpha_x", 1.0))  # half of the stretch: both axes are dense
    even = (np.arange(n) + 0.5) * 2.0 * PI / n
    phi = np.arctan2(r * np.sin(even), np.cos(even))
    w = on_sphere(theta[:, None], phi[None, :])
    dphi = 2.0 * PI / n * r / (np.cos(even) ** 2 + (r * np.sin(even)) ** 2)
    solid = (np.sin(theta) * weight)[:, None] * dphi
    return Direction(w[..., 0], w[..., 1], w[..., 2]), solid


@each_distribution
def test_facets_cover_the_surface(d):
    """Integral of D cos(theta) = 1."""
    wm, solid = normals(d)
    assert (d.D(wm) * wm.z * solid).sum() == pytest.approx(1.0, abs=3e-5)


@each_distribution
def test_smith_masking_conserves_projected_area(d):
    """(1 + Lambda) cos(theta_o) is the area that all facets show to a direction: integral of D max(wo . wm, 0)."""
    wm, solid = normals(d)
    D = d.D(wm)
    for theta, phi in ((0.0, 0.0), (0.6, 0.4), (1.3, 2.0), (1.5, 0.1)):
        wo = on_sphere(theta, phi)
        seen = np.maximum(wm.x * wo[0] + wm.y * wo[1] + wm.z * wo[2], 0.0)
        shown = (D * seen * solid).sum()
        expected = (1.0 + float(d.Lambda(Direction(*wo)))) * wo[2]
        assert shown == pytest.approx(expected, rel=2e-4)


def test_gaussian_facets_norm():
    """1/D(0) by adaptive quadrature, and for small alpha pi alpha Dawson(alpha) (the range's end does not matter)."""
    from scipy.integrate import quad
    from scipy.special import dawsn

    pole = Direction(0.0, 0.0, 1.0)
    for alpha in (1e-3, 0.01, 0.1, 0.25, 0.6, 1.0):
        points = [alpha * s for s in (0.5, 1.0, 2.0, 4.0) if alpha * s < 0.5 * PI]
        norm, _ = quad(
            lambda t, a=alpha: math.exp(-((t / a) ** 2)) * math.sin(2.0 * t),
            0.0,
            min(0.5 * PI, 8.0 * alpha),
            points=points,
            epsabs=0.0,
            epsrel=1e-13,
        )
        assert 1.0 / gn.GaussianFacets(alpha).D(pole) == pytest.approx(PI * norm, rel=1e-11)
        if alpha < 0.2:
            assert 1.0 / gn.GaussianFacets(alpha).D(pole) == pytest.approx(PI * alpha * dawsn(alpha), rel=1e-11)


# Torrance-Sparrow and microfacets by an independent scalar implementation.


def scalar_torrance_sparrow(wi: np.ndarray, wo: np.ndarray, alpha: float, index: complex) -> float:
    """The model of 1967 in plain Python, from the definitions."""
    half = wi + wo
    half = half / math.sqrt(half @ half)
    theta = math.acos(min(half[2], 1.0))
    steps = 200_000
    t = (np.arange(steps) + 0.5) * 0.5 * PI / steps
    norm = PI * float(np.sum(np.exp(-((t / alpha) ** 2)) * np.sin(2.0 * t))) * 0.5 * PI / steps
    between = float(wo @ half)
    grooves = min(1.0, 2.0 * half[2] * wo[2] / between, 2.0 * half[2] * wi[2] / between)
    return math.exp(-((theta / alpha) ** 2)) / norm * amplitudes(between, index) * grooves / (4.0 * wi[2] * wo[2])


def test_torrance_sparrow_against_plain_python():
    rng = np.random.default_rng(1)
    grooved = 0
    for alpha, eta, k in ((0.1, 0.2, 3.9), (0.35, 1.5, 0.0), (0.8, 2.0, 4.0)):
        m = gn.TorranceSparrow(alpha, gn.Conductor(eta, k))
        v = gn.Microfacet(gn.GaussianFacets(alpha), gn.Conductor(eta, k), masking="v_groove")
        for _ in range(25):
            wi, wo = gn.direction(np.arccos(rng.uniform(0.05, 1.0, 2)), rng.uniform(-PI, PI, 2))
            if rng.random() < 0.5:  # near the mirror direction
                wo = gn.direction(*(np.array(gn.angles(wi * [-1.0, -1.0, 1.0])) + 0.3 * alpha * rng.normal(size=2)))
                if wo[2] < 0.01:
                    continue
            expected = scalar_torrance_sparrow(wi, wo, alpha, complex(eta, k))
            assert m.f(wi, wo) == pytest.approx(expected, rel=1e-8)
            assert v.f(wi, wo) == pytest.approx(expected, rel=1e-8)
            half = (wi + wo) / np.linalg.norm(wi + wo)
            grooved += 2.0 * half[2] * min(wi[2], wo[2]) < wo @ half
    assert grooved > 5


# Phong's family.


def over_hemisphere(f: Any) -> float:
    """Integral of f(theta) cos(theta) over the hemisphere for what depends on theta alone."""
    t, w = graded(0.5 * PI)
    return float(2.0 * PI * (w * np.sin(t) * np.cos(t)) @ f(t))


@pytest.mark.parametrize("n", [0.0, 1.0, 4.28, 35.5, 900.0])
def test_phong_family_at_normal_incidence(n):
    up = np.array([0.0, 0.0, 1.0])
    assert gn.albedo(gn.Phong(0.7, n), up, tolerance=1e-6) == pytest.approx(2.0 * PI * 0.7 / (n + 2.0), abs=1e-5)
    assert gn.albedo(gn.ModifiedPhong(0.7, n), up, tolerance=1e-6) == pytest.approx(0.7, abs=1e-5)
    assert gn.albedo(gn.BlinnPhong(0.7, n), up, tolerance=1e-6) == pytest.approx(0.7, abs=1e-5)
    # Blinn-Phong's factor is the reciprocal of the integral of cos(theta/2)^n cos(theta).
    blinn = over_hemisphere(lambda t: np.cos(0.5 * t) ** n)
    assert gn.BlinnPhong(1.0, n).f(up, up) == pytest.approx(1.0 / blinn, rel=1e-9)


def test_phong_breaks_energy_where_the_formula_says():
    """2 pi rho_s/(n + 2) > 1 below n = 4.28 for rho_s = 1 (equations.md, R 4.1.3)."""
    up = np.array([0.0, 0.0, 1.0])
    assert gn.albedo(gn.Phong(1.0, 4.27), up) > 1.0 > gn.albedo(gn.Phong(1.0, 4.30), up)


@pytest.mark.parametrize(("theta", "expected"), [(30.0, 0.86602541), (60.0, 0.50050950)])
def test_modified_phong_albedo(theta, expected):
    m = gn.ModifiedPhong(1.0, 20.0)
    assert gn.albedo(m, gn.direction(math.radians(theta), 1.0), tolerance=1e-7) == pytest.approx(expected, abs=1e-6)


# ABC: the published fit of a measured material.


def test_abc_fit_of_chrome():
    """f and pdf of the row "chrome" of the table, against an independent evaluation with 40 digits."""
    table = Path(gn.__file__).parent / "data" / "merl_abc.tsv"
    row = next(
        line.split("\t") for line in table.read_text(encoding="utf-8").splitlines() if line.startswith("chrome\t")
    )
    rho, A, (B, C, eta) = [float(x) for x in row[1:4]], [float(x) for x in row[4:7]], [float(x) for x in row[7:10]]
    lobe = gn.ABC(A, B, C, eta)
    wi, wo = gn.direction(0.7, 0.1), gn.direction(0.705, 3.24)
    f = (gn.Lambertian(rho) + lobe).f(wi, wo)
    expected = [383.23966323932867, 299.54370804789038, 271.77458053503378]
    np.testing.assert_allclose(f, expected, rtol=1e-11)
    assert lobe.pdf(wi, wo) == pytest.approx(2243.84577980627, rel=1e-11)


# Mitsuba 3, another implementation of the same optics.


@pytest.fixture(scope="module")
def mitsuba() -> Any:
    module = pytest.importorskip("mitsuba")
    module.set_variant("scalar_rgb")
    return module


def test_fresnel_against_mitsuba(mitsuba):
    rng = np.random.default_rng(2)
    for _ in range(100):
        cos, n, k = rng.random(), rng.uniform(1.01, 4.0), 6.0 * rng.random()
        assert gn.Dielectric(n).F(cos) == pytest.approx(mitsuba.fresnel(cos, n)[0], abs=1e-6)
        index = mitsuba.Complex2f(n, k)
        assert gn.Conductor(n, k).F(cos) == pytest.approx(mitsuba.fresnel_conductor(cos, index), abs=1e-6)


@pytest.mark.parametrize("alphas", [(0.3, 0.3), (0.1, 0.5), (0.02, 0.02)])
@pytest.mark.parametrize(("name", "kind", "tolerance"), [("ggx", gn.GGX, 2e-5), ("beckmann", gn.Beckmann, 8e-3)])
def test_microfacets_against_mitsuba(mitsuba, name, kind, tolerance, alphas):
    """`roughconductor`, whose Smith is the separable one and whose Beckmann G1 is a rational approximation.

    Its `eval(si, wo)` takes the viewer in si.wi, the light in wo, and has the light's cosine in it.
    """
    index = {"eta": {"type": "spectrum", "value": 2.0}, "k": {"type": "spectrum", "value": 4.0}}
    alpha = {"alpha_u": alphas[0], "alpha_v": alphas[1]}
    theirs = mitsuba.load_dict({"type": "roughconductor", "distribution": name, **alpha, **index})
    ours = gn.Microfacet(kind(*alphas), gn.Conductor(2.0, 4.0), "separable")
    rng = np.random.default_rng(3)
    off = []
    for i in range(150):
        wi, wo = gn.direction(np.arccos(rng.uniform(0.05, 1.0, 2)), rng.uniform(-PI, PI, 2))
        if i % 2:
            wo = wi * [-1.0, -1.0, 1.0] + np.mean(alphas) * rng.normal(size=3)
            wo = wo * [1.0, 1.0, np.sign(wo[2])] / np.linalg.norm(wo)
        si = mitsuba.SurfaceInteraction3f()
        si.wi = mitsuba.Vector3f(*map(float, wo))
        value = theirs.eval(mitsuba.BSDFContext(), si, mitsuba.Vector3f(*map(float, wi)))[0] / wi[2]
        f = float(ours.f(wi, wo))
        off.append(abs(value - f) / (f + 1e-6))
    assert max(off) < tolerance
    assert np.median(off) < tolerance / 8.0


# The tests' own generator.


def test_random_parameters_stay_within_bounds():
    rng = np.random.default_rng(4)
    for model in (*MODELS, *DISTRIBUTIONS, *FRESNELS):
        for field in (f for f in model.fields.values() if isinstance(f, Param)):
            values = [number(field, rng, None) for _ in range(200)]
            assert field.low <= min(values)
            assert max(values) <= field.high
            assert np.ptp(values) > 0.0
    assert Draw(gn.Phong, 1).material() == Draw(gn.Phong, 1).material()


def test_another_model_changes_no_draw(monkeypatch):
    """What a test draws follows from the names of what it is drawn for, not from their places in a list."""
    another = type("Aardvark", (), {"fields": {}})
    before, sums = draws(), [Draw(Sum, seed) for seed in range(3)]
    made = [draw.material(channels) for draw in sums for channels in (None, 3)]
    monkeypatch.setattr(materials, "MODELS", [another, *MODELS])
    monkeypatch.setattr(materials, "structures", lambda model: [{}] if model is another else structures(model))
    assert [draw for draw in draws() if draw.model is not another] == before
    assert [materials._material.__wrapped__(*draw, channels) for draw in sums for channels in (None, 3)] == made
