"""MCD43A1: bands, pixels, tiles in HDF4 and HDF5, damage."""

from __future__ import annotations

import datetime
import math
import sys

import numpy as np
import pytest
from format_cases import at, loaded
from places import real
from seeds import SEEDS, mcd43, mcd43_tile

import gonio as gn
from gonio.errors import DependencyError, FormatError, MissingDataWarning, NotFoundError, ParameterError
from gonio.formats import mcd43 as mcd43_module
from gonio.formats import xarray_netcdf

# MCD43A1.


pytestmark = pytest.mark.usefixtures("uncompiled", "one_probe")  # a kernel for every table takes longer than all else


def test_mcd43(tmp_path):
    m = loaded(tmp_path, mcd43())
    assert (m.time, m.channel_names) == (1, ("red", "vis"))
    assert not m.valid[0].any()
    expected = gn.RossLi(f_iso=[0.101, 0.102], f_vol=[0.051, 0.051], f_geo=[0.021, 0.021])
    np.testing.assert_allclose(at(m, 40.0, 0.0, 20.0, 100.0), at(expected, 40.0, 0.0, 20.0, 100.0), rtol=1e-12)
    np.testing.assert_allclose(m.on(2).f_iso, [0.102, 0.103])
    assert np.isnan(at(m.on(0), 40.0, 0.0, 20.0, 100.0)).all()
    assert m.about["quality"] == {"red": 0, "vis": 0}
    assert xarray_netcdf.read(tmp_path / "file", time=2).time == 2
    with pytest.raises(ParameterError, match="holds 3 days"):
        xarray_netcdf.read(tmp_path / "file", time=3)


def test_mcd43_bands_have_wavelengths_and_pixels_are_a_map(tmp_path):
    m = loaded(tmp_path, mcd43(("Band1", "Band4"), pixels=2))
    assert (m.channel_names, m.wavelengths) == (("red", "green"), (645.0, 555.0))
    assert m.f_iso.shape == (2, 2, 2)
    assert at(m, 40.0, 0.0, 20.0, 100.0).shape == (2, 2, 2)


@pytest.mark.parametrize("scales", [False, True])
def test_mcd43_converted_by_h4toh5(tmp_path, scales):
    """Its groups are those of HDF-EOS, and not all of its files have netCDF's dimensions."""
    import h5py

    with h5py.File(tmp_path / "file", "w") as file:
        group = file.create_group("MOD_Grid_BRDF/Data Fields")
        for k, band in enumerate(("Band1", "Band4")):
            weights = np.full((2, 2, 3), 100 + k, "i2")
            held = group.create_dataset(f"BRDF_Albedo_Parameters_{band}", data=weights)
            held.attrs.update({"scale_factor": [0.001], "add_offset": [0.0], "_FillValue": np.array([32767], "i2")})
            for axis, name in enumerate(("YDim", "XDim", "Num_Parameters") if scales else ()):
                if name not in group:
                    group.create_dataset(name, data=np.arange(held.shape[axis], dtype="f8")).make_scale(name)
                held.dims[axis].attach_scale(group[name])
    m = gn.load(tmp_path / "file")
    assert m.channel_names == ("red", "green")
    np.testing.assert_allclose(m.f_iso, np.broadcast_to([0.1, 0.101], (2, 2, 2)))


