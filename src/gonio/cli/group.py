"""The group of all commands: which there are, how a run of one begins, and the line and the code in which it ends."""

from __future__ import annotations

import contextlib
import os
import sys
import traceback
import warnings
from collections.abc import Iterator, Sequence
from types import FunctionType
from typing import Any, NoReturn

import click

from ..declared.discover import docstring
from ..declared.version import __version__
from ..errors import Error, ExpressionError, LeftOutWarning, MissingDataWarning, visible
from ..facts.public import asked_of_one
from .terminal import echo

BAD_INPUT, FAULT, INTERRUPTED, NOBODY_READS = 2, 70, 130, 141
"""Exit codes; the last three are those of sysexits.h and of a shell, for SIGINT and SIGPIPE."""


class CommandGroup(click.Group):
    """Commands that are written, and those that are public functions: bad input and failures of the machine end in one
    line and exit code 2.

    Help comes from the docstrings, under `python -OO` too.
    """

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self.help = _help(self)

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Register a command."""
        cmd.help = _help(cmd)
        super().add_command(cmd, name)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order in which they are written."""
        return list(self.commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of this name."""
        from .functions import command_of

        return super().get_command(ctx, cmd_name) or command_of(cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command of these words, and its own; where there is none, names like it."""
        try:
            return super().resolve_command(ctx, args)
        except click.exceptions.NoSuchCommand as error:
            functions = [name.replace("_", "-") for name in asked_of_one()]
            names = sorted({*self.commands, *functions})
            raise click.exceptions.NoSuchCommand(error.command_name, possibilities=names, ctx=ctx) from None

    def make_context(self, *args: Any, **more: Any) -> click.Context:
        """Parse the words of a command line."""
        with _somebody_reads():
            return super().make_context(*args, **more)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        with _somebody_reads():
            return super().invoke(ctx)

    def main(  # type: ignore[override]  # fewer arguments than click's
        self, args: Sequence[str] | None = None, prog_name: str | None = None, **extra: Any
    ) -> NoReturn:
        """Run a command and exit, with the code that it returns, or 0."""
        try:
            with _announced_warnings():
                code = super().main(args, self.name, **{**extra, "standalone_mode": False})
        except click.UsageError as error:
            help_ = f"; see {error.ctx.command_path} --help" if error.ctx else ""
            _stop(error.format_message().strip().rstrip(".") + help_)
        except click.ClickException as error:
            _stop(error.format_message())
        except click.Abort as error:
            if isinstance(error.__cause__, EOFError):
                _fault(error.__cause__)
            _stop("interrupted", INTERRUPTED)
        except ExpressionError as error:
            _stop(str(error).partition("\n")[0])  # the other lines show the place
        except Error as error:
            _stop(str(error))
        except MemoryError as error:
            _stop(f"not enough memory: {str(error) or 'this takes more than there is'}; ask for less at a time")
        except RecursionError:
            _stop("nested too deeply to be worked out; write it with fewer levels")
        except OSError as error:
            place = f"{os.fsdecode(error.filename)}: " if isinstance(error.filename, (str, bytes)) else ""
            _stop(f"{place}{error.strerror or error}")
        except Exception as error:
            _fault(error)
        sys.exit(code if isinstance(code, int) else 0)


def _help(command: click.Command) -> str | None:
    text = docstring(command.callback) if isinstance(command.callback, FunctionType) else ""
    return text or command.help


@contextlib.contextmanager
def _somebody_reads() -> Iterator[None]:
    """Stop silently where the reader of the output has gone, as `head` goes."""
    try:
        yield
    except BrokenPipeError:
        _drop("stdout", "stderr")
        raise click.exceptions.Exit(NOBODY_READS) from None


def _drop(*names: str) -> None:
    """Lead standard streams to nowhere: as it ends, Python flushes them, and complains if it cannot."""
    for name in names:
        setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115  (open until the process ends)


def _one_line(text: str) -> str:
    return visible(" ".join(text.split()))


def _stop(message: str, code: int = BAD_INPUT) -> NoReturn:
    _say(f"gonio: error: {_one_line(message)}")
    with contextlib.suppress(AttributeError, ValueError):  # none, or closed
        try:
            sys.stdout.flush()
        except OSError:  # what it has not taken it never will
            _drop("stdout")
    sys.exit(code)


def _fault(error: BaseException) -> NoReturn:
    """End a run that met a mistake in gonio."""
    _say("".join(traceback.format_exception(error)))
    _stop(
        f"{type(error).__name__}: a fault of gonio {__version__}, not of what was asked for; please report it, with "
        f"the lines above and the command",
        FAULT,
    )


def _say(text: str) -> None:
    """Print to standard error, if anybody is there to read it."""
    try:
        echo(text, err=True)
    except (OSError, ValueError):
        _drop("stderr")


@contextlib.contextmanager
def _announced_warnings() -> Iterator[None]:
    """Warnings as one line each on stderr, without the place in the code."""

    def show(message: Warning | str, *rest: Any, **named: Any) -> None:
        _say(f"gonio: warning: {_one_line(str(message))}")

    with warnings.catch_warnings():
        for category in (MissingDataWarning, LeftOutWarning):
            warnings.simplefilter("default", category)
        warnings.showwarning = show
        yield


def streams() -> None:
    """Prepare standard input, output and error.

    Characters that the terminal's encoding lacks are printed as "?". Closed streams lead to nowhere, so that no opened
    file gets their numbers; without a standard output gonio stops.
    """
    closed = [number for number in range(3) if not _is_open(number)]
    for _ in closed:
        os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    if sys.stderr is None:
        _drop("stderr")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    if sys.stdout is None:
        _stop("standard output is closed; lead it to /dev/null if it is not wanted")


def _is_open(number: int) -> bool:
    try:
        os.fstat(number)
    except OSError:
        return False
    return True
