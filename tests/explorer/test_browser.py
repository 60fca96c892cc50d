"""The page of `gonio view` in a browser: what is drawn, dragged, dropped and kept in the address, and its numbers."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.catalogue.expressions import expression

sync_api = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")

FLAGS = [
    *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
]
GLOSSY = "Lambertian([0.4, 0.1, 0.05]) + Microfacet(GGX(0.2))"
WIDE = {"width": 1200, "height": 800}
PATIENCE = 60_000
"""Milliseconds: a machine that does other things too compiles shaders slowly."""

Open = Callable[..., Any]


def _measured(folder: Path) -> Path:
    """A file of measurements: a painted surface, as a table."""
    path = folder / "paint.bsdf"
    gn.save(expression(GLOSSY), path, format="rgl", resolution=24)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("measured")


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    command = [sys.executable, "-m", "gonio", "view", "--no-browser", "gold", str(_measured(folder))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        yield server.stdout.readline().strip()
        server.terminate()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def open_page(address: str, browser: Any) -> Iterator[Open]:
    """Opens the page in a state and waits until it is drawn; in the end nothing stands on the console or left."""
    complaints: list[str] = []
    asked: list[str] = []
    contexts = []

    def opened(size: dict[str, int] = WIDE, where: str = address, **state: Any) -> Any:
        context = browser.new_context(viewport=size, accept_downloads=True)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(where + "#" + quote(json.dumps({"materials": [{"text": "gold"}], **state})))
        page.evaluate("() => gonio.ready")
        return page

    yield opened
    for context in contexts:
        context.close()
    assert not complaints
    host = address.split("/")[2]
    assert not [url for url in asked if not re.match(rf"(http|ws)://{re.escape(host)}/|blob:|data:|file:", url)]


def state_of(page: Any) -> dict[str, Any]:
    return page.evaluate("() => JSON.parse(JSON.stringify(gonio.state))")


def drawn(page: Any, testid: str) -> list[int]:
    """How many colours a canvas shows, and how many of its pixels are not empty."""
    return page.get_by_test_id(testid).evaluate(
        """canvas => {
          const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
          copy.drawImage(canvas, 0, 0);
          const pixels = new Uint32Array(copy.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
          return [new Set(pixels).size, pixels.filter((pixel) => pixel).length];
        }"""
    )


def picture(page: Any, testid: str) -> str:
    return page.get_by_test_id(testid).evaluate("canvas => canvas.toDataURL()")


def settled(page: Any) -> None:
    """Waits until no more is drawn."""
    page.evaluate(
        """async () => {
          let before = -1;
          while (before !== gonio.frames) {
            before = gonio.frames;
            await new Promise((resolve) => setTimeout(resolve, 400));
          }
        }"""
    )


def drop(page: Any, name: str, content: bytes) -> None:
    page.evaluate(
        """([name, text]) => {
          const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
          const dataTransfer = new DataTransfer();
          dataTransfer.items.add(new File([bytes], name));
          for (const kind of ["dragenter", "drop"]) {
            window.dispatchEvent(new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true }));
          }
        }""",
        [name, base64.b64encode(content).decode()],
    )


VIEWS = {
    "lobe": "lobe-0",
    "lit": "sphere-0",
    "polar": "polar",
    "cartesian": "cartesian",
    "slice": "slice-0",
    "albedo": "albedo",
    "spectrum": "spectrum",
    "mueller": "mueller-0",
}


@pytest.mark.parametrize("views", [[*VIEWS][2:], pytest.param([*VIEWS], marks=pytest.mark.full)], ids=["flat", "all"])
def test_every_view_shows_something(open_page, views):
    """Lobes and lit spheres are what most of the other tests look at."""
    page = open_page(views=views)
    assert page.locator("h1").all_inner_texts() == ["gonio"]  # of the page, no more that of its start
    for testid in map(VIEWS.get, views):
        page.get_by_test_id(testid).scroll_into_view_if_needed()
        settled(page)
        colours, pixels = drawn(page, testid)
        assert colours > 20 and pixels > 1000, testid


def test_a_slider_changes_the_picture_and_the_address(open_page):
    page = open_page(views=["lit"])
    settled(page)
    before = picture(page, "sphere-0")
    slider = page.get_by_test_id("parameter-distribution.alpha_x-0")
    slider.focus()
    for _ in range(5):
        slider.press("ArrowRight")
    settled(page)
    replaced = state_of(page)["materials"][0]["replaced"]
    assert replaced["distribution.alpha_x"] > 0.1
    assert picture(page, "sphere-0") != before
    assert page.evaluate("() => gonio.lastUpdate.drawn > gonio.lastUpdate.from")
    page.wait_for_timeout(1000)
    assert json.loads(unquote(page.url.split("#")[1]))["materials"][0]["replaced"] == replaced


def test_numbers_are_entered_and_refused_in_the_words_of_gonio(open_page):
    page = open_page(views=["polar"])
    number = page.get_by_test_id("number-distribution.alpha_x-0")
    number.fill("0.35")
    assert state_of(page)["materials"][0]["replaced"] == {"distribution.alpha_x": 0.35}
    number.fill("-2")
    number.press("Enter")
    error = page.get_by_test_id("error")
    error.wait_for()
    assert "alpha_x" in error.inner_text()
    assert state_of(page)["materials"][0]["replaced"] == {"distribution.alpha_x": 0.35}
    error.get_by_role("button").click()
    assert not error.is_visible()


def test_the_light_is_dragged(open_page):
    page = open_page(views=["lobe"], theta=30)
    box = page.get_by_test_id("lobe-0").bounding_box()
    camera = state_of(page)["camera"]
    x, y = _handle(box, camera, 30.0)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 60, y + 50, steps=4)
    page.mouse.up()
    after = state_of(page)
    assert after["theta"] > 40.0
    assert after["camera"] == camera
    page.mouse.move(box["x"] + 40, box["y"] + box["height"] - 40)
    page.mouse.down()
    page.mouse.move(box["x"] + 140, box["y"] + box["height"] - 40, steps=3)
    page.mouse.up()
    assert state_of(page)["camera"] != camera
    assert state_of(page)["theta"] == after["theta"]


def _handle(box: dict[str, float], camera: list[float], theta: float) -> tuple[float, float]:
    """Where the ball of the incident direction stands: the camera looks at (0, 0, 0.42), 30 degrees wide."""
    eye, up = np.array(camera), np.array([0.0, 0.0, 1.0])
    back = (eye - [0.0, 0.0, 0.42]) / np.linalg.norm(eye - [0.0, 0.0, 0.42])
    right = np.cross(up, back) / np.linalg.norm(np.cross(up, back))
    at = 1.2 * np.array([np.sin(np.radians(theta)), 0.0, np.cos(np.radians(theta))]) - eye
    scale = box["height"] / 2 / np.tan(np.radians(15.0)) / -(at @ back)
    return (
        box["x"] + box["width"] / 2 + scale * (at @ right),
        box["y"] + box["height"] / 2 - scale * (at @ np.cross(back, right)),
    )


def test_materials_stand_side_by_side_and_go(open_page):
    page = open_page(views=["lit", "polar"])
    page.get_by_test_id("add").fill("OrenNayar(0.5, 0.3)")
    page.get_by_test_id("add").press("Enter")
    page.get_by_test_id("sphere-1").wait_for()
    settled(page)
    for _ in range(100):  # a busy machine draws late
        if drawn(page, "sphere-1")[1] > 1000:
            break
        page.wait_for_timeout(100)
    assert drawn(page, "sphere-1")[1] > 1000
    page.get_by_test_id("remove-0").click()
    assert page.evaluate("() => gonio.materials.map((one) => one.text)") == ["OrenNayar(0.5, 0.3)"]
    page.get_by_test_id("add").fill("NoSuchThing(1)")
    page.get_by_test_id("add").press("Enter")
    page.get_by_test_id("error").wait_for()
    assert "NoSuchThing" in page.get_by_test_id("error").inner_text()
    assert page.evaluate("() => gonio.materials.length") == 1


@pytest.mark.parametrize(
    ("view", "testid"), thinned([("slice", "slice-1"), ("lit", "sphere-1")], [("slice", "slice-1")])
)
def test_files_are_dropped(open_page, folder, view, testid):
    page = open_page(views=[view])
    drop(page, "dropped.bsdf", (folder / "paint.bsdf").read_bytes())
    page.get_by_test_id(testid).wait_for()
    settled(page)
    assert drawn(page, testid)[1] > 1000
    drop(page, "broken.bsdf", b"this is no measurement")
    error = page.get_by_test_id("error")
    error.wait_for()
    assert "broken.bsdf" in error.inner_text()
    assert page.evaluate("() => gonio.materials.length") == 2


def test_what_leaves_the_page(open_page):
    page = open_page(views=["polar", "slice"])
    settled(page)
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the numbers of Polar plot").click()
    lines = Path(download.value.path()).read_text().splitlines()
    assert lines[2] == "material,theta_i,phi_i,plane,theta_o,channel,f" and len(lines) > 2000
    with page.expect_download() as download:
        page.get_by_test_id("export-0").click()
        page.get_by_role("menuitem", name="PNG of θₕ").click()
    assert Path(download.value.path()).read_bytes()[:4] == b"\x89PNG"
    for name, words in (
        ("HLSL", "float3 microfacet_f"),
        ("Python", "gn.material('gold')"),
        ("Command line", "gonio show"),
    ):
        page.get_by_test_id("export-0").click()
        page.get_by_role("menuitem", name=name).click()
        page.get_by_role("dialog").wait_for()
        assert words in page.get_by_role("dialog").inner_text()
        page.keyboard.press("Escape")


@pytest.mark.parametrize(
    ("view", "light", "shape"),
    [("slice", None, None), pytest.param("lit", "area", "teapot", marks=pytest.mark.full)],
)
def test_the_address_brings_everything_back(open_page, view, light, shape):
    page = open_page(views=[view, "polar"])
    page.evaluate("() => { gonio.setIncidence(62, 15); gonio.setParameter(0, 'distribution.alpha_x', 0.4); }")
    if light:
        page.get_by_test_id("light").select_option(light)
        page.get_by_test_id("shape").select_option(shape)
    page.get_by_test_id("units").select_option("radians")
    page.get_by_test_id("view-albedo").click()
    settled(page)
    page.wait_for_timeout(1000)
    before = state_of(page)
    page.reload()
    page.evaluate("() => gonio.ready")
    assert state_of(page) == before
    assert (before["theta"], before["units"]) == (62, "radians") and "albedo" in before["views"]
    assert light is None or (before["light"], before["shape"]) == (light, shape)
    assert page.evaluate("() => gonio.materials[0].values.get('distribution.alpha_x')") == 0.4


def test_units_and_theme(open_page):
    page = open_page(views=["polar"], theta=60)
    page.get_by_test_id("units").select_option("radians")
    assert float(page.get_by_test_id("theta-i").input_value()) == pytest.approx(1.047)
    ground = "() => getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(ground)
    page.get_by_test_id("theme").select_option("dark")
    assert page.evaluate(ground) != light
    page.emulate_media(color_scheme="dark")
    page.get_by_test_id("theme").select_option("auto")
    assert page.evaluate("() => document.documentElement.dataset.theme") == "dark"


def test_everything_by_keyboard(open_page):
    page = open_page(views=["lobe"], theta=40)
    page.keyboard.press("]")
    assert state_of(page)["theta"] == 41
    page.get_by_test_id("lobe-0").focus()
    page.keyboard.press("ArrowUp")
    assert state_of(page)["theta"] == 40
    page.keyboard.press("?")
    page.get_by_role("dialog").wait_for()
    page.keyboard.press("Escape")
    page.keyboard.press("3")
    assert state_of(page)["views"] == ["lobe", "polar"]
    page.get_by_test_id("export-0").focus()
    page.keyboard.press("Enter")
    page.keyboard.press("ArrowDown")
    assert page.evaluate("() => document.activeElement.getAttribute('role')") == "menuitem"
    page.keyboard.press("Escape")
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, canvas")]
          .filter((one) => !one.hidden && !one.closest("label"))
          .filter((one) => !one.getAttribute("aria-label") && !one.textContent.trim())
          .map((one) => one.outerHTML)"""
    )
    assert not unnamed


