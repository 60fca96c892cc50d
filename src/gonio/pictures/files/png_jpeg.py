"""PNG and JPEG pictures, by pillow: codes of 8 or 16 bits, and how these stand for light."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import FormatError
from ..colour import srgb_decode, srgb_encode
from ._icc import profile
from ._source import DENSE, Picture, PictureFile, Unsettled, blocks, gray_or_rgb, library, warn_lost

if TYPE_CHECKING:
    from ..image import Image

STARTS = {b"\x89PNG\r\n\x1a\n": "PNG", b"\xff\xd8\xff": "JPEG"}
GRAY = {b"\x89PNG\r\n\x1a\n": "PNG", b"II*\0": "TIFF", b"MM\0*": "TIFF"}
SUFFIXES = (".png", ".jpg", ".jpeg")
WRITTEN = ".png"

ORIENTATION = 0x0112
"""The tag of EXIF that says which way is up."""

SRGB_GAMMA = (0.4545, 0.455)
"""From and up to which gAMA stands for sRGB's own curve, as libpng takes it."""

_SCALES = {"L;2": 85, "L;4": 17}  # of codes of fewer bits


class Codes(NamedTuple):
    """The codes of a picture, some rows (N, W, C) of uint8 or uint16 at a time; coverage is the last channel."""

    rows: Iterator[tuple[slice, NDArray[Any]]]
    size: tuple[int, int]
    is_gray: bool
    is_deep: bool
    covered: bool
    key: tuple[int, ...]
    info: dict[Any, Any]
    orientation: int
    notes: tuple[str, ...]


def read(source: PictureFile) -> Picture:
    """The picture in a file; pillow raises errors of its own."""
    source.expect_one_layer()
    codes = _codes(source, ("PNG", "JPEG"))
    names = ("Y",) if codes.is_gray else ("R", "G", "B")
    light, primaries, notes = _light(source, codes)
    width, height = codes.size
    transposed = codes.orientation > 4
    pixels = np.empty((width, height, len(names)) if transposed else (height, width, len(names)), np.float32)
    alpha = np.empty(pixels.shape[:2], np.float32) if codes.covered or codes.key else None
    for part, row_codes in codes.rows:
        rows = _stored(pixels, codes.orientation)[part]
        for k, curve in enumerate(light):
            rows[..., k] = curve[row_codes[..., k]]
        if alpha is not None:
            share = np.float32(1.0 / (65535.0 if codes.is_deep else 255.0))
            seen = share * row_codes[..., -1] if codes.covered else (row_codes != codes.key).any(axis=-1)
            _stored(alpha, codes.orientation)[part] = seen
    return Picture(pixels, alpha, names, primaries, coded=True, notes=(*codes.notes, *notes))


def gray(source: PictureFile) -> NDArray[np.float64]:
    """The codes (H, W) of a gray picture, as they are; of TIFF also numbers. Raises Unsettled for colours."""
    pillow = library("PIL.Image", "pillow")
    rule = "a gray picture has one number at each place: save the heights alone, gray"
    with _opened(pillow, source, ("PNG", "TIFF")) as picture:
        _check(picture, source, 1)
        scale = _SCALES.get(_raw(picture), 1)
        if picture.mode == "P":
            picture = picture.convert("RGBA" if "transparency" in picture.info else "RGB")
        if "A" in picture.mode or "a" in picture.mode:
            raise Unsettled(f"it has coverage ({picture.mode}); {rule}")
        gray_codes = np.asarray(picture)
        if gray_codes.ndim == 3 and picture.mode == "RGB" and (gray_codes == gray_codes[..., :1]).all():
            gray_codes = gray_codes[..., 0]
        if gray_codes.ndim != 2:
            raise Unsettled(f"it has colours ({picture.mode}); {rule}")
        if "transparency" in picture.info and isinstance(key := picture.info["transparency"], int):
            return np.where(gray_codes == key * scale, np.nan, gray_codes / scale)
        return gray_codes / scale


