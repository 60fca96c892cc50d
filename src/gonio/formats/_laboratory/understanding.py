"""A laboratory's table, understood: its columns as angles, values and standard uncertainties, and words about them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...errors import FormatError, ParameterError
from ...tables.angle_systems import ANGLES
from .layout import TableLayout
from .meanings import Meanings, Said
from .names import IGNORE, UNCERTAINTY, VALUE, WAVELENGTH, WAVELENGTH_UNITS, Meaning, nanometres, unit_of
from .numbers import NumberColumns, numbers, without_marks
from .sheets import CellSheet, TextSheet


class Column(NamedTuple):
    """A column, as it was understood.

    name     in the file, or "" of a constant
    meaning  in words
    unit     in words, and where it is from
    first    its first values; `low` and `high` its least and largest number
    missing  cells without a number
    """

    name: str
    meaning: str
    unit: str
    first: tuple[str, ...] = ()
    low: float = math.nan
    high: float = math.nan
    missing: int = 0


class Understood(NamedTuple):
    """A table: columns of angles in one unit, and of values, named as `csv_table` names them, and how they were read.

    angles   name of the angle -> (rows,), in degrees, or in radians if `in_radians`; and "wavelength" [nm]
    values   (quantity, whether it is the uncertainty, channel) -> (rows,); uncertainties are standard ones
    columns  as they stand in the file, constants last
    numbers  as they stand in the file
    remarks  what was taken from the text above the table
    """

    angles: dict[str, np.ndarray]
    values: dict[tuple[str, bool, str], np.ndarray]
    in_radians: bool
    columns: list[Column]
    layout: TableLayout
    numbers: NumberColumns
    remarks: list[str]


def understand(sheet: TextSheet | CellSheet, said: Said) -> Understood:
    """The table of a sheet.

    Raises FormatError where a name or a number is unknown or has two readings, with the option that decides it, and
    ParameterError for columns that are not there.
    """
    return _TableReader(sheet, Meanings(sheet, said)).understood()


class _TableReader:
    def __init__(self, sheet: TextSheet | CellSheet, meanings: Meanings):
        self.meanings, self.said, self.layout = meanings, meanings.said, meanings.layout
        self.of, self.names, self.path = meanings.of, meanings.names, sheet.path
        wanted = [k for k, of in self.of.items() if of.key != IGNORE]
        angular = [k for k in wanted if self.of[k].key in (*ANGLES, WAVELENGTH)]
        self.numbers = numbers(sheet, self.layout, wanted, angular, self.said.decimal, self.said.marks)
        self.columns = {k: Column(self.names[k], "left out", "") for k, of in self.of.items() if of.key == IGNORE}

    def understood(self) -> Understood:
        """The table, all decided."""
        angles, in_radians = self._angles()
        values = self._values(lambda: places(angles))
        columns = [self.columns[k] for k in sorted(self.columns)]
        for key, x in self.meanings.constants.items():
            words, unit = ("wavelength", "nm") if key == WAVELENGTH else (f"{key}: {_short(key)}", "deg")
            columns.append(Column("", f"{words}, of all rows", unit, (f"{x:g}",), x, x))
        return Understood(angles, values, in_radians, columns, self.layout, self.numbers, self.meanings.remarks)

    # Angles.

    def _angles(self) -> tuple[dict[str, np.ndarray], bool]:
        """Angles by their name, all in one unit."""
        places = {of.key: k for k, of in self.of.items() if of.key in (*ANGLES, WAVELENGTH)}
        stated = self._stated_unit()
        units = {key: self._angle_unit(k, stated) for key, k in places.items() if key in ANGLES}
        self._expect_degrees({key: self.numbers.columns[places[key]] for key, unit in units.items() if not unit})
        in_radians = bool(units) and {*units.values()} == {"rad"} and not self.meanings.constants
        angles: dict[str, np.ndarray] = {}
        for key, k in places.items():
            column = self.numbers.columns[k]
            if key == WAVELENGTH:
                angles[key], unit = self._nm(column, self.of[k])
                self.columns[k] = _column(self.names[k], "wavelength", unit, column)
                continue
            factor = 1.0 if in_radians else _DEGREES.get(units[key], 1.0)
            angles[key] = column if factor == 1.0 else column * factor
            unit = units[key] or "deg (unstated)"
            self.columns[k] = _column(self.names[k], f"{key}: {_short(key)}", unit, column)
        rows = len(self.numbers.lines)
        for key, number in self.meanings.constants.items():
            angles[key] = np.full(rows, number * (_DEGREES.get(stated, 1.0) if key in ANGLES else 1.0))
        self._turn(angles, places, math.pi if in_radians else 180.0)
        return angles, in_radians

    def _stated_unit(self) -> str:
        """The unit of angles by the option, or by a line "# angle_unit: rad"."""
        stated = self.said.angle_unit or self.layout.notes.get("angle_unit", "")
        unit = unit_of(stated) if stated else ""
        if unit not in ("", "deg", "rad"):
            raise FormatError(f"{self.path}: angle_unit: {stated}, expected deg or rad")
        return unit

    def _angle_unit(self, k: int, stated: str) -> str:
        of, name = self.of[k], self.names[k]
        if of.unit and of.unit not in ("deg", "rad", "mrad"):
            raise self.meanings.fault(f"column {name!r:.60}: an angle in {of.unit}, expected deg or rad")
        if self.said.angle_unit and of.unit not in ("", stated):
            raise ParameterError(f"angle_unit={stated!r}: the column {name!r:.60} says {of.unit}; leave the option out")
        return of.unit or stated

    def _expect_degrees(self, unstated: dict[str, np.ndarray]) -> None:
        """Raises FormatError where angles without a unit look like radians."""
        if not len(self.numbers.lines):
            return
        largest = {key: float(np.abs(column).max()) for key, column in unstated.items()}
        polar = {key: column for key, column in unstated.items() if ANGLES[key].highest is not None}
        small = all(x <= (0.5 if key in polar else 2.0) * math.pi + 1e-3 for key, x in largest.items())
        broken = any((column != np.round(column)).any() for column in polar.values())
        if small and broken and max(len(np.unique(column)) for column in polar.values()) > 2:
            raise FormatError(
                f"{self.path}: polar angles up to {max(largest[key] for key in polar):.4g}, and no unit is "
                f"stated: radians, or degrees close to the normal? say angle_unit='rad' or angle_unit='deg'"
            )

    def _nm(self, column: np.ndarray, of: Meaning) -> tuple[np.ndarray, str]:
        unit = of.unit if of.unit in WAVELENGTH_UNITS else self.said.wavelength_unit
        if unit is None and len(column) and column.max() < 100.0:
            raise FormatError(
                f"{self.path}: wavelengths from {column.min():g} to {column.max():g}, and no unit is stated: "
                f"micrometres? say wavelength_unit='um' or wavelength_unit='nm'"
            )
        return nanometres(column, unit or "nm"), unit or "nm (unstated)"

    def _turn(self, angles: dict[str, np.ndarray], places: dict[str, int], half: float) -> None:
        """Count azimuths from the side of the light, where they are counted from the mirror direction."""
        if {key for key in angles if key != WAVELENGTH} == {"theta_i", "theta_o"}:
            self._expect_sides(angles["theta_i"], angles["theta_o"])
            key, shifted = "theta_o", 0.0 - angles["theta_o"]
            words = "of the sign of theta_i in the mirror direction"
        elif self.said.forward == 0 and not {"phi", "phi_o"} & {*angles}:
            raise ParameterError("forward=0: expected a column phi or phi_o, or theta_i and theta_o alone")
        elif self.said.forward == 0:
            key = "phi" if "phi" in angles else "phi_o"
            shifted, words = angles[key] + half, "0 in the mirror direction, half a turn is added"
        if self.said.forward == 0:
            angles[key] = shifted
            if key in places:
                column = self.columns[places[key]]
                self.columns[places[key]] = column._replace(meaning=f"{column.meaning}; {words}")

    def _expect_sides(self, theta_i: np.ndarray, theta_o: np.ndarray) -> None:
        """Raises FormatError where nothing says on which side of the normal the viewer is."""
        one_sided = len(theta_i) and min(theta_i.min(), theta_o.min()) >= 0.0
        if self.said.forward is None and one_sided and min(theta_i.max(), theta_o.max()) > 0.0:
            raise FormatError(
                f"{self.path}: no column of an azimuth and no negative angle: the viewer may be on the side of "
                f"the light, "
                f"or on the mirror's; say forward=180, or forward=0, where theta_o = theta_i is the mirror direction"
            )

    # Values.

    def _values(self, at: Callable[[], np.ndarray]) -> dict[tuple[str, bool, str], np.ndarray]:
        """Values and standard uncertainties by quantity and channel, in units of 1; `at`: places of the rows."""
        values: dict[tuple[str, bool, str], np.ndarray] = {}
        places = [k for k, of in self.of.items() if of.key == VALUE]
        for k in places:
            of, column = self.of[k], self._marked(k, at)
            values[of.quantity, False, of.channel] = column * 0.01 if of.unit == "%" else column
            words = f"values: {_IN_WORDS[of.quantity]}{f', channel {of.channel}' if of.channel else ''}"
            self.columns[k] = _column(self.names[k], words, _value_unit(of), column)
        for k in [k for k, of in self.of.items() if of.key == UNCERTAINTY]:
            left = self._value_of(k, places)
            value, column = self.of[left], self._marked(k, at)
            if (value.quantity, True, value.channel) in values:
                raise self.meanings.fault(
                    f"column {self.names[k]!r:.60} is a second uncertainty of {self.names[left]!r:.60}, "
                    f"expected one; leave it "
                    f'out: columns={{"ignore": {self.names[k]!r:.60}}}'
                )
            u, words, unit = self._standard(k, column, values[value.quantity, False, value.channel], value)
            values[value.quantity, True, value.channel] = u
            words += f" of {self.names[left]!r:.60}" if len(places) > 1 else ""
            self.columns[k] = _column(self.names[k], words, unit, column)
        return values

    def _marked(self, k: int, at: Callable[[], np.ndarray]) -> np.ndarray:
        return without_marks(self.path, self.layout, self.numbers, k, self.said.marks, at)

    def _value_of(self, k: int, places: list[int]) -> int:
        """The column of values that an uncertainty belongs to: of its channel, else the next on its left."""
        channel = self.of[k].channel
        before = [p for p in places if p < k]
        same = [p for p in places if self.of[p].channel == channel]
        if same or (before and not channel):
            return same[0] if same else before[-1]
        raise self.meanings.fault(
            f"column {self.names[k]!r:.60}: an uncertainty of channel {channel!r:.60}, which no values have; expected "
            f"uncertainties of none or of all channels, each on the right of its values or named as these"
        )

    def _standard(self, k: int, column: np.ndarray, values: np.ndarray, value: Meaning) -> tuple[np.ndarray, str, str]:
        """The standard uncertainty, in the unit of the values, with words for the column and its unit."""
        of = self.of[k]
        factor = self._coverage(k)
        words = (
            "standard uncertainty" if factor == 1.0 else f"expanded uncertainty, k = {factor:g}: divided by {factor:g}"
        )
        relative = {"relative": True, "absolute": False}.get(self.said.uncertainty or "", of.relative)
        if relative is None and of.unit == value.unit == "%":
            readings = (("relative", "percent of the value"), ("absolute", "percent, as the values"))
            raise self.meanings.two_readings(self.names[k], readings, "uncertainty={key!r:.60}")
        relative = of.unit == "%" if relative is None else relative
        if relative:
            share = column * (0.01 if of.unit == "%" else 1.0) / factor
            return np.abs(values) * share, f"relative {words}", of.unit or "1"
        scale = (0.01 if "%" in (of.unit, value.unit) else 1.0) / factor
        return column if scale == 1.0 else column * scale, words, of.unit or _value_unit(value)

    def _coverage(self, k: int) -> float:
        """The coverage factor of a column."""
        stated, said = self.of[k].coverage, self.said.coverage
        if stated and stated != 1.0:
            if said not in (None, stated):
                name = self.names[k]
                raise ParameterError(
                    f"coverage={said:g}: the column {name!r:.60} says k = {stated:g}; leave the option out"
                )
            return stated
        factor = said or stated or self.meanings.stated_coverage()
        if not factor:
            raise self.meanings.fault(
                f"column {self.names[k]!r:.60}: a standard uncertainty, or an expanded one, and by which factor k? say "
                f"coverage=1 for a standard uncertainty, coverage=2 for U (k = 2)"
            )
        return factor


def places(angles: dict[str, np.ndarray]) -> np.ndarray:
    """What tells the rows' places apart (rows, k): angles, without azimuths along the normal."""
    polar = [angles[name] for name in angles if name.startswith("theta")]
    tilted = np.logical_and.reduce([theta != 0.0 for theta in polar]) if polar else True
    return np.stack([x * tilted if name.startswith("phi") else x for name, x in angles.items()], axis=-1)


_DEGREES = {"rad": math.degrees(1.0), "mrad": math.degrees(1e-3)}
_IN_WORDS = {
    "brdf": "BRDF f",
    "brdf * cos(theta_o)": "DSF, f cos(theta_o)",
    "brdf * cos(theta_i)": "f cos(theta_i)",
    "reflectance factor": "reflectance factor, pi f",
}


def _short(angle: str) -> str:
    return ANGLES[angle].meaning.replace("direction to the ", "")


def _value_unit(of: Meaning) -> str:
    return of.unit or ("1" if of.quantity == "reflectance factor" else "1/sr")


def _column(name: str, words: str, unit: str, column: np.ndarray) -> Column:
    finite = column[np.isfinite(column)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (math.nan, math.nan)
    first = tuple("missing" if math.isnan(x) else f"{x:.6g}" for x in column[:3])
    return Column(name, words, unit, first, low, high, int(np.isnan(column).sum()))
