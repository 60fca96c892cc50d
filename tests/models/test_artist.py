"""Artists' models against scalar implementations of their own, integrals, closed forms, and Mitsuba 3."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.formula.direction import Direction
from gonio.integrals.over_hemisphere import integrate
from gonio.models._ggx_albedo import lost, lost_on_average, schlick_share, schlick_share_on_average

PI = math.pi


def some_pairs(count: int = 200, seed: int = 0, least: float = 0.02) -> list[tuple[np.ndarray, np.ndarray]]:
    """Random pairs of directions, every third near the mirror pair, every third near back-scatter."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        wi, wo = gn.direction(np.arccos(rng.uniform(least, 1.0, 2)), rng.uniform(-PI, PI, 2))
        if len(found) % 3:
            wo = wi * ([-1.0, -1.0, 1.0] if len(found) % 3 == 1 else [1.0, 1.0, 1.0]) + 0.1 * rng.normal(size=3)
            wo = wo / np.linalg.norm(wo)
        if wo[2] > least:
            found.append((wi, wo))
    return found


def angles_of(wi: np.ndarray, wo: np.ndarray) -> tuple[float, float, float, float, float]:
    """theta_i, theta_o, theta_h, theta_d, and phi_h [rad]."""
    h = (wi + wo) / np.linalg.norm(wi + wo)
    theta = [math.acos(min(1.0, float(x))) for x in (wi[2], wo[2], h[2])]
    return (*theta, math.atan2(np.linalg.norm(wi - wo), np.linalg.norm(wi + wo)), math.atan2(h[1], h[0]))


def ggx_D(theta: float, alpha: float) -> float:
    """Walter et al. 2007, eq. 33."""
    return alpha**2 / (PI * math.cos(theta) ** 4 * (alpha**2 + math.tan(theta) ** 2) ** 2)


def ggx_lambda(theta: float, alpha: float) -> float:
    return 0.5 * (math.sqrt(1.0 + (alpha * math.tan(theta)) ** 2) - 1.0)


def ggx_f(wi: np.ndarray, wo: np.ndarray, alpha: float, F: Any) -> float:
    """GGX with the height-correlated masking; F takes the difference angle."""
    ti, to, th, td, _ = angles_of(wi, wo)
    G = 1.0 / (1.0 + ggx_lambda(ti, alpha) + ggx_lambda(to, alpha))
    return ggx_D(th, alpha) * F(td) * G / (4.0 * math.cos(ti) * math.cos(to))


def held(m: gn.Reflectance, scalar: Any, relative: float = 1e-9, count: int = 200) -> None:
    for wi, wo in some_pairs(count):
        assert m.f(wi, wo) == pytest.approx(scalar(wi, wo), rel=relative, abs=1e-12)


# How much a first reflection loses.


class Slopes:
    """Integrals over the facets seen by one direction, in r = tan(theta_m)/alpha and its azimuth."""

    def __init__(self) -> None:
        x, w = np.polynomial.legendre.leggauss(5)
        edges = np.concatenate([[0.0], np.geomspace(1e-6, 0.3, 40), np.linspace(0.3, 1.0, 17)[1:]])
        half, middle = 0.5 * np.diff(edges)[:, None], 0.5 * (edges[1:] + edges[:-1])[:, None]
        c = (middle + half * x).ravel()  # 1/sqrt(1 + r^2): r dr/(1 + r^2)^2 = c dc
        x, v = np.polynomial.legendre.leggauss(120)
        self.r = (np.sqrt(1.0 - c * c) / c)[:, None]
        self.cos_phi = np.cos(0.5 * PI * (x + 1.0))
        self.weight = (c * (half * w).ravel())[:, None] * v

    def over(self, mu: float, alpha: float, value: Any) -> float:
        """Mean of value(cos, G2/G1) over the visible facets."""
        toward = np.maximum(mu + math.sqrt(1.0 - mu * mu) * alpha * self.r * self.cos_phi, 0.0)  # wo . wm/cos(theta_m)
        cos = np.minimum(toward / np.sqrt(1.0 + (alpha * self.r) ** 2), 1.0)
        out = 2.0 * cos / np.sqrt(1.0 + (alpha * self.r) ** 2) - mu
        up = out > 0.0
        z = np.where(up, np.minimum(out, 1.0), 1.0)
        own = 0.5 * math.sqrt(1.0 + alpha**2 * (1.0 / mu**2 - 1.0)) + 0.5
        other = 0.5 * np.sqrt(1.0 + alpha**2 * (1.0 / z**2 - 1.0)) - 0.5
        seen = np.where(up, own / (own + other), 0.0)
        return float((self.weight * toward * value(cos, seen)).sum() / (mu * own))


