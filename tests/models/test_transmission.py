"""Materials on both sides of a surface: against closed forms, the paper's formulas, Mitsuba and each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.base.calls import breaches
from gonio.base.reflectance import Reflectance
from gonio.errors import LeftOutWarning, ParameterError
from gonio.formula.mueller import of_amplitudes
from gonio.integrals.over_hemisphere import integrate
from gonio.models._reversed import Reversed
from gonio.numerics.lattice import lattice

PI = math.pi
ALL_ROUND = gn.direction(np.radians([0.0, 25.0, 60.0, 85.0, 95.0, 130.0, 150.0, 180.0]), 0.4)
GLASS = [
    gn.RoughDielectric(gn.GGX(0.2), 1.5),
    gn.RoughDielectric(gn.GGX(0.1, 0.4), 0.67),
    gn.RoughDielectric(gn.Beckmann(0.3), 2.4),
]
SHEETS = [
    gn.Across(gn.Microfacet(gn.GGX(0.1, 0.3))),
    gn.Lambertian(0.3) + gn.DiffuseTransmission(0.2),
    gn.TwoSided(gn.Lambertian(0.6), gn.Microfacet(gn.GGX(0.2))) + 0.1 * gn.Absorber(0.5),
    gn.Sheet(gn.Lambertian(0.4), gn.Lambertian(0.2), gn.Lambertian(0.1), gn.Microfacet(gn.GGX(0.4), 0.3)),
    gn.Rotated(gn.RoughDielectric(gn.GGX(0.1, 0.4), 1.5), 0.7),
    gn.KullaContyDielectric(0.5, 1.5),
]


def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions (count, 3) all over the sphere."""
    u = lattice(count, 4)
    wi, wo = (gn.direction(np.arccos(1.0 - 2.0 * u[:, k]), 2.0 * PI * u[:, k + 1]) for k in (0, 2))
    return wi, wo


def squares(m: Reflectance, w: np.ndarray) -> np.ndarray:
    """n^2 of the side that directions are on."""
    return np.where(w[..., 2] < 0.0, np.asarray(m.index, float), 1.0) ** 2


def walter(wi: np.ndarray, wo: np.ndarray, alpha: float, eta: float) -> np.ndarray:
    """f of the paper for GGX, term by term, in the names of its equations, both sides."""
    i, o, n = wi.astype(np.longdouble), wo.astype(np.longdouble), np.array([0.0, 0.0, 1.0])
    eta_i, eta_o = (np.where(w[:, 2] < 0.0, eta, 1.0) for w in (i, o))
    reflected = i[:, 2] * o[:, 2] > 0.0
    h = np.where(reflected[:, None], i + o, -(eta_i[:, None] * i + eta_o[:, None] * o))
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    m = h * np.sign(h @ n)[:, None]
    ih, oh = (i * m).sum(-1), (o * m).sum(-1)
    cos = m @ n
    D = alpha**2 / (PI * cos**4 * (alpha**2 + (1.0 - cos**2) / cos**2) ** 2)

    def G1(v: np.ndarray) -> np.ndarray:
        tan2 = (1.0 - v[:, 2] ** 2) / v[:, 2] ** 2
        seen = (v * m).sum(-1) * v[:, 2] > 0.0
        return seen * 2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * tan2))

    c, ratio = np.abs(oh), np.where(reflected, np.where(o[:, 2] > 0, eta, 1 / eta), eta_i / eta_o)
    g2 = ratio**2 - 1.0 + c**2
    g = np.sqrt(np.maximum(g2, 0.0))
    F = 0.5 * ((g - c) / (g + c)) ** 2 * (1.0 + ((c * (g + c) - 1.0) / (c * (g - c) + 1.0)) ** 2)
    F = np.where(g2 <= 0.0, 1.0, F)
    G = G1(i) * G1(o)
    f_r = F * G * D / (4.0 * np.abs(i[:, 2] * o[:, 2]))
    f_t = np.abs(ih * oh) / np.abs(i[:, 2] * o[:, 2]) * eta_o**2 * (1.0 - F) * G * D / (eta_i * ih + eta_o * oh) ** 2
    return np.asarray(np.where(reflected, f_r, f_t * (ih * oh < 0.0)), dtype=float)


