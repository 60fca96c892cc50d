"""Zemax, LightTools, Speos, FRED and the RT-300S: geometry, numbers, round trips, real and damaged files."""

from __future__ import annotations

import math
import sys
import warnings
from pathlib import Path

import numpy as np
import optical_files as files
import pytest

import gonio as gn
from gonio.errors import DependencyError, FormatError, ParameterError, ToleranceWarning
from gonio.formats import fred, jdv, lighttools, rt300s_xls, speos, zemax
from gonio.formats._optical import angle_tables
from gonio.pictures.colour import XYZ_OF_RGB
from gonio.tables.gridded import Gridded
from gonio.tables.scattered import Scattered

SHARED = Path(__file__).parents[2] / "shared" / "data"
LOFT = SHARED / "ua_loft"

METAL = gn.Conductor(0.2, 3.0)
LOBE = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.3), METAL)
BRUSHED = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.2, 0.5), METAL)
RGB = gn.Lambertian([0.1, 0.5, 0.2])


def real(name: str) -> Path:
    path = SHARED / name
    if not path.exists():
        pytest.skip(f"{name} is not in ../shared/data: real files are not part of the repository")
    return path


def made(tmp_path: Path, text: str | bytes, name: str = "file") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def at(m, theta_i: float, phi_i: float, theta_o: float, phi_o: float):
    """f at angles in degrees."""
    return m.f_angles(*(np.radians(np.array([x])) for x in (theta_i, phi_i, theta_o, phi_o)))[0]


def pairs(n: int = 500, seed: int = 1):
    random = np.random.default_rng(seed)
    w = [gn.direction(np.arccos(random.uniform(0.25, 1.0, n)), random.uniform(-np.pi, np.pi, n)) for _ in range(2)]
    return w[0], w[1]


# Zemax -----------------------------------------------------------------------------------------------------------


def test_zemax_counts_azimuths_from_the_normal(tmp_path):
    m = gn.load(made(tmp_path, files.zemax()))
    # Light at 30 degrees from phi 0: the mirror direction is (30, 180).
    assert at(m, 30, 0, 30, 180) == pytest.approx(0.2, abs=1e-9)
    # Radial 40, azimuth 0: towards the normal and past it, to 10 degrees on the side of the light.
    assert at(m, 30, 0, 10, 0) == pytest.approx(0.055, abs=1e-9)
    # Azimuth 180: towards the horizon.
    assert at(m, 30, 0, 70, 180) == pytest.approx(0.075, abs=1e-9)
    assert at(m, 0, 0, 40, 180) == pytest.approx(0.045, abs=1e-9)
    # Azimuth 90, on either side of the plane of incidence: wo = cos 40 s + sin 40 (0, -1, 0), by hand.
    c, s, i = math.cos(math.radians(40)), math.sin(math.radians(40)), math.radians(30)
    wi = np.array([[math.sin(i), 0.0, math.cos(i)]])
    for sign in (-1.0, 1.0):
        wo = np.array([[-c * math.sin(i), sign * s, c * math.cos(i)]])
        assert m.f(wi, wo)[0] == pytest.approx(0.065, abs=1e-9)
    assert m.about["TIS"].tolist() == [[[0.25, 0.125]]]
    assert m.about["comments"] == ("made by hand", "second comment")


def test_zemax_counts_azimuths_counterclockwise_against_the_mirror_direction(tmp_path):
    m = gn.load(made(tmp_path, files.zemax("ASymmetrical", azimuth="0 90 270")))
    c, s, i = math.cos(math.radians(40)), math.sin(math.radians(40)), math.radians(30)
    wi = np.array([[math.sin(i), 0.0, math.cos(i)]])
    mirror, to_normal = np.array([-math.sin(i), 0, math.cos(i)]), np.array([math.cos(i), 0, math.sin(i)])
    across = np.cross(mirror, to_normal)  # a quarter turn to the left, seen from outside
    assert m.f(wi, (c * mirror + s * across)[None])[0] == pytest.approx(0.065, abs=1e-9)
    assert m.f(wi, (c * mirror - s * across)[None])[0] == pytest.approx(0.075, abs=1e-9)


