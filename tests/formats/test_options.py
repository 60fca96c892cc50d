"""Options of readers and writers: every one is declared, and a wrong value is one ParameterError in every format."""

from __future__ import annotations

import contextlib
import math
import re
import shlex
import types
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from binary_files import polarized
from click.testing import CliRunner
from seeds import SEEDS
from sweeps import every

import gonio as gn
from gonio.cli import formats as formats_command
from gonio.cli import tables
from gonio.cli.commands import cli
from gonio.conversion import comparison
from gonio.declared import discover
from gonio.declared.arguments import LARGEST, Declared, FunctionArgument
from gonio.errors import NotFoundError, ParameterError, TooLargeError
from gonio.facts.format_table import format_table
from gonio.formats import DEMANDED, _options, formats
from gonio.formats._options import of_texts, options
from gonio.formats._reading import tensor_file

MODULES = {module.NAME: module for module in formats()}
READ = [(name, o) for name, module in MODULES.items() for o in options(module.read).values()]
WRITE = [(n, o) for n, module in MODULES.items() if hasattr(module, "write") for o in options(module.write).values()]
CASES = [("read", *case) for case in READ] + [("write", *case) for case in WRITE]

SEED_OF = {"CUReT": "CUReT Oren-Nayar", "RT-300S": "RT-300S raw"}
ITSELF: dict[str, Any] = {}
ITSELF["a"] = ITSELF
NEVER = [
    *(object(), b"x", 1j, {1}, len, [], (), [[]], [None], {"a": object()}, {"a": math.nan}, {(1, 2): 3}, ITSELF),
    *(math.nan, math.inf, -math.inf, np.array([np.nan]), np.float32(np.inf), 10**400, -(10**400), [10**400, 10**401]),
    *("a\0b", "a\nb", "x" * 2000, ["x" * 2000], np.array(["x", "y"]), np.zeros((2, 2, 2)), np.datetime64("2020-01-01")),
]
"""Values that no option may have."""

SOMETIMES = {
    bool: [0, 1, 1.0, "true", "x", None, [True], np.array([True, False])],
    int: [True, np.True_, 4.0, 4.5, "4", "x", {}, [True], ["4"], [4.5] * 3],
    float: [True, np.True_, "4", "x", {}, [True], ["4"], [[0.1, 0.2]]],
    str: [True, 4, ["x"], {}, Path("x")],
    Path: [True, 4, [4], {}, [b"x"]],
    dict: [True, 4, "x", [], [("a", 1)]],
}
"""Values that no option may have whose numbers or words are of this kind only."""


def scalars(kind: Any) -> list[Any]:
    """The kinds of what a value of this kind holds."""
    inner = typing.get_args(kind)[:1] if hasattr(kind, "__metadata__") else typing.get_args(kind)
    return [scalar for of in inner for scalar in scalars(of)] if inner else [kind]


def bad_values(option: FunctionArgument) -> list[Any]:
    d, kinds = option.declared, {scalar for kind in option.kinds for scalar in scalars(kind)}
    found = [*NEVER, *([None] if option.default is not None else [])]
    if len(kinds) == 1:
        found += SOMETIMES[(kind := kinds.pop())]
        if kind in (int, float):
            outside = [x for x in (d.low - 1, 2 * d.high + 1) if math.isfinite(x)]
            outside = [kind(x) for x in outside] + ([LARGEST] if kind is int else [])
            if typing.get_args(option.kinds[0]):
                count = d.lengths[0] if d.lengths else len(typing.get_args(option.kinds[0]))
                outside = [[x] * count for x in outside] + ([[]] if d.lengths else [])
            found += outside
    if d.words:
        found += ["no such word", 5, "", 1.0]
    if d.lengths:
        found += [8, [8], [8] * 7, [8.0] * d.lengths[0]]
    if d.multiple > 1:
        found.append(int(d.low) + 1)
    if d.rising:
        found += [[2.0, 1.0], [1.0, 1.0], np.array([1.0, 1.0])]
    return found


def seed(name: str, folder: Path) -> Path:
    """A file of the format, as far as that is recognized."""
    path = folder / "file"
    key = next(key for key in (SEED_OF.get(name, name), *SEEDS) if key in SEEDS and key.startswith(name))
    path.write_bytes(b"\x0e\x03\x13\x01" if name == "MCD43A1" else SEEDS[key]())
    return path