@pytest.mark.parametrize(("alpha", "eta"), [(0.2, 1.5), (0.5, 0.67), (0.3, 2.4)])
def test_the_papers_formulas(alpha, eta):
    wi, wo = pairs(4000)
    away = np.minimum(np.abs(wi[:, 2]), np.abs(wo[:, 2])) > 1e-3
    f, paper = (x[away] for x in (gn.RoughDielectric(gn.GGX(alpha), eta).f(wi, wo), walter(wi, wo, alpha, eta)))
    assert (paper > 0.0).mean() > 0.5
    np.testing.assert_allclose(f, paper, rtol=1e-6, atol=1e-9 * paper.max())
    close = np.abs(f - paper) <= 1e-10 * paper
    assert close.mean() > 0.98  # beside the critical angle the paper's 1 - F has few digits


@pytest.mark.parametrize("m", [*GLASS, *SHEETS], ids=str)
def test_reciprocity_of_f_over_n2(m):
    wi, wo = pairs(20000)
    there, back = m.f(wi, wo) / squares(m, wo), m.f(wo, wi) / squares(m, wi)
    if isinstance(m, gn.Sheet):  # of which each way is a part of its own
        reflected = wi[:, 2] * wo[:, 2] > 0.0
        there, back = there[reflected], back[reflected]
    np.testing.assert_allclose(there, back, rtol=1e-7, atol=1e-9 * there.max())


@pytest.mark.parametrize("m", thinned([*GLASS, *SHEETS], [*GLASS[1:2], *SHEETS[:4], SHEETS[5]]), ids=str)
def test_samples_add_up_to_integrals(m):
    """Weights of either side average to the integrals over it, with two numbers and with three."""
    for view in ALL_ROUND[1::2]:
        exact = [integrate(m, view, 1e-5, incident=False, sides=sides).value for sides in ("front", "across")]
        for numbers, off in ((2, 4e-3), (3, 1e-2)):  # a lattice in three dimensions is as much coarser in each
            s = m.sample(np.broadcast_to(view, (1 << 16, 3)), lattice(1 << 16, numbers))
            same = s.wi[:, 2] * view[2] > 0.0
            found = [(s.weight * side).mean() for side in (same, ~same)]
            np.testing.assert_allclose(found, exact, atol=off * max(exact))
            used = (s.pdf > 0.0) & ~s.delta
            wo = np.broadcast_to(view, s.wi.shape)
            np.testing.assert_allclose(s.pdf[used], m.pdf(s.wi, wo)[used], rtol=1e-6)
            weight = m.f(s.wi, wo) * np.abs(s.wi[:, 2])
            np.testing.assert_allclose(s.weight[used], weight[used] / s.pdf[used], rtol=1e-6, atol=1e-12)


def test_smooth_interfaces_lose_nothing():
    for eta in (0.67, 1.33, 1.5, 2.4):
        F = gn.fate(gn.SmoothDielectric(eta), ALL_ROUND)
        np.testing.assert_allclose(F.absorbed, 0.0, atol=1e-12)
        np.testing.assert_allclose(F.reflected[0], ((eta - 1.0) / (eta + 1.0)) ** 2, rtol=1e-12)
    inside = gn.fate(gn.SmoothDielectric(1.5), gn.direction(np.radians([137.0, 139.0]), 0.0))
    assert inside.transmitted[0] == 0.0 < inside.transmitted[1]  # the critical angle is 41.8 degrees


def test_delta_radiance_and_flux():
    """Radiance is compressed by n^2, flux is not; the refracted direction is Snell's."""
    m, wo = gn.SmoothDielectric(1.5), gn.direction(0.7, 0.2)
    s = m.sample(np.broadcast_to(wo, (4, 3)), np.array([[0.01, 0.5], [0.5, 0.5], [0.9, 0.1], [0.99, 0.9]]))
    through = s.wi[1]
    assert np.arccos(-through[2]) == pytest.approx(math.asin(math.sin(0.7) / 1.5), rel=1e-12)
    T = 1.0 - m.delta_reflectance(wo)
    assert m.delta_reflectance(wo, across=True) == pytest.approx(T / 2.25, rel=1e-12)
    assert m.delta_reflectance(through, across=True) == pytest.approx(T * 2.25, rel=1e-12)
    assert gn.transmittance(m, wo) == pytest.approx(T, rel=1e-12)
    assert gn.transmittance(m, through) == pytest.approx(T, rel=1e-12)
    assert gn.Lambertian(0.5).delta_reflectance(wo, across=True) == 0.0


