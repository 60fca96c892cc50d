"""A surface from a height map that a profilometer measured."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..declared.arguments import ABOVE_ZERO, Declared, checked
from ..declared.numbers import numbers
from ..errors import Error, FormatError, NotFoundError, ParameterError, TooLargeError
from ..numerics.filling import filled_in_layers
from ..pictures.image import read_gray
from .height_field import MOST, UNITS, HeightField
from .sdf import read_sdf
from .text_map import read_text

LARGEST = 1e30
"""Size of a height, at most."""

HOLES = 0.2
"""Share of a map that may be missing."""

TEXTS, PICTURES = (".csv", ".txt", ".asc", ".dat", ".xyz"), (".png", ".tif", ".tiff")
SUFFIXES = (".npy", *TEXTS, *PICTURES, ".sdf")


@checked
def from_map(
    source: Any,
    pixel: Annotated[
        float | tuple[float, float],
        Declared("distance of the heights along x and y, in `unit`; none for an SDF file", ABOVE_ZERO),
    ]
    | None = None,
    unit: Annotated[str, Declared("of lengths", words=(*UNITS,))] = "um",
    *,
    scale: Annotated[
        float, Declared("a number of the source, in `height_unit`: micrometres per gray level, say", 1e-12, 1e12)
    ] = 1.0,
    height_unit: Annotated[str, Declared("of heights, where it is another one", words=(*UNITS,))] | None = None,
    edges: Annotated[
        str,
        Declared("how the map becomes periodic: by its mirror images, or as it is", words=("mirror", "wrap")),
    ] = "mirror",
    decimal: Annotated[str, Declared("decimal sign of a text whose commas have two readings", words=(".", ","))]
    | None = None,
) -> HeightField:
    """A surface from a height map: of an array (rows, columns), or of a file.

    source       heights; a `.npy` file, a text file of rows of numbers (commas are decimal signs where ";", tabs or
                 blanks are between them), a gray picture (`.png`, `.tif`), or an SDF file (`.sdf`, ISO 25178-71),
                 which has lengths of its own
    edges        how the map becomes periodic: "mirror", by its mirror images along x and y, whose directions count as
                 its own; or "wrap", where it is periodic already

    A plane is taken away, the map's tilt. Up to a fifth of the heights may be missing (NaN): they are filled in from
    their neighbours. The surface stands for a larger one: uncertainties come from the differences of its parts.

    Raises NotFoundError, FormatError for files; ParameterError for maps without heights or with too many holes, and for
    slopes that only come about where units are confused.

    Example
    >>> heights = 0.2 * np.sin(np.arange(64) / 5.0)[:, None] * np.ones(48)
    >>> surface = gn.surfaces.from_map(heights, pixel=0.5, unit="um")
    >>> print(surface.heights.shape, surface.cell, surface.unit)
    (128, 96) (0.5, 0.5) um
    """
    named = isinstance(source, (str, os.PathLike))
    title = Path(source).name if named else "height map"
    if named:
        path = _existing(Path(source))
        if path.suffix.lower() == ".sdf":
            if pixel is not None or height_unit or scale != 1.0:
                raise ParameterError(f"{title}: has lengths of its own; expected no pixel, scale or height_unit")
            source, lengths = read_sdf(path)
            height_unit, (dx, dy) = "m", (UNITS["m"] / UNITS[unit] * length for length in lengths)
            pixel = (dx, dy)
        else:
            source = _read(path, decimal)
    if pixel is None:
        raise ParameterError(f"{title}: pixel is missing; expected the distance of its heights, in {unit}: pixel=0.5")
    try:
        heights = numbers(source).astype(float)
    except ValueError as error:
        raise ParameterError(f"from_map: {error}; expected an array (rows, columns) of heights") from None
    if heights.ndim != 2 or min(heights.shape) < 8:
        raise ParameterError(
            f"{title}: got heights of shape {heights.shape}, expected (rows, columns), 8 or more of each"
        )
    if np.isinf(heights).any():
        raise ParameterError(
            f"{title}: {int(np.isinf(heights).sum())} heights are infinite; expected NaN where missing"
        )
    missing = float(np.isnan(heights).mean())
    if missing > HOLES:
        raise ParameterError(f"{title}: {missing:.0%} of the heights are missing; expected at most {HOLES:.0%}")
    with np.errstate(all="ignore"):
        heights *= scale * UNITS[height_unit or unit] / UNITS[unit]
        if missing:
            heights = filled_in_layers(heights[..., None], (False, False))[0][..., 0]
        heights -= _plane(heights)
    if not np.abs(heights).max() <= LARGEST:
        raise ParameterError(
            f"{title}: heights above {LARGEST:g} {unit}; expected smaller ones: NaN where one is missing"
        )
    if edges == "mirror":
        if 4 * heights.size > MOST:
            raise ParameterError(
                f"{title}: {heights.size} heights, expected at most {MOST // 4}; take every second one"
            )
        heights = np.concatenate([heights, heights[::-1]], axis=0)
        heights = np.concatenate([heights, heights[:, ::-1]], axis=1)
    cell = (pixel, pixel) if isinstance(pixel, float) else pixel
    shape = " x ".join(map(str, heights.shape))
    return HeightField(
        heights,
        cell,
        unit=unit,
        is_part=True,
        is_mirrored=edges == "mirror",
        title=f"{title}, {shape} heights {cell[0]:g} {unit} apart",
    )


def _plane(heights: np.ndarray) -> np.ndarray:
    """The plane nearest to the heights, by least squares."""
    y, x = (np.arange(n) - 0.5 * (n - 1) for n in heights.shape)
    along = float((heights.mean(0) * x).sum() / (x * x).sum())
    across = float((heights.mean(1) * y).sum() / (y * y).sum())
    plane: np.ndarray = heights.mean() + along * x + across * y[:, None]
    return plane


def _existing(path: Path) -> Path:
    if not os.path.isfile(path):
        raise NotFoundError(f"{path}: no such file; expected a height map ({', '.join(SUFFIXES)})")
    return path


def _read(path: Path, decimal: str | None) -> np.ndarray:
    """The numbers in a file."""
    suffix = path.suffix.lower()
    if suffix in PICTURES:
        return read_gray(path, MOST)
    try:
        if suffix == ".npy":
            return _array(path)
        if suffix in TEXTS:
            return read_text(path, decimal)
    except Error:
        raise
    except MemoryError:
        raise TooLargeError(f"{path}: there is not enough memory to read it; take every second height") from None
    except Exception as error:  # damage makes NumPy raise nearly every type there is
        rule = "an array of numbers, rows of as many numbers each, or a gray picture, as the suffix says"
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:80]
        raise FormatError(f"{path}: not a height map ({reason}); expected {rule}") from None
    raise FormatError(f"{path}: unknown suffix {suffix!r}; expected one of {', '.join(SUFFIXES)}")


def _array(path: Path) -> np.ndarray:
    """The array in a `.npy` file, which must hold all that its header announces before memory is taken for it."""
    with open(path, "rb") as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, by_columns, dtype = header(file)
        count = math.prod(shape)
        left = os.fstat(file.fileno()).st_size - file.tell()
        if dtype.kind not in "biuf" or not 0 <= count <= MOST or count * dtype.itemsize > left:
            got = f"{dtype} of shape {shape}"
            raise FormatError(
                f"{path}: {got:.80}, {left} bytes; expected real numbers, at most {MOST}, all of them there"
            )
        found = np.frombuffer(file.read(count * dtype.itemsize), dtype)
    return found.reshape(shape, order="F" if by_columns else "C").astype(float)
