"""Spectra of reflectance, as panels are calibrated with: two or three columns, wavelength, reflectance, uncertainty.

Names of columns say the unit (nm, um, cm-1, eV; percent) and the quantity. What is no reflectance, what is not known,
and what has two readings, such as a third column without a name, is refused with the option that decides; numbers go by
the understanding of laboratories' tables. Two columns without names are wavelength [nm] and reflectance, and a warning
says so. Such a file says nothing of directions: it is read as a Lambertian surface, which is an assumption. Checked
against a real file (Labsphere's 8 degrees/hemispherical calibration of a Spectralon panel, published by GRIT Lab).
Uncertainties that do not say whether they are standard or expanded ones are taken as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..base.measured import Measured
from ..declared.arguments import Declared
from ..errors import FormatError, MeaningWarning, ParameterError, warn
from ..files.cells import decimal_sign, delimiter_of, split
from ..formula.state import note
from ..models.lambertian import Lambertian
from ..tables.angle_systems import ANGLES
from ._laboratory.names import UNCERTAINTY, WAVELENGTH, WAVELENGTH_UNITS, meaning, nanometres, unit_of
from ._laboratory.spectra import REFLECTANCE, WORDS, SpectrumColumns, Stated, column, names_in
from ._reading import plain_text
from .csv_table import Coverage, Spread

if TYPE_CHECKING:
    import xarray

NAME = "reflectance spectrum"
SUFFIXES = (".txt", ".csv")
SHARED_SUFFIX = True
DESCRIPTION = "wavelength, reflectance, uncertainty: a Lambertian surface, by assumption"
ORACLE = "real file (GRIT Lab, Spectralon)"
NO_LAYOUT = "a spectrum, no angles"

COMMENTS = ("#", ";")
SHORTEST, LONGEST = 100.0, 100000.0  # wavelengths [nm] that a file of this kind may begin and end with
ASSUMPTION = "Lambertian: f = reflectance/pi for all directions; the file has no angles"
ROWS = 400
"""Rows that say what is between numbers."""

HEADER = 30
"""Lines above the numbers, at most."""


class _Text(NamedTuple):
    """Lines above the numbers with their number and whether they are comments; and rows of cells with their number."""

    above: list[tuple[int, str, bool]]
    rows: list[tuple[int, list[str]]]

    def names(self) -> tuple[int, list[str], list[str]]:
        """The line of names, these, and units below them; 0 and none where nothing names columns."""
        units, count = [""] * len(self.rows[0][1]), len(self.rows[0][1])
        for number, line, _ in reversed(self.above):
            cells = split(
                line, delimiter_of("", [line]) if any(d in line for d in ";\t|") else "," if "," in line else " "
            )
            below = [unit_of(cell.strip("[](){}")) for cell in cells]
            if len(cells) == count and all(below):
                units = [unit or "" for unit in below]
            if names := [] if all(below) else names_in(line, count):
                return number, names, units
        return 0, [], units


def _text(path: object, lines: Sequence[str], decimal: str | None) -> _Text:
    """The lines of a file, with points for decimal signs. Raises FormatError where a comma has two readings."""
    above: list[tuple[int, str, bool]] = []
    rows: list[tuple[int, str]] = []
    for number, line in enumerate(lines, 1):
        kept = line.strip()
        if not kept:
            continue
        if not rows and len(above) <= HEADER and not _begins_with_number(kept):
            above.append((number, kept.lstrip("#; \t"), kept.startswith(COMMENTS)))
        elif not kept.startswith(COMMENTS):
            rows.append((number, kept))
    first = [row for _, row in rows[:ROWS]]
    delimiter = delimiter_of(path, first, decimal)
    cells = [(number, split(row, delimiter)) for number, row in rows]
    if {len(row) for _, row in cells[:ROWS]} <= {2, 3} and delimiter != ",":
        sign = decimal or decimal_sign(path, [cell for _, row in cells[:ROWS] for cell in row])
        if sign == ",":
            return _Text(above, [(k, [x.replace(".", "").replace(",", ".") for x in row]) for k, row in cells])
    return _Text(above, [(number, plain_text.split(row)) for number, row in rows])  # any of blanks, commas, semicolons


def _begins_with_number(line: str) -> bool:
    words = plain_text.split(line)
    return bool(words) and plain_text.is_number(words[0])


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: all its rows are wavelength, reflectance[, uncertainty]."""
    lines = head.decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if size > len(head):
        lines = lines[:-1]  # may be cut
    for decimal in (None, ",", "."):  # which `read` asks about
        try:
            text = _text("", lines, decimal)
            break
        except FormatError:
            continue
    else:
        return False
    rows = [row for _, row in text.rows]
    if len(rows) < 2 or len({len(row) for row in rows}) > 1 or len(rows[0]) not in (2, 3):
        return False
    if not all(plain_text.is_number(x) for row in rows for x in row):
        return False
    _, names, _ = text.names()
    nm, rho = np.array(rows, dtype=float).T[:2]
    steps = np.diff(nm)
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        return False
    if any(meaning(name).key in (*ANGLES, "angle") for name in names):
        return False
    if any(column(name).key == WAVELENGTH for name in names):
        return True
    words = sum(not is_comment for _, _, is_comment in text.above)
    return bool(words <= 3 and nm.min() >= SHORTEST and nm.max() <= LONGEST and (np.abs(rho) <= 120.0).all())