def test_zemax_turns_the_sample(tmp_path):
    m = gn.load(made(tmp_path, files.ZEMAX_XYZ))
    assert m.channel_names == ("X", "Y", "Z")
    # Rotation 0: light from +y; azimuth 180, radial 10 is at 30 degrees on the other side.
    assert at(m, 20, 90, 30, -90) == pytest.approx([1.2, 2.2, 3.2], abs=1e-9)
    assert at(m, 20, 90, 10, -90) == pytest.approx([1.1, 2.1, 3.1], abs=1e-9)
    # Rotation 90, counterclockwise: the light is a quarter turn clockwise of that on the sample.
    assert at(m, 20, 0, 30, 180) == pytest.approx([1.4, 2.4, 3.4], abs=1e-9)


def test_zemax_zeros_below_the_horizon_are_no_data(tmp_path):
    text = files.zemax().replace("0\t40\t", "0\t80\t").replace("7.5E-02", "0").replace("4.5E-02", "0")
    m = gn.load(made(tmp_path, text))
    assert np.isnan(m.stored[1, 1, 0])  # 30 + 80 degrees
    assert m.stored[0, 1, 0] == 0.0  # 80 degrees, measured
    assert at(m, 30, 0, 80, 180) > 0.05, "not pulled down by what lies below"


@pytest.mark.parametrize("text", [files.zemax(), files.zemax("ASymmetrical", azimuth="0 90 180"), files.ZEMAX_XYZ])
def test_zemax_is_written_as_it_was_read(tmp_path, text):
    m = gn.load(made(tmp_path, text))
    gn.save(m, tmp_path / "b.bsdf", "Zemax")
    again = gn.load(tmp_path / "b.bsdf")
    assert again == m
    assert again.about["comments"] == m.about["comments"]
    np.testing.assert_array_equal(again.filed.values, m.filed.values)
    np.testing.assert_array_equal(again.filed.tis, m.filed.tis)
    assert again.filed[1:5] == m.filed[1:5]


def test_zemax_of_a_changed_table_has_the_changed_numbers(tmp_path):
    m = gn.load(made(tmp_path, files.zemax()))
    gn.save(m.with_brdf(2.0 * m.brdf()), tmp_path / "b.bsdf", "Zemax")
    again = gn.load(tmp_path / "b.bsdf")
    np.testing.assert_array_equal(again.stored, 2.0 * m.stored)
    assert again.about["Symmetry"] == "PlaneSymmetrical"


@pytest.mark.parametrize("ending", ["\r\n", "\r", "\n\n"])
def test_zemax_tolerates_line_ends_marks_and_case(tmp_path, ending):
    text = "\ufeff" + files.zemax().replace("\n", ending).replace("Symmetry", "SYMMETRY").replace("\t", "   ")
    reordered = text.replace("ScatterType  BRDF" + ending, "").replace("Source", "ScatterType BRDF" + ending + "Source")
    assert gn.load(made(tmp_path, reordered)) == gn.load(made(tmp_path, files.zemax(), "plain"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ScatterType  BRDF", "ScatterType BTDF", "transmission"),
        ("1e-1\t2.5E-02\n", "1e-1\n", "line 20"),
        ("DataEnd", "TIS 1", "tables"),
        ("TIS 0.125\n", ",\nTIS 0.125\n", "line 22: got ','"),
        ("TIS 0.125\n.2\t5.5E-02\n.2\t6.5E-02\n.2\t7.5E-02\n", "", "cut short"),
        ("0 30", "30 0", "AngleOfIncidence"),
        ("0 30", "0 95", "AngleOfIncidence"),
        ("0 90 180", "0 90 270", "ScatterAzimuth"),
        ("AngleOfIncidence  2", "AngleOfIncidence 999999999", "line"),
        ("Monochrome\nScatter", "Rainbow\nScatter", "spectralcontent"),
        ("PlaneSymmetrical", "Round", "symmetry"),
        ("ScatterRadial 2\n0\t40\t\n", "", "ScatterRadial"),
        ("\nMonochrome", "\nTristimulusY", "promises"),
        ("0.25", "a quarter", "TIS"),
    ],
)
def test_zemax_damaged(tmp_path, old, new, words):
    text = files.zemax()
    assert old in text
    with pytest.raises(FormatError, match=words):
        gn.load(made(tmp_path, text.replace(old, new, 1)))


