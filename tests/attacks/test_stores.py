"""Zarr stores and netCDF files: lost data is never read as numbers, small files take little, and errors come alone."""

from __future__ import annotations

import gzip
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import warnings
import zipfile
import zlib
from itertools import product
from multiprocessing import spawn
from pathlib import Path

import h5py
import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.errors import DependencyError, FormatError
from gonio.formats import neural
from gonio.formats._reading import hdf, hdf_probe

SOURCE = Path(gn.__file__).parents[1]
ZEROS = zlib.compress(bytes(1_000_000))


@pytest.fixture
def _zarr():
    pytest.importorskip("zarr")


stores = pytest.mark.usefixtures("_zarr")


def grid(values: np.ndarray | float = 0.5) -> gn.Gridded:
    axes = {"theta_i": [0.1, 0.2, 0.4], "theta_o": [0.0, 0.3], "phi": [0.0, 1.0, 2.0]}
    return gn.Gridded("angles", axes, np.broadcast_to(np.asarray(values, "f4"), (3, 2, 3)).copy())


def child(code: str) -> subprocess.CompletedProcess:
    """A Python of its own that runs this."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(SOURCE), *filter(None, sys.path)]), "GONIO_ENGINE": "numpy"}
    return subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=300, check=False
    )


def chunk_of_zstd(size: int) -> bytes:
    """A frame that does not say how long it was: blocks of 128 kB, each one byte that is repeated."""
    blocks = [(k == 0) | 1 << 1 | 1 << 20 for k in reversed(range(size >> 17))]
    return b"\x28\xb5\x2f\xfd\x00\x58" + b"".join(header.to_bytes(3, "little") + b"\0" for header in blocks)


@stores
@pytest.mark.parametrize("form", ["zarr", "zip"])
@pytest.mark.parametrize("codec", ["gzip", "zlib", "zstd", "twice"])
def test_a_chunk_unpacks_to_no_more_than_its_array_holds(form, codec, tmp_path):
    """Of 72 bytes of numbers: 50 MB in a chunk that does not say so."""
    store = tmp_path / "a.zarr"
    gn.save(grid(), store)
    packed = {"gzip": gzip.compress, "zlib": zlib.compress, "zstd": lambda zeros: chunk_of_zstd(len(zeros))}
    packed["twice"] = lambda zeros: zlib.compress(zlib.compress(zeros, 1), 1)
    array = json.loads((store / "values" / ".zarray").read_text())
    array |= {"compressor": {"id": codec.replace("twice", "zlib"), "level": 1}}
    array |= {"filters": [{"id": "zlib", "level": 1}]} if codec == "twice" else {}
    (store / "values" / ".zarray").write_text(json.dumps(array))
    (store / ".zmetadata").unlink()
    (chunk,) = (name for name in (store / "values").iterdir() if name.name[0] != ".")
    chunk.write_bytes(packed[codec](bytes(50_000_000)))
    path = store
    if form == "zip":
        path = tmp_path / "a.zip"
        with zipfile.ZipFile(path, "w") as file:
            for name in sorted(p for p in store.rglob("*") if p.is_file()):
                file.write(name, name.relative_to(store))
    with pytest.raises(FormatError, match=r"unpacks to|the last of them"):
        gn.load(path)


@stores
def test_stores_in_zip_files_are_packed_as_stores_are(tmp_path):
    gn.save(grid(), tmp_path / "a.zip")
    with zipfile.ZipFile(tmp_path / "a.zip") as old, zipfile.ZipFile(tmp_path / "b.zip", "w", zipfile.ZIP_BZIP2) as new:
        for name in old.namelist():
            new.writestr(name, old.read(name))
    with pytest.raises(FormatError, match="packed as no store is"):
        gn.load(tmp_path / "b.zip")


def foreign(path: Path, zarr_format: int, **encoding: object) -> Path:
    """The store that xarray writes of a measurement, with chunks of its own."""
    ds = gn.tables.to_dataset(grid(np.linspace(0.1, 0.9, 18).reshape(3, 2, 3)))
    chunked = {name: {"chunks": (1, 2, 2)} for name in ("values", "valid")}
    chunked["values"] |= encoding
    ds.to_zarr(path, zarr_format=zarr_format, consolidated=False, encoding=chunked, write_empty_chunks=True)
    return path


def chunks(path: Path, name: str) -> list[Path]:
    return sorted(p for p in (path / name).rglob("*") if p.is_file() and p.name[0] not in ".z")


def zipped(path: Path) -> Path:
    """The folder as a zip file."""
    made = path.with_suffix(".zip")
    with zipfile.ZipFile(made, "w") as packed:
        for file in sorted(p for p in path.rglob("*") if p.is_file()):
            packed.write(file, file.relative_to(path).as_posix())
    return made


@stores
@pytest.mark.parametrize(
    ("packed", "name", "zarr_format"),
    thinned(
        product([False, True], ["values", "valid", "theta_i"], ["own", 2, 3]),
        [
            (False, "theta_i", "own"),
            (False, "values", 2),
            (False, "theta_i", 3),
            (True, "values", 3),
            (True, "valid", "own"),
        ],
    ),
)
def test_a_lost_chunk_is_refused(zarr_format, name, packed, tmp_path):
    """It was read as zeros, f = 0 with valid 96 %, or as invalid everywhere. (D7)"""
    path = tmp_path / "m.zarr"
    if zarr_format == "own":
        gn.save(grid(), path)
    else:
        foreign(path, zarr_format, **({"fill_value": 0} if zarr_format == 3 else {"_FillValue": None}))
    gn.load(zipped(path) if packed else path)
    chunks(path, name)[-1].unlink()
    is_nan = zarr_format != "own" and name == "theta_i"
    says = "theta_i is" if is_nan else f"is not whole: {name} has .* chunks, expected"
    with pytest.raises(FormatError, match=says):
        gn.load(zipped(path) if packed else path)


@stores
@pytest.mark.parametrize("zarr_format", [2, 3])
def test_a_chunk_that_is_nan_by_its_fill_value_is_a_hole(zarr_format, tmp_path):
    """Stores of others may leave such out: there is no value, and none is made up. An axis of NaN is refused. (D7)"""
    path = foreign(tmp_path / "m.zarr", zarr_format, _FillValue=np.nan)
    whole = gn.load(path).stored
    chunks(path, "values")[0].unlink()
    found = gn.load(path).stored
    assert np.isnan(found[0, :, :2]).all() and np.isnan(found).sum() == 4
    np.testing.assert_array_equal(found[~np.isnan(found)], whole[~np.isnan(found)])
    chunks(path, "theta_i")[0].unlink()
    with pytest.raises(FormatError, match=r"theta_i"):
        gn.load(path)


@stores
@pytest.mark.parametrize("name", ["m.zarr", "m.zip"])
def test_nothing_is_left_out_of_what_gonio_writes(name, tmp_path):
    """Not even chunks of zeros, which the library leaves out by itself. (D7)"""
    gn.save(grid(0.0), tmp_path / name)
    assert gn.load(tmp_path / name) == grid(0.0)


@stores
@pytest.mark.parametrize("separator", [".", "/"])
@pytest.mark.parametrize("zarr_format", [2, 3])
def test_chunks_are_found_by_either_separator(zarr_format, separator, tmp_path):
    """Zarr 2 with folders, and 3 without. (D7)"""
    import zarr

    ds = gn.tables.to_dataset(grid())
    group = zarr.open_group(tmp_path / "m.zarr", mode="w", zarr_format=zarr_format)
    coding = {"name": "default" if zarr_format == 3 else "v2", "separator": separator}
    more = {"write_empty_chunks": True}
    for name, variable in ds.variables.items():
        about = {"dimension_names": variable.dims} if zarr_format == 3 else {}
        made = group.create_array(
            name,
            shape=variable.shape,
            chunks=(2,) * variable.ndim,
            dtype=variable.dtype,
            chunk_key_encoding=coding,
            config=more,
            **about,
        )
        made[...] = variable.values
        made.attrs.update(variable.attrs | ({} if about else {"_ARRAY_DIMENSIONS": list(variable.dims)}))
    group.attrs.update(ds.attrs)
    if zarr_format == 3:  # where 0 is no missing value; see xarray, use_zarr_fill_value_as_mask
        assert gn.load(tmp_path / "m.zarr").stored.tolist() == grid().stored.tolist()
    chunks(tmp_path / "m.zarr", "valid")[0].unlink()
    with pytest.raises(FormatError, match="is not whole: valid has 3 chunks, expected 4"):
        gn.load(tmp_path / "m.zarr")


@stores
@pytest.mark.parametrize("what", ["pipe", "link", "device", "folder link"])
def test_a_chunk_that_is_no_file_is_refused(what, tmp_path):
    """A pipe hung. (D24)"""
    path = tmp_path / "m.zarr"
    gn.save(grid(), path)
    chunk = chunks(path, "values")[0]
    shutil.move(chunk, tmp_path / "chunk")
    if what == "pipe":
        os.mkfifo(chunk)
    elif what == "folder link":
        shutil.move(path / "values", tmp_path / "values")
        (path / "values").symlink_to(tmp_path / "values")
    else:
        chunk.symlink_to("/dev/zero" if what == "device" else tmp_path / "chunk")
    with pytest.raises(FormatError, match="is a link, a pipe or a device, expected a file"):
        gn.load(path)


@stores
@pytest.mark.parametrize(
    "name", thinned([".zattrs", ".zgroup", "values/.zattrs", "other/.zattrs"], [".zattrs", "other/.zattrs"])
)
def test_all_descriptions_are_bounded(name, tmp_path):
    """A zip file of 1 MB whose .zattrs has 1 GiB took 3.2 GB. (D14)"""
    gn.save(grid(), tmp_path / "m.zip")
    with (
        zipfile.ZipFile(tmp_path / "m.zip") as old,
        zipfile.ZipFile(tmp_path / "b.zip", "w", zipfile.ZIP_DEFLATED) as new,
    ):
        for entry in old.infolist():
            if entry.filename != name:
                new.writestr(entry.filename, old.read(entry))
        new.writestr(name, b'{"zarr_format": 2}' + b" " * (1 << 25))
    with pytest.raises(FormatError, match=r"has 33554450 bytes, expected a description of at most 16777216"):
        gn.load(tmp_path / "b.zip")


@stores
def test_many_descriptions_are_bounded_together(tmp_path):
    """Each of them is short enough. (D14)"""
    gn.save(grid(), tmp_path / "m.zip")
    with zipfile.ZipFile(tmp_path / "m.zip", "a", zipfile.ZIP_DEFLATED) as packed:
        for k in range(3):
            packed.writestr(f"other{k}/.zattrs", b"{}" + b" " * (7 << 20))
    with pytest.raises(FormatError, match="descriptions have"):
        gn.load(tmp_path / "m.zip")


@stores
def test_a_zip_has_no_name_that_a_store_would_not_find(tmp_path):
    """`values//0.0.0` would be counted as the chunk, and read as if there was none. (D7)"""
    gn.save(grid(), tmp_path / "m.zip")
    with zipfile.ZipFile(tmp_path / "m.zip") as old, zipfile.ZipFile(tmp_path / "b.zip", "w") as new:
        for entry in old.infolist():
            new.writestr(entry.filename.replace("values/0", "values//0"), old.read(entry))
    with pytest.raises(FormatError, match=r"values//0.0.0.* is a name that no store has"):
        gn.load(tmp_path / "b.zip")


BOUNDED = """
import resource, sys, gonio as gn
import xarray, h5netcdf, gonio.formats.xarray_netcdf
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + {room},) * 2)
for path in {paths}:
    try: print(gn.load(path).stored.shape)
    except gn.Error as error: print(error)
