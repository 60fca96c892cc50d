"""Stacks and polarized light: matrices as bright as f, and those of simpler models that they contain."""

from __future__ import annotations

import math

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.formula.mueller import Mueller, of_amplitudes
from gonio.layers.polarized import together
from gonio.polarization import dop, realizable

D = np.diag([1.0, 1.0, -1.0, 1.0])
METAL = gn.Conductor(0.2, 3.9)
GOLD = gn.Microfacet(gn.GGX(0.3), METAL)
Interface, Rough, Medium = gn.Interface, gn.RoughInterface, gn.Medium

FRONT = {
    "varnish": gn.Stack([Interface(1.5)], gn.Lambertian(0.5)),
    "lacquer": gn.Stack([Interface(1.5), Medium(1.0, [0.9, 0.5, 0.1], 0.3)], GOLD),
    "two coats": gn.Stack([Interface(1.5), Interface(1.2)], GOLD),
    "ground coat": gn.Stack([Rough(1.5, 0.2)], gn.Lambertian(0.5)),
    "under a smooth one": gn.Stack([Interface(1.3), Medium(0.5, 0.8), Rough(1.2, 0.2)], GOLD),
}
BOTH = {
    "milk": gn.Stack([Interface(1.5), Medium(2.0, 1.0), Interface(1.0 / 1.5)]),
    "ground": gn.Stack([Interface(1.3), Medium(0.3, 0.5), Rough(1.3, 0.3), Medium(0.2, 0.5)]),
}