SLOPES = Slopes()
ALPHAS = [1e-3, 0.004, 0.02, 0.06, 0.13, 0.3, 0.55, 0.8, 1.0]
COSINES = [1e-5, 3e-4, 0.002, 0.011, 0.05, 0.12, 0.3, 0.6, 0.9, 1.0]


@pytest.mark.parametrize("alpha", ALPHAS)
def test_what_a_first_reflection_loses(alpha):
    """The fits, against integrals of 2e4 nodes: 1 - E and B to 5e-4."""
    for mu in COSINES:
        assert SLOPES.over(mu, alpha, lambda cos, seen: 1.0) == pytest.approx(1.0, abs=2e-4)
        gone = SLOPES.over(mu, alpha, lambda cos, seen: 1.0 - seen)
        assert lost(mu, alpha) == pytest.approx(gone, abs=5.5e-4)
        assert lost(mu, alpha) > 0.0
        schlick = SLOPES.over(mu, alpha, lambda cos, seen: seen * (1.0 - cos) ** 5)
        assert schlick_share(mu, alpha) == pytest.approx(schlick, abs=7e-4)


@pytest.mark.parametrize("mu", COSINES)
def test_loss_in_closed_form(mu):
    """alpha = 1: 1 - E = mu ln((1 + mu)/mu) and E_avg = 4/3 (1 - ln 2)."""
    assert lost(mu, 1.0) == pytest.approx(mu * math.log((1.0 + mu) / mu), abs=5e-4)
    assert lost_on_average(1.0) == pytest.approx(1.0 - 4.0 / 3.0 * (1.0 - math.log(2.0)), abs=2e-4)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_average_loss_is_that_of_the_fit(alpha):
    x, w = np.polynomial.legendre.leggauss(200)
    u = 0.5 * (x + 1.0) * math.asinh(1.0 / alpha)
    mu = alpha * np.sinh(u)  # dense at the cosines where the loss is
    jacobian = 0.5 * w * math.asinh(1.0 / alpha) * alpha * np.cosh(u)
    assert lost_on_average(alpha) == pytest.approx((jacobian * 2.0 * mu * lost(mu, alpha)).sum(), rel=2e-4)


# Compensation.

VIEWS = gn.direction(np.radians([0.0, 30.0, 60.0, 80.0, 88.0, 89.9]), 0.3)


@pytest.mark.parametrize("alpha", thinned([1e-3, 0.01, 0.1, 0.3, 0.6, 1.0], [0.01, 0.1, 1.0]))
def test_white_furnace(alpha):
    """F = 1: what light from anywhere becomes (Kulla and Conty), and what viewers anywhere see (all three), is 1."""
    assert gn.albedo(gn.KullaConty(alpha), VIEWS, tolerance=1e-4) == pytest.approx(1.0, abs=7e-4)
    if alpha > 0.04:
        for m in (gn.Turquin(alpha), gn.FdezAguera(alpha, 1.0)):
            assert integrate(m, VIEWS, 1e-4, incident=False).value == pytest.approx(1.0, abs=1e-3)


def test_furnace_of_a_metal():
    """KullaConty's albedo averaged over diffuse light is that of its two terms: E_F,avg + F_ms (1 - E_avg)."""
    F, alpha = 0.6, 0.8
    x, w = np.polynomial.legendre.leggauss(8)
    mu, w = 0.5 * (x + 1.0), 0.5 * w
    mean = (2.0 * mu * w) @ gn.albedo(gn.KullaConty(alpha, F), gn.direction(np.arccos(mu), 0.0))
    gone = float((2.0 * mu * w) @ [SLOPES.over(m, alpha, lambda cos, seen: 1.0 - seen) for m in mu])
    # Bounce by bounce: each reflects F, and 1 - gone of that escapes.
    left, expected = 1.0, 0.0
    for _ in range(60):
        left *= F
        expected, left = expected + left * (1.0 - gone), left * gone
    assert mean == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(("alpha", "F0"), thinned([(0.1, 0.3), (0.4, 0.9), (1.0, 0.05)], [(0.4, 0.9)]))
