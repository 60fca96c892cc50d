"""What a material is, where its numbers come from, and how they are had again: as HTML."""

from __future__ import annotations

import re
from html import escape
from typing import Any

import numpy as np

from ...facts import words
from .told import Told, angle, copied, marked, n, table
from .typeset import typeset


def head(its: Told, level: int) -> str:
    """The name, a sphere, and the numbers that say most."""
    one = its.one
    cards: list[tuple[str, str]] = []
    if one["albedo"]:
        table_ = one["albedo"]["table"]
        for theta in (0.0, 45.0):
            k = int(np.abs(np.array(table_["theta_i"]) - theta).argmin())
            mean = float(np.mean(table_["values"][k]))
            cards.append((f"albedo at {angle(table_['theta_i'][k])}", n(mean, 3)))
    middle = min(one["peaks"], key=lambda p: abs(p["theta_i"] - 45.0), default=None)
    if middle is not None and np.isfinite(middle["peak"]):
        cards.append((f"largest f, light from {angle(middle['theta_i'])}", f"{n(middle['peak'], 3)} sr⁻¹"))
    if one["laws"]:
        laws = one["laws"]["laws"]
        held = sum(law["passed"] for law in laws)
        kind = "pass" if one["laws"]["passed"] else "breaks" if one["laws"]["lawful"] else "fail"
        cards.append(("laws that hold", f'<span class="verdict {kind}">{held} of {len(laws)}</span>'))
    if one["colour"] and one["colour"]["patches"]:
        code = one["colour"]["patches"][0]["hex"]
        cards.append(("colour of the albedo", f'<span class="swatch" style="background:{code}"></span>{code}'))
    kind = ' class="long"' if len(one["name"]) > 36 else ""
    sphere = next((x for x in [*its.pictures["spheres"][1:2], *its.pictures["spheres"]] if "src" in x), None)
    picture = f'<img src="{sphere["src"]}" alt="A lit sphere: {escape(sphere["caption"])}">' if sphere else ""
    items = "".join(f"<li><small>{small}</small><strong>{strong}</strong></li>" for small, strong in cards)
    return (
        f'<header class="head"><div><h{level}{kind}>{escape(one["name"])}</h{level}><p>{typeset(one["title"])}</p>'
        f'<ul class="cards">{items}</ul></div>{picture}</header>'
    )


def what(its: Told) -> str:
    """Formula, parameters, what a file holds."""
    f, one = its.facts, its.one
    rows = [("kind", typeset(one["title"]))]
    if "expression" in f:
        rows.append(("expression", f"<code>{escape(f['expression'])}</code>"))
    if "format" in f:
        held = ((name, text) for name, text in words.contents(f) if name != "repaired")
        rows += [("format", escape(f["format"])), *((typeset(name), marked(text)) for name, text in held)]
    rows += ((typeset(name), marked(text)) for name, text in words.optics(f))
    rows.append(("turned about the normal", "the same (isotropic)" if one["isotropic"] else "differs (anisotropic)"))
    parts = [table(("", ""), rows, kind="facts")]
    if f["parameters"]:
        cells = [
            (f"<code>{escape(path)}</code>", _value(p["value"]), _unit(p["unit"]),
             f"{n(p['low'], 6)} to {n(p['high'], 6)}", escape(p["doc"]))
            for path, p in f["parameters"].items()
        ]  # fmt: skip
        parts.append("<h4>Parameters</h4>" + table(("parameter", "value", "unit", "bounds", "meaning"), cells))
    if f["options"]:
        listed = [
            [f"<code>{escape(path)}</code>", *map(escape, (str(o["value"]), ", ".join(o["choices"]), o["doc"]))]
            for path, o in f["options"].items()
        ]
        parts.append("<h4>Options</h4>" + table(("option", "value", "choices", "meaning"), listed))
    parts.append("<h4>Formula</h4>" if "expression" in f else "<h4>How values come from the file</h4>")
    for told in one["formulas"]:
        source = f" Source: {typeset(told['source'])}" if told["source"] else ""
        parts.append(f'<div class="formula"><b>{escape(told["class"])}</b>  {typeset(told["formula"])}</div>')
        parts.append(f'<p class="of">{typeset(told["units"])}{source}</p>')
    return "".join(parts)


def _value(value: Any) -> str:
    values = np.atleast_1d(np.asarray(value, dtype=object)).ravel().tolist()
    shown = [n(x, 6) if isinstance(x, (int, float)) else escape(str(x)) for x in values[:8]]
    return ", ".join(shown) + (f" … ({len(values)} numbers)" if len(values) > 8 else "")


def _unit(unit: str) -> str:
    return "" if unit == "1" else typeset(re.sub(r"(?<=[a-z])(-\d)", r"^\1", unit))


def provenance(its: Told) -> str:
    """Where the numbers come from, and what to cite."""
    f = its.facts
    rows = []
    if "path" in f:
        rows.append(("file", escape(str((f["provenance"] or {}).get("file", f["path"])))))
        if f["bytes"]:
            rows.append(("size", f"{f['bytes']:,} bytes".replace(",", " ")))
        for name, text in words.provenance(f):
            rows.append((name, f'<code class="hash">{escape(text)}</code>' if name == "sha256" else escape(text)))
        rows += [("repaired", escape(repair["summary"])) for repair in f["repairs"]]
        if f["path"] and not f["repairs"]:
            rows.append(("repairs", "none: values are as the file has them"))
        for name, text in words.notes(f):
            if text and name != "columns":
                rows.append((escape(name), escape(text if len(text) <= 600 else text[:600] + " …")))
    else:
        rows.append(("origin", "a formula and its parameters, as above; no file was read"))
    if "source" in f:
        rows.append(("source of the numbers", escape(f["source"])))
    about = table(("", ""), rows, kind="facts")
    return f"{about}<details><summary>BibTeX to cite it</summary>{copied(its.one['citations'])}</details>"


def reproduce(its: Told) -> str:
    """Code and commands."""
    given = its.one["reproduce"]
    shell = copied("\n".join(given["shell"]))
    return f"<h4>In Python</h4>{copied(given['python'])}<h4>On the command line</h4>{shell}"
