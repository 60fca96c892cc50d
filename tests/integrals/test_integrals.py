"""Albedos and the nine reflectances: closed forms, other quadrature than gonio's, limits and symmetries."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest
from house import PLASTIC
from libraries import thinned
from materials import OBEDIENT, Draw, at_bounds, draws, on_sphere

import gonio as gn
from gonio.base.sums import Sum
from gonio.errors import LeftOutWarning, MissingDataWarning, ParameterError, ToleranceWarning
from gonio.integrals import by_polar_angle, factor_between, over_directions
from gonio.integrals.cones import Cone, Rings, overlap
from gonio.numerics import quadrature
from gonio.numerics.lattice import lattice
from gonio.numerics.quadrature import CellSums, Integrals, cubature, place, weighed

PI = math.pi
GRAZING = math.radians(89.99)
LAYERED = {Draw(kind, 0) for kind in (gn.Coated, gn.RoughCoated, gn.NormalMapped, gn.RetroMicrofacet, Sum)}
"""Beside the models that compiled kernels are held to the laws of."""
X8, W8 = np.polynomial.legendre.leggauss(8)


def panels(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gauss–Legendre nodes and weights, 8 in each panel."""
    half, middle = 0.5 * np.diff(edges)[:, None], 0.5 * (edges[1:] + edges[:-1])[:, None]
    return (middle + half * X8).ravel(), (half * W8).ravel()


def by_half_vectors(
    m: gn.Reflectance, wi: np.ndarray, alpha: float, sides: int = 256, rings: int = 160, across: float | None = None
) -> float:
    """Albedo as an integral over half vectors: polar coordinates of their slopes, graded; uses m.f only.

    `across`: the scale along y, where that differs from `alpha`."""
    edges = np.concatenate([[0.0], np.geomspace(1e-4, 1e6, rings)])  # to the end: at grazing the steepest facets count
    r, dr = panels(edges)
    phi = (np.arange(sides) + 0.5) * (2.0 * PI / sides)
    along, across = alpha, across or alpha
    x, y = along * r[:, None] * np.cos(phi), across * r[:, None] * np.sin(phi)
    cos = 1.0 / np.sqrt(1.0 + x * x + y * y)
    solid = along * across * (r * dr)[:, None] * cos**3 * (2.0 * PI / sides)
    wm = np.stack([x * cos, y * cos, cos], -1)
    d = wm @ wi
    wo = 2.0 * d[..., None] * wm - wi
    up = (d > 0.0) & (wo[..., 2] > 1e-6)
    wo[~up] = [0.0, 0.0, 1.0]
    return float((solid * np.where(up, m.f(wi, wo) * wo[..., 2] * 4.0 * d, 0.0)).sum())


def by_disc(m: gn.Reflectance, wi: np.ndarray, sides: int = 768) -> float:
    """Albedo as an integral over the unit disc, in polar coordinates about the mirror point; uses m.f only."""
    low, high = np.geomspace(1e-7, 0.5, 90), 1.0 - np.geomspace(0.5, 1e-8, 50)
    t, dt = panels(np.concatenate([[0.0], low, high[1:], [1.0]]))
    phi = (np.arange(sides) + 0.5) * (2.0 * PI / sides)
    across = np.stack([np.cos(phi), np.sin(phi)], -1)
    start = -wi[:2]
    b = across @ start
    chord = -b + np.sqrt(b * b + 1.0 - start @ start)
    xy = start + (t[:, None] * chord)[..., None] * across
    wo = np.concatenate([xy, np.sqrt(np.maximum(1.0 - (xy**2).sum(-1, keepdims=True), 0.0))], -1)
    return float((m.f(wi, wo) * (t * dt)[:, None] * chord**2).sum() * (2.0 * PI / sides))


# Albedo.

ANGLES = [0.0, 60.0, 85.0, 88.0, 89.5, 89.99]


FACETS = {
    "GGX": (lambda a: gn.Microfacet(gn.GGX(a), gn.Conductor(0.18, 3.42), "separable"), 256),
    "GGX v-groove": (lambda a: gn.Microfacet(gn.GGX(a), masking="v_groove"), 768),  # grooves have edges
    "Beckmann": (lambda a: gn.Microfacet(gn.Beckmann(a)), 256),
    "Torrance-Sparrow": (gn.TorranceSparrow, 768),
}
WIDTHS = (0.001, 0.01, 0.05, 0.1, 0.3, 0.8, 1.0)
USUAL = [("GGX", 0.001), ("GGX", 0.3), ("GGX v-groove", 0.001), ("Beckmann", 0.001), ("Torrance-Sparrow", 0.3)]


@pytest.mark.parametrize(("kind", "alpha"), thinned(product(FACETS, WIDTHS), USUAL))
def test_albedo_of_facets(kind, alpha):
    made, sides = FACETS[kind]
    m, some = made(alpha), ANGLES[int(1e3 * alpha) % 2 :: 2]
    w = on_sphere(np.radians(some), 0.7)
    found = gn.albedo(m, w, return_error=True)
    expected = [by_half_vectors(m, x, alpha, sides) for x in w]
    np.testing.assert_allclose(found.value, expected, rtol=0.0, atol=1e-4 + 4e-5)  # the second: of `expected`
    assert found.error.shape == (len(w),)
    assert (found.error <= 1e-4 * np.maximum(found.value, 1.0)).all()


NARROW_METAL = gn.Conductor(0.18, 3.42)
NARROW_FACETS = [
    gn.GGX(0.05),
    gn.GGX(0.01, 0.03),
    gn.GGX(0.005),
    gn.Beckmann(0.05, 0.02),
    gn.Beckmann(0.01),
    gn.StudentT(0.02, gamma=1.8),
]


@pytest.mark.parametrize("facets", thinned(NARROW_FACETS, NARROW_FACETS[1:5:2]), ids=repr)
def test_albedo_of_narrow_lobes(facets):
    """To 1e-4 against graded rings of half vectors, which hold 2e-5 themselves; more digits where asked for."""
    masking = "separable" if facets.alpha_x > 0.01 else "height_correlated"
    m = gn.Microfacet(facets, NARROW_METAL, masking)
    w = on_sphere(np.radians([0.0, 40.0, 75.0, 88.0, 89.3]), [0.1, 0.7, 2.0, -1.0, 1.57])
    expected = [by_half_vectors(m, x, facets.alpha_x, across=facets.alpha_y) for x in w]
    found = gn.albedo(m, w, return_error=True)
    np.testing.assert_allclose(found.value, expected, rtol=0.0, atol=1e-4)
    assert (found.error <= 1e-4).all()
    fine = gn.albedo(m, w, 1e-7, return_error=True)
    np.testing.assert_allclose(fine.value, expected, rtol=0.0, atol=3e-5)
    assert (np.abs(found.value - fine.value) <= found.error + fine.error + 1e-9).all()


@pytest.mark.parametrize("facets", NARROW_FACETS, ids=repr)
def test_narrow_lobes_need_no_cells(facets, monkeypatch):
    """Rules in half vectors reach 1e-4 by themselves, on maps too; those who see no smooth facets go without them."""
    monkeypatch.setattr(over_directions, "cubature", lambda *_, **__: pytest.fail("cells"))
    w = on_sphere(np.radians([0.0, 40.0, 75.0, 85.0]), [0.1, 0.7, 2.0, -1.0])
    m = gn.Microfacet(facets, NARROW_METAL)
    one = gn.albedo(m, w)
    assert ((one > 0.5) & (one < 1.0)).all()
    map_of = gn.Microfacet(facets.replace(alpha_x=np.full((2, 1, 1), facets.alpha_x)), NARROW_METAL)
    np.testing.assert_allclose(gn.albedo(map_of, w)[..., 0], np.broadcast_to(one, (2, 4)), atol=1e-4)
    for other in (gn.Microfacet(facets, NARROW_METAL, "v_groove"), gn.RetroMicrofacet(facets), gn.Lambertian(0.5)):
        assert other.hints.spread is None