def test_compensation_against_plain_python(alpha, F0):
    def E(theta: float) -> float:
        return 1.0 - float(lost(math.cos(theta), alpha))

    def F(theta: float) -> float:
        return F0 + (1.0 - F0) * (1.0 - math.cos(theta)) ** 5

    average, escaping = F0 + (1.0 - F0) / 21.0, 1.0 - float(lost_on_average(alpha))

    def kulla_conty(wi: np.ndarray, wo: np.ndarray) -> float:
        ti, to, *_ = angles_of(wi, wo)
        lobe = (1.0 - E(ti)) * (1.0 - E(to)) / (PI * (1.0 - escaping))
        return ggx_f(wi, wo, alpha, F) + average**2 * escaping / (1.0 - average * (1.0 - escaping)) * lobe

    def turquin(wi: np.ndarray, wo: np.ndarray) -> float:
        e = E(angles_of(wi, wo)[1])
        return ggx_f(wi, wo, alpha, F) * (1.0 + F0 * (1.0 - e) / e)

    def fdez_aguera(wi: np.ndarray, wo: np.ndarray) -> float:
        to = angles_of(wi, wo)[1]
        B = float(schlick_share(math.cos(to), alpha))
        once, gone = F0 * (E(to) - B) + B, 1.0 - E(to)
        return ggx_f(wi, wo, alpha, F) + once * average / (1.0 - average * gone) * gone / PI

    held(gn.KullaConty(alpha, gn.Schlick(F0)), kulla_conty)
    held(gn.Turquin(alpha, gn.Schlick(F0)), turquin)
    held(gn.FdezAguera(alpha, F0), fdez_aguera)


# Fresnel: F82.


def test_f82_goes_through_its_three_points():
    for F0, tint in ((0.9, 0.8), (0.3, 1.0), (0.5, 0.2), (1.0, 0.0)):
        F = gn.F82Tint(F0, tint).F
        assert F(1.0) == pytest.approx(F0)
        assert F(0.0) == pytest.approx(1.0)
        assert F(1.0 / 7.0) == pytest.approx(tint * gn.Schlick(F0).F(1.0 / 7.0))
    cos = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(gn.F82Tint(0.4, 1.0).F(cos), gn.Schlick(0.4).F(cos), rtol=1e-14)
    assert gn.F82Tint(0.0, 0.0).F(cos).min() == 0.0


def test_f82_as_written():
    """F_S(mu) - mu (1 - mu)^6/(m (1 - m)^6) (1 - tint) F_S(m), m = 1/7 (OpenPBR's specification, on metal)."""
    F0, tint, m = 0.8, 0.7, 1.0 / 7.0
    for mu in np.linspace(0.0, 1.0, 30):
        schlick, edge = (F0 + (1.0 - F0) * (1.0 - x) ** 5 for x in (mu, m))
        expected = schlick - mu * (1.0 - mu) ** 6 / (m * (1.0 - m) ** 6) * (edge - tint * edge)
        assert gn.F82Tint(F0, tint).F(mu) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("eta", "k", "error"), [(1.37, 7.62, 0.0185), (0.18, 3.43, 0.0061)])
def test_f82_of_metals(eta, k, error):
    """What the docstring says of aluminium and gold."""
    exact, cos = gn.Conductor(eta, k).F, np.linspace(0.0, 1.0, 1001)
    F0 = float(exact(1.0))
    tint = float(exact(1.0 / 7.0) / gn.Schlick(F0).F(1.0 / 7.0))
    assert np.abs(gn.F82Tint(F0, tint).F(cos) - exact(cos)).max() == pytest.approx(error, abs=5e-4)


# Sheen.


@pytest.mark.parametrize("r", [0.1, 0.37, 1.0])
def test_charlie_against_plain_python(r):
    zero = (25.3245, 3.32435, 0.16801, -1.27393, -4.85967)
    one = (21.5473, 3.82987, 0.19823, -1.97760, -4.32054)
    a, b, c, d, e = ((1.0 - r) ** 2 * x + (1.0 - (1.0 - r) ** 2) * y for x, y in zip(zero, one, strict=True))

    def L(x: float) -> float:
        return a / (1.0 + b * x**c) + d * x + e

    def masking(theta: float) -> float:
        z = math.cos(theta)
        return math.exp(L(z)) if z < 0.5 else math.exp(2.0 * L(0.5) - L(1.0 - z))

    def charlie(wi: np.ndarray, wo: np.ndarray) -> float:
        ti, to, th, *_ = angles_of(wi, wo)
        D = (2.0 + 1.0 / r) * math.sin(th) ** (1.0 / r) / (2.0 * PI)
        return 0.7 * D / (4.0 * math.cos(ti) * math.cos(to) * (1.0 + masking(ti) + masking(to)))

    held(gn.CharlieSheen(0.7, r), charlie, 1e-7)


@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_velvet_against_plain_python(alpha):
    def velvet(wi: np.ndarray, wo: np.ndarray) -> float:
        ti, to, th, *_ = angles_of(wi, wo)
        bell = 4.0 * math.exp(-1.0 / (math.tan(th) * alpha) ** 2) / math.sin(th) ** 4 if th > 1e-3 else 0.0
        D = (1.0 + bell) / (PI * (1.0 + 4.0 * alpha**2))
        return 0.7 * D / (4.0 * (math.cos(ti) + math.cos(to) - math.cos(ti) * math.cos(to)))

    held(gn.AshikhminVelvet(0.7, alpha), velvet)


