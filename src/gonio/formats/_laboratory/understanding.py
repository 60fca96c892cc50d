"""What the columns of a laboratory's table mean, by their names and by what its reader says, and their numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...errors import FormatError, ParameterError
from ...tables.angle_systems import ANGLES
from .._reading import plain_text
from .layout import Layout, find
from .names import IGNORE, QUANTITIES, UNCERTAINTY, VALUE, WAVELENGTH, Meaning, meaning, unit_of
from .numbers import Numbers, numbers, without_marks
from .sheets import DELIMITERS, CellSheet, TextSheet


class Said(NamedTuple):
    """What the reader of a table says about it; see `csv_table.read`."""

    columns: Mapping[str, Any] | Sequence[str] | None = None
    skip: int | None = None
    delimiter: str | None = None
    decimal: str | None = None
    angle_unit: str | None = None
    wavelength_unit: str | None = None
    quantity: str | None = None
    value_unit: str | None = None
    coverage: float | None = None
    uncertainty: str | None = None
    missing: float | str | None = None
    forward: int | None = None

    @property
    def marks(self) -> list[str]:
        """The words of `missing`."""
        return [] if self.missing is None else [word.strip() for word in str(self.missing).split(",")]


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
    notes    lines "# key: value" of the file
    """

    angles: dict[str, np.ndarray]
    values: dict[tuple[str, bool, str], np.ndarray]
    in_radians: bool
    notes: dict[str, str]
    columns: list[Column]
    layout: Layout
    lines: np.ndarray
    repeated: list[int]
    below: list[str]
    decimal: str
    remarks: list[str]


def understand(sheet: TextSheet | CellSheet, said: Said) -> Understood:
    """The table of a sheet. Raises FormatError where something is unknown or has two readings, with the option that
    decides it, and ParameterError for columns that are not there."""
    return _Table(sheet, said).understood()


def understand_names(sheet: TextSheet | CellSheet, said: Said) -> None:
    """Raises the errors of `understand` that the names give, before any number is read."""
    _Table(sheet, said)


