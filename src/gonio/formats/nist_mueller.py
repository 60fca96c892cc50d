"""Tables of Mueller matrix BRDFs as NIST publishes them for sintered PTFE: one row per wavelength and pair.

A line of column names, lambda, thetai, phi, thetar, phir, f_r11, f_r12/f_r11 ... f_r44/f_r11, then rows of these 21
numbers, separated by commas: wavelength [um], angles [degrees], f [1/sr] of unpolarized light, the other elements of
the Mueller matrix over f. A negative thetai leans to azimuth phi + 180. The specular direction is that of the azimuth
phi + 180, as found from the data. Checked against NIST's file for PTFE and its published expansion (`zernike`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..arrays import frozen, ops
from ..base.angles import direction
from ..errors import FormatError, ParameterError
from ..formula import tree
from ..formula.state import note
from ..polarization import realizable, to_frames
from ..tables.interpolation import Rows, interpolated
from ..tables.polarimetric import KEPT, MIRRORED, Polarimetric
from ..tables.scattered import Scattered
from ._reading import channel_words, plain_text
from ._rows.direction_pairs import LEVEL, upright

NAME = "NIST Mueller"
SUFFIXES = (".csv",)
SHARED_SUFFIX = True
DESCRIPTION = "rows of BRDF and normalized Mueller matrix (Germer 2017)"
ORACLE = "real file (NIST PTFE), against its published expansion"
NO_LAYOUT = "written as it was read, number by number: see `COLUMNS`"

COLUMNS = 21
ANGLES = slice(1, 5)


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: names of columns, lambda, thetai ... and Mueller elements."""
    first = plain_text.start(head).lstrip().partition("\n")[0]
    words = [w.strip(' "') for w in first.lower().split(",")]
    return (
        len(words) == COLUMNS
        and words[:2] == ["lambda", "thetai"]
        and words[3] == "thetar"
        and words[20].endswith(("m44", "f_r44/f_r11"))
    )


def read(path: Path) -> MuellerRows:
    """The measurements in a file. Raises FormatError with the line where it holds something else."""
    lines = plain_text.read(path, "#")
    names = [w.strip(' "') for w in lines.take("a line of column names").split(",")]
    if len(names) != COLUMNS:
        raise lines.fault(f"{len(names)} column names", f"{COLUMNS}: lambda, 4 angles, f_r11 and 15 elements")
    rows = lines.rows(COLUMNS, expected="numbers: lambda, 4 angles, f_r11 and 15 elements")
    return MuellerRows(rows, names, str(path))


def write(m: MuellerRows, path: Path) -> None:
    """Write the rows as they were read, number by number."""
    if not isinstance(m, MuellerRows):
        raise ParameterError(f"{m!r:.80}: expected a Mueller matrix table; save f alone as 'BiRD' or netCDF")
    plain_text.write(path, [",".join(m.about["columns"]) + "\n"], m.table, ",")


class MuellerRows(Polarimetric, Scattered):
    """Measured rows of f and of the normalized Mueller matrix; `f` is that of unpolarized light.

    matrices  the measured Mueller matrices (pairs, 4, 4), or (pairs, C, 4, 4) for C wavelengths, in the file's axes,
              "xyxy" of `gn.polarization.to_frames`; NaN where not measured
    mueller   the matrix of any pair, each element interpolated as f is, in the axes of the surface. Matrices that no
              passage of light can have are kept, and counted in `about["not realizable"]`.

    Shapes   table: (n, 21). f: (...), or (..., C).
    Units    f, matrices: 1/sr; table: as in the file, whose angles are in degrees and wavelengths in um.
    Error    of the lookup: see `Scattered`.
    Source   Germer 2017, Appl. Opt. 56(33):9333; columns as in the README of its data.
    """

    format = NAME
    breaks: ClassVar[dict[str, str]] = Scattered.breaks | {"realizability": KEPT}

    table: np.ndarray = note()
    """The file's rows."""
    matrices: np.ndarray = note()
    """Mueller matrices [1/sr] of the pairs, as measured."""

    def __init__(self, table: Any, columns: Any, path: str = ""):
        rows = frozen(np.array(ops.numbers(table), np.float64))
        where = path or "MuellerRows(table)"
        nm, angles = rows[:, 0] * 1e3, np.radians(rows[:, ANGLES])
        if not ((nm > 0.0) & (nm < np.inf)).all():
            raise FormatError(f"{where}: a wavelength is {nm.min():g} nm, expected positive numbers [um]")
        angles = upright(angles, where, LEVEL)
        elements = np.concatenate([np.ones((len(rows), 1)), rows[:, 6:]], axis=1) * rows[:, 5:6]
        values = {"f": rows[:, 5], "mueller": elements.reshape(-1, 4, 4)}
        pairs, names, wide = channel_words.by_channel(angles, nm, values, where)
        single = len(names) == 1
        about = {"columns": list(columns), "wavelengths": names.tolist()}
        if not np.isfinite(wide["f"]).any():
            raise FormatError(f"{where}: holds no value that is a number, expected at least one measurement")
        matrices = frozen(wide["mueller"][:, 0] if single else wide["mueller"])
        measured = np.isfinite(matrices).all(axis=(-1, -2))
        if wrong := int((measured & ~realizable(np.where(measured[..., None, None], matrices, 0.0))).sum()):
            about["not realizable"] = wrong
        self._hold(table=rows, matrices=matrices)
        theta_i, phi_i, theta_o, phi_o = pairs.T
        super().__init__(theta_i, phi_i, theta_o, phi_o, wide["f"], channels=names.tolist(), path=path, about=about)

    def facet_matrices(self) -> np.ndarray:
        wi, wo = (direction(self.rows[:, k], self.rows[:, k + 1]) for k in (0, 2))
        M = to_frames(self.matrices, wi, wo, "facet", given="xyxy").reshape(len(wi), -1, 4, 4)
        if self.is_mirrored:
            behind = np.sin(self.rows[:, 3] - self.rows[:, 1]) < 0.0
            M = np.where(behind[:, None, None, None], M * MIRRORED, M)
        flat = M.reshape(len(wi), -1)
        rows = Rows(self.rows, flat, None, tree.is_oriented(self), self.is_mirrored, self.outside)
        nodes, _, _ = interpolated(rows, self.axes)
        return nodes
