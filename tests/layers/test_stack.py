"""Stacks: limits with closed forms, photons followed one by one, energy, derivatives, texts, files, wrong input."""

import math

import numpy as np
import pytest
from layered_walk import Diffuse, Medium, Metal, Rough, Smooth, walked
from libraries import thinned

import gonio as gn
from gonio.errors import ParameterError
from gonio.formula.json_form import from_json


def pairs(n, seed, lowest=0.05):
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(lowest, 1.0, (2, n)), rng.uniform(0.0, 2.0 * np.pi, (2, n))
    return tuple(gn.direction(np.arccos(a), b) for a, b in zip(z, phi, strict=True))


WI, WO = pairs(500, 1)


def test_an_empty_medium_changes_nothing():
    base = gn.Lambertian([0.8, 0.3]) + gn.Microfacet(gn.GGX(0.2), 0.1)
    found = gn.Stack([gn.Medium(0.0)], base)
    np.testing.assert_allclose(found.f(WI, WO), base.f(WI, WO), rtol=1e-6)


@pytest.mark.parametrize("albedo", [0.3, 0.9, 0.999])
def test_deep_isotropic_media_are_chandrasekhars(albedo):
    found = gn.Stack([gn.Medium(1e5, albedo)]).f(WI, WO)
    np.testing.assert_allclose(found, gn.Chandrasekhar(albedo).f(WI, WO), rtol=3e-4)


def test_thin_media_scatter_once():
    thin = gn.Stack([gn.Interface(1.4), gn.Medium(1e-4, 0.9, 0.6), gn.Interface(1.0)])
    np.testing.assert_allclose(thin.f(WI, WO), gn.HanrahanKrueger(0.9, 0.6, 1e-4, 1.4).f(WI, WO), rtol=1e-2)
    assert thin.f(WI, WO).max() > 0.0


def test_kubelka_munk_of_thick_paint():
    mu, weights = np.polynomial.legendre.leggauss(16)
    w = gn.direction(np.arccos(0.5 + 0.5 * mu), 0.0)
    for ratio, error in ((0.001, 1e-4), (0.1, 4e-3), (1.0, 1e-2)):
        paint = gn.Stack([gn.Medium.kubelka_munk(1e3 * ratio, 1e3)])
        diffuse = (weights * (0.5 + 0.5 * mu) * gn.albedo(paint, w)).sum()
        assert abs(diffuse - (1.0 + ratio - math.sqrt(ratio * ratio + 2.0 * ratio))) < error


@pytest.mark.parametrize("eta", thinned([1.2, 1.5, 2.0], [1.5]))
def test_smooth_coats_over_lambertian_bases_are_exact(eta):
    base = gn.Lambertian([1.0, 0.5, 0.05])
    found, coat = gn.Stack([gn.Interface(eta)], base), gn.Coated(base, eta)
    np.testing.assert_allclose(found.f(WI, WO), coat.f(WI, WO), rtol=2e-4)
    np.testing.assert_allclose(found.delta_reflectance(WO), coat.delta_reflectance(WO), rtol=1e-12)
    np.testing.assert_allclose(gn.albedo(found, WI[:5]), gn.albedo(coat, WI[:5]), atol=1e-4)


def test_absorbing_coats_over_lambertian_bases_are_exact():
    base, tau = gn.Lambertian(0.8), 0.4
    found = gn.Stack([gn.Interface(1.5), gn.Medium(tau, 0.0)], base)
    np.testing.assert_allclose(found.f(WI, WO), gn.Coated(base, 1.5, tau).f(WI, WO), rtol=3e-4)


def test_mirrors_under_coats_are_exact():
    base = gn.IdealSpecular(0.7)
    found, coat = gn.Stack([gn.Interface(1.5), gn.Medium(0.3, 0.0)], base), gn.Coated(base, 1.5, 0.3)
    np.testing.assert_allclose(found.delta_reflectance(WO), coat.delta_reflectance(WO), rtol=1e-12)
    assert np.abs(found.f(WI, WO)).max() < 1e-9


