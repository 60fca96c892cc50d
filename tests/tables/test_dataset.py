"""gonio's layout of measurements, in memory, as netCDF and as Zarr: nothing is lost on the way, damage is named."""

from __future__ import annotations

import builtins
import contextlib
import json
import zipfile

import h5py
import numpy as np
import pytest
import xarray
from house import GOLD
from places import ROOT
from seeds import saved, small_grid, small_rows

import gonio as gn
from gonio.errors import DependencyError, FormatError, NotFoundError, ParameterError
from gonio.evaluate import planning
from gonio.formats.merl import MERL
from gonio.tables import dataset_layout

PAGE = ROOT / "docs" / "data-model.md"
WI, WO = (
    gn.direction(np.array([0.1, 0.5, 1.2]), 0.3),
    gn.direction(np.array([0.4, 0.1, 1.0]), np.array([2.0, 0.0, 3.0])),
)


@pytest.fixture(autouse=True)
def plain(monkeypatch, one_probe):
    """No kernels: compiling one for every table takes longer than all else here."""
    monkeypatch.setattr(planning, "available", lambda: False)


def grids():
    yield small_grid()
    rng = np.random.default_rng(1)
    theta, half = np.radians([0.0, 20.0, 60.0]), np.linspace(0.0, np.pi, 4)
    yield gn.Gridded(
        "angles", {"theta_i": theta, "theta_o": theta, "phi": half}, rng.uniform(size=(3, 3, 4)), mirrored=True
    )
    axes = {"theta_i": theta, "radial": [0.0, 0.1, 1.0], "azimuth": half, "phi_i": [0.0, 1.0, 4.0]}
    yield gn.Gridded("specular", axes, rng.normal(size=(3, 3, 4, 3, 3)), quantity="brdf * cos(theta_o)", channels="RGB")
    axes = {"theta_i": theta, "theta_o": theta, "phi_i": [0.0, 1.0], "phi_o": half}
    values = rng.uniform(size=(3, 3, 2, 4, 2))
    yield gn.Gridded(
        "angles", axes, values, quantity="reflectance factor", channels=[450, 633.25], uncertainty=0.1 * values
    )


MEASUREMENTS = [*grids(), small_rows(), small_rows(uncertainty=0.01, quantity="reflectance factor", isotropic=False)]


def kept(a, b):
    """Whether nothing was lost."""
    assert type(a) is type(b)
    assert a == b
    assert a.stored.dtype == b.stored.dtype
    assert (a.uncertainty is None) == (b.uncertainty is None)
    assert a.uncertainty is None or a.uncertainty.dtype == b.uncertainty.dtype
    assert a.channel_names == b.channel_names
    np.testing.assert_equal({k: v for k, v in b.about.items() if k != "converted_from"}, a.about)
    assert [type(x) for x in a.about.values()] == [type(b.about[x]) for x in a.about]


