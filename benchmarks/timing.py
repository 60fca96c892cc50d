"""Timing engines in turn, and saying on what: rounds in random order, ratios of one round, facts of the machine.

An engine is a name and a function that sets everything up and returns the call that is timed. In each round every
engine of a case runs once, in an order drawn anew. Before a timed call the others' threads get time to fall asleep
(OpenMP and Dr.Jit keep theirs spinning, on the next engine's cores) and the engine runs once untimed, so that every
one finds its own arrays in the caches. What a call allocates counts; releasing it does not.
"""

from __future__ import annotations

import gc
import os
import platform
import subprocess
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

import gonio as gn

THREADS = 2
SETTLE = 0.01
"""Seconds of sleep before an engine's turn."""
LONG = 0.3
"""Seconds; a call that takes longer is not repeated untimed before it is timed."""


@dataclass
class Engine:
    """One way to do a case's work.

    build     prepares inputs and code, untimed; returns the call that is timed, whose result is stored when it returns
    target    how many times as fast gonio is asked to be; None where that is for information
    values    the result as an array like that of gonio's f, to see that equal work is done
    moved     bytes that one call moves, for a yardstick of memory; None for an engine that does the case's work
    """

    name: str
    build: Callable[[], Callable[[], Any]]
    target: float | None = None
    values: Callable[[Any], np.ndarray] | None = None
    moved: float | None = None


@dataclass
class Case:
    """Engines that do the same work: `count` evaluations that read and write `traffic` bytes each.

    The first of `ours` is gonio as a user calls it; a second writes into an array that is already there. `rested`: the
    timed call is the first one after the pause.
    """

    title: str
    count: int
    traffic: int
    ours: Sequence[Engine]
    peers: Sequence[Engine] = ()
    note: str = ""
    rested: bool = False


@dataclass
class Timed:
    """What was measured of one engine: seconds of each round, or why there are none."""

    engine: Engine
    seconds: np.ndarray = field(default_factory=lambda: np.empty(0))
    values: np.ndarray | None = None
    failure: str = ""

    @property
    def median(self) -> float:
        return float(np.median(self.seconds))


def first_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".partition("\n")[0][:90]


def measure(engines: Sequence[Engine], rounds: int, rested: bool = False, warm: float = 0.0) -> list[Timed]:
    """All engines, timed in turn. One that cannot be built or run is reported, and left out of the rounds.

    `rested`: without the untimed call after the pause; `warm`: with as many as take so many seconds.
    """
    timed = [Timed(engine) for engine in engines]
    calls: list[tuple[Timed, Callable[[], Any], bool]] = []
    for t in timed:
        try:
            call = t.engine.build()
            result = call()  # compiles
            t.values = t.engine.values(result) if t.engine.values else None
            del result
            calls.append((t, call, _seconds(call) > LONG))
        except Exception as error:  # a peer that is not installed, or lacks what is asked of it
            t.failure = first_line(error)
    order, seconds = np.random.default_rng(1), {id(t): [] for t, _, _ in calls}
    for _ in range(rounds):
        for i in order.permutation(len(calls)):
            t, call, long = calls[i]
            time.sleep(SETTLE)
            end = time.perf_counter() + warm
            if not (long or rested):
                call()
                while time.perf_counter() < end:
                    call()
            seconds[id(t)].append(_seconds(call))
    for t, _, _ in calls:
        t.seconds = np.array(seconds[id(t)])
    return timed


def _seconds(call: Callable[[], Any]) -> float:
    gc.disable()
    start = time.perf_counter()
    result = call()
    end = time.perf_counter()
    gc.enable()
    del result
    return end - start


# Tables.

HEAD = f"   {'engine':<30} {'speed':>10} {'best':>6} {'GB/s':>5}  {'gonio/it [quartiles]':<21} {'out=/it':>7}  target"


def table(case: Case, rounds: int) -> list[str]:
    """The lines of a case, measured now: gonio's own first, then each peer with how many times as fast gonio is."""
    timed = measure([*case.ours, *case.peers], rounds, case.rested)
    ours, peers = timed[: len(case.ours)], timed[len(case.ours) :]
    lines = [case.title]
    for t in timed:
        if t.failure:
            lines.append(f"   {t.engine.name:<30} {t.failure}"[:119])
            continue
        against = [_ratios(case, own, t) for own in ours if not own.failure] if t in peers else []
        lines.append(_line(case, t, ours[0], against))
    return lines + [f"   {line}" for line in case.note.splitlines()]


def _ratios(case: Case, own: Timed, peer: Timed) -> np.ndarray:
    """How many times as fast as the peer gonio was, round by round; bytes per second against a yardstick of memory."""
    share = 1.0 if peer.engine.moved is None else case.count * case.traffic / peer.engine.moved
    return share * peer.seconds / own.seconds


