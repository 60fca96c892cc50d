"""BRF tables: rows, the real table of Spectralon, damage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from format_cases import at, loaded
from places import real
from seeds import BRF_TABLE

import gonio as gn
from gonio.errors import FormatError

# Tables of reflectance factors.


pytestmark = pytest.mark.usefixtures("uncompiled")  # a kernel for every table takes longer than all else


def test_brf_table(tmp_path):
    m = loaded(tmp_path, BRF_TABLE.replace(b"\n", b"\r\n"))
    assert m.quantity == "reflectance factor"
    assert m.channel_names == (450.5, 633.0)
    assert m.about["text"] == ["BRF Values", "a panel"]
    np.testing.assert_allclose(at(m, 45.0, 0.0, 45.0, 180.0), np.array([1.06, 1.08]) / math.pi, rtol=1e-9)


def test_the_real_brf_table():
    m = gn.load(real("ua_rsg/spectralon7_vis_brf.txt"))
    assert m.stored.shape == (19, 11)
    assert m.stored[1, 0] == 1.05215
    ptfe = gn.load(real("nist_ptfe/PTFE.532.coeff.csv"))
    green = m.channel_names.index(537.85)
    rows = {tuple(np.round(np.degrees(r)).astype(int)): v[green] for r, v in zip(m.rows, m.stored, strict=True)}
    forward = rows[45, 0, 45, 180] / rows[45, 0, 0, 0]
    assert forward == pytest.approx(at(ptfe, 45, 0, 45, 180) / at(ptfe, 45, 0, 0, 0), abs=0.01)
    assert abs(forward - at(ptfe, 45, 0, 45, 0) / at(ptfe, 45, 0, 0, 0)) > 0.05


def test_damaged_brf_tables(tmp_path):
    for old, new, words in (
        (b"633nm", b"400nm", "rising wavelengths"),
        (b"633nm", b"red", "a wavelength like"),
        (b"1.06\n 45", b"1.06\t1\n 45", "line 5"),
        (b" 12.000", b" 91.000", "theta_i is 91 degrees"),
        (b" 12.000", b"    nan", "theta_i is nan degrees"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(tmp_path, BRF_TABLE.replace(old, new))
