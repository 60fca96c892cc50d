"""The report: it says what gonio computes, is one whole file, asks nobody for anything, and works in a browser."""

import base64
import json
import re
import shutil
import subprocess
import sys
import textwrap
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import rgl_files
from libraries import thinned
from places import ROOT

import gonio as gn
from gonio.compile import store
from gonio.errors import DependencyError, FluorescenceWarning, ParameterError, WriteError
from gonio.evaluate import planning
from gonio.evaluate.tracing import at_most
from gonio.facts.material import facts
from gonio.facts.subject import Subject
from gonio.formats._reading import tensor_file
from gonio.pictures.colour import daylight
from gonio.report import page
from gonio.report.page import browser, chart, contents, curves, fits, html, lobes, pictures
from gonio.report.page.typeset import typeset

pytestmark = pytest.mark.slow_because("a page is a dozen pictures")

PTFE = ROOT / "examples" / "ptfe_in_plane.csv"
EVERY = {"what", "lobe", "slices", "albedo", "light", "laws", "fits", "colour", "provenance", "reproduce"}
PAINT = Subject("gold-metallic-paint", gn.material("gold-metallic-paint"), "gold-metallic-paint")
VOID = {"meta", "img", "input", "link", "br", "hr", "col"}


class Read(HTMLParser):
    """A page as its reader's browser has it: raises where elements do not close."""

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.addresses, self.text = [], [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        named = dict(attrs)
        self.ids += [named["id"]] if "id" in named else []
        self.addresses += [
            named[name] for name in ("src", "href", "action", "data", "poster", "srcset") if name in named
        ]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        named = dict(attrs)
        self.addresses += [named["href"]] if "href" in named else []

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("script", "style"):
            self.text.append(data)

    @property
    def sections(self):
        return {i.partition("-")[2] for i in self.ids if "-" in i}

    @property
    def words(self):
        return " ".join(" ".join(self.text).split())


def small(patch, size, samples):
    """Pictures of reports are so small."""
    for name in ("SIZE", "STILL_SIZE"):
        patch.setattr(pictures, name, size)
    for name in ("SAMPLES", "STILL_SAMPLES"):
        patch.setattr(pictures, name, samples)


@pytest.fixture
def quick(monkeypatch):
    """Reports with one law, one small sphere and one small lobe, which take a moment."""
    monkeypatch.setattr(pictures, "usual_lights", lambda m: [("Even light", [gn.ConstantLight(1.0)])])
    monkeypatch.setattr(contents, "check", lambda m, progress=None: gn.check(m, laws=["positivity"]))
    monkeypatch.setattr(pictures, "STILL", (45.0,))
    small(monkeypatch, 24, 4)


def reported(subjects, **options):
    """What a report says, and its page."""
    computed, kept = page.data, []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "data", lambda *given: kept.append(computed(*given)) or kept[-1])
        text = page.made(subjects, **options)
    return kept[0], text


@pytest.fixture(scope="module")
def paint():
    """The whole report of a paint, with small pictures: its data, its page, and what it knows of laws."""
    told, laws = [], []
    with pytest.MonkeyPatch.context() as patch:
        small(patch, 48, 2)
        computed = contents.check
        patch.setattr(contents, "check", lambda *given, **more: laws.append(computed(*given, **more)) or laws[-1])
        said, text = reported([PAINT], progress=lambda done, total: told.append(done / total))
    assert told == sorted(told) and told[-1] == 1.0 and len(laws) == 1
    return said["materials"][0], text, laws[0]


# What it says is true.


