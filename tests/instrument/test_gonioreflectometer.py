"""The virtual gonioreflectometer: against theory, energy, files, laws; its uncertainties; bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.errors import DirectionError, ParameterError, ToleranceWarning
from gonio.formula import tree
from gonio.instrument.cells import Cells
from gonio.instrument.parts import tiles


def after_one_bounce(slope, theta):
    """Shares of light at an angle that leave symmetric V-grooves after one bounce, from the side towards the light and
    from the other one: all ways in the plane, from crest to crest at x = -1 and 1, worked out."""
    d = np.array([-math.sin(theta), -math.cos(theta)])  # light from the side of +x
    shares = []
    for side in (-1.0, 1.0):  # the groove's side at x of this sign rises to its crest: normal (-side s, 1)
        n = np.array([-side * slope, 1.0]) / math.hypot(slope, 1.0)
        if d @ n >= 0.0:
            shares.append(0.0)
            continue
        x = np.linspace(0.0, side, 200_001)[1:]
        z = slope * np.abs(x)
        entry = x + d[0] * (slope - z) / d[1]  # where the ray came through the opening
        r = d - 2.0 * (d @ n) * n
        out = np.abs(entry) <= 1.0
        if r[1] > 0.0:
            out &= np.abs(x + r[0] * (slope - z) / r[1]) <= 1.0
        else:
            out &= False
        shares.append(out.sum() * abs(entry[1] - entry[0]) / 2.0)
    return shares


@pytest.mark.parametrize("degrees", [10.0, 30.0, 50.0])
def test_v_grooves(degrees):
    theta = math.radians(degrees)
    m = gn.gonioreflectometer(
        gn.surfaces.v_grooves(0.6), theta_i=theta, phi_i=0.0, rays=1 << 17, tolerance=0.5, cells=(90, 4), bounces=4
    )
    expected = after_one_bounce(0.6, theta)
    assert m.bounces[0, 0, 0, 0] == pytest.approx(sum(expected), abs=0.002)
    np.testing.assert_allclose(m.report.reflected, 1.0, atol=1e-5)


def test_energy_is_conserved():
    m = gn.gonioreflectometer(
        gn.surfaces.gaussian(0.5, size=128), theta_i=[0.0, 1.2], tolerance=1.0, rays=1 << 16, bounces=40
    )
    np.testing.assert_allclose(m.report.reflected + m.report.unfinished + m.report.lost, 1.0, atol=1e-6)
    assert m.report.lost.max() < 1e-4 and m.report.unfinished.max() < 1e-4
    projected = Cells(18, 36).projected * np.r_[1.0, np.full(17, 2.0), 1.0]
    np.testing.assert_allclose((m.stored * projected).sum((1, 2)), m.report.reflected[:, 0], rtol=1e-6)


@pytest.mark.parametrize(("rays", "bounces"), thinned([(1 << 13, 60), (1 << 15, 200)], [(1 << 13, 60)]))
def test_facets_of_any_reflectance(rays, bounces):
    """Mirrors as a number and as a material are alike; white facets of any kind return everything."""
    surface, named = gn.surfaces.gaussian(0.4, size=64), {"theta_i": 0.7, "tolerance": 1.0, "rays": rays}
    number = gn.gonioreflectometer(surface, 0.5, **named)
    material = gn.gonioreflectometer(surface, gn.IdealSpecular(0.5), **named)
    np.testing.assert_allclose(number.bounces, material.bounces, atol=2e-4)
    white = gn.gonioreflectometer(surface, gn.Lambertian(1.0), **named, bounces=bounces)
    np.testing.assert_allclose(white.report.reflected, 1.0, atol=2e-3)
    red = gn.gonioreflectometer(surface, gn.Lambertian([0.8, 0.2, 0.1]), **named)
    assert red.channels == 3 and red.stored.shape == (1, 18, 19, 3)
    first = red.bounces[0, 0, 0]
    np.testing.assert_allclose(first / first[0], [1.0, 0.25, 0.125], rtol=1e-5)


def test_flat_facets_are_the_facet():
    """On a flat surface the result is the reflectance of the facet itself, here with channels."""
    facet = gn.Lambertian([0.6, 0.3])
    m = gn.gonioreflectometer(
        gn.surfaces.HeightField(np.zeros((4, 4)), turn=0.0), facet, 0.5, rays=1 << 17, tolerance=1.0
    )
    f, u = m.stored[0, :-1], m.uncertainty[0, :-1]
    assert np.abs((f - np.array([0.6, 0.3]) / np.pi) / u).mean() < 1.5
    np.testing.assert_allclose(m.bounces[0, 0, 0], [0.6, 0.3], rtol=1e-5)


@pytest.mark.parametrize("count", thinned([16, 24], [16]))
def test_uncertainty_is_that_of_independent_surfaces(count):
    """The spread of whole measurements is the uncertainty that each states."""
    surface, named = (
        gn.surfaces.gaussian(0.4, size=64),
        {"theta_i": 0.5, "tolerance": 1.0, "rays": 1 << 14, "cells": (6, 8)},
    )
    runs = [gn.gonioreflectometer(surface, **named, seed=seed) for seed in range(count)]
    f, u = (np.stack([getattr(m, name)[0] for m in runs]) for name in ("stored", "uncertainty"))
    strong = f.mean(0) > 0.1 * f.mean(0).max()
    ratio = np.sqrt((u**2).mean(0))[strong] / f.std(0, ddof=1)[strong]
    assert 0.8 < ratio.mean() < 1.25
    again = gn.gonioreflectometer(surface, **named, seed=3)
    np.testing.assert_array_equal(again.stored, runs[3].stored)


def test_beckmann():
    """Light once reflected by a Gaussian surface, against the microfacet model (its shadowing is an approximation)."""
    theta = np.radians([10.0, 50.0])
    m = gn.gonioreflectometer(gn.surfaces.gaussian(0.4), theta_i=theta, bounces=1, tolerance=0.06, rays=1 << 17)
    albedo = gn.albedo(gn.Microfacet(gn.Beckmann(0.4), 1.0), gn.direction(theta, 0.0))
    np.testing.assert_allclose(m.bounces[:, 0, 0, 0], albedo, rtol=0.01)


@pytest.mark.full
@pytest.mark.parametrize("degrees", [10.0, 30.0, 50.0, 70.0])
def test_beckmann_closely(degrees):
    """Within 1 %, but for three standard errors of what is measured: the mean of four runs, by their spread."""
    theta, cells = math.radians(degrees), Cells(18, 36)
    named = {"theta_i": theta, "bounces": 1, "tolerance": 0.024}
    runs = [gn.gonioreflectometer(gn.surfaces.gaussian(0.4), **named, seed=seed) for seed in range(4)]
    model = gn.Microfacet(gn.Beckmann(0.4), 1.0)
    off = np.array([m.bounces[0, 0, 0, 0] for m in runs]) / gn.albedo(model, gn.direction(theta, 0.0)) - 1.0
    assert abs(off.mean()) < 0.01 + 3.0 * off.std(ddof=1) / 2.0
    polar, around = np.meshgrid(cells.theta_o, cells.phi[:19], indexing="ij")
    expected = model.f(gn.direction(theta, 0.0), gn.direction(polar, around))
    weight = (cells.projected * expected)[1:-1]  # nodes for means over cells: about the same but at the horizon
    f = np.mean([m.stored[0] for m in runs], axis=0)
    assert (weight * np.abs(f / expected - 1.0)[1:-1]).sum() / weight.sum() < 0.06


def test_orientation():
    """Along grooves light goes on as from a mirror; across them it is split. The table turns with the surface."""
    m = gn.gonioreflectometer(
        gn.surfaces.v_grooves(0.3), theta_i=[0.4], phi_i=[0.0, np.pi / 2], rays=1 << 14, tolerance=1.0
    )
    assert tree.is_oriented(m) and m.periods["phi_i"] == pytest.approx(np.pi)
    across, along = (m.stored[0, :, :, j] * Cells(18, 36).projected for j in (0, 1))
    behind = slice(9, 28)
    assert along[:, behind].sum() > 0.9
    assert across[:, 0].sum() + across[:, 18].sum() > 0.99
    wi, wo = gn.direction(0.4, np.pi / 2), gn.direction(0.4, -np.pi / 2)
    assert m.f(wi, wo) == pytest.approx(m.f(-wi * [1, 1, -1], -wo * [1, 1, -1]), rel=1e-4)


def test_files_and_laws(tmp_path):
    m = gn.gonioreflectometer(gn.surfaces.gaussian(0.5, size=64), theta_i=[0.0, 0.5, 1.0], tolerance=0.5, rays=1 << 14)
    gn.save(m, tmp_path / "rough.csv")
    back = gn.load(tmp_path / "rough.csv")
    wi, wo = gn.direction(0.5, 0.0), gn.direction([0.2, 0.6], [0.5, 2.0])
    np.testing.assert_allclose(back.f(wi, wo), m.f(wi, wo), rtol=1e-4)
    assert back.uncertainty is not None
    assert gn.check(m, laws=["positivity", "pdf", "energy"]).lawful
    assert "surfaces" in str(m.report) and m.about["surfaces"] >= 8


def test_what_is_not_reached_is_said():
    with pytest.warns(ToleranceWarning, match="allow more"):
        m = gn.gonioreflectometer(
            gn.surfaces.gaussian(0.4, size=64), theta_i=0.5, tolerance=1e-4, surfaces=8, rays=1024
        )
    assert not m.converged and m.report.error[0, 0] > 1e-4
    bumps = 0.3 * np.random.default_rng(0).normal(size=(32, 32))
    part = gn.surfaces.from_map(bumps, pixel=1.0)
    with pytest.warns(ToleranceWarning, match="a larger map"):
        m = gn.gonioreflectometer(part, theta_i=0.5, phi_i=0.0, tolerance=1e-4, rays=1024, cells=(4, 4))
    assert m.report.surfaces[0, 0] == 16


@pytest.mark.parametrize("mirrored", [False, True])
def test_parts_cover_the_surface_once(mirrored):
    points = np.random.default_rng(2).random((4096, 2)).astype(np.float32)
    every = [tiles(points, k, mirrored) for k in range(16)]
    counts, *_ = np.histogram2d(*np.concatenate(every).T, bins=8, range=[[0, 1], [0, 1]])
    assert np.abs(counts / counts.mean() - 1.0).max() < 0.15
    original = [np.where(x > 0.5, 1.0 - x, x) if mirrored else x for x in every]
    for k, x in enumerate(original):
        width = 0.125 if mirrored else 0.25
        assert (np.floor(x / width * (1 - 1e-6)) == [k % 4, k // 4]).all()


@pytest.mark.parametrize(
    "change, message",
    [
        ({"theta_i": 30.0}, "numpy.radians"),
        ({"theta_i": [0.5, 0.2]}, "rising"),
        ({"theta_i": np.nan}, "numbers from 0 below"),
        ({"theta_i": []}, "rising"),
        ({"theta_i": np.pi / 2}, "below"),
        ({"phi_i": 0.0}, "isotropic"),
        ({"facet": 1.5}, "0 to 1"),
        ({"facet": "gold"}, "expected"),
        ({"facet": gn.SmoothDielectric(1.5)}, "transmits"),
        ({"facet": gn.Lambertian(np.full((4, 3), 0.5))}, "maps"),
        ({"cells": (18, 35)}, "even"),
        ({"cells": (1, 36)}, "rings"),
        ({"tolerance": 0.0}, "from"),
        ({"bounces": 0}, "from"),
        ({"surface": gn.Lambertian(0.5)}, "surface"),
    ],
)
def test_bad_input(change, message):
    given = {"surface": gn.surfaces.gaussian(0.3, size=64), "theta_i": 0.5, "rays": 1024, **change}
    with pytest.raises((ParameterError, DirectionError), match=message):
        gn.gonioreflectometer(**given)
