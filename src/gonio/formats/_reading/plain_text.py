"""Text files of numbers: lines counted for messages, rows read fast, numbers written without loss.

Memory stays below a small multiple of the file's size: the text is kept whole, numbers are collected as they are
read, and nothing is allocated on a header's word.
"""

from __future__ import annotations

import codecs
import os
import re
from array import array
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from ...declared.typed import is_number as is_number
from ...declared.typed import is_whole as is_whole
from ...errors import FormatError
from ...files import replacing

LIMIT = 2**30
"""Longest text file that is read, in bytes."""

LONGEST = 2**22
"""Longest line, in characters: its words take up to thirty times the memory of their text."""

CHUNK = 2**20
"""Characters that `Lines.rows` converts at a time."""

BLOCK = 4096
"""Rows that `join` writes at a time."""

MANY = 8
"""Fewest columns of one number each that `join` formats once."""

MARKS = {
    codecs.BOM_UTF8: "utf-8",
    codecs.BOM_UTF32_LE: "utf-32-le",  # begins with the mark of UTF-16
    codecs.BOM_UTF32_BE: "utf-32-be",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
}
"""Byte order marks -> encoding."""

_SEPARATORS = str.maketrans(",;", "  ")


def read(path: str | os.PathLike, comment: str | tuple[str, ...] = (), mixed: re.Pattern[bytes] | None = None) -> Lines:
    """The lines of a text file without those that begin with `comment`.

    `mixed` is the mark of files with binary numbers between lines; their text is Latin-1 (`Lines.mixed`). Raises the
    errors of `decode`, and FormatError for a file longer than `LIMIT` or a line longer than `LONGEST`.
    """
    content = _content(path, LIMIT)
    if mixed is not None and mixed.search(content):
        return Lines(path, content.removeprefix(codecs.BOM_UTF8).decode("latin-1"), comment, mixed=True)
    return Lines(path, decode(path, content), comment)


def text(path: str | os.PathLike, limit: int = LIMIT) -> str:
    """A whole text file. Raises FormatError for one of more than `limit` bytes, and the errors of `decode`."""
    return decode(path, _content(path, limit))


def _content(path: str | os.PathLike, limit: int) -> bytes:
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size > limit:
            raise FormatError(f"{path}: {size} bytes, expected text of at most {limit}; split it into several files")
        return file.read(size)


def _expect_lines(path: str | os.PathLike, text: str) -> None:
    """Raises FormatError where a line is longer than `LONGEST`."""
    at = 0
    while len(text) - at > LONGEST:
        end = text.rfind("\n", at, at + LONGEST + 1)
        if end < 0:
            number = text.count("\n", 0, at) + 1
            raise FormatError(
                f"{path}, line {number}: more than {LONGEST} characters, expected shorter lines; fetch it again"
            )
        at = end + 1


def decode(path: str | os.PathLike, content: bytes) -> str:
    """Text of a file in the encoding of its mark, else in UTF-8, or in Latin-1 if it is not UTF-8; lines end with "\n".

    Raises FormatError for zero bytes and half characters, which no text file has.
    """
    mark, encoding = marked(content)
    content = content.removeprefix(mark)
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        if encoding != "utf-8":
            name = encoding[:6].upper()
            raise FormatError(f"{path}: expected {name} text, as its first bytes say: {error.reason}") from None
        text = content.decode("latin-1")
    if "\0" in text:
        raise FormatError(f"{path}: not a text file: zero byte at {text.index(chr(0))}, expected text only")
    return _lines(text)


def marked(content: bytes) -> tuple[bytes, str]:
    """The byte order mark of a text, if any, and its encoding."""
    return next(((mark, name) for mark, name in MARKS.items() if content.startswith(mark)), (b"", "utf-8"))


