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


def refused(monkeypatch: pytest.MonkeyPatch, module: object, *names: str) -> None:
    """From now on these functions fail."""

    def entered(name: str) -> Callable[..., object]:
        def fail(*_: object, **__: object) -> object:
            raise AssertionError(f"{name} was entered, off the short way")

        return fail

    for name in names:
        monkeypatch.setattr(module, name, entered(name))


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_a_warm_call_looks_up_its_plan(call, monkeypatch):
    m = metal(0.2)
    call(m)
    refused(monkeypatch, batch, "_checked", "_batch", "traced")
    refused(monkeypatch, planning, "plan", "_of_pattern", "traced")
    call(m)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_other_numbers_trace_and_compile_nothing(call, monkeypatch):
    m = metal(0.2)
    call(m)
    refused(monkeypatch, tracing, "_trace", "_jacobian")
    refused(monkeypatch, planning, "plan")
    refused(monkeypatch, machine, "to_object")
    call(metal(0.3))
    call(m.replace(alpha=0.4))


def test_a_trace_is_made_once_for_all_arrays(monkeypatch):
    m = metal(0.2)
    m.f(ONE, ONE)
    refused(monkeypatch, tracing, "_trace")
    m.f(MANY, MANY)
    m.f(MANY.astype(np.float32), MANY.astype(np.float32))
    m.f(MANY[:, None], ONE)
