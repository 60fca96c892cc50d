"""Reflectances made of another one: coats, turned and tilted frames, tables."""

from __future__ import annotations

import copy
import json
import math
import pickle
import warnings

import numpy as np
import pytest
from libraries import switch_off, thinned
from materials import on_sphere
from scipy.integrate import quad

import gonio as gn
from gonio.base.calls import breaches
from gonio.errors import ParameterError
from gonio.formats import merl
from gonio.formula import tree
from gonio.formula.direction import Direction
from gonio.formula.fresnel.dielectric import fresnel_dielectric
from gonio.formula.json_form import from_json
from gonio.models.coated import _BelowSmooth

PI = math.pi
WHITE = gn.Lambertian(1.0)
GLOSSY = gn.Microfacet(gn.GGX(0.15, 0.3), gn.Conductor(0.2, 3.9))
MIRROR = gn.IdealSpecular(gn.Conductor([0.2, 0.9, 1.2], [3.9, 2.4, 2.3]))
BASES = {
    "Lambertian": gn.Lambertian([0.2, 0.5, 0.8]),
    "sum": gn.Lambertian([0.2, 0.5, 0.8]) + 0.3 * GLOSSY,
    "mirror": 0.2 * gn.Lambertian(0.5) + 0.5 * MIRROR,
    "wrapper": gn.Rotated(GLOSSY, 0.7),
}
each_base = pytest.mark.parametrize("base", BASES.values(), ids=BASES)


def directions(count: int, seed: int, steepest: float = 0.02) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return on_sphere(np.arccos(rng.uniform(steepest, 1.0, count)), rng.uniform(-PI, PI, count))


WI, WO = directions(200, 1), directions(200, 2)
WRAPPERS = {
    "Coated": lambda m: gn.Coated(m, 1.4, [0.1, 0.3, 0.0]),
    "RoughCoated": lambda m: gn.RoughCoated(m, 1.4, [0.1, 0.3, 0.0], alpha=0.2),
    "OpenPBRCoat": lambda m: gn.OpenPBRCoat(m, 0.7, [0.9, 0.5, 0.7], 0.4),
    "OpenPBRFuzz": lambda m: gn.OpenPBRFuzz(m, 0.4, [0.9, 0.5, 0.7], 0.6),
    "Rotated": lambda m: gn.Rotated(m, 0.6),
    "ShadingNormal": lambda m: gn.ShadingNormal(m, 0.3, -0.2),
    "NormalMapped": lambda m: gn.NormalMapped(m, 0.3, -0.2),
}
each_wrapper = pytest.mark.parametrize("wrap", WRAPPERS.values(), ids=WRAPPERS)


# Any wrapper.


@pytest.fixture
def uncompiled(monkeypatch):
    """For many structures, at few directions: compiling each would take the time."""
    switch_off(monkeypatch)


@each_base
@each_wrapper
def test_forms(wrap, base):
    m = wrap(base)
    assert gn.expression(repr(m)) == m
    assert from_json(json.loads(json.dumps(m.to_json()))) == m
    assert pickle.loads(pickle.dumps(m)) == m == copy.deepcopy(m)
    assert hash(m) == hash(copy.deepcopy(m))
    assert m.channel_names == base.channel_names
    inner = "base" if "base" in m.fields else "of"
    assert {f"{inner}.{path}" for path in base.parameters} <= set(m.parameters)


def test_parameters_of_what_is_inside():
    m = gn.Coated(gn.Lambertian(0.5))
    assert m.parameters["base.rho"].value == 0.5
    brighter = m.replace({"base.rho": 0.9, "eta": 1.3})
    assert brighter == gn.Coated(gn.Lambertian(0.9), 1.3)
    by = brighter.jacobian(WI, WO, ["base.rho", "eta"]).by
    for path, h in (("base.rho", 1e-6), ("eta", 1e-6)):
        up, down = (brighter.replace({path: brighter.parameters[path].value + s}).f(WI, WO) for s in (h, -h))
        np.testing.assert_allclose(by[path], (up - down) / (2 * h), rtol=1e-6, atol=1e-9)


