"""Scatter by polished surfaces: Harvey-Shack, ABg, K-correlation and the generalized Harvey-Shack theory."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

import gonio as gn

THETA = np.linspace(0.0, 1.4, 15)


def in_plane(m, theta_i=0.4):
    return m.f_angles(theta_i, 0.0, THETA, np.pi)


def test_harvey_shack_is_the_formula():
    beta = np.sin(THETA) - np.sin(0.4)
    assert np.allclose(in_plane(gn.HarveyShack(3.0, 0.05, -1.7)), 3.0 * (1.0 + (beta / 0.05) ** 2) ** -0.85, rtol=1e-12)
    mean = 0.5 * (np.cos(0.4) + np.cos(THETA))
    expected = 3.0 * mean**2 * (1.0 + (beta / (0.05 * mean)) ** 2) ** -0.85
    assert np.allclose(in_plane(gn.HarveyShack(3.0, 0.05, -1.7, 2.0, 1.0)), expected, rtol=1e-12)


def test_abg_is_the_formula():
    beta = np.abs(np.sin(THETA) - np.sin(0.4))
    assert np.allclose(in_plane(gn.ABg(0.01, 0.002, 1.6)), 0.01 / (0.002 + beta**1.6), rtol=1e-10)
    with pytest.raises(gn.Error, match="out of bounds"):
        gn.ABg(0.01, 0.0, 1.6)


@pytest.mark.parametrize("s", [-1.2, -2.0, -3.0])
def test_total_integrated_scatter_of_harvey_shack(s):
    lobe = gn.HarveyShack(0.5, 0.05, s)
    assert np.isclose(lobe.tis(), gn.albedo(lobe, [0, 0, 1]), rtol=1e-5)


@pytest.mark.parametrize("s", [-1.5, -2.0, -2.6])
def test_conversions_of_harvey_shack_and_abg(s):
    lobe = gn.HarveyShack(4.0, 0.005, s)
    other = gn.ABg.from_harvey_shack(lobe)
    back = other.to_harvey_shack()
    assert np.allclose([back.b0, back.L, back.s], [4.0, 0.005, s], rtol=1e-12)
    for theta_i, theta_o in ((0.4 + 1e-7, 0.4), (0.4, 1.5)):  # next to the mirror direction, and far from it
        a, b = (m.f_angles(theta_i, 0.0, theta_o, np.pi) for m in (lobe, other))
        assert np.isclose(a, b, rtol=5e-3)
    if s == -2.0:
        assert np.allclose(in_plane(lobe), in_plane(other), rtol=1e-10)


@pytest.mark.parametrize("C", [0.5, 1.5, 2.0, 2.5, 4.0])
def test_the_spectrum_holds_the_roughness(C):
    m = gn.KCorrelation(3.0, 5e3, C, shortest=20.0)
    peak = float(m.psd(0.0))

    def within(shortest):
        ring = quad(
            lambda t: math.exp(2.0 * t) * peak * (1.0 + (5e3 * math.exp(t)) ** 2) ** (-0.5 * C),
            math.log(1e-9),
            -math.log(shortest),
            limit=400,
        )
        return math.sqrt(2.0 * math.pi * ring[0])

    assert within(20.0) == pytest.approx(3.0, rel=1e-7)
    assert within(550.0) == pytest.approx(float(m.roughness(550.0)), rel=1e-7)


@pytest.mark.parametrize("theta", [0.0, 0.5, 1.0])
def test_scatter_follows_from_the_roughness(theta):
    m = gn.KCorrelation(2.0, 1e5, 4.0, fresnel=1.0)
    expected = (4.0 * math.pi * 2.0 * math.cos(theta) / 550.0) ** 2
    assert gn.albedo(m, gn.direction(theta, 0.0)) == pytest.approx(expected, rel=3e-3)
    assert float(m.tis(math.cos(theta))) == pytest.approx(expected, rel=1e-12)


def test_k_correlation_is_rayleigh_rice():
    m = gn.KCorrelation(2.0, 1e4, 2.2, fresnel=gn.Constant(0.8), wavelength=633.0)
    beta = np.abs(np.sin(THETA) - np.sin(0.4))
    spectrum = float(m.psd(0.0)) * (1.0 + (1e4 * beta / 633.0) ** 2) ** -1.1
    expected = 16.0 * np.pi**2 / 633.0**4 * np.cos(0.4) * np.cos(THETA) * 0.8 * spectrum
    assert np.allclose(in_plane(m), expected, rtol=1e-9)
    lobe = gn.HarveyShack(1.0, 0.01, -1.5)
    mirror = gn.KCorrelation.from_harvey_shack(lobe, wavelength=550.0)
    assert mirror.f_angles(0.02, 0.0, 0.03, np.pi) == pytest.approx(lobe.f_angles(0.02, 0.0, 0.03, np.pi), rel=1e-3)


def test_generalized_harvey_shack_between_smooth_and_rough():
    smooth = gn.GeneralizedHarveyShack(0.5, 1500.0, wavelength=550.0, fresnel=1.0)
    beta = np.sin(THETA) - np.sin(0.4)
    spectrum = np.pi * 0.5**2 * 1500.0**2 * np.exp(-((np.pi * 1500.0 * beta / 550.0) ** 2))
    obliquity = (0.5 * (np.cos(0.4) + np.cos(THETA))) ** 2
    first_order = 16.0 * np.pi**2 / 550.0**4 * obliquity * spectrum
    assert np.allclose(in_plane(smooth), first_order, rtol=1e-3, atol=1e-4 * first_order.max())
    rough = gn.GeneralizedHarveyShack(3e3, 3e4, wavelength=500.0, fresnel=1.0)
    near = np.array([0.0, 0.05, 0.1])
    ours, theirs = (m.f_angles(0.0, 0.0, near, np.pi) for m in (rough, gn.Microfacet(gn.Beckmann(0.2), 1.0)))
    assert np.allclose(ours, theirs, rtol=6e-3)
    for sigma in (0.5, 5.0, 20.0):
        m = gn.GeneralizedHarveyShack(sigma, 5000.0, wavelength=550.0, fresnel=1.0)
        assert gn.albedo(m, [0, 0, 1]) + float(m.unscattered()) == pytest.approx(1.0, abs=2e-3)


MODELS = [gn.HarveyShack(3.0, 0.05, -1.7), gn.ABg(0.01, 0.002, 1.6), gn.KCorrelation(), gn.GeneralizedHarveyShack()]


@pytest.mark.parametrize("m", MODELS)
def test_single_precision_is_near(m):
    wi, wo = gn.direction(0.4, 0.0), gn.direction(THETA, np.pi - 0.2)
    single = m.f(wi.astype(np.float32), wo.astype(np.float32))
    assert np.allclose(single, m.f(wi, wo), rtol=3e-4)
