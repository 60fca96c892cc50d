"""Textures: values between texels, what lies outside, colours of files, and errors."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from PIL import Image as Pillow

import gonio as gn
from gonio.errors import (
    AccessError,
    ArrayTypeError,
    FormatError,
    MeaningWarning,
    NotFoundError,
    ParameterError,
    ShapeError,
)
from gonio.formula.json_form import from_json

TEXELS = np.array([[0.0, 0.4, 0.8], [1.0, 0.2, 0.6]])  # centres at u = 1/6, 1/2, 5/6 and v = 1/4, 3/4


def at(u: float, v: float, **how: str) -> float:
    (value,) = gn.Texture(TEXELS, **how).at([u, v])
    return value


def test_the_centre_of_a_texel_is_its_value():
    v, u = np.meshgrid([0.25, 0.75], np.array([1.0, 3.0, 5.0]) / 6.0, indexing="ij")
    for filter in ("bilinear", "nearest"):
        for wrap in ("repeat", "mirror", "clamp", "refuse"):
            found = gn.Texture(TEXELS, filter, wrap).at(np.stack([u, v], -1))
            np.testing.assert_allclose(found[..., 0], TEXELS, atol=1e-15)


def test_between_texels_it_is_bilinear():
    # A quarter of the way from texel (0, 0) to (0, 1), three quarters of that from row 0 to row 1.
    upper, lower = 0.75 * 0.0 + 0.25 * 0.4, 0.75 * 1.0 + 0.25 * 0.2
    assert at(0.25, 0.25 + 0.375) == pytest.approx(0.25 * upper + 0.75 * lower)
    assert at(1.0 / 3.0, 0.5) == pytest.approx((0.0 + 0.4 + 1.0 + 0.2) / 4.0)


@pytest.mark.parametrize(
    ("wrap", "left", "corner", "beyond"),
    [
        # At u = 0 half of the first texel is that of the other edge, or the same; the corner is a mean of four.
        ("repeat", (0.0 + 0.8) / 2.0, (0.0 + 0.8 + 1.0 + 0.6) / 4.0, 0.4),  # u = 1.5 is u = 0.5
        ("mirror", 0.0, 0.0, 0.4),  # u = 1.5 is u = 0.5 from the other side
        ("clamp", 0.0, 0.0, 0.8),
    ],
)
def test_wrapping(wrap: str, left: float, corner: float, beyond: float):
    assert at(0.0, 0.25, wrap=wrap) == pytest.approx(left)
    assert at(0.0, 0.0, wrap=wrap) == pytest.approx(corner)
    assert at(1.5, 0.25, wrap=wrap) == pytest.approx(beyond)


def test_repeating_and_mirroring_have_their_periods():
    uv = np.random.default_rng(1).uniform(0.0, 1.0, (200, 2))
    for filter in ("bilinear", "nearest"):
        repeated, mirrored = gn.Texture(TEXELS, filter), gn.Texture(TEXELS, filter, "mirror")
        np.testing.assert_allclose(repeated.at(uv), repeated.at(uv + np.array([3.0, -2.0])), atol=1e-12)
        np.testing.assert_allclose(mirrored.at(uv), mirrored.at(-uv), atol=1e-12)
        np.testing.assert_allclose(mirrored.at(uv), mirrored.at(uv + np.array([2.0, -4.0])), atol=1e-12)
    assert at(1.0 / 6.0 + 1.0, 0.25, wrap="mirror") == pytest.approx(0.8)  # the image reversed


def test_the_nearest_texel():
    assert [at(u, 0.3, filter="nearest") for u in (0.0, 0.33, 0.34, 0.99)] == [0.0, 0.0, 0.4, 0.8]
    assert at(1.0, 1.0, filter="nearest", wrap="clamp") == 0.6
    assert at(1.0, 1.0, filter="nearest") == 0.0  # the first texel again


def test_places_outside_are_refused_where_that_is_asked_for():
    with pytest.raises(ParameterError, match=r'uv: 1\.2; expected 0 to 1 of a texture with wrap="refuse"'):
        at(1.2, 0.5, wrap="refuse")
    m = gn.Lambertian(gn.Texture(TEXELS, wrap="refuse"))
    with pytest.raises(ParameterError, match="expected 0 to 1"):
        m.f([0, 0, 1], [0, 0, 1], uv=[0.5, -0.1])
    assert m.at(uv=[1.0, 0.75]).rho == pytest.approx([0.6])


def test_rounding_keeps_within_the_texels():
    """Else a parameter of the least value were refused."""
    rng = np.random.default_rng(1)
    steps = 1.0 - 2.0 ** -rng.uniform(20.0, 50.0, 1000)  # almost at the centre of the next texel
    for a, b in rng.uniform(0.001, 1.0, (100, 2)):
        values = gn.Texture([[a, b]], wrap="clamp").at(np.stack([0.25 + 0.5 * steps, 0.5 + 0.0 * steps], -1))
        assert min(a, b) <= values.min() and values.max() <= max(a, b)
    single = np.full((3, 2), 0.4, np.float32)  # where 0.01 is less than 0.01
    assert gn.Texture([[0.01]]).at(single).min() == 0.01


CODES = np.array([[[0, 64, 128]], [[200, 255, 10]]], np.uint8)


def decoded(code: float) -> float:
    """IEC 61966-2-1."""
    x = code / 255.0
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


def test_colours_of_files(tmp_path):
    Pillow.fromarray(CODES).save(tmp_path / "codes.png")
    light = np.vectorize(decoded)(CODES)
    np.testing.assert_allclose(gn.Texture(tmp_path / "codes.png").texels, light, atol=1e-6)
    np.testing.assert_allclose(gn.Texture(tmp_path / "codes.png", colour="srgb").texels, light, atol=1e-6)
    np.testing.assert_allclose(gn.Texture(str(tmp_path / "codes.png"), colour="linear").texels, CODES / 255, atol=1e-6)
    np.testing.assert_allclose(gn.Texture(CODES, colour="srgb").texels, light, atol=1e-6)
    np.testing.assert_allclose(gn.Texture(CODES, colour="linear").texels, CODES / 255.0, atol=1e-6)
    np.testing.assert_allclose(gn.Texture(CODES.astype(np.uint16), colour="linear").texels, CODES / 65535.0, atol=1e-6)
    assert gn.Texture(CODES, colour="linear").texels.dtype == np.float32  # codes fill half of its digits
    gn.scenes.Image(light).save(tmp_path / "light.exr")
    np.testing.assert_allclose(gn.Texture(tmp_path / "light.exr").texels, light, atol=1e-6)
    again = gn.Texture(tmp_path / "light.exr", colour="srgb").texels
    np.testing.assert_allclose(again, np.vectorize(lambda x: decoded(255.0 * x))(light), atol=1e-6)
    assert gn.Texture(gn.scenes.Image(light)).texels.shape == (2, 1, 3)


def test_transparency_is_announced(tmp_path):
    Pillow.fromarray(np.dstack([CODES, np.full((2, 1), 100, np.uint8)])).save(tmp_path / "glass.png")
    with pytest.warns(MeaningWarning, match="a texture leaves its coverage out"):
        gn.Texture(tmp_path / "glass.png")


def test_bad_images(tmp_path):
    (tmp_path / "text.png").write_text("no picture")
    for image, error, words in (
        (tmp_path / "none.png", NotFoundError, "none.png: No such file"),
        (tmp_path / "text.png", FormatError, "not a picture gonio reads"),
        ([[0.1, np.nan]], ParameterError, "1 of 2 texels are NaN or infinite, nan in row 0, column 1; expected"),
        ([[0.1, np.inf]], ParameterError, "inf in row 0, column 1"),
        (CODES, ArrayTypeError, 'uint8 codes; expected colour="srgb" .* or colour="linear" for codes / 255'),
        (CODES.astype(np.int64), ArrayTypeError, "int64; expected floats, or codes as uint8 or uint16"),
        (CODES * 1j, ArrayTypeError, "complex128; expected floats"),
        ([0.1, 0.2], ShapeError, r"shape \(2,\), expected \(H, W, C\) or \(H, W\)"),
        (np.zeros((0, 2)), ShapeError, r"shape \(0, 2\)"),
        (np.zeros((2, 2, 2, 2)), ShapeError, r"shape \(2, 2, 2, 2\)"),
        (0.5, ParameterError, "got a float; expected the path of a picture, a gn.scenes.Image, or an array"),
        (None, ParameterError, "got a NoneType"),
        ([["a", "b"]], ParameterError, "the image is no"),
        (np.ma.masked_less(TEXELS, 0.5), ParameterError, "some texels are masked"),
    ):
        with pytest.raises(error, match=words):
            gn.Texture(image)
    for how in ({"filter": "cubic"}, {"wrap": "black"}, {"colour": "rec2020"}, {"wrap": None}, {"filter": []}):
        with pytest.raises(ParameterError, match=r"Texture\(\w+=.*\): expected one of"):
            gn.Texture(TEXELS, **how)


def test_bad_places():
    t = gn.Texture(TEXELS)
    for uv in ([0.1], [0.1, 0.2, 0.3]):
        with pytest.raises(ShapeError, match=r"uv: got shape .*, expected \(\.\.\., 2\)"):
            t.at(uv)
    for uv in (0.5, None, "middle"):
        with pytest.raises(ArrayTypeError, match="uv: got"):
            t.at(uv)
    assert np.isnan(t.at([np.nan, 0.5])).all()
    assert np.isnan(t.at([0.5, np.inf])).all()
    assert np.isnan(gn.Texture(TEXELS, "nearest").at([[0.5, np.nan], [np.inf, 0.5]])).all()
    with pytest.raises(ParameterError, match="from 0 to 0"):
        t.channel(1)


def test_bounds_of_the_parameter_hold_for_every_texel():
    with pytest.raises(ParameterError, match=r"alpha_x=.*0 in row 1, column 0 is out of bounds; expected .* 0\.001 <="):
        gn.GGX(gn.Texture([[0.2], [0.0]]))
    with pytest.raises(ParameterError, match=r"1\.5 in row 0, column 0, channel 2 is out of bounds"):
        gn.Lambertian(gn.Texture([[[0.1, 0.2, 1.5]]]))
    with pytest.raises(ParameterError, match="out of bounds"):
        gn.Lambertian(0.5).replace(rho=gn.Texture([[-0.1]]))


def test_a_texture_is_a_value():
    t = gn.Texture(TEXELS, "nearest", "mirror")
    assert t == gn.Texture(TEXELS.copy(), "nearest", "mirror") != gn.Texture(TEXELS)
    assert pickle.loads(pickle.dumps(t)) == t
    assert hash(t) == hash(gn.Texture(TEXELS.copy(), "nearest", "mirror"))
    with pytest.raises(AccessError):
        t.wrap = "repeat"
    with pytest.raises(ValueError, match="read-only"):
        t.texels[0, 0, 0] = 1.0
    with pytest.raises(ParameterError, match="no number until there is a place"):
        t + 1.0
    m = 0.5 * gn.Lambertian(t) + gn.Microfacet(gn.GGX(gn.Texture([[0.2, 0.3]])))
    assert pickle.loads(pickle.dumps(m)) == m
    assert from_json(m.to_json()) == m
    assert (t * gn.Lambertian(0.5)).weight is t
    with pytest.raises(ParameterError, match="a text opens no files"):
        from_json({"type": "Lambertian", "rho": {"type": "Texture", "image": "wood.png"}})
    with pytest.raises(NotFoundError, match="Texture has no parameter 'gamma'"):
        from_json({"type": "Texture", "image": [[0.5]], "gamma": 2.2})


def test_its_own_texels_stay_as_they_were():
    mine = TEXELS.copy()
    t = gn.Texture(mine)
    mine[0, 0] = 0.9
    assert t.texels[0, 0, 0] == 0.0


def test_wavelengths():
    t = gn.Texture(np.stack([TEXELS, 0.5 * TEXELS], -1))
    m = gn.Lambertian(t, wavelengths=[400.0, 600.0]).at([400.0, 500.0, 600.0])
    np.testing.assert_allclose(m.at(uv=[0.5, 0.25]).rho, [0.4, 0.3, 0.2])
    with pytest.raises(ParameterError, match=r"at: Lambertian\.rho: has 2 channels without wavelengths"):
        gn.Lambertian(t).at([400.0, 500.0])