def test_estimates_of_rules_see_what_waves_hide():
    """From the normal, facets that differ along x and y have even waves alone; at grazing a rough rim bends."""
    for facets in (gn.GGX(0.003, 0.29), gn.GGX(0.17, 0.79), gn.Beckmann(0.5, 0.01), gn.GGX(0.9)):
        m = gn.Microfacet(facets, 1.0, "separable")
        w = on_sphere(np.radians([0.0, 7.95, 61.0, 86.0, 89.95]), [0.0, 0.3, 1.0, 2.0, 0.7])
        fine = gn.albedo(m, w, 1e-8, return_error=True)
        for tolerance in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
            found = gn.albedo(m, w, tolerance, return_error=True)
            error = np.abs(found.value - fine.value)
            assert (error <= found.error + fine.error).all()
            assert (found.error <= tolerance).all()


@pytest.mark.parametrize(
    "m",
    [
        gn.Lambertian(0.5),
        *thinned((gn.ModifiedPhong(0.5, n) for n in (1.0, 20.0, 1e4)), [gn.ModifiedPhong(0.5, 1e4)]),
        *thinned([gn.ABC(2.0, 100.0, 0.5), gn.ABC(100, 1e6, 1)], [gn.ABC(2.0, 100.0, 0.5)]),
    ],
    ids=repr,
)
def test_albedo_of_lobes(m):
    w = on_sphere(np.radians(ANGLES), -1.2)
    np.testing.assert_allclose(gn.albedo(m, w), [by_disc(m, x) for x in w], rtol=0.0, atol=1.1e-4)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-8])
def test_albedo_in_closed_form(tolerance):
    """GGX(1), F = 1: 1 - mu ln((1 + mu)/mu), and separable 2 (1 - ln 2)/(1 + mu); at grazing too."""
    theta = np.radians([0.0, 45.0, 80.0, 89.0, 89.9, 89.99])
    w, mu = on_sphere(theta, 0.3), np.cos(theta)
    correlated = gn.albedo(gn.Microfacet(gn.GGX(1.0)), w, tolerance, return_error=True)
    separable = gn.albedo(gn.Microfacet(gn.GGX(1.0), masking="separable"), w, tolerance, return_error=True)
    for found, exact in (
        (correlated, 1.0 - mu * np.log((1.0 + mu) / mu)),
        (separable, 2.0 * (1.0 - math.log(2.0)) / (1.0 + mu)),
    ):
        error = np.abs(found.value - exact)
        assert (error <= 3.0 * found.error + 1e-12).all()
        assert (error <= tolerance).all()
        assert (found.error <= tolerance).all()


@pytest.mark.parametrize("draw", thinned(draws(2, every=5), {*sorted(OBEDIENT, key=str)[::2]} | LAYERED), ids=str)
def test_the_estimate_covers_the_error(draw):
    m = draw.material()
    w = on_sphere(np.radians([0.0, 35.0, 70.0, 86.0, 89.9]), [0.0, 0.5, 1.0, -2.0, 3.0])
    rough, fine = gn.albedo(m, w, 1e-3, return_error=True), gn.albedo(m, w, 1e-5, return_error=True)
    error = np.abs(rough.value - fine.value) - fine.error - 1e-6
    assert (error <= 1e-3 * np.maximum(fine.value, 1.0)).all()
    assert (error <= rough.error).all()


@pytest.mark.parametrize(
    ("model", "structures"),
    [
        (gn.Microfacet, 3),
        pytest.param(gn.Microfacet, None, marks=pytest.mark.full),
        (gn.ModifiedPhong, None),
        (gn.ABC, None),
    ],
)
def test_albedo_at_the_bounds_of_parameters(model, structures):
    w = on_sphere([0.0, 1.0, GRAZING], 0.4)
    for m in at_bounds(model, structures):
        found = gn.albedo(m, w, return_error=True)
        assert np.isfinite(found.value).all()
        assert (found.error <= 1e-4 * np.maximum(found.value, 1.0)).all()


def test_albedo_shapes_and_dtypes():
    m = gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.2), gn.Conductor([0.2, 0.9, 1.2], [3.9, 2.4, 2.3]))
    w = on_sphere(np.radians([[5.0, 50.0, 80.0]]), 0.1)
    found = gn.albedo(m, w, return_error=True)
    assert found.value.shape == (1, 3, 3)
    assert found.error.shape == (1, 3)
    single = gn.albedo(m, w.astype(np.float32), return_error=True)
    assert single.value.dtype == np.float32
    np.testing.assert_allclose(single.value, found.value, atol=2e-6)
    assert gn.albedo(gn.Lambertian(0.3), w[0, 0]).shape == ()
    assert gn.albedo(m, np.zeros((0, 3))).shape == (0, 3)
    assert np.isscalar(gn.albedo(m, w[0, 0], return_error=True).error)


def test_albedo_of_a_direction_without_numbers():
    m = gn.Microfacet(gn.GGX(0.2))
    w = on_sphere([0.3, 1.0, 2.0], 0.0)
    w[0] = np.nan
    found = gn.albedo(m, w, return_error=True)
    assert np.isnan(found.value[0])
    assert found.value[1] == gn.albedo(m, w[1])
    assert found.value[2] == 0.0


def test_channels_are_integrated_as_each_alone():
    """Ten of them, in groups of equal and of different width; the colour of a light goes with its channel."""
    alpha = np.repeat([0.05, 0.3, 0.31], [3, 6, 1])
    F = np.linspace(0.1, 1.0, 10)
    m = gn.Microfacet(gn.GGX(alpha), F)
    w = on_sphere([0.2, 1.3], 0.5)
    together = gn.albedo(m, w, 1e-5)
    sky = np.linspace(1.0, 2.0, 10)
    lit = gn.reflected_radiance(m, gn.FunctionLight(lambda w: sky + 0.0 * w[..., :1]), w, tolerance=1e-5)
    for c in range(10):
        alone = gn.albedo(gn.Microfacet(gn.GGX(alpha[c]), F[c]), w, 1e-5)
        np.testing.assert_allclose(together[:, c], alone, atol=2e-5)
        np.testing.assert_allclose(lit[:, c], sky[c] * alone, atol=6e-5)


WEIGHTS = np.array([0.2, 0.6, 0.7])
COLOURLESS = {
    "stack": lambda k: gn.Stack([gn.Interface(1.5)], k * gn.Lambertian(0.9)),
    "both sides": lambda k: gn.Sheet(k * gn.Lambertian(0.5), gn.Lambertian(0.3), k * gn.Lambertian(0.4)),
    "fuzz": lambda k: gn.OpenPBRFuzz(k * gn.Lambertian(0.5), 0.3),
    "mirror on a map": lambda k: np.array([[[0.5]], [[0.8]], [[0.3]]]) * (k * gn.IdealSpecular(gn.Dielectric(1.5))),
    "map": lambda k: k * (gn.Lambertian(np.linspace(0.1, 0.9, 3)[:, None, None]) + gn.ThinDielectric(1.5)),
}