# LightTools ------------------------------------------------------------------------------------------------------


def test_lighttools_light_comes_from_azimuth_90(tmp_path):
    m = gn.load(made(tmp_path, files.LIGHTTOOLS))
    assert m.channel_names == (550.0,)
    assert at(m, 40, 0, 45, 180) == pytest.approx(0.8)  # azimuth 270
    assert at(m, 40, 0, 45, 0) == pytest.approx(0.7)  # azimuth 90: back to the light
    assert at(m, 20, 10, 0, 0) == pytest.approx(0.3)  # between AOI 0 and 40
    with pytest.raises(FormatError, match="back"):
        lighttools.read(tmp_path / "file", side="back")


def test_lighttools_plane_symmetrical_files_hold_either_side(tmp_path):
    full = gn.load(made(tmp_path, files.LIGHTTOOLS))
    rows = files.LIGHTTOOLS.replace("Asymmetric", "PlaneSymmetrical").replace("ScatterAzimuth 4", "ScatterAzimuth 3")
    one = rows.replace("0 90 180 270", "90 180 270").replace("0.1 0.2\n0.1 0.3", "0.1 0.3").replace("0.5 0.6\n", "", 1)
    other = rows.replace("0 90 180 270", "-90 0 90").replace("0.01 0.02\n", "", 1)
    for old, new in (("0.1 0.2\n0.1 0.3\n0.1 0.2\n0.1 0.4", "0.1 0.4\n0.1 0.2\n0.1 0.3"),):
        other = other.replace(old, new)
    other = other.replace("0.5 0.6\n0.5 0.7\n0.5 0.6\n0.5 0.8", "0.5 0.8\n0.5 0.6\n0.5 0.7")
    wi, wo = pairs()
    for text in (one.replace("0.01 0.02\n", "", 1), other):
        m = gn.load(made(tmp_path, text))
        assert m.is_mirrored
        np.testing.assert_allclose(m.f(wi, wo), full.f(wi, wo), rtol=1e-12)
    with pytest.raises(FormatError, match="one side"):
        gn.load(made(tmp_path, rows.replace("0 90 180 270", "0 90 180")))


def test_lighttools_keeps_all_blocks(tmp_path):
    m = gn.load(made(tmp_path, files.LIGHTTOOLS))
    gn.save(m, tmp_path / "b.bsdf", "LightTools")
    again = gn.load(tmp_path / "b.bsdf")
    assert again == m and "BTDF" in (tmp_path / "b.bsdf").read_text()
    for a, b in zip(m.filed.blocks, again.filed.blocks, strict=True):
        assert a[:-1] == b[:-1]
        np.testing.assert_array_equal(a.values, b.values)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("0.1 0.3\n", "0.1\n", "values"),
        ("AOI 40", "AOI 0", "two tables"),
        ("AOI 40", "AOI 400", "AOI"),
        ("ScatterType BRDF", "ScatterType BSDF", "ScatterType"),
        ("0 45\n", "0 45 50\n", "ScatterRadial"),
        ("ScatterRadial 2\n0 45\n", "ScatterRadial 2 0 45 50\n", "2 angles, not 3"),
        ("DataBegin\n", "", "DataBegin"),
        ("0 90 180 270", "0 90 180 480", "covers"),
        ("Wavelength 550", "Wavelength 600", "one for each"),
        ("Front", "Inside", "Side"),
    ],
)
def test_lighttools_damaged(tmp_path, old, new, words):
    text = files.LIGHTTOOLS
    assert old in text
    with pytest.raises(FormatError, match=words):
        gn.load(made(tmp_path, text.replace(old, new, 1)))


# Speos -----------------------------------------------------------------------------------------------------------


