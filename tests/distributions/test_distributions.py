"""Distributions of normals: normalization, Smith's function and limits, against independent integration; roughness."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from libraries import thinned
from scipy.special import erfc

import gonio as gn
from gonio.errors import ParameterError
from gonio.formula import special
from gonio.formula.direction import NORMAL, Direction, dot

PI = math.pi
ALPHAS = (1e-3, 0.02, 0.3, 1.0)


def distributions() -> list[Any]:
    """Instances over the bounds, the awkward places among them."""
    made: list[Any] = [gn.GaussianFacets(a) for a in ALPHAS]
    made += [gn.GTR(a, g) for a in ALPHAS for g in (0.5, 1.0, 1.0 + 1e-7, 1.4, 3.0, 10.0)]
    made += [gn.StudentT(a, gamma=g) for a in ALPHAS for g in (1.8, 2.0, 5.0, 1000.0)]
    made += [gn.BlinnFacets(n) for n in (0.0, 0.7, 30.0, 1e4)]
    made += [gn.ExponentialPower(a, p=p) for a in ALPHAS[:3] for p in (0.25, 0.6, 1.0, 1.7, 4.0)]
    made += [gn.ABCFacets(B, C) for B in (1.0, 300.0, 2e6) for C in (0.5, 1.0, 2.0, 10.0)]
    made += [gn.SGDFacets(a, p) for a in (1e-3, 0.1, 2.0) for p in (0.0, 0.6, 1.0, 3.0)]
    return made


each_distribution = pytest.mark.parametrize("d", distributions(), ids=repr)
TABLES = [
    gn.TabulatedFacets(),
    gn.TabulatedFacets([0.1, 0.2, 0.25, 0.9], [0.0, 3.0, 0.5, 0.0]),
    gn.TabulatedFacets(np.linspace(0.0, 1.5, 90), np.exp(-((np.linspace(0.0, 1.5, 90) / 0.05) ** 2))),
]


def tabulated(d: Any) -> Any:
    """The same in a table of polar angles and azimuths."""
    theta, phi = 0.5 * PI * np.linspace(0.0, 1.0, 400) ** 2, np.arange(800) * PI / 400
    return gn.TabulatedAnisotropicFacets(
        theta, phi, d.D(Direction(*np.moveaxis(gn.direction(theta[:, None], phi), -1, 0)))
    )


# It ends before the horizon: near there D cos/density is unbounded, and no sum of draws settles.
LEANING = gn.TabulatedAnisotropicFacets(
    [0.1, 0.3, 0.8, 1.4], [0.2, 1.0, 4.0], [[1.0, 1.0, 1.0], [5.0, 3.0, 0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]
)


@cache
def slopes() -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights over log tan(theta): a trapezoid, which converges fast for what decays at both ends."""
    u = np.linspace(-32.0, 100.0, 14_001)
    return np.exp(u), np.full(len(u), u[1] - u[0])


def at_slope(t: np.ndarray) -> Direction:
    c = 1.0 / np.sqrt(1.0 + t * t)
    return Direction(t * c, 0.0 * t, c)


@each_distribution
def test_facets_cover_the_surface(d):
    """Integral of D cos over the hemisphere; sin cos dtheta = (sin cos)^2 d(log tan) ."""
    t, weight = slopes()
    wm = at_slope(t)
    total = 2.0 * PI * (d.D(wm) * np.square(wm.x * wm.z) * weight).sum()
    assert total == pytest.approx(1.0, abs=1e-10 if not isinstance(d, gn.GaussianFacets) else 1e-6)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_gaussian_facets_cover_the_surface(alpha):
    theta, weight = cut(np.concatenate([[0.0], np.geomspace(1e-5, 0.5 * PI, 80)]))
    wm = Direction(np.sin(theta), 0.0 * theta, np.cos(theta))
    assert PI * (gn.GaussianFacets(alpha).D(wm) * np.sin(2.0 * theta) * weight).sum() == pytest.approx(1.0, abs=1e-11)


