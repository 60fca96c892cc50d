"""Arrays with named axes (xarray, pandas) and arrays that are computed later (Dask), as parameters and directions."""

from __future__ import annotations

import pickle

import dask.array
import numpy as np
import pandas
import pytest
import xarray

import gonio as gn
from gonio.errors import ArrayTypeError, ParameterError, ShapeError

UP = np.array([0.0, 0.0, 1.0])
ISO = xarray.DataArray(
    np.linspace(0.05, 0.4, 12).reshape(2, 3, 2),
    dims=("y", "band", "x"),
    coords={"y": [10.0, 20.0], "band": ["red", "nir", "swir"], "lat": ("y", [50.0, 51.0])},
)
VOL = xarray.DataArray([0.1, 0.2], dims="x")
MAP = gn.RossLi(ISO, VOL, 0.02)
SUN = xarray.DataArray(np.radians([10.0, 20.0, 60.0]), dims="time", coords={"time": [1, 2, 3]})


def one(y, band, x):
    """The material of one pixel and band."""
    return gn.RossLi(float(ISO[y, band, x]), float(VOL[x]), 0.02)


def test_axes_of_parameters_are_those_of_results():
    f = MAP.f(UP, UP)
    assert f.dims == ("y", "x", "band") and f["lat"].values.tolist() == [50.0, 51.0]
    assert MAP.channel_names == ("red", "nir", "swir")
    np.testing.assert_allclose(f.transpose(*ISO.dims), ISO / np.pi, rtol=1e-12)
    assert MAP.pdf(UP, UP).dims == ("y", "x")
    assert type(MAP.f(np.tile(UP, (5, 1, 1, 1)), UP)) is np.ndarray  # an axis without a name


def test_axes_of_angles_come_first():
    f = MAP.f_angles(SUN, 0.0, 0.3, 2.0)
    assert f.dims == ("time", "y", "x", "band")
    for y, band, x in np.ndindex(2, 3, 2):
        expected = one(y, band, x).f_angles(SUN.values, 0.0, 0.3, 2.0)
        np.testing.assert_allclose(f.isel(y=y, x=x, band=band), expected, rtol=1e-12)
    shared = xarray.DataArray([[0.1, 0.2], [0.3, 0.4]], dims=("x", "y"), coords={"y": [10.0, 20.0]})
    at = MAP.f_angles(shared, 0.0, 0.0, 0.0)
    assert at.dims == ("y", "x", "band")
    assert at[1, 0, 2] == pytest.approx(float(one(1, 2, 0).f_angles(0.2, 0.0, 0.0, 0.0)))


def test_directions_have_an_axis_of_components():
    w = gn.direction(SUN, 0.5)
    assert w.dims == ("time", "xyz") and w["xyz"].values.tolist() == ["x", "y", "z"]
    theta, phi = gn.angles(w)
    xarray.testing.assert_allclose(theta, SUN)
    assert phi.dims == ("time",)
    channels = gn.Lambertian([0.1, 0.2]).with_channels([645, 858.5]).f(w, UP)
    assert channels.dims == ("time", "channel") and channels["channel"].values.tolist() == [645.0, 858.5]
    assert gn.Lambertian(0.1).f(w, UP).dims == ("time",)


def test_albedos_keep_axes():
    matte = gn.Lambertian(ISO)
    white, black = gn.remote_sensing.white_sky_albedo(matte), gn.remote_sensing.black_sky_albedo(matte, SUN)
    assert white.dims == ("y", "x", "band") and black.dims == ("time", "y", "x", "band")
    np.testing.assert_allclose(white.transpose(*ISO.dims), ISO, rtol=1e-4)
    blue = gn.remote_sensing.blue_sky_albedo(matte, SUN, xarray.DataArray([0.0, 1.0], dims="x"))
    assert blue.dims == black.dims
    np.testing.assert_allclose(blue, black, rtol=1e-4)
    both = gn.albedo(matte, gn.direction(SUN, 0.0), return_error=True)
    xarray.testing.assert_allclose(both.value, black)
    assert both.error.dims == ("time", "y", "x")
    to_all = gn.reflectance(matte, gn.Cone(UP, 0.1), gn.Hemisphere())
    assert to_all.dims == ("y", "x", "band")
    np.testing.assert_allclose(to_all, white, rtol=1e-4)


def test_series_are_arrays_of_one_axis():
    angles = pandas.Series([0.1, 0.5], index=pandas.Index(["a", "b"], name="plot"))
    f = gn.RossLi().f_angles(angles, 0.0, 0.0, 0.0)
    assert f.to_series().index.tolist() == ["a", "b"]
    assert gn.Lambertian(pandas.Series([0.1, 0.2])).f(UP, UP).dims == ("row",)
    for m in (angles * gn.Lambertian(0.5), gn.Lambertian(0.5) * angles):
        np.testing.assert_allclose(m.f(UP, UP), [0.05 / np.pi, 0.25 / np.pi])


