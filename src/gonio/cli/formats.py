"""`gonio formats`: the file formats, and the options of one."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from ..errors import NotFoundError
from . import completion
from .options import json_option
from .tables import table
from .terminal import echo, print_json

if TYPE_CHECKING:
    from ..facts.format_table import Format


@click.command("formats", short_help="List the file formats, or the options of one.")
@click.argument("name", nargs=-1, shell_complete=completion.formats)
@json_option
def formats_(name: tuple[str, ...], as_json: bool) -> None:
    """List the file formats: their suffixes, whether they are read and written, and what they were checked against.

    With the NAME or a suffix of a format: its options too, with meanings and values. Files are recognized by their
    content. A suffix of several formats does not say which one to write: name it.
    """
    from ..facts.format_table import format_table

    rows = format_table()
    chosen = formats_named(rows, " ".join(name)) if name else rows
    if as_json:
        print_json([row.to_json() for row in chosen])
    else:
        echo("\n\n\n".join(map(format_as_text, chosen)) if name else formats_as_text(rows))


def formats_as_text(rows: Sequence[Format]) -> str:
    """The table of file formats."""
    from ..facts.format_table import sampled_in_words

    cells = []
    for row in rows:
        meaning = f"{row.description}; checked against: {row.oracle}"
        cells.append((row.name, " ".join(row.suffixes), row.access, sampled_in_words(row), meaning))
    return table(("format", "suffixes", "access", "sampled", "what it is"), cells)


def formats_named(rows: Sequence[Format], name: str) -> list[Format]:
    """The formats of that name, in any case, or with that suffix. Raises NotFoundError."""
    word = name.lower()
    fitting = [row for row in rows if word in (row.name.lower(), *row.suffixes, *(s.lstrip(".") for s in row.suffixes))]
    if not fitting:
        close = difflib.get_close_matches(word, [row.name.lower() for row in rows], n=1)
        guess = next((f"; did you mean {row.name}?" for row in rows if row.name.lower() in close), ";")
        raise NotFoundError(f"{name!r:.60}: no format of this name or suffix{guess} `gonio formats` lists them")
    return fitting


def format_as_text(row: Format) -> str:
    """A file format and its options."""
    from ..facts.format_table import sampled_in_words

    facts = [
        ("format", f"{row.name}: {row.description}"),
        ("suffixes", " ".join(row.suffixes) + (" (shared: name the format to write)" if row.shared_suffix else "")),
        ("access", row.access),
        ("sampled", sampled_in_words(row)),
        ("holds", "both sides, reflection and transmission" if row.both_sides else "the reflection of one side"),
        ("checked", f"against {row.oracle}"),
    ]
    text = [table(("", ""), facts).removeprefix("\n")]
    for title, options in (("option to read", row.read_options), ("option to write", row.write_options or {})):
        cells = [(name, option.usual, f"{option.expected}: {option.declared.doc}") for name, option in options.items()]
        if cells:
            text.append(table((title, "default", "value: meaning"), cells))
    return "\n\n".join(text)
