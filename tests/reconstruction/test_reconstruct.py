"""`gn.reconstruction.reconstruct`, `gn.reconstruction.reflectance_basis`, `gn.planning.plan_table`: whole tables from
few values, with their uncertainty."""

from __future__ import annotations

import json

import numpy as np
import pytest
from libraries import thinned
from places import real

import gonio as gn
from gonio.reconstruction.basis import SYSTEM

NAMES = [e.name for e in gn.materials() if e.kind == "measured fit"]
OUT = NAMES[3::10]
"""Materials that are left out."""


@pytest.fixture(scope="module")
def basis():
    """Of the other nine tenths of the built-in materials."""
    return gn.reconstruction.reflectance_basis(
        [n for n in NAMES if n not in OUT], resolution=(40, 20, 7), departure=0.0
    )


@pytest.fixture(scope="module")
def planned(basis):
    return gn.planning.plan_table(10, basis)


def pairs(n, seed=0, limit=75.0):
    u = np.random.default_rng(seed).random((3, n))
    theta_i, theta_o = (np.arcsin(np.sin(np.radians(limit)) * np.sqrt(x)) for x in u[:2])
    return gn.direction(theta_i, 0.0 * theta_i), gn.direction(theta_o, 2.0 * np.pi * u[2])


def noisy(m, wi, wo, seed=0, noise=0.01):
    f = m.f(wi, wo)
    return wi, wo, f * (1.0 + noise * np.random.default_rng(seed).standard_normal(f.shape)), noise * f


def test_weights_are_those_of_projected_solid_angles():
    """Of both directions alike: the mean of the product of their cosines is (2/3)^2."""
    basis = gn.reconstruction.reflectance_basis(
        [gn.Lambertian(r) for r in (0.1, 0.2, 0.4, 0.8)], resolution=(40, 20, 7)
    )
    wi, wo = SYSTEM.directions(basis.axes)
    assert abs((basis.weights * wi[..., 2] * wo[..., 2]).sum() - 4.0 / 9.0) < 1e-3


def at_nodes(m, found):
    """ln of f over the reconstruction, and where the nodes are above the horizon."""
    wi, wo = found.reflectance.directions()
    up = (wi[..., 2] > 0.02) & (wo[..., 2] > 0.02)
    return np.log(m.f(wi[up], wo[up]) / found.reflectance.stored[up]), up


def errors(basis, wi, wo):
    squares = []
    for k, name in enumerate(OUT):
        m = gn.material(name)
        found = gn.reconstruction.reconstruct(noisy(m, wi, wo, k), basis)
        off, up = at_nodes(m, found)
        squares.append(np.average(off**2, axis=0, weights=basis.weights[up]))
    return np.sqrt(np.mean(squares, axis=1))


def test_planned_directions_are_better_than_others(basis, planned):
    ours = errors(basis, planned.wi, planned.wo)
    assert np.sqrt(np.mean(ours**2)) < 0.03  # measured: 0.012
    wi, wo = gn.planning.Goniometer().pairs()
    for seed in range(2):
        some = np.random.default_rng(seed).choice(len(wi), 10, replace=False)
        assert np.sqrt(np.mean(errors(basis, wi[some], wo[some]) ** 2)) > 2.0 * np.sqrt(np.mean(ours**2))


@pytest.mark.parametrize("n", [5, 10])
def test_uncertainties_are_those_of_materials_left_out(basis, n):
    wi, wo = gn.planning.Goniometer().pairs()
    some = np.random.default_rng(n).choice(len(wi), n, replace=False)
    within, u_of_f = [], []
    for k, name in enumerate(OUT):
        m = gn.material(name)
        found = gn.reconstruction.reconstruct(noisy(m, wi[some], wo[some], k), basis)
        off, up = at_nodes(m, found)
        within.append(np.mean(np.abs(off) < 2.0 * found.log_u[up]))
        table = found.reflectance
        u_of_f.append(np.mean(np.abs(np.exp(off) - 1.0) * table.stored[up] < 2.0 * table.uncertainty[up]))
    assert 0.88 < np.mean(within) <= 1.0  # measured: 0.95 to 0.98
    assert 0.85 < np.mean(u_of_f) <= 1.0