def test_sheen_normals_are_normalized():
    """Integral of D cos(theta_m) = 1 for both; D from f at normal incidence, of a light at 2 theta_m."""
    x, w = np.polynomial.legendre.leggauss(400)
    t, w = 0.25 * PI * (x + 1.0), 0.25 * PI * w
    for r in (0.1, 0.5, 1.0):
        D = (2.0 + 1.0 / r) / (2.0 * PI) * np.sin(t) ** (1.0 / r)
        assert (2.0 * PI * w * np.sin(t) * np.cos(t)) @ D == pytest.approx(1.0, abs=1e-6)
    for alpha in (0.1, 0.5, 1.0):
        D = (1.0 + 4.0 * np.exp(-1.0 / (np.tan(t) * alpha) ** 2) / np.sin(t) ** 4) / (PI * (1.0 + 4.0 * alpha**2))
        assert (2.0 * PI * w * np.sin(t) * np.cos(t)) @ D == pytest.approx(1.0, abs=1e-6)


# Retro-reflection.


def test_retro_is_the_mirrored_microfacet():
    facets, metal = gn.GGX(0.1, 0.4), gn.Conductor(0.2, 3.9)
    for masking in ("height_correlated", "separable", "v_groove"):
        m, r = gn.Microfacet(facets, metal, masking), gn.RetroMicrofacet(facets, metal, masking)
        for wi, wo in some_pairs(40):
            assert r.f(wi, wo) == pytest.approx(m.f(wi, wo * [-1.0, -1.0, 1.0]), rel=1e-12)
        w = gn.direction(1.0, 0.4)
        assert gn.albedo(r, w) == pytest.approx(gn.albedo(m, w), abs=1e-4)


def test_retro_returns_light_to_its_source():
    """As Portsmouth et al. write it: D(h) F G/(4 cos cos), h between the light and the mirrored viewer."""
    alpha, k = 0.2, 0.8

    def retro(wi: np.ndarray, wo: np.ndarray) -> float:
        return ggx_f(wi, np.array([-wo[0], -wo[1], wo[2]]), alpha, lambda _: k)

    held(gn.RetroMicrofacet(gn.GGX(alpha), k), retro)
    view = gn.direction(0.9, 0.3)
    around = gn.direction(np.array([0.9, 0.9, 0.7]), np.array([0.3, 0.3 + PI, 0.3]))
    f = gn.RetroMicrofacet(gn.GGX(0.1)).f(around, view)
    assert f[0] > 4.0 * f[2] > 40.0 * f[1]


# Disney's model.


def disney(p: dict[str, float], masking: str, wi: np.ndarray, wo: np.ndarray) -> float:
    """Burley 2012 in angles, term by term."""
    ti, to, th, td, ph = angles_of(wi, wo)

    def fall(theta: float) -> float:
        return (1.0 - math.cos(theta)) ** 5

    def mix(a: float, b: float, t: float) -> float:
        return a * (1.0 - t) + b * t

    def smith(theta: float, alpha: float) -> float:
        return 2.0 / (1.0 + math.sqrt(1.0 + (alpha * math.tan(theta)) ** 2))

    rough = p["roughness"]
    F_D90 = 0.5 + 2.0 * math.cos(td) ** 2 * rough
    diffuse = mix(1.0, F_D90, fall(ti)) * mix(1.0, F_D90, fall(to))
    F_SS90 = math.cos(td) ** 2 * rough
    flat = mix(1.0, F_SS90, fall(ti)) * mix(1.0, F_SS90, fall(to))
    flat = 1.25 * (flat * (1.0 / (math.cos(ti) + math.cos(to)) - 0.5) + 0.5)
    base = p["base_color"] / PI * mix(diffuse, flat, p["subsurface"])
    sheen = p["sheen"] * mix(1.0, p["tint"], p["sheen_tint"]) * fall(td)

    aspect = math.sqrt(1.0 - 0.9 * p["anisotropic"])
    ax, ay = max(1e-3, rough**2 / aspect), max(1e-3, rough**2 * aspect)
    slope2 = math.tan(th) ** 2 * ((math.cos(ph) / ax) ** 2 + (math.sin(ph) / ay) ** 2)
    D = 1.0 / (PI * ax * ay * math.cos(th) ** 4 * (1.0 + slope2) ** 2)
    F0 = mix(0.08 * p["specular"] * mix(1.0, p["tint"], p["specular_tint"]), p["base_color"], p["metallic"])
    G = 1.0
    for w, theta in ((wi, ti), (wo, to)):
        phi = math.atan2(w[1], w[0])
        seen = math.hypot(ax * math.cos(phi), ay * math.sin(phi))
        G *= smith(theta, seen if masking == "anisotropic" else (0.5 + rough / 2.0) ** 2)
    cosines = 4.0 * math.cos(ti) * math.cos(to)
    mirrors = D * mix(F0, 1.0, fall(td)) * G / cosines

    a = mix(0.1, 0.001, p["clearcoat_gloss"])
    D_r = (a * a - 1.0) / (PI * math.log(a * a) * (1.0 + (a * a - 1.0) * math.cos(th) ** 2))
    coat = 0.25 * p["clearcoat"] * D_r * mix(0.04, 1.0, fall(td)) * smith(ti, 0.25) * smith(to, 0.25) / cosines
    return (1.0 - p["metallic"]) * (base + sheen) + mirrors + coat