@each_base
@each_wrapper
def test_all_lobes_together_are_all(uncompiled, wrap, base):
    m = wrap(base)
    f = sum(np.asarray(weight) * np.reshape(lobe.f(WI, WO), (200, -1)) for weight, lobe in m.lobes())
    np.testing.assert_allclose(f, m.f(WI, WO).reshape(200, -1) * np.ones(f.shape), rtol=1e-12)
    back = m.f(WO, WI)
    if "reciprocity" not in breaches(m):
        np.testing.assert_allclose(back, m.f(WI, WO), rtol=1e-10)


@pytest.mark.parametrize("outer", WRAPPERS.values(), ids=WRAPPERS)
@each_wrapper
def test_wrappers_of_wrappers(uncompiled, wrap, outer):
    m = outer(wrap(gn.Lambertian(0.4) + gn.IdealSpecular(0.3)))
    u = np.random.default_rng(3).random((len(WO), 2))
    s = m.sample(WO, u)
    assert all(np.isfinite(x).all() for x in (m.f(WI, WO), m.pdf(WI, WO), *s))
    np.testing.assert_allclose(np.linalg.norm(s.wi, axis=-1), 1.0, rtol=1e-12)
    used = (s.pdf > 0.0) & ~s.delta
    np.testing.assert_allclose(s.pdf[used], m.pdf(s.wi, WO)[used], rtol=1e-8)


@pytest.fixture(scope="module")
def holed():
    raw = np.full((3, 90, 90, 180), 20.0)
    raw[:, 30:34, 30:34] = -1.0
    return merl.MERL(raw)


@each_wrapper
def test_measurements_inside(uncompiled, holed, wrap):
    """A table as in MERL files, with a hole; f is NaN where the base holds nothing."""
    m = wrap(holed)
    f = m.f(WI, WO)
    assert f.shape == (200, 3)
    assert np.isfinite(f).mean() > 0.9
    s = m.sample(WO, np.random.default_rng(3).random((len(WO), 2)))
    used = s.pdf > 0.0
    assert used.mean() > 0.3
    np.testing.assert_allclose(s.pdf[used & ~s.delta], m.pdf(s.wi, WO)[used & ~s.delta], rtol=1e-9)


@pytest.mark.parametrize("base", [gn.Phong(1.0, 1.0), gn.OriginalPhong(1.0, 2.0)], ids=lambda m: type(m).__name__)
def test_breaches_are_inherited(base):
    assert set(breaches(gn.Rotated(base))) == set(base.breaks)
    assert set(breaches(gn.ShadingNormal(base))) == {"energy", "reciprocity"}
    assert not breaches(gn.Coated(WHITE))


# Rotated.


def test_rotated():
    m = gn.Microfacet(gn.GGX(0.1, 0.4), 0.7)
    np.testing.assert_allclose(gn.Rotated(m, 0.0).f(WI, WO), m.f(WI, WO), rtol=1e-14)
    np.testing.assert_allclose(
        gn.Rotated(m, PI / 2).f(WI, WO), gn.Microfacet(gn.GGX(0.4, 0.1), 0.7).f(WI, WO), rtol=1e-9
    )
    round_lobe = gn.Microfacet(gn.GGX(0.2))
    np.testing.assert_allclose(gn.Rotated(round_lobe, 1.234).f(WI, WO), round_lobe.f(WI, WO), rtol=1e-9)
    theta_i, phi_i, theta_o, phi_o = (*gn.angles(WI), *gn.angles(WO))
    np.testing.assert_allclose(
        gn.Rotated(m, 0.8).f(WI, WO), m.f_angles(theta_i, phi_i - 0.8, theta_o, phi_o - 0.8), rtol=1e-9
    )
    assert tree.is_oriented(gn.Rotated(m, 0.3))
    assert not tree.is_oriented(gn.Rotated(gn.Lambertian(), 0.3))
    maps = gn.Rotated(m, np.linspace(0.0, 3.0, 200)[:, None]).f(WI, WO)
    assert maps[7, 0] == pytest.approx(gn.Rotated(m, 3.0 * 7 / 199).f(WI[7], WO[7]), rel=1e-9)


