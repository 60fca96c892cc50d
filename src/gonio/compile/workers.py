"""Threads that help with a batch at once: after a piece of work they look out for the next a little while, awake, for
the system takes longer to wake a thread than a kernel to compute ten thousand directions."""

from __future__ import annotations

import ctypes
import os
import platform
import threading
from collections.abc import Callable
from functools import cache
from typing import Any

from . import store

PATIENCE = 4000  # looks, of about 50 ns each, before a thread sleeps

_LOOK = """
define i64 @kernel(ptr %word, i64 %old, i64 %looks) nounwind {
entry:
  br label %look
look:
  %n = phi i64 [ 0, %entry ], [ %n.next, %wait ]
  %now = load atomic i64, ptr %word monotonic, align 8
  %changed = icmp ne i64 %now, %old
  br i1 %changed, label %exit, label %wait
wait:
  PAUSE
  %n.next = add i64 %n, 1
  %more = icmp ult i64 %n.next, %looks
  br i1 %more, label %look, label %exit
exit:
  ret i64 %now
}
"""


@cache
def _look() -> Callable[[int, int, int], int]:
    """look(address of a word, old value, how often): returns when the word is no longer the old value, or at last."""
    pause = "call void @llvm.x86.sse2.pause()" if platform.machine() in ("x86_64", "AMD64") else ""
    declared = "declare void @llvm.x86.sse2.pause()" if pause else ""
    text = declared + _LOOK.replace("PAUSE", pause)
    prototype = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)
    return store.function(text, lambda: text, prototype)


class _Worker:
    """A thread with one piece of work at a time."""

    def __init__(self) -> None:
        self.taken = threading.Lock()  # by whoever gives it work
        self.guard = threading.Lock()  # of what follows
        self.work: tuple[Callable[..., Any], tuple] = (str, ())
        self.asleep = False
        self.count = ctypes.c_int64()  # of the pieces it was given
        self.wake, self.finished = threading.Semaphore(0), threading.Semaphore(0)
        self.error: BaseException | None = None
        threading.Thread(target=self.serve, name="gonio", daemon=True).start()

    def give(self, work: Callable[..., Any], args: tuple) -> None:
        with self.guard:
            self.work, self.error = (work, args), None
            self.count.value += 1
            asleep, self.asleep = self.asleep, False
        if asleep:
            self.wake.release()

    def wait(self) -> None:
        """Until the work is done; interrupts are raised then, for the work writes to memory of the caller's."""
        interrupt: BaseException | None = None
        while True:
            try:
                self.finished.acquire()
                break
            except KeyboardInterrupt as error:
                interrupt = error
        if interrupt or self.error:
            raise interrupt or self.error  # type: ignore[misc]

    def serve(self) -> None:
        look, word, seen = _look(), ctypes.addressof(self.count), 0
        while True:
            if look(word, seen, PATIENCE) == seen:
                with self.guard:
                    asleep = self.asleep = self.count.value == seen
                if asleep:
                    self.wake.acquire()
            seen += 1
            work, args = self.work
            try:
                work(*args)
            except BaseException as error:
                self.error = error
            self.finished.release()


_WORKERS: dict[int, list[_Worker]] = {}


def together(count: int, work: Callable[..., Any], *args: Any) -> None:
    """Call `work(*args)`, which takes its parts itself, on `count` threads until nothing is left.

    The caller itself sleeps: were it at work, the system might put a thread that it wakes behind it, on one processor.
    """
    workers = _WORKERS.get(os.getpid())  # threads do not survive a fork
    if workers is None:
        _WORKERS.clear()
        workers = _WORKERS[os.getpid()] = []
    while len(workers) < count:
        workers.append(_Worker())
    mine = [w for w in workers[:count] if w.taken.acquire(blocking=False)]
    for worker in mine:
        worker.give(work, args)
    if not mine:  # other callers have them all
        work(*args)
    errors: list[BaseException] = []
    for worker in mine:
        try:
            worker.wait()
        except BaseException as error:
            errors.append(error)
        worker.taken.release()
    if errors:
        raise errors[0]