def test_numbers_are_those_of_gonio(paint):
    one, _, report = paint
    m = gn.material("gold-metallic-paint")
    table = one["albedo"]["table"]
    rho = gn.albedo(m, gn.direction(np.radians(table["theta_i"]), np.pi))
    assert np.allclose(table["values"], rho, atol=2e-4)
    assert np.allclose(one["albedo"]["white_sky"]["values"], gn.remote_sensing.white_sky_albedo(m), atol=2e-3)
    assert {law["name"]: law["verdict"] for law in one["laws"]["laws"]} == report.verdicts
    assert [law["value"] for law in one["laws"]["laws"]] == [law.value for law in report.laws]
    assert {name: p["value"] for name, p in one["facts"]["parameters"].items()} == {
        name: np.asarray(p.value).tolist() for name, p in m.parameters.items()
    }
    assert one["citations"] == gn.cite(m) and "10.1145/2077341.2077350" in one["citations"]
    for row, peak in zip(one["slices"]["in_plane"], one["peaks"], strict=True):
        wi, wo = gn.direction(np.radians(row["theta_i"]), np.pi), gn.direction(np.radians(row["theta_i"]), 0.0)
        Y = m.f(wi, wo) @ [0.2126, 0.7152, 0.0722]
        assert peak["mirror"] == pytest.approx(Y, rel=1e-3)
        assert peak["peak"] >= peak["mirror"]
    nearest = [match.name for match in gn.reconstruction.nearest(m, count=6)][1:]
    assert [x["name"] for x in one["fits"]["nearest"]] == nearest
    assert one["fits"]["exact"] == ["Lambertian() + ABC()"]
    best = one["fits"]["models"][0]
    assert best["rms"] == pytest.approx(gn.fit(m, gn.expression(best["model"])).rms)
    json.dumps(page.finite(one), allow_nan=False)


@pytest.mark.full
def test_laws_are_those_of_check(paint):
    assert [law.value for law in gn.check(gn.material("gold-metallic-paint")).laws] == [
        law.value for law in paint[2].laws
    ]


def test_the_program_of_a_report_gives_its_numbers(paint, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    one, *_ = paint
    text = (
        one["reproduce"]["python"]
        .replace("gn.check(m)", "1")
        .replace("gn.render(m)", "gn.render(m, size=8, samples=1)")
    )
    exec(compile(text, "report", "exec"), {})
    printed = np.array([float(x) for x in re.findall(r"\d+\.\d+(?:e-\d+)?", capsys.readouterr().out)])
    values = np.ravel(one["albedo"]["table"]["values"])
    assert np.allclose(printed[: len(values)], values, rtol=1e-5)
    assert Path("sphere.png").exists()
    assert one["reproduce"]["shell"][0] == "gonio report gold-metallic-paint -o report.html"


def test_uncertainties_of_a_table_are_those_of_gonio(quick):
    m = gn.load(PTFE)
    one = page.data([Subject.of("ptfe", m)], fits=False)["materials"][0]
    table = one["albedo"]["table"]
    assert table["theta_i"] == [0.0, 15.0, 30.0, 45.0, 60.0]  # what was measured
    wi = gn.direction(np.radians(table["theta_i"]), np.pi)
    common = gn.with_uncertainty(gn.albedo, m, wi, correlation="common", tolerance=1e-3)
    assert np.allclose(np.ravel(table["values"]), common.value)
    assert np.allclose(np.ravel(table["u"]["common errors"]), common.u_noise, rtol=1e-2)
    assert np.allclose(np.ravel(table["total"]), common.u, rtol=1e-2)
    assert one["facts"]["provenance"]["sha256"].startswith("848f414f")
    white = gn.with_uncertainty(gn.remote_sensing.white_sky_albedo, m, correlation="common", tolerance=1e-3)
    told = one["albedo"]["white_sky"]
    assert np.allclose([told["values"][0], told["total"][0]], [white.value, white.u], rtol=1e-2)
    row = one["slices"]["in_plane"][3]
    assert len(row["measured"]["views"]) == len(row["measured"]["u"]) == 32
    text = html.page({"title": "t", "gonio": "0", "date": "1", "summary": [], "materials": [one]}, [BLANK])
    assert "848f414f" in text and "no data" in text and "GSP-7" in Read(text).words


@pytest.mark.slow_because("a whole report of a measurement, but for pictures and laws")
def test_fits_of_a_page_are_those_of_its_commands(quick, tmp_path, monkeypatch, capsys):
    """Of a table that states its uncertainties: the same loss, so the same numbers, and how well they agree."""
    monkeypatch.setattr(fits, "MODELS", fits.MODELS[:1])
    monkeypatch.setattr(fits, "nearest", lambda m, count: [])
    theta_i, theta_o, phi = (
        x.ravel() for x in np.meshgrid([0.0, 30.0, 60.0], np.arange(0.0, 81.0, 10.0), [0.0, 180.0])
    )
    made = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.3), gn.Schlick(0.1))
    f = made.f_angles(*np.radians([theta_i, 0.0 * phi, theta_o, phi]))
    u = 0.01 * f + 1e-4
    f += 4.0 * u * np.sin(np.arange(len(f)))  # u is too small
    rows = np.stack([theta_i, theta_o, phi, f, u], axis=1)
    path = tmp_path / "made.csv"
    path.write_text("theta_i,theta_o,phi,BRDF,u\n" + "\n".join(",".join(map("{:.7g}".format, row)) for row in rows))
    m = gn.load(path)
    one = page.data([Subject.of("made", m)])["materials"][0]
    best = one["fits"]["models"][0]
    found = gn.fit(m, gn.expression(best["model"]))
    assert found.loss == best["loss"] == "likelihood"
    assert [(x["name"], x["value"]) for x in best["parameters"]] == [row[:2] for row in found.rows()]
    assert best["chi2_per_free"] == pytest.approx(found.cost / found.free) and best["chi2_per_free"] > 4.0
    line = next(x for x in one["reproduce"]["python"].split("\n") if "gn.fit" in x)
    exec(line, {"gn": gn, "m": m})
    printed = capsys.readouterr().out
    assert all(x["value"] in printed for x in best["parameters"])


