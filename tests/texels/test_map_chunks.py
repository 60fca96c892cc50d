"""`gn.fit_map_chunks`: what `fit_map` gives, chunk by chunk, from store to store; stopped runs go on."""

from __future__ import annotations

import pickle
from concurrent.futures import Executor, Future
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest
import xarray

import gonio as gn
from gonio.texels import map_chunks

pytestmark = [
    pytest.mark.skipif(find_spec(name) is None, reason=f"{name} is not installed") for name in ("dask", "zarr")
]

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
    return wi, wo, opened, gn.fit_map(wi, wo, f, gn.OrenNayar())


def same(found, whole):
    for name in whole.values:
        assert np.array_equal(found[name], whole.values[name], equal_nan=True)
        assert np.array_equal(found[f"{name}.stderr"], whole.stderr[name], equal_nan=True)
    for name in NAMES:
        assert np.array_equal(found[name], getattr(whole, name), equal_nan=True)


def test_without_output_nothing_is_computed_yet(scan):
    wi, wo, f, whole = scan
    found = gn.fit_map_chunks(wi, wo, f.transpose("observation", "y", "x"), gn.OrenNayar())
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
    found = gn.fit_map_chunks(
        wi, wo, f, gn.OrenNayar(), output=tmp_path / "out.zarr", scheduler=scheduler,
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
    before = gn.threads()
    try:
        gn.threads(1)
        with pytest.raises(OSError, match="the machine stops"):
            gn.fit_map_chunks(wi, wo, f, gn.OrenNayar(), output=tmp_path / "out.zarr")
        first, done[:] = list(done), []
        monkeypatch.setattr(map_chunks, "_fit_chunk", lambda job: (original(job), done.append(job[1])))
        same(gn.fit_map_chunks(wi, wo, f, gn.OrenNayar(), output=tmp_path / "out.zarr"), whole)
    finally:
        gn.threads(before)
    assert len(first) == 3 and len(done) == 3 and not {*first} & {*done}
    with pytest.raises(gn.errors.ParameterError, match="another model"):
        gn.fit_map_chunks(wi, wo, f, gn.Lambertian(), output=tmp_path / "out.zarr")


def test_numbers_are_not_sent(scan, tmp_path, monkeypatch):
    wi, wo, f, _ = scan
    work = map_chunks._Map(wi, wo, f, None, "observation", (gn.OrenNayar(), "plain", None, None))
    assert len(work.job(tmp_path / "out.zarr", (0, 0), True)) < 10_000
    monkeypatch.setattr(map_chunks, "MOST_SENT", 3000)
    loaded = f.load().chunk(y=10, x=7)
    work = map_chunks._Map(wi, wo, loaded, None, "observation", (gn.OrenNayar(), "plain", None, None))
    with pytest.raises(gn.errors.ParameterError, match="write them to a Zarr store"):
        work.job(tmp_path / "out.zarr", (0, 0), True)


def test_channels_and_directions_by_texel(scan):
    wi, wo, f, _ = scan
    f = f.load()
    bright = xarray.concat([f, 0.5 * f], "band")
    by_texel = xarray.DataArray(np.broadcast_to(wi, (7, 6, 3)), dims=("x", "observation", "xyz"))
    whole = gn.fit_map(wi, wo, np.moveaxis(bright.values, 0, -1), gn.OrenNayar(), coloured=True)
    same(gn.fit_map_chunks(by_texel, wo, bright.chunk(y=5), gn.OrenNayar()).compute(), whole)
