"""Derivatives of pictures against what is linear, against differences, and refusals."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.errors import NotFoundError, ParameterError

STUDIO = gn.EnvironmentLight.studio(height=32)
SMALL = {"size": 24, "samples": 64}


def test_by_what_is_linear():
    """The picture is in proportion to an albedo, to a weight and to the lights' scale."""
    m = 0.5 * gn.Lambertian([0.2, 0.4, 0.8])
    sun = gn.DistantLight([0.3, -1.0, 0.5], 2.0)
    by = ["rho", "weight", "lights.0.scale", "lights.1.irradiance"]
    picture, slopes = gn.scenes.picture_jacobian(m, [STUDIO, sun], by=by, **SMALL)
    whole = gn.render(m, [STUDIO, sun], **SMALL)
    np.testing.assert_allclose(picture.pixels, whole.pixels, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(slopes["rho"].pixels, picture.pixels / np.float32([0.2, 0.4, 0.8]), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(slopes["weight"].pixels, 2.0 * picture.pixels, rtol=1e-4, atol=1e-6)
    lit = slopes["lights.0.scale"].pixels + 2.0 * slopes["lights.1.irradiance"].pixels
    np.testing.assert_allclose(lit, picture.pixels, rtol=1e-4, atol=1e-5)


LIGHTS = {
    "sun": gn.DistantLight([0.3, -1.0, 0.5], [3.0, 2.0, 1.0]),
    "sky": gn.ConstantLight([1.0, 0.5, 0.2]),
    "gray sky": gn.ConstantLight(1.0),
}


@pytest.mark.parametrize(
    ("under", "samples"), thinned([("sun", 512), *product(LIGHTS, [4096])], [("sun", 512), ("sky", 4096)])
)
def test_by_roughness_and_index(under, samples):
    """Against differences of pictures of many samples, in the mean over the shape."""
    m = gn.Microfacet(gn.GGX(0.4), gn.Dielectric(1.5)) + gn.Lambertian(0.2)
    more = {"size": 24, "samples": samples}
    light = LIGHTS[under]
    _, slopes = gn.scenes.picture_jacobian(m, light, by=["alpha", "eta"], **more)
    for name, h in (("alpha", 0.02), ("eta", 0.05)):
        value = {"alpha": 0.4, "eta": 1.5}[name]
        high, low = (gn.render(m.replace({name: value + s * h}), light, **more) for s in (1, -1))
        inside = high.alpha == 1.0
        found, wanted = slopes[name].pixels[inside], (high.pixels - low.pixels)[inside] / (2 * h)
        assert abs(found.mean() - wanted.mean()) < 0.01 * np.abs(wanted).mean()


def test_by_the_brightness_of_a_sun():
    """What a delta light alone makes is in proportion to it."""
    picture, slopes = gn.scenes.picture_jacobian(
        gn.Lambertian(1.0), gn.DistantLight([0.0, -1.0, 0.0], np.pi), by="lights.0.irradiance", size=24, samples=64
    )
    np.testing.assert_allclose(slopes["lights.0.irradiance"].pixels * np.pi, picture.pixels, rtol=1e-5)


def test_refusals():
    m = gn.Lambertian(0.5)
    with pytest.raises(NotFoundError, match="roughness"):
        gn.scenes.picture_jacobian(m, STUDIO, by="roughness", **SMALL)
    with pytest.raises(ParameterError, match="RectangleLight has edges"):
        lamp = gn.RectangleLight([0.0, 0.0, 3.0])
        gn.scenes.picture_jacobian(m, lamp, by="lights.0.centre.x", **SMALL)
    with pytest.raises(ParameterError, match="FunctionLight is a function"):
        gn.scenes.picture_jacobian(m, gn.FunctionLight(lambda w: w[..., 0]), by="rho", **SMALL)
