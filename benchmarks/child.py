"""What engine.py and measured.py run in fresh processes. Prints numbers for them to read; not meant to be run by hand.

python child.py numpy blocks|whole    m.f of the pickled (m, wi, wo) on standard input, once per line of it
python child.py first                 seconds: import numpy, import gonio, first and second f of 1000 directions
python child.py memory N              bytes that the process grew by for f of N directions, and those of the arrays
python child.py file PATH             seconds: import gonio, load the file, first and second f of 1000 directions
python child.py held PATH             bytes: of the file's table, most that load and first f allocated, that they
                                      made the process grow by
"""

from __future__ import annotations

import pickle
import sys
import time
from pathlib import Path


def serve_numpy(how: str) -> None:
    """Evaluates with NumPy, in gonio's blocks or (its block made endless) on whole arrays."""
    from gonio.evaluate import blocks

    if how == "whole":
        if not hasattr(blocks, "BLOCK"):
            raise SystemExit("gonio.evaluate.blocks has no BLOCK any more: child.py must learn how to turn blocks off")
        blocks.BLOCK = 1 << 60
    m, wi, wo = pickle.load(sys.stdin.buffer)
    for _ in sys.stdin.buffer:
        m.f(wi, wo)
        print(flush=True)


def first() -> None:
    """Times of the first steps of a process."""
    times = [time.perf_counter()]
    import numpy as np

    times.append(time.perf_counter())
    import gonio as gn

    times.append(time.perf_counter())
    m = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))
    w = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (1000, 1))
    for _ in range(2):
        start = time.perf_counter()
        m.f(w, w)
        times.append(time.perf_counter() - start)
    print(times[1] - times[0], times[2] - times[1], *times[3:])


def peak() -> int:
    """The most memory [bytes] this program had at once; getrusage's ru_maxrss begins with that of its parent."""
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return 1024 * int(status["VmHWM"].split()[0])


def memory(count: int) -> None:
    """Growth of the largest memory the process ever had, from before it makes its arrays to after f."""
    import numpy as np

    import gonio as gn

    m = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))
    small = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (1000, 1))
    m.f(small, small)
    before = peak()
    wi, wo = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
    wi[...] = wo[...] = small[0]
    value = m.f(wi, wo)
    print(peak() - before, wi.nbytes + wo.nbytes + value.nbytes)


def file(path: str) -> None:
    """Times of the first steps with a file."""
    times = [time.perf_counter()]
    import numpy as np

    import gonio as gn

    times.append(time.perf_counter())
    m = gn.load(path)
    times.append(time.perf_counter())
    w = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (1000, 1))
    for _ in range(2):
        m.f(w, w)
        times.append(time.perf_counter())
    print(*np.diff(times))


def held(path: str) -> None:
    """Memory of a file's table (of trees: children and values), its loading and its first f.

    A material without a table was evaluated before.
    """
    import tracemalloc

    import numpy as np

    import gonio as gn
    from gonio.formats.window_xml import TensorTree

    w = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (1000, 1))
    gn.Microfacet(gn.GGX(0.3)).f(w, w)
    before = peak()
    gn.load(path).f(w, w)
    grown = peak() - before
    tracemalloc.start()
    m = gn.load(path)
    m.f(w, w)
    if m.format == "RGL":
        table = sum(a.nbytes for a in m.stored.values())
    elif isinstance(m, TensorTree):
        table = m.first.nbytes + m.values.nbytes
    else:
        table = 8 * m.valid.size
    print(table, tracemalloc.get_traced_memory()[1], grown)


if __name__ == "__main__":
    command, *arguments = sys.argv[1:]
    if command == "numpy":
        serve_numpy(arguments[0])
    elif command == "first":
        first()
    elif command == "file":
        file(arguments[0])
    elif command == "held":
        held(arguments[0])
    else:
        memory(int(arguments[0]))