class _Table:
    def __init__(self, sheet: TextSheet | CellSheet, said: Said):
        self.path, self.said, self.sheet = sheet.path, said, sheet
        delimiter = DELIMITERS.get(said.delimiter or "", said.delimiter)
        self.layout = find(sheet, said.columns, said.skip, delimiter)
        self.names, self.remarks = self.layout.names, []  # type: tuple[list[str], list[str]]
        self.constants: dict[str, float] = {}
        self.meanings = self._with_units(self._meanings())

    # What the names mean.

    def _meanings(self) -> dict[int, Meaning]:
        """Meaning of each column, by place."""
        columns = self.said.columns
        if columns is not None and not isinstance(columns, Mapping):
            return {k: self._told(str(key), "") for k, key in enumerate(columns) if str(key).strip()}
        told = self._by_name(columns or {})
        found: dict[int, Meaning] = {}
        for k, name in enumerate(self.names):
            if k in told:
                found[k] = told[k]
            elif name:
                found[k] = meaning(name)
        self._decide_red(found)
        self._decide_angles(found)
        others = isinstance(columns, Mapping) and columns.get(IGNORE) == "*"
        for k, of in found.items():
            if not of.key:
                if not others:
                    raise self._unknown(self.names[k])
                found[k] = Meaning(IGNORE)
        return found

    def _by_name(self, columns: Mapping[str, Any]) -> dict[int, Meaning]:
        told: dict[int, Meaning] = {}
        for key, names in columns.items():
            for name in names if isinstance(names, (list, tuple)) else (names,):
                if key == IGNORE and name == "*":
                    continue
                k = self._place(name)
                if k is None:
                    self._constant(key, name)
                elif k in told:
                    raise ParameterError(f"columns: {self.names[k]!r} twice, expected one meaning for each column")
                else:
                    told[k] = self._told(key, self.names[k])
        return told

    def _place(self, name: Any) -> int | None:
        """The column of a name; None for a number that is no column's name."""
        word = str(name).strip().lower()
        places = [k for k, n in enumerate(self.names) if n == str(name).strip()]
        places = places or [k for k, n in enumerate(self.names) if n.lower() == word]
        if len(places) == 1:
            return places[0]
        if not places and plain_text.is_number(word):
            return None
        fault = "there is no such column" if not places else f"{len(places)} columns have this name"
        raise ParameterError(
            f"columns: {name!r}: {fault} in {self.path}; line {self.layout.header} names {self._listed()}"
        )

    def _listed(self) -> str:
        return ", ".join(map(repr, self.names[:20])) + (" ..." if len(self.names) > 20 else "")

    def _constant(self, key: str, number: Any) -> None:
        if key not in ANGLES and key != WAVELENGTH:
            raise ParameterError(
                f"columns: {key}={number}: expected the name of a column; a number may stand for an angle"
            )
        self.constants[key] = float(number)

    def _told(self, key: str, name: str) -> Meaning:
        """The meaning that is said, with the unit and the coverage factor of the column's own name."""
        of = meaning(key)
        own = meaning(name) if name else Meaning()
        unit = own.unit or _unit_in(name)
        if key in ANGLES or key in (WAVELENGTH, IGNORE):
            return Meaning(key, unit=unit)
        if of.key == UNCERTAINTY:
            coverage = own.coverage if own.key == UNCERTAINTY and own.coverage is not None else of.coverage
            return of._replace(unit=unit, coverage=coverage, relative=own.relative)
        if of.key == VALUE and (of.quantity or of.channel) and not of.readings:
            return of._replace(unit=unit)
        expected = (
            f"{', '.join(ANGLES)}, {WAVELENGTH}, {', '.join(QUANTITIES)}, each of these as f_R or f_550nm, u_f, ignore"
        )
        raise ParameterError(f"columns: {key!r}: expected one of {expected}")

    def _unknown(self, name: str) -> FormatError:
        return FormatError(
            f"{self.path}, line {self.layout.header}: column {name!r} is not known; say what it is, or leave it out: "
            f'columns={{"theta_o": {name!r}}} or columns={{"ignore": {name!r}}} (-O columns.ignore={name!r}); "ignore": "*" '
            f"leaves out every unknown one"
        )

    def _decide_red(self, found: dict[int, Meaning]) -> None:
        """ "R" beside "G" and "B" is a channel."""
        channels = {of.channel for of in found.values() if of.key == VALUE}
        for k, of in found.items():
            if of.key in (VALUE, UNCERTAINTY) and "G" in channels and self.names[k].lower().split()[-1:] == ["r"]:
                found[k] = of._replace(readings=(), channel="R")
            if self.names[k] == "f_r" and channels & {"g", "G"}:
                found[k] = of._replace(channel="r" if "g" in channels else "R")

    def _decide_angles(self, found: dict[int, Meaning]) -> None:
        """Names such as theta_s, by the other angles; and azimuths of one side alone."""
        sure = {of.key for of in found.values() if of.key in ANGLES} | {*self.constants}
        for k, of in found.items():
            if of.key != "angle":
                continue
            keys = [key for key, _ in of.readings]
            if keys == ["theta_o", "radial"]:
                left = []
            else:
                left = [key for key in keys if key not in sure and _opposite(key) in sure]
                if keys == ["phi_i", "phi_o"] and not left and "theta_i" in self._sides(found, sure):
                    left = ["phi_o"]
                    self._which_azimuth(self.names[k])
            if len(left) != 1:
                raise self._two_readings(self.names[k], of.readings, "columns={{{key!r}: {name!r}}}")
            found[k] = of._replace(key=left[0], readings=())
        turns = {of.key for of in found.values()} | {*self.constants}
        for k, of in found.items():
            lone = of.key == "phi_o" and "phi_i" not in turns
            if lone or (of.key == "azimuth" and "radial" not in turns):
                found[k] = of._replace(key="phi")

    def _sides(self, found: dict[int, Meaning], sure: set[str]) -> set[str]:
        """The side of the light where theta_s is the scattered light, as `sure` has it."""
        return (
            {"theta_i"} if "theta_i" in sure and any(of.key in ("angle", "theta_o") for of in found.values()) else set()
        )

    def _which_azimuth(self, name: str) -> None:
        if self.said.forward is None:
            raise FormatError(
                f"{self.path}, line {self.layout.header}: column {name!r} has two readings: 0 is the mirror direction, as "
                f"in ASTM E2387, or the side of the light; say forward=0 or forward=180, its value in the mirror direction"
            )

    def _two_readings(self, name: str, readings: Sequence[tuple[str, str]], cure: str) -> FormatError:
        said = " or ".join(f"{key} ({words})" for key, words in readings)
        cures = " or ".join(cure.format(key=key, name=name) for key, _ in readings)
        return FormatError(f"{self.path}, line {self.layout.header}: column {name!r} can be {said}; say {cures}")

    def _with_units(self, found: dict[int, Meaning]) -> dict[int, Meaning]:
        """The same with units of a line below the names, each meaning once, and quantities known."""
        for k, of in found.items():
            below = self.layout.units[k] if k < len(self.layout.units) else ""
            if below and of.key != IGNORE:
                if of.unit and of.unit != below:
                    raise FormatError(
                        f"{self.path}: column {self.names[k]!r}: unit {of.unit}, and {below} in the line below"
                    )
                found[k] = of._replace(unit=below)
        seen: dict[Any, int] = {}
        for k, of in found.items():
            if of.key in (IGNORE, UNCERTAINTY) or (of.key == VALUE and of.channel == "" and not of.quantity):
                continue
            same = (of.key, of.channel, of.quantity)
            if same in seen or of.key in self.constants:
                other = f"column {self.names[seen[same]]!r}" if same in seen else "columns="
                raise FormatError(
                    f"{self.path}, line {self.layout.header}: column {self.names[k]} twice: {other} is {of.key} too, expected each "
                    f'once; columns={{"ignore": {self.names[k]!r}}} leaves it out'
                )
            seen[same] = k
        values = [k for k, of in found.items() if of.key == VALUE]
        for k in values:
            found[k] = found[k]._replace(unit=found[k].unit or self.said.value_unit or "")
        if not values:
            raise FormatError(
                f"{self.path}, line {self.layout.header}: no column of values among {self._listed()}; expected f, BRDF, "
                f'DSF or BRF; say which it is: columns={{"f": ...}}'
            )
        for k in values:
            found[k] = found[k]._replace(quantity=self._quantity(self.names[k], found[k]), readings=())
        return found

    def _quantity(self, name: str, of: Meaning) -> str:
        """The quantity of a column of values."""
        if self.said.quantity is not None:
            return QUANTITIES.get(self.said.quantity, self.said.quantity)
        if of.quantity and not of.readings:
            if of.unit in ("1/sr", "%") and (of.unit == "%") != (of.quantity == "reflectance factor"):
                both = (("brdf", "f [1/sr]"), ("reflectance factor", "pi f"))
                raise self._two_readings(name, both, "quantity={key!r}")
            return of.quantity
        readings = of.readings or (("brdf", "f"), ("reflectance factor", "pi f"))
        fitting = [
            q for q, _ in readings if q in QUANTITIES.values() and (q == "reflectance factor") == (of.unit != "1/sr")
        ]
        if of.unit in ("1/sr", "%", "1") and len(fitting) == 1 and len(readings) == 2 and readings[1][0] != "dsf":
            return fitting[0]
        stated = _stated_quantities(self.layout.text)
        if len(stated) == 1 and not of.readings:
            ((quantity, line),) = stated.items()
            self.remarks.append(f"the quantity is that of the line {line[:60]!r}")
            return quantity
        readings = tuple((QUANTITIES.get(q, q), words) for q, words in readings)
        raise self._two_readings(name, readings, "quantity={key!r}")

    # Their numbers.

    def understood(self) -> Understood:
        wanted = [k for k, of in self.meanings.items() if of.key != IGNORE]
        angular = [k for k in wanted if self.meanings[k].key in (*ANGLES, WAVELENGTH)]
        found = numbers(self.sheet, self.layout, wanted, angular, self.said.decimal, self.said.marks)
        angles, columns, in_radians = self._angles(found)
        values = self._values(found, columns)
        for k, of in self.meanings.items():
            if of.key == IGNORE:
                columns[k] = Column(self.names[k], "left out", "")
        listed = [Column("", f"{key}: {_short(key)}, of all rows" if key in ANGLES else "wavelength of all rows", "nm" if key == WAVELENGTH else "deg", (f"{x:g}",), x, x) for key, x in self.constants.items()]  # fmt: skip
        columns_ = [columns[k] for k in sorted(columns)] + listed
        return Understood(
            angles, values, in_radians, self.layout.notes, columns_, self.layout, found.lines, found.repeated, found.below,
            found.decimal, self.remarks,
        )  # fmt: skip

    def _angles(self, found: Numbers) -> tuple[dict[str, np.ndarray], dict[int, Column], bool]:
        """Angles by their name, all in one unit."""
        places = {of.key: k for k, of in self.meanings.items() if of.key in (*ANGLES, WAVELENGTH)}
        stated = (self.said.angle_unit or self.layout.notes.get("angle_unit", "")).lower()
        units = {
            key: self._angle_unit(self.meanings[k], self.names[k], stated) for key, k in places.items() if key in ANGLES
        }
        self._expect_degrees(found, {key: places[key] for key, unit in units.items() if not unit})
        radians = bool(units) and all(unit == "rad" for unit in units.values()) and not self.constants
        angles: dict[str, np.ndarray] = {}
        columns = {}
        for key, k in places.items():
            column = found.columns[k]
            if key == WAVELENGTH:
                angles[key], unit = self._nm(column, self.meanings[k])
                words = "wavelength"
            else:
                factor = 1.0 if radians else {"rad": math.degrees(1.0), "mrad": math.degrees(1e-3)}.get(units[key], 1.0)
                angles[key], unit = (
                    column * factor if factor != 1.0 else column,
                    units[key] or "deg, as no unit is stated",
                )
                words = f"{key}: {_short(key)}"
            columns[k] = _column(self.names[k], words, unit, column)
        rows = len(found.lines)
        for key, number in self.constants.items():
            angles[key] = np.full(rows, math.degrees(number) if stated.startswith("rad") and key in ANGLES else number)
        self._turn(angles, columns, places, math.pi if radians else 180.0)
        return angles, columns, radians

    def _angle_unit(self, of: Meaning, name: str, stated: str) -> str:
        short = {"deg": "deg", "rad": "rad"}.get(stated[:3], "")
        if stated and (not short or unit_of(stated) is None):
            raise FormatError(f"{self.path}: angle_unit: {stated}, expected deg or rad")
        unit = of.unit if of.unit in ("deg", "rad", "mrad") else ""
        if of.unit and not unit and of.unit != "1":
            raise FormatError(f"{self.path}: column {name!r}: an angle in {of.unit}, expected deg or rad")
        if self.said.angle_unit and unit and unit != short:
            raise ParameterError(f"angle_unit={stated!r}: the column {name!r} says {unit}; leave the option out")
        return unit or short

    def _expect_degrees(self, found: Numbers, unstated: dict[str, int]) -> None:
        """Raises FormatError where angles without a unit look like radians."""
        columns = [(key, found.columns[k]) for key, k in unstated.items()]
        if not columns or not all(len(c) for _, c in columns):
            return
        polar = [c for key, c in columns if ANGLES[key].highest is not None]
        turns = [c for key, c in columns if ANGLES[key].highest is None]
        small = all(np.abs(c).max() <= 0.5 * math.pi + 1e-3 for c in polar) and all(
            np.abs(c).max() <= 2.0 * math.pi + 1e-3 for c in turns
        )
        broken = any((c != np.round(c)).any() for c in polar)
        if small and broken and max((len(np.unique(c)) for c in polar), default=0) > 2:
            key, k = next(iter(unstated.items()))
            c = found.columns[k]
            raise FormatError(
                f"{self.path}: angles up to {max(np.abs(c).max() for c in polar):.4g} (column {self.names[k]!r}: {c.min():g} to {c.max():g}), and "
                f"no unit is stated: radians, or degrees close to the normal? say angle_unit='rad' or angle_unit='deg'"
            )

    def _nm(self, column: np.ndarray, of: Meaning) -> tuple[np.ndarray, str]:
        unit = of.unit if of.unit in ("nm", "um") else self.said.wavelength_unit
        if unit is None and len(column) and np.nanmax(column) < 100.0:
            raise FormatError(
                f"{self.path}: wavelengths from {column.min():g} to {column.max():g}, and no unit is stated: micrometres? "
                f"say wavelength_unit='um' or wavelength_unit='nm'"
            )
        return (np.round(column * 1000.0, 6) if unit == "um" else column), unit or "nm, as no unit is stated"

    def _turn(
        self, angles: dict[str, np.ndarray], columns: dict[int, Column], places: dict[str, int], half: float
    ) -> None:
        """Count azimuths from the side of the light, where they are counted from the mirror direction."""
        forward = self.said.forward
        if {"theta_i", "theta_o"} == {key for key in angles if key != WAVELENGTH}:
            theta_i, theta_o = angles["theta_i"], angles["theta_o"]
            if (
                forward is None
                and len(theta_i)
                and min(theta_i.min(), theta_o.min()) >= 0.0
                and theta_i.max() > 0.0
                and theta_o.max() > 0.0
            ):
                raise FormatError(
                    f"{self.path}: no column of an azimuth and no negative angle: the viewer may be on the side of the light or on "
                    f"the mirror's side; say forward=180 (on the light's) or forward=0 (theta_o = theta_i is the mirror direction)"
                )
            if forward == 0:
                angles["theta_o"] = 0.0 - theta_o
                self._note(columns, places, "theta_o", "of one sign with theta_i in the mirror direction")
            return
        if forward != 0:
            return
        key = "phi" if "phi" in angles else "phi_o"
        if key not in angles:
            raise ParameterError("forward=0: expected a column phi or phi_o, or theta_i and theta_o alone")
        angles[key] = angles[key] + half
        self._note(columns, places, key, "0 in the mirror direction, half a turn is added")

    def _note(self, columns: dict[int, Column], places: dict[str, int], key: str, words: str) -> None:
        if key in places:
            old = columns[places[key]]
            columns[places[key]] = old._replace(meaning=f"{old.meaning}; {words}")

    def _values(self, found: Numbers, columns: dict[int, Column]) -> dict[tuple[str, bool, str], np.ndarray]:
        """Values and standard uncertainties by quantity and channel, in units of 1."""
        values: dict[tuple[str, bool, str], np.ndarray] = {}
        places = [k for k, of in self.meanings.items() if of.key == VALUE]
        for k in places:
            of, column = self.meanings[k], without_marks(self.path, self.layout, found, k, self.said.marks)
            values[of.quantity, False, of.channel] = column * 0.01 if of.unit == "%" else column
            words = f"values: {_in_words(of.quantity)}{f', channel {of.channel}' if of.channel else ''}"
            columns[k] = _column(self.names[k], words, _value_unit(of), column)
        if len(places) > 1 and any(not self.meanings[k].channel for k in places):
            raise FormatError(
                f"{self.path}, line {self.layout.header}: columns of values {', '.join(repr(self.names[k]) for k in places[:5])}: "
                f"expected one column or one per channel, as in 'BRDF 550 nm'; columns={{\"ignore\": [...]}} leaves out others"
            )
        for k, of in self.meanings.items():
            if of.key != UNCERTAINTY:
                continue
            left = self._value_of(k, of, places)
            value = self.meanings[left]
            column = without_marks(self.path, self.layout, found, k, self.said.marks)
            u, words, unit = self._standard(k, column, values[value.quantity, False, value.channel], value)
            if (value.quantity, True, value.channel) in values:
                raise FormatError(
                    f"{self.path}, line {self.layout.header}: column {self.names[k]!r} is a second uncertainty of "
                    f'{self.names[left]!r}; expected one; leave out the other: columns={{"ignore": {self.names[k]!r}}}'
                )
            values[value.quantity, True, value.channel] = u
            columns[k] = _column(
                self.names[k], f"{words} of {self.names[left]!r}" if len(places) > 1 else words, unit, column
            )
        return values

    def _value_of(self, k: int, of: Meaning, places: list[int]) -> int:
        """The column of values that an uncertainty belongs to: of its channel, else the next on its left."""
        same = [p for p in places if self.meanings[p].channel == of.channel]
        if same:
            return same[0]
        if of.channel or not any(p < k for p in places):
            got = f"the channel {of.channel!r}" if of.channel else "no channel"
            raise FormatError(
                f"{self.path}: the uncertainty {self.names[k]!r} has {got}, none of the values: uncertainties of none or of all are expected"
            )
        return max(p for p in places if p < k)

    def _standard(self, k: int, column: np.ndarray, values: np.ndarray, value: Meaning) -> tuple[np.ndarray, str, str]:
        """The standard uncertainty, in the unit of the values, with words for the column and its unit."""
        of, name = self.meanings[k], self.names[k]
        factor = self._coverage(name, of)
        words = (
            "standard uncertainty" if factor == 1.0 else f"expanded uncertainty, k = {factor:g}: divided by {factor:g}"
        )
        relative = {"relative": True, "absolute": False}.get(self.said.uncertainty or "", of.relative)
        if relative is None and of.unit == "%":
            if value.unit == "%":
                both = (("relative", "percent of the value"), ("absolute", "percent, as the values"))
                raise self._two_readings(name, both, "uncertainty={key!r}")
            relative = True
        u = column * 0.01 if of.unit == "%" else column
        if relative:
            return np.abs(values) * u / factor, f"relative {words}", "%" if of.unit == "%" else "1"
        scale = 0.01 if value.unit == "%" and of.unit != "%" else 1.0
        return u * scale / factor if factor != 1.0 or scale != 1.0 else u, words, of.unit or _value_unit(value)

    def _coverage(self, name: str, of: Meaning) -> float:
        """The coverage factor k of a column."""
        said, stated = self.said.coverage, _stated_coverage(self.layout.text)
        if of.coverage and of.coverage != 1.0:
            if said is not None and said != of.coverage:
                raise ParameterError(
                    f"coverage={said:g}: the column {name!r} says k = {of.coverage:g}; leave the option out"
                )
            return of.coverage
        if said is not None:
            return said
        if of.coverage == 1.0:
            return 1.0
        if stated is not None:
            self.remarks.append(f"the coverage factor is that of the line {stated[1][:60]!r}")
            return stated[0]
        raise FormatError(
            f"{self.path}, line {self.layout.header}: column {name!r}: a standard uncertainty, or an expanded one, and by which "
            f"factor k? say coverage=1 for a standard uncertainty, coverage=2 for U (k = 2)"
        )