Columns = Annotated[
    Sequence[Annotated[str, Declared("what a column is", words=tuple(WORDS))]] | None,
    Declared("what the columns are, in their order"),
]
WavelengthUnit = Annotated[
    str | None, Declared("unit of wavelengths whose name has none; nm if not given", words=WAVELENGTH_UNITS)
]
Quantity = Annotated[
    str | None, Declared("that the values are reflectances, whatever their name says", words=(REFLECTANCE,))
]
ValueUnit = Annotated[str | None, Declared("unit of reflectances whose name has none", words=("1", "%"))]
Decimal = Annotated[str | None, Declared("decimal sign, where a comma has two readings", words=(".", ","))]


def read(
    path: Path,
    columns: Columns = None,
    wavelength_unit: WavelengthUnit = None,
    quantity: Quantity = None,
    value_unit: ValueUnit = None,
    coverage: Coverage = None,
    uncertainty: Spread = None,
    decimal: Decimal = None,
) -> ReflectanceSpectrum:
    """The spectrum, as a Lambertian surface.

    Raises FormatError with the line where there is something else, and for what is no reflectance, is not known, or has
    two readings, with the option that decides.

    Example
    >>> with open("dark.csv", "w") as file:
    ...     n = file.write("wavelength (nm),reflectance (%)\\n400,0.41\\n500,0.42\\n600,0.45\\n")
    >>> dark = gn.load("dark.csv")
    >>> print(dark.channel_names, gn.albedo(dark, [0, 0, 1]).round(4))
    (400.0, 500.0, 600.0) [0.0041 0.0042 0.0045]
    """
    text = _text(path, plain_text.text(path).split("\n"), decimal)
    if not text.rows:
        raise FormatError(f"{path}: ends after line {len(text.above)}, expected rows of wavelength and reflectance")
    numbers = _numbers(path, text)
    line, names, below = text.names()
    asked = SpectrumColumns(path, line, names, numbers.shape[1])
    found = (
        asked.told(columns)
        if columns is not None
        else asked.by_name(quantity)
        if names
        else asked.unnamed(text.above, quantity)
    )
    of = {c.key: k for k, c in enumerate(found) if c.key in (WAVELENGTH, REFLECTANCE, UNCERTAINTY)}
    nm, unit = _nanometres(
        path, numbers[:, of[WAVELENGTH]], found[of[WAVELENGTH]].unit or below[of[WAVELENGTH]], wavelength_unit
    )
    share = found[of[REFLECTANCE]].unit or below[of[REFLECTANCE]] or value_unit or "1"
    rho = numbers[:, of[REFLECTANCE]] * (0.01 if share == "%" else 1.0)
    if share != "%" and rho.max() > 1.0 and value_unit is None:
        got = f"reflectances from {rho.min():g} to {rho.max():g}"
        raise FormatError(f"{path}: {got}, expected 0 to 1; if they are percentages say value_unit='%'")
    kept = [nm, rho]
    understood = [f"wavelengths in {unit}", "reflectance in percent, divided by 100" if share == "%" else "reflectance"]
    if UNCERTAINTY in of:
        c = found[of[UNCERTAINTY]]
        c = c._replace(unit=c.unit or below[of[UNCERTAINTY]])
        u, words = asked.standard(numbers[:, of[UNCERTAINTY]], rho, c, Stated(share, coverage, uncertainty))
        kept.append(u)
        understood.append(words)
    rows = np.stack(kept, axis=1)
    about: dict[str, Any] = {"understood": ", ".join(understood)}
    if names:
        about["columns"] = ", ".join(names)
    if others := [words for number, words, _ in text.above if number != line and words]:
        about["text"] = others
    m = ReflectanceSpectrum(rows if len(nm) < 2 or nm[0] < nm[-1] else rows[::-1], str(path), about)
    if asked.taken:
        taken = "two columns without names, taken for wavelength [nm] and reflectance of a surface"
        cure = f"of that say quantity='{REFLECTANCE}'; a lamp or a filter is gn.Spectrum(wavelengths, values)"
        warn(f"{path}: {taken}; {cure}", MeaningWarning)
    return m


