"""`gonio reconstruct`: plans directions, and makes tables of what was measured there; bad input ends in exit code 2."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import gonio as gn
from gonio.cli.commands import cli

FEW = [x for name in ("brass", "blue-fabric", "green-latex", "pink-felt", "gold-metallic-paint") for x in ("-b", name)]
"""A basis that is learnt quickly."""


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the command in an empty folder and returns its result."""
    monkeypatch.chdir(tmp_path)
    return lambda *args: CliRunner().invoke(cli, ["reconstruct", *map(str, args)])


def fill(path, m):
    """Write f of a material into the empty column of a plan."""
    lines = Path(path).read_text().splitlines()
    for k, line in enumerate(lines):
        if line.endswith(","):
            theta_i, phi_i, theta_o, phi_o = np.radians([float(x) for x in line.split(",")[:4]])
            lines[k] += f"{m.f(gn.direction(theta_i, phi_i), gn.direction(theta_o, phi_o))[0]:.9g}"
    Path(path).write_text("\n".join(lines))


def test_a_plan_is_filled_and_becomes_a_table(run, tmp_path, one_probe):
    assert run("--plan", 5, "-o", "plan.csv", *FEW).exit_code == 0
    m = gn.material("brass")
    fill("plan.csv", m)
    path = tmp_path / "table.nc"
    result = run("plan.csv", "-o", path, *FEW)
    assert result.exit_code == 0 and "values" in result.stdout and result.stdout.splitlines()[-1] == str(path)
    table = gn.load(path)
    assert np.allclose(gn.albedo(table, [0, 0, 1]), gn.albedo(m, [0, 0, 1])[0], rtol=0.15)
    assert table.uncertainty is not None
    told = json.loads(run("plan.csv", "--json", *FEW).stdout)
    assert np.ravel(told["used"]).tolist() == [5]
    more = json.loads(run("plan.csv", "--plan", 3, "--json", *FEW).stdout)
    assert len(more["directions"]) == 3 and more["error"] <= more["before"]


@pytest.mark.parametrize(
    "args, told",
    [
        ((), "--plan N"),
        (("--plan", 3, "-o", "plan.nc"), ".csv or .json"),
        (("none.csv", *FEW), "no such file"),
        (("none.csv", "-o", "table.xyz"), "suffix"),
        (("none.csv", "--theta-max", 0), "--theta-max"),
        (("--plan", 3, "-b", "brass"), "4 at least"),
    ],
)
def test_bad_input_ends_in_one_line(run, args, told):
    result = run(*args)
    assert result.exit_code == 2 and told in result.output