def _short(angle: str) -> str:
    return ANGLES[angle].meaning.replace("direction to the ", "")


def _opposite(key: str) -> str:
    return {"theta_i": "theta_o", "theta_o": "theta_i", "phi_i": "phi_o", "phi_o": "phi_i"}[key]


def _unit_in(name: str) -> str:
    return next((unit for word in re.findall(r"[\[(]([^\[\]()]+)[\])]", name) if (unit := unit_of(word))), "")


def _in_words(quantity: str) -> str:
    return {
        "brdf": "BRDF f",
        "brdf * cos(theta_o)": "DSF, f cos(theta_o)",
        "brdf * cos(theta_i)": "f cos(theta_i)",
        "reflectance factor": "reflectance factor, pi f",
    }[quantity]


def _value_unit(of: Meaning) -> str:
    return of.unit or ("1" if of.quantity == "reflectance factor" else "1/sr")


def _column(name: str, words: str, unit: str, column: np.ndarray) -> Column:
    finite = column[np.isfinite(column)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (math.nan, math.nan)
    first = tuple("missing" if math.isnan(x) else f"{x:.6g}" for x in column[:3])
    return Column(name, words, unit, first, low, high, int(np.isnan(column).sum()))


_QUANTITY_WORDS = {
    "brdf": re.compile(r"\bB[RS]DF\b", re.IGNORECASE),
    "reflectance factor": re.compile(r"\bBRF\b|reflectance factor", re.IGNORECASE),
    "brdf * cos(theta_o)": re.compile(r"\bDSF\b|cosine[- ]corrected", re.IGNORECASE),
}
_COVERAGE_WORDS = re.compile(
    r"\bk\s*=\s*([0-9]+(?:[.,][0-9]+)?)|coverage factor\W*(?:k\W*)?([0-9]+(?:[.,][0-9]+)?)", re.IGNORECASE
)


def _stated_quantities(text: Sequence[str]) -> dict[str, str]:
    """Quantities that the lines above a table name, with the line."""
    found: dict[str, str] = {}
    for line in text:
        for quantity, words in _QUANTITY_WORDS.items():
            if words.search(line):
                found.setdefault(quantity, line)
    return found


def _stated_coverage(text: Sequence[str]) -> tuple[float, str] | None:
    """The only coverage factor that the lines above a table name, with the line."""
    found = {float((m[1] or m[2]).replace(",", ".")): line for line in text if (m := _COVERAGE_WORDS.search(line))}
    return next(iter(found.items())) if len(found) == 1 else None


_INCIDENCE = re.compile(
    r"(?:angle of incidence|incidence angle|incident angle|incidence|AOI|theta_?i\w*)\D{0,14}?([-+]?[0-9]+(?:[.,][0-9]+)?)",
    re.IGNORECASE,
)


def stated_incidence(text: Sequence[str]) -> str:
    """What to say where no column has theta_i: the option, with the angle of a line above the table."""
    for line in text:
        if match := _INCIDENCE.search(line):
            number = match[1].replace(",", ".")
            return f'; the line {line[:50]!r} states it: columns={{"theta_i": {number}}} (-O columns.theta_i={number})'
    return ""
