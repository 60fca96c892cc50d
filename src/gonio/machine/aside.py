"""Work done in another thread while this one waits: where an interrupt must not reach it."""

from __future__ import annotations

import _thread
from collections.abc import Callable
from typing import Any


class Ending:
    """The end of another thread's work, to be waited for."""

    def __init__(self) -> None:
        self.ended, self.lock = False, _thread.allocate_lock()
        self.lock.acquire()

    def end(self) -> None:
        self.ended = True
        self.lock.release()

    def wait(self) -> None:
        while not self.ended:  # an interrupt may come after the lock was taken: nothing depends on who has it
            self.lock.acquire(timeout=0.05)


def apart(work: Callable[..., Any], *args: Any) -> Any:
    """`work(*args)`, in a new thread while this one waits: libraries lose their locks to interrupts, and no signal
    reaches that thread.

    An interrupt is raised when the work has ended.
    """
    results: list[Any] = []
    errors: list[BaseException] = []
    done, once, started = Ending(), iter((True,)), False

    def run() -> None:
        if not next(once, False):
            return
        try:
            results.append(work(*args))
        except BaseException as error:
            errors.append(error)
        finally:
            done.end()

    interrupt: BaseException | None = None
    while not done.ended:
        try:
            if not started:
                _thread.start_new_thread(run, ())
                started = True
            done.wait()
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
