"""Masked arrays keep their masks wherever arrays come in; what is no real number is refused."""

from __future__ import annotations

import datetime
from typing import Any

import numpy as np
import pytest

import gonio as gn
from gonio.arrays import ops
from gonio.base.sums import Scaled
from gonio.errors import ArrayTypeError, Error, ParameterError

WI, WO = gn.direction([0.2, 0.7, 1.2], [0.0, 1.0, 3.0]), gn.direction([0.9, 0.3, 0.6], [3.0, 4.0, 0.1])
AXES = {"theta_i": np.linspace(0, 1.5, 3), "theta_o": np.linspace(0, 1.5, 4), "phi": np.linspace(0, 6, 5)}
FILL = 1e20


def table() -> np.ma.MaskedArray:
    """Values with some that are missing, as files are read: the fill value is below the mask."""
    values = np.linspace(0.1, 0.9, 60).reshape(3, 4, 5)
    values[1, 2, 3] = values[0] = FILL
    return np.ma.masked_values(values, FILL)


def holed() -> np.ndarray:
    return table().filled(np.nan)


# Measurements.


@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_masked_values_of_a_grid_are_missing(dtype):
    """What is masked is not valid, and f does not see the fill value. (D12)"""
    m = gn.Gridded("angles", AXES, table().astype(dtype))
    np.testing.assert_array_equal(m.valid, ~np.ma.getmaskarray(table()))
    assert m == gn.Gridded("angles", AXES, holed().astype(dtype))
    assert m.stored.dtype == dtype
    assert np.nanmax(m.f(WI, WO)) < 1.0


def test_masked_whole_numbers_are_missing():
    """Counts cannot hold NaN: they become float64. (D12)"""
    counts = np.ma.masked_equal(np.arange(60).reshape(3, 4, 5), 7)
    m = gn.Gridded("angles", AXES, counts)
    assert m.stored.dtype == np.float64
    np.testing.assert_array_equal(m.valid, counts.data != 7)


def test_masked_rows_in_a_list_are_missing():
    """NumPy itself drops the masks of arrays in a list. (D12)"""
    m = gn.Gridded("angles", AXES, list(table()))
    np.testing.assert_array_equal(m.stored, holed())
    np.testing.assert_array_equal(gn.Gridded("angles", AXES, [list(plane) for plane in table()]).stored, holed())


def test_masked_uncertainties_are_unknown():
    """The uncertainty under a mask is NaN, not the fill value. (D12)"""
    values = np.full((3, 4, 5), 0.5)
    m = gn.Gridded("angles", AXES, values, uncertainty=table())
    np.testing.assert_array_equal(m.uncertainty, holed())


def test_masked_nodes_are_refused():
    """Every node of an axis has to be known. (D12)"""
    nodes = np.ma.masked_greater(AXES["phi"], 5.0)
    with pytest.raises(ParameterError, match="phi"):
        gn.Gridded("angles", {**AXES, "phi": nodes}, np.full((3, 4, 5), 0.5))


def test_masked_rows_are_missing():
    """Of measurements in no grid: values and uncertainties; masked angles are refused. (D12)"""
    angles = [
        np.array([0.1, 0.5, 0.9, 1.2]),
        np.zeros(4),
        np.array([0.2, 0.3, 0.1, 1.0]),
        np.array([3.0, 1.0, 2.0, 0.3]),
    ]
    values = np.ma.array([0.5, FILL, 0.4, 0.3], mask=[0, 1, 0, 0])
    m = gn.Scattered(*angles, values, uncertainty=0.1 * values)
    np.testing.assert_array_equal(m.valid, [True, False, True, True])
    np.testing.assert_array_equal(np.isnan(m.uncertainty), [False, True, False, False])
    assert np.nanmax(m.f(WI, WO)) < 1.0
    angles[0] = np.ma.array(angles[0], mask=[0, 0, 1, 0])
    with pytest.raises(ParameterError, match="finite"):
        gn.Scattered(*angles, values)


def test_masked_values_given_later_are_missing():
    """`with_brdf` and `with_table`. (D12)"""
    m = gn.Gridded("angles", AXES, np.full((3, 4, 5), 0.5))
    for made in (m.with_brdf(table()), m.with_table(table())):
        np.testing.assert_array_equal(made.stored, holed())
    other = gn.Gridded("angles", AXES, np.full((3, 4, 5), 0.5), quantity="brdf * cos(theta_o)").with_brdf(table())
    assert not other.valid[1, 2, 3]