BLANK = {"spheres": [], "lobes": "", "stills": []}


@pytest.mark.parametrize("alpha", [0.001, 0.01, 0.3])
def test_no_peak_is_chopped(alpha):
    m = gn.Microfacet(gn.GGX(alpha), gn.Dielectric(1.5))
    given = lobes.lobes(m)
    for lobe in given["lobes"][:6]:
        theta = np.radians(lobe["theta_i"])
        mirror = m.f(gn.direction(theta, np.pi), gn.direction(theta, 0.0))
        codes = np.frombuffer(base64.b64decode(lobe["codes"]), "<u2").astype(float)
        f = 10.0 ** (given["floor"] + (codes - 1.0) / 65534.0 * (given["high"] - given["floor"]))
        assert f.max() >= 0.99 * mirror and lobe["peak"] == pytest.approx(f.max(), rel=1e-3)
        polar, around = lobe["polar"], lobe["around"]
        assert len(polar) * len(around) == len(codes)
        assert np.all(np.diff(polar) > 0.0) and np.all(np.diff(around) > 0.0)
    width = curves.peaks(curves.slices(m)["in_plane"])[0]["width"]
    half = np.arctan(alpha * np.sqrt(np.sqrt(2.0) - 1.0))  # where D has fallen to its half
    assert width == pytest.approx(4.0 * np.degrees(half), rel=0.01 if alpha < 0.1 else 0.2)


def test_lobes_are_f_in_all_directions():
    m = gn.Microfacet(gn.GGX(0.1, 0.4), gn.material("gold").fresnel)
    lobe = lobes.lobes(m)["lobes"][3]
    f = lobes.values(m, lobe["theta_i"])
    i, j = 40, 77
    wo = gn.direction(np.radians(lobe["polar"][i]), 2.0 * np.pi + np.radians(lobe["around"][j]))
    Y = m.f(gn.direction(np.radians(lobe["theta_i"]), np.pi), wo) @ [0.2126, 0.7152, 0.0722]
    assert f[i, j] == pytest.approx(Y, rel=2e-3)