@pytest.mark.parametrize("eta", [1.5, 2.4])
@pytest.mark.parametrize("depth", [0.0, 0.3])
def test_pane_is_the_sum_of_its_bounces(eta, depth):
    """The Mueller matrices of every bounce, each of its own amplitudes, one after the other; R and T are their first
    elements, which are the means of the series of s and of p, and not the series of the mean."""
    cos = math.cos(1.2)
    ct = math.sqrt(1.0 - (1.0 - cos * cos) / eta**2)
    r = np.array([(cos - eta * ct) / (cos + eta * ct), (eta * cos - ct) / (eta * cos + ct)])  # of s and p
    J, T_in = (np.array(of_amplitudes(*x).rows, float) for x in (r, np.sqrt(1.0 - r * r)))
    inside, a = np.array(of_amplitudes(*-r).rows, float), math.exp(-depth / ct) * np.eye(4)
    R, T, light = J.copy(), np.zeros((4, 4)), a @ T_in
    for _ in range(60):
        T += T_in @ light
        light = a @ inside @ light
        R += T_in @ light
        light = a @ inside @ light
    pane = gn.ThinDielectric(eta, depth)
    wo = gn.direction([1.2, PI - 1.2], 0.3)
    np.testing.assert_allclose(pane.delta_mueller(wo), np.stack([R, R]), atol=1e-14)
    np.testing.assert_allclose(pane.delta_mueller(wo, across=True), np.stack([T, T]), atol=1e-14)
    found = gn.fate(pane, wo)
    np.testing.assert_allclose(found.reflected, R[0, 0], rtol=1e-12)
    np.testing.assert_allclose(found.transmitted, T[0, 0], rtol=1e-12)
    F = 0.5 * (r @ r)
    assert F + (1 - F) ** 2 * F * a[0, 0] ** 2 / (1 - (F * a[0, 0]) ** 2) > 1.04 * R[0, 0]


def test_a_pane_shares_each_polarization_out():
    """R + T = 1 for s and for p, up to the horizon; at Brewster's angle all of p passes; both matrices can be."""
    pane = gn.ThinDielectric(1.5)
    wo = gn.direction([0.0, 0.5, math.atan(1.5), 1.2, 1.57, PI - 1e-3], 0.2)
    R, T = pane.delta_mueller(wo), pane.delta_mueller(wo, across=True)
    np.testing.assert_allclose((R + T)[:, :2, :2], np.broadcast_to(np.eye(2), (6, 2, 2)), atol=1e-14)
    assert T[2, 0, 0] - T[2, 0, 1] == pytest.approx(1.0, abs=1e-14)
    assert gn.polarization.realizable(R, 1e-12).all() and gn.polarization.realizable(T, 1e-12).all()
    single = pane.delta_mueller(wo.astype(np.float32), across=True)
    np.testing.assert_allclose(single, T, rtol=2e-5, atol=1e-6)


def test_a_filter_leaves_polarization_as_it_is():
    M = gn.Absorber([0.1, 1.0]).delta_mueller(gn.direction(1.0, 0.2), across=True)
    np.testing.assert_allclose(M, np.exp(-np.array([0.1, 1.0]) / math.cos(1.0))[:, None, None] * np.eye(4), rtol=1e-14)


