"""Uncertainty of results of measured tables: closed forms, first order against Monte Carlo, correlations, words."""

import gc
import json
import math
import weakref
from itertools import pairwise

import numpy as np
import pytest
from click.testing import CliRunner
from libraries import thinned
from scipy import sparse

import gonio as gn
from gonio.base.reflectance import Reflectance
from gonio.cli import arguments
from gonio.cli.commands import cli
from gonio.errors import MissingDataWarning
from gonio.laws._significance import judged
from gonio.laws._verdict import Law
from gonio.tables.gridded import Gridded
from gonio.tables.scattered import Scattered
from gonio.uncertainty.correlation import Factors, factor
from gonio.uncertainty.functionals import linear, named
from gonio.uncertainty.quoted import rounded
from gonio.uncertainty.sensitivity import by_channel, coefficients
from gonio.uncertainty.table import TableErrors

THETA_I = np.radians([0.0, 20.0, 40.0, 60.0, 80.0])
THETA_O = np.radians(np.arange(0.0, 91.0, 10.0))
PHI = np.radians(np.arange(0.0, 360.0, 30.0))
ANGLES = {"theta_i": THETA_I, "theta_o": THETA_O, "phi": PHI}
SHAPE = (5, 10, 12)
RHO = 0.5
WI = gn.direction(0.5, 0.0)


def lambertian(u=0.02, **more):
    """A white-ish table; every value has the same relative uncertainty."""
    values = np.full(SHAPE, RHO / np.pi)
    return Gridded("angles", ANGLES, values, uncertainty=u * values, **more)


def rough(seed=1, spread=0.2, **more):
    rng = np.random.default_rng(seed)
    values = RHO / np.pi * (1.0 + spread * rng.standard_normal(SHAPE))
    return Gridded("angles", ANGLES, values, uncertainty=0.05 * np.abs(values), **more)


def quote(function, *args, correlation="independent", **more):
    return gn.with_uncertainty(function, *args, correlation=correlation, **more)


def hats():
    """Integrals of the hat functions of THETA_O times cos sin."""
    x, w = np.polynomial.legendre.leggauss(16)
    found = np.zeros(len(THETA_O))
    for j, (a, b) in enumerate(pairwise(THETA_O)):
        theta = 0.5 * (a + b) + 0.5 * (b - a) * x
        g = np.cos(theta) * np.sin(theta) * w * 0.5 * (b - a)
        found[j] += ((b - theta) / (b - a) * g).sum()
        found[j + 1] += ((theta - a) / (b - a) * g).sum()
    return found


# Closed forms.


def test_albedo_with_independent_errors():
    t = (0.5 - THETA_I[1]) / (THETA_I[2] - THETA_I[1])  # between the second and the third node
    c2 = (hats() ** 2).sum() * len(PHI) * (2 * np.pi / len(PHI)) ** 2 * (t**2 + (1 - t) ** 2)
    q = quote(gn.albedo, lambertian(), WI)
    assert q.u == pytest.approx(0.02 * RHO / np.pi * math.sqrt(c2), rel=2e-3)
    assert q.value == pytest.approx(RHO, abs=0.3 * q.u)
    assert q.method == "first order"
    assert q.at_estimate == q.value


@pytest.mark.parametrize(
    ("function", "args", "rho"),
    [
        (gn.albedo, (WI,), RHO),
        (gn.remote_sensing.black_sky_albedo, (0.5,), RHO),
        (gn.remote_sensing.white_sky_albedo, (), RHO),
        (gn.reflectance, (gn.Cone([0, 0, 1], 0.4), gn.Cone([0.5, 0, 1], 0.2)), None),
        (gn.reflectance_factor, (gn.Hemisphere(), WI), RHO),
        (gn.reflectance_factor, (WI, gn.Cone([0, 1, 1], 0.3)), RHO),
        (gn.reflectance_factor, (WI, WI), RHO),
        (Reflectance.f, (WI, WI), RHO / np.pi),
        (Reflectance.f_angles, (0.5, 0.0, 0.7, 1.0), RHO / np.pi),
    ],
)
def test_a_common_error_is_relative_to_the_result(function, args, rho):
    q = quote(function, lambertian(), *args, correlation="common")
    assert q.u == pytest.approx(0.02 * q.value, rel=2e-3)
    if rho is not None:
        assert q.value == pytest.approx(rho, abs=1e-3)