def test_tiles_of_mcd43(tmp_path):
    pytest.importorskip("pyhdf")
    m = loaded(tmp_path, mcd43_tile())
    assert m.channel_names == ("red", "green") and m.f_iso.shape == (3, 2, 2)
    assert m.about["CoreMetadata.0"] == "GROUP = INVENTORYMETADATA"
    assert m.about["quality"]["green"] == [[1, 1]] * 3
    y, x = np.mgrid[:3, :2]
    expected = 0.1 + 0.001 * (y + x)[..., None] + [0.0, 0.01]
    expected[0, 0] = np.nan
    np.testing.assert_allclose(m.f_iso, expected, rtol=1e-12)
    np.testing.assert_allclose(m.f_vol[1:], 0.05)
    np.testing.assert_allclose(m.f_geo[1:], 0.02)
    green = gn.load(tmp_path / "file", band="green", quality="any")
    np.testing.assert_array_equal(green.f_iso, m.f_iso[..., 1:])
    with pytest.raises(FormatError, match="holds no weights"):
        gn.load(tmp_path / "file", band="green", quality="full")
    one = gn.load(tmp_path / "file", rows=(2, 3), columns=(1, 2))
    assert one.f_iso.tolist() == pytest.approx([0.103, 0.113])
    np.testing.assert_allclose(at(one, 40.0, 0.0, 20.0, 100.0), at(m, 40.0, 0.0, 20.0, 100.0)[2, 1], rtol=1e-12)
    row = gn.load(tmp_path / "file", rows=(1, 2))
    np.testing.assert_allclose(row.f_iso, expected[1:2], rtol=1e-12)


@pytest.mark.parametrize(
    "options", [{"rows": (2, 5)}, {"columns": (0, 0)}, {"rows": (5, 1)}, {"rows": (0, 1), "columns": (2, 1)}]
)
def test_pixels_that_a_tile_lacks(tmp_path, options):
    pytest.importorskip("pyhdf")
    loaded(tmp_path, mcd43_tile())
    with pytest.raises(ParameterError, match=r"holds 3 rows and 2 columns of pixels; got rows="):
        gn.load(tmp_path / "file", **options)
    with pytest.raises(ParameterError, match=r"rows=1: expected 2 whole numbers from 0"):
        gn.load(tmp_path / "file", rows=1)


def test_large_tiles_ask_which_pixels(tmp_path, monkeypatch):
    pytest.importorskip("pyhdf")
    monkeypatch.setattr(mcd43_module, "MOST", 40)
    (tmp_path / "file").write_bytes(mcd43_tile())
    with pytest.raises(ParameterError, match=r"holds 3 rows and 2 columns of pixels, 0 MB of weights; say which"):
        gn.load(tmp_path / "file")
    with pytest.raises(ParameterError, match="say which"):
        gn.load(tmp_path / "file", rows=(0, 3))
    assert gn.load(tmp_path / "file", rows=(0, 1)).f_iso.shape == (1, 2, 2)
    assert gn.load(tmp_path / "file", rows=(0, 3), columns=(0, 2)).f_iso.shape == (3, 2, 2)


