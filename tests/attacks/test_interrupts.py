"""Interrupts and forks at any moment: the numbers stay right, the threads stay there, the child works."""

from __future__ import annotations

import ctypes
import gc
import inspect
import json
import os
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from places import PACKAGE, ROOT

import gonio as gn
from gonio.compile import plans, store, workers
from gonio.compile.llvm import machine
from gonio.compile.threads import share
from gonio.evaluate import planning, tracing
from gonio.machine.aside import apart
from gonio.numerics.embree import EmbreeTriangles
from gonio.uncertainty.table import _ledger as ledger

CAMPAIGN = ROOT / "tests" / "tools" / "interrupting.py"

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="signals and forks are those of POSIX")


def child(*arguments: str, **environment: str) -> str:
    """What a fresh process prints."""
    command = [sys.executable, *arguments]
    run = subprocess.run(command, capture_output=True, text=True, timeout=600, env={**os.environ, **environment})
    assert run.returncode == 0, run.stderr[-2000:]
    return run.stdout


@pytest.mark.parametrize("count", [40, *(pytest.param(n, marks=pytest.mark.full) for n in (100, 600))])
@pytest.mark.parametrize("engine", ["", pytest.param("numpy", marks=pytest.mark.full)])
def test_interrupts_do_no_harm(engine, count):
    """Random exceptions from signal handlers: none is lost, no number is wrong, nothing is written after a call has
    been left, no helper goes missing. (D1, D2)"""
    if not Path("/proc/self/schedstat").exists():
        pytest.skip("needs Linux: the time that each thread has run is read from /proc")
    seen = json.loads(child(str(CAMPAIGN), str(count // 4 if engine else count), "7", "2", GONIO_ENGINE=engine))
    assert seen["wrong"] == 0, seen["where"]
    assert seen["lost interrupts"] == 0, seen["ignored"]
    assert seen["ignored"] == []
    assert engine or seen["helpers lost"] == 0
    assert seen["left over"] == []


class Stop(BaseException):
    """An exception of nobody's."""


def stopped_at(number: int, work: Callable[[], Any]) -> bool:
    """Whether `work` has so many places in gonio's own code where Python looks for signals, that is after calls of
    built-in functions and at the start of its own; an exception is raised at that one."""
    seen = 0

    def place(frame: Any, event: str, argument: Any) -> None:
        nonlocal seen
        code = frame.f_code
        is_closed = event == "call" and code.co_flags & inspect.CO_GENERATOR  # perhaps, and then nobody looks
        if event in ("call", "c_return") and "gonio" in code.co_filename and not is_closed:
            seen += 1
            if seen == number:
                raise Stop

    sys.setprofile(place)
    try:
        work()
    except Stop:
        return True
    finally:
        sys.setprofile(None)
    return False


def taken_and_released(lock: Any) -> bool:
    if not lock.acquire(blocking=False):
        return False
    lock.release()
    return True


@pytest.mark.parametrize(
    "name, stride",
    [("f", 1), ("f, out=", 1), ("sample", 1), ("first f", 5), ("first jacobian", 7), ("compile", 37)],
)
def test_an_exception_at_any_place_does_no_harm(name, stride):
    """One is raised wherever a signal's may be (of longer calls at a stride): the team is free, nobody is in it, no
    lock is held, and the next call is right. (D1, D2)"""
    wi = gn.direction(np.linspace(0.0, 1.5, 70_000), 0.3)
    wo = np.broadcast_to(gn.direction(0.4, 2.0), wi.shape)
    m = gn.Lambertian([0.2, 0.5]) + gn.Microfacet(gn.GGX(0.3))
    u, out = np.full((len(wi), 2), 0.25), np.empty((len(wi), 2))

    def compiled_anew() -> Any:
        tracing._TRACES.clear()
        planning._PATTERNS.clear()
        store._KNOWN.clear()
        return gn.ModifiedPhong(0.5, 3.0).f(wi, wo)

    works: dict[str, Callable[[], Any]] = {
        "f": lambda: m.f(wi, wo),
        "f, out=": lambda: m.f(wi, wo, out=out),
        "sample": lambda: m.sample(wo, u).weight,
        "first f": lambda: m.replace().f(wi, wo),
        "first jacobian": lambda: m.replace().jacobian(wi, wo).f,
        "compile": compiled_anew,
    }
    work, before = works[name], gn.engine.threads()
    gn.engine.threads(2)
    try:
        want = work().copy()
        number = 1
        while stopped_at(number, work):
            words = (ctypes.c_int64 * 9).from_address(workers.team().address)
            assert (words[0], words[8] & 0xFFFFFFFF) == (0, 0), number
            assert apart(taken_and_released, machine.LOCK), number
            if number % (7 * stride) == 1:
                np.testing.assert_array_equal(work(), want)
            number += stride
        assert number > 30
        np.testing.assert_array_equal(work(), want)
    finally:
        gn.engine.threads(before)


def test_long_calls_are_made_of_pieces(monkeypatch):
    """f of many lobes is computed in several calls of the kernel, so that an interrupt is answered between them: the
    rest is not computed. Whatever the pieces are, the numbers are the same. (D25)"""
    wi = gn.direction(np.linspace(0.0, 1.5, 300_000), 0.3)
    wo = np.broadcast_to(gn.direction(0.4, 2.0), wi.shape)
    m = sum((gn.Microfacet(gn.GGX(0.02 * i), gn.Conductor(0.2, 3.9)) for i in range(1, 20)), gn.Lambertian(0.5))
    want, before = m.f(wi, wo), gn.engine.threads()
    calls: list[int] = []

    def counted(count, function, args, outer, inner, grain):
        calls.append(inner)
        if len(calls) == stop:
            raise TimeoutError("from a handler")
        together(count, function, args, outer, inner, grain)

    together, stop = plans.together, 3
    monkeypatch.setattr(plans, "together", counted)
    monkeypatch.setattr(plans, "PIECE", 1 << 20)
    planning._PATTERNS.clear()
    out = np.full(len(wi), -1.0)
    try:
        gn.engine.threads(2)
        with pytest.raises(TimeoutError, match="from a handler"):
            m.replace().f(wi, wo, out=out)
        done = calls[1]
        assert 0 < done < len(wi)
        np.testing.assert_array_equal(out[:done], want[:done])
        np.testing.assert_array_equal(out[done:], -1.0)
        calls.clear()
        stop = -1
        np.testing.assert_array_equal(m.replace().f(wi, wo), want)
        assert len(calls) > 2
    finally:
        gn.engine.threads(before)


def test_a_piece_is_short():
    """The first call of a kernel does some hundredths of a second of work at most, by the size of its graph. (D25)"""
    m = sum((gn.Microfacet(gn.GGX(0.02 * i), gn.Conductor(0.2, 3.9)) for i in range(1, 41)), gn.Lambertian(0.5))
    wo = np.broadcast_to(gn.direction(0.4, 2.0), (20, 3)).copy()
    m.f(wo, wo)
    (plan,) = m._derived[planning.known].values()
    assert plan.plan.piece < 200_000
    m = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))
    m.f(wo, wo)
    (plan,) = m._derived[planning.known].values()
    assert plan.plan.piece > 500_000  # a usual call is one piece


FORKS = """
import os, signal, sys, threading, time
import numpy as np
import gonio as gn
from gonio.evaluate import planning, tracing
from gonio.compile import store

wo = np.array([[0.6, 0.0, 0.8]])
stop = False

def compile_all_the_time():
    while not stop:
        tracing._TRACES.clear()
        planning._PATTERNS.clear()
        store._KNOWN.clear()
        gn.ModifiedPhong(0.5, 3.0).f(wo, wo)

def compute_all_the_time():
    many = np.broadcast_to(wo, (200_000, 3)).copy()
    while not stop:
        gn.Lambertian(0.5).f(many, many)

gn.engine.threads(2)
want = gn.Microfacet(gn.GGX(0.3)).f(wo, wo)
for work in (compile_all_the_time, compile_all_the_time, compute_all_the_time):
    threading.Thread(target=work, daemon=True).start()
for k in range(int(sys.argv[1])):
    time.sleep(0.003 * (k % 7))
    child = os.fork()
    if not child:
        signal.alarm(20)
        many = np.broadcast_to(wo, (100_000, 3)).copy()
        tracing._TRACES.clear()
        planning._PATTERNS.clear()
        store._KNOWN.clear()
        f = gn.Microfacet(gn.GGX(0.3)).f(many, many)
        os._exit(0 if (f == want).all() else 3)
    _, status = os.waitpid(child, 0)
    if status:
        os._exit(print("child", k, "ended with", status, flush=True) or 1)
stop = True
print("fine")
"""


@pytest.mark.parametrize("count", [5, pytest.param(14, marks=pytest.mark.full)])
def test_a_child_works_whatever_is_under_way_at_the_fork(count):
    """Other threads compile and compute without end; each forked child compiles and computes. (D21)"""
    assert child("-W", "ignore::DeprecationWarning", "-c", FORKS, str(count), GONIO_CACHE="off").strip() == "fine"


def test_helpers_that_are_gone_are_replaced():
    """In a child there is none of them; they are made anew, once."""
    workers.wake(7)
    for _ in range(1000):
        if len(workers.team().helpers) >= 7:
            break
        threading.Event().wait(0.01)
    first = {helper.thread for helper in workers.team().helpers.values()}
    assert len(first) >= 7
    workers.wake(7)
    assert {helper.thread for helper in workers.team().helpers.values()} == first


def test_parts_that_nobody_began_are_left_when_one_fails():
    """An error, or an interrupt, in one part: those under way end, no other begins, and then it is raised."""
    begun, before = [], gn.engine.threads()

    def work(number):
        begun.append(number)
        if number == 3:
            raise KeyboardInterrupt

    try:
        for count in (1, 4):
            gn.engine.threads(count)
            begun.clear()
            with pytest.raises(KeyboardInterrupt):
                share(work, [(i,) for i in range(1000)])
            assert 4 <= len(begun) < 1000
    finally:
        gn.engine.threads(before)


def facets() -> Any:
    pytest.importorskip("embreex")
    return EmbreeTriangles([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def shown() -> Any:
    mesh = gn.scenes.Mesh(([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]]))
    gn.render(gn.Lambertian(0.5), gn.ConstantLight(1.0), mesh, size=4, samples=1)
    return mesh


def quoted() -> Any:
    table = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(4, 4, 6))
    ledger(table, ())
    return table


@pytest.mark.parametrize("make", [facets, shown, quoted])
def test_no_line_of_python_runs_as_a_thing_goes(make):
    """An exception that a signal's handler raises in a finalizer is printed, and lost: what is done then, C does."""
    make()  # what is imported late, and kept for all
    ran: list[str] = []

    def seen(frame: Any, event: str, argument: Any) -> None:  # the collector itself calls lines of JAX
        if event == "call" and frame.f_code.co_filename.startswith((str(PACKAGE), weakref.__file__)):
            ran.append(frame.f_code.co_qualname)

    for in_a_circle in (False, True):
        things = [make()]
        gone = weakref.ref(things[0])
        if in_a_circle:  # which the collector finds
            things.append(things)
        else:
            gc.collect()
        gc.disable()
        sys.setprofile(seen)
        try:
            del things
            gc.collect()
        finally:
            sys.setprofile(None)
            gc.enable()
        assert gone() is None and ran == []


def test_no_finalizer_is_written_in_python():
    found = [
        f"{path.relative_to(PACKAGE)}: {name}"
        for path in PACKAGE.rglob("*.py")
        for name in ("weakref.finalize", "WeakKeyDictionary", "WeakValueDictionary", "WeakSet", "def __del__")
        if name in path.read_text(encoding="utf-8")
    ]
    assert found == []


def test_work_apart_is_done_by_a_thread_that_no_signal_reaches():
    """Its result and its errors are those of the work."""
    assert apart(lambda a: (a, threading.get_ident() != threading.main_thread().ident), 5) == (5, True)
    with pytest.raises(ZeroDivisionError):
        apart(lambda: 1 / 0)
