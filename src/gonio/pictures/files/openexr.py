"""OpenEXR pictures: their headers, which are checked before the library reads the file, and their channels."""

from __future__ import annotations

import builtins
import struct
from collections.abc import Callable
from types import FunctionType
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import FormatError
from ._source import Picture, Source, library

STARTS = {b"v/1\x01": "OpenEXR"}
SUFFIXES = (".exr",)
WRITTEN = ".exr"

DENSE = 2**10
"""The most pixels per byte of a file: one colour, 8192 x 4096, comes to 449 in all but DWA compression."""

DENSE_DWA = 2**14  # 5189 as DWAB

_BYTES = {0: 4, 1: 2, 2: 4}  # of a number: uint, half, float
_HEAD = 1 << 16  # bytes of a file that are searched for headers; eight times as many while these go on


def read(source: Source) -> Picture:
    """The picture in a file: of several parts the first. Raises FormatError where there is none."""
    openexr, most = library("OpenEXR", "OpenEXR"), {False: DENSE * source.size, True: DENSE_DWA * source.size}
    parts = _headers(source.file, source.size)
    width = height = decoded = 0
    for part in reversed(parts):  # ends with the first; the library decodes all of them
        if part.get(b"type", b"").startswith(b"deep"):
            raise FormatError("its pixels are deep, with any number of samples each; expected one sample a pixel")
        left, top, right, bottom = struct.unpack("<4i", part[b"dataWindow"])
        width, height = right - left + 1, bottom - top + 1
        kinds = _channel_kinds(part[b"channels"])
        stored = sum(_BYTES.get(kind, 4) for kind in kinds)
        dense = most[part.get(b"compression") in (b"\x08", b"\x09")]
        source.check(width, height, stored + 4 * len(kinds), dense)
        decoded += width * height * stored
        source.check(width, height, decoded // (width * height) + 4 * len(kinds), dense)
        # The library allocates whole tiles before it reads their data: 6.6 GB for a damaged file of 2 kB.
        tile = struct.unpack_from("<2I", part.get(b"tiles", bytes(8)))
        if tile[0] > max(width, 4096) or tile[1] > max(height, 4096):
            raise FormatError(f"tiles of {tile} pixels, expected at most the picture or 4096")
    np.empty(decoded, np.uint8)  # where there is no memory, the library says damage
    planes = _planes(openexr, source.path)
    if any(p.shape != (height, width) or p.dtype.kind not in "fu" for p in planes.values()):
        channels = {name: f"{p.shape} {p.dtype}" for name, p in planes.items()}
        raise FormatError(f"channels are {channels}, expected {(height, width)} numbers, not deep ones")
    alpha = planes.pop("A").astype(np.float32, copy=False) if "A" in planes and len(planes) > 1 else None
    rgb = tuple("RGB") if {"R", "G", "B"} <= planes.keys() else ()
    names = (*rgb, *sorted(planes.keys() - set(rgb)))
    pixels = np.empty((height, width, len(names)), np.float32)
    for k, name in enumerate(names):
        pixels[..., k] = planes.pop(name)  # its memory is needed
    if alpha is not None:
        np.divide(pixels, alpha[..., None], out=pixels, where=alpha[..., None] > 0.0)
    chromaticities = parts[0].get(b"chromaticities")
    primaries = struct.unpack("<8f", chromaticities) if chromaticities else None
    return Picture(pixels, alpha, None if names == ("A",) else names, primaries)


def _headers(file: BinaryIO, size: int) -> list[dict[bytes, bytes]]:
    """The attributes of every part, as raw bytes by name."""
    count = _HEAD
    while True:
        file.seek(0)
        data = file.read(min(count, size))
        try:
            return _attributes(data)
        except (IndexError, ValueError, struct.error):
            if count >= size:
                raise FormatError("it ends within its header") from None
        count *= 8


def _attributes(data: bytes) -> list[dict[bytes, bytes]]:
    several = struct.unpack_from("<I", data, 4)[0] & 0x1000
    parts: list[dict[bytes, bytes]] = []
    at = 8
    while not parts or (several and data[at]):
        parts.append({})
        while data[at]:
            name = data.index(b"\0", at)
            kind = data.index(b"\0", name + 1)
            end = kind + 5 + struct.unpack_from("<I", data, kind + 1)[0]
            parts[-1][data[at:name]] = data[kind + 5 : end]
            at = end
        at += 1
    return parts


def _channel_kinds(data: bytes) -> list[int]:
    """The number type of every channel, from the attribute that lists them."""
    kinds, at = [], 0
    while data[at]:
        at = data.index(b"\0", at) + 1
        kinds.append(struct.unpack_from("<I", data, at)[0])
        at += 16
    return kinds


def _planes(openexr: Any, path: str) -> dict[str, NDArray[Any]]:
    """The channels of the first part. The library raises no error for a damaged part: some versions drop it, print a
    line, and count the others from 0."""
    parts = _UNHEARD(openexr.File, path).parts
    if not parts or parts[0].part_index != 0:
        raise FormatError("its pixels cannot be decoded")
    return {name: channel.pixels for name, channel in parts[0].channels.items()}


def _opened(file: Any, path: str) -> Any:
    return file(path, separate_channels=True)


def _import(name: str, *args: Any, **more: Any) -> Any:
    if name == "sys":
        raise ImportError("there is no standard output here")
    return builtins.__import__(name, *args, **more)


# What prints is pybind11, as the function that called the library would: by that one's `print`, or (before pybind11 3)
# on the standard output of a `sys` that it imports, giving up if it cannot. So this function has a `print` and an
# `__import__` of its own: `sys.stdout` stays what it is, for other threads too.
_UNHEARD = FunctionType(
    _opened.__code__,
    {"__builtins__": {**vars(builtins), "print": lambda *_, **__: None, "__import__": _import}},
)


def encode(picture: Picture, path: str, exposure: float) -> Callable[[str], object]:
    """float32, lossless; times the coverage."""
    openexr = library("OpenEXR", "OpenEXR")
    count = picture.pixels.shape[2]
    names = picture.names or {1: ("Y",), 3: tuple("RGB")}.get(count) or [f"C{i:04d}" for i in range(count)]
    planes = dict(zip(names, np.ascontiguousarray(np.moveaxis(picture.over_black(), -1, 0)), strict=True))
    if picture.alpha is not None:
        planes["A"] = np.ascontiguousarray(picture.alpha)
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    return lambda name: openexr.File(header, planes).write(name)
