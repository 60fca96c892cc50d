"""Pictures of linear light: the `Image` class, read and saved in the formats of `files/`.

Files are recognized by their first bytes, never by their suffix. Values that a format cannot hold are refused or
announced; .png alone is for looking at.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import errors
from ..declared.arguments import checked
from ..declared.discover import modules
from ..declared.notebooks import repr_html, repr_png
from ..declared.numbers import numbers
from ..errors import FormatError, MeaningWarning, ParameterError, ShapeError, TooLargeError, warn
from ..files import replacing, target
from ..machine.aside import apart
from .colour import SRGB_XY, srgb_decode, srgb_encode
from .files._source import Limits, Picture, PictureFile, Unsettled, opened

PIXELS = 2**29
"""The most pixels that a picture may announce: 32768 x 16384."""

_FORMATS = modules("gonio.pictures.files")
_WRITERS = {module.WRITTEN: module for module in _FORMATS}

SUFFIXES = tuple(suffix for module in _FORMATS for suffix in module.SUFFIXES)
"""Suffixes of the files that `load_image` reads."""


STARTS = {start: name for module in _FORMATS for start, name in module.STARTS.items()}
"""The first bytes of these files, and the name of what they are."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Image:
    """A picture: linear pixels, row 0 at the top.

    Shapes   `pixels` (H, W, C) float32; `alpha` (H, W) float32 or None; `channels` C names or None; `error` as
             `pixels`, or None: their standard errors, of a picture that was rendered; `samples` of each of its pixels.
    Units    `pixels` as rendered (radiance, when the lights are), linear sRGB primaries for C = 3; `alpha` is
             coverage, 0 to 1. `premultiplied`: whether it is multiplied into `pixels` (and `error`), as in .exr files;
             in those of .png and of `gn.render` it is not. `light` and `colour` are either, whatever `pixels` are.
    Errors   ShapeError; ArrayTypeError (not floats); ParameterError (names). float32 arrays are not copied.

    Example
    >>> picture = gn.scenes.Image(np.full((2, 4, 3), 0.18))
    >>> print(picture.pixels.shape, picture.alpha)
    (2, 4, 3) None
    """

    _repr_html_ = repr_html
    _repr_png_ = repr_png

    pixels: NDArray[np.float32]
    alpha: NDArray[np.float32] | None = None
    channels: tuple[str, ...] | None = None
    error: NDArray[np.float32] | None = None
    samples: int | None = None
    premultiplied: bool = False

    @property
    def light(self) -> NDArray[np.float32]:
        """What comes from each pixel before black, times its coverage: radiance, of a picture of radiance. Files of
        OpenEXR hold it, and it may be where nothing is covered, as of a flame.

        Example
        >>> half = gn.scenes.Image(np.full((1, 1, 3), 0.8), alpha=np.full((1, 1), 0.5))
        >>> print(half.light[0, 0], half.colour[0, 0])
        [0.4 0.4 0.4] [0.8 0.8 0.8]
        """
        return self.pixels if self.alpha is None or self.premultiplied else over_black(self.pixels, self.alpha)

    @property
    def colour(self) -> NDArray[np.float32]:
        """The mean over the covered part of each pixel, its `light` over its coverage; where nothing is covered, as it
        is.

        Example
        >>> half = gn.scenes.Image(np.full((1, 1, 3), 0.4), alpha=np.full((1, 1), 0.5), premultiplied=True)
        >>> print(half.colour[0, 0])
        [0.8 0.8 0.8]
        """
        if self.alpha is None or not self.premultiplied:
            return self.pixels
        out, alpha = self.pixels.copy(), self.alpha[..., None]
        return np.divide(out, alpha, out=out, where=alpha > 0.0)

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
        if self.error is not None:
            error = _float32(self.error, "error")
            if error.shape != pixels.shape:
                raise ShapeError(f"error is {error.shape}, expected that of the pixels, {pixels.shape}")
            object.__setattr__(self, "error", error)
        if self.channels is not None:
            several = isinstance(self.channels, (list, tuple)) or getattr(self.channels, "ndim", 0) == 1
            names = tuple(map(str, self.channels if several else [self.channels]))
            distinct = {n for n in names if n.isprintable() and 0 < len(n.encode()) < 256} - {"A"}
            if len(distinct) != pixels.shape[2] or len(names) != pixels.shape[2]:
                expected = f"{pixels.shape[2]} different short names, none of them 'A'; coverage goes into alpha"
                raise ParameterError(f"channels are {names}, expected {expected}")
            object.__setattr__(self, "channels", names)

    def __repr__(self) -> str:
        height, width, count = self.pixels.shape
        names = ", ".join(self.channels) if self.channels and count <= 4 else f"{count} channels"
        alpha = "" if self.alpha is None else ", alpha multiplied in" if self.premultiplied else ", alpha"
        return f"Image({width} x {height}, {names}{alpha})"

    @checked
    def save(self, path: str | os.PathLike[str], exposure: float = 0.0) -> None:
        """Write the picture whole or not at all (beside the target, then renamed); the suffix is the format.

        .png     8 bits: round(255 srgb_encode(clamp(2^exposure colour, 0, 1))); C = 1 or 3; alpha as it is.
                 NaN becomes 0, and a MissingDataWarning says how many pixels that are.
        .exr     float32, lossless, NaN and infinity kept: R, G, B, or Y, or the given names; with an alpha
                 also A, and the others are `light`, multiplied by it.
        .hdr     Radiance RGBE, flat; C = 3, or 1 written three times; `light`; rounded to nearest: error at
                 most 1/256 of a pixel's largest channel. NaN becomes 0, values outside 0 to 1.69e38 are clamped,
                 and a MissingDataWarning says how many pixels that are.

        Units    `exposure` in stops, for .png only: the other two hold the values themselves.
        Errors   ParameterError (suffix, exposure, values the format cannot hold), ShapeError (channel count),
                 NotFoundError (no such directory), DependencyError (pillow or OpenEXR is not installed);
                 WriteError (disk full and the like).

        Example
        >>> gn.scenes.Image(np.full((2, 4, 3), 0.18)).save("grey.png")
        >>> print(gn.scenes.load_image("grey.png").pixels[0, 0].round(2))
        [0.18 0.18 0.18]
        """
        check_target(path, exposure)
        write = _WRITERS[Path(path).suffix.lower()].encode(self, os.fspath(path), float(exposure))
        with replacing(path) as temporary:
            write(str(temporary))


