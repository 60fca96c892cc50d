"""Many fits: tables and stores that go on where they stopped, in this process and on a cluster of processes."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest

import gonio as gn
from gonio.fitting import many, map_store
from gonio.fitting.cluster import each

pandas = pytest.importorskip("pandas")
MODELS = {"matt": gn.Lambertian(), "glossy": gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick())}
quiet = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore:.*:DeprecationWarning", "ignore:.*:FutureWarning")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "in").mkdir()
    for k, rho in enumerate((0.2, 0.5, 0.8)):
        gn.save(gn.tabulate(gn.Lambertian(rho), "angles", resolution=(4, 4, 5)), tmp_path / "in" / f"{k}.csv")
    (tmp_path / "in" / "broken.csv").write_text("# gonio measurement\nnothing here\n")
    return tmp_path


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_row_for_each_pair_and_errors_are_rows(folder, suffix):
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    output = folder / f"fits{suffix}"
    table = gn.fit_many(folder / "in", MODELS, output)
    assert len(table) == 8 and not Path(f"{output}.parts").exists()
    good = table[(table.error == "") & (table.model == "matt")]
    assert list(good["rho"].round(6)) == [0.2, 0.5, 0.8] and (good["rho u"] < 1e-6).all()
    assert (table[table.material == "broken.csv"].error != "").all()
    read = pandas.read_parquet(output) if suffix == ".parquet" else pandas.read_csv(output)
    assert list(read.columns) == list(table.columns) and len(read) == 8
    assert gn.expression(read.expression[1]).terms


def counted(monkeypatch):
    calls = []
    real = many._rows
    monkeypatch.setattr(many, "_rows", lambda job: calls.append(job.name) or real(job))
    return calls


def test_a_repeated_run_computes_what_is_new(folder, monkeypatch):
    calls, output = counted(monkeypatch), folder / "fits.csv"
    first = gn.fit_many(folder / "in", MODELS, output)
    assert len(calls) == 4
    gn.save(gn.tabulate(gn.Lambertian(0.6), "angles", resolution=(4, 4, 5)), folder / "in" / "new.csv")
    second = gn.fit_many(folder / "in", MODELS, output)
    assert calls[4:] == ["new.csv"] and len(second) == 10
    assert np.allclose(
        second[second.material == "1.csv"]["rho"].dropna(), first[first.material == "1.csv"]["rho"].dropna()
    )
    gn.fit_many(folder / "in", MODELS["matt"], output)  # other models
    assert len(calls) == 10


def test_a_killed_run_goes_on(folder, monkeypatch):
    output, done = folder / "fits.csv", []
    real = many._rows

    def rows(job):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(job.name)
        return real(job)

    monkeypatch.setattr(many, "_rows", rows)
    with pytest.raises(KeyboardInterrupt):
        gn.fit_many(folder / "in", MODELS, output)
    assert not output.exists() and len(list(Path(f"{output}.parts").glob("*.json"))) == 2
    monkeypatch.setattr(many, "_rows", lambda job: done.append(job.name) or real(job))
    assert len(gn.fit_many(folder / "in", MODELS, output)) == 8
    assert len(done) == 4 and output.exists()


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("nowhere", gn.Lambertian()), "no such folder"),
        ((gn.Lambertian(), gn.Lambertian()), "one material"),
        ((3, gn.Lambertian()), "expected a folder"),
        (([], gn.Lambertian()), "expected a folder"),
        (({"a": gn.Lambertian()}, 3), "expected a model"),
        (({"a": gn.Lambertian()}, "every"), "expected one of"),
        (({"a": gn.Lambertian()}, gn.Lambertian(), "fits.txt"), "ends in"),
    ],
)
def test_bad_arguments_are_refused(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(gn.Error, match=words):
        gn.fit_many(*arguments)


def test_schedulers_that_are_none_are_refused():
    pytest.importorskip("distributed")
    with pytest.raises(gn.Error, match="expected None"):
        gn.fit_many({"a": gn.Lambertian()}, gn.Lambertian(), scheduler="threads")


def killing(job):
    """Ends its process the first time it is called for a path."""
    number, path = job
    if number == 3 and not os.path.exists(path):
        Path(path).write_text("once")
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


@quiet
def test_a_cluster_of_processes(folder):
    pytest.importorskip("distributed")
    table = gn.fit_many(folder / "in", MODELS, folder / "fits.csv", scheduler="processes")
    here = gn.fit_many(folder / "in", MODELS)
    assert np.allclose(table["rho"].fillna(0.0), here["rho"].fillna(0.0)) and (table.error == here.error).all()
    once = str(folder / "once")
    found = {job[0]: result for job, result, error in each(killing, [(k, once) for k in range(8)], "processes")}
    assert found == {k: k * k for k in range(8)} and os.path.exists(once)


def store(path, shape=(20, 12), coloured=False):
    xarray, zarr = pytest.importorskip("xarray"), pytest.importorskip("zarr")
    random = np.random.default_rng(0)
    wi = gn.direction(np.linspace(0.1, 1.2, 10), np.linspace(0.0, 3.0, 10))
    wo = gn.direction(np.full(10, 0.3), np.full(10, 1.0))
    rho = random.uniform(0.1, 0.9, (*shape, 1, 3) if coloured else (*shape, 1, 1))
    f = gn.Lambertian(rho).f(wi, wo)
    dims = ("y", "x", "observation", "channel") if coloured else ("y", "x", "observation")
    f = f if coloured else f[..., 0]
    maps = {"f": (dims, f), "wi": (("observation", "xyz"), wi), "wo": (("observation", "xyz"), wo)}
    xarray.Dataset(maps).to_zarr(path, consolidated=False, encoding={"f": {"chunks": (5, *f.shape[1:])}})
    assert zarr.__version__
    return rho[:, :, 0]


@quiet
@pytest.mark.parametrize("coloured", [False, True])
def test_stores_are_fitted_tile_by_tile(tmp_path, coloured):
    rho = store(tmp_path / "map.zarr", coloured=coloured)
    calls = []
    found = gn.fit_map_store(
        tmp_path / "map.zarr",
        gn.Lambertian(),
        tmp_path / "fits.zarr",
        tile=(5, 12),
        progress=lambda done, of: calls.append((done, of)),
    )
    names = [f"rho[{c}]" for c in range(3)] if coloured else ["rho"]
    assert np.allclose(np.stack([found[name].values for name in names], -1), rho, rtol=1e-5)
    assert found["rms"].dims == ("y", "x") and (found["used"] == (30 if coloured else 10)).all()
    assert calls == [(k, 4) for k in range(1, 5)] and found.attrs["loss"] == "plain"


@quiet
def test_a_store_goes_on_where_it_stopped(tmp_path, monkeypatch):
    rho = store(tmp_path / "map.zarr")
    real, done = map_store._fit_tile, []

    def fit(job):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(job.number)
        real(job)

    arguments = (tmp_path / "map.zarr", gn.Lambertian(), tmp_path / "fits.zarr")
    monkeypatch.setattr(map_store, "_fit_tile", fit)
    with pytest.raises(KeyboardInterrupt):
        gn.fit_map_store(*arguments, tile=(5, 12))
    monkeypatch.setattr(map_store, "_fit_tile", lambda job: done.append(job.number) or real(job))
    found = gn.fit_map_store(*arguments, tile=(5, 12))
    assert done == [0, 1, 2, 3] and np.allclose(found["rho"].values, rho[..., 0], rtol=1e-5)
    with pytest.raises(gn.Error, match="something else"):
        gn.fit_map_store(*arguments, "log", tile=(5, 12))


@quiet
def test_a_store_on_a_cluster(tmp_path):
    pytest.importorskip("distributed")
    rho = store(tmp_path / "map.zarr")
    found = gn.fit_map_store(
        tmp_path / "map.zarr", gn.Lambertian(), tmp_path / "fits.zarr", tile=(5, 12), scheduler="processes"
    )
    assert np.allclose(found["rho"].values, rho[..., 0], rtol=1e-5)


@quiet
def test_stores_that_hold_something_else_are_refused(tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("zarr")
    with pytest.raises(gn.Error, match="no such store"):
        gn.fit_map_store(tmp_path / "nothing.zarr", gn.Lambertian(), tmp_path / "fits.zarr")
    xarray.Dataset({"g": ("x", np.ones(3))}).to_zarr(tmp_path / "other.zarr", consolidated=False)
    with pytest.raises(gn.Error, match="has no f, wi, wo"):
        gn.fit_map_store(tmp_path / "other.zarr", gn.Lambertian(), tmp_path / "fits.zarr")
    wi = ("observation", "xyz"), np.ones((3, 3)) / np.sqrt(3.0)
    for dims, words in ((("y", "x"), "expected \\(..., observation\\)"), (("observation",), "expected a map")):
        maps = {"f": (dims, np.ones((2, 3)[-len(dims) :])), "wi": wi, "wo": wi}
        xarray.Dataset(maps).to_zarr(tmp_path / f"{len(dims)}.zarr", consolidated=False)
        with pytest.raises(gn.Error, match=words):
            gn.fit_map_store(tmp_path / f"{len(dims)}.zarr", gn.Lambertian(), tmp_path / "fits.zarr")
    store(tmp_path / "map.zarr")
    with pytest.raises(gn.Error, match="expected 2 lengths"):
        gn.fit_map_store(tmp_path / "map.zarr", gn.Lambertian(), tmp_path / "fits.zarr", tile=(5,))
    (tmp_path / "fits.zarr").mkdir()
    (tmp_path / "fits.zarr" / "note.txt").write_text("keep")
    with pytest.raises(gn.Error, match="something else"):
        gn.fit_map_store(tmp_path / "map.zarr", gn.Lambertian(), tmp_path / "fits.zarr")
    assert (tmp_path / "fits.zarr" / "note.txt").read_text() == "keep"


def test_rows_are_json(folder):
    job = many._job("a", gn.Lambertian(0.3), MODELS, {"loss": None, "per_channel": None, "theta_max": 1.5})
    assert json.loads(json.dumps(many._rows(job)))[0]["rho"] == pytest.approx(0.3)


@quiet
def test_folders_and_maps_on_the_command_line(folder, monkeypatch):
    from click.testing import CliRunner

    from gonio.cli.commands import cli

    monkeypatch.chdir(folder)
    store("map.zarr")
    run = CliRunner().invoke(cli, ["fit", "in", "-o", "fits.csv", "-m", "Lambertian()"])
    assert run.exit_code == 0 and "4 fits, 1 without a result" in run.output and "broken.csv" in run.output, run.output
    run = CliRunner().invoke(cli, ["fit", "map.zarr", "-o", "fits.zarr", "-m", "Lambertian()"])
    assert run.exit_code == 0 and "240 texels, 0 of them flagged" in run.output, run.output
    run = CliRunner().invoke(cli, ["fit", "in"])
    assert run.exit_code == 2 and "-o fits.parquet" in run.output
    run = CliRunner().invoke(cli, ["fit", "in/0.csv", "--scheduler", "processes"])
    assert run.exit_code == 2 and "one material" in run.output
