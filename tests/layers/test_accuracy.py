"""How good f of stacks is: beside DISORT, and where light is totally reflected, of light that may not be lost."""

import math
from pathlib import Path

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.layers.layered import _Lobe
from gonio.layers.table_lobes import _Rest, _Through

FULL = pytest.mark.full
DISORT = np.loadtxt(Path(__file__).parent / "disort.tsv", skiprows=2)
"""Rows of depth, albedo, g, mu_i, mu_o, phi and f: see benchmarks/disort.py."""

STEEP = gn.direction(np.radians(np.linspace(0.0, 88.8, 400)), 0.0)


def both_sides(w):
    return np.concatenate([w, w * [1.0, 1.0, -1.0]])


# Of backward particles the forward side has a thousandth of the peak; at -0.95 DISORT's own error there is 1.9e-3.
ERROR = {-0.95: 3e-3, -0.8: 1.5e-3}


@pytest.mark.parametrize("g", thinned([-0.95, -0.8, -0.5, 0.0, 0.5, 0.8, 0.9, 0.95], [-0.8, 0.9]))
def test_media_are_disorts(g):
    for depth, albedo in np.unique(DISORT[:, :2], axis=0):
        *_, mu_i, mu_o, phi, f = DISORT[(DISORT[:, 0] == depth) & (DISORT[:, 2] == g)].T
        m = gn.Stack([gn.Medium(depth, albedo, g)], gn.Lambertian(0.0))
        found = m.f(gn.direction(np.arccos(mu_i), 0.0), gn.direction(np.arccos(mu_o), phi))
        np.testing.assert_allclose(found, f, rtol=ERROR.get(g, 5e-4), err_msg=f"depth {depth}")


ETAS = [0.3, 0.5, 1.0 / 1.5, 0.7, 0.9, 1.03, 1.5, 3.0]
CLOSED = [
    *([gn.Interface(eta), gn.Medium(1.0, 1.0, 0.5)] for eta in ETAS),
    [gn.Medium(0.3, 1.0, -0.5), gn.Interface(0.7), gn.Medium(20.0, 1.0, 0.9)],
    [gn.Medium(0.02, 1.0, 0.5), gn.Interface(0.5), gn.Medium(0.05, 1.0, 0.8)],
    [gn.Medium(1.0, 1.0, 0.95)],
]


@pytest.mark.parametrize("layers", thinned(CLOSED, [CLOSED[k] for k in (0, 4, 9)]))
def test_white_stacks_lose_no_light_at_any_angle(layers):
    np.testing.assert_allclose(gn.albedo(gn.Stack(layers, gn.Lambertian(1.0)), STEEP), 1.0, atol=1e-4)


@pytest.mark.full
def test_the_thinnest_white_media_lose_next_to_no_light():
    m = gn.Stack([gn.Medium(0.003, 1.0, 0.9)], gn.Lambertian(1.0))
    np.testing.assert_allclose(gn.albedo(m, STEEP), 1.0, atol=5e-4)


PANES = [
    [gn.Interface(1.0 / 1.5), gn.Medium(0.5, 1.0), gn.Interface(1.5)],
    [gn.Interface(1.5), gn.Medium(0.5, 1.0, 0.5), gn.Interface(0.5)],
    [gn.Medium(0.03, 1.0, 0.5), gn.Interface(1.3), gn.Medium(1.0, 1.0, 0.8)],
]


@pytest.mark.parametrize("layers", thinned(PANES, PANES[1:2]))
def test_white_panes_lose_no_light_from_either_side(layers):
    m, w = gn.Stack(layers), both_sides(STEEP[::4])
    np.testing.assert_allclose(gn.albedo(m, w) + gn.transmittance(m, w), 1.0, atol=1e-4)


def beside(*sines):
    """Directions a degree and less to both sides of critical angles."""
    theta = np.degrees(np.arcsin(sines))[:, None] + [-1.0, -0.1, 0.1, 1.0]
    return gn.direction(np.radians(theta.reshape(-1)), 0.0)


@pytest.mark.parametrize(
    ("layers", "sines", "w"),
    [
        (CLOSED[2], [1.0 / 1.5], None),
        *(pytest.param(layers, (), STEEP, marks=FULL) for layers in CLOSED),
        pytest.param(PANES[1], [0.75, 2.0 / 3.0], None, marks=FULL),
    ],
)
def test_f_itself_integrates_to_all_light(layers, sines, w, monkeypatch):
    for lobe in (_Rest, _Through, _Lobe):
        monkeypatch.delattr(lobe, "_collected")
    m = gn.Stack(layers, None if layers in PANES else gn.Lambertian(1.0))
    w = beside(*sines) if w is None else w
    all_light = gn.albedo(m, w) + (gn.transmittance(m, w) if m.sides == "both" else 0.0)
    np.testing.assert_allclose(all_light, 1.0, atol=1e-3)


def anywhere(count, seed, sides):
    z, phi = np.random.default_rng(seed).random((2, count))
    return gn.direction(np.arccos(2.0 * z - 1.0 if sides == "both" else z), 2.0 * math.pi * phi)


NEVER_NEGATIVE = [
    gn.Stack(CLOSED[2], gn.Lambertian(1.0)),
    gn.Stack([gn.Interface(0.7)], gn.Lambertian(1.0)),
    gn.Stack([gn.Medium(1.0, 1.0, 0.95)], gn.Lambertian(0.0)),
    gn.Stack(PANES[0]),
]


@pytest.mark.parametrize("m", thinned(NEVER_NEGATIVE, NEVER_NEGATIVE[:2]))
def test_f_is_nowhere_negative(m):
    assert m.f(anywhere(100_000, 1, m.sides), anywhere(100_000, 2, m.sides)).min() >= 0.0


@pytest.mark.parametrize("base", [gn.Lambertian(0.5), pytest.param(None, marks=FULL)])
def test_channels_may_have_panels_of_their_own(base):
    etas, gs = [0.9, 1.1, 0.6], [0.5, 0.0, 0.5]
    m = gn.Stack([gn.Interface(etas), gn.Medium(1.0, 0.9, gs)], base)
    wi, wo = (anywhere(500, seed, m.sides) for seed in (3, 4))
    found = m.f(wi, wo)
    for c, (eta, g) in enumerate(zip(etas, gs, strict=True)):
        one = gn.Stack([gn.Interface(eta), gn.Medium(1.0, 0.9, g)], base).f(wi, wo)
        np.testing.assert_allclose(found[:, c], one, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("library", ["numpy", "torch", "jax.numpy"])
def test_single_precision_near_critical_angles(library):
    convert = pytest.importorskip(library).asarray
    m = gn.Stack([gn.Interface(1.0 / 1.5), gn.Medium(0.5, 0.9, 0.5)], gn.Lambertian(0.5))
    away = beside(1.0 / 1.5)
    wi, wo = np.repeat(away, len(away), axis=0), np.tile(away, (len(away), 1)) * [-1.0, 1.0, 1.0]
    found = np.asarray(m.f(*(convert(w.astype(np.float32)) for w in (wi, wo))))
    np.testing.assert_allclose(found, m.f(wi, wo), rtol=2e-4, atol=1e-6)
