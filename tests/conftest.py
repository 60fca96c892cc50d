"""The array libraries as a fixture: a test that takes `library` runs on each one that can be used here.

`python3 dev.py test` leaves out what is marked `full` or `texts`; `python3 dev.py test -m full` runs the former,
`python3 dev.py lint` the latter, `python3 dev.py test -m ""` everything.
"""

from __future__ import annotations

import os
import sys

# Before any of them is imported: double precision for JAX, and one thread, so that small arrays cost nothing. Threads
# of BLAS that wait for each other on a busy machine took twenty times as long for the matrices of layers.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("JAX_ENABLE_X64", "1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("GONIO_OPTIMIZE", "off")  # both are as users have them where `optimized` is asked for
os.environ.setdefault("GONIO_PASSES", "off")
os.environ.setdefault("GONIO_KEEP", "128")  # MiB
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

from collections.abc import Iterator
from functools import partial
from typing import Any
from zlib import crc32

import pytest
from leftovers import give_back, settle
from libraries import KINDS, DrJitArray, DrJitTensor, Jax, Library, Torch, Uncompiled, opened, optimizing, switch_off

from gonio.evaluate import planning
from gonio.formats._reading import hdf
from gonio.formula.fields import CLASSES

pytest_plugins = ("near", "passed", "second", "skips")


def pytest_configure() -> None:
    settle()


@pytest.hookimpl(tryfirst=True)  # before pytest leaves out what `-m` says
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What is left out by default where a compiler is slow.

    Of random materials few are compiled, and all are evaluated in blocks, by the same formula: kernels of every model
    are compared with arrays (`test_laws.py`), each operation by itself (`test_elementary.py`, `test_engine.py`). JAX
    and Dr.Jit compile what they compute: of a test marked `few_by_jax` JAX runs the cases that the mark names; of other
    cases with either a quarter runs, by their names, but of operations and laws (`test_ops.py`, `test_laws.py`) all.
    """
    from materials import OBEDIENT

    models = {draw.model for draw in OBEDIENT}
    for item in items:
        if any(name in item.name for name in ("jax", "drjit")) or "jax" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.slow_because("JAX and Dr.Jit compile what they compute"))
        case = item.callspec if isinstance(item, pytest.Function) and hasattr(item, "callspec") else None
        if case is None:
            continue
        material = case.params.get("draw", case.params.get("model"))
        if case.params.get("evaluation") == "compiled" and not {material} <= {None, *OBEDIENT, *models}:
            item.add_marker("full")
        few = item.get_closest_marker("few_by_jax")
        if few and case.params.get("library") is Jax and not any(word in case.id for word in few.args):
            item.add_marker("full")
        by_compiler = case.params.get("library") in (Jax, DrJitTensor, DrJitArray)
        if by_compiler and item.path.name not in ("test_ops.py", "test_laws.py") and crc32(item.nodeid.encode()) % 4:
            item.add_marker("full")


@pytest.fixture(params=KINDS, ids=lambda kind: kind.name, scope="session")
def library(request: pytest.FixtureRequest) -> Library:
    return opened(request.param)


@pytest.fixture(autouse=True)
def _as_the_library_says(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if "library" in request.fixturenames and isinstance(request.getfixturevalue("library"), Uncompiled):
        switch_off(monkeypatch)


@pytest.fixture(params=["compiled", "uncompiled"])
def evaluation(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """NumPy both ways: by compiled kernels, and in blocks."""
    if request.param == "uncompiled":
        switch_off(monkeypatch)
    elif not planning.available():
        pytest.skip("nothing can be compiled here: llvmlite is missing, or the processor has no fused multiply-add")
    return request.param


@pytest.fixture(autouse=True)
def _own_classes() -> Iterator[None]:
    """Classes that a test defines are forgotten after it; those of modules, which it may have imported, are not."""
    before = dict(CLASSES)
    yield
    for name in CLASSES.keys() - before.keys():
        kind = CLASSES[name]
        if getattr(sys.modules.get(kind.__module__), kind.__name__, None) is not kind:
            del CLASSES[name]
    CLASSES.update(before)


@pytest.fixture(autouse=True)
def _memory() -> Iterator[None]:
    """What tests leave behind is dropped when it is much."""
    yield
    give_back()


@pytest.fixture(scope="module")
def optimized() -> Iterator[None]:
    """Graphs are rewritten and kernels compiled as they are for users; elsewhere formulas are compiled as written, at
    the least cost, which takes a third of the time."""
    with optimizing():
        yield


@pytest.fixture
def uncompiled(monkeypatch: pytest.MonkeyPatch) -> None:
    switch_off(monkeypatch)


@pytest.fixture
def unlaid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are not laid out, which takes half of their time."""
    monkeypatch.setattr("matplotlib.layout_engine.ConstrainedLayoutEngine.execute", lambda *_: None)


@pytest.fixture
def one_probe(monkeypatch: pytest.MonkeyPatch) -> None:
    """On Linux HDF files are looked at by one process for all, instead of by a new one for each."""
    if sys.platform == "linux":
        from fuzzing import probed_by_one

        monkeypatch.setattr(hdf, "probed", partial(probed_by_one, 1 << 30))


@pytest.fixture(scope="session")
def torch() -> Any:
    return opened(Torch).module  # type: ignore[attr-defined]  # the modules of these two have it


@pytest.fixture(scope="session")
def jax() -> Any:
    return opened(Jax).module  # type: ignore[attr-defined]  # the modules of these two have it
