"""How the command line speaks: errors and warnings in one line each, progress bars, JSON."""

from __future__ import annotations

import contextlib
import json
import math
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NoReturn

import click

from .errors import Error, ExpressionError, MissingDataWarning

BAD_INPUT, INTERRUPTED = 2, 130


class Program(click.Group):
    """A group of commands in which every failure that is the input's becomes one line and exit code 2."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order in which they are written."""
        return list(self.commands)

    def main(  # type: ignore[override]
        self, args: Sequence[str] | None = None, prog_name: str | None = None, **extra: Any
    ) -> NoReturn:
        """Run and exit: the code is what the command returns, 0 if nothing."""
        try:
            with _announced_warnings():
                code = super().main(args, self.name, **{**extra, "standalone_mode": False})
        except click.UsageError as error:
            help_ = f"; see {error.ctx.command_path} --help" if error.ctx else ""
            _stop(error.format_message().strip().rstrip(".") + help_)
        except click.ClickException as error:
            _stop(error.format_message())
        except click.Abort:
            _stop("interrupted", INTERRUPTED)
        except ExpressionError as error:
            _stop(str(error).partition("\n")[0])  # the other lines show the place
        except Error as error:
            _stop(str(error))
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            _stop(f"{place}{error.strerror or error}")
        sys.exit(code if isinstance(code, int) else 0)


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _stop(message: str, code: int = BAD_INPUT) -> NoReturn:
    click.echo(f"gonio: error: {_one_line(message)}", err=True)
    sys.exit(code)


@contextlib.contextmanager
def _announced_warnings() -> Iterator[None]:
    """Warnings as one line each on stderr, without the place in the code."""

    def show(message: Warning | str, *rest: Any, **named: Any) -> None:
        click.echo(f"gonio: warning: {_one_line(str(message))}", err=True)

    with warnings.catch_warnings():
        warnings.simplefilter("default", MissingDataWarning)
        warnings.showwarning = show
        yield


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
    """Print JSON, with null for NaN and infinity, which it has not."""
    click.echo(json.dumps(_finite(data), indent=2, allow_nan=False))


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {k: _finite(v) for k, v in data.items()}
    if isinstance(data, (list, tuple)):
        return [_finite(v) for v in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def any_encoding() -> None:
    """Let what the terminal's encoding has not be printed as "?" rather than fail."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