def test_speos_tables_are_normalised_by_their_shares(tmp_path):
    m = gn.load(made(tmp_path, files.speos()))
    assert m.channel_names == (500.0, 600.0)
    assert (m.filed.comment, m.filed.description) == ("a comment", "two\nlines..")
    # Table k: number x cos(theta_o) is k at 0, (k.5 + k.25)/2 cos 60 = half of that at 60; with a linear course
    # between, integral of (a + b theta) sin(theta) = a (1 - cos t) + b (sin t - t cos t), times 2 pi.
    t = math.radians(60.0)
    for k, (theta_i, channel) in enumerate(((0, 0), (0, 1), (40, 0), (40, 1)), start=1):
        b = (0.5 * (k + 0.375) - k) / t
        share = 2.0 * math.pi * (k * (1.0 - math.cos(t)) + b * (math.sin(t) - t * math.cos(t)))
        scale = 0.1 * k / share
        assert at(m, theta_i, 0, 0, 0)[channel] == pytest.approx(k * scale, rel=1e-9)
        if theta_i == 0:
            continue  # no plane of incidence
        assert at(m, theta_i, 0, 60, 180)[channel] == pytest.approx((k + 0.5) * scale, rel=1e-9)  # phi 0: forward
        assert at(m, theta_i, 0, 60, 0)[channel] == pytest.approx((k + 0.25) * scale, rel=1e-9)


def test_speos_intensity_is_the_brdf_times_the_cosine(tmp_path):
    of_f, of_i = (gn.load(made(tmp_path, files.speos(flag), str(flag))) for flag in (1, 0))
    at_60 = [at(m, 40, 0, 60, 180)[0] / at(m, 40, 0, 0, 0)[0] for m in (of_f, of_i)]
    assert at_60 == pytest.approx([3.5 / 3.0, 7.0 / 3.0], rel=1e-8)


def test_speos_one_spectrum_scales_every_table(tmp_path):
    m = gn.load(made(tmp_path, files.SPEOS_ANISOTROPIC))
    assert m.channel_names == (400.0, 800.0)
    red = speos.read(tmp_path / "file", wavelengths=[500.0, 600.0])
    # Angle of the sample 0: light travels along x, so it comes from 180; forward is phi_o = 0.
    forward, left, back = (at(m, 20, 180, 60, phi) for phi in (0, 90, 180))
    assert left / forward == pytest.approx([1.5, 1.5]) and back / forward == pytest.approx([2.0, 2.0])
    assert forward[1] == pytest.approx(3.0 * forward[0])
    assert at(red, 20, 180, 60, 0) == pytest.approx([1.5 * forward[0], 2.0 * forward[0]])
    # Angle 90: the same, turned, with the same scale.
    turned = [at(m, 20, 270, 60, 90 + phi)[0] / forward[0] for phi in (0, 90, 180, 270)]
    assert turned == pytest.approx([3.0, 3.5, 4.0, 4.5])
    # The table lit at 0 reflects 10 %: mean of (2, 3, 4, 3) x cos 60 = 1.5 at 60, 1 at 0.
    t = math.radians(60.0)
    integral = 2.0 * math.pi * ((1.0 - math.cos(t)) + 0.5 / t * (math.sin(t) - t * math.cos(t)))
    assert forward[0] == pytest.approx(2.0 * 0.1 / integral, rel=1e-9)


def test_speos_azimuths_need_not_fit_the_angles_of_the_sample(tmp_path):
    m = gn.load(made(tmp_path, files.SPEOS_ANISOTROPIC.replace("0\t90\n1", "0\t60\n1")))
    fits = gn.load(made(tmp_path, files.SPEOS_ANISOTROPIC, "fits"))
    np.testing.assert_allclose(np.degrees(m.axes["phi_o"]), [0, 60, 90, 150, 180, 240, 270, 330])
    for phi in (0.0, 30.0, 100.0, 200.0, 359.0):
        assert at(m, 20, 180, 60, phi) == pytest.approx(at(fits, 20, 180, 60, phi))
        assert at(m, 20, 240, 60, 60 + phi) == pytest.approx(at(fits, 20, 270, 60, 90 + phi))


