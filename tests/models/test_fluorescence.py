"""Fluorescence: bispectral matrices against numbers worked out by hand, photons, materials under a light, bad input."""

from __future__ import annotations

import json
import math
import pickle
import re

import numpy as np
import pytest
from libraries import colour_science

import gonio as gn
from gonio.errors import ParameterError
from gonio.formula import bands
from gonio.formula.json_form import from_json

PI = math.pi
UP = np.array([0.0, 0.0, 1.0])
NM = np.arange(380.0, 781.0, 10.0)
EMISSION = np.exp(-(((NM - 560.0) / 25.0) ** 2))
DYE = gn.FluorescentLambertian(
    rho=0.1 + 0.6 / (1.0 + np.exp((520.0 - NM) / 10.0)),
    absorbed=0.95 * np.exp(-(((NM - 450.0) / 40.0) ** 2)),
    emission=EMISSION / EMISSION.sum(),
    quantum_yield=0.9,
    wavelength=NM,
)
TAKEN = 0.9 * (1.0 - DYE.rho) * DYE.absorbed
INK = gn.Donaldson([[0.2, 0.0, 0.0], [0.3, 0.6, 0.0], [0.1, 0.15, 0.7]], wavelengths=[400.0, 500.0, 650.0])
RNG = np.random.default_rng(16)


def directions(count: int) -> tuple[np.ndarray, np.ndarray]:
    u = RNG.random((count, 4))
    return gn.direction(np.arccos(u[:, 0]), 6.3 * u[:, 1]), gn.direction(np.arccos(u[:, 2]), 6.3 * u[:, 3])


# The matrix.


def test_matrix_of_a_dye_by_hand():
    F = DYE.reradiation(UP, gn.direction(0.7, 1.0))
    o, i = 20, 6
    expected = TAKEN[i] * DYE.emission[o] * NM[i] / NM[o] / PI
    np.testing.assert_allclose(F[o, i], expected, rtol=1e-14)
    same = np.diagonal(F) - TAKEN * DYE.emission / PI
    np.testing.assert_allclose(same, DYE.rho / PI, rtol=1e-13)
    np.testing.assert_allclose(DYE.f(UP, UP), DYE.rho / PI, rtol=1e-14)


def test_without_fluorescence_the_matrix_is_diagonal():
    m = gn.Microfacet(gn.GGX(0.3), [0.2, 0.5, 0.9])
    wi, wo = directions(5)
    F = m.reradiation(wi, wo)
    assert not m.fluoresces and F.shape == (5, 3, 3)
    np.testing.assert_array_equal(F, m.f(wi, wo)[..., None] * np.eye(3))
    E = [1.0, 2.0, 3.0]
    assert m.under(E) is m


def test_below_the_horizon_nothing_leaves_and_nan_stays():
    down = np.array([0.6, 0.0, -0.8])
    assert not INK.reradiation(UP, down).any() and not INK.reradiation(down, UP).any()
    assert np.isnan(INK.reradiation(UP, np.full(3, np.nan))).all()


def test_compositions_pass_it_on():
    wi, wo = directions(6)
    whole = 0.5 * INK + gn.Lambertian(0.2) + gn.Rotated(gn.Donaldson(INK.matrix, gn.Microfacet(gn.GGX(0.1, 0.4))), 0.4)
    shape = gn.Rotated(gn.Microfacet(gn.GGX(0.1, 0.4)), 0.4).f(wi, wo)
    expected = (0.5 / PI + shape[:, None, None]) * INK.matrix + 0.2 / PI * np.eye(3)
    np.testing.assert_allclose(whole.reradiation(wi, wo), expected, rtol=1e-12)
    filtered = gn.Lambertian(0.0) + np.array([1.0, 0.5, 0.1]) * INK  # a weight by wavelength dims what leaves
    expected = np.array([1.0, 0.5, 0.1])[:, None] * INK.matrix / PI
    np.testing.assert_allclose(filtered.reradiation(UP, UP), expected, rtol=1e-14)


def test_a_map_has_a_matrix_at_each_place():
    scale = np.linspace(0.5, 1.0, 6).reshape(2, 3, 1, 1)
    m = gn.Donaldson(INK.matrix * scale, wavelengths=[400.0, 500.0, 650.0])
    np.testing.assert_allclose(m.reradiation(UP, UP), INK.matrix * scale / PI, rtol=1e-14)
    assert m.f(UP, UP).shape == (2, 3, 3)


