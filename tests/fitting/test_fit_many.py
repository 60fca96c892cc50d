"""`gn.fitting.fit_many`: a row for each material and model, wherever it is computed; stopped runs go on."""

from __future__ import annotations

import json
import os
import signal
import sys

import numpy as np
import pandas
import pytest

import gonio as gn
from gonio.fitting import fit_table, many
from gonio.fitting.cluster import ENVIRONMENT, workers

MODELS = {"matt": gn.Lambertian(), "rough": gn.OrenNayar()}


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "materials"
    made.mkdir()
    for k in range(4):
        gn.save(gn.OrenNayar(0.2 * (k + 1), 0.3), made / f"m{k}.json")
    (made / "bad.json").write_text("{}")
    return made


def test_a_bad_file_is_a_row_with_its_error(folder):
    table = gn.fitting.fit_many(folder, MODELS)
    assert list(table["material"]) == [
        n for n in ("bad.json", "m0.json", "m1.json", "m2.json", "m3.json") for _ in "ab"
    ]
    bad = table[table["material"] == "bad.json"]
    assert (bad["status"] == "refused").all() and bad["error"].str.contains("format").all()
    good = table[(table["model"] == "rough") & (table["status"] == "fitted")]
    assert np.allclose(good["rho"], [0.2, 0.4, 0.6, 0.8]) and np.allclose(good["sigma"], 0.3)
    one = gn.fit(folder / "m1.json", gn.Lambertian())
    row = table[(table["material"] == "m1.json") & (table["model"] == "matt")].iloc[0]
    assert (row["rho"], row["rho.stderr"]) == (one.values[0], one.stderr["rho"])
    assert (row["rms"], row["aic"], row["bic"], row["values"]) == (one.rms, one.aic, one.bic, one.used)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_resumed_run_computes_nothing_twice(folder, tmp_path, suffix, monkeypatch):
    output, asked = tmp_path / f"fits.{suffix}", []
    original = many._rows
    monkeypatch.setattr(many, "_rows", lambda job: asked.append((job.name, *job.models)) or original(job))
    first = gn.fitting.fit_many(folder, {"matt": MODELS["matt"]}, output=output)
    assert len(asked) == 5 and not output.with_name(output.name + ".unfinished").exists()
    again = gn.fitting.fit_many(folder, {"matt": MODELS["matt"]}, output=output)
    assert len(asked) == 5
    pandas.testing.assert_frame_equal(first, again, check_exact=True)
    more = gn.fitting.fit_many(folder, MODELS, output=output)
    assert len(asked) == 10 and all(models == ("rough",) for _, *models in asked[5:] for models in [tuple(models)])
    assert list(more[more["model"] == "matt"]["rho"].dropna()) == list(first["rho"].dropna())
    for k in range(3):  # the same numbers, written again, and what cannot be read: other bytes of it
        os.utime(folder / f"m{k}.json", (1.0, 1.0))
    (folder / "bad.json").write_text("[]")
    gn.fitting.fit_many(folder, MODELS, output=output)
    assert asked[10:] == [("bad.json", "matt", "rough")]


def test_rows_of_others_stay(tmp_path):
    """As does the journal of a run that was killed: what took long is neither replaced nor removed."""
    output, journal = tmp_path / "fits.csv", tmp_path / "fits.csv.unfinished"
    sources = {"a": gn.OrenNayar(0.3, 0.2), "b": gn.OrenNayar(0.5, 0.2)}

    def stop(done, total):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gn.fitting.fit_many(sources, {"rough": gn.OrenNayar()}, output=output, progress=stop)
    assert journal.exists() and not output.exists()
    own = gn.fitting.fit_many({"a": sources["a"]}, {"matt": gn.Lambertian()}, output=output)
    assert list(own["model"]) == ["matt"]
    held = pandas.read_csv(output)
    assert not journal.exists() and list(held["model"])[:1] == ["matt"] and {*held["model"]} == {"matt", "rough"}
    counts = []
    gn.fitting.fit_many(
        sources, {"rough": gn.OrenNayar()}, output=output, progress=lambda done, total: counts.append(done)
    )
    assert counts[0] > 0 and len(pandas.read_csv(output)) == 3