# Coats.


def fresnel(theta: float, n: float) -> float:
    """Unpolarized reflectance for light at an angle, from the sine and tangent laws (Born & Wolf, section 1.5.2)."""
    if theta < 1e-9:
        return ((n - 1.0) / (n + 1.0)) ** 2
    inside = math.asin(math.sin(theta) / n)
    s = math.sin(theta - inside) / math.sin(theta + inside)
    p = math.tan(theta - inside) / math.tan(theta + inside)
    return 0.5 * (s * s + p * p)


def internal(n: float, tau: float) -> float:
    """Share of diffuse light inside that the coat reflects, absorption included: the integral over angles inside."""

    def share(theta: float) -> float:
        sine = n * math.sin(theta)
        F = 1.0 if sine >= 1.0 else fresnel(math.asin(sine), n)
        return F * math.exp(-2.0 * tau / max(math.cos(theta), 1e-12)) * math.sin(2.0 * theta)

    edge = math.asin(1.0 / n)
    below, beyond = quad(share, 0.0, edge, epsabs=1e-11)[0], quad(share, edge, PI / 2, epsabs=1e-11)[0]
    return below + beyond


@pytest.mark.parametrize(("eta", "tau"), [(1.5, 0.0), (1.5, 0.01), (1.33, 0.3), (2.4, 0.05), (1.01, 0.1), (3.0, 2.0)])
def test_internal_reflectance(eta, tau):
    R = float(tree.unchecked(_BelowSmooth, eta=eta, tau=tau).R())
    assert pytest.approx(internal(eta, tau), abs=1e-6) == R
    if (eta, tau) == (1.5, 0.0):
        assert pytest.approx(0.5963457598, abs=1e-9) == R  # 1 - (1 - 0.09177795934)/n^2, in closed form


@pytest.mark.parametrize("seed", range(4))
def test_coated_against_angles(seed):
    """Written in angles: Snell, the sine and tangent laws, Lambert and Beer, and Saunderson's series."""
    rng = np.random.default_rng(seed)
    rho, eta, tau = rng.uniform(0.0, 1.0), rng.uniform(1.05, 2.5), rng.choice([0.0, rng.exponential(0.3)])
    R = internal(eta, tau)
    m = gn.Coated(gn.Lambertian(rho), eta, tau)
    lobe = gn.Microfacet(gn.GGX(0.3), 1e-9)
    for wi, wo in zip(WI[:50], WO[:50], strict=True):
        (ti, _), (to, _) = gn.angles(wi), gn.angles(wo)
        inside = [math.asin(math.sin(t) / eta) for t in (ti, to)]
        through = (1.0 - fresnel(ti, eta)) * (1.0 - fresnel(to, eta)) / eta**2
        through *= math.exp(-tau * sum(1.0 / math.cos(t) for t in inside))
        assert m.f(wi, wo) == pytest.approx(through * rho / PI / (1.0 - rho * R), rel=3e-6)
        assert m.replace(internal="lost").f(wi, wo) == pytest.approx(through * rho / PI, rel=1e-9)
        # A dark base: next to nothing goes to and fro.
        turned = (inside[0], gn.angles(wi)[1], inside[1], gn.angles(wo)[1])
        assert gn.Coated(lobe, eta, tau).f(wi, wo) == pytest.approx(through * lobe.f_angles(*turned), rel=1e-8)


@each_base
@pytest.mark.usefixtures("uncompiled")  # large formulas, and few directions
def test_a_coat_of_nothing(base):
    m = gn.Coated(base, 1.0)
    np.testing.assert_allclose(m.f(WI, WO), base.f(WI, WO), rtol=1e-7)  # of R, which is 1e-12 and not 0
    np.testing.assert_allclose(m.delta_reflectance(WO), base.delta_reflectance(WO), rtol=1e-12)
    assert np.abs(gn.RoughCoated(base, 1.0, alpha=0.4).f(WI, WO) - base.f(WI, WO)).max() < 1e-7 * base.f(WI, WO).max()