def test_single_precision_and_large_batches():
    wi, wo = directions(3000)
    whole = gn.Coated(DYE).reradiation(wi, wo)
    one = gn.Coated(DYE).reradiation(wi[1234], wo[1234])
    np.testing.assert_allclose(whole[1234], one, rtol=1e-12)
    single = gn.Coated(DYE).reradiation(wi.astype("f4"), wo.astype("f4"))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, whole, rtol=2e-5, atol=1e-9)


def test_other_libraries():
    wi, wo = directions(4)
    m = gn.Coated(INK, tau=[0.1, 0.2, 0.0]) + gn.FluorescentLambertian(
        0.2, [0.9, 0.1, 0.0], [0.0, 0.5, 0.5], wavelength=[400.0, 500.0, 650.0]
    )
    expected, seen = m.reradiation(wi, wo), m.under([3.0, 1.0, 2.0])
    torch = pytest.importorskip("torch")
    a, b = torch.tensor(wi), torch.tensor(wo)
    np.testing.assert_allclose(m.reradiation(a, b).numpy(), expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(seen.f(a, b).numpy(), seen.f(wi, wo), rtol=1e-12)
    yields = torch.tensor(0.8, dtype=torch.float64, requires_grad=True)
    dye = gn.FluorescentLambertian(0.2, [0.9, 0.1], [0.0, 0.5], yields, wavelength=[400.0, 500.0])
    dye.reradiation(a[0], b[0])[1, 0].backward()
    np.testing.assert_allclose(float(yields.grad), 0.8 * 0.9 * 0.5 * 0.8 / PI, rtol=1e-12)


# Photons.


def test_photon_budget_of_a_dye():
    sent = gn.photon_albedo(DYE, gn.direction([0.0, 1.0, 1.5], 0.0))
    np.testing.assert_allclose(sent, np.broadcast_to(DYE.rho + TAKEN, sent.shape), rtol=1e-4)
    assert sent.max() < 1.0


def test_photons_of_what_does_not_fluoresce_are_its_albedo():
    m = gn.Lambertian([0.2, 0.6])
    np.testing.assert_array_equal(gn.photon_albedo(m, UP), gn.albedo(m, UP))


def test_energy_is_lost_to_heat():
    """Every photon leaves, at 600 nm: of the energy that arrived at 400 nm a third stays behind."""
    m = gn.FluorescentLambertian(0.0, [1.0, 0.0], [0.0, 1.0], 1.0, wavelength=[400.0, 600.0])
    np.testing.assert_allclose(gn.photon_albedo(m, UP), [1.0, 0.0], atol=1e-4)
    np.testing.assert_allclose(PI * m.reradiation(UP, UP)[1, 0], 400.0 / 600.0, rtol=1e-14)


DUNTLEY = 0.5963
"""Internal diffuse reflectance at a surface of index 1.5, as in textbooks."""


@pytest.mark.parametrize("coat", [gn.Coated, gn.RoughCoated])
def test_no_photon_is_lost_under_a_clear_coat(coat):
    """All light that enters is taken, each photon gives one, and the base is white where they leave."""
    m = coat(gn.FluorescentLambertian([0.0, 1.0], [1.0, 0.0], [0.0, 1.0], 1.0, wavelength=[400.0, 600.0]))
    w = gn.direction([0.0, 1.0], 0.0)
    white = gn.albedo(coat(gn.Lambertian(1.0)), w)  # 1, and less what rough facets lose
    np.testing.assert_allclose(gn.photon_albedo(m, w)[:, 0], white, atol=1e-4)


def test_photons_under_a_coat_by_hand():
    dye = gn.FluorescentLambertian([0.2, 0.6], [0.7, 0.0], [0.0, 0.8], 0.9, wavelength=[400.0, 600.0])
    coated, plain = gn.Coated(dye), gn.Coated(gn.Lambertian([0.2, 0.6]))
    fluorescent = (gn.photon_albedo(coated, UP) - gn.albedo(plain, UP))[0]
    taken = 0.96 / (1.0 - 0.2 * DUNTLEY) * 0.8 * 0.7
    expected = taken * 0.9 * 0.8 * (1.0 - DUNTLEY) / (1.0 - 0.6 * DUNTLEY)
    np.testing.assert_allclose(fluorescent, expected, rtol=2e-4)
    lost = gn.Coated(dye, internal="lost")
    fluorescent = gn.photon_albedo(lost, UP)[0] - gn.albedo(gn.Coated(gn.Lambertian(0.2), internal="lost"), UP)
    np.testing.assert_allclose(fluorescent, 0.96 * 0.8 * 0.7 * 0.9 * 0.8 * (1.0 - DUNTLEY), rtol=2e-4)


def test_light_that_the_coat_sends_back_excites_again():
    """All wavelengths at once: what goes to and fro between the coat and the dye is a geometric series of matrices."""
    bare = gn.FluorescentLambertian(
        *([0.1, 0.0, 0.3, 0.2, 0.5], [0.9, 0.8, 0.5, 0.2, 0.1], [0.05, 0.1, 0.4, 0.3, 0.15]),
        wavelength=[400.0, 450.0, 500.0, 550.0, 600.0],
    )
    D, R = PI * bare.reradiation(UP, UP), np.full(5, DUNTLEY)
    thick = gn.Coated(bare + gn.Lambertian(0.02), tau=[0.5, 0.0, 0.1, 0.2, 0.3])
    clear = PI * gn.Coated(bare).reradiation(UP, UP) * 1.5**2 / 0.96**2
    rest, expected = D.copy(), np.zeros((5, 5))
    for _ in range(60):
        expected, rest = expected + rest, D @ (R[:, None] * rest)
    np.testing.assert_allclose(clear, expected, rtol=2e-4)
    wi, wo = directions(3)
    E = RNG.random(5) + 0.1
    for m in (thick, gn.RoughCoated(bare, alpha=0.3), 0.5 * gn.Rotated(gn.Coated(bare), 0.3) + gn.Lambertian(0.1)):
        np.testing.assert_allclose(m.under(E).f(wi, wo) * E, m.reradiation(wi, wo) @ E, rtol=1e-12)


def test_no_photon_is_lost_where_every_wavelength_excites():
    """A dye that takes all light and gives a photon for each, at wavelengths that it takes up again."""
    dye = gn.FluorescentLambertian(0.0, 1.0, [0.1, 0.3, 0.6], 1.0, wavelength=[400.0, 500.0, 600.0])
    np.testing.assert_allclose(gn.photon_albedo(gn.Coated(dye), gn.direction([0.0, 1.2], 0.0)), 1.0, atol=1e-4)
    again = gn.Coated(gn.Coated(dye, eta=1.3), eta=1.5)
    assert gn.photon_albedo(again, UP).max() < 1.0


def test_a_coat_over_what_sends_out_more_than_arrives():
    with pytest.raises(ParameterError, match="grows without end"):
        gn.Coated(gn.Donaldson([[0.5, 2.0], [2.0, 0.5]], wavelengths=[400.0, 500.0])).reradiation(UP, UP)


def test_coats_of_torch_keep_their_derivatives():
    torch = pytest.importorskip("torch")
    a = torch.tensor(UP)

    def F(eta):
        return gn.Coated(INK, eta=eta).reradiation(a, a)[2, 0]

    eta = torch.tensor(1.5, dtype=torch.float64, requires_grad=True)
    F(eta).backward()
    h = 1e-5
    slope = (F(torch.tensor(1.5 + h, dtype=torch.float64)) - F(torch.tensor(1.5 - h, dtype=torch.float64))) / (2.0 * h)
    np.testing.assert_allclose(float(eta.grad), float(slope), rtol=1e-6)


def test_what_goes_to_and_fro_has_no_derivatives_by_name():
    m = gn.Coated(DYE).under(np.ones(41)) + gn.Lambertian(0.1)
    assert set(m.jacobian(UP, UP).by) == {"0.light", "0.seen", "1.rho"}
    with pytest.raises(ParameterError, match=r"0\.of\.base\.quantum_yield'\): changes what goes to and fro"):
        m.jacobian(UP, UP, by="0.of.base.quantum_yield")
    lost = gn.Coated(DYE, internal="lost").under(np.ones(41))
    assert "of.base.quantum_yield" in lost.jacobian(UP, UP).by


def test_a_coat_has_the_numbers_of_either_wavelength():
    m = gn.Coated(INK, eta=[1.6, 1.5, 1.45], tau=[0.5, 0.1, 0.0], internal="lost")
    wi, wo = directions(4)
    F = m.reradiation(wi, wo)
    parts = [gn.Coated(gn.Lambertian(1.0), eta, tau, "lost") for eta, tau in zip(m.eta, m.tau, strict=True)]

    def through(coat: gn.Reflectance, w: np.ndarray) -> np.ndarray:
        """T and absorption one way, over the index."""
        return np.sqrt(PI * coat.f(w, w))

    i, o = 0, 2
    into, out = through(parts[i], wi) * m.eta[i], through(parts[o], wo) / m.eta[o]
    np.testing.assert_allclose(F[:, o, i], INK.matrix[o, i] / PI * into * out, rtol=1e-12)


# Under a light.


def test_radiance_factor_under_two_illuminants_is_that_of_the_matrix():
    flat, led = np.ones(41), 1e-3 + np.exp(-(((NM - 450.0) / 12.0) ** 2))
    D = DYE.reradiation(UP, UP) * PI
    peaks = []
    for E in (flat, led):
        factor = gn.albedo(DYE.under(E), gn.direction([0.3], 0.0))[0]
        np.testing.assert_allclose(factor, D @ E / E, rtol=1e-5)
        peaks.append(factor.max())
    assert 1.0 < peaks[0] < 3.0 < peaks[1]  # more leaves than arrives, and far more where little arrives


@pytest.mark.parametrize("name", ["D65", "A", "LED-B1"])
def test_radiance_factor_under_standard_illuminants(name):
    colour_science()
    lamp = gn.spectra.illuminant(name)
    E = lamp.bands(NM)
    found = gn.albedo(DYE.under(lamp), gn.direction(0.3, 0.0))
    np.testing.assert_allclose(found, PI * DYE.reradiation(UP, UP) @ E / E, rtol=1e-5)


def test_light_adds_up():
    E1, E2 = RNG.random(3) + 0.1, RNG.random(3) + 0.1
    wi, wo = directions(5)
    m = gn.Coated(INK, tau=[0.3, 0.0, 0.1])
    sum_of_both = m.under(E1).f(wi, wo) * E1 + m.under(E2).f(wi, wo) * E2
    np.testing.assert_allclose(m.under(E1 + E2).f(wi, wo) * (E1 + E2), sum_of_both, rtol=1e-12)
    np.testing.assert_allclose(m.under(E1).f(wi, wo), m.under(7.0 * E1).f(wi, wo), rtol=1e-13)
    np.testing.assert_allclose(m.under(E1).f(wi, wo) * E1, (m.reradiation(wi, wo) @ E1), rtol=1e-12)


def test_a_lamp_of_ultraviolet_alone():
    m = INK.under([1.0, 0.0, 0.0], seen=[1.0, 1.0, 1.0])
    np.testing.assert_allclose(gn.albedo(m, UP), [0.2, 0.3, 0.1], rtol=1e-5)
    with pytest.raises(ParameterError, match=r"no light at 500 nm and 1 other .*seen="):
        INK.under([1.0, 0.0, 0.0])


def test_spectra_of_light_are_bound_to_the_bands():
    lamp = gn.Spectrum([300.0, 500.0, 800.0], [0.0, 1.0, 1.0])
    E = np.diff(bands.edges(INK.wavelengths))[:, 0] * lamp.bands(INK.wavelengths)
    np.testing.assert_allclose(INK.under(lamp).f(UP, UP), INK.under(E).f(UP, UP), rtol=1e-14)


def test_samples_of_both_lobes():
    m = (INK + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))).under([1.0, 1.0, 1.0])
    sample = m.sample(gn.direction(0.5, 0.0), RNG.random((200_000, 2)))
    np.testing.assert_allclose(sample.weight.mean(0), gn.albedo(m, gn.direction(0.5, 0.0)), rtol=5e-3)
    report = gn.check(INK.under([1.0, 1.0, 1.0]), laws=["pdf", "sampling", "derivatives", "positivity"])
    assert report.passed, report


