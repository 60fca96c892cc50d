"""CSV: one table in many forms, grids and rows kept exactly, damage."""

import math

import numpy as np
import pytest
from format_cases import f, grid, loaded, rows
from sweeps import every
from text_files import CSV

import gonio as gn
from gonio.formats import csv_table
from gonio.formats._laboratory import numbers, sheets
from gonio.tables.gridded import Gridded

# CSV


DEGREES = math.pi / 180.0


def test_csv_rows(tmp_path):
    m = loaded(tmp_path, CSV)
    assert m.about["sample"] == "grey tile"
    np.testing.assert_allclose(f(m, 30 * DEGREES, 0.0, 45 * DEGREES, math.pi), [0.3, 0.4])
    assert np.isnan(f(m, 30 * DEGREES, 0.0, 60 * DEGREES, math.pi)).tolist() == [False, True]
    assert np.nanmax(m.uncertainty) == 0.02


@pytest.mark.parametrize(
    "text",
    [
        "theta_i;phi_i;theta_o;phi_o;f\n30;0;45,5;180;0,25\n30;0;60;180;0,5\n",
        "theta_i\tphi_i\ttheta_o\tphi_o\tf\n30\t0\t45.5\t180\t0.25\n30\t0\t60\t180\t0.5\n",
        "theta_i phi_i theta_o phi_o f\n30 0  45.5 180 0.25\n30 0 60 180 0.5\n",
        'Theta_o,"phi_o",BRDF,theta_i, phi_i\n45.5,180,0.25,30,0\n60,180,0.5,30,0\n',
        "theta_i,theta_o,phi,brf\n30,45.5,180,0.7853981633974483\n30,60,180,1.5707963267948966\n",
        "# angle_unit: rad\ntheta_i,theta_o,phi,f\n0.5235987755982988,0.7941248096574199,3.141592653589793,0.25\n"
        "0.5235987755982988,1.0471975511965976,3.141592653589793,0.5\n",
        "theta_i,theta_o,phi,dsf\n30,45.5,180,0.17522724\n30,60,180,0.25\n",
        "theta_i,theta_o,phi,f_cos_i\n30,45.5,180,0.21650635\n30,60,180,0.4330127\n",
        "theta_i,theta_o,f\n30,-45.5,0.25\n30,-60,0.5\n",
        "theta_i,phi_i,theta_o,phi_o,f\n-30,180,45.5,180,0.25\n30,0,60,-180,0.5\n",
    ],
)
def test_one_table_in_many_forms(tmp_path, text):
    m = loaded(tmp_path, text)
    assert f(m, 30 * DEGREES, 0.0, 45.5 * DEGREES, math.pi) == pytest.approx(0.25)
    assert f(m, 30 * DEGREES, 0.0, 60 * DEGREES, math.pi) == pytest.approx(0.5)


def test_csv_rows_of_one_wavelength_each(tmp_path):
    text = "theta_i,theta_o,phi,wavelength,f,u_f\n" + "".join(
        f"30,{t},180,{w},{(t + w) / 4000},{w / 4e6}\n" for w in (550, 450) for t in (10, 20, 30) if (t, w) != (20, 450)
    )
    m = loaded(tmp_path, text)
    assert m.channel_names == (450.0, 550.0)
    np.testing.assert_allclose(f(m, 30 * DEGREES, 0.0, 30 * DEGREES, math.pi), [0.12, 0.145])
    assert np.isnan(m.stored).sum() == 1
    assert m.uncertainty.ravel()[-1] == pytest.approx(0.55 / 4000)
    with pytest.raises(gn.errors.FormatError, match="each pair once"):
        loaded(tmp_path, text + "30,10,180,450,1,1\n")


@pytest.mark.parametrize("kind", ["angles", "specular", "half_difference"])
@every(
    quantity=["brdf", "brdf * cos(theta_o)", "brdf * cos(theta_i)", "reflectance factor"],
    channels=[None, ("R", "cos"), (400.0, 500.5)],
    counts=[((3, 4, 5), False), ((3, 4, 5), True), ((3, 4, 5, 2), False)],
)
def test_csv_keeps_grids_exactly(tmp_path, quantity, channels, kind, counts):
    counts, mirrored = counts
    m = grid(kind, counts, channels, mirrored)
    stored = m.stored.copy()
    stored[1, 2, 3] = np.nan
    about = {"device": "by hand", "remark": "a: b, c"}
    m = Gridded(
        kind,
        m.axes,
        stored,
        quantity=quantity,
        uncertainty=np.abs(stored),
        channels=channels,
        mirrored=mirrored,
        outside="missing",
        interpolation="nearest",
        about=about,
    )
    gn.save(m, tmp_path / "a.csv")
    again = gn.load(tmp_path / "a.csv")
    assert again == m
    assert again.about == about
    assert "angle_unit" not in (tmp_path / "a.csv").read_text()