def test_coated_mirror():
    """All paths between two mirrors: F + (1 - F)^2 k e^2/(1 - k F e^2)."""
    for k, eta, tau in ((1.0, 1.5, 0.0), (0.7, 1.8, 0.2)):
        m = gn.Coated(gn.IdealSpecular(k), eta, tau)
        for theta in (0.0, 0.5, 1.2, 1.5):
            F, e = fresnel(theta, eta), math.exp(-2.0 * tau / math.cos(math.asin(math.sin(theta) / eta)))
            expected = F + (1.0 - F) ** 2 * k * e / (1.0 - k * F * e)
            assert m.delta_reflectance(gn.direction(theta, 0.4)) == pytest.approx(expected, rel=1e-9)
        assert (m.f(WI, WO) == 0.0).all()


INCIDENT = gn.direction(np.radians([0.0, 30.0, 60.0, 75.0, 85.0, 89.0]), 0.3)


@pytest.mark.parametrize("eta", [1.01, 1.33, 1.5, 2.0, 3.0])
def test_white_furnace(eta):
    np.testing.assert_allclose(gn.albedo(gn.Coated(WHITE, eta), INCIDENT, tolerance=1e-6), 1.0, atol=3e-6)
    for alpha in (0.03, 0.4):
        a = gn.albedo(gn.RoughCoated(WHITE, eta, alpha=alpha), INCIDENT, tolerance=1e-4)
        assert a.max() < 1.0 + 5e-4
        assert a.min() > 0.72
    a = gn.albedo(gn.RoughCoated(WHITE, 1.5, alpha=0.1), INCIDENT)
    np.testing.assert_allclose(a[[0, 2]], [0.9995, 0.993], atol=1e-3)


def test_energy_of_coats():
    """Not above 1 for anything that keeps to it itself, whatever its `estimate` says."""
    rng = np.random.default_rng(5)
    for _ in range(8):
        alpha = float(rng.uniform(0.02, 1.0))
        base = [
            gn.Microfacet(gn.GGX(alpha, float(rng.uniform(0.1, 1.0)))),
            gn.Microfacet(gn.Beckmann(alpha), gn.Conductor(0.2, 3.9)),
            gn.ModifiedPhong(1.0, float(rng.uniform(0.0, 50.0))),
            0.4 * WHITE + 0.6 * gn.Microfacet(gn.GGX(alpha)),
            0.5 * WHITE + 0.5 * gn.IdealSpecular(),
        ][rng.integers(5)]
        eta = float(rng.uniform(1.0, 3.0))
        for m in (gn.Coated(base, eta), gn.RoughCoated(base, eta, alpha=float(rng.uniform(0.01, 1.0)))):
            assert gn.albedo(m, INCIDENT, tolerance=1e-3).max() < 1.001, m


def test_rough_transmittance():
    """The nodes of RoughCoated's F, against the mean of F over sampled visible facets."""
    u = (np.stack(np.meshgrid(*[(np.arange(256) + 0.5) / 256] * 2), -1).reshape(-1, 2)).T
    for alpha in (0.02, 0.1, 0.4, 1.0):
        for eta in (1.1, 1.5, 2.5):
            for theta in (0.0, 0.8, 1.3, 1.55):
                w = Direction(math.sin(theta), 0.0, math.cos(theta))
                n = gn.GGX(alpha).warp_normal(w, *u)
                mean = np.mean(fresnel_dielectric(np.minimum(w.x * n.x + w.z * n.z, 1.0), eta))
                T = tree.unchecked(gn.RoughCoated, eta=eta, alpha=alpha).T(w)
                assert pytest.approx(1.0 - mean, abs=8e-3) == T


