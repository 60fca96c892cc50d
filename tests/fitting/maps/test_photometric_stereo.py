"""`gn.reconstruction.photometric_stereo` and `gn.reconstruction.texel_data`: images under known lights give normals,
albedos, and any model."""

from __future__ import annotations

import numpy as np
import pytest
from png_files import gamma, png

import gonio as gn
from gonio.fitting.maps.photometric_stereo import ABOVE_ONE, TOO_FEW, UNDETERMINED

SIZE = 24
WO = np.array([0.0, -1.0, 0.0])
X, Z = np.meshgrid(np.linspace(-0.95, 0.95, SIZE), np.linspace(0.95, -0.95, SIZE))
SPHERE = X * X + Z * Z < 0.95
NORMAL = np.where(SPHERE[..., None], np.stack([X, -np.sqrt(np.maximum(1.0 - X * X - Z * Z, 0.0)), Z], axis=-1), WO)
RHO = np.random.default_rng(0).uniform(0.1, 0.9, (SIZE, SIZE, 1))
RGB = RHO * np.array([1.0, 0.5, 0.1])


def directions(count):
    """Within 52 degrees of the camera."""
    k = np.arange(count)
    return gn.directions.to_world(gn.direction(np.arccos(1.0 - 0.38 * (k + 0.5) / count), 2.4 * k), normal=WO)


def far(count):
    return [gn.DistantLight(w, 2.0 + 0.3 * k) for k, w in enumerate(directions(count))]


def near(count):
    return [gn.PointLight(2.5 * w, 15.0 + k) for k, w in enumerate(directions(count))]


def pictures(m, lights):
    """(K, H, W, C) of the sphere."""
    return np.stack([gn.reflected_radiance(m, light, WO, normal=NORMAL, position=NORMAL) for light in lights])


def angle(a, b):
    return 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(a - b, axis=-1), 0.0, 1.0))


@pytest.mark.parametrize(("lights", "position"), [(far(8), None), (near(8), NORMAL), (far(4) + near(4), NORMAL)])
@pytest.mark.parametrize("rho", [RHO, RGB])
def test_a_lambertian_sphere_is_recovered(lights, position, rho):
    images = pictures(gn.Lambertian(rho), lights)
    assert (images == 0.0).any(axis=0)[SPHERE].any()  # attached shadows
    gray = rho.shape[-1] == 1
    found = gn.reconstruction.photometric_stereo(
        images[..., 0] if gray else images, lights, position=position, mask=SPHERE
    )
    lit = np.where(SPHERE, (images.max(axis=-1) > 0.0).sum(axis=0), 0)
    assert (found.used == lit).all() and (lit < 3).sum() <= (~SPHERE).sum() + 1
    assert (found.flags == np.where(lit < 3, TOO_FEW, 0)).all() and np.isnan(found.normal[lit < 3]).all()
    assert angle(found.normal, NORMAL)[lit >= 3].max() < 1e-7
    assert np.allclose(found.albedo[lit >= 3], (rho[..., 0] if gray else rho)[lit >= 3], rtol=1e-8)
    assert found.rms[lit >= 3].max() < 1e-6 and found.albedo.shape == rho.shape[: 2 + (not gray)]


def test_a_near_lamp_taken_for_a_far_one_is_not():
    images = pictures(gn.Lambertian(RHO), near(8))[..., 0]
    lights = [gn.DistantLight(x.position, x.intensity / 2.5**2) for x in near(8)]
    found = gn.reconstruction.photometric_stereo(images, lights, mask=SPHERE)
    assert np.degrees(np.nanmedian(angle(found.normal, NORMAL))) > 3.0


def test_lamps_of_different_colours():
    lights = [gn.DistantLight(w, [1.0 + k % 3, 2.0, 3.0 - k % 2]) for k, w in enumerate(directions(8))]
    found = gn.reconstruction.photometric_stereo(pictures(gn.Lambertian(RGB), lights), lights, mask=SPHERE)
    assert angle(found.normal, NORMAL)[SPHERE].max() < 1e-7
    assert np.allclose(found.albedo[SPHERE], RGB[SPHERE], rtol=1e-7)


