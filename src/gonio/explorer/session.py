"""The worker of a server: started, asked, ended where it takes too long, and started anew where it is gone."""

from __future__ import annotations

import contextlib
import itertools
import json
import signal
import threading
from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Error
from .messages import CALLS
from .pipes import receive, send
from .process import started

if TYPE_CHECKING:
    from .given import Given

AGAIN = "a new one answers the next question"

START = 60.0
"""Seconds that a worker has to start."""


class WorkerError(Error, RuntimeError):
    """The process that computes is gone: it crashed, or was ended because it took too long."""


class _Worker:
    """One process, and who waits for its answers."""

    def __init__(self, given: Sequence[Given], uploads: Path, early: bool):
        self.process = started()
        self._waiting: dict[int, Future[bytes]] = {}
        self._numbers = itertools.count(1)
        self._writing, self._noting = threading.Lock(), threading.Lock()
        self._started = threading.Event()
        self._is_gone = False
        self.ended = ""  # why
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        with contextlib.suppress(OSError):
            setup = {"given": list(given), "uploads": str(uploads), "early": early}
            send(self.process.requests, 0, json.dumps(setup).encode())

    def ask(self, message: bytes, seconds: float) -> bytes:
        """The answer to a message. Raises WorkerError where the process ends before it is there."""
        answer: Future[bytes] = Future()
        with self._noting:
            if self.ended:
                raise WorkerError(self.ended)
            number = next(self._numbers)
            self._waiting[number] = answer
        if not self._started.wait(START):
            self.end(f"did not start within {START:g} s")
        watch = threading.Timer(seconds, self.end, [f"took more than {seconds:g} s and was ended"])
        watch.daemon = True
        watch.start()
        try:
            with contextlib.suppress(OSError), self._writing:  # it is gone: `_read` says so
                send(self.process.requests, number, message)
            return answer.result()
        finally:
            watch.cancel()

    def end(self, reason: str) -> None:
        """End the process, if it still runs."""
        with self._noting:
            self.ended = self.ended or f"what computes {reason}; {AGAIN}"
            self._kill()

    def wait(self) -> None:
        """Wait until the process is gone."""
        self._reader.join()

    def _kill(self) -> None:
        if not self._is_gone:
            with contextlib.suppress(ProcessLookupError):
                self.process.kill()

    def _read(self) -> None:
        """Hand out answers until the process ends."""
        while (piece := receive(self.process.answers)) is not None:
            number, content = piece
            self._started.set()
            with self._noting:
                waiting = self._waiting.pop(number, None)
            if waiting is not None:
                waiting.set_result(content)
        with self._noting:
            self._kill()
            code = self.process.wait()
            self._is_gone = True
            self.ended = self.ended or f"what computes has crashed ({_named(code)}); {AGAIN}"
            lost = list(self._waiting.values())
            self._waiting.clear()
        self._started.set()
        for waiting in lost:
            waiting.set_exception(WorkerError(self.ended))
        for pipe in (self.process.requests, self.process.answers):
            with contextlib.suppress(OSError):
                pipe.close()


def _named(code: int) -> str:
    """An exit code in words."""
    try:
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"
    except ValueError:
        return f"signal {-code}"


class Session:
    """A worker that is there whenever it is asked: `with Session(given, uploads) as session`."""

    def __init__(self, given: Sequence[Given], uploads: Path):
        self.given, self.uploads = list(given), uploads
        self._lock = threading.Lock()
        self._closed = False
        self._worker = _Worker(self.given, uploads, early=True)

    def ask(self, name: str, message: bytes) -> bytes:
        """The answer of the worker to a message of this call. Raises WorkerError where there is none."""
        with self._lock:
            if self._closed:
                raise WorkerError("what computes has been ended, with its server")
            if self._worker.ended:
                self._worker = _Worker(self.given, self.uploads, early=False)  # it may be one of these that crashes
            worker = self._worker
        return worker.ask(message, CALLS[name].seconds)

    def close(self) -> None:
        """End the worker."""
        with self._lock:
            self._closed = True
            worker = self._worker
        worker.end("has been ended, with its server")
        worker.wait()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *error: Any) -> None:
        self.close()
