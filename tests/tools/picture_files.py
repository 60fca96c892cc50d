"""Sound pictures of every kind, with what kinds have beside pixels, and height maps in pictures."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import OpenEXR
from PIL import Image as Pillow
from png_files import gamma, icc, png, profile

import gonio as gn
from gonio.pictures.files._icc import SRGB_D50

CODES = np.random.default_rng(4).integers(0, 1 << 16, (6, 5, 3)).astype(np.uint16)
LAYERS = {"R": 1, "G": 2, "B": 3, "A": 0.5, "albedo.R": 0.1, "albedo.G": 0.2, "albedo.B": 0.3, "Z": 9}
EXIF = Pillow.Exif()
EXIF[0x0112] = 6


def exr(path: Path, planes: Any, parts: Any = None, **header: Any) -> Path:
    """An OpenEXR file of numbers, or arrays, by the names of channels; or of parts of them, by theirs."""
    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}

    def full(values: Any) -> Any:
        return {name: np.float32(x) * np.ones(np.shape(x) or (4, 8), np.float32) for name, x in values.items()}

    if parts is None:
        OpenEXR.File(head, full(planes)).write(str(path))
    else:
        OpenEXR.File([OpenEXR.Part(dict(head), full(x), name) for name, x in parts.items()]).write(str(path))
    return path


def sparse_exr(path: Path, planes: dict[str, np.ndarray]) -> Path:
    """An OpenEXR file of float planes, those of half the size at every second row and column, which the library does
    not write: scan lines, not compressed."""
    height, width = max(x.shape for x in planes.values())
    steps = {name: 1 if planes[name].shape == (height, width) else 2 for name in sorted(planes)}
    listed = b"".join(n.encode() + struct.pack("<x4i", 2, 0, step, step) for n, step in steps.items()) + b"\0"
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = (
        ("channels", "chlist", listed),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", box),
        ("displayWindow", "box2i", box),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
        ("screenWindowCenter", "v2f", bytes(8)),
        ("screenWindowWidth", "float", struct.pack("<f", 1.0)),
    )
    head = struct.pack("<2I", 20000630, 2)
    for name, kind, data in attributes:
        head += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(data)) + data
    head += b"\0"
    lines, table, at = b"", b"", len(head) + 8 * height
    for y in range(height):
        row = b"".join(planes[n][y // step].astype("<f4").tobytes() for n, step in steps.items() if y % step == 0)
        table += struct.pack("<Q", at + len(lines))
        lines += struct.pack("<2i", y, len(row)) + row
    path.write_bytes(head + table + lines)
    return path


def window(*corners: int) -> tuple[Any, Any]:
    """A data or display window of OpenEXR."""
    return (np.array(corners[:2], np.int32), np.array(corners[2:], np.int32))


def _exr(*args: Any, **header: Any) -> bytes:
    with TemporaryDirectory() as folder:
        return exr(Path(folder) / "a.exr", *args, **header).read_bytes()


def _chroma() -> bytes:
    with TemporaryDirectory() as folder:
        planes = {"Y": np.full((4, 6), 0.5), "RY": np.full((2, 3), 0.1), "BY": np.full((2, 3), -0.2)}
        return sparse_exr(Path(folder) / "a.exr", planes).read_bytes()


def _radiance() -> bytes:
    with TemporaryDirectory() as folder:
        gn.scenes.Image(CODES / 65535.0).save(Path(folder) / "a.hdr")
        return (Path(folder) / "a.hdr").read_bytes()


def _pillow(array: np.ndarray, kind: str, **options: Any) -> bytes:
    stream = io.BytesIO()
    Pillow.fromarray(array).save(stream, kind, **options)
    return stream.getvalue()


HEIGHTS = np.rint(1000.0 + 180.0 * np.sin(np.arange(24)[:, None] / 4.0) * np.cos(np.arange(32) / 3.0)).astype(np.uint16)

PICTURES: dict[str, Callable[[], bytes]] = {
    "picture OpenEXR layers": lambda: _exr(LAYERS, displayWindow=window(-2, 0, 8, 4)),
    "picture OpenEXR parts": lambda: _exr(None, {"albedo": {"R": 1, "G": 2, "B": 3}, "Z": {"Z": 4}}),
    "picture chroma": _chroma,
    "picture Radiance": _radiance,
    "picture PNG 16 bits": lambda: png(CODES, gamma(0.5), (b"tRNS", struct.pack(">3H", *CODES[0, 0].tolist()))),
    "picture PNG profile": lambda: png(CODES, icc(profile(b"curv" + bytes(8), SRGB_D50))),
    "picture JPEG": lambda: _pillow((CODES >> 8).astype(np.uint8), "JPEG", exif=EXIF),
}
"""What `gn.scenes.load_image` reads; of OpenEXR the layer `albedo`."""

GRAYS: dict[str, Callable[[], bytes]] = {
    "height map PNG": lambda: _pillow(HEIGHTS, "PNG"),
    "height map TIFF": lambda: _pillow(HEIGHTS.astype(np.float32), "TIFF"),
    "height map TIFF packed": lambda: _pillow(HEIGHTS, "TIFF", compression="tiff_adobe_deflate"),
}
