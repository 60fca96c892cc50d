"""Verdicts of measurements: sound ones fail no law, unsound ones do, and every face says the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from sound import LAWS, SHAPES, errors, sound, too_white, unreciprocal

import gonio as gn
from gonio.cli.commands import cli
from gonio.laws._significance import CHANCE, Errors, _below, _differing

PTFE = str(Path(__file__).parents[2] / "examples" / "ptfe_in_plane.csv")


def test_a_good_measurement_passes_on_every_face(tmp_path):
    """PTFE in the plane of incidence, 0.3 % noise: albedos above 1 are interpolation's."""
    report = gn.check(gn.load(PTFE), laws=["reciprocity", "energy"])
    assert report.verdicts == dict.fromkeys(("reciprocity", "energy"), "not significant")
    assert report.passed and report.lawful and report["energy"].value > report["energy"].tolerance
    told = json.loads(json.dumps(report.to_json()))
    assert (told["passed"], told["lawful"], told["laws"][1]["verdict"]) == (True, True, "not significant")
    assert "FAIL" not in str(report) and "  not significant  energy" in str(report)
    assert "all laws hold" in report._repr_html_() and "not significant" in report._repr_html_()


@pytest.mark.full
def test_the_command_line_passes_a_good_measurement():
    found = CliRunner().invoke(cli, ["check", PTFE])
    assert found.exit_code == 0 and "FAIL" not in found.output


@pytest.mark.parametrize("common", [0.0, 0.5, 1.0])
def test_chances_of_lawful_surfaces_are_not_too_small(common):
    """Of 500 draws, of which 5 have a chance below 1 %, more than 12 have one with a probability of 2e-3."""
    rng = np.random.default_rng(7)
    low = np.zeros(3)
    for _ in range(500):
        u, u_back = 0.01 + 0.04 * np.linspace(0.0, 1.0, 25), 0.01 + 0.0 * np.arange(25)
        e = errors(rng, (50,), common)
        pairs = _differing(1.0 + u * e[:25], 1.0 + u_back * e[25:], u, u_back)
        share = np.sqrt(common), np.sqrt(1.0 - common)
        white = share[0] * 0.02 * rng.standard_normal() + share[1] * 0.005 * rng.standard_normal(11)
        chances = 2.0 * pairs.chance, _below(e)[-1], Errors(0.005, 0.02, 0.0).chance(float(white.max()), 11, 1)
        low += np.array(chances) < 0.01
    assert (low <= 12).all(), low


def test_breaches_of_many_and_of_one_are_seen():
    u = np.full(100, 0.01)
    many = _differing(np.full(100, 1.0), np.full(100, 1.04), u, u)
    one = _differing(np.full(100, 1.0), np.where(np.arange(100) == 7, 1.1, 1.0), u, u)
    assert many.by_all < CHANCE < many.by_one and many.rms == pytest.approx(0.04, rel=0.05)
    assert one.by_one < CHANCE and one.off == pytest.approx(0.1, rel=0.1)
    assert _below(np.full(100, 4.0))[-1] < CHANCE < 0.2 < _below(np.full(100, 1.0))[-1]  # may be one error of all


def test_an_albedo_of_four_u_above_1_is_significant():
    assert Errors(0.001, 0.01, 0.002).chance(4.0 * 0.0102, 11, 1) < 2e-4
    assert Errors(0.01, 0.0, 0.0).chance(0.03, 1, 1) == pytest.approx(1.35e-3, rel=0.01)
    assert Errors(0.01, 0.0, 0.0).chance(0.03, 11, 3) == pytest.approx(33 * 1.35e-3, rel=0.03)
    assert Errors(0.0, 0.01, 0.0).chance(0.03, 11, 1) == pytest.approx(1.35e-3, rel=0.02)


@pytest.mark.full
@pytest.mark.parametrize("number", range(20))
def test_sound_measurements_fail_no_law(number):
    """The campaign, benchmarks/verdicts.py, has 1000."""
    report = gn.check(sound(number, 0.5 * (number % 2))[1], laws=LAWS)
    assert report.passed, report


@pytest.mark.full
@pytest.mark.parametrize("number", range(len(SHAPES)))
def test_unsound_measurements_fail(number):
    assert gn.check(unreciprocal(number, 5.0, 0.5)[1], laws=["reciprocity"])["reciprocity"].verdict == "FAIL"
    assert gn.check(too_white(number, 6.0, 0.5)[1], laws=["energy"])["energy"].verdict == "FAIL"


@pytest.mark.parametrize("change, verdict", [(0.0, "not significant"), (0.1, "FAIL")])
def test_along_the_normal_azimuths_differ_by_their_errors_or_by_more(change, verdict):
    m = sound(SHAPES.index("grid"), 0.0)[1]
    f = m.brdf().copy()
    f[0, :, len(m.axes["phi"]) // 2 :] *= 1.0 + change
    m = gn.Gridded("angles", m.axes, f, uncertainty=m.brdf_uncertainty(), mirrored=m.is_mirrored)
    assert gn.check(m, laws=["isotropy"])["isotropy"].verdict == verdict
