"""Pictures of linear light: the `Image` class, read and saved in the formats of `files/`.

Files are recognised by their first bytes, never by their suffix. Values that a format cannot hold are refused or
announced; .png alone is for looking at.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import errors
from ..arguments import checked
from ..compile.threads import apart
from ..discover import modules
from ..errors import FormatError, ParameterError, ShapeError, TooLargeError, warn
from ..files import replacing, target
from ..notebooks import repr_html, repr_png
from ..numbers import numbers
from .colour import SRGB_XY
from .files._source import Picture, Source, opened

PIXELS = 2**29
"""The most pixels that a picture may announce: 32768 x 16384."""

_FORMATS = modules("gonio.pictures.files")
_WRITERS = {module.WRITTEN: module for module in _FORMATS}

SUFFIXES = tuple(suffix for module in _FORMATS for suffix in module.SUFFIXES)
"""Suffixes of the files that `read_image` reads."""


STARTS = {start: kind for module in _FORMATS for start, kind in module.STARTS.items()}
"""The first bytes of these files, and the name of what they are."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Image:
    """A picture: linear pixels, row 0 at the top.

    Shapes   `pixels` (H, W, C) float32; `alpha` (H, W) float32 or None; `channels` C names or None; `noise` as
             `pixels`, or None: their standard errors, of a picture that was rendered; `samples` of each of its pixels.
    Units    `pixels` as rendered (radiance, when the lights are), linear sRGB primaries for C = 3; `alpha` is
             coverage, 0 to 1, not multiplied into `pixels` (as in .png; .exr files hold the product, and are
             divided on reading).
    Errors   ShapeError; ArrayTypeError (not floats); ParameterError (names). float32 arrays are not copied.

    Example
    >>> picture = gn.Image(np.full((2, 4, 3), 0.18))
    >>> print(picture.pixels.shape, picture.alpha)
    (2, 4, 3) None
    """

    _repr_html_ = repr_html
    _repr_png_ = repr_png

    pixels: NDArray[np.float32]
    alpha: NDArray[np.float32] | None = None
    channels: tuple[str, ...] | None = None
    noise: NDArray[np.float32] | None = None
    samples: int | None = None

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
        if self.noise is not None:
            noise = _float32(self.noise, "noise")
            if noise.shape != pixels.shape:
                raise ShapeError(f"noise is {noise.shape}, expected that of the pixels, {pixels.shape}")
            object.__setattr__(self, "noise", noise)
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
        return f"Image({width} x {height}, {names}{'' if self.alpha is None else ', alpha'})"

    @checked
    def save(self, path: str | os.PathLike[str], exposure: float = 0.0) -> None:
        """Write the picture whole or not at all (beside the target, then renamed); the suffix is the format.

        .png     8 bits: round(255 srgb_encode(clamp(2^exposure pixels, 0, 1))); C = 1 or 3; alpha as it is.
                 NaN becomes 0, and a MissingDataWarning says how many pixels that are.
        .exr     float32, lossless, NaN and infinity kept: R, G, B, or Y, or the given names; with an alpha
                 also A, and the others multiplied by it, as OpenEXR has it.
        .hdr     Radiance RGBE, flat; C = 3, or 1 written three times; over black; rounded to nearest: error at
                 most 1/256 of a pixel's largest channel. NaN becomes 0, values outside 0 to 1.69e38 are clamped,
                 and a MissingDataWarning says how many pixels that are.

        Units    `exposure` in stops, for .png only: the other two hold the values themselves.
        Errors   ParameterError (suffix, exposure, values the format cannot hold), ShapeError (channel count),
                 NotFoundError (no such directory), DependencyError (pillow or OpenEXR is not installed);
                 WriteError (disk full and the like).

        Example
        >>> gn.Image(np.full((2, 4, 3), 0.18)).save("grey.png")
        >>> print(gn.read_image("grey.png").pixels[0, 0].round(2))
        [0.18 0.18 0.18]
        """
        check_target(path, exposure)
        picture = Picture(self.pixels, self.alpha, self.channels)
        write = _WRITERS[Path(path).suffix.lower()].encode(picture, os.fspath(path), float(exposure))
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