@pytest.mark.parametrize("masking", ["remapped", "anisotropic"])
@pytest.mark.parametrize("seed", range(5))
def test_disney_against_plain_python(masking, seed):
    rng = np.random.default_rng(seed)
    p = {name: float(rng.random()) for name in gn.DisneyPrincipled.fields if name != "masking"}
    p["tint"] = 3.0 * rng.random()
    p["roughness"] = max(p["roughness"], 0.1)
    held(gn.DisneyPrincipled(masking=masking, **p), lambda wi, wo: disney(p, masking, wi, wo), 1e-8, 60)


def test_disney_limits():
    wi, wo = (np.array(w) for w in zip(*some_pairs(60), strict=True))
    metal = gn.DisneyPrincipled(0.7, metallic=1.0, roughness=0.4, masking="anisotropic")
    facets = gn.Microfacet(gn.GGX(0.16), gn.Schlick(0.7), masking="separable")
    np.testing.assert_allclose(metal.f(wi, wo), facets.f(wi, wo), rtol=1e-10)
    coated, bare = (gn.DisneyPrincipled(0.7, clearcoat=c, clearcoat_gloss=0.3) for c in (0.5, 0.0))
    assert (coated.f(wi, wo) > bare.f(wi, wo)).all()
    twice = coated.replace(clearcoat=1.0).f(wi, wo) - bare.f(wi, wo)
    np.testing.assert_allclose(twice, 2.0 * (coated.f(wi, wo) - bare.f(wi, wo)), rtol=1e-9)
    # Smooth and not specular: at normal incidence and view a Lambertian surface.
    matte = gn.DisneyPrincipled(0.7, specular=0.0, roughness=1.0)
    up = np.array([0.0, 0.0, 1.0])
    assert matte.f(up, up) == pytest.approx(0.7 / PI)


def test_gtr1_is_normalized():
    for gloss in (0.0, 0.5, 1.0):
        *_, (_, coat) = gn.DisneyPrincipled(0.0, specular=0.0, clearcoat=1.0, clearcoat_gloss=gloss).lobes()
        x, w = np.polynomial.legendre.leggauss(40)
        edges = np.concatenate([[0.0], np.geomspace(1e-6, 0.5 * PI, 40)])
        t = np.concatenate([0.5 * (b - a) * (x + 1.0) + a for a, b in pairwise(edges)])
        dt = np.concatenate([0.5 * (b - a) * w for a, b in pairwise(edges)])
        wm = Direction(np.sin(t), 0.0 * t, np.cos(t))
        assert (2.0 * PI * dt * np.sin(t) * np.cos(t)) @ coat.D(wm) == pytest.approx(1.0, rel=1e-6)


def test_disney_from_rgb():
    m = gn.DisneyPrincipled.from_rgb([0.8, 0.5, 0.1], specular_tint=1.0)
    assert m.tint == pytest.approx(np.array([0.8, 0.5, 0.1]) / 0.55)
    assert (0.3 * m.tint[0] + 0.6 * m.tint[1] + 0.1 * m.tint[2]) == pytest.approx(1.0)
    assert gn.DisneyPrincipled.from_rgb([0.0, 0.0, 0.0]).tint == pytest.approx(1.0)
    up = np.array([0.0, 0.0, 1.0])
    plain = gn.DisneyPrincipled([0.8, 0.5, 0.1])
    mirrored = (m.f(up, up) - plain.f(up, up)) / (plain.f(up, up) - np.array([0.8, 0.5, 0.1]) / PI)
    assert mirrored + 1.0 == pytest.approx(m.tint)


# OpenPBR's slabs.


@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.55, 1.0])
@pytest.mark.parametrize("ior", [1.2, 1.5, 3.0])
def test_white_glossy_diffuse_loses_nothing(roughness, ior):
    m = gn.OpenPBRGlossyDiffuse(1.0, 1.0, roughness, ior)
    assert gn.albedo(m, VIEWS, tolerance=1e-4) == pytest.approx(1.0, abs=7e-4)