"""


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux' count of memory")
def test_arrays_that_nothing_needs_are_not_read(tmp_path):
    """A netCDF file of 282 kB with a further dataset of zeros took 2.5 GB, or was called damaged. (D14)

    Without a dimension it takes their names from others, so that the library pads them to its length.
    """
    paths = [tmp_path / "named.nc", tmp_path / "nameless.nc"]
    for path in paths:
        gn.save(grid(), path)
        with h5py.File(path, "a") as file:
            more = file.create_dataset("more", (200_000_000,), "i1", chunks=(1_000_000,), compression="gzip")
            for start in range(0, 200_000_000, 1_000_000):
                more.id.write_direct_chunk((start,), ZEROS)
            more.attrs["scale_factor"] = 0.5
            if path.name == "named.nc":
                more.make_scale("more")
        assert path.stat().st_size < 400_000
    done = child(BOUNDED.format(paths=[*map(str, paths)], room=600 << 20))
    named, nameless = done.stdout.splitlines() or [done.stderr, ""]
    assert named == "(3, 2, 3)" and "theta_i has a dimension without a name, expected those of" in nameless


@stores
def test_arrays_of_a_store_that_nothing_needs_are_not_read(tmp_path, monkeypatch):
    """The same in Zarr. (D14)"""
    import zarr

    path = tmp_path / "m.zarr"
    gn.save(grid(), path)
    made = zarr.open_group(path, mode="a", zarr_format=2).create_array("more", shape=(10**6,), dtype="i1")
    made[...] = 1
    made.attrs["_ARRAY_DIMENSIONS"] = ["more"]
    read = []
    real = zarr.Array.__getitem__
    monkeypatch.setattr(zarr.Array, "__getitem__", lambda self, at: (read.append(self.name), real(self, at))[1])
    assert gn.load(path) == grid()
    assert {name.strip("/") for name in read} == {"values", "valid", "theta_i", "theta_o", "phi"}


def test_what_gonio_wrote_is_never_damaged(tmp_path):
    """Zeros are packed 300 times: the time that reading may take goes by what they unpack to. (D16)"""
    path = tmp_path / "m.nc"
    axes = {"theta_i": np.linspace(0, 1.5, 100), "theta_o": np.linspace(0, 1.5, 100), "phi": np.linspace(0, 3.1, 200)}
    m = gn.Gridded("angles", axes, np.zeros((100, 100, 200, 3), "f4"), channels=("R", "G", "B"))
    gn.save(m, path)
    assert path.stat().st_size < 300_000
    assert gn.load(path).stored.shape == (100, 100, 200, 3)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not count what a process has")
def test_a_chunk_that_unpacks_to_more_than_it_says_is_refused(tmp_path):
    """A chunk of 100 numbers held 64 MB, and 105 kB of file took 140 MB: HDF5 unpacks all that there is."""
    path = tmp_path / "m.nc"
    with h5py.File(path, "w") as file:
        values = file.create_dataset("values", shape=(100,), dtype="u1", chunks=(100,), compression="gzip")
        values.id.write_direct_chunk((0,), zlib.compress(bytes(1 << 26)))
    with pytest.raises(gn.errors.FormatError, match="damaged"):
        hdf.inspected("hdf5", path, '[["values"], []]')


@pytest.mark.parametrize("total", [0, 192_000_000])
def test_the_time_to_read_follows_what_a_file_unpacks_to(total, monkeypatch):
    """By the packed size alone 192 MB of zeros had 0.8 s, and passed or failed by the machine. (D16)"""
    given = []
    monkeypatch.setattr(signal, "setitimer", lambda clock, seconds: given.append(seconds))
    hdf_probe._limit_time(586_000, total)
    assert given == [pytest.approx(0.7 + 0.12 + total / 1e7, abs=0.01)]


def test_whole_chunks_are_unpacked_once(tmp_path, monkeypatch):
    """One that is longer than what is read at a time was unpacked for every part of it. (D16)"""
    path = tmp_path / "m.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("values", data=np.zeros((40, 1000)), chunks=(40, 1000), compression="gzip")
    monkeypatch.setattr(hdf_probe, "AT_ONCE", 8000)
    for name in ("_limit_time", "_limit_memory"):
        monkeypatch.setattr(hdf_probe, name, lambda *_: None)
    parts = []
    real = h5py.Dataset.__getitem__
    monkeypatch.setattr(h5py.Dataset, "__getitem__", lambda self, at: (parts.append(at), real(self, at))[1])
    assert hdf_probe.main("hdf5", str(path), '[["values"], []]') == {"names": ["values"]}
    assert parts == [slice(0, 40)]


@pytest.mark.parametrize("executable", thinned(["", None, "/bin/false", "/nowhere/application"], [None, "/bin/false"]))
def test_netcdf_is_read_where_the_executable_is_not_python(executable, tmp_path, monkeypatch):
    """Embedded, every HDF5 file was "damaged", or there was a TypeError. (D16)"""
    gn.save(grid(), tmp_path / "m.nc")
    monkeypatch.setattr(sys, "executable", executable)
    monkeypatch.setattr(spawn, "get_executable", lambda: executable)
    monkeypatch.setattr(sys, "_base_executable", executable, raising=False)
    assert gn.load(tmp_path / "m.nc") == grid()


def test_without_any_python_the_error_says_so(tmp_path, monkeypatch):
    """And not that the file is damaged; no other program is run, which could be gonio's own. (D16)"""
    gn.save(grid(), tmp_path / "m.nc")
    ran = tmp_path / "ran"
    for name in ("application", "python-like"):
        (tmp_path / name).write_text(f"#!/bin/sh\necho {name} >> {ran}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "application"))
    monkeypatch.setattr(spawn, "get_executable", lambda: str(tmp_path / "python-like"))
    monkeypatch.setattr(sys, "_base_executable", None, raising=False)
    for home in ("exec_prefix", "base_exec_prefix"):
        monkeypatch.setattr(sys, home, str(tmp_path / "nowhere"))
    with pytest.raises(
        DependencyError, match=r"no Python was found.*python-like.*multiprocessing.set_executable"
    ) as error:
        gn.load(tmp_path / "m.nc")
    assert "damaged" not in str(error.value) and ran.read_text() == "python-like\n"


def test_a_probe_that_never_ends_is_an_error(tmp_path, monkeypatch):
    """One of gonio's. (D16)"""
    gn.save(grid(), tmp_path / "m.nc")
    expired = subprocess.TimeoutExpired("python", 600.0)
    monkeypatch.setattr(hdf.subprocess, "run", lambda *_, **__: (_ for _ in ()).throw(expired))
    with pytest.raises(FormatError, match="its library hangs"):
        gn.load(tmp_path / "m.nc")


def test_netcdf_without_dimensions_says_one_thing(tmp_path, capfd):
    """h5netcdf's warning of phony_dims came with the error. (D18)"""
    with h5py.File(tmp_path / "m.nc", "w") as file:
        file["values"] = np.zeros((2, 3))
    with warnings.catch_warnings(record=True) as warned, pytest.raises(FormatError, match="no attribute gonio_schema"):
        warnings.simplefilter("always")
        gn.load(tmp_path / "m.nc")
    assert not warned and capfd.readouterr() == ("", "")


@stores
@pytest.mark.parametrize(
    "which", [[("chunks", 3)], pytest.param(list(product(["descriptions", "chunks"], [2, 3])), marks=pytest.mark.full)]
)
def test_an_error_of_a_store_comes_alone(which, tmp_path):
    """asyncio said "Task was destroyed but it is pending!" and more of the tasks that zarr left. (D18)"""
    for damage, zarr_format in which:
        path = foreign(tmp_path / f"{damage}{zarr_format}.zarr", zarr_format, compressors=None)
        for file in path.rglob("*"):
            if damage == "descriptions" and file.name in (".zarray", "zarr.json") and file.parent != path:
                held = json.loads(file.read_text())
                held["codecs" if zarr_format == 3 else "order"] = [{"name": "bytes"}] * 2 if zarr_format == 3 else "Q"
                file.write_text(json.dumps(held))
            elif (
                damage == "chunks" and file.parent.parent != path.parent and file.is_file() and file.name[0] not in ".z"
            ):
                file.write_bytes(b"?")
        code = f"import gonio as gn\ntry: gn.load({str(path)!r})\nexcept gn.Error as error: print(type(error).__name__)"
        done = child(code)
        assert (done.stdout, done.stderr) == ("FormatError\n", "")


@stores
@pytest.mark.parametrize("reads", [8, pytest.param(60, marks=pytest.mark.full)])
def test_a_store_that_is_replaced_is_read_as_one_or_the_other(reads, tmp_path):
    """Two writers and a reader: 69 of 254 reads fell between two states and failed. (D18)"""
    path = tmp_path / "m.zarr"
    whole = [grid(np.full((3, 2, 3), x)) for x in (0.25, 0.75)]
    gn.save(whole[0], path)
    writers = []
    for k in range(2):
        pid = os.fork()
        if not pid:
            try:
                while True:
                    gn.save(whole[k], path)
            finally:
                os._exit(1)
        writers.append(pid)
    found = set()
    try:
        for _ in range(reads):
            found.add(float(np.unique(gn.load(path).stored).item()))
    finally:
        for pid in writers:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
    assert found <= {0.25, 0.75}
    gn.save(whole[0], path)
    assert [p.name for p in tmp_path.iterdir()] == ["m.zarr"]


@pytest.mark.parametrize("suffix", [".nc", ".zip", ".zarr"])
def test_a_measurement_that_changes_while_it_is_read_is_read_again(suffix, tmp_path, monkeypatch):
    """It is never put together of two. (D18)"""
    if suffix != ".nc":
        pytest.importorskip("zarr")
    from gonio.formats import xarray_netcdf, xarray_zarr

    path = tmp_path / f"m{suffix}"
    gn.save(grid(0.25), path)
    module, name = (xarray_netcdf, "_opened") if suffix == ".nc" else (xarray_zarr, "inspected")
    real, seen = getattr(module, name), []

    def once(*args, **options):
        if not seen:
            seen.append(1)
            gn.save(grid(0.75), path)
        else:
            seen.append(2)
        return real(*args, **options)

    monkeypatch.setattr(module, name, once)
    assert gn.load(path) == grid(0.75) and seen == [1, 2]


def test_a_network_is_written_in_memory_too(tmp_path):
    """HDF5 of any kind does not survive a full disk. (D18)"""
    shapes = ((6, 21), (21, 21), (21, 3))
    kernels = [np.full(shape, 0.1, "f4") for shape in shapes]
    biases = [np.full(shape[1:], 0.1, "f4") for shape in shapes]
    m = neural.Neural(kernels, biases)
    path = tmp_path / "m.h5"
    pid = os.fork()
    if not pid:
        code = 1
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
            gn.save(m, path, format=neural.NAME)
        except gn.errors.WriteError:
            code = 0
        finally:
            os._exit(code)
    assert os.waitpid(pid, 0)[1] == 0 and not any(tmp_path.iterdir())
    gn.save(m, path, format=neural.NAME)
    assert gn.load(path).kernel_1.shape == (6, 21)
