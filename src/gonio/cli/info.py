"""`gonio info`: a material, and the contents of a file."""

from __future__ import annotations

from typing import Any

import click
import numpy as np

from ..formula.text import literal
from .options import TypedMaterial, json_option, material_argument
from .tables import size_in_words, table
from .terminal import echo, print_json

LONGEST = 300
"""Characters of a note of a file; JSON has all of it."""


@click.command(short_help="Say what MATERIAL is, and what a file holds.")
@material_argument
@json_option
def info(material: TypedMaterial, as_json: bool) -> None:
    """Say what MATERIAL is: formula, parameters, channels, albedo; of a file also what it holds and lacks."""
    from ..facts.material import facts

    about = facts(material.text, material.read())
    if as_json:
        print_json(about)
    else:
        echo(facts_as_text(about))


def facts_as_text(facts: dict[str, Any]) -> str:
    """Facts about a material (see `facts.material`) as a table."""
    from ..facts import words

    rows = [("name", facts["material"])]
    if "built_in" in facts:
        rows.append(("built in", f"{facts['built_in']}: {facts['description']}"))
    if "format" in facts:
        rows.append(("format", facts["format"] + (f", {size_in_words(facts['bytes'])}" if facts["bytes"] else "")))
        if facts["published_as"]:
            rows.append(("recognized", f"bit by bit the published file of {facts['published_as']}"))
        rows += [(name, text if len(text) <= LONGEST else f"{text[:LONGEST]} ...") for name, text in words.notes(facts)]
        rows += [(f"  {name}" if name in facts["axes"] else name, text) for name, text in words.contents(facts)]
    else:
        rows.append(("formula", facts["expression"]))
    rows += words.optics(facts)
    if "source" in facts:
        rows.append(("source", facts["source"]))
    text = table(("", ""), [*rows, *words.provenance(facts)]).removeprefix("\n")
    listed = [
        (path, _value(p["value"]), f"{p['low']:g} ... {p['high']:g}", _meaning(p))
        for path, p in facts["parameters"].items()
    ]
    listed += [
        (path, o["value"], "a word", f"{o['doc']}: {', '.join(o['choices'])}") for path, o in facts["options"].items()
    ]
    if listed:
        text += "\n\n" + table(("parameter", "value", "bounds", "meaning"), listed)
    return text


def _meaning(parameter: dict[str, Any]) -> str:
    unit = "" if parameter["unit"] == "1" else f" [{parameter['unit']}]"
    alias = parameter.get("alias", "").rpartition(".")[2]
    return parameter["doc"] + unit + (f"; {alias} sets it with what is tied to it" if alias else "")


def _value(value: Any) -> str:
    if np.ndim(value) == 0:
        return f"{value:.6g}"
    if np.ndim(value) > 1:
        return f"{literal(np.asarray(value))[:30]} ..."
    first = ", ".join(f"{v:.5g}" for v in value[:3])
    return first if len(value) <= 3 else f"{first}, ... ({len(value)})"
