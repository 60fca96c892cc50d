"""What the command line prints: tables, and what was found out about materials, files and conversions, as text."""

from __future__ import annotations

import fnmatch
import math
import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

import click
import numpy as np

from ..catalogue import builtin
from ..catalogue.builtin import Entry
from ..conversion.conversion import Conversion, labelled, percent
from ..errors import NotFoundError, visible
from ..formula.text import literal
from ..integrals.efficiency import Efficiency
from ..report.format_table import Format, sampled_in_words

NARROWEST = 20
"""Characters of a line of text, however narrow the terminal is."""

PARAMETERISATIONS = {
    "angles": "polar angles and azimuths of both directions",
    "half_difference": "half and difference angles",
    "specular": "angles about the mirror direction",
}


def matching(pattern: str | None) -> list[Entry]:
    """Built-in materials of which name, kind, description or alias holds the word, or matches its * and ?."""
    entries = builtin.materials()
    if not pattern:
        return entries
    wanted = pattern.lower() if any(c in pattern for c in "*?[") else f"*{pattern.lower()}*"
    found = [
        e
        for e in entries
        if any(fnmatch.fnmatchcase(x.lower(), wanted) for x in (e.name, e.kind, e.description, *e.aliases))
    ]
    if not found:
        raise NotFoundError(f"no built-in material matches {pattern!r}{builtin.hint(pattern)}")
    return found


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


def efficiency_table(rows: Iterable[Efficiency]) -> str:
    """Rows of `sampling_efficiency`, aligned, with what the columns mean."""
    header = ("theta_o", "lobe", "chosen", "mean weight", "scatter", "effective", "lost")
    cells = [
        (f"{r.theta_o:g}", r.lobe, f"{r.chosen:.1%}", f"{r.mean:.4g}", f"{r.scatter:.3g}", f"{r.effective:.1%}",
         f"{r.lost:.2%}")
        for r in rows
    ]  # fmt: skip
    meaning = (
        "scatter: standard deviation of a weight over the mean; effective: as many samples of equal weight would say "
        "as much; lost: below the horizon"
    )
    return table(header, cells) + "\n" + "\n".join(textwrap.wrap(meaning, max(min(_width(), 100), NARROWEST)))


def _heading(line: str, bold: bool) -> str:
    return click.style(line, bold=True) if bold and line else line


def _width() -> int:
    return shutil.get_terminal_size((100, 24)).columns if sys.stdout.isatty() else 10_000


def facts_as_text(found: dict[str, Any]) -> str:
    """What `facts` found, for people."""
    rows = [("name", found["material"])]
    if "built_in" in found:
        rows.append(("built in", f"{found['built_in']}: {found['description']}"))
    rows += _file_rows(found) if "format" in found else [("formula", found["expression"])]
    rows.append(("channels", _channels(found)))
    if "albedo" in found:
        values = found["albedo"]["values"]
        parts = [f"{_spectrum(v)} at {t:g}°" for t, v in zip(found["albedo"]["theta_i"], values, strict=True)]
        rows.append(("albedo", ", ".join(parts)))
    for assumed, spread in found.get("uncertainty_of_albedo", {}).items():
        at = ", ".join(f"{_spectrum(v)} at {t:g}°" for t, v in zip(found["albedo"]["theta_i"], spread, strict=True))
        rows.append(("u of albedo", f"{at}, of {assumed} errors"))
    rows += [(name, _within(off)) for name, off in found.get("symmetry", {}).items()]
    if found["has_delta"]:
        rows.append(("mirror", "has a delta lobe: f is 0 pointwise, sampling and integrals are exact"))
    rows += labelled("may break", found["breaks"])
    if "source" in found:
        rows.append(("source", found["source"]))
    rows += _provenance_rows(found.get("provenance"))
    text = table(("", ""), rows).removeprefix("\n")
    listed = [
        (path, _value(p["value"]), f"{_number(p['low'])} ... {_number(p['high'])}", _meaning(p))
        for path, p in found["parameters"].items()
    ]
    listed += [
        (path, o["value"], "a word", f"{o['doc']}: {', '.join(o['choices'])}") for path, o in found["options"].items()
    ]
    if listed:
        text += "\n\n" + table(("parameter", "value", "bounds", "meaning"), listed)
    return text


