"""One pool of threads: `gn.engine.threads`, GONIO_THREADS, the affinity and a container's limit bind all that gonio
computes.

Each script runs in a process of its own, whose threads are told apart by the time that each of them has run.
"""

from __future__ import annotations

import gc
import inspect
import json
import os
import shutil
import subprocess
import sys
import threading
import time
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from places import PACKAGE

import gonio as gn
from gonio.compile import plans, store, workers
from gonio.compile.threads import container_limit, share
from gonio.scenes import traced

needs_linux = pytest.mark.skipif(
    not Path("/proc/self/schedstat").exists(), reason="needs Linux: the time that each thread has run is from /proc"
)

START = """
import json, os, threading, time
from contextlib import suppress
from pathlib import Path
import numpy as np
import gonio as gn
from gonio.compile import workers
from gonio.scenes import traced

def ran():
    times = {}
    for p in Path("/proc/self/task").iterdir():
        with suppress(OSError):  # it has ended since
            times[int(p.name)] = int((p / "schedstat").read_text().split()[0])
    return times

def until(condition):
    "Wait for what other threads are still to do, on a busy machine."
    end = time.monotonic() + 60.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.001)

class Spectral(gn.Lambertian):
    channel_names = tuple(np.linspace(400.0, 700.0, 200))

MATERIALS = {
    "coloured": gn.Lambertian([0.2, 0.5, 0.7]) + gn.Microfacet(gn.GGX(0.3)),
    "spectral": Spectral(np.linspace(0.1, 0.9, 200)),
}
LIGHT = gn.EnvironmentLight.studio(height=16)

def computing(work):
    "What it gives, and the threads that ran for more than a millisecond: one that goes to sleep computes nothing."
    until(lambda: all(helper.asleep for helper in workers.team().helpers.values()))
    before = ran()
    result = work()
    return result, {tid for tid, ns in ran().items() if ns > before.get(tid, 0) + 1_000_000}

live, most, tile = [], [0], traced.tile
def counted(*args):
    live.append(threading.get_ident())
    most[0] = max(most[0], len(live))
    try:
        return tile(*args)
    finally:
        live.pop()
traced.tile = counted
"""


def run(code: str, **environment: str) -> dict:
    """What a script prints, as JSON."""
    command = [sys.executable, "-W", "ignore", "-c", START + code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env={**os.environ, **environment})
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


PICTURES = """
gn.engine.threads(COUNT)
sums = {}
for name, m in MATERIALS.items():
    for size, samples in ((96, 16), (2, 1 << 12)):
        picture, threads = computing(lambda: gn.render(m, LIGHT, size=size, samples=samples))
        helpers = {helper.thread for helper in workers.team().helpers.values()}
        assert threads <= helpers | {threading.get_native_id()}, (name, threads, helpers)
        sums[f"{name} {size}"] = picture.pixels.tobytes().hex()[:4000]
until(lambda: len(workers.team().helpers) >= COUNT - 1)
print(json.dumps({"most": most[0], "helpers": len(workers.team().helpers), "sums": sums}))
"""


@needs_linux
@pytest.mark.parametrize("engine", ["", pytest.param("numpy", marks=pytest.mark.full)])
def test_a_picture_takes_as_many_threads_as_are_asked_for(engine):
    """None beside the caller and the pool's helpers computes, BLAS's own neither, and no tile shares out what it calls,
    be its batches as large as they may; the picture is the same."""
    seen = {n: run(PICTURES.replace("COUNT", str(n)), GONIO_ENGINE=engine) for n in (1, 3)}
    for count, found in seen.items():
        assert found["helpers"] == count - 1
        assert found["most"] <= count
        assert found["sums"] == seen[1]["sums"]