def test_masks_in_datasets_are_missing():
    """xarray turns masks into NaN. (D12)"""
    ds = gn.tables.to_dataset(gn.Gridded("angles", AXES, np.full((3, 4, 5), 0.5)))
    ds["values"] = (ds["values"].dims, table())
    np.testing.assert_array_equal(gn.tables.from_dataset(ds).stored, holed())


def test_tables_of_facets_are_whole():
    """A masked value, or angle, of a distribution is refused. (D12)"""
    theta, values = np.linspace(0.0, 1.5, 9), np.ma.masked_less(np.linspace(1.0, 0.1, 9), 0.3)
    with pytest.raises(ParameterError, match="finite"):
        gn.TabulatedFacets(theta, values)
    with pytest.raises(ParameterError):
        gn.TabulatedFacets(np.ma.masked_less(theta, 0.3), values.data)


# Parameters.

MAP = np.ma.array(np.full((3, 1), 0.5), mask=[[0], [1], [0]])
MAPS = {
    "Lambertian": lambda x: gn.Lambertian(x),
    "GGX": lambda x: gn.Microfacet(gn.GGX(x), gn.Dielectric(1.5)),
    "weight": lambda x: x * gn.Lambertian(0.5) + gn.Phong(0.1, 3.0),
    "fresnel": lambda x: gn.Microfacet(gn.GGX(0.3), gn.Schlick(x)),
    "quotient": lambda x: gn.Lambertian(0.5) / (2.0 + x),
    "unused": lambda x: gn.DisneyDiffuse(0.0, x),
    "wrapped": lambda x: gn.Rotated(gn.Lambertian(x)),
}


@pytest.mark.parametrize("make", MAPS.values(), ids=MAPS)
def test_masked_parameters_are_missing_in_results(make, evaluation):
    """Where an entry of a map is masked, f, pdf, samples, albedo and radiance are NaN; elsewhere as ever. (D12)"""
    m, whole, u = make(MAP), make(MAP.data), np.array([[0.3, 0.4]] * 3)
    light = gn.ConstantLight(1.0)
    pairs = [
        (m.f(WI, WO), whole.f(WI, WO)),
        (m.pdf(WI, WO), whole.pdf(WI, WO)),
        (m.sample(WO, u).weight, whole.sample(WO, u).weight),
        (m.sample(WO, u).pdf, whole.sample(WO, u).pdf),
        (m.delta_reflectance(WO), whole.delta_reflectance(WO)),
        (m.f(WI.astype("f4"), WO.astype("f4")), whole.f(WI.astype("f4"), WO.astype("f4"))),
        (gn.albedo(m, WI, tolerance=1e-2), gn.albedo(whole, WI, tolerance=1e-2)),
        (gn.reflected_radiance(m, light, WO, tolerance=1e-2), gn.reflected_radiance(whole, light, WO, tolerance=1e-2)),
    ]
    for got, want in pairs:
        assert np.isnan(got[1]).all()
        np.testing.assert_allclose(got[[0, 2]], want[[0, 2]], rtol=1e-12)


def test_masked_parameters_stay_so():
    """In what is made of a material; they have no JSON form. (D12)"""
    m = gn.Lambertian(MAP)
    assert np.isnan((m + gn.Phong()).replace({"1.n": 3.0}).f(WI, WO)[1]).all()
    assert m == gn.Lambertian(MAP)
    with pytest.raises(ParameterError, match="masked"):
        m.to_json()
    assert not np.isnan(m.replace(rho=0.5).f(WI, WO)).any()


def test_masked_parameters_in_other_libraries(torch):
    """The numbers are NaN there too. (D12)"""
    f = gn.Lambertian(MAP).f(torch.tensor(WI), torch.tensor(WO)).numpy()
    np.testing.assert_array_equal(np.isnan(f[:, 0]), [False, True, False])


