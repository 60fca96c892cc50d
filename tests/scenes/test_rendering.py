"""Pictures: closed forms of the lit sphere, the same picture by Mitsuba, and what does not depend on chance."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.arrays import ops
from gonio.errors import MissingDataWarning, ParameterError
from gonio.formula import tree
from gonio.laws import _probes
from gonio.numerics.lattice import lattice
from gonio.pictures.colour import LUMINANCE, RGB_OF_XYZ, to_rgb
from gonio.scenes.estimator import MARGIN

MATTE = gn.Lambertian([0.2, 0.5, 0.8])


def centre(picture, half=3):
    n = picture.pixels.shape[0] // 2
    return picture.pixels[n - half : n + half, n - half : n + half].mean(axis=(0, 1))


def test_a_lambertian_sphere_in_a_furnace_has_its_albedo():
    picture = gn.render(MATTE, gn.ConstantLight(2.0), size=32, samples=4)
    inside = picture.alpha == 1.0
    np.testing.assert_allclose(picture.pixels[inside], np.broadcast_to([0.4, 1.0, 1.6], (inside.sum(), 3)), rtol=2e-6)
    assert picture.pixels.shape == (32, 32, 3) and picture.alpha.max() == 1.0 and picture.alpha.min() == 0.0
    # The disc has radius 16/1.06 pixels.
    np.testing.assert_allclose(picture.alpha.sum(), np.pi * (16 / MARGIN) ** 2, rtol=5e-3)


def test_bands_are_chosen_by_name_or_wavelength():
    m = gn.Lambertian([0.1, 0.2, 0.3, 0.4])
    named, spectral = m.with_channels(["blue", "green", "red", "nir"]), m.with_channels([469, 555, 645, 858.5])

    def pixel(material, light=1.0, **options):
        return centre(gn.render(material, gn.ConstantLight(light), size=8, samples=4, **options), 1)

    np.testing.assert_allclose(pixel(named), [0.3, 0.2, 0.1], rtol=1e-5)
    for chosen, bands in ((named, ("nir", "red", "green")), (spectral, (860, 645, 550.0)), (m, (3, 2, 1))):
        np.testing.assert_allclose(pixel(chosen, channels=bands), [0.4, 0.3, 0.2], rtol=1e-5)
    np.testing.assert_allclose(pixel(named, [1.0, 2.0, 3.0, 4.0]), [0.9, 0.4, 0.1], rtol=1e-5)
    np.testing.assert_allclose(pixel(named, channels=["nir"]), [0.4], rtol=1e-5)
    for bands, wrong in ((("nir", "red"), "expected three"), ("nir", "expected three"), ((0, 1, 2), "no such channel")):
        with pytest.raises(gn.Error, match=wrong):
            pixel(named, channels=bands)


def test_a_distant_light_falls_as_the_cosine():
    light = gn.DistantLight([0.0, -1.0, 0.0], np.pi)  # from the camera
    picture = gn.render(gn.Lambertian(1.0), light, size=64, samples=16)
    y, x = np.mgrid[0:64, 0:64] + 0.5
    r2 = ((x - 32) ** 2 + (y - 32) ** 2) * (2 * MARGIN / 64) ** 2
    inside = r2 < 0.8
    np.testing.assert_allclose(picture.pixels[inside, 0], np.sqrt(1.0 - r2[inside]), atol=1.2e-2)


def test_light_from_the_upper_right_makes_the_upper_right_bright():
    picture = gn.render(gn.Lambertian(1.0), gn.DistantLight([1.0, -0.2, 0.7], 1.0), size=32, samples=4)
    pixels = picture.pixels[..., 0] * picture.alpha
    bright = np.argwhere(pixels == pixels.max())[0]
    assert bright[0] < 14 and bright[1] > 18  # row 0 is at the top


def test_a_mirror_sphere_shows_what_lies_behind_the_camera_in_its_centre():
    def sky(w):
        return np.where(w[..., 1] < -0.9, 3.0, 0.1)

    picture = gn.render(gn.IdealSpecular(0.5), gn.FunctionLight(sky), size=32, samples=4)
    np.testing.assert_allclose(centre(picture, 1), 1.5, rtol=1e-6)
    row, column = 16, 27  # towards the right edge, where the mirror direction points away from the camera
    np.testing.assert_allclose(picture.pixels[row, column], 0.05, rtol=1e-6)


def test_brushing_runs_round_the_axis():
    """Rough along y (up), smooth along x: a highlight is drawn out up and down."""
    light = gn.DistantLight([0.0, -1.0, 0.0], 1.0)
    picture = gn.render(gn.Microfacet(gn.GGX(0.05, 0.4)), light, size=64, samples=16).pixels[..., 0]
    assert picture[20, 32] > 20 * picture[32, 20]


def test_the_same_seed_gives_the_same_picture_on_any_number_of_threads():
    light = gn.EnvironmentLight.studio(height=32)
    m = MATTE + gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
    first = gn.render(m, light, size=40, samples=32, seed=3).pixels
    before = gn.engine.threads()
    try:
        for count in (1, 5):
            gn.engine.threads(count)
            np.testing.assert_array_equal(gn.render(m, light, size=40, samples=32, seed=3).pixels, first)
    finally:
        gn.engine.threads(before)
    assert not np.array_equal(gn.render(m, light, size=40, samples=32, seed=4).pixels, first)


def test_noise_falls_with_the_number_of_samples():
    """Block means of different seeds: what is correlated within a pixel would not fall."""
    light = gn.EnvironmentLight.studio(height=64)
    m = gn.Microfacet(gn.GGX(0.1))

    def spread(samples):
        pictures = [gn.render(m, light, size=16, samples=samples, seed=s).pixels.mean(axis=-1) for s in range(6)]
        return np.std(pictures, axis=0).mean() / np.mean(pictures)

    assert spread(1024) < 0.35 * spread(16)


def test_progress_is_told_to_the_end():
    calls = []
    gn.render(MATTE, gn.ConstantLight(1.0), size=64, samples=16, progress=lambda *at: calls.append(at))
    done, total = calls[-1]
    assert done == total == len(calls) > 1


def test_spectra_become_colours():
    wavelengths = np.arange(400.0, 701.0, 20.0)
    grey = gn.material("gold", wavelengths=wavelengths, alpha=0)
    np.testing.assert_allclose(to_rgb(wavelengths).sum(axis=0), 1.0, rtol=1e-12)
    expected = grey.delta_reflectance(np.array([0.0, 0.0, 1.0])) @ to_rgb(wavelengths)
    flat = gn.render(grey, gn.ConstantLight(1.0), size=16, samples=4)
    assert flat.pixels.shape == (16, 16, 3)
    np.testing.assert_allclose(centre(flat, 1), expected, rtol=2e-3)
    lit = gn.render(grey, gn.ConstantLight(np.ones(len(wavelengths))), size=16, samples=4)
    np.testing.assert_allclose(lit.pixels, flat.pixels, rtol=1e-5)
    r, g, b = expected
    assert r > g > b


def test_tristimulus_values_become_colours():
    """A table of X, Y, Z looks as the same one in linear sRGB."""
    axes = {"theta_i": [0.0, 1.5], "theta_o": [0.0, 1.5], "phi": [0.0]}
    rgb = np.broadcast_to([0.25, 0.1, 0.05], (2, 2, 1, 3))
    a, b = (
        gn.render(gn.Gridded("angles", axes, values, channels=names), gn.ConstantLight(1.0), size=16, samples=4).pixels
        for values, names in ((rgb, "RGB"), (rgb @ np.linalg.inv(RGB_OF_XYZ).T, "XYZ"))
    )
    np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-6)
    assert a[8, 8, 0] > 2.0 * a[8, 8, 1]


class _Holed(gn.Reflectance):
    """NaN for half of the light, as a measurement with a hole has it."""

    def formula(self, wi, wo):
        return ops.where(wi.x > 0.0, float("nan"), 1.0 / np.pi + 0.0 * wi.x)


def test_directions_without_data_are_black_and_are_counted():
    with pytest.warns(MissingDataWarning, match=r"[0-9]+ samples met directions without measured data"):
        picture = gn.render(_Holed(), gn.ConstantLight(1.0), size=16, samples=64)
    np.testing.assert_allclose(centre(picture), 0.5, atol=0.05)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"shape": "cube"}, "expected one of 'cylinder', 'disk', 'plane', 'sphere'"),
        ({"size": 0}, "size=0\\): expected a whole number from 1"),
        ({"size": 2.5}, "size=2.5"),
        ({"samples": -1}, "samples=-1"),
        ({"seed": -1}, "seed=-1"),
        ({"lights": []}, "non-empty list of lights"),
        ({"lights": "sun"}, "expected a light"),
        ({"lights": gn.ConstantLight([1.0, 1.0])}, "2 channels and the material has 3"),
    ],
)
def test_bad_arguments(arguments, text):
    with pytest.raises(ParameterError, match=text):
        gn.render(**{"m": MATTE, "lights": gn.ConstantLight(1.0), **arguments})


def test_nobody_needs_to_ask_for_a_light():
    """The studio; for channels that are no colours its luminance, under which any number of them can stand."""
    small = {"size": 16, "samples": 4}
    studio = gn.EnvironmentLight.studio()
    for m in (MATTE, gn.Lambertian(0.5), tree.with_notes(gn.Lambertian([0.2, 0.3]), channel_names=(500.0, 600.0))):
        assert (gn.render(m, **small).pixels == gn.render(m, studio, **small).pixels).all()
    bands = np.array([0.1, 0.2, 0.4, 0.8])
    picture = gn.render(tree.with_notes(gn.Lambertian(bands), channel_names=("Band1", "Band2", "nir", "vis")), **small)
    assert picture.channels == ("Band1", "Band2", "nir", "vis")
    np.testing.assert_allclose(picture.pixels, picture.pixels[..., 3:] * bands / 0.8, rtol=2e-5)
    three = gn.render(tree.with_notes(gn.Lambertian(bands[:3]), channel_names=("Band1", "Band2", "nir")), **small)
    np.testing.assert_allclose(three.pixels, picture.pixels[..., :3], rtol=2e-5)
    gray = gn.render(gn.Lambertian(1.0), size=16, samples=64).pixels @ LUMINANCE
    many = gn.render(gn.Lambertian(np.ones(4)), size=16, samples=64).pixels
    np.testing.assert_allclose(many.mean(axis=(0, 1)), gray.mean(), rtol=0.05)  # noise


def test_lattices_fill_every_dimension():
    """In 4 dimensions each of 4^4 cells gets its share; two 2-dimensional ones side by side would miss most."""
    points = lattice(1 << 14, 4)
    cells = np.bincount((points * 4).astype(int) @ np.array([1, 4, 16, 64]), minlength=256)
    assert cells.min() > 48 and cells.max() < 80
    wi, wo = _probes.pairs()
    cells = np.histogramdd(np.concatenate([wi[:, :2], wo[:, :2]], axis=-1), bins=4, range=[(-0.7, 0.7)] * 4)[0]
    assert (cells > 0).mean() > 0.95


@pytest.mark.parametrize(
    ("m", "name"),
    [(MATTE, "a.png"), pytest.param(gn.IdealSpecular(0.5), "b.svg", marks=pytest.mark.full)],
    ids=["png", "svg"],
)
def test_figures(tmp_path, m, name):
    gn.figures.overview(m, gn.ConstantLight(1.0), tmp_path / name, size=16, samples=1)
    assert (tmp_path / name).stat().st_size > 10_000
    with pytest.raises(ParameterError, match=r"\.png, \.jpg, \.pdf, \.svg"):
        gn.figures.overview(MATTE, gn.ConstantLight(1.0), tmp_path / "a.gif")


@pytest.fixture(scope="module")
def mi():
    mitsuba = pytest.importorskip("mitsuba")
    before = mitsuba.variant()
    mitsuba.set_variant("scalar_rgb")
    yield mitsuba
    if before is not None:
        mitsuba.set_variant(before)


CONDUCTOR = {"type": "roughconductor", "distribution": "ggx", "material": "none", "specular_reflectance": 1.0}


@pytest.mark.parametrize(
    ("m", "bsdf"),
    [
        (gn.Lambertian(0.5), {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}),
        (gn.Microfacet(gn.GGX(0.15, 0.5), 1.0, "separable"), {**CONDUCTOR, "alpha_u": 0.15, "alpha_v": 0.5}),
    ],
    ids=["Lambertian", "GGX"],
)
def test_mitsuba_shows_the_same(mi, m, bsdf):
    """Means over quarters of the disc's inner square under an environment map without symmetry."""
    size, light = 16, gn.EnvironmentLight.studio(height=32)
    t = mi.ScalarTransform4f
    camera = t().look_at(origin=[0, -4, 0], target=[0, 0, 0], up=[0, 0, 1])
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "sensor": {
                "type": "orthographic",
                "to_world": camera @ t().scale([MARGIN, MARGIN, 1.0]),
                "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent", "sample_count": 2048},
            },
            "sphere": {"type": "sphere", "bsdf": bsdf},
            "light": {
                "type": "envmap",
                "bitmap": mi.Bitmap(np.ascontiguousarray(light.to_mitsuba().pixels, dtype=np.float32)),
                "to_world": t(light.MITSUBA_TO_WORLD.tolist()),
            },
        }
    )
    theirs = np.array(mi.render(scene))[..., :3]
    ours = gn.render(m, light, size=size, samples=2048).pixels
    theirs, ours = (x[3:13, 3:13].reshape(2, 5, 2, 5, 3).mean(axis=(1, 3)) for x in (theirs, ours))
    np.testing.assert_allclose(ours, theirs, rtol=1e-2)


