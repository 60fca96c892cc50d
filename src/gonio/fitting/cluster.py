"""Where many fits run: in this process, in processes of this machine, or on a scheduler of Dask elsewhere."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import Any

from ..errors import DependencyError, NotFoundError, ParameterError, shown

PROCESSES = "processes"

AHEAD = 3
"""Jobs for each worker that are handed out before the first of them is done."""

MAPPED = str(2**28)
"""Bytes below which memory is not given back at once. Dask's own setting makes every array above 64 KB a new mapping,
which makes fits three times as slow."""


def each(
    function: Callable[[Any], Any], jobs: Iterable[Any], scheduler: Any = None
) -> Iterator[tuple[Any, Any, BaseException | None]]:
    """Each job, what the function makes of it, and the error of a worker that was lost, as they are done.

    `scheduler`: None for this process; "processes" for a process on each core; the address of a scheduler of Dask,
    "tcp://host:8786"; or a `distributed.Client`.
    """
    if scheduler is None:
        for job in jobs:
            yield job, function(job), None
        return
    with _client(scheduler) as client:
        from distributed import as_completed

        left = iter(jobs)
        count = AHEAD * max(1, sum(client.nthreads().values()))
        running = {client.submit(function, job, pure=False): job for job in islice(left, count)}
        done = as_completed(list(running))
        for future in done:
            job = running.pop(future)
            error = future.exception()
            yield job, None if error is not None else future.result(), error
            for more in islice(left, 1):
                new = client.submit(function, more, pure=False)
                running[new] = more
                done.add(new)


@contextlib.contextmanager
def _client(scheduler: Any) -> Iterator[Any]:
    """A client of the scheduler, which is closed at the end if it was made here."""
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise DependencyError('scheduler: dask and distributed are missing; pip install "gonio[fit]"') from None
    if isinstance(scheduler, Client):
        yield scheduler
    elif scheduler == PROCESSES:
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "GONIO_THREADS"), "1")
        memory = {"MALLOC_TRIM_THRESHOLD_": MAPPED, "MALLOC_MMAP_THRESHOLD_": MAPPED}
        with dask.config.set({"distributed.nanny.pre-spawn-environ": {**threads, **memory}}):
            cluster = LocalCluster(
                n_workers=_cores(), threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0
            )
            with cluster, Client(cluster) as client:
                yield client
    elif isinstance(scheduler, str) and "://" in scheduler:
        try:
            client = Client(scheduler, timeout=10)
        except (OSError, ValueError) as error:
            raise NotFoundError(f"scheduler={shown(scheduler)}: no scheduler of Dask answers there: {error}") from None
        with client:
            yield client
    else:
        rule = "expected None, 'processes', an address such as 'tcp://host:8786', or a distributed.Client"
        raise ParameterError(f"scheduler={shown(scheduler)}: {rule}")


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
