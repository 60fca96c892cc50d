"""`gonio materials`: the built-in materials."""

from __future__ import annotations

import fnmatch
import sys
from typing import TYPE_CHECKING

import click

from .options import json_option
from .tables import table
from .terminal import echo, print_json

if TYPE_CHECKING:
    from ..catalogue.builtin import Entry


@click.command(short_help="List the built-in materials.")
@click.argument("pattern", required=False)
@json_option
def materials(pattern: str | None, as_json: bool) -> None:
    """List the built-in materials, those that match PATTERN (a word, or with * and ?)."""
    entries = matching(pattern)
    if as_json:
        from dataclasses import asdict

        print_json([asdict(entry) for entry in entries])
        return
    rows = [(e.name, e.kind, e.description) for e in entries]
    echo(table(("name", "kind", "what it is"), rows))
    if sys.stdout.isatty():
        echo(f"\n{len(rows)} materials; gonio info NAME says more, gonio cite NAME where it is from.")


def matching(pattern: str | None) -> list[Entry]:
    """Built-in materials with a name, kind, description or alias that holds the word, or matches its * and ?."""
    from ..catalogue import builtin
    from ..errors import NotFoundError

    entries = builtin.materials()
    if not pattern:
        return entries
    mask = pattern.lower() if any(c in pattern for c in "*?[") else f"*{pattern.lower()}*"
    chosen = [e for e in entries if fnmatch.filter(map(str.lower, (e.name, e.kind, e.description, *e.aliases)), mask)]
    if not chosen:
        raise NotFoundError(f"no built-in material matches {pattern!r}{builtin.hint(pattern)}")
    return chosen