UNLIKE = [
    gn.OrenNayar(0.8, 0.5),
    gn.EON(0.3, 0.3) + gn.Microfacet(gn.GGX(0.35), gn.Schlick(0.04)),
    gn.Microfacet(gn.GGX(0.3), gn.Schlick(0.9)),
    gn.KullaConty(0.5),
    gn.EON(0.2, 0.9),
    gn.EON(0.55, 0.4) + gn.Microfacet(gn.Beckmann(0.22), gn.Schlick(0.08)),
    gn.Lambertian(0.4) + gn.Microfacet(gn.GGX(0.1), gn.Schlick(0.04)),
    gn.Microfacet(gn.GGX(0.15), gn.Schlick(0.7)),
    gn.Coated(gn.Lambertian(0.6)),
]


@pytest.fixture(scope="module")
def departing():
    """A basis that knows of real materials, and plans by it."""
    basis = gn.reconstruction.reflectance_basis([name for name in NAMES if name not in OUT], resolution=(40, 20, 7))
    coarse = gn.planning.Goniometer(step_theta=np.radians(10.0))
    return basis, [gn.planning.plan_table(n, basis, goniometer=coarse, starts=1) for n in (10, 20)]


@pytest.mark.parametrize("m", thinned(UNLIKE, UNLIKE[:4]), ids=repr)
def test_intervals_hold_materials_unlike_the_basis_from_planned_directions(m, departing):
    """Without being wide everywhere: the error to be expected is less than three times that of the basis."""
    basis, plans = departing
    wi, wo = pairs(1000)
    cosine, truth = np.minimum(wi[:, 2], wo[:, 2]), m.f(wi, wo)
    for planned in plans:
        found = gn.reconstruction.reconstruct(noisy(m, planned.wi, planned.wo), basis)
        low, high = (table.f(wi, wo) for table in found.interval(0.95))
        within = (low <= truth) & (truth <= high)
        assert min(within[cosine > least].mean() for least in (0.0, 0.25, 0.5)) > 0.9  # measured: 0.95 to 1
        assert found.error < 3.0 * planned.error


def test_u_widens_by_the_chi_square_of_the_values(departing):
    """Of the coefficients, of what the basis leaves, of draws, and of the next plan, by the same factor."""
    basis, _ = departing
    wi, wo = pairs(10)
    rows = basis.at(wi, wo)
    f = np.exp(rows.mean + rows.factors[:, :5].sum(axis=1)) - basis.offset
    near = gn.reconstruction.reconstruct((wi, wo, f, 0.02 * f), basis)
    ripple = f * np.exp(0.08 * (-1.0) ** np.arange(10))
    far = gn.reconstruction.reconstruct((wi, wo, ripple, 0.02 * ripple), basis)
    assert near.widening == 1.0 and far.widening > 1.2 and far.discrepancy == 0.0
    assert np.isclose(far.widening, far.chi2 / far.used)
    assert np.allclose(far.covariance, far.widening * near.covariance, atol=1e-3)
    assert np.allclose(far.log_u, np.sqrt(far.widening) * near.log_u, rtol=1e-2)
    drawn = np.log(np.array([[t.stored for t in x.draws(30)] for x in (near, far)]) + basis.offset).std(axis=1)
    assert np.isclose(np.median(drawn[1] / drawn[0]), np.sqrt(far.widening), rtol=0.1)
    plans = [gn.planning.plan_table(1, basis, measured=x, candidates=(wi, wo), starts=1) for x in (near, far)]
    assert np.isclose(plans[1].before, far.error) and plans[1].before > plans[0].before


