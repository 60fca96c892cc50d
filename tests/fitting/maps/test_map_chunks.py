"""`gn.fitting.fit_map_chunks`: what `fit_map` gives, chunk by chunk, from store to store; stopped runs go on."""

from __future__ import annotations

import errno
import importlib.util
import os
import pickle
import signal
import time
import warnings
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest
import xarray
from places import ROOT

import gonio as gn
from gonio.files._unfinished import held
from gonio.fitting.maps import map_chunks
from gonio.fitting.maps.texel_data import TexelValues

pytestmark = [
    pytest.mark.skipif(find_spec(name) is None, reason=f"{name} is not installed") for name in ("dask", "zarr")
]

zarr = pytest.importorskip("zarr")
NAMES = ["rms", "used", "flags"]


@pytest.fixture
def scan(tmp_path):
    wi = gn.direction([0.1, 0.5, 0.9, 1.2, 0.7, 0.3], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    wo = gn.direction([0.6, 0.2, 0.4, 0.8, 0.1, 1.0], [0.5, 2.0, 1.0, 3.5, 0.0, 2.0])
    rho = np.random.default_rng(0).uniform(0.1, 0.9, (10, 7))
    f = gn.OrenNayar(rho[..., None, None], 0.4).f(wi, wo)[..., 0]
    f[0, 0, 1:] = np.nan
    data = xarray.DataArray(f, dims=("y", "x", "observation"), coords={"y": np.arange(10.0)}, name="f")
    data.chunk(y=4, x=4).to_dataset().to_zarr(tmp_path / "scan.zarr", consolidated=False)
    opened = xarray.open_zarr(tmp_path / "scan.zarr", consolidated=False)["f"]
    return wi, wo, opened, gn.fitting.fit_map((wi, wo, f), gn.OrenNayar())


def same(found, whole):
    for name in whole.values:
        assert np.array_equal(found[name], whole.values[name], equal_nan=True)
        assert np.array_equal(found[f"{name}.stderr"], whole.stderr[name], equal_nan=True)
    for name in NAMES:
        assert np.array_equal(found[name], getattr(whole, name), equal_nan=True)


def test_without_output_nothing_is_computed_yet(scan):
    wi, wo, f, whole = scan
    found = gn.fitting.fit_map_chunks((wi, wo, f.transpose("observation", "y", "x")), gn.OrenNayar())
    assert found["rho"].chunks == ((4, 4, 2), (4, 3)) and found["flags"].dtype == np.uint8
    same(found.compute(scheduler="synchronous"), whole)


class _Sent(Executor):
    """Calls at once what pickle makes of a function and its arguments, as another process gets them."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future:
        future: Future = Future()
        work, given, named = pickle.loads(pickle.dumps((fn, args, kwargs)))
        future.set_result(work(*given, **named))
        return future


@pytest.mark.parametrize(
    "scheduler",
    [None, _Sent(), pytest.param("processes:1", marks=pytest.mark.full)],
    ids=["threads", "sent", "processes"],
)
def test_from_store_to_store(scan, tmp_path, scheduler):
    wi, wo, f, whole = scan
    counts = []
    found = gn.fitting.fit_map_chunks(
        (wi, wo, f), gn.OrenNayar(), output=tmp_path / "out.zarr", scheduler=scheduler,
        progress=lambda done, total: counts.append((done, total)),
    )  # fmt: skip
    same(found, whole)
    assert counts[0] == (0, 70) and counts[-1] == (70, 70) and found["y"].values[3] == 3.0


def test_a_stopped_run_goes_on(scan, tmp_path, monkeypatch):
    wi, wo, f, whole = scan
    done, original = [], map_chunks._fit_chunk

    def counted(job):
        if len(done) == 3:
            raise OSError("the machine stops")
        original(job)
        done.append(job[1])

    monkeypatch.setattr(map_chunks, "_fit_chunk", counted)
    before = gn.engine.threads()
    try:
        gn.engine.threads(1)
        with pytest.raises(OSError, match="the machine stops"):
            gn.fitting.fit_map_chunks((wi, wo, f), gn.OrenNayar(), output=tmp_path / "out.zarr")
        first, done[:] = list(done), []
        monkeypatch.setattr(map_chunks, "_fit_chunk", lambda job: (original(job), done.append(job[1])))
        same(gn.fitting.fit_map_chunks((wi, wo, f), gn.OrenNayar(), output=tmp_path / "out.zarr"), whole)
    finally:
        gn.engine.threads(before)
    assert len(first) == 3 and len(done) == 3 and not {*first} & {*done}
    with pytest.raises(gn.errors.ParameterError, match="another model"):
        gn.fitting.fit_map_chunks((wi, wo, f), gn.Lambertian(), output=tmp_path / "out.zarr")


def fitted(folder, f, wi, wo, model=None, u=None, **options):
    return gn.fitting.fit_map_chunks((wi, wo, f, u), model or gn.OrenNayar(), output=folder / "out.zarr", **options)


@pytest.fixture
def counted(monkeypatch):
    """The chunks that are fitted, as they are."""
    done, original = [], map_chunks._fit_chunk
    monkeypatch.setattr(map_chunks, "_fit_chunk", lambda job: (done.append(job[1]), original(job)))
    return done


def test_a_store_of_other_numbers_is_refused_and_left_as_it_is(scan, tmp_path, counted):
    """One number of f, u or a direction by texel, in its last digit: the fits of the first were given back."""
    wi, wo, f, _ = scan
    f = f.load()
    u = xarray.full_like(f, 0.01)
    by_texel = xarray.DataArray(np.tile(wi, (7, 1, 1)), dims=("x", "observation", "xyz"))
    given = {"f": f, "wi": by_texel, "wo": wo, "loss": "likelihood", "u": u}
    fitted(tmp_path, **given)
    before = {p: p.read_bytes() for p in (tmp_path / "out.zarr").rglob("*") if p.is_file()}
    counted.clear()
    for name, at in (("f", (9, 6, 5)), ("u", (0, 0, 3)), ("wi", (3, 2, 0)), ("wo", (5, 1))):
        other = given[name].copy()
        (other if name == "wo" else other.values)[at] = np.nextafter(np.asarray(other)[at], 1.0)
        with pytest.raises(gn.errors.ParameterError, match=r"out\.zarr: holds fits of"):
            fitted(tmp_path, **{**given, name: other})
    fitted(tmp_path, **{n: x.copy() if hasattr(x, "copy") else x for n, x in given.items()})
    assert not counted and before == {p: p.read_bytes() for p in before}


def test_lost_and_damaged_chunks_are_fitted_again(scan, tmp_path, counted):
    wi, wo, f, whole = scan
    fitted(tmp_path, f, wi, wo)
    store = tmp_path / "out.zarr"
    chunk = store / "rho" / "c" / "0" / "0"
    damage = {
        "lost": lambda: chunk.unlink(),
        "cut": lambda: chunk.write_bytes(chunk.read_bytes()[:-9]),
        "a bit": lambda: chunk.write_bytes(bytes([*(old := chunk.read_bytes())[:20], old[20] ^ 1, *old[21:]])),
        "its mark": lambda: (store / "done" / "c" / "0" / "0" / "0").write_bytes(b"?"),
    }
    for act in damage.values():
        counted.clear()
        act()
        fitted(tmp_path, f, wi, wo)
        assert counted == [(0, 0)]
    counted.clear()
    for name in ("rms/zarr.json", "flags/zarr.json"):
        (store / name).write_text("{") if name[0] == "f" else (store / name).unlink()
    same(fitted(tmp_path, f, wi, wo), whole)
    assert not counted


def test_runs_that_start_together_fit_each_chunk_once(scan, tmp_path, counted):
    wi, wo, f, whole = scan
    with warnings.catch_warnings(), ThreadPoolExecutor(3) as pool:
        warnings.simplefilter("ignore", gn.errors.WaitingWarning)  # two of them wait
        for found in [pool.submit(fitted, tmp_path, f, wi, wo) for _ in range(3)]:
            same(found.result(), whole)
    assert len(counted) == len({*counted}) == 6
    assert sorted(x.name for x in tmp_path.iterdir()) == ["out.zarr", "scan.zarr"]


def test_who_holds_a_file_and_is_killed_holds_it_no_more(tmp_path):
    """Not even where a process that it forked lives on."""
    path = tmp_path / "lock"
    ready, tell = os.pipe()
    pid = os.fork()
    if not pid:
        with held(path):
            if not os.fork():
                time.sleep(20.0)
                os._exit(0)
            os.write(tell, b"x")
            time.sleep(20.0)
    os.read(ready, 1)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    with held(path) as file:
        assert file.name == str(path)
    assert not path.exists()


def test_a_full_disk_is_one_error_and_the_next_run_goes_on(scan, tmp_path, monkeypatch):
    wi, wo, f, whole = scan
    real = zarr.Array.__setitem__

    def full(array, place, numbers):
        if array.name.endswith("flags"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(array, place, numbers)

    with monkeypatch.context() as patched:
        patched.setattr(zarr.Array, "__setitem__", full)
        with pytest.raises(gn.errors.WriteError, match=r"out\.zarr: cannot be written: No space left on device; make"):
            fitted(tmp_path, f, wi, wo)
    same(fitted(tmp_path, f, wi, wo), whole)


CHANGES = ROOT / "benchmarks" / "stores.py"


@pytest.mark.full
@pytest.mark.parametrize("count", [100])
def test_stores_tell_changes_apart_and_resume_what_is_the_same(count, tmp_path):
    """Of data, uncertainties, directions, tables, textures, numbers of models, options and versions."""
    spec = importlib.util.spec_from_file_location("stores", CHANGES)
    assert spec is not None and spec.loader is not None
    stores = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(stores)
    found = stores.campaign(tmp_path, count)
    assert found == {"told apart": count, "resumed": count}


def test_numbers_are_not_sent(scan, tmp_path, monkeypatch):
    wi, wo, f, _ = scan
    work = map_chunks._Map(TexelValues(wi, wo, f), "observation", (gn.OrenNayar(), "plain", None, None))
    assert len(work.job(work.store(tmp_path / "out.zarr"), (0, 0), True)) < 10_000
    monkeypatch.setattr(map_chunks, "MOST_SENT", 3000)
    loaded = f.load().chunk(y=10, x=7)
    work = map_chunks._Map(TexelValues(wi, wo, loaded), "observation", (gn.OrenNayar(), "plain", None, None))
    with pytest.raises(gn.errors.ParameterError, match="write them to a Zarr store"):
        work.job(work.store(tmp_path / "out.zarr"), (0, 0), True)


def test_channels_and_directions_by_texel(scan):
    wi, wo, f, _ = scan
    f = f.load()
    bright = xarray.concat([f, 0.5 * f], "band")
    by_texel = xarray.DataArray(np.broadcast_to(wi, (7, 6, 3)), dims=("x", "observation", "xyz"))
    whole = gn.fitting.fit_map((wi, wo, np.moveaxis(bright.values, 0, -1)), gn.OrenNayar(), coloured=True)
    same(gn.fitting.fit_map_chunks((by_texel, wo, bright.chunk(y=5)), gn.OrenNayar()).compute(), whole)