@pytest.mark.parametrize("d", TABLES, ids=["line", "peak", "narrow"])
def test_tables_cover_the_surface(d):
    theta, weight = cut(0.5 * PI * np.square(np.arange(513) / 512))
    wm = Direction(np.sin(theta), 0.0 * theta, np.cos(theta))
    assert PI * (d.D(wm) * np.sin(2.0 * theta) * weight).sum() == pytest.approx(1.0, abs=1e-12)


def cut(edges: np.ndarray, n: int = 12) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(n)
    parts = [(0.5 * (b - a) * (x + 1.0) + a, 0.5 * (b - a) * w) for a, b in pairwise(edges)]
    nodes, weights = zip(*parts, strict=True)
    return np.concatenate(nodes), np.concatenate(weights)


THETAS = np.radians([0.5, 10.0, 30.0, 45.0, 60.0, 75.0, 83.0, 87.0, 89.0, 89.7, 89.9, 89.99])


@cache
def steep(n: int) -> tuple[np.ndarray, np.ndarray]:
    return cut(np.concatenate([[0.0], np.geomspace(1e-9, 0.5, n)[:-1], 1.0 - np.geomspace(0.5, 1e-14, n), [1.0]]))


def hidden(d: Any, theta: float) -> float:
    """Area of the facets turned away from wo, as wo would see it: integral of D max(-wo . wm, 0) dwm = Lambda cos.

    Over polar angles t of the normal, from 90 degrees less theta on; of each ring the part |phi - 180 degrees| < psi is
    turned away, cos(psi) = cot(t) cot(theta).
    """
    x, weight = steep(800 if isinstance(d, gn.TabulatedFacets) else 80)  # tables have kinks
    t, low = 0.5 * PI - theta + theta * x, theta * (1.0 - x)
    c, s = np.sin(low), np.cos(low)
    across = s * math.sin(theta)
    cos_psi = c * math.cos(theta) / across
    sin_psi = np.sqrt(np.sin(theta * x) / across * (1.0 + cos_psi))  # 1 - cos(psi) = sin(theta x)/across
    ring = 2.0 * across * (sin_psi - np.arctan2(sin_psi, cos_psi) * cos_psi)
    wm = Direction(np.where(t < 0.5, np.sin(t), s), 0.0 * s, c)
    return float((d.D(wm) * ring * s * theta * weight).sum())


@pytest.mark.parametrize("d", thinned([*distributions(), *TABLES], [*distributions()[::3], *TABLES]), ids=repr)
def test_smith_function(d):
    """G1 = 1/(1 + Lambda) to 1e-6 from the pole to 89.99 degrees; of tables to 1e-5."""
    for theta in THETAS:
        w = gn.direction(theta, 0.3)
        G1 = 1.0 / (1.0 + hidden(d, theta) / w[2])
        relative = 1e-5 if isinstance(d, gn.TabulatedFacets) else 1e-6
        assert 1.0 / (1.0 + float(d.Lambda(Direction(*w)))) == pytest.approx(G1, rel=relative)


@pytest.mark.parametrize("theta", [0.3, 1.2, 1.5])
def test_smith_function_by_adaptive_quadrature(theta):
    """The same from the textbook's definition, (1/mu) int (s - mu) P2(s) ds, with P2 by quadrature too."""
    from scipy.integrate import quad

    gamma, mu = 3.3, 1.0 / math.tan(theta)

    def P2(s: float) -> float:
        return 2.0 * quad(lambda r: (1.0 + (s * s + r * r) / (gamma - 1.0)) ** -gamma / PI, 0.0, np.inf)[0]

    smith = quad(lambda s: (s - mu) * P2(s), mu, np.inf, epsabs=1e-10)[0] / mu
    assert float(gn.StudentT(1.0, gamma=gamma).Lambda(Direction(*gn.direction(theta, 1.0)))) == pytest.approx(
        smith, abs=2e-7
    )