def scene(count, channels=1, texels=4000, noise=0.01, seed=1):
    """Texels that face all lights, with noise: (K, N, C), lights, normals and albedos."""
    random = np.random.default_rng(seed)
    lights = [gn.DistantLight(gn.direction(0.6 + 0.1 * (k % 3), 2.39 * k), 3.0) for k in range(count)]
    normal = gn.direction(random.uniform(0.0, 0.6, texels), random.uniform(0.0, 6.0, texels))
    rho = random.uniform(0.3, 0.9, (texels, 1)) * np.linspace(1.0, 0.4, channels)
    up = [0.0, 0.0, 1.0]
    images = np.stack([gn.reflected_radiance(gn.Lambertian(rho), light, up, normal=normal) for light in lights])
    return images + noise * random.standard_normal(images.shape), lights, normal, rho


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("known", [True, False])
def test_standard_errors_are_those_that_noise_shows(channels, known):
    images, lights, normal, rho = scene(9, channels)
    found = gn.reconstruction.photometric_stereo(images, lights, u=0.01 if known else None, coloured=True)
    z2 = (angle(found.normal, normal) / found.normal_stderr) ** 2
    z = (found.albedo - rho) / found.albedo_stderr
    if known:  # 4000 texels: the standard error of both means is 2.5 % at most
        assert np.isclose(z2.mean(), 1.0, atol=0.08) and np.isclose(np.square(z).mean(), 1.0, atol=0.08)
        assert np.isclose(np.square(found.rms).mean(), 1.0 - (2 + channels) / (9 * channels), rtol=0.02)
        assert np.isclose((np.abs(z) < 1.96).mean(), 0.95, atol=0.012)
    else:  # Student's t of 6 or 22 degrees of freedom: its variance is t/(t - 2)
        free = 9 * channels - 2 - channels
        assert np.isclose(np.square(z).mean(), free / (free - 2), rtol=0.15)
        assert np.isclose(z2.mean(), free / (free - 2), rtol=0.15)


def test_the_common_normal_of_channels_is_surer_than_that_of_each():
    images, lights, normal, _ = scene(6, 3)
    joint = angle(gn.reconstruction.photometric_stereo(images, lights, coloured=True).normal, normal)
    mean = angle(gn.reconstruction.photometric_stereo(images.mean(axis=-1), lights, coloured=False).normal, normal)
    single = angle(gn.reconstruction.photometric_stereo(images[..., 0], lights, coloured=False).normal, normal)
    assert np.square(joint).mean() < 0.97 * np.square(mean).mean() < 0.97 * np.square(single).mean()


def test_lights_that_a_texel_faces_away_from_are_left_out():
    lights = far(10)
    exact = pictures(gn.Lambertian(0.5 + 0.0 * RHO), lights)[..., 0]
    images = exact + np.abs(0.02 * np.random.default_rng(0).standard_normal(exact.shape))  # no value is 0
    found = gn.reconstruction.photometric_stereo(images, lights, mask=SPHERE)
    facing = np.array([(NORMAL * w).sum(axis=-1) for w in directions(10)]) > 0.0
    assert np.abs(found.used - facing.sum(axis=0))[SPHERE].mean() < 0.3
    dark = SPHERE & (facing.sum(axis=0) < 10) & (facing.sum(axis=0) > 3)
    lamps = np.stack([w * light.irradiance for w, light in zip(directions(10), lights, strict=True)])
    plain = gn.directions.normalize(
        np.linalg.lstsq(lamps, images.reshape(10, -1), rcond=None)[0].T.reshape(SIZE, SIZE, 3)
    )
    assert angle(found.normal, NORMAL)[dark].mean() < 0.7 * angle(plain, NORMAL)[dark].mean()


