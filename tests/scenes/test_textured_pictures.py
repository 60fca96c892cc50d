"""Pictures of materials with textures: where the texels of an image come to lie on a sphere."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.errors import ParameterError
from gonio.scenes.estimator import MARGIN

SIZE = 64
LIGHT = gn.ConstantLight(1.0)


def places_seen(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """u, v and whether it is well inside the disc, of the centres of pixels: the camera looks along +y, z is up."""
    x = ((np.arange(size) + 0.5) / size * 2.0 - 1.0) * MARGIN
    x, z = np.meshgrid(x, -x)
    y = -np.sqrt(np.maximum(1.0 - x * x - z * z, 0.0))
    u = np.arctan2(y, x) / (2.0 * np.pi) % 1.0
    return u, np.arccos(np.clip(z, -1.0, 1.0)) / np.pi, x * x + z * z < 0.9


def test_a_chequered_sphere_in_a_furnace():
    """Every pixel has the albedo of the square that its centre is in, but for those that edges cross."""
    chequers = np.indices((6, 12)).sum(axis=0) % 2
    colours = np.where(chequers[..., None] == 0, [0.8, 0.1, 0.2], [0.1, 0.3, 0.9])
    picture = gn.render(gn.Lambertian(gn.Texture(colours, "nearest")), LIGHT, size=SIZE).pixels
    u, v, inside = places_seen(SIZE)
    apart = inside & (np.abs(v - 0.5) < 0.25) & (np.abs(u - 0.75) < 0.15)
    for place in (12 * u, 6 * v):  # by more than half a pixel, in squares
        apart &= np.abs(place - np.round(place)) > 0.16
    assert apart.sum() > 300
    expected = colours[np.floor(6 * v[apart]).astype(int), np.floor(12 * u[apart]).astype(int)]
    np.testing.assert_allclose(picture[apart], expected, rtol=1e-5)


def test_images_are_not_mirrored():
    """Seen from outside, the columns of the image go from left to right, and its rows downwards."""
    columns, rows = np.broadcast_to(np.linspace(0.1, 0.9, 90), (45, 90)), np.linspace(0.1, 0.9, 45)[:, None]
    across = gn.render(gn.Lambertian(gn.Texture(columns, wrap="clamp")), LIGHT, size=32).pixels[16, 6:26, 0]
    down = gn.render(gn.Lambertian(gn.Texture(rows, wrap="clamp")), LIGHT, size=32).pixels[3:29, 16, 0]
    assert (np.diff(across) > 0.0).all()
    assert (np.diff(down) > 0.0).all()
    assert across.mean() == pytest.approx(0.1 + 0.8 * 0.75, abs=0.02)  # the front is three quarters along


def test_a_constant_texture_makes_the_picture_of_the_number():
    plain = gn.Lambertian([0.5, 0.2, 0.1]) + gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
    colours, rough = gn.Texture(np.full((4, 3, 3), [0.5, 0.2, 0.1])), gn.Texture(np.full((2, 5), 0.2))
    textured = gn.Lambertian(colours) + gn.Microfacet(gn.GGX(rough), gn.Dielectric(1.5))
    pictures = [gn.render(m, size=SIZE).pixels for m in (plain, textured)]
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=2e-4, atol=2e-5)


def test_the_rough_half_is_sampled_as_rough():
    """Sampling has the numbers at the place: both halves are those of plain materials."""
    halves = gn.Microfacet(gn.GGX(gn.Texture([[0.5], [0.1]], "nearest")), gn.Conductor(0.2, 3.9))
    picture = gn.render(halves, size=SIZE, samples=64).pixels
    for alpha, rows in ((0.5, slice(8, 28)), (0.1, slice(36, 56))):
        plain = gn.render(gn.Microfacet(gn.GGX(alpha), gn.Conductor(0.2, 3.9)), size=SIZE, samples=64).pixels
        np.testing.assert_allclose(picture[rows, 20:44], plain[rows, 20:44], rtol=1e-3, atol=1e-4)


def test_derivatives_of_other_numbers():
    glossy = gn.Microfacet(gn.GGX(0.3), 0.5)
    m = gn.Lambertian(gn.Texture([[0.4, 0.4]])) + glossy
    found, expected = (gn.scenes.picture_jacobian(x, size=16) for x in (m, gn.Lambertian(0.4) + glossy))
    np.testing.assert_allclose(found[1]["alpha"].pixels, expected[1]["alpha"].pixels, rtol=1e-3, atol=1e-3)
    with pytest.raises(ParameterError, match=r"by=rho\): a texture, and a picture has no derivative by all of its"):
        gn.scenes.picture_jacobian(m, LIGHT, by=["rho"], size=16)


def test_a_stopped_picture_of_a_texture_goes_on(tmp_path):
    m = gn.Lambertian(gn.Texture([[0.2, 0.6]]))
    whole = gn.render(m, size=16, samples=96)
    gn.render(m, size=16, samples=32, checkpoint=tmp_path / "sums")
    again = gn.render(m, size=16, samples=96, checkpoint=tmp_path / "sums")
    np.testing.assert_array_equal(again.pixels, whole.pixels)
    with pytest.raises(ParameterError, match="another"):
        gn.render(gn.Lambertian(gn.Texture([[0.2, 0.5]])), size=16, samples=96, checkpoint=tmp_path / "sums")
