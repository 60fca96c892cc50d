"""`gonio nearest`: what it prints and draws; bad input ends in one line and exit code 2."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from libraries import thinned

import gonio as gn
from gonio.cli.commands import cli
from gonio.pictures.image import load_image

SMALL = ("--size", 16, "--samples", 4)


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the command in an empty folder and returns its result."""
    monkeypatch.chdir(tmp_path)
    return lambda *args: CliRunner().invoke(cli, ["nearest", *map(str, args)])


def test_the_nearest_are_listed(run):
    lines = run("brass", "-n", 3).stdout.splitlines()
    assert lines[0].split() == ["name", "distance", "what", "it", "is"] and len(lines) == 4
    assert lines[1].split() == ["1", "brass", "0.0000", "measured", "fit,", "metal"]


def test_a_free_scale_has_a_column(run):
    lines = run(
        "0.25 * Lambertian(0.8)", "--scale", "free", "-a", "Lambertian(0.4)", "-d", "cosine"
    ).stdout.splitlines()
    assert lines[0].split()[:3] == ["name", "distance", "factor"]
    assert lines[1].split()[:4] == ["1", "Lambertian(0.4)", "0.0000", "0.5"]


def test_json_is_what_python_returns(run):
    gn.save(gn.Lambertian(0.3), "a.json")
    Path("notes.txt").write_text("no material\n")
    rows = json.loads(run("brass", "-a", ".", "-a", "gold", "--json").stdout)
    assert [row["rank"] for row in rows] == [1, 2, None] and rows[-1]["name"] == "notes.txt"
    found = {match.name: match for match in gn.reconstruction.nearest(gn.material("brass"), [".", "gold"])}
    for row in rows:
        match = found[row["name"]]
        assert row["compared"] == match.compared and row["pairs"] == match.pairs
        assert row["distance"] == (match.distance if match.rank else None)
        assert (row["reason"] is None) == bool(match.rank)


def test_a_reason_takes_one_line(run):
    Path("notes.txt").write_text("no material\n")
    said = run("brass", "-a", "notes.txt", "-a", "gold")
    assert said.exit_code == 0
    last = said.stdout.splitlines()[-1]
    assert "notes.txt" in last and "not a known format" in last and len(last) < 200


@pytest.mark.parametrize(
    ("count", "columns", "rows"), thinned([(1, 2, 1), (5, 6, 1), (6, 4, 2), (10, 6, 2)], [(6, 4, 2)])
)
@pytest.mark.usefixtures("unlaid")
def test_the_picture_has_itself_and_the_nearest(run, count, columns, rows):
    said = run("brass", "-n", count, "-o", "near.png", *SMALL)
    assert said.exit_code == 0 and said.stdout.splitlines()[-1].startswith("near.png: brass and the nearest, ")
    height, width = load_image("near.png").pixels.shape[:2]
    assert abs(width - 120 * (2.2 * columns + 0.1)) < 2 and abs(height - 120 * (2.65 * rows + 0.1)) < 2


def test_pictures_of_a_free_scale_and_other_lights(run):
    words = ("-p", "distribution.alpha_x=0.2", "-n", 1, "-a", "brass", "-a", "chrome", "--scale", "free", "-l", "sun")
    said = run("gold", *words, "-o", "a.svg", *SMALL)
    assert said.exit_code == 0 and "<svg" in Path("a.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["nosuch"], "no such file, no built-in material"),
        (["brass", "-a", "nosuch"], "no such file, no built-in material"),
        (["brass", "-a", "zzz*"], "no built-in material matches"),
        (["brass", "-d", "lob"], "--distance 'lob': expected one of 'log', 'cosine', 'cube_root'"),
        (["brass", "--scale", "fre"], "did you mean 'free'?"),
        (["brass", "-n", "0"], "--count '0': expected a whole number from 1"),
        (["brass", "-o", "a.gif"], "expected a name that ends in"),
        (["brass", "-n", "500", "-o", "a.png"], "expected up to 399 beside a picture"),
        (["brass", "--size", "0", "-o", "a.png"], "--size '0': expected a whole number"),
        (["RoughDielectric(GGX(0.2), 1.5)"], "transmits light"),
        (["brass", "-a", "RoughDielectric(GGX(0.2), 1.5)"], "none of 1 could be compared"),
    ],
)
def test_bad_input_ends_in_one_line(run, args, said):
    result = run(*args)
    assert result.exit_code == 2 and said in result.stderr
    assert len(result.stderr.splitlines()) == 1 and result.stderr.startswith("gonio: error: ")