def test_saturated_and_shadowed_values_are_left_out():
    lights = far(8)
    exact = pictures(gn.Lambertian(RGB), lights)
    clipped = np.minimum(exact, 0.5)
    found = gn.reconstruction.photometric_stereo(clipped, lights, mask=SPHERE, saturation=0.5)
    enough = SPHERE & (found.used >= 3)
    assert (found.used[enough] < 8).any() and enough.sum() > 0.8 * SPHERE.sum()
    assert angle(found.normal, NORMAL)[enough].max() < 1e-6
    assert angle(gn.reconstruction.photometric_stereo(clipped, lights, mask=SPHERE).normal, NORMAL)[enough].max() > 0.01
    cast = exact.copy()
    cast[2, : SIZE // 2] = 0.003  # some light is left
    found = gn.reconstruction.photometric_stereo(cast, lights, mask=SPHERE, shadow=0.004)
    enough = SPHERE & (found.used >= 3)
    assert angle(found.normal, NORMAL)[enough].max() < 1e-6
    cast[2, : SIZE // 2] = np.nan
    masks = np.isfinite(cast[..., 0]) & SPHERE
    found, masked = (gn.reconstruction.photometric_stereo(cast, lights, mask=m) for m in (SPHERE, masks))
    assert np.array_equal(found.normal, masked.normal, equal_nan=True)
    assert angle(found.normal, NORMAL)[enough].max() < 1e-6


def test_outliers_count_less():
    images, lights, normal, _ = scene(16)
    random = np.random.default_rng(3)
    images = np.where(random.random(images.shape) < 0.1, random.uniform(0.0, 3.0, images.shape), images)[..., 0]
    off = {
        robust: angle(gn.reconstruction.photometric_stereo(images, lights, robust=robust).normal, normal)
        for robust in WORDS
    }
    assert all(off[robust].mean() < 0.35 * off["none"].mean() for robust in WORDS[1:])
    clean, lights, normal, _ = scene(32)
    found = gn.reconstruction.photometric_stereo(clean[..., 0], lights, robust="cauchy")
    z2 = (angle(found.normal, normal) / found.normal_stderr) ** 2
    assert np.isclose(np.median(z2), np.log(2.0), rtol=0.15)  # of a normal error in two dimensions


WORDS = ["none", "huber", "soft_l1", "cauchy"]


def test_laws_of_scale_and_order():
    images, lights, *_ = scene(7, texels=50)
    images = images[..., 0]
    found = gn.reconstruction.photometric_stereo(images, lights)
    brighter = [light.replace({"irradiance": 40.0 * light.irradiance}) for light in lights]
    order = [3, 0, 6, 1, 5, 2, 4]
    scaled = gn.reconstruction.photometric_stereo(40.0 * images, brighter)
    turned = gn.reconstruction.photometric_stereo(images[order], [lights[k] for k in order])
    for other in (scaled, turned):
        for name in ("normal", "albedo", "normal_stderr", "albedo_stderr", "used", "flags"):
            assert np.allclose(getattr(found, name), getattr(other, name), rtol=1e-9), name
    assert np.allclose(scaled.rms, 40.0 * found.rms)
    assert np.allclose(gn.reconstruction.photometric_stereo(0.5 * images, lights).albedo, 0.5 * found.albedo)


def test_blocks_of_texels_change_nothing(monkeypatch):
    images = pictures(gn.Lambertian(RGB), near(6)) + 0.01 * np.random.default_rng(5).standard_normal(())
    whole = gn.reconstruction.photometric_stereo(
        images, near(6), position=NORMAL, robust="huber", u=np.full(images.shape, 0.01)
    )
    monkeypatch.setattr("gonio.fitting.maps.photometric_stereo.AT_ONCE", 37)
    parts = gn.reconstruction.photometric_stereo(images, near(6), position=NORMAL, robust="huber", u=0.01)
    for name in ("normal", "albedo", "normal_stderr", "rms", "used", "flags"):
        assert np.allclose(getattr(whole, name), getattr(parts, name), equal_nan=True), name


def test_texels_without_an_answer_are_flagged():
    images, lights, *_ = scene(4, texels=5)
    images = images[..., 0]
    none = gn.reconstruction.photometric_stereo(images, lights, mask=np.zeros(5, bool))
    assert (none.flags == TOO_FEW).all() and np.isnan(none.normal).all() and not none.used.any()
    in_plane = [gn.DistantLight(gn.direction(t, 0.3)) for t in (0.1, 0.4, 0.7, -0.2)]
    flat = gn.reconstruction.photometric_stereo(images, in_plane)
    assert (flat.flags == UNDETERMINED).all() and np.isnan(flat.albedo).all()
    for w in gn.directions.normalize(np.random.default_rng(0).normal(size=(20, 2, 3)) + np.array([0.0, 0.0, 3.0])):
        lamps = [gn.DistantLight(w[0] + s * (w[1] - w[0])) for s in (0.0, 0.3, 0.7, 1.0)]
        assert (gn.reconstruction.photometric_stereo(images, lamps).flags == UNDETERMINED).all()
    assert "5 texels: the lights do not determine" in str(flat)
    primary = [gn.DistantLight(w, c) for w, c in zip(directions(3), np.eye(3), strict=True)]  # three numbers, not five
    assert (
        gn.reconstruction.photometric_stereo(np.eye(3)[:, None], primary, coloured=True).flags == UNDETERMINED
    ).all()
    bright = gn.reconstruction.photometric_stereo(10.0 * images, lights)
    assert (bright.flags == ABOVE_ONE).all() and (bright.albedo > 1.0).all()
    three = gn.reconstruction.photometric_stereo(images[:3], lights[:3])
    assert np.isinf(three.normal_stderr).all() and np.isfinite(three.normal).all()  # nothing is to spare
    assert np.isfinite(gn.reconstruction.photometric_stereo(images[:3], lights[:3], u=0.01).normal_stderr).all()


def test_pictures_have_masks_and_channels():
    lights = far(6)
    arrays = pictures(gn.Lambertian(RGB), lights)
    images = [gn.scenes.Image(x, SPHERE.astype(float)) for x in arrays]
    found = gn.reconstruction.photometric_stereo(images, lights)
    assert angle(found.normal, NORMAL)[SPHERE & (found.used >= 3)].max() < 1e-5  # pixels are float32
    assert (found.flags[~SPHERE] == TOO_FEW).all()
    gray = gn.reconstruction.photometric_stereo([gn.scenes.Image(x[..., :1]) for x in arrays], lights)
    assert gray.albedo.shape == (SIZE, SIZE)


@pytest.mark.parametrize("chunks", [[gamma(1.0)], []], ids=["said by the file", "said by the caller"])
def test_linear_pictures_of_16_bits_keep_normals_and_albedos(tmp_path, chunks):
    """... as those of the benchmarks, and as converters of raw files write them."""
    lights = [gn.DistantLight(w, np.pi) for w in directions(10)]
    arrays, stored = pictures(gn.Lambertian([0.942, 0.5, 0.2]), lights), []
    for k, x in enumerate(arrays):
        path = tmp_path / f"{k}.png"
        path.write_bytes(png(np.rint(65535.0 * np.clip(x, 0.0, 1.0)).astype(np.uint16), *chunks))
        stored.append(gn.scenes.load_image(path, linear=None if chunks else True))
    found = gn.reconstruction.photometric_stereo(stored, lights, mask=SPHERE)
    sure = SPHERE & (found.used >= 4)
    assert np.degrees(angle(found.normal, NORMAL)[sure].max()) < 0.1
    np.testing.assert_allclose(
        found.albedo[sure], np.broadcast_to([0.942, 0.5, 0.2], found.albedo.shape)[sure], rtol=0.01
    )


def test_pictures_that_are_multiplied_by_their_coverage_are_taken_as_they_are():
    lights = far(6)
    arrays, half = pictures(gn.Lambertian(RGB), lights), np.full((SIZE, SIZE), 0.5)
    plain = gn.reconstruction.photometric_stereo(arrays, lights, mask=SPHERE)
    for images in (
        [gn.scenes.Image(x, half, premultiplied=True) for x in arrays],
        [gn.scenes.Image(2.0 * x, half) for x in arrays],
    ):
        found = gn.reconstruction.photometric_stereo(images, lights, mask=SPHERE)
        np.testing.assert_allclose(found.albedo, plain.albedo, rtol=1e-4)


def test_observations_are_f_in_local_frames():
    m = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.15, 0.4), gn.Schlick(0.05))
    lights, tangent = near(6), np.cross(NORMAL, [0.3, 0.2, 1.0])
    options = {"normal": NORMAL, "tangent": tangent, "position": NORMAL}
    images = np.stack([gn.reflected_radiance(m, light, WO, **options) for light in lights])
    seen = gn.reconstruction.texel_data(images, lights, WO, mask=SPHERE, u=0.01, **options)
    assert seen.wi.shape == (SIZE, SIZE, 6, 3) and seen.wo.shape == (SIZE, SIZE, 1, 3)
    assert np.allclose(seen.wi[..., 2, :], gn.directions.to_local(lights[2].arrival(NORMAL).w, NORMAL, tangent))
    counts = np.isfinite(seen.f)
    expected = m.f(seen.wi, seen.wo)
    assert np.allclose(seen.f[counts], expected[counts], rtol=1e-10) and not counts[~SPHERE].any()
    assert (counts == (np.moveaxis(images, 0, -1) > 0.0) & SPHERE[..., None]).all()
    assert np.allclose((seen.u / seen.f)[counts], 0.01 / np.moveaxis(images, 0, -1)[counts])