def test_misfit_is_what_others_leave_of_a_material():
    names, squares = NAMES[:40:5], []
    settings = {"components": 2, "resolution": (8, 6, 3), "departure": 0.0}
    for out in names:
        others = gn.reconstruction.reflectance_basis([n for n in names if n != out], **settings)
        wi, wo = gn.Gridded("half_difference", others.axes, others.mean, mirrored=True).directions()
        up = (wi[..., 2] > 0.0101) & (wo[..., 2] > 0.0101)
        off = np.log(gn.material(out).f(wi[up], wo[up]) + others.offset) - others.mean[up][:, None]
        q = others.factors[up]
        squares.append((off - q @ np.linalg.lstsq(q, off, rcond=None)[0]) ** 2)
    every = gn.reconstruction.reflectance_basis(names, **settings)
    assert np.allclose(every.misfit[up], np.concatenate(squares, axis=1).mean(axis=1), rtol=1e-4, atol=1e-9)
    further = gn.reconstruction.reflectance_basis(names, **{**settings, "departure": 0.3})
    assert np.allclose(further.misfit, every.misfit + 0.09)


def test_a_material_of_the_basis_comes_back(basis):
    m = gn.material(next(n for n in NAMES if n not in OUT))
    wi, wo = pairs(3000)
    f = m.f(wi, wo)
    found = gn.reconstruction.reconstruct((wi, wo, f, 1e-4 * f), basis)
    off, up = at_nodes(m, found)
    assert np.sqrt(np.average(off**2, weights=np.broadcast_to(basis.weights[up][:, None], off.shape))) < 0.01
    assert np.all(found.discrepancy < 0.1) and np.all(found.rms < 0.02)


def test_the_posterior_is_that_of_linear_regression(basis):
    wi, wo = pairs(6)
    rows = basis.at(wi, wo)
    f = np.exp(rows.mean + 0.3 * rows.factors[:, 0]) - basis.offset
    u = np.full(6, 0.02) * f
    found = gn.reconstruction.reconstruct((wi, wo, f, u), basis)
    cover = rows.factors @ rows.factors.T + np.diag((u / (f + basis.offset)) ** 2 + rows.misfit)
    off = np.log(f + basis.offset) - rows.mean
    gain = rows.factors.T @ np.linalg.inv(cover)  # the other form of the same: n x n
    assert np.allclose(found.coefficients, gain @ off, atol=1e-9)
    assert np.allclose(found.covariance, np.eye(len(basis)) - gain @ rows.factors, atol=1e-9)
    assert np.isclose(found.chi2, off @ np.linalg.solve(cover, off))
    assert np.allclose(found.stderr, np.sqrt(np.diag(found.covariance)))
    variance = np.einsum("...k,kl,...l->...", basis.factors, found.covariance, basis.factors) + basis.misfit
    assert np.allclose(found.log_u, np.sqrt(variance))
    assert np.isclose(found.error, np.sqrt((basis.weights * variance).sum()))


def test_more_values_never_make_it_less_sure(basis):
    wi, wo = pairs(40)
    m = gn.material(OUT[0])
    f = m.f(wi, wo)
    before = np.full(basis.mean.shape, np.inf)
    for n in (1, 2, 5, 10, 40):
        found = gn.reconstruction.reconstruct((wi[:n], wo[:n], f[:n, 0], 0.1 * f[:n, 0]), basis)
        assert found.discrepancy == 0.0 and np.all(found.log_u <= before + 1e-9)
        before = found.log_u


def test_noise_is_respected(basis):
    wi, wo = pairs(20)
    f = gn.material(OUT[1]).f(wi, wo)[:, 0]
    found = gn.reconstruction.reconstruct((wi, wo, f, 1e4 * np.ones(20)), basis)
    assert np.allclose(found.coefficients, 0.0, atol=1e-3) and np.allclose(found.stderr, 1.0, atol=1e-3)
    assert np.allclose(np.log(found.reflectance.stored + basis.offset), basis.mean, atol=1e-2)


