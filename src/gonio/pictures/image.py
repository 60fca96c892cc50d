"""Pictures of linear light: the `Image` class, its files (.png, .exr, .hdr) and the sRGB transfer function.

Files are recognised by their first bytes, never by their suffix. What a format cannot hold is refused or
announced; .png alone is for looking at.
"""

import importlib
import os
import re
import stat
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import errors
from ..compile.threads import apart
from ..errors import FormatError, ParameterError, ShapeError, TooLargeError
from ..files import replacing, target
from . import openexr_file
from .radiance_rle import longest, scanlines

__all__ = ["Image", "read_image", "srgb_decode", "srgb_encode"]

PIXELS = 2**29
"""Most pixels that a picture may announce: 32768 x 16384."""

_DENSE = 2**14  # pixels that a byte may stand for: one colour, 8192 x 4096, comes to 8089 as 1-bit PNG
_BESIDE = 6  # bytes a pixel that libraries take beside what they return
_HEADER_LINE = 1 << 16  # bytes
_BLOCK = 1 << 18  # pixels that are converted at a time
_SRGB_XY = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # ITU-R BT.709: red, green, blue, white


def srgb_encode(linear: ArrayLike) -> NDArray[Any]:
    r"""Linear value to sRGB code value, both 1 at white.

    $$V = 12.92\,L \;\; (L \le 0.0031308), \qquad V = 1.055\,L^{1/2.4} - 0.055 \;\; \text{otherwise}$$

    Shapes   any, elementwise; floats keep their dtype, integers become float64.
    Units    none. Nothing is clamped: negative values follow the straight line, NaN stays NaN.
    Error    rounding, and 3e-8 where the two rounded thresholds of the standard do not quite meet.
    Source   IEC 61966-2-1:1999, 5.2.
    """
    x = np.asarray(linear) * 1.0
    power = 1.055 * np.maximum(x, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(x <= 0.0031308, 12.92 * x, power)[()]


def srgb_decode(encoded: ArrayLike) -> NDArray[Any]:
    r"""sRGB code value to linear value, both 1 at white: the inverse of `srgb_encode`.

    $$L = V / 12.92 \;\; (V \le 0.04045), \qquad L = ((V + 0.055) / 1.055)^{2.4} \;\; \text{otherwise}$$

    Shapes, units, error, source: as `srgb_encode`. An 8-bit code is divided by 255 first.
    """
    x = np.asarray(encoded) * 1.0
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.04045) + 0.055) / 1.055) ** 2.4)[()]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Image:
    """A picture: linear pixels, row 0 at the top.

    Shapes   `pixels` (H, W, C) float32; `alpha` (H, W) float32 or None; `channels` C names or None.
    Units    `pixels` as rendered (radiance, when the lights are), linear sRGB primaries for C = 3; `alpha` is
             coverage, 0 to 1, not multiplied into `pixels` (as in .png; .exr files hold the product, and are
             divided on reading).
    Errors   ShapeError; ArrayTypeError (not floats); ParameterError (names). float32 arrays are not copied.
    """

    pixels: NDArray[np.float32]
    alpha: NDArray[np.float32] | None = None
    channels: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        pixels = _float32(self.pixels, "pixels")
        if pixels.ndim != 3 or 0 in pixels.shape:
            raise ShapeError(f"pixels are {pixels.shape}, expected (H, W, C); gray: pixels[..., None]")
        object.__setattr__(self, "pixels", pixels)
        if self.alpha is not None:
            alpha = _float32(self.alpha, "alpha")
            if alpha.shape != pixels.shape[:2]:
                raise ShapeError(f"alpha is {alpha.shape}, expected (H, W), here {pixels.shape[:2]}")
            object.__setattr__(self, "alpha", alpha)
        if self.channels is not None:
            names = tuple(map(str, self.channels))
            distinct = {n for n in names if n.isprintable() and 0 < len(n.encode()) < 256} - {"A"}
            if len(distinct) != pixels.shape[2] or len(names) != pixels.shape[2]:
                rule = f"{pixels.shape[2]} different short names, none of them 'A'; coverage goes into alpha"
                raise ParameterError(f"channels are {names}, expected {rule}")
            object.__setattr__(self, "channels", names)

    def __repr__(self) -> str:
        height, width, count = self.pixels.shape
        names = ", ".join(self.channels) if self.channels and count <= 4 else f"{count} channels"
        return f"Image({width} x {height}, {names}{'' if self.alpha is None else ', alpha'})"

    def save(self, path: str | os.PathLike[str], exposure: float = 0.0) -> None:
        """Write the picture whole or not at all (beside the target, then renamed); the suffix is the format.

        .png     8 bits: round(255 srgb_encode(clamp(2^exposure pixels, 0, 1))); C = 1 or 3; alpha as it is.
                 NaN becomes 0, and a MissingDataWarning says how many.
        .exr     float32, lossless, NaN and infinity kept: R, G, B, or Y, or the given names; with an alpha
                 also A, and the others multiplied by it, as OpenEXR has it.
        .hdr     Radiance RGBE, flat; C = 3, or 1 written three times; over black; rounded to nearest: error at
                 most 1/256 of a pixel's largest channel. NaN becomes 0, and what lies outside 0 to 1.69e38 is
                 clamped: a MissingDataWarning says how many.

        Units    `exposure` in stops, for .png only: the other two hold the values themselves.
        Errors   ParameterError (suffix, exposure, values the format cannot hold), ShapeError (channel count),
                 NotFoundError (no such directory), DependencyError (pillow or OpenEXR is not installed);
                 WriteError (disk full and the like).
        """
        check_target(path, exposure)
        write = _ENCODERS[Path(path).suffix.lower()](self, os.fspath(path), float(exposure))
        with replacing(path) as temporary:
            write(str(temporary))