@pytest.mark.parametrize("m", MEASUREMENTS, ids=repr)
def test_nothing_is_lost(m, tmp_path):
    again = gn.tables.from_dataset(gn.tables.to_dataset(m))
    kept(m, again)
    np.testing.assert_array_equal(again.f(WI, WO), m.f(WI, WO))
    for name in ("a.nc4", "a.zip", "a.zarr"):
        if not name.endswith("nc4"):
            pytest.importorskip("zarr")
        gn.save(m, tmp_path / name)
        again = gn.load(tmp_path / name)
        kept(m, again)
        assert again.path == str(tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.nc4", "a.zarr", "a.zip"]


def test_what_a_dataset_says():
    ds = gn.tables.to_dataset(small_grid())
    assert ds.attrs["Conventions"] == "CF-1.11"
    assert ds.attrs["gonio_schema"] == dataset_layout.VERSION
    assert ds["values"].dims == ("theta_h", "theta_d", "phi_d", "channel")
    assert ds["values"].attrs["units"] == "sr-1"
    assert ds["theta_h"].attrs["units"] == "rad"
    assert not ds["valid"].values[2, 1, 3].any()
    assert ds["valid"].values.sum() == 48 - 2
    ds = gn.tables.to_dataset(small_rows(quantity="reflectance factor"))
    assert ds["values"].dims == ("measurement", "wavelength")
    assert ds["values"].attrs["units"] == "1"
    assert ds["wavelength"].attrs["units"] == "nm"
    xarray.testing.assert_identical(small_grid().data.drop_attrs(), gn.tables.to_dataset(small_grid()).drop_attrs())


def test_provenance_is_that_of_the_first_file(tmp_path):
    gn.save(small_rows(), tmp_path / "first.brdf", format="BiRD")
    m = gn.load(tmp_path / "first.brdf")
    for name in ("second.nc", "third.nc"):
        gn.save(m, tmp_path / name)
        m = gn.load(tmp_path / name)
    import hashlib

    first = m.provenance["converted_from"]["converted_from"]
    assert first["file"] == "first.brdf"
    assert first["sha256"] == hashlib.sha256((tmp_path / "first.brdf").read_bytes()).hexdigest()
    assert first["gonio"] == gn.__version__


def test_units_and_order_are_those_the_dataset_names():
    m = MEASUREMENTS[1]
    ds = gn.tables.to_dataset(m).transpose("phi", "theta_o", "theta_i")
    for name in ("theta_i", "theta_o", "phi"):
        ds[name] = ds[name].copy(data=np.degrees(ds[name])).assign_attrs(units="degree")
    again = gn.tables.from_dataset(ds)
    np.testing.assert_allclose(again.axes["theta_i"], m.axes["theta_i"], rtol=1e-15)
    np.testing.assert_array_equal(again.stored, m.stored)
    rows = gn.tables.to_dataset(small_rows())
    rows["wavelength"] = rows["wavelength"].copy(data=[0.45, 0.6335]).assign_attrs(units="um")
    assert gn.tables.from_dataset(rows).channel_names == pytest.approx((450.0, 633.5))


def test_where_valid_is_false_there_is_no_value():
    ds = gn.tables.to_dataset(MEASUREMENTS[1])
    ds["valid"] = ds["valid"] & (ds["theta_i"] > 0.0)
    m = gn.tables.from_dataset(ds)
    assert np.isnan(m.stored[0]).all()
    assert np.isfinite(m.stored[1:]).all()


def test_models_are_put_on_a_grid(tmp_path):
    m = gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))
    gn.save(m, tmp_path / "m.nc")
    again = gn.load(tmp_path / "m.nc")
    assert again.channel_names == ("R", "G", "B")
    np.testing.assert_allclose(again.f(WI, WO), m.f(WI, WO), rtol=1e-2)
    assert again.about["made_of"] == repr(m)
    gn.save(m, tmp_path / "m.nc", parameterization="angles", resolution=(5, 5, 8))
    assert gn.load(tmp_path / "m.nc").stored.shape == (5, 5, 8, 3)
    with pytest.raises(ParameterError, match="perfect mirror"):
        gn.save(gn.IdealSpecular(0.9), tmp_path / "m.nc")
    with pytest.raises(ParameterError, match="maps"):
        gn.tables.to_dataset(gn.Lambertian(np.full((2, 2, 3), 0.5)))
    with pytest.raises(ParameterError, match="resolution"):
        gn.tables.to_dataset(m, resolution=(5, 5))


def broken(change):
    ds = gn.tables.to_dataset(small_grid())
    change(ds)
    return ds


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda ds: ds.attrs.pop("gonio_schema"), "gonio_schema"),
        (lambda ds: ds.attrs.update(gonio_schema="2.0"), "update gonio"),
        (lambda ds: ds.attrs.update(quantity="radiance"), "expected one of"),
        (lambda ds: ds.attrs.pop("quantity"), "attribute quantity is None"),
        (lambda ds: ds.attrs.update(parameterization="angles"), "expected theta_i"),
        (lambda ds: ds.attrs.update(about="{"), "not JSON"),
        (lambda ds: ds.attrs.update(about='{"a": {"gonio:array": ["O", [1], [2]]}}'), "not JSON"),
        (lambda ds: ds.attrs.update(about="[1]"), "JSON object"),
        (lambda ds: ds.attrs.update(periods='{"phi_d": ' + 400 * "1" + "}"), "expected names of azimuths and radians"),
        (lambda ds: ds["theta_h"].attrs.update(units="gon"), "units 'gon'"),
        (lambda ds: ds["theta_h"].attrs.pop("units"), "units None"),
        (lambda ds: ds.__delitem__("values"), "no variable values"),
    ],
)
def test_a_wrong_dataset_says_what_is_wrong(change, words):
    with pytest.raises(FormatError, match=words):
        gn.tables.from_dataset(broken(change))


def test_things_that_cannot_be_kept_are_refused(tmp_path):
    m = gn.Gridded("angles", {"theta_i": [0.0], "theta_o": [0.0], "phi": [0.0]}, [[[1.0]]], about={"open": object()})
    with pytest.raises(ParameterError, match="cannot be kept"):
        gn.save(m, tmp_path / "m.nc")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("cuts", [20, pytest.param(40, marks=pytest.mark.full)])
