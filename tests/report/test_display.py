"""What notebooks show: every object, well-formed, without links; a failure shows the object as it prints."""

from __future__ import annotations

import base64
import io
import re
import subprocess
import sys
import warnings
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from face import classes
from house import PAINT

import gonio as gn
from gonio.declared import notebooks
from gonio.formula import tree
from gonio.report import display
from gonio.report.display import _html, _sphere, _things

FLOOR = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
LAMP = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]], [[0, 1, 2, 3]]
UP = np.array([0.0, 0.0, 1.0])


def scan(**more: Any) -> gn.Scattered:
    theta = np.radians(np.arange(0.0, 61.0, 10.0))
    f = np.full(len(theta), 0.2)
    f[3] = np.nan
    return gn.Scattered(0.1, 0.0, theta, np.pi, f, **more)


def scene() -> gn.Scene:
    return gn.Scene([gn.scenes.Mesh(FLOOR, gn.Lambertian(0.5)), gn.scenes.Mesh(LAMP, gn.Lambertian(0.0), exitance=1.0)])


def image() -> gn.scenes.Image:
    return gn.scenes.Image(np.linspace(0.0, 2.0, 96, dtype=np.float32).reshape(4, 8, 3), np.ones((4, 8), np.float32))


MADE: dict[str, Callable[[], Any]] = {
    "model": lambda: PAINT,
    "mirror": lambda: gn.IdealSpecular(0.9),
    "glass": lambda: gn.RoughDielectric(gn.GGX(0.2), 1.5),
    "map": lambda: gn.Lambertian(np.linspace(0.1, 0.9, 18).reshape(2, 3, 3)),
    "spectral": lambda: gn.Lambertian(np.linspace(0.1, 0.9, 7), wavelengths=np.linspace(400.0, 700.0, 7)),
    "bright": lambda: 1e8 * gn.Lambertian(1.0),
    "rows": scan,
    "grid": lambda: gn.tables.tabulate(PAINT, resolution=(6, 6, 12)),
    "distribution": lambda: gn.GGX(0.2),
    "fresnel": lambda: gn.Conductor([0.2, 0.9, 1.1], 3.9),
    "light": lambda: gn.SunLight([0.0, 0.0, 1.0], 3.0),
    "environment": lambda: gn.EnvironmentLight.studio(height=16),
    "spectrum": lambda: gn.spectra.illuminant("D65"),
    "texture": lambda: gn.Texture(np.full((2, 3, 3), 0.5)),
    "image": image,
    "difference": lambda: gn.scenes.picture_difference(image(), gn.scenes.Image(1.1 * image().pixels)),
    "fit": lambda: gn.fit((gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.1, 0.11, 0.12]),
                          gn.Lambertian(), loss="plain"),
    "report": lambda: gn.check(gn.OriginalPhong(0.25, 8.0), laws=["reciprocity", "positivity"]),
    "verdict": lambda: gn.check(gn.Lambertian(0.5), laws=["positivity"])["positivity"],
    "map report": lambda: gn.check(gn.Lambertian(np.full((2, 2, 1), 0.5)), laws=["energy"]),
    "plan": lambda: gn.planning.plan(gn.Lambertian(0.5), 3),
    "goniometer": gn.planning.Goniometer,
    "quoted": lambda: gn.with_uncertainty(gn.albedo, gn.tables.tabulate(gn.Lambertian(0.4), resolution=(5, 5, 8)), UP),
    "fate": lambda: gn.fate(gn.ThinDielectric(1.5), UP),
    "sample": lambda: gn.Lambertian(0.5).sample(UP, np.array([0.2, 0.3])),
    "cone": lambda: gn.Cone(UP, 0.2),
    "mesh": lambda: gn.scenes.Mesh(FLOOR),
    "scene": scene,
    "radiosity": lambda: gn.scenes.radiosity(scene(), patches=32),
    "source": lambda: gn.engine.shader_source(gn.Lambertian(0.5), "glsl"),
    "kernel": lambda: gn.engine.kernel(gn.Lambertian(0.5)),
    "contents": gn.models,
    "entry": lambda: next(iter(gn.materials())),
}  # fmt: skip


@pytest.mark.parametrize("name", MADE)
def test_every_object_is_shown(name):
    thing = MADE[name]()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        shown = thing._repr_html_()
    assert shown == display.html(thing)
    root = ElementTree.fromstring(shown)  # well-formed
    assert root.attrib["class"] == "gonio" and "".join(root.itertext()).strip()
    assert not re.search(r"https?://|<script|<link|src=\"(?!data:image/png;base64,)|@import", shown)
    assert not re.search(r"[^-]color:\s*(#|rgb|black|white)", shown)  # letters have the page's colour, light or dark
    for picture in root.iter("img"):
        assert picture.attrib["alt"]
        assert base64.b64decode(picture.attrib["src"].partition(",")[2]).startswith(b"\x89PNG")


def test_a_mesh_is_shown_as_it_is_wherever_it_is():
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]])
    shown = [gn.scenes.Mesh((corners + shift, [[0, 1, 2], [0, 2, 3]]))._repr_html_() for shift in (0.0, 1e7)]
    pictures = [next(ElementTree.fromstring(html).iter("img")).attrib["src"] for html in shown]
    assert pictures[0] == pictures[1]


AS_TEXT = {"HalfDifferenceAngles", "HeightField", "KernelFit", "Matches", "Problem", "Quantity", "Repair"}
"""Classes that print well as they are, or are steps on the way."""


def test_classes_of_gonio_have_a_display():
    """A class of objects that gonio makes takes `_repr_html_ = repr_html`."""
    kinds = [kind for kind in classes().values() if not issubclass(kind, Exception)]
    assert {k.__name__ for k in kinds if not hasattr(k, "_repr_html_")} == AS_TEXT