def test_mitsuba_plastic():
    """A smooth coat on a Lambertian base is Mitsuba's `plastic`, with its own polynomial for R in place of ours."""
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    for eta, rho, nonlinear in ((1.5, 0.6, True), (1.3, 0.9, True), (1.8, 0.4, False)):
        colour = {"type": "rgb", "value": [rho, rho, rho]}
        index = {"int_ior": eta, "ext_ior": 1.0, "nonlinear": nonlinear}
        theirs = mitsuba.load_dict({"type": "plastic", "diffuse_reflectance": colour, **index})
        R = mitsuba.fresnel_diffuse_reflectance(1.0 / eta)
        assert internal(eta, 0.0) == pytest.approx(R, rel=2e-3)
        ours = gn.Coated(gn.Lambertian(rho), eta, internal="lost")
        exact = gn.Coated(gn.Lambertian(rho), eta)
        for wi, wo in zip(WI[:100], WO[:100], strict=True):
            si = mitsuba.SurfaceInteraction3f()
            si.wi = mitsuba.Vector3f(*map(float, wo))
            value = theirs.eval(mitsuba.BSDFContext(), si, mitsuba.Vector3f(*map(float, wi)))[0] / wi[2]
            assert value == pytest.approx(ours.f(wi, wo) / (1.0 - R * (rho if nonlinear else 1.0)), rel=3e-6)
            if nonlinear:
                assert value == pytest.approx(exact.f(wi, wo), rel=3e-3)


# Tilted normals.


def walk(of: gn.Reflectance, nx: float, ny: float, wi: np.ndarray, wo: np.ndarray) -> float:
    """f by the walk among facets of Schüssler et al. 2017: probability of the facet hit, times BRDF, times escape.

    Facets p (normal wp) and t (upright mirrors, normal wt); lambda is the probability of hitting each, G1 that of
    escaping. Paths i -> p -> o, i -> p -> t -> o, i -> t -> p -> o.
    """
    up = np.array([0.0, 0.0, 1.0])
    wp = np.array([nx, ny, math.sqrt(1.0 - nx * nx - ny * ny)])
    tilt = math.acos(wp[2])
    wt = -np.array([nx, ny, 0.0]) / math.hypot(nx, ny)
    axis = np.cross(up, wp) / math.sin(tilt)

    def inside(w: np.ndarray) -> np.ndarray:
        """w turned by -tilt about the axis across the tilt (Rodrigues): wp becomes z."""
        c, s = math.cos(tilt), -math.sin(tilt)
        return w * c + np.cross(axis, w) * s + axis * (axis @ w) * (1.0 - c)

    def plus(x: float) -> float:
        return max(x, 0.0)

    def area(w: np.ndarray) -> float:
        return plus(w @ wp) / math.cos(tilt) + plus(w @ wt) * math.tan(tilt)

    def lambda_p(w: np.ndarray) -> float:
        return plus(w @ wp) / math.cos(tilt) / area(w)

    def G1(w: np.ndarray) -> float:
        return min(1.0, plus(w @ up) / area(w))

    def f_cos(i: np.ndarray, o: np.ndarray) -> float:
        return of.f(inside(i), inside(o)) * plus(o @ wp)

    def bounced(w: np.ndarray) -> np.ndarray:
        return w - 2.0 * (w @ wt) * wt

    total = lambda_p(wi) * f_cos(wi, wo) * G1(wo)
    if wo @ wt > 0.0:
        total += lambda_p(wi) * f_cos(wi, bounced(wo)) * (1.0 - G1(bounced(wo))) * G1(wo)
    if wi @ wt > 0.0:
        total += (1.0 - lambda_p(wi)) * f_cos(bounced(wi), wo) * G1(wo)
    return total / (wo @ up)


@pytest.mark.parametrize("of", [gn.Lambertian(0.8), gn.ModifiedPhong(0.9, 8.0)], ids=lambda m: type(m).__name__)
def test_normal_mapped_against_the_walk(of):
    for nx, ny in ((0.3, -0.4), (-0.6, 0.1), (0.02, 0.0), (0.0, 0.69)):
        m = gn.NormalMapped(of, nx, ny)
        f = m.f(WI, WO)
        for i in range(0, 200, 2):
            assert f[i] == pytest.approx(walk(of, nx, ny, WI[i], WO[i]), rel=1e-9, abs=1e-12)