# Limits and relations.


def same(a: Any, b: Any, D: float, G1: float) -> None:
    """Two distributions agree: D at 40 normals, G1 at 40 directions, anisotropy included."""
    theta = np.linspace(0.0, 1.56, 40)
    w = Direction(*np.moveaxis(gn.direction(theta, 5.0 * theta), -1, 0))
    np.testing.assert_allclose(a.D(w), b.D(w), rtol=D)
    np.testing.assert_allclose(1.0 / (1.0 + a.Lambda(w)), 1.0 / (1.0 + b.Lambda(w)), rtol=G1)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_limits(alpha):
    wide = (alpha, min(3.0 * alpha, 1.0))
    same(gn.GTR(alpha, 2.0), gn.GGX(alpha), 1e-11, 1e-6)
    same(gn.StudentT(*wide, 2.0), gn.GGX(*wide), 1e-11, 1e-7)
    same(gn.ExponentialPower(*wide, 1.0), gn.Beckmann(*wide), 1e-10, 1e-6)
    if alpha > 0.1:  # elsewhere the tail, where D is 0, never converges
        for gamma in (300.0, 1000.0):
            near = gn.StudentT(*wide, gamma), gn.Beckmann(*wide)
            pole = Direction(*gn.direction(0.8 * alpha, 0.0))
            assert near[0].D(pole) == pytest.approx(near[1].D(pole), rel=1.0 / gamma)
    n = max(2.0 / alpha**2 - 2.0, 0.0)
    if n < 900.0:
        same(gn.BlinnFacets(n), gn.StudentT(alpha, gamma=0.5 * n + 2.0), 1e-9, 1e-9)
    same(gn.BlinnFacets(0.0), gn.GGX(1.0), 1e-12, 1e-6)


def test_gtr_is_smooth_where_its_norm_has_another_form():
    """At gamma = 1 and alpha = 1 numerators and denominators of the paper's norm vanish."""
    wm = Direction(*gn.direction(0.4, 0.0))
    for made in (lambda h: gn.GTR(0.3, 1.0 + h), lambda h: gn.GTR(1.0 - abs(h), 1.7)):
        values = [made(h).D(wm) for h in (-1e-4, -1e-6, -1e-9, 0.0, 1e-9, 1e-6, 1e-4)]
        assert np.ptp(values) < 3e-4 * values[3]
        assert abs(values[4] - values[3]) < 1e-8 * values[3]
    assert gn.GTR(1.0, 1.0).D(wm) == pytest.approx(1.0 / PI, rel=1e-12)


# The papers' formulas in plain Python, in angles.


def burley(theta: float, alpha: float, gamma: float) -> float:
    a2 = alpha * alpha
    if gamma == 1.0:
        c = (a2 - 1.0) / (PI * math.log(a2))
    else:
        c = (gamma - 1.0) * (a2 - 1.0) / (PI * (1.0 - a2 ** (1.0 - gamma)))
    return c / (1.0 + (a2 - 1.0) * math.cos(theta) ** 2) ** gamma


def ribardiere(theta: float, alpha: float, gamma: float) -> float:
    top = (gamma - 1.0) ** gamma * alpha ** (2.0 * gamma - 2.0)
    return top / (PI * math.cos(theta) ** 4 * ((gamma - 1.0) * alpha**2 + math.tan(theta) ** 2) ** gamma)


def holzschuch(theta: float, beta: float, p: float) -> float:
    norm = p / (PI * beta**2 * math.gamma(1.0 / p) * math.cos(theta) ** 4)
    return norm * math.exp(-((math.tan(theta) ** 2 / beta**2) ** p))


