"""Processes of this machine that compute calls of functions: Pythons of our own, at the ends of pipes.

Nothing listens: jobs and results are pickles on pipes that only the two processes hold, and a child unpickles what its
parent wrote, and the parent what its child wrote. A child imports no script, so a script needs no guard; classes that
were made in one are sent with their code. A child ends when its parent does, however that ends.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import suppress
from queue import SimpleQueue
from typing import IO, Any

from ..errors import WorkerError, needed
from ..machine.interpreters import interpreters, no_interpreter

TRIES = 3
"""Processes that may die of a job before it counts as failed."""

ENDED = "the processes were ended before this was done"


class Processes(Executor):
    """As many processes as `count`, each with these variables in its environment; a job whose process dies is given to
    a new one, `TRIES` times in all. Functions and arguments are sent by cloudpickle."""

    def __init__(self, count: int, environment: Mapping[str, Any]):
        with needed("fits by processes need cloudpickle", 'pip install "gonio[fit]"'):
            import cloudpickle
        self._packed: Callable[[Any], bytes] = cloudpickle.dumps
        self._environment = {**os.environ, **{name: str(value) for name, value in environment.items()}}
        self._threads = ThreadPoolExecutor(count, "gonio-process")
        self._idle: SimpleQueue[subprocess.Popen[bytes] | None] = SimpleQueue()
        self._started: set[subprocess.Popen[bytes]] = set()
        self._lock = threading.Lock()
        self._is_ended = False
        for _ in range(count):
            self._idle.put(None)

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The future of a call in one of the processes."""
        return self._threads.submit(self._call, self._packed((fn, args, kwargs)))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all processes, whatever they compute."""
        with self._lock:
            self._is_ended = True
            for process in self._started:
                process.kill()
        self._threads.shutdown(wait, cancel_futures=True)
        for process in self._started:
            _close(process)

    def _call(self, packed: bytes) -> Any:
        process = self._idle.get()
        try:
            for _ in range(TRIES):
                if process is None or process.poll() is not None:
                    process = self._start()
                try:
                    _send(process.stdin, packed)
                    answer = _received(process.stdout)
                except OSError:
                    answer = None
                if answer is not None:
                    result, error = pickle.loads(answer)
                    if error is not None:
                        raise error
                    return result
                code = process.wait()
                self._forget(process)
                if self._is_ended:
                    raise WorkerError(ENDED)
            told = f"signal {-code}" if code < 0 else f"exit code {code}"
            raise WorkerError(
                f"a process that computed this ended, {TRIES} times ({told}); is there enough memory? fewer processes, "
                f"such as scheduler='processes:1', need less"
            )
        finally:
            self._idle.put(process)

    def _start(self) -> subprocess.Popen[bytes]:
        code = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve()"
        failures = []
        for program in interpreters():
            with self._lock:
                if self._is_ended:
                    raise WorkerError(ENDED)
                try:
                    process = subprocess.Popen(
                        [program, "-P", "-c", code],
                        stdin=subprocess.PIPE,
                        stdout=subprocess.PIPE,
                        env=self._environment,
                        start_new_session=True,  # Ctrl-C is the parent's affair
                    )
                except OSError as error:
                    failures.append(f"{program}: {error.strerror}")
                    continue
                self._started.add(process)
                return process
        raise no_interpreter("fits by processes run", failures)

    def _forget(self, process: subprocess.Popen[bytes]) -> None:
        with self._lock:
            self._started.discard(process)
        _close(process)


def _close(process: subprocess.Popen[bytes]) -> None:
    for pipe in (process.stdin, process.stdout):
        with suppress(OSError):
            pipe.close()  # type: ignore[union-attr]  # both are pipes
    process.wait()


def _send(pipe: IO[bytes] | None, packed: bytes) -> None:
    assert pipe is not None
    pipe.write(len(packed).to_bytes(8, "little") + packed)
    pipe.flush()


def _received(pipe: IO[bytes] | None) -> bytes | None:
    """The next message; None where the other side has ended."""
    assert pipe is not None
    length = int.from_bytes(pipe.read(8), "little")
    packed = pipe.read(length)
    return packed if length and len(packed) == length else None


def serve() -> None:
    """Be such a process: compute what comes, until nothing can come any more."""
    jobs, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what is printed is no answer
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    waiting: SimpleQueue[bytes] = SimpleQueue()

    def receive() -> None:
        while (packed := _received(jobs)) is not None:
            waiting.put(packed)
        os._exit(0)

    threading.Thread(target=receive, daemon=True).start()
    while True:
        _send(answers, _answer(waiting.get()))


def _answer(packed: bytes) -> bytes:
    """The result of a call and None, or None and its error, packed."""
    import cloudpickle

    try:
        function, args, kwargs = pickle.loads(packed)
        return cloudpickle.dumps((function(*args, **kwargs), None))
    except BaseException as error:
        try:
            return _checked(cloudpickle.dumps((None, error)))
        except Exception:
            return cloudpickle.dumps((None, WorkerError(f"{type(error).__name__}: {error}")))


def _checked(packed: bytes) -> bytes:
    """The bytes, if they can be unpacked."""
    pickle.loads(packed)
    return packed
