"""Colours of spectra against colour-science, and spectra of colours back again."""

from __future__ import annotations

import pickle
import subprocess
import sys
import warnings

import numpy as np
import pytest
from libraries import colour_science

import gonio as gn
from gonio.errors import DependencyError, NotFoundError, ParameterError, ShapeError
from gonio.formula.json_form import from_json

NM = np.arange(380.0, 781.0, 5.0)
METALS = [e.name for e in gn.materials() if e.kind == "metal"]
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def colour():
    return colour_science()


def by_colour_science(colour, R, light, observer="CIE 1931 2 Degree Standard Observer"):
    """X, Y, Z and those of white, summed every 5 nm, both over the Y of white."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its own tables
        of = [colour.SpectralDistribution(values, NM) for values in (R, np.ones(len(NM)))]
        matching, power = colour.MSDS_CMFS[observer], colour.SDS_ILLUMINANTS[light]
        xyz, white = (np.asarray(colour.sd_to_XYZ(x, matching, power)) for x in of)
    return xyz / white[1], white / white[1]


@pytest.mark.parametrize("light", ["D65", "A", "D50", "E"])
@pytest.mark.parametrize("name", METALS)
def test_metals_have_the_colours_of_colour_science(colour, name, light):
    R = gn.material(name, alpha=0, wavelengths=NM).delta_reflectance(UP)
    xyz, white = by_colour_science(colour, R, light)
    expected = colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(white))
    found = gn.colour.to_colour(R, NM, light, space="Lab")
    assert colour.delta_E(found, expected, method="CIE 2000") < 0.1
    adapted = colour.chromatic_adaptation(
        xyz, white, gn.colour.to_colour(np.ones(81), NM, space="XYZ"), transform="Bradford"
    )
    rgb = gn.colour.to_colour(R, NM, light)
    assert (
        gn.colour.colour_difference(gn.colour.to_colour(R, NM, light), adapted @ np.linalg.inv(_xyz_of_rgb()).T) < 0.1
    ), rgb


def _xyz_of_rgb():
    from gonio.pictures.colour import XYZ_OF_RGB

    return XYZ_OF_RGB


@pytest.mark.parametrize("light", [None, "D65", "A", "FL11", "LED-B1", "D5600", gn.spectra.blackbody(3000.0)])
def test_white_stays_white(colour, light):
    np.testing.assert_allclose(gn.colour.to_colour(np.ones((2, 81)), NM, light), 1.0, atol=1e-12)


def test_without_adaptation_lamps_are_orange(colour):
    red, green, blue = gn.colour.to_colour(np.ones(81), NM, "A", adaptation=None)
    assert red > 1.5 > green > 0.5 > blue > 0.0


def test_the_default_needs_no_library(monkeypatch):
    monkeypatch.setitem(sys.modules, "colour", None)
    np.testing.assert_allclose(gn.colour.to_colour(np.ones(81), NM), 1.0, atol=1e-12)
    assert gn.colour.to_colour(np.ones(81), NM, space="XYZ")[1] == pytest.approx(1.0)
    with pytest.raises(DependencyError, match=r"gonio\[spectra\]"):
        gn.spectra.illuminant("A")


LOUD = """
import warnings
import numpy
numpy.set_printoptions(precision=2)
warnings.warn("something is missing")
class A:
    wavelengths, values = [400.0, 700.0], [1.0, 2.0]