def test_values_at_one_place_hold_what_one_holds(basis):
    wi, wo = pairs(1)
    found = [
        gn.reconstruction.reconstruct((np.repeat(wi, n, 0), np.repeat(wo, n, 0), np.full(n, 0.1), 1e-8), basis)
        for n in (1, 500)
    ]
    assert found[1].used == 1
    assert np.allclose(found[0].log_u, found[1].log_u, rtol=1e-6)


def test_each_channel_is_reconstructed_on_its_own(basis, planned):
    f = gn.material(OUT[2]).f(planned.wi, planned.wo)
    together = gn.reconstruction.reconstruct((planned.wi, planned.wo, f), basis)
    for c in range(3):
        alone = gn.reconstruction.reconstruct((planned.wi, planned.wo, f[:, c]), basis)
        assert np.allclose(alone.coefficients, together.coefficients[c])
        assert np.allclose(alone.reflectance.stored, together.reflectance.stored[..., c])
    hole = f.copy()
    hole[4, 1] = np.nan
    assert gn.reconstruction.reconstruct((planned.wi, planned.wo, hole), basis).used.tolist() == [10, 9, 10]


def test_tables_are_reflectances(basis, planned, tmp_path, one_probe):
    m = gn.material("blue-fabric")
    found = gn.reconstruction.reconstruct(noisy(m, planned.wi, planned.wo), basis)
    table = found.reflectance
    assert np.all(table.stored >= 0.0) and np.all(table.uncertainty >= 0.0) and np.isfinite(table.stored).all()
    assert np.allclose(gn.albedo(table, [0, 0, 1]), gn.albedo(m, [0, 0, 1]), rtol=0.05)
    assert np.all(gn.albedo(table, gn.direction(np.radians([0.0, 45.0, 75.0]), 0.0)) < 1.0)
    a, b = pairs(200, 5)
    assert np.allclose(table.f(a, b), table.f(b, a), rtol=1e-9)
    gn.save(table, tmp_path / "table.nc")
    assert np.allclose(gn.load(tmp_path / "table.nc").f(a, b), table.f(a, b))
    assert gn.render(table, size=16).pixels.shape[-1] == 3


def test_intervals_and_draws_have_the_spread_of_the_posterior(basis):
    wi, wo = pairs(4)
    found = gn.reconstruction.reconstruct((wi, wo, [0.2, 0.1, 0.15, 0.1]), basis)
    low, high = found.interval(0.6826895)
    offset = basis.offset
    assert np.allclose(np.log((high.stored + offset) / (low.stored + offset)), 2.0 * found.log_u, atol=0.02)
    assert np.allclose(0.5 * (high.stored - low.stored), found.reflectance.uncertainty, atol=1e-3, rtol=0.05)
    drawn = np.log(np.array([t.stored for t in found.draws(200)]) + offset)
    ratio = drawn.std(axis=0)[found.log_u > 0.1] / found.log_u[found.log_u > 0.1]
    assert 0.85 < np.median(ratio) < 1.15
    assert np.array_equal(next(found.draws(1)).stored, next(found.draws(1)).stored)


def test_materials_unlike_the_basis_are_told(basis):
    wi, wo = pairs(60)
    odd = 0.1 + 0.09 * np.sin(12.0 * np.arccos(wi[:, 2]))
    found = gn.reconstruction.reconstruct((wi, wo, odd, 0.01 * odd), basis)
    assert found.discrepancy > 0.1 and found.chi2 > 5.0 * found.used
    assert any("far from the materials" in note for note in found.notes)
    assert found.error > gn.reconstruction.reconstruct(noisy(gn.material(OUT[0]), wi, wo), basis).error.max()