def test_normal_mapped_energy():
    """A mirror's light all returns where no facet is met twice; white facets lose what meets them twice."""
    for nx, ny in ((0.34, 0.0), (0.2, -0.5), (0.7, 0.7)):
        assert gn.albedo(gn.NormalMapped(WHITE, nx, ny), INCIDENT, tolerance=1e-3).max() < 1.001
        mirror = gn.NormalMapped(gn.IdealSpecular(), nx, ny)
        assert gn.albedo(mirror, INCIDENT).max() < 1.0 + 1e-12
        s = mirror.sample(WO, np.random.default_rng(1).random((200, 2)))
        assert s.delta.any()
        assert (s.wi[s.delta, 2] > 0.0).all()
    for n in (0.342, 0.643):  # at normal incidence f = n'_z/pi for all wo
        a = gn.albedo(gn.NormalMapped(WHITE, n), INCIDENT[0])
        assert a == pytest.approx(math.sqrt(1.0 - n * n), abs=2e-4)


def test_normal_mapped_mirror_as_the_limit():
    """A delta lobe reflects what a narrow lobe in its place does."""
    narrow = gn.NormalMapped(gn.Microfacet(gn.GGX(0.003)), 0.3, -0.2)
    mirror = gn.NormalMapped(gn.IdealSpecular(), 0.3, -0.2)
    w = gn.direction(np.radians([0.0, 20.0, 35.0]), np.array([0.3, 1.0, 2.0]))
    a = gn.albedo(narrow, w, tolerance=1e-3)
    np.testing.assert_allclose(a, gn.albedo(mirror, w), atol=5e-3)


def test_shading_normal():
    n = np.array([0.3, -0.4, math.sqrt(0.75)])
    f = gn.ShadingNormal(gn.Lambertian(0.8), 0.3, -0.4).f(WI, WO)
    lit = (WI @ n > 0.0) & (WO @ n > 0.0)
    np.testing.assert_allclose(f, np.where(lit, 0.8 / PI * (WI @ n) / WI[:, 2], 0.0), rtol=1e-12)
    assert 0.05 < (~lit).mean() < 0.95
    mirror = gn.ShadingNormal(gn.IdealSpecular(0.7), 0.3, -0.4)
    s = mirror.sample(WO, np.full((200, 2), 0.5))
    reflected = 2.0 * (WO @ n)[:, None] * n - WO
    up = (WO @ n > 0.0) & (reflected[:, 2] > 0.0)
    np.testing.assert_allclose(s.wi[up], reflected[up], atol=1e-12)
    np.testing.assert_allclose(s.weight, np.where(up, 0.7, 0.0), rtol=1e-12)


@pytest.mark.parametrize("kind", [gn.ShadingNormal, gn.NormalMapped])
@each_base
def test_no_tilt(kind, base):
    m = kind(base)
    np.testing.assert_allclose(m.f(WI, WO), base.f(WI, WO), rtol=1e-9)
    np.testing.assert_allclose(m.delta_reflectance(WO), base.delta_reflectance(WO), rtol=1e-12)


def test_a_tilted_mirror_under_lights():
    """Radiance by the mirror direction that the tilted normal has: the reflection equation follows delta lobes."""
    n = np.array([0.3, -0.2, math.sqrt(0.87)])
    sky = gn.FunctionLight(lambda w: 1.0 + w[..., :1] + 2.0 * w[..., 1:2] ** 2)
    wo = gn.direction(np.array([0.1, 0.5]), np.array([0.3, -1.0]))
    wi = 2.0 * (wo @ n)[:, None] * n - wo
    expected = 0.7 * (1.0 + wi[:, 0] + 2.0 * wi[:, 1] ** 2)
    L = gn.reflected_radiance(gn.ShadingNormal(gn.IdealSpecular(0.7), 0.3, -0.2), sky, wo)
    np.testing.assert_allclose(np.ravel(L), expected, rtol=1e-12)


# Tables.

PAINT = gn.Lambertian([0.2, 0.4, 0.6]) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))
BRUSHED = gn.Microfacet(gn.GGX(0.5, 0.9), 0.8)
SMALL = {
    ("half_difference", False): (20, 12, 12),
    ("angles", False): (12, 12, 20),
    ("half_difference", True): (10, 7, 8, 8),
    ("angles", True): (7, 7, 8, 8),
}