def test_f_between_nodes():
    m = lambertian()
    at = [gn.direction(t, p) for t, p in ((THETA_O[3], PHI[4]), (0.5 * (THETA_O[3] + THETA_O[4]), PHI[4]))]
    q = quote(m.f, gn.direction(THETA_I[2], 0.0), np.array(at))
    assert q.u == pytest.approx(0.02 * RHO / np.pi * np.array([1.0, math.sqrt(0.5)]), rel=1e-6)
    across = gn.direction(THETA_O[3], PHI[-1] + 0.25 * (PHI[1] - PHI[0]))  # between the last azimuth and the first
    q = quote(m.f, gn.direction(THETA_I[2], 0.0), across)
    assert q.u == pytest.approx(0.02 * RHO / np.pi * math.hypot(0.75, 0.25), rel=1e-6)


def test_scale_adds_in_quadrature():
    alone = quote(gn.albedo, lambertian(), WI)
    both = quote(gn.albedo, lambertian(about={"scale_uncertainty": 0.01}), WI)
    assert both.u == pytest.approx(math.hypot(alone.u, 0.01 * RHO), rel=1e-3)
    assert quote(gn.albedo, lambertian(), WI, scale=0.01).u == pytest.approx(both.u, rel=1e-6)
    assert "scale (0.01)" in both.assumed
    bare = Gridded("angles", ANGLES, np.full(SHAPE, RHO / np.pi))
    assert quote(gn.albedo, bare, WI, scale=0.01).u == pytest.approx(0.01 * RHO, rel=1e-3)


# The coefficients: they are how f is interpolated, whatever the axes are.

LAYOUTS = {
    "angles": ("angles", ANGLES, {}),
    "nearest": ("angles", ANGLES, {"interpolation": "nearest"}),
    "uneven": ("angles", {**ANGLES, "theta_o": np.radians([0.0, 3.0, 10.0, 30.0, 35.0, 80.0])}, {}),
    "square root": (
        "half_difference",
        {"theta_h": np.linspace(0.1, 1.2, 9) ** 2, "theta_d": THETA_I, "phi_d": PHI},
        {},
    ),
    "reciprocal": (
        "half_difference",
        {"theta_h": THETA_O, "theta_d": THETA_I, "phi_d": 0.5 * PHI},
        {"periods": {"phi_d": np.pi}},
    ),
    "mirrored": ("angles", {**ANGLES, "phi": np.linspace(0.0, np.pi, 7)}, {"mirrored": True}),
    "specular": ("specular", {"theta_i": THETA_I, "radial": np.radians([0.0, 2.0, 10.0, 60.0]), "azimuth": PHI}, {}),
    "anisotropic": ("angles", {"theta_i": THETA_I, "theta_o": THETA_O, "phi_i": PHI[::3], "phi_o": PHI[::2]}, {}),
    "relative": (
        "relative",
        {"theta_i": THETA_I, "theta_o": THETA_O, "phi": PHI[::2], "phi_i": PHI[::3]},
        {},
    ),
    "one node": ("angles", {"theta_i": [0.2], "theta_o": THETA_O, "phi": PHI}, {}),
    "missing": ("angles", {**ANGLES, "theta_o": THETA_O[:6]}, {"outside": "missing"}),
    "zero": ("angles", {**ANGLES, "theta_o": THETA_O[:6]}, {"outside": "zero"}),
    "cosine": ("angles", ANGLES, {"quantity": "brdf * cos(theta_o)"}),
}


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("holes", [0.0, 0.2])
@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_coefficients_give_f(layout, holes):
    name, axes, more = layout
    rng = np.random.default_rng(3)
    values = rng.random((*(len(x) for x in axes.values()), 2))
    values[rng.random(values.shape) < holes] = np.nan
    m = Gridded(name, axes, values, channels=["A", "B"], **more)
    wi, wo = (gn.direction(1.6 * rng.random(500), 7.0 * rng.random(500)) for _ in range(2))  # some below the horizon
    f = m.f(wi, wo)
    found = coefficients(m, linear(Reflectance.f, {"wi": wi, "wo": wo}), 1)
    table = np.nan_to_num(by_channel(m.brdf(), m))
    for c in range(2):
        assert found.of(c) @ table[:, c] == pytest.approx(np.nan_to_num(f[:, c]), rel=1e-9, abs=1e-12)
        assert (np.diff(found.of(c).indptr) == 0)[np.isnan(f[:, c])].all() or holes or name == "angles"
        assert abs(found.of(c)[np.isnan(f[:, c])]).sum() == 0.0