def bagher(theta: float, alpha: float, p: float) -> float:
    from scipy.integrate import quad

    x = math.tan(theta) ** 2
    gamma = quad(lambda t: t**-p * math.exp(-t), alpha, math.inf, epsabs=0.0, epsrel=1e-12)[0]  # Gamma(1 - p, alpha)
    P22 = alpha ** (p - 1.0) / gamma * math.exp(-(alpha**2 + x) / alpha) / (alpha**2 + x) ** p
    return P22 / (PI * math.cos(theta) ** 4)


def loew(theta: float, B: float, C: float) -> float:
    from scipy.integrate import quad

    def S(c: float) -> float:
        return (1.0 + B * (1.0 - c)) ** -C

    edge = min(30.0 / B, 0.5)
    whole = (
        quad(lambda c: S(c) * c, 0.0, 1.0 - edge, epsrel=1e-12)[0]
        + quad(lambda c: S(c) * c, 1.0 - edge, 1.0, epsrel=1e-12)[0]
    )
    return S(math.cos(theta)) / (2.0 * PI * whole)


PAPERS = {
    gn.GTR: burley,
    gn.StudentT: ribardiere,
    gn.ExponentialPower: holzschuch,
    gn.SGDFacets: bagher,
    gn.ABCFacets: loew,
}


@pytest.mark.parametrize("kind", PAPERS, ids=lambda kind: kind.__name__)
def test_density_against_the_paper(kind):
    rng = np.random.default_rng(5)
    for _ in range(60):
        theta = math.acos(rng.uniform(0.1, 1.0))
        shapes = {
            gn.GTR: (rng.uniform(0.05, 0.95), rng.choice([1.0, rng.uniform(0.5, 6.0)])),
            gn.StudentT: (rng.uniform(0.1, 1.0), rng.uniform(1.6, 9.0)),
            gn.ExponentialPower: (rng.uniform(0.2, 1.0), rng.uniform(0.25, 2.0)),
            gn.SGDFacets: (rng.uniform(0.02, 1.5), rng.uniform(0.0, 2.5)),
            gn.ABCFacets: (10.0 ** rng.uniform(0.0, 4.0), rng.uniform(0.5, 4.0)),
        }[kind]
        made = kind(shapes[0], shapes[0], shapes[1]) if "alpha_x" in kind.fields else kind(*shapes)
        wm = Direction(*gn.direction(theta, rng.uniform(-PI, PI)))
        assert float(made.D(wm)) == pytest.approx(PAPERS[kind](theta, *shapes), rel=1e-8)


# Sampling.


@pytest.mark.parametrize(("d", "bound"), [
    *((gn.ExponentialPower(0.3, p=p), 4.0) for p in (0.25, 0.5, 0.99, 1.0, 1.01, 2.0, 4.0)),
    *((gn.SGDFacets(a, p), 3.0) for a in (1e-3, 0.1, 2.0) for p in (0.0, 0.6, 3.0)),
    *((d, 1.6) for d in (gn.GTR(0.1, 1.0), gn.StudentT(0.3, 0.1, 1.6), gn.BlinnFacets(9.0), gn.ABCFacets(1e3, 0.7))),
    (gn.TabulatedFacets(np.linspace(0.0, 1.5, 300), np.exp(-((np.linspace(0.0, 1.5, 300) / 0.1) ** 2))), 1.1),
], ids=repr)  # fmt: skip
def test_normals_are_drawn_nearly_as_they_are(d, bound):
    """Seen along the normal: D cos over the density of `warp_normal`, bounded, and 1 on average."""
    u = (np.stack(np.meshgrid(np.arange(8), np.arange(8192), indexing="ij"), -1).reshape(-1, 2) + 0.5) / [8, 8192]
    wm = d.warp_normal(NORMAL, u[:, 0], u[:, 1])
    weight = d.D(wm) * wm.z / d.normal_density(NORMAL, wm, wm.z)
    assert weight.max() < bound
    assert weight.mean() == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("theta", thinned([0.3, 1.2, 1.4], [1.4]))
