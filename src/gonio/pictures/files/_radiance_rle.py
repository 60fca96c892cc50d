"""How Radiance pictures pack their scanlines: RGBE bytes, flat or run-length coded in the old and the new way."""

import numpy as np
from numpy.typing import NDArray

from ...errors import FormatError


def longest(rows: int, columns: int) -> int:
    """Bytes that so many scanlines take at most: new run-length coding with runs of one pixel."""
    return rows * (4 + 8 * columns)


def scanlines(data: bytes, at: int, rows: int, columns: int) -> NDArray[np.uint8]:
    """RGBE bytes (rows, columns, 4) of new run-length, old run-length and flat scanlines, in any mixture."""
    if 4 * rows > len(data) - at:
        raise FormatError(f"{len(data) - at} bytes of pixels, expected at least 4 per scanline ({rows})")
    packable = 8 <= columns <= 0x7FFF
    if len(data) - at == 4 * rows * columns:  # flat throughout, unless some pixel is a run-length mark
        flat = np.frombuffer(data, np.uint8, offset=at).reshape(rows, columns, 4)
        packed = (flat[:, 0, :2] == 2).all(-1) & (flat[:, 0, 2] < 128) & packable
        if not packed.any() and not (flat[..., :3] == 1).all(-1).any():
            return flat
    out = np.empty((rows, columns, 4), np.uint8)
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
    if int.from_bytes(data[at + 2 : at + 4]) != columns:
        raise FormatError(f"its length is {int.from_bytes(data[at + 2 : at + 4])}, expected {columns}")
    at += 4
    pieces: list[bytes] = []
    for _ in range(4):
        left = columns
        while left > 0:
            code = data[at]
            end = at + 2 if code > 128 else at + 1 + code
            pieces.append(data[at + 1 : end] * (code - 128 if code > 128 else 1))
            left -= code - 128 if code > 128 else code
            at = end
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
    times[last] -= total[last] - columns  # as the reference reader, which drops what a repeat has over
    return np.repeat(quads[source[: last + 1]], times[: last + 1], axis=0), at + 4 * (last + 1)