@pytest.mark.parametrize(
    "layers",
    [
        [gn.Interface(1.5), gn.Medium(2.0, 1.0, 0.7)],
        pytest.param([gn.RoughInterface(1.5, 0.2), gn.Medium(0.5, 1.0, -0.4)], marks=pytest.mark.full),
        [gn.RoughInterface(1.33, 0.4), gn.Medium(1.0, 1.0), gn.RoughInterface(1.2, 0.4)],
        pytest.param(
            [gn.Medium(0.7, 1.0, 0.9), gn.RoughInterface(1.5, 0.2), gn.Interface(1.0 / 1.5)], marks=pytest.mark.full
        ),
        [gn.Medium(2.0, 1.0), gn.Interface(1.0 / 1.5)],
    ],
    ids=["smooth", "rough", "two rough", "plate", "thinner below"],
)
def test_nothing_is_lost_over_a_white_base(layers):
    white = gn.Stack(layers, gn.Lambertian(1.0))
    w = gn.direction(np.arccos([1.0, 0.8, 0.5, 0.2, 0.1]), 0.0)
    np.testing.assert_allclose(gn.albedo(white, w, tolerance=1e-5), 1.0, atol=1e-4)


WALKS = [
    ([Smooth(1.5), Medium(1.0, 0.9, 0.5)], Diffuse(0.5)),
    ([Rough(1.5, 0.1), Medium(1.0, 0.9, 0.5)], Metal(0.2, 0.8)),
    ([Rough(1.33, 0.3), Medium(3.0, 1.0, 0.7)], Diffuse(0.2)),
    ([Medium(2.0, 0.99, 0.8), Rough(1.5, 0.2)], None),
    ([Smooth(1.5), Medium(0.5, 0.8, 0.0), Smooth(1.0 / 1.5)], None),
    ([Smooth(1.4), Rough(1.3, 0.2), Medium(0.3, 0.7, -0.5)], Metal(0.3, 0.9)),
]


def stack_of(parts, base):
    made = {
        Smooth: lambda p: gn.Interface(p.eta),
        Rough: lambda p: gn.RoughInterface(p.eta, p.alpha, "lost"),
        Medium: lambda p: gn.Medium(p.depth, p.albedo, p.g),
        Diffuse: lambda p: gn.Lambertian(p.rho),
        Metal: lambda p: gn.Microfacet(gn.GGX(p.alpha), p.F),
        type(None): lambda p: None,
    }
    return gn.Stack([made[type(p)](p) for p in parts], made[type(base)](base))


@pytest.mark.parametrize("theta", [pytest.param(0.3, marks=pytest.mark.full), 1.1])
@pytest.mark.parametrize(("parts", "base"), thinned(WALKS, [WALKS[k] for k in (0, 1, 3)]))
def test_photons_leave_as_the_stack_says(parts, base, theta):
    """Counts in 8 x 8 cells of the hemisphere, beside f integrated over each; the mirrored light apart."""
    count, wi, m = 100_000, gn.direction(theta, 0.0), stack_of(parts, base)
    up, _ = walked(parts, base, wi, count, np.random.default_rng(7))
    mirrored = np.abs(up - wi * [-1.0, -1.0, 1.0]).max(axis=1) < 1e-9
    mirror = float(m.delta_reflectance(wi))
    assert abs(mirrored.sum() / count - mirror) <= 4.0 * math.sqrt(mirror / count)
    edges, turns = np.sqrt(np.linspace(0.0, 1.0, 9)), np.linspace(0.0, np.pi, 9)
    rest = up[~mirrored]
    counts, _, _ = np.histogram2d(rest[:, 2], np.abs(np.arctan2(rest[:, 1], -rest[:, 0])), [edges, turns])
    x, weights = np.polynomial.legendre.leggauss(12)
    x, weights = 0.5 + 0.5 * x, 0.5 * weights
    mu = edges[:-1, None] + np.diff(edges)[:, None] * x
    phi = turns[:-1, None] + np.diff(turns)[:, None] * x
    f = m.f(wi, gn.direction(np.arccos(mu)[:, None, :, None], np.pi - phi[None, :, None, :]))
    area = 2.0 * np.diff(edges)[:, None] * np.diff(turns)
    expected = np.einsum("abij,i,j,ai->ab", f, weights, weights, mu) * area * count
    z = (counts - expected) / np.sqrt(np.maximum(expected, 1.0))
    assert np.abs(z).max() < 4.5  # of 64 cells
    assert (z * z).mean() < 1.0 + 5.0 * math.sqrt(2.0 / z.size)
    assert abs(counts.sum() - expected.sum()) < 4.0 * math.sqrt(expected.sum())


