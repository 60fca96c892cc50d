"""A material as the page gets it: everything there, JSON, sliders that hold the value, code that makes it again."""

import json
import math
import shlex

import numpy as np
import pytest

import gonio as gn
from gonio.explorer import calls, messages
from gonio.explorer.describe import slider
from gonio.explorer.given import Given
from gonio.explorer.shelf import Shelf

TEXTS = (
    "gold",
    "gold-metallic-paint",
    "Lambertian(0.2) + 0.5 * Microfacet(GGX(0.1, 0.4), Dielectric(1.5))",
    "IdealSpecular(0.04)",
    "RoughDielectric(GGX(0.2), 1.5)",
    "Lambertian([0.1, 0.2, 0.3, 0.4, 0.5])",
    "OriginalPhong(0.2)",
)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    path = tmp_path_factory.mktemp("measured") / "table.csv"
    gn.save(gn.tables.tabulate(gn.material("gold-metallic-paint"), resolution=(6, 8, 12)), path)
    return str(path)


@pytest.mark.parametrize("text", TEXTS)
def test_described(text):
    shelf = Shelf()
    found = calls.material(shelf, text, {})
    m = shelf.material(text, {})
    json.dumps(messages.in_base64(found), allow_nan=False)
    assert found["text"] == found["title"] == text
    assert found["channels"] == m.channels and found["class"] == type(m).__name__
    assert np.shape(found["rgb"]) == (m.channels or 1, 3)
    assert found["formula"] and found["source"] and found["description"]
    assert found["isotropic"] == m.is_isotropic() and found["has_delta"] == m.has_delta
    assert found["sides"] == m.sides and found["polarized"] == m.polarizes
    scope: dict = {}
    exec(found["snippet"], scope)
    assert scope["m"] == m
    assert shlex.split(found["command"])[:3] == ["gonio", "show", text]


@pytest.mark.parametrize("text", TEXTS)
def test_numbers_of_the_formula_have_sliders(text):
    found = calls.material(Shelf(), text, {})
    glsl = found["glsl"]
    assert f"{glsl['name']}_f" in glsl["functions"] and glsl["name"] + "_f" in glsl["text"]
    by_path = {p["path"]: p for p in found["parameters"]}
    for argument in glsl["arguments"]:
        p = by_path[argument["path"]]
        assert np.size(p["value"]) == argument["width"]
        assert np.all(p["low"] <= np.array(p["value"])) and np.all(np.array(p["value"]) <= p["high"])
        assert p["scale"] == "linear" or p["low"] > 0.0
    count = found["channels"] or 1
    assert glsl["type"] == {1: "float", 3: "vec3"}.get(count, f"float[{count}]")


def test_a_measurement(measured):
    found = calls.material(Shelf([Given(measured)]), measured, {})
    assert found["measured"] and found["title"] == "table.csv" and "measurement" in found["description"]
    assert sum(table["data"].size for table in found["glsl"]["tables"]) > 100
    assert all(table["data"].dtype == np.float32 for table in found["glsl"]["tables"])
    assert found["facts"]["shape"] and "albedo" not in found["facts"]
    json.dumps(messages.in_base64(found), allow_nan=False)


def test_replaced_numbers_are_in_code_and_command():
    replaced = {"distribution.alpha_x": 0.3, "masking": "separable"}
    found = calls.material(Shelf([Given("gold", (), ("eta=1.5,1.6,1.7",))]), "gold, eta=1.5,1.6,1.7", replaced)
    scope: dict = {}
    exec(found["snippet"], scope)
    assert scope["m"] == gn.material("gold").replace(eta=[1.5, 1.6, 1.7], alpha=0.3, masking="separable")
    assert "-p distribution.alpha_x=0.3 -p masking=separable -p eta=1.5,1.6,1.7" in found["command"]
    assert next(o["value"] for o in found["options"] if o["path"] == "masking") == "separable"


