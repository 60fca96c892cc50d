"""Memory that tests leave behind: a worker runs thousands of them, and is to stay near 1 GB."""

from __future__ import annotations

import ctypes
import gc
import sys
from contextlib import suppress
from pathlib import Path

from gonio.arrays import Fixed
from gonio.formula.value import Value

MUCH, MORE = 600 << 20, 100 << 20
"""Bytes from which on it is worth the time to look, and by which a process has grown since the last look."""
_LEFT = [0]


def give_back() -> None:
    """Drop what follows from materials and what libraries keep compiled, and return it to the system."""
    if resident() < max(MUCH, _LEFT[0] + MORE):
        return
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
    with suppress(AttributeError, OSError):  # glibc's alone
        ctypes.CDLL(None).malloc_trim(0)
    _LEFT[0] = resident()


def resident() -> int:
    """Bytes of memory that this process has; 0 where the system does not say."""
    try:
        return 4096 * int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return 0
