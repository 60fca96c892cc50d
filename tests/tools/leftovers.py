"""Memory that tests leave behind: a worker runs thousands of them, and is to stay near 1 GB."""

from __future__ import annotations

import ctypes
import gc
import sys
from contextlib import suppress
from pathlib import Path

from gonio.arrays import Fixed
from gonio.formula.value import Value

MUCH, MORE = 500 << 20, 50 << 20
"""Bytes from which on it is worth the time to look, and by which a process has grown since the last look."""
_LEFT = [0]
LARGE = 1 << 20
"""Bytes from which on memory comes from the system, and goes back when it is free: in the heap it leaves holes."""
_MMAP_THRESHOLD, _TRIM_THRESHOLD = -3, -1  # of glibc's malloc.h


def settle() -> None:
    """Keep large arrays out of the heap; glibc alone, which else lets them in, up to 32 MB, once one has been freed."""
    with suppress(AttributeError, OSError):
        libc = ctypes.CDLL(None)
        libc.mallopt(_MMAP_THRESHOLD, LARGE)
        libc.mallopt(_TRIM_THRESHOLD, MORE)


def give_back() -> None:
    """Return to the system what is free; where that is not enough, drop first what follows from materials and what
    libraries keep compiled."""
    if resident() < max(MUCH, _LEFT[0] + MORE):
        return
    _trim()
    if resident() >= max(MUCH, _LEFT[0] + MORE):
        _drop()
        _trim()
    _LEFT[0] = resident()


def _trim() -> None:
    with suppress(AttributeError, OSError):  # glibc's alone
        ctypes.CDLL(None).malloc_trim(0)


def _drop() -> None:
    gc.collect()
    for thing in gc.get_objects():  # materials stay, but not what follows from them
        if issubclass(type(thing), Value):
            thing._derived.clear()
        elif issubclass(type(thing), Fixed):
            thing._conversions.clear()
    if "jax" in sys.modules:
        sys.modules["jax"].clear_caches()  # a program for each operation, shape and dtype
    if "drjit" in sys.modules:
        sys.modules["drjit"].flush_kernel_cache()
        sys.modules["drjit"].flush_malloc_cache()


def resident() -> int:
    """Bytes of memory that this process has; 0 where the system does not say."""
    try:
        return 4096 * int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return 0
