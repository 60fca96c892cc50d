"""Interrupts at random moments: a few in tests/attacks/test_interrupts.py, 1e5 in benchmarks/interrupts.py.

`python tests/tools/interrupting.py COUNT SEED THREADS` interrupts what gonio is asked for, until COUNT interrupts have
come, by SIGALRM and by SIGINT in turn; each raises an exception wherever the program is. What is asked for again
afterwards must be right to the last bit, nothing may be written any more, the helpers must all be there and at work. It
prints what it saw as JSON.
"""

from __future__ import annotations

import collections
import faulthandler
import json
import os
import random
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import gonio as gn
from gonio.compile import store, workers
from gonio.evaluate import planning, tracing


class Timeout(Exception):
    """What a program's own handler of SIGALRM raises: no KeyboardInterrupt, and nothing that gonio knows of."""


class Interrupts:
    """Signals at random times; each raises an exception, once, while `armed`."""

    def __init__(self, seed: int):
        self.armed, self.raised, self.caught = False, 0, 0
        self.random = random.Random(seed)
        signal.signal(signal.SIGALRM, self.arrived)
        signal.signal(signal.SIGINT, self.arrived)
        self.other = os.fork()  # who sends SIGINT
        if not self.other:
            parent = os.getppid()
            while True:
                time.sleep(self.random.expovariate(150.0))
                if os.getppid() != parent:
                    os._exit(0)
                os.kill(parent, signal.SIGINT)

    def arrived(self, number: int, frame: Any) -> None:
        if self.armed:
            self.armed = False
            self.raised += 1
            raise KeyboardInterrupt if number == signal.SIGINT else Timeout

    def during(self, work: Callable[[], Any], seconds: float) -> tuple[bool, Any]:
        """Whether `work` came to its end, and what it gave; a signal comes within so many seconds."""
        signal.setitimer(signal.ITIMER_REAL, self.random.uniform(1e-6, seconds))
        try:
            self.armed = True
            result = work()
            self.armed = False
        except (Timeout, KeyboardInterrupt):
            self.caught += 1
            return False, None
        finally:
            self.armed = False
        return True, result

    def end(self) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        os.kill(self.other, signal.SIGKILL)
        os.waitpid(self.other, 0)


def directions(n: int, seed: int) -> np.ndarray:
    v = np.random.default_rng(seed).normal(size=(n, 3))
    v[:, 2] = abs(v[:, 2]) + 0.01
    return v / np.linalg.norm(v, axis=1)[:, None]


def works(folder: Path) -> dict[str, Callable[[], Any]]:
    """What is interrupted, by name; each gives arrays to compare."""
    m = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9)) + gn.OrenNayar(0.5, 0.3)
    wi, wo, few = directions(100_000, 1), directions(100_000, 2), directions(50, 3)
    u = np.random.default_rng(4).random((100_000, 2))
    out = np.empty(len(wi))
    light = gn.EnvironmentLight.studio(height=16)
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    boxes = gn.Scene([gn.scenes.Mesh((corners + 2.0 * k, sides), gn.Lambertian(0.5), 1.0) for k in range(2)])
    rows = few, few[::-1], gn.OrenNayar(0.5, 0.3).f(few, few[::-1])
    small = gn.tables.tabulate(m, resolution=(4, 4, 6), anisotropic=False)

    def into() -> Any:
        out[:] = -1.0
        return m.f(wi, wo, out=out).copy()

    def anew() -> Any:
        tracing._TRACES.clear()
        planning._PATTERNS.clear()
        store._KNOWN.clear()
        return gn.ModifiedPhong(0.5, 3.0).f(few, few)

    def saved(name: str) -> Callable[[], Any]:
        def work() -> Any:
            gn.save(small, folder / name)
            return gn.load(folder / name).f(few[:5], few[5:10])

        return work

    computing = {
        "f": lambda: m.f(wi, wo),
        "f, out=": into,
        "f of float32": lambda: m.f(wi.astype("f4"), wo.astype("f4")),
        "sample": lambda: m.sample(wo, u).weight,
        "jacobian": lambda: m.jacobian(wi[:40_000], wo[:40_000]).f,
        "albedo": lambda: gn.albedo(m, few),
        "render": lambda: gn.render(m, light, size=24, samples=8).pixels,
        "radiosity": lambda: gn.scenes.radiosity(boxes, 60, "rays", tolerance=0.2).radiosity,
        "fit": lambda: gn.fit(rows, gn.OrenNayar()).model.rho,
        "compile": anew,
    }
    saving = {"save CSV": saved("a.csv"), "save netCDF": saved("a.nc"), "save Zarr": saved("a.zarr")}
    return computing | (saving if planning.available() else {})  # whoever computes, it is the same


WEIGHTS = {
    "compile": 0.2,
    "save netCDF": 0.2,
    "save Zarr": 0.1,
    "save CSV": 0.5,
    "render": 0.5,
    "albedo": 0.5,
    "radiosity": 0.5,
}


def busy(tid: int) -> int:
    """Nanoseconds that a thread has run."""
    return int(Path(f"/proc/self/task/{tid}/schedstat").read_text().split()[0])


def campaign(count: int, seed: int, threads: int) -> dict[str, Any]:
    gn.engine.threads(threads)
    ignored: list[str] = []
    sys.unraisablehook = lambda info: ignored.append(f"{info.exc_type.__name__} in {info.object!r:.80}")
    wrong: collections.Counter[str] = collections.Counter()
    hit: collections.Counter[str] = collections.Counter()
    with TemporaryDirectory() as folder:
        asked = works(Path(folder))
        want, took = {}, {}
        for name, work in asked.items():
            work()
            start = time.perf_counter()
            want[name] = work()
            took[name] = time.perf_counter() - start
        names = list(asked)
        weights = [WEIGHTS.get(name, 1.0) for name in names]
        signals = Interrupts(seed)
        while signals.raised < count:
            (name,) = signals.random.choices(names, weights)
            ended, result = signals.during(asked[name], 1.5 * took[name])
            if ended:
                wrong[name] += not np.array_equal(result, want[name], equal_nan=True)
                continue
            hit[name] += 1
            faulthandler.dump_traceback_later(120, exit=True)
            if name == "f, out=":  # nobody writes to it any more
                into = next(c.cell_contents for c in asked[name].__closure__ if isinstance(c.cell_contents, np.ndarray))
                into[:] = -2.0
                time.sleep(2e-4)
                wrong["written to later"] += bool((into != -2.0).any())
        signals.end()
        for name, work in asked.items():
            wrong[f"{name}, at the end"] += not np.array_equal(work(), want[name], equal_nan=True)
        made = (p.relative_to(folder) for p in Path(folder).rglob("*"))
        left = sorted(str(p) for p in made if p.parts[0].startswith("."))
    members = list(workers.team().helpers.values())
    before = [busy(helper.thread) for helper in members]
    for _ in range(200 if planning.available() else 20):
        asked["f"]()
    lost = threads - 1 - sum(busy(h.thread) - b > 1e6 for h, b in zip(members, before, strict=True))
    return {
        "interrupts": signals.raised,
        "lost interrupts": signals.raised - signals.caught,
        "ignored": ignored,
        "wrong": sum(wrong.values()),
        "where": {name: n for name, n in wrong.items() if n},
        "hit": dict(hit),
        "helpers lost": lost,
        "left over": left,
    }


if __name__ == "__main__":
    print(json.dumps(campaign(*map(int, sys.argv[1:]))))
