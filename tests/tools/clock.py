"""The processor time of a call, for tests of how it grows: of this thread, without the collector of garbage.

What the tests' process holds by then, such as JAX, makes one collection take a second, wherever it happens to come.
"""

import gc
from collections.abc import Callable
from time import thread_time
from typing import Any


def seconds(call: Callable[[], Any]) -> float:
    """Seconds that a call takes."""
    collects = gc.isenabled()
    gc.disable()
    start = thread_time()
    try:
        call()
        return thread_time() - start
    finally:
        if collects:
            gc.enable()
