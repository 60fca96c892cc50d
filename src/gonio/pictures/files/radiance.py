"""Radiance pictures: RGBE, a mantissa of 8 bits for each colour and one exponent; flat or run-length scanlines.

Source   G. Ward, "Radiance File Formats" (filefmts.pdf).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import FormatError
from ..colour import SRGB_XY
from ._source import DENSE, Picture, PictureFile, blocks, gray_or_rgb, warn_lost

if TYPE_CHECKING:
    from ..image import Image

STARTS = {b"#?RADIANCE": "Radiance", b"#?RGBE": "Radiance"}
SUFFIXES = (".hdr",)
WRITTEN = ".hdr"

_HEADER_LINE = 1 << 16  # bytes


def read(source: PictureFile) -> Picture:
    """The picture in a file; raises FormatError where there is none."""
    source.expect_one_layer()
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
    longest = rows * (4 + 8 * columns)  # new run-length coding with runs of one pixel
    rgbe = _scanlines(source.file.read(min(longest, source.size - source.file.tell())), rows, columns)
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


def _scanlines(data: bytes, rows: int, columns: int) -> NDArray[np.uint8]:
    """RGBE bytes (rows, columns, 4) of new run-length, old run-length and flat scanlines, in any mixture."""
    if 4 * rows > len(data):
        raise FormatError(f"{len(data)} bytes of pixels, expected at least 4 per scanline ({rows})")
    packable = 8 <= columns <= 0x7FFF
    if len(data) == 4 * rows * columns:  # flat throughout, unless some pixel is a run-length mark
        flat = np.frombuffer(data, np.uint8).reshape(rows, columns, 4)
        packed = (flat[:, 0, :2] == 2).all(-1) & (flat[:, 0, 2] < 128) & packable
        if not packed.any() and not (flat[..., :3] == 1).all(-1).any():
            return flat
    out, at = np.empty((rows, columns, 4), np.uint8), 0
    for row in range(rows):
        new = packable and data[at : at + 2] == b"\2\2" and data[at + 2 : at + 3] < b"\x80"
        try:
            out[row], at = (_new_scanline if new else _old_scanline)(data, at, columns)
        except (IndexError, ValueError) as error:
            why = "the file ends in it" if isinstance(error, IndexError) else error
            raise FormatError(f"scanline {row} of {rows}: {why}") from None
    return out


def _new_scanline(data: bytes, at: int, columns: int) -> tuple[NDArray[np.uint8], int]:
    """One scanline of run-length coded components (columns, 4), and where the next one starts."""
    if (length := int.from_bytes(data[at + 2 : at + 4])) != columns:
        raise FormatError(f"its length is {length}, expected {columns}")
    at += 4
    pieces: list[bytes] = []
    for _ in range(4):
        left = columns
        while left > 0:
            code = data[at]
            repeats, stored = (code - 128, 1) if code > 128 else (1, code)
            pieces.append(data[at + 1 : at + 1 + stored] * repeats)
            left -= repeats * stored
            at += 1 + stored
        if left:
            raise FormatError(f"a run goes {-left} pixels beyond it")
    if at > len(data):
        raise IndexError
    return np.frombuffer(b"".join(pieces), np.uint8).reshape(4, columns).T, at


def _old_scanline(data: bytes, at: int, columns: int) -> tuple[NDArray[np.uint8], int]:
    """One flat or old run-length scanline (columns, 4), and where the next one starts.

    (1, 1, 1, n) repeats the pixel before it n times; following another repeat, 256 n times, and so on.
    """
    count = min(columns, (len(data) - at) // 4)
    quads = np.frombuffer(data, np.uint8, 4 * count, at).reshape(count, 4)
    repeats = (quads[:, :3] == 1).all(axis=1)
    index = np.arange(count)
    source = np.maximum.accumulate(np.where(repeats, -1, index))
    times = np.where(repeats, quads[:, 3].astype(np.int64) << np.minimum(8 * (index - source - 1), 32), 1)
    total = np.cumsum(times)
    last = int(np.searchsorted(total, columns))
    if last == count:
        raise IndexError
    if source[0] < 0:
        raise FormatError("it starts with a repeat, expected a pixel")
    times[last] -= total[last] - columns  # as the reference reader, which drops the excess of a repeat
    return np.repeat(quads[source[: last + 1]], times[: last + 1], axis=0), at + 4 * (last + 1)


def encode(image: Image, path: str, exposure: float) -> Callable[[str], object]:
    """Flat scanlines, rounded to nearest."""
    pixels = gray_or_rgb(image.light, path)
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
