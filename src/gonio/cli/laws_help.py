"""The help of a command that lists the laws."""

from __future__ import annotations

import textwrap
from itertools import chain

import click


class WithLaws(click.Command):
    """A command that lists the laws in its help, where LAWS stands; they are looked up when help is asked for."""

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the text above the options."""
        from ..laws import summaries

        laws = summaries()
        indent = " " * (max(map(len, laws)) + 2)
        said = [
            textwrap.wrap(text, 76, initial_indent=name.ljust(len(indent)), subsequent_indent=indent)
            for name, text in laws.items()
        ]
        self.help = (self.help or "").replace("LAWS", "\n".join(["\b", *chain.from_iterable(said)]))
        super().format_help_text(ctx, formatter)
