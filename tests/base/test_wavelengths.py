"""Declared wavelengths: a part of what a material is; and materials bound to them."""

from __future__ import annotations

import copy
import json
import pickle

import numpy as np
import pytest
from sweeps import trying

import gonio as gn
from gonio.authoring import Fresnel, Reflectance, param, wavelengths
from gonio.base.calls import disperses
from gonio.base.sums import Scaled, Sum
from gonio.errors import ParameterError
from gonio.evaluate import tracing
from gonio.formula.json_form import from_json

UP = np.array([0.0, 0.0, 1.0])


class _Haze(Reflectance):
    """f = rho (400 nm/wavelength)^4/pi."""

    rho = param(0.5, 0.0, 1.0, "albedo at 400 nm")
    wavelength = wavelengths()

    def formula(self, wi, wo):
        return self.rho * (400.0 / self.wavelength) ** 4 / np.pi


class _Rayleigh(Fresnel):
    """F = F0 (400 nm/wavelength)^4."""

    F0 = param(0.5, 0.0, 1.0, "reflectance at 400 nm")
    wavelength = wavelengths()

    def F(self, cos_theta):
        return self.F0 * (400.0 / self.wavelength) ** 4 + 0.0 * cos_theta


def made(nm):
    """Materials that differ by their wavelengths alone."""
    two = gn.Lambertian([0.1, 0.2])
    yield gn.Lambertian([0.1, 0.2], wavelengths=nm)
    yield 0.5 * gn.Lambertian([0.1, 0.2], wavelengths=nm)
    yield Scaled(0.5, two, wavelengths=nm)
    yield gn.Lambertian(0.3) + gn.Lambertian([0.1, 0.2], wavelengths=nm)
    yield Sum(gn.Lambertian(0.3), two, wavelengths=nm)
    yield gn.Coated(gn.Lambertian([0.1, 0.2], wavelengths=nm))
    yield gn.Microfacet(gn.GGX(0.2), gn.Conductor([0.2, 0.3], 3.0), wavelengths=nm)
    yield gn.Microfacet(gn.GGX(0.2), _Rayleigh(0.5)).at(nm)
    yield gn.tables.tabulate(two, resolution=(5, 5, 6)).with_channels(nm)


def test_wavelengths_are_a_part_of_what_a_material_is():
    for m, other in zip(made([450.0, 550.0]), made([450.0, 551.0]), strict=True):
        with trying(m=m, other=other):
            wavelengths_are_a_part_of(m, other)


def wavelengths_are_a_part_of(m: gn.Reflectance, other: gn.Reflectance) -> None:
    assert m.wavelengths.tolist() == [450.0, 550.0] and m.channel_names == (450.0, 550.0)
    assert m != other and m == copy.deepcopy(m)
    assert pickle.loads(pickle.dumps(m)) == m != pickle.loads(pickle.dumps(other))
    assert pickle.loads(pickle.dumps(m)).wavelengths.tolist() == [450.0, 550.0]
    if m._has_text and "_Rayleigh" not in repr(m):
        assert from_json(json.loads(json.dumps(m.to_json()))) == m
        assert "550.0]" in repr(m) != repr(other)
        assert gn.expression(repr(m)) == m


def test_names_in_words_are_no_wavelengths():
    m = gn.Lambertian([0.1, 0.2]).with_channels(["red", "nir"])
    assert m.wavelengths is None and m == gn.Lambertian([0.1, 0.2])
    assert from_json(m.to_json()).channel_names == ("red", "nir")


def test_files_that_call_wavelengths_names_are_read():
    data = {"type": "Lambertian", "rho": [0.1, 0.2], "channel_names": [450.0, 550.0]}
    assert from_json(data) == gn.Lambertian([0.1, 0.2], wavelengths=[450.0, 550.0])


def test_a_formula_gets_the_wavelength_of_its_channel():
    nm = np.array([400.0, 500.0, 600.0])
    expected = 0.5 * (400.0 / nm) ** 4
    m = _Haze(0.5).at(nm)
    np.testing.assert_allclose(m.f(UP, UP) * np.pi, expected, rtol=1e-14)
    np.testing.assert_allclose(gn.albedo(m, UP), expected, rtol=1e-9)
    many = np.linspace(400.0, 700.0, 31)
    np.testing.assert_allclose(gn.albedo(_Haze(0.5).at(many), UP), 0.5 * (400.0 / many) ** 4, rtol=1e-9)
    assert _Haze(0.5).at(500.0).channels is None
    assert _Haze(0.5, wavelengths=nm) == m == _Haze(0.5).at(nm).at(nm)
    summed = (gn.Lambertian(0.1) + 0.5 * _Haze(0.5)).at(nm)
    np.testing.assert_allclose(summed.f(UP, UP) * np.pi, 0.1 + 0.5 * expected, rtol=1e-14)
    assert summed.wavelengths.tolist() == nm.tolist()
    assert m.with_channels([450.0, 550.0, 650.0]).f(UP, UP)[0] < m.f(UP, UP)[0]


@pytest.mark.parametrize("library", ["torch", "jax"])
def test_a_formula_gets_the_wavelength_of_its_channel_in_other_libraries(library):
    lib = pytest.importorskip("torch" if library == "torch" else "jax.numpy")
    up = (lib.tensor if library == "torch" else lib.array)([0.0, 0.0, 1.0])
    m = _Haze(0.5).at([400.0, 500.0])
    np.testing.assert_allclose(np.asarray(m.f(up, up)), m.f(UP, UP), rtol=1e-6)
    with pytest.raises(ParameterError, match=r"m\.at"):
        _Haze(0.5).f(up, up)


