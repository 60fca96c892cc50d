"""Commands follow from signatures: their options, their help, and commands that nobody wrote."""

from __future__ import annotations

import ast
import inspect
import json
import math
import re
import sys
import textwrap
from types import ModuleType
from typing import Annotated

import numpy as np
import pytest
from click import Context
from click.testing import CliRunner

import gonio as gn
from gonio.cli.command import Command, Typed
from gonio.cli.commands import cli
from gonio.declared.arguments import Argument, Declared, arguments, checked
from gonio.facts.public import forms

PAINT = "Lambertian(0.3) + Microfacet(GGX(0.2))"
COMMANDS = sorted(cli.commands)
UNWRITTEN = sorted({found.name.replace("_", "-") for found in forms()} - {*COMMANDS})
"""Commands that are public functions."""


def told(*words: str, columns: int = 80) -> str:
    """The help of a command on a terminal of so many columns."""
    done = CliRunner().invoke(cli, [*words, "--help"], env={"COLUMNS": str(columns)})
    assert done.exit_code == 0, done.output
    return done.stdout


def called(command: Command) -> list[str]:
    """The public functions that the body of a command imports."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(command.callback))))
    names = {a.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for a in node.names}
    return [name for name in sorted(names & set(gn.__all__)) if inspect.isfunction(getattr(gn, name))]


@pytest.mark.parametrize("name", COMMANDS)
def test_no_option_restates_a_declared_argument(name):
    """... of a function that its command calls: bounds, defaults and words are those of the signature."""
    command = cli.commands[name]
    functions = [getattr(gn, function) for function in called(command)]
    functions += command.functions.values() if isinstance(command, Command) else ()
    declared = {argument for function in functions for argument in arguments(function)}
    assert not declared & {p.name for p in command.params}


@pytest.mark.parametrize("name", ["", *COMMANDS, *UNWRITTEN])
def test_help_fits_and_says_units(name):
    words, command = name.split(), cli.get_command(Context(cli), name) if name else cli
    assert command.help
    wide, narrow = told(*words), told(*words, columns=60)
    assert max(map(len, wide.splitlines())) <= 80
    assert {*re.split(r"[\s-]+", narrow)} <= {*re.split(r"[\s-]+", told(*words, columns=100))}, "a word is cut"
    kinds = [parameter.type for parameter in command.asked] if isinstance(command, Command) else []
    for kind in kinds:
        unit = kind.declared.typed.unit if isinstance(kind, Typed) else ""
        assert not unit or f"[{unit}]" in " ".join(wide.split())


@pytest.mark.parametrize(
    ("declared", "text", "value"),
    [
        (Declared("a", 0.0, math.pi, "rad"), "90", math.pi / 2),
        (Declared("a", 0.0, math.pi, "rad"), "1rad", 1.0),
        (Declared("a", 0.0, 1.0, "share"), "2", 0.02),
        (Declared("a", 0.0, 1.0, "share"), "2%", 0.02),
        (Declared("a", 0.0, 10.0), "2e-1", 0.2),
    ],
)
def test_numbers_are_typed_in_the_units_of_people(declared, text, value):
    assert Typed(Argument("a", (float,), 0.0, declared)).convert(text, None, None) == pytest.approx(value, rel=1e-12)


WRONG = [
    ("plan gold 0", "N '0': expected a whole number from 1 to 200: how many pairs of directions"),
    ("plan gold 3 --noise 100", "--noise '100': expected a number from 0 below 100%"),
    ("plan gold 3 --criterion Z", "--criterion 'Z': expected 'D' or 'A'"),
    ("plan gold 3 --phi 0,x", "--phi '0,x': 'x' is no angle; expected a number in degrees"),
    ("plan gold 3 --phi 0,9rad", "--phi '0,9rad', which is 0°, 515.66°: expected 2 numbers from -360 to 360 degrees"),
    ("measure gaussian(0.3) -o a.csv --cells 18", "--cells '18': expected 2 whole numbers from 1: rings"),
    ("measure gaussian(0.3) -o a.csv --pixel 1", "--pixel: does nothing beside a surface that is no map"),
    ("fit gold --select lobes --robust huber", "--robust: does nothing beside --select"),
    ("fit gold --loss cosin", "did you mean 'cosine'?"),
    ("source gold --function f,pfd", "did you mean 'pdf'?"),
    ("plan gold 3 --theta-i 80,10", "--theta-i '80,10': expected the least angle first, then the largest"),
    ("render gold -o a.png --shape cube", "--shape 'cube': expected one of 'cylinder'"),
    ("convert gold a.bsdf --format rgk", "--format 'rgk': expected one of"),
    ("black-sky-albedo gold 95", "THETA '95': expected numbers from 0 to 90 degrees: polar angle of the sun"),
    ("fate gold 45", "WI '45': expected a unit vector, typed as its polar angle and azimuth in degrees, such as 45,0"),
    ("check --all --laws energy", "--laws: does nothing beside --all"),
]


@pytest.mark.parametrize(("words", "said"), WRONG, ids=[words for words, _ in WRONG])
def test_a_wrong_value_is_told_as_it_was_typed(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli, words.split())
    assert done.exit_code == 2 and said in done.stderr and done.stderr.count("\n") == 1 and not done.stdout


@pytest.mark.filterwarnings("default::gonio.errors.MeaningWarning")
def test_a_share_in_the_place_of_percent_is_suspected():
    told = CliRunner().invoke(cli, ["plan", PAINT, "3", "--noise", "0.01", "--step-theta", "15", "--json"])
    assert "--noise 0.01: taken as 0.01 %; a share of 1? write 1%" in told.stderr and told.exit_code == 0
    assert not CliRunner().invoke(cli, ["plan", PAINT, "3", "--noise", "1", "--step-theta", "15"]).stderr


def test_what_is_typed_reaches_the_function():
    limits = ["--theta-i", "0,60", "--theta-o", "0,1rad", "--step-theta", "10", "--step-phi", "30"]
    more = ["--noise", "2", "--starts", "2", "--seed", "3", "--criterion", "a", "--repeats"]
    done = CliRunner().invoke(cli, ["plan", PAINT, "4", *limits, *more, "--json"])
    assert done.exit_code == 0, done.stderr
    arm = gn.Goniometer(
        theta_i=(0.0, math.radians(60.0)),
        theta_o=(0.0, 1.0),
        step_theta=math.radians(10.0),
        step_phi=math.radians(30.0),
    )
    planned = gn.plan(gn.expression(PAINT), 4, "A", goniometer=arm, noise=0.02, starts=2, seed=3, repeats=True)
    assert json.loads(done.stdout) == json.loads(json.dumps(planned.to_json()))


# Commands that nobody wrote.


@checked
def tmp_gloss(
    m: gn.Reflectance,
    theta_i: Annotated[float, Declared("polar angle of the light", 0.0, math.pi / 2, "rad")] = math.radians(60.0),
    share: Annotated[float, Declared("part of the light that counts", 0.0, 1.0, "share")] = 0.5,
) -> float:
    """Specular gloss: f in the mirror direction, a part of it.

    Units    1/sr.
    """
    wi = gn.direction(theta_i, 0.0)
    return share * m.f(wi, wi * [-1.0, -1.0, 1.0])


@pytest.fixture
def gloss(monkeypatch):
    """A public function more, for a while."""
    module = ModuleType("gonio.tmp_gloss_of")
    module.tmp_gloss = tmp_gloss
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(gn._ON_USE, "tmp_gloss", "tmp_gloss_of")
    monkeypatch.setattr(gn, "__all__", [*gn.__all__, "tmp_gloss"])
    yield
    vars(gn).pop("tmp_gloss", None)


@pytest.mark.usefixtures("gloss")
def test_a_public_function_is_a_command():
    """One signature and one docstring: options in degrees and %, help, errors, JSON."""
    run = CliRunner().invoke
    m = "Lambertian(0.5) + Microfacet(GGX(0.3), Dielectric(1.5))"
    expected = gn.tmp_gloss(gn.expression(m), math.radians(20.0), 0.25)
    done = run(cli, ["tmp-gloss", m, "--theta-i", "20", "--share", "25"])
    assert done.exit_code == 0, done.stderr
    assert float(done.stdout) == pytest.approx(float(expected), rel=1e-5)
    as_json = run(cli, ["tmp-gloss", m, "--theta-i", "20", "--share", "25%", "--json"])
    assert json.loads(as_json.stdout) == pytest.approx(float(expected), rel=1e-12)
    assert json.loads(run(cli, ["tmp-gloss", m, "--json"]).stdout) == pytest.approx(
        float(gn.tmp_gloss(gn.expression(m)))
    )
    text = told("tmp-gloss")
    assert max(map(len, text.splitlines())) <= 80 and "f in the mirror direction" in text
    joined = " ".join(text.split())
    assert "Polar angle of the light [degrees]. [default: 60]" in joined
    assert "Part of the light that counts [%]. [default: 50]" in joined
    wrong = run(cli, ["tmp-gloss", m, "--theta-i", "95"])
    assert wrong.exit_code == 2 and wrong.stderr.count("\n") == 1
    assert "--theta-i '95': expected a number from 0 to 90 degrees: polar angle of the light" in wrong.stderr


def test_functions_of_a_material_are_commands():
    done = CliRunner().invoke(cli, ["white-sky-albedo", "Lambertian([0.2, 0.3, 0.4])", "--json"])
    np.testing.assert_allclose(json.loads(done.stdout), [0.2, 0.3, 0.4], atol=1e-4)
    for name in ("tmp-gloss", "albedos", "blackbody", "gonio", "white_sky_albed"):
        assert "No such command" in CliRunner().invoke(cli, [name, "gold"]).stderr
