"""`gonio report`: what it writes and prints; bad input ends in one line and exit code 2."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import gonio as gn
from gonio.cli.commands import cli
from gonio.report.page import browser, contents, pictures

pytestmark = pytest.mark.slow_because("a page is a dozen pictures")


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the command in an empty folder, with one law, a small sphere and a small lobe, and returns its result."""
    monkeypatch.setattr(pictures, "usual_lights", lambda m: [("Even light", [gn.ConstantLight(1.0)])])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(contents, "check", lambda m, progress=None: gn.check(m, laws=["positivity"]))
    for name in ("SIZE", "STILL_SIZE"):
        monkeypatch.setattr(pictures, name, 16)
    for name in ("SAMPLES", "STILL_SAMPLES"):
        monkeypatch.setattr(pictures, name, 2)
    monkeypatch.setattr(pictures, "STILL", (45.0,))
    return lambda *args: CliRunner().invoke(cli, ["report", *map(str, args)])


def test_a_page_is_written(run):
    said = run("gold", "-p", "alpha=0.3", "-o", "a.html", "--no-fits", "--title", "My gold")
    assert said.exit_code == 0 and said.stdout.startswith("a.html: 1 material, ")
    text = Path("a.html").read_text(encoding="utf-8")
    assert "<title>My gold</title>" in text and ">gold, alpha=0.3<" in text
    assert (
        "gonio info gold -p alpha=0.3" in text
        and "gn.material(&#x27;gold&#x27;).replace({&#x27;alpha&#x27;: 0.3})" in text
    )


def test_several_materials_and_lights(run):
    said = run("gold", "Lambertian(0.5)", "-o", "a.html", "--no-fits", "-l", "constant:1", "-l", "distant:30,-60")
    assert said.exit_code == 0 and "2 materials" in said.stdout
    text = Path("a.html").read_text(encoding="utf-8")
    assert text.count("<figcaption>distant:30,-60</figcaption>") == 4 and "Even light" not in text


def test_json_is_the_data(run):
    told = json.loads(run("Lambertian(0.4)", "--json", "--no-fits").stdout)
    assert told["materials"][0]["albedo"]["table"]["values"][3] == [pytest.approx(0.4)]
    assert told["materials"][0]["laws"]["laws"][0]["verdict"] == "pass"
    assert run("Lambertian(0.4)", "-o", "a.json", "--no-fits").exit_code == 0
    written = json.loads(Path("a.json").read_text())
    assert written["materials"] == told["materials"]


def test_options_of_reading_reach_the_file_and_the_commands(run):
    theta = np.arange(-80, 81, 10)
    rows = "\n".join(f"{i},{o},0.3" for i in (0, 30, 60) for o in theta)
    Path("a.csv").write_text(f"a comment\ntheta_i [deg],theta_o [deg],brdf [1/sr]\n{rows}\n")
    said = run("a.csv", "-O", "skip=1", "-o", "a.html", "--no-fits")
    assert said.exit_code == 0, said.stderr
    text = Path("a.html").read_text(encoding="utf-8")
    assert "gonio check a.csv -O skip=1" in text and "skip=1)" in text


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("gold",), "nowhere to write to: expected -o report.html, or --json"),
        (("gold", "-o", "a.txt"), "expected a name that ends in .html, .htm, .pdf, .json"),
        (("gold", "-o", "no/a.html"), "does not exist; create it first"),
        (("gold", "-o", "a.html", "--json"), "expected -o report.json, or no -o"),
        (("gold", "-o", "a.json", "--pdf"), "expected -o report.html; -o report.pdf writes a PDF alone"),
        (("goold", "-o", "a.html"), "'goold'"),
        (("gold", "-p", "beta=1", "-o", "a.html"), "beta"),
        (("gold", "-l", "lamp", "-o", "a.html"), "no such light"),
        (("-", "gold", "-o", "a.html"), "standard input beside other materials"),
        ((), "Missing argument"),
    ],
)
def test_bad_input_ends_in_one_line(run, args, words):
    said = run(*args)
    assert said.exit_code == 2 and words in said.stderr and said.stderr.count("\n") == 1
    assert [*Path().iterdir()] == []


def test_without_a_browser_there_is_no_pdf(run, monkeypatch):
    monkeypatch.setattr(browser.shutil, "which", lambda name: None)
    monkeypatch.setattr(browser, "PLACES", ())
    for args in (("-o", "a.html", "--pdf"), ("-o", "a.pdf")):
        said = run("gold", *args)
        assert said.exit_code == 2 and "needs Chromium, Chrome or Edge" in said.stderr
    assert [*Path().iterdir()] == []


def test_a_page_and_its_print(run, monkeypatch):
    monkeypatch.setattr(browser, "found", lambda: "browser")
    monkeypatch.setattr(browser, "print_page", lambda text, final, program: final.write_text(f"printed by {program}"))
    said = run("Lambertian(0.5)", "-o", "a.html", "--pdf", "--no-fits")
    assert [line.partition(":")[0] for line in said.stdout.splitlines()] == ["a.html", "a.pdf"]
    assert Path("a.pdf").read_text() == "printed by browser"
