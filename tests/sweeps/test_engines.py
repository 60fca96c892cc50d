"""The same numbers compiled and on arrays, of every array library, and on any number of threads: everything public that
takes a material and directions.

By default few materials; with `full` all house materials. A failure ends with three lines of Python that repeat it.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import contextmanager
from itertools import product
from typing import Any

import house
import numpy as np
import pytest
from directed import COUNT, SWEPT, TOLERANCE, Call, Refused, lines, named, run
from libraries import DrJitArray, DrJitTensor, Jax, Torch, switch_off, thinned
from lit import CALLS, MATERIALS, Lit, made
from sweeps import grouped, one_in

import gonio as gn
from gonio.compile import plans
from gonio.errors import ArrayTypeError
from gonio.evaluate import planning

HOUSE = {name.lower(): repr(m) for name, m in vars(house).items() if isinstance(m, gn.Reflectance)}
LIBRARIES = thinned((Torch, Jax, DrJitTensor, DrJitArray), [Torch])
NUMPY_ONLY = {"jacobian"}
"""Methods that other libraries do without."""


def cells(*few: str, of: Iterable[str] = HOUSE, calls: Iterable[Call] = SWEPT) -> list[Any]:
    """Calls, each with house materials; by default with few, and of integrals a third of these."""

    def default(call: Call, name: str) -> bool:
        return name in few and (not call.integral or one_in(3, name, *call.arguments.values()))

    return grouped(product(calls, of), default)


def whole(call: Call) -> Any:
    """All directions of a call."""
    return slice(COUNT) if named(call) else ...


def hold(call: Call, m: gn.Reflectance, found: Any, expected: Any, tolerance: float, what: str) -> None:
    told = f"{lines(call, m, COUNT, 0)}  # {what}"
    if isinstance(found, Refused) or isinstance(expected, Refused):
        assert found == expected, f"{told}\none of the two is refused: {found}; {expected}"
        return
    for x, y in zip(found, expected, strict=True):
        assert x.shape == y.shape, f"{told}\nshape {x.shape}, expected {y.shape}"
        size = (
            np.maximum(1.0, np.abs(y)) if call.integral and tolerance else max(1e-300, np.nanmax(np.abs(y), initial=0))
        )
        off = np.where(np.isnan(x) | np.isnan(y), np.isnan(x) != np.isnan(y), np.abs(1.0 * x - 1.0 * y) / size)
        assert (off <= tolerance).all(), f"{told}\n{x}\nexpected\n{y}"


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
@pytest.mark.parametrize("cells", cells("paint", "ground_glass"))
def test_compiled_and_on_arrays(cells):
    for call, name in cells:
        m = gn.expression(HOUSE[name])
        expected = run(call, m, whole(call))
        with pytest.MonkeyPatch.context() as patch:
            switch_off(patch)
            found = run(call, gn.expression(HOUSE[name]), whole(call))
        hold(call, m, found, expected, TOLERANCE if call.integral else 1e-12, "with GONIO_ENGINE=numpy, and without")


@pytest.mark.parametrize(
    "cells",
    cells(
        *("paint", "leaf", "mirror"),
        of=("paint", "leaf", "mirror", "brushed", "ground_glass"),
        calls=[call for call in SWEPT if named(call)],
    ),
)
@pytest.mark.parametrize("library", LIBRARIES, indirect=True, ids=lambda kind: kind.name)
def test_array_libraries(library, cells):
    """The same numbers, or an ArrayTypeError; formulas of all."""
    for call, name in cells:
        m = gn.expression(HOUSE[name])
        found = run(call, m, whole(call), library.array, library.numpy)
        expected = run(call, m, whole(call))
        if isinstance(found, Refused) and found != expected:
            assert issubclass(found.kind, ArrayTypeError) and (call.owner == "gn" or call.name in NUMPY_ONLY), found
            continue
        tolerance = TOLERANCE if call.integral else 1e-12
        hold(call, m, found, expected, tolerance, f"with arrays of {library.name}")


@contextmanager
def shared_out(patch: pytest.MonkeyPatch) -> Any:
    """All that kernels compute is shared out in parts of a line of the cache, however little it is."""
    before = gn.engine.threads()
    patch.setattr(plans, "PARALLEL", 0)
    patch.setattr(plans, "GRAIN", 1)
    patch.setattr(plans, "_crew", lambda work: gn.engine.threads())
    try:
        yield
    finally:
        gn.engine.threads(before)


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
@pytest.mark.parametrize("cells", cells("paint"))
def test_number_of_threads(cells, monkeypatch):
    shared: list[int] = []
    together = plans.together
    monkeypatch.setattr(plans, "together", lambda count, *args: shared.append(count) or together(count, *args))
    for call, name in cells:
        heavy = call.integral or call.name.startswith("repair.") or not named(call)
        some = whole(call) if heavy else np.arange(1000) % COUNT
        found = []
        with shared_out(monkeypatch):
            for count in (1, 2, 3):
                gn.engine.threads(count)
                found.append(run(call, gn.expression(HOUSE[name]), some))
        for count in (1, 2):
            told = f"after gn.engine.threads(1), and gn.engine.threads({count + 1})"
            hold(call, gn.expression(HOUSE[name]), found[count], found[0], 0.0, told)
    if cells[0][0].name == "f":
        assert {*shared} == {2, 3}


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
@pytest.mark.parametrize("function", CALLS)
def test_number_of_threads_under_a_light(function, monkeypatch):
    under = Lit(MATERIALS["paint"], f"a = {made()['SphereLight']}", CALLS[function], "(([a], 1.0),)")
    found = []
    with shared_out(monkeypatch):
        for count in (1, 2, 3):
            gn.engine.threads(count)
            found += under.results()
    for several in found[1:]:
        np.testing.assert_array_equal(several, found[0], err_msg=under.lines())