@pytest.mark.parametrize(
    ("function", "args"),
    [
        (gn.albedo, (WI,)),
        pytest.param(gn.remote_sensing.white_sky_albedo, (), marks=pytest.mark.full),
        (gn.reflectance, (gn.Cone([0, 0, 1], 0.4), gn.Cone([0.5, 0, 1], 0.2))),
        (gn.reflectance_factor, (gn.Cone([0.5, 0, 1], 0.2), WI)),
        (gn.reflectance_factor, (WI, gn.Cone([1, 0, 0.2], 0.5))),
    ],
)
def test_coefficients_give_integrals(function, args):
    m = rough()
    found = coefficients(m, linear(function, named(function, m, args, {})), 1 << 17)
    value = function(m, *args, tolerance=1e-3)
    assert (found.of(0) @ m.brdf().reshape(-1))[0] == pytest.approx(value, rel=2e-3)


def test_holes_in_an_integral_add_nothing():
    values = np.full(SHAPE, RHO / np.pi)
    values[:, 5:] = np.nan
    m = Gridded("angles", ANGLES, values, uncertainty=0.02 * np.full(SHAPE, RHO / np.pi))
    with pytest.warns(MissingDataWarning):
        q = quote(gn.albedo, m, WI, correlation="common")
    assert q.u_noise == pytest.approx(0.02 * q.value, rel=3e-3)
    assert q.u_interpolation == pytest.approx(RHO - q.value, rel=0.02)  # what the directions without data may hold


# Correlation.


def test_correlation_goes_from_independent_to_common():
    m = rough()
    u = [quote(gn.albedo, m, WI, correlation=c).u_noise for c in ("independent", 1e-4, 0.1, 0.3, 1.0, 30.0, "common")]
    assert u[1] == pytest.approx(u[0], rel=1e-6)
    assert u[5] == pytest.approx(u[6], rel=1e-3)
    assert (np.diff(u[1:]) > 0.0).all()
    along = quote(gn.albedo, m, WI, correlation={"theta_i": math.inf, "theta_o": math.inf, "phi": math.inf})
    assert along.u_noise == pytest.approx(u[6], rel=1e-9)
    some = quote(gn.albedo, m, WI, correlation={"theta_o": math.inf})
    assert u[0] < some.u_noise < u[6]


@pytest.mark.parametrize("period", [None, 2.0 * np.pi, np.pi])
def test_factors_make_the_correlation_matrix(period):
    nodes = np.array([0.0, 0.1, 0.5, 2.0, 3.0])
    apart = nodes[:, None] - nodes
    if period:
        apart = period / np.pi * np.sin(np.pi * apart / period)
    F = factor(nodes, 0.4, period)
    np.testing.assert_allclose(F @ F.T, np.exp(-0.5 * (apart / 0.4) ** 2), atol=1e-10)
    assert factor(nodes, 0.0) is None
    assert factor(nodes, math.inf) @ factor(nodes, math.inf).T == pytest.approx(np.ones((5, 5)))