@pytest.mark.parametrize("d", [
    *(gn.GTR(0.3, 1.5), gn.StudentT(0.3, 0.1, 2.5), gn.ExponentialPower(0.5, 0.2, p=0.7), gn.SGDFacets(0.3, 0.5)),
    *(gn.ABCFacets(50.0, 1.5), gn.GaussianFacets(0.5), gn.BlinnFacets(9.0), TABLES[0]),
    *(gn.GGX(0.3, 0.6), gn.Beckmann(0.4), LEANING, pytest.param(tabulated(gn.GGX(0.1, 0.4)), marks=pytest.mark.full)),
], ids=repr)  # fmt: skip
def test_normals_face_the_viewer(d, theta):
    """None is drawn that faces away, and what is seen of all facets adds up to cos(theta) (1 + Lambda)."""
    u = (np.stack(np.meshgrid(np.arange(64), np.arange(4096), indexing="ij"), -1).reshape(-1, 2) + 0.5) / [64, 4096]
    wo = Direction(*gn.direction(theta, 0.7))
    wm = d.warp_normal(wo, u[:, 0], u[:, 1])
    cos_d = dot(wo, wm)
    assert cos_d.min() > -1e-7
    area = (d.D(wm) * cos_d / d.normal_density(wo, wm, cos_d))[cos_d > 1e-6].sum() / len(u)
    assert area == pytest.approx(float(d.projected_area(wo)), rel=5e-3)


@pytest.mark.parametrize(("dtype", "worst", "usual"), [("float64", 3e-8, 1e-15), ("float32", 3e-7, 3e-8)])
def test_visible_slopes_of_beckmann(dtype, worst, usual):
    """The share of the visible surface up to the slope that is drawn is u, as the closed form has it: at all angles."""
    ends = np.logspace(-12, -1, 60)
    u = np.concatenate([[0.0], ends, np.linspace(0.1, 0.9, 60), 1.0 - ends]).astype(dtype)
    u = u[u < 1.0]
    cot = np.concatenate([np.logspace(-6, -2, 10), np.linspace(0.01, 4.0, 100), np.logspace(0.6, 12, 20)]).astype(dtype)
    cot, u = (x.ravel() for x in np.meshgrid(cot, u))
    wo = gn.direction(np.arctan2(1.0, cot.astype(float)), 0.0).astype(dtype)
    cot = (wo[:, 2] / wo[:, 0]).astype(float)
    wm = gn.Beckmann(1.0).warp_normal(Direction(*wo.T), u, np.full_like(u, 0.5))
    assert wm.x.dtype == dtype
    slope = -(wm.x / wm.z).astype(float)

    def seen(x: np.ndarray) -> np.ndarray:
        return cot * erfc(-x) + np.exp(-x * x) / math.sqrt(PI)

    error = np.abs(seen(slope) / seen(cot) - u)
    assert error.max() < worst
    assert np.median(error[np.abs(u - 0.5) < 0.4]) < usual


# Tables.


def test_a_table_of_ggx_is_ggx():
    theta = 0.5 * PI * np.linspace(0.0, 1.0, 1001) ** 2
    w = Direction(np.sin(theta), 0.0 * theta, np.cos(theta))
    ggx = gn.GGX(0.2)
    table = gn.TabulatedFacets(theta, 7.0 * ggx.D(w))
    seen = Direction(*(x[5:-5] for x in w))
    np.testing.assert_allclose(table.D(seen), ggx.D(seen), rtol=3e-4)
    np.testing.assert_allclose(1.0 / (1.0 + table.Lambda(seen)), 1.0 / (1.0 + ggx.Lambda(seen)), rtol=1e-4)
    wi, wo = gn.direction(0.6, 0.2), gn.direction(0.9, 3.0)
    assert gn.Microfacet(table).f(wi, wo) == pytest.approx(gn.Microfacet(ggx).f(wi, wo), rel=5e-4)


