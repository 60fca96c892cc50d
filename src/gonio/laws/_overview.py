"""Every model held to every law: which models there are, and the table as text."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from ..base.reflectance import Reflectance
from ..declared import discover
from ._verdict import Report


def models() -> dict[str, type[Reflectance]]:
    """The public classes of models/, by name."""
    return discover.classes("gonio.models", Reflectance)


def as_text(rows: Sequence[tuple[str, ...]], reports: dict[str, Report]) -> str:
    """The rows of `table`, aligned, the reasons of all that is not "pass", and a count."""
    header, *rows = rows
    top, below = zip(*map(_hyphenated, header), strict=True)
    lines = [top, below, *rows]
    widths = [max(len(line[c]) for line in lines) for c in range(len(header))]
    text = ["  ".join(f"{cell:<{w}}" for cell, w in zip(line, widths, strict=True)).rstrip() for line in lines]
    for model, report in reports.items():
        for start, reason in _reasons(report):
            text += ["", *textwrap.wrap(f"{model}  {start}: {reason}", 100, subsequent_indent="    ")]
    failed = sum(not r.lawful for r in reports.values())
    declared = sum(r.lawful and not r.passed for r in reports.values())
    good = len(reports) - failed - declared
    text += ["", f"{len(reports)} models: {good} obey every law, {declared} break some as declared, {failed} fail"]
    return "\n".join(text)


def _reasons(report: Report) -> Iterator[tuple[str, str]]:
    """Broken laws, and why; those that are declared for one reason together."""
    declared: dict[str, list[str]] = {}
    for law in report.laws:
        if law.verdict == "FAIL":
            yield f"FAIL  {law.name}", f"{law.finding}; {law.why}"
        elif law.verdict == "breaks":
            declared.setdefault(law.declared, []).append(law.name)
    for reason, names in declared.items():
        yield f"breaks  {', '.join(names)}", reason


def _hyphenated(name: str) -> tuple[str, str]:
    """A name in two lines, where it is long."""
    return (f"{name[:5]}-", name[5:]) if len(name) > 7 else (name, "")
