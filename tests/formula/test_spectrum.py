"""Spectra: values between wavelengths, means over bands, and parameters that are spectra."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import gonio as gn
from gonio.errors import AccessError, ParameterError
from gonio.formula.json_form import from_json

RAMP = gn.Spectrum([400.0, 700.0], [0.0, 0.3])


def test_values_lie_on_straight_lines():
    np.testing.assert_allclose(RAMP.at([400.0, 550.0, 700.0]), [0.0, 0.15, 0.3])
    assert RAMP.at(550.0) == pytest.approx(0.15)
    assert gn.Spectrum([700.0, 400.0], [0.3, 0.0]) == RAMP


def test_means_over_bands_keep_the_sum():
    rng = np.random.default_rng(1)
    nm = np.sort(rng.uniform(400.0, 700.0, 200))
    s = gn.Spectrum(nm, rng.random(200))
    centres = np.linspace(nm[0], nm[-1], 17)
    inner = 0.5 * (centres[1:] + centres[:-1])
    widths = np.diff([nm[0], *inner, nm[-1]])
    total = np.sum(0.5 * (s.values[1:] + s.values[:-1]) * np.diff(nm))  # the area below straight lines
    assert np.sum(s.bands(centres) * widths) == pytest.approx(total, rel=1e-12)
    np.testing.assert_allclose(RAMP.bands([500.0, 520.0, 540.0]), RAMP.at([500.0, 520.0, 540.0]), rtol=1e-12)
    np.testing.assert_allclose(RAMP.bands([540.0, 500.0, 520.0]), RAMP.at([540.0, 500.0, 520.0]), rtol=1e-12)


def test_nothing_is_extrapolated():
    for call in (RAMP.at, RAMP.bands):
        with pytest.raises(ParameterError, match="400 to 700 nm at 399 nm: nothing is extrapolated"):
            call([399.0, 500.0])
    with pytest.raises(ParameterError, match="in micrometres"):
        RAMP.at(0.5)


def test_spectra_that_do_not_overlap():
    blue, red = gn.Spectrum([400.0, 500.0], [0.1, 0.2]), gn.Spectrum([600.0, 700.0], [0.1, 0.2])
    m = gn.Lambertian(blue) + gn.Lambertian(red)
    with pytest.raises(ParameterError, match="take wavelengths that all spectra hold"):
        m.at([450.0])
    with pytest.raises(ParameterError, match=r"Lambertian\.rho"):
        m.at(650.0)


def test_spectra_that_are_none():
    for nm, values, message in (
        ([400.0], [1.0], "N > 1"),
        ([400.0, 500.0], [1.0], "N > 1"),
        ([400.0, 400.0], [1.0, 1.0], "different"),
        ([0.4, 0.7], [1.0, 1.0], "in micrometres"),
        ([400.0, 500.0], [1.0, np.nan], "leave such wavelengths out"),
        ("ab", [1.0], "expected a wavelength"),
        ([400.0, 500.0], "ab", "expected a number"),
    ):
        with pytest.raises(ParameterError, match=message):
            gn.Spectrum(nm, values)


def test_a_parameter_that_is_a_spectrum():
    m = gn.Lambertian(RAMP)
    assert m.at([450.0, 550.0]) == gn.Lambertian(RAMP.at([450.0, 550.0]), wavelengths=[450.0, 550.0])
    assert m.at(550.0) == gn.Lambertian(RAMP.at(550.0)) == gn.Lambertian(RAMP, wavelengths=550.0)
    assert gn.Lambertian(RAMP, wavelengths=[450.0, 550.0]) == m.at([450.0, 550.0])
    assert m == pickle.loads(pickle.dumps(m)) == from_json(m.to_json()) == gn.expression(repr(m))
    assert m != gn.Lambertian(gn.Spectrum([400.0, 701.0], [0.0, 0.3]))
    weighted = RAMP * gn.Lambertian(0.5)
    assert weighted.at(550.0).f([0, 0, 1], [0, 0, 1]) == pytest.approx(0.075 / np.pi)
    assert weighted == gn.expression(repr(weighted))
    assert gn.GGX(gn.Spectrum([400.0, 700.0], [0.1, 0.3])).at(700.0) == gn.GGX(0.3)


def test_bounds_hold_where_a_spectrum_is_bound():
    steep = gn.Lambertian(gn.Spectrum([400.0, 700.0], [0.0, 1.5]))
    assert steep.at([450.0, 600.0]).rho.tolist() == pytest.approx([0.25, 1.0])
    for nm in (650.0, [450.0, 650.0]):
        with pytest.raises(ParameterError, match=r"Lambertian\.rho: 1\.25 at 650 nm is out of bounds"):
            steep.at(nm)
    far = gn.Conductor(
        gn.Spectrum([500.0, 1000.0, 200000.0], [0.8, 1.4, 424.0]), gn.Spectrum([500.0, 200000.0], [6, 8])
    )
    assert gn.Microfacet(gn.GGX(0.2), far).at(500.0).fresnel.eta == 0.8
    with pytest.raises(ParameterError, match="424 at 200000 nm is out of bounds"):
        gn.IdealSpecular(far).at(200000.0)
    with pytest.raises(ParameterError, match="in percent"):
        gn.Lambertian(gn.Spectrum([400.0, 700.0], [50.0, 60.0]))  # nowhere within the bounds
    emission = gn.Spectrum([400.0, 500.0, 600.0], [0.0, 50.0, 0.0])
    dye = gn.FluorescentLambertian(0.1, gn.Spectrum([400.0, 600.0], [1.0, 0.0]), emission)
    assert dye.at([420.0, 500.0, 580.0]).emission.sum() == pytest.approx(1.0)
    with pytest.raises(ParameterError, match="expected numbers of 0 or more"):
        dye.replace(emission=gn.Spectrum([400.0, 500.0, 600.0], [-1.0, 1.0, 0.0])).at([420.0, 500.0, 580.0])


def test_a_spectrum_is_a_value():
    with pytest.raises(AccessError):
        RAMP.values = np.zeros(2)
    with pytest.raises(ValueError, match="read-only"):
        RAMP.values[0] = 1.0
    assert len({RAMP, gn.Spectrum([400.0, 700.0], [0.0, 0.3])}) == 1
