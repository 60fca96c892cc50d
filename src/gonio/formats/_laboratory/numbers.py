"""Numbers from the cells of a table: decimal commas, missing values, lines that are no rows."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...base.quantities import mark_of_missing
from ...errors import FormatError
from ...files.cells import MISSING, decimal_sign, is_numeric
from .._reading import plain_text
from .layout import TableLayout, is_data, trimmed
from .names import unit_of
from .sheets import COLUMNS, CellSheet, Row, TextSheet

MARKS = (-99.0, -999.0, -9999.0, -99999.0)
"""Numbers that programs write where there is no value."""


class NumberColumns(NamedTuple):
    """The columns of a table as numbers, NaN where a value is missing.

    columns   number of the column -> (rows,)
    lines     number of the line of each row, (rows,)
    repeated  lines that repeat the column names, and `below`, the text below the table
    decimal   the decimal sign
    """

    columns: dict[int, np.ndarray]
    lines: np.ndarray
    repeated: list[int]
    below: list[str]
    decimal: str


def numbers(
    sheet: TextSheet | CellSheet,
    layout: TableLayout,
    wanted: Collection[int],
    needed: Collection[int],
    decimal: str | None,
    missing: Sequence[str] = (),
) -> NumberColumns:
    """The columns `wanted`; those that are `needed` must have a number in every row.

    Raises FormatError, with the line and the column, for a cell that is no number.
    """
    if len(layout.names) > COLUMNS:
        raise FormatError(
            f"{sheet.path}: {len(layout.names)} columns, expected at most {COLUMNS}; split the table by channels"
        )
    return _NumberReader(sheet, layout, {k: k in needed for k in sorted(wanted)}, decimal, missing).read()


class _NumberReader:
    """`columns`: number of a column -> whether it must have a number in every row."""

    def __init__(
        self,
        sheet: TextSheet | CellSheet,
        layout: TableLayout,
        columns: Mapping[int, bool],
        decimal: str | None,
        missing: Sequence[str],
    ):
        self.sheet, self.layout = sheet, layout
        self.wanted, self.needed = [*columns], {k for k, needed in columns.items() if needed}
        first = [row[k] for row in layout.sample if len(row) >= len(layout.names) for k in self.wanted]
        self.decimal = decimal or decimal_sign(sheet.path, first)
        self.other = {",": ".", ".": ","}[decimal] if decimal else ""
        grouped = rf"[-+]?\d{{1,3}}(?:[{self.other or ' '}]\d{{3}})+(?:[{self.decimal}]\d*)?"
        self.grouped = re.compile(grouped, re.ASCII)
        self.missing = MISSING | {word.strip().lower() for word in missing}
        self.delimiter = " " if layout.delimiter == "  " else layout.delimiter
        self.repeated: list[int] = []
        self.below: list[str] = []

    def read(self) -> NumberColumns:
        """All rows."""
        parts: dict[int, list[np.ndarray]] = {k: [] for k in self.wanted}
        lines = []
        for kept, columns in self._pieces():
            lines.append(np.array(kept, dtype=np.int64))
            for k, column in columns.items():
                parts[k].append(column)
            if self.below:
                break
        columns = {k: np.concatenate(part) if part else np.empty(0) for k, part in parts.items()}
        return NumberColumns(columns, np.concatenate(lines), self.repeated, self.below, self.decimal)

    def _pieces(self) -> Iterator[tuple[Sequence[int], dict[int, np.ndarray]]]:
        start = self.layout.first - 1
        if isinstance(self.sheet, CellSheet):
            for rows in self.sheet.rows(self.delimiter, start):
                yield self._of_rows(rows)
            return
        for number, lines in self.sheet.lines(start):
            yield self._plain(lines, number) or self._of_rows(self.sheet.split(lines, number, self.delimiter))

    def _of_rows(self, piece: list[Row]) -> tuple[Sequence[int], dict[int, np.ndarray]]:
        rows = [row for row in piece if any(row[1]) and not row[1][0].startswith("#")]
        return self._fast(rows) or self._one_by_one(rows)

    def _plain(self, lines: list[str], number: int) -> tuple[Sequence[int], dict[int, np.ndarray]] | None:
        """All lines at once, without rows of cells; None unless each has so many numbers and nothing else."""
        count, delimiter = len(self.layout.names), self.delimiter
        lines = lines if lines[-1] else lines[:-1]  # after the last line
        text = delimiter.join(lines)
        if delimiter in (" ", self.decimal) or any(mark in text for mark in '"#'):
            return None
        if not lines or any(line.count(delimiter) != count - 1 for line in lines):
            return None
        cells = text.split(delimiter)
        columns = self._floats({k: cells[k::count] for k in self.wanted})
        return None if columns is None else (range(number, number + len(lines)), columns)

    def _fast(self, rows: list[Row]) -> tuple[list[int], dict[int, np.ndarray]] | None:
        """All rows at once; None if one of them is not plain numbers."""
        count = len(self.layout.names)
        if not rows or any(len(row) != count for _, row in rows):
            return None
        table = [*zip(*(row for _, row in rows), strict=True)]
        columns = self._floats({k: table[k] for k in self.wanted})
        return None if columns is None else ([number for number, _ in rows], columns)

    def _floats(self, cells: Mapping[int, Sequence[str]]) -> dict[int, np.ndarray] | None:
        """Cells by column as numbers; None if one of them is not plain."""
        columns = {}
        for k, column in cells.items():
            text = "\n".join(column)
            if not text.isascii() or "_" in text or (self.decimal == "," and "." in text):
                return None
            if self.decimal == ",":
                text = text.replace(",", ".")
            try:
                columns[k] = np.array([*map(float, text.split("\n"))])
            except ValueError:
                return None
            if k in self.needed and np.isnan(columns[k]).any():
                return None
        return columns

    def _one_by_one(self, rows: list[Row]) -> tuple[list[int], dict[int, np.ndarray]]:
        kept: list[int] = []
        columns: dict[int, list[float]] = {k: [] for k in self.wanted}
        for at, (number, row) in enumerate(rows):
            cells = row if len(row) == len(self.layout.names) else self._of_length(number, row)
            if cells is None or self._is_text(row):
                if self._names_again(row):
                    self.repeated.append(number)
                    continue
                if self._ends(number):
                    self.below = [" ".join(r).strip() for _, r in rows[at:]]
                    break
                if cells is None:
                    raise self._misfit(number, row)
            for k in self.wanted:
                columns[k].append(self._number(cells[k], number, k))
            kept.append(number)
        return kept, {k: np.array(column, dtype=np.float64) for k, column in columns.items()}

    def _of_length(self, number: int, row: list[str]) -> list[str] | None:
        """The cells, one for each name; None if there are too many or too few."""
        count, kept = len(self.layout.names), trimmed(row)
        if len(kept) > count or (len(row) < count and isinstance(self.sheet, TextSheet)):
            return None
        return kept + [""] * (count - len(kept))

    def _is_text(self, row: list[str]) -> bool:
        first = row[self.wanted[0]] if self.wanted[0] < len(row) else row[0]
        return not is_numeric(first) and not plain_text.is_number(first)

    def _names_again(self, row: list[str]) -> bool:
        units = [unit_of(cell) or "" for cell in row[: len(self.layout.units)]]
        return trimmed(row) == self.layout.names or (any(units) and units == self.layout.units)

    def _ends(self, number: int) -> bool:
        """Whether all lines from this one on are text."""
        for piece in self.sheet.rows(self.delimiter, number - 1):
            for _, row in piece:
                if any(row) and (is_data(row) or is_numeric(row[0])):
                    return False
        return True

    def _misfit(self, number: int, row: list[str]) -> FormatError:
        names, count = self.layout.names, len(row)
        cure = f"line {self.layout.header} has the names {', '.join([f'{name!r:.40}' for name in names[:6]])}"
        if self.delimiter == "," and count > len(names):
            cure += "; decimal commas between commas cannot be told apart: export with semicolons or points"
        elif self._is_text(row):
            cure += "; several tables in one file? split it; skip=N passes over the first N lines"
        return FormatError(
            f"{self.sheet.path}, line {number}: got {' | '.join(row)[:60]!r}, expected {len(names)} numbers, not "
            f"{count}: {cure}"
        )

    def _number(self, cell: str, number: int, k: int) -> float:
        word = cell.strip()
        if word.lower() in self.missing:
            if k not in self.needed:
                return float("nan")
            raise FormatError(
                f"{self.sheet.path}, line {number}, column {self.layout.names[k]!r:.60}: an angle is no number: got "
                f"{word!r}, expected one in every row; remove the line"
            )
        plain = word.replace(self.other, "") if self.other and self.grouped.fullmatch(word) else word
        swapped = plain.replace(",", ".") if self.decimal == "," and "." not in plain else plain
        if plain_text.is_number(swapped) and (self.decimal == "." or "." not in plain):
            return float(swapped)
        raise FormatError(
            f"{self.sheet.path}, line {number}: got {word[:60]!r} in the column {self.layout.names[k]!r:.60}, "
            f"expected a number{_cure(word, self.decimal)}"
        )


def _cure(word: str, decimal: str) -> str:
    if word.endswith(("°", "%")):
        return ": the unit stands in the column name, 'theta_i (deg)'"
    if is_numeric(word):
        return f" with the decimal sign {decimal!r}; say decimal=',' or decimal='.'"
    return f"; if it stands for a missing value say missing={word[:20]!r}"


def without_marks(
    path: object,
    layout: TableLayout,
    columns: NumberColumns,
    k: int,
    missing: Sequence[str],
    places: Callable[[], np.ndarray],
) -> np.ndarray:
    """A column with NaN for the numbers among `missing`.

    Raises FormatError where it holds another number that programs write for a missing value, or, if nothing is said of
    any, one that repeats and stands decades apart. `places`: those of the rows, see `mark_of_missing`.
    """
    column = columns.columns[k]
    stated = [float(word) for word in missing if plain_text.is_number(word)]
    if stated:
        column = np.where(np.isin(column, stated), np.nan, column)
    apart = None if missing else mark_of_missing(column, places)
    for mark in MARKS if apart is None else (*MARKS, apart):
        at = np.flatnonzero(column == mark)
        if len(at):
            or_not = "" if mark in MARKS else ", decades apart from all others"
            cure = f"say missing={mark:g}" + ("" if mark in MARKS else ", or missing='' if it was measured")
            raise FormatError(
                f"{path}, line {columns.lines[at[0]]}: {mark:g} in the column {layout.names[k]!r:.60}, in {len(at)} "
                f"rows{or_not}: is it the mark of a missing value? {cure}"
            )
    return column
