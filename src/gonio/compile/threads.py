"""How many threads compute (`gn.engine.threads`), for f of NumPy arrays and for pictures (`gn.render`) alike.

There is one pool of threads, `workers.py`, and the calling thread takes part: `threads()` of them compute for a call,
never more. `plans.py` shares out kernels; `share` shares out work of Python in parts (tiles of a picture, blocks of a
batch that NumPy evaluates). Calls within a part run on the thread of that part.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from contextvars import copy_context
from functools import cache
from math import ceil, inf
from typing import TYPE_CHECKING, Any

from ..errors import ParameterError, shown
from . import workers

if TYPE_CHECKING:
    from pathlib import Path

MOST = 4096

_COUNT: list[int] = []  # what `threads(count)` set


def threads(count: int | None = None) -> int:
    """How many threads compute f of NumPy arrays, and pictures; with `count`, from now on that many.

    Until `count` is given it is the environment variable GONIO_THREADS (as first found), else the number of processors
    that this thread may use: by its affinity, and by the limit of its container. Small batches are computed by one
    thread: of a Lambertian up to 70 000 directions, of twenty lobes up to 1000. Linear algebra of other libraries,
    which fits and repairs use, has threads of its own.

    Example
    >>> before = gn.engine.threads()
    >>> print(gn.engine.threads(1), gn.engine.threads(before) == before)
    1 True
    """
    if count is not None:
        if not isinstance(count, int) or isinstance(count, bool) or not 1 <= count <= MOST:
            raise ParameterError(f"threads({shown(count)}): expected a whole number from 1 to {MOST}")
        _COUNT[:] = [count]
    return _COUNT[0] if _COUNT else _from_environment() or _processors()


@cache
def _from_environment() -> int | None:
    text = os.environ.get("GONIO_THREADS", "")
    if not text:
        return None
    if not text.isdecimal() or not 1 <= int(text) <= MOST:
        raise ParameterError(f"GONIO_THREADS={text!r}: expected a whole number from 1 to {MOST}")
    return int(text)


def _processors() -> int:
    """Processors that this thread may use now: its affinity may have been changed."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return int(min(count, container_limit()))


@cache
def container_limit(membership: str = "/proc/self/cgroup", root: str = "/sys/fs/cgroup") -> float:
    """Processors that the control groups of this process let it use, rounded up; infinity where they set no limit.

    Source   Linux, Documentation/admin-guide/cgroup-v2.rst (cpu.max) and scheduler/sched-bwc.rst (version 1).
    """
    from pathlib import Path  # late: it takes as long to import as twenty modules of gonio

    limit = inf
    with suppress(OSError, ValueError):
        for line in Path(membership).read_text().splitlines():
            _, controllers, group = line.split(":", 2)
            if controllers and "cpu" not in controllers.split(","):
                continue
            top = Path(root, controllers)
            path = top / group.lstrip("/")  # often missing within a container, where its parents exist
            for folder in (path, *path.parents):
                if folder.is_relative_to(top):
                    limit = min(limit, _quota(folder, version=1 if controllers else 2))
    return limit


def _quota(folder: Path, version: int) -> float:
    """Processors that the limit of one control group amounts to."""
    files = ("cpu.cfs_quota_us", "cpu.cfs_period_us") if version == 1 else ("cpu.max",)
    try:
        quota, period = " ".join((folder / file).read_text() for file in files).split()
        return max(1, ceil(int(quota) / int(period))) if int(quota) > 0 else inf
    except (OSError, ValueError, ZeroDivisionError):  # no such file, or "max"
        return inf


def share(work: Callable[..., Any], parts: Iterable[tuple], after: Callable[[], Any] | None = None) -> None:
    """Call `work(*part)` for every part, on all threads; `after()` on this one, after each part that it did itself.

    The first error, or an interrupt, is raised when the parts that are under way have ended; no others are begun.
    """
    context = copy_context()  # of the caller: a thread that helps has another, and none can be in two at a time
    job = workers.Job(lambda *part: context.copy().run(work, *part), list(parts))
    seats = min(threads(), len(job.parts)) - 1 if len(job.parts) > 1 and not workers.busy() else 0
    try:
        if seats > 0:
            workers.offer(job, seats)
        job.take(after)
    finally:
        job.open = False  # before any call, for an interrupt may come within one
        if seats > 0:
            try:
                workers.withdraw(job)
            except BaseException:
                workers.withdraw(job)
                raise
    if job.errors:
        raise job.errors[0]
