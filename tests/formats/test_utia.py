"""UTIA: where numbers lie, decodings, pictures, writing, damage."""

from __future__ import annotations

import math
import struct
import tracemalloc

import numpy as np
import pytest
from binary_files import header
from format_cases import ANISOTROPIC, GRAY, claimed, file_of

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.formats import csail, formats, load, save, utia
from gonio.pictures.colour import RGB_OF_XYZ
from gonio.pictures.image import Image, load_image


def utia_index(plane, ti, pi, to, po):
    """As all readers have it."""
    return plane * 288 * 288 + 288 * (48 * ti + pi) + 48 * to + po


@pytest.fixture(scope="module")
def utia_numbers():
    return np.random.default_rng(1).uniform(0.1, 0.9, 3 * 288 * 288)


def test_utia_numbers_are_where_readers_find_them(tmp_path, utia_numbers):
    path = file_of(tmp_path, utia_numbers.tobytes(), "random.bin")
    assert path.stat().st_size == 1_990_656
    m = load(path)
    for ti, pi, to, po in ((0, 0, 0, 0), (1, 2, 3, 4), (5, 47, 5, 46), (2, 30, 0, 7)):
        angles = np.radians([15.0 * ti, 7.5 * pi, 15.0 * to, 7.5 * po])
        if ti == 0:
            angles[0], angles[1] = 1e-9, angles[1]
        expected = [utia_numbers[utia_index(c, ti, pi, to, po)] for c in range(3)]
        np.testing.assert_allclose(m.f_angles(*np.maximum(angles, [1e-8, 0.0, 1e-8, 0.0])), expected, rtol=1e-6)
    # Half way between two azimuths, across 360 degrees; and beyond 75 degrees, where it stays.
    found = m.f_angles(*np.radians([30.0, 356.25, 45.0, 15.0]))
    ends = [[utia_numbers[utia_index(c, 2, p, 3, 2)] for c in range(3)] for p in (47, 0)]
    np.testing.assert_allclose(found, np.mean(ends, axis=0), rtol=1e-9)
    np.testing.assert_allclose(
        m.f_angles(*np.radians([88.0, 15.0, 45.0, 15.0])), m.f_angles(*np.radians([75.0, 15.0, 45.0, 15.0])), rtol=1e-9
    )
    assert claimed(path) == ["UTIA"]


def test_utia_decodings(tmp_path, utia_numbers):
    stored = utia_numbers.copy()
    stored[utia_index(0, 1, 0, 1, 0)], stored[utia_index(1, 1, 0, 1, 0)] = 0.5, -0.02
    stored[utia_index(2, 1, 0, 1, 0)] = 70.0
    path = file_of(tmp_path, stored.tobytes(), "random.bin")
    at = np.radians([15.0, 0.0, 15.0, 0.0])
    assert load(path) == utia.read(path, decoding="linear") != utia.read(path, decoding="srgb")
    np.testing.assert_allclose(load(path).f_angles(*at), [0.5, -0.02, 70.0])
    # IEC 61966-2-1: 0.5 is 0.21404 linear; dj_brdf divides by 140 before, and multiplies by 100 after.
    found = utia.read(path, decoding="srgb").f_angles(*at)
    np.testing.assert_allclose(found[:2], [0.214041, -0.02 / 12.92], rtol=1e-5)
    found = utia.read(path, decoding="dj_brdf").f_angles(*at)
    np.testing.assert_allclose(found, [100 * 0.5 / 140 / 12.92, -100 * 0.02 / 140 / 12.92, 21.4041], rtol=1e-5)
    with pytest.raises(ParameterError, match="'srgb'"):
        utia.read(path, decoding="gamma")


