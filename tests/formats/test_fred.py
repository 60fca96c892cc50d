"""FRED: azimuths, several incident planes, sparse rows, writing, damage."""

from __future__ import annotations

import math

import numpy as np
import optical_files as files
import pytest
from format_cases import at, file_of, pairs_off_grazing
from places import real

import gonio as gn
from gonio.errors import FormatError
from gonio.formula import tree
from gonio.tables.gridded import Gridded
from gonio.tables.scattered import Scattered


def test_fred_azimuth_0_is_forward(tmp_path):
    m = gn.load(file_of(tmp_path, files.FRED.format(scale=2)))
    assert m.is_mirrored
    assert [at(m, 10, 0, 30, phi) for phi in (180, 90, 270, 0)] == pytest.approx([0.5, 0.25, 0.25, 0.125])
    assert at(m, 10, 25, 0, 0) == pytest.approx(1.0), "one row along the normal stands for all azimuths"
    whole = files.FRED.format(scale=2).replace("30\t90\t0.125", "30\t270\t0.125")
    assert at(gn.load(file_of(tmp_path, whole)), 10, 0, 30, 90) == pytest.approx(0.25)


def test_fred_several_incident_azimuths_are_an_anisotropic_material(tmp_path):
    text = "type bsdf_data\nformat angles=rad bsdf=value\n" + "".join(
        f"0.5 {a}\n0.5 {b} {a + b + 1}\n0.5 {a} {a + a + 1}\n" for a, b in ((0.0, 1.0), (1.0, 0.0))
    )
    m = gn.load(file_of(tmp_path, text))
    assert tree.is_oriented(m)
    half = math.degrees(0.5)
    assert at(m, half, 180, half, math.degrees(1.0)) == pytest.approx(2.0)
    assert at(m, half, 180 + math.degrees(1.0), half, math.degrees(1.0)) == pytest.approx(3.0)


def test_fred_sparse_rows_are_scattered(tmp_path):
    rows = "".join(f"{10 + k} 0\n{5 + 3 * k} {7 * k} 0.{k + 1}\n" for k in range(8))
    m = gn.load(file_of(tmp_path, f"type bsdf_data\nformat angles=deg bsdf=value scale=1\n{rows}"))
    assert isinstance(m, Scattered)
    assert m.f(*pairs_off_grazing(5)).shape == (5,)


@pytest.mark.parametrize("kind", ["read", "table"])
def test_fred_is_written_as_it_was_read(tmp_path, kind):
    m = gn.load(file_of(tmp_path, files.FRED.format(scale="0.5")))
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
        gn.load(file_of(tmp_path, text.replace(old, new, 1)))


def test_real_fred_is_written_as_it_was_read(tmp_path):
    m = gn.load(real("ua_loft/AnoBlackEC1onAlum.fred.txt"))
    for k, given in enumerate((m, Gridded("angles", m.axes, m.stored, mirrored=True))):
        gn.save(given, tmp_path / f"{k}.txt", "FRED")
        again = gn.load(tmp_path / f"{k}.txt")
        np.testing.assert_array_equal(again.filed.rows, m.filed.rows)
        np.testing.assert_array_equal(again.stored, m.stored)