def check_target(path: str | os.PathLike[str], exposure: float = 0.0) -> None:
    """Raise what `Image.save` raises for this name and exposure: to be asked before a picture is made."""
    suffix = Path(path).suffix.lower()
    if suffix not in _ENCODERS:
        raise ParameterError(f"{path}: suffix is {suffix!r}, expected one of {', '.join(_ENCODERS)}")
    if not abs(exposure) <= (200.0 if suffix == ".png" else 0.0):
        rule = "within 200 stops for .png, 0 for .exr and .hdr; scale the pixels instead"
        raise ParameterError(f"{path}: exposure is {exposure}, expected {rule}")
    target(path)


def read_image(path: str | os.PathLike[str], most: int = PIXELS) -> Image:
    """Read an OpenEXR, Radiance, PNG or JPEG picture, recognised by its first bytes.

    OpenEXR    half, float or uint as float32 (uint above 2^24 rounds). R, G, B first, then the other
               channels by name; A becomes `alpha`. Of several parts the first; nothing deep or subsampled.
    Radiance   value = mantissa 2^(E - 136), 0 where E = 0, divided by all EXPOSURE and COLORCORR lines.
               Radiance itself adds 1/2 to the mantissa, for its writer truncates; Mitsuba and OpenCV do not,
               nor do we: 1.0 reads as 1.0, and a truncating writer's picture half a step (0.2 to 0.4 % of
               the largest channel) too dark. Flat, old and new run-length coding, every orientation; no XYZE.
    PNG, JPEG  `srgb_decode` of what pillow reads, without profiles or gamma; 16-bit colour comes as 8-bit.
               Up to pillow's own limit of 178 956 970 pixels.

    Primaries that are not sRGB's give a warning, and the values stay as they are.
    `most`: pixels; a picture that announces more is refused before anything of it is decoded. Reading RGB never takes
    more than 30 bytes of memory a pixel, and 12 of them stay.

    Shapes   `pixels` (H, W, C), row 0 at the top.
    Errors   NotFoundError (missing or not readable), FormatError (whatever else is wrong with the file),
             TooLargeError (it announces more than this machine has memory for).
    Source   G. Ward, "Radiance File Formats" (filefmts.pdf); "OpenEXR File Layout" (openexr.com).
    """
    image, primaries = apart(_decoded, path, most)
    if not np.allclose(primaries, _SRGB_XY, atol=0.002):
        text = f"primaries are {tuple(np.round(primaries, 4).tolist())}, not sRGB's {_SRGB_XY}"
        warnings.warn(f"{path}: {text}; nothing is converted", stacklevel=2)
    return image


