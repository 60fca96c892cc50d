"""Memory that a file of tests leaves behind: a worker runs some hundred of them, and is to stay below 1 GB."""

from __future__ import annotations

import ctypes
import gc
import sys
from contextlib import suppress
from pathlib import Path

from gonio.arrays import Fixed
from gonio.formula.value import Value

MUCH = 800 << 20
"""Bytes from which on it is worth the time to compile again what other files of tests have compiled, too."""


def give_back() -> None:
    """Return to the system what is free; where this process has much, drop before what libraries keep compiled."""
    if resident() > MUCH:
        gc.collect()
        for thing in gc.get_objects():  # materials of modules stay, but not what follows from them
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


def resident() -> int:
    """Bytes of memory that this process has; 0 where the system does not say."""
    try:
        return 4096 * int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return 0
