"""Environment maps: lookup, sampling, other renderers' layouts, and the light they give."""

from __future__ import annotations

import json
import math
import pickle

import numpy as np
import pytest
from places import real

import gonio as gn
from gonio.errors import ArrayTypeError, ParameterError, ShapeError
from gonio.formula.json_form import from_json
from gonio.lights._layouts import direction_to_square, square_to_direction
from gonio.lights._panorama import pixel_directions
from gonio.numerics.lattice import lattice

Z = np.array([0.0, 0.0, 1.0])


def noise(height: int, width: int, channels: int = 3, dtype: type = np.float64) -> np.ndarray:
    return (np.random.default_rng(height * width).random((height, width, channels)) ** 4).astype(dtype)


def random_directions(count: int, seed: int = 1) -> np.ndarray:
    w = np.random.default_rng(seed).normal(size=(count, 3))
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


def solid_angles(height: int, width: int) -> np.ndarray:
    edges = np.cos(np.linspace(0.0, np.pi, height + 1))
    return np.broadcast_to((edges[:-1] - edges[1:])[:, None] * 2.0 * np.pi / width, (height, width))


def smooth(w: np.ndarray) -> np.ndarray:
    """A radiance without symmetry; its integral over the sphere is 4 pi (1.6, 2, 1.5)."""
    x, y, z = np.moveaxis(w, -1, 0)
    return np.stack([1.6 + 0.5 * x + 0.3 * y * z + 0.4 * z, 2.0 + x * y + 0.7 * y - z, 1.5 + 0.9 * x * z - 0.4 * y], -1)


SMOOTH_IRRADIANCE_UP = np.pi * np.array([1.6 + 0.8 / 3.0, 2.0 - 2.0 / 3.0, 1.5])


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (2, 1), (7, 5), (16, 32)])
def test_pixel_centres_hold_the_pixels(shape):
    pixels = noise(*shape)
    found = gn.EnvironmentLight(pixels).incident(pixel_directions(*shape))
    np.testing.assert_allclose(found, pixels, rtol=0, atol=1e-12)


def test_rows_go_down_from_z_and_columns_from_x_away_from_y():
    """As photographed: what is further right in the picture has a smaller azimuth."""
    pixels = np.zeros((4, 8))
    pixels[0, :], pixels[2, 0], pixels[2, 2] = 5.0, 1.0, 3.0
    light = gn.EnvironmentLight(pixels)
    theta = 5.0 * math.pi / 8.0
    assert light.incident(Z)[0] == 5.0
    assert light.incident(gn.direction(theta, -math.pi / 8))[0] == pytest.approx(1.0)
    assert light.incident(gn.direction(theta, -5.0 * math.pi / 8))[0] == pytest.approx(3.0)
    assert light.incident(gn.direction(theta, math.pi / 8))[0] == pytest.approx(0.0)


def test_between_pixels_it_is_bilinear():
    pixels = noise(6, 10)
    light = gn.EnvironmentLight(pixels)
    found = light.incident(gn.direction(np.pi * 2.75 / 6, -2.0 * np.pi * 3.9 / 10))
    upper, lower = (0.6 * pixels[i, 3] + 0.4 * pixels[i, 4] for i in (2, 3))
    np.testing.assert_allclose(found, 0.75 * upper + 0.25 * lower, rtol=1e-12)


def test_it_is_continuous_where_the_picture_ends():
    pixels = noise(8, 16)
    light = gn.EnvironmentLight(pixels)
    theta = (np.arange(8) + 0.5) * math.pi / 8
    tiny = 1e-9
    sides = [light.incident(gn.direction(theta, phi)) for phi in (-tiny, 0.0, tiny, 2.0 * math.pi - tiny)]
    for side in sides:
        np.testing.assert_allclose(side, 0.5 * (pixels[:, 0] + pixels[:, -1]), rtol=0, atol=1e-8)
    back = [light.incident(gn.direction(theta, phi)) for phi in (math.pi - tiny, math.pi, -math.pi + tiny)]
    for side in back:
        np.testing.assert_allclose(side, 0.5 * (pixels[:, 7] + pixels[:, 8]), rtol=0, atol=1e-8)