@pytest.mark.parametrize(
    ("alpha", "eta"),
    thinned(
        [
            *((0.05, 1.5), (0.3, 1.5), (1.0, 1.5), (0.1, 1.33), (0.5, 2.4)),
            *((0.4, 0.7), (0.06, 1.022), (0.1, 1.06), (0.2, 1 / 1.04)),
        ],
        [(0.05, 1.5), (1.0, 1.5), (0.4, 0.7), (0.1, 1.06)],
    ),
)
def test_compensated_interfaces_lose_nothing(alpha, eta):
    with pytest.warns(LeftOutWarning, match="light that meets facets twice is lost by RoughDielectric"):
        lost = gn.absorptance(gn.RoughDielectric(gn.GGX(alpha), eta), ALL_ROUND, tolerance=1e-5)
    kept = gn.absorptance(gn.KullaContyDielectric(alpha, eta), ALL_ROUND, tolerance=1e-5)
    assert np.abs(kept).max() < 1e-3 < np.abs(lost).max()


def test_transmittances_agree_both_ways():
    """Light of a diffuse surround, radiance n^2, goes through in equal amounts: T_1 n_1^2 = T_2 n_2^2 on average."""
    x, w = np.polynomial.legendre.leggauss(24)
    mu, weight = 0.5 * (x + 1.0), w * 0.5 * (x + 1.0)
    for m in (gn.RoughDielectric(gn.GGX(0.3), 1.5), gn.KullaContyDielectric(0.3, 1.5)):
        sides = [gn.transmittance(m, gn.direction(theta, 0.0)) @ weight for theta in (np.arccos(mu), np.arccos(-mu))]
        assert sides[0] == pytest.approx(2.25 * sides[1], rel=2e-3)


@pytest.mark.parametrize(("polar", "azimuths"), thinned([(16, 13), (24, 19)], [(16, 13)]))
def test_across_measurements(polar, azimuths):
    """Tables in both ways of a sheet: f, transmittance and samples are those of the tables."""
    table = gn.tables.tabulate(
        gn.Microfacet(gn.GGX(0.4), [0.5, 0.3, 0.2]), "angles", resolution=(polar, polar, azimuths)
    )
    sheet = gn.Sheet(gn.Lambertian(0.2), gn.Lambertian(0.1), table, table)
    wi, wo = gn.direction(PI - 0.5, PI), gn.direction(0.4, 0.0)
    np.testing.assert_allclose(sheet.f(wi, wo), table.f(gn.direction(0.5, PI), wo))
    np.testing.assert_allclose(sheet.f(wo, wi), table.f(wo * [-1, 1, 1], wi * [-1, 1, -1]))
    there = gn.direction(0.5, 0.0)
    np.testing.assert_allclose(gn.transmittance(sheet, there), gn.albedo(table, there), atol=2e-4)
    s = sheet.sample(np.broadcast_to(wo, (1 << 15, 3)), lattice(1 << 15, 3))
    through = (s.weight * (s.wi[:, 2:] < 0.0)).mean(axis=0)
    np.testing.assert_allclose(through, integrate(table, wo, 1e-4, incident=False).value, rtol=1e-2)


def test_seen_from_behind_directions_are_turned_about_y():
    brushed = gn.Microfacet(gn.GGX(0.1, 0.4))
    tilted, turn = gn.Rotated(brushed, 0.5), np.array([-1.0, 1.0, -1.0])
    wi, wo = gn.direction(0.4, 0.3), gn.direction(0.5, 2.0)
    m = gn.TwoSided(gn.Lambertian(0.5), tilted)
    assert m.f(wi * turn, wo * turn) == pytest.approx(tilted.f(wi, wo), rel=1e-12)
    glass = gn.Rotated(gn.RoughDielectric(gn.GGX(0.1, 0.4), 1.5), 0.5)
    inverse = gn.Rotated(gn.RoughDielectric(gn.GGX(0.1, 0.4), 1.0 / 1.5), -0.5)
    through = gn.direction(PI - 0.3, 3.0)
    assert glass.f(through * turn, wo * turn) == pytest.approx(inverse.f(through, wo), rel=1e-9)