def check_target(path: str | os.PathLike[str], exposure: float = 0.0) -> None:
    """Raise the errors of `Image.save` for this name and exposure, before a picture is made."""
    suffix = Path(path).suffix.lower()
    if suffix not in _WRITERS:
        raise ParameterError(f"{path}: suffix is {suffix!r}, expected one of {', '.join(_WRITERS)}")
    if not abs(exposure) <= (200.0 if suffix == ".png" else 0.0):
        expected = "within 200 stops for .png, 0 for .exr and .hdr; scale the pixels instead"
        raise ParameterError(f"{path}: exposure is {exposure}, expected {expected}")
    target(path)


def shown_on_screen(picture: Image, scale: float = 1.0) -> NDArray[Any]:
    """A picture times a factor as sRGB with its coverage (H, W, 4), from 0 to 1; gray where channels are no colours."""
    linear = picture.colour if picture.pixels.shape[-1] == 3 else picture.colour.mean(axis=-1, keepdims=True)
    codes = srgb_encode(np.clip(np.nan_to_num(linear.astype(float)) * scale, 0.0, 1.0))
    alpha = np.ones(codes.shape[:2]) if picture.alpha is None else np.clip(picture.alpha, 0.0, 1.0)
    return np.concatenate([np.broadcast_to(codes, (*codes.shape[:2], 3)), alpha[..., None]], axis=-1)


def over_black(pixels: NDArray[Any], alpha: NDArray[Any]) -> NDArray[Any]:
    """Pixels times their coverage; what covers nothing is 0, also where it is not finite."""
    covered: NDArray[Any] = np.where(alpha[..., None] > 0.0, pixels, np.float32(0.0))
    covered *= alpha[..., None]
    return covered


@checked
def load_image(
    path: str | os.PathLike[str], max_pixels: int = PIXELS, *, layer: str | None = None, linear: bool | None = None
) -> Image:
    """Read an OpenEXR, Radiance, PNG or JPEG picture, recognized by its first bytes.

    OpenEXR    half, float or uint as float32 (uint above 2^24 rounds), of a layer: R, G, B (r, g, b; red, green, blue)
               whatever their order; other channels by their names, those with numbers by these. A becomes `alpha`, and
               pixels stay as they are stored, multiplied by it: `premultiplied`. The display window is what is read:
               0, and coverage 0, where the data window has nothing; what lies beyond is left out. Luminance and chroma
               become RGB, as in OpenEXR's own reader. Nothing deep.
    Radiance   value = mantissa 2^(E - 136), 0 where E = 0, divided by all EXPOSURE and COLORCORR lines.
               Radiance itself adds 1/2 to the mantissa, for its writer truncates; Mitsuba and OpenCV do not,
               nor do we: 1.0 reads as 1.0, and a truncating writer's picture half a step (0.2 to 0.4 % of
               the largest channel) too dark. Flat, old and new run-length coding, every orientation; no XYZE.
    PNG, JPEG  codes of 8 and 16 bits, made linear by the picture's ICC profile, else by sRGB's curve if it says so or
               nothing, else by its gAMA (0.45455 is sRGB). The way up is that of EXIF. Up to pillow's own limit of
               178 956 970 pixels.

    `layer`: which one, where an OpenEXR file has several: `albedo` for `albedo.R` and so on, "" for channels without
    a dot, a part by its name, one channel by its whole name, or "*" for all channels of the first part. Without it,
    several are an error that names them.
    `linear`: True, codes are linear as they are; False, they are sRGB's; whatever the file says. Floats are linear
    unless False.
    `max_pixels`: a picture that announces more is refused before anything of it is decoded. Reading RGB never takes
    more than 30 bytes of memory a pixel, and 12 of them stay.

    A MeaningWarning tells what is not obeyed: primaries that are not sRGB's, for which values stay as they are, pixels
    that are not square, profiles of tables, inks, and channels beside R, G, B that are left out.

    Shapes   `pixels` (H, W, C), row 0 at the top.
    Errors   NotFoundError (missing or not readable), FormatError (everything else that is wrong with the file),
             TooLargeError (it announces more than this machine has memory for).
    Source   G. Ward, "Radiance File Formats" (filefmts.pdf); "OpenEXR File Layout" (openexr.com); PNG, third edition.

    Example
    >>> gn.scenes.Image(np.full((2, 4, 3), 1000.0)).save("bright.exr")
    >>> print(gn.scenes.load_image("bright.exr").pixels.max())
    1000.0
    """
    image, notes = apart(_read, path, Limits(max_pixels, layer, linear), _READERS)
    for note in notes:
        warn(f"{path}: {note}", MeaningWarning)
    return image


