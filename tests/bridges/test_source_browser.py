"""`gn.engine.shader_source` in a browser: GLSL by WebGL 2 and WGSL by WebGPU give what gonio gives in float32."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest
import source_browser as on_page
import source_cases as cases

import gonio as gn
from gonio.catalogue.expressions import expression
from gonio.formats.window_xml.klems import QUARTER, Klems

sync_api = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.slow_because("a browser compiles the shaders"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed"),
    pytest.mark.xdist_group("browser"),
]

GLOSSY = "Lambertian([0.4, 0.1, 0.05]) + Microfacet(GGX(0.2))"
FUNCTIONS = ("f", "pdf", "sample")
in_blocks = pytest.mark.usefixtures("uncompiled")
both = pytest.mark.parametrize("language", ["glsl", "wgsl"])


@pytest.fixture(scope="module")
def page() -> Iterator[Any]:
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=on_page.FLAGS)
        yield on_page.opened(browser)
        browser.close()


def compare(page: Any, materials: Mapping[str, Any], language: str, parameters: str = "constants") -> None:
    if language == "wgsl" and not on_page.has_webgpu(page):
        pytest.skip("this Chromium has no WebGPU")
    beyond = []
    for name, m in materials.items():
        case = cases.case(m, language, FUNCTIONS, name, parameters)
        beyond += cases.beyond([case], [on_page.run(page, case)])
    assert beyond == []


@both
@in_blocks
@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.full)])
def test_models(page: Any, language: str, whole: bool) -> None:
    few = ("coated", "coxmunk", "microfacet") if language == "glsl" else ("eon", "hapke", "rossli")
    names = ("coated", "coxmunk", "disneyprincipled", "eon", "hapke", "microfacet", "rossli", "sgd") if whole else few
    compare(page, {name: m for name, m in cases.models().items() if name in names}, language)


@both
@in_blocks
@pytest.mark.parametrize("counts", [(None, 2, 5), pytest.param((None, 1, 2, 5), marks=pytest.mark.full)], ids=str)
def test_channels_and_arguments(page: Any, language: str, counts: tuple[int | None, ...]) -> None:
    materials = {f"m{count or 0}": cases.of_channels(count) for count in counts}
    compare(page, materials, language, "arguments")


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("measured")
    gn.save(expression(GLOSSY), folder / "a.bsdf", format="rgl", resolution=8)
    gn.save(expression(GLOSSY), folder / "a.binary", format="MERL")
    rng = np.random.default_rng(1)
    return {
        "rgl": gn.load(folder / "a.bsdf"),
        "merl": gn.load(folder / "a.binary"),
        "klems": Klems(rng.uniform(0.1, 0.3, (41, 41)), QUARTER),
    }


@pytest.mark.parametrize(
    ("language", "names"),
    [
        ("glsl", ["klems"]),
        ("wgsl", ["rgl"]),
        *(pytest.param(language, ["rgl", "merl", "klems"], marks=pytest.mark.full) for language in ("glsl", "wgsl")),
    ],
)
@in_blocks
def test_tables(page: Any, language: str, names: list[str], measured: dict[str, Any]) -> None:
    compare(page, {name: measured[name] for name in names}, language)


@both
@pytest.mark.full
def test_all_models(page: Any, language: str) -> None:
    compare(page, cases.models(), language)
