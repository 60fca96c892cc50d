"""UTIA's `.bin` and `.exr`: anisotropic RGB measurements on a grid of both directions' angles.

float64, little-endian, [plane][theta_i][phi_i][theta_o][phi_o]: 3 planes, theta 0 to 75 degrees by 15, phi 0 to 352.5
by 7.5, 1 990 656 bytes. The "dense" variant has 44 theta and 180 phi, 1.5 GB; its theta are taken to be 2 degrees
apart (no description of them was seen). Known from the sources of four readers, which disagree about colour, see
`DECODINGS`; no specification and no published file was at hand.

The same as an OpenEXR picture of 288 x 288: a column for each wo, a row for each wi. Whether the first row is at the
top was seen in one reader's source only (ALTA's, which turns the rows, but perhaps turns them back), so it is found
from the numbers: by reciprocity the picture is symmetric, and turned upside down it is not.
"""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.reflectance import Reflectance
from ..declared.arguments import ABOVE_ZERO, Declared
from ..errors import FormatError, ParameterError, expect_one_of
from ..formula.fields import Ours, kept
from ..formula.state import note
from ..pictures.colour import RGB_OF_XYZ, srgb_decode
from ..pictures.image import Image, load_image
from ..tables.rows import ROW_ANGLES
from ._layout import CHANNEL, FileAxis, Layout
from ._reading import large_tables
from ._reading.large_tables import LARGE, Unscanned, expect_channels, numbers

NAME = "UTIA"
SUFFIXES = (".bin", ".exr")
DESCRIPTION = "anisotropic RGB on angles of both directions, UTIA database (Filip & Vavra 2014)"
ORACLE = "own generator only"

EXR = b"v/1\x01"

GRIDS = {(6, 48): 15.0, (44, 180): 2.0}
"""(theta, phi) nodes of each direction, and the step of theta [degrees]."""


LAYOUT = Layout("angles", {"plane": CHANNEL, **{name: FileAxis(name) for name in ROW_ANGLES}})

DECODINGS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "linear": lambda v: v,
    "srgb": srgb_decode,
    "dj_brdf": lambda v: 100.0 * srgb_decode(v / 140.0, 0.0375),
    "xyz": lambda v: v @ RGB_OF_XYZ.T,
}
"""f [1/sr] from stored numbers (..., 3): as they are (ALTA, asztr's UTIA-brdf), sRGB-encoded (Fichet's reader), as
dj_brdf has it, which divides by 140 and calls that a constant from the database's author (and makes negative numbers
0), or CIE XYZ (Fichet's reader; the pictures of UTIA's textures are said to be that)."""

ROWS = ("down", "up")
"""Which way theta_i grows in a picture."""


class UTIA(Unscanned):
    """BRDF of an anisotropic material, linear in theta_i, theta_o, phi_i and phi_o between nodes; RGB.

    Beyond the outermost theta (75 degrees) f is constant; other readers extrapolate. Values are decoded at nodes. By
    default they are taken as they are stored: negative ones occur, and stay.

    raw       (3, theta_i, phi_i, theta_o, phi_o), as in the file
    decoding  a name in `DECODINGS`

    Sampling: see `Sampled`.

    Shapes   f: (..., 3).
    Units    f: 1/sr, if `decoding` is right; the readers say so, and no description of the scale was seen.
    Error    that of linear interpolation over 15 degrees of theta; for GGX(0.3) written and read, cosines above 0.3, of
             its peak: 7e-4 (median), 2 % (99th percentile), 22 % (largest).
    Source   Filip & Vavra 2014, "Template-based sampling of anisotropic BRDFs", CGF 33(7):91.
    """

    format = NAME
    decoding: str = note()
    raw: np.ndarray = note()

    def __init__(self, raw: Any, decoding: str = "linear", theta_step: float | None = None, path: str = ""):
        raw = kept(raw)
        expect_one_of(DECODINGS, "decoding", decoding)
        grid = raw.shape[1:3]
        if raw.shape != (3, *grid, *grid) or grid not in GRIDS:
            listed = " or ".join(str((3, *g, *g)) for g in GRIDS)
            raise ParameterError(f"UTIA(raw): got shape {raw.shape}, expected {listed}; read files with gonio.load")
        step = GRIDS[grid] if theta_step is None else theta_step
        if not 0.0 < step * (grid[0] - 1) <= 90.0:
            raise ParameterError(f"theta_step={theta_step!r}: expected degrees above 0, the last theta below 90")
        self._hold(raw=raw, decoding=decoding)
        axes = {name: _nodes(grid, step)[name] for name in LAYOUT.grid(True)}
        about = {"decoding": decoding, "theta_step": step}
        super().__init__("angles", axes, LAYOUT.table(raw, True), ("R", "G", "B"), path=path, about=about)
        if raw.nbytes < LARGE:
            self._hold(holes=not np.isfinite(raw).all())

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes; read-only where the file's numbers are f."""
        finite = np.isfinite(self.stored)
        with np.errstate(invalid="ignore"):
            f = DECODINGS[self.decoding](self.stored)
        return f if finite.all() else np.where(finite, f, np.nan)

    def _key(self) -> tuple:
        return (*super()._key(), ("decoding", self.decoding))


