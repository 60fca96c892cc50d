"""A value keeps what it was made of: nobody can write to its arrays, and the caller's are its own no more."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from frozen import WI, WO, assert_frozen
from materials import DISTRIBUTIONS, draws
from seeds import small_grid
from sweeps import every

import gonio as gn
from gonio.formula.fields import Param


class Made(NamedTuple):
    """What is made of arrays, and a number that depends on every one of them."""

    make: Callable[..., Any]
    given: dict[str, Any]
    shows: Callable[[Any], Any]


def f(m: gn.Reflectance) -> np.ndarray:
    return m.f(WI, WO)


def incident(light: Any) -> np.ndarray:
    return light.incident(WI)


def grid(**given: Any) -> Made:
    axes = {"theta_i": np.linspace(0, 1.5, 4), "theta_o": np.linspace(0, 1.4, 5), "phi": np.linspace(0, 6, 6)}
    values = np.linspace(0.1, 0.9, 4 * 5 * 6).reshape(4, 5, 6)

    def make(theta_i: Any, theta_o: Any, phi: Any, values: Any, uncertainty: Any, offsets: Any) -> gn.Gridded:
        axes = {"theta_i": theta_i, "theta_o": theta_o, "phi": phi}
        about = {"offsets": offsets, "deep": [{"more": offsets}]}
        return gn.Gridded("angles", axes, values, uncertainty=uncertainty, about=about)

    def shows(m: gn.Gridded) -> list[np.ndarray]:
        held = (*m.axes.values(), m.stored, m.uncertainty, m.about["offsets"], m.about["deep"][0]["more"])
        return [m.f(WI, WO), m.valid, m.brdf(), *m.directions(), *map(np.copy, held)]

    return Made(make, {**axes, "values": values, "uncertainty": 0.1 * values, "offsets": np.arange(1.0, 4.0)}, shows)


def rows() -> Made:
    theta_i, theta_o = np.array([0.1, 0.5, 0.9, 1.2, 1.3]), np.array([0.2, 0.3, 0.1, 1.0, 0.7])
    given = {"theta_i": theta_i, "phi_i": 0.1 + 0.0 * theta_i, "theta_o": theta_o, "phi_o": 3.0 * theta_o}
    given |= {"values": theta_i + 0.5, "uncertainty": 0.1 * theta_i}
    return Made(gn.Scattered, given, lambda m: [f(m), *map(np.copy, (m.rows, m.stored, m.uncertainty, m.brdf()))])


CASES = {
    "parameter map": Made(gn.Lambertian, {"rho": np.full((3, 1), 0.5)}, f),
    "channels": Made(gn.Lambertian, {"rho": np.full(3, 0.5)}, f),
    "weight": Made(lambda w: w * gn.Lambertian(0.5) + gn.Lambertian(0.1), {"w": np.full(3, 0.5)}, f),
    "distribution": Made(lambda alpha: gn.Microfacet(gn.GGX(alpha)), {"alpha": np.full(3, 0.3)}, f),
    "replaced": Made(lambda rho: gn.Lambertian().replace(rho=rho), {"rho": np.full((3, 1), 0.5)}, f),
    "table of facets": Made(
        lambda theta, values: gn.Microfacet(gn.TabulatedFacets(theta, values)),
        {"theta": np.linspace(0.0, 1.5, 9), "values": np.linspace(1.0, 0.1, 9)},
        f,
    ),
    "grid": grid(),
    "rows": rows(),
    "image": Made(gn.EnvironmentLight, {"image": np.full((4, 8, 3), 0.5), "scale": np.full(3, 2.0)}, incident),
    "gray image": Made(gn.EnvironmentLight, {"image": np.full((4, 8), 0.5)}, incident),
    "constant light": Made(gn.ConstantLight, {"radiance": np.full(3, 0.5)}, incident),
    "point light": Made(
        gn.PointLight, {"position": np.full(3, 1.0), "intensity": np.full(3, 2.0)}, lambda x: x.arrival(WI)
    ),
    "distant light": Made(
        gn.DistantLight, {"direction": np.full(3, 1.0), "irradiance": np.full(3, 2.0)}, lambda x: x.arrival(WI)
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
@pytest.mark.parametrize("view", [False, True])
def test_what_becomes_of_the_callers_arrays_changes_nothing(case, view):
    """Arrays are copied, read-only views of arrays that may be written to as well. (D23)"""
    own = {name: array.copy() for name, array in case.given.items()}
    given = {name: array[...] for name, array in own.items()}
    for array in given.values():
        array.flags.writeable = not view
    m = case.make(**given)
    before = copy.deepcopy(case.shows(m))
    for array in own.values():
        array[...] = 0.25
    for a, b in zip(before, case.shows(m), strict=True):
        np.testing.assert_array_equal(a, b)
    fresh = case.make(**case.given)
    assert fresh == m
    for a, b in zip(case.shows(fresh), before, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_nothing_that_a_value_holds_may_be_written_to(case):
    """Nor the arrays behind a view, nor what was made of them, nor what pickles and copies hold. (D23)"""
    m = case.make(**case.given)
    case.shows(m)
    for value in (m, pickle.loads(pickle.dumps(m)), copy.deepcopy(m)):
        assert_frozen(value)
        assert value == m


@every(draw=draws(1, every=50))
def test_models_copy_their_parameters(draw):
    """Every parameter of every model that is given as an array. (D23)"""
    m = draw.material()
    own = {path: np.array([p.value] * 3, float) for path, p in m.parameters.items() if np.ndim(p.value) == 0}
    made = m.replace(own)
    assert_frozen(made)
    kept = {path: np.copy(p.value) for path, p in made.parameters.items()}
    for array in own.values():
        array[...] = -1.0
    for path, p in made.parameters.items():
        np.testing.assert_array_equal(p.value, kept[path])


@every(kind=DISTRIBUTIONS)
def test_distributions_copy_their_parameters(kind):
    """Every parameter of every distribution of normals. (D23)"""
    for name, field in kind.fields.items():
        if isinstance(field, Param):
            own = np.full(3, field.default if not isinstance(field.default, str) else 0.2)
            made = kind(**{name: own})
            assert_frozen(made)
            kept = made.__dict__[name].copy()
            own[...] = -1.0
            np.testing.assert_array_equal(made.__dict__[name], kept)


def test_the_axes_of_a_grid_cannot_be_changed():
    """`axes` and `periods` cannot be given other nodes, and pickles of them are equal. (D23)"""
    m = small_grid()
    for held in (m.axes, m.periods):
        for change in (lambda h: h.update(phi_d=1), lambda h: h.pop("phi_d"), lambda h: h.__setitem__("phi_d", 1)):
            with pytest.raises(AttributeError, match="cannot be changed"):
                change(held)
    with pytest.raises(ValueError, match="read-only"):
        m.axes["theta_h"][0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        m.stored[0] = 1.0
    assert pickle.loads(pickle.dumps(m)) == m
    assert list(m.axes) == ["theta_h", "theta_d", "phi_d"]


def test_other_interpolation_shares_the_table():
    """What a value holds already is not copied once more. (D23)"""
    m = small_grid()
    assert m.replace(interpolation="linear").stored is m.stored


def test_a_dataset_is_copied(tmp_path):
    """A measurement made of a dataset does not change with it. (D23)"""
    m = small_grid()
    ds = gn.tables.to_dataset(m)
    made = gn.tables.from_dataset(ds)
    before = made.f(WI, WO)
    for variable in ds.variables.values():
        if variable.dtype.kind == "f" and variable.values.flags.writeable:
            variable.values[...] = 0.0
    np.testing.assert_array_equal(made.stored, m.stored)
    np.testing.assert_array_equal(gn.Gridded.f(made, WI, WO), before)