@pytest.mark.parametrize("made", COLOURLESS.values(), ids=COLOURLESS)
def test_as_many_directions_as_channels(made):
    """A weight for each channel is none for each direction, and a map none for either."""
    w = on_sphere([[0.1, 0.7, 1.3]] * 3, 0.4)
    for call in (gn.albedo, gn.transmittance):
        found = call(made(WEIGHTS), w)
        assert found.shape == (3, 3, 3)
        np.testing.assert_allclose(found, np.concatenate([call(made(k), w) for k in WEIGHTS[:, None]], -1), atol=1e-4)


def test_channels_of_what_transmits_are_those_of_what_reflects():
    m = gn.Lambertian(0.1) + gn.DiffuseTransmission([0.2, 0.3, 0.4])
    for call in (gn.albedo, gn.reflectance, gn.reflectance_factor):
        np.testing.assert_allclose(call(m, [0.0, 0.0, 1.0]), [0.1] * 3, atol=1e-4)
    for call in (gn.remote_sensing.white_sky_albedo, gn.reflectance):
        np.testing.assert_allclose(call(m), [0.1] * 3, atol=1e-4)
    assert gn.reflectance(gn.DiffuseTransmission([[0.2], [0.3]]), return_error=True).error.shape == (2,)


# Many polar angles.

SMOOTH = {
    "gold": gn.Microfacet(gn.GGX(0.2), gn.Conductor([0.2, 0.9, 1.2], [3.9, 2.4, 2.3])),
    "narrow": gn.Microfacet(gn.GGX(0.002), gn.Dielectric(1.5)),
    "out of glass": gn.RoughDielectric(gn.GGX(0.02), 1.0 / 1.5),
    "bent": gn.OpenPBRCoat(gn.Lambertian(0.5), 0.8),
}


@pytest.mark.parametrize("m", SMOOTH.values(), ids=SMOOTH)
def test_many_angles_are_integrated_as_each_alone(m, monkeypatch):
    theta = np.concatenate([np.linspace(0.0, 1.5, 90), 0.5 * PI - np.geomspace(1e-4, 0.05, 30)])
    w = on_sphere(theta, np.linspace(0.0, 20.0, len(theta)))
    for call in (gn.albedo,) if m.sides == "front" else (gn.albedo, gn.transmittance):
        each = call(m, w, 1e-4)
        monkeypatch.setattr(by_polar_angle, "ALONE", 3)
        found = call(m, w, 1e-4, return_error=True)
        monkeypatch.undo()
        off = np.abs(found.value - each).reshape(len(w), -1).max(axis=-1)
        assert (off <= 1e-4 * np.maximum(1.0, each.reshape(len(w), -1).max(axis=-1))).all()
        assert (off > 0.0).any()
        assert (found.error <= 1e-4 * np.maximum(1.0, each.max())).all()


def test_a_million_angles_need_few_integrals(monkeypatch):
    counts, hemisphere = [], over_directions._Integrand.over_hemisphere

    def counted(integrand, *more):
        counts.append(len(integrand.fixed))
        return hemisphere(integrand, *more)

    monkeypatch.setattr(over_directions._Integrand, "over_hemisphere", counted)
    w = on_sphere(np.linspace(0.0, 1.57, 100_000), np.linspace(0.0, 20.0, 100_000))
    gn.albedo(SMOOTH["gold"], w)
    assert sum(counts) < 500
    counts.clear()
    gn.albedo(SMOOTH["gold"], on_sphere(np.repeat([0.3, 1.2, 2.0], 1000), np.linspace(0.0, 20.0, 3000)))
    assert sum(counts) == 3
    counts.clear()
    turned = gn.Microfacet(gn.GGX(0.2, 0.3))
    found = gn.albedo(turned, on_sphere(0.8, np.linspace(0.0, 1.5, 300)))
    assert sum(counts) == 300
    assert np.ptp(found) > 1e-3


@pytest.mark.parametrize(
    "of_angle",
    [
        lambda t: 0.3 + 0.2 * np.cos(t) - 0.1 * np.sin(t),
        lambda t: np.where(t < 0.7, 0.2, 0.9),
        lambda t: np.abs(t - 0.4) + np.sqrt(np.maximum(np.sin(t - 0.9), 0.0)),
        lambda t: np.sin(40.0 * t) ** 2,
        lambda t: 40.0 * t * np.cos(t),  # to the tolerance of its size
        lambda t: 0.01 / (0.01 + np.cos(t)),
    ],
    ids=["smooth", "step", "bends", "waves", "large", "steep"],
)
def test_between_polar_angles(of_angle):
    """What is not smooth is found, and integrated by itself where it is."""
    w = on_sphere(np.random.default_rng(2).uniform(0.0, 0.5 * PI - 1e-5, 20_000), 0.3)
    counts = []

    def direct(w, tolerance, unit):
        counts.append(len(w))
        value = of_angle(np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2]))[:, None] * [1.0, 0.2]
        return Integrals(value, 0.1 * tolerance, np.zeros(len(w)))

    goal = np.full(len(w), 1e-4)
    found = by_polar_angle.by_polar_angle(gn.Lambertian(0.5), w, goal, np.ones(len(w)), direct)
    exact = direct(w, goal, goal).value
    error = np.abs(found.value - exact).max(axis=-1)
    size = np.maximum(1.0, np.abs(exact).max(axis=-1))
    assert (error <= found.error).all()
    assert (found.error <= 1e-4 * size).all()
    assert sum(counts[:-1]) < 2500


def test_holes_between_polar_angles_are_integrated_by_themselves():
    w = on_sphere(np.linspace(0.0, 1.5, 5000), 0.3)

    def direct(w, tolerance, unit):
        return Integrals(w[:, 2:], 0.0 * tolerance, np.where(w[:, 2] < 0.5, 0.1, 0.0))

    found = by_polar_angle.by_polar_angle(gn.Lambertian(0.5), w, np.full(5000, 1e-4), np.ones(5000), direct)
    np.testing.assert_array_equal(found.missing, np.where(w[:, 2] < 0.5, 0.1, 0.0))


def test_panels_end_at_nodes_of_tables():
    axes = {"theta_i": [0.0, 0.5, 1.0], "theta_o": [0.0, 0.7, 1.5], "phi": [0.0]}
    m = gn.Coated(gn.Gridded("angles", axes, np.full((3, 3, 1), 0.1)))
    assert {0.5, 0.7, 1.0} <= set(by_polar_angle._bends(m))


def test_narrow_panels_of_a_table_cost_nothing():
    """Sixty of them, of 300 angles: each is integrated once, and nothing between them."""
    counts, theta = [], np.linspace(0.0, 1.5, 61)
    m = gn.Gridded("angles", {"theta_i": theta, "theta_o": [0.0, 1.5], "phi": [0.0]}, np.full((61, 2, 1), 0.1))

    def direct(w, tolerance, unit):
        counts.append(len(w))
        return Integrals(w[:, 2:], 0.0 * tolerance, 0.0 * tolerance)

    w = on_sphere(np.linspace(0.0, 1.5, 300), 0.3)
    found = by_polar_angle.by_polar_angle(m, w, np.full(300, 1e-4), np.ones(300), direct)
    np.testing.assert_array_equal(found.value, w[:, 2:])
    assert counts == [300]


