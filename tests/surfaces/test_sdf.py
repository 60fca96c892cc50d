"""SDF files: as text and in binary, against the heights that they were made of; what is missing; damaged files."""

from __future__ import annotations

import contextlib
import struct

import numpy as np
import pytest

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.surfaces.sdf import read_sdf

Y, X = np.mgrid[:9, :12]
HEIGHTS = np.rint(1000.0 * np.sin(X / 3.0) + 800.0 * np.cos(Y / 4.0))  # nanometres
HOLED = np.where((X == 5) & (Y == 3), np.nan, HEIGHTS)
TYPES = {1: "H", 2: "I", 3: "f", 5: "h", 6: "i", 7: "d"}


def text(heights, **changes):
    fields = {"ManufacID": "test", "CreateDate": "010120251200", "ModDate": "010120251200", "NumPoints": 12}
    fields |= {"NumProfiles": 9, "Xscale": 2.5e-7, "Yscale": 5e-7, "Zscale": 1e-9, "Zresolution": -1}
    fields |= {"Compression": 0, "DataType": 7, "CheckType": 0, **changes}
    lines = [f"{name} = {value}" for name, value in fields.items()]
    rows = [" ".join("BAD" if np.isnan(z) else f"{z:g}" for z in row) for row in heights]
    return "\r\n".join(["aISO-1.0", *lines, "*", *rows, "*", "<Operator> somebody </Operator>", "*"]).encode()


def binary(heights, kind=7, compression=0):
    header = struct.pack("<10s12s12s", b"test      ", b"010120251200", b"010120251200")
    header += struct.pack("<HHddddBBB", 12, 9, 2.5e-7, 5e-7, 1e-9, -1.0, compression, kind, 0)
    least = {"h": -(2**15), "i": -(2**31)}.get(TYPES[kind], np.nan)
    numbers = [least if np.isnan(z) else z for z in heights.ravel()]
    numbers = numbers if TYPES[kind] in "fd" else [int(z) for z in numbers]
    return b"bISO-1.0" + header + struct.pack(f"<{len(numbers)}{TYPES[kind]}", *numbers)


@pytest.mark.parametrize("kind", [0, *TYPES])
def test_heights(tmp_path, kind):
    shift = 2000.0 if kind in (1, 2) else 0.0  # of unsigned types
    heights = HEIGHTS + shift if shift else HOLED
    (tmp_path / "a.sdf").write_bytes(binary(heights, kind) if kind else text(HOLED))
    found, lengths = read_sdf(tmp_path / "a.sdf")
    np.testing.assert_allclose(found, 1e-9 * heights, rtol=1e-6)
    assert lengths == (2.5e-7, 5e-7)


@pytest.mark.parametrize("make", [text, binary])
def test_as_a_surface(tmp_path, make):
    """The file has its lengths: the surface is that of the array with the lengths given."""
    (tmp_path / "a.SDF").write_bytes(make(HOLED))
    surface = gn.surfaces.from_map(tmp_path / "a.SDF")
    same = gn.surfaces.from_map(HOLED, (0.25, 0.5), "um", height_unit="nm")
    np.testing.assert_allclose(surface.heights, same.heights, atol=1e-6)
    assert surface.cell == pytest.approx(same.cell) and surface.unit == "um"
    in_nm = gn.surfaces.from_map(tmp_path / "a.SDF", unit="nm")
    assert in_nm.cell == pytest.approx((250.0, 500.0)) and in_nm.rms_slopes == pytest.approx(
        surface.rms_slopes, rel=1e-5
    )
    for named in ({"pixel": 0.5}, {"scale": 2.0}, {"height_unit": "nm"}):
        with pytest.raises(ParameterError, match="lengths of its own"):
            gn.surfaces.from_map(tmp_path / "a.SDF", **named)


@pytest.mark.parametrize(
    "data, message",
    [
        (b"", "expected aISO-1.0"),
        (b"cISO-1.0" + binary(HEIGHTS)[8:], "expected aISO-1.0"),
        (text(HEIGHTS, Compression=1), "compressed"),
        (binary(HEIGHTS, compression=1), "compressed"),
        (text(HEIGHTS, NumPoints=11), "9 x 11"),
        (text(HEIGHTS, Xscale=0.0), "above 0"),
        (text(HEIGHTS, Zscale="nan"), "above 0"),
        (text(HEIGHTS, NumProfiles="nine"), "cannot be read"),
        (text(HEIGHTS).replace(b"Yscale", b"yscale"), "cannot be read"),
        (text(HEIGHTS).replace(b"*", b""), "cannot be read"),
        (text(HEIGHTS).replace(b"Compression", b"compression"), "cannot be read"),
        (text(HEIGHTS, Compression="none"), "cannot be read"),
        (text(HEIGHTS, NumPoints=-12, NumProfiles=-9), "-9 x -12"),
    ],
)
def test_damaged_files(tmp_path, data, message):
    (tmp_path / "a.sdf").write_bytes(data)
    with pytest.raises(FormatError, match=message):
        gn.surfaces.from_map(tmp_path / "a.sdf")


def test_cut_files(tmp_path):
    """Wherever a file ends too soon it is refused, and nothing else happens."""
    whole = binary(HEIGHTS)
    for length in range(len(whole)):
        (tmp_path / "a.sdf").write_bytes(whole[:length])
        with pytest.raises(FormatError):
            read_sdf(tmp_path / "a.sdf")
    rng = np.random.default_rng(0)
    for make in (text, binary):
        for _ in range(300):
            data = bytearray(make(HEIGHTS))
            for place in rng.integers(len(data), size=3):
                data[place] = rng.integers(256)
            (tmp_path / "a.sdf").write_bytes(bytes(data))
            with contextlib.suppress(FormatError):
                read_sdf(tmp_path / "a.sdf")


def test_a_map_needs_its_pixel():
    with pytest.raises(ParameterError, match="pixel is missing"):
        gn.surfaces.from_map(HEIGHTS)