@pytest.mark.parametrize(
    ("text", "name"),
    [(files.speos(), "a.brdf"), (files.speos(0), "a.brdf"), (files.SPEOS_ANISOTROPIC, "a.anisotropicbsdf")],
)
def test_speos_is_written_as_it_was_read(tmp_path, text, name):
    m = gn.load(made(tmp_path, text))
    gn.save(m, tmp_path / name, "Speos")
    again = gn.load(tmp_path / name)
    assert again == m and again.filed[:5] == m.filed[:5]
    for a, b in zip(m.filed.parts["reflection"].tables, again.filed.parts["reflection"].tables, strict=True):
        np.testing.assert_array_equal(a.values, b.values)
        assert a.share == b.share or math.isnan(a.share)


def test_speos_keeps_transmission(tmp_path):
    text = files.speos()
    tables = text[text.index("10\n2\t2") :].replace("\n0\t", "\n120\t").replace("\n60\t", "\n180\t")
    both = text.replace("1\t0\n1\n", "1\t1\n1\n") + tables
    m = gn.load(made(tmp_path, both))
    gn.save(m, tmp_path / "b.brdf", "Speos")
    assert gn.load(tmp_path / "b.brdf").filed.parts["transmission"].tables[3].theta.tolist() == [120.0, 180.0]
    with pytest.raises(FormatError, match="transmission only"):
        gn.load(made(tmp_path, text.replace("1\t0\n1\n", "0\t1\n1\n")))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("v8.0\n0", "v8.0\n1", "binary"),
        ("v8.0", "v6.1", "version"),
        ("\n11\n", "\neleven\n", "characters"),
        ("\n11\n", "\n²3\n", "characters"),
        ("\n11\n", "\n" + "1" * 5000 + "\n", "characters"),
        ("v8.0", "v8.²", "version"),
        ("2\t2\n0\t40", "3\t2\n0\t40", "line"),
        ("60\t4.5\t4.25\n", "", "cut short"),
        ("0\t180\n0\t3", "0\t90\n0\t3", "different"),
        ("500\t600", "600\t500", "wavelengths"),
        ("60\t2.5\t2.25", "60\t2.5", "line"),
        ("2\t2\n\t0\t180", "2\t999999999\n\t0\t180", "line"),
    ],
)
def test_speos_damaged(tmp_path, old, new, words):
    text = files.speos()
    assert old in text
    with pytest.raises(FormatError, match=words):
        gn.load(made(tmp_path, text.replace(old, new, 1)))


def test_speos_spectra_do_not_multiply_memory(tmp_path):
    rows = "".join(f"{400 + k / 1000}\t{1 + k / 1000}\n" for k in range(5000))
    table = "".join(f"{t}\t" + "\t".join(["1"] * 72) + "\n" for t in range(90))
    tables = ("90 72\n\t" + "\t".join(str(5 * p) for p in range(72)) + "\n" + table) * 2
    start = files.SPEOS_ANISOTROPIC.partition("2\n400\t10")[0]
    path = made(tmp_path, f"{start}5000\n{rows}{tables}")
    with pytest.raises(FormatError, match="wavelengths="):
        gn.load(path)
    assert speos.read(path, wavelengths=[402.0]).stored.shape[-1] == 1


# FRED ------------------------------------------------------------------------------------------------------------


def test_fred_azimuth_0_is_forward(tmp_path):
    m = gn.load(made(tmp_path, files.FRED.format(scale=2)))
    assert m.is_mirrored
    assert [at(m, 10, 0, 30, phi) for phi in (180, 90, 270, 0)] == pytest.approx([0.5, 0.25, 0.25, 0.125])
    assert at(m, 10, 25, 0, 0) == pytest.approx(1.0), "one row along the normal stands for all azimuths"
    whole = files.FRED.format(scale=2).replace("30\t90\t0.125", "30\t270\t0.125")
    assert at(gn.load(made(tmp_path, whole)), 10, 0, 30, 90) == pytest.approx(0.25)


def test_fred_several_incident_azimuths_are_an_anisotropic_material(tmp_path):
    text = "type bsdf_data\nformat angles=rad bsdf=value\n" + "".join(
        f"0.5 {a}\n0.5 {b} {a + b + 1}\n0.5 {a} {a + a + 1}\n" for a, b in ((0.0, 1.0), (1.0, 0.0))
    )
    m = gn.load(made(tmp_path, text))
    assert m.is_oriented()
    half = math.degrees(0.5)
    assert at(m, half, 180, half, math.degrees(1.0)) == pytest.approx(2.0)
    assert at(m, half, 180 + math.degrees(1.0), half, math.degrees(1.0)) == pytest.approx(3.0)