@pytest.mark.parametrize(
    ("channels", "masking"),
    thinned(product((31, 401), ("height_correlated", "v_groove")), [(31, "v_groove"), (401, "height_correlated")]),
)
def test_albedo_of_many_channels(channels, masking):
    """In compiled kernels, as each alone, for smooth lobes and for those that cells integrate."""
    eta, k = np.linspace(0.2, 1.3, channels), np.linspace(3.9, 2.0, channels)
    w = on_sphere([0.2, 1.3, 1.56], 0.5)
    many = gn.albedo(gn.Microfacet(gn.GGX(0.1), gn.Conductor(eta, k), masking), w)
    assert many.shape == (3, channels)
    for c in (0, 17, channels - 1):
        alone = gn.albedo(gn.Microfacet(gn.GGX(0.1), gn.Conductor(eta[c], k[c]), masking), w, 1e-6)
        np.testing.assert_allclose(many[:, c], alone, atol=1e-4)


def test_a_tolerance_that_is_not_reached_is_said(monkeypatch):
    monkeypatch.setattr(quadrature, "STAGES", ((8, 8), (4, 8)))
    with pytest.warns(ToleranceWarning, match=r"1 of 1 integrals may be up to 0\.\d"):
        found = gn.albedo(gn.Microfacet(gn.GGX(0.1)), on_sphere(1.5, 0.0), 1e-9, return_error=True)
    assert found.error > 1e-9
    with pytest.warns(ToleranceWarning):
        gn.reflectance(gn.Microfacet(gn.GGX(0.1)), on_sphere(0.7, 0.0), Cone((-1, 0, 1), 0.3), tolerance=1e-9)


def test_the_tolerance_goes_with_the_light():
    """Of a light of radiance 1e6, or 1e-6, the same digits are right."""
    m, wo = gn.Microfacet(gn.GGX(0.1)), on_sphere([0.4, 1.45], 0.3)
    exact = gn.albedo(m, wo, 1e-7)
    for scale in (1e-6, 1.0, 1e6):
        radiance = gn.reflected_radiance(m, gn.ConstantLight(scale), wo) / scale
        np.testing.assert_allclose(radiance, exact, atol=1e-4)


# The quadrature alone.


def integral(f, tolerance=1e-6, seam=0.0, seeds=None, **options):
    def evaluate(rows, cells):
        u, area = place(cells.T[..., None], quadrature.NODES.T)
        return CellSums(weighed((f(*u) * area)[..., None]), 0.0, 0.0)

    found = cubature(evaluate, 1, quadrature.Goal(tolerance, **options), seam, seeds)
    return found.value[0, 0], found.error[0]


@pytest.mark.parametrize(
    ("f", "exact"),
    [
        (lambda x, y: x**5 * y**3, 1.0 / 24.0),
        (lambda x, y: np.exp(x - 2.0 * y), (math.e - 1.0) * 0.5 * (1.0 - math.exp(-2.0))),
        (lambda x, y: np.abs(x - y / 3.0 - 0.2), 187.0 / 675.0),
        (lambda x, y: (x * x + y * y < 1.0) + 0.0, PI / 4.0),
        (lambda x, y: 1.0 / np.sqrt(x * y), 4.0),
        (lambda x, y: (x > 0.999) + 0.0 * y, 1e-3),
    ],
    ids=["polynomial", "smooth", "kink", "jump", "roots", "strip"],
)
def test_cubature(f, exact):
    for tolerance in (1e-3, 1e-5):
        value, error = integral(f, tolerance)
        assert abs(value - exact) <= tolerance * max(1.0, exact)
        assert error <= tolerance * max(1.0, exact)


@pytest.mark.parametrize("place", [(0.582, 0.362), (0.564, 0.638), (0.69, 0.202), (0.714, 0.22), (0.638, 0.305)])
def test_small_details_are_seen_where_the_tolerance_is_small(place):
    """A bump that is 200 times narrower than the square, and a hundredth of the integral."""

    def bump(x, y):
        return 1.0 + 0.01 * np.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / 5e-5) / (5e-5 * PI)

    assert integral(bump, 1e-6)[0] == pytest.approx(1.01, abs=2e-6)


def test_cubature_with_a_seam_and_with_seeds():
    def jump(x, y):
        return np.where(x < 0.3, np.sin(x) * y, 2.0 + x * y)

    exact = 0.5 * (1.0 - math.cos(0.3)) + 1.4 + 0.25 * (1.0 - 0.09)
    assert integral(jump, 1e-9, seam=0.3)[0] == pytest.approx(exact, abs=1e-9)

    def peak(x, y):
        return np.exp(-((x - 0.731) ** 2 + (y - 0.219) ** 2) / 2e-8) / (2e-8 * PI)

    assert integral(peak, 1e-4)[0] < 0.5  # not seen
    value, error = integral(peak, 1e-4, seeds=np.array([[[0.731, 0.219, 3e-4, 3e-4]]]))
    assert value == pytest.approx(1.0, abs=1e-4)
    assert error <= 1e-4


# Geometries.


@cache
def spread(count: int) -> np.ndarray:
    """Directions (count, 3), evenly over the hemisphere."""
    return on_sphere(np.arccos(1.0 - (np.arange(count) + 0.5) / count), np.arange(count) * 2.399963229728653)


@pytest.mark.parametrize(
    "cone", [Cone((0, 0, 1), 0.4), Cone(on_sphere(1.4, 2.0), 0.5), Cone(on_sphere(1.8, -1.0), 1.0)]
)
def test_coordinates_of_a_cone(cone):
    """They cover it, within it; the projected solid angle is that of the closed form."""
    x, w = panels(np.linspace(0.0, 1.0, 41))
    seam = cone.seam
    total = 0.0
    for low, high in ((0.0, seam), (seam, 1.0)):
        u0, u1 = low + (high - low) * x[:, None] ** 2, x
        directions, solid = cone.points(u0, u1)
        assert cone.contains(directions).mean() > 0.95  # but for the rim and the horizon, by rounding
        total += ((high - low) * 2.0 * x * w) @ np.broadcast_to(solid, (len(x), len(x))) @ w
        x0, x1, _ = cone._inverse(directions)
        inner = (
            solid > 1e-3 * cone.projected
        )  # at the pole and where a circle is all below the horizon azimuths mean nothing
        np.testing.assert_allclose(x0[inner], np.broadcast_to(u0, x0.shape)[inner], atol=1e-6)
        np.testing.assert_allclose(x1[inner], np.broadcast_to(u1, x1.shape)[inner], atol=1e-6)
    assert total == pytest.approx(cone.projected, rel=1e-5)
    many = spread(300_000)
    share = (many[:, 2] * cone.contains(many)).mean() * 2.0 * PI
    assert share == pytest.approx(cone.projected, rel=2e-3)


@pytest.mark.parametrize(
    ("polar", "half_angle"), [(0.2, 0.5), (0.5, 0.5), (0.6, 0.5), (1.4, 0.5), (1.8, 1.0), (1.5, 1.57)]
)
def test_rings_of_a_cone(polar, half_angle):
    """They cover it, within it; each is at one polar angle."""
    rings = Rings(Cone(on_sphere(polar, 2.0), half_angle))
    halves = [(0.0, rings.seam), (rings.seam, 1.0 - rings.seam)]
    cells = np.array([(low, size, 0.0, 0.0, 1.0, 1.0) for low, size in halves])
    x, w = panels(np.linspace(0.0, 1.0, 41))
    u, area = place(cells.T[:, :, None, None], (x[:, None], x[None, :]))
    directions, solid = rings.points(*u)
    assert rings.cone.contains(directions)[solid * area > 1e-12].mean() > 0.99  # but for the rim, by rounding
    assert np.ptp(directions[..., 2], axis=-1).max() == 0.0
    assert np.einsum("pij,i,j->", area * solid, w, w) == pytest.approx(rings.projected, rel=1e-10)


