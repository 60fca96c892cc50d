"""The only pool of threads: helpers of callers, with compiled kernels and with parts of work of Python.

A caller works itself, and helpers that are awake join in. One compiled call posts a kernel, takes part in it and waits
until the last helper has left. Python raises nothing during that call: an interrupt comes before or after it, when
nobody writes to the caller's memory. Each kernel has a round, a number that only grows, so that remains of an
interrupted call are never mistaken for a new one. A helper first watches for the next round without the interpreter's
lock, because the system takes longer to wake a thread than a kernel to compute ten thousand directions. Then it looks
for a `Job`, and sleeps.
"""

from __future__ import annotations

import _thread
import ctypes
import itertools
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from typing import Any
from weakref import ref

from ..errors import Error
from ..machine.aside import Ending
from . import store
from .llvm import rounds

PATIENCE = 4000  # looks, of about 50 ns each, before a helper sleeps


@cache
def _help() -> Any:
    return _compiled(rounds.HELP, ctypes.c_int64)


@cache
def _lead() -> Any:
    return _compiled(rounds.LEAD, None)


def _compiled(text: str, result: Any) -> Any:
    """A function that takes words of `ctypes` as they are."""
    text = rounds.complete(text)
    return _immortal(store.function(text, lambda: text, ctypes.CFUNCTYPE(result)))


def _immortal(thing: Any) -> Any:
    """The same, never freed: helpers are still awake in it while the interpreter ends."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))
    return thing


def _yield() -> int:
    """The address of sched_yield, which lets other threads run, or else of some harmless function."""
    libc = ctypes.CDLL(None) if os.name == "posix" else ctypes.CDLL("msvcrt")
    function = libc.sched_yield if hasattr(libc, "sched_yield") else libc.clock
    return ctypes.cast(function, ctypes.c_void_p).value or 0


_processor = getattr(ctypes.pythonapi, "sched_getcpu", None) if hasattr(os, "sched_setaffinity") else None


class _Here(threading.local):
    """The work of this thread: a helper takes parts of others' jobs, a caller may share out a job of its own."""

    helps = False
    job: ref[Job] | None = None  # weak: a job holds arrays


_HERE = _Here()


class Job:
    """Parts that threads take in turn, until there are none left, one has failed, or the caller leaves."""

    def __init__(self, work: Callable[..., Any], parts: list[tuple]):
        self.work, self.parts = work, parts
        self.numbers = itertools.count()
        self.seats: Iterator[int] = iter(())
        self.open = True
        self.endings: list[Ending] = []
        self.errors: list[BaseException] = []

    def take(self, after: Callable[[], Any] | None = None) -> None:
        while self.open and (number := next(self.numbers)) < len(self.parts):
            self.work(*self.parts[number])
            if after is not None:
                after()

    def help(self) -> None:
        """Take parts, where a seat is left for a helper."""
        if next(self.seats, None) is None:
            return
        ending = Ending()
        self.endings.append(ending)  # before it looks for work: the caller, when the work has ended, looks for helpers
        try:
            self.take()
        except BaseException as error:
            self.errors.append(error)
            self.open = False
        finally:
            ending.end()


class _Helper:
    """A thread that helps, as callers see it: the lock it sleeps on, and the processors it may use: of all that its
    caller may, or of these without the caller's."""

    def __init__(self) -> None:
        self.thread = _thread.get_native_id()
        self.bed = _thread.allocate_lock()
        self.bed.acquire()
        self.asleep = False
        self.all: set[int] = set()
        self.places: set[int] = set()

    def sleep(self) -> None:
        self.asleep = True
        self.bed.acquire()
        self.asleep = False  # set by the thread itself, so that an interrupt of the waking thread changes nothing

    def wake(self, places: set[int], here: int) -> None:
        """Wake the thread, on another of these processors than `here`; one that is awake will look once more.

        It stays there: the system can move the caller, but to move the thread each time would take longer than work.
        """
        if self.asleep and (here in self.places or self.all != places):
            self.all, self.places = places, places - {here} or places
            with suppress(OSError):  # where a process may not set that
                os.sched_setaffinity(self.thread, self.places)
        with suppress(RuntimeError):  # another caller was quicker
            self.bed.release()


