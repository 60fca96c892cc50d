"""The diffuse models against their papers, written out once more in the papers' angles, and against closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from materials import on_sphere, pairs

import gonio as gn

PI = math.pi


def oren_nayar(ti: float, to: float, phi: float, rho: float, sigma: float) -> float:
    alpha, beta, s2 = max(ti, to), min(ti, to), sigma**2
    C1 = 1.0 - 0.5 * s2 / (s2 + 0.33)
    C2 = 0.45 * s2 / (s2 + 0.09) * (math.sin(alpha) - (0.0 if math.cos(phi) >= 0.0 else (2.0 * beta / PI) ** 3))
    C3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * alpha * beta / PI**2) ** 2
    once = C1 + math.cos(phi) * C2 * math.tan(beta)
    once += (1.0 - abs(math.cos(phi))) * C3 * math.tan(0.5 * (alpha + beta))
    twice = 0.17 * s2 / (s2 + 0.13) * (1.0 - math.cos(phi) * (2.0 * beta / PI) ** 2)
    return rho / PI * once + rho**2 / PI * twice


def qualitative(ti: float, to: float, phi: float, rho: float, sigma: float) -> float:
    A, B = 1.0 - 0.5 * sigma**2 / (sigma**2 + 0.33), 0.45 * sigma**2 / (sigma**2 + 0.09)
    return rho / PI * (A + B * max(0.0, math.cos(phi)) * math.sin(max(ti, to)) * math.tan(min(ti, to)))


def fujii(ti: float, to: float, phi: float, rho: float, r: float) -> float:
    s = math.sin(ti) * math.sin(to) * math.cos(phi)
    t = max(math.cos(ti), math.cos(to)) if s > 0.0 else 1.0
    return rho * (1.0 + r * s / t) / (PI + (PI / 2.0 - 2.0 / 3.0) * r)


def fujii_albedo(theta: float, r: float) -> float:
    """For rho = 1: the integral of the lobe, done by hand."""
    s, c, t = math.sin(theta), math.cos(theta), math.tan(theta)
    G = s * (theta - s * c) + 2.0 / 3.0 * (t * (1.0 - s**3) - s)
    return (PI + r * G) / (PI + (PI / 2.0 - 2.0 / 3.0) * r)


def fujii_average(r: float) -> float:
    return (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * PI)) * r) / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * r)


def eon(ti: float, to: float, phi: float, rho: float, r: float) -> float:
    E, i, o = fujii_average(r), fujii_albedo(ti, r), fujii_albedo(to, r)
    again = rho**2 * E / (1.0 - rho * (1.0 - E))
    return fujii(ti, to, phi, rho, r) + again / PI * (1.0 - i) * (1.0 - o) / (1.0 - E)


def minnaert(ti: float, to: float, phi: float, B0: float, k: float) -> float:
    return B0 * math.cos(ti) ** k * math.cos(to) ** (k - 1.0) / (PI * math.cos(ti))  # I/F over pi cos


def lommel_seeliger(ti: float, to: float, phi: float, w: float) -> float:
    return w / (4.0 * PI) / (math.cos(ti) + math.cos(to))


def chandrasekhar(ti: float, to: float, phi: float, w: float) -> float:
    return chandrasekhar_H(w, math.cos(ti)) * chandrasekhar_H(w, math.cos(to)) * lommel_seeliger(ti, to, phi, w)


def ashikhmin_shirley(ti: float, to: float, phi: float, rho: float, F0: float) -> float:
    factor = 28.0 * rho / (23.0 * PI) * (1.0 - F0)
    return factor * (1.0 - (1.0 - math.cos(ti) / 2.0) ** 5) * (1.0 - (1.0 - math.cos(to) / 2.0) ** 5)


def cos_d(ti: float, to: float, phi: float) -> float:
    """Cosine of half the angle between the directions, by the law of cosines."""
    return math.cos(0.5 * math.acos(math.cos(ti) * math.cos(to) + math.sin(ti) * math.sin(to) * math.cos(phi)))


def disney(ti: float, to: float, phi: float, rho: float, roughness: float) -> float:
    F90 = 0.5 + 2.0 * roughness * cos_d(ti, to, phi) ** 2
    return rho / PI * (1.0 + (F90 - 1.0) * (1.0 - math.cos(ti)) ** 5) * (1.0 + (F90 - 1.0) * (1.0 - math.cos(to)) ** 5)


def frostbite(ti: float, to: float, phi: float, rho: float, roughness: float) -> float:
    bias, factor = 0.5 * roughness, (1.0 - roughness) + roughness / 1.51
    F90 = bias + 2.0 * cos_d(ti, to, phi) ** 2 * roughness
    light, view = 1.0 + (F90 - 1.0) * (1.0 - math.cos(ti)) ** 5, 1.0 + (F90 - 1.0) * (1.0 - math.cos(to)) ** 5
    return rho / PI * light * view * factor


def fresnel(theta: float, n: float) -> float:
    """By Fresnel's sines and tangents; n is the index behind over that in front."""
    t = math.asin(math.sin(theta) / n)
    rs, rp = math.sin(theta - t) / math.sin(theta + t), math.tan(theta - t) / math.tan(theta + t)
    return 0.5 * (rs**2 + rp**2)