def test_an_isotropic_material_in_a_tilted_cone_is_integrated_by_polar_angle(monkeypatch):
    rough = gn.tables.tabulate(gn.Lambertian(0.3), "angles", (9, 9, 12))
    rough = rough.with_brdf(rough.brdf() * (1.0 + 0.3 * np.random.default_rng(0).standard_normal(rough.stored.shape)))
    counts, single = [], factor_between.single_integral

    def counted(m, known, *more, **others):
        counts.append(len(known))
        return single(m, known, *more, **others)

    monkeypatch.setattr(factor_between, "single_integral", counted)
    cone = Cone(on_sphere(1.3, 0.2), 0.5)
    value = gn.reflectance_factor(rough, gn.Hemisphere(), cone, tolerance=1e-2)
    assert sum(counts) < 300
    wo, solid = cone.points(*lattice(400).T)
    each = gn.reflectance_factor(rough, gn.Hemisphere(), wo, tolerance=1e-2)
    assert value == pytest.approx(np.average(each, weights=solid), abs=1e-2)


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (Cone((0, 0, 1), 0.4), Cone((0, 0, 1), 0.2)),
        (Cone(on_sphere(0.6, 0.2), 0.3), Cone(on_sphere(0.8, 0.4), 0.35)),
        (Cone(on_sphere(1.4, 2.0), 0.6), Cone(on_sphere(1.5, 2.6), 0.5)),
        (Cone(on_sphere(1.3, 3.0), 1.5), Cone(on_sphere(1.3, -0.5), 1.5)),
        (Cone(on_sphere(1.3, 3.0), 1.2), gn.Hemisphere()),
    ],
)
@pytest.mark.parametrize(("count", "edges"), thinned([(100_000, 51), (300_000, 101)], [(100_000, 51)]))
def test_overlap_of_cones(a, b, count, edges):
    many = spread(count)
    expected = (many[:, 2] * (a.contains(many) & b.contains(many))).mean() * 2.0 * PI
    x, w = panels(np.linspace(0.0, 1.0, edges))
    for first, second in ((a, b), (b, a)):
        points, _ = overlap(first, second)
        directions, solid = points(x[:, None], x)
        assert (first.contains(directions) & second.contains(directions)).mean() > 0.999
        assert w @ np.broadcast_to(solid, (len(x), len(x))) @ w == pytest.approx(expected, rel=3e-3)
    assert overlap(Cone((0, 0, 1), 0.2), Cone((0, 1, 0), 0.3)) is None


# The nine reflectances.

A, B = on_sphere(0.5, 0.3), on_sphere(1.0, 2.0)
NARROW, WIDE, LOW = Cone(on_sphere(0.6, 0.2), 0.1), Cone(on_sphere(0.3, 2.0), 0.6), Cone(on_sphere(1.4, 3.0), 0.5)
SKY = gn.Hemisphere()
MATERIALS = {
    "plastic": PLASTIC,
    "brushed": gn.Microfacet(gn.GGX(0.15, 0.5), gn.Conductor([0.2, 0.9], [3.9, 2.4])),
    "polished": gn.Microfacet(gn.Beckmann(0.02)),
}
each_material = pytest.mark.parametrize("m", MATERIALS.values(), ids=MATERIALS)
each_but_polished = pytest.mark.parametrize(
    "m", [pytest.param(m, id=k, marks=pytest.mark.full if k == "polished" else ()) for k, m in MATERIALS.items()]
)


@pytest.mark.parametrize("tolerance", thinned([1e-2, 1e-4], [1e-2]))
def test_all_nine_of_a_lambertian_surface(tolerance):
    """R = rho, whatever the geometry; the reflectance is rho times the projected solid angle over pi."""
    m = gn.Lambertian([0.4, 0.7])
    for incident in (A, NARROW, SKY):
        for collected in (B, LOW, SKY):
            found = gn.reflectance_factor(m, incident, collected, tolerance=tolerance)
            np.testing.assert_allclose(found, [0.4, 0.7], rtol=1e-8)
    for collected, size in ((WIDE, PI * math.sin(0.6) ** 2 * math.cos(0.3)), (SKY, PI)):
        for incident in (A, NARROW, SKY):
            found = gn.reflectance(m, incident, collected, tolerance=tolerance)
            np.testing.assert_allclose(found, np.array([0.4, 0.7]) * size / PI, rtol=1e-8)


@pytest.mark.parametrize(
    ("masking", "average"),
    [("height_correlated", 4.0 / 3.0 * (1.0 - math.log(2.0))), ("separable", 4.0 * (1.0 - math.log(2.0)) ** 2)],
)
def test_white_sky_albedo_in_closed_form(masking, average):
    """0.4091370926 and 0.3766346112: GGX(1) with F = 1."""
    m = gn.Microfacet(gn.GGX(1.0), masking=masking)
    found = gn.reflectance(m, SKY, SKY, return_error=True)
    assert abs(found.value - average) <= found.error <= 1e-4
    assert gn.remote_sensing.white_sky_albedo(m, tolerance=1e-6) == pytest.approx(average, abs=1e-6)


def test_white_sky_albedo_of_a_mirror():
    """Schlick's average is F0 + (1 - F0)/21, a dielectric's of n = 1.5 is 0.09177795934."""
    assert gn.remote_sensing.white_sky_albedo(gn.IdealSpecular(gn.Schlick(0.04))) == pytest.approx(
        0.04 + 0.96 / 21.0, abs=1e-6
    )
    assert gn.remote_sensing.white_sky_albedo(gn.IdealSpecular(gn.Dielectric(1.5))) == pytest.approx(
        0.09177795934, abs=1e-6
    )


def test_hemispheres_are_albedos():
    w = on_sphere([0.2, 1.0, 1.5], 0.4)
    np.testing.assert_allclose(gn.reflectance(PLASTIC, w, SKY), gn.albedo(PLASTIC, w), atol=1e-4)
    np.testing.assert_allclose(gn.reflectance_factor(PLASTIC, SKY, w), gn.albedo(PLASTIC, w), atol=1e-4)
    np.testing.assert_allclose(
        gn.remote_sensing.black_sky_albedo(PLASTIC, [0.2, 1.0, 1.5], 0.4), gn.albedo(PLASTIC, w), rtol=1e-12
    )
    np.testing.assert_allclose(gn.reflectance_factor(PLASTIC, A, w), PI * PLASTIC.f(A, w), rtol=1e-12)


def test_black_white_and_blue_sky():
    m = gn.Lambertian([0.1, 0.5]) + gn.ModifiedPhong(0.3, 5.0)
    theta = np.array([0.1, 1.2])
    black, white = gn.remote_sensing.black_sky_albedo(m, theta), gn.remote_sensing.white_sky_albedo(m)
    blue = gn.remote_sensing.blue_sky_albedo(m, theta, [0.25, 1.0])
    np.testing.assert_allclose(blue[0], 0.75 * black[0] + 0.25 * white, rtol=1e-12)
    np.testing.assert_allclose(blue[1], white, rtol=1e-12)
    sun = gn.DistantLight(on_sphere(1.2, 0.0), 3.0 / math.cos(1.2))  # irradiance 3, and pi L = 1 from the sky
    lit = gn.reflectance(m, SKY, SKY, sky=[sun, gn.ConstantLight(1.0 / PI)])
    np.testing.assert_allclose(lit, gn.remote_sensing.blue_sky_albedo(m, 1.2, 0.25), atol=1e-4)


