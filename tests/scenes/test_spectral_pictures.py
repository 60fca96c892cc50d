"""Pictures of spectral materials: under white light, and under lights that are spectra."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.compile import store
from gonio.errors import ParameterError
from gonio.evaluate import planning
from gonio.pictures.colour import light_to_rgb, to_rgb
from gonio.scenes import traced

NM = np.arange(380.0, 781.0, 5.0)
WHITE = gn.Lambertian(1.0).at(NM)
PAINT = gn.Lambertian(gn.Spectrum([380.0, 500.0, 600.0, 780.0], [0.1, 0.2, 0.7, 0.6])).at(NM)


def middle(m, lights):
    return gn.render(m, lights, size=8, samples=4).pixels[4, 4]


def test_a_light_without_a_spectrum_is_daylight():
    np.testing.assert_allclose(middle(PAINT, gn.ConstantLight(1.0)), PAINT.rho @ to_rgb(NM), rtol=1e-5)


def test_a_light_that_is_a_spectrum_has_its_own_colour():
    lamp = gn.spectra.blackbody(2856.0)
    lamp = gn.Spectrum(lamp.wavelengths, lamp.values / lamp.at(560.0))
    expected = (PAINT.rho * lamp.at(NM)) @ light_to_rgb(NM)
    for light in (gn.ConstantLight(lamp), gn.ConstantLight(lamp).at(NM)):
        found = middle(PAINT, [light, gn.ConstantLight(gn.Spectrum([300.0, 800.0], [0.0, 0.0]))])
        np.testing.assert_allclose(found, expected, rtol=1e-5)
    sun = gn.DistantLight(gn.direction(0.4, -1.2), lamp)
    up = [0.0, 0.0, 1.0]
    radiance = gn.reflected_radiance(PAINT, sun, up, normal=up)
    np.testing.assert_allclose(radiance, PAINT.rho / np.pi * lamp.at(NM) * np.cos(0.4), rtol=1e-6)
    assert (middle(WHITE, sun) > 0.0).all()


def test_light_of_equal_power_has_a_luminance_of_one():
    """X = Y = Z = 1 for equal power, by which the observer is defined; the tables' own sums differ by 2e-4."""
    from gonio.pictures.colour import XYZ_OF_RGB

    np.testing.assert_allclose(np.ones(81) @ light_to_rgb(NM) @ XYZ_OF_RGB.T, 1.0, atol=5e-4)


def test_any_number_of_wavelengths(monkeypatch):
    many = np.linspace(380.0, 780.0, 401)
    m = gn.Lambertian(gn.Spectrum([380.0, 780.0], [0.2, 0.8])).at(many)
    sizes = []
    tile = traced.tile
    monkeypatch.setattr(traced, "tile", lambda job, at, *a: (sizes.append(at.stop - at.start), tile(job, at, *a))[1])
    picture = gn.render(m, gn.ConstantLight(gn.Spectrum([300.0, 800.0], [1.0, 1.0])), size=64, samples=8)
    assert picture.pixels.shape == (64, 64, 3)
    assert max(sizes) <= traced.PIXELS * traced.CHANNELS // 401  # pixels in memory at a time
    np.testing.assert_allclose(picture.pixels[32, 32], m.rho @ light_to_rgb(many), rtol=1e-4)


def test_lights_and_materials_that_do_not_meet():
    spectrum = gn.Spectrum([400.0, 700.0], [1.0, 1.0])
    with pytest.raises(ParameterError, match="material has no wavelengths"):
        gn.render(gn.Lambertian([0.1, 0.2, 0.3]), gn.ConstantLight(spectrum), size=8, samples=4)
    with pytest.raises(ParameterError, match="nothing is extrapolated"):
        gn.render(PAINT, gn.ConstantLight(spectrum), size=8, samples=4)
    with pytest.raises(ParameterError, match=r"m\.at"):
        gn.render(gn.Lambertian(spectrum), gn.ConstantLight(1.0), size=8, samples=4)


def test_bands_outside_the_visible_are_no_colours():
    m = gn.Lambertian([0.3, 0.2], wavelengths=[858.5, 1640.0])
    picture = gn.render(m, gn.ConstantLight(gn.Spectrum([300.0, 2000.0], [1.0, 1.0])), size=8, samples=4)
    np.testing.assert_allclose(picture.pixels[4, 4], [0.3, 0.2], rtol=1e-6)


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
def test_channels_of_a_light_share_what_they_can(monkeypatch):
    """One kernel computes a sky once for its three channels, of a material of wavelengths: so many operations."""
    counts, kernel = set(), store.kernel

    def noted(program):
        counts.add(len(program.graph.reachable([node for output in program.outputs for node in output.nodes])))
        return kernel(program)

    monkeypatch.setattr(store, "kernel", noted)
    m = gn.Lambertian(np.linspace(0.2, 0.8, 31), wavelengths=np.linspace(400.0, 700.0, 31))
    gn.render(m, gn.PreethamSky(3.0), size=8, samples=4)
    assert max(counts) == 665