@pytest.mark.parametrize(("parameterization", "four"), thinned(SMALL, [("half_difference", False), ("angles", True)]))
def test_tables(parameterization, four):
    m = BRUSHED if four else PAINT
    size = SMALL[parameterization, four]
    small, large = (gn.tables.tabulate(m, parameterization, tuple(k * n for n in size)) for k in (1, 2))
    assert large.error.mean < 0.5 * small.error.mean < 0.15
    assert large.error.albedo < 0.05
    f, true = large.f(WI, WO), m.f(WI, WO)
    assert f.shape == true.shape
    np.testing.assert_allclose(small.f(WO, WI), small.f(WI, WO), rtol=1e-9)
    assert f.min() >= 0.0
    assert small.is_isotropic() == (not four)
    assert pickle.loads(pickle.dumps(small)) == small
    u = np.random.default_rng(1).random((200, 2))
    s = small.sample(WO, u)
    used = s.pdf > 0.0
    np.testing.assert_allclose(s.pdf[used], small.pdf(s.wi, WO)[used], rtol=1e-8)


@pytest.mark.parametrize("parameterization", ["angles", pytest.param("half_difference", marks=pytest.mark.full)])
def test_tables_keep_the_laws(parameterization):
    report = gn.check(gn.tables.tabulate(PAINT, parameterization, SMALL[parameterization, False]))
    assert {law.name for law in report.laws if not law.passed} <= {"energy", "furnace"}, report


def test_a_table_at_its_nodes():
    """Exact at nodes, and for whatever is linear between them."""
    m = gn.tables.tabulate(PAINT, "angles", (10, 10, 12))
    theta, phi = np.radians([[0.0], [20.0], [70.0]]), np.radians([[0.0, 30.0, 90.0, 330.0, 180.0]])
    np.testing.assert_allclose(
        m.f_angles(theta, 0.4, 0.9 * 0.0 + np.radians(40.0), phi + 0.4),
        PAINT.f_angles(theta, 0.4, np.radians(40.0), phi + 0.4),
        rtol=1e-9,
    )
    flat = gn.tables.tabulate(gn.Lambertian([0.1, 0.9]), resolution=(4, 3, 2), channels=[1])
    np.testing.assert_allclose(flat.f(WI, WO), 0.9 / PI, rtol=1e-12)
    assert flat.error.largest < 1e-12
    assert flat.channel_names == ("1",)
    assert gn.tables.tabulate(gn.Lambertian(0.5), resolution=(4, 3, 2)).f(WI, WO).shape == (200,)


def test_a_table_of_channels_without_names_is_a_measurement_like_any_other():
    m = gn.tables.tabulate(gn.Lambertian([0.5, 0.3, 0.1]), resolution=(4, 3, 2))
    assert m.channel_names == ("R", "G", "B")
    np.testing.assert_array_equal(gn.tables.from_dataset(gn.tables.to_dataset(m)).stored, m.stored)
    np.testing.assert_array_equal(gn.repair.remove_negatives(m).stored, m.stored)


def test_tables_without_reciprocity():
    m = gn.ShadingNormal(gn.Lambertian(0.5), 0.2)
    k = gn.tables.tabulate(m, resolution=(16, 12, 12, 16))
    assert k.periods["phi_d"] == pytest.approx(2.0 * PI)
    assert "reciprocity" in breaches(k)
    up = (WI[:, 2] > 0.5) & (WO[:, 2] > 0.5)
    np.testing.assert_allclose(k.f(WI[up], WO[up]), m.f(WI[up], WO[up]), rtol=0.1)


def test_tables_of_measurements_have_no_holes():
    raw = np.full((3, 90, 90, 180), 20.0)
    raw[:, 30:40, 30:40] = -1.0
    k = gn.tables.tabulate(merl.MERL(raw), resolution=(20, 12, 12))
    np.testing.assert_allclose(k.f(WI, WO), 20.0 * np.array(merl.SCALE) * np.ones((200, 1)), rtol=1e-9)


