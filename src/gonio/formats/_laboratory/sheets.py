"""Rows of cells, of text files and of workbooks: what the search for a table and its reading have in common."""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from ...errors import FormatError
from .._reading import plain_text

CHUNK = 2**20
"""Characters that are split into cells at a time."""

HEAD = 2**22
"""Characters among which a table is sought."""

COLUMNS = 2**16
"""Largest number of columns."""

DELIMITERS = (";", "\t", ",", "|", "  ", " ")
"""What is between cells, in the order in which it is tried; "  ": names are two blanks apart, numbers any."""

NAMED = {"tab": "\t", "blank": " "}
"""Words for delimiters that do not show."""

Row = tuple[int, list[str]]


class TextSheet:
    """A text file; rows are its lines, cells are between delimiters, quoted or not."""

    delimiters = DELIMITERS

    def __init__(self, path: Path, text: str | None = None):
        self.path = path
        self.text = (
            (plain_text.text(path) if text is None else text)
            .replace("\N{MINUS SIGN}", "-")
            .replace("\N{NO-BREAK SPACE}", " ")
        )

    def head(self, delimiter: str, count: int) -> list[Row]:
        """The first rows, numbered from 1; a line that begins with "#" is one cell."""
        return [row for piece in self._pieces(delimiter, 0, 0, count) for row in piece]

    def rows(self, delimiter: str, start: int = 0) -> Iterator[list[Row]]:
        """Rows in pieces, after the line of number `start`."""
        return self._pieces(delimiter, start, CHUNK)

    def _pieces(self, delimiter: str, start: int, size: int, count: int = sys.maxsize) -> Iterator[list[Row]]:
        at, number = 0, 0
        while at < len(self.text) and number < start + count and (size or at < HEAD):
            end = self.text.find("\n", at + size if number >= start else at)
            end = len(self.text) if end < 0 else end
            lines = self.text[at:end].split("\n")
            at, number = end + 1, number + len(lines)
            if number > start:
                yield self._split(lines, number - len(lines) + 1, delimiter, strict=size > 0)

    def _split(self, lines: list[str], number: int, delimiter: str, strict: bool) -> list[Row]:
        for k, line in enumerate(lines, number):
            if len(line) > plain_text.LONGEST:
                raise FormatError(
                    f"{self.path}, line {k}: more than {plain_text.LONGEST} characters, expected shorter lines"
                )
        return [(k, cells(line, delimiter, self.path, k, strict)) for k, line in enumerate(lines, number)]


class CellSheet:
    """A sheet of a workbook: rows of cells as texts."""

    delimiters = ("",)

    def __init__(self, path: Path, content: list[list[str]]):
        self.path, self.content = path, content

    def head(self, delimiter: str, count: int) -> list[Row]:
        """The first rows, numbered from 1."""
        return [*enumerate(self.content[:count], 1)]

    def rows(self, delimiter: str, start: int = 0) -> Iterator[list[Row]]:
        """Rows in pieces, after that of number `start`."""
        yield [*enumerate(self.content[start:], start + 1)]


def cells(line: str, delimiter: str, path: Path, number: int, strict: bool) -> list[str]:
    """The cells of a line, without blanks around them. Raises FormatError for an open quotation mark, if `strict`."""
    if line.lstrip().startswith("#"):
        return [line]
    if delimiter in ("  ", " "):
        parts = line.split() if delimiter == " " else re.split(r"\s{2,}|\t", line.strip())
        return [part.strip('"') for part in parts]
    if '"' in line:
        try:
            (parsed,) = csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=strict)
        except (csv.Error, ValueError) as error:
            if strict:
                expected = f"expected closed quotation marks: {error}"
                raise FormatError(f"{path}, line {number}: got {line[:60]!r}, {expected}") from None
            parsed = line.split(delimiter)
        return [cell.strip() for cell in parsed]
    return [cell.strip() for cell in line.split(delimiter)]