def test_sparse_and_dense_rows_agree():
    rng = np.random.default_rng(6)
    factors = Factors(ANGLES, 1, {"theta_i": 0.3, "theta_o": 0.2, "phi": 0.5, "channel": 0.0}, {"phi": 2.0 * np.pi})
    few = np.zeros((3000, math.prod(SHAPE)))
    few[0, [7, 99, 500]] = rng.random(3)
    found = [factors.on_angles(sparse.csr_array(rows)).toarray()[0] for rows in (few, few[:1])]
    assert found[0] == pytest.approx(found[1], abs=1e-12)
    assert (found[0] != 0.0).sum() > 3


def test_an_axis_of_azimuths_is_a_circle():
    m = lambertian()
    wi, wo = gn.direction(THETA_I[2], 0.0), gn.direction(THETA_O[3], PHI[[0, -1]])
    V = quote(m.f, wi, wo, correlation={"phi": 0.5}).covariance
    d = 2.0 * math.sin(0.5 * (PHI[1] - PHI[0]))
    assert V[0, 1] / V[0, 0] == pytest.approx(math.exp(-0.5 * (d / 0.5) ** 2), rel=1e-6)


def spectral(names=(450.0, 550.0, 650.0)):
    values = np.full((*SHAPE, 3), RHO / np.pi) * np.array([0.5, 1.0, 1.5])
    return Gridded("angles", ANGLES, values, uncertainty=0.02 * values, channels=names)


def test_channels():
    m = spectral()
    of = {word: quote(gn.albedo, m, WI, correlation=word) for word in ("independent", "common", "channel")}
    correlation = {word: q.covariance[0, 1] / math.prod(q.u[:2]) for word, q in of.items()}
    assert correlation == pytest.approx({"independent": 0.0, "common": 1.0, "channel": 0.0}, abs=1e-9)
    assert of["common"].u == pytest.approx(of["channel"].u)
    assert of["common"].u == pytest.approx(0.02 * RHO * np.array([0.5, 1.0, 1.5]), rel=2e-3)
    V = quote(gn.albedo, m, WI, correlation={"channel": 80.0}).covariance
    assert V[0, 1] / math.sqrt(V[0, 0] * V[1, 1]) == pytest.approx(math.exp(-0.5 * (100.0 / 80.0) ** 2), rel=1e-9)
    several = quote(gn.albedo, m, gn.direction(np.array([0.5, 1.2]), 0.0))
    for k, theta in enumerate((0.5, 1.2)):
        assert several.u[k] == pytest.approx(quote(gn.albedo, m, gn.direction(theta, 0.0)).u, rel=2e-2)
    with pytest.raises(gn.Error, match="no wavelengths"):
        quote(gn.albedo, spectral(("R", "G", "B")), WI, correlation={"channel": 80.0})


@pytest.mark.parametrize("n", thinned([36, 60], [36]))
def test_rows_in_no_grid_share_their_errors_with_the_nodes_around_them(n):
    rng = np.random.default_rng(5)
    angles = [1.2 * rng.random(n), 0.0 * rng.random(n), 1.3 * rng.random(n), 6.0 * rng.random(n)]
    values = np.full(n, RHO / np.pi)
    m = Scattered(*angles, values, uncertainty=0.02 * values)
    u, common = (quote(gn.albedo, m, WI, correlation=c).u for c in ("independent", "common"))
    assert common == pytest.approx(0.02 * RHO, rel=1e-2)
    assert 0.02 * RHO / math.sqrt(n) < u < common  # as if all nodes were independent: below a hundredth of it
    bare = Scattered(*angles, values)
    assert quote(gn.albedo, bare, WI, scale=0.01).u == pytest.approx(0.01 * RHO, rel=1e-2)
    drawn = TableErrors(m, "independent").draw(np.random.default_rng(1)).brdf() - m.brdf()
    assert 0.5 * n < len(np.unique(drawn.round(12))) <= n


# First order against Monte Carlo.


