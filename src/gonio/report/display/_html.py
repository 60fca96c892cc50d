"""Pieces of HTML: text that is escaped, tables, small pictures; in the colours of the page around them."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np

from ...errors import visible
from ...pictures.colour import srgb_encode

ROWS = 24
"""Rows of a table, of which more are cut."""

_LINE = "1px solid rgba(127,127,127,.35)"
_QUIET = "opacity:.7"


class Cut(NamedTuple):
    """What is shown of an object: a title, words behind it, a picture beside the rest, and the rest; HTML all but the
    title and the words."""

    title: str
    words: str = ""
    picture: str = ""
    parts: tuple[str, ...] = ()


def text(value: Any) -> str:
    """Text of any kind, as it is."""
    return escape(visible(str(value), keep="\n"))


def code(value: Any, longest: int = 600) -> str:
    """Code, cut where it is long."""
    shown = str(value)
    shown = shown if len(shown) <= longest else f"{shown[:longest]} …"
    return f'<code style="white-space:pre-wrap;overflow-wrap:anywhere;background:none">{text(shown)}</code>'


def block(value: Any, longest: int = 20_000) -> str:
    """Text of several lines, in letters of one width."""
    shown = str(value)
    shown = shown if len(shown) <= longest else f"{shown[:longest]}\n…"
    style = f"max-height:28em;overflow:auto;margin:.3em 0;padding:.4em .6em;border:{_LINE};border-radius:4px"
    return f'<pre style="{style};background:none;color:inherit;line-height:1.35">{text(shown)}</pre>'


def paragraph(value: Any, quiet: bool = False) -> str:
    """A sentence."""
    return f'<div style="margin:.25em 0{";" + _QUIET if quiet else ""}">{text(value)}</div>'


def items(values: Iterable[Any]) -> str:
    """Sentences in a list; nothing, where there are none."""
    lines = "".join(f"<li>{text(value)}</li>" for value in values)
    return f'<ul style="margin:.25em 0;padding-left:1.4em">{lines}</ul>' if lines else ""


def table(head: Sequence[str], rows: Iterable[Sequence[Any]], more: str = "") -> str:
    """A table of texts, and of HTML in `Raw`; `more` says where the rows are that are left out."""
    every = list(rows)
    if not every:
        return ""
    cell = f"padding:.12em .8em .12em 0;text-align:left;vertical-align:top;border:0;border-bottom:{_LINE}"
    first = "".join(f'<th style="{cell};font-weight:600">{text(name)}</th>' for name in head)
    lines = [f"<tr>{first}</tr>"] if any(head) else []
    for row in every[:ROWS]:
        cells = [x.html if isinstance(x, Raw) else text(x) for x in row]
        widths = [""] * (len(cells) - 1) + [";min-width:8em"]
        wide = "".join(f'<td style="{cell}{w}">{x}</td>' for w, x in zip(widths, cells, strict=True))
        lines.append(f"<tr>{wide}</tr>")
    left = len(every) - ROWS
    note = f"… {left} more{': ' + more if more else ''}" if left > 0 else ""
    style = "border-collapse:collapse;margin:.35em 0;background:none;color:inherit;font-size:.95em"
    whole = f'<table style="{style}">{"".join(lines)}</table>'
    return f'<div style="overflow-x:auto">{whole}</div>{paragraph(note, True) if note else ""}'


class Raw(NamedTuple):
    """HTML in the cell of a table."""

    html: str


def image(png: bytes | None, width: int, alternative: str) -> str:
    """A picture, in the page itself; nothing where there is none."""
    if png is None:
        return ""
    data = base64.b64encode(png).decode("ascii")
    return (
        f'<img src="data:image/png;base64,{data}" width="{width}" alt="{escape(alternative, quote=True)}" '
        f'style="display:block;max-width:100%;background:none"/>'
    )


def swatch(rgb: Sequence[float]) -> str:
    """A colour of linear red, green and blue."""
    codes = np.floor(np.clip(srgb_encode(np.clip(np.nan_to_num(np.asarray(rgb, float)), 0.0, 1.0)), 0, 1) * 255 + 0.5)
    colour = "#" + "".join(f"{int(x):02x}" for x in codes)
    style = f"display:inline-block;width:.85em;height:.85em;margin-right:.4em;border:{_LINE};vertical-align:-.1em"
    return f'<span style="{style};background:{colour}"></span>'


def sparkline(values: Sequence[float]) -> str:
    """Numbers of a spectrum or a table as a small curve."""
    y = np.asarray(values, float)
    known = np.isfinite(y)
    if known.sum() < 2:
        return ""
    low, high = float(y[known].min()), float(y[known].max())
    scale = (high - low) or 1.0
    x = np.linspace(1.0, 89.0, len(y))
    points = " ".join(
        f"{a:.1f},{15.0 - 14.0 * (b - low) / scale:.1f}" for a, b, k in zip(x, y, known, strict=True) if k
    )
    return (
        '<svg width="90" height="16" viewBox="0 0 90 16" style="vertical-align:-.2em;margin-right:.5em">'
        f'<polyline points="{points}" fill="none" stroke="currentColor" stroke-width="1.2"/></svg>'
    )


def frame(shown: Cut) -> str:
    """The whole of what is shown."""
    words = f' <span style="{_QUIET}">{text(shown.words)}</span>' if shown.words else ""
    head = f'<div style="margin:0 0 .2em"><b>{text(shown.title)}</b>{words}</div>'
    rest = f'<div style="min-width:0;flex:1 1 18em">{head}{"".join(shown.parts)}</div>'
    beside = f'<div style="flex:0 0 auto">{shown.picture}</div>' if shown.picture else ""
    style = "display:flex;flex-wrap:wrap;gap:.4em 1.1em;align-items:flex-start;color:inherit;background:none"
    return f'<div class="gonio" style="{style};max-width:62em;line-height:1.4">{beside}{rest}</div>'
