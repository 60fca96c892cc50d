"""Cells of tables as people write them: what is between them, which say nothing, which sign is the decimal one."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from ..errors import FormatError

DELIMITERS = (";", "\t", ",", "|", "  ", " ")
"""What is between cells, in the order in which it is tried; "  ": names are two blanks apart, numbers any."""

MISSING = frozenset(
    ("", "-", "--", "---", "n/a", "na", "n.a.", "#n/a", "nan", "null", "none", "missing", "*", "n.d.", "nd")
)
"""Cells, in small letters, that say that there is no value."""

LONGEST = 60
"""Characters of a cell that may be a number written in another way."""

_NUMERIC = re.compile(r"[-+]?(?:\d[\d., ']*|[.,]\d+)(?:e[-+]?\d+)?\s*[°%]?", re.ASCII | re.IGNORECASE)
_FRACTION = re.compile(r"-0|[-+]?0\d+")
"""Whole numbers that nobody writes, but commas leave of decimal fractions: "-0,5" and "1,05"."""
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+", re.ASCII)


def is_numeric(cell: str) -> bool:
    """Whether a cell is a number with points, commas, blanks in it, or with a unit behind."""
    return len(cell) <= LONGEST and _NUMERIC.fullmatch(cell) is not None


def split(line: str, delimiter: str) -> list[str]:
    """The cells of a line."""
    return line.split() if delimiter == " " else [cell.strip() for cell in line.split(delimiter)]


def delimiter_of(path: object, rows: Sequence[str], decimal: str | None = None) -> str:
    """What is between the numbers of rows. Raises FormatError where commas are that and decimal signs too."""
    found = next((d for d in DELIMITERS if d != "," and d.strip(" ") and any(d in row for row in rows)), " ")
    if found != " " or not any("," in row for row in rows):
        return found
    if any(len(row.split()) > 1 for row in rows) and all(x.strip(",") == x for row in rows for x in row.split()):
        return " "
    if decimal == "," or (decimal is None and any(_FRACTION.fullmatch(x) for row in rows for x in split(row, ","))):
        raise FormatError(
            f"{path}: commas between numbers and as decimal signs cannot be told apart: {rows[0][:60]!r}; export it "
            f"with semicolons or points, or say decimal='.' if each comma is between two numbers"
        )
    return ","


def decimal_sign(path: object, cells: Collection[str]) -> str:
    """The decimal sign of cells between which there are no commas. Raises FormatError where a comma can be either."""
    numeric = [cell for cell in cells if is_numeric(cell)]
    commas = [cell for cell in numeric if "," in cell]
    points = [cell for cell in numeric if "." in cell]
    if not commas:
        return "."
    if points or all(_THOUSANDS.fullmatch(cell) for cell in commas):
        got = f"{commas[0]!r}" + (f" beside {points[0]!r}" if points else "")
        raise FormatError(
            f"{path}: numbers such as {got}: is the comma the decimal sign, or does it part thousands? say decimal=',' "
            f"or decimal='.'"
        )
    return ","
