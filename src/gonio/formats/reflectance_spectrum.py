"""Spectra of reflectance, as panels are calibrated with: two or three columns, wavelength, reflectance, uncertainty.

Wavelengths are in nm and rise; reflectances are fractions; lines that begin with "#" or ";" are passed over, and up to
three lines of words come before the numbers. Such a file says nothing of directions: it is read as a Lambertian
surface, which is an assumption. Checked against a real file (Labsphere's 8 degrees/hemispherical calibration of a
Spectralon panel, published by GRIT Lab). Whether its uncertainties are standard or expanded ones the file does not say:
they are taken as they are.
"""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import ops
from ..base.measured import Measured
from ..errors import FormatError, ParameterError
from ..formula.state import note
from ..models.lambertian import Lambertian
from ._reading import plain_text

if TYPE_CHECKING:
    import xarray

NAME = "reflectance spectrum"
SUFFIXES = (".txt", ".csv")
SHARED_SUFFIX = True
DESCRIPTION = "wavelength, reflectance, uncertainty: a Lambertian surface, by assumption"
ORACLE = "real file (GRIT Lab, Spectralon)"

COMMENTS = ("#", ";")
SHORTEST, LONGEST = 100.0, 100000.0  # wavelengths [nm] that a file of this kind may begin and end with
ASSUMPTION = "Lambertian: f = reflectance/pi for all directions; the file has no angles"


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: all its lines are wavelength, reflectance[, uncertainty]."""
    lines = [line.strip() for line in plain_text.start(head).split("\n")]
    if size > len(head):
        lines = lines[:-1]  # may be cut
    rows = [words for line in lines if (words := plain_text.split(line)) and not line.startswith(COMMENTS)]
    rows = rows[next((k for k, row in enumerate(rows[:4]) if plain_text.is_number(row[0])), 0) :]
    if len(rows) < 2 or len({len(row) for row in rows}) > 1 or len(rows[0]) not in (2, 3):
        return False
    if not all(plain_text.is_number(x) for row in rows for x in row):
        return False
    nm, rho = np.array(rows, dtype=float).T[:2]
    return bool(nm[0] >= SHORTEST and nm[-1] <= LONGEST and (np.diff(nm) > 0.0).all() and (np.abs(rho) <= 120.0).all())


def read(path: Path) -> ReflectanceSpectrum:
    """The spectrum, as a Lambertian surface. Raises FormatError with the line where there is something else.

    Example
    >>> np.savetxt("panel.asc", [[400.0, 0.97], [500.0, 0.98], [600.0, 0.98], [700.0, 0.99]])
    >>> print(gn.load("panel.asc").channel_names)
    (400.0, 500.0, 600.0, 700.0)
    """
    lines = plain_text.read(path, COMMENTS)
    words: list[str] = []
    while (line := lines.peek()) is not None:
        row = plain_text.split(line)
        if len(words) == 3 or (row and plain_text.is_number(row[0])):
            break
        words.append(lines.take("a line"))
    if line is None:
        raise lines.cut_short("rows of wavelength and reflectance")
    columns = len(row)
    if columns not in (2, 3):
        raise lines.fault(line, "two or three columns: wavelength [nm], reflectance, and its uncertainty")
    rows = lines.rows(columns, expected="numbers: wavelength [nm], reflectance, and its uncertainty")
    return ReflectanceSpectrum(rows, str(path), {"text": words} if words else {})


def write(m: ReflectanceSpectrum, path: Path) -> None:
    """Write the rows as they were read, number by number. Raises ParameterError for other materials."""
    if not isinstance(m, ReflectanceSpectrum):
        raise ParameterError(f"{m!r:.80}: expected a reflectance spectrum; others need a format with directions")
    plain_text.write(path, chain((f"{line}\n" for line in m.about.get("text", [])), plain_text.join(m.rows)))


class ReflectanceSpectrum(Lambertian, Measured):
    """A measured spectrum of reflectance, taken for that of a Lambertian surface: f = rho(wavelength)/pi.

    What such files hold is usually the 8 degrees/hemispherical reflectance; that the surface is Lambertian is an
    assumption, as `about` says. Another panel of Spectralon, seen along the normal at 538 nm, has an f 8 % above rho/pi
    for light at 12 degrees and 19 % below it for light at 85 degrees (`brf_table`).

    Shapes   rows: (n, 2 or 3). f: (..., n).
    Units    f: 1/sr; rows: nm, 1, 1.
    Error    `uncertainty`, as in the file, of rho; that of the assumption is not in it.
    Source   definition.
    """

    format = NAME
    quantity = "reflectance"

    rows: np.ndarray = note()
    """As in the file."""
    uncertainty: np.ndarray | None = note()
    """Of rho, by wavelength."""

    def __init__(self, rows: Any, path: str = "", about: dict[str, Any] | None = None):
        rows = np.array(ops.numbers(rows), np.float64)
        where = path or "ReflectanceSpectrum(rows)"
        if rows.ndim != 2 or rows.shape[1] not in (2, 3) or not len(rows):
            raise ParameterError(f"{where}: shape {rows.shape}, expected (n, 2) or (n, 3)")
        nm, rho = rows[:, 0], rows[:, 1]
        if not (nm[0] >= SHORTEST and nm[-1] <= LONGEST and (np.diff(nm) > 0.0).all()):
            raise FormatError(f"{where}: wavelengths from {nm[0]:g} to {nm[-1]:g}, expected rising ones in nm")
        if not ((rho >= 0.0) & (rho <= 1.0)).all():
            got = f"reflectances from {np.min(rho):g} to {np.max(rho):g}"
            raise FormatError(f"{where}: {got}, expected 0 to 1; divide percentages by 100")
        rows.flags.writeable = False
        names = tuple(nm.tolist())
        self._hold(rows=rows, channel_names=names, uncertainty=rows[:, 2] if rows.shape[1] == 3 else None)
        super().__init__(path, {"assumption": ASSUMPTION, **(about or {})}, rho=rho)

    @property
    def values(self) -> np.ndarray:
        """The reflectances, by wavelength."""
        return self.rows[:, 1]

    @property
    def valid(self) -> np.ndarray:
        """True: every wavelength has a value."""
        return np.ones(len(self.rows), bool)

    @property
    def data(self) -> xarray.Dataset:
        """Variables `reflectance` and `uncertainty`, by wavelength."""
        import xarray

        names, units = ("wavelength", "reflectance", "uncertainty"), ("nm", "1", "1")
        columns = {n: ("wavelength", x, {"units": unit}) for n, x, unit in zip(names, self.rows.T, units, strict=False)}
        about = {"quantity": self.quantity, "source": self.path, "assumption": ASSUMPTION}
        return xarray.Dataset(columns, attrs=about)