def test_fred_sparse_rows_are_scattered(tmp_path):
    rows = "".join(f"{10 + k} 0\n{5 + 3 * k} {7 * k} 0.{k + 1}\n" for k in range(8))
    m = gn.load(made(tmp_path, f"type bsdf_data\nformat angles=deg bsdf=value scale=1\n{rows}"))
    assert isinstance(m, Scattered)
    assert m.f(*pairs(5)).shape == (5,)


@pytest.mark.parametrize("kind", ["read", "table"])
def test_fred_is_written_as_it_was_read(tmp_path, kind):
    m = gn.load(made(tmp_path, files.FRED.format(scale="0.5")))
    given = m if kind == "read" else Gridded("angles", m.axes, m.stored, mirrored=True)
    gn.save(given, tmp_path / "b.txt", "FRED")
    again = gn.load(tmp_path / "b.txt")
    np.testing.assert_array_equal(again.stored, m.stored)
    assert again.about["scale"] == (0.5 if kind == "read" else 1.0)
    assert len(again.filed.rows) == 4


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("angles=deg", "angles=sines", "angles=deg"),
        ("bsdf=value", "bsdf=log", "bsdf=value"),
        ("30\t90\t0.125\n", "30\t90\t0.125\t1\n", "line 6"),
        ("10\t0\n", "", "line 3"),
        ("30\t180", "130\t180", "polar"),
        ("30\t180", "30\t18000", "azimuths"),
        ("type bsdf_data", "type bsdf_data x", "first line"),
        ("scale=1", "scale=one", "line 2"),
    ],
)
def test_fred_damaged(tmp_path, old, new, words):
    text = files.FRED.format(scale=1)
    assert old in text
    with pytest.raises(FormatError, match=words):
        gn.load(made(tmp_path, text.replace(old, new, 1)))


# RT-300S ---------------------------------------------------------------------------------------------------------

DIALECTS = {"RT-300S": files.JDV, "Raywiz": files.RAYWIZ, "Reflet": files.REFLET, "Speos": files.RTD}


@pytest.mark.parametrize("dialect", [*DIALECTS, "workbook"])
def test_rt300s_angles_and_quantity(tmp_path, dialect):
    if dialect == "workbook":
        pytest.importorskip("xlrd", reason="xlrd is not installed")
    m = gn.load(made(tmp_path, DIALECTS.get(dialect) or files.workbook(files.SHEET)))
    assert m.quantity == "brdf * cos(theta_o)"
    unit = math.pi * math.cos(math.radians(30.0))
    # Azimuth -90, Receive 30: the mirror direction of Incidence 30. Azimuth 0: a quarter turn on.
    assert at(m, 30, 0, 30, 180) * unit == pytest.approx(3.0, rel=1e-9)
    assert at(m, 30, 0, 30, 0) * unit == pytest.approx(1.0, rel=1e-9)
    assert at(m, 30, 0, 30, 270) * unit == pytest.approx(5.0, rel=1e-9)
    assert at(m, 30, 0, 30, 90) * unit == pytest.approx(4.0, rel=1e-9)
    assert at(m, 30, 0, 0, 0) * math.pi == pytest.approx(2.0, rel=1e-9)


def test_rt300s_repeated_measurements(tmp_path):
    second = files.JDV.replace("\t3\n", "\t30\n")
    path = made(tmp_path, files.JDV + second)
    unit = math.pi * math.cos(math.radians(30.0))
    read = [at(jdv.read(path, measurement=k), 30, 0, 30, 180) * unit for k in (0, 1, -1)]
    assert read == pytest.approx([3.0, 30.0, 30.0])
    assert gn.load(path).about["measurements"] == 2
    with pytest.raises(FormatError, match="measurement=2"):
        jdv.read(path, measurement=2)