@every(case=CASES)
def test_every_option_says_what_it_is(case):
    does, name, option = case
    assert option.declared.doc and option.expected and option.kinds
    assert option.default is None or option.checked(option.default) == option.default
    usual = option.declared.usual
    assert usual is None or (option.default is None and option.checked(usual) == usual)
    assert of_texts(MODULES[name], does, [f"{option.name}={option.usual}"] if option.usual else []) is not None


@pytest.mark.parametrize("name", sorted({name for _, name, _ in CASES}))
def test_bad_values_are_parameter_errors(name, tmp_path):
    """Through the public face, before anything is read or written."""
    for does, option in ((does, option) for does, of, option in CASES if of == name):
        folder = tmp_path / f"{does} {option.name}"
        folder.mkdir()
        file = seed(name, folder) if does == "read" else folder / "new"
        for value in bad_values(option):
            with pytest.raises((ParameterError, TooLargeError), match=rf"^{option.name}=") as error:
                if does == "read":
                    gn.load(file, **{option.name: value})
                else:
                    gn.save(gn.Lambertian(0.5), file, name, **{option.name: value})
            assert "expected" in str(error.value) and f"`gonio formats {shlex.quote(name)}`" in str(error.value), value
            assert len(str(error.value)) < 1200
        assert does == "read" or not list(folder.iterdir())


@every(case=CASES)
def test_bad_texts_are_told_as_they_were_typed(case):
    does, name, option = case
    flag = {"read": "-O", "write": "--option"}[does]
    for text, says in ((f"{option.name}=a\0b", ": expected "), (f"{option.name}x=1", "; did you mean '")):
        with pytest.raises(ParameterError, match=re.escape(f"{flag} {text!r}")) as error:
            of_texts(MODULES[name], does, [text])
        assert says in str(error.value)


@every(case=CASES)
def test_values_at_the_bounds_are_taken(case):
    option = case[-1]
    d = option.declared
    kind = option.kinds[0]
    for word in d.words:
        assert option.checked(word) == word
        assert option.checked(word.upper() if isinstance(word, str) else np.int64(word)) == word
    if kind in (int, float) and not d.words:
        for bound in (x for x in (d.low, d.high) if math.isfinite(x)):
            taken = option.checked(np.array([bound])[0] if kind is float else np.int64(bound))
            assert taken == bound and type(taken) is kind
    if typing.get_origin(kind) is Sequence and scalars(kind) == [float]:
        assert option.checked(d.low) == (d.low,) and option.checked(np.array([d.low, d.high])) == (d.low, d.high)
    if d.lengths:
        for count in d.lengths:
            least = (int(d.low),) * count
            assert option.checked(list(least)) == option.checked(np.array(least)) == least
            with pytest.raises(TooLargeError, match=option.name):
                _options.checked(MODULES[case[1]], case[0], {option.name: [10**6] * count})
    if bool in option.kinds:
        assert option.checked(np.True_) is True
    if dict in option.kinds:
        assert option.checked({"a": [1, {"b": "é"}]}) == {"a": [1, {"b": "é"}]}


NEEDED = {"pab-opto": {"incident": (0.3, 0.0)}, "RGL": {"resolution": 4}, "SCATFUN": {"nodes": 4}}
NEEDED |= {name: {"wavelengths": [550.0]} for name in ("BRF table", "OpenMATERIAL", "Speos")}


def at_the_bounds(option: FunctionArgument) -> list[Any]:
    """Values that `option` may have; the largest of SCATFUN and of trees take minutes."""
    d, kind = option.declared, option.kinds[0]
    ends = [x for x in (d.low, d.high) if (math.isfinite(x) and x < 2048) or x == 1e9]
    if d.words:
        return [*d.words][-1:] if isinstance(next(iter(d.words)), str) else sorted(d.words)[:2]
    if d.lengths:
        return [[int(d.low)] * d.lengths[0]]
    if kind in (int, float):
        return [kind(x) for x in ends]
    return [*([x] for x in ends), ends] if ends and typing.get_origin(kind) is Sequence else []


@pytest.mark.parametrize(("name", "option"), WRITE, ids=[f"{name} {option.name}" for name, option in WRITE])
def test_files_at_the_bounds_are_written_or_refused(name, option, tmp_path):
    """A format may refuse what does not fit the material, or memory; it never fails in another way."""
    module, trees = MODULES[name], name == "WINDOW XML" and option.name in ("resolution", "tolerance")
    coarse = {"step": 30.0} if "step" in options(module.write) else {"tree": 3} if trees else {}
    for value in at_the_bounds(option):
        path = tmp_path / f"a{module.SUFFIXES[0]}"
        with contextlib.suppress(ParameterError, TooLargeError):
            gn.save(gn.Lambertian(0.5), path, name, **{**NEEDED.get(name, {}), **coarse, option.name: value})
            assert path.exists()