class _Team:
    """The helpers of this process, the jobs they may take part in, and the memory that they and callers share."""

    def __init__(self) -> None:
        memory = _immortal((ctypes.c_int64 * (rounds.WORDS + rounds.LINE // 8))())
        self.address = -(-ctypes.addressof(memory) // rounds.LINE) * rounds.LINE
        ctypes.c_int64.from_address(self.address + 8 * rounds.YIELD).value = _yield()
        self.helpers: dict[int, _Helper] = {}
        self.jobs: list[Job] = []

    def help(self, number: int) -> None:
        """The endless work of helper `number`; nothing if it exists already, as several callers may start it."""
        helper, look, word = _Helper(), None, ctypes.c_int64
        team, last, looks = word(self.address), word(0), word(PATIENCE)
        if self.helpers.setdefault(number, helper) is not helper:
            return
        _HERE.helps = True
        try:
            while True:
                if look is not None:  # at once: whoever is woken finds its way with cold caches
                    last = word(look(team, last, looks))
                elif _help.cache_info().currsize:  # a kernel is shared out; with GONIO_ENGINE=numpy none ever is
                    look = _help()
                    continue
                self.take_parts()
                helper.sleep()
        finally:
            del self.helpers[number]

    def take_parts(self) -> None:
        """Of every job, in a function of its own: a job holds arrays, and this thread may sleep long."""
        for job in list(self.jobs):
            job.help()
            self.forget(job)  # all its parts are taken, or all its seats

    def forget(self, job: Job) -> None:
        with suppress(ValueError):  # another thread was quicker
            self.jobs.remove(job)


_TEAM: list[_Team] = []  # one, once it is needed; in a forked process a new one, for threads do not survive a fork
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_TEAM.clear)


def team() -> _Team:
    """The team of this process."""
    if not _TEAM:
        _TEAM.append(_Team())
    return _TEAM[0]


@cache
def possible() -> bool:
    """Whether helpers can help with kernels: their code is compiled as any other, which not every machine allows."""
    try:
        _help(), _lead()
    except Error:
        return False
    return True


def busy() -> bool:
    """Whether this thread works on a part of something shared out, whose own calls are not shared out again."""
    job = None if _HERE.job is None else _HERE.job()
    return _HERE.helps or (job is not None and job.open)


def awake() -> bool:
    """Whether a helper is awake, or will be at once."""
    return any(not helper.asleep for helper in list(team().helpers.values()))


def wake(count: int) -> None:
    """See to it that so many helpers are awake, or soon will be."""
    helpers = team().helpers
    if len(helpers) < count:
        for number in range(count):
            if number not in helpers:
                with suppress(RuntimeError):  # no more threads are to be had
                    _thread.start_new_thread(team().help, (number,))
    wanted = [helper for helper in list(helpers.values())[:count] if helper.bed.locked()]
    places, here = set[int](), -1
    if any(helper.asleep for helper in wanted) and _processor is not None:
        # Left alone, the system may put a thread behind the one that wakes it, on one processor.
        places, here = os.sched_getaffinity(0), _processor()
    for helper in wanted:
        helper.wake(places, here)


def offer(job: Job, seats: int) -> None:
    """Let up to so many helpers take parts of a job; the calling thread takes the others."""
    job.seats = iter(range(seats))
    _HERE.job = ref(job)
    team().jobs.append(job)
    wake(seats)


def withdraw(job: Job) -> None:
    """Wait for the helpers that are still at a part of a job that is closed."""
    team().forget(job)
    for ending in job.endings:
        ending.wait()


def together(count: int, function: int, args: Any, outer: int, inner: int, grain: int) -> None:
    """Call the kernel at address `function` with a block of arguments, of which it takes parts itself, on up to `count`
    threads, this one included.

    When it returns, or an exception comes out of it, no thread works on this any more.
    """
    word = ctypes.c_int64
    _lead()(
        word(team().address), word(min(count - 1, 4095)), word(function), args, word(outer), word(inner), word(grain)
    )
