"""Zemax: where azimuths are counted from, sample rotation, zeros, writing, damage."""

from __future__ import annotations

import math
import warnings

import numpy as np
import optical_files as files
import pytest
from format_cases import at, file_of
from places import real

import gonio as gn
from gonio.errors import FormatError, ToleranceWarning


def test_zemax_counts_azimuths_from_the_normal(tmp_path):
    m = gn.load(file_of(tmp_path, files.zemax()))
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
    m = gn.load(file_of(tmp_path, files.zemax("ASymmetrical", azimuth="0 90 270")))
    c, s, i = math.cos(math.radians(40)), math.sin(math.radians(40)), math.radians(30)
    wi = np.array([[math.sin(i), 0.0, math.cos(i)]])
    mirror, to_normal = np.array([-math.sin(i), 0, math.cos(i)]), np.array([math.cos(i), 0, math.sin(i)])
    across = np.cross(mirror, to_normal)  # a quarter turn to the left, seen from outside
    assert m.f(wi, (c * mirror + s * across)[None])[0] == pytest.approx(0.065, abs=1e-9)
    assert m.f(wi, (c * mirror - s * across)[None])[0] == pytest.approx(0.075, abs=1e-9)


def test_zemax_turns_the_sample(tmp_path):
    m = gn.load(file_of(tmp_path, files.ZEMAX_XYZ))
    assert m.channel_names == ("X", "Y", "Z")
    # Rotation 0: light from +y; azimuth 180, radial 10 is at 30 degrees on the other side.
    assert at(m, 20, 90, 30, -90) == pytest.approx([1.2, 2.2, 3.2], abs=1e-9)
    assert at(m, 20, 90, 10, -90) == pytest.approx([1.1, 2.1, 3.1], abs=1e-9)
    # Rotation 90, counterclockwise: the light is a quarter turn clockwise of that on the sample.
    assert at(m, 20, 0, 30, 180) == pytest.approx([1.4, 2.4, 3.4], abs=1e-9)


def test_zemax_zeros_below_the_horizon_are_no_data(tmp_path):
    text = files.zemax().replace("0\t40\t", "0\t80\t").replace("7.5E-02", "0").replace("4.5E-02", "0")
    m = gn.load(file_of(tmp_path, text))
    assert np.isnan(m.stored[1, 1, 0])  # 30 + 80 degrees
    assert m.stored[0, 1, 0] == 0.0  # 80 degrees, measured
    assert at(m, 30, 0, 80, 180) > 0.05, "not pulled down by what lies below"


@pytest.mark.parametrize("text", [files.zemax(), files.zemax("ASymmetrical", azimuth="0 90 180"), files.ZEMAX_XYZ])
def test_zemax_is_written_as_it_was_read(tmp_path, text):
    m = gn.load(file_of(tmp_path, text))
    gn.save(m, tmp_path / "b.bsdf", "Zemax")
    again = gn.load(tmp_path / "b.bsdf")
    assert again == m
    assert again.about["comments"] == m.about["comments"]
    np.testing.assert_array_equal(again.filed.values, m.filed.values)
    np.testing.assert_array_equal(again.filed.tis, m.filed.tis)
    assert again.filed.angles == m.filed.angles


def test_zemax_of_a_changed_table_has_the_changed_numbers(tmp_path):
    m = gn.load(file_of(tmp_path, files.zemax()))
    gn.save(m.with_brdf(2.0 * m.brdf()), tmp_path / "b.bsdf", "Zemax")
    again = gn.load(tmp_path / "b.bsdf")
    np.testing.assert_array_equal(again.stored, 2.0 * m.stored)
    assert again.about["Symmetry"] == "PlaneSymmetrical"


@pytest.mark.parametrize("ending", ["\r\n", "\r", "\n\n"])
def test_zemax_tolerates_line_ends_marks_and_case(tmp_path, ending):
    text = "\ufeff" + files.zemax().replace("\n", ending).replace("Symmetry", "SYMMETRY").replace("\t", "   ")
    reordered = text.replace("ScatterType  BRDF" + ending, "").replace("Source", "ScatterType BRDF" + ending + "Source")
    assert gn.load(file_of(tmp_path, reordered)) == gn.load(file_of(tmp_path, files.zemax(), "plain"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ScatterType  BRDF", "ScatterType BSDF", "scattertype is 'BSDF', expected one of BRDF, BTDF"),
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
        gn.load(file_of(tmp_path, text.replace(old, new, 1)))


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
    assert again == m and again.filed[:2] == m.filed[:2]
    np.testing.assert_array_equal(again.filed.values, m.filed.values)
    np.testing.assert_array_equal(again.filed.tis, m.filed.tis)


def test_real_zemax_total_is_the_albedo():
    """BrownVinyl: 15 to 75 degrees; the file's TIS leaves out what was not seen near the horizon."""
    m = gn.load(real("ansys/planesymmetric_brdf_zemax.bsdf"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToleranceWarning)  # 1e-3 is not reached near the horizon
        albedo = gn.albedo(m, gn.direction(m.axes["theta_i"], 0.0), tolerance=1e-3)
    ratio = albedo / m.about["TIS"][0, 0]
    assert ratio.min() > 1.0 and ratio.max() < 1.09 and ratio[0] < 1.02
