"""Commands follow from signatures: their options, their help, and commands that nobody wrote."""

from __future__ import annotations

import ast
import inspect
import json
import math
import re
import shlex
import sys
import textwrap
import typing
from types import ModuleType
from typing import Annotated, Any

import click
import numpy as np
import pytest
from click import Context
from click.testing import CliRunner
from face import functions

import gonio as gn
from gonio.cli.command import Command, Typed
from gonio.cli.commands import cli
from gonio.declared.arguments import Declared, FunctionArgument, arguments, checked
from gonio.errors import ParameterError
from gonio.facts.public import asked_of_one, forms

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
    return sorted(names & {place.rpartition(".")[2] for place in functions()})


@pytest.mark.parametrize("name", COMMANDS)
def test_no_option_restates_a_declared_argument(name):
    """... of a function that its command calls: bounds, defaults and words are those of the signature."""
    command = cli.commands[name]
    by_name = {place.rpartition(".")[2]: function for place, function in functions().items()}
    asked = [by_name[name] for name in called(command)]
    asked += command.functions.values() if isinstance(command, Command) else ()
    declared = {argument for function in asked for argument in arguments(function)}
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
    assert Typed(FunctionArgument("a", (float,), 0.0, declared)).convert(text, None, None) == pytest.approx(
        value, rel=1e-12
    )


WRONG = [
    ("plan gold 0", "COUNT '0': expected a whole number from 1 to 200: how many pairs of directions"),
    ("plan gold 3 --noise 100", "--noise '100': expected a number from 0 below 100%"),
    ("plan gold 3 --criterion Z", "--criterion 'Z': expected 'D' or 'A'"),
    ("plan gold 3 --phi 0,x", "--phi '0,x': 'x' is no angle; expected a number in degrees"),
    ("plan gold 3 --phi 0,9rad", "--phi '0,9rad', which is 0°, 515.66°: expected 2 numbers from -360 to 360 degrees"),
    ("measure gaussian(0.3) -o a.csv --cells 18", "--cells '18': expected 2 whole numbers from 1: rings"),
    ("measure gaussian(0.3) -o a.csv --pixel 1", "--pixel: does nothing beside a surface that is no map"),
    ("fit gold --select lobes --robust huber", "--robust: does nothing beside --select"),
    ("fit gold --loss cosin", "did you mean 'cosine'?"),
    ("shader-source gold --function f,pfd", "did you mean 'pdf'?"),
    ("plan gold 3 --theta-i 80,10", "--theta-i '80,10': expected the least angle first, then the largest"),
    ("render gold -o a.png --shape cube", "--shape 'cube': expected one of 'cylinder'"),
    ("convert gold a.bsdf --format rgk", "--format 'rgk': expected one of"),
    ("black-sky-albedo gold 95", "THETA_S '95': expected numbers from 0 to 90 degrees: polar angle of the sun"),
    ("fate gold 45", "WI '45': expected a polar angle and azimuth in degrees, such as 45,0"),
    ("check --all --laws energy", "--laws: does nothing beside --all"),
    ("check gold --laws energie", "--laws 'energie': expected some of positivity"),
    ("fit gold --by alphy", "--by 'alphy': expected some of 0.rho"),
    ("fit gold --select lobs", "--select 'lobs': expected one of lobes"),
    ("albedo gold -k nan", "-k 'nan': expected a number above 0"),
    ("albedo gold --uncertainty common,chanel", "expected some of 'independent', 'common', 'channel'"),
    ("plan gold 3 --seed 9223372036854775808", "from 0 to 9223372036854775807: of the random numbers"),
    ("plan gold 3 --floor -1", "--floor '-1': expected a number from 0 [1/sr]"),
    ("render gold -o a.png --channels 0,1", "--channels '0,1': expected three channels"),
    ("convert gold a.csv --resolution 1,2", "--resolution '1,2': expected 3 or 4 whole numbers"),
    ("convert gold a.txt --format pab-opto --option incident=x,0", "from -2880 to 2880 degrees"),
    ("measure v_grooves(0.3) -o a.csv --phi-i -10", "--phi-i '-10': expected numbers from 0 to 360 degrees"),
    ("measure gaussian(0.3,sed=1) -o a.csv", "'sed'; did you mean 'seed'?; expected some of alpha_x"),
    ("white-sky-albed gold", "'white-sky-albedo'"),
]