def test_holes_stay_holes():
    given = lobes.lobes(gn.load(PTFE))
    codes = np.frombuffer(base64.b64decode(given["lobes"][0]["codes"]), "<u2").reshape(lobes.POLAR, -1)
    polar = np.array(given["lobes"][0]["polar"])
    assert (codes[polar > 81.0] == 0).all() and (codes[polar < 79.0] > 0).all()
    assert [lobe["theta_i"] for lobe in given["lobes"]] == [0.0, 15.0, 30.0, 45.0, 60.0]


# The page is whole, and asks nobody for anything.


def whole(text):
    """The page as it is read, held to what every page must be."""
    read = Read(text)
    assert len(text) < 3_000_000
    for address in read.addresses:
        assert address.startswith("data:image/") or address.removeprefix("#") in read.ids, address[:80]
    assert len(read.ids) == len({*read.ids})
    plain = re.sub(r"data:image/[a-z]+;base64,[\w+/=]*|<pre>.*?</pre>", "", text, flags=re.DOTALL)
    assert not re.search(r"url\(|@import|\bimport\(|fetch\(|XMLHttp|WebSocket|sendBeacon|<link|<iframe", plain)
    assert re.findall(r'https?://[^\s"<]+', plain.replace("http://www.w3.org/2000/svg", "")) == []
    assert "default-src 'none'" in text and 'name="viewport"' in text
    return read


def test_the_page_is_whole(paint):
    read = whole(paint[1])
    assert read.sections == EVERY
    for words in (
        "✓ holds",
        "Löw, Kronander",
        "f = A F(θ d",
        "light from 45°",
        "Nearest built-in materials",
        "sr -1",
        "±",
    ):
        assert words in read.words, words
    assert paint[1].count("<img") >= 7 and "<canvas" in paint[1]


@pytest.mark.full
def test_a_page_with_pictures_of_full_size_is_whole():
    assert whole(page.made([PAINT])).sections == EVERY


def test_equal_reports_are_equal(quick):
    subject = Subject.of("a", gn.Lambertian(0.5))
    both = [re.sub(r"on \d{4}-.*?\.", "", page.made([subject], fits=False)) for _ in range(2)]
    assert both[0] == both[1]


KINDS = {
    "glass": ("RoughDielectric(GGX(0.2), 1.5)", {"transmission", "polarization"}),
    "thin glass": ("ThinDielectric(1.5)", {"transmission", "polarization"}),
    "mirror": ("IdealSpecular(Dielectric(1.5))", {"polarization"}),
    "leaf": ("Lambertian(0.1) + DiffuseTransmission(0.2)", {"transmission"}),
    "bands": ("Lambertian([0.1, 0.2, 0.3, 0.4, 0.3])", set()),
}


@pytest.mark.parametrize("kind", thinned(KINDS, ["mirror", "leaf", "bands"]))
def test_every_kind_has_its_parts(quick, kind):
    text, more = KINDS[kind]
    m = gn.expression(text)
    read = whole(page.made([Subject(kind, m, text)], fits=False))
    without = {"colour"} if kind == "bands" else set()
    assert read.sections == (EVERY - without) | more
    assert "left out on request" in read.words
    if m.has_delta:
        assert "delta lobes" in read.words and "f = 0 away from the mirror direction" in read.words


def test_a_spectrum_has_a_plot_and_colours(quick):
    m = gn.material("gold", wavelengths=np.arange(400.0, 701.0, 10.0))
    said, text = reported([Subject.of("gold", m)], fits=False)
    one = said["materials"][0]
    assert one["colour"]["spectrum"]["wavelengths"] == list(np.arange(400.0, 701.0, 10.0))
    assert one["albedo"]["table"]["shown"] == [0, 5, 10, 15, 20, 25, 30]
    patch = one["colour"]["patches"][0]
    rgb = gn.colour.to_colour(one["albedo"]["table"]["values"][0], m.wavelengths)
    assert np.allclose(patch["rgb"], rgb, atol=2e-3)
    read = whole(text)
    assert "wavelength [nm]" in read.words and "7 of 31 channels" in read.words


