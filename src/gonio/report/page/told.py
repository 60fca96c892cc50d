"""What all sections of a report share: its contents, and how numbers, tables and reasons are written."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np

from .chart import number


def n(value: Any, digits: int = 4) -> str:
    """A number as text; a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "–"
    return re.sub(r"e([-+])0*(\d)", lambda e: f"e{e[1].strip('+')}{e[2]}", f"{value:.{digits}g}") if value else "0"


def angle(degrees: float, digits: int = 4) -> str:
    """An angle in HTML, which the page can turn into radians."""
    return f'<span data-deg="{degrees:.10g}">{number(float(f"{degrees:.{digits}g}"))}°</span>'


def marked(text: str) -> str:
    """Text as HTML, with the angles in it [degrees] as `angle` writes them."""
    return re.sub(r"(?<![\d.])(-?\d{1,9}(?:\.\d{1,9})?)°", lambda found: angle(float(found[1])), escape(text))


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: int = 0, kind: str = "") -> str:
    """A table of HTML cells; those from the column `numbers` on are numbers, where it is given. A first cell heads its
    row."""

    def cell(k: int, text: str, tag: str) -> str:
        mark = ' class="n"' if numbers and k >= numbers else ""
        return f"<{tag}{mark}>{text}</{tag}>"

    top = "".join(cell(k, text, "th") for k, text in enumerate(head))
    body = "".join(
        "<tr>" + "".join(cell(k, text, "th" if k == 0 else "td") for k, text in enumerate(row)) + "</tr>"
        for row in rows
    )
    above = f"<thead><tr>{top}</tr></thead>" if any(head) else ""
    return f'<div class="wide"><table class="{kind}">{above}<tbody>{body}</tbody></table></div>'


def copied(text: str) -> str:
    """A block of code that can be copied."""
    return f'<pre><code>{escape(text)}</code><button type="button" data-do="copy">copy</button></pre>'


def reason(text: str) -> str:
    """Why something is missing."""
    return f'<p class="reason">Not shown: {escape(text)}</p>'


class Told(NamedTuple):
    """The contents and the pictures of one material, and the beginning of the ids of its sections."""

    one: dict[str, Any]
    pictures: dict[str, Any]
    key: str

    @property
    def facts(self) -> dict[str, Any]:
        return self.one["facts"]

    def told(self, make: Callable[[Told], str], *parts: str) -> str:
        """A section, if there is the first of the parts that it tells of, with the reasons and warnings of parts."""
        is_there = not parts or bool(self.one.get(parts[0]) or self.pictures.get(parts[0]))
        named = parts if is_there else parts[:1]
        told = [make(self)] if is_there else []
        told += [reason(self.one["left_out"][name]) for name in named if name in self.one["left_out"]]
        told += [f'<p class="note">{escape(text)}</p>' for name in named for text in self.one["notes"].get(name, [])]
        return "".join(told)