def test_the_poles_have_the_last_rows():
    pixels = noise(8, 16)
    light = gn.EnvironmentLight(pixels)
    phi = (np.arange(16) + 0.5) * -math.pi / 8
    np.testing.assert_allclose(light.incident(gn.direction(1e-7, phi)), pixels[0], atol=1e-7)
    np.testing.assert_allclose(light.incident(gn.direction(math.pi - 1e-7, phi)), pixels[-1], atol=1e-7)
    for pole, row in ((Z, 0), (-Z, -1)):
        np.testing.assert_allclose(light.incident(pole), 0.5 * (pixels[row, 0] + pixels[row, -1]), rtol=1e-12)
        assert light.pdf(pole) > 0.0


def test_nan_directions_give_nan():
    light = gn.EnvironmentLight(noise(4, 8))
    w = np.array([[np.nan, 0.0, 1.0], [0.0, 0.0, 1.0]])
    assert np.isnan(light.incident(w)).any(axis=-1).tolist() == [True, False]
    assert np.isnan(light.pdf(w)).tolist() == [True, False]


def test_flux_and_irradiance_of_a_smooth_map_have_the_closed_form():
    height, width = 128, 256
    w = pixel_directions(height, width)
    light = gn.EnvironmentLight(smooth(w))
    energy = (light.incident(w) * solid_angles(height, width)[..., None]).reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(energy, 4.0 * np.pi * np.array([1.6, 2.0, 1.5]), rtol=1e-6)
    points = np.array(lattice(1 << 16))
    w, pdf = light.sample(points)
    estimates = light.incident(w) / pdf[:, None] * np.maximum(w[:, 2:], 0.0)
    np.testing.assert_allclose(estimates.mean(axis=0), SMOOTH_IRRADIANCE_UP, rtol=2e-4)


def test_interpolation_error_falls_with_the_square_of_the_pixels():
    w = random_directions(20000)
    errors = []
    for height in (32, 64, 128):
        light = gn.EnvironmentLight(smooth(pixel_directions(height, 2 * height)))
        errors.append(np.abs(light.incident(w) - smooth(w))[np.abs(w[:, 2]) < 0.95].max())
    assert errors[2] < 4e-4
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 4.0, rtol=0.15)


@pytest.mark.parametrize("shape", [(1, 1), (5, 7), (32, 64), (33, 48)])
def test_the_density_integrates_to_one(shape):
    light = gn.EnvironmentLight(noise(*shape) + (np.arange(shape[1]) % 5 == 0)[:, None] * 300.0)
    total = (light.pdf(pixel_directions(*shape)) * solid_angles(*shape)).sum()
    assert total == pytest.approx(1.0, abs=1e-12)


def test_samples_have_the_density_they_say_and_pdf_says():
    light = gn.EnvironmentLight(noise(16, 24) + 0.1)
    u = np.random.default_rng(3).random((4000, 2))
    w, pdf = light.sample(u)
    np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(light.pdf(w), pdf, rtol=1e-13)
    step = 1e-7  # pdf |dw/du| = 1, wherever a step stays within the pixel
    across, down = (
        (light.sample(u + s)[0] - light.sample(u - s)[0]) / (2.0 * step) for s in ((step, 0.0), (0.0, step))
    )
    area = np.linalg.norm(np.cross(across, down), axis=-1)
    inside = np.all([np.abs(light.sample(u + s)[1] - pdf) < 1e-12 for s in (-step, step)], axis=0)
    assert inside.mean() > 0.99
    np.testing.assert_allclose((area * pdf)[inside], 1.0, rtol=2e-5)


