"""What many wavelengths cost: f of a rough metal at 8000 pairs of directions, against one channel.

    python benchmarks/spectra.py > benchmarks/spectra.txt

One thread. Each number is the shortest of 60 calls, in nanoseconds for a pair of directions.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import timing

import gonio as gn

PAIRS, CALLS = 8000, 60
COUNTS = (1, 3, 8, 31, 81, 400)
BARS = {("float32", 31): 7.0, ("float64", 31): 8.0, ("float32", 400): 80.0, ("float64", 400): 80.0}
"""How many times one channel is asked for at most."""


def shortest(call: Callable[[], Any]) -> float:
    """Seconds of the fastest of several calls."""
    call()
    seconds = []
    for _ in range(CALLS):
        start = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def main() -> None:
    """A line for each number of wavelengths."""
    print("\n".join(timing.machine(3)))
    gn.engine.threads(1)
    rng = np.random.default_rng(0)
    directions = [gn.direction(np.arccos(np.sqrt(u[:, 0])), 2.0 * np.pi * u[:, 1]) for u in rng.random((2, PAIRS, 2))]
    for dtype in ("float32", "float64"):
        wi, wo = (w.astype(dtype) for w in directions)
        single = 0.0
        for count in COUNTS:
            m = gn.material("gold", wavelengths=np.linspace(400.0, 700.0, count) if count > 1 else 550.0)
            taken = shortest(lambda m=m, wi=wi, wo=wo: m.f(wi, wo)) / PAIRS * 1e9
            single = single or taken
            bar = BARS.get((dtype, count))
            verdict = "" if bar is None else f"<= {bar:g}x {timing.verdict_of(taken <= bar * single)}"
            print(f"{dtype} {count:4d} wavelengths {taken:8.2f} ns {taken / single:7.1f}x  {verdict}".rstrip())


if __name__ == "__main__":
    main()
