"""BLAS held to one thread, while many small matrices are multiplied: its own threads wait for each other longer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

_HELD: list[Any] = []
_INSIDE = Lock()


@contextmanager
def one_thread() -> Iterator[None]:
    """BLAS has one thread within, and its own number again when the last that is within leaves, in whatever order."""
    from threadpoolctl import threadpool_limits  # late: few need it

    with _INSIDE:
        _HELD.append(None if _HELD else threadpool_limits(1, "blas"))
    try:
        yield
    finally:
        with _INSIDE:
            held = _HELD.pop()
            if held is not None:
                held.restore_original_limits()
