"""`gn.planning.plan`: the best directions are found, and their errors are those that fits show."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

import gonio as gn
from gonio.errors import ParameterError
from gonio.reconstruction.planning.directions import order_of
from gonio.reconstruction.planning.misfit import smooth_errors

PAINT = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.04))
SMALL = gn.planning.Goniometer(step_theta=np.radians(15.0), step_phi=np.radians(45.0))


def covariance(m, wi, wo, noise):
    f, by = m.jacobian(wi, wo)
    rows = np.stack(list(by.values()), axis=-1) / (noise * f)[:, None]
    return np.linalg.inv(rows.T @ rows)


def test_errors_are_those_of_the_jacobian():
    planned = gn.planning.plan(PAINT, 9, goniometer=SMALL, noise=0.02)
    expected = covariance(PAINT, planned.wi, planned.wo, 0.02)
    assert np.allclose(planned.covariance, expected, rtol=1e-8)
    assert np.isclose(planned.value, np.linalg.slogdet(expected)[1])
    assert np.allclose(list(planned.stderr.values()), np.sqrt(np.diag(expected)))


@pytest.mark.parametrize("criterion", ["D", "A"])
def test_errors_with_a_misfit_are_those_of_least_squares_that_do_not_know_it(criterion):
    """P (noise^2 + misfit^2 e e^T) P^T, P = (J^T J)^-1 J^T, e the functions of which the model's own error is made."""
    planned = gn.planning.plan(PAINT, 9, criterion, goniometer=SMALL, noise=0.02, misfit=0.1)
    f, by = PAINT.jacobian(planned.wi, planned.wo)
    rows, e = np.stack(list(by.values()), axis=-1) / f[:, None], smooth_errors(planned.wi, planned.wo)
    P = np.linalg.pinv(rows)
    expected = P @ (0.02**2 * np.eye(9) + 0.1**2 * e @ e.T) @ P.T
    assert np.allclose(planned.covariance, expected, rtol=1e-6)
    values = np.linalg.slogdet(expected)[1], (np.diag(expected) / np.array([0.3, 0.2, 0.04]) ** 2).sum()
    assert np.isclose(planned.value, values[criterion == "A"])


def test_plans_for_models_with_errors_are_better_where_models_err():
    wi, wo = gn.planning.Goniometer(theta_i=(0.0, 1.5), theta_o=(0.0, 1.5)).pairs()
    assert np.sqrt((smooth_errors(wi, wo) ** 2).mean(axis=0).sum()) == pytest.approx(1.0, abs=0.15)
    shown, arm = {}, gn.planning.Goniometer(step_theta=np.radians(7.5), step_phi=np.radians(30.0))
    for misfit in (0.0, 0.05):
        planned, off = gn.planning.plan(PAINT, 12, goniometer=arm, noise=0.002, misfit=misfit), []
        e = smooth_errors(planned.wi, planned.wo)
        for seed in range(12):
            f = PAINT.f(planned.wi, planned.wo) * (
                1.0 + 0.05 * e @ np.random.default_rng(seed).standard_normal(e.shape[1])
            )
            values = gn.fit((planned.wi, planned.wo, f), PAINT, "ratio", starts=1).values
            off.append(np.log(values / np.array([0.3, 0.2, 0.04])))
        shown[misfit] = np.sqrt(np.mean(np.square(off), axis=0))
    assert (shown[0.05] < shown[0.0]).all() and shown[0.05][1] < 0.5 * shown[0.0][1], shown


def test_no_number_of_regular_directions_averages_a_misfit_out():
    planned = gn.planning.plan(PAINT, 9, goniometer=SMALL, misfit=0.2)
    assert planned.regular == np.inf and "however many directions" in str(planned) and "off by 20 %" in str(planned)
    assert planned.to_json()["regular"] is None and planned.to_json()["misfit"] == 0.2
    with pytest.raises(ParameterError, match=r"3 % is 0\.03"):
        gn.planning.plan(PAINT, 9, goniometer=SMALL, misfit=3.0)


