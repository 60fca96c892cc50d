"""How kernels read and write memory, by every length of vectors, and the memory that results are given."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from itertools import product

import numpy as np
import pytest
from copying import placed
from libraries import thinned
from places import ROOT

import gonio as gn
from gonio.compile import plans
from gonio.compile.llvm import machine
from gonio.evaluate import planning
from gonio.machine import memory

needs_a_compiler = pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")


def python(*arguments: str, lanes: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "GONIO_LANES": lanes}
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=300, env=environment)


# Kernels.


@needs_a_compiler
@pytest.mark.parametrize(
    ("lanes", "widths"),
    thinned([(4, "1"), (8, "2"), (16, "3 5"), (4, ""), (8, ""), (16, "")], [(4, "1"), (8, "2"), (16, "3 5")]),
)
def test_every_vector_is_read_and_written_right(lanes, widths):
    """Of 1 to 5 components, in every layout, from and to any place, within the caches and past them, masks too."""
    done = python(str(ROOT / "tests" / "tools" / "copying.py"), *widths.split(), lanes=str(lanes))
    assert done.returncode == 0, done.stderr[-2000:]
    seen = json.loads(done.stdout)
    assert seen["bits"] == min(32 * lanes, machine._own_bits())
    assert seen["failed"] == []


@pytest.mark.parametrize("lanes", thinned(["0", "32", "eight", "8 "], ["32", "8 "]))
def test_a_wrong_number_of_lanes(lanes):
    done = python("-c", "import gonio as gn; gn.Lambertian(0.5).f([0, 0, 1], [0, 0, 1])", lanes=lanes)
    assert done.stderr.splitlines()[-1] == (
        f"gonio.errors.ParameterError: GONIO_LANES={lanes!r}: expected 4, 8 or 16, float32 numbers in a vector; "
        "or unset it"
    )


def test_the_lanes_are_in_the_name_of_a_kernel():
    """One that was compiled for long vectors is not run where shorter ones are asked for."""
    script = "from gonio.compile.llvm import machine; print(machine.processor())"
    names = {lanes: python("-c", script, lanes=lanes).stdout for lanes in ("", "4", "8", "16")}
    own = machine._own_bits()
    assert (names["4"] != names[""]) == (own > 128)
    assert (names["8"] != names[""]) == (own > 256)
    assert names["16"] == names[""] != ""


@needs_a_compiler
@pytest.mark.parametrize(
    ("channels", "dtype"),
    thinned(
        product([1, 2, 3, 4], [np.float32, np.float64]),
        [(1, np.float32), (2, np.float64), (3, np.float32), (4, np.float64)],
    ),
)
def test_large_results_by_threads_in_pieces(channels, dtype, monkeypatch):
    """They are those of small ones: in memory of their own or in the caller's, where lines of the cache are cut too."""
    n = 100_077  # above the sizes from which on helpers join in, and are woken
    rng = np.random.default_rng(channels)
    wi, wo = (gn.direction(rng.uniform(0.0, 1.6, n), rng.uniform(0.0, 6.0, n)).astype(dtype) for _ in "io")
    u = rng.random((n, 2)).astype(dtype)
    m = gn.Lambertian(np.linspace(0.1, 0.5, channels)) + gn.Microfacet(gn.GGX(0.3))
    parts = [slice(at, at + 9000) for at in range(0, n, 9000)]
    want = np.concatenate([m.f(wi[part], wo[part]) for part in parts])
    sampled = [m.sample(wo[part], u[part]) for part in parts]
    monkeypatch.setattr(plans, "CACHED", 1 << 10)
    monkeypatch.setattr(plans, "PIECE", 1 << 20)
    before = gn.engine.threads()
    try:
        for count in (1, 2):
            gn.engine.threads(count)
            planning._PATTERNS.clear()
            fresh = m.replace()
            np.testing.assert_array_equal(fresh.f(wi, wo), want)
            for offset in (0, 8, 16, 32):
                out = placed(np.zeros_like(want), offset)
                np.testing.assert_array_equal(fresh.f(wi, wo, out=out), want)
            for got, *each in zip(fresh.sample(wo, u), *sampled, strict=True):
                np.testing.assert_array_equal(got, np.concatenate(each))
    finally:
        gn.engine.threads(before)
        planning._PATTERNS.clear()


# Results.

COUNT = memory.SMALL // 4 + 5
FLOAT = np.dtype(np.float32)


@pytest.fixture
def rooms(monkeypatch):
    monkeypatch.setattr(memory, "_ROOMS", {})


def address(x: np.ndarray) -> int:
    return x.__array_interface__["data"][0]


def test_memory_of_a_result_that_is_gone_is_used_again(rooms):
    first = memory.empty((COUNT,), FLOAT)
    place = address(first)
    assert place % memory.LINE == 0
    assert address(memory.empty((COUNT,), FLOAT)) != place
    del first
    assert place in {address(memory.empty((COUNT,), FLOAT)) for _ in range(3)}
    assert len(memory._ROOMS[4 * COUNT]) == 2


VIEWS = {
    "itself": lambda x: x,
    "a part": lambda x: x[7:9],
    "another type": lambda x: x.view(np.int32)[::-1],
    "another shape": lambda x: x.reshape(1, -1).T,
    "a broadcast": lambda x: np.broadcast_to(x, (3, *x.shape)),
    "a memoryview": memoryview,
    "its owner": lambda x: x.base,
    "a read-only view": lambda x: np.frombuffer(x, np.uint8),
    "an object": lambda x: [{"x": x}],
}


@pytest.mark.parametrize("name", VIEWS)
def test_memory_that_anybody_sees_is_not_used_again(name, rooms):
    x = memory.empty((COUNT,), FLOAT)
    place, view = address(x), VIEWS[name](x)
    del x
    held = [memory.empty((COUNT,), FLOAT) for _ in range(2 * memory.LOOKS)]
    assert place not in [address(x) for x in held]
    del view, held
    assert place in [address(x) for x in [memory.empty((COUNT,), FLOAT) for _ in range(2 * memory.LOOKS + 1)]]


def test_memory_is_kept_within_a_limit(rooms, monkeypatch):
    monkeypatch.setattr(memory, "lid", lambda: 40 * COUNT)
    held = [memory.empty((COUNT + i % 3,), FLOAT) for i in range(50)]
    assert sum(size * len(kept) for size, kept in memory._ROOMS.items()) <= 20 * COUNT
    assert len({address(x) for x in held}) == 50
    memory.empty((6 * COUNT,), FLOAT)
    assert 24 * COUNT not in memory._ROOMS


def test_threads_never_share_a_result(rooms):
    """Each writes its number all over what it is given, and finds it there."""
    wrong: list[int] = []

    def work(number: int) -> None:
        for _ in range(300):
            x = memory.empty((COUNT,), FLOAT)
            x[::4096] = number
            if (x[::4096] != number).any():
                wrong.append(number)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
