"""Memory for results: pages that the system has just handed out cost more than computing into them, so those of
results that nobody holds any more are used again."""

from __future__ import annotations

import math
import os
from threading import RLock
from typing import Any

import numpy as np

from ..errors import TooLargeError

SMALL = 1 << 18  # bytes below which NumPy's own memory is as fast
KEPT = 1 << 28  # bytes that are kept at most

_FREE: dict[int, list[np.ndarray]] = {}
_LOCK = RLock()  # a lease may end, by garbage collection, while one is taken
_HELD = [0]


class _Lease:
    """Owns a buffer for as long as an array is a view of it."""

    __slots__ = ("__array_interface__", "buffer")

    def __init__(self, buffer: np.ndarray, shape: tuple[int, ...], dtype: np.dtype):
        self.buffer = buffer
        self.__array_interface__ = {
            "shape": shape,
            "typestr": dtype.str,
            "data": (buffer.__array_interface__["data"][0], False),
            "version": 3,
        }

    def __del__(self) -> None:
        buffer = self.buffer
        with _LOCK:
            if _HELD[0] + buffer.nbytes <= KEPT:
                _HELD[0] += buffer.nbytes
                _FREE.setdefault(buffer.nbytes, []).append(buffer)


def empty(shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """An array with any content. Raises TooLargeError where this machine has not as much memory."""
    size = math.prod(shape) * dtype.itemsize
    if size < SMALL:
        return np.empty(shape, dtype)
    with _LOCK:
        kept = _FREE.get(size)
        buffer = kept.pop() if kept else None
        if buffer is not None:
            _HELD[0] -= size
    if buffer is None:
        _check(size, shape, dtype)
        buffer = np.empty(size, np.uint8)
    return np.asarray(_Lease(buffer, shape, dtype))


def _check(size: int, shape: tuple[int, ...], dtype: Any) -> None:
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return
    if size > there:
        raise TooLargeError(
            f"a result of shape {shape} and dtype {dtype} takes {size / 1e9:.1f} GB and this machine has "
            f"{there / 1e9:.1f} GB of memory; evaluate fewer directions at a time"
        )