@pytest.mark.parametrize("criterion", ["D", "A"])
def test_no_other_choice_is_better(criterion):
    few = gn.planning.Goniometer(
        theta_i=(0.3, 1.2), theta_o=(0.0, 1.3), step_theta=np.radians(25.0), in_plane=True, least_angle=0.0
    )
    wi, wo = few.pairs()
    assert len(wi) <= 16
    best = np.inf
    for chosen in itertools.combinations(range(len(wi)), 4):
        rows = list(chosen)
        with np.errstate(all="ignore"):
            try:
                c = covariance(PAINT, wi[rows], wo[rows], 0.01)
            except np.linalg.LinAlgError:
                continue
        sign, logarithm = np.linalg.slogdet(c)
        value = logarithm if criterion == "D" else (np.diag(c) / np.array([0.3, 0.2, 0.04]) ** 2).sum()
        if sign > 0 and np.all(np.diag(c) > 0):
            best = min(best, value)
    assert np.isclose(gn.planning.plan(PAINT, 4, criterion, goniometer=few).value, best, rtol=1e-6)


@pytest.mark.parametrize(("trials", "near"), [(120, 0.15), pytest.param(400, 0.12, marks=pytest.mark.full)])
def test_fits_show_the_errors_that_were_promised(trials, near):
    """To 10 %, and what the spread of so many trials is uncertain by: 6.5 % of 120, 3.5 % of 400."""
    planned = gn.planning.plan(PAINT, 20, goniometer=SMALL)
    f, fitted = PAINT.f(planned.wi, planned.wo), []
    for seed in range(trials):
        noisy = f * (1.0 + 0.01 * np.random.default_rng(seed).standard_normal(len(f)))
        fitted.append(gn.fit((planned.wi, planned.wo, noisy, 0.01 * f), PAINT, starts=1).values)
    shown, promised = np.std(fitted, axis=0, ddof=1), np.array(list(planned.stderr.values()))
    assert np.allclose(shown, promised, rtol=near)


def test_arms_move_little_between_directions():
    """By the light first, then by the azimuth between, the view last."""
    angles = np.array(list(itertools.product([0.2, 0.5], [0.1, 1.0], [0.3, 2.0], [0.4, 0.9])))  # the order itself
    theta_i, phi_i, phi, theta_o = angles[np.random.default_rng(1).permutation(len(angles))].T
    order = order_of(gn.direction(theta_i, phi_i), gn.direction(theta_o, phi_i + phi))
    found = np.stack([theta_i, phi_i, phi, theta_o], axis=-1)[order]
    np.testing.assert_array_equal(found, angles)


def test_as_many_of_a_regular_grid_tell_less():
    planned = gn.planning.plan(PAINT, 12)
    assert planned.efficiency > 1.0
    wi, wo = gn.planning.Goniometer(step_theta=np.radians(15.0), step_phi=np.radians(60.0)).pairs()
    regular = covariance(PAINT, wi, wo, 0.01) * len(wi) / 12
    assert (
        planned.value < np.linalg.slogdet(regular)[1]
    )  # of all numbers together; an albedo alone, any direction tells


def test_what_was_measured_counts():
    first = gn.planning.plan(PAINT, 6, goniometer=SMALL)
    f = PAINT.f(first.wi, first.wo)
    found = gn.fit((first.wi, first.wo, f, 0.01 * f), PAINT, starts=1)
    for measured in (found, (first.wi, first.wo, f, 0.01 * f)):
        more = gn.planning.plan(PAINT, 3, goniometer=SMALL, measured=measured)
        both = covariance(PAINT, np.concatenate([first.wi, more.wi]), np.concatenate([first.wo, more.wo]), 0.01)
        assert np.allclose(more.covariance, both, rtol=1e-3)
        assert np.allclose(list(more.before.values()), list(first.stderr.values()), rtol=1e-3)


def test_limits_hold():
    arm = gn.planning.Goniometer((0.2, 0.8), (0.1, 1.0), (0.0, 2.0), least_angle=np.radians(20.0))
    wi, wo = arm.pairs()
    theta_i, theta_o = gn.angles(wi)[0], gn.angles(wo)[0]
    assert theta_i.min() >= 0.2 - 1e-9 and theta_i.max() <= 0.8 and theta_o.min() >= 0.1 - 1e-9 and theta_o.max() <= 1.0
    assert np.arccos((wi * wo).sum(-1)).min() >= np.radians(20.0) - 1e-9
    flat = gn.planning.plan(PAINT, 6, goniometer=gn.planning.Goniometer(in_plane=True))
    assert np.abs(flat.wo[:, 1]).max() < 1e-12
    brushed = gn.Microfacet(gn.GGX(0.1, 0.3))
    assert len(gn.planning.plan(brushed, 6, goniometer=SMALL).names) == 3


