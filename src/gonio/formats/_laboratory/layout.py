"""Where the table is in a laboratory's export: below lines about the instrument, with names, units, then numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ...errors import FormatError
from ...files.cells import DELIMITERS, is_numeric
from ...tables.angle_systems import ANGLES
from .._reading import plain_text
from .names import IGNORE, WAVELENGTH, Meaning, meaning, unit_of
from .sheets import CellSheet, Row, TextSheet

HEAD = 400
"""Rows among which the line of column names is sought."""

BELOW = 12
"""Rows below the names among which the first of numbers stands."""

LONGEST_LINE = 500
"""Characters of a line of text that may say something."""

NOTE = re.compile(r"#\s*(\w[^:]*):\s*(.*)")
_RULE = re.compile(r"[-=_+|:\s]*")


class TableLayout(NamedTuple):
    """The place of a table.

    names, units   of its columns; units from a line of their own, "" where there is none
    header, first  numbers of the line of names (0: none is used) and of the first line of numbers
    text           the lines above, and `notes`, those among them that are "# key: value"
    sample         the first rows of numbers
    """

    delimiter: str
    names: list[str]
    units: list[str]
    header: int
    first: int
    text: list[str]
    notes: dict[str, str]
    sample: list[list[str]]


def find(
    sheet: TextSheet | CellSheet,
    columns: Mapping[str, Any] | Sequence[str] | None = None,
    skip: int | None = None,
    delimiter: str | None = None,
) -> TableLayout:
    """The table of a sheet: the first line of known names, or of `columns`, above numbers; with `skip` the line behind
    so many. Raises FormatError, which says what is there instead."""
    count = HEAD + (skip or 0)
    chosen = [d for d in sheet.delimiters if sheet.has(d, count)] if delimiter is None else [delimiter]
    tried = [(d, sheet.head(d, count)) for d in chosen]
    listed = None if columns is None or isinstance(columns, Mapping) else list(columns)
    wanted = {str(name).strip().lower() for name in _flat(columns.values())} if isinstance(columns, Mapping) else set()
    best: tuple[int, TableLayout] | None = None
    for d, rows in tried:
        for score, at in _candidates(rows, d, wanted, listed, skip):
            layout = _below(rows, at, d, listed)
            if layout is not None:
                if best is None or score > best[0]:
                    best = (score, layout)
                break
    if best is None:
        raise _refusal(sheet, tried, listed, skip)
    return best[1]


def _flat(values: Any) -> Iterator[Any]:
    for value in values:
        yield from value if isinstance(value, (list, tuple)) else (value,)


def _candidates(
    rows: list[Row], delimiter: str, wanted: set[str], listed: list[str] | None, skip: int | None
) -> Iterator[tuple[int, int]]:
    """Rows that may be the names, by place, with the number of names that are known."""
    if listed is not None:
        for at, (number, row) in enumerate(rows):
            if number > (skip or 0) and is_data(row) and len(trimmed(row)) == len(listed):
                yield len(listed), at
                return
        return
    for at in range(len(rows)) if skip is not None else _above_numbers(rows, delimiter):
        number, row = rows[at]
        if skip is not None and number <= skip:
            continue
        row = _uncommented(row, rows[at])
        if skip is None and len(row) < 2:
            continue
        known, angle, value = 0, bool(wanted), False
        for cell, count in Counter(row).items():  # of a line of separators alone all cells are the same
            of = meaning(cell) if cell else Meaning()
            named = cell.lower() in wanted
            known += count * (named or of.key not in ("", IGNORE))
            angle = angle or named or of.key in (*ANGLES, "angle")
            value = value or named or (bool(of.key) and of.key not in (*ANGLES, WAVELENGTH, "angle", IGNORE))
        if skip is not None:
            if any(row):
                yield known * 1000 + len(row), at
                return
        elif known >= 2 and angle and value:
            yield known, at


def _above_numbers(rows: list[Row], delimiter: str) -> list[int]:
    """Places of rows with numbers close below: of other rows it takes long to find out what their words mean."""
    found, first = [], len(rows) + BELOW
    for at in range(len(rows) - 1, -1, -1):
        if first - at <= BELOW:
            found.append(at)
        if is_data(_split_again(rows[at][1], delimiter)):
            first = at
    return found[::-1]


def _uncommented(row: list[str], numbered: Row) -> list[str]:
    """The cells of a line of names that was made a comment, as NumPy does it."""
    if len(row) == 1 and row[0].lstrip().startswith("#") and not NOTE.fullmatch(row[0].strip()):
        line = row[0].lstrip().lstrip("#").strip()
        for d in DELIMITERS:
            parts = line.split(d) if d != "  " else re.split(r"\s{2,}", line)
            if len(parts) > 1:
                return [part.strip().strip('"') for part in (line.split() if d == " " else parts)]
    return row


def _below(rows: list[Row], at: int, delimiter: str, listed: list[str] | None) -> TableLayout | None:
    """The layout if there are numbers below the row of names at this place."""
    header, row = rows[at]
    names = trimmed(_uncommented(row, rows[at])) if listed is None else listed
    units = [""] * len(names)
    start = at if listed is not None else at + 1
    k = start
    while k < len(rows) and k < start + BELOW:
        cells = rows[k][1]
        if is_data(_split_again(cells, delimiter)):
            break
        if not any(cells) or cells[0].lstrip().startswith("#") or all(_RULE.fullmatch(c) for c in cells):
            k += 1
            continue
        said = [unit_of(cell.strip("[](){}")) for cell in cells[: len(names)]]
        if k > start + 3 or not all(unit is not None or not cell for unit, cell in zip(said, cells, strict=False)):
            return None
        units = [unit or "" for unit in said] + [""] * (len(names) - len(said))
        k += 1
    else:
        return None
    sample = [_split_again(row, delimiter) for _, row in rows[k:] if any(row) and not row[0].startswith("#")]
    notes, text = {}, []
    for _, above in rows[:at]:
        line = (" " if delimiter.isspace() else f"{delimiter} ").join(above).strip(f"{delimiter} ")
        if match := NOTE.fullmatch(line):
            notes[match[1].strip()] = match[2]
        elif line.strip("#"):
            text.append(line)
    if listed is not None:
        header = 0
    return TableLayout(delimiter, names, units, header, rows[k][0], text, notes, sample)


def _split_again(row: list[str], delimiter: str) -> list[str]:
    """Cells of numbers below names that stand two blanks apart: any blank is between numbers."""
    return " ".join(row).split() if delimiter == "  " else row


def trimmed(row: list[str]) -> list[str]:
    """Without empty cells at the end, which delimiters at the ends of lines make."""
    last = next((k for k in range(len(row), 0, -1) if row[k - 1]), 0)
    return row[:last]


def is_data(row: list[str]) -> bool:
    filled = [cell for cell in row if cell]
    if len(filled) < 2:
        return False
    numbers = sum(1 for cell in filled if is_numeric(cell) or plain_text.is_number(cell))
    return numbers >= 2 and 2 * numbers >= len(filled)


def _refusal(
    sheet: TextSheet | CellSheet, tried: list[tuple[str, list[Row]]], listed: list[str] | None, skip: int | None
) -> FormatError:
    """Why there is no table, from the first row of numbers with the most cells."""
    path = sheet.path
    firsts = [
        (sum(1 for cell in rows[at][1] if cell), -order, rows, at)
        for order, (_, rows) in enumerate(tried)
        for at in [next((k for k, (n, row) in enumerate(rows) if n > (skip or 0) and is_data(row)), None)]
        if at is not None
    ]
    if not firsts:
        more = f" behind the first {skip}" if skip else ""
        return FormatError(
            f"{path}: none of the first {HEAD} lines{more} holds two numbers or more; expected a table with a line of "
            f"column names above rows of numbers; skip=N passes over N lines, delimiter= says what is between cells"
        )
    count, _, rows, at = max(firsts, key=lambda first: first[:2])
    number, row = rows[at]
    shown = " | ".join(row)[:60]
    if listed is not None:
        return FormatError(
            f"{path}, line {number}: got {count} numbers, {shown!r}, expected {len(listed)}, one for each of columns="
            f"{','.join(listed):.60}; ignore stands for one that is not needed"
        )
    above = next((k for k in range(at - 1, -1, -1) if any(rows[k][1]) and rows[k][0] > (skip or 0)), None)
    names = [cell for cell in _uncommented(rows[above][1], rows[above]) if cell] if above is not None else []
    for line, cells in ((number, row), (number if above is None else rows[above][0], names)):
        words = [cell for cell in cells if not is_numeric(cell)]
        named = len(words) == 1 or any(meaning(word).key for word in words)
        if words[:1] == cells[:1] and len(cells) > len(words) + 1 and named:
            return FormatError(
                f"{path}, line {line}: columns are named by numbers, {', '.join(cells):.60}; expected one row for "
                f"each pair of directions: bring a cross table into that form; wavelengths need their unit, '450 nm'"
            )
    if above is None:
        what = f"begins with numbers in line {number}, {shown!r}"
        return FormatError(
            f"{path}: {what}; expected a line of column names above; give columns=[...], a name for each of {count}: "
            f"theta_i, phi_i, theta_o, phi_o, f, u_f, wavelength, ignore"
        )
    known = [name for name in names if meaning(name).key not in ("", IGNORE)]
    return FormatError(
        f"{path}, line {rows[above][0]}: column names {', '.join([f'{name!r:.40}' for name in names[:8]])}"
        f"{' ...' if len(names) > 8 else ''} above the numbers of line {number}: "
        f"{f'only {known[0]!r:.60} is known' if known else 'none is known'}; expected an angle and a value at "
        f"least; say "
        f'what they are: columns={{"theta_i": {names[0]!r:.60}, ...}}, or skip=N if N lines stand above the names'
    )