@checked
def read_image(path: str | os.PathLike[str], most: int = PIXELS) -> Image:
    """Read an OpenEXR, Radiance, PNG or JPEG picture, recognised by its first bytes.

    OpenEXR    half, float or uint as float32 (uint above 2^24 rounds). R, G, B first, then the other
               channels by name; A becomes `alpha`. Of several parts the first; nothing deep or subsampled.
    Radiance   value = mantissa 2^(E - 136), 0 where E = 0, divided by all EXPOSURE and COLORCORR lines.
               Radiance itself adds 1/2 to the mantissa, for its writer truncates; Mitsuba and OpenCV do not,
               nor do we: 1.0 reads as 1.0, and a truncating writer's picture half a step (0.2 to 0.4 % of
               the largest channel) too dark. Flat, old and new run-length coding, every orientation; no XYZE.
    PNG, JPEG  `srgb_decode` of pillow's codes, without profiles or gamma; 16-bit colour comes as 8-bit.
               Up to pillow's own limit of 178 956 970 pixels.

    Primaries that are not sRGB's give a warning, and the values stay as they are.
    `most`: pixels; a picture that announces more is refused before anything of it is decoded. Reading RGB never takes
    more than 30 bytes of memory a pixel, and 12 of them stay.

    Shapes   `pixels` (H, W, C), row 0 at the top.
    Errors   NotFoundError (missing or not readable), FormatError (everything else that is wrong with the file),
             TooLargeError (it announces more than this machine has memory for).
    Source   G. Ward, "Radiance File Formats" (filefmts.pdf); "OpenEXR File Layout" (openexr.com).

    Example
    >>> gn.Image(np.full((2, 4, 3), 1000.0)).save("bright.exr")
    >>> print(gn.read_image("bright.exr").pixels.max())
    1000.0
    """
    image, primaries = apart(_decoded, path, most)
    if primaries is not None and not np.allclose(primaries, SRGB_XY, atol=0.002):
        mismatch = f"primaries are {tuple(np.round(primaries, 4).tolist())}, not sRGB's {SRGB_XY}"
        warn(f"{path}: {mismatch}; nothing is converted", UserWarning)
    return image


def _decoded(path: str | os.PathLike[str], most: int) -> tuple[Image, tuple[float, ...] | None]:
    """The picture in a file, and its primaries, if the file has them."""
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        head = file.read(10)
        starts = {start: (kind, module) for module in _FORMATS for start, kind in module.STARTS.items()}
        kind, module = next((starts[start] for start in starts if head.startswith(start)), ("", None))
        if module is None:
            expected = ", ".join(f"{start!r} ({kind})" for start, (kind, _) in starts.items())
            mismatch = f"starts with {head!r}, expected {expected}; convert it to .exr or .hdr first"
            raise FormatError(f"{path}: not a picture gonio reads: {mismatch}")
        try:
            with np.errstate(all="ignore"):
                pixels, alpha, names, primaries = module.read(Source(file, os.fspath(path), size, most))
                return Image(pixels, alpha, names), primaries
        except errors.DependencyError:
            raise
        except MemoryError as error:
            reason = str(error) if isinstance(error, TooLargeError) else "there is not enough memory to decode it"
            advice = "make it smaller, or use a machine with more memory"
            raise TooLargeError(f"{path}: {kind} picture: {reason}; {advice}") from None
        except Exception as error:  # damage makes pillow and OpenEXR raise nearly every type there is
            reason = str(error) if isinstance(error, errors.Error) else repr(error)
            advice = "copy or export it again"
            raise FormatError(f"{path}: damaged or unsupported {kind} picture: {reason}; {advice}") from error


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
