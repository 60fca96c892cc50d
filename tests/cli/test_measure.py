"""`gonio measure`: surfaces by name and from maps, into files; what it says of bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

import gonio as gn
from gonio.cli.commands import cli
from gonio.cli.measure import surface_of
from gonio.errors import ExpressionError, NotFoundError, ParameterError


def run(*words):
    return CliRunner().invoke(cli, ["measure", *map(str, words)])


def test_a_surface_by_name(tmp_path):
    few = ("--tolerance", "50%", "--rays", 2048, "--cells", "6,8", "--theta-i", "0,40", "--json")
    found = run("gaussian(0.3, size=64)", "-o", tmp_path / "a.csv", "--facet", "0.5", *few)
    assert found.exit_code == 0, found.output
    said = json.loads(found.stdout)
    assert [row["theta_i"] for row in said["directions"]] == pytest.approx([0.0, 40.0])
    assert 0.4 < said["directions"][0]["reflected"] < 0.51
    m = gn.load(tmp_path / "a.csv")
    assert gn.albedo(m, [0, 0, 1]) == pytest.approx(said["directions"][0]["reflected"], abs=0.05)


def test_a_map(tmp_path, one_probe):
    heights = 0.3 * np.sin(np.arange(48) / 4.0)[:, None] * np.cos(np.arange(40) / 5.0)
    np.save(tmp_path / "a.npy", heights)
    few = ("--tolerance", 100, "--rays", 1024, "--cells", "4,8", "--theta-i", 30, "--phi-i", "0,90")
    found = run(tmp_path / "a.npy", "--pixel", 0.5, "--facet", "Lambertian([0.5, 0.2])", "-o", tmp_path / "b.nc", *few)
    assert found.exit_code == 0, found.output
    assert "16 parts" in found.output
    assert gn.load(tmp_path / "b.nc").channels == 2
    assert "--pixel" in run(tmp_path / "a.npy", "-o", tmp_path / "b.nc").output


@pytest.mark.parametrize(
    "text, error, message",
    [
        ("gausian(0.3)", NotFoundError, "did you mean 'gaussian'"),
        ("gaussian(0.3, sze=64)", ParameterError, "sze"),
        ("gaussian(__import__('os'))", ExpressionError, "expected"),
        ("gaussian(0.3", ExpressionError, "expected"),
        ("from_map('x')", NotFoundError, "no such file"),
        ("gaussian(30)", ParameterError, "from"),
    ],
)
def test_surfaces_that_are_none(text, error, message):
    with pytest.raises(error, match=message):
        surface_of(text)