def test_glossy_diffuse_against_plain_python():
    """The specification's reciprocal form, with E and its mean by the integrals above and not by the fits."""
    C, weight, roughness, ior = 0.6, 0.8, 0.6, 1.5
    alpha, F0 = roughness**2, weight * (0.5 / 2.5) ** 2

    def F(theta: float) -> float:
        return F0 + (1.0 - F0) * (1.0 - math.cos(theta)) ** 5

    def E(mu: float) -> float:
        return SLOPES.over(mu, alpha, lambda cos, seen: seen * (F0 + (1.0 - F0) * (1.0 - cos) ** 5))

    x, w = np.polynomial.legendre.leggauss(16)
    mean = sum(float(0.5 * v * (u + 1.0)) * E(0.5 * float(u + 1.0)) for u, v in zip(x, w, strict=True))

    def glossy_diffuse(wi: np.ndarray, wo: np.ndarray) -> float:
        below = C / PI * (1.0 - E(float(wi[2]))) * (1.0 - E(float(wo[2]))) / (1.0 - mean)
        return ggx_f(wi, wo, alpha, F) + below

    held(gn.OpenPBRGlossyDiffuse(C, weight, roughness, ior), glossy_diffuse, 1.5e-3, 40)


def test_openpbr_metal_is_a_microfacet_model():
    a, r = 0.4, 0.5
    ax = r**2 * math.sqrt(2.0 / (1.0 + (1.0 - a) ** 2))
    expected = 0.7 * gn.Microfacet(gn.GGX(ax, (1.0 - a) * ax), gn.F82Tint(0.8, 0.6))
    m = gn.OpenPBRMetal(0.8, 0.6, 0.7, r, a)
    for wi, wo in some_pairs(60):
        assert m.f(wi, wo) == pytest.approx(expected.f(wi, wo), rel=1e-12)
    assert gn.OpenPBRMetal(0.8, 1.0, 1.0, 0.0, 1.0).facets.alpha_y == 1e-3


@pytest.mark.parametrize("alpha", ALPHAS)
def test_average_schlick_share(alpha):
    x, w = np.polynomial.legendre.leggauss(100)
    u = 0.5 * (x + 1.0) * math.asinh(1.0 / alpha)
    mu = np.minimum(alpha * np.sinh(u), 1.0)
    jacobian = 0.5 * w * math.asinh(1.0 / alpha) * alpha * np.cosh(u)
    assert schlick_share_on_average(alpha) == pytest.approx(
        (jacobian * 2.0 * mu * schlick_share(mu, alpha)).sum(), abs=5e-5
    )


# OpenPBR's layers.

BASES = {
    "Lambertian": gn.Lambertian([0.2, 0.5, 1.0]),
    "slabs": 0.3 * gn.OpenPBRGlossyDiffuse([0.2, 0.5, 0.9])
    + 0.7 * gn.OpenPBRMetal([0.9, 0.6, 0.2], 0.8, 1.0, 0.4, 0.3),
    "mirror": 0.5 * gn.IdealSpecular(0.9) + gn.Lambertian(0.4),
}
each_base = pytest.mark.parametrize("base", BASES.values(), ids=BASES)


@pytest.mark.parametrize("roughness", thinned([0.2, 0.6, 1.0], [0.6]))
def test_openpbr_coat_against_plain_python(roughness):
    """In angles, with the albedo by the integrals above."""
    C, color, ior, alpha = 0.7, 0.4, 1.7, roughness**2
    F0 = ((ior - 1.0) / (ior + 1.0)) ** 2
    base = gn.OpenPBRMetal(0.8, 0.6, 0.7, 0.5, 0.4)

    def F(theta: float) -> float:
        return F0 + (1.0 - F0) * (1.0 - math.cos(theta)) ** 5

    def E(mu: float) -> float:
        return SLOPES.over(mu, alpha, lambda cos, seen: seen * (F0 + (1.0 - F0) * (1.0 - cos) ** 5))

    def coated(wi: np.ndarray, wo: np.ndarray) -> float:
        ti, to, *_ = angles_of(wi, wo)
        passes = [math.sqrt(color) ** (1.0 / math.cos(math.asin(math.sin(t) / ior))) for t in (ti, to)]
        reflected = max(E(math.cos(ti)), E(math.cos(to)))
        through = (1.0 - C * reflected) * (1.0 - C + C * passes[0] * passes[1])
        return C * ggx_f(wi, wo, alpha, F) + through * float(base.f(wi, wo))

    held(gn.OpenPBRCoat(base, C, color, roughness, ior), coated, 2e-3, 60)


@pytest.mark.parametrize("r", [0.0, 0.1, 0.17, 0.33, 0.62, 1.0])
def test_openpbr_fuzz_and_the_albedo_of_its_sheen(r):
    """What the base loses is the sheen's albedo, and up to 0.0065 more."""
    W, color, base = 0.8, 0.4, gn.OpenPBRMetal(0.8, 0.6, 0.7, 0.5, 0.4)
    sheen = gn.CharlieSheen(1.0, max(r, 0.1))
    wi, wo = (np.array(w) for w in zip(*some_pairs(40, least=1e-3), strict=True))
    E = np.maximum(*(gn.albedo(sheen, w, tolerance=1e-5) for w in (wi, wo)))
    f = gn.OpenPBRFuzz(base, W, color, r).f(wi, wo)
    lost = (1.0 - (f - W * color * sheen.f(wi, wo)) / base.f(wi, wo)) / W
    assert (lost - E).min() > -1e-4
    assert (lost - E).max() < 0.0065