def wolff(ti: float, to: float, phi: float, rho: float, eta: float) -> float:
    return rho / PI * (1.0 - fresnel(ti, eta)) * (1.0 - fresnel(math.asin(math.sin(to) / eta), 1.0 / eta))


@cache
def H_table(w: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cosines, weights and H there, by Chandrasekhar's equation 1/H = sqrt(1 - w) + w/2 int u' H(u')/(u + u') du'."""
    x, weight = np.polynomial.legendre.leggauss(200)
    u, weight = (0.5 * (1.0 + x)) ** 2, 0.5 * weight * (1.0 + x)
    H = np.ones_like(u)
    for _ in range(2000):  # damped: undamped it swings for w = 1
        new = 1.0 / (math.sqrt(1.0 - w) + 0.5 * w * (weight * u * H / (u[:, None] + u)).sum(1))
        if abs(new - H).max() < 1e-13:
            break
        H = 0.5 * (H + new)
    return u, weight, H


def chandrasekhar_H(w: float, mu: float) -> float:
    u, weight, H = H_table(w)
    return 1.0 / (math.sqrt(1.0 - w) + 0.5 * w * float((weight * u * H / (mu + u)).sum()))


CASES: dict[type, tuple[Callable, tuple[tuple[float, ...], ...], float]] = {
    gn.OrenNayar: (oren_nayar, ((0.3, 0.1), (1.0, 0.5), (0.7, 1.5)), 1e-9),
    gn.QualitativeOrenNayar: (qualitative, ((0.3, 0.1), (1.0, 0.5), (0.7, 1.5)), 1e-9),
    gn.FujiiOrenNayar: (fujii, ((0.3, 0.1), (1.0, 0.5), (0.7, 1.0)), 1e-9),
    gn.EON: (eon, ((0.3, 0.1), (1.0, 0.5), (0.7, 1.0)), 1e-9),
    gn.Minnaert: (minnaert, ((0.3, 0.0), (1.0, 0.7), (0.7, 3.0)), 1e-12),
    gn.LommelSeeliger: (lommel_seeliger, ((0.3,), (1.0,)), 1e-12),
    gn.Chandrasekhar: (chandrasekhar, ((0.1,), (0.6,), (0.95,), (0.999,), (1.0,)), 3e-6),
    gn.AshikhminShirleyDiffuse: (ashikhmin_shirley, ((0.3, 0.04), (1.0, 0.5)), 1e-11),
    gn.DisneyDiffuse: (disney, ((0.3, 0.0), (1.0, 0.5), (0.7, 1.0)), 1e-11),
    gn.FrostbiteDiffuse: (frostbite, ((0.3, 0.0), (1.0, 0.5), (0.7, 1.0)), 1e-11),
    gn.Wolff: (wolff, ((0.3, 1.2), (1.0, 1.5), (0.7, 4.0)), 1e-9),
}


@pytest.mark.parametrize("model", CASES, ids=lambda c: c.__name__)
def test_against_the_paper_in_angles(model):
    by_angles, parameters, tolerance = CASES[model]
    rng = np.random.default_rng(11)
    for values in parameters:
        ti, to = np.arccos(rng.uniform(0.01, 1.0, (2, 200)))
        phi_i, phi_o = rng.uniform(-PI, PI, (2, 200))
        f = model(*values).f_angles(ti, phi_i, to, phi_o)
        expected = [by_angles(*angles, *values) for angles in zip(ti, to, phi_i - phi_o, strict=True)]
        np.testing.assert_allclose(f, expected, rtol=tolerance, atol=tolerance * 1e-2)


# Limits.

LAMBERTIAN = [
    gn.OrenNayar(0.4, 0.0),
    gn.QualitativeOrenNayar(0.4, 0.0),
    gn.FujiiOrenNayar(0.4, 0.0),
    gn.EON(0.4, 0.0),
    gn.Minnaert(0.4, 1.0),
    gn.Wolff(0.4, 1.0),
]


@pytest.mark.parametrize("m", LAMBERTIAN, ids=lambda m: type(m).__name__)
def test_lambertian_limit(m):
    np.testing.assert_allclose(m.f(*pairs()), 0.4 / PI, rtol=1e-9)


def test_chandrasekhar_is_lommel_seeliger_where_little_is_scattered_again():
    wi, wo = pairs()
    for w in (1e-6, 1e-4):
        f, once = gn.Chandrasekhar(w).f(wi, wo), gn.LommelSeeliger(w).f(wi, wo)
        assert (f >= once).all()
        np.testing.assert_allclose(f, once, rtol=1.5 * w)


# Albedo.

UP = on_sphere(np.radians([0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0, 89.9]), np.full(8, 0.3))
MU = UP[:, 2]


def albedo(m: Any, tolerance: float = 1e-6) -> np.ndarray:
    return gn.albedo(m, UP, tolerance=tolerance)


def panels(m: Any, theta: float) -> float:
    """Albedo by Gauss quadrature between the kinks of the family: theta_i = theta_o, phi = pi/2."""
    x, weight = np.polynomial.legendre.leggauss(40)
    total = 0.0
    for low, high in ((0.0, theta), (theta, PI / 2.0)):
        for start in (0.0, PI / 2.0):
            t, phi = 0.5 * (high - low) * (x + 1.0) + low, PI / 4.0 * (x + 1.0) + start
            f = m.f_angles(t[:, None], phi, theta, 0.0)
            total += 2.0 * (high - low) * PI / 8.0 * float((weight * np.sin(t) * np.cos(t)) @ f @ weight)
    return total


@pytest.mark.parametrize("r", [0.0, 0.1, 0.5, 1.0])
def test_eon_conserves_energy(r):
    """White furnace: for rho = 1 all light returns; else rho E + rho_ms (1 - E)."""
    for theta in np.radians([0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0, 89.9]):
        assert panels(gn.EON(1.0, r), theta) == pytest.approx(1.0, abs=1e-9)
    assert abs(albedo(gn.EON(1.0, r), 1e-7) - 1.0).max() < 5e-6
    E, average, rho = np.array([fujii_albedo(math.acos(c), r) for c in MU]), fujii_average(r), 0.6
    expected = rho * E + rho**2 * average / (1.0 - rho * (1.0 - average)) * (1.0 - E)
    np.testing.assert_allclose(albedo(gn.EON(rho, r), 1e-7), expected, atol=5e-6)


@pytest.mark.parametrize("r", [0.1, 0.5, 1.0])
def test_fujii_albedo(r):
    m = gn.FujiiOrenNayar(1.0, r)
    np.testing.assert_allclose(albedo(m), [fujii_albedo(math.acos(c), r) for c in MU], atol=3e-6)
    mu, weight = np.polynomial.legendre.leggauss(24)
    a = gn.albedo(m, on_sphere(np.arccos(0.5 * (mu + 1.0)), np.zeros(24)), tolerance=1e-6)
    assert 0.5 * (weight * (mu + 1.0)) @ a == pytest.approx(fujii_average(r), abs=1e-5)


@pytest.mark.parametrize("sigma", [0.2, 0.5, 1.2])
def test_qualitative_oren_nayar_albedo(sigma):
    """A + B/pi (sin (theta - sin cos) + 2/3 tan (1 - sin^3)) of theta, integrated by hand; A + B/2 at grazing."""
    m = gn.QualitativeOrenNayar(1.0, sigma)
    A, B = 1.0 - 0.5 * sigma**2 / (sigma**2 + 0.33), 0.45 * sigma**2 / (sigma**2 + 0.09)
    s, theta = np.sqrt(1.0 - MU**2), np.arccos(MU)
    back = s * (theta - s * MU) + 2.0 / 3.0 * s / MU * (1.0 - s**3)
    np.testing.assert_allclose(albedo(m), A + B / PI * back, atol=3e-6)
    assert albedo(m)[-1] == pytest.approx(A + 0.5 * B, abs=2e-3)


def test_qualitative_oren_nayar_values():
    """sigma = 0.5: two sources agree on A and B, and the albedo at normal incidence is A."""
    m = gn.QualitativeOrenNayar(1.0, 0.5)
    assert pytest.approx(0.7844827586, abs=1e-10) == m.A
    assert pytest.approx(0.3308823529, abs=1e-10) == m.B
    assert albedo(m)[0] == pytest.approx(m.A, rel=1e-9)


def test_oren_nayar_breaks_what_it_declares():
    """The numbers that `breaks` names."""
    assert albedo(gn.OrenNayar(1.0, 0.3))[-1] == pytest.approx(1.05, abs=2e-3)
    assert max(albedo(gn.OrenNayar(0.94, sigma), 1e-4).max() for sigma in np.linspace(0.05, 0.6, 12)) < 1.0
    assert max(albedo(gn.OrenNayar(0.97, sigma), 1e-4).max() for sigma in np.linspace(0.05, 0.6, 12)) > 1.0
    grazing = on_sphere(np.radians([89.99, 89.99]), [0.0, PI])
    assert gn.OrenNayar(1e-3, 0.66).f(*grazing) > 0.0 > gn.OrenNayar(1e-3, 0.67).f(*grazing)
    assert gn.OrenNayar(1e-3, PI / 2.0).f(*grazing) / 1e-3 == pytest.approx(-0.084, abs=2e-3)
    assert max(albedo(gn.QualitativeOrenNayar(1.0, s), 1e-4).max() for s in np.linspace(0.1, 0.4, 7)) < 1.0155


@pytest.mark.parametrize("k", [0.0, 0.5, 1.0, 2.5, 10.0])
def test_minnaert_albedo(k):
    expected = 2.0 * 0.8 / (k + 1.0) * MU ** (k - 1.0)
    np.testing.assert_allclose(albedo(gn.Minnaert(0.8, k)), expected, rtol=1e-6)
    s = gn.Minnaert(0.8, k).sample(np.repeat(UP, 50, axis=0), np.random.default_rng(0).random((50 * len(UP), 2)))
    np.testing.assert_allclose(s.weight, np.repeat(expected, 50), rtol=1e-6)  # sampled exactly


def test_lommel_seeliger_albedo():
    expected = 0.5 * (1.0 - MU * np.log((1.0 + MU) / MU))
    np.testing.assert_allclose(albedo(gn.LommelSeeliger(1.0)), expected, atol=1e-6)


@pytest.mark.parametrize("w", [0.2, 0.8, 0.99, 0.99999, 1.0])
def test_chandrasekhar_albedo(w):
    """1 - sqrt(1 - w) H(mu), which follows from the equation for H."""
    expected = [1.0 - math.sqrt(1.0 - w) * chandrasekhar_H(w, c) for c in MU]
    np.testing.assert_allclose(albedo(gn.Chandrasekhar(w)), expected, atol=3e-6)


def test_chandrasekhar_H():
    """f at normal incidence gives H(1): for w = 1 2.9078, for w = 0.975 2.2710 (Chandrasekhar's table)."""
    for w, H in ((1.0, 2.9078105), (0.975, 2.2709854)):
        f = gn.Chandrasekhar(w).f_angles(0.0, 0.0, 0.0, 0.0)
        assert math.sqrt(8.0 * PI * f / w) == pytest.approx(H, rel=2e-6)
        assert chandrasekhar_H(w, 1.0) == pytest.approx(H, rel=1e-7)


def test_ashikhmin_shirley_albedo():
    """28/23 is what makes the albedo rho (1 - F0) (1 - (1 - mu/2)^5)."""
    expected = 0.9 * (1.0 - 0.1) * (1.0 - (1.0 - 0.5 * MU) ** 5)
    np.testing.assert_allclose(albedo(gn.AshikhminShirleyDiffuse(0.9, 0.1)), expected, atol=1e-7)


def test_disney_and_frostbite_breach():
    """The numbers that `breaks` names; and Frostbite's holds below 88.6 degrees."""
    a = albedo(gn.DisneyDiffuse(1.0, 1.0), 1e-5)
    assert a[0] == pytest.approx(1.036, abs=1e-3)
    assert a[-1] == pytest.approx(1.554, abs=2e-3)
    theta = np.radians([*range(0, 88, 4), 88.5, 88.7])
    for roughness in (0.0, 0.5, 0.9, 1.0):
        a = gn.albedo(gn.FrostbiteDiffuse(1.0, roughness), on_sphere(theta, 0.0 * theta), tolerance=1e-5)
        assert a[:-1].max() < 1.0
        assert (a[-1] > 1.0) == (roughness == 1.0)
    assert albedo(gn.FrostbiteDiffuse(1.0, 1.0), 1e-5)[-1] == pytest.approx(1.029, abs=1e-3)


def test_wolff_transmits_what_fresnel_leaves():
    """At one view the albedo is a product; the diffuse transmittance into eta = 1.5 is 1 - 0.09177795934."""
    T = np.array([1.0, *(1.0 - fresnel(math.acos(c), 1.5) for c in MU[1:])])
    T[0] = 0.96
    np.testing.assert_allclose(albedo(gn.Wolff(0.8, 1.5)), 0.8 * T * (1.0 - 0.09177795934), atol=1e-6)


# Sampling: how far weights scatter, against the cosine hemisphere.

ROUGH = [gn.OrenNayar(0.8, 0.5), gn.QualitativeOrenNayar(1.0, 1.0), gn.FujiiOrenNayar(0.5, 1.0), gn.EON(1.0, 1.0)]


@pytest.mark.parametrize("m", [*ROUGH, gn.LommelSeeliger(1.0)], ids=lambda m: type(m).__name__)
def test_weights_scatter_less_than_by_the_cosine(m):
    u = np.random.default_rng(3).random((1 << 15, 2))
    cosine = gn.Lambertian(1.0)
    for view in UP[2:]:
        wo = np.broadcast_to(view, (len(u), 3))
        weight = m.sample(wo, u).weight
        plain = m.f(cosine.sample(wo, u).wi, wo) * PI
        assert weight.var() < 0.5 * plain.var()
        assert weight.max() < 4.0 * weight.mean()


# Mitsuba 3.


def test_disney_against_mitsuba():
    """`principled` without specular reflection is Burley's lobe: in the form of 2015, that of 2012 multiplied out."""
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    rng = np.random.default_rng(5)
    for roughness in (0.1, 0.5, 1.0):
        reflectance = {"type": "rgb", "value": [0.5, 0.5, 0.5]}
        theirs = mitsuba.load_dict(
            {"type": "principled", "base_color": reflectance, "roughness": roughness, "specular": 0.0}
        )
        ours = gn.DisneyDiffuse(0.5, roughness)
        for _ in range(60):
            wi, wo = gn.direction(np.arccos(rng.uniform(0.05, 1.0, 2)), rng.uniform(-PI, PI, 2))
            si = mitsuba.SurfaceInteraction3f()
            si.wi = mitsuba.Vector3f(*map(float, wo))
            value = theirs.eval(mitsuba.BSDFContext(), si, mitsuba.Vector3f(*map(float, wi)))[0] / wi[2]
            assert value == pytest.approx(float(ours.f(wi, wo)), rel=2e-5)
