"""`gonio formats`: the file formats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from .options import json_option
from .tables import table
from .terminal import echo, print_json

if TYPE_CHECKING:
    from ..report.format_table import Format


@click.command("formats", short_help="List the file formats.")
@json_option
def formats_(as_json: bool) -> None:
    """List the file formats: their suffixes, whether they are read and written, and what they were checked against.

    Files are recognised by their content. A suffix of several formats does not say which one to write: name it.
    """
    from ..report.format_table import format_table

    rows = format_table()
    if as_json:
        print_json([row._asdict() for row in rows])
    else:
        echo(formats_as_text(rows))


def formats_as_text(rows: Sequence[Format]) -> str:
    """The table of file formats."""
    from ..report.format_table import sampled_in_words

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