def test_as_many_samples_as_the_density_promises_fall_into_each_pixel():
    pixels = noise(12, 20)
    pixels[4, 7] = 200.0
    light = gn.EnvironmentLight(pixels)
    count = 300_000
    w, _ = light.sample(np.random.default_rng(5).random((count, 2)))
    theta, phi = gn.angles(w)
    row, column = (theta * 12 / np.pi).astype(int), (-phi % (2.0 * np.pi) * 20 / (2.0 * np.pi)).astype(int)
    seen = np.bincount(row * 20 + column, minlength=240)
    expected = count * (light.pdf(pixel_directions(12, 20)) * solid_angles(12, 20)).ravel()
    assert expected.min() > 5.0
    chi2 = ((seen - expected) ** 2 / expected).sum()
    assert chi2 < 239 + 4.0 * math.sqrt(2.0 * 239)


def test_sampling_is_monotone():
    light = gn.EnvironmentLight(noise(16, 32))
    u = np.linspace(0.0, 1.0, 3001)
    _, phi = gn.angles(light.sample(np.stack([u, np.full_like(u, 0.3)], -1))[0])
    assert np.all(np.diff(-phi[:-1] % (2.0 * np.pi)) > 0.0)
    z = light.sample(np.stack([np.full_like(u, 0.3), u], -1))[0][:, 2]
    assert np.all(np.diff(z) < 0.0)


@pytest.mark.parametrize("at", [(0, 0), (3, 15), (7, 4)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_no_light_is_missed_beside_one_bright_pixel(at, dtype):
    pixels = np.zeros((8, 16, 3), dtype)
    pixels[at] = 0.0, 0.0, 7.0
    light = gn.EnvironmentLight(pixels)
    w = random_directions(50_000).astype(dtype)
    lit = light.incident(w)[:, 2] > 0.0
    assert lit.any()
    assert np.all(light.pdf(w)[lit] > 0.0)
    ends = np.array([0.0, np.finfo(dtype).tiny, 0.5, np.nextafter(dtype(1), dtype(0)), 1.0], dtype)
    u = np.concatenate([np.stack(np.meshgrid(ends, ends), -1).reshape(-1, 2), lattice(2000).astype(dtype)])
    w, pdf = light.sample(u)
    assert np.all(pdf > 0.0)
    assert np.all(np.isfinite(w))
    estimates = light.incident(w)[:, 2] / pdf
    assert estimates.max() < 5.0 * estimates.mean()  # the sum of mean + maximum over that of the mean


def test_a_black_map_gives_no_light_and_is_sampled_uniformly():
    light = gn.EnvironmentLight(np.zeros((6, 9, 3)))
    u = np.array(lattice(5000))
    w, pdf = light.sample(u)
    np.testing.assert_allclose(pdf, 0.25 / np.pi, rtol=1e-12)
    np.testing.assert_allclose(w[:, 2], 1.0 - 2.0 * u[:, 1], atol=1e-12)
    np.testing.assert_allclose(light.pdf(w), 0.25 / np.pi, rtol=1e-12)
    assert not light.incident(w).any()
    out = gn.reflected_radiance(gn.Lambertian(0.5), light, Z)
    np.testing.assert_array_equal(out, np.zeros(3))


@pytest.mark.parametrize("shape", [(16, 32), (512, 1024)])
def test_float32_stays_float32_and_close_to_float64(shape):
    pixels = noise(*shape, dtype=np.float32)
    light = gn.EnvironmentLight(pixels)
    w, u = random_directions(20_000), np.array(lattice(20_000))
    single = w.astype(np.float32)
    assert light.incident(single).dtype == light.pdf(single).dtype == np.float32
    error = np.abs(light.incident(single) - light.incident(w)).max()
    assert error < 1.5e-7 * shape[1]  # at most 6e-8 W of a pixel, each way, times the contrast
    directions, pdf = light.sample(u.astype(np.float32))
    assert directions.dtype == pdf.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, atol=3e-7)
    moved = np.abs(directions - light.sample(u)[0]).max(axis=-1)
    assert np.mean(moved > 1e-4) < 2e-3  # where u lies on the edge of a row


def test_uniform_light_is_constant_light():
    w = gn.direction(np.array([0.0, 0.5, 1.2]), 0.3)
    environment = gn.EnvironmentLight(np.broadcast_to([0.5, 1.0, 2.0], (8, 16, 3)))
    constant = gn.ConstantLight(np.array([0.5, 1.0, 2.0]))
    for m in (gn.Lambertian(0.5), gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))):
        np.testing.assert_allclose(
            gn.reflected_radiance(m, environment, w), gn.reflected_radiance(m, constant, w), rtol=1e-3
        )