def test_colours_of_what_fluoresces_are_those_in_daylight():
    """And the page says how much of the light its albedos and slices leave out."""
    ink = gn.Donaldson([[0.2, 0.0], [0.5, 0.6]], wavelengths=[450.0, 550.0])
    E = daylight(ink.wavelengths)
    patch = contents.colours(ink)["patches"][0]
    assert np.allclose(patch["rgb"], gn.colour.to_colour(ink.matrix @ E / E, ink.wavelengths), atol=2e-3)
    with pytest.warns(FluorescenceWarning, match="left out"):
        contents.albedos(ink)
    said = facts("ink", ink, computed=False)["fluorescence"]
    assert "50% of what arrives at 450 nm" in said
    assert "fluorescence" not in facts("paint", gn.Lambertian(0.5), computed=False)


def test_lab_is_that_of_the_cie():
    assert np.allclose(contents.lab_of(np.ones(3)), [100.0, 0.0, 0.0], atol=1e-9)
    assert np.allclose(contents.lab_of(np.array([1.0, 0.0, 0.0])), [53.24, 80.09, 67.20], atol=0.02)


@pytest.mark.full
def test_measurements_in_files(quick, tmp_path):
    """One of RGL's, whose file's name is no HTML."""
    path = tmp_path / "a<b>\"&'.bsdf"
    tensor_file.write(path, rgl_files.synthetic(n=12, n_ndf=16, n_theta=5))
    assert whole(page.made([Subject.of("m", gn.load(path))], fits=False)).sections == EVERY


def test_measurements_on_grids(quick):
    """A MERL-like table."""
    theta = np.radians(np.linspace(0.0, 88.0, 12))
    axes = {"theta_h": theta, "theta_d": theta, "phi_d": np.radians(np.linspace(0.0, 180.0, 9))}
    f = np.full((12, 12, 9, 3), 0.1) + np.exp(-20.0 * theta)[:, None, None, None]
    table = gn.Gridded("half_difference", axes, f, channels=["R", "G", "B"])
    assert whole(page.made([Subject.of("m", table)], fits=False)).sections == EVERY


def test_names_are_text(quick):
    bad = "<script>alert(1)</script>'\"&</style><img src=x onerror=alert(2)>\x1b\ud800\u202e"
    m = gn.Lambertian(0.5)
    text = page.made([Subject(bad, m, bad, (bad,), ()), Subject(bad, m, bad)], None, bad, fits=False)
    read = whole(text)
    assert bad[:-3] + r"\x1b\ud800\u202e" in read.words and text.encode("utf-8")
    assert text.count("<script") == 3 and "onerror=alert(2)>" not in text.replace("&gt;", "")


def test_data_of_a_script_stays_in_it():
    text = html.script_data({"a": "</script><script>alert(1)</script>"})
    assert text.count("<") == 2 and json.loads(text[text.index(">") + 1 : -9])["a"].startswith("</script>")


@pytest.mark.slow_because("fits of two materials, and what is near to them")
@pytest.mark.parametrize("simpler", thinned([1, fits.SIMPLER], [1]))
def test_two_materials_stand_side_by_side(quick, simpler, monkeypatch):
    monkeypatch.setattr(fits, "SIMPLER", simpler)
    subjects = [Subject.of(name, gn.material(name)) for name in ("gold", "brass")]
    said, text = reported(subjects)
    read = whole(text)
    assert {"m0", "m1", "side"} <= {*read.ids} and {f"m{k}-{part}" for k in (0, 1) for part in EVERY} <= {*read.ids}
    summary = said["summary"]
    for row, subject in zip(summary, subjects, strict=True):
        rho = gn.albedo(subject.m, gn.direction(np.radians(45.0), np.pi))
        assert row["albedo"][45.0] == pytest.approx(rho.mean(), abs=2e-4)
    assert summary[0]["nearest"] == "copper"
    assert "Overlaid" in read.words and text.count("<h1") == 1


