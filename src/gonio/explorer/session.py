"""The workers of a server: one that everybody asks, and one for each call that takes long.

A call that is not answered within `BUSY` seconds keeps its worker for itself: another one is started, and who waits is
asked there too; the first answer counts. So a call that takes too long, or whose page has gone, is ended with its
worker, and nobody else's. Calls change nothing in a worker but what it keeps for later ones.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import queue
import signal
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import WorkerError
from .calls import CALLS
from .pipes import receive, send
from .process import started

if TYPE_CHECKING:
    from .given import Given

AGAIN = "a new one answers the next question"

START = 60.0
"""Seconds that a worker has to start."""

BUSY = 1.0
"""Seconds after which a call keeps its worker for itself."""

WORKERS = 4
"""The most workers at a time, of some 200 MB each."""

FULL = 10.0
"""Seconds after which a call is ended where all other workers are kept by calls of their own."""

IDLE = 60.0
"""Seconds after which a worker is ended that nobody asks beside the first one."""

TICK = 0.05
"""Seconds between two looks at what takes long."""


class _Call:
    """A request, and who waits for its answer."""

    def __init__(self, message: bytes, seconds: float):
        self.message, self.seconds, self.asked = message, seconds, time.monotonic()
        self.answer: Future[bytes] = Future()
        self.workers = 0
        """How many work on it."""

    def answered(self, content: bytes) -> None:
        with contextlib.suppress(InvalidStateError):  # by another worker, or nobody waits any more
            self.answer.set_result(content)

    def failed(self, reason: str) -> None:
        with contextlib.suppress(InvalidStateError):
            self.answer.set_exception(WorkerError(reason))


class _Worker:
    """One process, and the calls that it has not answered, by the time at which it was asked."""

    def __init__(self, given: Sequence[Given], uploads: Path, early: bool):
        self.process = started()
        self.asked: dict[int, tuple[_Call, float]] = {}
        self.since = time.monotonic()
        self.is_ready = False
        self.ended = ""  # why
        self._numbers = itertools.count(1)
        self._lock = threading.Lock()
        self._is_gone = False
        self._requests: queue.SimpleQueue[tuple[int, bytes] | None] = queue.SimpleQueue()
        setup = {"given": list(given), "uploads": str(uploads), "early": early}
        self._requests.put((0, json.dumps(setup).encode()))
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        threading.Thread(target=self._write, daemon=True).start()

    def ask(self, call: _Call) -> bool:
        """Ask this one; False where it has ended."""
        with self._lock:
            if self.ended:
                return False
            number = next(self._numbers)
            self.asked[number] = call, time.monotonic()
            call.workers += 1
        self._requests.put((number, call.message))
        return True

    def calls(self) -> list[tuple[_Call, float]]:
        """What it has not answered, the oldest first, and since when."""
        with self._lock:
            return list(self.asked.values())

    def end(self, reason: str) -> None:
        """End the process, if it still runs."""
        with self._lock:
            self.ended = self.ended or f"what computes {reason}; {AGAIN}"
            self._kill()

    def wait(self) -> None:
        """Wait until the process is gone."""
        self._reader.join()

    def _kill(self) -> None:
        if not self._is_gone:
            with contextlib.suppress(ProcessLookupError):
                self.process.kill()

    def _write(self) -> None:
        with contextlib.suppress(OSError):  # it is gone: `_read` says so
            while (piece := self._requests.get()) is not None:
                send(self.process.requests, *piece)

    def _read(self) -> None:
        """Hand out answers until the process ends."""
        while (piece := receive(self.process.answers)) is not None:
            number, content = piece
            with self._lock:
                self.is_ready, self.since = True, time.monotonic()
                call, _ = self.asked.pop(number, (None, 0.0))
            if call is not None:
                call.answered(content)
        with self._lock:
            is_crash = not self.ended
            self._kill()
            code = self.process.wait()
            self._is_gone = True
            self.ended = self.ended or f"what computes has crashed ({_named(code)}); {AGAIN}"
            lost = [call for call, _ in self.asked.values()]
        self._requests.put(None)
        for call in lost:
            call.workers -= 1
            if is_crash and not call.workers:
                call.failed(self.ended)
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
    """Workers that are there whenever they are asked: `with Session(given, uploads) as session`."""

    def __init__(self, given: Sequence[Given], uploads: Path):
        self.given, self.uploads = list(given), uploads
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._first = self._started(early=True)
        self._next: _Worker | None = None
        """One that starts, or is idle, for the time when the first one is kept by a call."""
        self._kept: list[_Worker] = []
        self._calls: list[_Call] = []
        self._watch = threading.Thread(target=self._watched, daemon=True)
        self._watch.start()

    def ask(self, name: str, message: bytes) -> Future[bytes]:
        """The answer to a message of this call, in the future: WorkerError where there is none. Who cancels it waits no
        more, and a worker that nobody waits for is ended."""
        call = _Call(message, CALLS[name].seconds)
        with self._lock:
            if self._closing.is_set():
                raise WorkerError("what computes has been ended, with its server")
            try:
                self._ask(call)
            except OSError as error:
                raise WorkerError(f"no process can be started: {error.strerror or error}; close some") from None
            self._calls.append(call)
        return call.answer

    def _started(self, early: bool) -> _Worker:
        return _Worker(self.given, self.uploads, early)  # `early`: those of the command line may be what crashes

    def _ask(self, call: _Call) -> None:
        """Ask the first worker, or the one that takes its place."""
        while not self._first.ask(call):
            self._first, self._next = self._next or self._started(early=False), None

    def _watched(self) -> None:
        while not self._closing.wait(TICK if self._calls else 10 * TICK):
            with self._lock:
                self._look(time.monotonic())

    def _look(self, now: float) -> None:
        """End what took too long, and give the first worker back to all others."""
        for call in self._calls:
            if now - call.asked > call.seconds:
                call.failed(f"this took more than {call.seconds:g} s and was ended, alone; ask for less at a time")
        self._calls = [call for call in self._calls if not call.answer.done()]
        for worker in (self._first, *self._kept):
            late = [call for call, since in worker.calls() if now - since > BUSY]
            if late and all(call.answer.done() for call, _ in worker.calls()):
                worker.end("was ended, since nobody waited for it any more")
        self._relieve(now)
        self._kept = [worker for worker in self._kept if not worker.ended]
        for worker in [worker for worker in self._kept if not worker.calls()]:
            self._kept.remove(worker)
            if self._next is None:
                self._next = worker
            else:
                worker.end("was ended, since nobody asked it any more")
        if self._next is not None:
            if now - self._next.since > (IDLE if self._next.is_ready else START):
                self._next.end("was ended, since nobody asked it any more")
            if self._next.ended:
                self._next = None

    def _relieve(self, now: float) -> None:
        """Where a call keeps the first worker, have another one take its place."""
        calls = self._first.calls()
        if not calls or self._first.ended or now - calls[0][1] <= (BUSY if self._first.is_ready else START):
            return
        if self._next is None and len(self._kept) + 1 < WORKERS:
            with contextlib.suppress(OSError):
                self._next = self._started(early=False)
        if self._next is not None and self._next.is_ready:
            self._kept.append(self._first)
            self._first, self._next = self._next, None
        elif self._next is None and now - calls[0][1] > FULL:
            many = f"{len(self._kept)} others are computed, as many as at a time"
            calls[0][0].failed(f"this takes longer than {FULL:g} s, and {many}; ask again when one of them has ended")
            self._first.end("was ended, since too much is asked at a time")
        else:
            return
        for call, _ in calls[1:]:
            if not call.answer.done():
                self._ask(call)

    def close(self) -> None:
        """End the workers."""
        self._closing.set()
        self._watch.join()
        with self._lock:
            workers = [worker for worker in (self._first, self._next, *self._kept) if worker is not None]
        for worker in workers:
            worker.end("has been ended, with its server")
        for worker in workers:
            worker.wait()
        for call in self._calls:
            call.failed("what computes has been ended, with its server")

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *error: Any) -> None:
        self.close()