def brute(m: gn.Reflectance, incident, collected, n: int = 16, radiance=None):
    """The reflectance factor by Gauss–Legendre products in polar coordinates of each geometry, horizon masked."""

    def nodes(g):
        if isinstance(g, np.ndarray):
            return g[None], np.array([PI])
        axis, reach = (
            (np.array([0.0, 0.0, 1.0]), 0.5 * PI) if isinstance(g, gn.Hemisphere) else (np.array(g.axis), g.half_angle)
        )
        t = np.cross(axis, [0.3, 0.8, 0.52])
        t /= np.linalg.norm(t)
        r, dr = panels(np.linspace(0.0, reach, n // 4 + 1))
        phi = (np.arange(3 * n) + 0.5) * (2.0 * PI / (3 * n))
        side = np.cos(phi)[:, None] * t + np.sin(phi)[:, None] * np.cross(axis, t)
        w = np.cos(r)[:, None, None] * axis + np.sin(r)[:, None, None] * side
        solid = np.broadcast_to((np.sin(r) * dr)[:, None] * (2.0 * PI / (3 * n)), w.shape[:-1])
        w, cos = w.reshape(-1, 3), np.maximum(w[..., 2], 0.0)
        return w, (solid * cos).reshape(-1)

    (wi, di), (wo, do) = nodes(incident), nodes(collected)
    lit = di if radiance is None else di * radiance(wi)
    total: float | np.ndarray = 0.0
    for k in range(len(wo)):
        f = m.f(wi, wo[k])
        total = total + do[k] * (lit @ f)
    return PI * total / (lit.sum() * do.sum())


def pairs_of_geometries():
    """Every one with every one. Those of two cones take long, and are `full`, as are others of the low one; by default
    `both_orders` has two small ones."""
    kinds = {"direction": A, "wide": WIDE, "low": LOW, "hemisphere": SKY}
    for incident, i in kinds.items():
        for collected, o in ({"narrow": NARROW} | kinds | {"direction": B}).items():
            both = isinstance(i, Cone) and isinstance(o, Cone)
            marks, nodes = pytest.mark.full if both or i is LOW or o is LOW else (), 24 if both else 16
            yield pytest.param(i, o, 1e-4, nodes, id=f"{incident}-{collected}", marks=marks)
    yield pytest.param(WIDE, WIDE, 1e-3, 16, id="wide-wide, coarsely", marks=pytest.mark.full)
    yield pytest.param(LOW, NARROW, 1e-3, 16, id="low-narrow, coarsely", marks=pytest.mark.full)
    yield pytest.param(WIDE, NARROW, 1e-2, 8, id="wide-narrow, coarsely", marks=pytest.mark.full)


@pytest.mark.parametrize(("incident", "collected", "tolerance", "nodes"), [*pairs_of_geometries()])
def test_by_brute_force(incident, collected, tolerance, nodes):
    m = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.5, 0.9), gn.Dielectric(1.5))
    found = gn.reflectance_factor(m, incident, collected, tolerance=tolerance, return_error=True)
    assert found.value == pytest.approx(brute(m, incident, collected, nodes), rel=3e-3)
    assert found.error <= tolerance


@each_material
@pytest.mark.parametrize(
    "pair",
    [
        pytest.param((NARROW, WIDE), marks=pytest.mark.full, id="CC"),
        pytest.param((WIDE, SKY), id="CH"),
        pytest.param((A, LOW), id="DC"),
        pytest.param((SKY, B), marks=pytest.mark.full, id="HD"),
    ],
)
def test_reciprocity(m, pair):
    there = gn.reflectance_factor(m, *pair, tolerance=1e-3, return_error=True)
    back = gn.reflectance_factor(m, *pair[::-1], tolerance=1e-3, return_error=True)
    np.testing.assert_allclose(there.value, back.value, atol=float(np.max(there.error + back.error)) + 1e-12)


def both_orders(m, wide, tolerance, nodes, monkeypatch):
    """The larger geometry outside, which needs more, gives the same: it is the other order of integration. So does a
    plain sum."""
    smaller = gn.reflectance_factor(m, NARROW, wide, tolerance=tolerance)
    monkeypatch.setattr(factor_between, "smaller_first", lambda of, to: of.projected > to.projected)
    larger = gn.reflectance_factor(m, NARROW, wide, tolerance=tolerance)
    near = max(tolerance, 3e-3)
    np.testing.assert_allclose(larger, smaller, rtol=near, atol=near)
    np.testing.assert_allclose(smaller, brute(m, NARROW, wide, nodes), rtol=3e-3)


@pytest.mark.full
@each_but_polished
def test_either_integral_may_be_outside(m, monkeypatch):
    both_orders(m, WIDE, 2e-3, 32, monkeypatch)


@pytest.mark.parametrize(("half_angle", "tolerance"), thinned([(0.15, 2e-2), (0.25, 5e-3)], [(0.15, 2e-2)]))
def test_either_integral_may_be_outside_of_a_small_cone(half_angle, tolerance, monkeypatch):
    both_orders(MATERIALS["plastic"], Cone(on_sphere(0.3, 2.0), half_angle), tolerance, 8, monkeypatch)


@pytest.mark.parametrize("name", thinned(MATERIALS, ["polished"]))
def test_a_narrow_cone_is_a_direction(name):
    m = MATERIALS[name]
    mirror = A * [-1.0, -1.0, 1.0]
    for axis in (B, mirror):
        for half_angle, off in ((1e-2, 0.4), (1e-4, 2e-4), (1e-6, 2e-4)):
            cone = Cone(axis, half_angle)
            np.testing.assert_allclose(gn.reflectance_factor(m, A, cone), PI * m.f(A, axis), rtol=off, atol=2e-4)
            np.testing.assert_allclose(gn.reflectance_factor(m, cone, A), PI * m.f(axis, A), rtol=off, atol=2e-4)
    np.testing.assert_allclose(
        gn.reflectance_factor(m, Cone(A, 1e-4), Cone(mirror, 1e-4)), PI * m.f(A, mirror), rtol=5e-4
    )


def add_up(m, incident, tolerance):
    """What two halves of the hemisphere collect is the whole."""
    left, right = (Cone((0.0, s, 0.0), 0.5 * PI) for s in (-1.0, 1.0))
    whole = gn.reflectance(m, incident, SKY, tolerance=tolerance)
    parts = sum(gn.reflectance(m, incident, half, tolerance=tolerance) for half in (left, right))
    np.testing.assert_allclose(parts, whole, atol=2.0 * tolerance)


@pytest.mark.full
@each_but_polished
def test_parts_of_what_comes_from_a_cone_add_up(m):
    add_up(m, NARROW, 5e-3)


@each_but_polished
def test_parts_add_up(m):
    """Side by side, or as cone and rest."""
    for incident in (A, on_sphere(1.5, 1.0)):
        add_up(m, incident, 1e-4)
    inside = gn.reflectance(m, A, Cone((0.0, 0.0, 1.0), 0.5))
    theta, d = panels(np.linspace(0.5, 0.5 * PI, 60))
    phi = (np.arange(200) + 0.5) * (2.0 * PI / 200)
    wo = on_sphere(theta[:, None], phi)
    f = m.f(A, wo).reshape(*wo.shape[:2], -1)
    rest = np.tensordot((np.sin(theta) * np.cos(theta) * d)[:, None] * np.full(200, 2.0 * PI / 200), f, 2)
    np.testing.assert_allclose(inside + (rest if inside.ndim else rest[0]), gn.albedo(m, A), atol=3e-4)