def test_a_lambertian_reflects_the_sum_over_the_pixels():
    light = gn.EnvironmentLight.studio(height=128)
    pixels = light.image.pixels.astype(float)
    w, weight = pixel_directions(128, 256), solid_angles(128, 256)
    for normal in ((0.0, 0.0, 1.0), (-0.3, -0.9, 0.4), (0.7, 0.1, -0.7)):
        n = np.array(normal) / np.linalg.norm(normal)
        irradiance = np.einsum("ij,ijc->c", weight * np.maximum(w @ n, 0.0), pixels)
        for samples, rtol in ((1 << 12, 1e-2), (1 << 16, 1e-3)):
            found = gn.reflected_radiance(gn.Lambertian(0.8), light, n, normal=n, samples=samples)
            np.testing.assert_allclose(found, 0.8 / np.pi * irradiance, rtol=rtol)


def test_a_mirror_shows_the_map():
    light = gn.EnvironmentLight(smooth(pixel_directions(64, 128)))
    wo = gn.direction(np.array([0.2, 1.0]), np.array([0.4, 2.0]))
    found = gn.reflected_radiance(gn.IdealSpecular(0.9), light, wo)
    np.testing.assert_allclose(found, 0.9 * light.incident(wo * (-1.0, -1.0, 1.0)), rtol=1e-12)


def test_one_bright_pixel_is_a_distant_light():
    height, width = 256, 512
    pixels = np.zeros((height, width))
    pixels[70, 400] = 1000.0
    step = math.pi / height
    theta = 70.5 * step  # the pixel's tent, integrated: step in phi, 2 sin(theta) (1 - cos(step))/step in theta
    irradiance = 1000.0 * 2.0 * math.pi / width * 2.0 * math.sin(theta) * (1.0 - math.cos(step)) / step
    distant = gn.DistantLight(gn.direction(theta, -400.5 * 2.0 * math.pi / width), irradiance)
    wo = gn.direction(np.array([0.0, 0.8]), np.array([0.0, 1.1]))
    for m in (gn.Lambertian(0.7), gn.Microfacet(gn.GGX(0.4), gn.Dielectric(1.5))):
        found = gn.reflected_radiance(m, gn.EnvironmentLight(pixels), wo)
        assert found.shape == (2,)
        np.testing.assert_allclose(found, gn.reflected_radiance(m, distant, wo), rtol=2e-3)


def test_torch_agrees_with_numpy(torch):
    light = gn.EnvironmentLight(noise(16, 32), scale=(1.0, 2.0, 3.0))
    w, u = random_directions(500), np.array(lattice(500))
    for dtype, tolerance in ((torch.float64, 1e-12), (torch.float32, 2e-5)):
        there = torch.as_tensor(w, dtype=dtype)
        assert light.incident(there).dtype == dtype
        np.testing.assert_allclose(light.incident(there).numpy(), light.incident(w), atol=tolerance)
        directions, pdf = light.sample(torch.as_tensor(u, dtype=dtype))
        assert directions.dtype == pdf.dtype == dtype
        np.testing.assert_allclose(directions.numpy(), light.sample(u)[0], atol=20 * tolerance)
    np.testing.assert_allclose(light.pdf(torch.as_tensor(w)).numpy(), light.pdf(w), rtol=1e-12)
    there = torch.as_tensor(np.concatenate([w, [Z, -Z]])).requires_grad_()
    light.incident(there).sum().backward()
    assert torch.isfinite(there.grad).all()


