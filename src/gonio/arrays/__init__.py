"""The array libraries that formulas run on: the only package (with `bridges`) that knows which exist.

The table `LIBRARIES` says which library an array belongs to and what that library calls a function. Adding a library
in the manner of NumPy is one entry there.
"""

from __future__ import annotations

from typing import Any

from ..errors import ArrayTypeError
from ..trace.symbol import Symbol, Symbols, TableSymbol
from .dr_jit import DrJit
from .in_numpys_manner import Array, Jax, Library, NumPy, Torch
from .in_numpys_manner import Fixed as Fixed
from .in_numpys_manner import Later as Later
from .in_numpys_manner import Roomy as Roomy
from .in_numpys_manner import contiguous as contiguous
from .in_numpys_manner import frozen as frozen

LIBRARIES: dict[str, Library] = {
    "numpy": NumPy("numpy", absolute="abs"),
    "torch": Torch("torch", absolute="abs"),
    "jax": Jax("jax.numpy", absolute="abs"),
    "cupy": Library("cupy", absolute="abs"),
    "drjit": DrJit("drjit", absolute="abs", arccos="acos", arctan2="atan2"),
}
"""Library name -> how to use it."""

_SYMBOLS = Symbols()
_BY_PACKAGE: dict[str, Library | None] = {
    "builtins": None,
    **LIBRARIES,
    "jaxlib": LIBRARIES["jax"],
    "mitsuba": LIBRARIES["drjit"],
}


def library_of_type(kind: Any) -> Any:
    """The library that arrays of this type belong to; None for numbers and for what is no array."""
    if kind in (float, int, bool):
        return None
    if kind in (Symbol, TableSymbol):
        return _SYMBOLS
    package = str(kind.__module__).partition(".")[0]  # `str`, because torch.compile knows it no other way
    return _BY_PACKAGE[package] if package in _BY_PACKAGE else library_of_type(kind.__base__)


def library(*arrays: Array) -> Library:
    """The one library that `arrays` belong to; numbers belong to any. Raises ArrayTypeError if they are mixed."""
    common: Library | None = None
    for x in arrays:
        lib = library_of_type(type(x))
        if lib is None or lib is common:
            continue
        if common is not None:
            raise ArrayTypeError(
                f"arrays of different libraries in one call: {common.name} and {lib.name}; "
                f"expected one library; convert one side first"
            )
        common = lib
    return common or LIBRARIES["numpy"]