@pytest.mark.parametrize(
    "correlation", [pytest.param("independent", marks=pytest.mark.full), {"theta_o": math.inf, "phi": 0.5}]
)
def test_monte_carlo_agrees_for_f(correlation):
    m = rough(about={"scale_uncertainty": 0.02})
    wo = gn.direction([0.1, 0.5, 1.0], [0.0, 1.0, 2.0])
    first = quote(m.f, WI, wo, correlation=correlation)
    drawn = quote(m.f, WI, wo, correlation=correlation, method="Monte Carlo", draws=300)
    assert drawn.u == pytest.approx(first.u, rel=4.0 / math.sqrt(2 * 300))
    assert drawn.value == pytest.approx(first.value, abs=4.0 * first.u.max() / math.sqrt(300))
    sigma = first.u[:, None] * first.u
    assert (drawn.covariance / sigma).ravel() == pytest.approx((first.covariance / sigma).ravel(), abs=0.2)
    low, high = drawn.interval(0.95)
    assert high - low == pytest.approx(2 * 1.96 * first.u, rel=0.2)


def test_monte_carlo_agrees_for_albedo():
    m, correlation = rough(), 0.4
    first = quote(gn.albedo, m, WI, correlation=correlation)
    drawn = quote(gn.albedo, m, WI, correlation=correlation, method="Monte Carlo", draws=100, tolerance=1e-3)
    assert drawn.u == pytest.approx(first.u, rel=4.0 / math.sqrt(2 * 100))
    assert drawn.at_estimate == pytest.approx(first.value, abs=1e-3)


def test_monte_carlo_agrees_for_channels_at_several_directions():
    m, wo = spectral(), gn.direction([0.1, 0.5, 1.0, 1.2], [0.0, 1.0, 2.0, 3.0])
    first = quote(m.f, WI, wo, correlation="independent")
    drawn = quote(m.f, WI, wo, correlation="independent", method="Monte Carlo", draws=300)
    assert drawn.draws.shape == (300, *first.value.shape)
    assert drawn.draws.std(axis=0) == pytest.approx(first.u, rel=0.2)


def test_monte_carlo_takes_any_function():
    m = spectral()
    wo = gn.direction(THETA_O[3], PHI[4])
    wi = gn.direction(THETA_I[2], 0.0)
    largest = quote(lambda t: t.f(wi, wo).max() / t.f(wi, wo).min(), m, method="Monte Carlo", draws=300)
    assert largest.value == pytest.approx(3.0, abs=0.02)
    assert largest.u == pytest.approx(3.0 * 0.02 * math.sqrt(2.0), rel=0.17)  # of a ratio, GUM 5.1.6
    again = quote(lambda t: t.f(wi, wo).max() / t.f(wi, wo).min(), m, method="Monte Carlo", draws=5)
    assert (again.draws == largest.draws[:5]).all()


@pytest.mark.parametrize(
    "correlation",
    [
        *(pytest.param(word, marks=pytest.mark.full) for word in ("independent", "channel")),
        {"phi": 0.8, "channel": 100.0},
    ],
)
def test_drawn_tables_have_the_covariance(correlation):
    m = spectral()
    errors = TableErrors(m, correlation)
    random = np.random.default_rng(7)
    tables = np.array([errors.draw(random).brdf()[2, 3, :3].reshape(-1) for _ in range(1000)])
    V = np.cov(tables, rowvar=False)
    u = m.uncertainty[2, 3, :3].reshape(-1)
    d = 2.0 * np.sin(0.5 * (PHI[:3, None] - PHI[:3]))
    expected = {
        "independent": np.eye(9),
        "channel": np.kron(np.ones((3, 3)), np.eye(3)),
    }.get(correlation if isinstance(correlation, str) else "")
    if expected is None:
        colour = np.array([450.0, 550.0, 650.0])
        R = np.exp(-0.5 * ((colour[:, None] - colour) / 100.0) ** 2)
        expected = np.kron(np.exp(-0.5 * (d / 0.8) ** 2), R)
    assert (V / (u[:, None] * u)).ravel() == pytest.approx(expected.ravel(), abs=0.16)


# ufloat.