def test_a_picture_is_the_radiance_under_the_light():
    E = [2.0, 1.0, 0.5]
    m = INK.under(E)
    radiance = gn.reflected_radiance(m, gn.ConstantLight(np.array(E)), UP)
    np.testing.assert_allclose(radiance, INK.matrix @ E, rtol=1e-3)
    assert gn.render(m, gn.ConstantLight(1.0), size=8, samples=1).pixels.shape == (8, 8, 3)


# Wavelengths.


def test_emission_as_a_spectrum_is_shared_out_to_bands():
    emission = gn.Spectrum([500.0, 550.0, 650.0], [0.0, 1.0, 0.0])
    dye = gn.FluorescentLambertian(0.1, gn.Spectrum([300.0, 400.0, 700.0], [1.0, 1.0, 0.0]), emission, 0.9)
    wide = dye.at(np.arange(400.0, 701.0, 10.0))
    np.testing.assert_allclose(wide.emission.sum(), 1.0, rtol=1e-12)
    np.testing.assert_allclose(gn.photon_albedo(wide, UP), 0.1 + 0.9 * 0.9 * wide.absorbed, rtol=1e-4)
    np.testing.assert_allclose(dye.at([500.0, 550.0, 600.0]).emission, [6.25 / 75.0, 40.625 / 75.0, 25.0 / 75.0])
    assert dye.at(550.0).emission == 0.0 and np.ndim(dye.at(550.0).f(UP, UP)) == 0
    with pytest.raises(ParameterError, match=r"500 to 650 nm, and wavelengths from 400 to 440 nm.*overlap"):
        dye.at([400.0, 420.0, 440.0])
    with pytest.raises(ParameterError, match="without light"):
        dye.replace(emission=gn.Spectrum([500.0, 600.0], [0.0, 0.0])).at([500.0, 550.0])


