"""RT-300S: four texts and a workbook of one instrument, repeated measurements, damage."""

from __future__ import annotations

import math
import sys

import numpy as np
import optical_files as files
import pytest
from format_cases import at, file_of
from places import real

import gonio as gn
from gonio.errors import DependencyError, FormatError
from gonio.formats import jdv

# RT-300S ---------------------------------------------------------------------------------------------------------

DIALECTS = {"RT-300S": files.JDV, "Raywiz": files.RAYWIZ, "Reflet": files.REFLET, "Speos": files.RTD}


@pytest.mark.parametrize("dialect", [*DIALECTS, "workbook"])
def test_rt300s_angles_and_quantity(tmp_path, dialect):
    if dialect == "workbook":
        pytest.importorskip("xlrd")
    m = gn.load(file_of(tmp_path, DIALECTS.get(dialect) or files.workbook(files.SHEET)))
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
    path = file_of(tmp_path, files.JDV + second)
    unit = math.pi * math.cos(math.radians(30.0))
    read = [at(jdv.read(path, measurement=k), 30, 0, 30, 180) * unit for k in (0, 1, -1)]
    assert read == pytest.approx([3.0, 30.0, 30.0])
    assert gn.load(path).about["measurements"] == 2
    with pytest.raises(FormatError, match="measurement=2"):
        jdv.read(path, measurement=2)


def test_rt300s_values_of_one_direction_are_averaged(tmp_path):
    text = files.JDV.replace("Azimuth:\t-90,0,90", "Azimuth:\t-90,90,180").replace("\n0\t4\t2\t5", "\n90\t7\t4\t3")
    m = gn.load(file_of(tmp_path, text))
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
        gn.load(file_of(tmp_path, text.replace(old, new, 1)))


def test_workbooks_that_are_not_of_the_instrument(tmp_path):
    pytest.importorskip("xlrd")
    for change, words in ((lambda s: s[:4], "rt"), (lambda s: [r[:3] for r in s[:4]] + [["RT", 1.0, "x"]], "column")):
        with pytest.raises(FormatError, match=words):
            gn.load(file_of(tmp_path, files.workbook(change(files.SHEET))))
    with pytest.raises(FormatError, match="workbook"):
        gn.load(file_of(tmp_path, files.workbook(files.SHEET)[:2000]))


def test_workbooks_need_xlrd(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "xlrd", None)
    with pytest.raises(DependencyError, match=r"gonio\[io\]"):
        gn.load(file_of(tmp_path, files.workbook(files.SHEET)))


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
    pytest.importorskip("xlrd")
    raw = gn.load(real("ua_loft/raw_EC1.xls"))
    wi, wo = fred_file.directions()
    known = fred_file.valid
    wi, wo, f = wi[known], wo[known], fred_file.stored[known]
    mean = 0.5 * (raw.f(wi, wo) + raw.f(wi, wo * [1.0, -1.0, 1.0]))  # what it did for both sides
    rt = math.pi * wo[:, 2] * (mean - f)
    assert np.abs(rt).max() < 0.0042 and abs(rt.mean()) < 6e-4, "the measurement without light that it subtracted"
    assert raw.stored.shape == (4, 17, 36) and raw.about["method"] == "BRDF_LD"