def test_jax_agrees_with_numpy_and_compiles(jax):
    light = gn.EnvironmentLight(noise(16, 32), scale=2.0)
    w, u = random_directions(500).astype(np.float32), lattice(500).astype(np.float32)
    found = jax.jit(light.incident)(jax.numpy.asarray(w))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, light.incident(w), atol=1e-4)
    np.testing.assert_allclose(jax.jit(light.pdf)(jax.numpy.asarray(w)), light.pdf(w), rtol=1e-5)
    directions, pdf = jax.jit(light.sample)(jax.numpy.asarray(u))
    np.testing.assert_allclose(directions, light.sample(u)[0], atol=2e-3)
    np.testing.assert_allclose(pdf, light.sample(u)[1], rtol=1e-5)


def test_mitsuba_sees_the_same_radiance():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    light = gn.EnvironmentLight(noise(7, 12, dtype=np.float32), scale=1.5)
    emitter = mi.load_dict(
        {
            "type": "envmap",
            "bitmap": mi.Bitmap(light.to_mitsuba().pixels),
            "to_world": mi.ScalarTransform4f(np.array(light.MITSUBA_TO_WORLD)),
        }
    )
    for w in random_directions(400):
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*(-w))
        np.testing.assert_allclose(np.array(emitter.eval(si)), light.incident(w), rtol=0, atol=5e-6)


def test_pictures_from_mitsuba_look_as_there():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    pixels = smooth(pixel_directions(48, 96)).astype(np.float32)  # of some place, in Mitsuba's layout
    emitter = mi.load_dict(
        {
            "type": "envmap",
            "bitmap": mi.Bitmap(pixels),
            "to_world": mi.ScalarTransform4f(np.array(gn.EnvironmentLight.MITSUBA_TO_WORLD)),
        }
    )
    light = gn.EnvironmentLight.from_mitsuba(pixels)
    for w in random_directions(200):
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*(-w))
        atol = 2e-3 if abs(w[2]) < 0.99 else 0.05  # pixels that lie half a row apart; at the poles, the last half
        np.testing.assert_allclose(np.array(emitter.eval(si)), light.incident(w), rtol=0, atol=atol)


def rotation(axis, angle):
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(4)
    turn[:3, :3] += np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K
    return turn


def test_a_map_of_a_mitsuba_scene_is_turned_as_there():
    """`to_world` turns the directions of Mitsuba's own frame, y up; about the vertical by whole columns exactly."""
    pixels, base = smooth(pixel_directions(49, 96)).astype(np.float32), gn.EnvironmentLight.MITSUBA_TO_WORLD
    plain = gn.EnvironmentLight.from_mitsuba(pixels)
    same = gn.EnvironmentLight.from_mitsuba(pixels, to_world=base)
    np.testing.assert_allclose(same.image.pixels, plain.image.pixels, rtol=1e-6)
    columns = gn.EnvironmentLight.from_mitsuba(pixels, to_world=rotation([0, 0, 1], 2.0 * np.pi * 7 / 96) @ base)
    np.testing.assert_allclose(columns.image.pixels, np.roll(plain.image.pixels, -7, axis=1), rtol=1e-5)
    turn, w = rotation([1, 2, -1], 0.7), random_directions(200)
    turned = gn.EnvironmentLight.from_mitsuba(pixels, to_world=turn @ base)
    at = w @ turn[:3, :3]  # turned back
    inside = (np.abs(at[:, 2]) < 0.97) & (np.abs(w[:, 2]) < 0.97)  # poles last half a pixel
    np.testing.assert_allclose(turned.incident(w)[inside], plain.incident(at)[inside], rtol=0, atol=6e-3)
    for wrong, error, words in ((2.0 * base, ParameterError, "a rotation"), (np.eye(2), ShapeError, r"\(4, 4\)")):
        with pytest.raises(error, match=words):
            gn.EnvironmentLight.from_mitsuba(pixels, to_world=wrong)


