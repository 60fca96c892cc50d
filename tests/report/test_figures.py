"""What figures draw: slices that end where the data end, what was measured, names of one number of many channels."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.report import figures
from gonio.report._slices import USUAL, VIEWS, incidences, lit_range, one_number, plane, slices_of, spans

GLOSSY = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))


def scan(phi: float = 0.0) -> gn.Scattered:
    """Measured in the plane of incidence, at 15 to 60 degrees, up to views of 70 degrees."""
    theta_i, view = np.meshgrid(np.radians([15.0, 30.0, 45.0, 60.0]), np.radians(np.arange(-70.0, 71.0, 10.0)))
    rows = [x.ravel() for x in (theta_i, phi + 0.0 * view, np.abs(view), np.where(view < 0.0, phi, phi + np.pi))]
    f = GLOSSY.f_angles(*rows)
    return gn.Scattered(*rows, f, uncertainty=0.02 * f)


def grid(**options: object) -> gn.Gridded:
    """On a grid of all azimuths, up to 60 and 65 degrees."""
    nodes = {"theta_i": (0.0, 61.0, 10.0), "theta_o": (0.0, 66.0, 5.0), "phi": (0.0, 360.0, 15.0)}
    axes = {name: np.radians(np.arange(*steps)) for name, steps in nodes.items()}
    theta_i, theta_o, phi = np.meshgrid(*axes.values(), indexing="ij")
    return gn.Gridded("angles", axes, GLOSSY.f_angles(theta_i, 0.0, theta_o, phi), **options)


@pytest.mark.parametrize("phi", [0.0, 1.0])
def test_slices_of_a_scan_are_what_was_measured(phi):
    m = scan(phi)
    slices = slices_of(m)
    assert [s.theta for s in slices] == [15.0, 30.0, 45.0, 60.0] == incidences(m)
    assert lit_range(m) == (15.0, 60.0)
    for s in slices:
        np.testing.assert_allclose(np.sort(s.views), np.arange(-70.0, 71.0, 10.0), atol=1e-6)
        seen = gn.direction(np.radians(np.abs(s.views)), np.where(s.views < 0.0, np.pi, 0.0))
        true = GLOSSY.f(gn.direction(np.radians(s.theta), np.pi), seen)
        np.testing.assert_allclose(s.measured, true, rtol=1e-12)  # forward of the light is to the right
        np.testing.assert_allclose(s.u, 0.02 * true, rtol=1e-12)
        assert np.isnan(s.f[np.abs(VIEWS) > 70.5]).all() and np.isfinite(s.f[np.abs(VIEWS) < 69.5]).all()
    assert spans(slices) == [(-90.0, pytest.approx(-70.0, abs=0.2)), (pytest.approx(70.0, abs=0.2), 90.0)]


def test_slices_of_a_grid_end_with_its_nodes():
    for outside in ("hold", "missing"):
        slices = slices_of(grid(outside=outside))
        assert [round(s.theta, 9) for s in slices] == [0.0, 10.0, 30.0, 40.0, 60.0]  # next to the usual ones
        for s in slices:
            assert np.isnan(s.f[np.abs(VIEWS) > 65.1]).all() and np.isfinite(s.f[np.abs(VIEWS) < 64.9]).all()
            assert len(np.unique(s.views.round(6))) == 27 and s.u is None
            np.testing.assert_allclose(np.interp(s.views, VIEWS, s.f), s.measured, rtol=2e-3)
    assert slices_of(GLOSSY)[0].views.size == 0 and spans(slices_of(GLOSSY)) == []
    assert incidences(GLOSSY) == list(USUAL) and lit_range(GLOSSY) == (0.0, 90.0)


def test_the_plane_of_an_oriented_measurement_is_one_that_was_lit():
    rows = [np.concatenate(x) for x in zip(scan(0.4).rows.T, scan(2.9).rows.T, strict=True)]
    m = gn.Scattered(*rows, np.ones(len(rows[0])), isotropic=False)
    assert plane(m) == pytest.approx(2.9)
    assert all(len(s.views) == 15 for s in slices_of(m))
    assert plane(GLOSSY) == plane(scan(0.4)) == np.pi


@pytest.mark.parametrize(
    ("names", "count", "words", "weights"),
    [
        (None, 1, "", [1.0]),
        (None, 3, "luminance", [0.2126, 0.7152, 0.0722]),
        (("R", "G", "B"), 3, "luminance", [0.2126, 0.7152, 0.0722]),
        (("X", "Y", "Z"), 3, "luminance Y", [0.0, 1.0, 0.0]),
        (("Band1", "Band2", "nir"), 3, "mean of 3 channels", [1 / 3] * 3),
        ((450.0, 550.0, 650.0), 3, "mean of 3 wavelengths, 450 to 650 nm", [1 / 3] * 3),
        (None, 4, "mean of 4 channels", [0.25] * 4),
    ],
)
def test_one_number_of_many_channels_has_a_name(names, count, words, weights):
    m = gn.Lambertian(np.linspace(0.1, 0.5, count)).with_notes(channel_names=names)
    number, got = one_number(m)
    assert got == words
    np.testing.assert_allclose([number(row) for row in np.eye(count)], weights, atol=5e-5)


MAP = gn.Lambertian(np.linspace(0.1, 0.9, 6).reshape(2, 3, 1))


@pytest.mark.parametrize("m", [scan(), MAP, gn.Lambertian(np.linspace(0.1, 0.5, 7))], ids=["scan", "map", "7 channels"])
def test_figures_say_what_they_draw(m, tmp_path, monkeypatch):
    """No light is needed; the title is no path; what is no data says so."""
    said = []
    monkeypatch.setattr("matplotlib.text.Text.set_text", _recording(said))
    named = m.with_notes(path="/a/long/path/sample.csv") if hasattr(m, "path") else m
    figures.show(named, tmp_path / "a.svg", size=16, samples=1)
    text = "\n".join(said)
    assert "[sr⁻¹]" in text and "/a/long" not in text
    if hasattr(m, "path"):
        assert {"sample.csv", "no data", "incidence θᵢ"} <= set(said) and "bars: ±2u" in text and "outermost" in text
    elif m is MAP:
        assert "+ the place (0, 1) of the other panels" in text and "sphere" not in text.lower()
    else:
        assert "mean of 7 channels" in text and "number of the channel" in said


def _recording(said: list[str]):
    from matplotlib.text import Text

    original = Text.set_text

    def set_text(self, s):
        said.append(str(s))
        original(self, s)

    return set_text