def test_a_matrix_at_other_wavelengths_keeps_the_light():
    D = np.tril(RNG.random((41, 41)), -1) * 0.02 + np.diag(np.linspace(0.1, 0.9, 41))
    D[-1, :-1] = 0.0  # half of a new outer band lies outside
    m = gn.Donaldson(D, wavelengths=NM)
    fine = m.at(np.arange(380.0, 780.1, 5.0))
    np.testing.assert_allclose(fine.f(UP, UP)[::2], np.diagonal(D) / PI, rtol=1e-12)
    sums, fine_sums = D.sum(0) - np.diagonal(D), fine.matrix.sum(0) - np.diagonal(fine.matrix)
    np.testing.assert_allclose(fine_sums[::2], sums, atol=1e-14)
    np.testing.assert_array_equal(m.at(NM).matrix, D)
    np.testing.assert_allclose(m.at(550.0).f(UP, UP), D[17, 17] / PI, rtol=1e-12)
    coarse = m.at(np.arange(390.0, 771.0, 20.0))
    np.testing.assert_allclose(coarse.matrix.sum(0)[:-1], D.sum(0)[1:-1:2][:-1], rtol=1e-12)
    with pytest.raises(ParameterError, match="nothing is extrapolated"):
        m.at([350.0, 400.0])