def _line(case: Case, t: Timed, own: Timed, against: list[np.ndarray]) -> str:
    moved = t.engine.moved or case.count * case.traffic
    speed, best = (f"{case.count / s * 1e-6:.4g}" for s in (t.median, t.seconds.min()))
    if t.engine.moved:
        speed, best = "", ""
    left = f"   {t.engine.name:<30} {speed and speed + ' M/s':>10} {best:>6} {moved / t.median * 1e-9:5.1f}"
    if not against:
        return left
    low, middle, high = np.percentile(against[0], [25, 50, 75])
    second = f"{np.median(against[1]):.3g}" if len(against) > 1 else ""
    ratio = f"{middle:.3g} [{low:.3g} {high:.3g}]"
    goal, verdict = "", ""
    if t.engine.target is not None:
        goal = f">= {t.engine.target:g}"
        verdict = verdict_of(max(float(np.median(r)) for r in against) >= t.engine.target)
        if verdict == "ok" and middle < t.engine.target:
            verdict = "out="
    return f"{left}  {ratio:<21} {second:>7} {goal:>7} {verdict:<5} {_difference(own, t)}".rstrip()


def _difference(own: Timed, t: Timed) -> str:
    """How far results are apart: the relative difference that 99 % of them keep to."""
    if own.values is None or t.values is None:
        return ""
    a, b = own.values.reshape(-1), t.values.reshape(-1)
    apart = np.abs(a - b) / np.maximum(np.abs(a), 1e-6)
    return f"99% {np.nanpercentile(apart, 99.0):.0e}"


def verdict_of(good: bool) -> str:
    return "ok" if good else "short"


def limit(label: str, value: float, unit: str, most: float | None) -> str:
    """A line for something that is to stay below a limit."""
    goal = "" if most is None else f"<= {most:g}"
    return f"   {label:<48} {value:9.4g} {unit:<9} {goal:>8} {verdict_of(value <= most) if goal else ''}".rstrip()


# The machine.

COPY_BYTES = 64_000_000


def copy_engine(target: float | None = None) -> Engine:
    """np.copyto between two warm arrays of 64 MB on two threads: the speed of memory, bytes read and written."""

    def build() -> Callable[[], None]:
        a, b = np.ones(COPY_BYTES // 4, np.float32), np.ones(COPY_BYTES // 4, np.float32)
        pool = ThreadPoolExecutor(THREADS)
        step = len(a) // THREADS
        parts = [slice(i * step, (i + 1) * step) for i in range(THREADS)]
        return lambda: [None for _ in pool.map(lambda s: np.copyto(b[s], a[s]), parts)]

    return Engine("copy of 64 MB", build, target, moved=2.0 * COPY_BYTES)


def machine(rounds: int) -> list[str]:
    """What this was measured on, as lines."""
    info = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    facts = dict(line.split(":", 1) for line in info.splitlines() if ":" in line)
    facts = {key.strip(): value.strip() for key, value in facts.items()}
    known = facts.get("flags", "").split()
    features = [f for f in ("avx2", "fma", "avx512f", "avx512dq", "avx512vl", "amx_tile", "neon") if f in known]
    kind = f" (family {facts['cpu family']}, model {facts.get('model', '?')})" if "cpu family" in facts else ""
    copied = measure([copy_engine()], rounds)[0].seconds
    speeds = 2.0 * COPY_BYTES / copied * 1e-9
    return [
        f"{datetime.now():%Y-%m-%d %H:%M}; gonio {gn.__version__} at {_revision()}; "
        + "; ".join(f"{name}={os.environ.get(name, '(unset)')}" for name in ("GONIO_ENGINE", "GONIO_LANES")),
        f"{facts.get('model name', platform.processor())}{kind}; {os.cpu_count()} cores, {THREADS} used; "
        f"load {os.getloadavg()[0]:.2f}; {' '.join(features)}",
        f"Python {platform.python_version()}; " + ", ".join(_versions()),
        f"copy of 64 MB, two threads: {np.median(speeds):.1f} GB/s read and written "
        f"[{speeds.min():.1f} {speeds.max():.1f}]; first touch of fresh memory: {_first_touch():.1f} GB/s",
    ]


def _revision() -> str:
    git = ["git", "-C", str(Path(gn.__file__).parent), "describe", "--always", "--dirty"]
    return subprocess.run(git, capture_output=True, text=True).stdout.strip() or "unknown"


def _versions() -> list[str]:
    found = []
    for name in ("numpy", "llvmlite", "mitsuba", "drjit", "torch", "jax"):
        try:
            found.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            found.append(f"no {name}")
    return found


def _first_touch() -> float:
    """GB/s of writing to memory that the system has yet to provide, on one thread."""
    fresh = np.empty(COPY_BYTES, np.uint8)
    return COPY_BYTES / _seconds(lambda: fresh.fill(1)) * 1e-9