STACKS = [
    gn.Stack(
        [gn.RoughInterface(1.5, 0.2), gn.Medium(1.0, 0.9, 0.5)], gn.Microfacet(gn.GGX(0.2), gn.Conductor(0.2, 3.0))
    ),
    gn.Stack([gn.Interface(1.5), gn.Medium([0.5, 1.0], 0.9, 0.5), gn.Interface(0.8)], gn.Lambertian([0.4, 0.2])),
    gn.Stack([gn.Medium(1.0, 0.9, -0.5), gn.Interface(1.3)], gn.Lambertian(0.4) + gn.IdealSpecular(gn.Dielectric(1.8))),
    gn.Stack([gn.Interface(1.5), gn.Medium(0.5, 0.9)], gn.Lambertian(0.3)),  # a slope by g where g is 0
]


def coarsely(*stacks, kept):
    """The stacks with few nodes and orders, on which derivatives and differences depend alike, by default those `kept`;
    as they are, `full`."""
    coarse = [gn.Stack(m.layers, m.__dict__.get("base"), tolerance=0.1) for m in stacks]
    return [*thinned(coarse, [coarse[k] for k in kept]), *(pytest.param(m, marks=pytest.mark.full) for m in stacks)]


@pytest.mark.parametrize("m", [*coarsely(*STACKS[1:], kept=[2]), pytest.param(STACKS[0], marks=pytest.mark.full)])
@pytest.mark.usefixtures("uncompiled")  # kernels of all derivatives take longer to compile than few directions
def test_derivatives_are_those_of_differences(m):
    wi, wo = (w[:40] for w in (WI, WO))
    found = m.jacobian(wi, wo)
    np.testing.assert_allclose(found.f, m.f(wi, wo), rtol=1e-13)
    for path, p in m.parameters.items():
        step = 1e-6 * max(float(np.max(np.abs(p.value))), 0.1)  # where total reflection sets in, nodes meet kinks
        high, low = (m.replace({path: p.value + sign * step}).f(wi, wo) for sign in (1.0, -1.0))
        slope = (high - low) / (2.0 * step)
        np.testing.assert_allclose(found.by[path], slope, atol=2e-4 * np.abs(slope).max(), err_msg=path)


ROUGH_BELOW = gn.Stack([gn.Interface(1.3), gn.RoughInterface(1.4, 0.2)], gn.Lambertian(0.2), tolerance=0.05)


@pytest.mark.parametrize("m", [*thinned(STACKS, STACKS[1:2]), ROUGH_BELOW])
def test_stacks_are_reciprocal_and_sampled(m):
    np.testing.assert_allclose(m.f(WI, WO), m.f(WO, WI), rtol=1e-9)
    wo = gn.direction(0.7, 0.3)
    s = m.sample(np.broadcast_to(wo, (30_000, 3)), np.random.default_rng(5).random((30_000, 2)))
    weight = s.weight if m.channels else s.weight[:, None]
    error = 4.0 * weight.std(axis=0) / math.sqrt(len(weight))
    assert (np.abs(weight.mean(axis=0) - gn.albedo(m, wo)) < error + 1e-4).all()


@pytest.mark.parametrize(
    ("finest", "tolerances"),
    thinned([(1e-3, (1e-2,)), (1e-4, (1e-2, 1e-3)), (1e-5, (1e-2, 1e-3, 1e-4))], [(1e-3, (1e-2,))]),
)
def test_tolerance_is_kept(finest, tolerances):
    layers, base = [gn.RoughInterface(1.5, 0.1), gn.Medium(1.0, 0.9, 0.5)], gn.Microfacet(gn.GGX(0.2), 0.9)
    exact = gn.Stack(layers, base, tolerance=finest).f(WI, WO)
    for tolerance in tolerances:
        off = np.abs(gn.Stack(layers, base, tolerance=tolerance).f(WI, WO) - exact)
        np.testing.assert_array_less(np.percentile(off / exact, [50, 90]), [0.2 * tolerance, tolerance])


