"""ASTM E1392: columns in any order, angles that lean to the other side, transmission, damage."""

import math

import numpy as np
import pytest
from format_cases import f, loaded
from text_files import ASTM

import gonio as gn
from gonio.formats import astm, csv_table
from gonio.tables.gridded import Gridded

# ASTM


def test_astm_rows(tmp_path):
    m = loaded(tmp_path, ASTM)
    assert m.about == {"TITLE": "grey tile", "SAMPLE_ID": "7"}
    assert m.channel_names == ("R", "G", "B")
    np.testing.assert_allclose(f(m, 0.5, 0.0, 0.5, 3.0), [0.4, 0.5, 0.6])
    np.testing.assert_allclose(f(m, 0.5, 1.0, 0.5, 4.0), [0.4, 0.5, 0.6])  # of one azimuth: isotropic


def test_astm_columns_in_any_order_and_without_phi_i(tmp_path):
    text = "VARS Integrated 300-700nm, theta_s, THETA_I, phi_s\n0.7, 0.2, 0.1, 3\n\n0.8, 0.3, 0.1, 3\n"
    m = loaded(tmp_path, text)
    assert m.channel_names is None
    assert m.about["channel"] == "Integrated 300-700nm"
    assert f(m, 0.1, 0.0, 0.3, 3.0) == pytest.approx(0.8)
    m = loaded(tmp_path, "VARS theta_i,phi_i,theta_s,phi_s,400nm,502.5 nm\n0.1,0,0.2,3,5,6\n")
    assert m.channel_names == (400.0, 502.5)


def test_a_line_that_is_named_like_an_azimuth_is_text(tmp_path):
    m = loaded(tmp_path, "phi_i as in the log\nVARS theta_i,theta_s,phi_s,f\n0.1,0.2,0,5\n0.1,0.3,0,6\n")
    assert type(m) is Gridded
    astm.write(m, tmp_path / "a")
    assert gn.load(tmp_path / "a") == m


def test_rows_without_a_number_are_refused(tmp_path):
    with pytest.raises(gn.errors.FormatError, match="holds no value that is a number"):
        loaded(tmp_path, "VARS theta_i,theta_s,phi_s,f\n0.1,0.2,0,nan\n0.1,0.3,0,nan\n")


def test_negative_polar_angles_lean_to_the_other_side(tmp_path):
    m = loaded(tmp_path, "VARS theta_i,phi_i,theta_s,phi_s,f\n0.5,0,-0.25,0,1\n0.5,0,0.25,0,2\n")
    assert f(m, 0.5, 0.0, 0.25, math.pi) == pytest.approx(1.0)
    assert f(m, 0.5, 0.0, 0.25, 0.0) == pytest.approx(2.0)


def test_transmission_is_kept_beside_the_reflection(tmp_path):
    text = "VARS theta_i,phi_i,theta_s,phi_s,f\n0.5,0,0.3,0,1\n0.5,0,3,1,7\n2.5,0,3,1,9\n0.5,0,0.4,0,2\n"
    m = loaded(tmp_path, text)
    assert f(m, 0.5, 0.0, 0.4, 0.0) == pytest.approx(2.0)
    assert m.about["other_pairs"].values.tolist() == [7.0, 9.0]
    for module in (astm, csv_table):
        module.write(m, tmp_path / "a")
        assert gn.load(tmp_path / "a") == m
        assert gn.load(tmp_path / "a").about["other_pairs"].values.tolist() == [7.0, 9.0]
    back = loaded(tmp_path, text, astm, side="back")
    assert f(back, math.pi - 2.5, 0.0, math.pi - 3.0, 1.0) == pytest.approx(9.0)
    only = "VARS theta_i,phi_i,theta_s,phi_s,f\n0.5,0,3,1,7\n"
    m = loaded(tmp_path, only)
    assert isinstance(m, gn.Sheet) and m.f(gn.direction(0.5, 0.0), gn.direction(3.0, 1.0)) == 7.0
    with pytest.raises(gn.errors.FormatError, match="no reflection of the front, but transmission of light"):
        gn.load(tmp_path / "file", side="front")
    with pytest.raises(gn.errors.ParameterError, match="side='top'"):
        gn.load(tmp_path / "file", side="top")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("NUM_POINTS 3", "NUM_POINTS 4", "NUM_POINTS says 4 rows, got 3"),
        ("NUM_POINTS 3", "NUM_POINTS many", "line 3: got 'many'"),
        ("theta_s,", "", "line 4: .*expected theta_i, phi_i, theta_s, phi_s"),
        ("phi_i,theta_s", "theta_i,theta_s", "line 4"),
        ("0.50,3.0,0.4", "0.50,3.0", "line 6: got .* expected 7 numbers, not 6"),
        ("0.50,3.0,0.4", "0.50,3.0,o.4", "line 6: got 'o.4'"),
        ("0.50,3.0,0.4", "nan,3.0,0.4", "row 2: theta_o is nan degrees, expected at most 180"),
        ("0.50,3.0,0.4", "50,3.0,0.4", "row 2: theta_o is 2864.79 degrees"),
    ],
)
def test_damaged_astm(tmp_path, old, new, says):
    assert old in ASTM
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, ASTM.replace(old, new), astm)
