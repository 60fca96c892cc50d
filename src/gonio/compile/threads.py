"""How many threads compute, and handing them their parts of a batch."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from typing import Any

from ..errors import ParameterError

_COUNT: list[int] = []
_POOLS: dict[int, Any] = {}


def threads(count: int | None = None) -> int:
    """How many threads NumPy arrays are computed with; with `count`, from now on that many.

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


def share(work: Callable[..., Any], parts: Iterable[tuple]) -> None:
    """Call `work(*part)` for every part, on all threads; the first error is raised after all have ended."""
    jobs = [pool().submit(work, *part) for part in parts]
    errors = [job.exception() for job in jobs]
    for error in errors:
        if error is not None:
            raise error


def pool() -> Any:
    """The threads, made when first needed; in a forked process anew, for threads do not survive a fork."""
    key = os.getpid() * 8192 + threads()
    found = _POOLS.get(key)
    if found is None:
        from concurrent.futures import ThreadPoolExecutor

        _POOLS.clear()
        found = _POOLS[key] = ThreadPoolExecutor(threads(), thread_name_prefix="gonio")
    return found