def _decoded(path: str | os.PathLike[str], most: int) -> tuple[Image, Any]:
    """The picture in a file, and its primaries."""
    with _opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        head = file.read(10)
        found = next((reader for magic, reader in _READERS.items() if head.startswith(magic)), None)
        if found is None:
            known = ", ".join(f"{magic!r} ({kind})" for magic, (kind, _) in _READERS.items())
            rule = f"starts with {head!r}, expected {known}; convert it to .exr or .hdr first"
            raise FormatError(f"{path}: not a picture gonio reads: {rule}")
        kind, reader = found
        try:
            with np.errstate(all="ignore"):
                return reader(_Source(file, os.fspath(path), size, most))
        except errors.DependencyError:
            raise
        except MemoryError as error:
            why = str(error) if isinstance(error, TooLargeError) else "there is not enough memory to decode it"
            text = f"{path}: {kind} picture: {why}; make it smaller, or use a machine with more memory"
            raise TooLargeError(text) from None
        except Exception as error:  # damage makes pillow and OpenEXR raise nearly every type there is
            why = str(error) if isinstance(error, errors.Error) else repr(error)
            text = f"{path}: damaged or unsupported {kind} picture: {why}; copy or export it again"
            raise FormatError(text) from error


def _opened(path: str | os.PathLike[str]) -> BinaryIO:
    """The file of this name, open, at its start; not a FIFO, a device or the like, which may never end."""
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise errors.NotFoundError(f"{path}: {why}; check the name and its permissions") from None
    mode = os.fstat(handle).st_mode
    if stat.S_ISREG(mode):
        return os.fdopen(handle, "rb")
    os.close(handle)
    if stat.S_ISDIR(mode):
        raise FormatError(f"{path}: is a directory, expected a picture; name a file in it")
    raise FormatError(f"{path}: is a FIFO, a device or the like, expected a file; copy what comes from it into one")


@dataclass(frozen=True, slots=True)
class _Source:
    """A picture's file, open; its name, its size in bytes, and the most pixels that may be read of it."""

    file: BinaryIO
    path: str
    size: int
    most: int

    def check(self, width: int, height: int, each: int, dense: int) -> None:
        """Refuse a picture of more pixels than are allowed, than its bytes can hold (`dense`) or, at `each` bytes a
        pixel, than fit into memory."""
        if min(width, height) < 1 or width * height > min(self.most, dense):
            limit = f"1 to {self.most} pixels, and what {self.size} bytes can hold"
            raise FormatError(f"the header says {width} x {height} pixels, expected {limit}")
        needed, there = width * height * (each + _BESIDE), _available()
        if needed > there:
            said = f"the header says {width} x {height} pixels, which take up to {needed / 1e9:.1f} GB"
            raise TooLargeError(f"{said}, and {there / 1e9:.1f} GB are free")


