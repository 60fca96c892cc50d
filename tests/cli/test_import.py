"""`gonio import`, and the options with which every command reads a file."""

from __future__ import annotations

import json
from functools import partial

import pytest
from click.testing import CliRunner
from places import ROOT

import gonio as gn
from gonio.cli import tables
from gonio.cli.commands import cli

EXPORT = """Operator;J. Doe

Ausfall;Einfall;BRDF [1/sr];U;Temp
-40,0;30,0;0,31;0,004;21
0,0;30,0;0,30;0,004;21
40,0;30,0;n/a;;21
Ende
"""
SAID = ["-O", "columns.theta_i=Einfall", "-O", "columns.theta_o=Ausfall", "-O", "columns.ignore=*", "-O", "coverage=2"]


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs a command in a folder with an export, on a terminal of so many columns where it is said."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scan.csv").write_text(EXPORT)

    def run(*words, columns=10_000):
        monkeypatch.setattr(tables, "_width", lambda: columns)
        return CliRunner().invoke(cli, [str(word) for word in words])

    return run


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_what_was_understood_is_shown(run, columns):
    result = run("import", "scan.csv", *SAID, columns=columns)
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert max(map(len, lines)) <= max(columns, 78)
    text = " ".join(result.stdout.split())
    assert lines[0].startswith("scan.csv: CSV, 123 bytes")
    for words in ("Ausfall", "Einfall", "3 in lines 4 to 6, names in line 3, semicolons between cells, decimal commas",
                  "lines above: 1, lines below: 1", "2 cells", "30° (1)", "the plane of incidence alone",
                  "2 theta_o", "1 missing", "with standard uncertainties", "Nothing is written"):  # fmt: skip
        assert words in text, result.stdout


def test_an_import_is_written(run, tmp_path, one_probe):
    result = run("import", "scan.csv", *SAID, "-o", tmp_path / "scan.nc", "--json")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    assert [column["meaning"].partition(":")[0] for column in found["columns"]] == [
        "theta_o", "theta_i", "values", "expanded uncertainty, k = 2", "left out"
    ]  # fmt: skip
    assert found["columns"][2]["missing"] == 1 and found["suspicious"] == []
    assert "scan.nc: netCDF" in result.stderr and "error  none" in result.stderr
    m = gn.load(tmp_path / "scan.nc")
    assert m.uncertainty.ravel()[0] == 0.002 and m.provenance["converted_from"]["options"]["coverage"] == 2.0
    assert m == gn.load("scan.csv", columns={"theta_i": "Einfall", "theta_o": "Ausfall", "ignore": "*"}, coverage=2)


def test_what_looks_wrong_is_shown(run, tmp_path):
    (tmp_path / "a.csv").write_text("AOI,theta_r,phi,BRF\n0,10,0,98\n0,20,0,97\n")
    assert "suspicious" in (text := run("import", "a.csv").stdout) and "percent? say value_unit='%'" in text
    assert "suspicious" not in run("import", "a.csv", "-O", "value_unit=%").stdout


def test_every_command_reads_with_options(run, tmp_path, monkeypatch, one_probe):
    monkeypatch.setattr("gonio.laws.check", partial(gn.check, laws=["positivity"]))
    for command in (["info"], ["check", "--json"], ["albedo"], ["convert"]):
        out = [tmp_path / "out.nc"] if command == ["convert"] else []
        assert "column names 'Ausfall'" in run(command[0], "scan.csv", *out).stderr
        result = run(*command, "scan.csv", *out, *SAID)
        assert result.exit_code in (0, 1) and "error" not in result.stderr, (command, result.stderr)
    assert gn.load(tmp_path / "out.nc").uncertainty.ravel()[0] == 0.002


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("import nothing.csv", "no such file"),
        ("import scan.csv -O skip=two", "-O 'skip=two': expected a whole number from 0"),
        ("import scan.csv -O skip", "expected name=value"),
        ("import scan.csv -O skip=1 -O skip=2", "skip is given twice"),
        ("import scan.csv -O columns.=1", "expected name=value"),
        ("import scan.csv -O columns=a,b -O columns.c=1", "columns is given twice"),
        ("import scan.csv -o scan.xyz", "'.xyz'"),
        ("import model.json", "a gonio JSON file, which needs no import"),
        ("info gold -O skip=1", "options to read a file with"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line(run, command, says):
    gn.save(gn.Lambertian(0.5), "model.json")
    result = run(*command.split())
    assert result.exit_code == 2 and says in result.stderr and result.stderr.count("\n") == 1, result.stderr


def test_the_example_is_what_its_page_shows(run):
    shown = (ROOT / "docs" / "your-own-measurement.md").read_text(encoding="utf-8")
    lines = run("import", ROOT / "examples" / "ptfe_in_plane.csv").stdout.splitlines()
    assert "\n".join(lines[1:-2]) in shown
