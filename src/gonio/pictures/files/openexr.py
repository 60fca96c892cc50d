"""OpenEXR pictures: their headers, which are checked before the library reads the file, and their channels."""

from __future__ import annotations

import builtins
import struct
from collections.abc import Callable, Iterator
from types import FunctionType
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import FormatError
from ..colour import SRGB_XY
from . import _chroma
from ._layers import PictureLayer, chosen
from ._source import Picture, PictureFile, Unsettled, library

if TYPE_CHECKING:
    from ..image import Image

STARTS = {b"v/1\x01": "OpenEXR"}
SUFFIXES = (".exr",)
WRITTEN = ".exr"

DENSE = 2**10
"""The most pixels per byte of a file: one colour, 8192 x 4096, comes to 449 in all but DWA compression."""

DENSE_DWA = 2**14  # 5189 as DWAB

FRAME = 2**22
"""Pixels that any file may show, black where it has none: 2048 x 2048."""

_BYTES = {0: 4, 1: 2, 2: 4}  # of a number: uint, half, float
_HEAD = 1 << 16  # bytes of a file that are searched for headers; eight times as many while these go on


def read(source: PictureFile) -> Picture:
    """The picture in a file, or the layer of it that is asked for. Raises FormatError where there is none."""
    openexr = library("OpenEXR", "OpenEXR")
    parts = _headers(source.file, source.size)
    channels = [_channels(part[b"channels"]) for part in parts]
    decoded = 0
    for part, inside in zip(parts, channels, strict=True):  # the library decodes all of them
        if part.get(b"type", b"").startswith(b"deep"):
            raise Unsettled("its pixels are deep, with any number of samples each; expected one sample a pixel")
        _, _, width, height = _window(part[b"dataWindow"])
        stored = sum(_BYTES.get(number_type, 4) for number_type, *_ in inside.values())
        source.check(width, height, stored + 4 * len(inside), _dense(part, source))
        decoded += width * height * stored
        source.check(width, height, decoded // (width * height) + 4 * len(inside), _dense(part, source))
        # The library allocates whole tiles before it reads their data: 6.6 GB for a damaged file of 2 kB.
        tile = struct.unpack_from("<2I", part.get(b"tiles", bytes(8)))
        if tile[0] > max(width, 4096) or tile[1] > max(height, 4096):
            raise FormatError(f"tiles of {tile} pixels, expected at most the picture or 4096")
    names = [part.get(b"name", b"").decode() for part in parts]
    layer = chosen([(name, [*x]) for name, x in zip(names, channels, strict=True)], source.limits.layer)
    part, wanted = parts[layer.part], [*layer.channels, *filter(None, [layer.coverage])]
    short = {name.rpartition(".")[2]: name for name in layer.channels}
    is_chroma = tuple(sorted(short)) == _chroma.NAMES and [channels[layer.part][short[x]][1:] for x in short] == [
        (2, 2) if x != "Y" else (1, 1) for x in short
    ]
    if not is_chroma and (sparse := [name for name in wanted if channels[layer.part][name][1:] != (1, 1)]):
        whole = next((f"; layer={name!r} reads {name}" for name in wanted if name not in sparse), "")
        raise Unsettled(
            f"{', '.join(sparse)} has no number at most pixels; "
            f"convert it to RGB, as `oiiotool in.exr -o out.exr` does{whole}"
        )
    frame, (left, top, width, height) = _window(part[b"dataWindow"]), _window(part[b"displayWindow"])
    each = decoded // max(1, width * height) + 4 * len(wanted) + (64 if is_chroma else 4)
    source.check(width, height, each, max(_dense(part, source), FRAME))
    np.empty(decoded, np.uint8)  # where there is no memory, the library says damage
    planes = _planes(openexr, source.path, layer.part, wanted)
    chromaticities = part.get(b"chromaticities")
    primaries = struct.unpack("<8f", chromaticities) if chromaticities else None
    if is_chroma:
        weights = _chroma.weights(primaries or SRGB_XY)
        half = tuple((n + 1) // 2 for n in frame[:1:-1])
        if [planes[short[x]].shape for x in _chroma.NAMES] != [half, half, frame[:1:-1]]:
            raise FormatError(
                f"OpenEXR {openexr.__version__} finds its chroma not at every second row and column; a newer one may"
            )
        Y, RY, BY = (planes.pop(short[x]).astype(np.float32, copy=False) for x in ("Y", "RY", "BY"))
        planes.update(zip("RGB", _chroma.colours(Y, RY, BY, weights), strict=True))
        layer = layer._replace(channels=tuple("RGB"), is_rgb=True)
        wanted = [*layer.channels]
    if any(p.shape != frame[:1:-1] or p.dtype.kind not in "fu" for p in planes.values()):
        shapes = {name: f"{p.shape} {p.dtype}" for name, p in planes.items()}
        raise FormatError(f"channels are {shapes}, expected {frame[:1:-1]} numbers")
    there, from_x = _overlap(left, width, frame[0], frame[2])
    rows, from_y = _overlap(top, height, frame[1], frame[3])
    is_filled = planes[wanted[0]][from_y, from_x].shape == (height, width)
    pixels = (np.empty if is_filled else np.zeros)((height, width, len(layer.channels)), np.float32)
    alpha = None
    if layer.coverage and is_filled:
        alpha = np.ascontiguousarray(planes.pop(layer.coverage)[from_y, from_x], np.float32)
    elif layer.coverage or not is_filled:
        alpha = np.zeros((height, width), np.float32)
        alpha[rows, there] = planes.pop(layer.coverage)[from_y, from_x] if layer.coverage else 1.0
    for k, name in enumerate(layer.channels):
        pixels[rows, there, k] = planes.pop(name)[from_y, from_x]  # its memory is needed
    shown = ("R", "G", "B") if layer.is_rgb else None if layer.channels == ("A",) else layer.channels
    notes = tuple(_notes(part, layer, source.limits.layer))
    return Picture(pixels, alpha, shown, primaries, alpha is not None, notes=notes)


def _notes(part: dict[bytes, bytes], layer: PictureLayer, wanted: str | None) -> Iterator[str]:
    """What callers should hear of a picture."""
    if layer.beside and wanted is None:
        left_out = f"{', '.join(layer.beside[:5])}{', ...' if len(layer.beside) > 5 else ''}"
        yield f"{left_out} beside {', '.join(layer.channels)} is left out; layer={layer.beside[0]!r} reads it"
    shown, frame = _window(part[b"displayWindow"]), _window(part[b"dataWindow"])
    if any(_overlap(shown[k], shown[k + 2], frame[k], frame[k + 2])[0] == slice(0, 0) for k in (0, 1)):
        yield "it is black: nothing of its data window lies within its display window"
    if part.get(b"envmap") == b"\1":
        yield "it is a map of the six faces of a cube (envmap), which lights take for an equirectangular one"
    (aspect,) = struct.unpack("<f", part.get(b"pixelAspectRatio", b"\0\0\x80?"))
    if not abs(aspect - 1.0) < 1e-3:
        yield f"pixels are {aspect:.4g} times as wide as high (pixelAspectRatio); they are taken for square ones"


def _window(data: bytes) -> tuple[int, int, int, int]:
    """Left, top, width and height of a window."""
    left, top, right, bottom = struct.unpack("<4i", data)
    return left, top, right - left + 1, bottom - top + 1


def _overlap(start: int, count: int, other: int, length: int) -> tuple[slice, slice]:
    """Where a stretch meets another one, as places in each."""
    first, last = max(start, other), min(start + count, other + length)
    if first >= last:
        return slice(0, 0), slice(0, 0)
    return slice(first - start, last - start), slice(first - other, last - other)


def _dense(part: dict[bytes, bytes], source: PictureFile) -> int:
    """The most pixels that a part of a file can hold."""
    return (DENSE_DWA if part.get(b"compression") in (b"\x08", b"\x09") else DENSE) * source.size


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
            type_end = data.index(b"\0", name + 1)
            end = type_end + 5 + struct.unpack_from("<I", data, type_end + 1)[0]
            parts[-1][data[at:name]] = data[type_end + 5 : end]
            at = end
        at += 1
    return parts


def _channels(data: bytes) -> dict[str, tuple[int, int, int]]:
    """Number type and steps along x and y of every channel, from the attribute that lists them."""
    channels, at = {}, 0
    while data[at]:
        end = data.index(b"\0", at)
        number_type, _, across, down = struct.unpack_from("<4i", data, end + 1)
        channels[data[at:end].decode()] = number_type, across, down
        at = end + 17
    return channels


def _planes(openexr: Any, path: str, part: int, names: list[str]) -> dict[str, NDArray[Any]]:
    """Channels of a part. The library raises no error for a damaged part: some versions drop it, print a line, and
    count the others from 0."""
    parts = _UNHEARD(openexr.File, path).parts
    stored = parts[part] if part < len(parts) and all(x.part_index == k for k, x in enumerate(parts)) else None
    if stored is None or stored.channels.keys() < {*names}:
        raise FormatError("its pixels cannot be decoded")
    return {name: stored.channels[name].pixels for name in names}


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


def encode(image: Image, path: str, exposure: float) -> Callable[[str], object]:
    """float32, lossless; times the coverage."""
    openexr = library("OpenEXR", "OpenEXR")
    count = image.pixels.shape[2]
    names = image.channels or {1: ("Y",), 3: tuple("RGB")}.get(count) or [f"C{i:04d}" for i in range(count)]
    planes = dict(zip(names, np.ascontiguousarray(np.moveaxis(image.light, -1, 0)), strict=True))
    if image.alpha is not None:
        planes["A"] = np.ascontiguousarray(image.alpha)
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    return lambda name: openexr.File(header, planes).write(name)
