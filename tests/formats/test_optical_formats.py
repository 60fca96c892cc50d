"""Formats of optical design software: any material written and read, totals, real exports of one measurement."""

from __future__ import annotations

import math

import numpy as np
import optical_files as files
import pytest
from format_cases import at, pairs_off_grazing
from places import real

import gonio as gn
from gonio.errors import ParameterError
from gonio.formats import fred, lighttools, speos, zemax
from gonio.formats._optical import angle_tables
from gonio.formula import tree
from gonio.pictures.colour import XYZ_OF_RGB

METAL = gn.Conductor(0.2, 3.0)

LOBE = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.3), METAL)

BRUSHED = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.2, 0.5), METAL)

RGB = gn.Lambertian([0.1, 0.5, 0.2])


WRITERS = {
    "Zemax": (zemax, "a.bsdf"),
    "LightTools": (lighttools, "a.bsdf"),
    "Speos": (speos, "a.brdf"),
    "Speos anisotropic": (speos, "a.anisotropicbsdf"),
    "FRED": (fred, "a.txt"),
}


@pytest.mark.parametrize(
    ("name", "m", "median", "most"),
    [
        # Median and 90th percentile of the error between nodes: measured, and half as much again.
        ("Zemax", LOBE, 0.013, 0.03),
        ("LightTools", LOBE, 0.014, 0.04),
        ("Speos", LOBE, 0.014, 0.04),
        ("Speos anisotropic", LOBE, 0.014, 0.04),
        ("FRED", LOBE, 0.014, 0.04),
        ("Zemax", BRUSHED, 0.14, 0.37),
        ("LightTools", BRUSHED, 0.13, 0.45),
        ("Speos anisotropic", BRUSHED, 0.13, 0.45),
        ("FRED", BRUSHED, 0.13, 0.45),
    ],
)
def test_materials_are_written_and_read(tmp_path, name, m, median, most):
    module, file = WRITERS[name]
    module.write(m, tmp_path / file, step=10.0 if m is BRUSHED else 5.0)
    table = gn.load(tmp_path / file)
    assert tree.is_oriented(table) == (m is BRUSHED)
    wi, wo = table.directions()
    up = (wi[..., 2] > 1e-6) & (wo[..., 2] > 1e-6)
    f = table.brdf().reshape(up.shape)
    np.testing.assert_allclose(f[up], m.f(wi[up], wo[up]), rtol=2e-9)
    wi, wo = pairs_off_grazing()
    error = np.abs(table.f(wi, wo).reshape(-1) / m.f(wi, wo) - 1.0)
    assert np.quantile(error, 0.5) < median and np.quantile(error, 0.9) < most
    module.write(table, tmp_path / ("b" + file))
    assert (tmp_path / ("b" + file)).read_bytes() == (tmp_path / file).read_bytes()


@pytest.mark.parametrize("module", [zemax, lighttools])
def test_rgb_is_written_as_tristimulus_values(tmp_path, module):
    module.write(RGB, tmp_path / "a.bsdf", step=30.0)
    m = gn.load(tmp_path / "a.bsdf")
    assert m.channel_names == ("X", "Y", "Z")
    xyz = np.array([0.1, 0.5, 0.2]) @ XYZ_OF_RGB.T / math.pi
    np.testing.assert_allclose(at(m, 20, 0, 30, 40), xyz, rtol=1e-12)
    assert xyz[1] * math.pi == pytest.approx(0.2126 * 0.1 + 0.7152 * 0.5 + 0.0722 * 0.2, rel=1e-4)
    module.write(RGB, tmp_path / "g.bsdf", step=30.0, channel=1)
    assert np.ravel(at(gn.load(tmp_path / "g.bsdf"), 20, 0, 30, 40)) == pytest.approx([0.5 / math.pi])
    white = XYZ_OF_RGB.sum(1)
    assert white == pytest.approx([0.9505, 1.0, 1.089], abs=1e-3), "D65"


def test_total_is_the_albedo():
    for m, theta in ((gn.Lambertian(0.5), 0.0), (LOBE, 40.0), (gn.Microfacet(gn.GGX(0.02), METAL), 80.0)):
        albedo = gn.albedo(m, gn.direction(math.radians(theta), 0.0))
        assert angle_tables.totals(m, [theta], [0.0]).item() == pytest.approx(float(albedo), abs=5e-4)


def test_writers_say_the_total_and_keep_the_angles_asked_for(tmp_path):
    zemax.write(gn.Lambertian(0.5), tmp_path / "a.bsdf", aoi=[0, 37.5], radial=[0, 10, 100], azimuth=[0, 45, 180])
    m = gn.load(tmp_path / "a.bsdf")
    assert m.filed.angles["AngleOfIncidence"] == [0.0, 37.5]
    assert m.filed.angles["ScatterAzimuth"] == [0.0, 45.0, 180.0]
    assert m.about["TIS"][0, 0] == pytest.approx([0.5, 0.5], abs=1e-3)
    speos.write(gn.Lambertian(0.5), tmp_path / "a.brdf", theta_i=[0, 30], theta_o=[0, 45, 90], phi=[0, 180])
    m = gn.load(tmp_path / "a.brdf")
    assert m.channel_names == (550.0,) and m.filed.parts["reflection"].tables[0].theta.tolist() == [0.0, 45.0, 90.0]
    speos.write(RGB, tmp_path / "a.brdf", wavelengths=[465, 532, 630])
    assert gn.load(tmp_path / "a.brdf").channel_names == (465.0, 532.0, 630.0)


@pytest.mark.parametrize("name", WRITERS)
def test_what_the_formats_cannot_hold(tmp_path, name):
    module, file = WRITERS[name]
    with pytest.raises(ParameterError, match="mirror"):
        module.write(gn.IdealSpecular(0.5) + gn.Lambertian(0.1), tmp_path / file)
    with pytest.raises(ParameterError, match="map"):
        module.write(gn.Lambertian(np.full((2, 2, 3), 0.5)), tmp_path / file)
    with pytest.raises(ParameterError, match="channel"):
        module.write(gn.Lambertian([0.1, 0.2, 0.3, 0.4]), tmp_path / file)
    with pytest.raises(ParameterError, match="step"):
        gn.save(gn.Lambertian(0.5), tmp_path / file, module.NAME, step=0.0)
    with pytest.raises(ParameterError, match="expected one of"):
        module.write(gn.Lambertian(0.5), tmp_path / file, channel="infrared")
    if name == "Speos":
        with pytest.raises(ParameterError, match="anisotropicbsdf"):
            module.write(BRUSHED, tmp_path / file)
    assert not list(tmp_path.iterdir()), "nothing is left behind"


@pytest.mark.parametrize("name", files.SEEDS)
def test_every_file_is_claimed_by_one_format(name):
    from gonio.formats import formats

    data = files.SEEDS[name]()
    claims = [m.NAME for m in formats() if m.matches(data[:4096], len(data))]
    assert len(claims) == 1 and name.startswith(claims[0])


def test_real_exports_of_one_measurement_agree():
    names = ("test_jdv.jdv", "test_raywiz.jdv", "test_lighttools.txt", "test_speos.rtd")
    first, *others = (gn.load(real(f"ua_loft/formats/{name}")) for name in names)
    for other in others:
        np.testing.assert_array_equal(other.stored, first.stored)
        assert other.axes.keys() == first.axes.keys()
    assert first.about["measurements"] == 2
    # The direction of the normal was measured twice; the instrument's own table has the same mean, in two decimals.
    assert first.stored[0, 0, 0] * math.pi == pytest.approx(-29095.56, abs=0.006)
