"""Who computes many fits: threads of this process, processes of this machine, or the workers of a Dask scheduler.

Jobs are calls of a function that other processes can import. Few are under way at a time, so that a run of a million
does not fill the memory of the scheduler.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple

from ..compile.threads import threads
from ..errors import DependencyError, NotFoundError, ParameterError, shown

AHEAD = 3
"""Jobs under way for each worker: it has the next one when it has done one."""

ENVIRONMENT = {
    "OMP_NUM_THREADS": 1,
    "OPENBLAS_NUM_THREADS": 1,
    "MKL_NUM_THREADS": 1,
    "GONIO_THREADS": 1,
    "MALLOC_TRIM_THRESHOLD_": 1 << 28,
    "MALLOC_MMAP_THRESHOLD_": 1 << 28,
}
"""Variables of worker processes. Dask's own value of the trim threshold has the C library ask the system for every
array above 128 KiB anew, which makes NumPy three times slower; it goes only if the whole dictionary is replaced."""

PATIENCE = 30
"""Seconds to wait for a scheduler to answer."""

Done = tuple[int, Any, BaseException | None]
"""The number of a job, its result, and the error that it ended with."""


class Workers(NamedTuple):
    """Where jobs are computed.

    executor   takes them
    places     how many jobs run at the same time
    are_far    whether jobs and results travel to other processes
    """

    executor: Executor
    places: int
    are_far: bool

    def results(self, work: Callable[[Any], Any], jobs: Iterable[Any]) -> Iterator[Done]:
        """`work(job)` for every job, as they end; jobs that are not under way are not taken from the iterator yet.

        Where the caller stops early, jobs that have not begun are cancelled.
        """
        waiting = enumerate(jobs)
        under_way: dict[Future, int] = {}
        try:
            while True:
                while len(under_way) < AHEAD * self.places and (following := next(waiting, None)) is not None:
                    number, job = following
                    under_way[self.executor.submit(work, job)] = number
                if not under_way:
                    return
                ended, _ = wait(under_way, return_when=FIRST_COMPLETED)
                for future in ended:
                    number, error = under_way.pop(future), future.exception()
                    yield number, None if error else future.result(), error
        finally:
            for future in under_way:
                future.cancel()


@contextmanager
def workers(scheduler: Any = None) -> Iterator[Workers]:
    """The workers that a `scheduler` stands for; what is started here is ended with the block.

    `scheduler`: None for threads of this process; "processes" for as many processes of this machine as `gn.threads()`
    says, or "processes:4"; the address of a Dask scheduler, "tcp://10.0.0.1:8786"; a client of `distributed`; or an
    executor of `concurrent.futures`.
    """
    if scheduler is None:
        with ThreadPoolExecutor(threads(), "gonio-fit") as pool:
            yield Workers(pool, threads(), False)
    elif isinstance(scheduler, Executor):
        yield Workers(scheduler, threads(), not isinstance(scheduler, ThreadPoolExecutor))
    else:
        with ExitStack() as stack:
            client = _client(scheduler, stack)
            count = max(1, sum(client.nthreads().values()))
            yield Workers(stack.enter_context(client.get_executor()), count, True)


def _client(scheduler: Any, stack: ExitStack) -> Any:
    """A client of `distributed`; the stack closes what is opened here."""
    distributed = _distributed()
    if isinstance(scheduler, distributed.Client):
        return scheduler
    word, _, count = str(scheduler).partition(":")
    if word == "processes" and (not count or (count.isdecimal() and 1 <= int(count) <= 4096)):
        cluster = stack.enter_context(_local(distributed, int(count or threads())))
        return stack.enter_context(distributed.Client(cluster, set_as_default=False))
    if not isinstance(scheduler, str) or "://" not in scheduler:
        raise ParameterError(
            f"scheduler={shown(scheduler)}: expected None for threads, 'processes', 'processes:4', the address of a "
            f"Dask scheduler such as 'tcp://10.0.0.1:8786', a client of distributed, or an executor"
        )
    try:
        return stack.enter_context(distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False))
    except (OSError, ValueError) as error:
        raise NotFoundError(
            f"scheduler={scheduler!r:.200}: no Dask scheduler answers there "
            f"({str(error) or type(error).__name__:.200}); start one with: dask scheduler"
        ) from None


@contextmanager
def _local(distributed: Any, count: int) -> Iterator[Any]:
    """Processes of this machine, one thread each."""
    import dask

    with dask.config.set({"distributed.nanny.pre-spawn-environ": ENVIRONMENT}):
        cluster = distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        )
    with cluster:
        yield cluster


def _distributed() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise DependencyError(f'fits by processes and clusters need Dask ({error}); pip install "gonio[fit]"') from None
    return distributed
