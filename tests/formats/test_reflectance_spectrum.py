"""Spectra of reflectance: a made one and the real one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from format_cases import at, loaded
from places import real

import gonio as gn
from gonio.errors import FormatError

# Spectra.


pytestmark = pytest.mark.usefixtures("uncompiled")  # a kernel for every table takes longer than all else


def test_spectrum(tmp_path):
    m = loaded(tmp_path, "nm R u\n# panel 4\n400\t0.5\t0.01\n500,0.75,0.02\n")
    assert m.channel_names == (400.0, 500.0)
    np.testing.assert_allclose(at(m, 20.0, 0.0, 70.0, 40.0), np.array([0.5, 0.75]) / math.pi)
    np.testing.assert_array_equal(m.uncertainty, [0.01, 0.02])
    assert "Lambertian" in m.about["assumption"]
    assert loaded(tmp_path, "400 0.5\n500 0.6\n").uncertainty is None
    assert loaded(tmp_path, ",\n400 0.5\n500 0.6\n").channel_names == (400.0, 500.0)
    for text, words in (
        ("400 50\n500 60\n", "percentages"),
        ("400 0.5\n500 -0.1\n", "expected 0 to 1"),
        ("".join(f"{300 + k} 0.5\n" for k in range(600)) + "x", "line 601"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(tmp_path, text)


def test_the_real_spectrum():
    m = gn.load(real("grit/Spectralon_Num4.txt"))
    assert len(m.channel_names) == 2151
    assert (m.channel_names[0], m.rho[0], m.uncertainty[0]) == (350.0, 0.9878, 0.0053)
