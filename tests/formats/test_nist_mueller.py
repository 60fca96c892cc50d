"""NIST's tables of Mueller matrices: rows, wavelengths, the real table, damage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from format_cases import loaded
from places import real
from seeds import mueller_table

import gonio as gn
from gonio.errors import FormatError

# NIST's Mueller tables.


pytestmark = pytest.mark.usefixtures("uncompiled")  # a kernel for every table takes longer than all else


def test_mueller_rows(tmp_path):
    m = loaded(tmp_path, mueller_table())
    assert isinstance(m, gn.Scattered)
    assert m.channel_names == (532.0,)
    np.testing.assert_array_equal(m.stored, [[0.265], [0.25], [0.32]])
    np.testing.assert_allclose(np.degrees(m.rows[1]), [75.0, 180.0, 10.0, 20.0])
    assert m.matrices.shape == (3, 4, 4)
    np.testing.assert_allclose(m.matrices[0, 0, :3], 0.265 * np.array([1.0, 0.01, 0.02]))
    assert m.matrices[2, 3, 2] == pytest.approx(0.14 * 0.32)
    other = m.replace(outside="missing")
    assert type(other) is type(m) and other.outside == "missing" and other.path == m.path
    assert other.matrices is m.matrices and other.provenance == m.provenance and np.array_equal(other.stored, m.stored)


def test_wavelengths_of_mueller_rows_are_channels(tmp_path):
    lines = mueller_table().decode().splitlines()
    again = [line.replace("0.532", "0.633", 1).replace("2.65E-01", "0.27") for line in lines[1:3]]
    m = loaded(tmp_path, "\r\n".join([*lines, *again]))
    assert m.channel_names == (532.0, 633.0)
    np.testing.assert_array_equal(m.stored, [[0.265, 0.27], [0.25, 0.25], [0.32, np.nan]])
    assert m.matrices.shape == (3, 2, 4, 4)


def test_the_real_mueller_table():
    m = gn.load(real("nist_ptfe/PTFE.data.532.csv"))
    assert m.stored.shape == (1824, 1)
    assert m.residual.rms < 0.006
    f = m.f_angles(math.radians(75.0), math.pi, *np.radians([60.0, 0.0]))  # forward, where PTFE is brightest
    assert f > 1.5 * m.f_angles(math.radians(75.0), math.pi, *np.radians([60.0, 180.0]))


def test_damaged_mueller_tables(tmp_path):
    text = mueller_table().decode()
    for change, words in (
        (lambda t: t.replace("0.25,", "abc,"), "line 3: got 'abc'"),
        (lambda t: t.replace("-75,", "-95,"), "theta_i is -95 degrees"),
        (lambda t: t.splitlines()[0], "ends after line 1, expected rows of numbers: lambda"),
        (lambda t: t.replace("0.532,-75", "-1,-75"), "wavelength"),
        (lambda t: t.replace("2.65E-01", "nan").replace(",0.25,", ",nan,").replace(",0.32,", ",nan,"), "no value"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(tmp_path, change(text))
