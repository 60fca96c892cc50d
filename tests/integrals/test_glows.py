"""What fluoresces under lights that are known, and under none: radiances, factors and fates, with numbers by hand."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

import gonio as gn
from gonio.errors import FluorescenceWarning, ParameterError

PI = math.pi
UP = np.array([0.0, 0.0, 1.0])
D = np.array([[0.2, 0.0, 0.0], [0.45, 0.6, 0.0], [0.1, 0.15, 0.7]])
INK = gn.Donaldson(D, wavelengths=[450.0, 550.0, 650.0])
VIOLET = np.array([4.0, 1.0, 1.0])


def factor(light, m=INK, **options):
    return PI * gn.reflected_radiance(m, light, UP, **options)


@pytest.mark.parametrize("E", [1.0, VIOLET, [1.0, 0.0, 0.0]], ids=["alike", "violet", "one band"])
def test_radiance_is_the_matrix_times_the_light(E):
    expected = D @ np.broadcast_to(E, 3)
    np.testing.assert_allclose(factor(gn.DistantLight(UP, E)), expected, rtol=1e-12)
    np.testing.assert_allclose(factor(gn.ConstantLight(E)) / PI, expected, rtol=1e-4)


def test_of_spectra_the_power_of_whole_bands_is_exchanged():
    m = gn.Donaldson(D, wavelengths=[450.0, 550.0, 620.0])
    widths = np.array([100.0, 85.0, 70.0])
    lamp = gn.Spectrum([450.0, 550.0, 620.0, 650.0], [*VIOLET, 1.0])
    np.testing.assert_allclose(factor(gn.ConstantLight(lamp), m) / PI, D @ (VIOLET * widths) / widths, rtol=1e-4)
    np.testing.assert_allclose(factor(gn.DistantLight(UP, lamp)), D @ VIOLET, rtol=1e-12)  # of an even grid


def test_wavelengths_that_come_from_different_directions():
    """Light along x in the first band, along y in the others, of an environment, a sky and a function."""
    glossy = gn.Donaldson(D, gn.Microfacet(gn.GGX(0.5)), wavelengths=[450.0, 550.0, 650.0])
    w = gn.direction(0.7, 0.3)
    sky = gn.FunctionLight(lambda w: np.stack([1.0 + w[..., 0], 1.0 + w[..., 1], 1.0 + 0.0 * w[..., 2]], -1))
    alone = [
        gn.reflected_radiance(gn.Microfacet(gn.GGX(0.5)), gn.FunctionLight(lambda w, k=k: sky.L(w)[..., k]), w)
        for k in range(3)
    ]
    np.testing.assert_allclose(gn.reflected_radiance(glossy, sky, w), D @ alone, rtol=1e-3)
    for light in (gn.EnvironmentLight.studio(height=32), gn.PreethamSky(sun=[0.0, 0.6, 0.8])):
        white = factor(light, gn.Lambertian(np.ones(3)), samples=512)
        np.testing.assert_allclose(factor(light, samples=512), D @ white, rtol=1e-4)


def test_several_lights_add_up_each_with_its_spectrum():
    sun, lamp = gn.DistantLight(UP, VIOLET), gn.SphereLight([0.0, 0.5, 2.0], 0.5, [0.5, 0.0, 2.0])
    both = factor([sun, lamp])
    np.testing.assert_allclose(both, D @ (VIOLET + gn.irradiance(lamp)), rtol=1e-3)
    found = gn.reflected_radiance(INK, [sun, lamp], UP, return_error=True)
    np.testing.assert_allclose(PI * found.value, both, rtol=1e-2)


def test_numbers_of_lights_keep_their_derivatives():
    torch = pytest.importorskip("torch")
    E = torch.tensor(VIOLET, requires_grad=True)
    gn.reflected_radiance(INK, gn.DistantLight(UP, E), torch.tensor(UP))[2].backward()
    np.testing.assert_allclose(E.grad.numpy(), D[2] / PI, rtol=1e-12)


def test_beside_light_that_is_transmitted():
    m = INK + gn.DiffuseTransmission(0.1)
    np.testing.assert_allclose(factor(gn.DistantLight(UP, 1.0), m), D.sum(axis=1), rtol=1e-12)
    wi = np.array([UP, -UP])
    np.testing.assert_allclose(gn.fate(m, wi).absorbed, [[0.15, 0.15, 0.2], [0.9, 0.9, 0.9]], atol=1e-4)


def test_energy_that_leaves_again_is_not_absorbed():
    found = gn.fate(INK, gn.direction([0.0, 1.0], 0.0))
    np.testing.assert_allclose(found.reflected, [D.sum(axis=0)] * 2, atol=1e-4)
    np.testing.assert_allclose(found.absorbed, [1.0 - D.sum(axis=0)] * 2, atol=1e-4)
    absorbed = gn.absorptance(INK, UP, return_error=True)
    np.testing.assert_allclose(absorbed.value, 1.0 - D.sum(axis=0), atol=1e-4)


CALLS = {
    "albedo": lambda m: gn.albedo(m, UP),
    "black_sky_albedo": lambda m: gn.remote_sensing.black_sky_albedo(m, 0.3),
    "white_sky_albedo": gn.remote_sensing.white_sky_albedo,
    "blue_sky_albedo": lambda m: gn.remote_sensing.blue_sky_albedo(m, 0.3, 0.2),
    "reflectance": gn.reflectance,
    "reflectance_factor": lambda m: gn.reflectance_factor(m, UP, UP),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_without_a_light_calls_say_once_what_they_leave_out(call):
    with pytest.warns(FluorescenceWarning, match=r"m\.under\(E\)") as said:
        found = call(INK)
    assert len(said) == 1 and said[0].filename == __file__
    np.testing.assert_allclose(found, np.diagonal(D), atol=1e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        call(INK.under(VIOLET))
        call(INK.at(550.0))  # a single wavelength has no other


def test_a_sky_is_a_light():
    skies = [gn.ConstantLight(VIOLET), gn.ConstantLight(2.0 * VIOLET)]
    np.testing.assert_allclose(gn.reflectance_factor(INK, collected=UP, sky=skies), D @ VIOLET / VIOLET, rtol=1e-3)
    with pytest.raises(ParameterError, match=r"changes with direction.*one spectrum"):
        gn.reflectance(INK, sky=[gn.ConstantLight(VIOLET), gn.CIESky()])