def test_options_of_reading_are_in_code_and_command(measured):
    found = calls.material(Shelf([Given(measured, ("side=front",))]), measured, {})
    assert "side='front')" in found["snippet"] and "-O side=front" in found["command"]


def test_maps_have_no_formula_in_the_page():
    found = calls.material(Shelf(), "Lambertian([[0.1, 0.2], [0.3, 0.4]])", {})
    assert found["glsl"] is None and found["why"] and found["parameters"] == []


@pytest.mark.parametrize(
    "name, value, bounds, expected",
    [
        ("rho", 0.5, (0.0, 1.0), (0.0, 1.0, "linear")),
        ("alpha_x", 0.1, (0.001, 1.0), (0.001, 1.0, "log")),
        ("eta", [0.14, 1.5], (0.01, 20.0), (0.14, 4.0, "linear")),
        ("k", 3.9, (0.0, 50.0), (0.0, 10.0, "linear")),
        ("k", 20.0, (0.0, 50.0), (0.0, 20.0, "linear")),
        ("n", 20.0, (0.0, 1e4), (0.0, 100.0, "linear")),
        ("x", -3.0, (-math.inf, math.inf), (-100.0, 100.0, "linear")),
        ("x", 0.0, (0.0, math.inf), (0.0, 1.0, "linear")),
    ],
)
def test_slider(name, value, bounds, expected):
    assert slider(name, {"value": value, "low": bounds[0], "high": bounds[1], "unit": "1"}) == pytest.approx(expected)


def test_colours():
    gray = calls.material(Shelf(), "Lambertian([0.1, 0.2])", {})["rgb"]
    assert gray == [[0.5] * 3] * 2
    spectrum = calls.material(Shelf(), "Lambertian([0.5, 0.5, 0.5, 0.5], wavelengths=[450, 500, 550, 650])", {})["rgb"]
    assert np.sum(spectrum, axis=0) == pytest.approx(np.ones(3))


def test_names_are_everything_a_page_offers():
    found = calls.names(Shelf([Given("gold")]))
    assert found["given"] == [{"text": "gold", "title": "gold"}]
    assert {"gold", "brass"} <= {m["name"] for m in found["materials"]}
    assert {m["name"] for m in found["models"]} >= {"Lambertian", "Microfacet"}
    for model in found["models"]:
        assert gn.expression(model["example"])


def test_data_are_f_in_the_plane_of_incidence():
    shelf = Shelf()
    text = "Microfacet(GGX(0.3))"
    lines = calls.data(shelf, text, 30.0, {"alpha": 0.2}, 40.0)["csv"].splitlines()
    rows = [line for line in lines if not line.startswith("#")]
    assert rows[0] == "theta_o_deg,f" and any("1/sr" in line for line in lines)
    table = np.array([[float(x) for x in row.split(",")] for row in rows[1:]])
    assert table[table[:, 1].argmax(), 0] == pytest.approx(30.0, abs=3.0)
    m = gn.Microfacet(gn.GGX(0.2))
    f = m.f_angles(math.radians(30.0), math.radians(40.0), math.radians(45.0), math.radians(220.0))
    assert table[table[:, 0] == 45.0, 1] == pytest.approx(f, rel=1e-6)


def test_check_fit_and_albedo():
    shelf = Shelf()
    found = calls.check(shelf, "OriginalPhong(0.2)", {})
    assert not found["ok"] and {row["verdict"] for row in found["rows"]} >= {"pass", "breaks"}
    json.dumps(messages.in_base64(found), allow_nan=False)
    fitted = calls.fit(shelf, "Lambertian(0.3)", "Lambertian(0.5)")
    assert fitted["numbers"][0]["name"] == "rho" and fitted["numbers"][0]["value"] == pytest.approx(0.3)
    assert fitted["material"]["text"] == fitted["expression"]
    albedo = calls.albedo(shelf, "Lambertian([0.3, 0.4])", {})
    assert albedo["values"] == pytest.approx(np.broadcast_to([0.3, 0.4], (len(albedo["theta"]), 2)), abs=1e-3)
    assert albedo["u"] is None
