"""The command line: what each command prints and writes; bad input ends in one line and exit code 2."""

import functools
import json
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from picture_files import exr

import gonio as gn
from gonio.cli.arguments import resolve_light
from gonio.cli.commands import cli
from gonio.errors import FormatError, MissingDataWarning, NotFoundError
from gonio.facts.models import kinds
from gonio.pictures.image import Image, load_image

SMALL = ["--size", "16", "--samples", "4"]


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs a command in an empty folder and returns its result."""
    monkeypatch.chdir(tmp_path)
    return lambda *args: CliRunner().invoke(cli, [str(a) for a in args])


def process(*args, **extra):
    return subprocess.run([sys.executable, *args], capture_output=True, text=True, timeout=300, **extra)


# What works.


def test_help_and_version(run):
    result = run("--help")
    assert result.exit_code == 0
    assert all(name in result.stdout for name in cli.commands)
    assert run("--version").stdout == f"gonio {gn.__version__}\n"
    for name in cli.commands:
        text = run(name, "--help").stdout
        assert "Usage:" in text and max(map(len, text.splitlines())) <= 80


def test_many_channels_are_pictures_of_bands(run):
    """A picture that no .png can hold is refused before it is made."""
    m = "Lambertian([0.1, 0.2, 0.3, 0.4])"
    refused = run("render", m, "-o", "a.png")
    assert refused.exit_code == 2 and "4 channels, expected 1 or 3; choose three, --channels" in refused.stderr
    assert run("render", m, "-o", "a.png", "--channels", "3,2,1", *SMALL).exit_code == 0
    assert run("render", m, "-o", "a.exr", *SMALL).exit_code == 0


def test_models_are_listed_and_explained(run):
    every = [name for of in kinds().values() for name in of]
    listed = run("models").stdout
    assert [line.split()[0] for line in listed.splitlines() if re.match(r"[A-Z]", line)] == every
    found = json.loads(run("models", "--json").stdout)
    assert [x["name"] for x in found] == every and all(x["summary"] and x["source"] for x in found)
    for x in found:
        assert isinstance(gn.expression(x["example"]), gn.Reflectance)
    one = run("models", "ggx").stdout
    for words in (
        "Trowbridge",
        "alpha_x",
        "0.001 to 1: slope scale along x",
        "Walter",
        "Microfacet(GGX(0.3))",
        "GGX.md",
    ):
        assert words in one
    assert run("models", "oren").stdout.count("OrenNayar  ") == 3
    assert run("models", "*Phong").stdout.count("Phong  ") >= 4
    said = run("models", "Lambertain").stderr
    assert "no model 'Lambertain'; did you mean 'Lambertian'?" in said


def test_the_program_and_its_imports():
    shown = process("-X", "importtime", "-m", "gonio", "--help")
    assert shown.returncode == 0 and shown.stdout.startswith("Usage: gonio ")
    imported = {line.rpartition("|")[2].strip() for line in shown.stderr.splitlines()}
    assert "click" in imported
    assert not imported & {
        "scipy",
        "xarray",
        "rich",
        "matplotlib",
        "PIL",
        "OpenEXR",
        "gonio.catalogue",
        "gonio.scenes.rendering",
    }


def test_materials(run):
    lines = run("materials").stdout.splitlines()
    assert len(lines) == 1 + 113
    assert lines[0].split()[:2] == ["name", "kind"]
    assert len({line.index("measured fit") for line in lines if "measured fit" in line}) == 1
    listed = json.loads(run("materials", "--json").stdout)
    assert {"name", "kind", "description", "source", "aliases"} == set(listed[0])
    assert [e["name"] for e in listed] == [e.name for e in gn.materials()]
    assert len(run("materials", "rubber").stdout.splitlines()) == 1 + 4
    assert len(run("materials", "*-rubber").stdout.splitlines()) == 1 + 4
    assert run("materials", "au").stdout.count("\ngold ") == 1


def test_info_of_models(run):
    text = run("info", "gold").stdout
    assert "metal: Au" in text and "distribution.alpha_x" in text and "3: linear RGB" in text
    found = json.loads(run("info", "--json", "0.5 * Lambertian(0.2) + Phong(0.1, 20)").stdout)
    assert gn.expression(found["expression"]) == gn.expression("0.5 * Lambertian(0.2) + Phong(0.1, 20)")
    assert found["channels"] == 1 and found["channel_names"] is None
    assert found["albedo"]["values"][0] == pytest.approx(0.1 + 0.2 * np.pi / 22, abs=1e-3)
    assert found["parameters"]["1.n"] == {
        "value": 20.0, "low": 0.0, "high": 1e4, "unit": "1", "doc": "exponent: the larger, the narrower"
    }  # fmt: skip
    assert "energy" in found["breaks"]
    assert "450, 550 nm" in run("info", "material('gold', wavelengths=[450, 550])").stdout
    assert "delta lobe" in run("info", "IdealSpecular(0.9)").stdout


def test_info_of_a_measured_file(run):
    assert run("convert", "Lambertian([0.2, 0.3, 0.4])", "m.binary").exit_code == 0
    found = json.loads(run("info", "m.binary", "--json").stdout)
    assert found["format"] == "MERL" and found["shape"] == [3, 90, 90, 180]
    assert 0.2 < found["missing"] < 0.3 and found["negative"] == 0.0
    assert np.allclose(found["albedo"]["values"][0], [0.2, 0.3, 0.4], atol=2e-3)
    text = run("info", "m.binary").stdout
    assert "missing" in text and "35 MB" in text and "interpolation" in text


def test_check(run):
    good = run("check", "Lambertian(0.5)")
    assert good.exit_code == 0 and good.stdout.startswith("Lambertian(0.5)\n  pass  positivity")
    bad = run("check", "Phong()", "--json", "-p", "rho_s=1")
    assert bad.exit_code == 1 and bad.stderr == ""
    report = json.loads(bad.stdout)
    assert report["passed"] is False and report["name"] == "Phong(), rho_s=1"
    failed = [law["name"] for law in report["laws"] if not law["passed"]]
    assert failed == ["energy", "furnace", "cavity"]


def test_render(run):
    result = run("render", "gold-metallic-paint", "-o", "a.png", *SMALL)
    assert result.exit_code == 0, result.stderr
    assert re.fullmatch(
        r"a.png: gold-metallic-paint under studio, 16 x 16, 4 samples per pixel, [\d.]+ s\n", result.stdout
    )
    assert load_image("a.png").pixels.shape == (16, 16, 3)
    assert run("render", "Lambertian(0.5)", "-o", "a.exr", "-l", "constant:2", *SMALL).exit_code == 0
    assert load_image("a.exr").pixels[8, 8] == pytest.approx(1.0, rel=0.3)
    lit = ["-l", "distant:45,-60", "-l", "point:2,-3,3", "-l", "constant:0.1,0.1,0.2"]
    assert run("render", "gold", "-o", "b.exr", *lit, *SMALL).exit_code == 0
    picture = load_image("b.exr")
    assert run("render", "gold", "-o", "c.exr", *lit, *SMALL).exit_code == 0
    assert np.array_equal(picture.pixels, load_image("c.exr").pixels)
    assert run("render", "gold", "-o", "d.exr", *lit, *SMALL, "--seed", 1).exit_code == 0
    assert not np.array_equal(picture.pixels, load_image("d.exr").pixels)
    assert run("render", "gold", "-o", "e.png", "-l", "b.exr", *SMALL).exit_code == 0


def test_a_picture_with_a_camera_and_the_ground(run):
    """... is that of Python."""
    where = ["--ground", "Lambertian(0.5)", "--camera", "1.5,-3,1.6", "--look-at", "0,0.4,0.2", "--angle", 40]
    result = run("render", "gold", "-o", "a.exr", *SMALL, *where, "--backdrop")
    assert result.exit_code == 0, result.stderr
    camera = gn.scenes.Camera([1.5, -3.0, 1.6], [0.0, 0.4, 0.2], field_of_view=np.radians(40.0))
    options = {"size": 16, "samples": 4, "camera": camera, "ground": gn.Lambertian(0.5), "backdrop": True}
    assert np.array_equal(load_image("a.exr").pixels, gn.render(gn.material("gold"), **options).pixels)
    for wrong, message in (
        (["--camera", "1,2"], "--camera '1,2': expected 3 numbers"),
        (["--camera", "1,2,3", "--look-at", "a"], "--look-at 'a': expected 3 numbers"),
        (["--camera", "1,2,3", "--angle", 200], "--angle '200': expected a number from 0.01 to 175 degrees"),
        (["--angle", 20], "--angle: of no camera; expected its place too"),
    ):
        refused = run("render", "gold", "-o", "b.exr", *SMALL, *wrong)
        assert refused.exit_code == 2 and message in refused.stderr


def test_noise_says_how_many_samples_are_taken(run):
    """... which is the picture of the call with as many."""
    small = ["--size", "16", "-l", "constant"]
    said = run("render", "gold", "-o", "a.exr", *small, "--tolerance", 2).stdout
    samples = int(re.search(r"(\d+) samples per pixel", said)[1])
    assert samples % 32 == 0 and samples > 64
    assert run("render", "gold", "-o", "b.exr", *small, "--samples", samples).exit_code == 0
    assert np.array_equal(load_image("a.exr").pixels, load_image("b.exr").pixels)
    least = run("render", "gold", "-o", "c.exr", *small, "--tolerance", 2, "--samples", 40)
    assert "40 samples per pixel" in least.stdout


def test_a_checkpoint_is_gone_on_from(run):
    small = ["--size", "16", "-l", "sun"]
    assert run("render", "gold", "-o", "a.exr", *small, "--samples", 96).exit_code == 0
    assert run("render", "gold", "-o", "b.exr", *small, "--samples", 64, "--checkpoint", "sums.npz").exit_code == 0
    assert run("render", "gold", "-o", "b.exr", *small, "--samples", 96, "--checkpoint", "sums.npz").exit_code == 0
    assert np.array_equal(load_image("a.exr").pixels, load_image("b.exr").pixels)
    other = run("render", "copper", "-o", "b.exr", *small, "--checkpoint", "sums.npz")
    assert other.exit_code == 2 and "a checkpoint of another picture" in other.stderr


def test_a_luminaire_is_a_light(run, tmp_path):
    """It is aimed at the sphere, whose middle it would light to pi, were it the brightest there."""
    text = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0 1 1 10 0 20 90 0 800 500 0"
    for name in ("lamp.ies", "LAMP.IES"):
        (tmp_path / name).write_text(text)
        light = resolve_light(name)
        assert gn.irradiance(light, normal=-np.asarray(light.axis)) == pytest.approx(np.pi, rel=1e-9)
    assert run("render", "Lambertian(1)", "-o", "a.exr", "-l", "lamp.ies", *SMALL).exit_code == 0
    assert 0.5 < load_image("a.exr").pixels.max() < 3.0
    (tmp_path / "dark.ies").write_text(text.replace("800 500", "0 0"))
    for name, words in (("dark.ies", "all its intensities are 0"), ("none.ldt", "no such file")):
        said = run("render", "Lambertian(1)", "-o", "a.exr", "-l", name, *SMALL)
        assert said.exit_code == 2 and words in said.stderr


def test_the_sun_is_on_the_upper_left(run):
    assert resolve_light("sun") == gn.SunLight([-0.8, -0.7, 0.8], np.pi)
    assert run("render", "gold", "-o", "a.png", "-l", "sun:45", *SMALL).exit_code == 2


def test_compare(run):
    """Materials under one light, and pictures that were rendered before."""
    lit = ["-l", "constant", "--size", "16"]
    said = run("compare", "Lambertian(0.5)", "Lambertian(0.6)", "-o", "d.png", *lit)
    assert said.exit_code == 0, said.stderr
    assert "d.png: Lambertian(0.6) is 20.0 % brighter than Lambertian(0.5); rms 2" in said.stdout
    for name in ("0.5", "0.6"):
        assert run("render", f"Lambertian({name})", "-o", f"{name}.exr", *lit).exit_code == 0
    said = run("compare", "0.6.exr", "0.5.exr", "-o", "e.svg")
    assert "0.5.exr is 16.7 % darker than 0.6.exr" in said.stdout and Path("e.svg").exists()
    assert run("compare", "0.6.exr", "Lambertian(0.5)", "-o", "e.svg", *lit, "--tolerance", 10).exit_code == 0
    wrong = run("compare", "0.6.exr", "Lambertian(0.5)", "-o", "e.svg", "--size", 8)
    assert wrong.exit_code == 2 and "expected one size" in wrong.stderr


def test_exposure_brightens_the_png(run):
    mean = []
    for exposure in (0, -2):
        run("render", "Lambertian(0.5)", "-o", "a.png", "-l", "constant", *SMALL, "--exposure", exposure)
        mean.append(load_image("a.png").pixels[8, 8].mean())
    assert mean[1] == pytest.approx(mean[0] / 4, rel=0.05)


def test_show(run):
    result = run("show", "Lambertian(0.5)", "-o", "a.png", "-l", "constant", *SMALL)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("a.png: Lambertian(0.5) under constant, ")
    assert min(load_image("a.png").pixels.shape[:2]) > 500


def test_convert(run):
    result = run("convert", "brass", "m.json", "-p", "C=1")
    assert result.exit_code == 0, result.stderr
    assert gn.load("m.json") == gn.material("brass").replace({"1.C": 1.0})
    said = r"m.json: brass, C=1 as gonio JSON, \d+ bytes, [\d.]+ s\nerror  none\nlost   nothing else\n"
    assert re.fullmatch(said, result.stdout)
    assert run("convert", "brass", "m.txt", "--format", "JSON").exit_code == 0
    assert gn.load("m.txt") == gn.material("brass")
    assert run("convert", "m.txt", "n.json", "--format", "gonio json").exit_code == 0


def test_convert_reports_what_changed(run):
    small = ["--format", "rgl", "--resolution", "16", "--option", "theta-i=7"]
    result = run("convert", "Lambertian(0.5)", "a.bsdf", *small)
    assert result.exit_code == 0, result.stderr
    assert gn.load("a.bsdf").stored["rgb"].shape == (1, 7, 3, 16, 16)
    for words in ("a.bsdf: Lambertian(0.5) as RGL", "of f on average", "at most, at theta_i", "lost    formula"):
        assert words in result.stdout, result.stdout
    found = json.loads(run("convert", "a.bsdf", "b.bsdf", *small, "--json").stdout)
    assert found["format"] == "RGL" and 0.0 < found["error"]["mean"] < 0.1 and found["lost"] == {}


def test_formats(run):
    lines = run("formats").stdout.splitlines()
    assert lines[0].split()[:2] == ["format", "suffixes"]
    listed = json.loads(run("formats", "--json").stdout)
    assert {"MERL", "RGL", "gonio JSON"} <= {row["name"] for row in listed}
    assert len(lines) == 1 + len(listed)


def test_cite(run):
    assert run("cite", "gold").stdout == gn.cite("gold") + "\n"
    assert "@article{schlick1994," in run("cite", "Microfacet(GGX(0.1), Schlick(0.5))").stdout


@pytest.mark.parametrize("command", ["info", "check", "render -o a.png", "show -o a.png", "convert", "cite"])
def test_every_command_takes_parameters(run, command):
    name, *options = command.split()
    out = ["a.json"] if name == "convert" else []
    result = run(name, "gold", *out, *options, "-p", "alpha=2")
    assert result.exit_code == 2
    assert "GGX(alpha_x=2.0)" in result.stderr


# What does not.


@pytest.fixture
def files(tmp_path):
    """Damaged files in the folder that `run` works in."""
    (tmp_path / "hello.bsdf").write_text("hello\n")
    (tmp_path / "empty.binary").write_bytes(b"")
    (tmp_path / "short.binary").write_bytes(np.array([90, 90, 180], "<i4").tobytes() + b"\0" * 1000)
    (tmp_path / "cut.bsdf").write_bytes(b"tensor_file\0\1\0\3\0\0\0" + b"\xff" * 20)
    (tmp_path / "bad.json").write_text('{"type": "Lambertian", "rho": 2}')
    (tmp_path / "deep.json").write_text('{"type": ' + "[" * 100000)
    (tmp_path / "light.json").write_text('{"type": "ConstantLight"}')
    (tmp_path / "bad.exr").write_bytes(b"v/1\x01" + b"\0" * 100)
    (tmp_path / "folder").mkdir()


BAD = [
    ("info golden", "nearest: gold"),
    ("info", "Missing argument 'MATERIAL'"),
    ("info nothing.bsdf", "no such file"),
    ("info nowhere/a.bsdf", "no directory 'nowhere'"),
    ("info folder", "it is a directory"),
    ("info hello.bsdf", "known formats"),
    ("info empty.binary", "the file is empty"),
    ("info short.binary", "short.binary"),
    ("check cut.bsdf", "cut.bsdf"),
    ("info bad.json", "2 is out of bounds"),
    ("info deep.json", "deep.json"),
    ("info light.json", "expected a reflectance"),
    ("info Lambertian(1.5)", "0 <= rho <= 1"),
    ("info Lambertian(nan)", "NaN"),
    ("info Lambertian(0.5", "never closed"),
    ("info Lambertain(0.5)", "did you mean Lambertian?"),
    ("info Microfacet(GGX(0))", "0.001 <= alpha_x"),
    ("info Microfacet(GGX(-0.1))", "0.001 <= alpha_x"),
    ("info Lambertian([0.1,0.2])+Lambertian([0.1,0.2,0.3])", "channels"),
    ("info gold -p alpha=0", "0 is out of bounds"),
    ("info gold -p alpah=1", "did you mean 'alpha'?"),
    ("info gold -p alpha", "name=value"),
    ("info gold --foo", "No such option"),
    ("check material('gold',wavelengths=2000)", "292.4 to 1216 nm"),
    ("render gold", "Missing option '-o'"),
    ("render gold -o a.tif", "'.tif'"),
    ("render gold -o nowhere/a.png", "does not exist"),
    ("render gold -o folder", "suffix"),
    ("render gold -o a.exr --exposure 1", "exposure"),
    ("render gold -o a.png --exposure nan", "exposure"),
    ("render gold -o a.png --size 0", "--size '0': expected a whole number from 1 to 16384"),
    ("render gold -o a.png --size 1e3", "--size '1e3': expected a whole number"),
    ("render gold -o a.png --samples 0", "--samples '0': expected a whole number"),
    ("render gold -o a.png --seed -1", "--seed"),
    ("render gold -o a.png --tolerance 0", "--tolerance '0': expected a number above 0%"),
    ("render gold -o a.png --tolerance much", "--tolerance"),
    ("render gold -o a.png --checkpoint folder", "folder: is a directory"),
    ("render gold -o a.png --checkpoint hello.bsdf", "not a checkpoint"),
    ("render gold -o a.png --shape cube", "'sphere'"),
    ("render gold -o a.png -l moon", "expected one of FILE"),
    ("render gold -o a.png -l nothing.exr", "no such file"),
    ("render gold -o a.png -l bad.exr", "bad.exr"),
    ("render gold -o a.png -l hello.bsdf", "not a picture"),
    ("render gold -o a.png -l constant:nan", "NaN"),
    ("render gold -o a.png -l constant:-1", "out of bounds"),
    ("render gold -o a.png -l distant:45", "THETA,PHI"),
    ("render gold -o a.png -l constant:1,2", "channels"),
    ("show gold -o a.gif", ".png, .jpg, .pdf, .svg"),
    ("check gold --plot a.gif", ".png, .jpg, .pdf, .svg"),
    ("check gold --plot nowhere/a.png", "does not exist"),
    ("show gold -o nowhere/a.png", "does not exist"),
    ("convert gold a.xyz", "'.xyz'"),
    ("convert gold a.binary --format foo", "'foo'"),
    ("convert gold nowhere/a.binary", "does not exist"),
    ("convert IdealSpecular(0.5) a.binary", "mirror"),
    ("convert Lambertian([0.1,0.2]) a.binary", "expected 1 or 3 in MERL files"),
    ("convert gold", "Missing argument 'OUT'"),
    ("convert gold a.bsdf", "give format= (on the command line --format)"),
    ("convert gold a.binary --resolution 3,4", "expected one of phi_d"),
    ("convert gold a.bsdf --format rgl --resolution 3", "expected a whole number from 4"),
    ("convert gold a.bsdf --format rgl --option theta_i", "expected name=value"),
    ("materials zzz", "'zzz'"),
    ("cite zzz", "no built-in material"),
    ("nonsense", "No such command 'nonsense'"),
    ("chek gold", "check"),
]


@pytest.mark.parametrize(("command", "said"), BAD, ids=[b[0] for b in BAD])
def test_bad_input_is_one_line_and_exit_code_2(run, files, tmp_path, command, said):
    before = sorted(p.name for p in tmp_path.iterdir())
    result = run(*command.split())
    assert result.exit_code == 2
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert re.fullmatch(r"gonio: error: [^\n]+\n", result.stderr), result.stderr
    assert said in result.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_a_failure_leaves_an_existing_file_alone(run, tmp_path):
    (tmp_path / "a.png").write_text("old")
    assert run("render", "Lambertian(2)", "-o", "a.png").exit_code == 2
    late = run("render", "Lambertian(1)", "-o", "a.png", "-l", "constant:1,2", *SMALL)
    assert late.exit_code == 2 and "2 channels, expected 1 or 3" in late.stderr  # known when it is written
    assert (tmp_path / "a.png").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder where nobody can write: /proc")
def test_a_folder_where_nothing_can_be_written(run):
    result = run("render", "gold", "-o", "/proc/a.png", *SMALL)
    assert result.exit_code == 2
    assert re.fullmatch(r"gonio: error: /proc/a\.png: [^\n]+\n", result.stderr)


def test_other_failures_of_the_system_are_one_line(run, monkeypatch):
    def full(*args, **kwargs):
        raise OSError(28, "No space left on device", "a.png")

    monkeypatch.setattr("gonio.pictures.image.Image.save", full)
    result = run("render", "gold", "-o", "a.png", *SMALL)
    assert result.exit_code == 2
    assert result.stderr == "gonio: error: a.png: No space left on device\n"


def test_an_interrupt_is_said_and_leaves_nothing(run, tmp_path, monkeypatch):
    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(gn, "render", functools.wraps(gn.render)(interrupted))
    result = run("render", "gold", "-o", "a.png", *SMALL)
    assert result.exit_code == 130
    assert result.stderr.strip() == "gonio: error: interrupted"
    assert list(tmp_path.iterdir()) == []


def test_missing_data_is_announced_in_one_line(run, monkeypatch):
    from gonio.scenes.rendering import render

    def holes(*args, **kwargs):
        warnings.warn("3 samples met directions\nwithout data", MissingDataWarning, stacklevel=1)
        return render(*args, **kwargs)

    monkeypatch.setattr(gn, "render", functools.wraps(gn.render)(holes))
    result = run("render", "gold", "-o", "a.png", "-l", "constant", *SMALL)
    assert result.exit_code == 0
    assert result.stderr == "gonio: warning: 3 samples met directions without data\n"


def test_a_real_process_fails_in_one_line(tmp_path):
    result = process("-m", "gonio", "info", "Lambertian(7)", cwd=tmp_path, env=_environment())
    assert result.returncode == 2
    assert result.stdout == ""
    assert re.fullmatch(r"gonio: error: Lambertian[^\n]+\n", result.stderr)


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a terminal to draw on")
def test_a_terminal_gets_a_progress_bar(tmp_path):
    ours, theirs = os.openpty()
    command = [sys.executable, "-m", "gonio", "render", "gold", "-o", "a.png", "-l", "constant", *SMALL]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        env=_environment() | {"TERM": "xterm"},
        stdout=subprocess.PIPE,
        stderr=theirs,
        timeout=300,
    )
    os.close(theirs)
    drawn = os.read(ours, 1 << 16).decode()
    os.close(ours)
    assert done.returncode == 0 and done.stdout.startswith(b"a.png: gold under constant")
    assert "rendering" in drawn and "100%" in drawn


def _environment():
    """Where the package is found, from another folder."""
    found = str(Path(gn.__file__).parents[1])
    return os.environ | {"PYTHONPATH": os.pathsep.join([found, os.environ.get("PYTHONPATH", "")])}


def test_a_photograph_with_values_below_zero_lights_with_a_warning(tmp_path):
    pixels = np.full((8, 16, 3), 0.5, np.float32)
    pixels[3, 4] = (-1e-6, 0.1, 0.1)
    Image(pixels).save(tmp_path / "sky.exr")
    out = tmp_path / "a.exr"
    of = ["--light", str(tmp_path / "sky.exr"), "--size", "8", "--samples", "1", "-o", str(out)]
    command = ["render", "Lambertian(0.5)", *of]
    result = CliRunner().invoke(cli, command)
    assert result.exit_code == 0 and out.exists()
    assert "1 of 128 pixels are negative (down to -1e-06) and count as 0" in result.stderr
    pixels[3, 4] = np.nan
    Image(pixels).save(tmp_path / "sky.exr")
    result = CliRunner().invoke(cli, command)
    assert result.exit_code == 2 and "NaN" in result.stderr


def test_a_layer_of_a_picture_is_named_after_a_colon(run, tmp_path):
    planes = {"R": 1, "G": 2, "B": 3, "albedo.R": 0.1, "albedo.G": 0.2, "albedo.B": 0.3}
    path = exr(tmp_path / "a.exr", planes)
    for layer, expected in (("albedo", [0.1, 0.2, 0.3]), ("", [1, 2, 3])):
        light = resolve_light(f"{path}:{layer}")
        np.testing.assert_allclose(light.incident([0, 0, 1]), expected, rtol=1e-6)
    with pytest.raises(FormatError, match="FILE: on the command line"):
        resolve_light(str(path))
    result = run("compare", f"{path}:albedo", f"{path}:", "-o", "c.png")
    assert result.exit_code == 0 and "900.0 % brighter" in result.stdout
    with pytest.raises(NotFoundError, match="no such file"):
        resolve_light(f"{path}.none:albedo")
