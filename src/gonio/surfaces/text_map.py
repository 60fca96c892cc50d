"""Height maps as text: rows of numbers, with semicolons, tabs, bars, blanks or commas between them."""

from __future__ import annotations

import codecs
import itertools
import math
import os
import re
from array import array
from pathlib import Path

import numpy as np

from ..errors import FormatError
from ..files.cells import LONGEST, MISSING, decimal_sign, delimiter_of, split

LARGEST = 1 << 30
"""Bytes of a height map, at most."""

HEAD, CELLS = 400, 10_000
"""Rows, and cells in them, that say what is between numbers and which sign is the decimal one."""

_MARKS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?|[-+]?inf", re.ASCII | re.IGNORECASE)


def content(path: Path) -> bytes:
    """The bytes of a height map. Raises FormatError for too many."""
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size > LARGEST:
            raise FormatError(f"{path}: more than {LARGEST >> 20} MiB; expected a smaller map")
        return file.read(size)


def read_text(path: Path, decimal: str | None) -> np.ndarray:
    """Heights (rows, columns), NaN where a cell says that there is none.

    What is between numbers is what the first rows have, and a comma between other delimiters is the decimal sign, as in
    laboratories' tables (`cells`). Text after "#" is passed over. Raises FormatError, with the line, for rows of other
    lengths and for what is no number; for commas that have two readings too, unless `decimal` is said.
    """
    lines = _lines(path)
    first = [line for _, line in itertools.islice(((n, x) for n, x in enumerate(lines) if x), HEAD)]
    delimiter = delimiter_of(path, first, decimal)
    cells = itertools.islice((cell for line in first for cell in split(line, delimiter)), CELLS)
    sign = decimal or ("." if delimiter == "," else decimal_sign(path, [*cells]))
    found, columns = array("d"), 0
    closed = all(line.endswith(delimiter) for line in first)  # each number is, not each but the last
    for number, line in enumerate(lines, 1):
        if not line:
            continue
        row = split(line.removesuffix(delimiter) if closed else line, delimiter)
        columns = columns or len(row)
        if len(row) != columns:
            raise FormatError(f"{path}, line {number}: {len(row)} numbers, expected {columns} as in the first row")
        found.extend(_plain(line, row, delimiter, sign) or [_number(path, number, cell, sign) for cell in row])
    if not found:
        raise FormatError(f"{path}: no numbers; expected rows of heights")
    return np.frombuffer(found).reshape(-1, columns)


def _lines(path: Path) -> list[str]:
    """The lines without comments and without blanks about them."""
    data = content(path)
    encoding = next((name for mark, name in _MARKS.items() if data.startswith(mark)), "utf-8")
    text = data.decode(encoding).replace("\N{MINUS SIGN}", "-").replace("\N{NO-BREAK SPACE}", " ")
    return [line.partition("#")[0].strip(" \r\f\v\x1a") for line in text.split("\n")]


def _plain(line: str, row: list[str], delimiter: str, sign: str) -> list[float] | None:
    """The numbers of a row at once; None unless they are written as Python has them, but for the decimal sign."""
    if "_" in line or not line.isascii() or (delimiter != "," and {".": ",", ",": "."}[sign] in line):
        return None
    try:
        return [float(cell.replace(",", ".")) for cell in row] if sign == "," else [*map(float, row)]
    except ValueError:
        return None


def _number(path: Path, number: int, cell: str, sign: str) -> float:
    plain = cell.replace("," if sign == "." else ".", "").replace(",", ".") if "," in cell else cell
    if sign == "," and "." in cell and "," not in cell:
        plain = cell.replace(".", "")
    if len(plain) <= LONGEST and _NUMBER.fullmatch(plain):
        return float(plain)
    if plain.lower() in MISSING:
        return math.nan
    raise FormatError(
        f"{path}, line {number}: got {cell[:60]!r}, expected a number; lines of words begin with #, and a cell "
        f"without a height is empty or nan"
    )
