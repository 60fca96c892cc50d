"""The component of uncertainty by interpolation: beside the truth, its words, and what there is to rehearse."""

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from house import PLASTIC
from synthetic import measured, results, surface, synthetic

import gonio as gn
from gonio.cli import arguments
from gonio.cli.commands import cli
from gonio.errors import MissingDataWarning
from gonio.laws._significance import both_ways
from gonio.tables.angle_systems import SYSTEMS
from gonio.tables.half_planes import half_planes, in_words
from gonio.uncertainty.row_rehearsal import groups

GLOSSY = PLASTIC.replace(rho=0.2, alpha=0.2)
WI = gn.direction(np.radians(32.0), 0.0)


def scan(of, step=5.0, phi=(0.0, np.pi), last=85.0, noise=0.0, seed=1, mirrored=True, **more):
    theta = np.radians(np.arange(0.0, last + 1e-6, step))
    axes = {"theta_i": theta, "theta_o": theta, "phi": np.asarray(phi, dtype=float)}
    f = of.f(gn.direction(theta, 0.0)[:, None, None], gn.direction(theta[:, None], axes["phi"]))
    u = None if noise == 0.0 else noise * f
    if noise:
        f = f * (1.0 + noise * np.random.default_rng(seed).standard_normal(f.shape))
    return gn.Gridded("angles", axes, f, uncertainty=u, mirrored=mirrored, **more)


def rows(of, n=200, seed=2, phi=None, noise=0.01):
    rng = np.random.default_rng(seed)
    theta_i, theta_o = 1.3 * np.sqrt(rng.random(n)), 1.3 * np.sqrt(rng.random(n))
    phi = 2.0 * np.pi * rng.random(n) if phi is None else np.asarray(phi)[rng.integers(len(phi), size=n)]
    f = of.f(gn.direction(theta_i, 0.0), gn.direction(theta_o, phi))
    return gn.Scattered(theta_i, 0.0 * theta_i, theta_o, phi, f, uncertainty=noise * f if noise else None)


def judged(made):
    """(|error| / u, |error|/|truth|, u_interpolation/|error|) of all results."""
    found = []
    for r in made:
        off = np.maximum(np.abs(r.error) - (0.0 if r.name == "f" else 1e-5), 1e-30)
        found += list(
            zip(off / np.maximum(r.u, 1e-12), off / np.maximum(r.size, 1e-12), r.interpolation / off, strict=True)
        )
    return np.array(found)


# Beside the truth.


@pytest.mark.parametrize("count", [3, pytest.param(15, marks=pytest.mark.full)])
def test_measurements_on_two_grids(count):
    """The same as benchmarks/uncertainty_campaign.py."""
    found = []
    for number in range(count):
        of, noise = surface(np.random.default_rng(number)), (0.0, 0.01, 0.05)[number % 3]
        for kind, step, planes in (("grid", 15.0, 24), ("mirrored grid", 10.0, 2)):
            made = measured(np.random.default_rng(number), of, kind, step, planes, noise, 75.0)
            found += results(number, made, sky=False, angles=1)
    z, error, wide = judged(found).T
    assert len(z) == count * 2 * 9
    assert (z <= 3.0).mean() >= 0.97
    assert np.median(wide[error > 1e-3]) < 10.0
    alone = np.concatenate([np.abs(r.error) <= 3.0 * r.noise for r in found])
    assert alone.mean() < 0.7  # which is why


# Measurements with holes, of which the error is judged.
@pytest.mark.full
@pytest.mark.filterwarnings("ignore::gonio.errors.MissingDataWarning", "ignore::gonio.errors.ToleranceWarning")
def test_measurements_of_all_kinds():
    z, error, wide = judged([r for n in range(60) for r in results(n, synthetic(n), sky=n % 3 == 0)]).T
    assert (z <= 3.0).mean() >= 0.97
    assert np.median(wide[error > 1e-3]) < 10.0


def test_a_scan_in_the_plane_of_incidence_knows_little_of_the_albedo():
    truth = gn.albedo(GLOSSY, WI)
    q = gn.with_uncertainty(gn.albedo, scan(GLOSSY, noise=0.002), WI, correlation="independent")
    assert abs(q.value - truth) > 100.0 * q.u_noise
    assert 0.5 < abs(q.value - truth) / q.u < 3.0
    assert q.u == pytest.approx(math.hypot(q.u_noise, q.u_interpolation))
    full = scan(GLOSSY, phi=np.radians(np.arange(0.0, 181.0, 7.5)), noise=0.002)
    assert gn.with_uncertainty(gn.albedo, full, WI, correlation="independent").u < 0.1 * q.u


