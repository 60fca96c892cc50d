"""OpenMATERIAL: tables of wavelengths and angles, what it cannot hold."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from format_cases import loaded

import gonio as gn
from gonio.errors import FormatError, ParameterError

# OpenMATERIAL.


pytestmark = pytest.mark.usefixtures("uncompiled")  # a kernel for every table takes longer than all else


def material(rows, **more):
    held = {"metadata": {"name": "asphalt", "openMaterial3dVersion": "1.1.0"}}
    return json.dumps({**held, "brdf": {"wavelengths": [9.05e-07], "lookupTable": rows, **more}})


def test_open_material(tmp_path):
    rows = [[9.05e-07, 0.5, 0.0, 0.0, 0.1], [9.05e-07, 0.5, 0.7, 0.0, 0.2], [9.05e-07, 0.5, 0.7, math.pi, 0.4]]
    solid = [{"wavelength": 9.05e-07, "solidAngle": 0.01}]
    m = loaded(tmp_path, material(rows, receiverSolidAngles=solid))
    assert m.channel_names == (905.0,)
    assert m.about["receiverSolidAngles"] == solid
    np.testing.assert_allclose(m.f_angles(0.5, 1.0, 0.7, 1.0 + math.pi), [0.4])
    np.testing.assert_allclose(m.f_angles(0.5, 1.0, 0.7, 1.0), [0.2])
    m = loaded(tmp_path, material([*rows[:2], [*rows[2][:4], None]]))
    assert np.isnan(m.stored).sum() == 1
    for row, words in (
        ([9.05e-07, 2.0, 0.0, 0.0, 0.1], "theta_i is 114.592"),
        ([9.05e-07, 0.1, None, 0.0, 0.1], "row 4"),
        ([0.0, 0.1, 0.1, 0.0, 0.1], "row 4"),
        ([9.05e-07, 0.1, 0.1, 0.1], "row 4"),
        ([9.05e-07, 0.1, "a", 0.1, 0.1], "'a' among numbers"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(tmp_path, material([*rows, row]))
    with pytest.raises(FormatError, match="lookupTable"):
        loaded(tmp_path, json.dumps({"metadata": {"openMaterial3dVersion": "1"}, "optical": {}}))


def test_many_wavelengths_without_pairs_in_common(tmp_path):
    rows = [[1e-7 + 1e-10 * k, 0.5, 1e-3 * k, 0.0, 0.1] for k in range(1000)]
    with pytest.raises(FormatError, match="about the same pairs"):
        loaded(tmp_path, material(rows))


def test_open_material_refuses_what_it_cannot_hold(tmp_path):
    with pytest.raises(ParameterError, match="anisotropic"):
        gn.save(gn.Ward(0.1, 0.1, 0.3), tmp_path / "m.xompt", wavelengths=[500])
    m = gn.Gridded("angles", {"theta_i": [0.0, 1.0], "theta_o": [0.5], "phi": [0.0]}, [[[0.1]], [[-0.1]]])
    with pytest.raises(ParameterError, match="not negative"):
        gn.save(m, tmp_path / "m.xompt", wavelengths=[500])
    assert not (tmp_path / "m.xompt").exists()
