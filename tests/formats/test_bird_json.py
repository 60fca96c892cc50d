"""BiRD: the project's example, units, uncertainties, the earlier layout, damage."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from format_cases import at, loaded

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.formats import bird_json

# BiRD.


pytestmark = pytest.mark.usefixtures("uncompiled")  # a kernel for every table takes longer than all else


def bird(**columns):
    unit = {"theta_i": "deg", "phi_i": "deg", "theta_r": "deg", "phi_r": "deg", "BRDF": "sr^-1", "uBRDF": "1/sr"}
    data = {k: v if isinstance(v, dict) else {"unit": unit[k], "values": v} for k, v in columns.items()}
    return json.dumps({"metadata": {"type": "BRDF", "id": "here"}, "data": data})


PAIRS = {"theta_i": [0, 0], "phi_i": [0, 0], "theta_r": [10, 20], "phi_r": [60, 60]}


def test_bird_example(tmp_path):
    """The values of the project's example.brdf (BiRD_view, MIT): 550 to 850 nm, s and p by turns."""
    values = [0.254, 0.263, 0.267, 0.273, 0.281, 0.295, 0.296, 0.301]
    states = [[1, 1, 0, 0], [1, -1, 0, 0]] * 4
    text = bird(
        **{name: [float(v[0])] * 8 for name, v in PAIRS.items()},
        BRDF=values,
        wavelength_i={"unit": "nm", "values": np.repeat([550, 650, 750, 850], 2).tolist()},
        polarization_i={"notation": "inStokes", "values": states},
    )
    m = loaded(tmp_path, text)
    assert m.channel_names == (550.0, 650.0, 750.0, 850.0)
    np.testing.assert_allclose(m.stored.reshape(-1), [0.2585, 0.27, 0.288, 0.2985])
    assert m.about["polarization_i"] == "mean of s and p"
    s = bird_json.read(tmp_path / "file", polarization="s")
    np.testing.assert_array_equal(s.stored.reshape(-1), values[::2])
    np.testing.assert_allclose(at(s, 0.0, 0.0, 10.0, 60.0), values[::2])
    with pytest.raises(ParameterError, match="holds p, s"):
        bird_json.read(tmp_path / "file", polarization="u")


def test_bird_units_and_uncertainties(tmp_path):
    half = {"unit": "rad", "values": [0.0, 0.5]}
    base = {**PAIRS, "theta_r": half, "BRDF": [0.2, 0.4]}
    m = loaded(tmp_path, bird(**base, uBRDF={"unit": "%", "values": [1.0, 2.0]}))
    np.testing.assert_allclose(m.uncertainty.reshape(-1), [0.002, 0.008])
    assert m.channel_names is None
    assert m.f_angles(0.0, 0.0, 0.5, math.pi / 3.0) == pytest.approx(0.4)
    one = {"unit": "1/sr", "values": [0.2, 0.4], "uncertainty": {"value": 0.01, "unit": "sr^-1"}}
    m = loaded(tmp_path, bird(**{**base, "BRDF": one}))
    np.testing.assert_array_equal(m.uncertainty.reshape(-1), 0.01)
    m = loaded(tmp_path, bird(**base, wavelength_i={"unit": "μm", "values": [0.55, 0.55]}))
    assert m.channel_names == pytest.approx((550.0,))


def test_bird_rows_of_the_earlier_layout(tmp_path):
    names = (("theta_i", "°"), ("phi_i", "°"), ("theta_r", "°"), ("phi_r", "°"), ("BRDF", "sr-1"), ("uBRDF", "sr-1"))
    variables = [{"name": n, "type": "number", "unit": u} for n, u in names]
    rows = [[0, 0, 10, 60, 0.2, 0.01], [0, 0, 20, 60, 0.3, 0.02]]
    text = json.dumps({"metadata": {"type": "BRDF"}, "data": {"variables": variables, "values": rows}})
    m = loaded(tmp_path, text)
    np.testing.assert_array_equal(m.stored.reshape(-1), [0.2, 0.3])
    np.testing.assert_array_equal(m.uncertainty.reshape(-1), [0.01, 0.02])
    with pytest.raises(FormatError, match="row 2"):
        loaded(tmp_path, text.replace(", 0.02]", "]"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"BRDF": [0.1]}, "same number"),
        ({"BRDF": [0.1, "x"]}, "'x' among numbers"),
        ({"BRDF": [0.1, True]}, "True among numbers"),
        ({"BRDF": [0.1, [1.0]]}, "one length"),
        ({"BRDF": {"unit": "W", "values": [0.1, 0.2]}}, "unit 'W', expected one of 1/sr"),
        ({"theta_r": [10, 100]}, "theta_o is 100 degrees"),
        ({"theta_r": {"unit": "deg"}}, "'values' is missing"),
        ({"theta_r": 3}, "values"),
        ({"polarization_i": {"values": ["s", 4]}}, "Stokes"),
        ({"polarization_i": {"values": ["s", "p"]}}, "different directions"),
        ({"uBRDF": {"unit": "1/sr", "values": None}}, "'values' is None"),
        ({"BRDF": {"unit": "1/sr", "values": [0.1, 0.2], "uncertainty": {"value": 1, "unit": "K"}}}, "uncertainty"),
    ],
)
def test_damaged_bird_files(change, words, tmp_path):
    with pytest.raises(gn.Error, match=words):
        loaded(tmp_path, bird(**{**PAIRS, "BRDF": [0.1, 0.2], **change}))


def test_json_that_is_none(tmp_path):
    text = bird(**PAIRS, BRDF=[0.1, 0.2])
    for content, words in (
        (text[:-5], "line 1: not JSON, or cut short"),
        (text.replace("0.1", "9" * 5000), "not JSON that can be read"),
        (text.replace("[0.1", "[" * 100000 + "0.1"), "not JSON"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(tmp_path, content)