def test_finer_grids_are_less_uncertain():
    phi = np.radians(np.arange(0.0, 181.0, 15.0))
    of = gn.Minnaert(0.5, 1.3)
    u = [gn.with_uncertainty(gn.albedo, scan(of, step, phi, 80.0), gn.direction(0.0, 0.0)).u for step in (20.0, 10.0)]
    assert u[0] / u[1] == pytest.approx(4.0, rel=0.6)  # second order in the spacing


def test_f_at_nodes_is_not_interpolated():
    m = scan(GLOSSY)
    q = gn.with_uncertainty(
        m.f, gn.direction(m.axes["theta_i"][6], 0.0), gn.direction(m.axes["theta_o"][[4, 7]], np.pi)
    )
    assert (q.u == 0.0).all()
    q = gn.with_uncertainty(m.f, WI, gn.direction(m.axes["theta_o"][6], np.pi))
    assert q.u > 0.0


def test_what_is_linear_along_the_axes_is_certain():
    theta, phi = np.radians(np.arange(0.0, 91.0, 15.0)), np.radians(np.arange(0.0, 360.0, 30.0))
    f = 0.1 + 0.05 * theta[:, None, None] + 0.02 * theta[:, None] + 0.0 * phi
    m = gn.Gridded("angles", {"theta_i": theta, "theta_o": theta, "phi": phi}, f)
    q = gn.with_uncertainty(gn.albedo, m, WI)
    assert q.u < 1e-12
    assert repr(q).endswith("(noise 0, interpolation 0)")


@pytest.mark.parametrize("count", [4, pytest.param(12, marks=pytest.mark.full)])
def test_noise_is_not_counted_twice(count):
    """Of a table that is noise alone the rehearsal finds next to nothing, though its nodes differ from neighbours."""
    phi = np.radians(np.arange(0.0, 181.0, 15.0))
    wi = gn.direction(np.radians([12.0, 32.0, 57.0]), 0.0)
    noisy = [scan(gn.Lambertian(0.5), 10.0, phi, 80.0, 0.05, seed) for seed in range(count)]
    found = [gn.with_uncertainty(gn.albedo, m, wi, correlation="independent") for m in noisy]
    bare = [gn.with_uncertainty(gn.albedo, m.with_brdf(m.brdf()), wi) for m in noisy]
    share, alone = (
        np.sqrt(np.mean([q.u_interpolation**2 for q in some], axis=0)) / found[0].u_noise for some in (found, bare)
    )
    assert (share < alone).all()
    assert np.sqrt(np.mean(share**2)) < 0.9
    off = [abs(q.value - 0.5) / q.u for q in found]
    assert np.mean(np.array(off) <= 2.0) > 0.9


def test_beyond_the_outermost_nodes():
    of = gn.Minnaert(0.3, 0.5)  # rises towards grazing
    phi = np.radians(np.arange(0.0, 181.0, 30.0))
    u = {last: gn.with_uncertainty(gn.albedo, scan(of, 5.0, phi, last), WI) for last in (60.0, 85.0)}
    assert u[60.0].u > 10.0 * u[85.0].u
    assert abs(u[60.0].value - gn.albedo(of, WI)) < 3.0 * u[60.0].u
    beyond = gn.direction(np.radians(75.0), 0.0)
    q = gn.with_uncertainty(gn.Reflectance.f, scan(of, 5.0, phi, 60.0), WI, beyond)
    assert 0.0 < abs(q.value - of.f(WI, beyond)) < 3.0 * q.u


def test_directions_without_data_count_by_those_beside_them():
    phi = np.radians(np.arange(0.0, 181.0, 30.0))
    m = scan(gn.Lambertian(0.5), 5.0, phi, 60.0, outside="missing")
    with pytest.warns(MissingDataWarning):
        q = gn.with_uncertainty(gn.albedo, m, WI)
    assert q.value + q.u_interpolation == pytest.approx(0.5, abs=1e-3)


def test_one_angle_of_incidence_says_little_of_others():
    m = scan(GLOSSY, phi=np.radians(np.arange(0.0, 181.0, 15.0)))
    one = gn.Gridded("angles", {**m.axes, "theta_i": m.axes["theta_i"][[6]]}, m.brdf()[[6]], mirrored=True)
    w = gn.direction(np.array([m.axes["theta_i"][6], 0.0, 1.2]), 0.0)
    q = gn.with_uncertainty(gn.albedo, one, w)
    assert (q.u[1:] > 5.0 * q.u[0]).all()
    assert (np.abs(q.value - gn.albedo(GLOSSY, w)) < 3.0 * q.u).all()


def test_a_nearest_neighbour_is_off_by_half_a_step():
    m = scan(gn.Minnaert(0.5, 1.5), 10.0, np.radians(np.arange(0.0, 181.0, 30.0)), interpolation="nearest")
    wo = gn.direction(np.radians([34.0, 46.0]), 0.0)
    q = gn.with_uncertainty(m.f, WI, wo)
    error = np.abs(q.value - gn.Minnaert(0.5, 1.5).f(WI, wo))
    assert (error < 3.0 * q.u).all()
    assert (q.u < 10.0 * error.max()).all()