def test_one_wild_value_does_not_rule(basis):
    m = gn.material(OUT[4])
    wi, wo, f, _ = noisy(m, *pairs(60))
    f[7] *= 5.0
    off, up = at_nodes(m, gn.reconstruction.reconstruct((wi, wo, f, 0.01 * f), basis))
    assert np.sqrt(np.average(off**2, weights=np.broadcast_to(basis.weights[up][:, None], off.shape))) < 0.08


def test_suspicious_units_are_told(basis, planned):
    white = np.full(10, 0.9)  # pi f of a white surface
    notes = gn.reconstruction.reconstruct((planned.wi, planned.wo, white, 0.01), basis).notes
    assert any("pi f" in note for note in notes)
    f = 0.9 / np.pi * np.ones(10)
    assert not any(
        "pi f" in note for note in gn.reconstruction.reconstruct((planned.wi, planned.wo, f, 0.01), basis).notes
    )


def test_what_does_not_fit_is_refused(basis):
    wi, wo = pairs(5)
    with pytest.raises(gn.Error, match="anisotropic"):
        gn.reconstruction.reconstruct(gn.Microfacet(gn.GGX(0.1, 0.3)), basis)
    with pytest.raises(gn.Error, match="nothing to fit"):
        gn.reconstruction.reconstruct((wi, wo, np.full(5, np.nan)), basis)
    with pytest.raises(gn.Error, match="floor"):
        gn.reconstruction.reconstruct((wi, wo, np.zeros(5)), basis)
    assert np.isfinite(gn.reconstruction.reconstruct((wi, wo, np.zeros(5)), basis, floor=0.01).error)
    with pytest.raises(gn.Error, match="shape"):
        gn.reconstruction.reconstruct((wi, wo, np.ones(4)), basis)
    with pytest.raises(gn.Error, match="in percent"):
        gn.reconstruction.reconstruct((wi, wo, np.ones(5)), basis, noise=5.0)
    with pytest.raises(gn.Error, match="length"):
        gn.reconstruction.reconstruct((wi * 40.0, wo, np.ones(5)), basis)
    for materials, told in (
        (["brass"], "4 at least"),
        ("brass", "a list"),
        ([gn.Lambertian(0.5)] * 5, "same f"),
        ([gn.Microfacet(gn.GGX(0.1, 0.3))] * 5, "anisotropic"),
        ([3, 4, 5, 6], "a reflectance"),
        ([gn.IdealSpecular(0.5)] * 4, "mirror"),
    ):
        with pytest.raises(gn.Error, match=told):
            gn.reconstruction.reflectance_basis(materials)


def test_plans_promise_what_reconstructions_show(basis, planned):
    m = gn.material(OUT[0])
    f = m.f(planned.wi, planned.wo)
    found = gn.reconstruction.reconstruct((planned.wi, planned.wo, f, 0.01 * f), basis)
    assert np.allclose(found.error, planned.error, rtol=0.05)
    known = gn.reconstruction.reconstruct((planned.wi, planned.wo, f[:, 0], 0.01 * f[:, 0]), basis)
    more = gn.planning.plan_table(5, basis, measured=known, starts=1)
    assert np.isclose(more.before, known.error, rtol=1e-6) and more.error < known.error
    same = gn.planning.plan_table(5, basis, measured=(planned.wi, planned.wo, f[:, 0], 0.01 * f[:, 0]), starts=1)
    assert np.allclose(same.wi, more.wi) and np.isclose(same.before, more.before)
    arm = gn.planning.Goniometer(theta_o=(0.0, np.radians(40.0)), in_plane=True)
    limited = gn.planning.plan_table(6, basis, goniometer=arm)
    assert gn.angles(limited.wo)[0].max() < np.radians(40.1) and np.abs(limited.wo[:, 1]).max() < 1e-9
    assert limited.error > gn.planning.plan_table(6, basis, starts=1).error
    other = gn.reconstruction.reflectance_basis(NAMES[:6], resolution=(6, 5, 3))
    with pytest.raises(gn.Error, match="another basis"):
        gn.planning.plan_table(3, other, measured=known)
    with pytest.raises(gn.Error, match="at most"):
        gn.planning.plan_table(30, basis, candidates=pairs(20))


