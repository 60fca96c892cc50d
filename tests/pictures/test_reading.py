"""What pictures of others say of themselves: layers, windows, coverage, bits, curves, profiles, which way is up."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import OpenEXR
import png_files
import pytest
from picture_files import LAYERS, exr, sparse_exr, window
from png_files import chunk, gamma, icc, png

import gonio as gn
from gonio.errors import FormatError, MeaningWarning
from gonio.pictures.colour import LUMINANCE, srgb_decode
from gonio.pictures.files import _source
from gonio.pictures.files._icc import SRGB_D50, profile

pillow = pytest.importorskip("PIL.Image")

RNG = np.random.default_rng(5)


def codes(depth=16, channels=3, height=11, width=7):
    dtype = np.uint16 if depth == 16 else np.uint8
    return RNG.integers(0, 1 << depth, (height, width, channels)).astype(dtype)


def write(path, data):
    path.write_bytes(data)
    return path


# Layers -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "names",
    [
        "ViewLayer.Combined.R .G .B",
        ".R .G .B",
        "rgb.R .G .B",
        "C.r .g .b",
        "r g b",
        "red green blue",
        "a.Red .Green .Blue",
    ],
)
def test_colours_are_red_green_blue_whatever_they_are_called(tmp_path, names):
    first, *others = names.split()
    layer = first.rpartition(".")[0]
    full = [first, *(f"{layer}{x}" if x.startswith(".") else x for x in others)]
    image = gn.scenes.load_image(exr(tmp_path / "a.exr", dict(zip(full, (1, 2, 3), strict=True))))
    assert image.channels == ("R", "G", "B") and image.pixels[0, 0].tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_array_equal(gn.EnvironmentLight(tmp_path / "a.exr").incident([0, 0, 1]), [1.0, 2.0, 3.0])


def test_a_layer_is_the_colour_of_a_texture(tmp_path):
    path = exr(tmp_path / "a.exr", {"albedo.R": 0.9, "albedo.G": 0.5, "albedo.B": 0.1})
    m = gn.Lambertian(gn.Texture(path))
    np.testing.assert_allclose(np.pi * m.f([0, 0, 1], [0, 0, 1], uv=[0.5, 0.5]), [0.9, 0.5, 0.1], rtol=1e-6)


def test_numbered_channels_stand_by_their_numbers(tmp_path):
    image = gn.scenes.load_image(exr(tmp_path / "a.exr", {"ch0": 0, "ch1": 1, "ch10": 10, "ch2": 2}))
    assert image.channels == ("ch0", "ch1", "ch2", "ch10") and image.pixels[0, 0].tolist() == [0, 1, 2, 10]


def test_several_layers_are_asked_about_by_everything_that_takes_a_path(tmp_path):
    path = exr(tmp_path / "a.exr", LAYERS)
    for taker in (gn.scenes.load_image, gn.EnvironmentLight, gn.Texture, gn.EnvironmentLight.from_mitsuba):
        with pytest.raises(FormatError, match=r"2 layers, '' \(R, G, B, A, Z\), 'albedo' \(R, G, B\): .*layer=''"):
            taker(path)
    for layer, expected in (("", [1, 2, 3]), ("albedo", [0.1, 0.2, 0.3]), ("Z", [9]), ("albedo.G", [0.2])):
        image = gn.scenes.load_image(path, layer=layer)
        np.testing.assert_allclose(image.pixels[2, 3], expected, rtol=1e-6)
        np.testing.assert_allclose(gn.EnvironmentLight(image).incident([0, 0, 1]), expected, rtol=1e-6)
        assert (image.alpha is not None) is (layer == "")
    assert gn.scenes.load_image(path, layer="*").channels == ("R", "G", "B", "Z", "albedo.B", "albedo.G", "albedo.R")
    with pytest.raises(FormatError, match=r"layer='albdo'.*did you mean 'albedo'"):
        gn.scenes.load_image(path, layer="albdo")


def test_what_stands_beside_colours_is_left_out_and_told(tmp_path):
    path = exr(tmp_path / "a.exr", {k: LAYERS[k] for k in "RGBAZ"})
    with pytest.warns(MeaningWarning, match="Z beside R, G, B is left out; layer='Z'"):
        image = gn.scenes.load_image(path)
    assert image.channels == ("R", "G", "B") and image.alpha[0, 0] == 0.5


def test_parts_are_layers_by_their_names(tmp_path):
    rgb = {"R": 1, "G": 2, "B": 3}
    path = exr(
        tmp_path / "a.exr", None, {"beauty": rgb, "depth": {"depth.Z": 4}, "more": {"x.R": 5, "x.G": 6, "x.B": 7}}
    )
    with pytest.raises(FormatError, match=r"3 layers, 'beauty' \(R, G, B\), 'depth.depth' .*, 'more.x'"):
        gn.scenes.load_image(path)
    for layer, first in (("beauty", 1), ("depth", 4), ("depth.depth", 4), ("more.x", 5), ("more", 5), ("x", 5)):
        assert gn.scenes.load_image(path, layer=layer).pixels[0, 0, 0] == first


@pytest.mark.parametrize(
    "names",
    [
        ("450.0", "550.5", "1000.0"),
        ("T.450,0nm", "T.450,0nm.550,0nm", "T.1000,0nm"),
        ("S0.450,000000nm", "S0.550,000000nm"),
        ("0.55 um", "0.6 um"),
        ("X", "Y", "Z"),
    ],
)
def test_wavelengths_and_numbers_are_no_layers(tmp_path, names):
    """... of what gonio writes itself, with coverage and without."""
    pixels = np.arange(1.0, 1.0 + len(names)) * np.ones((2, 2, 1))
    for alpha in (None, np.ones((2, 2))):
        gn.scenes.Image(pixels, alpha, names).save(tmp_path / "a.exr")
        back = gn.scenes.load_image(tmp_path / "a.exr")
        assert back.channels == names and (back.alpha is None) is (alpha is None)
        np.testing.assert_array_equal(back.pixels, pixels)


def test_a_spectrum_beside_colours_for_viewers_is_a_layer(tmp_path):
    path = exr(tmp_path / "a.exr", {"R": 1, "G": 1, "B": 1, "S0.450,0nm": 4, "S0.550,0nm": 5})
    assert gn.scenes.load_image(path, layer="S0").pixels[0, 0].tolist() == [4, 5]


def test_only_openexr_has_layers(tmp_path):
    gn.scenes.Image(np.ones((2, 2, 3))).save(tmp_path / "a.png")
    gn.scenes.load_image(tmp_path / "a.png", layer="")
    with pytest.raises(FormatError, match="no layers"):
        gn.scenes.load_image(tmp_path / "a.png", layer="albedo")


def chroma(path, rgb):
    """A file of luminance, and of chroma at every second row and column; its weights are those of sRGB."""
    Y = rgb @ LUMINANCE
    return sparse_exr(path, {"Y": Y, **{n: ((rgb[..., k] - Y) / Y)[::2, ::2] for k, n in ((0, "RY"), (2, "BY"))}})


@pytest.mark.parametrize("size", [(30, 40), (2, 2), (16, 2)])
def test_luminance_and_chroma_become_colours(tmp_path, size):
    y, x = np.mgrid[: size[0], : size[1]]
    level = 0.5 + 0.4 * np.sin(x + 2.0 * y)  # changes from pixel to pixel; the colour does not
    path = chroma(tmp_path / "a.exr", level[..., None] * [0.9, 0.5, 0.2])
    image = gn.scenes.load_image(path)
    assert image.channels == ("R", "G", "B") and image.alpha is None
    np.testing.assert_allclose(image.pixels, level[..., None] * [0.9, 0.5, 0.2], rtol=1e-5)
    np.testing.assert_allclose(
        gn.scenes.load_image(path, layer="Y").pixels[..., 0], image.pixels @ LUMINANCE, rtol=1e-5
    )


def test_chroma_is_interpolated_by_openexrs_filter(tmp_path):
    """27 taps, every second one 0: cubic chroma is kept but for its digits, away from the edges."""
    y, x = np.mgrid[:60, :80] / 80.0
    rgb = np.stack([0.5 + 0.2 * x**2 * y, 0.5 + 0.1 * y, 0.4 + 0.2 * x * y], -1)
    image = gn.scenes.load_image(chroma(tmp_path / "a.exr", rgb))
    np.testing.assert_allclose(image.pixels[14:-14, 14:-14], rgb[14:-14, 14:-14], atol=2e-5)
    spike = np.full((30, 30, 3), 0.5)
    spike[10, 10] = [2.0, 0.5, 0.5]
    found = gn.scenes.load_image(chroma(tmp_path / "b.exr", spike)).pixels
    ry = (2.0 - spike[10, 10] @ LUMINANCE) / (spike[10, 10] @ LUMINANCE)
    for away, tap in ((1, 0.627123), (3, -0.186077), (13, 0.002128)):
        assert found[10, 10 + away, 0] / 0.5 - 1.0 == pytest.approx(tap * ry, rel=1e-4)
    saturated = 1.0 - found.min(axis=-1) / found.max(axis=-1)
    assert saturated[10, 10] <= 0.75 + 0.25 * 0.5  # as saturated as what lies diagonally beside it lets it be


def test_channels_at_fewer_pixels_are_told_as_that(tmp_path):
    sparse_exr(tmp_path / "a.exr", {"Y": np.ones((4, 4)), "w": np.ones((2, 2))})
    with pytest.raises(FormatError, match=r"w has no number at most pixels; .*layer='Y' reads Y") as caught:
        gn.scenes.load_image(tmp_path / "a.exr")
    assert "damaged" not in str(caught.value) and "deep" not in str(caught.value)


# Coverage -----------------------------------------------------------------------------------------


def test_lights_are_what_is_stored_and_textures_are_divided_by_coverage(tmp_path):
    path = exr(tmp_path / "a.exr", {"R": 0.5, "G": 0.5, "B": 0.5, "A": 0.5})
    image = gn.scenes.load_image(path)
    assert image.premultiplied and image.pixels[0, 0, 0] == image.light[0, 0, 0] == 0.5 and image.colour[0, 0, 0] == 1.0
    for light in (path, image, gn.scenes.Image(np.ones((4, 8, 3)), np.full((4, 8), 0.5))):
        np.testing.assert_allclose(gn.EnvironmentLight(light).incident([0, 0, 1]), 0.5)
    with pytest.warns(MeaningWarning, match="transparent"):
        assert gn.Texture(path).texels.max() == 1.0
    assert gn.Texture(image).texels.max() == 1.0


def test_light_without_coverage_stays(tmp_path):
    """A flame covers nothing and shines."""
    path = exr(tmp_path / "a.exr", {"R": 3.0, "G": 2.0, "B": 1.0, "A": 0.0})
    image = gn.scenes.load_image(path)
    np.testing.assert_array_equal(gn.EnvironmentLight(image).incident([0, 0, 1]), [3, 2, 1])
    image.save(tmp_path / "b.exr")
    np.testing.assert_array_equal(gn.scenes.load_image(tmp_path / "b.exr").light, image.light)
    image.save(tmp_path / "b.hdr")
    np.testing.assert_array_equal(gn.scenes.load_image(tmp_path / "b.hdr").pixels, image.light)
    assert gn.scenes.picture_difference(image, image).inside.all()


def test_both_kinds_of_pixels_are_one_picture(tmp_path):
    alpha = RNG.uniform(0.1, 1.0, (5, 6)).astype(np.float32)
    straight = gn.scenes.Image(RNG.uniform(0.1, 0.9, (5, 6, 3)), alpha, error=np.full((5, 6, 3), 0.1))
    multiplied = gn.scenes.Image(straight.light, alpha, error=0.1 * alpha[..., None] * np.ones(3), premultiplied=True)
    np.testing.assert_allclose(multiplied.colour, straight.colour, rtol=1e-6)
    found = gn.scenes.picture_difference(straight, multiplied)
    assert found.rms < 1e-6 and found.sigmas < 1e-5
    for suffix in ("png", "exr", "hdr"):
        for name, image in (("a", straight), ("b", multiplied)):
            image.save(tmp_path / f"{name}.{suffix}")
        a, b = (gn.scenes.load_image(tmp_path / f"{name}.{suffix}") for name in "ab")
        np.testing.assert_allclose(a.light, b.light, atol=0.005)
    rendered = gn.render(gn.Lambertian(0.5), gn.ConstantLight(1.0), size=8, samples=4)
    rendered.save(tmp_path / "r.exr")
    back = gn.scenes.load_image(tmp_path / "r.exr")
    assert not rendered.premultiplied and back.premultiplied
    np.testing.assert_array_equal(back.pixels, rendered.light)


# Windows ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("covered", [False, True])
@pytest.mark.parametrize(
    ("data", "display"),
    [  # the arrangements of DisplayWindow/t01 ... t14 of OpenEXR's conformance files, smaller
        *(
            ((0, 0, 39, 29), x)
            for x in ((0, 0, 39, 29), (1, 1, 40, 30), (3, 2, 39, 29), (0, 0, 36, 27), (3, 2, 36, 27))
        ),
        *(((0, 0, 39, 29), x) for x in ((-1, -1, 40, 30), (-4, -4, 44, 33), (39, 29, 49, 39), (-10, -10, 0, 0))),
        ((3, 4, 42, 33), (0, 0, 50, 40)),
    ],
)
def test_the_display_window_is_read(tmp_path, data, display, covered):
    height, width = data[3] - data[1] + 1, data[2] - data[0] + 1
    planes = {name: RNG.random((height, width)).astype(np.float32) for name in ("RGBA" if covered else "RGB")}
    path = exr(tmp_path / "a.exr", planes, dataWindow=window(*data), displayWindow=window(*display))
    image = gn.scenes.load_image(path)
    assert image.pixels.shape[:2] == (display[3] - display[1] + 1, display[2] - display[0] + 1)
    y, x = np.mgrid[display[1] : display[3] + 1, display[0] : display[2] + 1]
    inside = (x >= data[0]) & (x <= data[2]) & (y >= data[1]) & (y <= data[3])
    at = np.clip(y - data[1], 0, height - 1), np.clip(x - data[0], 0, width - 1)
    for k, name in enumerate("RGB"):
        np.testing.assert_array_equal(image.pixels[..., k], np.where(inside, planes[name][at], 0.0))
    if image.alpha is None:
        assert inside.all() and not covered
    else:
        np.testing.assert_array_equal(image.alpha, inside * (planes["A"][at] if covered else 1.0))


def test_what_shows_nothing_of_its_pixels_is_black_and_told(tmp_path):
    path = exr(tmp_path / "a.exr", {"Y": 1.0}, displayWindow=window(100, 0, 107, 3))
    with pytest.warns(MeaningWarning, match="black"):
        image = gn.scenes.load_image(path)
    assert image.pixels.shape == (4, 8, 1) and not image.pixels.any() and not image.alpha.any()


def test_a_map_of_the_lower_half_lights_from_below(tmp_path):
    path = exr(tmp_path / "a.exr", {"Y": 1.0}, dataWindow=window(0, 4, 7, 7), displayWindow=window(0, 0, 7, 7))
    light = gn.EnvironmentLight(path)
    assert light.incident([0, 0, 1]) == 0.0 and light.incident([0, 0, -1]) == 1.0


def test_pixels_that_are_not_square_are_told(tmp_path):
    with pytest.warns(MeaningWarning, match="1.5 times as wide as high"):
        gn.scenes.load_image(exr(tmp_path / "a.exr", {"Y": 1.0}, pixelAspectRatio=1.5))


def test_maps_of_a_cube_are_told(tmp_path):
    with pytest.warns(MeaningWarning, match="six faces of a cube"):
        gn.scenes.load_image(exr(tmp_path / "a.exr", {"Y": 1.0}, envmap=OpenEXR.ENVMAP_CUBE))


def test_a_small_file_does_not_show_gigabytes(tmp_path):
    path = exr(tmp_path / "a.exr", {"Y": 1.0}, displayWindow=window(0, 0, 2047, 2047))
    assert gn.scenes.load_image(path).pixels.shape == (2048, 2048, 1)
    for corners in ((0, 0, 16383, 16383), (-50000, -50000, 50000, 50000)):
        path = exr(tmp_path / "a.exr", {"Y": 1.0}, displayWindow=window(*corners))
        with pytest.raises(FormatError, match="the header says"):
            gn.scenes.load_image(path)


# Codes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("depth", [8, 16])
def test_all_bits_of_a_png_are_read(tmp_path, channels, depth):
    found = codes(depth, channels)
    image = gn.scenes.load_image(write(tmp_path / "a.png", png(found)), linear=True)
    top = (1 << depth) - 1
    colours = channels - (channels % 2 == 0)
    np.testing.assert_allclose(image.pixels, found[..., :colours] / top, rtol=1e-6)
    assert image.channels == (("Y",) if colours == 1 else ("R", "G", "B"))
    if colours < channels:
        np.testing.assert_allclose(image.alpha, found[..., -1] / top, rtol=1e-6)
    image = gn.scenes.load_image(tmp_path / "a.png")
    np.testing.assert_allclose(image.pixels, srgb_decode(found[..., :colours] / top), rtol=1e-6)


def test_an_interlaced_png_of_16_bits_is_the_same(tmp_path):
    """Seven passes, each a small picture (PNG, 8.2)."""
    found = codes(16, 3, 13, 10)
    body = b""
    for y, x, dy, dx in (
        (0, 0, 8, 8),
        (0, 4, 8, 8),
        (4, 0, 8, 4),
        (0, 2, 4, 4),
        (2, 0, 4, 2),
        (0, 1, 2, 2),
        (1, 0, 2, 1),
    ):
        rows = found[y::dy, x::dx].astype(">u2")
        body += b"".join(b"\0" + row.tobytes() for row in rows if row.size)
    head = chunk(b"IHDR", struct.pack(">2I5B", 10, 13, 16, 2, 0, 0, 1))
    data = png_files.SIGNATURE + head + chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")
    image = gn.scenes.load_image(write(tmp_path / "a.png", data), linear=True)
    np.testing.assert_allclose(image.pixels, found / 65535.0, rtol=1e-6)


def test_palettes_are_pillows_own_colours(tmp_path):
    picture = pillow.fromarray(codes(8)).convert("P", palette=pillow.Palette.ADAPTIVE)
    for name, options in (("a", {}), ("b", {"transparency": 3}), ("c", {"transparency": bytes(range(0, 200, 2))})):
        picture.save(tmp_path / f"{name}.png", **options)
        image = gn.scenes.load_image(tmp_path / f"{name}.png")
        with pillow.open(tmp_path / f"{name}.png") as again:
            expected = np.asarray(again.convert("RGBA" if options else "RGB"))
        np.testing.assert_allclose(image.pixels, srgb_decode(expected[..., :3] / 255.0), rtol=1e-6)
        assert (image.alpha is None) is not options or np.allclose(image.alpha, expected[..., 3] / 255.0)


@pytest.mark.parametrize(("depth", "channels"), [(1, 1), (2, 1), (4, 1), (8, 1), (8, 3), (16, 1), (16, 3)])
def test_one_colour_may_be_transparent(tmp_path, depth, channels):
    """tRNS has the codes of the file, of as many bits as these have."""
    found = codes(depth, channels)
    key = found[3, 2].tolist()
    data = png(found, (b"tRNS", struct.pack(f">{channels}H", *key)), depth=depth)
    image = gn.scenes.load_image(write(tmp_path / "a.png", data), linear=True)
    np.testing.assert_allclose(image.pixels, found / float((1 << depth) - 1), rtol=1e-6)
    np.testing.assert_array_equal(image.alpha, (found != key).any(axis=-1))


def test_gamma_is_obeyed_and_srgb_counts_more(tmp_path):
    found = codes(16)
    x = found / 65535.0
    for chunks, expected in (
        ([gamma(1.0)], x),
        ([gamma(1 / 1.8)], x**1.8),
        ([gamma(0.45455)], srgb_decode(x)),
        ([gamma(1.0), (b"sRGB", b"\0")], srgb_decode(x)),
        ([gamma(1.0), (b"cICP", b"\1\x0d\0\1")], srgb_decode(x)),
        ([(b"cICP", b"\1\x08\0\1")], x),
    ):
        image = gn.scenes.load_image(write(tmp_path / "a.png", png(found, *chunks)))
        np.testing.assert_allclose(image.pixels, expected, rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(gn.scenes.load_image(tmp_path / "a.png", linear=False).pixels, srgb_decode(x), rtol=1e-6)
    aces = struct.pack(">8I", 32168, 33767, 73470, 26530, 0, 100000, 10, 7000)
    with pytest.warns(MeaningWarning, match=r"primaries are \(0.7347, 0.2653, 0.0, 1.0"):
        gn.scenes.load_image(write(tmp_path / "a.png", png(found, gamma(1.0), (b"cHRM", aces))))
    with pytest.warns(MeaningWarning, match="transfer 16"):
        gn.scenes.load_image(write(tmp_path / "a.png", png(found, (b"cICP", b"\x09\x10\0\1"))))


def test_the_curves_of_a_profile_are_obeyed(tmp_path):
    cms = pytest.importorskip("PIL.ImageCms")
    found = codes(16)
    x = found / 65535.0
    kept = cms.ImageCmsProfile(cms.createProfile("sRGB")).tobytes()
    squared = np.rint(65535.0 * np.linspace(0.0, 1.0, 4097) ** 2).astype(">u2")
    for data, expected in (
        (kept, srgb_decode(x)),
        (png_files.profile(b"curv" + bytes(8), SRGB_D50), x),
        (png_files.profile(b"curv" + bytes(4) + struct.pack(">IH", 1, 461), SRGB_D50), x ** (461 / 256)),
        (png_files.profile(b"curv" + bytes(4) + struct.pack(">I", 4097) + squared.tobytes(), SRGB_D50), x**2),
        (png_files.profile(b"para" + bytes(4) + struct.pack(">2Hi", 0, 0, 3 << 16), SRGB_D50), x**3),
    ):
        image = gn.scenes.load_image(write(tmp_path / "a.png", png(found, gamma(0.1), icc(data))))
        np.testing.assert_allclose(image.pixels, expected, rtol=1e-4, atol=1e-5)
    wide = png_files.profile(b"curv" + bytes(8), SRGB_D50[:, [1, 0, 2]])
    with pytest.warns(MeaningWarning, match="primaries of its ICC profile"):
        image = gn.scenes.load_image(write(tmp_path / "a.png", png(found, icc(wide))))
    np.testing.assert_allclose(image.pixels, x, rtol=1e-5)
    for damaged in (wide[:200], wide[:128] + b"\xff" * 300, b""):
        with pytest.warns(MeaningWarning, match="damaged"):
            gn.scenes.load_image(write(tmp_path / "a.png", png(found, icc(damaged))))
    pillow.fromarray((x * 255).astype(np.uint8)).save(tmp_path / "a.jpg", quality=100, icc_profile=kept)
    assert gn.scenes.load_image(tmp_path / "a.jpg").pixels.shape == x.shape


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        ((2.0, 2.0, -0.5), lambda x: np.maximum(2.0 * x - 0.5, 0.0) ** 2),
        ((2.0, 2.0, -0.5, 0.125), lambda x: np.maximum(2.0 * x - 0.5, 0.0) ** 2 + 0.125),
        ((3.0, 1.0, 0.0, 0.5, 0.25), lambda x: np.where(x >= 0.25, x**3, 0.5 * x)),
        ((3.0, 0.5, 0.0, 0.5, 0.25, 0.125, 0.0625), lambda x: np.where(x >= 0.25, x**3 / 8 + 0.125, 0.5 * x + 0.0625)),
    ],
)
def test_parametric_curves_are_those_of_the_standard(numbers, expected):
    """ICC.1, table 68: functions 1 to 4."""
    x = np.linspace(0.0, 1.0, 101)
    curve = b"para" + bytes(4) + struct.pack(">2H", len(numbers) - (2 if len(numbers) < 6 else 3), 0)
    curve += struct.pack(f">{len(numbers)}i", *np.rint(65536.0 * np.array(numbers)).astype(int))
    found = profile(png_files.profile(curve, SRGB_D50), 3, x)
    np.testing.assert_allclose(found.light, np.broadcast_to(expected(x), (3, 101)), atol=1e-9)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_jpeg_stands_as_its_exif_says(tmp_path, orientation):
    ops = pytest.importorskip("PIL.ImageOps")
    picture = pillow.fromarray(np.kron(codes(8, 3, 2, 3), np.ones((16, 16, 1), np.uint8)))
    exif = pillow.Exif()
    exif[0x0112] = orientation
    picture.save(tmp_path / "a.jpg", exif=exif, quality=100)
    with pillow.open(tmp_path / "a.jpg") as again:
        expected = np.asarray(ops.exif_transpose(again))
    image = gn.scenes.load_image(tmp_path / "a.jpg")
    np.testing.assert_allclose(image.pixels, srgb_decode(expected / 255.0), rtol=1e-6)
    assert image.pixels.flags.c_contiguous


def test_data_in_codes_are_taken_as_they_are(tmp_path):
    """Normal maps and roughness of 16 bits, whatever the file says of its gamma."""
    found = codes(16)
    path = write(tmp_path / "a.png", png(found, gamma(0.45455)))
    np.testing.assert_allclose(gn.Texture(path, colour="linear").texels, found / 65535.0, rtol=1e-6)
    np.testing.assert_allclose(gn.Texture(path).texels, srgb_decode(found / 65535.0), rtol=1e-6)
    linear = write(tmp_path / "b.png", png(found, gamma(1.0)))
    np.testing.assert_allclose(gn.Texture(linear).texels, found / 65535.0, rtol=1e-6)
    np.testing.assert_allclose(gn.Texture(linear, colour="srgb").texels, srgb_decode(found / 65535.0), rtol=1e-6)
    gn.scenes.Image(srgb_decode(found / 65535.0)).save(tmp_path / "c.exr")
    np.testing.assert_allclose(gn.Texture(tmp_path / "c.exr", colour="linear").texels, srgb_decode(found / 65535.0))


def test_rows_are_read_some_at_a_time(tmp_path, monkeypatch):
    """A picture in one block of rows, and in many, is the same."""
    found = codes(16, 4, 40, 30)
    path = write(tmp_path / "a.png", png(found))
    whole = gn.scenes.load_image(path)
    monkeypatch.setattr(_source, "_BLOCK", 100)
    parts = gn.scenes.load_image(path)
    np.testing.assert_array_equal(parts.pixels, whole.pixels)
    np.testing.assert_array_equal(parts.alpha, whole.alpha)