def read_gray(path: str | os.PathLike[str], max_pixels: int) -> NDArray[np.float64]:
    """The codes (H, W) of a gray PNG, or the numbers of a gray TIFF, as they are; NaN where a PNG is transparent.

    Raises as `load_image`; FormatError for colours.
    """
    codes: NDArray[np.float64] = apart(_read, path, Limits(max_pixels), _GRAY_READERS)
    return codes


def _image(module: Any, source: PictureFile) -> tuple[Image, list[str]]:
    """The picture in a file, by the module of its format, and what a caller should hear of it."""
    picture: Picture = module.read(source)
    image = Image(picture.pixels, picture.alpha, picture.names, premultiplied=picture.premultiplied)
    notes = list(picture.notes)
    if picture.primaries is not None and not np.allclose(picture.primaries, SRGB_XY, atol=0.002):
        mismatch = f"primaries are {tuple(np.round(picture.primaries, 4).tolist())}, not sRGB's {SRGB_XY}"
        notes.append(f"{mismatch}; nothing is converted")
    if source.limits.linear is False and not picture.coded:
        image = Image(srgb_decode(image.colour), image.alpha, image.channels)
    return image, notes


_READERS = {start: (name, partial(_image, module)) for module in _FORMATS for start, name in module.STARTS.items()}
_GRAY_READERS = {start: (name, m.gray) for m in _FORMATS for start, name in getattr(m, "GRAY", {}).items()}


def _read(
    path: str | os.PathLike[str], limits: Limits, readers: dict[bytes, tuple[str, Callable[[PictureFile], Any]]]
) -> Any:
    """What the reader for the first bytes of a file makes of it."""
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        head = file.read(10)
        format_name, reader = next((entry for start, entry in readers.items() if head.startswith(start)), ("", None))
        if reader is None:
            expected = ", ".join(f"{start!r} ({format_name})" for start, (format_name, _) in readers.items())
            raise FormatError(
                f"{path}: not a picture gonio reads: starts with {head!r}, expected {expected}; save it as one of these"
            )
        try:
            with np.errstate(all="ignore"):
                return reader(PictureFile(file, os.fspath(path), size, limits))
        except errors.DependencyError:
            raise
        except Unsettled as error:
            raise FormatError(f"{path}: {format_name} picture: {error}") from None
        except MemoryError as error:
            reason = str(error) if isinstance(error, TooLargeError) else "there is not enough memory to decode it"
            advice = "make it smaller, or use a machine with more memory"
            raise TooLargeError(f"{path}: {format_name} picture: {reason}; {advice}") from None
        except Exception as error:  # damage makes pillow and OpenEXR raise nearly every type there is
            reason = str(error) if isinstance(error, errors.Error) else repr(error)
            advice = "copy or export it again"
            raise FormatError(f"{path}: damaged or unsupported {format_name} picture: {reason}; {advice}") from error


def _float32(values: ArrayLike, name: str) -> NDArray[np.float32]:
    try:
        x = numbers(values)
    except ValueError as error:
        raise errors.ArrayTypeError(f"{name}: got {error}; expected an array of floats") from None
    if x.dtype.kind != "f":
        raise errors.ArrayTypeError(f"{name} are {x.dtype}, expected floats; codes: srgb_decode(x / 255)")
    try:
        with np.errstate(over="ignore"):
            return x.astype(np.float32, copy=False)
    except MemoryError:
        raise TooLargeError(f"{name}: there is no memory for an array of shape {x.shape}; make it smaller") from None