def test_csv_keeps_what_degrees_cannot_say(tmp_path):
    rng = np.random.default_rng(4)
    axes = {"theta_i": np.sort(rng.uniform(0, 1.5, 30)), "theta_o": np.sort(rng.uniform(0, 1.5, 30)), "phi": [0.0]}
    m = Gridded("angles", axes, rng.normal(size=(30, 30, 1)) * 1e-300, periods={"phi": math.pi})
    csv_table.write(m, tmp_path / "a")
    assert "# angle_unit: rad\n" in (tmp_path / "a").read_text()
    assert gn.load(tmp_path / "a") == m
    reciprocal = grid("half_difference", (3, 3, 4), periods={"phi_d": 2.0 * math.pi})
    csv_table.write(reciprocal, tmp_path / "a")
    assert gn.load(tmp_path / "a") == reciprocal


@pytest.mark.parametrize("isotropic", [True, False])
def test_csv_keeps_rows_exactly(tmp_path, isotropic):
    m = rows(isotropic, quantity="reflectance factor", uncertainty=np.ones((40, 2)) / 3.0, outside="missing")
    csv_table.write(m, tmp_path / "a")
    again = gn.load(tmp_path / "a")
    assert again == m
    assert again.rows.tobytes() == m.rows.tobytes()


def test_half_a_circle_is_mirrored_or_reciprocal_unless_said(tmp_path):
    text = "theta_i,theta_o,phi,f\n" + "".join(f"30,45,{p},{p / 900}\n" for p in (0, 90, 180))
    assert loaded(tmp_path, text).is_mirrored
    assert not loaded(tmp_path, "# mirrored: false\n" + text).is_mirrored
    text = "theta_h,theta_d,phi_d,f\n" + "".join(f"30,45,{p},{p / 900}\n" for p in (0, 90, 180))
    assert loaded(tmp_path, text).periods["phi_d"] == math.pi
    assert loaded(tmp_path, "# period_phi_d: 360\n" + text).periods["phi_d"] == 2.0 * math.pi


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("f_G,u", "g_G,u", "column 'g_G'"),
        ("f_G,u", "brf_G,u", "one quantity"),
        ("f_G,u", "f,u", "one column or one per channel"),
        ("f_G,u", "f_R,u", "column f_R twice"),
        ("u_f_G", "u_f_B", "uncertainties of none or of all"),
        ("phi_i,", "phi_d,", "columns of angles are"),
        ("0.3,0.4", "0.3,0.4,0.5", "line 4: .*8 numbers, not 9"),
        ("0.3,0.4", "0.3,a", "line 4: got 'a'"),
        ("45,180", ",180", "an angle is no number"),
        ("# sample: grey tile", "# angle_unit: gon", "angle_unit: gon"),
        ("# sample: grey tile", "# outside: zeros", "option|outside"),
        ("# sample: grey tile", "# period_phi_o: x", "period_phi_o: 'x'"),
        ("60,180", "190,180", "row 3: theta_o is 190 degrees"),
    ],
)
def test_damaged_csv(tmp_path, old, new, says):
    assert old in CSV
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, CSV.replace(old, new), csv_table)


@pytest.mark.parametrize("table", ["f\n1\n2\n", "wavelength,f\n400,1\n500,2\n"])
def test_a_table_without_angles_is_no_format_of_directions(tmp_path, table):
    with pytest.raises(gn.errors.FormatError, match=r"columns of angles are missing, expected theta_i"):
        loaded(tmp_path, f"{csv_table.MARK}\n{table}")


def test_csv_refuses_names_that_are_no_columns(tmp_path):
    for names in (("a,b", "c"), ("a b", "c"), ("a", "a")):
        with pytest.raises(gn.errors.ParameterError, match="has channels"):
            csv_table.write(grid("angles", (2, 2, 2), names), tmp_path / "a")


def test_lines_of_numbers_are_read_without_cells(tmp_path, monkeypatch):
    """A million rows are read at once, not cell by cell; where a line holds anything else, as before."""
    pieces = []
    split = sheets.TextSheet.split
    monkeypatch.setattr(sheets.TextSheet, "split", lambda *of: pieces.append(of) or split(*of))
    head = "theta_i,phi_i,theta_o,phi_o,f\n"
    rows = [f"{k % 80},{7 * k % 360},{k % 77},{k % 359},{(1 + k % 7) / 90}" for k in range(20)]
    for line, plain in (
        ("3,4,5,6,0.7", True),
        (" 3 , 4,5,6 ,.7 ", True),
        ("3,4,5,6,nan", True),
        ('"3",4,5,6,.7', False),
        ("", False),
        ("# by hand", False),
        (",,,,", False),
        ("3,4,5,6,", False),
    ):
        text = head + "\n".join([*rows[:10], line, *rows[10:]])
        pieces.clear()
        found = loaded(tmp_path, text)
        assert bool(pieces) != plain
        with monkeypatch.context() as patch:
            patch.setattr(numbers._NumberReader, "_plain", lambda *_: None)
            by_cells = loaded(tmp_path, text)
        np.testing.assert_array_equal(found.stored, by_cells.stored)
        np.testing.assert_array_equal(found.rows, by_cells.rows)
    with pytest.raises(gn.errors.FormatError, match=r"line 12.*expected 5 numbers, not 4"):
        loaded(tmp_path, head + "\n".join([*rows[:10], "3,4,5,6", *rows[10:]]))
    with pytest.raises(gn.errors.FormatError, match=r"line 12, .*an angle is no number"):
        loaded(tmp_path, head + "\n".join([*rows[:10], "nan,4,5,6,0.7", *rows[10:]]))
