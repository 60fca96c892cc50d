"""Pictures of polarized light: their radiance is that of `render`; polarizers beside Fresnel's formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.errors import ParameterError

PI = math.pi
SUN = gn.DistantLight([0.3, -1.0, 0.5], 2.0)
STUDIO = gn.EnvironmentLight.studio(height=32)
MATERIALS = {
    "metal": gn.Microfacet(gn.GGX(0.2), gn.Conductor([1.2, 0.2, 0.3], [6.0, 3.0, 2.0])),
    "varnish": gn.Coated(gn.Lambertian([0.6, 0.1, 0.05])),
    "glass over gray": gn.Lambertian(0.2) + gn.IdealSpecular(gn.Dielectric(1.5)),
    "weighted": np.array([0.2, 0.5, 0.9]) * gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5)) + gn.Lambertian(0.1),
    "wavelengths": gn.material("gold", wavelengths=[450, 550, 650]),
    "ground glass": gn.RoughDielectric(gn.GGX(0.2), 1.5),
    "water": gn.SmoothDielectric(1.33),
    "bottle": gn.ThinDielectric(1.5, [0.6, 0.2, 0.5]),
    "frosted pane": 0.5 * gn.ThinDielectric(1.5) + gn.DiffuseTransmission([0.1, 0.2, 0.3]),
    "two sides": gn.TwoSided(gn.Coated(gn.Lambertian(0.5)), gn.Lambertian(0.3)),
}
BEHIND = gn.DistantLight([0.3, 0.8, 0.4], 2.0)


def lit():
    """Every material under every light; in the studio, which takes ten times as long, few are not `full`."""
    for name, m in MATERIALS.items():
        for place, lights in {"sun": SUN, "sun behind": BEHIND, "studio": STUDIO}.items():
            few = place != "studio" or name in ("metal", "ground glass")
            yield pytest.param(m, lights, id=f"{place}-{name}", marks=() if few else pytest.mark.full)


# Both leave out what goes through a second surface, and say so.
@pytest.mark.filterwarnings("ignore:.*light goes through one surface of:gonio.errors.LeftOutWarning")
@pytest.mark.parametrize(("m", "lights"), [*lit()])
def test_the_radiance_is_that_of_render(m, lights):
    """Of several lobes under a light with extent, which are sampled together there and one by one here, in the mean."""
    same = lights is not STUDIO or (m.sides == "front" and m is not MATERIALS["weighted"])
    samples = 8 if same else 1024
    plain = gn.render(m, lights, size=24, samples=samples)
    picture = gn.scenes.render_stokes(m, lights, size=24, samples=samples)
    if same:
        np.testing.assert_allclose(picture.radiance.pixels, plain.pixels, atol=1e-5 * plain.pixels.max())
    elif m.sides == "front":
        ours, theirs = (x.pixels[4:20, 4:20].reshape(4, 4, 4, 4, 3).mean((1, 3)) for x in (picture.radiance, plain))
        np.testing.assert_allclose(ours, theirs, rtol=1e-2)
    else:  # few samples of what is drawn whole meet the sun: the mean's standard error is 0.4 %
        np.testing.assert_allclose(picture.radiance.pixels.mean(), plain.pixels.mean(), rtol=2e-2)
    np.testing.assert_array_equal(picture.alpha, plain.alpha)
    few = gn.scenes.render_stokes(m, lights, size=24, samples=8)
    filtered = [
        gn.scenes.render_stokes(m, lights, size=24, samples=8, polarizer=psi).pixels for psi in (0.3, 0.3 + PI / 2)
    ]
    np.testing.assert_allclose(sum(filtered), few.pixels, atol=1e-6 * plain.pixels.max())
    assert (picture.dop().pixels <= 1.0).all()


def test_two_analysers_share_the_light():
    picture = gn.scenes.render_stokes(MATERIALS["varnish"], STUDIO, size=24, samples=8)
    both = picture.through(0.4).pixels + picture.through(0.4 + PI / 2).pixels
    np.testing.assert_allclose(both, picture.radiance.pixels, rtol=1e-4, atol=1e-6)


def lit(m: gn.Reflectance, **others: float) -> np.ndarray:
    """Stokes vectors of a flat-looking sphere's pixels under light from the camera."""
    return gn.scenes.render_stokes(m, gn.DistantLight([0.0, -1.0, 0.0], 1.0), size=33, samples=4, **others).pixels