def test_damaged_tiles(tmp_path):
    pytest.importorskip("pyhdf")
    data = mcd43_tile()
    with pytest.raises(FormatError, match=r"HDF4 file that is damaged or cut short"):
        loaded(tmp_path, data[: len(data) // 2])
    with pytest.raises(FormatError, match=r"HDF4 without BRDF_Albedo_Parameters_\*"):
        loaded(tmp_path, data.replace(b"BRDF_Albedo_P", b"BRDF_albedo_p"))
    with pytest.raises(FormatError, match=r"expected \(\[time,\] y, x, 3\)"):
        loaded(tmp_path, mcd43_tile(flat=True))
    with pytest.raises(FormatError, match=r"has attributes .*'scale_factor': 'a'.*expected numbers"):
        loaded(tmp_path, mcd43_tile(scale_factor="a"))
    with pytest.raises(FormatError, match="scale_factor"):
        loaded(tmp_path, mcd43_tile(scale_factor=1.0))


def test_tiles_without_pyhdf(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyhdf", None)
    with pytest.raises(DependencyError, match=r"pip install 'gonio\[hdf4\]'.*AppEEARS.*h4tonccf_nc4 .*h4toh5 "):
        loaded(tmp_path, b"\x0e\x03\x13\x01" + bytes(100))


def test_damaged_mcd43(tmp_path):
    with pytest.raises(FormatError, match="scale_factor"):
        loaded(tmp_path, mcd43(scale_factor=1.0))
    (tmp_path / "file").write_bytes(SEEDS["netCDF"]())
    with pytest.raises(FormatError, match="which alone have days"):
        xarray_netcdf.read(tmp_path / "file", time=2)


def file_of_days(path, quality=0, **attributes):
    """Three days from 2018-07-01, the first without data, of Band2 and the broad nir; flags of the last day."""
    import io

    import xarray

    ds = xarray.load_dataset(io.BytesIO(mcd43(("Band2", "nir"))), engine="h5netcdf", decode_times=False)
    ds["time"] = ("time", [0, 1, 2], {"units": "days since 2018-07-01 00:00:00.0", "calendar": "julian", **attributes})
    ds[f"{mcd43_module.QUALITY}Band2"][2] = quality
    ds.to_netcdf(path, engine="h5netcdf")
    return path


def test_days_bands_and_quality_of_mcd43(tmp_path):
    path = file_of_days(tmp_path / "file", quality=1)
    m = gn.load(path, time="2018-07-03", band=["broad_nir", "nir"])
    assert (m.time, m.about["date"], m.channel_names) == (2, "2018-07-03", ("broad_nir", "nir"))
    assert m.f_iso.tolist() == pytest.approx([0.103, 0.102])
    assert m.on("2018-07-02").f_iso.tolist() == pytest.approx([0.102, 0.101])
    assert m.on(datetime.date(2018, 7, 2)).about["date"] == "2018-07-02"
    assert gn.load(path, time=datetime.datetime(2018, 7, 3), band=858.5).f_iso.tolist() == pytest.approx([0.102])
    assert gn.load(path, band="band2").channel_names == ("nir",)
    full = gn.load(path, time=2, quality="full")
    assert np.isnan(full.f_iso).tolist() == [True, False]
    assert m.data["time"].dt.strftime("%F").values.tolist() == ["2018-07-01", "2018-07-02", "2018-07-03"]
    assert m.data["wavelength"].sel(band="nir") == 858.5
    with pytest.warns(
        MissingDataWarning, match=r"no weights of full inversions on this day.*nearest that has is 2018-07-02"
    ):
        gn.load(path, time="2018-07-03", band="nir", quality="full")


@pytest.mark.slow_because("xarray opens a file a dozen times")
def test_days_bands_and_quality_that_a_file_has_not(tmp_path):
    path = file_of_days(tmp_path / "file")
    for time in ("2018-06-30", 3):
        with pytest.raises(ParameterError, match=r"holds 3 days, numbered 0 to 2, 2018-07-01 to 2018-07-03"):
            gn.load(path, time=time)
    for time in ("July", "2018", "2018-07-32", ""):
        with pytest.raises(ParameterError, match=r"2018-07-01"):
            gn.load(path, time=time)
    for band in ("red", 700.0, "Band1"):
        with pytest.raises(NotFoundError, match=r"it holds nir \(Band2, 858.5 nm\), broad_nir"):
            gn.load(path, band=band)
    with pytest.raises(ParameterError, match="expected 'any' or 'full'"):
        gn.load(path, quality="good")
    without = file_of_days(tmp_path / "without", units="seconds since 1970-01-01")
    with pytest.raises(ParameterError, match="the number of a day: it has no dates"):
        gn.load(without, time="2018-07-01")


def test_the_real_mcd43():
    m = gn.load(real("modis/mcd43a1_one_pixel.nc4"))
    assert m.weights.shape == (365, 1, 1, 3, 10)
    np.testing.assert_allclose([m.f_iso[0], m.f_vol[0], m.f_geo[0]], [0.089, 0.0, 0.022], atol=1e-7)
    assert np.isnan(m.weights).mean() == pytest.approx((9 * 25 + 63) / 3650)
    theta = math.radians(30.0)  # black-sky albedo by the product's polynomials (Lucht et al. 2000)
    vol = -0.007574 - 0.070987 * theta**2 + 0.307588 * theta**3
    geo = -1.284909 - 0.166314 * theta**2 + 0.041840 * theta**3
    expected = m.f_iso + vol * m.f_vol + geo * m.f_geo
    np.testing.assert_allclose(gn.albedo(m, gn.direction(theta, 0.0)), expected, atol=2e-3)