def test_a_phone_shows_it_without_a_horizontal_scroll(open_page):
    page = open_page(size={"width": 390, "height": 780}, views=["lobe", "lit"])
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
    page.get_by_test_id("parameter-distribution.alpha_x-0").scroll_into_view_if_needed()
    assert page.get_by_test_id("parameter-distribution.alpha_x-0").bounding_box()["width"] > 80


def test_laws_and_fits_beside_the_pictures(open_page):
    page = open_page(views=["laws", "fit"])
    page.get_by_test_id("check-0").get_by_role("button").click()
    page.get_by_test_id("check-0").get_by_role("row", name="reciprocity").wait_for()
    page.get_by_test_id("fit-0").get_by_role("combobox").fill("Microfacet(GGX(0.2))")
    page.get_by_test_id("fit-0").get_by_role("button", name="fit").click()
    page.get_by_test_id("adopt").click()
    page.get_by_test_id("material-1").wait_for()
    assert "Microfacet" in page.evaluate("() => gonio.materials[1].text")


def test_the_offline_page_needs_no_server(open_page, tmp_path):
    path = tmp_path / "gold.html"
    command = [sys.executable, "-m", "gonio", "view", "gold", "--export", str(path)]
    subprocess.run(command, check=True, capture_output=True)
    page = open_page(where=path.as_uri(), views=["lit", "laws"])
    settled(page)
    assert drawn(page, "sphere-0")[1] > 1000
    page.get_by_test_id("check-0").get_by_role("button").click()
    page.get_by_test_id("check-0").get_by_role("row", name="reciprocity").wait_for()
    assert page.evaluate("() => gonio.evaluate(0, [[0, 0, 1]], [[0, 0, 1]])")[0][0] > 1.0