@pytest.mark.parametrize(("azimuth", "read"), [([360.0], 1), ([0.0, 300.0], 2), ([0.0, 90.0, 270.0, 360.0], 2)])
def test_azimuths_of_zemax_that_are_no_half_circle(azimuth, read, tmp_path):
    """None is dropped: one side stands for the other where every azimuth of that has its mirror image."""
    gn.save(gn.Lambertian(0.5), tmp_path / "a", "Zemax", azimuth=azimuth, step=30)
    assert len(gn.load(tmp_path / "a").axes["azimuth"]) == read


def test_resolution_is_a_count_and_step_an_angle():
    for name, option in READ + WRITE:
        if option.name == "resolution":
            assert {scalar for kind in option.kinds for scalar in scalars(kind)} == {int}, name
        if option.name == "step":
            assert option.kinds == (float,) and option.declared.unit == "degrees", name
    assert {"FRED", "LightTools", "Speos", "Zemax"} <= {name for name, option in WRITE if option.name == "step"}


@pytest.mark.parametrize("name", ["FRED", "LightTools", "Speos", "Zemax"])
def test_step_is_that_of_the_angles_of_wo(name, tmp_path):
    gn.save(gn.Lambertian(0.5), tmp_path / "a", name, step=17)
    axes = gn.load(tmp_path / "a").axes
    if name == "Zemax":
        assert np.degrees(np.diff(axes["radial"])[-1]) == pytest.approx(17.0)
    else:
        assert np.degrees(axes["theta_o"][:6]) == pytest.approx([0, 17, 34, 51, 68, 85])
    with pytest.raises(ParameterError, match=r"resolution=17: no option to write .* expected one of .*step"):
        gn.save(gn.Lambertian(0.5), tmp_path / "a", name, resolution=17)


def test_lists_may_be_arrays_or_one_number(tmp_path):
    gn.save(gn.Lambertian(0.5), tmp_path / "a.brdf", "Speos", theta_i=np.array([0, 30]), theta_o=45, phi=[0, 180])
    axes = gn.load(tmp_path / "a.brdf").axes
    assert [np.degrees(x).round(9).tolist() for x in axes.values()] == [[0, 30], [45], [0, 180]]
    gn.save(gn.Lambertian(0.5), tmp_path / "b", "pab-opto", incident=(0.3, 0.0), resolution=(1, 18, 36))
    gn.save(gn.Lambertian(0.5), tmp_path / "c", "pab-opto", incident=[0.6, 0.0], resolution=(1, 18, 36))
    assert len(gn.load(tmp_path / "b", more=str(tmp_path / "c")).axes["theta_i"]) == 2
    with pytest.raises(NotFoundError):
        gn.load(tmp_path / "b", more=[tmp_path / "nothing"])


@pytest.mark.parametrize("format", [5, b"MERL", [], "no such format"])
def test_names_of_formats_that_are_none(format, tmp_path):
    with pytest.raises(ParameterError, match=r"format=.*expected (one of|a word)"):
        gn.save(gn.Lambertian(0.5), tmp_path / "a.binary", format)


def test_isotropic_azimuths_of_lighttools_begin_at_0(tmp_path):
    with pytest.raises(ParameterError, match=r"phi=.*expected angles from 0 to 360"):
        gn.save(gn.Lambertian(0.5), tmp_path / "a", "LightTools", phi=[-90, 90])


# Declarations.


def module_of(**functions: Any) -> types.ModuleType:
    """A format's module."""
    module = types.ModuleType("made_up")
    vars(module).update(NAME="made up", SUFFIXES=(".made",), DESCRIPTION="a format of this test", ORACLE="this test")
    vars(module).update(functions)
    return module


def matches(head: bytes, size: int) -> bool:
    return False


