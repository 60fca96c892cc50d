"""Compiled copies of vectors: of any length, layout and type, from and to any place in memory. Prints what is wrong.

    python tests/tools/copying.py         of 1 to 5 components, and many lengths
    python tests/tools/copying.py 2 4     of so many components, and few lengths

GONIO_LANES says how many numbers a vector of the processor holds. Results are also written past the caches, which
kernels do with large ones only, and where they begin with a line of the cache.
"""

from __future__ import annotations

import json
import sys

import numpy as np

from gonio.compile import plans
from gonio.compile.llvm import machine
from gonio.compile.llvm.program import EACH
from gonio.compile.plans import Data, KernelPlan, Result, carry_out, prepare
from gonio.trace.graph import REAL, Graph

SIZES = (1, 3, 4, 7, 8, 15, 16, 17, 31, 32, 33, 64, 100, 1000, 4133)
FEW = (1, 7, 16, 33, 1000)


def placed(x: np.ndarray, offset: int) -> np.ndarray:
    """A copy that begins so many bytes after a line of the cache."""
    room = np.empty(x.nbytes + 128, np.uint8)
    start = -room.__array_interface__["data"][0] % 64 + offset
    copy = room[start : start + x.nbytes].view(x.dtype).reshape(x.shape)
    copy[...] = x
    return copy


def layouts(x: np.ndarray) -> list[np.ndarray]:
    """The same vectors side by side, not aligned, in planes, padded, backwards."""
    wide = np.zeros((len(x), x.shape[1] + 2), x.dtype)
    wide[:, 1:-1] = x
    return [placed(x, 0), placed(x, x.itemsize), np.asfortranarray(x), wide[:, 1:-1], placed(x[::-1], 4)[::-1]]


def copying(x: np.ndarray) -> KernelPlan:
    """The components in reverse, whether each is positive, and the first alone."""
    graph, width = Graph(), x.shape[1]
    loads = [graph.load(0, c) for c in range(width)]
    positive = [graph.apply("gt", load, graph.constant(0.0, REAL)) for load in loads]
    results = [Result(tuple(loads[::-1]), EACH, (width,)), Result(tuple(positive), EACH, (width,))]
    return prepare(graph, [*results, Result((loads[0],), EACH, ())], Data([(x, width)], 1, [], x.shape[:1], x.dtype))


def wrong(width: int, n: int, dtype: type, past: bool) -> int:
    """How many copies differ from the original."""
    count, original = 0, np.random.default_rng(n).normal(size=(n, width)).astype(dtype)
    original[::3, 0] = np.nan
    want = (original[:, ::-1], original > 0, original[:, 0])
    plans.CACHED = -1 if past else 1 << 40
    for x in layouts(original):
        plan = copying(x)
        for offset in (0, original.itemsize, 16, 32):
            out = placed(np.zeros_like(original), offset)
            got = carry_out(plan, [x], [out])
            count += sum(not np.array_equal(a, b, equal_nan=a.dtype != bool) for a, b in zip(got, want, strict=True))
    return count


if __name__ == "__main__":
    widths, sizes = ([*map(int, sys.argv[1:])], FEW) if sys.argv[1:] else (range(1, 6), SIZES)
    cases = [(w, n, d, p) for w in widths for n in sizes for d in (np.float32, np.float64) for p in (False, True)]
    failed = [f"{w} x {n} {d.__name__} {'past' if p else 'near'}" for w, n, d, p in cases if wrong(w, n, d, p)]
    print(json.dumps({"bits": machine.lane_bits(), "failed": failed}))