@pytest.mark.parametrize("value", [
    np.ma.masked, np.ma.array(0.5, mask=True), np.ma.array([0.5, 0.4], mask=True), [0.5, np.ma.masked],
    np.ma.array([0.5, np.nan], mask=[1, 0]), np.ma.array([7.0, 0.5], mask=[0, 1]),
], ids=repr)  # fmt: skip
def test_parameters_without_a_number_are_refused(value):
    """A masked number is none; a mask excuses no other entry. (D12)"""
    with pytest.raises(ParameterError):
        gn.Lambertian(value)


# Directions, and numbers beside them.


def test_masked_directions_give_nan(evaluation):
    """Of wi and of wo, by component or whole; `out` too. (D12)"""
    m, mask = gn.Microfacet(gn.GGX(0.3)), np.zeros((3, 3), bool)
    mask[1, 2] = True
    plain, want = m.f(WI, WO), [False, True, False]
    for wi, wo in ((np.ma.array(WI, mask=mask), WO), (WI, np.ma.array(WO, mask=mask)), (np.ma.array(WI), WO)):
        masked = any(np.ma.getmaskarray(w).any() for w in (wi, wo))
        out = np.empty(3)
        for f in (m.f(wi, wo), m.f(wi, wo, out=out), out):
            np.testing.assert_array_equal(np.isnan(f), np.array(want) & masked)
            np.testing.assert_array_equal(f[[0, 2]], plain[[0, 2]])
        assert np.isnan(m.pdf(wi, wo)).any() == masked
        assert np.isnan(m.jacobian(wi, wo).f).any() == masked
    m.f(WI, WO)  # a plan is known now
    assert np.isnan(m.f(np.ma.array(WI, mask=mask), WO)[1])
    assert np.isnan(m.f(WI, np.ma.array(WO, mask=mask))[1])


def test_masked_random_numbers_give_nan(evaluation):
    """Of u, and of the directions to draw for. (D12)"""
    u, m = np.ma.array(np.full((3, 2), 0.3), mask=[[0, 0], [0, 1], [0, 0]]), gn.Lambertian(0.5)
    np.testing.assert_array_equal(np.isnan(m.sample(WO, u).weight), [False, True, False])
    wo = np.ma.array(WO, mask=np.arange(9).reshape(3, 3) == 4)
    np.testing.assert_array_equal(np.isnan(m.sample(wo, u.data).pdf), [False, True, False])


def test_masked_angles_give_nan():
    """`direction`, `angles` and `f_angles`. (D12)"""
    theta = np.ma.array([0.1, 0.2, 0.3], mask=[0, 1, 0])
    for found in (
        gn.direction(theta, 0.0),
        gn.direction(0.4, theta),
        gn.Lambertian(0.5).f_angles(theta, 0.0, 0.1, 0.2),
    ):
        assert type(found) is np.ndarray
        assert np.isnan(found[1]).any()
        assert not np.isnan(found[[0, 2]]).any()
    assert np.isnan(gn.angles(np.ma.array(WI, mask=np.eye(3, dtype=bool)))[0]).all()


def test_lights_see_masks():
    """Pixels are refused as NaN is; directions, positions and normals give NaN. (D12)"""
    pixels = np.ma.array(np.full((4, 8, 3), 0.5), mask=np.arange(96).reshape(4, 8, 3) == 7)
    with pytest.raises(ParameterError, match="1 of 32 pixels"):
        gn.EnvironmentLight(pixels)
    assert gn.EnvironmentLight(pixels, invalid="zero").image.pixels.min() == 0.0
    normal = np.ma.array([[0.0, 0.0, 1.0]] * 3, mask=[[0] * 3, [1] * 3, [0] * 3])
    for light in (gn.DistantLight([0.0, 0.0, 1.0], 1.0), gn.PointLight([0.0, 0.0, 2.0], 1.0)):
        for given in ({"normal": normal}, {"position": normal}):
            radiance = gn.reflected_radiance(gn.Lambertian(0.5), light, WO, **given)
            if not (isinstance(light, gn.DistantLight) and "position" in given):
                np.testing.assert_array_equal(np.isnan(radiance), [False, True, False])
    with pytest.raises(ParameterError):
        gn.PointLight(np.ma.array([0.0, 0.0, 2.0], mask=[0, 0, 1]))
    shining = gn.FunctionLight(lambda w: np.ma.masked_less(w[..., 2], 0.5))
    np.testing.assert_array_equal(np.isnan(shining.incident(WI)[:, 0]), WI[:, 2] < 0.5)