def test_an_option_that_is_not_declared_is_an_error():
    def bare(path, side="front"): ...
    def typed(path, side: str = "front"): ...
    def without_meaning(path, side: Annotated[str, Declared("")] = "front"): ...
    def without_default(path, side: Annotated[str, Declared("a side")]): ...

    for function in (bare, typed, without_meaning, without_default):
        function.__name__ = "read"
        with pytest.raises(ParameterError, match=r"the option side is not declared; expected side: Annotated\["):
            options(function)

    def unknown(path, side: Annotated[Nothing, Declared("a side")] = None): ...  # noqa: F821  (a name that there is not)

    unknown.__name__ = "read"
    with pytest.raises(ParameterError, match="side is not declared"):
        options(unknown)


def test_what_a_format_needs_is_demanded_where_it_is_discovered(monkeypatch):
    def read(path: Path) -> gn.Reflectance: ...

    whole = module_of(matches=matches, read=read)
    monkeypatch.setattr(discover, "modules", lambda package: [whole])
    assert formats.__wrapped__() == [whole]
    for name in DEMANDED:
        lacking = module_of(matches=matches, read=read)
        delattr(lacking, name)
        lacking.__file__ = "made_up.py"
        monkeypatch.setattr(discover, "modules", lambda package, held=lacking: [held])
        with pytest.raises(ParameterError, match=f"made_up.py: a format without {name}; define"):
            formats.__wrapped__()


def test_the_row_of_a_format_has_its_options(monkeypatch):
    def read(path: Path, side: Annotated[str, Declared("a side", words=("up", "down"))] = "up") -> gn.Reflectance: ...

    monkeypatch.setattr("gonio.facts.format_table.formats", lambda: [module_of(matches=matches, read=read)])
    (row,) = format_table()
    assert row.oracle == "this test" and row.to_json()["read_options"]["side"]["default"] == "up"
    assert "side            up       'up' or 'down': a side" in formats_command.format_as_text(row)


# The command line.


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(cli, list(words))


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("a.txt --format fred --option step=0", "--option 'step=0': expected a number from 0.001 to 90 degrees"),
        ("a.txt --format fred --option step=nan", "--option 'step=nan': 'nan' is no angle"),
        ("a.txt --format fred --option step=1,2", "--option 'step=1,2': expected"),
        ("a.txt --format fred --option theta_i=30,0", "rising"),
        ("a.txt --format fred --option resolution=3", "no option to write FRED files"),
        ("a.binary --option phi_d=90", "expected 180 or 360"),
        ("a.binary --option phi_d=none", "--option 'phi_d=none': expected"),
        ("a.ssdd --option binary=2", "--option 'binary=2': expected True or False"),
        ("a.ssdd --resolution 4,4", "expected 3 or 4 whole numbers from 1"),
        ("a.xml --option tree=5", "expected 3 or 4"),
        ("a.bsdf --format scatfun --option nodes=1e9", "--option 'nodes=1e9': expected a whole number from 4 to 2048"),
        ("a.brdf --format bird --option metadata=x", "--option 'metadata=x': expected a JSON object"),
        ("a.brdf --format bird --option metadata=[1]", "--option 'metadata=[1]': expected a JSON object"),
        ("a.nc --option parameterization=polar", "expected one of 'angles'"),
        ("a.nc --option parameterization=angles --option parameterization=angles", "given twice"),
        ("a.nc --resolution 4,4,4 --option resolution=4,4,4", "given twice"),
    ],
)
def test_bad_options_are_one_line_and_exit_code_2(run, tmp_path, words, says):
    result = run("convert", "Lambertian(0.5)", *words.split())
    assert result.exit_code == 2 and says in result.stderr and result.stderr.count("\n") == 1, result.stderr
    assert not list(tmp_path.iterdir())


def test_options_are_read_by_their_declarations():
    bird, ssdd, fred, window = (MODULES[name] for name in ("BiRD", "SSDD", "FRED", "WINDOW XML"))
    texts = ['metadata={"id": "a,b"}', "wavelengths=550", "resolution=4,4,6"]
    assert of_texts(bird, "write", texts) == {
        "metadata": {"id": "a,b"}, "wavelengths": (550.0,), "resolution": (4, 4, 6)
    }  # fmt: skip
    assert of_texts(ssdd, "write", ["binary=TRUE", "resolution=none"]) == {"binary": True, "resolution": None}
    assert of_texts(fred, "write", ["theta-i=0, 30", "channel=550"]) == {"theta_i": (0.0, 30.0), "channel": 550.0}
    assert of_texts(fred, "write", ["channel=R"]) == {"channel": "R"}
    assert of_texts(window, "write", ["basis=Half", "name=a, b"]) == {"basis": "half", "name": "a, b"}
    pab = of_texts(MODULES["pab-opto"], "read", ["more=a.txt, b.txt", "side=back"])
    assert pab == {"more": (Path("a.txt"), Path("b.txt")), "side": "back"}