@pytest.mark.parametrize("ggx", [gn.GGX(0.1, 0.4), gn.GGX(0.5, 0.2)], ids=repr)
def test_a_table_of_anisotropic_ggx_is_ggx(ggx):
    table = tabulated(ggx)
    w = Direction(*gn.direction(np.linspace(0.001, 1.55, 150)[:, None], np.linspace(0.0, 6.28, 50)).reshape(-1, 3).T)
    np.testing.assert_allclose(table.D(w), ggx.D(w), rtol=6e-3)
    np.testing.assert_allclose(1.0 / (1.0 + table.Lambda(w)), 1.0 / (1.0 + ggx.Lambda(w)), rtol=1e-3)


def test_leaning_facets():
    """What no symmetry helps: the integral of D cos is 1, and Lambda is the projected area by plain quadrature.

    From behind, less of leaning facets is seen than of a flat surface: G1 is 1 there.
    """
    theta, weight = cut(0.5 * PI * np.square(np.arange(257) / 256), 3)
    phi = (np.arange(2048) + 0.5) * PI / 1024
    wm = gn.direction(theta[:, None], phi)
    area = LEANING.D(Direction(*np.moveaxis(wm, -1, 0))) * (np.sin(theta) * weight)[:, None] * PI / 1024
    assert (area * wm[..., 2]).sum() == pytest.approx(1.0, abs=1e-6)
    for angles in ((0.3, 0.1), (1.2, 3.0), (1.4, 1.0), (1.5, 5.0)):
        w = gn.direction(*angles)
        seen = (area * np.maximum(wm @ w, 0.0)).sum()
        assert float(LEANING.projected_area(Direction(*w))) == pytest.approx(max(seen, w[2]), rel=1e-4)


def test_isotropic_tables_agree():
    theta, values = np.linspace(0.0, 1.5, 200), np.exp(-(np.linspace(0.0, 1.5, 200) ** 2) / 0.1)
    one = gn.TabulatedFacets(theta, values)
    other = gn.TabulatedAnisotropicFacets(theta, [0.0, 2.0], np.stack([values, values], axis=1))
    w = Direction(*gn.direction(np.linspace(0.0, 1.56, 200), 2.5).T)
    np.testing.assert_allclose(other.D(w), one.D(w), atol=1e-4 * float(one.D(Direction(0.0, 0.0, 1.0))))
    np.testing.assert_allclose(1.0 / (1.0 + other.Lambda(w)), 1.0 / (1.0 + one.Lambda(w)), rtol=1e-4)


@pytest.mark.parametrize(
    ("theta", "phi", "values"),
    [([0.0, 1.0], [0.0], [1.0, 1.0]), ([0.0, 1.0], [0.0, 7.0], np.ones((2, 2))),
     ([0.0, 1.0], [1.0, 0.0], np.ones((2, 2))), ([0.0, 2.0], [0.0], [[1.0], [1.0]]),
     ([0.0, 1.0], [0.0], [[1.0], [-1.0]]), ([0.0, 1.0], [0.0], [[0.0], [0.0]]), ([0.0, 1.0], [], [[], []]),
     ([0.0, 1.0], [0.0], [[1.0], [math.nan]]), ("ab", [0.0], [[1.0]])],
)  # fmt: skip
def test_bad_tables_of_two_angles(theta, phi, values):
    with pytest.raises(ParameterError):
        gn.TabulatedAnisotropicFacets(theta, phi, values)


def test_tables_are_values(tmp_path):
    import pickle

    for m in (gn.Microfacet(TABLES[1], 0.5), gn.Microfacet(LEANING)):
        gn.save(m, tmp_path / "m.json")
        assert gn.load(tmp_path / "m.json") == m == pickle.loads(pickle.dumps(m))
        assert (
            eval(repr(m.distribution), vars(gn) | {type(m.distribution).__name__: type(m.distribution)})
            == m.distribution
        )
    d = TABLES[1]
    m = gn.Microfacet(d, 0.5)
    assert pickle.loads(pickle.dumps(m)) == m
    assert gn.TabulatedFacets(d.theta, 2.0 * d.values) != d
    assert eval(repr(d), {"TabulatedFacets": gn.TabulatedFacets}) == d
    gn.save(m, tmp_path / "m.json")
    assert gn.load(tmp_path / "m.json") == m


