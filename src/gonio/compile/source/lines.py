"""Lines of source text: long statements broken at operators, and comments in ASCII."""

from __future__ import annotations

import re
import textwrap
import unicodedata
from collections.abc import Iterator

WIDTH = 120
_BREAK = re.compile(r"(?<=,) | (?=(?:[-+*/?:<>&|]|[<>=!]=|&&|\|\||\^\^) )")
_DASHES = {ord(dash): "-" for dash in "\u2010\u2011\u2012\u2013\u2014\u2015\u2212"}


def wrapped(line: str, width: int = WIDTH) -> Iterator[str]:
    """A line as lines of at most `width` characters where that can be: each is broken where brackets are fewest."""
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    while len(line) > width and "//" not in line and not line.startswith("#"):
        depths = _depths(line)
        start = len(indent)
        places = [m.start() for m in _BREAK.finditer(line, start + 1, width + 1) if m.start() <= width]
        if not places:
            break
        place = min(places, key=lambda i: (depths[i], -i) if i > width // 3 else (99, -i))
        yield line[:place]
        line = indent + line[place + 1 :]
    yield line


def _depths(line: str) -> list[int]:
    depth, depths = 0, []
    for c in line:
        depth += {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}.get(c, 0)
        depths.append(depth)
    return depths


def ascii_of(text: str) -> str:
    """A text in printable ASCII, for comments: accents are left out, Greek letters and other signs are named.

    Backslashes become slashes: at the end of a comment they would draw the next line into it.
    """
    return "".join(map(_plain, text.translate(_DASHES))).replace("\\", "/").replace("??/", "?/")


def _plain(c: str) -> str:
    if " " <= c <= "~":
        return c
    if c.isspace():
        return " "
    letters = "".join(x for x in unicodedata.normalize("NFKD", c) if " " <= x <= "~")
    if letters or unicodedata.combining(c):
        return letters
    name = unicodedata.name(c, "?")
    return name.rpartition(" LETTER ")[2].lower() if "GREEK" in name else "?"


def with_comment(line: str, sign: str, comment: str) -> list[str]:
    """A line with a comment behind it, or above where that would be long; none for "".

    Long lines are wrapped.
    """
    comment = ascii_of(comment)
    if not comment:
        return list(wrapped(line))
    if len(line) + len(comment) + 2 <= WIDTH:
        return [f"{line} {sign} {comment}"]
    return [*(f"{sign} {part}" for part in textwrap.wrap(comment, WIDTH - 4)), *wrapped(line)]