def test_light_from_the_camera_comes_back_from_mirrors_as_it_was():
    """A rough mirror seen along the light mirrors at normal incidence: the polarizer's own axis lets all of it through,
    the crossed one none; of what is matt both take half."""
    rough = gn.Microfacet(gn.GGX(0.4), gn.Conductor(1.2, 6.0))
    for psi in (0.0, 0.6):
        S = lit(rough, polarizer=psi)
        bright = S[..., 0] > 0.01
        # Light comes back in a mirrored frame: what was psi from the right is so from the left for who looks into it.
        for turn, share in ((-psi, 1.0), (-psi + PI / 2, 0.0)):
            seen = S @ gn.polarization.analyser(turn).astype("f4")
            np.testing.assert_allclose(seen[bright], share * S[bright][:, 0], atol=1e-4)
    matt = lit(gn.Lambertian(0.5), polarizer=0.3)
    assert not matt[..., 1:].any()


def test_a_polarizer_halves_the_light():
    plain, filtered = (lit(gn.Lambertian(0.5), **how) for how in ({}, {"polarizer": 0.3}))
    np.testing.assert_allclose(filtered[..., 0], 0.5 * plain[..., 0], rtol=1e-5)


def test_the_sun_in_a_glass_ball_at_brewsters_angle_is_horizontal():
    """Light that turns by 180 degrees less twice Brewster's angle, in the plane of the picture's horizon: its mirror
    image is vertical, and behind a horizontal analyser it is gone."""
    away = PI - 2.0 * math.atan(1.5)
    sun = gn.DistantLight([math.sin(PI - away), -math.cos(PI - away), 0.0], 1.0)
    smooth = gn.Microfacet(gn.GGX(0.02), gn.Dielectric(1.5))
    picture = gn.scenes.render_stokes(smooth, sun, size=129, samples=4)
    i = np.unravel_index(picture.pixels[..., 0, 0].argmax(), picture.alpha.shape)
    total, Q, U, _ = picture.pixels[i][0]
    assert Q / total < -0.999 and abs(U / total) < 0.03
    assert picture.through(0.0).pixels[i][0] < 1e-3 * total
    assert picture.dop().pixels[i][0] == pytest.approx(1.0, abs=1e-3)


def test_what_goes_straight_through_keeps_its_polarization():
    """A filter before a polarized sky: all light passes the same polarizer, and none the crossed one."""
    picture = gn.scenes.render_stokes(gn.Absorber(0.3), gn.ConstantLight(1.0), size=24, samples=4, polarizer=0.4)
    inside = picture.alpha > 0.0
    np.testing.assert_allclose(picture.through(0.4).pixels, picture.radiance.pixels, atol=1e-6)
    assert picture.through(0.4 + PI / 2).pixels.max() < 1e-6 < picture.radiance.pixels[inside].min()


@pytest.mark.slow_because("a pixel at 70 degrees wants a picture of many")
@pytest.mark.parametrize("size", thinned([65, 257], [65]))
def test_an_even_sky_through_a_pane(size):
    """R + T = 1 for s and for p: a clear pane leaves an even sky as it was. A black one mirrors R_s and R_p alone."""
    sky = gn.ConstantLight(1.0)
    S = gn.scenes.render_stokes(gn.ThinDielectric(1.5), sky, size=size, samples=64).pixels[size // 2, :, 0]
    x = (np.arange(size) + 0.5) * (2.12 / size) - 1.06
    at = np.argmin(np.abs(x - math.sin(math.radians(70.0))))
    assert S[at, 0] == pytest.approx(1.0, abs=1e-4)
    np.testing.assert_allclose(S[at, 1:], 0.0, atol=2e-2)
    sides = gn.scenes.render_stokes(gn.ThinDielectric(1.5, 50.0), sky, size=size, samples=64).pixels[size // 2, at, 0]
    mirrored = gn.ThinDielectric(1.5, 50.0).delta_mueller(gn.direction(math.asin(x[at]), 0.0))
    assert sides[0] == pytest.approx(mirrored[0, 0], rel=0.03)
    assert sides[1] == pytest.approx(-mirrored[0, 1], rel=0.03)  # horizontal of the surface is vertical in the picture


def test_bad_angles_are_refused():
    with pytest.raises(ParameterError, match="polarizer"):
        gn.scenes.render_stokes(gn.Lambertian(0.5), SUN, size=8, samples=1, polarizer=math.nan)