@pytest.mark.parametrize("phi", [None, (0.0, np.pi), (0.0,)])
def test_rows_in_no_grid(phi):
    m = rows(gn.Lambertian(0.2) + gn.Ward(0.2, 0.4), phi=phi, noise=0.0)
    q = gn.with_uncertainty(gn.albedo, m, WI)
    error = abs(q.value - gn.albedo(gn.Lambertian(0.2) + gn.Ward(0.2, 0.4), WI))
    assert error < 3.0 * q.u
    assert q.u < (0.1 if phi is None else 0.5) * q.value


@pytest.mark.parametrize(("count", "names"), [(3, []), (4, ["rows"])])
def test_of_three_rows_in_no_grid_none_is_left_out(count, names):
    assert [group.name for group in groups(rows(GLOSSY, count))] == names


def test_rows_are_left_out_by_what_they_lie_in():
    names = [group.name for group in groups(rows(gn.Lambertian(0.5)))]
    assert names == ["rows"]
    both = list(groups(rows(gn.Lambertian(0.5), phi=(0.0, np.pi))))
    assert [group.name for group in both] == ["phi", "rows"]
    assert all(0.3 < group.left.mean() < 0.7 for group in both)
    m = scan(gn.Lambertian(0.5), 15.0, (0.0, 1.0, np.pi), 75.0)
    i, o, phi = np.meshgrid(*m.axes.values(), indexing="ij")
    jittered = gn.Scattered(i.ravel(), 0.0 * i.ravel(), o.ravel() + 1e-4, phi.ravel(), m.brdf().ravel())
    assert [group.name for group in groups(jittered)] == ["theta_i", "theta_o", "phi"]


@pytest.mark.parametrize("name", ["half_difference", "specular", "relative"])
def test_every_system_of_angles_is_rehearsed(name):
    of, system = gn.Minnaert(0.5, 1.4), SYSTEMS[name]
    axes = system.nodes((12, 12, 12))
    wi, wo = system.directions(axes)
    up = (wi[..., 2] > 0.0) & (wo[..., 2] > 0.0)
    m = gn.Gridded(name, axes, np.where(up, of.f(wi, wo), np.nan))
    wo = gn.direction(np.radians([12.0, 21.0, 44.0]), 2.0)
    q = gn.with_uncertainty(m.f, WI, wo)
    error = np.abs(q.value - of.f(WI, wo))
    assert (error <= 3.0 * q.u + 1e-12).all()
    assert (q.u < 0.1 * q.value).all()


# Monte Carlo.


def test_monte_carlo_has_the_same_component():
    m = scan(GLOSSY, 10.0, noise=0.01)
    first = gn.with_uncertainty(gn.albedo, m, WI, correlation="independent", tolerance=1e-3)
    drawn = gn.with_uncertainty(
        gn.albedo, m, WI, correlation="independent", method="Monte Carlo", draws=50, tolerance=1e-3
    )
    assert drawn.u_interpolation == pytest.approx(first.u_interpolation)
    assert np.std(drawn.draws) == pytest.approx(drawn.u, rel=0.5)
    ratio = gn.with_uncertainty(
        lambda t: 1.0 / gn.albedo(t, WI, tolerance=1e-3), m, correlation="independent", method="Monte Carlo", draws=2
    )
    assert ratio.u_interpolation * first.value**2 == pytest.approx(first.u_interpolation, rel=0.8)


# Words.


def test_results_are_correlated_by_interpolation_too():
    q = gn.with_uncertainty(gn.albedo, scan(GLOSSY), gn.direction(np.radians([31.0, 32.0]), 0.0))
    a, b = q.ufloat()
    assert (a - b).std_dev < 0.3 * a.std_dev


def test_words():
    alone = gn.with_uncertainty(gn.albedo, scan(GLOSSY), WI)
    assert alone.u_noise == 0.0
    assert "by interpolation alone: the measurement states no uncertainties" in alone.assumed
    assert "the values lie in 2 half-planes (azimuth 0°, 180°): the albedo rests on interpolation" in alone.assumed
    stated = gn.with_uncertainty(gn.albedo, scan(GLOSSY, noise=0.01), WI, correlation="common")
    assert repr(stated) == f"{stated.value:.2f} ± {stated.u:.2f} (noise 0.0031, interpolation {stated.u:.1f})"
    scaled = gn.with_uncertainty(gn.albedo, scan(GLOSSY), WI, scale=0.01)
    assert scaled.u_noise == pytest.approx(0.01 * scaled.value)
    assert "no uncertainties of values are stated, and of scale (0.01)" in scaled.assumed


