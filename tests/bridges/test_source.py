"""`gn.engine.shader_source`: texts are compiled, run, and compared with gonio's own values in float32."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import source_cases as cases
import source_compilers as compilers

import gonio as gn
from gonio.bridges.source import LANGUAGES
from gonio.bridges.source.writing import SMALL
from gonio.catalogue.expressions import expression
from gonio.errors import ParameterError
from gonio.formats.window_xml.klems import QUARTER, Klems
from gonio.pictures.image import load_image

ALL = tuple(LANGUAGES)
RUN = tuple(compilers.COMPILERS)
FUNCTIONS = ("f", "pdf", "sample")
GLOSSY = "Lambertian([0.4, 0.1, 0.05]) + Microfacet(GGX(0.2))"


FULL = pytest.mark.full
in_blocks = pytest.mark.usefixtures("uncompiled")
"""Values by NumPy: of few directions, in less time than kernels are compiled."""


def compiled(language: str) -> Any:
    """A mark: the tests of a language run where its compiler is."""
    program = compilers.COMPILERS[language].command[0]
    return pytest.mark.skipif(shutil.which(program) is None, reason=f"no {program} is installed")


def each(*names: str) -> Any:
    return pytest.mark.parametrize("language", [pytest.param(name, marks=compiled(name)) for name in names])


def compare(
    materials: Mapping[str, Any],
    language: str,
    folder: Path,
    functions: Sequence[str] = FUNCTIONS,
    parameters: str = "constants",
) -> None:
    made = [cases.case(m, language, functions, name, parameters) for name, m in materials.items()]
    assert cases.beyond(made, compilers.run(made, folder)) == []


@each(*RUN)
@pytest.mark.full
def test_all_models(language: str, tmp_path: Path) -> None:
    compare(cases.models(), language, tmp_path)


@each(*RUN)
@in_blocks
def test_models(language: str, tmp_path: Path) -> None:
    """Each has a quarter of them."""
    compare(dict([*cases.few().items()][RUN.index(language) :: 4]), language, tmp_path)


@each(*RUN)
@in_blocks
@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=FULL)])
def test_channels(language: str, whole: bool, tmp_path: Path) -> None:
    counts = (None, 1, 2, 3, 4, 5) if whole else (None, 2, 5) if language == "osl" else (1, 3, 4)
    compare({f"m{count or 0}": cases.of_channels(count) for count in counts}, language, tmp_path, (*FUNCTIONS, "f_cos"))


@each(*RUN)
@in_blocks
def test_parameters_as_arguments(language: str, tmp_path: Path) -> None:
    """One text serves all materials of a kind."""
    made = [cases.of_channels(count) for count in (None, 3, 5)]
    materials = {f"m{i}": m for i, m in enumerate(made)}
    texts = []
    for m in (made[1], made[1].replace(**{"1.distribution.alpha_x": 0.45})):
        text = gn.engine.shader_source(m, language, FUNCTIONS, "metal", "arguments").text
        texts.append("\n".join(line for line in text.splitlines() if not line.startswith("//")))
    assert texts[0] == texts[1]
    compare(materials | {"metal": m}, language, tmp_path, parameters="arguments")


@each(*RUN)
@pytest.mark.parametrize(
    "names",
    [
        ("hapke", "rpv"),
        pytest.param(("microfacet", "hapke", "coated", "disneyprincipled", "rpv"), marks=FULL),
    ],
    ids=["few", "more"],
)
def test_jacobian(language: str, names: tuple[str, ...], tmp_path: Path) -> None:
    materials = {name: m for name, m in cases.models().items() if name in names} | {"m5": cases.of_channels(5)}
    compare(materials, language, tmp_path, ["jacobian"])


@each(*RUN)
@in_blocks
def test_mueller(language: str, tmp_path: Path) -> None:
    materials = {name: m for name, m in cases.models().items() if m.polarizes}
    assert materials
    compare(dict(list(materials.items())[:3]), language, tmp_path, ["mueller"])


def resampled(m: Any, polar: int, azimuths: int) -> Any:
    """A table of so many nodes, without the account of what was lost that `gn.repair.resample` gives."""
    theta, phi = np.linspace(0.0, 1.55, polar), np.linspace(0.0, 2.0 * np.pi, azimuths, endpoint=False)
    table = gn.Gridded("angles", {"theta_i": theta, "theta_o": theta, "phi": phi}, np.zeros((polar, polar, azimuths)))
    names = {"channels": ["R", "G", "B"]} if m.channels else {}
    return gn.Gridded("angles", table.axes, m.f(*table.directions()), **names)


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Materials with tables: small ones, large ones, of several functions."""
    folder = tmp_path_factory.mktemp("measured")
    gn.save(expression(GLOSSY), folder / "a.bsdf", format="rgl", resolution=8)
    rng = np.random.default_rng(1)
    return {
        "rgl": gn.load(folder / "a.bsdf"),
        "klems": Klems(rng.uniform(0.1, 0.3, (41, 41)), QUARTER),
        "grid": resampled(expression(GLOSSY), 7, 12),
        "small": resampled(gn.Lambertian(0.4), 3, 4),
    }