def test_bands_share_out_all_light():
    known, new = np.array([400.0, 410.0, 420.0, 430.0]), np.array([425.0, 405.0])
    np.testing.assert_allclose(bands.edges(new), [[415.0, 435.0], [395.0, 415.0]])
    np.testing.assert_allclose(bands.shared(known, new), [[0.0, 0.0, 1.0, 1.0], [1.0, 1.0, 0.0, 0.0]])


# Values as all others.


@pytest.mark.parametrize("m", [INK, gn.Coated(DYE), INK + gn.Lambertian(0.1), INK.under([1.0, 2.0, 3.0])], ids=range(4))
def test_json_pickle_and_expressions(m):
    assert pickle.loads(pickle.dumps(m)) == m
    again = from_json(json.loads(json.dumps(m.to_json())))
    assert again == m and (m.channels > 3 or gn.expression(repr(m)) == m)
    np.testing.assert_array_equal(again.reradiation(UP, UP), m.reradiation(UP, UP))


def test_equality_sees_the_matrix_and_the_wavelengths():
    assert gn.Donaldson(INK.matrix, wavelengths=[400.0, 500.0, 650.0]) == INK
    assert gn.Donaldson(INK.matrix, wavelengths=[400.0, 500.0, 660.0]) != INK
    assert INK.replace(matrix=INK.matrix * 0.5) != INK
    np.testing.assert_allclose(INK.replace(matrix=INK.matrix * 0.5).f(UP, UP), 0.5 * INK.f(UP, UP))