@pytest.mark.parametrize("kept", ["table", "journal"])
def test_a_fit_to_other_data_is_not_replaced(tmp_path, kept):
    output = tmp_path / "fits.csv"
    gn.fitting.fit_many({"a": gn.Lambertian(0.3)}, {"matt": gn.Lambertian()}, output=output)
    if kept == "journal":
        row = fit_table._read(output)[0]
        output.rename(tmp_path / "fits.csv.unfinished").write_text(json.dumps([row]) + "\n")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for change in ({}, {"loss": "log"}, {"theta_max": 1.0}):
        source = gn.Lambertian(0.3) if change else gn.Lambertian(0.4)
        with pytest.raises(gn.errors.ParameterError, match="holds a fit of a by matt to other data"):
            gn.fitting.fit_many({"a": source}, {"matt": gn.Lambertian()}, output=output, **change)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_table_in_a_model_counts_by_its_numbers(tmp_path):
    """`load('t.json')` says nothing of them: a second call gave the fits with the first's."""
    output, path = tmp_path / "fits.csv", tmp_path / "t.nc"
    axes = {"theta_i": [0.0, 1.0], "theta_o": [0.0, 1.0], "phi": [0.0, np.pi]}

    def fitted(output):
        model = {"on": gn.Lambertian() + gn.load(path)}
        return gn.fitting.fit_many({"a": gn.Lambertian(0.8)}, model, output=output)["0.rho"][0]

    gn.save(gn.Gridded("angles", axes, np.full((2, 2, 2), 0.05)), path)
    first = fitted(output)
    gn.save(gn.Gridded("angles", axes, np.full((2, 2, 2), 0.2)), path)
    with pytest.raises(gn.errors.ParameterError, match="by another model of that name"):
        fitted(output)
    assert abs(fitted(None) - first) > 0.1


def test_models_that_look_alike_are_two():
    maps = [gn.Lambertian(np.full(65, x)) + gn.Lambertian(np.full(65, 0.1)) for x in (0.2, 0.3)]
    assert repr(maps[0]) == repr(maps[1])
    assert len(many._models(maps)) == 2


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '[{"key": "a"}]', "[1]", '{"a": 1}', "null", "1" * 5000, "[[]]", "\x00"]
)
def test_what_is_no_journal_is_left_alone(tmp_path, text):
    journal = tmp_path / "fits.csv.unfinished"
    journal.write_text(text + "\n")
    with pytest.raises(gn.errors.FormatError, match="is no journal of gonio"):
        gn.fitting.fit_many({"a": gn.Lambertian(0.3)}, {"matt": gn.Lambertian()}, output=tmp_path / "fits.csv")
    assert journal.read_text() == text + "\n"


def test_a_file_that_changes_while_it_is_fitted_is_fitted_by_the_next_run(tmp_path, monkeypatch):
    path, output = tmp_path / "m.json", tmp_path / "fits.csv"
    gn.save(gn.Lambertian(0.3), path)
    original = many._rows

    def late(job):
        gn.save(gn.Lambertian(0.4), path)
        return original(job)

    monkeypatch.setattr(many, "_rows", late)
    row = gn.fitting.fit_many([path], {"matt": gn.Lambertian()}, output=output).iloc[0]
    assert row["status"] == "failed" and "changed after the run began" in row["error"]
    monkeypatch.setattr(many, "_rows", original)
    assert round(gn.fitting.fit_many([path], {"matt": gn.Lambertian()}, output=output)["rho"][0], 6) == 0.4


def test_a_stopped_run_goes_on(folder, tmp_path):
    output = tmp_path / "fits.csv"

    def stop(done, total):
        if done >= 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gn.fitting.fit_many(folder, MODELS, output=output, progress=stop)
    journal = output.with_name("fits.csv.unfinished")
    kept = [row for line in journal.read_bytes().splitlines() for row in json.loads(line)]
    assert len(kept) >= 4 and not output.exists()
    with journal.open("ab") as file:
        file.write(b'[{"key": "cut o')
    counts = []
    table = gn.fitting.fit_many(folder, MODELS, output=output, progress=lambda done, total: counts.append(done))
    assert counts[0] == len(kept) and counts[-1] == 10 and not journal.exists()
    assert len(table) == 10 and table["seconds"].between(0.0, 60.0).all()


def test_a_file_of_others_is_left_alone(folder, tmp_path):
    output = tmp_path / "mine.csv"
    output.write_text("a,b\n1,2\n")
    with pytest.raises(gn.errors.FormatError, match="no table of fits"):
        gn.fitting.fit_many(folder, MODELS, output=output)
    assert output.read_text() == "a,b\n1,2\n"
    with pytest.raises(gn.errors.ParameterError, match=r"expected \.parquet or \.csv"):
        gn.fitting.fit_many(folder, MODELS, output=tmp_path / "fits.txt")


