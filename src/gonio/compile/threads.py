"""How many threads compute, and handing them their parts of a batch."""

from __future__ import annotations

import _thread
import itertools
import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

from ..errors import ParameterError

_COUNT: list[int] = []


def threads(count: int | None = None) -> int:
    """How many threads compute f of NumPy arrays, and pictures; with `count`, from now on that many.

    At the start that is the environment variable GONIO_THREADS, or the number of processors this process may use.
    Batches below about 30 000 directions are computed by one thread.
    """
    if count is not None:
        if not isinstance(count, int) or isinstance(count, bool) or not 1 <= count <= 4096:
            raise ParameterError(f"threads({count!r}): expected a whole number from 1 to 4096")
        _COUNT[:] = [count]
    if not _COUNT:
        _COUNT.append(_from_environment())
    return _COUNT[0]


def _from_environment() -> int:
    text = os.environ.get("GONIO_THREADS", "")
    if not text:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not text.isdecimal() or not 1 <= int(text) <= 4096:
        raise ParameterError(f"GONIO_THREADS={text!r}: expected a whole number from 1 to 4096")
    return int(text)


class _Work:
    """Parts that threads take in turn, until there are none left, one has failed, or the caller leaves."""

    def __init__(self, work: Callable[..., Any], parts: list[tuple]):
        self.work, self.parts = work, parts
        self.numbers, self.open = itertools.count(), True
        self.helpers: list[_Helper] = []
        self.errors: list[BaseException] = []

    def take(self, after: Callable[[], Any] | None = None) -> None:
        while self.open and (number := next(self.numbers)) < len(self.parts):
            self.work(*self.parts[number])
            if after is not None:
                after()

    def help(self) -> None:
        helper = _Helper()
        self.helpers.append(helper)  # before it looks whether there is work: who ends the work looks for helpers then
        try:
            self.take()
        except BaseException as error:
            self.errors.append(error)
            self.open = False
        finally:
            helper.end()

    def end(self) -> None:
        self.open = False
        for helper in self.helpers:
            helper.wait()


class _Helper:
    """A thread that takes parts of some work, as others see it."""

    def __init__(self) -> None:
        self.ended, self.lock = False, _thread.allocate_lock()
        self.lock.acquire()

    def end(self) -> None:
        self.ended = True
        self.lock.release()

    def wait(self) -> None:
        while not self.ended:  # an interrupt may come after the lock was taken: nothing depends on who has it
            self.lock.acquire(timeout=0.05)


def share(work: Callable[..., Any], parts: Iterable[tuple], after: Callable[[], Any] | None = None) -> None:
    """Call `work(*part)` for every part, on all threads; `after()` on this one, after each part that it did itself.

    The first error, or an interrupt, is raised when the parts that are under way have ended; no others are begun.
    """
    job = _Work(work, list(parts))
    try:
        for _ in range(min(threads(), len(job.parts)) - 1):
            with suppress(RuntimeError):  # no more threads are to be had
                _thread.start_new_thread(job.help, ())
        job.take(after)
    finally:
        job.end()
    if job.errors:
        raise job.errors[0]


def apart(work: Callable[..., Any], *args: Any) -> Any:
    """`work(*args)`, called in a thread of its own, which no signal reaches: libraries lose their locks to interrupts.

    An interrupt is raised when the work has ended.
    """
    results: list[Any] = []
    errors: list[BaseException] = []
    helper, once, started = _Helper(), iter((True,)), False

    def run() -> None:
        if not next(once, False):
            return
        try:
            results.append(work(*args))
        except BaseException as error:
            errors.append(error)
        finally:
            helper.end()

    interrupt: BaseException | None = None
    while not helper.ended:
        try:
            if not started:
                _thread.start_new_thread(run, ())
                started = True
            helper.wait()
        except BaseException as error:
            if started or not isinstance(error, RuntimeError):
                interrupt = error
            else:  # no more threads are to be had
                run()
    if interrupt is not None:
        raise interrupt
    if errors:
        raise errors[0]
    return results[0]