@pytest.mark.parametrize(
    ("theta", "values"),
    [([0.0], [1.0]), ([0.0, 1.0], [1.0]), ([0.0, 2.0], [1.0, 1.0]), ([1.0, 0.5], [1.0, 1.0]), ([0.0, 1.0], [1.0, -1.0]),
     ([0.0, 1.0], [0.0, 0.0]), ([0.0, 1.0], [1.0, math.nan]), ("ab", [1.0])],
)  # fmt: skip
def test_bad_tables(theta, values):
    with pytest.raises(ParameterError):
        gn.TabulatedFacets(theta, values)


# Special functions.


def test_gamma_functions():
    from scipy.special import gammaln

    x = np.geomspace(0.1, 1e4, 300)
    np.testing.assert_allclose(special.log_gamma(x), gammaln(x), rtol=2e-14, atol=2e-14)
    small = np.geomspace(0.05, 100.0, 300)
    ratio = np.exp(gammaln(small + 0.5) - gammaln(small))
    np.testing.assert_allclose(special.gamma_ratio(small), ratio, rtol=2e-13)
    t = np.array([-0.9, -1e-3, -1e-12, 0.0, 1e-18, 1e-9, 0.3, 1e6])
    np.testing.assert_allclose(special.log1p(t), np.log1p(t), rtol=1e-15)


# Roughness of others.

SINGLE = ["beckmann_m", "rms_slope", "ward", "blinn_phong_n", "perceptual", "smoothness", "pbrt", "pbrt_v3"]
PAIRED = ["disney", "openpbr", "gltf"]


@pytest.mark.parametrize("name", SINGLE)
def test_roughness_round_trips(name):
    alpha = np.array([0.05, 0.2, 0.9])
    there = getattr(gn.radiometry.roughness, f"{name}_from_alpha")(alpha)
    back = getattr(gn.radiometry.roughness, f"alpha_from_{name}")
    np.testing.assert_allclose(back(there), alpha, rtol=1e-12)
    np.testing.assert_allclose(back(there.astype(np.float32)), alpha, rtol=1e-5)  # a warning would be an error


@pytest.mark.parametrize("name", PAIRED)
def test_anisotropic_roughness_round_trips(name):
    x, y = np.array([0.01, 0.2, 0.9]), np.array([0.004, 0.2, 0.3])
    there = getattr(gn.radiometry.roughness, f"{name}_from_alphas")(x, y)
    back = getattr(gn.radiometry.roughness, f"alphas_from_{name}")(*there)
    np.testing.assert_allclose(back, (x, y), rtol=1e-12)


def test_roughness_values():
    """By hand; pbrt-v3's polynomial is its constant at roughness 1."""
    r = gn.radiometry.roughness
    assert r.alpha_from_perceptual(0.5) == 0.25
    assert r.alpha_from_pbrt(0.25) == 0.5
    assert r.alpha_from_pbrt_v3(1.0) == pytest.approx(1.62142)
    assert r.alpha_from_pbrt_v3(1e-9) == r.alpha_from_pbrt_v3(1e-3)
    assert r.alpha_from_blinn_phong_n(0.0) == 1.0
    assert r.blinn_phong_n_from_alpha(0.1) == pytest.approx(198.0)
    assert r.blinn_phong_n_from_phong_n(r.phong_n_from_blinn_phong_n(12.0)) == 12.0
    assert r.alpha_from_rms_slope(0.5) == pytest.approx(0.5**0.5)
    assert r.alpha_from_correlation(1e-7, 1e-6) == pytest.approx(0.2)
    assert r.alphas_from_disney(0.5, 1.0) == pytest.approx((0.25 / 0.1**0.5, 0.25 * 0.1**0.5))
    assert r.alphas_from_openpbr(0.5, 0.0) == pytest.approx((0.25, 0.25))
    assert r.alphas_from_gltf(0.5, 1.0) == pytest.approx((1.0, 0.25))
    assert r.rms_slope_from_oren_nayar_sigma(r.oren_nayar_sigma_from_rms_slope(0.4)) == pytest.approx(0.4)


