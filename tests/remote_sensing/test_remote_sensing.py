"""Kernels by the angles of satellites, nadir reflectance, BRDF correction, fits."""

from __future__ import annotations

import math

import dask.array
import numpy as np
import pytest
import xarray

import gonio as gn
from gonio.errors import ArrayTypeError, DirectionError, MissingDataWarning, ParameterError, ShapeError

rs = gn.remote_sensing
SUN, VIEW, PHI = np.radians([[30, 30, 45, 45, 60, 20, 10], [0, 40, 20, 60, 30, 5, 44], [0, 180, 0, 90, 180, 20, 33]])
FIELD = gn.RossLi([0.2, 0.3], [0.1, 0.15], [0.03, 0.02])
ROWS = rs.brf(FIELD, SUN, VIEW, PHI)


@pytest.mark.parametrize("name", ["ross_thick", "ross_thin", "ross_thick_hotspot", "li_sparse_r", "li_dense_r"])
def test_kernels_are_those_of_the_model(name):
    which = "geometric" if name.startswith("li") else "volumetric"
    weight = {"f_geo" if name.startswith("li") else "f_vol": 1.0}
    crowns = {"b_r": 2.5} if name == "li_dense_r" else {}
    model = gn.RossLi(**{"f_iso": 0.0, "f_vol": 0.0, "f_geo": 0.0, **weight, which: name, **crowns})
    expected = np.pi * model.f_angles(SUN, 0.3, VIEW, 0.3 + PHI)
    np.testing.assert_allclose(getattr(rs, name)(SUN, VIEW, PHI), expected, rtol=1e-10, atol=1e-13)


def test_roujeans_kernels_are_those_of_his_model():
    model = gn.Roujean(0.2, 0.05, 0.3)
    expected = 0.2 + 0.05 * rs.roujean_geometric(SUN, VIEW, PHI) + 0.3 * rs.roujean_volumetric(SUN, VIEW, PHI)
    np.testing.assert_allclose(rs.brf(model, SUN, VIEW, PHI), expected, rtol=1e-10)


def test_kernels_as_the_papers_have_them():
    """Of scalars, written out: K_vol at 60 degrees back-scatter; K_geo across, where shadows do not overlap."""
    expected = (math.pi / 2) / (2 * math.cos(math.pi / 3)) - math.pi / 4
    assert rs.ross_thick(math.pi / 3, math.pi / 3, 0.0) == pytest.approx(expected)
    secant = 1 / math.cos(1.2)
    expected = -2 * secant + 0.5 * (1 + math.cos(2.4)) * secant**2
    assert rs.li_sparse_r(1.2, 1.2, math.pi) == pytest.approx(expected)
    assert rs.li_sparse_r(0.5, 0.5, math.pi / 2, h_b=2.0, b_r=1.0) == rs.li_sparse_r(0.5, 0.5, math.pi / 2)
    assert rs.li_sparse_r(0.5, 0.5, 1.0, b_r=2.0) != rs.li_sparse_r(0.5, 0.5, 1.0)


def test_kernels_take_arrays_with_names_and_later_ones():
    sun, view = xarray.DataArray(SUN, dims="time"), xarray.DataArray(VIEW[:2], dims="x")
    K = rs.ross_thick(sun, view, 0.0)
    assert K.dims == ("time", "x")
    np.testing.assert_allclose(K, rs.ross_thick(SUN[:, None], VIEW[:2], 0.0))
    lazy = rs.li_sparse_r(dask.array.from_array(SUN, chunks=2), VIEW, PHI)
    assert isinstance(lazy, dask.array.Array)
    np.testing.assert_allclose(lazy, rs.li_sparse_r(SUN, VIEW, PHI))


def test_nadir_reflectance_and_the_correction_to_it():
    np.testing.assert_allclose(rs.nbar(FIELD, 0.5), np.pi * FIELD.f_angles(0.5, 0.0, 0.0, 0.0))
    c = rs.c_factor(FIELD, SUN, VIEW, PHI, 0.5)
    np.testing.assert_allclose(c * ROWS, np.broadcast_to(rs.nbar(FIELD, 0.5), ROWS.shape))
    np.testing.assert_allclose(rs.c_factor(FIELD, SUN, VIEW, PHI) * ROWS, rs.nbar(FIELD, SUN))
    np.testing.assert_allclose(rs.c_factor(0.5 * FIELD, SUN, VIEW, PHI, 0.5), c)
    sun = xarray.DataArray(SUN, dims="time")
    assert rs.c_factor(FIELD, sun, 0.3, 0.0, xarray.DataArray([0.4, 0.5], dims="to")).dims == ("time", "to", "channel")
    with pytest.warns(MissingDataWarning, match="1 of 1 modelled reflectance factors are not positive"):
        assert np.isnan(rs.c_factor(gn.RossLi(0.1, 0.0, 0.1), np.pi / 4, np.pi / 4, np.pi))


# Fits.