def test_results_of_two_calls_are_correlated():
    m = rough()
    w = gn.direction(np.array([0.4, 0.5, 1.2]), 0.0)
    q = quote(gn.albedo, m, w)
    together = q.ufloat()
    V = q.covariance
    expected = math.sqrt(V[0, 0] + V[1, 1] - 2.0 * V[0, 1])
    assert (together[0] - together[1]).std_dev == pytest.approx(expected, rel=1e-6)
    one, other = (quote(gn.albedo, m, w[k]).ufloat() for k in (0, 1))
    assert (one - other).std_dev == pytest.approx(expected, rel=1e-6)
    assert (one - together[0]).std_dev < 1e-6 * one.std_dev
    assert expected < 0.9 * math.hypot(one.std_dev, other.std_dev)  # they share the nodes between them
    cone = quote(gn.reflectance, m, w[0], gn.Cone([0, 0, 1], 0.3)).ufloat()
    rest = one - cone  # what leaves outside the cone
    assert rest.std_dev < one.std_dev
    assert [x.std_dev for x in together] == pytest.approx(q.u.tolist())
    assert q.ufloat()[0] is together[0]


def test_tables_are_not_kept():
    m = rough()
    quote(m.f, WI, WI).ufloat()
    gone = weakref.ref(m)
    del m
    gc.collect()
    assert gone() is None


def test_a_common_error_cancels_in_a_ratio():
    m = spectral()
    a, b, _ = quote(gn.albedo, m, WI, correlation="common").ufloat()
    assert (a / b).std_dev == pytest.approx(0.0, abs=1e-8)
    other = quote(gn.albedo, m, gn.direction(1.0, 0.0), correlation="common").ufloat()[0]
    assert (other / a).std_dev < 1e-4
    blue = 0.8 * a + 0.2 * quote(gn.remote_sensing.white_sky_albedo, m, correlation="common").ufloat()[0]
    assert blue.std_dev == pytest.approx(0.02 * blue.nominal_value, rel=3e-3)


def test_monte_carlo_results_of_one_call_are_correlated():
    m = rough()
    wo = gn.direction([0.1, 0.12], [0.0, 0.0])
    a, b = quote(m.f, WI, wo, method="Monte Carlo", draws=500).ufloat()
    assert (a - b).std_dev < 0.8 * a.std_dev


# In words.


def test_words():
    assert rounded(0.12345, 0.0056) == "0.1235(56)"
    assert rounded(0.12345, 0.0056, " ± ") == "0.1235 ± 0.0056"
    assert rounded(0.5, math.nan) == "0.5(unknown)"
    assert rounded(0.5, 0.0, " ± ") == "0.5 ± 0"
    assert rounded(math.nan, 0.1) == "nan"
    q = quote(gn.albedo, lambertian(), WI, correlation="common")
    assert str(q) == "0.500(10)"
    assert repr(q) == "0.500 ± 0.010 (noise 0.01, interpolation 0)"
    assert q.text() == "0.500 ± 0.010 (k = 1: noise 0.01, interpolation 0)"
    assert q.text(k=2) == "0.500 ± 0.020 (k = 2: noise 0.02, interpolation 0)"
    assert q.expanded() == 2.0 * q.u
    low, high = q.interval()
    assert high - low == pytest.approx(2 * 1.959964 * q.u)
    several = quote(gn.albedo, lambertian(), gn.direction([0.1, 0.5], [0.0, 0.0]), correlation="common")
    assert str(several) == "[0.500(10) 0.500(10)]"


def test_no_results():
    q = quote(gn.albedo, lambertian(), np.zeros((0, 3)))
    assert q.u.shape == (0,)
    assert q.ufloat().shape == (0,)


def test_unknown_uncertainties():
    u = np.full(SHAPE, 0.003)
    u[3] = np.nan
    m = Gridded("angles", ANGLES, np.full(SHAPE, RHO / np.pi), uncertainty=u)
    with pytest.warns(MissingDataWarning, match="1 of 2 results is unknown"):
        q = quote(gn.albedo, m, gn.direction([0.2, 1.0], [0.0, 0.0]))
    assert np.isnan(q.u).tolist() == [False, True]
    assert "unknown" in str(q)
    assert np.isnan(q.covariance[1]).all()
    assert math.isnan(q.ufloat()[1].std_dev)
    with pytest.raises(gn.Error, match="unknown"):
        quote(m.f, WI, WI, method="Monte Carlo")