def test_replacing_reaches_into_a_material_under_a_light():
    m = DYE.under(np.ones(41))
    less = m.replace({"of.quantum_yield": 0.45})
    glow = (m.f(UP, UP) - DYE.rho / PI) * 0.5
    np.testing.assert_allclose(less.f(UP, UP) - DYE.rho / PI, glow, atol=1e-12)
    np.testing.assert_allclose(
        m.jacobian(UP, UP, by="of.quantum_yield").by["of.quantum_yield"], 2.0 * glow / 0.9, atol=1e-12
    )


# Bad input.


@pytest.mark.parametrize(
    ("matrix", "said"),
    [
        ([[0.2, -0.01], [0.3, 0.6]], r"negative, to -0.01.*numpy.maximum"),
        ([[0.2, 0.1, 0.3], [0.3, 0.6, 0.1]], r"shape \(2, 3\).*\(C, C\)"),
        ([0.2, 0.6], r"shape \(2,\).*\(C, C\)"),
        ([[0.2, np.nan], [0.3, 0.6]], "NaN or infinite"),
        ("blue", r"\(C, C\)"),
        (np.zeros((0, 0)), "shape"),
    ],
    ids=["negative", "not square", "a vector", "NaN", "a word", "empty"],
)
def test_what_is_no_matrix(matrix, said):
    with pytest.raises(ParameterError, match=said):
        gn.Donaldson(matrix)


def test_wavelengths_that_do_not_fit():
    with pytest.raises(ParameterError, match="in micrometres"):
        gn.Donaldson(INK.matrix, wavelengths=[0.4, 0.5, 0.65])
    with pytest.raises(ParameterError, match="expected 3"):
        gn.Donaldson(INK.matrix, wavelengths=[400.0, 500.0])
    with pytest.raises(ParameterError, match="not declared"):
        gn.Donaldson(INK.matrix).at([450.0, 550.0])
    bare = gn.FluorescentLambertian(0.1, [0.9, 0.0], [0.0, 1.0])
    for call in (lambda: bare.reradiation(UP, UP), lambda: bare.under([1.0, 1.0]), lambda: gn.photon_albedo(bare, UP)):
        with pytest.raises(ParameterError, match="wavelengths"):
            call()
    with pytest.raises(ParameterError, match="wavelengths are not known"):
        gn.photon_albedo(gn.Donaldson(INK.matrix), UP)
    with pytest.raises(ParameterError, match="no channel axis"):
        gn.Lambertian(0.5).reradiation(UP, UP)


def test_emission_that_adds_up_to_more_than_one():
    with pytest.raises(ParameterError, match=r"add up to 1\.5; expected at most 1"):
        gn.FluorescentLambertian(0.1, 0.5, [0.5, 0.5, 0.5])
    with pytest.raises(ParameterError, match=r"add up to 1\.5"):
        gn.FluorescentLambertian([0.1, 0.1, 0.2], 0.5, 0.5)


@pytest.mark.parametrize(
    ("light", "said"),
    [
        ([1.0, 1.0], r"shape \(2,\); expected 3 numbers"),
        ([1.0, -1.0, 1.0], "negative, infinite or NaN"),
        ("D65", "expected 3 numbers"),
        (gn.Spectrum([500.0, 800.0], [1.0, 1.0]), "nothing is extrapolated"),
        (gn.Spectrum([0.38 * 1000, 420.0], [1.0, 1.0]), "nothing is extrapolated"),
    ],
    ids=["too few", "negative", "a word", "does not reach", "elsewhere"],
)
def test_what_is_no_light(light, said):
    with pytest.raises(ParameterError, match=said):
        INK.under(light)