def _nodes(grid: tuple[int, ...], step: float) -> dict[str, np.ndarray]:
    """Of each angle [rad], in the file's order."""
    theta, phi = np.radians(step * np.arange(grid[0])), np.radians(360.0 / grid[1]) * np.arange(grid[1])
    return {name: theta if name.startswith("theta") else phi for name in ROW_ANGLES}


def _size(grid: tuple[int, int]) -> int:
    return 8 * 3 * math.prod(grid) ** 2


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: its size, and numbers of a usual magnitude; or a picture's."""
    if head.startswith(EXR):
        return _picture_grid(head) is not None
    if size not in map(_size, GRIDS) or len(head) < 8:
        return False
    first = np.abs(np.frombuffer(head[: len(head) // 8 * 8], "<f8"))
    return bool(((first == 0.0) | ((first > 1e-30) & (first < 1e9)) | np.isnan(first)).all())


def _picture_grid(head: bytes) -> tuple[int, int] | None:
    """The grid whose directions a picture with this head has as columns and rows."""
    _, _, window = head.partition(b"dataWindow\0box2i\0\x10\0\0\0")
    if len(window) < 16:
        return None
    left, top, right, bottom = struct.unpack("<4i", window[:16])
    return next((g for g in GRIDS if (right - left + 1, bottom - top + 1) == 2 * (math.prod(g),)), None)


def read(
    path: Path,
    decoding: Annotated[str, Declared("what the numbers are: readers disagree", words=(*DECODINGS,))] = "linear",
    theta_step: Annotated[
        float | None, Declared("step of theta; if not given 15 for 6 angles, 2 for 44", ABOVE_ZERO, 18.0, "degrees")
    ] = None,
    rows: Annotated[
        str | None,
        Declared(
            "which way theta_i grows in a picture; if not given the way that is the more reciprocal", words=(*ROWS,)
        ),
    ] = None,
) -> UTIA:
    """The material of a file. Raises FormatError where the length is that of no grid, or a picture has not three
    channels."""
    with path.open("rb") as file:
        head, size = file.read(4096), file.seek(0, os.SEEK_END)
        grid = next((grid for grid in GRIDS if size == _size(grid)), None)
        if grid is not None and not head.startswith(EXR):
            return UTIA(Ours(numbers(file, path, "<f8", (3, *grid, *grid))), decoding, theta_step, str(path))
    if head.startswith(EXR):
        return UTIA(Ours(_of_picture(path, _picture_grid(head), rows)), decoding, theta_step, str(path))
    listed = " or ".join(f"{_size(g)} for {g[0]} theta and {g[1]} phi" for g in GRIDS)
    raise FormatError(f"{path}: not a UTIA file: {size} bytes, expected {listed}; fetch it again")


def _of_picture(path: Path, grid: tuple[int, int] | None, rows: str | None) -> np.ndarray:
    pixels = load_image(path).colour
    if grid is None or pixels.shape != (math.prod(grid), math.prod(grid), 3):
        raise FormatError(f"{path}: a picture of {pixels.shape}, expected (288, 288, 3); fetch it again")
    if rows is None:
        gray = pixels.mean(axis=2, dtype=float)
        down, up = (np.nansum(np.abs(g - g.T)) for g in (gray, gray[::-1]))
        rows = "up" if up < down else "down"
    planes = np.moveaxis(pixels[:: 1 if rows == "down" else -1], -1, 0)
    return planes.astype(float).reshape(3, *grid, *grid)


def write(m: Reflectance, path: Path) -> None:
    """Write f at the nodes of the usual grid, as it is ("linear"); a UTIA is written as it was read, bit by bit.

    As a picture, theta_i growing down, where the name ends in `.exr`: numbers are float32 then. One channel becomes
    gray. Values beyond 75 degrees are lost. Raises ParameterError for a material with holes at nodes, a delta lobe,
    other than 1 or 3 channels, or maps: no such table could hold it.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.bin")
    >>> print(gn.load("white.bin").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    [0.1592 0.1592 0.1592]
    """
    raw = m.raw if isinstance(m, UTIA) else _tabulated(m)
    if path.suffix.lower() == ".exr":
        side = math.prod(raw.shape[1:3])
        Image(np.moveaxis(raw.reshape(3, side, side), 0, -1)).save(path)
        return
    large_tables.write(path, raw.astype("<f8", copy=False))


def _tabulated(m: Reflectance) -> np.ndarray:
    expect_channels(m, NAME)
    grid, step = next(iter(GRIDS.items()))
    f = with_channels(m.f_angles(*np.meshgrid(*_nodes(grid, step).values(), indexing="ij", sparse=True)), 4)
    if not np.isfinite(f).all():
        raise ParameterError(f"{m!r:.80}: has holes at nodes, which UTIA files cannot mark; fill them first")
    return np.ascontiguousarray(np.moveaxis(np.broadcast_to(f, (*f.shape[:-1], 3)), -1, 0))
