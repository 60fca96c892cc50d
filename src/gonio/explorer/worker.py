"""The process that loads, describes, checks and fits materials; `session.py` starts it.

It reads requests from standard input and writes answers to standard output, as `pipes.py` has them; the first one says
which materials there are. Each request has a thread. It ends with its standard input, whatever it still computes.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import threading
import traceback
import warnings
from pathlib import Path
from typing import IO, Any

from ..declared.version import __version__
from ..errors import Error, ExpressionError, visible
from ..facts.public import public
from .calls import CALLS
from .given import Given
from .messages import answer
from .pipes import receive, send
from .shelf import Shelf

NOTES = 20
"""The most warnings of an answer."""

QUIET = 2.0
"""Seconds without a request after which the worker gets ready for a first file."""

USED_BY_FILES = ("gonio.uncertainty", "xarray", "h5netcdf")
"""Modules that take long to import, and are first used by a file that is dropped."""


class _Notes(threading.local):
    """The warnings of the request that a thread answers."""

    def __init__(self) -> None:
        self.texts: list[str] = []


_notes = _Notes()


def main() -> None:
    """Answer requests until standard input ends."""
    requests, answers = _own_pipes()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends this process, after its own affairs
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("500")  # where memory ends, this process goes first
    warnings.simplefilter("always")
    warnings.showwarning = _note
    first = receive(requests)
    if first is not None:
        setup = json.loads(first[1])
        shelf = Shelf([Given(*map(_fixed, item)) for item in setup["given"]], Path(setup["uploads"]))
        lock = threading.Lock()
        send(answers, first[0], b"")
        if setup["early"]:
            threading.Thread(target=_describe, args=(shelf,), daemon=True).start()
        asked = threading.Event()
        threading.Thread(target=_get_ready, args=(asked,), daemon=True).start()
        while (piece := receive(requests)) is not None:
            asked.set()
            threading.Thread(target=_answer, args=(shelf, answers, lock, *piece), daemon=True).start()
    os._exit(0)  # whatever is still computed


def _describe(shelf: Shelf) -> None:
    """Describe the materials of the command line, before anybody asks; errors are told to who does."""
    for name in shelf.given:
        with contextlib.suppress(Exception):
            CALLS["material"].function(shelf, name)


def _get_ready(asked: threading.Event) -> None:
    """Import what a first file takes, once the page has what it asked for at first and asks for nothing more."""
    asked.wait()
    while asked.wait(QUIET):
        asked.clear()
    with contextlib.suppress(Exception):  # what fails here fails again, and is told, where it is asked for
        public("formats")()
    for name in USED_BY_FILES:
        with contextlib.suppress(Exception):  # the same: they may not be installed
            importlib.import_module(name)


def _fixed(x: Any) -> Any:
    return tuple(x) if isinstance(x, list) else x


def _own_pipes() -> tuple[IO[bytes], IO[bytes]]:
    """Standard input and output, for this module alone: what else is printed goes to standard error."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nowhere, 0)
    os.close(nowhere)
    os.dup2(2, 1)
    return requests, answers


def _note(message: Warning | str, *rest: Any, **named: Any) -> None:
    text = visible(" ".join(str(message).split()))
    if len(_notes.texts) < NOTES and text not in _notes.texts:
        _notes.texts.append(text)


def _answer(shelf: Shelf, answers: IO[bytes], lock: threading.Lock, job: int, message: bytes) -> None:
    request = json.loads(message)
    content = answered(shelf, request)
    with lock:
        try:
            send(answers, job, content)
        except OSError:  # nobody reads any more
            os._exit(0)


def answered(shelf: Shelf, request: dict[str, Any]) -> bytes:
    """The answer to a request."""
    head = {"id": request["id"]}
    _notes.texts.clear()
    try:
        result = CALLS[request["call"]].function(shelf, **request["arguments"])
        return answer({**head, "ok": True, "result": result, "notes": list(_notes.texts)})
    except Exception as error:
        return answer({**head, "ok": False, "error": in_words(error), "notes": list(_notes.texts)})


def in_words(error: Exception) -> str:
    """An error in the words of the command line; a fault of gonio is printed to standard error too."""
    if isinstance(error, ExpressionError):
        return str(error).partition("\n")[0]  # the other lines show the place
    if isinstance(error, Error):
        return str(error)
    if isinstance(error, MemoryError):
        return f"not enough memory: {str(error) or 'this takes more than there is'}; ask for less at a time"
    if isinstance(error, RecursionError):
        return "nested too deeply to be worked out; write it with fewer levels"
    if isinstance(error, OSError):
        return visible(f"{error.strerror or error}")
    traceback.print_exception(error)
    what = visible(f"{type(error).__name__}: {error!s:.200}")
    return f"{what}; a fault of gonio {__version__}, not of what was asked for: please report it"