def test_rt300s_values_of_one_direction_are_averaged(tmp_path):
    text = files.JDV.replace("Azimuth:\t-90,0,90", "Azimuth:\t-90,90,180").replace("\n0\t4\t2\t5", "\n90\t7\t4\t3")
    m = gn.load(made(tmp_path, text))
    unit = math.pi * math.cos(math.radians(30.0))
    assert at(m, 30, 0, 30, 180) * unit == pytest.approx(5.0)  # (-90, 30) and (90, -30)
    assert at(m, 30, 0, 30, 0) * unit == pytest.approx(2.0)
    assert at(m, 30, 0, 0, 0) * math.pi == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("dialect", "old", "new", "words"),
    [
        ("RT-300S", "0\t4\t2\t5\n", "", "azimuth"),
        ("RT-300S", "0\t4\t2\t5\n", "0\t4\t2\n", "line 11"),
        ("RT-300S", "Incidence:\t30", "Incidence:\t", "Incidence"),
        ("RT-300S", "Raw data", "Cooked data", "raw data"),
        ("RT-300S", "-30,30,30", "-30,30,1e-300", "step"),
        ("Raywiz", "2\t2\t\t\n", "2\t2\t2\t\n", "line"),
        ("Reflet", "Theta Lighting\t30", "Theta Lighting\t95", "Incidence 95"),
        ("Reflet", "\n30\t3\t5", "", "theta measure"),
        ("Speos", "Sample 30", "Sample", "angle of incidence"),
        ("Speos", "-30\t1\t4\t\n", "-30\t1\t\n", "line"),
        ("Speos", "0\t2\t2\t\n", ",\n0\t2\t2\t\n", "line 16: got ','"),
        ("Speos", "Sample 30", "Sample ٣", "angle of incidence"),
    ],
)
def test_rt300s_damaged(tmp_path, dialect, old, new, words):
    text = DIALECTS[dialect]
    assert old in text
    with pytest.raises(FormatError, match=words):
        gn.load(made(tmp_path, text.replace(old, new, 1)))


def test_workbooks_that_are_not_of_the_instrument(tmp_path):
    pytest.importorskip("xlrd", reason="xlrd is not installed")
    for change, words in ((lambda s: s[:4], "rt"), (lambda s: [r[:3] for r in s[:4]] + [["RT", 1.0, "x"]], "column")):
        with pytest.raises(FormatError, match=words):
            gn.load(made(tmp_path, files.workbook(change(files.SHEET))))
    with pytest.raises(FormatError, match="workbook"):
        gn.load(made(tmp_path, files.workbook(files.SHEET)[:2000]))


def test_workbooks_need_xlrd(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "xlrd", None)
    with pytest.raises(DependencyError, match=r"gonio\[io\]"):
        gn.load(made(tmp_path, files.workbook(files.SHEET)))


# Any material ----------------------------------------------------------------------------------------------------

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
    assert table.is_oriented() == (m is BRUSHED)
    wi, wo = table.directions()
    up = (wi[..., 2] > 1e-6) & (wo[..., 2] > 1e-6)
    f = table.brdf().reshape(up.shape)
    np.testing.assert_allclose(f[up], m.f(wi[up], wo[up]), rtol=2e-9)
    wi, wo = pairs()
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
        t = math.radians(theta)
        assert angle_tables.totals(m, [theta], [0.0]).item() == pytest.approx(
            float(gn.albedo(m, gn.direction(t, 0.0))), abs=5e-4
        )


def test_writers_say_the_total_and_keep_the_angles_asked_for(tmp_path):
    zemax.write(gn.Lambertian(0.5), tmp_path / "a.bsdf", aoi=[0, 37.5], radial=[0, 10, 100], azimuth=[0, 45, 180])
    m = gn.load(tmp_path / "a.bsdf")
    assert m.filed.incidence == [0.0, 37.5] and m.filed.azimuth == [0.0, 45.0, 180.0]
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


