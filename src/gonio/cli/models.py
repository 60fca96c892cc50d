"""`gonio models`: the models, and what one of them is."""

from __future__ import annotations

import fnmatch
import re
import sys
from collections.abc import Sequence
from typing import Any

import click

from ..errors import NotFoundError, suggestion
from . import completion
from .options import json_option
from .tables import table
from .terminal import echo, print_json


@click.command(short_help="List the models, or say what one of them is.")
@click.argument("name", required=False, shell_complete=completion.models)
@json_option
def models(name: str | None, as_json: bool) -> None:
    """List the models, the distributions of facet normals and the Fresnel terms.

    With the NAME of one: its formula, parameters with units and bounds, source, and values to try. With a word, or a
    pattern with * and ?: those whose name or summary holds it.
    """
    from ..facts.models import every_model

    known = every_model()
    exact = [facts for facts in known if name and facts["name"].lower() == name.lower()]
    chosen = exact or (known if name is None else matching(known, name))
    if as_json:
        print_json(chosen)
    elif exact or len(chosen) == 1:
        echo(model_as_text(chosen[0]))
    else:
        echo(models_as_text(chosen))
        if sys.stdout.isatty():
            echo(f"\n{len(chosen)} in all; gonio models NAME says what one is, gonio show draws its example.")


def matching(known: Sequence[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    """Facts about those whose name or summary holds a word, or matches its * and ?. Raises NotFoundError for none."""
    mask = name.lower() if any(c in name for c in "*?[") else f"*{name.lower()}*"
    chosen = [x for x in known if fnmatch.filter((x["name"].lower(), x["summary"].lower()), mask)]
    if not chosen:
        by_lower = {x["name"].lower(): x["name"] for x in known}
        near = suggestion(name.lower()[:60], by_lower)
        for lower, spelled in by_lower.items():
            near = near.replace(f"{lower!r}", f"{spelled!r}")
        raise NotFoundError(f"no model {name!r:.60}{near or ';'} `gonio models` lists all")
    return chosen


def models_as_text(chosen: Sequence[dict[str, Any]]) -> str:
    """A table for each kind."""
    headings = list(dict.fromkeys(x["kind"] for x in chosen))
    width = max(len(x["name"]) for x in chosen)
    texts = []
    for heading in headings:
        rows = [(f"{x['name']:<{width}}", in_words(x["summary"])) for x in chosen if x["kind"] == heading]
        texts.append(table((heading.partition(" ")[0].lower().rstrip("s"), "what it is"), rows))
    return "\n\n".join(texts)


def in_words(summary: str) -> str:
    """A summary up to its formula."""
    return re.split(r"[:,]? \b[fFDr] = ", summary)[0].rstrip(",:").replace("`", "")


LABELS = ("looks", "shapes", "units", "error", "source")


def model_as_text(facts: dict[str, Any]) -> str:
    """Everything about one."""
    from ..formula.text import labelled

    paragraphs = [" ".join(text.split()) for text in facts["formula"].split("\n\n")]
    rows = [("name", facts["name"]), ("kind", facts["kind"])]
    rows += [("formula" if k == 0 else "", text.replace("`", "")) for k, text in enumerate(paragraphs)]
    rows += [(label, " ".join(facts[label].replace("`", "").split())) for label in LABELS if label in facts]
    rows += labelled("may break", facts["may_break"])
    rows.append(("example", facts["example"]))
    rows.append(("picture", f'gonio show "{facts["example"]}" -o {facts["name"]}.png; {facts["page"]}'))
    text = table(("", ""), rows).removeprefix("\n")
    cells = [(p["name"], p["default"], f"{p['range']}: {p['meaning']}") for p in facts["parameters"]]
    return text + ("\n\n" + table(("parameter", "default", "bounds: meaning"), cells) if cells else "")