def test_texts_copies_and_other_libraries():
    m = STACKS[1]
    assert eval(repr(m), {"Stack": gn.Stack, **vars(gn), "array": np.array}) == m  # what repr writes is Python
    assert from_json(m.to_json()) == m
    other = m.replace({"0.eta": 1.4})
    assert other != m
    assert other.layers[0].eta == 1.4
    np.testing.assert_array_equal(other.replace({"0.eta": 1.5}).f(WI[:3], WO[:3]), m.f(WI[:3], WO[:3]))
    single = m.f(WI.astype(np.float32), WO.astype(np.float32))
    np.testing.assert_allclose(single, m.f(WI, WO), rtol=1e-3, atol=1e-5)


def test_a_stack_becomes_a_scatfun_file(tmp_path):
    m = gn.Stack([gn.RoughInterface(1.5, 0.3), gn.Medium(2.0, 0.95, 0.3)], gn.Lambertian(0.3))
    gn.save(m, tmp_path / "paint.bsdf", format="SCATFUN", nodes=24)
    found = gn.load(tmp_path / "paint.bsdf")
    wi, wo = pairs(200, 3, lowest=0.2)
    np.testing.assert_allclose(found.f(wi, wo), m.f(wi, wo), rtol=0.02)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gn.Stack([gn.Lambertian(0.5)]), "layer 0 is .*expected layers"),
        (lambda: gn.Stack([], 0.5), "expected a reflectance"),
        (lambda: gn.Stack([], gn.Lambertian(0.5), tolerance=1.0), "1e-6 to 0.1"),
        (lambda: gn.Stack([], gn.Microfacet(gn.GGX(0.1, 0.3))), "anisotropic"),
        (lambda: gn.RoughInterface(1.0, 0.2), "at least 0.01 from 1"),
        (lambda: gn.Stack([gn.Medium(np.ones((4, 4, 1)))]), "map"),
        (lambda: gn.Stack([gn.Medium([1.0, 2.0])], gn.Lambertian([0.1, 0.2, 0.3])), "channels"),
        (lambda: gn.Medium.kubelka_munk(-1.0, 2.0), "not negative"),
    ],
)
def test_wrong_input_is_refused(make, words):
    with pytest.raises(gn.Error, match=words) as caught:
        make()
    assert isinstance(caught.value, (ParameterError, gn.errors.ShapeError))


# Over nothing: both sides.


def sphere(n, seed):
    """Pairs whose directions are in front and behind in all four ways."""
    wi, wo = pairs(n, seed)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (2, n, 1))
    return wi * np.where([0, 0, 1], signs[0], 1.0), wo * np.where([0, 0, 1], signs[1], 1.0)


BOTH_I, BOTH_O = sphere(400, 3)
ALL_ROUND = gn.direction([0.0, 0.6, 1.0, 1.4, 1.7, 2.2, 2.8, np.pi], 0.4)


@pytest.mark.parametrize("eta", [1.5, [1.3, 2.0]])
def test_a_smooth_interface_over_nothing_is_a_smooth_dielectric(eta):
    found, glass = gn.Stack([gn.Interface(eta)]), gn.SmoothDielectric(eta)
    np.testing.assert_array_equal(found.index, glass.index)
    assert found.sides == "both"
    assert not found.f(BOTH_I, BOTH_O).any()
    for call in (gn.albedo, gn.transmittance):
        np.testing.assert_allclose(call(found, ALL_ROUND), call(glass, ALL_ROUND), atol=1e-12)
    if np.ndim(eta) == 0:
        u = np.random.default_rng(1).random((len(ALL_ROUND), 2))
        ours, theirs = found.sample(ALL_ROUND, u), glass.sample(ALL_ROUND, u)
        straight = theirs.wi[:, 2] * ALL_ROUND[:, 2] < 0.0
        through = straight & (ours.wi[:, 2] * ALL_ROUND[:, 2] < 0.0)
        np.testing.assert_allclose(ours.wi[through], theirs.wi[through], atol=1e-12)