# Real files ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ansys/planesymmetric_brdf_zemax.bsdf", "ua_loft/AnoBlackEC1onAlum.bsdf"])
def test_real_zemax_zeros_lie_at_the_horizon(tmp_path, name):
    """The rule of azimuths: instruments saw nothing below 5 or 10 degrees of elevation; tables have 0 there."""
    m = gn.load(real(name))
    _, wo = m.directions()
    elevation = np.degrees(np.arcsin(wo[..., 2]))
    value = np.nan_to_num(m.stored)
    assert elevation[value > 0.0].min() > 4.8 and elevation[value == 0.0].max() < 10.0
    gn.save(m, tmp_path / "b.bsdf", "Zemax")
    again = gn.load(tmp_path / "b.bsdf")
    assert again == m and again.filed[:5] == m.filed[:5]
    np.testing.assert_array_equal(again.filed.values, m.filed.values)
    np.testing.assert_array_equal(again.filed.tis, m.filed.tis)


def test_real_zemax_total_is_the_albedo():
    """BrownVinyl: 15 to 75 degrees; the file's TIS leaves out what was not seen near the horizon."""
    m = gn.load(real("ansys/planesymmetric_brdf_zemax.bsdf"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToleranceWarning)
        albedo = gn.albedo(m, gn.direction(m.axes["theta_i"], 0.0), tolerance=1e-3)
    ratio = albedo / m.about["TIS"][0, 0]
    assert ratio.min() > 1.0 and ratio.max() < 1.09 and ratio[0] < 1.02


def test_real_fred_zemax_and_workbook_hold_one_measurement():
    zemax_file = gn.load(real("ua_loft/AnoBlackEC1onAlum.bsdf"))
    fred_file = gn.load(real("ua_loft/AnoBlackEC1onAlum.fred.txt"))
    # At the mirror direction of 10 degrees both have the digits of one number.
    assert zemax_file.stored[0, 0, 0] == 0.0348 and at(fred_file, 10, 0, 10, 180) == pytest.approx(0.0348, abs=1e-9)
    wi, wo = zemax_file.directions()
    seen = (wo[..., 2] > 0.18) & (np.nan_to_num(zemax_file.stored) > 0.0)
    # Their laboratory moved and interpolated the one after another correction than the other: no closer than this.
    ratio = np.abs(fred_file.f(wi[seen], wo[seen]) / zemax_file.stored[seen] - 1.0)
    assert np.nanmedian(ratio) < 0.07 and np.nanquantile(ratio, 0.9) < 0.17
    pytest.importorskip("xlrd", reason="xlrd is not installed")
    raw = gn.load(real("ua_loft/raw_EC1.xls"))
    wi, wo = fred_file.directions()
    known = fred_file.valid
    wi, wo, f = wi[known], wo[known], fred_file.stored[known]
    mean = 0.5 * (raw.f(wi, wo) + raw.f(wi, wo * [1.0, -1.0, 1.0]))  # what it did for both sides
    rt = math.pi * wo[:, 2] * (mean - f)
    assert np.abs(rt).max() < 0.0042 and abs(rt.mean()) < 6e-4, "the measurement without light that it subtracted"
    assert raw.stored.shape == (4, 17, 36) and raw.about["method"] == "BRDF_LD"


def test_real_fred_is_written_as_it_was_read(tmp_path):
    m = gn.load(real("ua_loft/AnoBlackEC1onAlum.fred.txt"))
    for k, given in enumerate((m, Gridded("angles", m.axes, m.stored, mirrored=True))):
        gn.save(given, tmp_path / f"{k}.txt", "FRED")
        again = gn.load(tmp_path / f"{k}.txt")
        np.testing.assert_array_equal(again.filed.rows, m.filed.rows)
        np.testing.assert_array_equal(again.stored, m.stored)


def test_real_exports_of_one_measurement_agree():
    names = ("test_jdv.jdv", "test_raywiz.jdv", "test_lighttools.txt", "test_speos.rtd")
    first, *others = (gn.load(real(f"ua_loft/formats/{name}")) for name in names)
    for other in others:
        np.testing.assert_array_equal(other.stored, first.stored)
        assert other.axes.keys() == first.axes.keys()
    assert first.about["measurements"] == 2
    # The direction of the normal was measured twice; the instrument's own table has the same mean, in two decimals.
    assert first.stored[0, 0, 0] * math.pi == pytest.approx(-29095.56, abs=0.006)


def test_the_modules_are_formats():
    for module in (zemax, lighttools, speos, fred, jdv, rt300s_xls):
        assert module.NAME and module.SUFFIXES and module.DESCRIPTION and module.ORACLE
