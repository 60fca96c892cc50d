"""Excel workbooks, read as far as somebody asks: their sheets, and rows of cells as texts.

Nothing is kept of a part but its cells, and no more of them than the file accounts for: workbooks are zip files, whose
parts may be a thousand times as long as the file. Links to other files, formulas and styles but those of dates are not
looked at.
"""

from __future__ import annotations

import functools
import posixpath
import re
import sys
import zipfile
from collections.abc import Callable, Iterator
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from xml.parsers import expat

from ...errors import FormatError

UNPACKED = 50
"""Most bytes of the parts of a workbook for each byte of it, beside `SMALL`; of zeros alone there are thirty."""

SMALL = 2**24

MEMORY = 20
"""Most bytes of memory of the cells for each byte of the file, beside `ROOM`; of different numbers there are ten."""

ROOM = 5 * 2**23

PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""How parts may be packed: of others a few bytes may become any number at once."""

CHUNK = 2**16
"""Bytes that are unpacked at a time."""

LONGEST = 2**20
"""Bytes of a comment, or of a tag with its attributes."""

CELL = 32767
"""Characters of a cell, as in Excel; rows and columns too."""

ROWS, COLUMNS = 2**20, 2**14

MANY = 10_000
"""Sheets, parts that are named, and formats of numbers."""

SAME = 2**16
"""Texts that are kept once, however many cells have them."""

DATES = {*range(14, 23), *range(27, 37), *range(45, 48), *range(50, 59)}
"""Built-in formats of dates and times."""

_WORDS = re.compile(r'"[^"]*"|\\.|_.|\*.|\[(?!h+\]|m+\]|s+\])[^][]*\]', re.IGNORECASE)
"""What stands in a format, and says nothing of dates."""

Attributes = dict[str, str]


class Workbook:
    """The workbook in a file: `with Workbook(path) as book`. Raises FormatError where it is damaged or too large."""

    def __init__(self, path: Path):
        self.path = path
        self._left = ROOM + MEMORY * path.stat().st_size
        self._packed = zipfile.ZipFile(path)
        self._entries = {entry.filename: entry for entry in self._packed.infolist()}
        self._expect_small(path.stat().st_size)
        home = self._related("_rels/.rels", "").get("officeDocument", ["xl/workbook.xml"])[0]
        folder, name = posixpath.split(home)
        self._parts: dict[str, str] = {}
        related = self._related(f"{folder}/_rels/{name}.rels", folder)
        self.sheets: dict[str, str] = {}
        """The name of a sheet -> its part."""
        self._epoch = datetime(1899, 12, 30)
        self._read(home, self._workbook)
        self._dates: set[int] = set()
        self._formats: dict[int, bool] = {}
        self._style = -1
        for part in related.get("styles", [])[:1]:
            self._read(part, self._styled)
        self._strings: list[str] = []
        for part in related.get("sharedStrings", [])[:1]:
            texts = _Texts()
            for _ in self._events(part, texts.start, texts.end, texts.data):
                self._keep(texts.found)

    def _expect_small(self, size: int) -> None:
        unpacked = sum(entry.file_size for entry in self._entries.values())
        if unpacked > UNPACKED * size + SMALL:
            raise FormatError(f"{self.path}: {unpacked} bytes unpacked, of {size}; save the sheet as CSV")
        odd = [entry.filename for entry in self._entries.values() if entry.compress_type not in PACKED]
        if odd:
            raise FormatError(f"{self.path}: {odd[0]!r:.60} is packed as workbooks are not; save it anew")

    def _keep(self, texts: list[str]) -> None:
        for text in texts:
            self._take(sys.getsizeof(text) + 8)
        self._strings += texts
        texts.clear()

    def _take(self, memory: int) -> None:
        self._left -= memory
        if self._left < 0:
            rule = f"{MEMORY} times its size and {ROOM >> 20} MB"
            raise FormatError(f"{self.path}: its cells take more than {rule} of memory; save the sheet as CSV")

    def _related(self, part: str, folder: str) -> dict[str, list[str]]:
        """Parts of this file by what they are, and their names by `_parts`."""
        targets: dict[str, list[str]] = {}

        def start(tag: str, attributes: Attributes) -> None:
            if tag != "Relationship" or attributes.get("TargetMode") == "External":
                return
            target = posixpath.normpath(posixpath.join("/", folder, attributes.get("Target", ""))).lstrip("/")
            relationship = attributes.get("Type", "").rpartition("/")[2]
            targets.setdefault(relationship, []).append(target)
            if relationship == "worksheet" and target in self._entries:
                self._parts[attributes.get("Id", "")] = target
            if sum(map(len, targets.values())) > MANY:
                raise ValueError(f"more than {MANY} parts")

        if part in self._entries:
            self._parts = {}
            self._read(part, start)
        return targets

    def _workbook(self, tag: str, attributes: Attributes) -> None:
        if tag == "workbookPr" and attributes.get("date1904") in ("1", "true"):
            self._epoch = datetime(1904, 1, 1)
        if tag == "sheet":
            for name, number in attributes.items():
                if name.endswith(":id") and number in self._parts:
                    self.sheets[attributes.get("name", "")] = self._parts[number]

    def _styled(self, tag: str, attributes: Attributes) -> None:
        if tag == "numFmt" and len(self._formats) < MANY:
            code = _WORDS.sub("", attributes.get("formatCode", "")[:CELL].partition(";")[0])
            self._formats[int(attributes["numFmtId"])] = re.search("[dmhys]", code, re.IGNORECASE) is not None
        elif tag == "cellXfs":
            self._style = 0
        elif tag == "cellStyles":
            self._style = -1
        elif tag == "xf" and self._style >= 0:
            number = int(attributes.get("numFmtId", "0"))
            if self._formats.get(number, number in DATES) and self._style < MANY:
                self._dates.add(self._style)
            self._style += 1

    def _read(self, part: str, start: Callable[[str, Attributes], None]) -> None:
        for _ in self._events(part, start, lambda tag: None, None):
            pass

    def _events(self, part: str, start: Any, end: Any, data: Any) -> Iterator[None]:
        """Parse a part, by pieces: tags without prefixes."""
        parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = _doctype
        parser.StartElementHandler = lambda tag, attributes: start(tag.rpartition(":")[2], attributes)
        parser.EndElementHandler = lambda tag: end(tag.rpartition(":")[2])
        parser.CharacterDataHandler = data
        fed = 0
        with self._packed.open(part) as content:
            while chunk := content.read(CHUNK):
                parser.Parse(chunk, False)
                fed += len(chunk)
                if fed - parser.CurrentByteIndex > LONGEST:
                    raise ValueError(f"{part}: a tag or a comment of more than {LONGEST} bytes")
                yield
        parser.Parse(b"", True)
        yield

    def rows(self, sheet: str) -> Iterator[list[str]]:
        """The rows of a sheet, from the first; those that are not there are empty."""
        cells = _SheetCells(self._strings, self._dates, self._epoch, self._take)
        empty: list[str] = []
        count = 0
        for _ in self._events(self.sheets[sheet], cells.start, cells.end, cells.data):
            for number, row in cells.found:
                while count + 1 < number:
                    count += 1
                    self._take(8)
                    yield empty
                count += 1
                yield row
            cells.found.clear()

    def close(self) -> None:
        self._packed.close()

    def __enter__(self) -> Workbook:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _doctype(*_: Any) -> None:
    raise ValueError("a document type declaration, which workbooks do not have")


class _Texts:
    """The texts of "si" elements, in the order of the part: all pieces of each, but no readings of Japanese."""

    def __init__(self, tag: str = "si"):
        self.tag = tag
        self.found: list[str] = []
        self._pieces: list[str] = []
        self._length = 0
        self._is_text = self._is_reading = False

    def start(self, tag: str, attributes: Attributes) -> None:
        if tag == self.tag:
            self._pieces, self._length = [], 0
        self._is_reading |= tag == "rPh"
        self._is_text = tag == "t" and not self._is_reading

    def data(self, text: str) -> None:
        if self._is_text:
            self._length += len(text)
            if self._length > CELL:
                raise ValueError(f"a cell of more than {CELL} characters")
            self._pieces.append(text)

    def end(self, tag: str) -> None:
        self._is_text = False
        self._is_reading &= tag != "rPh"
        if tag == self.tag:
            self.found.append("".join(self._pieces).strip())


class _SheetCells:
    """The rows of a sheet: numbers, and texts of their cells."""

    def __init__(self, strings: list[str], dates: set[int], epoch: datetime, take: Callable[[int], None]):
        self.found: list[tuple[int, list[str]]] = []
        self._take = take
        self._strings, self._dates, self._epoch = strings, dates, epoch
        self._same: dict[str, str] = {}
        self._inline = _Texts("is")
        self._row: list[str] = []
        self._number = self._last = self._column = 0
        self._kind, self._style, self._value, self._is_value = "n", "0", "", False

    def start(self, tag: str, attributes: Attributes) -> None:
        if tag == "c":
            self._kind, self._style, self._value = attributes.get("t", "n"), attributes.get("s", "0"), ""
            self._column += 1
            if reference := attributes.get("r"):
                self._column = _column(reference.rstrip("0123456789"))
            if not 0 < self._column <= COLUMNS:
                raise ValueError(f"a cell in column {self._column}, expected at most {COLUMNS}")
        elif tag == "v":
            self._is_value = True
        elif tag == "row":
            self._number = int(attributes.get("r", self._number + 1))
            if not self._last < self._number <= ROWS:
                raise ValueError(f"row {self._number} after {self._last}, expected rising numbers up to {ROWS}")
            self._row, self._column, self._last = [], 0, self._number
        else:
            self._inline.start(tag, attributes)

    def data(self, text: str) -> None:
        if self._is_value:
            self._value += text
            if len(self._value) > CELL:
                raise ValueError(f"a cell of more than {CELL} characters")
        else:
            self._inline.data(text)

    def end(self, tag: str) -> None:
        if tag == "c":
            text = self._text()
            self._row += [""] * (self._column - len(self._row))
            self._row[self._column - 1] = text
        elif tag == "v":
            self._is_value = False
        elif tag == "row":
            self._take(64 + 8 * len(self._row))
            self.found.append((self._number, self._row))
        else:
            self._inline.end(tag)

    def _text(self) -> str:
        """The text of a cell: a number as Python writes it, a date as its text."""
        if self._kind == "inlineStr":
            return self._once("".join(self._inline.found[-1:]))
        if not self._value:
            return ""
        if self._kind == "s":
            number = int(self._value)
            if not 0 <= number < len(self._strings):
                raise ValueError(f"a cell has text {number} of {len(self._strings)}")
            return self._strings[number]
        if self._kind == "b":
            return self._once(str(self._value.strip() == "1"))
        if self._kind != "n":
            return self._once(self._value.strip())
        value = float(self._value)
        if self._dates and int(self._style) in self._dates:
            return self._once(self._date(value))
        return self._once(repr(value))

    def _date(self, days: float) -> str:
        try:
            return str(self._epoch + timedelta(milliseconds=round(days * 86_400_000)))
        except (OverflowError, ValueError):
            return "#VALUE!"

    def _once(self, text: str) -> str:
        """The same text for cells that have the same."""
        self._inline.found.clear()
        if (same := self._same.get(text)) is not None:
            return same
        self._take(sys.getsizeof(text))
        if len(self._same) < SAME:
            self._same[text] = text
        return text


@functools.cache
def _column(letters: str) -> int:
    if not re.fullmatch("[A-Z]{1,3}", letters):
        raise ValueError(f"a cell in column {letters!r:.40}")
    return functools.reduce(lambda number, letter: 26 * number + ord(letter) - 64, letters, 0)