SDS_ILLUMINANTS = {"A": A}
"""


@pytest.mark.filterwarnings("error")
def test_a_library_that_warns_and_changes_how_arrays_are_printed(tmp_path, monkeypatch):
    (tmp_path / "colour.py").write_text(LOUD)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "colour", None)  # which remembers what was there
    del sys.modules["colour"]
    before = np.get_printoptions()
    assert gn.spectra.illuminant("A").at(700.0) == 2.0
    assert np.get_printoptions() == before


@pytest.mark.full
def test_the_library_changes_nothing_else(colour):
    code = "import numpy as np, gonio as gn; options = np.get_printoptions(); gn.spectra.illuminant('A'); "
    code += "print(options == np.get_printoptions())"
    ran = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True)
    assert ran.stdout == "True\n" and ran.stderr == ""


def test_daylight_by_name_is_the_default(colour):
    R = gn.material("gold", alpha=0, wavelengths=NM).delta_reflectance(UP)
    np.testing.assert_allclose(gn.colour.to_colour(R, NM, "D65"), gn.colour.to_colour(R, NM), atol=1e-4)


def test_black_bodies_are_those_of_colour_science(colour):
    from colour.colorimetry import planck_law

    c1, c2 = 3.741771852192758e-16, 1.438776877503933e-2  # CODATA 2022; by default that of ITS-90
    for kelvin in (1900.0, 5772.0):
        light = gn.spectra.blackbody(kelvin)
        nm = np.concatenate([np.arange(300.0, 831.0), [1216.0, 2000.0, 1e4, 1e5, 1e7]])
        np.testing.assert_allclose(light.at(nm), planck_law(nm * 1e-9, kelvin, c1, c2) * 1e-9, rtol=1e-9)


def test_a_black_body_is_a_formula():
    """Its integral over all wavelengths is sigma T^4/pi, sigma that of CODATA 2018."""
    light = gn.spectra.blackbody(1000.0)
    total = np.trapezoid(light.values, light.wavelengths)
    assert total == pytest.approx(5.670374419e-8 * 1000.0**4 / np.pi, rel=1e-5)
    centres = np.linspace(3000.0, 5000.0, 5)
    fine = [np.mean(light.at(np.linspace(nm - 250.0, nm + 250.0, 20001))) for nm in centres]
    assert light.bands(centres) == pytest.approx(fine, rel=5e-5)
    assert light.at(1.0) == 0.0 and light.at(2000.0) == pytest.approx(light.at(np.full((2, 3), 2000.0))[1, 2])
    lit = gn.Lambertian(0.5) * light
    assert lit == gn.expression(repr(lit)) == from_json(lit.to_json()) == pickle.loads(pickle.dumps(lit))
    with pytest.raises(ParameterError, match="above 0"):
        light.at([500.0, 0.0])


def test_names_of_lights(colour):
    assert gn.spectra.illuminant("f11") == gn.spectra.illuminant("FL11") and gn.spectra.illuminant(
        "d65"
    ) == gn.spectra.illuminant("D65")
    assert gn.spectra.illuminant("A").at(560.0) == pytest.approx(100.0, abs=1e-3)
    with pytest.raises(NotFoundError, match="did you mean"):
        gn.spectra.illuminant("D66")


def test_colours_come_back(colour):
    rng = np.random.default_rng(3)
    for rgb in [*np.eye(3), *rng.random((8, 3))]:
        m = gn.spectra.upsampled(gn.Lambertian(rgb)).at(NM)
        np.testing.assert_allclose(gn.colour.to_colour(m.rho, NM), rgb, atol=1.2e-3)
    gray = gn.spectra.upsampled(gn.Lambertian([0.4, 0.4, 0.4])).at(NM)
    np.testing.assert_allclose(gray.rho, 0.4, rtol=1e-12)
    assert gn.spectra.upsampled(gn.Lambertian(0.4)) == gn.Lambertian(0.4)


def test_upsampled_compositions_and_tables(colour):
    red = [0.6, 0.1, 0.05]
    table = gn.tables.tabulate(gn.Lambertian(red), resolution=(5, 5, 6))
    for m in (gn.Lambertian(red), red * gn.Lambertian(1.0), gn.Lambertian(red) + gn.Lambertian(0.0), table):
        bound = gn.spectra.upsampled(m).at(NM)
        np.testing.assert_allclose(gn.colour.to_colour(bound.f(UP, UP) * np.pi, NM), red, atol=1.2e-3)
        assert bound.wavelengths.tolist() == NM.tolist()
    with pytest.raises(ParameterError, match="expected linear RGB"):
        gn.spectra.upsampled(gn.Lambertian([0.1, 0.2, 0.3], wavelengths=[450, 550, 650]))
    with pytest.raises(ParameterError, match="is a map"):
        gn.spectra.upsampled(gn.Lambertian(np.full((2, 2, 3), 0.5)))


def test_bad_input(colour):
    ones = np.ones(81)
    with pytest.raises(ParameterError, match="wholly outside the visible"):
        gn.colour.to_colour([0.1, 0.2], [850.0, 1650.0])
    with pytest.raises(ParameterError, match="in micrometres"):
        gn.colour.to_colour([0.1, 0.2], [0.45, 0.55])
    with pytest.raises(ShapeError, match="values"):
        gn.colour.to_colour(ones, NM[1:])
    with pytest.raises(NotFoundError, match="no RGB space"):
        gn.colour.to_colour(ones, NM, space="sRGBx")
    with pytest.raises(NotFoundError, match="no adaptation"):
        gn.colour.to_colour(ones, NM, "A", adaptation="Bradfort")
    with pytest.raises(ParameterError, match="expected the visible"):
        gn.colour.to_colour(ones, NM, gn.Spectrum([500.0, 600.0], [1.0, 1.0]))
    with pytest.raises(ParameterError, match="no light in the visible"):
        gn.colour.to_colour(ones, NM, gn.Spectrum([300.0, 900.0], [0.0, 0.0]))
    with pytest.raises(ParameterError, match="temperature"):
        gn.spectra.blackbody(0.0)
    with pytest.raises(ShapeError, match=r"got shape \(2,\), expected"):
        gn.colour.colour_difference([0.1, 0.2], [0.1, 0.2], space="Lab")


def test_bands_outside_the_visible_are_no_colours():
    m = gn.Lambertian([0.3, 0.2], wavelengths=[858.5, 1640.0])
    picture = gn.render(m, gn.ConstantLight(1.0), size=8, samples=4)
    assert picture.pixels.shape[-1] == 2