def _available() -> float:
    """Bytes of memory that are free on this machine, as far as that is known."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            return next(1024.0 * int(line.split()[1]) for line in file if line.startswith("MemAvailable:"))
    except (OSError, ValueError, StopIteration):
        return float("inf")


def _blocks(height: int, width: int) -> Iterator[slice]:
    """Some rows at a time."""
    step = max(1, _BLOCK // width)
    return (slice(start, min(start + step, height)) for start in range(0, height, step))


def _read_exr(source: _Source) -> tuple[Image, Sequence[float]]:
    found = openexr_file.read(_library("OpenEXR", "OpenEXR"), source.file, source.path, source.size, source.check)
    image = Image(found.pixels, found.alpha, None if found.names == ("A",) else found.names)
    return image, found.primaries or _SRGB_XY


def _read_radiance(source: _Source) -> tuple[Image, Sequence[float]]:
    known = {b"EXPOSURE": np.ones(1), b"COLORCORR": np.ones(3), b"PRIMARIES": np.array(_SRGB_XY)}
    source.file.seek(0)
    while line := _header_line(source.file):
        key, _, value = line.partition(b"=")
        if key == b"FORMAT" and value.strip() != b"32-bit_rle_rgbe":
            raise FormatError(f"FORMAT is {value[:40]!r}, expected b'32-bit_rle_rgbe' (XYZ: ra_xyze -r)")
        if key in known:
            numbers = np.array([float(v) for v in value.split()])
            if numbers.shape != known[key].shape or not np.all((numbers > 0.0) & (numbers < np.inf)):
                raise FormatError(f"header has {line[:50]!r}, expected {known[key].size} positive numbers")
            known[key] = numbers if key == b"PRIMARIES" else known[key] * numbers  # the others accumulate
    line = _header_line(source.file)
    size = re.fullmatch(rb"([+-])([XY]) +(\d{1,9}) +([+-])([XY]) +(\d{1,9})\s*", line)
    if size is None or size[2] == size[5]:
        raise FormatError(f"resolution line is {line[:40]!r}, expected '-Y height +X width'")
    rows, columns = int(size[3]), int(size[6])
    source.check(columns, rows, 12 + 4 + 8, _DENSE * source.size)
    packed = min(longest(rows, columns), source.size - source.file.tell())
    rgbe = scanlines(source.file.read(packed), 0, rows, columns)
    # A scanline runs along the second axis named; +Y goes up and -X left, against the order of the array.
    if size[2] == b"X":
        rgbe = rgbe.swapaxes(0, 1)
    signs = {size[2]: size[1], size[5]: size[4]}
    rgbe = rgbe[:: 1 if signs[b"Y"] == b"-" else -1, :: 1 if signs[b"X"] == b"+" else -1]
    unit = np.ldexp(np.float32(1.0), np.arange(256) - 136)
    unit[0] = 0.0
    divisor = known[b"EXPOSURE"] * known[b"COLORCORR"]
    pixels = np.empty((*rgbe.shape[:2], 3), np.float32)
    for part in _blocks(*rgbe.shape[:2]):
        np.multiply(rgbe[part, :, :3], unit[rgbe[part, :, 3]][..., None], out=pixels[part])
        if np.any(divisor != 1.0):
            pixels[part] = pixels[part] / divisor
    return Image(pixels, channels=tuple("RGB")), known[b"PRIMARIES"].tolist()


def _header_line(file: BinaryIO) -> bytes:
    line = file.readline(_HEADER_LINE)
    if not line.endswith(b"\n"):
        raise FormatError(f"header line {line[:40]!r} does not end, expected lines of at most {_HEADER_LINE} bytes")
    return line.rstrip(b"\r\n")


def _read_pillow(source: _Source) -> tuple[Image, Sequence[float]]:
    pillow = _library("PIL.Image", "pillow")
    source.file.seek(0)
    try:
        picture = pillow.open(source.file, formats=("PNG", "JPEG"))
    except pillow.DecompressionBombError as error:
        raise FormatError(str(error)) from None
    with picture:
        width, height, deep = picture.width, picture.height, picture.mode.startswith("I")  # 16-bit gray
        names = ("Y",) if deep or picture.mode in ("1", "L", "LA") else tuple("RGB")
        covered = not deep and ("A" in picture.mode or "transparency" in picture.info)
        source.check(width, height, 4 * (len(names) + covered) + 4, _DENSE * source.size)
        mode = "".join(names).replace("Y", "L") + "A" * covered
        light = srgb_decode(np.arange(256) / 255.0).astype(np.float32)
        pixels = np.empty((height, width, len(names)), np.float32)
        alpha = np.empty((height, width), np.float32) if covered else None
        for part in _blocks(height, width):
            strip = picture.crop((0, part.start, width, part.stop))
            if deep:
                pixels[part, :, 0] = srgb_decode(np.asarray(strip).astype(np.float32) / np.float32(65535.0))
                continue
            codes = np.asarray(strip.convert(mode)).reshape(part.stop - part.start, width, -1)
            pixels[part] = light[codes[..., : len(names)]]
            if alpha is not None:
                alpha[part] = np.float32(1.0 / 255.0) * codes[..., -1]
    return Image(pixels, alpha, names), _SRGB_XY


def _encode_png(image: Image, path: str, exposure: float) -> Callable[[str], object]:
    pillow, info = _library("PIL.Image", "pillow"), _library("PIL.PngImagePlugin", "pillow").PngInfo()
    pixels = _gray_or_rgb(image, path).astype(np.float64)
    _warn_lost(np.isnan(pixels), path, "NaN and become 0")
    codes = srgb_encode(np.clip(pixels * 2.0**exposure, 0.0, 1.0))
    if image.alpha is not None:
        codes = np.concatenate([codes, np.clip(image.alpha, 0.0, 1.0)[..., None]], axis=-1)
    codes = np.floor(np.nan_to_num(codes) * 255.0 + 0.5).astype(np.uint8)
    info.add(b"sRGB", b"\0")
    picture = pillow.fromarray(codes[..., 0] if codes.shape[-1] == 1 else codes)
    return lambda name: picture.save(name, format="PNG", pnginfo=info)


def _encode_exr(image: Image, path: str, exposure: float) -> Callable[[str], object]:
    openexr = _library("OpenEXR", "OpenEXR")
    count = image.pixels.shape[2]
    names = image.channels or {1: ("Y",), 3: tuple("RGB")}.get(count) or [f"C{i:04d}" for i in range(count)]
    planes = dict(zip(names, np.ascontiguousarray(np.moveaxis(_over_black(image), -1, 0)), strict=True))
    if image.alpha is not None:
        planes["A"] = np.ascontiguousarray(image.alpha)
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    return lambda name: openexr.File(header, planes).write(name)


def _encode_hdr(image: Image, path: str, exposure: float) -> Callable[[str], object]:
    _gray_or_rgb(image, path)
    pixels = _over_black(image)
    outside = ~((pixels >= 0.0) & (pixels <= 1.69e38))
    _warn_lost(outside, path, "NaN (now 0) or outside 0 to 1.69e38 (clamped)")
    pixels = np.clip(np.nan_to_num(pixels), 0.0, np.float32(1.69e38))
    largest = pixels.max(axis=-1)
    mantissa, exponent = np.frexp(largest)
    exponent = exponent + (mantissa >= 255.5 / 256.0)  # would round up to 256
    codes = np.zeros((*largest.shape, 4), np.uint8)
    codes[..., :3] = np.rint(np.ldexp(pixels.astype(np.float64), (8 - exponent)[..., None]))
    codes[..., 3] = np.maximum(exponent + 128, 0)
    codes[(largest == 0.0) | (exponent < -127)] = 0
    # Flat: the largest mantissa is at least 128, so no pixel looks like a run-length mark.
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {largest.shape[0]} +X {largest.shape[1]}\n"
    return lambda name: Path(name).write_bytes(header.encode() + codes.tobytes())


_READERS: dict[bytes, tuple[str, Callable[[_Source], tuple[Image, Sequence[float]]]]] = {
    b"#?RADIANCE": ("Radiance", _read_radiance),
    b"#?RGBE": ("Radiance", _read_radiance),
    b"v/1\x01": ("OpenEXR", _read_exr),
    b"\x89PNG\r\n\x1a\n": ("PNG", _read_pillow),
    b"\xff\xd8\xff": ("JPEG", _read_pillow),
}
_ENCODERS = {".png": _encode_png, ".exr": _encode_exr, ".hdr": _encode_hdr}  # check, and return a writer


def _warn_lost(lost: NDArray[np.bool_], path: str, what: str) -> None:
    if count := int(lost.any(axis=-1).sum()):
        text = f"{path}: {count} of {lost[..., 0].size} pixels are {what}; .exr keeps them"
        warnings.warn(text, errors.MissingDataWarning, stacklevel=4)


def _over_black(image: Image) -> NDArray[np.float32]:
    return image.pixels if image.alpha is None else image.pixels * image.alpha[..., None]


def _gray_or_rgb(image: Image, path: str) -> NDArray[np.float32]:
    if (count := image.pixels.shape[2]) in (1, 3):
        return image.pixels
    raise ShapeError(f"{path}: {count} channels, expected 1 or 3; pick some of them, or write .exr")


def _float32(values: ArrayLike, name: str) -> NDArray[np.float32]:
    x = np.asarray(values)
    if x.dtype.kind != "f":
        raise errors.ArrayTypeError(f"{name} are {x.dtype}, expected floats; codes: srgb_decode(x / 255)")
    with np.errstate(over="ignore"):
        return x.astype(np.float32, copy=False)


def _library(module: str, package: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        text = f"{package} reads and writes this format and is not installed; pip install {package}"
        raise errors.DependencyError(text) from error
