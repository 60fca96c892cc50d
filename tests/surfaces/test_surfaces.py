"""Surfaces: their slopes, heights and realizations, against what they are made to have; maps; bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from PIL import Image

import gonio as gn
from gonio.errors import FormatError, NotFoundError, ParameterError

SURFACES = {
    "gaussian": gn.surfaces.gaussian(0.3, 0.1, size=64, correlation=6.0),
    "v_grooves": gn.surfaces.v_grooves(0.6),
    "weave": gn.surfaces.weave(size=64),
    "brushed": gn.surfaces.brushed(0.3, size=64, length=40.0),
    "spheres": gn.surfaces.spheres(0.3, size=128, radius=8.0),
}


@pytest.mark.parametrize("name", SURFACES)
def test_realizations(name):
    surface = SURFACES[name]
    same, other = surface.realization(surface.seed), surface.realization(surface.seed + 1)
    np.testing.assert_array_equal(same.heights, surface.heights)
    assert np.array_equal(other.heights, surface.heights) != surface.is_random
    assert other.heights.shape == surface.heights.shape and other.turn == surface.turn
    assert not surface.heights.flags.writeable


def test_heights_count_from_their_mean_wherever_the_surface_is():
    heights = SURFACES["gaussian"].heights.astype(float)
    for made in (gn.surfaces.HeightField, lambda x: gn.surfaces.from_map(x, 1.0, edges="wrap")):
        np.testing.assert_allclose(made(heights + 1e7).slopes, made(heights).slopes, atol=1e-6)


def test_gaussian_slopes_are_beckmanns():
    surface = gn.surfaces.gaussian(0.4, 0.2, size=512)
    assert surface.rms_slopes == pytest.approx((0.4 / math.sqrt(2.0), 0.2 / math.sqrt(2.0)), rel=1e-5)
    for slopes in surface.slopes:
        x = slopes / slopes.std()
        assert np.mean(x**4) == pytest.approx(3.0, abs=0.1) and abs(np.mean(x**3)) < 0.1


@pytest.mark.parametrize(
    "name, at_one", [("gaussian", math.exp(-1)), ("exponential", math.exp(-1)), ("lorentzian", 2**-1.5)]
)
def test_autocorrelation(name, at_one):
    found = []
    for seed in range(20):
        h = gn.surfaces.gaussian(0.3, autocorrelation=name, size=256, correlation=8.0, seed=seed).heights
        found.append([np.mean(h * np.roll(h, 8, axis)) / np.mean(h * h) for axis in (0, 1)])
    assert np.mean(found) == pytest.approx(at_one, abs=0.04)


def test_own_autocorrelation():
    given = gn.surfaces.gaussian(0.3, autocorrelation=lambda r: np.exp(-(r**2)), size=64, correlation=6.0)
    np.testing.assert_allclose(given.heights, gn.surfaces.gaussian(0.3, size=64, correlation=6.0).heights, rtol=1e-6)


def test_spheres_cover_what_they_should():
    surface = gn.surfaces.spheres(0.3, sunk=1.0, size=512, radius=16.0)
    h = surface.heights - surface.heights.min()
    assert (h > 0.0).mean() == pytest.approx(0.3, abs=0.01)
    assert h.max() == pytest.approx(16.0, rel=0.01)


def test_threads_go_over_and_under():
    surface = gn.surfaces.weave(0.4, 0.9, 0.3, size=64)
    h = surface.heights
    top = [(16, 16), (16, 48), (48, 16), (48, 48)]  # the four crossings are equally high
    assert np.ptp([h[at] for at in top]) < 0.01
    np.testing.assert_allclose(h, np.roll(np.roll(h, 32, 0), 32, 1), atol=1e-6)


def test_maps(tmp_path):
    y, x = np.mgrid[:24, :32]
    waves = 200.0 * np.sin(x / 3.0) + 150.0 * np.cos(y / 4.0)  # nanometres
    tilted = waves + 30.0 * x - 20.0 * y
    np.save(tmp_path / "a.npy", tilted)
    np.savetxt(tmp_path / "a.csv", tilted, delimiter=",")
    surface = gn.surfaces.from_map(tmp_path / "a.npy", 0.5, "um", height_unit="nm")
    assert surface.heights.shape == (48, 64) and surface.unit == "um" and surface.is_part
    same = gn.surfaces.from_map(tmp_path / "a.csv", (0.5, 0.5), height_unit="nm")
    np.testing.assert_allclose(same.heights, surface.heights, atol=1e-6)
    np.testing.assert_array_equal(surface.heights, surface.heights[::-1, ::-1])
    # Without its tilt the map is that of the waves without theirs.
    plain = gn.surfaces.from_map(waves, 0.5, height_unit="nm")
    np.testing.assert_allclose(surface.heights, plain.heights, atol=1e-5)
    gray = np.rint(1e4 + 20.0 * waves / 2.0).astype(np.uint16)
    Image.fromarray(gray).save(tmp_path / "a.png")
    picture = gn.surfaces.from_map(tmp_path / "a.png", 0.5, scale=1e-4)
    np.testing.assert_allclose(picture.heights, plain.heights, atol=2e-4)


def test_holes_of_maps_are_filled():
    y, x = np.mgrid[:24, :32]
    waves = 0.2 * np.sin(x / 3.0)
    holed = np.where((x + 3 * y) % 11 == 0, np.nan, waves)
    surface, full = (gn.surfaces.from_map(h, 0.5) for h in (holed, waves))
    off = np.abs(surface.heights - full.heights)[:24, :32]
    assert off[1:-1, 1:-1].max() < 0.2 / 9.0  # neighbours on both sides: a second difference
    assert off.max() < 0.2 / 3.0  # at a corner on one side: a first difference


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: gn.surfaces.HeightField([]), "shape"),
        (lambda: gn.surfaces.HeightField(np.zeros((0, 4))), "shape"),
        (lambda: gn.surfaces.HeightField([[1.0, np.nan]]), "NaN or infinite"),
        (lambda: gn.surfaces.HeightField([["a", "b"]]), "heights"),
        (lambda: gn.surfaces.HeightField([[0.0, 1.0]], cell=(0.0, 1.0)), "above 0"),
        (lambda: gn.surfaces.HeightField([[0.0, 1.0]], unit="inch"), "unit"),
        (lambda: gn.surfaces.HeightField([[0.0, 1000.0]]), "one unit"),
        (lambda: gn.surfaces.from_map(np.zeros((4, 4)), 1.0), "8 or more"),
        (lambda: gn.surfaces.from_map(np.full((9, 9), np.inf), 1.0), "infinite"),
        (lambda: gn.surfaces.from_map(np.full((9, 9), np.nan), 1.0), "missing"),
        (lambda: gn.surfaces.from_map(np.eye(9), 1.0, "furlong"), "unit"),
        (lambda: gn.surfaces.from_map(np.eye(9), 0.0), "above 0"),
        (lambda: gn.surfaces.from_map(np.eye(9), 1.0, edges="blend"), "mirror"),
        (lambda: gn.surfaces.from_map(1e3 * np.random.default_rng(0).normal(size=(9, 9)), 1.0), "one unit"),
        (lambda: gn.surfaces.gaussian(0.0), "from"),
        (lambda: gn.surfaces.gaussian(0.3, size=16), "too soon"),
        (lambda: gn.surfaces.gaussian(0.3, autocorrelation="box"), "expected one of"),
        (lambda: gn.surfaces.gaussian(0.3, autocorrelation=lambda r: 0.5 * np.exp(-r)), "1 at 0"),
        (lambda: gn.surfaces.gaussian(0.3, autocorrelation=lambda r: 1.0 * (r < 1.0)), "negative"),
        (lambda: gn.surfaces.spheres(0.3, radius=100.0, size=64), "at least"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_files_that_are_no_maps(tmp_path):
    with pytest.raises(NotFoundError, match="no such file"):
        gn.surfaces.from_map(tmp_path / "none.npy", 1.0)
    for name, content in {"a.npy": b"no array", "a.csv": b"1,2\n3\n", "a.png": b"no picture", "a.doc": b"1"}.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(FormatError, match=name):
            gn.surfaces.from_map(tmp_path / name, 1.0)


SMOOTH = np.round(2.0 * np.sin(np.arange(12) / 3.0)[:, None] * np.cos(np.arange(10) / 4.0), 2)


@pytest.mark.parametrize("between", [";", "; ", "\t", " ", "  ", "|"])
@pytest.mark.parametrize("decimal", [",", "."])
def test_a_map_with_decimal_commas(tmp_path, between, decimal):
    """A comma was taken for a blank: twice as many columns, slopes nine times as steep."""
    lines = [between.join(f"{z:.2f}".replace(".", decimal) for z in row) for row in SMOOTH]
    expected = gn.surfaces.from_map(SMOOTH, 1.0)
    for text in ("# heights, um\n" + "\n".join(lines) + "\n\n", "\r\n".join(lines)):
        (tmp_path / "a.txt").write_text(text, encoding="utf-8", newline="")
        np.testing.assert_array_equal(gn.surfaces.from_map(tmp_path / "a.txt", 1.0).heights, expected.heights)
    (tmp_path / "a.asc").write_text("".join(f"{line}{between}\n" for line in lines), encoding="utf-16")
    np.testing.assert_array_equal(gn.surfaces.from_map(tmp_path / "a.asc", 1.0).heights, expected.heights)


def test_a_map_with_commas_between_numbers(tmp_path):
    path = tmp_path / "a.csv"
    for between in (",", ", ", " ,"):
        path.write_text("\n".join(between.join(map(str, row)) for row in SMOOTH), encoding="utf-8")
        np.testing.assert_array_equal(
            gn.surfaces.from_map(path, 1.0).heights, gn.surfaces.from_map(SMOOTH, 1.0).heights
        )
    path.write_text("\n".join(["0,1,2,3,2,1,0,5"] * 9), encoding="utf-8")
    assert gn.surfaces.from_map(path, 9.0).heights.shape == (18, 16)
    path.write_text(
        "\n".join([";".join("" if k == j else f"{k}" for k in range(9)) for j in range(9)]), encoding="utf-8"
    )
    assert np.isfinite(gn.surfaces.from_map(path, 1.0).heights).all()  # an empty cell is a missing height


@pytest.mark.parametrize(
    ("rows", "message", "decimals"),
    [
        (["0,05,0,25,0,5,1,0"] * 9, "cannot be told apart", "."),
        (["-0,5,0,5,0,5,1,0"] * 9, "cannot be told apart", "."),
        (["1,250;2,500;1,250;2,500;1,250;2,500;1,250;2,500"] * 9, "does it part thousands", ".,"),
        (["1,5 2,5 3.5 1 1 1 1 1"] * 9, "is the comma the decimal sign", ","),
        (["1;2;3;4;5;6;7;8"] * 8 + ["1;2;3;4;5;6;7;8;9"], "line 9: 9 numbers, expected 8", ""),
        (["1 2 3 4 5 6 7 8"] * 8 + ["1 2 3 4 5 6 7"], "line 9: 7 numbers, expected 8", ""),
        (["x y z", *["1 2 3 4 5 6 7 8"] * 8], "line 1: got 'x', expected a number; lines of words begin with #", ""),
        (["1 2 3 4 5 6 7 1_0"] * 8, "got '1_0', expected a number", ""),
        (["# nothing"], "no numbers", ""),
    ],
)
def test_texts_with_two_readings_are_asked_about(tmp_path, rows, message, decimals):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(rows), encoding="utf-8")
    with pytest.raises(FormatError, match=message):
        gn.surfaces.from_map(path, 1e5)
    for decimal in decimals:
        gn.surfaces.from_map(path, 1e5, decimal=decimal)
    with pytest.raises(ParameterError, match="decimal="):
        gn.surfaces.from_map(path, 1.0, decimal=";")


def npy(header: str, numbers: bytes = b"") -> bytes:
    text = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + numbers


@pytest.mark.parametrize(
    "content",
    [
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (100000, 100000), }", b"\0" * 64),
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,), }"),
        npy("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }", b"\x80\x04."),
        npy("{'descr': '<c16', 'fortran_order': False, 'shape': (2, 2), }", b"\0" * 64),
        npy("{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (8,), }", b"\0" * 64),
        npy("{'descr': '<f8', 'fortran_order': (((((((((((("),
        npy("{'descr': '<f8', \x00"),
        npy("(" * 110),
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-9, -9), }", b"\0" * 648),
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-9, 9), }", b"\0" * 648),
        b"PK\x03\x04",
        b"",
    ],
)
def test_arrays_in_damaged_files(tmp_path, content):
    """Bounded by the file, not by what its header says; whatever NumPy raises is one error."""
    (tmp_path / "a.npy").write_bytes(content)
    with pytest.raises(FormatError):
        gn.surfaces.from_map(tmp_path / "a.npy", 1.0)


def test_arrays_by_rows_and_by_columns(tmp_path):
    for array in (SMOOTH, np.asfortranarray(SMOOTH), SMOOTH.astype(">f4"), np.rint(100.0 * SMOOTH).astype("i2")):
        np.save(tmp_path / "a.npy", array)
        found = gn.surfaces.from_map(tmp_path / "a.npy", 100.0)
        np.testing.assert_array_equal(found.heights, gn.surfaces.from_map(array, 100.0).heights)


def test_heights_without_bounds():
    for size in (1e308, 1e35):
        with pytest.raises(ParameterError, match="heights above 1e\\+30 um"):
            gn.surfaces.from_map(size * (SMOOTH / np.abs(SMOOTH).max()), 1.0)
