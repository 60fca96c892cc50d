"""Memory for results, reused when the result is gone: fresh pages from the system cost more than computing."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from typing import Any
from weakref import ReferenceType

import numpy as np

from ..errors import TooLargeError

SMALL = 1 << 18  # bytes below which NumPy's own memory is as fast
KEPT = 1 << 29  # bytes kept at most
LINE = 64  # bytes of a line of the cache: buffers begin with one, so that whole lines are written
LENT = 64  # loans remembered at most; buffers of forgotten loans are freed as any array is

_FREE: dict[int, list[np.ndarray]] = {}  # size -> buffers that nobody holds
_LOANS: dict[int, _Loan] = {}
_ENDED: list[_Loan] = []


class _Lease:
    """The owner of a buffer while an array is a view of it."""

    __slots__ = ("__array_interface__", "__weakref__", "buffer")

    def __init__(self, buffer: np.ndarray, shape: tuple[int, ...], dtype: np.dtype):
        self.buffer = buffer
        self.__array_interface__ = {
            "shape": shape,
            "typestr": dtype.str,
            "data": (buffer.__array_interface__["data"][0], False),
            "version": 3,
        }


class _Loan(ReferenceType[_Lease]):
    """A weak reference to a lease, with its buffer. The end of the lease puts it into `_ENDED`, by `list.append`: an
    interrupt during a finaliser written in Python would be lost."""

    __slots__ = ("buffer",)
    buffer: np.ndarray


def empty(shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """An array with any content. Raises TooLargeError where this machine has not as much memory."""
    size = math.prod(shape) * dtype.itemsize
    if size < SMALL:
        return np.empty(shape, dtype)
    _take_back()
    try:
        buffer = _FREE[size].pop()
    except (KeyError, IndexError):
        check(shape, dtype)
        buffer = _new(size, f"a result of shape {shape} and dtype {dtype}")
    lease = _Lease(buffer, shape, dtype)
    if size <= KEPT:
        _keep_within(KEPT - size)
        loan = _Loan(lease, _ENDED.append)
        loan.buffer = buffer
        _LOANS[id(loan)] = loan
    return np.asarray(lease)


def _take_back() -> None:
    """Move the buffers of ended loans to the free ones."""
    while _ENDED:
        with suppress(IndexError):  # another thread was quicker
            loan = _ENDED.pop()
            if _LOANS.pop(id(loan), None) is not None:
                _FREE.setdefault(loan.buffer.nbytes, []).append(loan.buffer)


def _keep_within(limit: int) -> None:
    """Drop free buffers, then the oldest loans, until both together hold at most so many bytes."""
    loans = list(_LOANS.items())
    lent = sum(loan.buffer.nbytes for _, loan in loans)
    if lent + sum(buffer.nbytes for buffers in list(_FREE.values()) for buffer in buffers) > limit:
        _FREE.clear()
    for i, (name, loan) in enumerate(loans):
        if lent <= limit and len(loans) - i < LENT:
            break
        _LOANS.pop(name, None)
        lent -= loan.buffer.nbytes


def _new(size: int, what: str) -> np.ndarray:
    try:
        room = np.empty(size + LINE, np.uint8)
    except MemoryError:
        text = f"{what} takes {size / 1e9:.1f} GB, more than is free here; evaluate fewer directions at a time"
        raise TooLargeError(text) from None
    start = -room.__array_interface__["data"][0] % LINE
    return room[start : start + size]


def check(shape: tuple[int, ...], dtype: Any, what: str = "a result") -> None:
    """Raises TooLargeError where this machine has not as much memory as an array of this shape takes."""
    size, total = math.prod(shape) * np.dtype(dtype).itemsize, physical()
    if size > total:
        raise TooLargeError(
            f"{what} of shape {shape} and dtype {dtype} takes {size / 1e9:.1f} GB and this machine has "
            f"{total / 1e9:.1f} GB of memory; evaluate fewer directions at a time"
        )


def physical() -> float:
    """Bytes of memory of this machine; infinity where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return math.inf
