"""The array libraries as a fixture: a test that takes `library` runs on each one that can be used here.

`python3 dev.py test` leaves out what is marked `full`; `python3 dev.py test -m full` runs that, `-m ""` everything.
"""

from __future__ import annotations

import os
import sys

# Before any of them is imported: double precision for JAX, and one thread, so that small arrays cost nothing.
os.environ.setdefault("JAX_ENABLE_X64", "1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

from collections.abc import Callable, Collection, Iterable
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from gonio.evaluate import planning
from gonio.formats._reading import hdf


@pytest.hookimpl(tryfirst=True)  # before pytest leaves out what `-m` says
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of random materials one of each model is compiled, and all are evaluated in blocks, by the same formula.

    What compiling adds is held per operation (`test_elementary.py`, `test_engine.py`); kernels of all materials take
    minutes to compile.
    """
    from models import COMPILED

    for item in items:
        given = item.callspec.params if isinstance(item, pytest.Function) and hasattr(item, "callspec") else {}
        if given.get("evaluation") == "compiled" and "draw" in given and given["draw"] not in COMPILED:
            item.add_marker("full")


def thinned(cases: Iterable[Any], kept: Collection[Any]) -> list[Any]:
    """The cases as parameters, of which all but those `kept` are marked `full`."""
    return [
        pytest.param(*(c if type(c) is tuple else (c,)), marks=() if c in kept else pytest.mark.full) for c in cases
    ]


class Library:
    """How the tests make arrays of a library and read them back."""

    name = "numpy"

    def array(self, x: Any, dtype: str = "float64") -> Any:
        return np.asarray(x, dtype)

    def numpy(self, x: Any) -> np.ndarray:
        return np.asarray(x)

    def dtype(self, x: Any) -> str:
        return str(x.dtype).rpartition(".")[2]

    def whole(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, compiled as one by JAX, which else compiles each operation of a large formula."""
        return function


class Uncompiled(Library):
    """NumPy in blocks, as where llvmlite is missing."""

    name = "numpy-uncompiled"


class Torch(Library):
    name = "torch"

    def __init__(self) -> None:
        self.module = import_module("torch")
        self.module.set_num_threads(1)

    def array(self, x: Any, dtype: str = "float64") -> Any:
        return self.module.tensor(np.asarray(x), dtype=getattr(self.module, dtype))

    def numpy(self, x: Any) -> np.ndarray:
        return x.detach().numpy()


class Jax(Library):
    name = "jax"

    def __init__(self) -> None:
        self.module = import_module("jax")

    def array(self, x: Any, dtype: str = "float64") -> Any:
        return self.module.numpy.asarray(np.asarray(x, dtype))

    def whole(self, function: Callable[..., Any]) -> Callable[..., Any]:
        return self.module.jit(function)


class DrJitTensor(Library):
    """Dr.Jit's TensorXf, of any shape."""

    name = "drjit"

    def __init__(self) -> None:
        drjit = import_module("drjit")
        if not drjit.has_backend(drjit.JitBackend.LLVM):
            pytest.skip("drjit: no LLVM back end here (install libLLVM, or set DRJIT_LIBLLVM_PATH)")
        self.module = import_module("drjit.llvm.ad")

    def array(self, x: Any, dtype: str = "float64") -> Any:
        return getattr(self.module, "TensorXf" + ("64" if dtype == "float64" else ""))(np.asarray(x, dtype))

    def numpy(self, x: Any) -> np.ndarray:
        return x.numpy()

    def dtype(self, x: Any) -> str:
        return import_module("drjit").type_v(x).name.lower()


class DrJitArray(DrJitTensor):
    """Dr.Jit's Array2f, Array3f: a batch (N, 2 or 3) only."""

    name = "drjit-array"

    def array(self, x: Any, dtype: str = "float64") -> Any:
        x = np.asarray(x, dtype)
        suffix = "f64" if dtype == "float64" else "f"
        if x.ndim == 1:
            return getattr(self.module, "Float" + suffix[1:])(x)
        return getattr(self.module, f"Array{x.shape[-1]}{suffix}")(np.ascontiguousarray(x.T))

    def numpy(self, x: Any) -> np.ndarray:
        return np.moveaxis(x.numpy(), 0, -1)


KINDS = (Library, Uncompiled, Torch, Jax, DrJitTensor, DrJitArray)


def opened(kind: type[Library]) -> Library:
    """The library, or a skip that says why not."""
    try:
        return kind()
    except ImportError as error:
        pytest.skip(f"{kind.name} cannot be imported: {error}")


@pytest.fixture(params=KINDS, ids=lambda kind: kind.name, scope="session")
def library(request: pytest.FixtureRequest) -> Library:
    return opened(request.param)


def switch_off(patch: pytest.MonkeyPatch) -> None:
    """Nothing is compiled from here on, as where llvmlite is missing."""
    patch.setattr(planning, "available", lambda: False)
    patch.setattr(planning, "known", lambda *_: None)


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


@pytest.fixture
def one_probe(monkeypatch: pytest.MonkeyPatch) -> None:
    """On Linux HDF files are looked at by one process for all, instead of by a new one for each."""
    if sys.platform == "linux":
        from fuzzing import probed_by_one

        monkeypatch.setattr(hdf, "probed", partial(probed_by_one, 1 << 30))


@pytest.fixture(scope="session")
def torch() -> Any:
    return opened(Torch).module  # type: ignore[attr-defined]


@pytest.fixture(scope="session")
def jax() -> Any:
    return opened(Jax).module  # type: ignore[attr-defined]