def _opened(pillow: Any, source: PictureFile, formats: tuple[str, ...]) -> Any:
    source.file.seek(0)
    try:
        return pillow.open(source.file, formats=formats)
    except pillow.DecompressionBombError as error:
        raise FormatError(str(error)) from None


def _check(picture: Any, source: PictureFile, channels: int) -> None:
    source.check(picture.width, picture.height, 4 * channels + 8, DENSE * source.size)


def _raw(picture: Any) -> str:
    """How a PNG's codes lie in the file, in pillow's words."""
    raw = picture.tile[0][3] if picture.tile and picture.format == "PNG" else ""
    return raw if isinstance(raw, str) else ""


def _codes(source: PictureFile, formats: tuple[str, ...]) -> Codes:
    pillow = library("PIL.Image", "pillow")
    picture = _opened(pillow, source, formats)
    raw, mode, info = _raw(picture), picture.mode, picture.info
    deep = raw.endswith("16B")
    is_gray = mode in ("1", "L", "LA") or raw in ("I;16B", "LA;16B")
    covered = mode in ("LA", "RGBA") or (mode == "P" and "transparency" in info)
    _check(picture, source, (1 if is_gray else 3) + covered)
    transparency: Any = info.get("transparency") if mode != "P" else None
    key: tuple[int, ...] = () if transparency is None else tuple(np.ravel(transparency).tolist())
    if mode == "1":
        key = tuple(255 * bool(x) for x in key)
    key = tuple(_SCALES.get(raw, 1) * x for x in key)
    notes: tuple[str, ...] = ()
    if mode not in ("1", "L", "LA", "P", "RGB", "RGBA", "I", "I;16"):
        notes = (f"{mode} inks are turned into RGB by complements, without a profile of the inks",)
    orientation = 1
    if "exif" in info:
        with suppress(Exception):  # damage makes pillow raise nearly every type there is
            orientation = int(picture.getexif().get(ORIENTATION, 1))
    orientation = orientation if 1 <= orientation <= 8 else 1
    plain = ("L" if is_gray else "RGB") + "A" * covered
    rows = _deep(pillow, source, picture, raw) if deep else _shallow(picture, plain)
    return Codes(rows, picture.size, is_gray, deep, covered, key, info, orientation, notes)


def _shallow(picture: Any, mode: str) -> Iterator[tuple[slice, NDArray[Any]]]:
    """Codes of 8 bits, converted to a mode of pillow."""
    for part in blocks(picture.height, picture.width):
        yield part, _rows(_strip(picture, part).convert(mode))


def _deep(pillow: Any, source: PictureFile, picture: Any, raw: str) -> Iterator[tuple[slice, NDArray[Any]]]:
    """Codes of 16 bits. Of colours pillow keeps one byte: that one, then the other, as if the bytes were reversed. Gray
    with coverage are four bytes, which it takes for those of four colours."""
    if raw == "LA;16B":
        picture.tile = [(*tile[:3], "RGBA") for tile in picture.tile]
    picture.load()
    again = None
    if raw.startswith("RGB"):
        again = _opened(pillow, source, ("PNG",))
        again.tile = [(*tile[:3], f"{raw[:-1]}L") for tile in again.tile]
    for part in blocks(picture.height, picture.width):
        codes: NDArray[Any] = _rows(_strip(picture, part)).astype(np.uint16)
        if again is not None:
            codes = codes << np.uint16(8) | _rows(_strip(again, part))
        elif raw == "LA;16B":
            codes = codes[..., 0::2] << np.uint16(8) | codes[..., 1::2]
        yield part, codes


def _strip(picture: Any, part: slice) -> Any:
    return picture.crop((0, part.start, picture.width, part.stop))


def _rows(strip: Any) -> NDArray[Any]:
    return np.asarray(strip).reshape(strip.height, strip.width, -1)


