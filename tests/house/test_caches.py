"""What is kept in a process for later calls: within one lid, found while it is used, dropped and made again."""

from __future__ import annotations

import gc
import threading
import tracemalloc
import weakref

import numpy as np
import pytest

import gonio as gn
from gonio.arrays.kinds import VALUE
from gonio.base import kernels
from gonio.compile import store
from gonio.evaluate import planning, tracing
from gonio.machine import caches
from gonio.numerics.lattice import lattice

compiled = pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
W = np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]])


@pytest.fixture
def small(monkeypatch):
    """A lid of 80 000 bytes, of which a generation makes 20 000."""
    monkeypatch.setattr(caches, "lid", lambda: 80_000)
    monkeypatch.setattr(caches, "_MADE", [0])


def test_what_is_asked_for_stays_and_the_rest_goes(small):
    cache = caches.Cache(len)
    for i in range(100):
        cache.keep(i, bytes(1000))
        assert cache.find(0) is not None
        assert (len(cache) + len(cache.before)) * (1000 + caches.ENTRY) <= 40_000 + 1000 + caches.ENTRY
    assert cache.find(1) is None
    assert cache.find(99) is not None


def test_what_was_made_last_stays_however_large_it_is(small):
    cache = caches.Cache(len)
    cache.keep("large", bytes(1_000_000))
    assert cache.find("large") is not None
    cache.keep("larger", bytes(2_000_000))
    cache.keep("small", bytes(10))
    assert cache.find("large") is None
    assert cache.find("larger") is not None


def test_one_lid_is_for_all_caches(small):
    a, b, c = caches.Cache(len), caches.Cache(len), caches.Passing()
    a.keep("a", bytes(10))
    c["c"] = 1
    for i in range(40):
        b.keep(i, bytes(1000))
    assert a.find("a") is None
    assert not c


def test_a_cache_that_nobody_has_is_forgotten(small):
    alive = len(caches._CACHES)
    for _ in range(50):
        caches.Passing()
    caches.made(20_001)
    assert len(caches._CACHES) <= alive


def test_arrays_of_a_function_are_under_the_lid(small):
    made = []

    @caches.kept
    def zeros(n, dtype="f8"):
        made.append(n)
        return np.zeros(n, dtype), [np.zeros(n, dtype)]

    assert zeros(100)[0] is zeros(100)[0] is not zeros(100, dtype="f4")[0]
    for n in range(101, 140):
        zeros(n)
    assert made.count(100) == 2
    zeros(100)
    assert made.count(100) == 3
    assert lattice(77).nbytes == caches._bytes(lattice(77)) == 77 * 16


@compiled
def test_plans_traces_and_kernels_are_dropped_and_made_again(small):
    """Results are the same to the last bit, and plans that are in use are found in each generation."""
    m = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))
    want = m.f(W, W)
    for n in range(3, 40):
        w = np.broadcast_to(W[1], (n, 3)).copy()
        gn.Lambertian(0.5).f(w, w)
    for cache in (tracing._TRACES, planning._PATTERNS, store._KNOWN):
        assert sum(cache.size(value) for value in [*cache.values(), *cache.before.values()]) <= 60_000
    assert m._derived[planning.known] == m._alike[planning.known] == {}
    np.testing.assert_array_equal(m.f(W, W), want)
    np.testing.assert_array_equal(m.replace(alpha=0.3).f(W, W), want)


@compiled
def test_a_kernel_that_runs_is_not_dropped(small):
    """Threads compute while another one ends generation after generation."""
    w = np.broadcast_to(W[1], (5000, 3)).copy()
    m = gn.Lambertian([0.2, 0.5]) + gn.Phong(0.1, 8.0)
    want, wrong, going = m.f(w, w), [], [True]

    def compute():
        while going:
            if not np.array_equal(m.f(w, w), want):
                wrong.append(1)

    threads = [threading.Thread(target=compute) for _ in range(2)]
    for thread in threads:
        thread.start()
    for _ in range(100):
        caches.made(20_001)
        gc.collect(0)
    going.clear()
    for thread in threads:
        thread.join()
    assert not wrong


def test_a_formula_that_cannot_be_traced_keeps_no_arrays():
    class Untraced(gn.Reflectance):
        """Fails on symbols."""

        def formula(self, wi, wo):
            return 0.3 + np.asarray(wi.z) * 0.0 if isinstance(wi.z, np.ndarray) else 1 / 0

    m, held = Untraced(), []
    for _ in range(3):
        w = W.copy()
        np.testing.assert_allclose(m.f(w, w), 0.3)
        held.append(weakref.ref(w))
        del w
    assert [array() for array in held] == [None] * 3


def test_structures_without_end_stay_below_the_lid(monkeypatch):
    """By what they are said to take, and by what Python has given out, which is no more than that."""
    monkeypatch.setattr(caches, "lid", lambda: 1_000_000)
    m, task = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9)), tracing.Task(kernels.value, (VALUE,), (3, 3))
    tracing.traced(task, m + gn.Phong(0.001, 8.0), 3)  # what the first one makes for all
    tracing._TRACES.clear()
    gc.collect()
    seen = []
    tracemalloc.start()
    try:
        for _ in range(15):
            m = m + gn.Phong(0.001, 8.0)
            tracing.traced(task, m, 3)
            held = [*tracing._TRACES.values(), *tracing._TRACES.before.values()]
            said = sum(map(tracing._TRACES.size, held)) + caches.ENTRY * len(held)
            seen.append((said, tracemalloc.get_traced_memory()[0]))
    finally:
        tracemalloc.stop()
    most = max(said for said, _ in seen)
    assert 250_000 < most <= 500_000 + tracing._TRACES.size(held[-1])
    for said, given in seen:
        assert given < said + 100_000  # the material itself, and garbage
    assert seen[-1][1] > 0.4 * seen[-1][0]


@pytest.mark.parametrize("text", ["0", "-1", "1.5", "all", "1G", "9999999999"])
def test_a_wrong_lid_is_refused(text, monkeypatch):
    monkeypatch.setenv("GONIO_KEEP", text)
    caches.lid.cache_clear()
    try:
        with pytest.raises(gn.errors.ParameterError, match=f"GONIO_KEEP='{text}': expected MiB"):
            caches.lid()
    finally:
        caches.lid.cache_clear()
