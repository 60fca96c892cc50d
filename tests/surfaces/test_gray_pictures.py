"""Height maps in pictures: their codes as they are, and what is no map of heights."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from png_files import chunk, gamma, png

import gonio as gn
from gonio.errors import FormatError
from gonio.pictures.image import read_gray
from gonio.surfaces.from_map import MOST

pillow = pytest.importorskip("PIL.Image")

RNG = np.random.default_rng(2)
Y, X = np.mgrid[:24, :32]
WAVES = 0.2 * np.sin(X / 3.0) * np.cos(Y / 4.0)


@pytest.mark.parametrize("depth", [1, 2, 4, 8, 16])
def test_codes_are_heights_whatever_stands_for_light(tmp_path, depth):
    codes = RNG.integers(0, 1 << depth, (9, 11, 1)).astype(np.uint16 if depth == 16 else np.uint8)
    (tmp_path / "a.png").write_bytes(png(codes, gamma(0.3), depth=depth))
    np.testing.assert_array_equal(read_gray(tmp_path / "a.png", MOST), codes[..., 0])


@pytest.mark.parametrize("dtype", ["<u1", "<u2", "<i4", "<f4"])
def test_tiff_holds_numbers(tmp_path, dtype):
    heights = np.asarray(100.0 + 90.0 * WAVES).astype(dtype)
    pillow.fromarray(heights).save(tmp_path / "a.tif")
    np.testing.assert_array_equal(read_gray(tmp_path / "a.tif", MOST), heights)
    surface, plain = (gn.surfaces.from_map(x, 1.0, scale=1e-3) for x in (tmp_path / "a.tif", heights.astype(float)))
    np.testing.assert_array_equal(surface.heights, plain.heights)


def test_palettes_are_their_colours_and_colours_are_refused(tmp_path):
    gray = RNG.integers(0, 4, (9, 11)).astype(np.uint8)
    picture = pillow.fromarray(gray)  # indices of a palette that runs backwards
    picture.putpalette([v for k in (200, 150, 70, 0) for v in (k, k, k)])
    picture.save(tmp_path / "a.png")
    np.testing.assert_array_equal(read_gray(tmp_path / "a.png", MOST), np.array([200, 150, 70, 0])[gray])
    picture.putpalette([v for k in (200, 150, 70, 0) for v in (k, 0, k)])
    picture.save(tmp_path / "a.png")
    pillow.fromarray(np.stack([gray] * 3 + [255 - gray], -1)).save(tmp_path / "c.png")
    pillow.fromarray(RNG.integers(0, 256, (9, 11, 3)).astype(np.uint8)).save(tmp_path / "b.tif")
    for name, words in (("a.png", "colours"), ("b.tif", "colours"), ("c.png", "coverage")):
        with pytest.raises(FormatError, match=f"{words}.*a gray picture has one number"):
            gn.surfaces.from_map(tmp_path / name, 1.0)


def test_a_transparent_code_is_a_hole(tmp_path):
    codes = np.rint(1000.0 + 900.0 * WAVES).astype(np.uint16)[..., None]
    codes[5, 6] = 7
    (tmp_path / "a.png").write_bytes(png(codes, (b"tRNS", struct.pack(">H", 7))))
    found = read_gray(tmp_path / "a.png", MOST)
    assert np.argwhere(np.isnan(found)).tolist() == [[5, 6]]
    assert np.isfinite(gn.surfaces.from_map(tmp_path / "a.png", 1.0, scale=1e-3).heights).all()


def test_a_small_file_that_announces_much_is_refused(tmp_path):
    small = png(np.zeros((8, 8, 1), np.uint8))
    for side, words in ((20_000, "exceeds limit"), (5_000, "the header says 5000 x 5000")):
        head = chunk(b"IHDR", struct.pack(">2I5B", side, side, 8, 0, 0, 0, 0))
        (tmp_path / "bomb.png").write_bytes(small[:8] + head + small[8 + len(head) :])
        with pytest.raises(FormatError, match=words):
            gn.surfaces.from_map(tmp_path / "bomb.png", 1.0)