def test_what_is_called_within_a_part_is_not_shared_out(monkeypatch):
    """Neither kernels nor further parts, by the caller or by a helper; afterwards all is shared out again."""
    lit = np.broadcast_to(gn.direction(0.4, 2.0), (1_000_000, 3))  # work that wakes helpers
    m, before, led, threads = gn.Lambertian(0.5), gn.engine.threads(), [], set()
    together = plans.together
    monkeypatch.setattr(plans, "together", lambda *args: led.append(1) or together(*args))
    barrier = threading.Barrier(3, timeout=20)

    def part(number: int) -> None:
        barrier.wait()  # until all three are at their part
        m.f(lit, lit)
        inner: set[int] = set()
        share(lambda _: inner.add(threading.get_ident()), [(i,) for i in range(50)])
        assert inner == {threading.get_ident()}
        threads.add(threading.get_ident())

    try:
        gn.engine.threads(3)
        share(part, [(i,) for i in range(3)])
        assert len(threads) == 3 and not led
        m.f(lit, lit)
        assert led
        assert not workers.busy() and not workers.team().jobs
    finally:
        gn.engine.threads(before)


def test_helpers_keep_nothing_of_what_they_did():
    """A part holds arrays and materials: they go when it is done, not when the next is shared out."""

    class Material:
        pass

    material, before, barrier = Material(), gn.engine.threads(), threading.Barrier(2, timeout=20)
    gone = weakref.ref(material)

    def part(number: int, material: Material | None = material) -> None:
        barrier.wait()  # until a helper is at its part, too

    try:
        gn.engine.threads(2)
        share(part, [(i,) for i in range(2)])
    finally:
        gn.engine.threads(before)
    del part, material
    deadline = time.monotonic() + 20.0
    while gone() is not None and time.monotonic() < deadline:  # the helper is on its way to sleep
        gc.collect()
        time.sleep(0.001)
    assert gone() is None


class Stop(BaseException):
    """An exception of nobody's."""


def test_an_exception_at_any_place_leaves_no_part_under_way():
    """One is raised wherever a signal's may be: `share` then waits for the helpers, offers nothing any more, and the
    next job is done whole."""
    before, under_way, done = gn.engine.threads(), set(), []
    main = threading.get_ident()

    def part(number: int) -> None:
        if threading.get_ident() != main:
            under_way.add(number)
            time.sleep(0.002)
            under_way.discard(number)
        done.append(number)

    def stopped_at(number: int) -> bool:
        seen = 0

        def place(frame: Any, event: str, argument: Any) -> None:
            nonlocal seen
            code = frame.f_code
            is_closed = event == "call" and code.co_flags & inspect.CO_GENERATOR  # perhaps: signals do not come there
            if event in ("call", "c_return") and Path(code.co_filename).is_relative_to(PACKAGE) and not is_closed:
                seen += 1
                if seen == number:
                    raise Stop

        sys.setprofile(place)
        try:
            share(part, [(i,) for i in range(6)])
        except Stop:
            return True
        finally:
            sys.setprofile(None)
        return False

    try:
        gn.engine.threads(3)
        number = 1
        while stopped_at(number):
            assert not under_way and not workers.busy(), number
            number += 1
        assert number > 15
        done.clear()
        share(part, [(i,) for i in range(100)])
        assert sorted(done) == list(range(100))
    finally:
        gn.engine.threads(before)


def test_a_picture_takes_helpers(monkeypatch):
    """With three threads three are at a tile at the same time."""
    before, tile, barrier = gn.engine.threads(), traced.tile, threading.Barrier(3, timeout=20)
    places: set[int] = set()

    def met(*args):
        if threading.get_ident() not in places:
            places.add(threading.get_ident())
            barrier.wait()
        return tile(*args)

    monkeypatch.setattr(traced, "tile", met)
    try:
        gn.engine.threads(3)
        gn.render(gn.Lambertian(0.5), gn.ConstantLight(1.0), size=64, samples=64)
        assert len(places) == 3
    finally:
        gn.engine.threads(before)