def layers(base: gn.Reflectance) -> list[gn.Reflectance]:
    found = [gn.OpenPBRCoat(base, 1.0, 1.0, r, n) for r, n in ((0.0, 3.0), (0.4, 1.0), (1.0, 1.6))]
    found += [gn.OpenPBRFuzz(base, 1.0, 1.0, r) for r in (0.0, 0.6)]
    return [*found, gn.OpenPBRFuzz(gn.OpenPBRCoat(base, 0.6, 1.0, 0.3), 0.5, 1.0, 0.7)]


def assert_white(base: gn.Reflectance) -> None:
    for m in layers(base):
        a = gn.albedo(m, VIEWS, tolerance=5e-4)
        assert a.max() < 1.0 + 1e-3, m
        assert a.min() > 0.8, m


@pytest.mark.full
def test_openpbr_layers_of_slabs_in_the_furnace():
    assert_white(gn.OpenPBRGlossyDiffuse(1.0))


def test_openpbr_layers_in_the_furnace():
    """Over white: never more than what comes in, and at grazing all of it."""
    for base in (gn.Lambertian(1.0), gn.IdealSpecular(1.0)):
        assert_white(base)
    up, slant = gn.direction(0.0, 0.0), gn.direction(math.radians(89.0), 0.0)
    varnish, dust = gn.OpenPBRCoat(gn.Lambertian(1.0)), gn.OpenPBRFuzz(gn.Lambertian(1.0))
    assert gn.albedo(varnish, up) == pytest.approx(0.955, abs=2e-3)
    assert gn.albedo(varnish, slant) == pytest.approx(1.0, abs=1e-3)
    assert gn.albedo(dust, up) == pytest.approx(0.858, abs=2e-3)
    assert gn.albedo(dust, slant) == pytest.approx(1.0, abs=7e-3)


@each_base
@pytest.mark.usefixtures("uncompiled")  # large formulas, and few directions
def test_openpbr_layers_of_no_weight(base):
    wi, wo = (np.array(w) for w in zip(*some_pairs(60), strict=True))
    for m in (gn.OpenPBRCoat(base, 0.0, 0.3, 0.4, 2.0), gn.OpenPBRFuzz(base, 0.0, 0.3, 0.4)):
        np.testing.assert_allclose(m.f(wi, wo), base.f(wi, wo), rtol=1e-15)  # but for the order of operations
        np.testing.assert_array_equal(m.delta_reflectance(wo), base.delta_reflectance(wo))


@each_base
@pytest.mark.usefixtures("uncompiled")
def test_openpbr_layers_lobe_by_lobe(base):
    wi, wo = (np.array(w) for w in zip(*some_pairs(60), strict=True))
    m = gn.OpenPBRFuzz(gn.OpenPBRCoat(base, 0.5, [0.8, 0.9, 1.0], 0.2), 0.3, [0.9, 0.5, 0.4], 0.6)
    assert len(list(m.lobes())) == 2 + len(list(base.lobes()))
    f = sum(np.asarray(weight) * np.reshape(lobe.f(wi, wo), (60, -1)) for weight, lobe in m.lobes())
    np.testing.assert_allclose(f, m.f(wi, wo), rtol=1e-12)
    np.testing.assert_allclose(m.f(wo, wi), m.f(wi, wo), rtol=1e-11)


# Sampling of what has several lobes: densities integrate to 1, samples follow them.


