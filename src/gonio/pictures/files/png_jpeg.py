"""PNG and JPEG pictures, by pillow: sRGB codes of 8 bits, and 16-bit gray."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import FormatError
from ..colour import srgb_decode, srgb_encode
from ._source import DENSE, Picture, Source, blocks, library, warn_lost

STARTS = {b"\x89PNG\r\n\x1a\n": "PNG", b"\xff\xd8\xff": "JPEG"}
SUFFIXES = (".png", ".jpg", ".jpeg")
WRITTEN = ".png"


def read(source: Source) -> Picture:
    """The picture in a file; pillow raises errors of its own."""
    pillow = library("PIL.Image", "pillow")
    source.file.seek(0)
    try:
        picture = pillow.open(source.file, formats=("PNG", "JPEG"))
    except pillow.DecompressionBombError as error:
        raise FormatError(str(error)) from None
    with picture:
        width, height, deep = picture.width, picture.height, picture.mode.startswith("I")  # 16-bit gray
        names = ("Y",) if deep or picture.mode in ("1", "L", "LA") else tuple("RGB")
        covered = not deep and ("A" in picture.mode or "transparency" in picture.info)
        source.check(width, height, 4 * (len(names) + covered) + 4, DENSE * source.size)
        mode = "".join(names).replace("Y", "L") + "A" * covered
        light = srgb_decode(np.arange(256) / 255.0).astype(np.float32)
        pixels = np.empty((height, width, len(names)), np.float32)
        alpha = np.empty((height, width), np.float32) if covered else None
        for part in blocks(height, width):
            strip = picture.crop((0, part.start, width, part.stop))
            if deep:
                pixels[part, :, 0] = srgb_decode(np.asarray(strip).astype(np.float32) / np.float32(65535.0))
                continue
            codes = np.asarray(strip.convert(mode)).reshape(part.stop - part.start, width, -1)
            pixels[part] = light[codes[..., : len(names)]]
            if alpha is not None:
                alpha[part] = np.float32(1.0 / 255.0) * codes[..., -1]
    return Picture(pixels, alpha, names)


def encode(picture: Picture, path: str, exposure: float) -> Callable[[str], object]:
    """PNG of 8 bits, sRGB."""
    pillow, info = library("PIL.Image", "pillow"), library("PIL.PngImagePlugin", "pillow").PngInfo()
    pixels = picture.gray_or_rgb(path).astype(np.float64)
    warn_lost(np.isnan(pixels), path, "NaN and become 0")
    codes = srgb_encode(np.clip(pixels * 2.0**exposure, 0.0, 1.0))
    if picture.alpha is not None:
        codes = np.concatenate([codes, np.clip(picture.alpha, 0.0, 1.0)[..., None]], axis=-1)
    codes = np.floor(np.nan_to_num(codes) * 255.0 + 0.5).astype(np.uint8)
    info.add(b"sRGB", b"\0")
    coded = pillow.fromarray(codes[..., 0] if codes.shape[-1] == 1 else codes)
    return lambda name: coded.save(name, format="PNG", pnginfo=info)
