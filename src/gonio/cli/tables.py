"""Text on a terminal: aligned tables, and numbers in words."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence

import click

from ..errors import visible

NARROWEST = 20
"""Characters of a line of text, however narrow the terminal is."""


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Aligned columns. On a terminal the last is wrapped to the width, below the others for want of room.

    What is not visible in a cell is written out: much of it is from files."""
    lines = [tuple(header), *(tuple(map(visible, row)) for row in rows)]
    widths = [max(len(line[c]) for line in lines) for c in range(len(header) - 1)]
    start = sum(w + 2 for w in widths)
    below = _width() - start < 30
    if below:
        start = 4
    text = []
    for i, line in enumerate(lines):
        first = "".join(f"{cell:<{w}}  " for cell, w in zip(line, widths, strict=False))
        wrapped = textwrap.wrap(line[-1], max(_width() - start, NARROWEST), break_long_words=False) or [""]
        if below:
            text.append(_heading(first.rstrip(), i == 0))
        else:
            text.append(_heading((first + wrapped.pop(0)).rstrip(), i == 0))
        text += [_heading(" " * start + more, i == 0) for more in wrapped]
    return "\n".join(text)


def paragraph(text: str) -> str:
    """Text wrapped to the terminal, to 100 characters at most."""
    return "\n".join(textwrap.wrap(text, max(min(_width(), 100), NARROWEST)))


def _heading(line: str, bold: bool) -> str:
    return click.style(line, bold=True) if bold and line else line


def _width() -> int:
    return shutil.get_terminal_size((100, 24)).columns if sys.stdout.isatty() else 10_000


def size_in_words(n: int) -> str:
    """A number of bytes, to three digits."""
    for unit, size in (("MB", 1e6), ("kB", 1e3)):
        if n >= size:
            return f"{n / size:.3g} {unit}"
    return f"{n} bytes"
