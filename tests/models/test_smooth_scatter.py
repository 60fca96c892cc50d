"""Scatter by smooth surfaces: closed forms, limits, conversions."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gonio as gn

NORMAL = [0.0, 0.0, 1.0]
AT = np.radians([[0.0, 20.0, 45.0, 70.0], [0.0, 30.0, 10.0, 0.0], [5.0, 40.0, 60.0, 65.0], [0.0, 200.0, 150.0, 180.0]])


def d2(ti, pi, to, po):
    return np.sin(ti) ** 2 + np.sin(to) ** 2 + 2.0 * np.sin(ti) * np.sin(to) * np.cos(pi - po)


def disc(f, high, n=4000):
    """Integral of 2 pi x f(x) from 0 to `high`, in log x."""
    t, w = np.polynomial.legendre.leggauss(n)
    low, top = math.log(1e-12 * high), math.log(high)
    x = np.exp(0.5 * (top - low) * (t + 1.0) + low)
    return float(0.5 * (top - low) * np.sum(w * 2.0 * math.pi * x * x * f(x)))


@pytest.mark.parametrize("s", [-0.7, -1.5, -2.0, -3.0])
def test_harvey_shack_total(s):
    b0, L = 0.3, 0.02
    m = gn.HarveyShack(b0, L, s)
    if s == -2.0:
        expected = math.pi * b0 * L * L * math.log(1.0 + 1.0 / L**2)
    else:
        expected = 2.0 * math.pi * b0 * L * L * ((1.0 + 1.0 / L**2) ** (0.5 * s + 1.0) - 1.0) / (s + 2.0)
    assert m.tis() == pytest.approx(expected, rel=1e-12)
    assert gn.albedo(m, NORMAL, tolerance=1e-6) == pytest.approx(expected, rel=1e-5)


def test_harvey_shack_with_powers_of_the_mean_cosine():
    g = 0.5 * (np.cos(AT[0]) + np.cos(AT[2]))
    expected = 2.0 * g**2 * (1.0 + d2(*AT) / (0.05 * g) ** 2) ** -0.9
    np.testing.assert_allclose(gn.HarveyShack(2.0, 0.05, -1.8, P=2.0, Q=1.0).f_angles(*AT), expected, rtol=1e-12)


@pytest.mark.parametrize("g", [0.8, 2.0, 3.5])
def test_abg_and_harvey_shack(g):
    abg = gn.ABg(0.01, 0.001, g)
    hs = abg.to_harvey_shack()
    back = gn.ABg.from_harvey_shack(hs)
    np.testing.assert_allclose([back.A, back.B, back.g], [0.01, 0.001, g], rtol=1e-9)
    knee = float(hs.L)
    at_knee = abg.f_angles(0.0, 0.0, math.asin(knee), 0.0) / hs.f_angles(0.0, 0.0, math.asin(knee), 0.0)
    assert at_knee == pytest.approx(2.0 ** (0.5 * g - 1.0), rel=1e-9)
    assert abg.f(NORMAL, NORMAL) == pytest.approx(hs.f(NORMAL, NORMAL), rel=1e-12)
    if g == 2.0:
        np.testing.assert_allclose(abg.f_angles(*AT), hs.f_angles(*AT), rtol=1e-9)


def test_abg_total_and_bounds():
    assert gn.albedo(gn.ABg(0.01, 0.001, 2.0), NORMAL, tolerance=1e-6) == pytest.approx(
        math.pi * 0.01 * math.log(1.0 + 1.0 / 0.001), rel=1e-5
    )
    np.testing.assert_allclose(gn.ABg(0.3, 0.5, 0.0).f_angles(*AT), 0.2, rtol=1e-12)
    with pytest.raises(gn.ParameterError):
        gn.ABg(0.01, 0.0, 2.0)


@pytest.mark.parametrize("C", [1.2, 2.0, 2.5, 4.0])
def test_the_spectrum_is_normalised(C):
    m = gn.KCorrelation(3.0, 5e3, C, shortest=20.0)
    assert disc(m.psd, 1.0 / 20.0) == pytest.approx(9.0, rel=1e-9)
    assert disc(m.psd, 1.0 / 550.0) == pytest.approx(float(m.roughness(550.0)) ** 2, rel=1e-9)


def test_the_spectrum_without_a_band():
    m = gn.KCorrelation(3.0, 5e3, 6.0, shortest=0.1)
    assert float(m.psd(0.0)) == pytest.approx(9.0 * 5e3**2 * 4.0 / (2.0 * math.pi), rel=1e-6)


@pytest.mark.parametrize("theta", [0.0, 0.5, 1.0])
def test_total_integrated_scatter(theta):
    """Of a long correlation the albedo is F (4 pi sigma cos/lambda)^2."""
    m = gn.KCorrelation(2.0, 3e5, 5.0, wavelength=500.0, fresnel=0.7)
    expected = 0.7 * (4.0 * math.pi * 2.0 * math.cos(theta) / 500.0) ** 2
    assert float(m.tis(math.cos(theta))) == pytest.approx(expected, rel=1e-12)
    assert gn.albedo(m, gn.direction(theta, 0.0), tolerance=1e-6) == pytest.approx(expected, rel=2e-3)


def test_total_from_the_spectrum():
    """At the normal the albedo is 16 pi^2/lambda^2 times the integral of cos(theta_o) S up to 1/lambda."""
    m = gn.KCorrelation(2.0, 2e3, 1.5, fresnel=1.0)
    inside = disc(lambda f: m.psd(f) * np.sqrt(1.0 - (550.0 * f) ** 2), 1.0 / 550.0)
    assert gn.albedo(m, NORMAL, tolerance=1e-6) == pytest.approx((4.0 * math.pi / 550.0) ** 2 * inside, rel=1e-5)


def test_k_correlation_of_a_measured_lobe():
    hs = gn.HarveyShack(1.0, 0.01, -1.5)
    m = gn.KCorrelation.from_harvey_shack(hs, 550.0, 0.9)
    cosines = np.cos(AT[0]) * np.cos(AT[2])
    np.testing.assert_allclose(m.f_angles(*AT), hs.f_angles(*AT) * cosines, rtol=1e-9)


def test_wavelength_scaling():
    """Shorter waves scatter more: f at the mirror goes as 1/lambda^4."""
    f = gn.KCorrelation(fresnel=1.0).at([400.0, 800.0]).f(NORMAL, NORMAL)
    assert f[0] / f[1] == pytest.approx(16.0, rel=1e-12)


def test_smooth_limit_of_the_general_theory():
    """Rayleigh-Rice of a Gaussian spectrum, with the mean cosine squared for the product of cosines."""
    sigma, tau, lam = 0.2, 1500.0, 550.0
    f = gn.GeneralizedHarveyShack(sigma, tau, lam, 1.0).f_angles(AT[0], AT[1], AT[0] + 0.02, AT[1] + math.pi)
    here = d2(AT[0], AT[1], AT[0] + 0.02, AT[1] + math.pi)
    mean = 0.5 * (np.cos(AT[0]) + np.cos(AT[0] + 0.02))
    spectrum = math.pi * sigma**2 * tau**2 * np.exp(-((math.pi * tau / lam) ** 2) * here)
    expected = 16.0 * math.pi**2 / lam**4 * mean**2 * spectrum
    np.testing.assert_allclose(f, expected, rtol=1e-4)


def test_rough_limit_of_the_general_theory():
    """The Gaussian of Kirchhoff, which is that of facets next to the normal."""
    sigma, tau = 2000.0, 2e4
    m = gn.GeneralizedHarveyShack(sigma, tau, 500.0, 1.0)
    alpha = 2.0 * sigma / tau
    ti, pi, to, po = np.radians([[0.0, 5.0, 20.0], [0.0, 0.0, 0.0], [5.0, 8.0, 30.0], [0.0, 120.0, 180.0]])
    vz = np.cos(ti) + np.cos(to)
    expected = np.exp(-d2(ti, pi, to, po) / (alpha * vz) ** 2) / (math.pi * (alpha * vz) ** 2)
    np.testing.assert_allclose(m.f_angles(ti, pi, to, po), expected, rtol=1e-3)
    facets = gn.Microfacet(gn.Beckmann(alpha), 1.0)
    np.testing.assert_allclose(m.f_angles(ti, pi, to, po)[:2], facets.f_angles(ti, pi, to, po)[:2], rtol=0.05)


def test_general_theory_conserves_energy_at_the_normal():
    """Wide correlation: what leaves the mirror is scattered, and nothing is lost beyond the horizon."""
    for sigma in (5.0, 30.0, 100.0):
        m = gn.GeneralizedHarveyShack(sigma, 2e4, 550.0, 1.0)
        total = gn.albedo(m, NORMAL, tolerance=1e-6) + float(m.unscattered())
        assert total == pytest.approx(1.0, abs=2e-3)


MODELS = [
    gn.HarveyShack(1.0, 0.01, -1.5, 2.0, 1.0),
    gn.ABg(0.0025, 0.001, 1.8),
    gn.KCorrelation(),
    gn.GeneralizedHarveyShack(),
]


@pytest.mark.parametrize("m", MODELS, ids=lambda m: type(m).__name__)
def test_reciprocity_and_single_precision(m):
    wi, wo = gn.direction(AT[0], AT[1]), gn.direction(AT[2], AT[3])
    f = m.f(wi, wo)
    np.testing.assert_allclose(f, m.f(wo, wi), rtol=1e-12)
    np.testing.assert_allclose(m.f(wi.astype(np.float32), wo.astype(np.float32)), f, rtol=5e-5)