def test_maps_are_refused(tmp_path):
    path = tmp_path / "a.html"
    with pytest.raises(ParameterError, match="map of 2 x 3 places"):
        gn.write_report(gn.Lambertian(np.full((2, 3, 1), 0.5)), path)
    assert not path.exists()


def test_what_cannot_be_computed_says_why(quick, monkeypatch):
    def broken(m):
        raise ParameterError("it <is> broken; expected otherwise")

    monkeypatch.setattr(curves, "slices", broken)
    read = whole(page.made([Subject.of("a", gn.Lambertian(0.5))], fits=False))
    assert "Not shown: it <is> broken; expected otherwise" in read.words


# Files.


def test_what_is_written(quick, tmp_path):
    gn.write_report(
        gn.Lambertian(0.5), tmp_path / "a.html", {"by <window>": gn.ConstantLight(1.0)}, "Title & more", fits=False
    )
    read = whole((tmp_path / "a.html").read_text(encoding="utf-8"))
    assert "Title & more" in read.words and "by <window>" in read.words and "Even light" not in read.words
    gn.write_report({"x": gn.Lambertian(0.5)}, tmp_path / "a.json", fits=False)
    told = json.loads((tmp_path / "a.json").read_text())
    assert told["materials"][0]["albedo"]["table"]["values"][0] == [pytest.approx(0.5)]
    for bad in ("a.txt", "a", "no/a.html"):
        with pytest.raises(gn.Error):
            gn.write_report(gn.Lambertian(0.5), tmp_path / bad)
    with pytest.raises(ParameterError, match="at least one Reflectance"):
        gn.write_report([], tmp_path / "b.html")


def test_a_failure_leaves_what_was_there(quick, tmp_path, monkeypatch):
    path = tmp_path / "a.html"
    path.write_text("old")

    def full(self, *args, **more):
        raise OSError(28, "No space left on device", str(self))

    with monkeypatch.context() as now, pytest.raises(OSError):
        now.setattr(Path, "write_text", full)
        page.write_page(path, "new")
    assert path.read_text() == "old" and [p.name for p in tmp_path.iterdir()] == ["a.html"]
    printed = tmp_path / "a.pdf"
    printed.write_text("old")
    program = tmp_path / "chromium"
    program.write_text("#!/bin/sh\necho nothing is printed >&2\n")
    program.chmod(0o755)
    monkeypatch.setattr(browser, "found", lambda: str(program))
    with pytest.raises(WriteError, match=r"printed no PDF: nothing is printed; write \.html"):
        page.write_page(printed, "new")
    assert printed.read_text() == "old"


def test_without_a_browser_nothing_is_computed(tmp_path, monkeypatch):
    monkeypatch.setattr(browser.shutil, "which", lambda name: None)
    monkeypatch.setattr(browser, "PLACES", ())
    with pytest.raises(DependencyError, match=r"needs Chromium, Chrome or Edge.*write \.html"):
        gn.write_report(gn.Lambertian(0.5), tmp_path / "a.pdf")


FEWER = """pictures.STILL, fits.SIMPLER = (45.0,), 1
        contents.check = lambda m, progress: gn.check(m, laws=["positivity"])
        pictures.usual_lights = lambda m: [("Even light", [gn.ConstantLight(1.0)])]"""