@pytest.mark.parametrize("suffix", [".nc", ".zip"])
def test_every_cut_is_noticed(suffix, cuts, tmp_path):
    if suffix == ".zip":
        pytest.importorskip("zarr")
    whole = saved(small_grid(), suffix)
    for n in range(64, len(whole), len(whole) // cuts):
        (tmp_path / "cut").write_bytes(whole[:n])
        with pytest.raises(FormatError):
            gn.load(tmp_path / "cut")


def test_damaged_numbers_are_noticed(tmp_path):
    (tmp_path / "m.nc").write_bytes(saved(small_grid(), ".nc"))
    with h5py.File(tmp_path / "m.nc") as file:
        chunk = file["values"].id.get_chunk_info(0)
    content = bytearray((tmp_path / "m.nc").read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 4
    (tmp_path / "m.nc").write_bytes(content)
    with pytest.raises(FormatError, match="damaged"):
        gn.load(tmp_path / "m.nc")


def test_netcdf_that_promises_too_much(tmp_path):
    path = tmp_path / "huge.nc"
    path.write_bytes(saved(small_grid(), ".nc"))
    with h5py.File(path, "a") as file:
        file.create_dataset("more", (10**6, 10**6), "f8", chunks=(1000, 1000))
    with pytest.raises(FormatError, match="8000000000"):
        gn.load(path)


def test_netcdf_that_points_elsewhere(tmp_path):
    path, other = tmp_path / "a.nc", tmp_path / "secret"
    other.write_bytes(b"secret" * 100)
    for add in (
        lambda file: file.create_dataset("x", (10,), "u1", external=[(str(other), 0, 10)]),
        lambda file: file.__setitem__("x", h5py.ExternalLink(str(other), "/")),
        lambda file: file.__setitem__("x", h5py.SoftLink("/values")),
    ):
        path.write_bytes(saved(small_grid(), ".nc"))
        with h5py.File(path, "a") as file:
            add(file)
        with pytest.raises(FormatError, match="expected the data itself"):
            gn.load(path)


def test_other_netcdf(tmp_path):
    path = tmp_path / "other.nc"
    xarray.Dataset({"t": ("x", [1.0, 2.0])}).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(FormatError, match=r"gonio_schema.*data-model"):
        gn.load(path)
    for kind in (b"\x01", b"\x02", b"\x05"):
        path.write_bytes(b"CDF" + kind + bytes(40))
        with pytest.raises(FormatError, match=r"classic.*nccopy -k nc4 .*ncks -4 "):
            gn.load(path)


def folder(tmp_path):
    pytest.importorskip("zarr")
    gn.save(small_grid(), tmp_path / "m.zarr")
    return tmp_path / "m.zarr"


def test_zarr_never_runs_what_it_reads(tmp_path):
    path = folder(tmp_path)
    described = json.loads((path / "values" / ".zarray").read_text())
    described["filters"] = [{"id": "pickle"}]
    (path / "values" / ".zarray").write_text(json.dumps(described))
    with pytest.raises(FormatError, match="coded by 'pickle'"):
        gn.load(path)


@pytest.mark.parametrize("codec", ["Blosc", "Zstd", "LZ4"])
def test_zarr_chunks_that_promise_too_much(codec, tmp_path):
    numcodecs = pytest.importorskip("numcodecs")
    path = tmp_path / "m.zarr"
    gn.save(small_grid(), path)
    coded = getattr(numcodecs, codec)()
    described = json.loads((path / "values" / ".zarray").read_text())
    chunk = next(p for p in (path / "values").iterdir() if not p.name.startswith("."))
    content = bytearray(coded.encode(numcodecs.get_codec(described["compressor"]).decode(chunk.read_bytes())))
    (path / "values" / ".zarray").write_text(json.dumps({**described, "compressor": coded.get_config()}))
    chunk.write_bytes(content)
    np.testing.assert_array_equal(gn.load(path).stored, small_grid().stored)
    # Zstandard's frames: magic, a byte that says how many bytes the length has, here four, then it.
    if codec == "Zstd":
        content[4:] = bytes([0b10100000]) + (2**31 - 1).to_bytes(4, "little") + content[5:]
    else:
        at = 4 if codec == "Blosc" else 0
        content[at : at + 4] = (2**31 - 1).to_bytes(4, "little")
    chunk.write_bytes(content)
    with pytest.raises(FormatError, match="unpacks to 2147483647 bytes, expected at most"):
        gn.load(path)


@pytest.mark.parametrize("suffix", [".zip", pytest.param(".nc", marks=pytest.mark.full)])  # which packs for a second
def test_merl_is_kept_as_it_is(suffix, tmp_path):
    """Every number, and f between them, to rounding; then it is MERL's file again."""
    if suffix == ".zip":
        pytest.importorskip("zarr")
    raw = np.empty((3, 90, 90, 180))  # a table takes 35 MB, so that few are there at a time
    c, j, k = np.ogrid[:3, :90, :180]
    for i in range(90):
        waves = np.cos(0.03 * (c + 1) * i) + np.cos(0.03 * (c + 2) * j) + np.cos(0.03 * (c + 3) * k)
        raw[:, i] = 50.0 * (c + 2.0 + waves / 2.0)
        wi, wo = gn.directions.from_half_difference(
            *(np.radians(x) for x in ((i + 0.5) ** 2 / 90.0, 0.0, j[0] + 0.5, k[0] + 0.5))
        )
        raw[:, i, np.minimum(wi[..., 2], wo[..., 2]) < 1e-6] = -1.0
    raw[:, 40, 20, 30] = -1.0
    m = MERL(raw)
    u = np.random.default_rng(1).random((4, 5000)) * np.array([[1.5], [6.2], [1.5], [6.2]])
    f, coarse = m.f_angles(*u), gn.tables.to_dataset(m, resolution=(5, 4, 3))
    del m  # and what it looked up
    gn.save(MERL(raw), tmp_path / f"m{suffix}")
    again = gn.load(tmp_path / f"m{suffix}")
    np.testing.assert_allclose(again.f_angles(*u), f, rtol=1e-13, equal_nan=True)
    gn.save(again, tmp_path / "again.binary")
    del again
    found = gn.load(tmp_path / "again.binary").raw
    for i in range(90):
        np.testing.assert_allclose(found[:, i], raw[:, i], rtol=1e-13)
    assert coarse["values"].shape == (5, 4, 3, 3)
    again = gn.tables.to_dataset(gn.tables.from_dataset(coarse), "angles", resolution=(3, 4, 5))
    assert again["values"].dims[:3] == ("theta_i", "theta_o", "phi")


def test_zarr_chunks_that_are_cut_short(tmp_path):
    """Blosc reads as far as the chunk's header says, wherever that ends."""
    path = folder(tmp_path)
    chunk = next(p for p in (path / "values").iterdir() if not p.name.startswith("."))
    content = chunk.read_bytes()
    for damaged in (content[:-1], content[:17], content[:12] + b"\xff\xff\xff\x7f" + content[16:]):
        chunk.write_bytes(damaged)
        with pytest.raises(FormatError, match="is cut short: it has"):
            gn.load(path)


@pytest.mark.parametrize("codec", ["Blosc", "GZip", "LZ4", "Zlib", "Zstd", "CRC32", "CRC32C", "Adler32", "Fletcher32"])
@pytest.mark.parametrize("count", [2, pytest.param(12, marks=pytest.mark.full)])
def test_damaged_chunks_of_every_codec(codec, count, tmp_path):
    """Cut anywhere, or with one byte changed: an error of ours, or other numbers."""
    numcodecs = pytest.importorskip("numcodecs")
    path = folder(tmp_path)
    described = json.loads((path / "values" / ".zarray").read_text())
    chunk = next(p for p in (path / "values").iterdir() if not p.name.startswith("."))
    coded = getattr(numcodecs, codec)()
    content = bytes(coded.encode(numcodecs.get_codec(described["compressor"]).decode(chunk.read_bytes())))
    (path / "values" / ".zarray").write_text(json.dumps({**described, "compressor": coded.get_config()}))
    random = np.random.default_rng(1)
    for at in random.integers(0, len(content), count):
        changed = content[:at] + bytes([content[at] ^ 1 << random.integers(8)]) + content[at + 1 :]
        chunk.write_bytes(content[:at])
        with pytest.raises(FormatError, match=r"Zarr store that is damaged|is cut short|unpacks to"):
            gn.load(path)
        chunk.write_bytes(changed)
        with contextlib.suppress(FormatError):
            gn.load(path)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"chunks": [2, 0, 4, 2]}, "chunks of .* expected at least 1 along every axis"),
        ({"filters": [{"id": "blosc"}], "compressor": {"id": "zlib"}}, "expected what packs to be the last of them"),
        ({"filters": [{"id": "blosc"}], "compressor": {"id": "crc32"}}, "expected what packs to be the last of them"),
    ],
)
def test_zarr_that_would_stop_its_libraries(tmp_path, change, says):
    path = folder(tmp_path)
    described = json.loads((path / "values" / ".zarray").read_text())
    (path / "values" / ".zarray").write_text(json.dumps({**described, **change}))
    with pytest.raises(FormatError, match=says):
        gn.load(path)


