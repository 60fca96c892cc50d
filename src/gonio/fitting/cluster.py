"""Who computes many fits: threads of this process, processes of this machine, or the workers of a Dask scheduler.

Jobs are calls of a function that other processes can import. Few are under way at a time, so that a run of a million
does not fill the memory of the scheduler.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple

from ..compile.threads import threads
from ..errors import NotFoundError, ParameterError, needed, shown
from .processes import Processes

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
"""Variables of processes that are started here: one thread each, and an allocator that keeps its memory."""

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

    `scheduler`: None for threads of this process; "processes" for as many processes of this machine as
    `gn.engine.threads()` says, or "processes:4", at the ends of pipes (`processes`); the address of a Dask scheduler,
    "tls://10.0.0.1:8786"; a client of `distributed`; or an executor of `concurrent.futures`. Who can reach a scheduler
    at "tcp://..." can run code there, and here.
    """
    word, _, count = scheduler.partition(":") if isinstance(scheduler, str) else ("", "", "")
    if scheduler is None:
        with ThreadPoolExecutor(threads(), "gonio-fit") as pool:
            yield Workers(pool, threads(), False)
    elif isinstance(scheduler, Executor):
        yield Workers(scheduler, threads(), not isinstance(scheduler, ThreadPoolExecutor))
    elif word == "processes" and (not count or (count.isdecimal() and 1 <= int(count) <= 4096)):
        places = int(count or threads())
        with Processes(places, ENVIRONMENT) as pool:
            yield Workers(pool, places, True)
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
    if not isinstance(scheduler, str) or "://" not in scheduler:
        raise ParameterError(
            f"scheduler={shown(scheduler)}: expected None for threads, 'processes', 'processes:4', the address of a "
            f"Dask scheduler such as 'tls://10.0.0.1:8786', a client of distributed, or an executor"
        )
    try:
        return stack.enter_context(distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False))
    except (OSError, ValueError) as error:
        raise NotFoundError(
            f"scheduler={scheduler!r:.200}: no Dask scheduler answers there "
            f"({str(error) or type(error).__name__:.200}); start one with: dask scheduler"
        ) from None


def _distributed() -> Any:
    with needed("fits on clusters need Dask", 'pip install "gonio[fit]"'):
        import distributed
    return distributed