def test_mitsuba_turns_a_map_so_too():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    pixels = smooth(pixel_directions(48, 96)).astype(np.float32)
    turn = mi.ScalarTransform4f(rotation([1, 2, -1], 0.7))
    emitter = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(pixels), "to_world": turn})
    light = gn.EnvironmentLight.from_mitsuba(pixels, to_world=turn)
    for w in random_directions(200):
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*(-w))
        atol = 6e-3 if abs(w[2]) < 0.98 else 0.05  # interpolated twice
        np.testing.assert_allclose(np.array(emitter.eval(si)), light.incident(w), rtol=0, atol=atol)


def test_mitsuba_layout_and_back_is_exact():
    pixels = noise(9, 14)
    light = gn.EnvironmentLight(pixels, scale=0.5)
    there = light.to_mitsuba().pixels
    assert there.shape == (19, 14, 3)
    back = gn.EnvironmentLight.from_mitsuba(there, height=9)
    np.testing.assert_array_equal(back.image.pixels, (0.5 * pixels).astype(np.float32))


def test_the_equal_area_square():
    corners = square_to_direction(np.array([[0.5, 0.5], [0, 0], [0, 1], [1, 0], [1, 1], [1, 0.5], [0.5, 1]]))
    expected = [[0, 0, 1], [0, 0, -1], [0, 0, -1], [0, 0, -1], [0, 0, -1], [1, 0, 0], [0, 1, 0]]
    np.testing.assert_allclose(corners, expected, atol=1e-15)
    np.testing.assert_allclose(square_to_direction(np.array([0.0, 0.5])), [-1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(square_to_direction(np.array([0.75, 0.75]))[:2] > 0.0, True)
    points = np.random.default_rng(2).random((20_000, 2))
    w = square_to_direction(points)
    np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(direction_to_square(w), points, atol=1e-14)
    d = random_directions(20_000)
    np.testing.assert_allclose(square_to_direction(direction_to_square(d)), d, atol=1e-14)
    step = 1e-6  # equal areas: |dw/ds| = 4 pi, but across the edges of the map's eight triangles
    a, b = ((square_to_direction(points + s) - square_to_direction(points - s)) / (2 * step) for s in step * np.eye(2))
    area = np.linalg.norm(np.cross(a, b), axis=-1)
    edges = np.abs(points - 0.5).min(axis=-1), np.abs(np.abs(2.0 * points - 1.0).sum(axis=-1) - 1.0)
    np.testing.assert_allclose(area[np.minimum(*edges) > 3 * step], 4.0 * np.pi, rtol=1e-5)


def test_pbrt_layout():
    light = gn.EnvironmentLight(smooth(pixel_directions(64, 128)), scale=2.0)
    there = light.to_pbrt(96).pixels
    assert there.shape == (96, 96, 3)
    np.testing.assert_allclose(there.mean(axis=(0, 1)), 2.0 * np.array([1.6, 2.0, 1.5]), rtol=5e-4)
    grid = (np.arange(96) + 0.5) / 96
    v, u = np.meshgrid(grid, grid, indexing="ij")  # texel (row, column) is at v, u
    np.testing.assert_allclose(there, light.incident(square_to_direction(np.stack([u, v], -1))), atol=3e-2)
    back = gn.EnvironmentLight.from_pbrt(there, height=64)
    w = random_directions(2000)
    assert np.abs(back.incident(w) - light.incident(w)).max() < 0.1
    assert np.sqrt(np.mean((back.incident(w) - light.incident(w)) ** 2)) < 0.02


def test_default_sizes_undo_each_other_and_keep_the_flux():
    light = gn.EnvironmentLight.studio(height=100)
    there = light.to_pbrt()
    back = gn.EnvironmentLight.from_pbrt(there)
    assert there.pixels.shape == (113, 113, 3)
    assert back.image.pixels.shape == (100, 200, 3)
    flux = [(x.image.pixels * solid_angles(100, 200)[..., None]).sum(axis=(0, 1)) for x in (light, back)]
    np.testing.assert_allclose(4.0 * np.pi * there.pixels.mean(axis=(0, 1)), flux[0], rtol=4e-3)
    np.testing.assert_allclose(flux[1], flux[0], rtol=4e-3)


def test_the_studio_is_fit_for_looking_at_materials():
    light = gn.EnvironmentLight.studio()
    pixels = light.image.pixels
    assert pixels.shape == (256, 512, 3)
    assert pixels.dtype == np.float32
    assert light == gn.EnvironmentLight.studio()
    w, weight = pixel_directions(256, 512), solid_angles(256, 512)
    mean = (pixels.mean(axis=-1) * weight).sum() / (4.0 * np.pi)
    assert 300.0 < pixels.mean(axis=-1).max() / mean < 800.0
    brightest = np.argmax(pixels.sum(axis=-1))
    assert w.reshape(-1, 3)[brightest] @ np.array([-0.8, -0.7, 0.8]) / math.sqrt(1.77) > math.cos(0.06)
    flux = (pixels * weight[..., None]).reshape(-1, 3)
    irradiance = [np.maximum(w.reshape(-1, 3) @ n, 0.0) @ flux for n in pixel_directions(6, 12).reshape(-1, 3)]
    assert 0.9 * np.pi < np.max(irradiance) < np.pi
    low = gn.EnvironmentLight.studio(sun=(0.0, 3.0, 0.0), height=32)
    assert low.image.pixels.shape == (32, 64, 3)


def test_it_is_a_value(tmp_path):
    pixels = noise(4, 8, dtype=np.float32)
    light = gn.EnvironmentLight(pixels, scale=2.0)
    pixels[0, 0] = 7.0  # the light has its own copy
    same = gn.EnvironmentLight(noise(4, 8, dtype=np.float32), 2.0)
    assert light == same
    assert hash(light) == hash(same)
    assert light != same.replace(scale=3.0)
    assert light != gn.EnvironmentLight(pixels, 2.0)
    assert same.replace(scale=3.0).image is same.image
    copy = pickle.loads(pickle.dumps(light))
    assert copy == light
    with pytest.raises(ValueError, match="read-only"):
        copy.image.pixels[0] = 0.0
    with pytest.raises(AttributeError, match="is a value"):
        light.scale = 1.0
    assert repr(light) == "EnvironmentLight(image=<8 x 4, 3 channels>, scale=2.0, invalid='error')"
    path = tmp_path / "sky.exr"
    gn.scenes.Image(noise(4, 8, dtype=np.float32)).save(path)
    read = gn.EnvironmentLight(path, 2.0)
    assert read == light
    assert "8 x 4, 3 channels" in repr(read)
    assert "sky.exr" in repr(read)
    for x in (light, read):
        assert from_json(json.loads(json.dumps(x.to_json())), files=True) == x


def test_gray_maps_and_scales_with_channels():
    w = random_directions(50)
    gray = noise(4, 8, 1)
    light = gn.EnvironmentLight(gray[..., 0], scale=(1.0, 2.0, 3.0))
    one = gn.EnvironmentLight(gray).incident(w)
    assert one.shape == (50, 1)
    np.testing.assert_allclose(light.incident(w), one * (1.0, 2.0, 3.0))
    assert gn.reflected_radiance(gn.Lambertian(0.5), gn.EnvironmentLight(gray), Z).shape == ()
    with pytest.raises(ShapeError, match=r"scale has shape \(2,\)"):
        gn.EnvironmentLight(noise(4, 8), scale=(1.0, 2.0))


def test_invalid_pixels_are_one_clear_error_or_zero():
    pixels = noise(5, 10, dtype=np.float32)
    pixels[2, 3, 1], pixels[4, 0] = np.nan, -1.0
    with pytest.raises(ParameterError, match=r"2 of 50 pixels .* row 2, column 3: .*nan.* invalid='zero'"):
        gn.EnvironmentLight(pixels)
    light = gn.EnvironmentLight(pixels, invalid="zero")
    assert light.image.pixels[2, 3, 1] == 0.0
    assert light.image.pixels[2, 3, 0] == pixels[2, 3, 0]
    assert not light.image.pixels[4, 0].any()
    assert gn.EnvironmentLight.from_mitsuba(pixels, invalid="zero", scale=2.0).scale == 2.0
    pixels = noise(5, 10)
    pixels[1, 1, 2] = np.inf
    with pytest.raises(ParameterError, match=r"1 of 50 pixels .* row 1, column 1"):
        gn.EnvironmentLight(pixels)


def test_bad_arguments_are_errors():
    with pytest.raises(ParameterError, match="expected a NumPy array"):
        gn.EnvironmentLight()
    with pytest.raises(ParameterError, match="expected a NumPy array"):
        gn.EnvironmentLight({"a": 1})
    with pytest.raises(ParameterError, match="lists that are not"):
        gn.EnvironmentLight([[1.0], [1.0, 2.0]])
    with pytest.raises(ArrayTypeError, match="uint8"):
        gn.EnvironmentLight(np.zeros((4, 8, 3), np.uint8))
    with pytest.raises(ShapeError, match=r"\(4,\)"):
        gn.EnvironmentLight(np.zeros(4))
    with pytest.raises(gn.Error):
        gn.EnvironmentLight("no_such_file.exr")
    with pytest.raises(ParameterError, match="scale"):
        gn.EnvironmentLight(np.zeros((4, 8)), scale=-1.0)
    light = gn.EnvironmentLight(np.zeros((4, 8)))
    with pytest.raises(ShapeError, match=r"expected \(..., 3\)"):
        light.incident(np.zeros((5, 2)))
    with pytest.raises(ShapeError, match=r"expected \(..., 2\)"):
        light.sample(np.zeros((5, 3)))
    with pytest.raises(ShapeError, match="square"):
        gn.EnvironmentLight.from_pbrt(np.zeros((4, 8)))
    with pytest.raises(ShapeError, match="at least 2"):
        gn.EnvironmentLight.from_mitsuba(np.zeros((1, 8)))
    with pytest.raises(ParameterError, match="size"):
        light.to_pbrt(0)
    for sun in ((0.0, 0.0, 0.0), (1.0, 2.0), (np.nan, 0.0, 1.0)):
        with pytest.raises(ParameterError, match="sun"):
            gn.EnvironmentLight.studio(sun)


def test_a_real_map():
    studio = real("env/studio.exr")
    with pytest.raises(ParameterError, match=r"studio.exr: .* of 524288 pixels are negative"):
        gn.EnvironmentLight(studio)
    light = gn.EnvironmentLight(studio, invalid="zero")
    pixels, weight = light.image.pixels, solid_angles(512, 1024)
    assert pixels.shape == (512, 1024, 3)
    flux = (pixels * weight[..., None]).sum(axis=(0, 1))
    w, pdf = light.sample(np.array(lattice(1 << 15)))
    estimates = light.incident(w) / pdf[:, None]
    np.testing.assert_allclose(estimates.mean(axis=0), flux, rtol=2e-3)
    cosine = np.maximum(pixel_directions(512, 1024)[..., 2:], 0.0)
    expected = (pixels * weight[..., None] * cosine).sum(axis=(0, 1)) / np.pi
    np.testing.assert_allclose(gn.reflected_radiance(gn.Lambertian(1.0), light, Z), expected, rtol=5e-3)