def test_refused():
    for make in (gn.Coated, gn.RoughCoated, gn.ShadingNormal, gn.Across):
        with pytest.raises(ParameterError, match="transmits light; expected a reflectance lit and seen in front only"):
            make(gn.DiffuseTransmission(0.3))
    with pytest.raises(ParameterError, match="between equal media refract nothing"):
        gn.RoughDielectric(eta=1.0)
    with pytest.raises(ParameterError, match="between equal media"):
        gn.RoughDielectric(eta=1.5).replace(eta=[1.5, 1.0])
    with pytest.raises(ParameterError, match=r"refractive indices 1\.5 and 1\.4"):
        gn.RoughDielectric(eta=1.5) + gn.SmoothDielectric(1.4)
    with pytest.raises(ParameterError, match=r"refractive indices 1\.0 and 1\.5"):
        gn.Lambertian(0.2) + gn.DiffuseTransmission(0.3) + gn.SmoothDielectric(1.5)
    two = gn.RoughDielectric(eta=1.5) + 0.5 * gn.SmoothDielectric(1.5)
    with pytest.raises(ParameterError, match="refractive indices"):
        two.replace({"0.eta": 1.4})
    with pytest.raises(ParameterError, match="refracts each channel to another direction"):
        gn.SmoothDielectric([1.4, 1.5]).sample([0, 0, 1], [0.5, 0.5])
    with pytest.raises(ParameterError, match=r"expected an index of at least 1\.02"):
        gn.KullaContyDielectric(eta=1.01)


def test_files_of_reflection_refuse_transmission(tmp_path):
    with pytest.raises(ParameterError, match="holds reflection of one side only"):
        gn.save(gn.Sheet(), tmp_path / "sheet.binary")
    for m in (*GLASS, *SHEETS):
        gn.save(m, tmp_path / "m.json")
        assert gn.load(tmp_path / "m.json") == m


def test_reflectances_of_cones_are_those_of_reflection():
    m = gn.Lambertian(0.3) + gn.DiffuseTransmission(0.4)
    assert gn.reflectance(m) == pytest.approx(0.3, abs=1e-4)
    assert gn.remote_sensing.white_sky_albedo(m) == pytest.approx(0.3, abs=1e-4)


def test_light_from_behind():
    """Under lights on the sphere: straight through, diffuse from both sides, and a sun behind."""
    sky, up = gn.EnvironmentLight.studio(height=32), np.array([0.0, 0.0, 1.0])
    for wo in gn.direction([0.5, 2.5], 0.3):
        passed = math.exp(-0.5 / abs(wo[2]))
        seen = gn.reflected_radiance(gn.Absorber(0.5), sky, wo, samples=64)
        np.testing.assert_allclose(seen, passed * sky.incident(-wo), rtol=1e-6)
        assert gn.reflected_radiance(gn.Absorber(0.5), gn.ConstantLight(2.0), wo) == pytest.approx(2.0 * passed)
    white = gn.Lambertian(1.0)
    above, below = (gn.reflected_radiance(white, sky, n, normal=n, samples=1 << 14) for n in (up, -up))
    paper = gn.TwoSided(gn.Lambertian(0.4), gn.Lambertian(0.4)) + gn.DiffuseTransmission(0.5)
    for wo, expected in ((up, 0.4 * above + 0.5 * below), (-up, 0.4 * below + 0.5 * above)):
        np.testing.assert_allclose(gn.reflected_radiance(paper, sky, wo, samples=1 << 14), expected, rtol=5e-3)
    sun = gn.DistantLight(gn.direction(2.5, 0.3), 3.0)
    lit = 0.5 / PI * 3.0 * abs(math.cos(2.5))
    assert gn.reflected_radiance(paper, sun, up) == pytest.approx(lit, rel=1e-6)


def test_maps_and_channels():
    rough = np.array([[0.1], [0.3]])
    m = gn.RoughDielectric(gn.GGX(rough), [1.5, 1.6, 1.7])
    w = gn.direction([0.3, 2.8], 0.2)
    found = gn.transmittance(m, w)
    for k in range(2):
        for c, eta in enumerate((1.5, 1.6, 1.7)):
            one = gn.RoughDielectric(gn.GGX(float(rough[k, 0])), eta)
            assert found[k, c] == pytest.approx(gn.transmittance(one, w[k]), abs=2e-4)
    leaves = gn.DiffuseTransmission(np.linspace(0.1, 0.9, 5)[:, None])
    np.testing.assert_allclose(gn.fate(leaves, [0, 0, 1.0]).absorbed[:, 0], np.linspace(0.9, 0.1, 5), atol=1e-4)