def test_any_model_at_every_texel():
    random = np.random.default_rng(2)
    shape, up = (6, 7), [0.0, 0.0, 1.0]
    normal = gn.direction(random.uniform(0.0, 0.4, shape), random.uniform(0.0, 6.0, shape))
    rho, alpha = random.uniform(0.2, 0.6, (*shape, 3)), random.uniform(0.15, 0.4, (*shape, 1))
    paint = gn.Lambertian(rho) + gn.Microfacet(gn.GGX(alpha), gn.Schlick(0.04))
    lights = [gn.DistantLight(gn.direction(np.arccos(1.0 - 0.5 * (i + 0.5) / 32), 2.39 * i), 3.0) for i in range(32)]
    images = np.stack([gn.reflected_radiance(paint, light, up, normal=normal) for light in lights])
    model = gn.Lambertian() + 1.0 * gn.Microfacet(gn.GGX(), gn.Schlick(0.04))
    options = {"by": ["rho", "weight", "alpha"], "per_channel": ["rho"]}
    for u in (None, 1e-3):
        seen = gn.reconstruction.texel_data(images, lights, up, normal=normal, u=u)
        found = gn.fitting.fit_map(seen, model, **options)
        assert not found.count()
        assert np.allclose(np.stack([found.values[f"0.rho[{c}]"] for c in range(3)], -1), rho, atol=2e-3)
        assert np.allclose(found.values["1.of.distribution.alpha_x"], alpha[..., 0], rtol=0.01)
    glossy = gn.Lambertian(rho) + gn.Microfacet(gn.GGX(0.1), gn.Schlick(0.04))
    images = np.stack([gn.reflected_radiance(glossy, light, up, normal=normal) for light in lights])
    plain, stereo = (
        gn.reconstruction.photometric_stereo(images, lights, robust=robust) for robust in ("none", "cauchy")
    )
    off = [np.degrees(angle(found.normal, normal)).mean() for found in (plain, stereo)]
    assert off[1] < 0.25 * off[0] and off[1] < 1.5
    assert np.abs(stereo.albedo - rho).mean() < 0.02
    seen = gn.reconstruction.texel_data(images, lights, up, normal=stereo.normal)
    found = gn.fitting.fit_map(seen, gn.Lambertian())
    assert np.isclose(found.values["rho[0]"], rho[..., 0], atol=0.15).all()