@each(*RUN)
@in_blocks
def test_tables(language: str, measured: dict[str, Any], tmp_path: Path) -> None:
    compare(measured, language, tmp_path)


@pytest.mark.parametrize(
    ("language", "interpolation"),
    [
        pytest.param(
            name, how, marks=[compiled(name), *([] if (how == "nearest") == (name in ("c", "osl")) else [FULL])]
        )
        for name, how in product(RUN, ["linear", "nearest"])
    ],
)
@in_blocks
def test_holes_of_tables_stay_holes(language: str, interpolation: str, tmp_path: Path) -> None:
    whole = resampled(expression(GLOSSY), 9, 12)
    values = np.array(whole.brdf())
    values[np.random.default_rng(3).random(values.shape) < 0.3] = np.nan
    values[:, 6:] = np.nan
    holed = gn.Gridded("angles", whole.axes, values, channels=whole.channel_names, interpolation=interpolation)
    case = cases.case(holed, language, ["f"], "holed")
    [[found]] = compilers.run([case], tmp_path)
    expected = case.calls[0].expected["f"]
    missing = np.isnan(expected)
    assert 0.01 < missing.mean() < 0.9
    np.testing.assert_allclose(found[~missing], expected[~missing], rtol=1e-5, atol=1e-5 * np.nanmax(expected))
    assert (found[missing] == 0.0).all() if language == "osl" else np.isnan(found[missing]).all()


@pytest.mark.parametrize("language", ALL)
def test_large_tables_are_the_programs(language: str, measured: dict[str, Any], tmp_path: Path) -> None:
    source = gn.engine.shader_source(measured["grid"], language, name="grid")
    assert [t.name for t in source.tables] == [name for name in ("grid_table0",) if name in source.text]
    assert all(len(t.values) > SMALL and t.values.dtype == np.float32 for t in source.tables)
    text, *beside = source.save(tmp_path / "grid.txt")
    assert text.read_text() == source.text == str(source)
    for path, table in zip(beside, source.tables, strict=True):
        if language == "osl":
            values = np.ravel(load_image(path).pixels)[: len(table.values)]
        else:
            values = np.fromfile(path, "<f4")
        np.testing.assert_array_equal(values, table.values)
    assert gn.engine.shader_source(measured["small"], language).tables == ()


GLSLANG = shutil.which("glslangValidator")
AROUND = {
    "es": ("#version 300 es\n", "\nout vec4 colour;\nvoid main() { colour = vec4(0.0); }\n", ".frag"),
    "desktop": ("#version 330\n", "\nout vec4 colour;\nvoid main() { colour = vec4(0.0); }\n", ".frag"),
    "hlsl": ("", "\nfloat4 main() : SV_Target { return float4(0.0, 0.0, 0.0, 0.0); }\n", ".frag"),
}


@pytest.mark.skipif(GLSLANG is None, reason="no glslangValidator is installed")
@pytest.mark.parametrize("kind", AROUND)
def test_glslang_takes_all_models(kind: str, measured: dict[str, Any], tmp_path: Path) -> None:
    before, after, suffix = AROUND[kind]
    files = []
    materials = cases.models() | measured | {"m5": cases.of_channels(5), "m2": cases.of_channels(2)}
    for name, m in materials.items():
        text = gn.engine.shader_source(m, "hlsl" if kind == "hlsl" else "glsl", FUNCTIONS, name).text
        files.append(tmp_path / f"{name}{suffix}")
        files[-1].write_text(before + text + after)
    options = ["-D", "-e", "main", "-V"] if kind == "hlsl" else []
    for some in np.array_split(np.array(files, dtype=object), 1 if kind != "hlsl" else len(files)):
        done = subprocess.run([str(GLSLANG), *options, *some], capture_output=True, text=True, cwd=tmp_path)
        assert not done.returncode, "\n".join(line for line in done.stdout.splitlines() if "ERROR" in line)[:3000]


@pytest.mark.parametrize("language", ALL)
def test_all_global_names_begin_with_the_name(language: str) -> None:
    """Two texts stand in one program."""
    text = gn.engine.shader_source(cases.of_channels(3), language, ("f", "pdf", "sample", "jacobian"), "gold").text
    text = re.sub(r"(//|#)[^\n]*", "", text) if language != "osl" else re.sub(r"//[^\n]*", "", text)
    unindented = [line for line in text.splitlines() if line and not line.startswith((" ", "{", "}", "precision"))]
    assert unindented
    for line in unindented:
        assert "gold_" in line or "Gold" in line, line


@pytest.mark.parametrize("language", ALL)
def test_comments_end_at_the_line(language: str) -> None:
    """A backslash would draw the next line into a comment; formulas of docstrings have them."""
    for name in ("microfacet", "hapke", "lambertian"):
        text = gn.engine.shader_source(cases.models()[name], language, ("f", "sample")).text
        assert text.isascii()
        assert not re.search(r"\\|\?\?/", text)
        assert all(len(line) <= 120 for line in text.splitlines())
        assert "Source:" in text


