"""A second of processor time a test: a plugin that counts, holds every test to it, and says which have a reason not to.

Counted is the time of the tests' process, and a part of that of the processes that it started, each of which imports
gonio anew; not that of the clock, so that other work on the machine counts little.
A test does not pay for having come first: fixtures that are shared, kernels that are compiled and libraries that are
imported are left out. Nor does it pay for the processor: one that is slow, or shared with much else, gets more time.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from time import process_time, thread_time
from typing import Any

import pytest

from gonio.compile.llvm import codegen, machine

BAR = 1.0
"""Seconds of processor time that a test may take."""
LENIENCE = 8.0
"""How many times the bar a test fails at: beside other work the same takes up to four times as long, and the first to
need what is kept for the process, such as a basis of materials, pays for it. Whatever is above the bar is listed."""
STARTED = 0.25
"""The part of the time of other processes that counts."""
SHARED = 5.0
"""The same bar for a fixture that a file or a session shares."""
LIBRARY = 100
"""Modules that are imported at least where a test is the first to need a library."""
STEPS, USUAL = 400_000, 0.025
"""Steps of a loop, and the seconds that they take on the processor that the bar is meant for, a Zen 5 at rest."""

_left_out = 0.0
_fixtures = 0


def pytest_configure(config: pytest.Config) -> None:
    for module, name in ((machine, "to_object"), (codegen, "generate")):
        setattr(module, name, _timed(getattr(module, name)))


def _timed(compile: Callable[..., Any]) -> Callable[..., Any]:
    """The same, whose time is left out."""

    def timed(*args: Any, **kwargs: Any) -> Any:
        global _left_out
        start = thread_time()
        try:
            return compile(*args, **kwargs)
        finally:
            if not _fixtures:
                _left_out += thread_time() - start

    return timed


def _now() -> float:
    """Seconds that this process has run, with a part of those that it started and waited for."""
    own, of_system, *started = os.times()[:4]
    return own + of_system + STARTED * sum(started)


def _pace() -> float:
    """How many times longer than usual this processor takes now; at least 1."""
    start, total = process_time(), 0
    for k in range(STEPS):
        total += k * k
    return max(1.0, (process_time() - start) / USUAL)


def _is_held(item: pytest.Item) -> bool:
    return sys.gettrace() is None and not any(map(item.get_closest_marker, ("full", "texts")))


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: pytest.FixtureDef[Any], request: pytest.FixtureRequest) -> Iterator[None]:
    global _left_out, _fixtures
    if fixturedef.scope == "function" or _fixtures:
        return (yield)
    start, loaded = _now(), len(sys.modules)
    _fixtures += 1
    try:
        made = yield
    finally:
        _fixtures -= 1
        seconds = _now() - start
        _left_out += seconds
    if seconds > SHARED * LENIENCE and len(sys.modules) - loaded < LIBRARY and seconds > SHARED * LENIENCE * _pace():
        pytest.fail(
            f"the fixture {fixturedef.argname} takes {seconds:.1f} s of processor time, expected at most {SHARED:g} s: "
            "make it smaller",
            pytrace=False,
        )
    return made


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    global _left_out
    _left_out = 0.0
    item.stash[_STARTED] = _now(), len(sys.modules)
    return (yield)


_STARTED: pytest.StashKey[tuple[float, int]] = pytest.StashKey()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    result = yield
    start, loaded = item.stash[_STARTED]
    seconds = _now() - start - _left_out
    if seconds <= BAR or not _is_held(item) or len(sys.modules) - loaded >= LIBRARY:
        return result
    reasoned = item.get_closest_marker("slow_because")
    item.user_properties.append(("slow", (seconds, reasoned.args[0] if reasoned else "")))
    if not reasoned and seconds > BAR * LENIENCE and seconds > BAR * LENIENCE * _pace():
        pytest.fail(
            f"the test takes {seconds:.1f} s of processor time, kernels and shared fixtures left out; expected at most "
            f"{BAR:g} s: make it smaller, take a material of tests/tools/house.py, share a fixture, mark it `full` "
            'beside a cheap one, or give a reason: @pytest.mark.slow_because("...")',
            pytrace=False,
        )
    return result


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """A line a reason, and a line for each test that takes longer than a second without one."""
    reports = [r for kind in ("passed", "failed") for r in terminalreporter.stats.get(kind, [])]
    slow = [(*value, r.nodeid) for r in reports for name, value in r.user_properties if name == "slow"]
    tests, spent = Counter(why for _, why, _ in slow), Counter()
    for seconds, why, _ in slow:
        spent[why] += seconds
    if slow:
        terminalreporter.section("tests of more than a second of processor time")
    for why in sorted(filter(None, tests)):
        terminalreporter.line(f"{spent[why]:6.1f} s in {tests[why]} with a reason: {why}")
    for seconds, why, test in sorted(slow, reverse=True):
        if not why:
            terminalreporter.line(f"{seconds:6.1f} s: {test}")