def test_missing_numbers_stay_missing():
    f = gn.RossLi(ISO.where(ISO < 0.3), VOL).f(UP, UP).transpose(*ISO.dims)
    np.testing.assert_array_equal(np.isnan(f), ISO >= 0.3)


def test_what_is_made_of_maps_has_all_their_axes():
    days = xarray.DataArray([0.1, 0.2, 0.3], dims="day")
    m = gn.Lambertian(days) + 0.5 * MAP
    assert m.f(UP, UP).dims == ("day", "y", "x", "band") and m.channel_names == MAP.channel_names
    np.testing.assert_allclose(m.f(UP, UP), gn.Lambertian(days).f(UP, UP) + 0.5 * MAP.f(UP, UP))
    np.testing.assert_allclose((gn.Lambertian(0.5) * days / days).f(UP, UP), np.full(3, 0.5 / np.pi))
    for made in (MAP.replace(f_geo=0.05), pickle.loads(pickle.dumps(MAP)).replace(f_geo=0.05)):
        np.testing.assert_allclose(made.f(UP, UP), MAP.f(UP, UP))
        assert made.f(UP, UP).dims == ("y", "x", "band")
    glossy = gn.Microfacet(gn.GGX(alpha=days), gn.Conductor(eta=0.2, k=3.0))
    expected = [gn.Microfacet(gn.GGX(alpha=a), gn.Conductor(eta=0.2, k=3.0)).f(UP, UP) for a in days.values]
    np.testing.assert_allclose(glossy.f(UP, UP), expected)


def test_dask_computes_later():
    lazy = gn.RossLi(ISO.chunk(y=1), VOL, 0.02)
    for result, expected in (
        (lazy.f(UP, UP), MAP.f(UP, UP)),
        (lazy.f_angles(SUN, 0.0, 0.2, 1.0), MAP.f_angles(SUN, 0.0, 0.2, 1.0)),
        (MAP.f_angles(SUN.chunk(time=1), 0.0, 0.2, 1.0), MAP.f_angles(SUN, 0.0, 0.2, 1.0)),
        (gn.remote_sensing.white_sky_albedo(gn.Lambertian(ISO.chunk(y=1))), gn.Lambertian(ISO).f(UP, UP) * np.pi),
    ):
        assert isinstance(result.data, dask.array.Array) and result.dims == expected.dims
        np.testing.assert_allclose(result, expected, rtol=1e-6)
    plain = gn.Lambertian(dask.array.full((4, 4, 3), 0.3, chunks=(2, 2, 3))).f(UP, UP)
    assert isinstance(plain, dask.array.Array) and plain.chunks[0] == (2, 2)
    np.testing.assert_allclose(plain, 0.3 / np.pi)
    assert isinstance(gn.direction(dask.array.ones(3, chunks=1), 0.0), dask.array.Array)
    missing = gn.Lambertian(dask.array.from_array(np.array([[np.nan], [0.2]]), chunks=1)).f(UP, UP)
    np.testing.assert_allclose(missing, [[np.nan], [0.2 / np.pi]])
    with pytest.raises(ParameterError, match="out of bounds"):
        gn.Lambertian(dask.array.full((4, 1), 2.0)).f(UP, UP).compute()


def test_what_does_not_fit():
    w = gn.direction(SUN, 0.0)
    for call, error, words in (
        (lambda: gn.RossLi(ISO, ISO.assign_coords(y=[1.0, 2.0])), ParameterError, "equal coordinates"),
        (lambda: gn.RossLi(ISO, ISO.isel(y=[0])), ParameterError, "lengths 2 and 1"),
        (lambda: gn.RossLi(ISO, ISO.isel(y=0).rename(band="channel")), ParameterError, "axis is called band and"),
        (lambda: gn.RossLi(ISO, np.zeros((2, 2, 3))), ParameterError, "without names"),
        (lambda: gn.Lambertian(ISO.to_dataset(name="a")), ParameterError, "take a variable"),
        (lambda: gn.Lambertian(ISO.astype(str)), ParameterError, "expected numbers"),
        (lambda: gn.RossLi().f_angles(pandas.DataFrame({"a": [0.1]}), 0, 0, 0), ArrayTypeError, "take a column"),
        (lambda: MAP.f(w.rename(xyz="c"), UP), ShapeError, "expected an axis 'xyz'"),
        (lambda: MAP.f(w, np.tile(UP, (3, 1))), ArrayTypeError, "names for all axes"),
        (lambda: gn.Lambertian(np.full((3, 1), 0.5)).f(w, UP), ArrayTypeError, "names for all axes"),
        (lambda: MAP.f(w.rename(time="band"), UP), ArrayTypeError, "which parameters alone have"),
        (lambda: MAP.sample(w, np.zeros(2)), ArrayTypeError, "sample is for plain arrays"),
        (lambda: MAP.jacobian(w, UP), ArrayTypeError, "where axes have no names"),
    ):
        with pytest.raises(error, match=words):
            call()