def test_other_kinds_of_array_are_arrays():
    """Matrices, records' columns and memory maps are read as the numbers that they hold. (D12)"""
    m, matrix = gn.Lambertian([0.1, 0.2, 0.3]), np.asarray(WI).view(np.matrix)
    assert type(m.f(matrix, WO)) is np.ndarray
    np.testing.assert_array_equal(m.f(matrix, WO), m.f(WI, WO))
    np.testing.assert_array_equal(m.f(WI, WO.view(np.recarray)), m.f(WI, WO))
    assert gn.Lambertian(np.array([0.1, 0.2, 0.3]).view(np.recarray)) == m


# What is no real number.

WRONG: dict[str, Any] = {
    "complex": np.array([0.1 + 0.0j, 0.2j]),
    "list of complex": [0.1, 0.2j],
    "dates": np.array(["2020-01-01", "2021-01-01"], "datetime64[D]"),
    "times": np.array([1, 2], "timedelta64[s]"),
    "words": np.array(["0.1", "0.2"]),
    "list of words": ["0.1", "0.2"],
    "bytes": np.array([b"0.1", b"0.2"]),
    "objects": np.array([0.1, None], object),
    "dates in a list": [datetime.date(2020, 1, 1)] * 2,
    "records": np.array([(0.1,), (0.2,)], [("x", float)]),
    "masked complex": np.ma.array([0.1j, 0.2], mask=[0, 1]),
    "ragged": [[0.1], [0.2, 0.3]],
}


@pytest.mark.parametrize("value", WRONG.values(), ids=WRONG)
def test_what_is_no_real_number_is_refused(value):
    """Nowhere do parts of numbers get lost: of parameters, values, uncertainties, nodes, tables, pixels. (D12)"""
    whole, two = np.full((2, 1, 1), 0.5), {"theta_i": [0.1, 0.2], "theta_o": [0.3], "phi": [0.1]}
    stacked = [[[x]] for x in value] if isinstance(value, list) else value.reshape(2, 1, 1)
    calls = [
        lambda: gn.Lambertian(value),
        lambda: value * gn.Lambertian(0.5) if isinstance(value, np.ndarray) else Scaled(value, gn.Lambertian()),
        lambda: gn.Lambertian(0.5) / (value if isinstance(value, np.ndarray) else np.array(value, object)),
        lambda: gn.Gridded("angles", two, stacked),
        lambda: gn.Gridded("angles", two, whole, uncertainty=stacked),
        lambda: gn.Gridded("angles", {**two, "theta_i": value}, whole),
        lambda: gn.Scattered([0.1, 0.2], 0.0, [0.1, 0.3], 0.0, value),
        lambda: gn.Scattered(value, 0.0, [0.1, 0.3], 0.0, [0.1, 0.2]),
        lambda: gn.TabulatedFacets([0.1, 0.2], value),
        lambda: gn.EnvironmentLight(stacked),
        lambda: gn.ConstantLight(value),
        lambda: gn.PointLight(value),
    ]
    for k, call in enumerate(calls):
        with pytest.raises(Error) as found:
            call()
        assert "\n" not in str(found.value), k


@pytest.mark.parametrize("value", WRONG.values(), ids=WRONG)
def test_directions_of_other_kinds_are_refused(value):
    """Nor of directions and random numbers. (D12)"""
    m, u = gn.Lambertian(0.5), value
    for call in (lambda: m.f(value, WO), lambda: m.f(WO, value), lambda: m.sample(WO[0], u), lambda: gn.angles(value)):
        with pytest.raises(Error):
            call()


def test_complex_tensors_are_refused(torch):
    """Of other libraries. (D12)"""
    with pytest.raises(ParameterError, match="complex"):
        gn.Lambertian(torch.tensor([0.1 + 0.2j]))
    with pytest.raises(ArrayTypeError, match="complex"):
        gn.Lambertian(0.5).f(torch.tensor(WI + 0j), torch.tensor(WO + 0j))


def test_plain_arrays_are_not_copied():
    """Masks cost those nothing who have none. (D12)"""
    x = np.arange(3.0)
    assert ops.numbers(x) is x
    assert np.shares_memory(ops.numbers(np.ma.array(x)), x)
    assert ops.numbers([1, 2**70]).dtype == np.float64