def test_utia_writes(tmp_path, utia_numbers):
    stored = utia_numbers.copy()
    stored[7] = -1.0
    path, copy = file_of(tmp_path, stored.tobytes(), "random.bin"), tmp_path / "copy.bin"
    save(utia.read(path, decoding="srgb"), copy)
    assert copy.read_bytes() == path.read_bytes()
    for m in (ANISOTROPIC, GRAY):
        save(m, copy)
        theta, phi = np.radians([15.0, 45.0, 75.0]), np.radians([7.5, 352.5])
        at = np.meshgrid(theta, phi, theta, phi, indexing="ij")
        expected = m.f_angles(*at)
        found = load(copy).f_angles(*at)
        np.testing.assert_allclose(
            found, np.broadcast_to(expected[..., None] if m is GRAY else expected, found.shape), rtol=1e-9
        )
    for m, why in ((gn.IdealSpecular(0.5), "mirror"), (gn.Lambertian([0.1, 0.2]), "1 or 3")):
        with pytest.raises(ParameterError, match=why):
            save(m, copy)
    holes = csail.CSAIL(np.full((3, 2, 2, 2, 2), -1.0, "f4"), header((2, 2, 2, 2)))
    with pytest.raises(ParameterError, match="holes"):
        save(holes, copy)


def test_utia_damage(tmp_path, utia_numbers):
    data = utia_numbers.tobytes()
    with pytest.raises(FormatError, match="1990656 for 6 theta"):
        utia.read(file_of(tmp_path, data[:-8]))
    assert claimed(file_of(tmp_path, data[:-8])) == []
    assert claimed(file_of(tmp_path, b"0.125 " * 331776)) == []  # a text of the same length
    with pytest.raises(ParameterError, match="theta_step"):
        utia.read(file_of(tmp_path, data), theta_step=20.0)


def test_utia_pictures(tmp_path):
    m = ANISOTROPIC
    table = tmp_path / "m.bin"
    save(m, table, "UTIA")
    as_table = load(table)
    picture = tmp_path / "m.exr"
    save(as_table, picture)
    assert claimed(picture) == ["UTIA"]
    found = load(picture)
    np.testing.assert_array_equal(found.raw, as_table.raw.astype(np.float32))
    # The pixel in row 48 * 2 + 5, column 48 * 3 + 7 is theta_i = 30, phi_i = 37.5, theta_o = 45, phi_o = 52.5 degrees.
    pixels = load_image(picture).pixels
    f = as_table.f_angles(*np.radians([30.0, 37.5, 45.0, 52.5]))
    np.testing.assert_allclose(pixels[101, 151], f, rtol=1e-6)
    # Turned upside down it is the same material, for that one is reciprocal; unless that is said otherwise.
    turned = tmp_path / "turned.exr"
    Image(pixels[::-1]).save(turned)
    np.testing.assert_array_equal(load(turned).raw, found.raw)
    np.testing.assert_array_equal(load(turned, rows="down").raw[:, 0, 0], found.raw[:, 5, 47])
    np.testing.assert_allclose(
        utia.read(picture, decoding="xyz").f_angles(*np.radians([30.0, 37.5, 45.0, 52.5])), f @ RGB_OF_XYZ.T, rtol=1e-6
    )
    with pytest.raises(ParameterError, match="rows='left': expected 'down' or 'up'"):
        load(picture, rows="left")
    Image(pixels[:287]).save(turned)
    with pytest.raises(FormatError, match="not a known format"):
        load(turned)
    Image(pixels[..., :1]).save(turned)
    with pytest.raises(FormatError, match=r"a picture of \(288, 288, 1\), expected \(288, 288, 3\)"):
        load(turned)


@pytest.mark.full  # 1.5 GB
def test_utia_dense(tmp_path):
    path = tmp_path / "dense.bin"
    with path.open("wb") as file:
        file.truncate(8 * 3 * (44 * 180) ** 2)
        index = (44 * 180) * (180 * 10 + 5) + 180 * 20 + 7  # plane 0, theta_i 10, phi_i 5, theta_o 20, phi_o 7
        file.seek(8 * index)
        file.write(struct.pack("<d", 0.75))
    formats()
    tracemalloc.start()
    m = load(path)
    assert tracemalloc.get_traced_memory()[1] < 1.01 * path.stat().st_size
    tracemalloc.stop()
    assert m.stored[10, 20, 5, 7].tolist() == [0.75, 0.0, 0.0]
    assert [round(math.degrees(x[1] - x[0]), 9) for x in m.axes.values()] == [2.0] * 4
