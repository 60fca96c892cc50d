"""Zarr's own thread, which works at several files at once, and goes on with the others when one of them failed."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def finished() -> Iterator[None]:
    """An error, or Ctrl-C, waits until that thread has done what it began: a file that is still being written would
    come back after its folder is removed, and at its end Python would complain of what nobody waits for."""
    try:
        yield
    except BaseException:
        from zarr.core.sync import sync

        sync(_others())
        raise


async def _others() -> None:
    if tasks := asyncio.all_tasks() - {asyncio.current_task()}:
        await asyncio.wait(tasks, timeout=60.0)
