"""MIT CSAIL's `.dat` (Ngan, Durand & Matusik): anisotropic RGB measurements on angles of both directions.

int32[16], little-endian: the counts of theta_i, theta_o, phi = phi_o - phi_i and phi_i; [6] 1, these angles; [7] 0,
bins of equal width; [9] 1 where phi covers 0 to pi only, 0 to 2 pi otherwise; [10] 3 channels; the others are reserved.
Then float32, planes R, G, B, each [theta_i][theta_o][phi][phi_i] with phi_i fastest; negative where there is no data.
Source: the header documented in BRDF Explorer, and its azimuths: phi_i is that of the direction away from the light. It
multiplies values by 10 without a reason, so that `scale` is 1 here unless you give another. No published file was at
hand.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.reflectance import Reflectance
from ..declared.arguments import ABOVE_ZERO, Declared
from ..errors import FormatError, ParameterError
from ..formula.fields import Ours, kept
from ..formula.state import note
from ..tables.angle_systems import SYSTEMS
from ._layout import CHANNEL, FileAxis, Layout
from ._reading import large_tables
from ._reading.large_tables import Unscanned, expect_channels, numbers

NAME = "CSAIL"
SUFFIXES = (".dat",)
SHARED_SUFFIX = True
DESCRIPTION = "anisotropic RGB on angles of both directions (Ngan, Durand & Matusik 2005)"
ORACLE = "own generator only"

COUNT = 16
HEADER = 4 * COUNT
RESOLUTION = (45, 45, 90, 36)
LAYOUT = Layout("relative", {"plane": CHANNEL, **{name: FileAxis(name) for name in SYSTEMS["relative"].oriented}})


class CSAIL(Unscanned):
    """BRDF of an anisotropic material, linear in theta_i, theta_o, phi and phi_i between the centres of bins; RGB.

    Bins without data (negative, or NaN) are left out and the weights of the others renormalized. theta stays at the
    outermost centres beyond them, azimuths wrap. Where phi covers 0 to pi, the other half is its mirror image.

    raw    (3, theta_i, theta_o, phi, phi_i), as in the file
    scale  what stored numbers are multiplied by

    Sampling: see `Sampled`.

    Shapes   f: (..., 3).
    Units    f: 1/sr, if `scale` is right.
    Error    of the bins; memory: 24 bytes per bin, 0.8 GB for the published 45 x 45 x 180 x 90, more while loading.
    Source   Ngan, Durand & Matusik 2005, "Experimental analysis of BRDF models", EGSR.
    """

    format = NAME
    raw: np.ndarray = note()
    header: np.ndarray = note()
    scale: float = note()

    def __init__(self, raw: Any, header: Any, scale: float = 1.0, path: str = ""):
        if not (math.isfinite(scale) and scale > 0.0):
            raise ParameterError(f"scale={scale!r}: expected a positive number")
        raw, header, scale = kept(raw), kept(header), float(scale)
        half = bool(header[9])
        self._hold(raw=raw, header=header, scale=scale)
        stored = LAYOUT.table(raw, True)
        if half:
            stored = np.concatenate([stored, stored[:, :, ::-1]], axis=2)
        axes, about = _centres(raw.shape[1:], half), {"half": half, "scale": scale}
        super().__init__("relative", axes, stored, ("R", "G", "B"), path=path, about=about)

    @property
    def valid(self) -> np.ndarray:
        """True where there is data; shape of `stored`."""
        with np.errstate(invalid="ignore"):
            return (self.stored >= 0.0) & (self.stored < np.inf)

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the centres of bins, NaN where there is no data."""
        f = np.full(self.stored.shape, np.nan)
        return np.multiply(self.stored, self.scale, out=f, where=self.valid, dtype=float)

    def _key(self) -> tuple:
        return (*super()._key(), ("scale", self.scale))


def _centres(counts: Sequence[int], half: bool) -> dict[str, np.ndarray]:
    """The centres of bins [rad], phi of the whole circle."""
    turns = counts[2] * (2 if half else 1)
    theta_i, theta_o = (0.5 * math.pi / n * (np.arange(n) + 0.5) for n in counts[:2])
    phi, phi_i = (2.0 * math.pi / n * (np.arange(n) + 0.5) for n in (turns, counts[3]))
    return {"theta_i": theta_i, "theta_o": theta_o, "phi": phi, "phi_i": phi_i - math.pi}


def _size(counts: Sequence[int]) -> int:
    return HEADER + 4 * 3 * math.prod(counts)


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: four counts, marks, and as long as the counts say."""
    if len(head) < HEADER:
        return False
    header = np.frombuffer(head, "<i4", COUNT).tolist()
    return min(header[:4]) > 0 and header[10] == 3 and (size == _size(header[:4]) or header[6:8] == [1, 0])


def read(
    path: Path, scale: Annotated[float, Declared("factor of the file's numbers", ABOVE_ZERO, 1e12)] = 1.0
) -> CSAIL:
    """The material of a file. Raises FormatError for a damaged one."""
    with path.open("rb") as file:
        header = numbers(file, path, "<i4", (COUNT,))
        counts, size = tuple(header[:4].tolist()), file.seek(0, os.SEEK_END)
        allowed = {(6, "paramType"): (1,), (7, "binType"): (0,), (9, "half_data"): (0, 1), (10, "channels"): (3,)}
        for (at, name), values in allowed.items():
            if header[at] not in values:
                raise FormatError(f"{path}: {name} is {header[at]}, expected {' or '.join(map(str, values))}")
        if min(counts) < 1 or size != _size(counts):
            raise FormatError(
                f"{path}: {size} bytes, expected {_size(counts)} for {'×'.join(map(str, counts))} bins of theta_i, "
                f"theta_o, phi, phi_i: cut short or damaged; fetch it again"
            )
        raw = numbers(file, path, "<f4", (3, *counts), HEADER)
    return CSAIL(Ours(raw), header, scale, str(path))


def write(
    m: Reflectance,
    path: Path,
    resolution: Annotated[
        Sequence[int] | None, Declared("bins of theta_i, theta_o, phi and phi_i", 1, lengths=(4,), usual=RESOLUTION)
    ] = None,
) -> None:
    """Write f at the centres of bins; a CSAIL is written as it was read, bit by bit, unless `resolution` is given.

    One channel becomes gray; -1 stands for values that are negative, NaN or infinite. Raises ParameterError for a
    delta lobe, other than 1 or 3 channels, and maps.
    """
    if isinstance(m, CSAIL) and resolution is None:
        tables = m.header, m.raw
    else:
        tables = _tabulated(m, resolution or RESOLUTION)
    large_tables.write(path, *tables)


def _tabulated(m: Reflectance, resolution: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    expect_channels(m, NAME)
    header = np.zeros(COUNT, "<i4")
    header[[0, 1, 2, 3, 6, 10]] = *resolution, 1, 3
    raw = np.empty((3, *resolution), "<f4")
    for part, pairs in LAYOUT.blocks(_centres(resolution, False)):
        f = with_channels(m.f(*pairs), 4)
        raw[:, part] = np.moveaxis(np.where((f >= 0.0) & (f < np.inf), f, -1.0), -1, 0)
    return header, raw
