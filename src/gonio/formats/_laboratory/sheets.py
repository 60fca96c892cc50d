"""Rows of cells, of text files and of workbooks: what the search for a table and its reading have in common."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Iterator
from pathlib import Path

from ...errors import FormatError
from ...files.cells import DELIMITERS
from .._reading import plain_text

CHUNK = 2**20
"""Characters that are split into cells at a time."""

HEAD = 2**22
"""Characters among which a table is sought."""

PIECE = 2**12
"""Rows of a workbook at a time."""

COLUMNS = 2**16
"""Largest number of columns."""

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
        self._first: tuple[int, list[str]] = (0, [])

    def head(self, delimiter: str, count: int) -> list[Row]:
        """The first rows, numbered from 1; a line that begins with "#" is one cell."""
        return self._split(self._first_lines(count), 1, delimiter, strict=False)

    def has(self, delimiter: str, count: int) -> bool:
        """Whether any of the first rows may have several cells."""
        at_spaces = delimiter.isspace() and delimiter != "\t"
        return at_spaces or any(delimiter in line for line in self._first_lines(count))

    def _first_lines(self, count: int) -> list[str]:
        if self._first[0] != count:
            at = 0
            lines: list[str] = []
            while at < min(len(self.text), HEAD) and len(lines) < count:
                end = self.text.find("\n", at)
                end = len(self.text) if end < 0 else end
                lines.append(self.text[at:end])
                at = end + 1
            self._first = count, lines
        return self._first[1]

    def rows(self, delimiter: str, start: int = 0) -> Iterator[list[Row]]:
        """Rows in pieces, after the line of number `start`."""
        for number, lines in self.lines(start):
            yield self.split(lines, number, delimiter)

    def lines(self, start: int = 0) -> Iterator[tuple[int, list[str]]]:
        """Lines in pieces, after that of number `start`, and the number of the first of each piece."""
        at, number = 0, 0
        while at < len(self.text):
            end = self.text.find("\n", at + CHUNK if number >= start else at)
            end = len(self.text) if end < 0 else end
            lines = self.text[at:end].split("\n")
            at, number = end + 1, number + len(lines)
            if number > start:
                yield number - len(lines) + 1, lines

    def split(self, lines: list[str], number: int, delimiter: str) -> list[Row]:
        """The rows of lines, of which the first has this number."""
        return self._split(lines, number, delimiter, strict=True)

    def _split(self, lines: list[str], number: int, delimiter: str, strict: bool) -> list[Row]:
        for k, line in enumerate(lines, number):
            if len(line) > plain_text.LONGEST:
                raise FormatError(
                    f"{self.path}, line {k}: more than {plain_text.LONGEST} characters, expected shorter lines"
                )
        return [(k, cells(line, delimiter, self.path, k, strict)) for k, line in enumerate(lines, number)]


class CellSheet:
    """A sheet of a workbook: rows of cells as texts, read as far as they are asked for."""

    delimiters = ("",)

    def __init__(self, path: Path, content: Iterator[list[str]]):
        self.path, self._content = path, content
        self._found: list[list[str]] = []

    def has(self, delimiter: str, count: int) -> bool:
        """Whether any of the first rows may have several cells."""
        return True

    def head(self, delimiter: str, count: int) -> list[Row]:
        """The first rows, numbered from 1."""
        self._found += itertools.islice(self._content, max(count - len(self._found), 0))
        return [*enumerate(self._found[:count], 1)]

    def rows(self, delimiter: str, start: int = 0) -> Iterator[list[Row]]:
        """Rows in pieces, after that of number `start`."""
        self._found += self._content
        for first in range(start, len(self._found), PIECE):
            yield [*enumerate(self._found[first : first + PIECE], first + 1)]


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
