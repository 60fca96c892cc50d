"""Radiance pictures: RGBE, a mantissa of 8 bits for each colour and one exponent.

Source   G. Ward, "Radiance File Formats" (filefmts.pdf).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...errors import FormatError
from ..colour import SRGB_XY
from ._radiance_rle import longest, scanlines
from ._source import DENSE, Picture, Source, blocks, warn_lost

STARTS = {b"#?RADIANCE": "Radiance", b"#?RGBE": "Radiance"}
SUFFIXES = (".hdr",)
WRITTEN = ".hdr"

_HEADER_LINE = 1 << 16  # bytes


def read(source: Source) -> Picture:
    """The picture in a file; raises FormatError for what is none."""
    header = {b"EXPOSURE": np.ones(1), b"COLORCORR": np.ones(3), b"PRIMARIES": np.array(SRGB_XY)}
    source.file.seek(0)
    while line := _header_line(source.file):
        key, _, value = line.partition(b"=")
        if key == b"FORMAT" and value.strip() != b"32-bit_rle_rgbe":
            raise FormatError(f"FORMAT is {value[:40]!r}, expected b'32-bit_rle_rgbe' (XYZ: ra_xyze -r)")
        if key in header:
            numbers = np.array([float(v) for v in value.split()])
            if numbers.shape != header[key].shape or not np.all((numbers > 0.0) & (numbers < np.inf)):
                raise FormatError(f"header has {line[:50]!r}, expected {header[key].size} positive numbers")
            header[key] = numbers if key == b"PRIMARIES" else header[key] * numbers  # the others accumulate
    line = _header_line(source.file)
    size = re.fullmatch(rb"([+-])([XY]) +(\d{1,9}) +([+-])([XY]) +(\d{1,9})\s*", line)
    if size is None or size[2] == size[5]:
        raise FormatError(f"resolution line is {line[:40]!r}, expected '-Y height +X width'")
    rows, columns = int(size[3]), int(size[6])
    source.check(columns, rows, 12 + 4 + 8, DENSE * source.size)
    packed = min(longest(rows, columns), source.size - source.file.tell())
    rgbe = scanlines(source.file.read(packed), 0, rows, columns)
    # A scanline runs along the second axis named; +Y goes up and -X left, against the order of the array.
    if size[2] == b"X":
        rgbe = rgbe.swapaxes(0, 1)
    signs = {size[2]: size[1], size[5]: size[4]}
    rgbe = rgbe[:: 1 if signs[b"Y"] == b"-" else -1, :: 1 if signs[b"X"] == b"+" else -1]
    unit = np.ldexp(np.float32(1.0), np.arange(256) - 136)
    unit[0] = 0.0
    divisor = header[b"EXPOSURE"] * header[b"COLORCORR"]
    pixels = np.empty((*rgbe.shape[:2], 3), np.float32)
    for part in blocks(*rgbe.shape[:2]):
        np.multiply(rgbe[part, :, :3], unit[rgbe[part, :, 3]][..., None], out=pixels[part])
        if np.any(divisor != 1.0):
            pixels[part] = pixels[part] / divisor
    return Picture(pixels, None, tuple("RGB"), tuple(header[b"PRIMARIES"].tolist()))


def _header_line(file: BinaryIO) -> bytes:
    line = file.readline(_HEADER_LINE)
    if not line.endswith(b"\n"):
        raise FormatError(f"header line {line[:40]!r} does not end, expected lines of at most {_HEADER_LINE} bytes")
    return line.rstrip(b"\r\n")


def encode(picture: Picture, path: str, exposure: float) -> Callable[[str], object]:
    """Flat scanlines, rounded to nearest."""
    picture.gray_or_rgb(path)
    pixels = picture.over_black()
    outside = ~((pixels >= 0.0) & (pixels <= 1.69e38))
    warn_lost(outside, path, "NaN (now 0) or outside 0 to 1.69e38 (clamped)")
    pixels = np.clip(np.nan_to_num(pixels), 0.0, np.float32(1.69e38))
    largest = pixels.max(axis=-1)
    mantissa, exponent = np.frexp(largest)
    exponent = exponent + (mantissa >= 255.5 / 256.0)  # would round up to 256
    codes = np.zeros((*largest.shape, 4), np.uint8)
    codes[..., :3] = np.rint(np.ldexp(pixels.astype(np.float64), (8 - exponent)[..., None]))
    codes[..., 3] = np.maximum(exponent + 128, 0)
    codes[(largest == 0.0) | (exponent < -127)] = 0
    # Flat: the largest mantissa is at least 128, so no pixel looks like a run-length mark.
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {largest.shape[0]} +X {largest.shape[1]}\n"
    return lambda name: Path(name).write_bytes(head.encode() + codes.tobytes())