def test_fits_find_the_weights_of_the_model():
    fit = rs.fit_kernels(SUN, VIEW, PHI, ROWS)
    np.testing.assert_allclose(fit.weights, [FIELD.f_iso, FIELD.f_vol, FIELD.f_geo], atol=1e-12)
    np.testing.assert_allclose(fit.model.f_vol, FIELD.f_vol, atol=1e-12)
    assert fit.rmse.max() < 1e-14 and fit.rows.tolist() == [7, 7]
    holes = ROWS.copy()
    holes[0, 0] = np.nan
    other = rs.fit_kernels(SUN, VIEW, PHI, holes, u=np.linspace(0.01, 0.02, 7))
    np.testing.assert_allclose(other.weights, fit.weights, atol=1e-12)
    assert other.rows.tolist() == [6, 7]


def test_uncertainties_are_those_of_repeated_fits():
    k = (1.0, rs.ross_thick(0.5, 0.0, 0.0), rs.li_sparse_r(0.5, 0.0, 0.0))
    noise = np.random.default_rng(1).normal(0.0, 0.005, (7, 4000))
    fits = rs.fit_kernels(SUN, VIEW, PHI, ROWS[:, :1] + noise, u=0.005)
    values, spread = fits.linear(k)
    assert values.mean() == pytest.approx(rs.nbar(FIELD, 0.5)[0], abs=2e-4)
    np.testing.assert_allclose(spread, values.std(), rtol=0.04)
    np.testing.assert_allclose(fits.uncertainty[:, 0], fits.weights.std(axis=1), rtol=0.04)
    assert np.sqrt((fits.rmse**2).mean()) == pytest.approx(0.005, rel=0.03)
    unknown = rs.fit_kernels(SUN, VIEW, PHI, ROWS[:, :1] + noise)
    np.testing.assert_allclose(np.sqrt(unknown.weight_of_determination(k)) * 0.005, spread)
    np.testing.assert_allclose(unknown.linear(k)[1], np.sqrt(unknown.weight_of_determination(k)) * unknown.rmse)


def test_fits_of_maps_keep_their_axes():
    stack = xarray.DataArray(
        np.stack([ROWS, 0.5 * ROWS]), dims=("x", "time", "band"), coords={"band": ["red", "nir"]}
    ).transpose("time", "x", "band")
    fit = rs.fit_kernels(*(xarray.DataArray(a, dims="time") for a in (SUN, VIEW, PHI)), stack)
    assert fit.weights.dims == ("weight", "x", "band")
    np.testing.assert_allclose(fit.weights.sel(weight="f_vol"), [FIELD.f_vol, 0.5 * FIELD.f_vol], atol=1e-12)
    assert fit.model.channel_names == ("red", "nir")
    assert rs.nbar(fit.model, 0.5).dims == fit.linear((1, 0, 0))[1].dims == ("x", "band")
    stack[:5, 1, 1] = np.nan
    with pytest.warns(MissingDataWarning, match="1 of 4 fits have too few rows"):
        partly = rs.fit_kernels(*(xarray.DataArray(a, dims="time") for a in (SUN, VIEW, PHI)), stack)
    assert np.isnan(partly.weights).sum() == 3
    assert np.isnan(rs.nbar(partly.model, 0.5)).sum() == 1


def test_what_does_not_fit():
    near = [0.5 + 1e-9 * angle for angle in (SUN, VIEW, PHI)]  # their slopes are apart, but nothing beside their values
    for call, error, words in (
        (lambda: rs.ross_thick(30, 0, 0), DirectionError, "in degrees"),
        (lambda: rs.ross_thick(0.3, 0.1, 120), DirectionError, "phi: 120.*in degrees"),
        (lambda: rs.li_sparse_r(0.3, -0.1, 0.0), DirectionError, "theta_v: -0.1"),
        (lambda: rs.ross_thick("a", 0, 0), ParameterError, "theta_s"),
        (lambda: rs.nbar(FIELD, 2.0), DirectionError, "theta_s: 2"),
        (lambda: rs.nbar(3, 0.1), ParameterError, "m=3"),
        (lambda: rs.fit_kernels(SUN[:2], VIEW[:2], PHI[:2], ROWS[:2]), ParameterError, "at least 3"),
        (lambda: rs.fit_kernels(0 * SUN, 0 * VIEW, PHI, ROWS), ParameterError, "do not tell the kernels apart"),
        (lambda: rs.fit_kernels(*near, ROWS), ParameterError, "do not tell the kernels apart"),
        (lambda: rs.fit_kernels(SUN, VIEW, PHI, 100 * ROWS), ParameterError, "in percent"),
        (lambda: rs.fit_kernels(SUN[:3], VIEW, PHI, ROWS), ShapeError, r"theta_s: got shape \(3,\)"),
        (lambda: rs.fit_kernels(SUN, VIEW, PHI, ROWS, u=0.0), ParameterError, "above 0"),
        (lambda: rs.fit_kernels(SUN, VIEW, PHI, ROWS, volumetric="x"), ParameterError, "'ross_thick'"),
        (lambda: rs.fit_kernels(0.1, 0.1, 0.1, 0.3), ShapeError, "a row for each"),
        (lambda: rs.fit_kernels(0.1, 0.1, 0.1, "a"), ArrayTypeError, "expected arrays of numbers"),
        (lambda: rs.fit_kernels(SUN, VIEW, PHI, ROWS).linear((1, 0)), ShapeError, "three numbers"),
        (lambda: rs.fit_kernels(xarray.DataArray(SUN), VIEW, PHI, ROWS), ArrayTypeError, "names for all"),
    ):
        with pytest.raises(error, match=words):
            call()
