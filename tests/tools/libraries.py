"""The array libraries as the tests see them; NumPy without compiling; parameters of which few are run by default."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from gonio.evaluate import planning


def thinned(cases: Iterable[Any], kept: Collection[Any]) -> list[Any]:
    """The cases as parameters, of which all but those `kept` are marked `full`."""
    return [
        pytest.param(*(c if type(c) is tuple else (c,)), marks=() if c in kept else pytest.mark.full) for c in cases
    ]


def colour_science(module: str = "colour") -> Any:
    """colour-science, or a module of it; the test is skipped without. Importing it warns of what it lacks, and changes
    how arrays are printed."""
    with warnings.catch_warnings(), np.printoptions():
        warnings.simplefilter("ignore")
        return pytest.importorskip(module)


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

    def compute(self, *arrays: Any) -> None:
        """Computes them now, together by Dr.Jit, which else compiles what they share for each."""


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

    def compute(self, *arrays: Any) -> None:
        import_module("drjit").eval(*arrays)


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
        return x.numpy() if "Tensor" in type(x).__name__ else np.moveaxis(x.numpy(), 0, -1)


KINDS = (Library, Uncompiled, Torch, Jax, DrJitTensor, DrJitArray)


def opened(kind: type[Library]) -> Library:
    """The library, or a skip that says why not."""
    try:
        return kind()
    except ImportError as error:
        pytest.skip(f"could not import {error.name!r}: {error}")


@contextmanager
def optimizing() -> Iterator[None]:
    """Kernels are compiled as they are for users: plans of kernels that were compiled otherwise are forgotten."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("GONIO_OPTIMIZE", raising=False)
        patch.delenv("GONIO_PASSES", raising=False)
        planning._PATTERNS.clear()
        yield
        planning._PATTERNS.clear()


def switch_off(patch: pytest.MonkeyPatch) -> None:
    """Nothing is compiled from here on, as where llvmlite is missing."""
    patch.setattr(planning, "available", lambda: False)
    patch.setattr(planning, "known", lambda *_: None)