def test_channels_and_held_parameters():
    m = gn.Lambertian([0.6, 0.1, 0.05]) + gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.04))
    planned = gn.planning.plan(m, 6, goniometer=SMALL, by=["rho", "alpha"])
    assert planned.names == ("0.rho[0]", "0.rho[1]", "0.rho[2]", "1.distribution.alpha_x") and planned.f.shape == (6, 3)


def test_several_expected_models():
    models = [PAINT.replace(alpha=alpha) for alpha in (0.1, 0.3)]
    planned = gn.planning.plan(models, 8, goniometer=SMALL)
    assert len(planned) == 8
    with pytest.raises(gn.Error, match="one structure"):
        gn.planning.plan([PAINT, gn.Lambertian(0.3)], 8)


def test_tables_that_are_filled_are_fitted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    planned = gn.planning.plan(PAINT, 10)
    planned.save("plan.csv")
    f = PAINT.f(planned.wi, planned.wo)
    lines = (tmp_path / "plan.csv").read_text().splitlines()
    rows = [i for i, line in enumerate(lines) if line.endswith(",")]
    for row, value in zip(rows, f, strict=True):
        lines[row] += f"{value:.10g}"
    (tmp_path / "plan.csv").write_text("\n".join(lines))
    assert np.allclose(gn.fit("plan.csv", PAINT).values, [0.3, 0.2, 0.04], rtol=1e-5)
    planned.save("plan.json")
    assert len(json.loads((tmp_path / "plan.json").read_text())["directions"]) == 10
    assert "<table" in planned._repr_html_() and "regular grid" in str(planned) and len(planned.rows()) == 10


@pytest.mark.parametrize(
    "arguments, changes, words",
    [
        ((PAINT, 2), {}, "at least 3"),
        ((PAINT, 0), {}, "count=0"),
        ((PAINT, 5, "E"), {}, "expected 'D' or 'A'"),
        ((PAINT, 5), {"noise": 5.0}, "in percent"),
        ((PAINT, 5), {"noise": 0.0}, "expected one of them above 0"),
        ((gn.IdealSpecular(0.5), 5), {}, "mirror"),
        ((PAINT, 5), {"by": ["gloss"]}, "gloss"),
        (([], 5), {}, "no models"),
        ((PAINT, 5), {"candidates": 3}, "expected \\(wi, wo\\)"),
        ((PAINT + 0.0 * gn.Lambertian(0.5), 9), {}, "determines"),
        ((PAINT, 60), {"goniometer": gn.planning.Goniometer(step_theta=0.43, in_plane=True)}, "expected at most"),
        ((PAINT, 201), {}, "count=201"),
    ],
)
def test_bad_arguments_are_refused(arguments, changes, words):
    with pytest.raises(gn.Error, match=words):
        gn.planning.plan(*arguments, **changes)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"theta_i": (0.0, 75.0)}, "in degrees"),
        ({"theta_i": 1.0}, "expected 2 numbers from 0"),
        ({"theta_i": (1.0, 0.5)}, "least angle first"),
        ({"step_theta": 5.0}, "in degrees"),
        ({"in_plane": 1}, "True or False"),
        ({"least_angle": -1.0}, "expected a number from 0"),
    ],
)
def test_impossible_goniometers_are_refused(changes, words):
    with pytest.raises(gn.Error, match=words):
        gn.planning.Goniometer(**changes)
    with pytest.raises(gn.Error, match="no pair of directions"):
        gn.planning.Goniometer((0.5, 0.5), (0.5, 0.5), (0.0, 0.0)).pairs()


def test_the_command(tmp_path, monkeypatch):
    from click.testing import CliRunner

    from gonio.cli.commands import cli

    monkeypatch.chdir(tmp_path)
    text = "Lambertian(0.3) + Microfacet(GGX(0.2), Schlick(0.04))"
    run = CliRunner().invoke(cli, ["plan", text, "8", "-o", "plan.csv", "--in-plane"])
    assert run.exit_code == 0 and "8 pairs of directions" in run.output and (tmp_path / "plan.csv").exists(), run.output
    run = CliRunner().invoke(cli, ["plan", text, "8", "--json", "--theta-o", "0,60"])
    assert max(row["theta_o"] for row in json.loads(run.output)["directions"]) <= 60.0
    for wrong in (["--theta-i", "60"], ["--step", "0"], ["-o", "plan.txt"]):
        assert CliRunner().invoke(cli, ["plan", text, "8", *wrong]).exit_code == 2
