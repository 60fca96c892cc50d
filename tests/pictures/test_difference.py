"""Differences of pictures: numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.errors import ParameterError, ShapeError

SKY = gn.ConstantLight(1.0)


def test_a_difference_is_signed_and_told_in_shares_of_the_mean():
    a = np.full((4, 5, 3), 0.5, np.float32)
    b = a.copy()
    b[1, 2] = 0.9
    b[..., 2] -= 0.1
    found = gn.scenes.picture_difference(gn.scenes.Image(a), gn.scenes.Image(b))
    np.testing.assert_allclose(found.pixels, b - a)
    np.testing.assert_allclose(found.bias, [0.04, 0.04, -0.16], rtol=1e-5)
    assert found.place == (1, 2) and found.largest == pytest.approx(0.8, rel=1e-5)
    assert found.rms == pytest.approx(np.sqrt(np.mean((b - a) ** 2)) / 0.5, rel=1e-5)
    assert found.sigmas is None
    back = gn.scenes.picture_difference(gn.scenes.Image(b), gn.scenes.Image(a))
    np.testing.assert_allclose(back.pixels, -found.pixels)
    assert "brighter" in repr(found) and "darker" in repr(back)  # by luminance: of blue a 14th


def test_brighter_is_by_luminance_not_by_the_mean_of_shares():
    """A small channel that doubles: 10 % darker to the eye, though the shares of the channels add up to brighter."""
    a, b = (gn.scenes.Image(np.full((4, 4, 3), rgb, np.float32)) for rgb in ((0.8, 0.5, 0.1), (0.72, 0.44, 0.2)))
    found = gn.scenes.picture_difference(a, b)
    Y = np.array([0.2126, 0.7152, 0.0722])
    expected = (Y @ [0.72, 0.44, 0.2]) / (Y @ [0.8, 0.5, 0.1]) - 1.0
    assert found.bias.mean() > 0.2 and found.brighter == pytest.approx(expected, rel=1e-3) and expected < -0.09
    assert repr(found).startswith("b is 9.9 % darker than a by luminance (R -10.0, G -12.0, B +100.0 %); rms")
    assert found.of_one_number().mean() / (a.pixels[0, 0] @ Y) == pytest.approx(expected, rel=1e-3)


def test_channels_of_other_names_count_by_their_mean_and_must_agree():
    names = ("450", "550", "650")
    a, b = (
        gn.scenes.Image(np.full((4, 4, 3), x, np.float32), channels=names) for x in ((0.5, 0.3, 0.2), (0.5, 0.3, 0.4))
    )
    assert gn.scenes.picture_difference(a, b).brighter == pytest.approx(0.2, rel=1e-5)
    assert "20.0 % brighter than a by the mean of the channels (450 +0.0," in repr(gn.scenes.picture_difference(a, b))
    with pytest.raises(ParameterError, match="expected the same of both"):
        gn.scenes.picture_difference(a, gn.scenes.Image(b.pixels, channels=("X", "Y", "Z")))


def test_what_is_transparent_in_both_does_not_count():
    alpha = np.zeros((4, 4), np.float32)
    alpha[:, :2] = 1.0
    a, b = (np.full((4, 4, 1), level, np.float32) for level in (0.4, 0.6))
    b[:, 2:] = np.nan  # beside the shape
    found = gn.scenes.picture_difference(gn.scenes.Image(a, alpha), gn.scenes.Image(b, alpha))
    np.testing.assert_allclose(found.bias, [0.5], rtol=1e-6)
    assert found.inside.sum() == 8
    half = gn.scenes.picture_difference(gn.scenes.Image(a, alpha), gn.scenes.Image(a, 0.5 * alpha))  # over black
    np.testing.assert_allclose(half.bias, [-0.5], rtol=1e-6)


def test_noise_is_about_one_standard_error_and_a_change_is_more():
    """Independent pictures of one thing differ by their noise; `render` says how well it knows it (0.7 at 256)."""
    m, light = gn.material("gold", alpha=0.3), gn.EnvironmentLight.studio(height=64)
    a, b = (gn.render(m, light, size=48, samples=256, seed=seed) for seed in (0, 1))
    assert 0.5 < gn.scenes.picture_difference(a, b).sigmas < 2.0
    changed = gn.render(m.replace(alpha=0.2), light, size=48, samples=256, seed=1)
    assert gn.scenes.picture_difference(a, changed).sigmas > 4.0


def test_bad_pictures_are_refused():
    gray = gn.scenes.Image(np.full((4, 4, 1), 0.5))
    for other, error, words in (
        (gn.scenes.Image(np.full((4, 5, 1), 0.5)), ShapeError, "expected one size"),
        (gn.scenes.Image(np.full((4, 4, 1), np.nan)), ParameterError, "NaN"),
    ):
        with pytest.raises(error, match=words):
            gn.scenes.picture_difference(gray, other)
    with pytest.raises(ShapeError, match="expected as many, or one"):
        gn.scenes.picture_difference(gn.scenes.Image(np.full((4, 4, 2), 0.5)), gn.scenes.Image(np.full((4, 4, 3), 0.5)))
    with pytest.raises(ParameterError, match="black in a channel"):
        gn.scenes.picture_difference(gn.scenes.Image(np.zeros((4, 4, 1))), gray)
    with pytest.raises(ParameterError, match="transparent throughout"):
        gn.scenes.picture_difference(*[gn.scenes.Image(np.ones((4, 4, 1)), np.zeros((4, 4)))] * 2)
