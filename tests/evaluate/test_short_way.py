"""The short way of a warm call: a plan is looked up, and nothing else is asked, traced or compiled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import gonio as gn
from gonio.compile.llvm import machine
from gonio.evaluate import batch, planning, tracing

pytestmark = pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
ONE, MANY = np.array([0.3, 0.1, 0.9]), np.random.default_rng(1).random((1000, 3))
NUMBERS = np.array([0.3, 0.6])
CALLS: dict[str, Callable[[gn.Reflectance], object]] = {
    "f of one direction": lambda m: m.f(ONE, ONE),
    "f of many directions": lambda m: m.f(MANY, MANY),
    "f into an array": lambda m: m.f(MANY, MANY, out=np.empty(1000)),
    "pdf": lambda m: m.pdf(ONE, ONE),
    "sample": lambda m: m.sample(ONE, NUMBERS),
    "mueller": lambda m: m.mueller(ONE, ONE),
    "jacobian": lambda m: m.jacobian(ONE, ONE),
    "delta_reflectance": lambda m: m.delta_reflectance(ONE),
}


def metal(alpha: float) -> gn.Reflectance:
    return gn.Microfacet(gn.GGX(alpha), gn.Conductor(0.2, 3.9))


@pytest.fixture
def entered(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """A list of which of a module's functions are entered from now on. They go on: what they raise may be caught."""
    found: list[str] = []

    def watched(module: object, *names: str) -> list[str]:
        for name in names:
            monkeypatch.setattr(module, name, told(name, getattr(module, name)))
        return found

    def told(name: str, function: Callable[..., object]) -> Callable[..., object]:
        def wrapper(*args: object, **kwargs: object) -> object:
            found.append(name)
            return function(*args, **kwargs)

        return wrapper

    return watched


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_a_warm_call_looks_up_its_plan(call, entered):
    m = metal(0.2)
    call(m)
    entered(batch, "_checked", "batch_of")
    found = entered(planning, "new_plan", "_of_pattern", "tables_of")
    call(m)
    assert not found


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_other_numbers_trace_and_compile_nothing(call, entered):
    m = metal(0.2)
    call(m)
    entered(tracing, "_trace", "_jacobian")
    entered(machine, "to_object")
    found = entered(planning, "new_plan")
    call(metal(0.3))
    call(m.replace(alpha=0.4))
    assert not found


def test_a_trace_is_made_once_for_all_arrays(entered):
    m = metal(0.2)
    m.f(ONE, ONE)
    found = entered(tracing, "_trace")
    m.f(MANY, MANY)
    m.f(MANY.astype(np.float32), MANY.astype(np.float32))
    m.f(MANY[:, None], ONE)
    assert not found