def directions(n: int, lowest: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    theta, phi = np.arccos(rng.uniform(lowest, 1.0, (2, n))), rng.uniform(0.0, 2.0 * math.pi, (2, n))
    return gn.direction(theta[0], phi[0]), gn.direction(theta[1], phi[1])


@pytest.mark.parametrize("name", thinned([*FRONT, *BOTH], ["lacquer", "milk", "ground coat"]))
def test_the_first_element_is_f_and_the_matrix_can_be(name):
    """And M/n_o^2 goes the same way back."""
    m = (FRONT | BOTH)[name]
    wi, wo = directions(400, 0.02 if m.sides == "front" else -1.0)
    M, back, f = m.mueller(wi, wo), m.mueller(wo, wi), m.f(wi, wo)
    np.testing.assert_allclose(M[..., 0, 0], f, rtol=1e-11, atol=1e-15)
    assert realizable(M, 1e-9).all() and m.polarizes
    n_i, n_o = (np.where(w[:, 2] < 0.0, m.index, 1.0)[(...,) + (None,) * (M.ndim - 1)] for w in (wi, wo))
    np.testing.assert_allclose(M / n_o**2, D @ np.swapaxes(back / n_i**2, -1, -2) @ D, atol=1e-12 * M.max())


def test_an_interface_over_a_matt_base_is_a_coat():
    wi, wo = directions(400, 0.02)
    found = gn.Stack([Interface(1.5)], gn.Lambertian(0.5), tolerance=1e-5).mueller(wi, wo)
    expected = gn.Coated(gn.Lambertian(0.5)).mueller(wi, wo)
    np.testing.assert_allclose(found, expected, atol=1e-5 * expected.max())


@pytest.mark.parametrize("across", [False, True])
def test_delta_lobes_are_those_of_an_interface_and_of_a_pane(across):
    wo = gn.direction([0.0, 0.4, 1.0, 1.4, 2.2, 2.9], 0.3)
    one, glass = (m.delta_mueller(wo, across=across) for m in (gn.Stack([Interface(1.5)]), gn.SmoothDielectric(1.5)))
    np.testing.assert_allclose(one, glass, atol=1e-14)
    layers = gn.Stack([Interface(1.5), Medium(0.3, 0.0), Interface(1.0 / 1.5)])
    found, pane = layers.delta_mueller(wo, across=across), gn.ThinDielectric(1.5, 0.3).delta_mueller(wo, across=across)
    np.testing.assert_allclose(found[:, 0, 0], layers.delta_reflectance(wo, across=across), rtol=1e-12)
    np.testing.assert_allclose(found / found[:, :1, :1], pane / pane[:, :1, :1], atol=1e-12)


def test_a_mirror_below_adds_all_its_bounces():
    """The Mueller matrices of every bounce between varnish and metal; those of metal turn U to V."""
    eta, depth, theta = 1.5, 0.2, 1.2
    m = gn.Stack([Interface(eta), Medium(depth, 0.0)], gn.IdealSpecular(METAL))
    c = math.cos(theta)
    ct = math.sqrt(1.0 - (math.sin(theta) / eta) ** 2)
    r = np.array([(c - eta * ct) / (c + eta * ct), (eta * c - ct) / (eta * c + ct)])
    J, T = (np.array(of_amplitudes(*x).rows, float) for x in (r, np.sqrt(1.0 - r * r)))
    metal = np.array(METAL.polarized(ct).rows, float) * math.exp(-2.0 * depth / ct)
    total, light = J.copy(), metal @ T
    for _ in range(200):
        total += T @ light
        light = metal @ J @ light
    found = m.delta_mueller(gn.direction(theta, 0.4))
    assert abs(found[2, 3]) > 0.05
    np.testing.assert_allclose(found / found[0, 0], total / total[0, 0], atol=1e-12)
    assert found[0, 0] == pytest.approx(m.delta_reflectance(gn.direction(theta, 0.4)), rel=1e-12)


def test_light_scattered_inside_is_polarized_on_its_way_out():
    """Unpolarized inside, light is left p along the way out: by T_s and T_p of the interface alone."""
    theta, wi = 1.2, gn.direction(0.0, 0.0)
    wo = gn.direction(theta, 0.7)
    c, ct = math.cos(theta), math.sqrt(1.0 - (math.sin(theta) / 1.5) ** 2)
    T_s, T_p = (1.0 - x * x for x in ((c - 1.5 * ct) / (c + 1.5 * ct), (1.5 * c - ct) / (1.5 * c + ct)))
    S = gn.Stack([Interface(1.5), Medium(3.0, 0.9)], gn.Lambertian(0.2)).mueller(wi, wo)[:, 0]
    assert S[1] / S[0] == pytest.approx((T_s - T_p) / (T_s + T_p), rel=1e-12)
    bare = gn.Stack([Medium(3.0, 0.9)], gn.Lambertian(0.2))
    assert not bare.polarizes and not bare.mueller(wi, wo)[1:].any()
    assert dop(gn.Stack([Rough(1.5, 0.3)], gn.Lambertian(1.0)).mueller(-wo * [1, 1, -1], wo)[:, 0]) > 0.05


def test_layers_of_nothing_leave_polarization_as_it_is():
    wi, wo = directions(200, 0.02)
    empty = gn.Stack([Medium(0.0)], GOLD).mueller(wi, wo)
    np.testing.assert_allclose(empty, GOLD.mueller(wi, wo), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(gn.Stack([]).delta_mueller(wo, across=True), np.tile(np.eye(4), (200, 1, 1)), atol=1e-14)


@pytest.mark.parametrize("rest", [0.5, -0.1, -1.0, -2.0])
def test_where_the_series_rings_the_matrix_can_be_and_is_as_bright(rest):
    closed = of_amplitudes(1.0, 0.2)
    for terms, bright in (([closed], closed.rows[0][0] + rest), ([], rest)):
        rows = together(terms, Mueller.depolarizer(np.array(rest))).rows
        M = np.array([[float(x) for x in row] for row in rows])
        assert M[0, 0] == pytest.approx(bright, rel=1e-14)
        assert realizable(math.copysign(1.0, bright) * M, 1e-12)


@pytest.mark.parametrize("library", ["torch", "jax"])
def test_libraries_agree(library):
    module = pytest.importorskip("torch" if library == "torch" else "jax.numpy")
    wi, wo = directions(20, 0.02)
    m = FRONT["under a smooth one"]
    found = m.mueller(*(module.asarray(w.astype("f4")) for w in (wi, wo)))
    expected = m.mueller(wi, wo)
    np.testing.assert_allclose(np.asarray(found), expected, atol=2e-5 * expected.max())