@pytest.mark.parametrize(
    "m",
    [
        pytest.param(gn.KullaConty(0.7, gn.Conductor([0.2, 0.9, 1.2], [3.9, 2.4, 2.3])), marks=pytest.mark.full),
        pytest.param(gn.FdezAguera([0.2, 0.5, 0.9], 0.8), marks=pytest.mark.full),
        pytest.param(gn.OpenPBRGlossyDiffuse(0.7, 1.0, 0.3, 1.8), marks=pytest.mark.full),
        pytest.param(
            gn.OpenPBRFuzz(gn.OpenPBRCoat(BASES["slabs"], 0.5, [0.8, 0.9, 1.0], 0.2), 0.3, [0.9, 0.5, 0.4], 0.6),
            marks=pytest.mark.full,
        ),
        gn.OpenPBRFuzz(gn.Lambertian(0.5), 0.3, [0.9, 0.5, 0.4], 0.6),
        gn.DisneyPrincipled(0.4, roughness=0.4, anisotropic=0.6, clearcoat=1.0, clearcoat_gloss=0.4, sheen=0.3),
    ],
    ids=lambda m: type(m).__name__,
)
@pytest.mark.usefixtures("uncompiled")
def test_samples_of_several_lobes(m):
    assert len(list(m.lobes())) > 1
    laws = {law.name: law for law in gn.check(m, laws=["pdf", "sampling"]).laws}
    assert laws["pdf"].passed, str(laws["pdf"])
    assert laws["sampling"].passed, str(laws["sampling"])
    rng = np.random.default_rng(1)
    wo = np.broadcast_to(gn.direction(0.8, 0.4), (512, 3))
    s = m.sample(wo, rng.random((512, 2)))
    up = s.pdf > 0.0
    np.testing.assert_allclose(s.pdf[up], m.pdf(s.wi, wo)[up], rtol=1e-9)
    f = m.f(s.wi, wo)[up]
    f = f if f.ndim == 1 else f[:, 0]
    weight = s.weight[up] if s.weight.ndim == 1 else s.weight[up][:, 0]
    np.testing.assert_allclose(weight, f * s.wi[up, 2] / s.pdf[up], rtol=1e-9)


# Mitsuba 3.


@pytest.fixture(scope="module")
def mitsuba() -> Any:
    module = pytest.importorskip("mitsuba")
    module.set_variant("scalar_rgb")
    return module


def principled(mitsuba: Any, wi: np.ndarray, wo: np.ndarray, **settings: Any) -> float:
    """Mitsuba's `principled`, of gray 0.6: its `eval(si, wo)` takes the viewer in si.wi, and has the light's cosine."""
    color = {"type": "rgb", "value": [0.6, 0.6, 0.6]}
    theirs = mitsuba.load_dict({"type": "principled", "base_color": color, **settings})
    si = mitsuba.SurfaceInteraction3f()
    si.wi = mitsuba.Vector3f(*map(float, wo))
    return theirs.eval(mitsuba.BSDFContext(), si, mitsuba.Vector3f(*map(float, wi)))[0] / wi[2]


METALS = [{"roughness": 0.5}, {"roughness": 0.5, "anisotropic": 0.6}, {"roughness": 0.9, "anisotropic": 1.0}]


@pytest.mark.parametrize("settings", METALS, ids=str)
def test_disney_metals_against_mitsuba(mitsuba, settings):
    ours = gn.DisneyPrincipled(0.6, metallic=1.0, masking="anisotropic", **settings)
    for wi, wo in some_pairs(60, least=0.1):
        expected = principled(mitsuba, wi, wo, metallic=1.0, **settings)
        assert ours.f(wi, wo) == pytest.approx(expected, rel=2e-4)


MATTES = [{"roughness": 0.2}, {"roughness": 1.0}, {"roughness": 0.7, "sheen": 0.8}]


@pytest.mark.parametrize("settings", MATTES, ids=str)
def test_disney_matte_against_mitsuba(mitsuba, settings):
    """Mitsuba's dielectric has an index, and reflects nothing where specular = 0; the paper's rises to 1 at grazing."""
    (_, ours), *_ = gn.DisneyPrincipled(0.6, specular=0.0, **settings).lobes()
    for wi, wo in some_pairs(60, least=0.1):
        assert ours.f(wi, wo) == pytest.approx(principled(mitsuba, wi, wo, specular=0.0, **settings), rel=2e-4)


def test_disney_coat_against_mitsuba(mitsuba):
    """Mitsuba multiplies by G and leaves the 1/(4 cos cos) out, which disney.brdf has in its G."""
    *_, (_, ours) = gn.DisneyPrincipled(0.6, clearcoat=0.8, clearcoat_gloss=0.2).lobes()
    for wi, wo in some_pairs(60, least=0.1):
        bare, coated = (principled(mitsuba, wi, wo, clearcoat=c, clearcoat_gloss=0.2) for c in (0.0, 0.8))
        assert 4.0 * wi[2] * wo[2] * ours.f(wi, wo) == pytest.approx(coated - bare, rel=1e-3, abs=1e-6)


def test_cited():
    compensated = [gn.KullaConty, gn.Turquin, gn.FdezAguera]
    for name in [
        c.__name__ for c in (gn.F82Tint, *compensated, gn.CharlieSheen, gn.AshikhminVelvet, gn.RetroMicrofacet)
    ]:
        assert "@" in gn.cite(name).partition("% the software")[0], name
    assert "burley2012" in gn.cite("DisneyPrincipled")
    assert "openpbr2024" in gn.cite("OpenPBRMetal")
    for name in ("OpenPBRGlossyDiffuse", "OpenPBRCoat", "OpenPBRFuzz"):
        assert "openpbr2024" in gn.cite(name)