def test_texels_without_a_normal_are_left_out():
    images, lights, normal, rho = scene(5, texels=4, noise=0.0)
    normal[1] = np.nan
    seen = gn.reconstruction.texel_data(images[..., 0], lights, [0, 0, 1], normal=normal)
    found = gn.fitting.fit_map(seen, gn.Lambertian())
    assert found.flags.tolist() == [0, TOO_FEW, 0, 0]
    assert np.allclose(np.delete(found.values["rho"], 1), np.delete(rho[:, 0], 1), rtol=1e-4)


IMAGES, LAMPS = np.full((4, 5, 6), 0.2), far(4)


@pytest.mark.parametrize(
    ("images", "lights", "options", "words"),
    [
        (np.moveaxis(IMAGES, 0, -1), LAMPS, {}, "np.moveaxis"),
        ((255 * IMAGES).astype(np.uint8), LAMPS, {}, "codes"),
        (gn.scenes.Image(IMAGES[0][..., None]), LAMPS, {}, "one image"),
        ([gn.scenes.Image(IMAGES[0][..., None]), *IMAGES[1:]], LAMPS, {}, "pictures and other things"),
        (np.full((4, 9, 3), 0.2), LAMPS, {}, "coloured=True"),
        (IMAGES[:, 0, 0], LAMPS, {}, r"expected \(K, H, W\)"),
        (IMAGES[:, :0], LAMPS, {}, "at least one texel"),
        ("sphere.exr", LAMPS, {}, "linear radiance"),
        (IMAGES, [*LAMPS[:3], gn.ConstantLight()], {}, "many directions"),
        (IMAGES, [], {}, "non-empty list"),
        (IMAGES, [gn.DistantLight(w, [1.0, 2.0, 3.0]) for w in directions(4)], {}, "no channel axis"),
        (IMAGES, near(4), {}, r"position: got none, and PointLight is near; expected .*\(5, 6, 3\)"),
        (IMAGES, near(4), {"position": np.zeros((6, 5, 3))}, "as the images"),
        (IMAGES, near(4), {"position": near(4)[1].position}, "outside the light"),
        (IMAGES, LAMPS, {"mask": np.ones((5, 6))}, "True where"),
        (IMAGES, LAMPS, {"mask": np.ones((6, 5), bool)}, "for each image"),
        (IMAGES, LAMPS, {"saturation": 0.0}, "saturation above"),
        (IMAGES, LAMPS, {"u": 0.0}, "above 0"),
        (IMAGES, LAMPS, {"u": np.ones(4)}, "shape of the images"),
        (IMAGES, LAMPS, {"robust": "l1"}, "expected one of none"),
    ],
)
def test_what_does_not_fit_is_refused(images, lights, options, words):
    with pytest.raises(gn.Error, match=words):
        gn.reconstruction.photometric_stereo(images, lights, **options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"wo": [0.0, 0.0, 2.0], "normal": WO}, "unit"),
        ({"wo": np.zeros((7, 3)), "normal": WO}, r"wo: got shape \(7, 3\)"),
        ({"wo": WO, "normal": [0.0, 0.0, 0.0]}, "length 0"),
        ({"wo": WO, "normal": WO, "tangent": WO}, "parallel to the normal"),
        ({"wo": WO, "normal": "up"}, "normal"),
        ({"wo": WO, "normal": WO, "tangent": [np.inf, 0.0, 0.0]}, "tangent: got infinite"),
    ],
)
def test_directions_of_observations_are_checked(options, words):
    with pytest.raises(gn.Error, match=words):
        gn.reconstruction.texel_data(IMAGES, LAMPS, **options)