def test_half_planes():
    assert np.degrees(half_planes(scan(GLOSSY))) == pytest.approx([0.0, 180.0])
    assert len(half_planes(scan(GLOSSY, phi=np.radians(np.arange(0.0, 181.0, 45.0))))) == 0
    assert len(half_planes(scan(GLOSSY, phi=np.radians([0.0, 90.0, 180.0])))) == 3
    across = scan(GLOSSY, phi=np.radians([0.0, 90.0, 180.0, 270.0]), mirrored=False)
    assert np.degrees(half_planes(across)) == pytest.approx([0.0, 90.0, 180.0, 270.0])
    assert np.degrees(half_planes(rows(GLOSSY, phi=(0.0, np.pi)))) == pytest.approx([0.0, 180.0])
    assert len(half_planes(rows(GLOSSY))) == 0
    assert in_words(half_planes(rows(GLOSSY))) == ""
    assert "1 half-plane (azimuth 0°)" in in_words(half_planes(rows(GLOSSY, phi=(0.0,))))


@pytest.fixture
def run(monkeypatch):
    def call(m, *words):
        monkeypatch.setattr(arguments, "resolve", lambda *_: m)
        return CliRunner().invoke(cli, list(words), catch_exceptions=False).output

    return call


def test_on_the_command_line(run):
    text = run(scan(GLOSSY, noise=0.01), "albedo", "x", "--theta-i", "32", "--uncertainty", "common")
    assert "(noise 0.0031, interpolation 0.1)" in text
    assert "the values lie in 2 half-planes" in text
    text = run(scan(GLOSSY), "albedo", "x", "--theta-i", "32")
    assert "albedo ± U (k = 1), by interpolation alone" in text
    row = json.loads(run(scan(GLOSSY), "albedo", "x", "--theta-i", "32", "--json"))[0]
    assert row["u"] == row["u_interpolation"]
    assert row["u_noise"] == {"interpolation": 0.0}
    text = run(scan(GLOSSY), "info", "x")
    assert "by interpolation" in text
    assert "the values lie in 2 half-planes" in " ".join(text.split())


# Reciprocity is judged on pairs that were measured both ways.


def test_reciprocity_of_a_reciprocal_surface():
    """An exactly reciprocal surface on a coarse grid: interpolation breaks the law, and no measurement does."""
    theta = np.radians([0.0, 20.0, 40.0, 60.0])
    axes = {"theta_i": theta, "theta_o": np.radians(np.arange(0.0, 81.0, 10.0)), "phi": np.radians([0.0, 90.0, 180.0])}
    f = GLOSSY.f(gn.direction(theta, 0.0)[:, None, None], gn.direction(axes["theta_o"][:, None], axes["phi"]))
    m = gn.Gridded("angles", axes, f, uncertainty=0.01 * f, mirrored=True)
    law = gn.check(m, laws=["reciprocity"])["reciprocity"]
    assert law.value > law.tolerance and law.verdict == "not significant"
    assert law.significance.startswith("of 18 pairs that were measured both ways")
    wrong = m.with_brdf(f * (1.0 + 0.3 * theta[:, None, None]), 0.01 * f)
    assert gn.check(wrong, laws=["reciprocity"])["reciprocity"].verdict == "FAIL"


def test_no_pair_was_measured_both_ways():
    theta = np.radians([15.0, 45.0])
    axes = {"theta_i": theta, "theta_o": np.radians([0.0, 30.0, 60.0]), "phi": np.radians([0.0, 90.0, 180.0])}
    f = GLOSSY.f(gn.direction(theta, 0.0)[:, None, None], gn.direction(axes["theta_o"][:, None], axes["phi"]))
    m = gn.Gridded("angles", axes, f, uncertainty=0.01 * f, mirrored=True)
    assert len(both_ways(m).f) == 0
    words = "no pair was measured both ways, the difference is one of interpolation: not significant"
    assert gn.check(m, laws=["reciprocity"])["reciprocity"].significance == words


def test_rows_measured_both_ways():
    rng = np.random.default_rng(4)
    i, o, phi = 1.2 * rng.random(30), 1.2 * rng.random(30), 2.0 * np.pi * rng.random(30)
    back = slice(0, 10)
    angles = [np.concatenate(x) for x in ((i, o[back]), (0.0 * i, 0.0 * i[back]), (o, i[back]), (phi, -phi[back]))]
    f = GLOSSY.f(gn.direction(*angles[:2]), gn.direction(*angles[2:]))
    found = both_ways(gn.Scattered(*angles, f, uncertainty=0.01 * f))
    assert found.f.shape == (10, 1)
    assert found.f == pytest.approx(found.back, rel=1e-9)
    assert found.u == pytest.approx(0.01 * found.f) and found.u_back == pytest.approx(0.01 * found.back)