def test_no_data_has_no_uncertainty():
    m = Gridded(
        "angles",
        {**ANGLES, "theta_o": THETA_O[:5]},
        np.ones((5, 5, 12)),
        uncertainty=np.ones((5, 5, 12)),
        outside="missing",
    )
    q = quote(m.f, WI, gn.direction(1.2, 0.0))
    assert math.isnan(q.value)
    assert math.isnan(q.u)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: quote(gn.check, m), "not known to be linear"),
        (lambda m: quote(gn.albedo, m, WI, return_error=True), "return_error=True"),
        (lambda m: quote(gn.reflectance, m, gn.Hemisphere(), gn.Hemisphere(), gn.ConstantLight(1.0)), "sky"),
        (lambda m: quote(gn.albedo, m, WI, correlation="systematic"), "expected one of 'independent'"),
        (lambda m: quote(gn.albedo, m, WI, correlation=-1.0), "expected a number that is 0"),
        (lambda m: quote(gn.albedo, m, WI, correlation=[1.0]), "a dictionary from a word to a number"),
        (lambda m: quote(gn.albedo, m, WI, correlation={"phi": None}), "a dictionary from a word to a number"),
        (lambda m: quote(gn.albedo, m, WI, correlation={"theta": 1.0}), "no axis 'theta'"),
        (lambda m: quote(gn.albedo, m, WI, scale=-0.1), "relative standard uncertainty"),
        (lambda m: quote(gn.albedo, m, WI, method="bootstrap"), "'first order' or 'Monte Carlo'"),
        (lambda m: quote(gn.albedo, m, WI, method="Monte Carlo", draws=1), "a whole number from 2"),
        (lambda m: quote(gn.albedo, gn.Lambertian(0.5), WI), "gn.tables.tabulate"),
        (lambda m: quote(gn.albedo), "got no measurement"),
        (lambda m: gn.with_uncertainty(gn.albedo, m, WI), "no file says how its errors are correlated"),
        (lambda m: quote(repr, m, method="Monte Carlo", draws=2), "expected a number or an array"),
        (lambda m: quote(gn.albedo, m, WI).interval(95), "between 0 and 1"),
        (lambda m: quote(gn.albedo, m.with_brdf(m.brdf(), -m.brdf()), WI), "negative"),
        (lambda m: quote(gn.reflectance, m, WI, WI), "infinitely little"),
    ],
)
def test_errors(call, words):
    with pytest.raises(gn.Error, match=words):
        call(lambertian())


# The laws.


def test_check_says_whether_a_failure_is_significant():
    laws = ["positivity", "reciprocity", "energy", "furnace"]
    rng = np.random.default_rng(2)
    axes = {**ANGLES, "theta_o": THETA_I}
    noisy = 1.03 / np.pi * (1.0 + 0.02 * rng.standard_normal((5, 5, 12)))
    bare = gn.check(Gridded("angles", axes, noisy), laws=laws)
    stated = gn.check(Gridded("angles", axes, noisy, uncertainty=0.03 * noisy), laws=laws)
    sure = gn.check(Gridded("angles", axes, noisy, uncertainty=0.001 * noisy), laws=laws)
    broken = ("reciprocity", "energy", "furnace")
    assert bare.verdicts == {"positivity": "pass", **dict.fromkeys(broken, "breaks")}
    assert stated.verdicts == {"positivity": "pass", **dict.fromkeys(broken, "not significant")}
    assert sure.verdicts == {"positivity": "pass", **dict.fromkeys(broken, "FAIL")}
    assert (stated.passed, stated.lawful, sure.passed, sure.lawful) == (True, True, False, False)
    assert bare["energy"].u == bare["energy"].u_interpolation > 0.0
    assert bare["energy"].u_noise is None
    assert bare["energy"].significance == ""
    assert "(by interpolation alone)" in str(bare)
    assert "no uncertainty is stated" in bare["reciprocity"].significance
    for law in broken:
        assert stated[law].significance.endswith(": not significant"), law
        assert sure[law].significance.endswith(": significant"), law
    assert stated["energy"].u == pytest.approx(0.03 * stated["energy"].value, rel=0.05)
    assert stated["reciprocity"].u_noise == pytest.approx(0.03, rel=1.0)
    assert f"max albedo = {stated['energy'].value:.4g} ± " in str(stated)
    assert "(noise 0.031, interpolation 0.0002" in str(stated)
    assert json.loads(json.dumps(stated.to_json()))["laws"][2]["u"] == stated["energy"].u


