"""The team: threads that help a caller with a kernel, and join and leave it in compiled code.

A caller works itself, and whoever is awake helps. Posting the work, taking part in it and waiting until the last helper
has left is one compiled call, during which Python raises nothing: whatever interrupts a program does so before or after
it, when nobody writes to the caller's memory. Work is known by its round, a number that only grows, so nothing that an
interrupt leaves behind can be taken for something else. A helper looks out for the next round a little while, without
the interpreter's lock, for the system takes longer to wake a thread than a kernel to compute ten thousand directions.
"""

from __future__ import annotations

import _thread
import ctypes
import os
import platform
from contextlib import suppress
from functools import cache
from typing import Any

from ..errors import Error
from . import store

PATIENCE = 4000  # looks, of about 50 ns each, before a helper sleeps

# The team's memory, in 64-bit words, a line of the cache for each of three: whether a caller has it; the gate; the work
# (function, arguments, outer, inner, grain) and the address of sched_yield. The gate is the round times 2^32, plus the
# seats left for helpers times 2^16, plus the helpers inside. It changes at once, so nobody enters a round that is over.
_WORDS, _LINE = 24, 64

_HELP = """
define i64 @kernel(ptr %team, i64 %last, i64 %looks) nounwind {
entry:
  %gate = getelementptr i64, ptr %team, i64 8
  br label %look
look:
  %seen = phi i64 [ %last, %entry ], [ %seen, %wait ], [ %seen, %join ], [ %round, %work ]
  %n = phi i64 [ 0, %entry ], [ %n.next, %wait ], [ %n, %join ], [ 0, %work ]
  %now = load atomic i64, ptr %gate monotonic, align 8
  %round = lshr i64 %now, 32
  %new = icmp ne i64 %round, %seen
  %seats = and i64 %now, 4294901760
  %free = icmp ne i64 %seats, 0
  %open = and i1 %new, %free
  br i1 %open, label %join, label %wait
join:
  %inside = sub i64 %now, 65535
  %tried = cmpxchg ptr %gate, i64 %now, i64 %inside acquire monotonic
  %joined = extractvalue { i64, i1 } %tried, 1
  br i1 %joined, label %work, label %look
work:
  %function.at = getelementptr i64, ptr %team, i64 16
  %function = load ptr, ptr %function.at, align 8
  %args.at = getelementptr i64, ptr %team, i64 17
  %args = load ptr, ptr %args.at, align 8
  %outer.at = getelementptr i64, ptr %team, i64 18
  %outer = load i64, ptr %outer.at, align 8
  %inner.at = getelementptr i64, ptr %team, i64 19
  %inner = load i64, ptr %inner.at, align 8
  %grain.at = getelementptr i64, ptr %team, i64 20
  %grain = load i64, ptr %grain.at, align 8
  call void %function(ptr %args, i64 %outer, i64 %inner, i64 %grain)
  %left = atomicrmw sub ptr %gate, i64 1 release
  br label %look
wait:
  PAUSE
  %n.next = add i64 %n, 1
  %more = icmp ult i64 %n.next, %looks
  br i1 %more, label %look, label %exit
exit:
  ret i64 %seen
}
"""
"""help(team, last round, looks): take part in every round after that one; the last round seen, after so many looks."""

_LEAD = """
define void @kernel(ptr %team, i64 %seats, ptr %function, ptr %args, i64 %outer, i64 %inner, i64 %grain) nounwind {
entry:
  %tried = cmpxchg ptr %team, i64 0, i64 1 acquire monotonic
  %mine = extractvalue { i64, i1 } %tried, 1
  br i1 %mine, label %post, label %alone
alone:
  call void %function(ptr %args, i64 %outer, i64 %inner, i64 %grain)
  ret void
post:
  %function.at = getelementptr i64, ptr %team, i64 16
  store ptr %function, ptr %function.at, align 8
  %args.at = getelementptr i64, ptr %team, i64 17
  store ptr %args, ptr %args.at, align 8
  %outer.at = getelementptr i64, ptr %team, i64 18
  store i64 %outer, ptr %outer.at, align 8
  %inner.at = getelementptr i64, ptr %team, i64 19
  store i64 %inner, ptr %inner.at, align 8
  %grain.at = getelementptr i64, ptr %team, i64 20
  store i64 %grain, ptr %grain.at, align 8
  %gate = getelementptr i64, ptr %team, i64 8
  %old = load atomic i64, ptr %gate monotonic, align 8
  %round = and i64 %old, -4294967296
  %next = add i64 %round, 4294967296
  %places = shl i64 %seats, 16
  %opened = or i64 %next, %places
  store atomic i64 %opened, ptr %gate release, align 8
  call void %function(ptr %args, i64 %outer, i64 %inner, i64 %grain)
  %closed = atomicrmw and ptr %gate, i64 -4294901761 acquire
  %yield.at = getelementptr i64, ptr %team, i64 21
  %yield = load ptr, ptr %yield.at, align 8
  br label %wait
wait:
  %n = phi i64 [ 0, %post ], [ %n.next, %pause ], [ 0, %sleep ]
  %now = load atomic i64, ptr %gate acquire, align 8
  %inside = and i64 %now, 65535
  %some = icmp ne i64 %inside, 0
  br i1 %some, label %patient, label %exit
patient:
  %n.next = add i64 %n, 1
  %quick = icmp ult i64 %n.next, 2000
  br i1 %quick, label %pause, label %sleep
pause:
  PAUSE
  br label %wait
sleep:
  %slept = call i32 %yield()
  br label %wait
exit:
  store atomic i64 0, ptr %team release, align 8
  ret void
}
"""
"""lead(team, seats, function, args, outer, inner, grain): the function, by the caller and by helpers in so many seats;
by the caller alone where another caller has the team."""