def test_zarr_described_twice_is_held_to_both(tmp_path):
    """Only one of two descriptions says that chunks are packed by blosc; which is read is not ours to say."""
    path = folder(tmp_path)
    collected = json.loads((path / ".zmetadata").read_text())
    collected["metadata"]["values/.zarray"]["compressor"] = {"id": "zlib", "level": 1}
    (path / ".zmetadata").write_text(json.dumps(collected))
    chunk = next(p for p in (path / "values").iterdir() if not p.name.startswith("."))
    chunk.write_bytes(chunk.read_bytes()[:-1])
    with pytest.raises(FormatError, match="is cut short: it has"):
        gn.load(path)


def test_zarr_that_promises_too_much(tmp_path):
    path = folder(tmp_path)
    described = json.loads((path / "values" / ".zarray").read_text())
    for change in ({"shape": [10**6, 10**6, 4, 2]}, {"chunks": [10**6, 10**6, 4, 2]}):
        (path / "values" / ".zarray").write_text(json.dumps({**described, **change}))
        with pytest.raises(FormatError, match="says that it holds"):
            gn.load(path)
    (path / "values" / ".zarray").write_text("{")
    with pytest.raises(FormatError, match="damaged or incomplete"):
        gn.load(path)


def test_zip_bombs_are_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_LZMA) as packed:
        packed.writestr(".zgroup", '{"zarr_format": 2}')
        packed.writestr("values/0.0", bytes(1 << 23))
    pytest.importorskip("zarr")
    with pytest.raises(FormatError, match="is packed as no store is"):
        gn.load(tmp_path / "bomb.zip")