def test_the_uncertainty_of_a_difference():
    values = np.full((5, 5, 12), RHO / np.pi)
    m = Gridded("angles", {**ANGLES, "theta_o": THETA_I}, values, uncertainty=0.03 * values)
    at = dict(zip(("theta_i", "phi_i", "theta_o", "phi_o"), (20.0, 0.0, 60.0, 30.0), strict=True))
    found = judged(m, Law("reciprocity", False, 0.1, 1e-4, "", at))
    assert found.u == pytest.approx(0.03 * math.sqrt(2.0), rel=1e-6)  # of two nodes; a common error cancels
    assert found.significance.startswith("of 140 pairs that were measured both ways")


def test_check_of_negative_values():
    rng = np.random.default_rng(2)
    dark = 1e-3 * rng.standard_normal(SHAPE)
    for u, verdict in ((1e-3, "not significant"), (1e-4, "FAIL")):
        m = Gridded("angles", ANGLES, dark, uncertainty=np.full(SHAPE, u))
        law = gn.check(m, laws=["positivity"])["positivity"]
        assert law.verdict == verdict
        assert 0.1 * u < law.u_noise <= 1.01 * u


# The command line.


@pytest.fixture
def run(monkeypatch):
    def call(m, *words):
        monkeypatch.setattr(arguments, "resolve", lambda *_: m)
        found = CliRunner().invoke(cli, list(words), catch_exceptions=False)
        return found.output

    return call


def test_albedo_on_the_command_line(run):
    m = spectral(("R", "G", "B"))
    lines = run(m, "albedo", "x", "--theta-i", "0,45", "--phi-i", "0,90").splitlines()
    assert len(lines) == 1 + 2 * 2 * 3
    assert lines[0].split()[:3] == ["theta_i", "phi_i", "channel"]
    assert "0.2500 ± 0.0050" in lines[1]
    text = run(m, "albedo", "x", "--theta-i", "45", "--uncertainty", "common", "-k", "2")
    assert "(k = 2), common errors" in text
    assert "independent" not in text
    assert "0.250 ± 0.010" in text
    rows = json.loads(run(m, "albedo", "x", "--theta-i", "45", "--json"))
    assert [row["channel"] for row in rows] == ["R", "G", "B"]
    assert rows[1]["u"]["common"] == pytest.approx(0.01, rel=1e-2)
    assert rows[1]["u"]["independent"] < 0.2 * rows[1]["u"]["common"]
    plain = json.loads(run(gn.Lambertian(0.25), "albedo", "x", "--theta-i", "45", "--json"))
    assert plain == [{"theta_i": 45.0, "phi_i": 0.0, "albedo": pytest.approx(0.25)}]


def test_info_and_check_on_the_command_line(run):
    m = lambertian(about={"scale_uncertainty": 0.01})
    text = run(m, "info", "x")
    assert "2 % (median)" in text
    assert "uncertain by 1 %" in text
    assert "of common errors" in text
    said = json.loads(run(m, "info", "x", "--json"))
    assert said["uncertainty"]["median"] == pytest.approx(0.02)
    assert said["scale_uncertainty"] == 0.01
    assert said["uncertainty_of_albedo"]["common"] == pytest.approx([0.0112] * 3, rel=1e-2)
    assert "max albedo = 0.5" in (shown := run(m, "check", "x"))
    assert " ± 0.011 (noise 0.011, interpolation 0) <= 1.001" in shown
    assert "uncertainty" not in run(gn.Lambertian(0.5), "info", "x")
