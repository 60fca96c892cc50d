"""Habits of the command line: what it says without words, words that the shell completes, angles with their units."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import gonio as gn
from gonio.bridges.source import LANGUAGES
from gonio.cli import commands, completion
from gonio.cli.arguments import resolve_light
from gonio.declared.typed import all_in_degrees, in_degrees
from gonio.errors import DirectionWarning, ParameterError


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *args: CliRunner().invoke(commands.cli, [str(a) for a in args])


# Without words.


def test_gonio_alone_says_three_commands(run):
    done = run()
    assert done.exit_code == 0
    shown = [line.split() for line in done.stdout.splitlines() if line.startswith("  gonio ")]
    assert len(shown) == 3 and {words[1] for words in shown} <= set(commands.cli.commands)
    assert "gonio --help for all" in done.stdout and len(done.stdout.splitlines()) < 10
    assert max(map(len, done.stdout.splitlines())) <= 80


# Completion.


def completed(words: str, number: int, shell: str = "zsh") -> list[str]:
    """The words that a shell is told."""
    told = {"COMP_WORDS": words, "COMP_CWORD": str(number), completion.VARIABLE: f"{shell}_complete"}
    done = CliRunner().invoke(commands.cli, [], env=told)
    assert done.exit_code == 0 and not done.stderr, done.stderr
    return done.stdout.splitlines()


COMPLETIONS = [
    ("gonio ", 1, {"report", "fit", "completion"}),
    ("gonio info gold-", 2, {"gold-metallic-paint"}),
    ("gonio models gg", 2, {"GGX"}),
    ("gonio formats mer", 2, {"MERL"}),
    ("gonio convert gold x.y --format RG", 5, {"RGL"}),
    ("gonio render gold -l dis", 4, {"distant"}),
    ("gonio shader-source gold --language gl", 4, {"glsl"}),
    ("gonio albedo gold --the", 3, {"--theta-i"}),
]


@pytest.mark.parametrize(("words", "number", "found"), COMPLETIONS)
def test_words_are_completed(words, number, found):
    assert found <= set(completed(words, number))


@pytest.mark.parametrize("shell", completion.SHELLS)
def test_scripts_of_shells(run, shell, tmp_path):
    script = run("completion", shell).stdout
    assert completion.VARIABLE in script and f"{shell}_complete" in script
    program = shutil.which(shell)
    if program:  # the shell itself reads it
        path = tmp_path / "script"
        path.write_text(script, encoding="utf-8")
        assert subprocess.run([program, "-n", path], capture_output=True, timeout=60).returncode == 0


def test_bash_completes_names_and_files(tmp_path):
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("bash is not installed")
    (tmp_path / "gold-sample.csv").write_text("")
    program = tmp_path / "gonio"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m gonio "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    code = (
        'compopt() { :; }; eval "$(gonio completion bash)"; COMP_WORDS=(gonio info gold-); COMP_CWORD=2\n'
        "_gonio_completion gonio; printf '%s\\n' \"${COMPREPLY[@]}\""
    )
    env = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run([bash, "-c", code], env=env, cwd=tmp_path, capture_output=True, text=True)
    assert {"gold-metallic-paint", "gold-sample.csv"} <= set(done.stdout.split()), done.stderr


def test_files_are_offered_in_order(tmp_path, monkeypatch):
    """In the same one on every disk."""
    names = ["gold-a.csv", "gold-b.csv", "gold-c.csv"]
    for name in names:
        (tmp_path / name).write_text("")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(completion.VARIABLE, "bash_complete")
    monkeypatch.setattr(completion.glob, "glob", lambda pattern: [names[k] for k in (1, 2, 0)])
    offered = completion._and_files(["gold-metallic-paint"], "gold-")
    assert [item.value for item in offered] == ["gold-", "gold-metallic-paint", *names]


def test_an_unknown_shell_is_refused(run):
    done = run("completion", "tcsh")
    assert done.exit_code == 2 and "bash" in done.stderr and done.stderr.count("\n") == 1


# Angles.


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        ("8", [8.0]),
        ("8deg", [8.0]),
        ("8 °", [8.0]),
        ("1rad", [np.degrees(1.0)]),
        ("1.5707963267948966rad", [90.0]),
        ("140 mrad", [np.degrees(0.14)]),
        ("0,8,45", [0.0, 8.0, 45.0]),
        ("0,0.5,1rad", np.degrees([0.0, 0.5, 1.0])),
        ("10deg,0.5rad", [10.0, np.degrees(0.5)]),
        ("-1e1DEG", [-10.0]),
    ],
)
def test_typed_angles(text, degrees):
    np.testing.assert_allclose(all_in_degrees(text), degrees, rtol=1e-15)


@pytest.mark.parametrize("text", ["", "x", "8grad", "nan", "inf", "1e999", "8 8", "0x1", "8deg5", "0,,1", "1_0", "٣"])
def test_what_is_no_angle(text):
    with pytest.raises(ParameterError, match="expected a number in degrees, or with its unit"):
        all_in_degrees(text)


def test_a_unit_beside_none_is_asked_for():
    with pytest.raises(ParameterError, match="5 has no unit, others have; expected 5deg or 5rad"):
        all_in_degrees("1rad,5")
    assert in_degrees("90deg") == 90.0


def rows(done) -> list[dict]:
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


def test_angles_of_commands_have_units(run):
    m = "Lambertian(0.5) + Microfacet(GGX(0.2), Dielectric(1.5))"
    plain = rows(run("albedo", m, "--theta-i", "0,30,60", "--phi-i", "90", "--json"))
    typed = f"0,{math.radians(30.0)!r},{math.radians(60.0)!r}rad"
    with_units = rows(run("albedo", m, "--theta-i", typed, "--phi-i", "90deg", "--json"))
    assert [row["theta_i"] for row in plain] == [row["theta_i"] for row in with_units] == [0.0, 30.0, 60.0]
    assert [row["albedo"] for row in plain] == [row["albedo"] for row in with_units]
    slanted = rows(run("albedo", "OrenNayar(0.5)", "-p", "sigma=20deg", "--theta-i", "45", "--json"))
    assert slanted[0]["albedo"] == pytest.approx(
        gn.albedo(gn.OrenNayar(0.5, np.radians(20.0)), gn.direction(45, 0, degrees=True)), rel=1e-6
    )


def test_three_angles_of_three_channels(run):
    found = rows(run("albedo", "Lambertian(0.3) + [1.0, 0.7, 0.3] * Lambertian(0.5)", "--json"))
    assert [row["theta_i"] for row in found[::3]] == [0.0, 45.0, 75.0]
    assert [(row["channel"], round(row["albedo"], 9)) for row in found] == [("R", 0.8), ("G", 0.65), ("B", 0.45)] * 3


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (
            "albedo gold --theta-i 1.6rad",
            "--theta-i '1.6rad', which is 91.673°: expected numbers from 0 below 90 degrees",
        ),
        (
            "albedo gold --theta-i 95",
            "--theta-i '95': expected numbers from 0 below 90 degrees: polar angles of incidence",
        ),
        ("albedo gold --phi-i x", "--phi-i 'x': 'x' is no angle"),
        ("plan gold 3 --theta-i 60", "--theta-i '60': expected 2 numbers from 0 to 90 degrees"),
        ("plan gold 3 --step-theta 0", "--step-theta '0': expected a number above 0 up to 180 degrees"),
        (
            "fit gold --theta-max 2rad",
            "--theta-max '2rad', which is 114.59°: expected a number above 0 up to 90 degrees",
        ),
        ("render gold -o a.png --camera 1,2,3 --angle 4rad", "--angle '4rad', which is 229.18°"),
        ("render gold -o a.png -l distant:45x,0", "'45x,0' is not a list of numbers; expected distant:THETA,PHI"),
        ("albedo gold -p alpha=20deg", "-p alpha=20deg: alpha is no angle; expected a number without deg"),
    ],
)
def test_errors_say_what_was_taken(run, command, said):
    done = run(*command.split())
    assert done.exit_code == 2 and said in done.stderr and done.stderr.count("\n") == 1


def test_radians_without_a_unit_are_suspected(run):
    assert "0.79 as 0.79°; radians? write 0.79rad" in run("albedo", "Lambertian(0.5)", "--theta-i", "0,0.79").stderr
    for fine in ("0,45", "0,0.79deg", "0,0.79rad", "0", "1", "0.5,20"):
        assert not run("albedo", "Lambertian(0.5)", "--theta-i", fine).stderr, fine


def test_lights_take_units():
    one, other = (resolve_light(f"distant:{text}") for text in ("45,-60,2", f"{math.pi / 4!r}rad,-60deg,2"))
    for light in (one, other):
        np.testing.assert_allclose(light.arrival([0.0, 0.0, 0.0]).w, gn.direction(45, -60, degrees=True), atol=1e-12)
        assert light.irradiance == 2.0


def test_radians_given_as_degrees_in_python():
    """Each is a whole number of degrees in radians: certainly not meant."""
    for theta, phi in ((np.pi / 4, 0.0), (np.radians([0.0, 10.0, 80.0]), np.pi), (0.0, np.radians(35.0))):
        with pytest.warns(DirectionWarning, match=r"in radians; for radians leave degrees=True out"):
            gn.direction(theta, phi, degrees=True)
    for theta, phi in ((45.0, 0.0), (0.5, 1.0), ([0.1, 0.2], 0.0), (1.0, 2.0), (0.0, 0.0), (np.pi / 4, 30.0)):
        gn.direction(theta, phi, degrees=True)  # a warning would be an error


# Source.


def test_source_is_printed_and_written(run):
    printed = run("shader-source", "gold", "--language", "c", "--function", "f,pdf").stdout
    assert printed == str(gn.engine.shader_source(gn.material("gold"), "c", ["f", "pdf"]))
    done = run("shader-source", "gold", "-p", "alpha=0.3", "--parameters", "arguments", "--name", "au", "-o", "au.glsl")
    assert done.exit_code == 0 and "au_f" in done.stdout
    with open("au.glsl", encoding="utf-8") as file:
        assert file.read() == str(
            gn.engine.shader_source(gn.material("gold", alpha=0.3), "glsl", name="au", parameters="arguments")
        )


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--language", "fortran"], "fortran"),
        (["--function", "g"], "'g'"),
        (["--function", ""], "function"),
        (["--parameters", "numbers"], "numbers"),
        (["--name", "1a"], "1a"),
        (["-o", "none/a.c"], "none"),
    ],
)
def test_bad_words_for_source(run, more, said):
    done = run("shader-source", "gold", *more)
    assert done.exit_code == 2 and said in done.stderr and done.stderr.count("\n") == 1 and not done.stdout


def test_help_names_the_languages():
    (option,) = (option for option in commands.cli.commands["shader-source"].asked if option.name == "language")
    assert f"One of {', '.join(LANGUAGES)}." in option.help


def test_a_material_that_is_not_there_is_said(run):
    done = run("shader-source", "unobtainium")
    assert done.exit_code == 2 and "no such file" in done.stderr
    with pytest.raises(ParameterError):
        gn.engine.shader_source(gn.Lambertian(0.5), "fortran")
