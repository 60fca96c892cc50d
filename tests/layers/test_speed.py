"""Speed of stacks, counted: closed forms are integrated at few polar angles, once; kernels look for panels that are."""

import math

import numpy as np
import pytest

import gonio as gn
from gonio.formula import tree
from gonio.integrals import over_directions
from gonio.integrals.over_directions import _Integrand
from gonio.layers import layered
from gonio.layers.shared import MOST, ORDER, shared
from gonio.numerics.quadrature import Integrals

COAT = gn.Stack([gn.Interface(1.5), gn.Medium(0.5, [0.9, 0.8])], gn.Lambertian(0.5))
THIN = gn.Stack([gn.Interface([1.0 / 1.5, 0.8]), gn.Medium(1.0, 1.0, 0.5)], gn.Lambertian(1.0), tolerance=0.1)
PANE = gn.Stack([gn.Interface(1.5), gn.Medium(0.3, 0.9), gn.Interface(0.5)], tolerance=0.1)
CRITICAL = math.asin(1.0 / 1.5)


def steep(count):
    return gn.direction(np.linspace(0.0, 1.55, count), 0.2)


@pytest.fixture
def counted(monkeypatch):
    """Numbers of directions that lobes are integrated for by kernels, and of responses."""
    found = {"integrals": 0, "responses": 0}
    run, response = _Integrand.over_hemisphere, layered.response

    def counting(self, *args):
        found["integrals"] += len(self.fixed)
        return run(self, *args)

    def responding(*args):
        found["responses"] += 1
        return response(*args)

    monkeypatch.setattr(_Integrand, "over_hemisphere", counting)
    monkeypatch.setattr(layered, "response", responding)
    return found


def test_more_albedos_take_no_more_integrals(counted):
    m = COAT.replace({"base.rho": 0.4})
    gn.albedo(m, steep(1))
    first = dict(counted)
    assert first["integrals"] <= 2 * 4 * (ORDER + ORDER // 2)  # of two lobes, two pieces each, which may be halved once
    assert first["responses"] == 2  # of two channels
    gn.albedo(m, steep(2000))
    gn.absorptance(m, steep(30))
    assert counted == first
    gn.remote_sensing.white_sky_albedo(m)
    sky = dict(counted)
    assert sky["integrals"] <= 3 * first["integrals"]
    assert sky["responses"] == 2
    gn.remote_sensing.white_sky_albedo(m)
    gn.reflectance_factor(m, gn.Hemisphere(), steep(30))
    assert counted["responses"] == 2


def test_both_sides_share_a_response(counted):
    m = gn.Stack(PANE.layers, tolerance=0.1)
    w = np.concatenate([steep(3), -steep(3)])
    gn.fate(m, w)
    first = dict(counted)
    assert first["responses"] == 1
    gn.fate(m, np.concatenate([w, -steep(300)]))
    assert counted == first


@pytest.mark.parametrize("m", [COAT, THIN, PANE], ids=["coat", "thin", "pane"])
def test_albedos_between_are_those_of_integrals(m, monkeypatch):
    theta = np.concatenate(
        [[0.0, 1e-9, 1.0, 1.5, 1.57, math.pi / 2], CRITICAL + np.array([-1e-3, -1e-9, 0.0, 1e-9, 1e-3])]
    )
    w = gn.direction(theta, 0.3)
    w = np.concatenate([w, w * [1.0, 1.0, -1.0], [[math.nan, 0.0, 1.0]]])
    front = w[w[:, 2] > 0.0]

    def found():
        yield gn.albedo(m, w)
        yield gn.transmittance(m, w)
        yield gn.reflectance_factor(m, gn.Hemisphere(), front)

    between = list(found())
    monkeypatch.delattr(layered._Lobe, "_collected")
    for ours, each in zip(between, found(), strict=True):
        np.testing.assert_allclose(ours, each, atol=3e-5)


def test_one_direction_is_as_many():
    w = steep(300)
    np.testing.assert_allclose(gn.albedo(THIN, w)[::60], [gn.albedo(THIN, one) for one in w[::60]], rtol=1e-12)


@pytest.mark.parametrize("base", [gn.Microfacet(gn.GGX([0.1, 0.3, 0.2]), 0.5), gn.Lambertian([0.1, 0.3, 0.2])])
def test_channels_that_are_not_integrated_together(base, monkeypatch):
    """Of lobes of other widths, and more of them than are integrated at a time."""
    monkeypatch.setattr(over_directions, "TOGETHER", 2)
    m = gn.Stack([gn.Medium(0.3, 0.0)], base, tolerance=0.1)
    found = gn.albedo(m, steep(3))
    for c in range(3):
        one = gn.Stack(m.layers, tree.each(base, lambda x, c=c: x[c] if np.ndim(x) else x), tolerance=0.1)
        np.testing.assert_allclose(found[:, c], gn.albedo(one, steep(3)), atol=3e-5)


def of(function):
    """Integrals as `shared` asks for them, of a function of the cosine."""

    def each(w, goal):
        zero = np.zeros(len(w))
        return Integrals(function(w[:, 2])[:, None], zero, zero)

    return each


FUNCTIONS = {
    "thin": ([], lambda z: np.exp(-0.003 / z)),
    "scattered once": ([], lambda z: z * np.log(z)),
    "critical": ([0.6, 0.8], lambda z: sum(np.sqrt(np.maximum(z * z - 1.0 + s * s, 0.0)) for s in (0.6, 0.8, 1.0))),
}


@pytest.mark.parametrize(("kinks", "function"), FUNCTIONS.values(), ids=FUNCTIONS)
def test_polynomials_are_within_their_goal(kinks, function):
    w = gn.direction(np.arccos(np.concatenate([np.linspace(0.0, 1.0, 5001)[1:], 10.0 ** -np.linspace(1, 5, 200)])), 0.0)
    for goal in (1e-4, 1e-7):
        off = np.abs(shared(kinks, goal, of(function)).at(w).value[:, 0] - function(w[:, 2]))
        assert off.max() <= goal


def test_kinks_elsewhere_are_left_to_others():
    tried = []

    def each(w, goal):
        tried.append(len(w))
        return of(lambda z: np.abs(np.sin(40.0 * z)))(w, goal)

    assert shared([], 1e-7, each) is None
    assert sum(tried) <= MOST * (ORDER + ORDER // 2)
    holes = of(lambda z: z)
    assert shared([], 1e-4, lambda w, goal: holes(w, goal)._replace(missing=np.full(len(w), 0.1))) is None


def test_kernels_look_for_panels_only_where_light_is_totally_reflected():
    dense = gn.Stack([gn.Interface(1.5), gn.Medium(0.5, 0.9)], gn.Lambertian(0.5), tolerance=0.1)
    thin = dense.replace({"0.eta": 1.0 / 1.5})
    lines = [len(gn.engine.kernel(m).rewritten.splitlines()) for m in (dense, thin, thin.replace({"0.eta": 1.5}))]
    assert lines[0] == lines[2] < lines[1]
    wi, wo = gn.direction([0.2, 0.9], 0.0), gn.direction([1.2, 0.4], 2.0)
    fresh = gn.Stack([gn.Interface(1.0 / 1.5), *dense.layers[1:]], gn.Lambertian(0.5), tolerance=0.1)
    np.testing.assert_array_equal(thin.f(wi, wo), fresh.f(wi, wo))
