"""Pictures: exact values, round trips, orientations, Mitsuba as a second reader, and damaged files."""

import os
import struct
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from places import real

from gonio import errors
from gonio.pictures import image as image_module
from gonio.pictures.colour import srgb_decode, srgb_encode
from gonio.pictures.image import Image, load_image

HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"


def smooth(height=9, width=17, channels=3):
    y, x, c = np.mgrid[:height, :width, :channels]
    return (0.25 + np.floor(x / 4) + y / height + 0.1 * c).astype(np.float32)


def rgbe(height=9, width=17, seed=3):
    """Normalized RGBE bytes with runs in them."""
    rng = np.random.default_rng(seed)
    codes = rng.integers(0, 256, (height, width, 4)).astype(np.uint8)
    codes[..., 0] |= 128
    codes[..., 3] = rng.integers(120, 136)
    codes[:, 3 : width - 2, 1] = 77
    return codes


def decode(codes):
    return codes[..., :3] * np.ldexp(1.0, codes[..., 3:].astype(int) - 136)


def hdr(codes, body=None, header=b"", size=None):
    size = size or b"-Y %d +X %d" % codes.shape[:2]
    return HDR + header + b"\n" + size + b"\n" + (codes.tobytes() if body is None else body)


def run_length(codes):
    """New run-length coding, by the definition: runs of 2 to 127, literals of 1 to 128."""
    out = bytearray()
    for row in codes:
        out += bytes([2, 2, *divmod(len(row), 256)])
        for component in row.T:
            at = 0
            while at < len(row):
                run = 1
                while run < 127 and at + run < len(row) and component[at + run] == component[at]:
                    run += 1
                literal = min(7, len(row) - at)
                out += bytes([128 + run, component[at]]) if run > 1 else bytes([literal, *component[at : at + literal]])
                at += run if run > 1 else literal
    return bytes(out)


def write(tmp_path, data, name="x.hdr"):
    path = tmp_path / name
    path.write_bytes(data)
    return path


@pytest.fixture
def mitsuba():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    return mi


# sRGB ---------------------------------------------------------------------------------------------


def test_srgb_has_the_values_of_the_standard():
    assert srgb_encode(0.0) == 0.0 and srgb_encode(1.0) == pytest.approx(1.0, abs=1e-15)
    assert srgb_encode(0.0031308) == pytest.approx(12.92 * 0.0031308, abs=1e-15)
    # 1.055 * 0.18**(1/2.4) - 0.055 and ((0.5 + 0.055) / 1.055)**2.4, by hand to ten digits
    assert srgb_encode(0.18) == pytest.approx(0.4613561295, abs=1e-9)
    assert srgb_decode(0.5) == pytest.approx(0.2140411405, abs=1e-9)
    assert srgb_encode(-0.5) == -0.5 * 12.92 and np.isnan(srgb_encode(np.nan))
    assert srgb_encode(np.float32(0.5)).dtype == np.float32 and srgb_encode(1).dtype == np.float64


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 1e-6), (np.float64, 1e-7)])
def test_srgb_functions_are_inverse(dtype, tolerance):
    x = np.concatenate([np.linspace(-0.1, 4.0, 4001), np.linspace(0.0031, 0.0032, 101)]).astype(dtype)
    np.testing.assert_allclose(srgb_decode(srgb_encode(x)), x, rtol=tolerance, atol=5e-8)
    assert np.all(np.diff(srgb_encode(np.sort(x))) >= 0)


# Image --------------------------------------------------------------------------------------------