@pytest.mark.parametrize("depth", thinned([0.0, 0.3], [0.3]))
def test_two_smooth_interfaces_are_a_pane(depth):
    """The sum of the bounces of light that counts as unpolarized at each: `ThinDielectric` has s and p apart, which is
    the same along the normal."""
    cos = np.abs(ALL_ROUND[:, 2])
    F, a = gn.Dielectric(1.5).F(cos), np.exp(-depth / np.sqrt(1.0 - (1.0 - cos * cos) / 2.25))
    passed = (1.0 - F) ** 2 * a / (1.0 - (F * a) ** 2)
    expected, exact = {gn.albedo: F + passed * F * a, gn.transmittance: passed}, gn.ThinDielectric(1.5, depth)
    pane = gn.Stack([gn.Interface(1.5), gn.Medium(depth, 0.0), gn.Interface(1.0 / 1.5)])
    bare = gn.Stack([gn.Interface(1.5), gn.Interface(1.0 / 1.5)])
    for found in [pane] if depth else [pane, bare]:
        assert abs(found.index - 1.0) < 1e-15
        for call in (gn.albedo, gn.transmittance):
            np.testing.assert_allclose(call(found, ALL_ROUND), expected[call], atol=1e-12)
            np.testing.assert_allclose(call(found, ALL_ROUND)[[0, -1]], call(exact, ALL_ROUND)[[0, -1]], atol=1e-12)
            np.testing.assert_allclose(call(found, ALL_ROUND), call(exact, ALL_ROUND), atol=0.023)
        assert np.abs(found.f(BOTH_I, BOTH_O)).max() < 1e-10


def test_nothing_and_an_empty_medium_let_all_light_through():
    for layers in ([], [gn.Medium(0.0)]):
        found = gn.Stack(layers)
        np.testing.assert_allclose(gn.transmittance(found, ALL_ROUND), 1.0, atol=1e-12)
        np.testing.assert_allclose(gn.albedo(found, ALL_ROUND), 0.0, atol=1e-12)


def test_thin_media_over_nothing_pass_light_scattered_once():
    depth, w, g = 1e-4, 0.9, 0.6
    thin = gn.Stack([gn.Medium(depth, w, g)])
    wi = WI * [1.0, 1.0, -1.0]
    d = 1.0 + g * g + 2.0 * g * (wi * WO).sum(axis=-1)
    phase = (1.0 - g * g) / (4.0 * np.pi * d**1.5)
    clear = (WI[:, 2] > 0.2) & (WO[:, 2] > 0.2)
    expected = (w * phase * depth / (WI[:, 2] * WO[:, 2]))[clear]
    np.testing.assert_allclose(thin.f(wi, WO)[clear], expected, rtol=2e-3)
    absorbed = 1.0 - gn.albedo(thin, WO[:5]) - gn.transmittance(thin, WO[:5])
    np.testing.assert_allclose(absorbed, (1.0 - w) * depth / WO[:5, 2], rtol=5e-3)


GOES_THROUGH = [
    ([gn.Medium(1.0, 1.0)], 1e-4),
    ([gn.Medium(3.0, 1.0, 0.9)], 1e-4),
    ([gn.Interface(1.5), gn.Medium(2.0, 1.0, 0.7), gn.Interface(1.0 / 1.5)], 1e-4),
    ([gn.Interface(1.5), gn.Medium(2.0, 1.0, 0.5)], 1e-4),
    ([gn.Medium(2.0, 1.0), gn.Interface(1.0 / 1.5)], 1e-4),
    ([gn.RoughInterface(1.5, 0.2), gn.Medium(1.0, 1.0, 0.9), gn.RoughInterface(1.0 / 1.5, 0.1)], 1e-4),
    ([gn.RoughInterface(1.5, 0.1)], 2e-5),
    ([gn.RoughInterface(1.0 / 1.5, 0.3)], 2e-5),
    ([gn.RoughInterface(1.5, 0.2), gn.Medium(0.5, 1.0, 0.5)], 1e-4),
    ([gn.RoughInterface(1.5, 0.2), gn.RoughInterface(1.0 / 1.5, 0.3)], 1e-4),
    # A smooth interface weighs what facets begin to reflect totally, by a root that the nodes meet.
    ([gn.RoughInterface(1.5, 0.2), gn.Interface(1.0 / 1.5)], 1.7e-4),
]


@pytest.mark.parametrize(("layers", "error"), thinned(GOES_THROUGH, [GOES_THROUGH[k] for k in (2, 8)]))
def test_nothing_is_lost_of_light_that_goes_through(layers, error):
    white = gn.Stack(layers)
    np.testing.assert_allclose(
        gn.albedo(white, ALL_ROUND, tolerance=1e-5) + gn.transmittance(white, ALL_ROUND, tolerance=1e-5),
        1.0,
        atol=error,
    )


