"""Output of the command line: text, progress bars, JSON."""

from __future__ import annotations

import contextlib
import json
import os
import re
import sys
from collections.abc import Callable, Iterator
from typing import Any

import click

from ..errors import visible
from ..facts import finite


def echo(text: str, err: bool = False) -> None:
    """Print text for people, in which only gonio's own styles act on a terminal."""
    parts = _STYLE.split(text)
    shown = "".join(part if k % 2 else visible(part, keep="\n") for k, part in enumerate(parts))
    try:
        click.echo(shown, err=err, color=False if os.environ.get("NO_COLOR") else None)
    except BrokenPipeError:
        raise
    except OSError as error:  # which does not say where
        raise OSError(error.errno, error.strerror, "standard error" if err else "standard output") from None


def say(text: str) -> None:
    """Print text in which everything invisible is written out, but for the ends of lines."""
    echo(visible(text, keep="\n"))


_STYLE = re.compile("(\x1b\\[(?:0|1|31|32)m)")


@contextlib.contextmanager
def bar(what: str) -> Iterator[Callable[[int, int], None] | None]:
    """A `progress(done, total)` that draws a bar on stderr if that is a terminal, and wipes it in the end."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(what)
        yield lambda done, total: progress.update(task, completed=done, total=total)


def print_json(data: Any) -> None:
    """Print JSON, with null for NaN and infinity, which JSON lacks."""
    click.echo(json.dumps(finite(data), indent=2, allow_nan=False))
