"""What each column of a laboratory's table means: by its name, by the other columns, and by what its reader says."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ...errors import FormatError, ParameterError
from ...tables.angle_systems import ANGLES
from .._reading import plain_text
from .layout import LONGEST_LINE, find
from .names import IGNORE, QUANTITIES, UNCERTAINTY, VALUE, WAVELENGTH, Meaning, meaning, unit_in
from .sheets import NAMED, CellSheet, TextSheet


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

    def columns_said(self) -> Iterator[tuple[str, Any]]:
        """Meanings and names of columns, in pairs."""
        if isinstance(self.columns, Mapping):
            for key, names in self.columns.items():
                for name in names if isinstance(names, (list, tuple)) else (names,):
                    yield key, name


class Meanings:
    """The columns of a table.

    layout     where they are
    of         number of the column -> what it means, with its unit and quantity
    constants  angles that no column has
    remarks    what was taken from the text above the table

    Raises FormatError where a name is unknown or has two readings, with the option that decides it, and ParameterError
    for columns that are not there.
    """

    def __init__(self, sheet: TextSheet | CellSheet, said: Said):
        self.path, self.said = sheet.path, said
        self.layout = find(sheet, said.columns, said.skip, NAMED.get(said.delimiter or "", said.delimiter))
        self.names = self.layout.names
        self.remarks: list[str] = []
        self.constants: dict[str, float] = {}
        self.of = self._by_name()
        self._decide_red()
        self._decide_angles()
        self._leave_out_unknown()
        self._add_units()
        self._expect_each_once()
        self._add_quantities()

    def fault(self, text: str) -> FormatError:
        """The error for the line of column names."""
        return FormatError(f"{self.path}, line {self.layout.header}: {text}")

    def two_readings(self, name: str, readings: Sequence[tuple[str, str]], cure: str) -> FormatError:
        """The error for an ambiguous column; `cure` has places for the `key` of a reading and the `name`."""
        said = " or ".join(f"{key} ({words})" for key, words in readings)
        cures = " or ".join(cure.format(key=key, name=name) for key, _ in readings)
        return self.fault(f"column {name!r:.60} can be {said}; say {cures}")

    def _by_name(self) -> dict[int, Meaning]:
        if self.said.columns is not None and not isinstance(self.said.columns, Mapping):
            return {k: self._told(str(key), "") for k, key in enumerate(self.said.columns) if str(key).strip()}
        told: dict[int, Meaning] = {}
        for key, name in self.said.columns_said():
            if key == IGNORE and name == "*":
                continue
            k = self._place(name)
            if k is None:
                self._note_constant(key, name)
            elif k in told:
                raise ParameterError(f"columns: {self.names[k]!r:.60} twice, expected one meaning for each column")
            else:
                told[k] = self._told(key, self.names[k])
        return {k: told.get(k) or meaning(name) for k, name in enumerate(self.names) if name}

    def _place(self, name: Any) -> int | None:
        """The column of a name; None for a number that is no column's name."""
        word = str(name).strip()
        places = [k for k, n in enumerate(self.names) if n == word]
        places = places or [k for k, n in enumerate(self.names) if n.lower() == word.lower()]
        if len(places) == 1:
            return places[0]
        if not places and plain_text.is_number(word):
            return None
        fault = f"{len(places)} columns have this name" if places else "there is no such column"
        at = f"line {self.layout.header} names {self._listed()}"
        raise ParameterError(f"columns: {name!r:.60}: {fault} in {self.path}; {at}")

    def _listed(self) -> str:
        return ", ".join([f"{name!r:.40}" for name in self.names[:20]]) + (" ..." if len(self.names) > 20 else "")

    def _note_constant(self, key: str, number: Any) -> None:
        if key not in ANGLES and key != WAVELENGTH:
            raise ParameterError(
                f"columns: {key}={number}: expected the name of a column; numbers stand for angles only"
            )
        self.constants[key] = float(number)

    def _told(self, key: str, name: str) -> Meaning:
        """The meaning that is said, with the unit and the coverage factor of the column's own name."""
        said, own = meaning(key), meaning(name) if name else Meaning()
        unit = own.unit or unit_in(name)
        if key in ANGLES or key in (WAVELENGTH, IGNORE):
            return Meaning(key, unit=unit)
        if said.key == UNCERTAINTY:
            coverage = said.coverage if own.key != UNCERTAINTY or own.coverage is None else own.coverage
            return said._replace(unit=unit, coverage=coverage, relative=own.relative)
        if said.key == VALUE and (said.quantity or said.channel) and not said.readings:
            return said._replace(unit=unit)
        values = f"{', '.join(QUANTITIES)}, each of these as f_R or f_550nm too, u_f"
        raise ParameterError(
            f"columns: {key!r:.60}: expected one of {', '.join(ANGLES)}, {WAVELENGTH}, {values}, {IGNORE}"
        )

    def _decide_red(self) -> None:
        """ "R" beside "G" and "B" is a channel, and so is "f_r" beside "f_g"."""
        channels = {of.channel for of in self.of.values() if of.key == VALUE}
        for k, of in self.of.items():
            if of.key in (VALUE, UNCERTAINTY) and "G" in channels and self.names[k].lower().split()[-1:] == ["r"]:
                self.of[k] = of._replace(readings=(), channel="R")
            if self.names[k] == "f_r" and channels & {"g", "G"}:
                self.of[k] = of._replace(channel="r" if "g" in channels else "R")

    def _decide_angles(self) -> None:
        """Names such as theta_s, by the other angles; and azimuths of one side alone."""
        sure = {of.key for of in self.of.values() if of.key in ANGLES} | {*self.constants}
        for k, of in self.of.items():
            if of.key != "angle":
                continue
            keys = [key for key, _ in of.readings]
            left = [key for key in keys if key not in sure and _OPPOSITE.get(key) in sure]
            if keys == ["theta_o", "radial"]:
                left = []
            elif keys == ["phi_i", "phi_o"] and not left and "theta_i" in sure:
                left = ["phi_o"]
                self._expect_forward(self.names[k])
            if len(left) != 1:
                raise self.two_readings(self.names[k], of.readings, "columns={{{key!r:.60}: {name!r:.60}}}")
            self.of[k] = of._replace(key=left[0], readings=())
        azimuths = {of.key for of in self.of.values()} | {*self.constants}
        for k, of in self.of.items():
            if (of.key == "phi_o" and "phi_i" not in azimuths) or (of.key == "azimuth" and "radial" not in azimuths):
                self.of[k] = of._replace(key="phi")

    def _expect_forward(self, name: str) -> None:
        if self.said.forward is None:
            raise self.fault(
                f"column {name!r:.60} has two readings: 0 is the mirror direction, or the side of the light; say "
                f"forward=0 or forward=180, its value in the mirror direction"
            )

    def _leave_out_unknown(self) -> None:
        every = (IGNORE, "*") in [*self.said.columns_said()]
        for k, of in self.of.items():
            if not of.key and not every:
                name = self.names[k]
                raise self.fault(
                    f'column {name!r:.60} is not known; say what it is, or leave it out: columns={{"theta_o": '
                    f"{name!r:.60}}} or "
                    f'columns={{"ignore": {name!r:.60}}} (-O columns.ignore={name!r:.60}); "*" leaves out every '
                    f"unknown one"
                )
            if not of.key:
                self.of[k] = Meaning(IGNORE)

    def _add_units(self) -> None:
        """Units of the line below the names, and of `value_unit`."""
        for k, of in self.of.items():
            below = self.layout.units[k]
            if below and of.unit not in ("", below) and of.key != IGNORE:
                raise self.fault(f"column {self.names[k]!r:.60}: {of.unit} in the name, and {below} in the line below")
            unit = of.unit or below or (self.said.value_unit or "" if of.key == VALUE else "")
            self.of[k] = of._replace(unit=unit)

    def _expect_each_once(self) -> None:
        seen: dict[Any, int] = {}
        for k, of in self.of.items():
            if of.key in (IGNORE, UNCERTAINTY) or (of.key == VALUE and not of.channel and not of.quantity):
                continue
            same = (of.key, of.channel, of.quantity)
            if same in seen or of.key in self.constants:
                other = f"column {self.names[seen[same]]!r:.60}" if same in seen else "columns="
                raise self.fault(
                    f"column {self.names[k]:.60} twice: {other} is {of.key} too, expected each once; "
                    f'columns={{"ignore": {self.names[k]!r:.60}}} leaves it out'
                )
            seen[same] = k

    def _add_quantities(self) -> None:
        values = [k for k, of in self.of.items() if of.key == VALUE]
        if not values:
            raise self.fault(
                f"no column of values among {self._listed()}; expected f, BRDF, DSF or BRF; say which it is: "
                f'columns={{"f": ...}}'
            )
        for k in values:
            self.of[k] = self.of[k]._replace(quantity=self._quantity(self.names[k], self.of[k]), readings=())
        if len(values) > 1 and not all(self.of[k].channel for k in values):
            raise self.fault(
                f"columns of values {', '.join(f'{self.names[k]!r:.40}' for k in values[:5])}: expected one column "
                f"or one per channel, as in 'BRDF 550 nm'; columns={{\"ignore\": [...]}} leaves out others"
            )

    def _quantity(self, name: str, of: Meaning) -> str:
        """The quantity of a column of values: as said, as named, by its unit, or by the text above."""
        if self.said.quantity is not None:
            return QUANTITIES.get(self.said.quantity, self.said.quantity)
        if of.quantity and not of.readings:
            if of.unit in ("1/sr", "%") and (of.unit == "%") != (of.quantity == "reflectance factor"):
                raise self.two_readings(name, _EITHER, "quantity={key!r:.60}")
            return of.quantity
        readings = of.readings or _EITHER
        of_unit = {"1/sr": "brdf", "%": "reflectance factor", "1": "reflectance factor"}.get(of.unit)
        if of_unit in [key for key, _ in readings] and "reflectance factor" in [key for key, _ in readings]:
            return str(of_unit)
        stated = self.stated_quantities() if not of.readings else {}
        if len(stated) == 1:
            ((quantity, line),) = stated.items()
            self.remarks.append(f"the quantity is that of the line {line[:60]!r}")
            return quantity
        raise self.two_readings(name, readings, "quantity={key!r:.60}")

    # What the lines above the table say.

    def stated_quantities(self) -> dict[str, str]:
        """Quantities that the lines above the table name, with the line."""
        found: dict[str, str] = {}
        for line in _short(self.layout.text):
            for quantity, words in _QUANTITY_WORDS.items():
                if words.search(line):
                    found.setdefault(quantity, line)
        return found

    def stated_coverage(self) -> float | None:
        """The only coverage factor that the lines above the table name."""
        found = {
            _decimal(m[1] or m[2]): line for line in _short(self.layout.text) if (m := _COVERAGE_WORDS.search(line))
        }
        if len(found) != 1:
            return None
        ((k, line),) = found.items()
        self.remarks.append(f"the coverage factor is that of the line {line[:60]!r}")
        return k