def test_a_material_shows_formula_picture_and_parameters():
    shown = ElementTree.fromstring(PAINT._repr_html_())
    said = " ".join(" ".join(shown.itertext()).split())
    for words in (repr(PAINT), "0.rho 0.3, 0.1, 0.05 0 … 1", "1.distribution.alpha_x", "slope scale along x"):
        assert words in said
    assert len(list(shown.iter("img"))) == 1
    assert "≥" not in said and "∞" in display.html(gn.ConstantLight(1.0))
    assert "280 nm" in display.html(gn.HeTorrance())  # numbers have their units
    assert "polyline" in display.html(MADE["spectral"]())


def test_a_measurement_shows_what_the_file_is_and_what_it_lacks():
    said = display.html(scan(uncertainty=0.01))
    for words in ("7 pairs of directions", "missing", "14", "of the table", "uncertainty", "interpolation"):
        assert words in said, words
    named = tree.with_notes(scan(), path="/a/place/scan<b>.csv")
    title = ElementTree.fromstring(display.html(named)).find(".//b")
    assert title is not None and title.text == "scan<b>.csv"
    assert "/a/place" not in "".join(ElementTree.fromstring(display.html(named)).itertext())


@pytest.mark.parametrize(
    "m", [gn.Lambertian([0.6, 0.3, 0.1]), gn.material("copper", alpha=0.3)], ids=["matte", "metal"]
)
def test_the_sphere_looks_as_it_is_rendered(m):
    """Within what a small picture shows: the brightness and colour of the parts of a picture by `gn.render`."""
    pillow = pytest.importorskip("PIL.Image")
    with pillow.open(io.BytesIO(m._repr_png_())) as picture:
        codes = np.asarray(picture.convert("RGBA"), float) / 255.0
    true = gn.render(m, size=_sphere.SIZE, samples=64)
    mine = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)[..., :3]
    inside = (codes[..., 3] == 1.0) & (true.alpha == 1.0)
    assert inside.mean() > 0.6
    shown = np.minimum(true.pixels, 1.0)
    np.testing.assert_allclose(mine[inside].mean(axis=0), shown[inside].mean(axis=0), rtol=0.12)
    left, right = (part[inside].mean() for part in (mine * (np.arange(_sphere.SIZE) < 60)[:, None], mine))
    assert left > 0.5 * right  # the sun is on the left


def test_pictures_are_kept_for_equal_materials(monkeypatch):
    made = []
    real = _sphere._sphere
    monkeypatch.setattr(_sphere, "_sphere", lambda m: made.append(m) or real(m))
    _sphere._pictures.clear()
    for _ in range(2):
        gn.Lambertian(0.123)._repr_html_()
        gn.Lambertian(0.123)._repr_png_()
    assert len(made) == 1
    gn.Lambertian(0.124)._repr_html_()
    assert len(made) == 2
    for k in range(_sphere.KEPT + 3):
        _sphere._pictures[gn.Lambertian(k / 1000.0)] = b""
    gn.Lambertian(0.9)._repr_html_()
    assert len(_sphere._pictures) <= _sphere.KEPT
    oldest = next(iter(_sphere._pictures))
    _sphere.picture(oldest)  # what was looked at last stays longest
    gn.Lambertian(0.91)._repr_html_()
    assert oldest in _sphere._pictures


def test_a_failure_shows_what_prints(monkeypatch):
    """Where the picture fails the rest is shown; where all fails, None lets notebooks print the object."""
    monkeypatch.setattr(_sphere, "picture", lambda m: 1 / 0)
    shown = gn.Lambertian(0.321)._repr_html_()
    assert "Lambertian(rho=0.321)" in shown and "<img" not in shown
    assert gn.Lambertian(0.321)._repr_png_() is None
    monkeypatch.setattr(display, "html_of", lambda thing: 1 / 0)
    assert gn.Lambertian(0.321)._repr_html_() is None


def test_text_is_escaped_and_long_text_is_cut():
    assert ElementTree.fromstring(f"<p>{_html.text('<b>&')}</p>").text == "<b>&"
    assert "\x1b" not in _html.text("a\x1b[31mb")
    assert len(_html.code("x" * 5000)) < 1500
    rows = [[str(k), "<i>"] for k in range(100)]
    cut = _html.table(("a", "b"), rows, "m.rows")
    ElementTree.fromstring(f"<div>{cut}</div>")
    assert "76 more: m.rows" in cut and "<i>" not in cut
    assert _things.short(np.arange(50.0)) == "array 50, 0 to 49"


def test_figures_and_pictures_are_png():
    assert image()._repr_png_().startswith(b"\x89PNG")
    assert gn.GGX(0.2)._repr_html_() and not hasattr(gn.GGX(0.2), "_repr_png_")
    assert display.png(gn.GGX(0.2)) is None


def test_subclasses_of_users_are_shown():
    class Own(gn.planning.Goniometer):
        pass

    assert "Goniometer" in Own()._repr_html_()


def test_importing_gonio_imports_no_display():
    code = "import gonio, sys; print([n for n in sys.modules if n.startswith(('gonio.report', 'gonio.scenes', 'PIL'))])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_ipython_shows_it():
    """By its own formatters, which ask for the methods."""
    formatters = pytest.importorskip("IPython.core.formatters")
    shown, _ = formatters.DisplayFormatter().format(PAINT)
    assert {"text/plain", "text/html", "image/png"} <= set(shown)
    assert shown["text/plain"] == repr(PAINT)


def test_without_a_maker_nothing_is_shown(monkeypatch):
    monkeypatch.setattr(notebooks, "_MAKERS", [])
    assert gn.GGX(0.2)._repr_html_() is None
