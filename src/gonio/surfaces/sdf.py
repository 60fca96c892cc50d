"""SDF, the files of surface data that profilometers write: heights and their distances, in metres."""

from __future__ import annotations

import math
import struct
from array import array
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError, TooLargeError
from .text_map import content

_NAMES = (
    *("ManufacID", "CreateDate", "ModDate", "NumPoints", "NumProfiles", "Xscale", "Yscale", "Zscale"),
    *("Zresolution", "Compression", "DataType", "CheckType"),
)
_HEADER = struct.Struct("<10s12s12sHHddddBBB")

_TYPES = {0: "u1", 1: "<u2", 2: "<u4", 3: "<f4", 4: "i1", 5: "<i2", 6: "<i4", 7: "<f8"}
"""Types of heights by number; the least number of a signed one, and NaN, stand for a missing height."""


def read_sdf(path: Path) -> tuple[np.ndarray, tuple[float, float]]:
    """Heights [m] (rows, columns), NaN where there is none, and their distances [m] along x and y.

    Source: ISO 25178-71:2017, "Software measurement standards": header, heights, and a trailer that is not read; as
    text ("aISO-1.0", parts end with "*", "BAD" is a missing height) or in binary ("bISO-1.0", little-endian).
    Raises FormatError.
    """
    data = content(path)
    magic = data[:8]
    if magic not in (b"aISO-1.0", b"bISO-1.0"):
        raise FormatError(f"{path}: begins with {magic!r}, expected aISO-1.0 or bISO-1.0, as SDF files do")
    try:
        heights, header = (_text if magic[:1] == b"a" else _binary)(data[8:])
        rows, columns = int(header["NumProfiles"]), int(header["NumPoints"])
        x, y, z, compression = (float(header[name]) for name in ("Xscale", "Yscale", "Zscale", "Compression"))
    except MemoryError:
        raise TooLargeError(f"{path}: there is not enough memory for its heights; save every second one") from None
    except Exception as error:  # of words of any kind in the place of numbers
        what = " ".join(f"{type(error).__name__}: {error}".split())[:80]
        raise FormatError(f"{path}: an SDF file whose header or heights cannot be read ({what})") from None
    if compression != 0.0:
        raise FormatError(f"{path}: its heights are compressed; expected Compression = 0: save it without")
    if heights.size != rows * columns or rows < 1:
        raise FormatError(f"{path}: {heights.size} heights, expected NumProfiles x NumPoints = {rows} x {columns}")
    if not all(0.0 < length < math.inf for length in (x, y, z)):
        raise FormatError(f"{path}: Xscale, Yscale, Zscale are {x:g}, {y:g}, {z:g}; expected lengths above 0 [m]")
    with np.errstate(over="ignore"):
        return z * heights.reshape(rows, columns), (x, y)


def _text(data: bytes) -> tuple[np.ndarray, Mapping[str, Any]]:
    header, heights = data.decode("latin-1").split("*")[:2]
    pairs = (line.split("=", 1) for line in header.splitlines() if line.strip())
    numbers = array("d", (math.nan if word == "BAD" else float(word) for word in heights.split()))
    return np.array(numbers, dtype=float), {name.strip(): value.strip() for name, value in pairs}


def _binary(data: bytes) -> tuple[np.ndarray, Mapping[str, Any]]:
    header = dict(zip(_NAMES, _HEADER.unpack_from(data), strict=True))
    kind = np.dtype(_TYPES[header["DataType"]])
    found = np.frombuffer(data, kind, header["NumPoints"] * header["NumProfiles"], _HEADER.size)
    heights = found.astype(float)
    if kind.kind == "i":
        heights[found == np.iinfo(kind).min] = math.nan
    return heights, header