def _stored(x: NDArray[Any], orientation: int) -> NDArray[Any]:
    """An upright picture, as its file lies; both are the same memory."""
    turns = {
        2: lambda a: a[:, ::-1],
        3: lambda a: a[::-1, ::-1],
        4: lambda a: a[::-1],
        5: lambda a: a.swapaxes(0, 1),
        6: lambda a: np.rot90(a, 1),
        7: lambda a: a[::-1, ::-1].swapaxes(0, 1),
        8: lambda a: np.rot90(a, -1),
    }
    return turns[orientation](x) if orientation in turns else x


def _light(source: PictureFile, codes: Codes) -> tuple[NDArray[np.float32], tuple[float, ...] | None, list[str]]:
    """Linear values (C, N) of codes; the primaries, where the file says them; what is not obeyed.

    The caller's word, an ICC profile, sRGB and gAMA count in this order (PNG, third edition, 4.3).
    """
    count, info = 1 if codes.is_gray else 3, codes.info
    x = np.linspace(0.0, 1.0, 65536 if codes.is_deep else 256)
    light, primaries, notes = srgb_decode(x), None, []
    if source.limits.linear is not None:
        light = x if source.limits.linear else light
    elif told := _coding(source):
        colours, transfer = told
        light = x if transfer == 8 else light
        if transfer not in (8, 13) or colours != 1:
            notes.append(f"cICP says primaries {colours}, transfer {transfer}; taken for those of sRGB, 1 and 13")
    elif "icc_profile" in info:
        icc = profile(info["icc_profile"] or b"", count, x)
        if icc is None:
            notes.append("its ICC profile is damaged, or one of tables; taken for sRGB, but with linear=True")
        else:
            light = icc.light
            if not icc.is_srgb:
                notes.append("primaries of its ICC profile are not sRGB's; its curves are obeyed, nothing is converted")
    elif "srgb" not in info:
        gamma = info.get("gamma", SRGB_GAMMA[0])
        if not 0.01 <= gamma <= 100.0:
            raise FormatError(f"gAMA is {gamma}, expected 0.01 to 100")
        light = light if SRGB_GAMMA[0] <= gamma <= SRGB_GAMMA[1] else x ** (1.0 / gamma)
        if "chromaticity" in info and count == 3:
            white, *colours = np.reshape(info["chromaticity"], (4, 2)).tolist()
            primaries = tuple(v for xy in (*colours, white) for v in xy)
    return np.broadcast_to(light, (count, len(x))).astype(np.float32), primaries, notes


def _coding(source: PictureFile) -> tuple[int, int] | None:
    """Primaries and transfer function of a PNG's cICP chunk, which pillow passes over."""
    source.file.seek(0)
    if source.file.read(8) not in STARTS:
        return None
    while len(head := source.file.read(8)) == 8:
        length, chunk = struct.unpack(">I4s", head)
        if chunk == b"cICP" and length == 4:
            return tuple(source.file.read(2))  # type: ignore[return-value]  # of two bytes: two numbers
        if chunk in (b"IDAT", b"IEND"):
            break
        source.file.seek(length + 4, 1)
    return None


def encode(image: Image, path: str, exposure: float) -> Callable[[str], object]:
    """PNG of 8 bits, sRGB; coverage not multiplied in."""
    pillow, info = library("PIL.Image", "pillow"), library("PIL.PngImagePlugin", "pillow").PngInfo()
    pixels = gray_or_rgb(image.colour, path).astype(np.float64)
    warn_lost(np.isnan(pixels), path, "NaN and become 0")
    codes = srgb_encode(np.clip(pixels * 2.0**exposure, 0.0, 1.0))
    if image.alpha is not None:
        codes = np.concatenate([codes, np.clip(image.alpha, 0.0, 1.0)[..., None]], axis=-1)
    codes = np.floor(np.nan_to_num(codes) * 255.0 + 0.5).astype(np.uint8)
    info.add(b"sRGB", b"\0")
    coded = pillow.fromarray(codes[..., 0] if codes.shape[-1] == 1 else codes)
    return lambda name: coded.save(name, format="PNG", pnginfo=info)