def test_folders(tmp_path):
    path = folder(tmp_path)
    gn.save(small_rows(), path)
    assert isinstance(gn.load(path), gn.Scattered)
    assert [p.name for p in tmp_path.iterdir()] == ["m.zarr"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(FormatError, match="a folder of no known format"):
        gn.load(tmp_path / "empty")
    (tmp_path / "file.zarr").write_text("x")
    with pytest.raises(ParameterError, match="is a file"):
        gn.save(small_rows(), tmp_path / "file.zarr")
    with pytest.raises(NotFoundError):
        gn.save(small_rows(), tmp_path / "nowhere" / "m.zarr")


def test_a_folder_stays_as_it_was_if_writing_fails(tmp_path, monkeypatch):
    path = folder(tmp_path)
    before = gn.load(path)
    monkeypatch.setattr(xarray.Dataset, "to_zarr", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        gn.save(small_rows(), path)
    monkeypatch.undo()
    kept(before, gn.load(path))
    assert [p.name for p in tmp_path.iterdir()] == ["m.zarr"]


@pytest.mark.parametrize(("library", "suffix"), [("h5py", ".nc"), ("zarr", ".zip")])
def test_without_the_library(library, suffix, tmp_path, monkeypatch):
    if library == "zarr":
        pytest.importorskip("zarr")
    whole = saved(small_grid(), suffix)
    real = builtins.__import__

    def missing(name, *args, **kwargs):
        if name.partition(".")[0] == library:
            raise ImportError(f"No module named {library!r}", name=library)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(DependencyError, match="pip install"):
        gn.save(small_grid(), tmp_path / f"m{suffix}")
    (tmp_path / f"m{suffix}").write_bytes(whole)
    with pytest.raises(DependencyError, match="pip install"):
        gn.load(tmp_path / f"m{suffix}")


def test_the_page_names_everything_that_a_dataset_holds():
    page = PAGE.read_text(encoding="utf-8")
    names = set()
    for m in MEASUREMENTS:
        ds = gn.tables.to_dataset(m)
        names |= {str(n) for n in (*ds.variables, *ds.dims, *ds.attrs)}
    missing = sorted(name for name in names if f"`{name}`" not in page)
    assert not missing


@pytest.fixture(scope="module")
def gold():
    return gn.tables.tabulate(GOLD, resolution=(5, 4, 6))


@pytest.mark.parametrize("name", ["a.nc", "a.zip"])
def test_a_tabulated_material_is_kept(name, gold, tmp_path):
    m = gold
    gn.save(m, tmp_path / name)
    again = gn.load(tmp_path / name)
    np.testing.assert_array_equal(again.stored, m.stored)
    assert again.channel_names == ("R", "G", "B") and again.periods == m.periods
    assert again.about["made_of"] == m.about["made_of"]
    np.testing.assert_array_equal(gn.tables.to_dataset(m)["values"], m.stored)