def test_no_other_choice_of_few_is_better(basis):
    wi, wo = pairs(12, 3)
    best = np.inf
    for a in range(12):
        for b in range(a):
            at = [a, b]
            rows = basis.at(wi[at], wo[at])
            f = np.exp(rows.mean)
            cover = rows.factors @ rows.factors.T + np.diag((0.01 * (f - basis.offset) / f) ** 2 + rows.misfit)
            left = np.eye(len(basis)) - rows.factors.T @ np.linalg.solve(cover, rows.factors)
            variance = np.einsum("...k,kl,...l->...", basis.factors, left, basis.factors) + basis.misfit
            best = min(best, float((basis.weights * variance).sum()))
    assert np.isclose(gn.planning.plan_table(2, basis, candidates=(wi, wo)).error, np.sqrt(best), rtol=1e-6)


def test_plans_are_filled_and_reconstructed(basis, planned, tmp_path):
    planned.save(tmp_path / "plan.csv")
    f = gn.material(OUT[0]).f(planned.wi, planned.wo)[:, 0]
    lines = (tmp_path / "plan.csv").read_text().splitlines()
    rows = [k for k, line in enumerate(lines) if line.endswith(",")]
    for row, value in zip(rows, f, strict=True):
        lines[row] += f"{value:.12g}"
    (tmp_path / "plan.csv").write_text("\n".join(lines))
    found = gn.reconstruction.reconstruct(tmp_path / "plan.csv", basis)
    expected = gn.reconstruction.reconstruct((planned.wi, planned.wo, f), basis)
    assert np.allclose(np.ravel(found.coefficients), expected.coefficients, atol=1e-6)
    planned.save(tmp_path / "plan.json")
    assert len(json.loads((tmp_path / "plan.json").read_text())["directions"]) == 10
    assert json.dumps(found.to_json()) and str(found).startswith("<half_difference table")
    with pytest.raises(gn.Error, match="csv"):
        planned.save(tmp_path / "plan.txt")


@pytest.mark.parametrize("count", thinned([5, 8], [5]))
def test_a_basis_of_tables_is_that_of_their_materials(basis, count):
    names = NAMES[:count]
    tables = [gn.tables.tabulate(gn.material(n), resolution=(60, 31, 24)) for n in names]
    of_tables, of_models = (gn.reconstruction.reflectance_basis(x, 5, resolution=(20, 12, 5)) for x in (tables, names))
    off = np.abs(of_tables.mean - of_models.mean)
    assert np.average(off, weights=of_models.weights) < 0.01
    assert np.isclose(of_tables.variances.sum(), of_models.variances.sum(), atol=1e-3)


@pytest.fixture(scope="module")
def planned_by_all():
    """By the basis of all built-in materials."""
    return gn.planning.plan_table(
        20, goniometer=gn.planning.Goniometer(theta_i=(0.0, 1.1), theta_o=(0.0, 1.1)), starts=1
    )


@pytest.mark.parametrize(
    "name",
    thinned(["nist_ptfe/PTFE.data.532.csv", "rgl/paper_white_rgb.bsdf"], ["nist_ptfe/PTFE.data.532.csv"]),
)
def test_real_materials_from_twenty_values(name, planned_by_all):
    m = gn.load(real(name))
    wi, wo = pairs(2000)
    truth = np.reshape(m.f(wi, wo), (2000, -1))
    planned = planned_by_all
    found = gn.reconstruction.reconstruct((planned.wi, planned.wo, m.f(planned.wi, planned.wo)))
    off = np.log(np.reshape(found.reflectance.f(wi, wo), truth.shape) / truth)
    assert np.sqrt(np.nanmean(off**2)) < 0.12