def stated_incidence(text: Sequence[str]) -> str:
    """What to say where no column has theta_i: the option, with the angle of a line above the table."""
    for line in _short(text):
        if match := _INCIDENCE_WORDS.search(line):
            number = f"{_decimal(match[1]):g}"
            return f'; the line {line[:50]!r} states it: columns={{"theta_i": {number}}} (-O columns.theta_i={number})'
    return ""


def _short(text: Sequence[str]) -> list[str]:
    return [line for line in text if len(line) <= LONGEST_LINE]


def _decimal(number: str) -> float:
    return float(number.replace(",", "."))


_OPPOSITE = {"theta_i": "theta_o", "theta_o": "theta_i", "phi_i": "phi_o", "phi_o": "phi_i"}
_EITHER = (("brdf", "f"), ("reflectance factor", "pi f"))
_NUMBER = r"([-+]?[0-9]+(?:[.,][0-9]+)?)"
_QUANTITY_WORDS = {
    "brdf": re.compile(r"\bB[RS]DF\b", re.IGNORECASE),
    "reflectance factor": re.compile(r"\bBRF\b|reflectance factor", re.IGNORECASE),
    "brdf * cos(theta_o)": re.compile(r"\bDSF\b|cosine[- ]corrected", re.IGNORECASE),
}
_COVERAGE_WORDS = re.compile(rf"\bk\s*=\s*{_NUMBER}|coverage factor\W*(?:k\W*)?{_NUMBER}", re.IGNORECASE)
_INCIDENCE_WORDS = re.compile(
    rf"(?:angle of incidence|incidence angle|incident angle|incidence|AOI|theta_?i\w*)\D{{0,14}}?{_NUMBER}",
    re.IGNORECASE,
)