def test_lobes_without_channels_are_turned_into_rgb_with_those_that_have_some():
    gold, coat = gn.material("gold", wavelengths=[450.0, 550.0, 650.0]), gn.Microfacet(gn.GGX(0.3), 0.9)
    alike = gn.Microfacet(gn.GGX(0.3), [0.9, 0.9, 0.9])
    pictures = [gn.render(gold + lobe, gn.ConstantLight(1.0), size=8, samples=4).pixels for lobe in (coat, alike)]
    np.testing.assert_allclose(*pictures, rtol=1e-5)


@pytest.mark.parametrize("sky", [gn.CIESky(12, sun=[-0.6, -0.6, 0.2]), gn.PreethamSky(sun=[-0.6, -0.6, 0.6])])
@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_pictures_under_skies_are_integrals(sky, angle):
    """A metal plate that looks at the horizon: half of what it mirrors is dark."""
    metal, lit = gn.Microfacet(gn.GGX(0.4)), gn.TurnedLight(sky, angle) if angle else sky
    picture = gn.render(metal, lit, shape="plane", size=64, samples=64)
    seen = picture.pixels[picture.alpha == 1.0].mean(axis=0)
    front = np.array([0.0, -1.0, 0.0])
    np.testing.assert_allclose(seen, gn.reflected_radiance(metal, lit, front, normal=front), rtol=2e-3)


@pytest.mark.parametrize("light", [gn.PointLight([0.3, 0.2, 0.0], 1.0), gn.SphereLight([0.0, 0.0, 0.0], 0.5)])
@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_lights_in_a_shape_are_refused(light, shape):
    with pytest.raises(ParameterError, match=f"is in the {shape}, out of which no light gets"):
        gn.render(gn.Lambertian(0.5), [light, gn.ConstantLight(1.0)], shape=shape, size=8)
    outside = gn.PointLight([0.0, -0.72, 0.0], 1.0) if shape == "cylinder" else gn.PointLight([0.0, -1.01, 0.0], 1.0)
    assert gn.render(gn.Lambertian(0.5), outside, shape=shape, size=8).pixels.any()