def _lines(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def head(content: bytes, size: int, length: int) -> tuple[bytes, int]:
    """The first `length` bytes of a file of `size` bytes that begins with `content`, and its size.

    A text with a mark becomes UTF-8 without one, so that `matches` need not know encodings; other files stay.
    """
    mark, encoding = marked(content)
    whole, plain = len(content) >= size, content.removeprefix(mark)
    if mark and encoding != "utf-8":
        try:
            plain = codecs.getincrementaldecoder(encoding)().decode(plain, final=whole).encode()
        except UnicodeDecodeError:
            plain = content
        plain = content if b"\0" in plain else plain
    return plain[:length], len(plain) if whole else size


def start(head: bytes) -> str:
    """The first characters of a possible text file, one for each byte; lines end with "\n" alone."""
    return _lines(head.decode("latin-1"))


class Lines:
    """Lines of a text, one after the other, stripped, without blank ones and comments.

    path     for messages
    number   of the line read last, counted from 1
    comment  beginnings of comments
    mixed    whether there are bytes between lines, and characters are bytes

    Raises FormatError for a line longer than `LONGEST`.
    """

    def __init__(self, path: str | os.PathLike, text: str, comment: str | tuple[str, ...] = (), mixed: bool = False):
        if not mixed:
            _expect_lines(path, text)
        self.path, self.number, self.mixed = str(path), 0, mixed
        self._text, self._at, self.comment = text, 0, comment

    def __iter__(self) -> Iterator[str]:
        while (line := self.next()) is not None:
            yield line

    def next(self) -> str | None:
        """The next line, or None at the end."""
        while self._at < len(self._text):
            end = self._text.find("\n", self._at)
            end = len(self._text) if end < 0 else end
            line = self._text[self._at : end].strip()
            self._at, self.number = end + 1, self.number + 1
            if line and not line.startswith(self.comment):
                return line
        return None

    def peek(self) -> str | None:
        """The next line, or None at the end, without taking it."""
        at, number = self._at, self.number
        line = self.next()
        self._at, self.number = at, number
        return line

    def bytes(self, count: int, expected: str) -> bytes:
        """The next bytes of a mixed file. Raises FormatError if fewer are left."""
        left = len(self._text) - self._at
        if count > left:
            raise FormatError(
                f"{self.path}: cut short: {left} bytes after line {self.number}, expected {count}: {expected}"
            )
        self._at += count
        return self._text[self._at - count : self._at].encode("latin-1")

    def edit(self, change: Callable[[str], str]) -> None:
        """Change the rest of the text within its lines."""
        self._text, self._at = change(self._text[self._at :]), 0

    def take(self, expected: str) -> str:
        """The next line. Raises FormatError, with `expected`, at the end of the file."""
        line = self.next()
        if line is None:
            raise self.cut_short(expected)
        return line

    def fault(self, text: str, expected: str) -> FormatError:
        """The error for the line read last."""
        return FormatError(f"{self.path}, line {self.number}: got {text[:60]!r}, expected {expected}")

    def cut_short(self, expected: str) -> FormatError:
        """The error for the end of the file."""
        return FormatError(f"{self.path}: cut short: ends after line {self.number}, expected {expected}")

    def floats(self, line: str, expected: str = "numbers") -> list[float]:
        """The numbers of the line read last, separated by blanks, commas or semicolons."""
        return [self.float(token, expected) for token in split(line)]

    def row(self, line: str, columns: int) -> list[float]:
        """The same, of so many numbers."""
        numbers = self.floats(line)
        if len(numbers) != columns:
            raise self.fault(line, f"{columns} numbers, not {len(numbers)}")
        return numbers

    def float(self, token: str, expected: str = "a number") -> float:
        """A number by the rules of `is_number`."""
        if not is_number(token):
            raise self.fault(token, expected)
        return float(token)

    def count(self, token: str, expected: str = "a count") -> int:
        """A whole number, 0 or above; "3.0" too."""
        value = self.float(token, expected)
        if not (value >= 0.0 and value == int(min(value, 2.0**53))):
            raise self.fault(token, expected)
        return int(value)

    def numbers(self, count: int, expected: str = "numbers") -> np.ndarray:
        """The next `count` numbers (count,), over several lines; the last of these holds no more."""
        out = array("d")
        while len(out) < count:
            out.extend(self.floats(self.take(f"{count} {expected}, got {len(out)}"), expected))
        if len(out) > count:
            raise self.fault(f"{len(out)} numbers", f"{count} {expected}")
        return _array(out)

    def rows(self, columns: int, count: int | None = None, expected: str = "numbers") -> np.ndarray:
        """The next `count` lines, or all that are left, at least one, as an array of numbers (rows, columns)."""
        out = array("d")
        while count is None or len(out) < count * columns:
            lines, at = self._chunk(CHUNK if count is None else min(CHUNK, count - len(out) // columns))
            if not lines:
                break
            start = len(out)
            try:
                if any("_" in line or not line.isascii() for line in lines):
                    raise ValueError  # float() takes 1_0, and the digits of every script
                for line in lines:
                    if len(row := line.split()) == columns:
                        out.extend(map(float, row))
                    elif row and not line.lstrip().startswith(self.comment):
                        raise ValueError
            except ValueError:
                del out[start:]
                self._row_by_row(out, columns, at)
                continue
            self._at, self.number = at, self.number + len(lines)
        if count is not None and len(out) < count * columns:
            raise self.cut_short(f"{count} rows of {columns} {expected}, got {len(out) // columns}")
        if count is None and not out:
            raise self.cut_short(f"rows of {expected}")
        return _array(out).reshape(-1, columns)

    def _chunk(self, count: int) -> tuple[list[str], int]:
        """At most `count` whole lines from here on, blanks as separators, and the place of the next one."""
        end = self._text.find("\n", self._at + CHUNK)
        text = self._text[self._at : end if end >= 0 else len(self._text)]
        lines = text.translate(_SEPARATORS).split("\n", count) if text else []
        rest = len(lines.pop()) if len(lines) > count else -1
        return lines, self._at + len(text) - rest

    def _row_by_row(self, out: array, columns: int, at: int) -> None:
        while self._at < at and (line := self.next()) is not None:
            out.extend(self.row(line, columns))


def split(line: str) -> list[str]:
    """The words of a line, separated by blanks, commas or semicolons."""
    return line.translate(_SEPARATORS).split()


def _array(numbers: array) -> np.ndarray:
    return np.frombuffer(numbers, np.float64) if numbers else np.empty(0)


def number(value: float) -> str:
    """The shortest text that reads back as the same float64; whole numbers below 1e16 without a point."""
    return repr(float(value)).removesuffix(".0")


def join(rows: Iterable[Iterable[float | str]], separator: str = " ") -> Iterator[str]:
    """Lines, with their ends, of rows of numbers or words; many at a time of an array (n, columns)."""
    if isinstance(rows, np.ndarray):
        for start in range(0, len(rows), BLOCK):
            yield from _block(rows[start : start + BLOCK], separator)
        return
    for row in rows:
        yield separator.join([x if isinstance(x, str) else number(x) for x in row]) + "\n"


def _block(rows: np.ndarray, separator: str) -> Iterator[str]:
    """Lines of a few rows; last columns that hold one number each, as a spectrum at many directions, are "
    "formatted once."""
    bits = np.ascontiguousarray(rows, np.float64).view(np.int64)
    differing = np.flatnonzero((bits != bits[0]).any(axis=0))
    count = int(differing[-1]) + 1 if len(differing) else 1
    if rows.shape[1] - count < MANY:
        yield _plain(rows, separator)
        return
    end = separator + _plain(rows[:1, count:], separator)
    yield _plain(rows[:, :count], separator).replace("\n", end)


def _plain(rows: np.ndarray, separator: str) -> str:
    # str() of a list is several times faster than one of each number.
    block = str(rows.tolist())[2:-2].replace("], [", "\n") + "\n"
    return block.replace(".0, ", ", ").replace(".0\n", "\n").replace(", ", separator)


def write(
    path: str | os.PathLike, lines: Iterable[str], rows: Iterable[Iterable[float | str]] = (), separator: str = " "
) -> None:
    """Write lines, with their ends, then rows (see `join`), as UTF-8; after a failure an existing file is as it was."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(lines)
        file.writelines(join(rows, separator))


def degrees(radians: np.ndarray) -> np.ndarray:
    """Angles in degrees, with the fewest decimals that read back as the same radians if any do.

    np.radians of the result is the argument, bit by bit, for angles that were read in degrees; else within 1 unit
    in the last place.
    """
    exact = np.degrees(np.asarray(radians, np.float64))
    result, unmatched = exact.copy(), np.isfinite(exact)
    for decimals in range(15):
        near = np.round(exact, decimals)
        same = unmatched & (np.radians(near) == radians)
        result[same] = near[same]
        unmatched &= ~same
    return result