def test_narrow_lobes_are_found():
    """A lobe of 0.001 rad in a cone of 90 degrees, in one that it half misses, and beside one."""
    m = gn.Microfacet(gn.Beckmann(0.001))
    mirror = on_sphere(0.8, PI)
    w = on_sphere(0.8, 0.0)
    assert gn.reflectance(m, w, Cone((0, 0, 1), 0.5 * PI)) == pytest.approx(1.0, abs=1e-4)
    assert gn.reflectance(m, w, Cone(mirror, 0.3)) == pytest.approx(1.0, abs=1e-4)
    half = gn.reflectance(m, w, Cone(on_sphere(0.8 + 0.4, PI), 0.4), tolerance=1e-3)
    assert half == pytest.approx(0.5, abs=5e-3)
    assert gn.reflectance(m, w, Cone(on_sphere(0.8 + 0.45, PI), 0.4)) < 1e-6


@pytest.mark.full
def test_narrow_lobes_are_found_from_cones():
    m, w, mirror = gn.Microfacet(gn.Beckmann(0.001)), on_sphere(0.8, 0.0), on_sphere(0.8, PI)
    both = gn.reflectance(m, Cone(w, 0.2), Cone(mirror, 0.21), tolerance=1e-2)
    assert both == pytest.approx(1.0, abs=1e-3)


# Delta lobes.


def test_a_mirror():
    m = [0.8, 0.4] * gn.IdealSpecular(1.0)
    k = np.array([0.8, 0.4])
    away = A * [-1.0, -1.0, 1.0]
    inside, outside = Cone(away, 0.01), Cone(on_sphere(0.6, 0.3 + PI), 0.05)
    np.testing.assert_allclose(gn.reflectance(m, A, inside), k, rtol=1e-12)
    np.testing.assert_allclose(gn.reflectance(m, A, outside), 0.0)
    np.testing.assert_allclose(gn.reflectance_factor(m, A, inside), k * PI / inside.projected, rtol=1e-9)
    np.testing.assert_allclose(gn.reflectance_factor(m, inside, A), k * PI / inside.projected, rtol=1e-9)
    np.testing.assert_allclose(gn.reflectance_factor(m, A, away), 0.0)
    np.testing.assert_allclose(gn.reflectance_factor(m, SKY, A), k, rtol=1e-12)
    np.testing.assert_allclose(gn.reflectance(m, SKY, SKY), k, rtol=1e-9)
    np.testing.assert_allclose(gn.reflectance(m, LOW, SKY), k, rtol=1e-9)
    np.testing.assert_allclose(gn.reflectance(m, SKY, LOW), k * LOW.projected / PI, rtol=1e-5)
    np.testing.assert_allclose(gn.reflectance(m, NARROW, Cone(A, 0.1)), 0.0)


def test_a_mirror_between_cones():
    """The share of the light that arrives in both cones, one of them mirrored."""
    a = Cone(on_sphere(0.6, 0.2), 0.3)
    around, within, across = (
        Cone(on_sphere(t, 0.2 + PI + p), r) for t, p, r in ((0.6, 0.0, 0.5), (0.6, 0.0, 0.2), (0.7, 0.2, 0.25))
    )
    m = gn.IdealSpecular(0.9)
    assert gn.reflectance(m, a, around) == pytest.approx(0.9, abs=1e-6)
    assert gn.reflectance(m, a, within) == pytest.approx(0.9 * within.projected / a.projected, abs=1e-6)
    many = spread(400_000)
    both = (many[:, 2] * (a.contains(many) & across.mirrored().contains(many))).mean() * 2.0 * PI
    assert gn.reflectance(m, a, across) == pytest.approx(0.9 * both / a.projected, rel=5e-3)
    assert gn.reflectance(m, a, Cone(on_sphere(0.6, 0.2), 0.2)) == 0.0


# Under a sky.


def gradient(w):
    return 2.0 + w[..., 2] + 0.5 * w[..., 0]


of_a_sky = pytest.mark.parametrize(
    ("incident", "collected"),
    [
        pytest.param(SKY, B, id="HD"),
        pytest.param(WIDE, B, id="CD"),
        pytest.param(WIDE, LOW, marks=pytest.mark.full, id="CC"),
        pytest.param(SKY, SKY, marks=pytest.mark.full, id="HH"),
    ],
)


@of_a_sky
def test_a_uniform_sky_is_no_sky(incident, collected):
    plain = gn.reflectance_factor(PLASTIC, incident, collected, tolerance=1e-3)
    lit = gn.reflectance_factor(PLASTIC, incident, collected, sky=gn.ConstantLight(7.0), tolerance=1e-3)
    assert lit == pytest.approx(plain, abs=2e-3)


@of_a_sky
def test_a_sky_by_brute_force(incident, collected):
    m = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.5, 0.9), gn.Dielectric(1.5))
    found = gn.reflectance_factor(m, incident, collected, sky=gn.FunctionLight(gradient), tolerance=1e-3)
    assert found == pytest.approx(brute(m, incident, collected, radiance=gradient), rel=3e-3)


def test_sun_and_sky():
    """HDRF: the mean of BRF and hemispherical-directional factor, weighed by irradiance; outside the cone is none."""
    sun, sky = gn.DistantLight(A, 2.0 / A[2]), gn.ConstantLight(3.0 / PI)
    wo = on_sphere([0.3, 1.1], 2.0)
    brf, hdrf = PI * PLASTIC.f(A, wo), gn.reflectance_factor(PLASTIC, SKY, wo)
    np.testing.assert_allclose(gn.reflectance_factor(PLASTIC, SKY, wo, sky=sun), brf, rtol=1e-12)
    np.testing.assert_allclose(
        gn.reflectance_factor(PLASTIC, SKY, wo, sky=[sun, sky]), 0.4 * brf + 0.6 * hdrf, atol=2e-4
    )
    mirror = gn.IdealSpecular(0.7)
    away = Cone(A * [-1.0, -1.0, 1.0], 0.1)
    assert gn.reflectance(mirror, SKY, away, sky=sun) == pytest.approx(0.7, rel=1e-12)
    assert gn.reflectance_factor(mirror, SKY, wo[0], sky=[sun, sky]) == pytest.approx(0.6 * 0.7, abs=1e-4)
    with pytest.raises(ParameterError, match="irradiance"):
        gn.reflectance_factor(PLASTIC, Cone(B, 0.1), wo, sky=sun)


def test_a_coloured_sky():
    sky = gn.FunctionLight(lambda w: np.stack([gradient(w), 1.0 + 0.0 * w[..., 0]], -1))
    found = gn.reflectance_factor(PLASTIC, SKY, B, sky=sky)
    assert found.shape == (2,)
    assert found[0] == pytest.approx(gn.reflectance_factor(PLASTIC, SKY, B, sky=gn.FunctionLight(gradient)), abs=2e-4)
    assert found[1] == pytest.approx(gn.reflectance_factor(PLASTIC, SKY, B), abs=2e-4)


@pytest.mark.parametrize(
    ("incident", "collected"),
    [
        pytest.param(SKY, B, id="HD"),
        pytest.param(WIDE, B, id="CD"),
        pytest.param(SKY, WIDE, marks=pytest.mark.full, id="HC"),
    ],
)
def test_an_environment_map(incident, collected):
    w, _ = gn.radiometry.latlong_pixels(32, 64)
    picture = gn.EnvironmentLight(gradient(w))
    m = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.4))
    found = gn.reflectance_factor(m, incident, collected, sky=picture, tolerance=2e-3, return_error=True)
    smooth = gn.reflectance_factor(m, incident, collected, sky=gn.FunctionLight(gradient))
    assert found.value == pytest.approx(smooth, rel=6e-3)
    assert found.error <= 2e-3