def _file_rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    """What a file is and holds."""
    size = f", {size_in_words(found['bytes'])}" if found["bytes"] else ""
    rows = [("format", found["format"] + size)]
    if found["published_as"]:
        rows.append(("recognised", f"bit by bit the published file of {found['published_as']}"))
    rows += [(k.replace("_", " "), _short(v)) for k, v in found["about"].items() if v not in ("", None)]
    rows.append(("quantity", found["quantity"]))
    if found["parameterisation"]:
        rows.append(("grid", PARAMETERISATIONS.get(found["parameterisation"], found["parameterisation"])))
    rows += [(f"  {name}", _nodes(axis)) for name, axis in found["axes"].items()]
    if found["rows"]:
        rows.append(("measured", f"{found['rows']} pairs of directions, in no grid"))
    rows.append(("table", " x ".join(map(str, found["shape"]))))
    rows.append(("missing", _share(found["missing"])))
    if found["negative"] is not None:
        rows.append(("negative", _share(found["negative"])))
    spread = found["uncertainty"]
    if spread:
        low, median, high = (percent(spread[name]) for name in ("low", "median", "high"))
        rows.append(("uncertainty", f"{low} to {high} of the value, {median} (median)"))
        if spread["unknown"] > 0.0:
            rows.append(("", f"unknown for {percent(spread['unknown'])} of the values"))
    if found["scale_uncertainty"]:
        rows.append(("scale", f"uncertain by {percent(found['scale_uncertainty'])}"))
    rows += [("repaired", r["summary"]) for r in found["repairs"]]
    return rows


def _nodes(axis: dict[str, Any]) -> str:
    if axis["nodes"] == 1:
        return f"{axis['low']:.4g}° only"
    step = "uneven" if axis["step"] is None else f"every {axis['step']:.4g}°"
    return f"{axis['nodes']} nodes from {axis['low']:.4g}° to {axis['high']:.4g}°, {step}"


def _within(off: dict[str, float] | None) -> str:
    if off is None:
        return "unknown: no data to compare"
    if off["high"] == 0.0:
        return "exactly"
    return f"to {percent(off['median'])} of f (median), {percent(off['high'])} (99th percentile)"


def _provenance_rows(held: dict[str, Any] | None) -> list[tuple[str, str]]:
    if not held:
        return []
    rows = [("sha256", held["sha256"])] if "sha256" in held else []
    if "gonio" in held:
        rows.append(("read by", f"gonio {held['gonio']}"))
    if "options" in held:
        rows.append(("read with", ", ".join(f"{k}={v}" for k, v in held["options"].items())))
    return rows + _made_from(held.get("converted_from"))


def _made_from(made: Any) -> list[tuple[str, str]]:
    """What something was made of, what that was made of, and so on."""
    if isinstance(made, list):
        return [row for of in made for row in _made_from(of)]
    if not isinstance(made, dict):
        return []
    what = made.get("file") or made.get("material", "?")
    digest = f", {made.get('format')}, sha256 {made['sha256']}" if "sha256" in made else ""
    row = ("made from", f"{what}{digest}, by {made.get('converted_by', 'gonio')}")
    return [row, *_made_from(made.get("converted_from"))]


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 300 else f"{text[:300]} ..."


def conversion_as_text(found: Conversion) -> str:
    """What a conversion changed and lost, for people."""
    return table(("", ""), found.rows()).removeprefix("\n")


def formats_as_text(rows: Sequence[Format]) -> str:
    """The table of file formats."""
    cells = [
        (
            row.name,
            " ".join(row.suffixes),
            "read, write its own" if row.own_kind else "read, write" if row.written else "read",
            sampled_in_words(row),
            f"{row.description}; checked against: {row.oracle}",
        )
        for row in rows
    ]
    return table(("format", "suffixes", "access", "sampled", "what it is"), cells)


def _meaning(parameter: dict[str, Any]) -> str:
    unit = "" if parameter["unit"] == "1" else f" [{parameter['unit']}]"
    alias = parameter.get("alias", "").rpartition(".")[2]
    return parameter["doc"] + unit + (f"; {alias} sets it with what is tied to it" if alias else "")


def _share(x: float) -> str:
    if x == 0.0:
        return "none"
    return f"{x:.2%} of the table" if x >= 1e-4 else f"{x:.1e} of the table"


def size_in_words(n: int) -> str:
    """A number of bytes, to three digits."""
    for unit, size in (("MB", 1e6), ("kB", 1e3)):
        if n >= size:
            return f"{n / size:.3g} {unit}"
    return f"{n} bytes"


def _channels(found: dict[str, Any]) -> str:
    names, count = found["channel_names"], found["channels"]
    if names is None:
        return "1: gray" if count == 1 else str(count)
    if isinstance(names[0], str):
        return f"{count}: linear {''.join(names)}" if names == list("RGB") else f"{count}: {', '.join(names)}"
    if count <= 4:
        return f"{count}: {', '.join(f'{x:g}' for x in names)} nm"
    return f"{count}: {names[0]:g} to {names[-1]:g} nm"


def _spectrum(values: Any) -> str:
    values = np.atleast_1d(values)
    if len(values) <= 4:
        return " ".join(f"{v:.3g}" for v in values)
    return f"{np.min(values):.3g} to {np.max(values):.3g}"


def _number(x: float) -> str:
    return "inf" if math.isinf(x) else f"{x:g}"


def _value(value: Any) -> str:
    flat = np.ravel(value)
    if np.ndim(value) == 0:
        return f"{value:.6g}"
    if np.ndim(value) > 1:
        return f"{literal(np.asarray(value))[:30]} ..."
    shown = ", ".join(f"{v:.5g}" for v in flat[:3])
    return shown if len(flat) <= 3 else f"{shown}, ... ({len(flat)})"