def test_blinn_phong_and_beckmann_agree_at_the_pole():
    """The meaning of n = 2/alpha^2 - 2: the same D at the pole."""
    pole = Direction(0.0, 0.0, 1.0)
    for alpha in (0.05, 0.3, 0.9):
        n = gn.radiometry.roughness.blinn_phong_n_from_alpha(alpha)
        assert gn.BlinnFacets(n).D(pole) == pytest.approx(gn.Beckmann(alpha).D(pole), rel=1e-12)


def test_rms_slope_of_beckmann():
    """alpha = sqrt(2) RMS slope along x: second moment of the slopes by quadrature."""
    t, weight = slopes()
    wm = at_slope(t)
    q = np.where(t < 1e3, t * t, 0.0)
    mean = 2.0 * PI * (gn.Beckmann(0.3).D(wm) * np.square(wm.x * wm.z) * q * weight).sum()
    assert math.sqrt(0.5 * mean) == pytest.approx(gn.radiometry.roughness.rms_slope_from_alpha(0.3), rel=1e-9)


@pytest.mark.parametrize("call", [
    lambda: gn.radiometry.roughness.alpha_from_perceptual(-0.1),
    lambda: gn.radiometry.roughness.blinn_phong_n_from_alpha(0.0),
    lambda: gn.radiometry.roughness.pbrt_v3_from_alpha(2.0),
    lambda: gn.radiometry.roughness.disney_from_alphas(0.1, 0.2),
    lambda: gn.radiometry.roughness.alphas_from_gltf(0.5, 1.5),
])  # fmt: skip
def test_roughness_out_of_range(call):
    with pytest.raises(ParameterError):
        call()


def sgd(angles: Any, rho_s: float, alpha: float, p: float, F0: float, F1: float, *masking: float) -> float:
    """The model of Bagher et al. 2012 in plain Python, in angles."""
    theta_i, phi_i, theta_o, phi_o = angles
    wi, wo = gn.direction(theta_i, phi_i), gn.direction(theta_o, phi_o)
    half = (wi + wo) / np.linalg.norm(wi + wo)
    cos_d = float(wo @ half)
    theta0, c, k, amplitude = masking
    G = 1.0
    for theta in (theta_i, theta_o):
        G *= min(max(1.0 + amplitude * (1.0 - math.exp(c * max(theta - theta0, 0.0) ** k)), 0.0), 1.0)
    F = F0 - F1 * cos_d + (1.0 - F0) * (1.0 - cos_d) ** 5
    return rho_s / PI * F * bagher(math.acos(min(half[2], 1.0)), alpha, p) * G / (wi[2] * wo[2])


@pytest.mark.parametrize("count", thinned([40, 100], [40]))
def test_sgd_against_plain_python(count):
    rng = np.random.default_rng(6)
    for _ in range(count):
        low = (0.0, 0.02, 0.0, 0.2, -0.1, -0.5, 0.01, 1.0, 0.1)
        values = rng.uniform(low, (2.0, 1.0, 2.5, 1.0, 0.2, 1.0, 1.0, 6.0, 3.0))
        angles = (rng.uniform(0.0, 1.4), 0.0, rng.uniform(0.0, 1.4), rng.uniform(-PI, PI))
        assert gn.SGD(*values).f_angles(*angles) == pytest.approx(sgd(angles, *values), rel=1e-9, abs=1e-14)