def test_a_model_around_it_that_does_not_say_where_the_light_goes():
    m = gn.NormalMapped(INK, 0.3)
    assert m.fluoresces
    for call in (lambda: m.reradiation(UP, UP), lambda: m.under([1.0, 1.0, 1.0])):
        with pytest.raises(ParameterError, match=re.escape("NormalMapped: Donaldson(")):
            call()


def test_beside_light_that_is_transmitted():
    m = INK + gn.DiffuseTransmission(0.1)
    np.testing.assert_allclose(PI * m.reradiation(UP, UP), INK.matrix, rtol=1e-14)
    np.testing.assert_allclose(PI * m.reradiation(-UP, UP), 0.1 * np.eye(3), rtol=1e-14)
    assert not m.reradiation(-UP, -UP).any()
    for call in (lambda: m.under([1.0, 1.0, 1.0]), lambda: gn.photon_albedo(m, UP)):
        with pytest.raises(ParameterError, match="transmits light"):
            call()
    report = gn.check(m, laws=["photons"])
    assert not report.laws and "transmits" in report.notes[0]


def test_arrays_with_names():
    """Two axes of channels, of the light that leaves and that arrives; of Dask's arrays, arrays of Dask."""
    xarray = pytest.importorskip("xarray")
    wi, wo = directions(4)
    m = gn.Coated(DYE)
    named = xarray.DataArray(wi, dims=("view", "xyz"), coords={"view": [1, 2, 3, 4]})
    F = m.reradiation(named, wo[0])
    assert F.dims == ("view", "channel_o", "channel_i") and list(F.channel_i) == list(F.channel_o) == list(
        DYE.wavelengths
    )
    np.testing.assert_array_equal(F, m.reradiation(wi, wo[0]))
    dask = pytest.importorskip("dask.array")
    later = m.reradiation(dask.from_array(wi, chunks=(2, 3)), wo)
    assert type(later).__module__.startswith("dask")
    np.testing.assert_allclose(later.compute(), m.reradiation(wi, wo), rtol=1e-13)


@pytest.mark.parametrize(
    "m",
    [
        INK,
        INK + gn.Lambertian(0.1),
        gn.Lambertian([0.1, 0.2, 0.3]),
        pytest.param(DYE, marks=pytest.mark.full),  # of whose bands every one meets every one: a minute to compile
        pytest.param(gn.Coated(DYE), marks=pytest.mark.full),
    ],
)
def test_drjit(m):
    """A tensor, whatever the directions are."""
    llvm = pytest.importorskip("drjit.llvm")
    wi, wo = directions(4)
    expected = m.reradiation(wi, wo)
    arrays = [llvm.Array3f64(*(llvm.Float64(np.ascontiguousarray(x)) for x in w.T)) for w in (wi, wo)]
    single = [llvm.Array3f64(*w[0].tolist()) for w in (wi, wo)]
    for a, b in (arrays, (llvm.TensorXf64(wi), llvm.TensorXf64(wo))):
        np.testing.assert_allclose(np.array(m.reradiation(a, b)), expected, rtol=1e-12, atol=1e-16)
    np.testing.assert_allclose(np.array(m.reradiation(*single)), expected[0], rtol=1e-12, atol=1e-16)


def test_emission_in_one_number_counts_for_every_band_around_it():
    """Half of all photons in each of three bands would be more photons than there are."""
    bands, white = [450.0, 550.0, 650.0], gn.Lambertian([0.1, 0.1, 0.1])
    sent = gn.photon_albedo((gn.FluorescentLambertian(emission=0.3) + white).with_channels(bands), UP)
    np.testing.assert_allclose(sent, 0.1 + 0.3 + 0.7 * 0.5 * 0.8 * 0.9, rtol=1e-4)
    dye = gn.FluorescentLambertian(emission=0.5)
    for m in (dye + white, dye + white.with_channels(bands), gn.Coated(dye, eta=[1.5, 1.5, 1.5])):
        for call in (m.reradiation, lambda *_, m=m: gn.photon_albedo(m, UP), lambda *_, m=m: m.under([1.0] * 3)):
            with pytest.raises(ParameterError, match=r"3 bands add up to 1\.5|wavelengths are not known"):
                call(UP, UP)
        with pytest.raises(ParameterError, match=r"shares of all 3 bands add up to 1\.5"):
            m.with_channels(bands).reradiation(UP, UP)