@needs_linux
def test_the_affinity_binds():
    """That of now, for the number of threads and for where helpers run that were at work elsewhere before."""
    processors = sorted(os.sched_getaffinity(0))
    if len(processors) < 2:
        pytest.skip("one processor")
    code = f"""
os.environ.pop("GONIO_THREADS", None)
gn.render(MATERIALS["coloured"], LIGHT, size=64, samples=64)
until(lambda: workers.team().helpers)
before = [gn.engine.threads(), len(workers.team().helpers)]
os.sched_setaffinity(0, [{processors[1]}])
_, threads = computing(lambda: gn.render(MATERIALS["coloured"], LIGHT, size=64, samples=64))
own = [threads == {{threading.get_native_id()}}, gn.engine.threads()]
gn.engine.threads(2)
gn.render(MATERIALS["coloured"], LIGHT, size=96, samples=64)
helper = workers.team().helpers[0].thread
print(json.dumps({{"before": before, "after": own, "helper": sorted(os.sched_getaffinity(helper))}}))
"""
    found = run(code)
    assert found["before"][0] >= 2 and found["before"][1] >= 1
    assert found["after"] == [True, 1]
    assert found["helper"] == [processors[1]]


def test_the_environment_binds():
    assert run("print(json.dumps(gn.engine.threads()))", GONIO_THREADS="3") == 3


@pytest.mark.parametrize(
    "membership, files, limit",
    [
        ("0::/\n", {"cpu.max": "150000 100000"}, 2),
        ("0::/a/b\n", {"a/cpu.max": "100000 100000", "a/b/cpu.max": "max 100000"}, 1),
        ("0::/elsewhere/b\n", {"cpu.max": "300000 100000"}, 3),
        ("0::/\n", {"cpu.max": "max 100000"}, float("inf")),
        ("0::/\n", {}, float("inf")),
        (
            "4:memory:/x\n2:cpu,cpuacct:/x\n0::/x\n",
            {"cpu,cpuacct/x/cpu.cfs_quota_us": "50000", "cpu,cpuacct/x/cpu.cfs_period_us": "100000"},
            1,
        ),
        ("2:cpu:/x\n", {"cpu/cpu.cfs_quota_us": "-1", "cpu/cpu.cfs_period_us": "100000"}, float("inf")),
        ("damaged", {"cpu.max": "100000 100000"}, float("inf")),
    ],
)
def test_limits_of_containers_are_read(tmp_path, membership, files, limit):
    """As the kernel's documentation has them, of both versions; what is not there sets no limit."""
    for name, text in files.items():
        path = tmp_path / "root" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "cgroup").write_text(membership)
    assert container_limit(str(tmp_path / "cgroup"), str(tmp_path / "root")) == limit


def test_a_container_limits_threads(monkeypatch):
    from gonio.compile import threads

    monkeypatch.setattr(threads, "_COUNT", [])
    monkeypatch.delenv("GONIO_THREADS", raising=False)
    monkeypatch.setattr(threads, "container_limit", lambda: 1)
    assert gn.engine.threads() == 1


COMPILE = Path(store.__file__).parent


@pytest.mark.parametrize(
    "name",
    [*sorted(str(p.relative_to(COMPILE)) for p in COMPILE.rglob("*.py")), "../trace/graph.py", "../arrays/ops.py"],
)
def test_every_module_of_the_compiler_is_in_the_name_of_a_kernel(name, tmp_path, monkeypatch):
    """A change of any of them, in folders too, and of what is known of operations, names kernels anew."""
    copy = tmp_path / "gonio"
    for room in ("compile", "trace", "arrays"):
        shutil.copytree(COMPILE.parent / room, copy / room)
    monkeypatch.setattr(store, "__file__", str(copy / "compile" / "store.py"))
    before = store._sources()
    assert before
    with open(copy / "compile" / name, "a") as file:
        file.write("# changed\n")
    assert store._sources() != before
