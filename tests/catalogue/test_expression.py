"""Material expressions: what they mean, that they reverse `repr`, that bad ones end in one clear error."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from materials import most
from sweeps import every

import gonio as gn
from gonio.base.reflectance import Reflectance
from gonio.base.sums import Sum
from gonio.catalogue.expressions import MAX_LENGTH, expression, names, read
from gonio.catalogue.typed import with_parameters
from gonio.cli.arguments import resolve, resolve_light
from gonio.errors import ExpressionError, NotFoundError, ParameterError
from gonio.formula.fields import CLASSES, Param
from gonio.formula.parametrised import Parametrised

COMPOSED = ("Sum", "Scaled", "Stack", "UnderLight")
"""Those that are nothing without parts; see `test_expression_reverses_repr_of_compositions`."""
MODELS = {n: k for n, k in names().items() if issubclass(k, Reflectance) and n not in COMPOSED}


def _drawn(kind, rng):
    """An instance of a model with parameters drawn within their bounds, some with channels."""
    values = {}
    for name, field in kind.fields.items():
        if isinstance(field, Param):
            high = min(most(field, 3), max(10.0, 2.0 * field.low))
            values[name] = field.low + (high - field.low) * rng.random(3 if rng.random() < 0.5 else ())
        elif isinstance(field.default, Parametrised):
            values[name] = _drawn(type(field.default), rng)
    return kind(**values)


@every(name=sorted(MODELS), seed=range(3))
def test_expression_reverses_repr(name, seed):
    rng = np.random.default_rng(seed)
    m = _drawn(MODELS[name], rng)
    assert expression(repr(m)) == m
    both = 0.3 * m + [0.1, 0.2, 0.3] * (gn.Lambertian(0.2) + 2.0 * m)
    assert expression(repr(both)) == both
    assert expression(repr(MODELS[name]())) == MODELS[name]()


@pytest.mark.parametrize(
    "m",
    [
        gn.Microfacet(gn.GGX(0.1, 0.4), gn.Conductor([0.2, 0.9, 1.1], 3.0), masking="separable"),
        gn.Microfacet(gn.Beckmann(0.3), gn.Schlick(0.1), masking="v_groove"),
        gn.Microfacet(gn.GaussianFacets(0.3), 0.5, "v_groove"),
        2.0 * (3.0 * gn.Lambertian(0.1)),
        Sum(Sum(gn.Lambertian(0.1), gn.Phong()), gn.Lambertian(0.2)),
        Sum(gn.Lambertian(0.25)),
        gn.IdealSpecular(gn.Dielectric(1.5)),
        gn.Lambertian([[[0.1, 0.2, 0.3]]]),
        gn.Stack([gn.Interface(1.5), gn.Medium(5.0, albedo=[0.99, 0.9, 0.5])], gn.Lambertian(0.1)),
        gn.Stack([gn.RoughInterface(1.5, 0.2), gn.Medium(2.0), gn.Interface(1 / 1.5)], tolerance=1e-2),
        gn.UnderLight(gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0]), [5.0, 1.0], [5.0, 1.0]),
    ],
    ids=repr,
)
def test_expression_reverses_repr_of_compositions(m):
    assert expression(repr(m)) == m


@pytest.mark.parametrize(
    ("text", "m"),
    [
        ("Lambertian(0.2)", gn.Lambertian(0.2)),
        (" Lambertian( rho = .2 ) ", gn.Lambertian(0.2)),
        ("Lambertian((0.1, 0.2, 0.3))", gn.Lambertian([0.1, 0.2, 0.3])),
        ("Lambertian(1)", gn.Lambertian(1.0)),
        ("Lambertian(1 - 2*0.25 + -0.1)", gn.Lambertian(1 - 2 * 0.25 - 0.1)),
        ("Phong(1/pi, 2e1)", gn.Phong(1 / np.pi, 20.0)),
        ("Lambertian(0.4) * 0.5", 0.5 * gn.Lambertian(0.4)),
        ("gn.Lambertian(0.2) + gonio.Phong()", gn.Lambertian(0.2) + gn.Phong()),
        ("Lambertian(0.2)\n  + Phong()", gn.Lambertian(0.2) + gn.Phong()),
        ("Microfacet(GGX(alpha=0.3), masking='separable')", gn.Microfacet(gn.GGX(0.3), masking="separable")),
        ("Microfacet(GGX(0.3), 0.9)", gn.Microfacet(gn.GGX(0.3), gn.Constant(0.9))),
        ("material('gold', alpha=0.2) + Lambertian()", gn.material("gold", alpha=0.2) + gn.Lambertian()),
    ],
)
def test_expression_means(text, m):
    assert expression(text) == m


def test_expression_loads_files(tmp_path):
    m = gn.Lambertian(0.3) + gn.Phong()
    gn.save(m, tmp_path / "m.json")
    assert expression(f"0.5 * load({str(tmp_path / 'm.json')!r})", files=True) == 0.5 * m


def test_expression_is_public():
    assert gn.expression("Lambertian(0.2)") == gn.Lambertian(0.2)


def test_a_long_sum_is_no_nesting():
    m = expression(" + ".join(["Lambertian(0.001)"] * 400))
    assert len(m.terms) == 400


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Lambertain(0.2)", ["column 1", "'Lambertain'", "did you mean Lambertian?"]),
        ("Lambertian(0.2) + phong()", ["column 19", "'phong'", "did you mean Phong?"]),
        ("Lambertian(0.2) + gold", ["column 19", 'material("gold")']),
        ("Lambertian", ["column 1", "Lambertian(...)"]),
        ("Lambertian(0.2", ["column 11", "never closed"]),
        ("Lambertian(0.2) Phong()", ["invalid syntax"]),
        ("Lambertian(0.2) - Phong()", ["column 19", "a Lambertian - a Phong", "expected"]),
        ("Lambertian(0.2) * Phong()", ["a Lambertian * a Phong", "number * reflectance"]),
        ("Lambertian(0.2) + 1", ["a Lambertian + the number 1"]),
        ("Lambertian(0.2) / 2", ["expected"]),
        ("Lambertian(1/0)", ["column 12", "no finite number"]),
        ("-Lambertian(0.2)", ["a sign before a Lambertian"]),
        ("Lambertian(True)", ["True", "neither a number nor a word"]),
        ("Lambertian(1j)", ["1j"]),
        ("Lambertian(0x" + "f" * 400 + ")", ["beyond the range"]),
        ("Lambertian(x)", ["unknown name 'x'", "expected one of"]),
        ("Lambertian(*[0.2])", ["without *"]),
        ("Lambertian(**{'rho': 1})", ["without **"]),
        ("Lambertian([Phong()])", ["a Phong in a list"]),
        ("GGX(0.2)", ["GGX, expected a reflectance"]),
        ("0.5", ["the number 0.5, expected a reflectance"]),
        ("Distribution()", ["unknown name 'Distribution'"]),
        ("Measured()", ["unknown name 'Measured'"]),
        ("MERL()", ["unknown name 'MERL'"]),
        ("__import__('os').system('true')", ["a call of something that is no name"]),
        ("().__class__.__bases__", ["is no part of an expression"]),
        ("(lambda: 1)()", ["a call of something that is no name"]),
        ("[m for m in (1, 2)]", ["list comp is no part"]),
        ("Lambertian(0.1) if 1 else Phong()", ["is no part of an expression"]),
        ("f'{1}'", ["is no part of an expression"]),
        ("gold.replace(alpha=1)", ["a call of something that is no name"]),
        ("material('gold', shine=1)", ["unexpected keyword argument 'shine'"]),
        ("material()", ["missing"]),
        ("", ["empty expression"]),
        ("Lambertian(\x00)", ["null"]),
        ("Lambertian(\ud800)", ["surrogates"]),
        ("(" * 100 + "Lambertian()" + ")" * 100, ["nested more than"]),
        ("-" * 3000 + "1", ["expected"]),
        ("-" * 60 + "1", ["nested more than"]),
        ("1+" * MAX_LENGTH + "1", ["characters", str(MAX_LENGTH)]),
        ("ä" * 20 + " + Lambertain()", ["unknown name"]),
    ],
    ids=lambda x: x[:30].encode("ascii", "replace").decode() if isinstance(x, str) else "",
)
def test_bad_expressions_say_what_and_where(text, words):
    with pytest.raises(ExpressionError) as caught:
        expression(text)
    for word in words:
        assert word in str(caught.value)


def test_the_caret_points_at_the_place():
    text = "Lambertian(0.2) + Microfact(GGX(0.1))"
    with pytest.raises(ExpressionError) as caught:
        expression(text)
    first, shown, caret = str(caught.value).split("\n")
    assert "column 19" in first
    assert shown[len(caret) - 1 :].startswith("Microfact(")
    with pytest.raises(ExpressionError, match="column 7: unknown name 'x'"):
        expression("'é' + x")  # columns are characters, not bytes


def test_values_out_of_bounds_keep_their_own_error():
    for text in (
        "Lambertian(1.5)",
        "Lambertian(nan)",
        "Lambertian(inf)",
        "Microfacet(GGX(0))",
        "Lambertian(-0.1)",
    ):
        with pytest.raises(ParameterError, match="expected"):
            expression(text)
    with pytest.raises(NotFoundError, match="did you mean 'rho'"):
        expression("Lambertian(roh=0.2)")


WORDS = ["Lambertian", "Microfacet", "GGX", "Sum", "material", "load", "Phong", "rho", "gn", "nan", "lambda"]
MARKS = [
    *"()[]{},+-*/=.'\"#\\:; \n@é\x00",
    "0.5",
    "1e400",
    "-1",
    "True",
    "'gold'",
    "'alpha_y'",
    "**",
    "9" * 400,
]


TEXTS = st.one_of(st.text(max_size=40), st.lists(st.sampled_from(WORDS + MARKS), max_size=14).map("".join))


def gives_a_reflectance_or_a_gonio_error(text):
    try:
        assert isinstance(expression(text), Reflectance)
    except gn.Error as error:
        assert str(error)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(TEXTS)
def test_any_text_gives_a_reflectance_or_a_gonio_error(text):
    gives_a_reflectance_or_a_gonio_error(text)


@pytest.mark.full
@settings(max_examples=150, deadline=None, derandomize=True)
@given(TEXTS)
def test_many_texts_give_a_reflectance_or_a_gonio_error(text):
    gives_a_reflectance_or_a_gonio_error(text)


ARGUMENTS = [
    "0.5",
    "-1",
    "[0.1, 0.2]",
    "[[1], [2, 3]]",
    "[]",
    "'alpha_x'",
    "'rho'",
    "'separable'",
    "1e308*10",
]
ARGUMENTS += ["GGX(0.2)", "Dielectric(2)", "Lambertian()", "rho=0.2", "alpha=0.1", "masking=[1]", "terms=1"]
ARGUMENTS += ["'x.exr'", "image=2", "of=3"]


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.sampled_from(sorted(names())), st.lists(st.sampled_from(ARGUMENTS), max_size=4))
def test_any_arguments_give_a_value_or_a_gonio_error(name, arguments):
    try:
        read(f"{name}({', '.join(arguments)})")
    except gn.Error as error:
        assert str(error)


# MATERIAL, LIGHT and -p of the command line.


def test_resolve_prefers_files_then_names_then_expressions(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert resolve("gold") == gn.material("gold")
    assert resolve("Au") == gn.material("gold")
    assert resolve("Lambertian(0.3)") == gn.Lambertian(0.3)
    (tmp_path / "copper").mkdir()
    assert resolve("copper") == gn.material("copper")
    gn.save(gn.Lambertian(0.3), tmp_path / "m.json")
    (tmp_path / "m.json").rename(tmp_path / "gold")
    assert resolve("gold") == gn.Lambertian(0.3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "gold-metalic",
            ["no such file", "no built-in material", "no expression", "nearest: gold-metallic-paint"],
        ),
        ("0.5*gold", ["nearest: gold"]),
        ("papr.bsdf", ["no such file", "did you mean paper.bsdf?"]),
        ("nowhere/paper.bsdf", ["there is no directory 'nowhere'"]),
        ("folder", ["it is a directory"]),
        ("copy (1).bsdf", ["no such file"]),
        ("", ["no such file"]),
        ("a" * 5000, ["no such file"]),
        ("x\x00y", ["no such file"]),
    ],
)
def test_resolve_names_what_it_tried(text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "paper.bsdf").write_text("")
    (tmp_path / "folder").mkdir()
    with pytest.raises(NotFoundError) as caught:
        resolve(text)
    for word in words:
        assert word in str(caught.value)


def test_lights():
    assert resolve_light("constant") == gn.ConstantLight(1.0)
    assert resolve_light("constant:2") == gn.ConstantLight(2.0)
    assert resolve_light("constant:1,0.9,0.8") == gn.ConstantLight([1.0, 0.9, 0.8])
    assert resolve_light("Constant: 1, 2, 3") == gn.ConstantLight([1.0, 2.0, 3.0])
    up = resolve_light("distant:0,0")
    assert np.allclose(up.direction, [0, 0, 1]) and up.irradiance == np.pi
    assert np.allclose(resolve_light("distant:90,-90,2").direction, [0, -1, 0])
    assert resolve_light("point:1,2,2") == gn.PointLight([1.0, 2.0, 2.0], 9.0 * np.pi)
    assert resolve_light("point:1,2,2,5") == gn.PointLight([1.0, 2.0, 2.0], 5.0)
    assert resolve_light("DistantLight([1, 0, 1], irradiance=3)") == gn.DistantLight([1, 0, 1], 3.0)


def test_a_white_surface_under_the_default_distant_light_has_radiance_1():
    wo = np.array([0.0, 0.0, 1.0])
    for text in ("constant", "distant:0,0", "point:0,0,3"):
        radiance = gn.reflected_radiance(gn.Lambertian(1.0), resolve_light(text), wo)
        assert np.allclose(radiance, 1.0), text


def test_light_from_a_picture(tmp_path):
    from gonio.pictures.image import Image

    Image(np.ones((4, 8, 3), np.float32)).save(tmp_path / "sky.hdr")
    light = resolve_light(str(tmp_path / "sky.hdr"))
    assert np.allclose(light.incident(np.array([[0.0, 0.0, 1.0]])), 1.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("constant:x", ["not a list of numbers"]),
        ("constant:", ["not a list of numbers"]),
        ("constant:nan", ["NaN or infinite"]),
        ("constant:-1", ["out of bounds"]),
        ("distant", ["distant:THETA,PHI"]),
        ("distant:4", ["distant:THETA,PHI"]),
        ("distant:200,0", ["0 (up) to 180 (down)"]),
        ("point:1,2", ["point:X,Y,Z"]),
        ("studio:1", ["studio:THETA,PHI"]),
        ("stduio", ["no such light", "did you mean studio?"]),
        ("zzz", ["no such file", "expected one of FILE"]),
        ("nothing.exr", ["no such file"]),
        ("Lambertian(0.2)", ["expected a light"]),
        ("DistantLight([0,0,0])", ["length 0"]),
        ("ConstantLight(", ["never closed"]),
    ],
)
def test_bad_lights(text, words):
    with pytest.raises(gn.Error) as caught:
        resolve_light(text)
    for word in words:
        assert word in str(caught.value)


def test_parameters_are_found_by_path_by_end_and_by_alias():
    m = gn.Lambertian(0.1) + 0.5 * gn.Microfacet(gn.GGX(0.1), gn.Conductor(0.2, 3.9))
    assert with_parameters(m, []) == m
    for name in (
        "alpha",
        "distribution.alpha",
        "1.of.distribution.alpha",
        "alpha_x",
        "1.of.distribution.alpha_x",
    ):
        assert with_parameters(m, [f"{name}=0.3"]).parameters["1.of.distribution.alpha_x"].value == 0.3
    assert with_parameters(m, ["rho=0.1,0.2,0.3"]).terms[0] == gn.Lambertian([0.1, 0.2, 0.3])
    assert with_parameters(m, ["rho = [0.1, 0.2, 0.3]"]).terms[0] == gn.Lambertian([0.1, 0.2, 0.3])
    assert with_parameters(m, ["masking=separable"]).terms[1].of.masking == "separable"
    assert with_parameters(m, ["fresnel=Dielectric(1.4)"]).terms[1].of.fresnel == gn.Dielectric(1.4)
    both = with_parameters(m, ["distribution=GaussianFacets(0.2)", "masking=v_groove"])
    assert both.terms[1].of.distribution == gn.GaussianFacets(0.2)


@pytest.mark.parametrize(
    ("assignments", "words"),
    [
        (["alpah=0.3"], ["-p alpah", "has no parameter 'alpah'", "did you mean 'alpha'?", "0.rho"]),
        (["rho=0.3"], ["several parameters", "0.rho", "1.rho"]),
        (["alpha"], ["name=value"]),
        (["alpha="], ["name=value"]),
        (["=2"], ["name=value"]),
        (["0.rho=x"], ["expected a number"]),
        (["0.rho=nan"], ["NaN"]),
        (["0.rho=2"], ["out of bounds"]),
        (["0.rho=0.1", "0.rho=0.2"], ["given twice"]),
        (["alpha=0.1", "distribution=GGX(0.2)"], ["given twice"]),
        (["0.rho=(1"], ["-p 0.rho", "never closed"]),
    ],
)
def test_bad_parameters(assignments, words):
    m = gn.Lambertian(0.1) + gn.Lambertian(0.2) + gn.Microfacet()
    with pytest.raises(gn.Error) as caught:
        with_parameters(m, assignments)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("text", ["Coated({})", "0.5 * {}", "Lambertian(0.5) + {} - 1"])
def test_names_of_materials_are_recognized_whole(text):
    for name in ("gold", "gold-metallic-paint", "alum-bronze"):
        with pytest.raises(gn.errors.ExpressionError, match=f'{name} is a built-in material; write material."{name}"'):
            gn.expression(text.format(name))


def test_every_class_that_stands_for_something_can_be_named():
    bases = {"Reflectance", "Light", "Distribution", "Fresnel", "Measured"}
    assert set(CLASSES) - set(names()) >= bases & set(CLASSES)
    assert {"Lambertian", "GGX", "Conductor", "ConstantLight"} <= set(names())
