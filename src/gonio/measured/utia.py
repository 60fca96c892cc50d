"""UTIA's `.bin`: anisotropic RGB measurements on a grid of both directions' angles, without a header.

float64, little-endian, [plane][theta_i][phi_i][theta_o][phi_o]: 3 planes, theta 0 to 75 degrees by 15, phi 0 to 352.5
by 7.5, 1 990 656 bytes. The "dense" variant has 44 theta and 180 phi, 1.5 GB; its theta are taken to be 2 degrees
apart (no description of them was seen). Known from the sources of four readers, which disagree about colour, see
`DECODINGS`; no specification and no published file was at hand, and files of the EXR variant are not read.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError, ParameterError
from ..files import replacing
from ..interface import Reflectance
from ._mapped import MAPPED, Mapped, expect_channels, numbers

NAME = "UTIA"
SUFFIXES = (".bin",)
DESCRIPTION = "anisotropic RGB on angles of both directions, UTIA database (Filip & Vavra 2014)"
ORACLE = "own generator only"

GRIDS = {(6, 48): 15.0, (44, 180): 2.0}
"""(theta, phi) nodes of each direction, and the step of theta [degrees]."""


def _srgb(v: np.ndarray, threshold: float = 0.04045) -> np.ndarray:
    return np.where(v <= threshold, v / 12.92, ((np.maximum(v, threshold) + 0.055) / 1.055) ** 2.4)


DECODINGS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "linear": lambda v: v,
    "srgb": _srgb,
    "dj_brdf": lambda v: 100.0 * _srgb(v / 140.0, 0.0375),
}
"""f [1/sr] from stored numbers: as they are (ALTA, asztr's UTIA-brdf), sRGB-encoded (Fichet's reader), or as dj_brdf
has it, which divides by 140 and calls that a constant from the database's author (and makes negative numbers 0)."""


class UTIA(Mapped):
    """BRDF of an anisotropic material, linear in theta_i, theta_o, phi_i and phi_o between nodes; RGB.

    Beyond the outermost theta (75 degrees) f is what it is there; other readers extrapolate. Values are decoded at
    nodes. By default they are taken as they are stored, which changes nothing: negative ones occur, and stay.

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
    decoding: str
    raw: np.ndarray

    def __init__(self, raw: np.ndarray, decoding: str = "linear", theta_step: float | None = None, path: str = ""):
        if decoding not in DECODINGS:
            raise ParameterError(f"decoding={decoding!r}: expected one of {', '.join(map(repr, DECODINGS))}")
        grid = raw.shape[1:3]
        if raw.shape != (3, *grid, *grid) or grid not in GRIDS:
            listed = " or ".join(str((3, *g, *g)) for g in GRIDS)
            raise ParameterError(f"UTIA(raw): got shape {raw.shape}, expected {listed}; read files with gonio.load")
        step = GRIDS[grid] if theta_step is None else theta_step
        if not 0.0 < step * (grid[0] - 1) <= 90.0:
            raise ParameterError(f"theta_step={theta_step!r}: expected degrees above 0, the last theta below 90")
        theta = np.radians(step * np.arange(grid[0]))
        phi = np.radians(360.0 / grid[1]) * np.arange(grid[1])
        self.__dict__.update(raw=raw, decoding=decoding)
        super().__init__(
            "angles",
            {"theta_i": theta, "theta_o": theta, "phi_i": phi, "phi_o": phi},
            raw.transpose(1, 3, 2, 4, 0),
            ("R", "G", "B"),
            path,
            {"decoding": decoding, "theta_step": step},
        )
        if raw.nbytes < MAPPED:
            self.__dict__["holes"] = not np.isfinite(raw).all()

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes."""
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(self.stored), DECODINGS[self.decoding](self.stored), np.nan)

    def _key(self) -> tuple:
        return (*super()._key(), ("decoding", self.decoding))


def _size(grid: tuple[int, int]) -> int:
    return 8 * 3 * math.prod(grid) ** 2


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: its size, and numbers of a usual magnitude."""
    if size not in map(_size, GRIDS) or len(head) < 8:
        return False
    first = np.abs(np.frombuffer(head[: len(head) // 8 * 8], "<f8"))
    return bool(((first == 0.0) | ((first > 1e-30) & (first < 1e9)) | np.isnan(first)).all())


def read(path: Path, decoding: str = "linear", theta_step: float | None = None) -> UTIA:
    """The material of a file; `decoding`: a name in `DECODINGS`; `theta_step` [degrees]: where it is not the usual.

    Raises FormatError where the length is that of no grid.
    """
    size = Path(path).stat().st_size
    for grid in GRIDS:
        if size == _size(grid):
            return UTIA(numbers(path, "<f8", (3, *grid, *grid)), decoding, theta_step, str(path))
    listed = " or ".join(f"{_size(g)} for {g[0]} theta and {g[1]} phi" for g in GRIDS)
    raise FormatError(f"{path}: not a UTIA file: {size} bytes, expected {listed}; fetch it again")


def write(m: Reflectance, path: Path) -> None:
    """Write f at the nodes of the usual grid, as it is ("linear"); a UTIA is written as it was read, bit by bit.

    One channel becomes gray. What is beyond 75 degrees is lost. Raises ParameterError for a material with holes at
    nodes, a delta lobe, other than 1 or 3 channels, or maps: no such table could hold it.
    """
    raw = m.raw if isinstance(m, UTIA) else _tabulated(m)
    with replacing(path) as temporary, temporary.open("wb") as file:
        raw.astype("<f8", copy=False).tofile(file)


def _tabulated(m: Reflectance) -> np.ndarray:
    expect_channels(m, NAME)
    (count, turns), step = next(iter(GRIDS.items()))
    theta, phi = np.radians(step * np.arange(count)), np.radians(360.0 / turns) * np.arange(turns)
    angles: list[Any] = [theta[:, None, None, None], phi[:, None, None], theta[:, None], phi]
    f = m.f_angles(*angles).reshape(count, turns, count, turns, -1)
    if not np.isfinite(f).all():
        raise ParameterError(f"{m!r:.80}: has holes at nodes, which UTIA files cannot mark; fill them first")
    return np.ascontiguousarray(np.moveaxis(np.broadcast_to(f, (*f.shape[:-1], 3)), -1, 0))
