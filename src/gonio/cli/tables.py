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

    Invisible characters of cells are written out, as many cells are from files."""
    lines = [tuple(header), *(tuple(map(visible, row)) for row in rows)]
    widths = [max(len(line[c]) for line in lines) for c in range(len(header) - 1)]
    start = sum(w + 2 for w in widths)
    below = _width() - start < 30
    start = 4 if below else start
    text = []
    for line in lines:
        first = "".join(f"{cell:<{w}}  " for cell, w in zip(line, widths, strict=False))
        last = textwrap.wrap(line[-1], max(_width() - start, NARROWEST), break_long_words=False) or [""]
        head = first if below else first + last.pop(0)
        parts = [head.rstrip(), *(" " * start + more for more in last)]
        text += [click.style(part, bold=True) if part and line is lines[0] else part for part in parts]
    return "\n".join(text)


def paragraph(text: str) -> str:
    """Text wrapped to the terminal, to 100 characters at most."""
    return "\n".join(textwrap.wrap(text, max(min(_width(), 100), NARROWEST)))


def _width() -> int:
    return shutil.get_terminal_size((100, 24)).columns if sys.stdout.isatty() else 10_000


def size_in_words(n: int) -> str:
    """A number of bytes, to three digits."""
    for unit, size in (("MB", 1e6), ("kB", 1e3)):
        if n >= size:
            return f"{n / size:.3g} {unit}"
    return f"{n} bytes"