def test_tables_on_every_library(library):
    m = gn.tables.tabulate(PAINT, resolution=(10, 6, 6))
    found = library.numpy(m.f(library.array(WI), library.array(WO)))
    np.testing.assert_allclose(found, m.f(WI, WO), rtol=1e-9)
    np.testing.assert_allclose(library.numpy(m.pdf(library.array(WI), library.array(WO))), m.pdf(WI, WO), rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gn.tables.tabulate(gn.IdealSpecular()), "perfect mirror"),
        (lambda: gn.tables.tabulate(gn.Lambertian(np.full((2, 2, 1), 0.5))), "maps"),
        (lambda: gn.tables.tabulate(PAINT, "spherical"), "half_difference"),
        (lambda: gn.tables.tabulate(PAINT, resolution=(3, 4)), "3 whole numbers"),
        (lambda: gn.tables.tabulate(PAINT, "angles", (3, 4, 5)), "reciprocity"),
        (lambda: gn.tables.tabulate(PAINT, channels=[3]), "from 0 to 2"),
        (lambda: gn.Coated(0.5), "expected a Reflectance"),
        (lambda: gn.Rotated(WHITE, 7.0), "out of bounds"),
    ],
)
def test_what_bad_input_says(make, words):
    with pytest.raises(ParameterError, match=words):
        make()


# Normal maps.


def codes(x: float, y: float) -> np.ndarray:
    return np.full((2, 2, 3), 0.5 * (np.array([x, y, math.sqrt(1.0 - x * x - y * y)]) + 1.0))


def test_the_directions_of_a_normal_map(tmp_path):
    x, y = gn.normal_map(codes(0.3, -0.2))
    np.testing.assert_allclose([x.texels[0, 0, 0], y.texels[0, 0, 0]], [0.3, -0.2])
    _, down = gn.normal_map(codes(0.3, -0.2), green="down")
    np.testing.assert_allclose(down.texels, 0.2)
    x, y = gn.normal_map(codes(0.6, 0.0), strength=0.5)
    assert x.texels[0, 0, 0] == pytest.approx(math.sin(math.atan(0.5 * 0.75)))
    flat, _ = gn.normal_map(codes(0.6, 0.0), strength=0.0)
    assert not flat.texels.any()
    from PIL import Image

    Image.fromarray(np.round(255.0 * codes(0.3, -0.2)).astype(np.uint8)).save(tmp_path / "normals.png")
    x, y = gn.normal_map(tmp_path / "normals.png")  # codes as they are, not decoded as colours
    np.testing.assert_allclose([x.texels[0, 0, 0], y.texels[0, 0, 0]], [0.3, -0.2], atol=0.005)


def test_bad_normal_maps():
    for image, words in (
        (codes(0.8, 0.1), r"a component of 0\.8; expected components up to 0\.7; strength=0\.7\d+ makes them so"),
        (np.full((2, 2, 3), 0.4), "points into the surface; expected blue above 0.5 everywhere"),
        (np.full((2, 2, 3), -0.4), r"out of bounds; expected codes from 0 to 1; of components .* \(x \+ 1\) / 2"),
    ):
        with pytest.raises(ParameterError, match=words), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a hint: the error is tested
            gn.normal_map(image)
    with pytest.raises(gn.errors.ShapeError, match="1 channels, expected 3"):
        gn.normal_map(np.full((2, 2), 0.5))
    with pytest.warns(gn.errors.MeaningWarning, match="is this a normal map"):
        gn.normal_map(np.full((2, 2, 3), 0.6))
    for how in ({"green": "left"}, {"strength": -1.0}, {"strength": float("nan")}):
        with pytest.raises(ParameterError, match="expected"):
            gn.normal_map(codes(0.1, 0.1), **how)


def test_the_strength_that_is_advised_is_enough():
    image = np.stack([codes(0.85, 0.1)[0], codes(0.2, -0.9)[0]])
    with pytest.raises(ParameterError, match="strength=") as caught:
        gn.normal_map(image)
    advised = float(str(caught.value).partition("strength=")[2].split()[0])
    x, y = gn.normal_map(image, strength=advised)
    assert 0.69 < max(np.abs(x.texels).max(), np.abs(y.texels).max()) <= 0.7