def test_other_wavelengths_are_not_traced_anew():
    m, w = _Haze(0.5), gn.direction(np.linspace(0.0, 1.5, 50), 0.0)
    m.at(np.linspace(400.0, 700.0, 31)).f(w, UP)
    before = len(tracing._TRACES)
    m.at(np.linspace(410.0, 710.0, 31)).f(w, UP)
    assert len(tracing._TRACES) == before


def test_numbers_without_wavelengths_are_refused():
    for m in (_Haze(0.5), gn.Lambertian(gn.Spectrum([400.0, 700.0], [0.1, 0.2]))):
        for call in (m.f, m.pdf, lambda wi, wo, m=m: gn.albedo(m, wi), m.jacobian):
            with pytest.raises(ParameterError, match=r"write m\.at\("):
                call(UP, UP)


def test_micrometres_are_suspected():
    for call in (_Haze(0.5).at, lambda nm: gn.Lambertian([0.1, 0.2], wavelengths=nm), _Haze(0.5).at):
        with pytest.raises(ParameterError, match="in micrometres"):
            call([0.45, 0.55])
    with pytest.raises(ParameterError, match="nanometres, all of them"):
        _Haze(0.5).at([0.45, 550.0])
    with pytest.raises(ParameterError, match="above 0"):
        _Haze(0.5).at([-450.0, 550.0])
    with pytest.raises(ParameterError, match="different"):
        _Haze(0.5).at([550.0, 550.0])


def test_declared_numbers_are_interpolated_along_wavelength():
    m = gn.Microfacet(gn.GGX(0.2), gn.Conductor([0.2, 0.4], [3.0, 5.0]), wavelengths=[500.0, 600.0])
    at = m.at([525.0, 550.0, 600.0])
    np.testing.assert_allclose(at.fresnel.eta, [0.25, 0.3, 0.4])
    assert at.wavelengths.tolist() == [525.0, 550.0, 600.0]
    assert m.at([500.0, 600.0]) == m
    one = m.at(550.0)
    assert one.channels is None and one.wavelengths is None and one.fresnel.k == 4.0
    for wrong, message in ((m, "nothing is extrapolated"), (gn.material("gold"), r"gn\.spectra\.upsampled")):
        with pytest.raises(ParameterError, match=message):
            wrong.at([450.0, 550.0])


def test_gray_is_the_same_at_all_wavelengths():
    m = gn.Lambertian(0.5).at([450.0, 550.0])
    assert m == gn.Lambertian([0.5, 0.5], wavelengths=[450.0, 550.0])
    assert gn.Lambertian(0.5).at(550.0) == gn.Lambertian(0.5)


def test_numbers_of_wavelengths_that_do_not_fit():
    for make in (
        lambda: gn.Lambertian([0.1, 0.2], wavelengths=[450.0]),
        lambda: gn.Lambertian(0.1, wavelengths=[450.0, 550.0]),
        lambda: gn.Lambertian([0.1, 0.2], wavelengths=450.0),
    ):
        with pytest.raises(ParameterError, match="wavelengths="):
            make()


@pytest.mark.parametrize("make", [lambda m: gn.tables.tabulate(m, resolution=(5, 5, 6)), lambda m: _rows(m)])
def test_tables_are_interpolated_along_wavelength(make):
    m = make(gn.Lambertian([0.1, 0.3, 0.2], wavelengths=[400.0, 500.0, 700.0]))
    wi, wo = gn.direction(0.4, 0.3), gn.direction(0.5, 2.0)
    at = m.at([450.0, 500.0, 600.0])
    np.testing.assert_allclose(at.f(wi, wo) * np.pi, [0.2, 0.3, 0.25], rtol=1e-6)
    assert at.wavelengths.tolist() == [450.0, 500.0, 600.0]
    assert m.at(600.0).channels is None and m.at(600.0).f(wi, wo) * np.pi == pytest.approx(0.25, rel=1e-6)
    with pytest.raises(ParameterError, match="nothing is extrapolated"):
        m.at(399.0)
    with pytest.raises(ParameterError, match=r"gn\.spectra\.upsampled"):
        make(gn.Lambertian([0.1, 0.3, 0.2])).at(500.0)


def _rows(m):
    angles = [x.ravel() for x in np.meshgrid([0.0, 0.5, 1.0], [0.0], [0.0, 0.5, 1.0], [0.0, 2.0, 4.0])]
    names = m.channel_names or ("R", "G", "B")
    return gn.Scattered(*angles, m.f_angles(*angles), channels=names)


def test_holes_of_a_table_stay_where_they_are():
    values = np.full((2, 2, 1, 3), 0.1)
    values[..., 1] = np.nan
    axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0]}
    m = gn.Gridded("angles", axes, values, channels=[400.0, 500.0, 600.0])
    assert m.at([400.0, 450.0, 500.0, 600.0]).valid[0, 0, 0].tolist() == [True, False, False, True]


class _Prism(gn.IdealSpecular):
    """A mirror that says it refracts, as an interface with an index for each channel."""

    sides = "across"
    n = param(1.5, 1.0, 3.0, "index")

    @property
    def index(self):
        return self.n


@pytest.mark.parametrize("wrapped", [lambda m: m, lambda m: gn.Lambertian(0.1) + 0.5 * m])
def test_a_sample_has_one_direction_for_all_wavelengths(wrapped):
    u = np.array([[0.3, 0.4]])
    for n in ([1.5, 1.6], [[1.5, 1.6]]):
        m = wrapped(_Prism(0.5, n=n))
        assert disperses(m)
        with pytest.raises(ParameterError, match=r"one wavelength: m\.at\(550"):
            m.sample(UP, u)
    for n in (1.5, [1.5], [1.5, 1.5]):
        m = wrapped(_Prism(0.5, n=n))
        assert not disperses(m) and np.isfinite(m.sample(UP, u).weight).all()