@cache
def _help() -> Any:
    return _compiled(_HELP, ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, *[ctypes.c_int64] * 2))


@cache
def _lead() -> Any:
    kinds = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_int64] * 3]
    return _compiled(_LEAD, ctypes.CFUNCTYPE(None, *kinds))


def _compiled(text: str, prototype: Any) -> Any:
    pause = "call void @llvm.x86.sse2.pause()" if platform.machine() in ("x86_64", "AMD64") else ""
    text = text.replace("PAUSE", pause) + ("declare void @llvm.x86.sse2.pause()\n" if pause else "")
    return _immortal(store.function(text, lambda: text, prototype))


def _immortal(thing: Any) -> Any:
    """The same, never freed: helpers are still awake in it while the interpreter ends."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))
    return thing


def _yield() -> int:
    """The address of sched_yield, which lets other threads run; where there is none, of a function as harmless."""
    libc = ctypes.CDLL(None) if os.name == "posix" else ctypes.CDLL("msvcrt")
    function = libc.sched_yield if hasattr(libc, "sched_yield") else libc.clock
    return ctypes.cast(function, ctypes.c_void_p).value or 0


class _Helper:
    """A thread that helps, as callers see it: the lock it sleeps on, and the processors it may use once it is awake."""

    def __init__(self) -> None:
        self.thread = _thread.get_native_id()
        self.bed = _thread.allocate_lock()
        self.bed.acquire()
        self.asleep = False
        self.places: set[int] = set()

    def sleep(self) -> None:
        self.asleep = True
        self.bed.acquire()
        self.asleep = False  # said by the thread itself: an interrupt of whoever wakes it changes nothing
        if self.places:
            with suppress(OSError):  # of places that are no longer there
                os.sched_setaffinity(0, self.places)

    def wake(self, places: set[int], here: int) -> None:
        """Wake the thread, on another of these processors than `here`; one that is awake will look once more."""
        if self.asleep and len(places) > 1:
            self.places = places
            with suppress(OSError):  # where a process may not say so
                os.sched_setaffinity(self.thread, places - {here})
        with suppress(RuntimeError):  # another caller was quicker
            self.bed.release()


class _Team:
    """The helpers of this process, and the memory that they and callers share."""

    def __init__(self) -> None:
        memory = _immortal((ctypes.c_int64 * (_WORDS + _LINE // 8))())
        self.address = -(-ctypes.addressof(memory) // _LINE) * _LINE
        ctypes.c_int64.from_address(self.address + 8 * 21).value = _yield()
        self.helpers: dict[int, _Helper] = {}

    def help(self, number: int) -> None:
        """What helper `number` does, for ever. Where there is one already, nothing: several callers may start it."""
        own = _Helper()
        if self.helpers.setdefault(number, own) is not own:
            return
        try:
            helps, seen = _help(), 0
            while True:
                seen = helps(self.address, seen, PATIENCE)
                own.sleep()
        finally:
            del self.helpers[number]


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
    """Whether helpers can help: their code is compiled as any other, and then not all can be had that was."""
    try:
        _help(), _lead()
    except Error:
        return False
    return True


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
    if any(helper.asleep for helper in wanted) and hasattr(os, "sched_getaffinity"):
        # Left alone, the system may put a thread behind the one that wakes it, on one processor.
        places = os.sched_getaffinity(0)
        here = ctypes.pythonapi.sched_getcpu() if hasattr(ctypes.pythonapi, "sched_getcpu") else -1
    for helper in wanted:
        helper.wake(places, here)


def together(count: int, function: int, args: int, outer: int, inner: int, grain: int) -> None:
    """Call the kernel at address `function`, which takes its parts itself, on up to `count` threads, this one included.

    When it returns, or an exception comes out of it, no thread works on this any more.
    """
    _lead()(team().address, min(count - 1, 4095), function, args, outer, inner, grain)