def _numbers(path: Path, text: _Text) -> np.ndarray:
    count = len(text.rows[0][1])
    expected = "two or three numbers: wavelength, reflectance, and its uncertainty"
    for number, row in text.rows:
        if len(row) != count or count not in (2, 3) or not all(map(plain_text.is_number, row)):
            raise FormatError(f"{path}, line {number}: got {' '.join(row)[:60]!r}, expected {expected}")
    return np.array([row for _, row in text.rows], dtype=float)


def _nanometres(path: Path, numbers: np.ndarray, stated: str, said: str | None) -> tuple[np.ndarray, str]:
    """Wavelengths [nm], and the unit that they are in."""
    if stated and said and said != stated:
        raise ParameterError(f"wavelength_unit={said!r}: {path} says {stated}; leave the option out")
    unit = stated or said
    if not unit and numbers.max() < SHORTEST:
        raise FormatError(
            f"{path}: wavelengths from {numbers.min():g} to {numbers.max():g}, and no unit is stated: micrometres? say "
            f"wavelength_unit='um', 'nm' or 'eV'"
        )
    return nanometres(numbers, unit or "nm"), unit or "nm (unstated)"


def write(m: ReflectanceSpectrum, path: Path) -> None:
    """Write the rows, number by number, below names. Raises ParameterError for other materials."""
    if not isinstance(m, ReflectanceSpectrum):
        raise ParameterError(f"{m!r:.80}: expected a reflectance spectrum; others need a format with directions")
    names = " ".join(("wavelength[nm]", "reflectance[1]", "u[1]")[: m.rows.shape[1]])
    plain_text.write(path, [*(f"# {line}\n" for line in m.about.get("text", [])), names + "\n"], m.rows)


class ReflectanceSpectrum(Lambertian, Measured):
    """A measured spectrum of reflectance, taken for that of a Lambertian surface: f = rho(wavelength)/pi.

    What such files hold is usually the 8 degrees/hemispherical reflectance; that the surface is Lambertian is an
    assumption, as `about` says. Another panel of Spectralon, seen along the normal at 538 nm, has an f 8 % above rho/pi
    for light at 12 degrees and 19 % below it for light at 85 degrees (`brf_table`).

    Shapes   rows: (n, 2 or 3). f: (..., n).
    Units    f: 1/sr; rows: nm, 1, 1.
    Error    `uncertainty`, of rho, as the file states it; that of the assumption is not in it.
    Source   definition.
    """

    format = NAME
    quantity = "reflectance"

    rows: np.ndarray = note()
    """Wavelength [nm], reflectance, and its standard uncertainty; wavelengths rise."""
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