def test_without_pyarrow_csv_is_advised(folder, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(gn.errors.DependencyError, match=r'pip install "gonio\[fit\]"'):
        gn.fitting.fit_many(folder, MODELS, output=tmp_path / "fits.parquet")


def test_wrong_schedulers_are_refused(folder):
    with pytest.raises(gn.errors.ParameterError, match="expected None for threads"):
        gn.fitting.fit_many(folder, MODELS, scheduler="two")


JOB = "(__import__('time').sleep(0.05), __import__('os').getpid(), dict(__import__('os').environ))"
"""An expression: a worker that has imported nothing yet evaluates it."""


@pytest.mark.slow_because("the fits run in processes of their own, one of which is killed")
@pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.full)])
def test_processes_give_the_same_and_survive_a_kill(folder, count):
    here = gn.fitting.fit_many(folder, MODELS)
    with workers(f"processes:{count}") as crew:
        after, killed = [], 0
        for number, result, error in crew.results(eval, [JOB + k * " " for k in range(8)]):
            assert error is None
            after.append((number, *result))
            if not killed:
                os.kill(killed := result[1], signal.SIGKILL)
        assert sorted(number for number, *_ in after) == list(range(8)) and after[-1][2] != killed
        assert {name: str(value) for name, value in ENVIRONMENT.items()}.items() <= after[-1][3].items()
        table = gn.fitting.fit_many(folder, MODELS, scheduler=crew.executor)
    kept = [name for name in here.columns if name != "seconds"]
    # workers have one thread for linear algebra each, which rounds sums differently from several
    pandas.testing.assert_frame_equal(here[kept], table[kept], rtol=1e-12, atol=1e-15)
    for pid in {pid for _, _, pid, _ in after}:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


@pytest.mark.full
@pytest.mark.filterwarnings("ignore::ResourceWarning")  # of Dask, when its cluster ends
def test_a_client_of_dask_computes_too(folder):
    distributed = pytest.importorskip("distributed")
    here = gn.fitting.fit_many(folder, {"matt": MODELS["matt"]})
    with distributed.Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        there = gn.fitting.fit_many(folder, {"matt": MODELS["matt"]}, scheduler=client)
    assert np.allclose(here["rho"], there["rho"], rtol=1e-12, equal_nan=True)


def test_the_folder_of_the_command_line(folder, tmp_path):
    table, told = many.fit_folder(folder, ["Lambertian()"], tmp_path / "fits.csv")
    assert len(table) == 5 and told.endswith("5 rows, 4 fitted, 1 refused")


def test_folders_and_maps_on_the_command_line(folder, tmp_path, monkeypatch):
    from click.testing import CliRunner

    from gonio.cli.commands import cli

    xarray = pytest.importorskip("xarray")
    pytest.importorskip("zarr")
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke(cli, ["fit", "materials", "-o", "fits.csv", "-m", "Lambertian()"])
    assert run.exit_code == 0 and "5 rows, 4 fitted, 1 refused" in run.output and "bad.json" in run.output, run.output
    wi, wo = gn.direction([0.1, 0.5, 0.9], 0.0), gn.direction([0.3, 0.2, 0.1], 1.0)
    maps = {"f": (("y", "x", "observation"), np.full((4, 5, 3), 0.1))}
    maps |= {"wi": (("observation", "xyz"), wi), "wo": (("observation", "xyz"), wo)}
    xarray.Dataset(maps).to_zarr("map.zarr", consolidated=False)
    run = CliRunner().invoke(cli, ["fit", "map.zarr", "-o", "fits.zarr", "-m", "Lambertian()"])
    assert run.exit_code == 0 and "20 texels, 0 of them flagged" in run.output, run.output
    run = CliRunner().invoke(cli, ["fit", "materials", "-o", "out.zarr"])
    assert run.exit_code == 2 and "materials" in run.output
    run = CliRunner().invoke(cli, ["fit", "materials"])
    assert run.exit_code == 2 and "-o fits.parquet" in run.output
    run = CliRunner().invoke(cli, ["fit", "materials/m0.json", "--scheduler", "processes"])
    assert run.exit_code == 2 and "one material" in run.output