def test_texts_are_alike_each_time() -> None:
    first, second = (gn.engine.shader_source(cases.models()["coated"], "glsl", FUNCTIONS) for _ in range(2))
    assert first.text == second.text
    assert first.functions == tuple(f"coated_{word}" for word in FUNCTIONS)


def test_functions_have_promised_signatures() -> None:
    text = gn.engine.shader_source(cases.of_channels(3), "glsl", ("f", "f_cos", "pdf", "sample"), "m", "arguments").text
    given = r"vec3 rho, float alpha_x, float alpha_y, vec3 eta, vec3 k"
    text = re.sub(r",\s+", ", ", text)
    assert re.search(r"^vec3 m_f\(vec3 wi, vec3 wo, ", text, re.M)
    assert re.search(r"^float m_pdf\(vec3 wi, vec3 wo, ", text, re.M)
    assert re.search(
        r"^void m_sample\(vec3 wo, vec2 u, .*out vec3 wi, out vec3 weight, out float pdf, out bool", text, re.M
    )
    for word in given.split(", "):
        assert f", {word}" in text
    constants = gn.engine.shader_source(gn.Lambertian([0.1, 0.2, 0.3]), "glsl", name="m")
    assert "const vec3 m_rho = vec3(0.1, 0.2, 0.3);" in constants.text
    assert "\nvec3 m_f(vec3 wi, vec3 wo)\n" in constants.text
    assert "#version" not in constants.text


def test_paths_of_arguments_replace() -> None:
    m = cases.of_channels(3)
    for a in gn.engine.shader_source(m, "c", parameters="arguments").arguments:
        value = a.value[0] if a.width == 1 else list(a.value)
        np.testing.assert_allclose(
            m.replace(**{a.path: value}).f([0.6, 0, 0.8], [0, 0, 1]), m.f([0.6, 0, 0.8], [0, 0, 1])
        )


# What is refused.

LAMBERT = gn.Lambertian(0.5)


@pytest.mark.parametrize(
    ("options", "kind", "words"),
    [
        ({"language": "metal"}, ParameterError, "language='metal'.*'glsl'"),
        ({"language": "gsl"}, ParameterError, "glsl"),
        ({"function": "g"}, ParameterError, "function='g'.*'f'.*'pdf'"),
        ({"function": ()}, ParameterError, "some of 'f', 'f_cos'"),
        ({"function": ("f", "f")}, ParameterError, "one of each function"),
        ({"parameters": "numbers"}, ParameterError, "'constants' or 'arguments'"),
        ({"name": "2gold"}, ParameterError, "letters, digits"),
        ({"name": "gl_gold"}, ParameterError, "gl_"),
        ({"name": "a__b"}, ParameterError, "single _"),
        ({"name": "gold\n#error"}, ParameterError, "letters, digits"),
    ],
)
def test_bad_words(options: dict[str, Any], kind: type[Exception], words: str) -> None:
    with pytest.raises(kind, match=words):
        gn.engine.shader_source(LAMBERT, **options)


def test_maps_are_refused_with_numbers_that_work() -> None:
    m = gn.Lambertian([[0.1, 0.2], [0.3, 0.4]])
    with pytest.raises(ParameterError, match=r"rho is a map of shape \(2,\).*one place") as caught:
        gn.engine.shader_source(m, "glsl")
    advice = re.search(r"m\.replace\(.*?\)\}?\)", str(caught.value))
    assert advice is not None
    assert gn.engine.shader_source(eval(advice[0], {"m": m}), "glsl").channels == 2
    with pytest.raises(ParameterError, match="alpha_x is a map"):
        gn.engine.shader_source(gn.Microfacet(gn.GGX(np.full((4, 4, 1), 0.3))), "c", parameters="arguments")


def test_textures_and_missing_parameters_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"rho is a texture.*m\.at\(uv"):
        gn.engine.shader_source(gn.Lambertian(gn.Texture(np.full((2, 2), 0.5))))


def test_long_formulas_are_refused_with_a_count_that_works(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gonio.bridges.source.writing.OPERATIONS", 2000)
    m = cases.of_channels(40)
    with pytest.raises(ParameterError, match=r"takes \d+ operations, expected at most 2000") as caught:
        gn.engine.shader_source(m, "c", "jacobian")
    found = re.search(r"at most (\d+) channels: m\.replace of (.*) with", str(caught.value))
    assert found is not None
    fewer = {path: np.full(int(found[1]), m.parameters[path].low + 0.1) for path in eval(f"[{found[2]}]")}
    assert gn.engine.shader_source(m.replace(**fewer), "c", "jacobian").channels == int(found[1])
    monkeypatch.setattr("gonio.bridges.source.writing.OPERATIONS", 20)
    with pytest.raises(ParameterError, match="write the parts of the material as texts"):
        gn.engine.shader_source(cases.of_channels(None), "c")