def test_image_checks_what_it_holds():
    with pytest.raises(errors.ShapeError, match=r"expected \(H, W, C\)"):
        Image(np.zeros((4, 4), np.float32))
    with pytest.raises(errors.ShapeError):
        Image(np.zeros((0, 4, 3), np.float32))
    with pytest.raises(errors.ShapeError, match="alpha"):
        Image(smooth(), np.ones((3, 3)))
    with pytest.raises(errors.ArrayTypeError, match="uint8"):
        Image(np.zeros((4, 4, 3), np.uint8))
    for names in (("R", "G"), ("R", "G", "G"), ("R", "G", ""), ("R", "G", "A"), ("R", "G", "x" * 256)):
        with pytest.raises(errors.ParameterError, match="channels"):
            Image(smooth(), channels=names)
    image = Image(smooth().astype(np.float64), np.ones((9, 17)))
    assert image.pixels.dtype == image.alpha.dtype == np.float32
    assert repr(image) == "Image(17 x 9, 3 channels, alpha)"
    assert repr(Image(smooth(), channels=("R", "G", "B"))) == "Image(17 x 9, R, G, B)"
    with pytest.raises(AttributeError):
        image.pixels = smooth()


# PNG ----------------------------------------------------------------------------------------------


def test_png_holds_exact_codes(tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    linear = np.array([0.0, 0.0031308, 0.18, 0.2140411405, 0.5, 1.0, 2.0, -1.0], np.float32)
    codes = [0, 10, 118, 128, 188, 255, 255, 0]  # round(255 V); 0.0031308 -> 10.3, 0.18 -> 117.6
    Image(np.broadcast_to(linear[None, :, None], (2, 8, 3))).save(tmp_path / "a.png")
    with pillow.open(tmp_path / "a.png") as picture:
        assert picture.mode == "RGB" and picture.info["srgb"] == 0
        np.testing.assert_array_equal(np.asarray(picture)[1], np.repeat(np.array(codes)[:, None], 3, axis=1))
    Image(linear[None, :, None]).save(tmp_path / "g.PNG", exposure=1.0)
    with pillow.open(tmp_path / "g.PNG") as picture:
        assert picture.mode == "L"
        np.testing.assert_array_equal(
            np.asarray(picture)[0],
            np.floor(255 * srgb_encode(np.clip(2.0 * linear.astype(float), 0, 1)) + 0.5),
        )


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("covered", [False, True])
def test_png_round_trip_keeps_codes_and_alpha(tmp_path, channels, covered):
    codes = np.arange(256 * channels).reshape(16, 16, channels) % 256
    alpha = (np.arange(256).reshape(16, 16) / 255.0).astype(np.float32) if covered else None
    image = Image(srgb_decode(codes / 255.0), alpha)
    image.save(tmp_path / "a.png")
    back = load_image(tmp_path / "a.png")
    np.testing.assert_array_equal(back.pixels, image.pixels)
    assert back.channels == (("Y",) if channels == 1 else ("R", "G", "B"))
    assert (back.alpha is None) is not covered
    if covered:
        np.testing.assert_allclose(back.alpha, alpha, atol=1e-7)


def test_png_counts_nan_and_clamps_infinity(tmp_path):
    pixels = smooth()
    pixels[1, 2, 0] = pixels[1, 2, 1] = pixels[3, 3, 2] = np.nan
    pixels[0, 0] = (np.inf, -np.inf, 0.0)
    with pytest.warns(errors.MissingDataWarning, match="2 of 153 pixels are NaN") as caught:
        Image(pixels).save(tmp_path / "a.png")
    assert caught[0].filename == __file__
    back = load_image(tmp_path / "a.png").pixels
    assert back[1, 2, 0] == back[3, 3, 2] == 0.0
    np.testing.assert_array_equal(back[0, 0], [1.0, 0.0, 0.0])


def test_other_png_and_jpeg_modes(tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    ramp = (np.arange(64).reshape(8, 8) * 1024).astype(np.uint16)
    pillow.fromarray(ramp).save(tmp_path / "deep.png")
    np.testing.assert_allclose(load_image(tmp_path / "deep.png").pixels[..., 0], srgb_decode(ramp / 65535.0), rtol=1e-6)
    flat = pillow.new("RGB", (8, 8), (200, 100, 50))
    flat.convert("P", palette=pillow.Palette.ADAPTIVE).save(tmp_path / "palette.png")
    flat.save(tmp_path / "a.jpg", quality=100)
    flat.convert("CMYK").save(tmp_path / "cmyk.jpg", quality=100)
    expected = srgb_decode(np.array([200, 100, 50]) / 255.0)
    for name in ("palette.png", "a.jpg", "cmyk.jpg"):
        with pytest.warns(errors.MeaningWarning, match="CMYK") if name == "cmyk.jpg" else nullcontext():
            image = load_image(tmp_path / name)
        assert image.channels == ("R", "G", "B")
        np.testing.assert_allclose(image.pixels[4, 4], expected, atol=0.02)


# OpenEXR ------------------------------------------------------------------------------------------


@pytest.fixture
def openexr():
    return pytest.importorskip("OpenEXR")


@pytest.mark.parametrize(
    ("channels", "names", "found"),
    [
        (1, None, ("Y",)),
        (3, None, ("R", "G", "B")),
        (3, ("X", "Y", "Z"), ("X", "Y", "Z")),
        (2, None, ("C0000", "C0001")),
        (2, ("S0.550nm", "S0.450nm"), ("S0.450nm", "S0.550nm")),
        (5, ("Z", "B", "green", "R", "u"), ("B", "R", "Z", "green", "u")),
    ],
)
@pytest.mark.parametrize("covered", [False, True])
def test_exr_round_trip_is_exact(openexr, tmp_path, channels, names, found, covered):
    pixels = smooth(channels=channels)
    pixels[0, :4, 0] = (np.nan, np.inf, -np.inf, 1e-42)
    alpha = (2.0 ** np.linspace(-9, 0, 9 * 17).round()).astype(np.float32).reshape(9, 17) if covered else None
    Image(pixels, alpha, names).save(tmp_path / "a.exr")
    back = load_image(tmp_path / "a.exr")
    assert back.channels == found and back.pixels.dtype == np.float32 and back.pixels.flags.c_contiguous
    order = [(names or found).index(n) for n in found]
    # Files hold pixels times alpha; with powers of two only the smallest number loses digits by that.
    kept = np.abs(pixels[..., order]) > 1e-40 if covered else np.full(back.pixels.shape, True)
    np.testing.assert_array_equal(back.colour[kept], pixels[..., order][kept])
    assert (back.alpha is None) is not covered and back.premultiplied is covered
    if covered:
        np.testing.assert_array_equal(back.alpha, alpha)
        stored = openexr.File(str(tmp_path / "a.exr"), separate_channels=True).channels()[found[0]].pixels
        np.testing.assert_array_equal(stored, pixels[..., order[0]] * alpha)
        np.testing.assert_array_equal(stored, back.pixels[..., 0])


def test_exr_of_other_writers(openexr, tmp_path):
    path = str(tmp_path / "a.exr")
    gray = smooth(channels=1)[..., 0]
    planes = {"R": gray, "G": (2 * gray).astype(np.float16), "B": gray.astype(np.uint32), "Z": gray}
    tiles = openexr.TileDescription()
    tiles.xSize = tiles.ySize = 8
    header = {"compression": openexr.PIZ_COMPRESSION, "type": openexr.tiledimage, "tiles": tiles}
    openexr.File(header, dict(planes)).write(path)  # it puts its own objects into the dict
    image = load_image(path, layer="*")
    assert image.channels == ("R", "G", "B", "Z")
    np.testing.assert_array_equal(image.pixels[..., 1], planes["G"])
    np.testing.assert_array_equal(image.pixels[..., 2], np.floor(gray))
    scan = {"type": openexr.scanlineimage}
    aces = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
    openexr.File({**scan, "chromaticities": aces}, {"Y": gray}).write(path)
    with pytest.warns(UserWarning, match=r"primaries are \(0\.7347"):
        load_image(path)
    openexr.File(scan, {"A": gray}).write(path)
    assert load_image(path).alpha is None and load_image(path).pixels.shape == (9, 17, 1)


def test_exr_whose_first_part_is_damaged_is_not_the_second(openexr, tmp_path, capfd):
    # The library drops the damaged part, and its second part then answers to number 0.
    ramp = np.repeat(np.arange(64, dtype=np.float32)[:, None], 64, axis=1)
    header = {"type": openexr.scanlineimage, "compression": openexr.ZIP_COMPRESSION}
    path = tmp_path / "a.exr"
    openexr.File([openexr.Part(dict(header), {n: ramp}, n) for n in ("one", "two")]).write(str(path))
    data = bytearray(path.read_bytes())
    first = data.index(b"x^")  # head of a zlib stream
    data[first : first + 12] = bytes(12)
    path.write_bytes(data)
    for part in ("one", "two"):
        with pytest.raises(errors.FormatError, match="damaged or unsupported OpenEXR"):
            load_image(path, layer=part)
    assert capfd.readouterr().out == ""  # what the library prints goes into the message


def test_exr_reading_in_threads_gives_standard_output_back(openexr, tmp_path):
    Image(smooth()).save(tmp_path / "a.exr")
    before = sys.stdout
    with ThreadPoolExecutor(8) as pool:
        images = list(pool.map(load_image, [tmp_path / "a.exr"] * 200))
    assert sys.stdout is before
    assert all(np.array_equal(image.pixels, smooth()) for image in images)


def test_exr_that_cannot_be_a_picture(openexr, tmp_path):
    Image(smooth()).save(tmp_path / "a.exr")
    data = (tmp_path / "a.exr").read_bytes()
    at = data.index(b"dataWindow\0box2i\0") + 21
    for right, bottom in ((10**6, 10**6), (2**31 - 1, 2**31 - 1), (-5, 3), (3735618, 69)):
        window = data[:at] + struct.pack("<4i", 0, 0, right, bottom) + data[at + 16 :]
        with pytest.raises(errors.FormatError, match="the header says"):
            load_image(write(tmp_path, window, "b.exr"))
    tiled = {"type": openexr.tiledimage, "tiles": openexr.TileDescription()}
    openexr.File(tiled, {"Y": smooth(channels=1)[..., 0]}).write(str(tmp_path / "t.exr"))
    data = (tmp_path / "t.exr").read_bytes()
    at = data.index(b"tiles\0tiledesc\0") + 19
    with pytest.raises(errors.FormatError, match=r"tiles of \(16777248, 32\)"):
        load_image(write(tmp_path, data[:at] + struct.pack("<2I", 16777248, 32) + data[at + 8 :], "t.exr"))
    deep = np.empty((2, 2), object)
    for index in np.ndindex(2, 2):
        deep[index] = np.ones(2, np.float32)
    header = {"type": openexr.deepscanline, "compression": openexr.ZIPS_COMPRESSION}
    openexr.File(header, {"Z": deep}).write(str(tmp_path / "d.exr"))
    with pytest.raises(errors.FormatError, match="deep"):
        load_image(tmp_path / "d.exr")


def test_exr_agrees_with_mitsuba(openexr, mitsuba, tmp_path):
    pixels = smooth(40, 70)
    Image(pixels).save(tmp_path / "a.exr")
    np.testing.assert_array_equal(np.array(mitsuba.Bitmap(str(tmp_path / "a.exr"))), pixels)
    mitsuba.Bitmap(pixels).write(str(tmp_path / "m.exr"))
    np.testing.assert_array_equal(load_image(tmp_path / "m.exr").pixels, pixels)


def test_a_real_environment_map(openexr, mitsuba):
    studio = real("env/studio.exr")
    image = load_image(studio)
    assert image.pixels.shape == (512, 1024, 3) and image.channels == ("R", "G", "B") and image.alpha is None
    # Its coding (DWAB) is lossy, and builds of the library round its cosine transform differently.
    np.testing.assert_allclose(image.pixels, np.array(mitsuba.Bitmap(str(studio)))[..., :3], rtol=0.01, atol=1e-5)


# Radiance -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("channels", [1, 3])
def test_hdr_round_trip_is_within_a_mantissa_step(tmp_path, channels):
    rng = np.random.default_rng(1)
    pixels = (10.0 ** rng.uniform(-30, 35, (40, 50, 1)) * rng.random((40, 50, channels))).astype(np.float32)
    pixels[0, :4] = np.array([0.0, 1.0, 255.6 / 256.0, 1.69e38])[:, None]
    Image(pixels).save(tmp_path / "a.hdr")
    back = load_image(tmp_path / "a.hdr")
    assert back.channels == ("R", "G", "B") and back.pixels.shape == (40, 50, 3)
    assert np.all(np.abs(back.pixels - pixels) <= pixels.max(axis=-1, keepdims=True) / 256.0)
    np.testing.assert_array_equal(back.pixels[0, 1], [1.0, 1.0, 1.0])
    Image(back.pixels).save(tmp_path / "b.hdr")
    assert (tmp_path / "a.hdr").read_bytes() == (tmp_path / "b.hdr").read_bytes()


def test_hdr_says_what_it_cannot_hold(tmp_path):
    pixels = smooth()
    pixels[0, 0, 0], pixels[1, 1, 1], pixels[2, 2, 2], pixels[3, 3] = np.nan, -1.0, np.inf, 1e-44
    with pytest.warns(errors.MissingDataWarning, match="3 of 153 pixels"):
        Image(pixels).save(tmp_path / "a.hdr")
    back = load_image(tmp_path / "a.hdr").pixels
    assert back[0, 0, 0] == back[1, 1, 1] == 0.0 and back[2, 2, 2] > 1.6e38
    np.testing.assert_array_equal(back[3, 3], 0.0)
    Image(smooth(), np.full((9, 17), 0.5)).save(tmp_path / "b.hdr")
    Image(0.5 * smooth()).save(tmp_path / "a.hdr")
    assert (tmp_path / "a.hdr").read_bytes() == (tmp_path / "b.hdr").read_bytes()  # over black
    with pytest.raises(errors.ShapeError, match="5 channels"):
        Image(smooth(channels=5)).save(tmp_path / "a.hdr")


def test_hdr_flat_new_and_mixed_scanlines_agree(tmp_path):
    codes = rgbe(6, 300)
    flat, new = codes.tobytes(), run_length(codes)
    half = run_length(codes[:3]) + codes[3:].tobytes()
    for body in (flat, new, half, new + b"trailing bytes"):
        path = write(tmp_path, hdr(codes, body))
        np.testing.assert_array_equal(load_image(path).pixels, decode(codes))


def test_hdr_old_run_lengths(tmp_path):
    """(1, 1, 1, n) repeats n times, a second one in a row 256 n times; a run ends with its scanline."""
    a, b, zero = (128, 64, 32, 129), (200, 100, 50, 120), (9, 9, 9, 0)
    body = bytes([*a, 1, 1, 1, 2, *b, *zero, 1, 1, 1, 43, 1, 1, 1, 1]) + bytes([*b, 1, 1, 1, 255, 1, 1, 1, 255])
    codes = np.array([[a] * 3 + [b] + [zero] * 300, [b] * 304])
    np.testing.assert_array_equal(
        load_image(write(tmp_path, hdr(codes, body))).pixels, np.where(codes[..., 3:] == 0, 0, decode(codes))
    )
    for wrong, reason in (
        (body[:-4], "scanline 1 of 2: the file ends in it"),
        (body[4:], "starts with a repeat"),
    ):
        with pytest.raises(errors.FormatError, match=reason):
            load_image(write(tmp_path, hdr(codes, wrong)))


@pytest.mark.parametrize("width", [1, 7, 8, 32767, 32768])
def test_hdr_at_the_widths_where_the_coding_changes(tmp_path, width):
    codes = rgbe(2, width) if width > 5 else np.full((2, width, 4), 130, np.uint8)
    bodies = [codes.tobytes(), run_length(codes)] if 8 <= width < 32768 else [codes.tobytes()]
    for body in bodies:
        np.testing.assert_array_equal(load_image(write(tmp_path, hdr(codes, body))).pixels, decode(codes))


@pytest.mark.parametrize(
    ("size", "there"),
    [  # what undoes it, from the array of scanlines to rows from the top and columns from the left
        (b"-Y 3 +X 5", lambda a: a),
        (b"+Y 3 +X 5", lambda a: a[::-1]),
        (b"-Y 3 -X 5", lambda a: a[:, ::-1]),
        (b"+Y 3 -X 5", lambda a: a[::-1, ::-1]),
        (b"+X 3 -Y 5", lambda a: a.swapaxes(0, 1)),
        (b"+X 3 +Y 5", lambda a: a.swapaxes(0, 1)[::-1]),
        (b"-X 3 -Y 5", lambda a: a.swapaxes(0, 1)[:, ::-1]),
        (b"-X 3 +Y 5", lambda a: a.swapaxes(0, 1)[::-1, ::-1]),
    ],
)
def test_hdr_orientations(tmp_path, size, there):
    codes = rgbe(3, 5)
    image = load_image(write(tmp_path, hdr(codes, size=size)))
    np.testing.assert_array_equal(image.pixels, there(decode(codes)))


def test_hdr_header_lines(tmp_path):
    codes = rgbe()
    lines = b"rpict -vf x\nEXPOSURE=2.0\n\tEXPOSURE=7\nCOLORCORR= 1 2 4\nEXPOSURE=0.25\nSOFTWARE=x\n"
    image = load_image(write(tmp_path, hdr(codes, header=lines)))
    np.testing.assert_allclose(image.pixels, decode(codes) / 0.5 / np.array([1, 2, 4]), rtol=1e-6)
    windows = HDR.replace(b"#?RADIANCE", b"#?RGBE").replace(b"\n", b"\r\n") + b"\r\n-Y 9 +X 17\n" + codes.tobytes()
    np.testing.assert_array_equal(load_image(write(tmp_path, windows)).pixels, decode(codes))
    srgb = b"PRIMARIES= 0.64 0.33 0.30 0.60 0.15 0.06 0.3127 0.329\n"
    load_image(write(tmp_path, hdr(codes, header=srgb)))
    with pytest.warns(UserWarning, match="nothing is converted"):
        load_image(write(tmp_path, hdr(codes, header=srgb.replace(b"0.30", b"0.20"))))
    for line in (b"EXPOSURE=\n", b"EXPOSURE=0\n", b"EXPOSURE=nan\n", b"COLORCORR=1 2\n", b"PRIMARIES=1\n"):
        with pytest.raises(errors.FormatError, match="positive numbers"):
            load_image(write(tmp_path, hdr(codes, header=line)))
    with pytest.raises(errors.FormatError, match="ra_xyze -r"):
        load_image(write(tmp_path, hdr(codes).replace(b"rgbe", b"xyze")))


def test_hdr_that_cannot_be_a_picture(tmp_path):
    codes = rgbe()
    for size in (b"-Y 1000000 +X 1000000", b"-Y 999999999 +X 999999999", b"-Y 0 +X 17", b"-Y 3000 +X 9000"):
        with pytest.raises(errors.FormatError, match="the header says"):
            load_image(write(tmp_path, hdr(codes, size=size)))
    for size in (b"-Y 9 +Y 17", b"9 17", b"-Y 9", b"-Y -9 +X 17", b"-Y " + b"9" * 5000 + b" +X 1"):
        with pytest.raises(errors.FormatError, match="resolution line"):
            load_image(write(tmp_path, hdr(codes, size=size)))
    with pytest.raises(errors.FormatError, match="4 per scanline"):
        load_image(write(tmp_path, hdr(codes, size=b"-Y 9000 +X 17")))
    body = run_length(codes)
    overrun = body[:4] + bytes([128 + 100]) + body[5:]
    with pytest.raises(errors.FormatError, match="scanline 0 of 9: a run goes 83 pixels beyond"):
        load_image(write(tmp_path, hdr(codes, overrun)))
    with pytest.raises(errors.FormatError, match="its length is 18, expected 17"):
        load_image(write(tmp_path, hdr(codes, body[:3] + bytes([18]) + body[4:])))
    for cut in range(len(hdr(codes, body))):
        with pytest.raises(errors.FormatError):
            load_image(write(tmp_path, hdr(codes, body)[:cut]))


def test_hdr_agrees_with_mitsuba(mitsuba, tmp_path):
    codes = rgbe(6, 300)
    for body in (codes.tobytes(), run_length(codes)):
        path = write(tmp_path, hdr(codes, body))
        np.testing.assert_array_equal(load_image(path).pixels, np.array(mitsuba.Bitmap(str(path))))
    Image(smooth(40, 70)).save(tmp_path / "a.hdr")
    np.testing.assert_array_equal(
        load_image(tmp_path / "a.hdr").pixels, np.array(mitsuba.Bitmap(str(tmp_path / "a.hdr")))
    )
    mitsuba.Bitmap(smooth(40, 70)).write(str(tmp_path / "m.hdr"))
    np.testing.assert_array_equal(
        load_image(tmp_path / "m.hdr").pixels, np.array(mitsuba.Bitmap(str(tmp_path / "m.hdr")))
    )


# Files in general ---------------------------------------------------------------------------------


def test_content_decides_and_not_the_suffix(tmp_path):
    Image(smooth()).save(tmp_path / "a.hdr")
    (tmp_path / "a.hdr").rename(tmp_path / "a.png")
    assert load_image(str(tmp_path / "a.png")).pixels.shape == (9, 17, 3)
    for data in (b"", b"#?", b"GIF89a", b"\0" * 100):
        with pytest.raises(errors.FormatError, match=r"expected b'v/1.*b'#\?RADIANCE' \(Radiance\)"):
            load_image(write(tmp_path, data))
    with pytest.raises(errors.NotFoundError, match="No such file"):
        load_image(tmp_path / "none.exr")
    with pytest.raises(errors.FormatError, match="directory"):
        load_image(tmp_path)


def test_save_refuses_what_it_cannot_do(tmp_path):
    image = Image(smooth())
    for name in ("a.tif", "a", "a.png.bak"):
        with pytest.raises(errors.ParameterError, match=r"\.exr, \.png, \.hdr"):
            image.save(tmp_path / name)
    for name, exposure in (("a.exr", 1.0), ("a.hdr", -1.0), ("a.png", np.nan), ("a.png", 1e9)):
        with pytest.raises(errors.ParameterError, match="exposure"):
            image.save(tmp_path / name, exposure=exposure)
    with pytest.raises(errors.NotFoundError, match="does not exist"):
        image.save(tmp_path / "none" / "a.png")
    (tmp_path / "d.png").mkdir()
    with pytest.raises(errors.ParameterError, match="directory"):
        image.save(tmp_path / "d.png")
    with pytest.raises(errors.ShapeError, match="expected 1 or 3"):
        Image(smooth(channels=4)).save(tmp_path / "a.png")
    assert [p.name for p in tmp_path.iterdir()] == ["d.png"]


@pytest.mark.parametrize("suffix", [".png", ".exr", ".hdr"])
def test_an_interrupted_save_leaves_the_old_file(tmp_path, monkeypatch, suffix):
    path = tmp_path / f"a{suffix}"
    Image(smooth()).save(path)
    before = path.read_bytes()

    def interrupted(source, target):
        assert Path(source).parents[1] == tmp_path and os.path.getsize(source) > 0
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        Image(smooth() * 2).save(path)
    monkeypatch.undo()
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]

    def breaks(name):
        Path(name).write_bytes(b"half")
        raise OSError("No space left on device")

    monkeypatch.setattr(image_module._WRITERS[suffix], "encode", lambda *_: breaks)
    with pytest.raises(OSError, match="No space"):
        Image(smooth() * 2).save(path)
    monkeypatch.undo()
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
    link = tmp_path / f"link{suffix}"
    link.symlink_to(path)
    Image(smooth(channels=1)).save(link)
    assert link.is_symlink() and path.read_bytes() != before


def test_a_missing_library_is_named(tmp_path, monkeypatch):
    Image(smooth()).save(tmp_path / "a.exr")
    Image(smooth()).save(tmp_path / "a.png")
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    for name, package in (("a.exr", "OpenEXR"), ("a.png", "pillow")):
        with pytest.raises(errors.DependencyError, match=f"pip install {package}"):
            load_image(tmp_path / name)
        with pytest.raises(errors.DependencyError, match=f"pip install {package}"):
            Image(smooth()).save(tmp_path / name)


def damaged(data, seed):
    """A cut, or one to four bytes changed, half of the time near the beginning."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.25:
        return data[: rng.integers(len(data))]
    data = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        at = rng.integers(len(data) if rng.random() < 0.5 else min(len(data), 400))
        data[at] = rng.choice([0, 1, 2, 127, 128, 255, rng.integers(256)])
    return bytes(data)


@pytest.mark.parametrize(
    "kind", ["flat.hdr", "new.hdr", "old.hdr", "zip.exr", "tiled.exr", "parts.exr", "a.png", "a.jpg"]
)
def test_damaged_files_raise_only_gonio_errors(tmp_path, kind, capfd):
    path = tmp_path / kind
    if path.suffix == ".hdr":
        body = {
            "flat": rgbe().tobytes(),
            "new": run_length(rgbe()),
            "old": bytes([2, 9, 9, 129, 1, 1, 1, 16]) * 9,
        }
        path.write_bytes(hdr(rgbe(), body[path.stem], b"EXPOSURE=2\nCOLORCORR=1 2 3\n"))
    elif path.suffix == ".exr":
        openexr = pytest.importorskip("OpenEXR")
        planes = {n: np.ascontiguousarray(smooth(40, 40)[..., i]) for i, n in enumerate("RGB")}
        if kind == "tiled.exr":
            openexr.File({"type": openexr.tiledimage, "tiles": openexr.TileDescription()}, planes).write(str(path))
        else:
            header = {"type": openexr.scanlineimage, "compression": openexr.ZIP_COMPRESSION}
            parts = [openexr.Part(dict(header), planes, n) for n in ("one", "two")]
            openexr.File(parts if kind == "parts.exr" else parts[:1]).write(str(path))
    elif path.suffix == ".jpg":
        pillow = pytest.importorskip("PIL.Image")
        pillow.fromarray((smooth() * 40).astype(np.uint8)).save(path)
    else:
        Image(smooth() / 5, smooth()[..., 0] / 5).save(path)
    whole, layer = path.read_bytes(), "one" if kind == "parts.exr" else None
    load_image(path, layer=layer)
    raised = 0
    for seed in range(60):
        path.write_bytes(damaged(whole, seed))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of pillow, about what is damaged
            try:
                image = load_image(path, layer=layer)
            except errors.FormatError as error:
                raised += 1
                assert str(error).startswith(str(path))
            else:
                assert image.pixels.ndim == 3
    assert 5 < raised < 60
    assert capfd.readouterr().out == ""