MITSUBA = [
    ("ggx", gn.RoughDielectric(gn.GGX(0.1), 1.5), 1.5e-5),
    ("ggx", gn.RoughDielectric(gn.GGX(0.1, 0.4), 1.5), 1.5e-5),
    ("ggx", gn.RoughDielectric(gn.GGX(0.2), 0.67), 1.5e-5),
    ("ggx", gn.RoughDielectric(gn.GGX(0.25), 2.4), 2e-4),
]


@pytest.mark.parametrize(("kind", "m", "most"), MITSUBA, ids=str)
def test_mitsuba(kind, m, most):
    """f and pdf over the sphere, in both modes of transport: 99.9 % of the values above a hundredth of the largest.

    Lower ones are beside the critical angle, where Mitsuba's single precision has fewer digits (there is no variant of
    it in double precision). The paper's formula, written straight down in NumPy, has the same errors in single
    precision: of 2e5 pairs across, f above 1e-6 of the largest, 99.9 % are within 1.2e-4, 1.4e-3, 8e-4, 6e-4, 3.9e-3
    (alpha, eta: 0.1, 1.5; 0.3, 1.5; 0.3, 1.33; 0.2, 0.67; 0.25, 2.4), Mitsuba within 1.1e-4, 1.5e-3, 1.2e-3, 5e-4,
    3.7e-3; in double precision it is within 1e-11 of gonio, and gonio's own single precision within 2e-5.
    """
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("llvm_ad_rgb")
    widths = {"alpha_u": m.distribution.alpha_x, "alpha_v": m.distribution.alpha_y}
    index = {"int_ior": m.eta, "ext_ior": 1.0}
    theirs = mi.load_dict({"type": "roughdielectric", "distribution": kind, **widths, **index})
    wi, wo = (w.astype(np.float32) for w in pairs(100_000))
    exact_i, exact_o = (w / np.linalg.norm(w.astype(float), axis=-1, keepdims=True) for w in (wi, wo))
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(np.ascontiguousarray(wo.T))
    for mode, f in (("Radiance", m.f(exact_i, exact_o)), ("Importance", m.f(exact_o, exact_i))):
        context = mi.BSDFContext(getattr(mi.TransportMode, mode))
        value, pdf = theirs.eval_pdf(context, si, mi.Vector3f(np.ascontiguousarray(wi.T)))
        both = (np.array(value)[0], f * np.abs(exact_i[:, 2])), (np.array(pdf), m.pdf(exact_i, exact_o))
        for found, true in both:
            used = true > 1e-2 * true.max()
            assert np.quantile(np.abs(found - true)[used] / true[used], 0.999) < most


def test_a_sheet_of_two_transmissions_need_not_be_reciprocal():
    forward = gn.Microfacet(gn.GGX(0.4), 0.3)
    for pair in ((forward, Reversed(forward)), (Reversed(forward), forward)):
        assert "reciprocity" not in breaches(gn.Sheet(forward=pair[0], backward=pair[1]))
    one = gn.Sheet(forward=gn.Lambertian(0.2), backward=gn.Lambertian(0.2))
    two = gn.Sheet(forward=gn.Lambertian(0.2), backward=gn.Lambertian(0.3))
    assert breaches(one) == {} and list(breaches(two)) == ["reciprocity"]
    assert [gn.check(m, laws=["reciprocity"]).laws[0].passed for m in (one, two)] == [True, False]


def test_micrometres_of_a_film_and_numbers_of_a_spectrum():
    with pytest.warns(gn.errors.MeaningWarning, match="in micrometres"):
        gn.ThinFilm(1.33, 0.4, 1.0)
    with pytest.raises(ParameterError, match="in micrometres"):
        gn.Dispersion(1, [0.0, 0.69, 0.068], [0.21, 6.7])
    with pytest.raises(ParameterError, match=r"write spectrum\.at"):
        gn.Conductor(*gn.spectra.refractive_index("gold")).F(1.0)