OVER_NOTHING = [
    gn.Stack([gn.Interface(1.5), gn.Medium([0.5, 1.0], 0.9), gn.Interface(0.8)]),
    gn.Stack([gn.RoughInterface(1.5, 0.3), gn.Medium(0.5, 0.8, -0.3)]),
    gn.Stack([gn.Interface(1.4), gn.RoughInterface(0.7, 0.2), gn.Medium(0.5, 0.8), gn.RoughInterface(1.3, 0.3)]),
]


@pytest.mark.parametrize("m", coarsely(*OVER_NOTHING, kept=[0, 1, 2]))
def test_light_may_go_either_way_through(m):
    n = {1.0: 1.0, -1.0: m.index}
    of_i, of_o = (np.array([n[s] ** 2 for s in np.sign(w[:, 2])])[:, None] for w in (BOTH_I, BOTH_O))
    there, back = (m.f(*ws).reshape(len(BOTH_I), -1) for ws in ((BOTH_I, BOTH_O), (BOTH_O, BOTH_I)))
    np.testing.assert_allclose(there / of_o, back / of_i, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("m", OVER_NOTHING[:2])
def test_a_stack_turned_over_is_the_layers_from_below(m):
    layers = [
        layer if isinstance(layer, gn.Medium) else layer.replace({"eta": 1.0 / layer.eta}) for layer in m.layers[::-1]
    ]
    other = gn.Stack(layers)
    over = [-1.0, 1.0, -1.0]
    found, expected = m.f(BOTH_I, BOTH_O), other.f(BOTH_I * over, BOTH_O * over)
    off = np.abs(found - expected) / np.abs(found).max()
    np.testing.assert_array_less(np.percentile(off, [50, 95, 100]), [1e-5, 1e-4, 2e-3])


@pytest.mark.parametrize(
    ("m", "theta"),
    [
        pytest.param(m, theta, marks=() if k else pytest.mark.full)
        for k, m in enumerate(OVER_NOTHING[:2])
        for theta in (0.7, 2.3)
    ],
)
def test_samples_go_through(m, theta):
    wo = gn.direction(theta, 0.3)
    s = m.sample(np.broadcast_to(wo, (60_000, 3)), np.random.default_rng(5).random((60_000, 2)))
    weight = s.weight.reshape(len(s.weight), -1)
    n = 1.0 / m.index if theta > 1.6 else m.index
    across = s.wi[:, 2] * wo[2] < 0.0
    for here, expected in ((~across, gn.albedo(m, wo)), (across, gn.transmittance(m, wo) / n**2)):
        got = np.where(here[:, None], weight, 0.0)
        error = 4.0 * got.std(axis=0) / math.sqrt(len(got))
        assert (np.abs(got.mean(axis=0) - expected) < error + 1e-4).all()


@pytest.mark.parametrize(
    ("m", "by"),
    [
        (gn.Stack(OVER_NOTHING[1].layers, tolerance=0.1), ["0.alpha", "1.albedo"]),
        *(pytest.param(*m.values, None, marks=pytest.mark.full) for m in coarsely(*OVER_NOTHING[:2], kept=[])),
    ],
)
@pytest.mark.usefixtures("uncompiled")
def test_derivatives_of_transmission_are_those_of_differences(m, by):
    wi, wo = (w[:60] for w in (BOTH_I, BOTH_O))
    found = m.jacobian(wi, wo, by)
    np.testing.assert_allclose(found.f, m.f(wi, wo), rtol=1e-12)
    for path, p in m.parameters.items():
        if by and path not in by:
            continue
        if path == "0.eta" and isinstance(m.layers[0], gn.RoughInterface):
            continue  # facets begin to reflect totally by a square root: differences jump as nodes pass it
        step = 1e-4 * max(float(np.max(np.abs(p.value))), 0.1)
        high, low = (m.replace({path: p.value + sign * step}).f(wi, wo) for sign in (1.0, -1.0))
        slope = (high - low) / (2.0 * step)
        off = np.abs(found.by[path] - slope) / np.abs(slope).max()
        assert np.percentile(off, 95) < 2e-4, path


@pytest.mark.usefixtures("uncompiled")
def test_an_index_behind_that_is_as_in_front_may_change():
    """Light behind then moves to other panels; near grazing the differences themselves do."""
    wi, wo = (w[:60] for w in (BOTH_I, BOTH_O))
    m, step = gn.Stack([gn.Interface(1.5), gn.Medium(0.5, 0.9), gn.Interface(1.0 / 1.5)], tolerance=0.1), 1e-4
    high, low = (m.replace({"2.eta": 1.0 / 1.5 + change}).f(wi, wo) for change in (step, -step))
    slope = (high - low) / (2.0 * step)
    off = np.abs(m.jacobian(wi, wo, ["2.eta"]).by["2.eta"] - slope) / np.abs(slope).max()
    assert np.median(off) < 1e-5


THROUGH = [
    [Medium(1.0, 0.9, 0.5)],
    [Smooth(1.5), Medium(1.0, 0.9, 0.0)],
    [Medium(0.5, 0.9, 0.7), Rough(1.5, 0.2)],
    [Rough(1.5, 0.2), Medium(0.5, 0.8, 0.0), Rough(1.0 / 1.5, 0.3)],
    [Smooth(1.5), Rough(1.0 / 1.5, 0.2)],
]


@pytest.mark.parametrize("theta", [0.3, pytest.param(1.1, marks=pytest.mark.full)])
@pytest.mark.parametrize("parts", thinned(THROUGH, [THROUGH[k] for k in (0, 3, 4)]))
def test_photons_go_through_as_the_stack_says(parts, theta):
    """Counts in 8 x 8 cells of the lower hemisphere, beside f integrated over each; the light that is not scattered
    apart."""
    count, wi, m = 100_000, gn.direction(theta, 0.0), stack_of(parts, None)
    _, down = walked(parts, None, wi, count, np.random.default_rng(7))
    straight = -wi / m.index
    straight[2] = -math.sqrt(1.0 - straight[0] ** 2)
    hit = np.abs(down - straight).max(axis=1) < 1e-9
    black = gn.Stack([layer.replace({"albedo": 0.0}) if isinstance(layer, gn.Medium) else layer for layer in m.layers])
    rough = any(isinstance(p, Rough) for p in parts)
    delta = 0.0 if rough else float(gn.transmittance(black, wi))
    assert abs(hit.sum() / count - delta) <= 4.0 * math.sqrt(delta / count)
    edges, turns = np.sqrt(np.linspace(0.0, 1.0, 9)), np.linspace(0.0, np.pi, 9)
    rest = down[~hit]
    counts, _, _ = np.histogram2d(-rest[:, 2], np.abs(np.arctan2(rest[:, 1], -rest[:, 0])), [edges, turns])
    x, weights = np.polynomial.legendre.leggauss(12)
    x, weights = 0.5 + 0.5 * x, 0.5 * weights
    mu = edges[:-1, None] + np.diff(edges)[:, None] * x
    phi = turns[:-1, None] + np.diff(turns)[:, None] * x
    f = m.f(wi, gn.direction(np.pi - np.arccos(mu)[:, None, :, None], np.pi - phi[None, :, None, :]))
    area = 2.0 * np.diff(edges)[:, None] * np.diff(turns)
    expected = np.einsum("abij,i,j,ai->ab", f, weights, weights, mu) * area * count
    z = (counts - expected) / np.sqrt(np.maximum(expected, 1.0))
    assert np.abs(z).max() < 4.5  # of 64 cells
    assert (z * z).mean() < 1.0 + 5.0 * math.sqrt(2.0 / z.size)


def test_the_index_of_a_rough_interface_may_be_a_tensor(torch):
    eta = torch.tensor(1.5, requires_grad=True)
    assert gn.RoughInterface(eta).eta is eta
    with pytest.raises(ParameterError, match="expected eta at least"):
        gn.RoughInterface(torch.tensor(1.001, requires_grad=True))


def test_what_does_not_scatter_takes_one_order():
    """What rounding leaves of light that went straight through is no reason for more: 256 of them took 200 MB."""
    black = gn.Stack([gn.Interface(1.5), gn.Medium(1.0, 0.0)])
    assert black._response(0).orders == 1
    assert gn.transmittance(black, WI[0]) < gn.transmittance(gn.SmoothDielectric(1.5), WI[0])