def test_the_options_of_a_format_are_shown(run):
    text = run("formats", "window", "xml").stdout
    assert re.search(r"tolerance +0 +a number from 0 below 1: cells of a tree", text)
    assert re.search(r"basis +full +one of 'full', 'half', 'quarter', or an AngleBasis", text)
    assert "checked   against Radiance" in text and "option to read" in text
    found = run("formats", ".BSDF").stdout
    assert all(f"format    {name}:" in found for name in ("LightTools", "RGL", "SCATFUN", "Zemax"))
    assert '"expected": "180 or 360"' in run("formats", "merl", "--json").stdout
    wrong = run("formats", "frd")
    assert wrong.exit_code == 2 and "did you mean FRED? `gonio formats`" in wrong.stderr


@pytest.mark.parametrize("width", [80, 120])
def test_the_options_fit_the_terminal(width, monkeypatch):
    monkeypatch.setattr(tables, "_width", lambda: width)
    for row in format_table():
        for line in formats_command.format_as_text(row).splitlines():
            assert len(re.sub(r"\x1b\[[0-9;]*m", "", line)) <= width, line


# Folders.


def test_zarr_folders_are_converted_again_and_again(run, tmp_path, monkeypatch):
    pytest.importorskip("zarr")
    monkeypatch.setattr(comparison, "TOLERANCES", (1e-2, 1e-2))
    for resolution in ("4,4,4", "4,5,4"):
        result = run("convert", "Lambertian(0.5)", "a.zarr", "--resolution", resolution)
        assert result.exit_code == 0, result.stderr
    report = gn.convert(gn.Lambertian(0.5), tmp_path / "a.zarr", resolution=(4, 4, 4))
    assert report.bytes == sum(p.stat().st_size for p in (tmp_path / "a.zarr").rglob("*") if p.is_file()) > 4000
    said = run("info", "a.zarr")
    assert said.exit_code == 0 and re.search(r"format +Zarr, [0-9.]+ kB", said.stdout)
    (tmp_path / "a.zarr" / "mine.txt").write_text("kept")
    result = run("convert", "Lambertian(0.5)", "a.zarr")
    assert result.exit_code == 2 and "no part of a Zarr store" in result.stderr
    assert run("convert", "a.zarr", "b.zip").exit_code == 0


# KAIST files without axes.


def test_kaist_axes_that_are_empty_are_even(tmp_path):
    fields = polarized()
    tensor_file.write(tmp_path / "whole.pbsdf", fields)
    whole = gn.load(tmp_path / "whole.pbsdf")
    wi, wo = (
        gn.direction(np.linspace(0.1, 1.4, 50), 0.3),
        gn.direction(np.linspace(1.3, 0.2, 50), np.linspace(0, 6, 50)),
    )
    for names in (["theta_h", "theta_d", "phi_d"], ["phi_d"]):
        empty = {name: np.zeros((0, fields[name].size), "f4") for name in names}
        tensor_file.write(tmp_path / "empty.pbsdf", {**fields, **empty})
        m = gn.load(tmp_path / "empty.pbsdf")
        np.testing.assert_allclose(m.f(wi, wo), whole.f(wi, wo), rtol=1e-5)
        assert m.about["nodes"].startswith(f"{', '.join(names)} empty in the file, taken as even")
        gn.save(m, tmp_path / "again.pbsdf")
        assert (tmp_path / "again.pbsdf").read_bytes() == (tmp_path / "empty.pbsdf").read_bytes()
    assert "nodes" not in whole.about
    assert "empty in the file" in CliRunner().invoke(cli, ["info", str(tmp_path / "empty.pbsdf")]).stdout
    tensor_file.write(tmp_path / "short.pbsdf", {**fields, "theta_h": fields["theta_h"][:, :-1]})
    with pytest.raises(gn.errors.FormatError, match="M is float32 of shape"):
        gn.load(tmp_path / "short.pbsdf")


def test_options_are_checked_in_one_place():
    """No reader or writer is called with a value that was not."""
    assert _options.checked(MODULES["RGL"], "write", {"resolution": np.int64(8)}) == {"resolution": 8}
    assert type(_options.checked(MODULES["RGL"], "write", {"resolution": np.int64(8)})["resolution"]) is int
