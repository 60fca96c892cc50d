"""Typical mistakes of a first hour, as the calls that are typed, with the words they get."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.errors import DirectionError, DirectionWarning, MeaningWarning, ParameterError

UP = np.array([0.0, 0.0, 1.0])
AXES = {"theta_i": [0.0, 0.3, 0.6], "theta_o": [0.0, 0.3, 0.6], "phi": [0.0, 1.0, 2.0]}
matte = gn.Lambertian(0.5)

REFUSED = {
    "a polar angle in degrees": (lambda: gn.direction(30, 0), DirectionError, "in degrees? numpy.radians(30) = 0.5236"),
    "polar angles in degrees": (lambda: gn.direction([0, 15, 30], 0), DirectionError, "theta: 15 is no polar angle"),
    "f_angles in degrees": (lambda: matte.f_angles(30, 0, 45, 180), DirectionError, "numpy.radians(30)"),
    "a sun in degrees": (
        lambda: gn.remote_sensing.black_sky_albedo(matte, 45),
        DirectionError,
        "0 to pi/2 [rad]; in degrees?",
    ),
    "a sun below the horizon": (
        lambda: gn.remote_sensing.black_sky_albedo(matte, 1.7),
        DirectionError,
        "1.7 is no polar angle here",
    ),
    "a blue sky in degrees": (
        lambda: gn.remote_sensing.blue_sky_albedo(matte, 45, 0.2),
        DirectionError,
        "numpy.radians(45)",
    ),
    "degrees beyond the sphere": (lambda: gn.direction(200, 0, degrees=True), DirectionError, "-180 to 180 degrees"),
    "a vector that is no direction": (
        lambda: gn.albedo(matte, [1, 1, 1]),
        DirectionError,
        "has length 1.732",
    ),
    "a view of length 2": (
        lambda: gn.reflected_radiance(matte, gn.ConstantLight(1.0), [0, 0, 2]),
        DirectionError,
        "divide by it: gonio.directions.normalize(w)",
    ),
    "no direction at all": (lambda: gn.albedo(matte, [0, 0, 0]), DirectionError, "length 0 has no direction"),
    "a cone in degrees": (lambda: gn.Cone([0, 0, 1], 30), ParameterError, "(0, pi/2] [rad]"),
    "a rotation in degrees": (lambda: gn.Rotated(matte, 90), ParameterError, "in degrees? numpy.radians(90) = 1.571"),
    "a slope in degrees": (lambda: gn.OrenNayar(0.5, 30), ParameterError, "in degrees? numpy.radians(30) = 0.5236"),
    "an albedo in percent": (lambda: gn.Lambertian(50), ParameterError, "in percent? 50 % is 0.5"),
    "albedos in percent": (lambda: gn.Lambertian([50, 20, 30]), ParameterError, "in percent? 50 % is 0.5"),
    "wavelengths in micrometres": (
        lambda: gn.spectra.refractive_index("gold", 0.5),
        ParameterError,
        "in micrometres? 1000",
    ),
    "a metal's wavelengths in micrometres": (
        lambda: gn.material("gold", wavelengths=[0.45, 0.55]),
        ParameterError,
        "in micrometres?",
    ),
    "a map with NaN": (
        lambda: gn.Lambertian(np.array([[0.5], [np.nan]])),
        ParameterError,
        "for missing places of a map numpy.ma.masked_invalid(map)",
    ),
    "axes in degrees": (
        lambda: gn.Gridded("angles", {**AXES, "theta_o": [0, 30, 60]}, np.ones((3, 3, 3))),
        ParameterError,
        "convert degrees with numpy.radians",
    ),
    "rows in degrees": (
        lambda: gn.Scattered([0, 30], [0, 0], [10, 20], [0, 0], [0.1, 0.2]),
        ParameterError,
        "theta_i: from 0 to 30, expected 0 to pi/2 rad",
    ),
    "rows with azimuths in degrees": (
        lambda: gn.Scattered([0, 0.3], [0, 0], [0.1, 0.2], [0, 180], [0.1, 0.2]),
        ParameterError,
        "phi_o: up to 180, expected at most two turns",
    ),
    "a sky's share in percent": (
        lambda: gn.remote_sensing.blue_sky_albedo(matte, 0.3, 20),
        ParameterError,
        "expected the sky's share of light, in [0, 1]",
    ),
}

SUSPECTED = {
    "azimuths in degrees": (lambda: gn.direction(0.3, [0, 90, 180]), DirectionWarning, "whole numbers up to 180"),
    "light from below": (lambda: gn.albedo(matte, -UP), DirectionWarning, "all directions are below the horizon"),
    "percent in a table": (
        lambda: gn.Gridded("angles", AXES, np.full((3, 3, 3), 50.0), quantity="reflectance factor"),
        MeaningWarning,
        "reflectance factors of 50 (median); in percent?",
    ),
    "a table's wavelengths in micrometres": (
        lambda: gn.Gridded("angles", AXES, np.ones((3, 3, 3, 2)), channels=[0.55, 0.65]),
        MeaningWarning,
        "up to 0.65 nm; in micrometres?",
    ),
    "a roughness for each direction": (
        lambda: gn.Microfacet(gn.GGX(np.full(1000, 0.2))).f(np.broadcast_to(UP, (1000, 3)), UP),
        MeaningWarning,
        "is parameter[:, None]",
    ),
}


@pytest.mark.parametrize("mistake", REFUSED)
def test_a_mistake_is_refused(mistake):
    call, kind, words = REFUSED[mistake]
    with pytest.raises(kind) as error:
        call()
    assert words in str(error.value)


@pytest.mark.parametrize("mistake", SUSPECTED)
def test_a_suspicion_is_said_at_the_line_that_was_typed(mistake):
    call, kind, words = SUSPECTED[mistake]
    with pytest.warns(kind) as warnings:
        call()
    assert len(warnings) == 1 and words in str(warnings[0].message)
    assert warnings[0].filename == __file__


MASK = [False, True, False]
THETA = np.ma.array([0.1, 0.2, 0.3], mask=MASK)
W = np.ma.array(gn.direction(THETA.data, 0.0), mask=np.repeat(np.array(MASK)[:, None], 3, axis=1))
RHO = np.ma.array([[0.1], [0.2], [0.3]], mask=np.array(MASK)[:, None])
MASKED = {
    "directions": lambda: matte.f(W, UP),
    "polar angles": lambda: gn.direction(THETA, 0.0)[:, 0],
    "f_angles": lambda: matte.f_angles(THETA, 0.0, 0.3, 0.0),
    "a map": lambda: gn.Lambertian(RHO).f(UP, UP)[:, 0],
    "an integral of a map": lambda: gn.albedo(gn.Lambertian(RHO), UP)[:, 0],
    "an integral of directions": lambda: gn.albedo(matte, W),
    "suns": lambda: gn.remote_sensing.black_sky_albedo(matte, THETA),
    "skies": lambda: gn.remote_sensing.blue_sky_albedo(matte, 0.3, THETA),
    "wavelengths": lambda: gn.spectra.refractive_index("gold", 5000.0 * np.ma.array([0.1, 0.2, 0.11], mask=MASK))[0],
    "normals": lambda: gn.reflected_radiance(matte, gn.DistantLight(UP, 1.0), UP, normal=W),
}


@pytest.mark.parametrize("what", MASKED)
def test_what_is_masked_stays_missing(what):
    assert np.isnan(MASKED[what]()).tolist() == MASK


def test_azimuths_and_polar_angles_of_any_sign_are_taken():
    turned = gn.direction([-0.3, 0.3], [0.0, np.pi])
    np.testing.assert_allclose(turned[0], turned[1], atol=1e-15)
    np.testing.assert_allclose(
        gn.direction(-30, 450, degrees=True), gn.direction(np.radians(30), np.radians(270)), atol=1e-15
    )


def test_typed_digits_are_taken_for_a_unit_vector():
    w = np.array([0.577, 0.577, 0.577])
    glossy = gn.Microfacet(gn.GGX(0.3))
    assert abs(gn.albedo(glossy, w) - gn.albedo(glossy, gn.directions.normalize(w))) < 1e-9