@pytest.mark.slow_because("a whole report is made in a process of its own")
@pytest.mark.parametrize("fewer", [FEWER, pytest.param("", marks=pytest.mark.full)], ids=["one light", "all"])
def test_a_formula_needs_no_scipy(tmp_path, fewer):
    """SciPy takes 0.4 s to import, which only a report of measured data has to spend."""
    code = f"""
        import sys
        import gonio as gn
        from gonio.report.page import contents, fits, pictures
        {fewer}
        pictures.SIZE = pictures.STILL_SIZE = 16
        gn.write_report(gn.material("gold"), "a.json")
        print(*sorted({{name.partition(".")[0] for name in sys.modules}} & {{"scipy", "pandas", "matplotlib"}}))
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=True)
    assert done.stdout.strip() == "" and (tmp_path / "a.json").exists()


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
def test_kernels_of_spheres(monkeypatch):
    """One for each kind of light, by one vector at a time, of so many operations."""
    programs, kernel = {}, store.kernel

    def noted(program):
        nodes = [node for output in program.outputs for node in output.nodes]
        programs[program.digest()] = program.single, len(program.graph.reachable(nodes))
        return kernel(program)

    monkeypatch.setattr(store, "kernel", noted)
    monkeypatch.setattr(pictures, "SIZE", 16)
    m = gn.Microfacet(gn.GGX(0.3), gn.Conductor([0.2, 0.9, 1.2], [3.9, 2.4, 2.3]))
    with at_most(pictures.ELEMENTS):
        pictures.spheres(m, pictures.usual_lights(m), lambda share: None)
    assert sorted(programs.values()) == [(True, 391), (True, 1140), (True, 1713)]


# Drawings.


def test_curves_keep_their_shape_with_fewer_points():
    x = np.linspace(0.0, 400.0, 2001)
    y = 50.0 * np.sin(x / 30.0)
    kept = chart.simplified(x, y)
    assert kept.sum() < 120
    assert np.abs(np.interp(x, x[kept], y[kept]) - y).max() < 0.25
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    assert 40 < chart.simplified(np.cos(turn) * 100.0, np.sin(turn) * 100.0).sum() < 200  # it ends where it begins


def test_curves_have_gaps_where_nothing_is_known():
    y = np.array([1.0, 2.0, np.nan, 4.0, np.nan, 6.0, 7.0])
    assert chart.path(np.arange(7.0), y).count("M") == 3
    assert chart.gaps(np.arange(7.0), [y], 1.5) == [(1.0, 3.0), (3.0, 5.0)]


def test_axes():
    assert chart.ChartAxis(0.0, 1.0).numbers() == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    assert chart.ChartAxis(0.01, 300.0, log=True).numbers() == pytest.approx([0.01, 0.1, 1.0, 10.0, 100.0])
    assert chart.ChartAxis(0.2, 0.9, log=True).numbers() == pytest.approx([0.2, 0.5])
    assert chart.fitting([np.nan, 0.0], "").high == 1.0 and not chart.fitting([1.0, 2.0], "").log
    assert [chart.number(x) for x in (0.0, -30.0, 1e-5, 2.5e7)] == ["0", "−30", "10⁻⁵", "2.5·10⁷"]


def test_formulas_are_typeset():
    assert typeset("f = rho / pi, theta_i < `a_b`") == "f = ρ / π, θ<sub>i</sub> &lt; <code>a_b</code>"
    assert typeset("(1 + B |D|^2)^(-C)") == "(1 + B |D|<sup>2</sup>)<sup>-C</sup>"
    assert "<script" not in typeset("<script>`<script>`")


# In a browser.


@pytest.fixture(scope="module")
def window():
    """A window of a browser, with what it asked for and complained of."""
    api = pytest.importorskip("playwright.sync_api")
    program = next(filter(None, map(shutil.which, browser.NAMES)), None)
    if program is None:
        pytest.skip("no Chromium, Chrome or Edge is installed")
    with api.sync_playwright() as started:
        flags = [
            "--no-sandbox",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-sync",
        ]
        program_ = started.chromium.launch(
            executable_path=program, args=["--headless", *flags, "--disable-component-update"]
        )
        yield program_
        program_.close()


@pytest.fixture(scope="module")
def tabs(window, paint, tmp_path_factory):
    """The report of the paint in a tab with scripts and in one without, and what was asked for and complained of."""
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(paint[1], encoding="utf-8")
    said = []

    @cache
    def opened(scripts):
        tab = window.new_context(java_script_enabled=scripts).new_page()
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.on(
            "request",
            lambda request: None if request.url.startswith(("data:", path.as_uri())) else said.append(request.url),
        )
        tab.goto(path.as_uri())
        return tab

    return opened, said


@pytest.fixture
def opened(tabs):
    """Shows the report of the paint; the test must leave no trace."""
    open_it, said = tabs

    def shown(width=1400, scheme="light", scripts=True):
        tab = open_it(scripts)
        tab.set_viewport_size({"width": width, "height": 900})
        tab.emulate_media(media="screen", color_scheme=scheme)
        return tab

    yield shown
    assert said == []


PIXELS = "() => { const c = document.querySelector('canvas'); return c.toDataURL(); }"


def settled(tab):
    tab.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return tab.evaluate(PIXELS)


def test_the_lobe_turns(opened):
    tab = opened()
    views = [settled(tab)]
    tab.focus("canvas")
    for key in ("ArrowLeft", "ArrowUp", "+", "Home"):
        tab.keyboard.press(key)
        views.append(settled(tab))
    assert len({*views}) == 5
    assert tab.input_value("input[type=range]") == "4" and tab.inner_text("output").startswith("60°: largest f 0.65")
    tab.fill("input[type=range]", "0")
    views.append(settled(tab))
    tab.select_option("select", "linear")
    views.append(settled(tab))
    box = tab.locator("canvas").bounding_box()
    tab.mouse.move(box["x"] + 300, box["y"] + 200)
    tab.mouse.down()
    tab.mouse.move(box["x"] + 420, box["y"] + 240)
    tab.mouse.up()
    views.append(settled(tab))
    assert len({*views}) == 8


def test_angles_become_radians(opened):
    tab = opened()
    before = tab.inner_text("#m0-albedo")
    tab.click("button[value=rad]")
    told = tab.inner_text("#m0-albedo")
    assert "45°" in before and "0.7854 rad" in told and "°" not in told
    assert "rad" in tab.locator("#m0-slices .chart > svg").nth(1).text_content()
    assert "rad" in tab.inner_text("output")
    tab.click("button[value=deg]")
    assert tab.inner_text("#m0-albedo") == before


def test_light_dark_and_small(opened):
    tab = opened(390, "dark")
    paper = "() => getComputedStyle(document.body).backgroundColor"
    assert tab.evaluate(paper) == "rgb(18, 20, 23)"
    assert tab.evaluate("() => document.documentElement.scrollWidth") <= 390
    tab.click("[data-do=theme]")
    assert tab.evaluate(paper) == "rgb(244, 242, 238)"
    tab.emulate_media(media="print")
    assert not tab.is_visible("canvas") and tab.is_visible(".stills img") and not tab.is_visible(".bar")


def test_the_page_without_scripts_is_still(opened):
    tab = opened(scripts=False)
    assert tab.is_visible(".stills img") and not tab.is_visible("canvas") and not tab.is_visible("button")
    assert "✓ holds" in tab.inner_text("#m0-laws")


@pytest.fixture
def printed(tmp_path):
    """Prints a page, and returns the PDF."""
    try:
        browser.found()
    except DependencyError as error:
        pytest.skip(str(error))

    def printed(text):
        page.write_page(tmp_path / "report.pdf", text)
        return (tmp_path / "report.pdf").read_bytes()

    return printed


@pytest.mark.slow_because("a browser prints")
def test_it_prints(printed):
    pdf = printed("<!doctype html><title>a page</title><h1>Words</h1>" + "<p>and more of them.</p>" * 100)
    assert pdf.startswith(b"%PDF") and len(pdf) > 5_000


@pytest.mark.full
def test_a_whole_page_prints(printed, paint):
    pdf = printed(paint[1])
    assert pdf.startswith(b"%PDF") and 100_000 < len(pdf) < 3_000_000


@pytest.mark.full
@pytest.mark.parametrize("name", gn.models())
def test_every_model_has_a_report(quick, name):
    kind = gn.models()[name]
    m = kind([gn.Interface(1.5), gn.Medium(2.0, 1.0)], gn.Lambertian(0.1)) if name == "Stack" else kind()
    one = page.data([Subject.of(name, m)], fits=False)["materials"][0]
    assert {*one["left_out"]} == {"fits"}
    whole(page.made([Subject.of(name, m)], fits=False))