@pytest.mark.parametrize(("words", "said"), WRONG, ids=[words for words, _ in WRONG])
def test_a_wrong_value_is_told_as_it_was_typed(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli, words.split())
    assert done.exit_code == 2 and said in done.stderr and done.stderr.count("\n") == 1 and not done.stdout


def typed_in(name: str) -> list[click.Parameter]:
    """The parameters of a command whose values are declared."""
    command = cli.get_command(click.Context(cli), name)
    return [p for p in command.get_params(click.Context(command)) if isinstance(p.type, Typed)]


FUNCTIONS = [name.replace("_", "-") for name in asked_of_one()]


@pytest.mark.parametrize("name", sorted({*COMMANDS, *FUNCTIONS}))
def test_every_option_is_told_as_it_was_typed(name):
    for parameter in typed_in(name):
        shown = parameter.human_readable_name if isinstance(parameter, click.Argument) else parameter.opts[-1]
        kind = parameter.type
        if not kind.declared.unit and Any in kind.kinds:  # takes any text
            continue
        with pytest.raises(ParameterError) as error:
            kind.convert("a\0b", parameter, None)
        words = str(error.value)
        assert words.startswith(f"{shown} 'a\\x00b'") and kind.declared.doc in words
        assert not re.search(r"`\w+`", words), "an argument by its name in Python"
        assert f": expected {kind.argument.expected_typed}: " in words
        if kind.argument.default is None:
            assert kind.convert("none", parameter, None) is None


def declared_arguments() -> list[FunctionArgument]:
    """Those of public functions, readers and writers."""
    formats = [x for module in gn.formats().values() for x in (module.read, getattr(module, "write", None)) if x]
    every = (*functions().values(), *formats, gn.planning.Goniometer)
    return [argument for function in every for argument in arguments(function).values()]


def test_bounds_are_within_when_they_are_typed_as_they_are_written():
    tried = 0
    for argument in declared_arguments():
        kind, declared = argument.kinds[0], argument.declared
        inner = typing.get_args(kind)
        count = declared.lengths[0] if declared.lengths else max(len(inner), 1)
        if declared.words or "tuple" in str(inner) or len({*inner}) > 1:
            continue
        for bound in re.findall(r"(?:from|to) ([^ %,]+)", argument.expected_typed):
            argument.checked_text(",".join([bound] * count), "")
            tried += 1
        for bound in re.findall(r"(?:from|to) ([-.e+\d]*(?: ?pi(?:/\d+)?)?)", argument.expected):
            value = eval(bound.replace(" pi", "*pi").replace("-pi", "-1*pi"), {"pi": math.pi})
            argument.checked([value] * count if count > 1 else value)
    assert tried > 150


@pytest.mark.parametrize("name", COMMANDS)
def test_examples_of_the_help_are_commands(name):
    for example in re.findall(rf"^ +gonio ({name} .*)$", told(name, columns=200), re.MULTILINE):
        words = shlex.split(example.partition("  ")[0])[1:]
        command = cli.commands[name]
        command.make_context(name, [word for word in words if word != ">>"][: None if ">>" not in words else 1])


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
    arm = gn.planning.Goniometer(
        theta_i=(0.0, math.radians(60.0)),
        theta_o=(0.0, 1.0),
        step_theta=math.radians(10.0),
        step_phi=math.radians(30.0),
    )
    planned = gn.planning.plan(gn.expression(PAINT), 4, "A", goniometer=arm, noise=0.02, starts=2, seed=3, repeats=True)
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