MATERIALS = [
    "gold",
    GLOSSY,
    "OrenNayar(0.5, 0.4)",
    "Ward(0.2, 0.1, 0.3)",
    "blue-acrylic",
    "RoughDielectric(GGX(0.3), 1.5)",
    "Microfacet(Beckmann(0.2, 0.4), Dielectric(1.5))",
    "DisneyPrincipled([0.5, 0.2, 0.1])",
    "RPV(0.1, 0.8, -0.1, 0.2)",
    "Lambertian([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])",
    "CookTorrance(0.3)",
]


FEW = ["gold", "RoughDielectric(GGX(0.3), 1.5)", "Lambertian([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])"]


@pytest.mark.parametrize("materials", [FEW, pytest.param(MATERIALS, marks=pytest.mark.full)], ids=["few", "all"])
def test_values_of_the_browser_are_those_of_python(open_page, folder, materials):
    measured = str(folder / "paint.bsdf")
    texts = [*materials, measured]
    page = open_page(materials=[{"text": text} for text in texts], views=["facts"])
    rng = np.random.default_rng(1)
    wi, wo = (rng.normal(size=(300, 3)) for _ in range(2))
    wi[:, 2], wo[:200, 2] = abs(wi[:, 2]), abs(wo[:200, 2])
    wi, wo = gn.directions.normalize(wi), gn.directions.normalize(wo)
    is_clear = (wi[:, 2] > 0.02) & (abs(wo[:, 2]) > 0.02)
    assert page.evaluate("() => gonio.materials.map((one) => one.text)") == texts
    for k, text in enumerate(texts):
        m = gn.load(measured) if text == measured else expression(text) if "(" in text else gn.material(text)
        found = page.evaluate("([k, wi, wo]) => gonio.evaluate(k, wi, wo)", [k, wi.tolist(), wo.tolist()])
        expected = np.asarray(m.f(wi, wo)).reshape(300, -1)
        expected = expected[is_clear]
        near_zero = 1e-6 * abs(expected).max()  # tables interpolate in float32
        np.testing.assert_allclose(np.array(found, float)[is_clear], expected, rtol=1e-4, atol=near_zero, err_msg=text)


def test_a_public_function_is_a_form(open_page):
    page = open_page()
    page.get_by_role("button", name="Ask").click()
    page.get_by_test_id("ask-function").select_option("black_sky_albedo")
    page.get_by_test_id("ask-theta_s").fill("45")
    page.get_by_test_id("ask-go").click()
    expected = gn.remote_sensing.black_sky_albedo(gn.material("gold"), np.radians(45.0))
    sync_api.expect(page.get_by_test_id("ask-result")).to_contain_text("[", timeout=PATIENCE)
    found = page.get_by_test_id("ask-result").inner_text().strip("[]").split()
    np.testing.assert_allclose(np.array(found, float), expected, atol=1e-5)
    page.get_by_test_id("ask-theta_s").fill("95")
    page.get_by_test_id("ask-theta_s").press("Enter")
    sync_api.expect(page.get_by_test_id("ask-result")).to_contain_text(
        "theta_s '95': expected numbers from 0 to 90 degrees", timeout=PATIENCE
    )