@pytest.mark.parametrize(
    ("made", "to"),
    [
        pytest.param(gn.Lambertian, SKY, id="matt-sky"),
        pytest.param(gn.Lambertian, B, id="matt-direction"),
        pytest.param(lambda x: gn.Microfacet(gn.GGX(x), gn.Conductor(0.2, 3.0)), B, id="metal-direction"),
        pytest.param(
            lambda x: gn.Microfacet(gn.GGX(x), gn.Conductor(0.2, 3.0)), SKY, id="metal-sky", marks=pytest.mark.full
        ),
    ],
)
def test_maps_under_the_sun_are_their_numbers_one_by_one(made, to):
    sun = gn.SunLight((0.3, 0.0, 1.0))
    numbers = np.array([[0.2], [0.7]])
    measure = gn.reflectance if to is SKY else gn.reflectance_factor
    found = measure(made(numbers), SKY, to, sky=sun)
    assert found.shape == numbers.shape
    alone = [measure(made(x), SKY, to, sky=sun) for x in numbers.ravel()]
    np.testing.assert_allclose(found.ravel(), alone, rtol=2e-4)


# Maps, measurements, input.


@pytest.mark.parametrize(
    ("incident", "collected"),
    [
        pytest.param(A, WIDE, id="DC"),
        pytest.param(WIDE, A, id="CD"),
        pytest.param(NARROW, WIDE, marks=pytest.mark.full, id="CC"),
    ],
)
def test_maps(incident, collected):
    alpha = np.array([[0.1, 0.2], [0.3, 0.9]])[..., None]
    m = 0.5 * gn.Microfacet(gn.GGX(alpha)) + gn.Lambertian(0.2) + gn.IdealSpecular(0.1)
    found = gn.reflectance_factor(m, incident, collected, tolerance=1e-2)
    assert found.shape == (2, 2, 1)
    one = 0.5 * gn.Microfacet(gn.GGX(0.3)) + gn.Lambertian(0.2) + gn.IdealSpecular(0.1)
    assert found[1, 0, 0] == pytest.approx(gn.reflectance_factor(one, incident, collected), abs=5e-3)


def test_holes_in_a_measurement_are_said():
    class _Holed(gn.Lambertian):
        def formula(self, wi, wo):
            from gonio.arrays import ops

            return ops.where(wo.x > 0.5, float("nan"), super().formula(wi, wo))

    with pytest.warns(MissingDataWarning):
        found = gn.albedo(_Holed(0.5), on_sphere(0.1, 0.0), 1e-3)
    lost = (PI / 3.0 - math.sqrt(3.0) / 4.0) / PI  # of the disc, where x > 1/2
    assert found == pytest.approx(0.5 * (1.0 - lost), abs=1e-3)
    with pytest.warns(MissingDataWarning):
        gn.reflectance(_Holed(0.5), WIDE, SKY, tolerance=1e-2)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda m: gn.reflectance(m, A, B), "reflectance_factor"),
        (lambda m: gn.reflectance(m, "up", SKY), "directions"),
        (lambda m: gn.reflectance(m, gn.Hemisphere, SKY), "Hemisphere()"),
        (lambda m: gn.reflectance(m, A, SKY, sky=gn.ConstantLight()), "DistantLight"),
        (lambda m: gn.reflectance(m, SKY, SKY, sky=gn.DistantLight((0, 0, -1))), "irradiance"),
        (lambda m: gn.reflectance(m, SKY, SKY, tolerance=0.0), "tolerance"),
        (lambda m: gn.Cone((0, 0, 1), 0.0), "half_angle"),
        (lambda m: gn.Cone((0, 0, 1), 2.0), "pi/2"),
        (lambda m: gn.Cone((0, 0, 0), 0.1), "not 0"),
        (lambda m: gn.Cone((0, 1), 0.1), "three"),
        (lambda m: gn.Cone(on_sphere(2.0, 0.0), 0.3), "below the horizon"),
        (lambda m: gn.remote_sensing.blue_sky_albedo(m, 0.3, 1.5), "diffuse_fraction"),
    ],
)
def test_bad_input(call, says):
    with pytest.raises(gn.Error, match=says.replace("(", r"\(").replace(")", r"\)")):
        call(gn.Lambertian(0.5))


def test_values():
    assert Cone((0, 0, 2), 0.3) == Cone((0.0, 0.0, 1.0), 0.3)
    assert gn.Hemisphere() == gn.Hemisphere()
    assert repr(Cone((0, 0, 2), 0.3)) == "Cone(axis=(0.0, 0.0, 1.0), half_angle=0.3)"
    for low, high in pairwise((0.1, 0.5, 1.0, 0.5 * PI)):
        assert Cone((0, 1, 1), low).projected < Cone((0, 1, 1), high).projected


def test_blue_sky_albedo_takes_angles_and_shares_of_pytorch():
    torch = pytest.importorskip("torch")
    field = gn.RossLi(f_iso=0.2, f_vol=0.1, f_geo=0.03)
    black, white = gn.remote_sensing.black_sky_albedo(field, 0.5), gn.remote_sensing.white_sky_albedo(field)
    theta, share = torch.tensor(0.5), torch.tensor(0.3, dtype=torch.float64, requires_grad=True)
    assert float(gn.remote_sensing.blue_sky_albedo(field, theta, 0.3)) == pytest.approx(
        0.7 * black + 0.3 * white, rel=2e-3
    )
    mixed = gn.remote_sensing.blue_sky_albedo(field, 0.5, share)
    (slope,) = torch.autograd.grad(mixed, share)
    assert mixed.item() == pytest.approx(0.7 * black + 0.3 * white, rel=1e-9)
    assert slope.item() == pytest.approx(white - black, rel=1e-6)


@pytest.mark.parametrize("of", [gn.absorptance, gn.fate])
@pytest.mark.parametrize("wrap", [lambda m: m, lambda m: 0.5 * m + gn.Lambertian(0.2), gn.Coated, gn.Sheet])
def test_light_that_facets_scatter_twice_is_told_where_it_counts_as_absorbed(of, wrap):
    """Of white GGX facets at alpha = 1 ln 2 is lost at normal incidence, whatever these facets absorb."""
    m = wrap(gn.Microfacet(gn.GGX(1.0), gn.Conductor(0.2, 3.9)))
    with pytest.warns(LeftOutWarning, match=r"lost by Microfacet.*up to 0\.69 of the light") as said:
        of(m, [0.0, 0.0, 1.0])
    assert len(said) == 1


@pytest.mark.parametrize(
    "m",
    [gn.Microfacet(gn.GGX(0.02)), gn.KullaConty(0.5), gn.Turquin(0.5), gn.KullaContyDielectric(0.5), gn.Lambertian()],
)
def test_where_facets_lose_nothing_nothing_is_told(m):
    gn.absorptance(m, gn.direction([0.0, 1.0], 0.0))


def test_white_facets_reflect_as_facets_of_a_white_metal():
    for m in (gn.Microfacet(gn.Beckmann(0.4), 0.3), gn.RetroMicrofacet(gn.GGX(0.4), 0.3), gn.OpenPBRMetal(0.3)):
        white = m._single_scatter
        wi, wo = gn.direction(0.4, 0.3), gn.direction(0.7, [0.2, 3.0])
        F = {"OpenPBRMetal": gn.OpenPBRMetal(1.0).f(wi, wo)}.get(type(m).__name__, m.f(wi, wo) / 0.3)
        np.testing.assert_allclose(white.f(wi, wo), F, rtol=1e-12)
