"""Memory for results, reused when the result is gone: fresh pages from the system cost more than computing.

A room is a buffer, and the place in it where a line of the cache begins. NumPy's arrays hold the owner of their memory,
and nothing in between, so a buffer that no array is a view of has one reference only: that of its room.
"""

from __future__ import annotations

import math
import sys
from collections import deque
from typing import Any

import numpy as np

from ..errors import TooLargeError
from .caches import lid, physical

SMALL = 1 << 18  # bytes below which NumPy's own memory is as fast
LOOKS = 8  # rooms looked at for one that is free
LINE = 64  # bytes of a line of the cache: results begin with one, so that whole lines are written

_Room = tuple[np.ndarray, int]

_ROOMS: dict[int, deque[_Room]] = {}  # by size


def _alone(room: _Room) -> bool:
    """Whether no array is a view of a room."""
    return sys.getrefcount(room[0]) == _ALONE


_PROBE: _Room = (np.empty(1, np.uint8), 0)
_ALONE = sys.getrefcount(_PROBE[0]) if sys.implementation.name == "cpython" else -1


def empty(shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """An array with any content. Raises TooLargeError where this machine has not as much memory."""
    size = math.prod(shape) * dtype.itemsize
    if size < SMALL:
        return np.empty(shape, dtype)
    room = _free(size)
    if room is None:
        check(shape, dtype)
        room = _new(size, f"a result of shape {shape} and dtype {dtype}")
    array: np.ndarray = np.ndarray(shape, dtype, *room)
    if size <= _kept():
        _ROOMS.setdefault(size, deque()).append(room)
    return array


def _free(size: int) -> _Room | None:
    """A room that nobody uses, which is given away; None where there is none."""
    rooms = _ROOMS.get(size) or deque()
    for _ in range(min(len(rooms), LOOKS)):
        try:
            room = rooms.popleft()
        except IndexError:  # another thread was quicker
            return None
        if _alone(room):
            return room
        rooms.append(room)
    return None


def _new(size: int, what: str) -> _Room:
    if sum(length * len(rooms) for length, rooms in list(_ROOMS.items())) + size > _kept():
        _ROOMS.clear()
    try:
        buffer = np.empty(size + LINE, np.uint8)
    except MemoryError:
        text = f"{what} takes {size / 1e9:.1f} GB, more than is free here; evaluate fewer directions at a time"
        raise TooLargeError(text) from None
    return buffer, -buffer.__array_interface__["data"][0] % LINE


def check(shape: tuple[int, ...], dtype: Any, what: str = "a result") -> None:
    """Raises TooLargeError where this machine has not as much memory as an array of this shape takes."""
    size, total = math.prod(shape) * np.dtype(dtype).itemsize, physical()
    if size > total:
        raise TooLargeError(
            f"{what} of shape {shape} and dtype {dtype} takes {size / 1e9:.1f} GB and this machine has "
            f"{total / 1e9:.1f} GB of memory; evaluate fewer directions at a time"
        )


def _kept() -> int:
    """Bytes kept at most, in use or not; buffers that are not kept are freed as any array is."""
    return lid() // 2
