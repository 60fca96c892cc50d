"""`gn.check` of materials whose parameters are maps: each place is held to the laws as it would be alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import gonio as gn
from gonio.errors import NotFoundError, ShapeError
from gonio.laws._maps import ANGLES, PAIRS
from gonio.laws._probes import pairs
from gonio.testing import assert_lawful

WEIGHTS = np.random.default_rng(2).uniform([0.1, 0.0, 0.0], [0.5, 0.3, 0.1], (4, 5, 3))


def field(make=lambda x: x[..., None]):
    return gn.RossLi(*(make(x) for x in np.moveaxis(WEIGHTS, -1, 0)))


def test_each_place_is_measured_as_one_material():
    report = gn.check(field())
    wi, wo = pairs(PAIRS)
    for place in np.ndindex(4, 5):
        one = gn.RossLi(*WEIGHTS[place])
        lowest = min(one.f(wi, wo).min(), one.f(wo, wi).min())
        assert report.values["positivity"][place] == pytest.approx(lowest, rel=1e-12)
        assert report.values["energy"][place] == pytest.approx(max(gn.albedo(one, gn.direction(ANGLES, 0.0))), abs=1e-3)
    assert report.values["reciprocity"].max() < 1e-8 and report.count()["reciprocity"] == 0


def test_broken_laws_are_counted_where_they_are_broken():
    rho = np.array([[0.2, 0.9], [0.5, 0.3]])[..., None]
    report = gn.check(gn.Lambertian(rho) + gn.OriginalPhong(0.5 * rho, 20.0))
    assert report.count() == {"positivity": 0, "reciprocity": 4, "energy": 1} and not report.passed
    assert "as declared" in str(report)
    assert (report.holds["energy"] == (report.values["energy"] <= 1.001)).all()
    assert gn.check(gn.Lambertian(rho), laws=["energy"]).passed
    told = report.to_json()["laws"]["reciprocity"]
    assert told["broken"] == 4 and told["worst"] == report.values["reciprocity"].max() and told["declared"]


def test_missing_places_are_neither_right_nor_wrong():
    holes = np.ma.masked_array(np.full((2, 2, 1), 0.4), [[[True], [False]], [[False], [False]]])
    report = gn.check(gn.Lambertian(holes))
    assert np.isnan(report.values["energy"][0, 0]).all() and report.passed
    assert_allclose(report.values["energy"][0, 1], 0.4, rtol=1e-3)


def test_arrays_of_xarray_and_dask():
    xarray = pytest.importorskip("xarray")
    named = gn.check(field(lambda x: xarray.DataArray(x, dims=("y", "x"))))
    assert named.holds["positivity"].dims == ("y", "x")
    plain = gn.check(field())
    for name, values in plain.values.items():
        assert_allclose(named.values[name], values[..., 0], rtol=1e-9, atol=1e-12)
    assert named.count() == plain.count() and str(named).splitlines()[1:] == str(plain).splitlines()[1:]
    dask = pytest.importorskip("dask.array")
    later = gn.check(field(lambda x: dask.from_array(x[..., None], chunks=(2, 3, 1))))
    assert isinstance(later.values["energy"], dask.Array) and later.values["energy"].chunks[:2] == ((2, 2), (3, 2))
    assert later.count() == plain.count()
    assert_allclose(later.values["energy"].compute(), plain.values["energy"], rtol=1e-6)


def test_laws_of_maps_are_named():
    with pytest.raises(NotFoundError, match="not measured at the places of a map"):
        gn.check(field(), laws=["pdf"])
    told = []
    gn.check(field(), progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_assertions_want_one_material():
    with pytest.raises(ShapeError, match="maps"):
        assert_lawful(field())
