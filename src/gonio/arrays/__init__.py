"""The array libraries that formulas run on: the only room (with `bridges`) that knows which exist.

Each is a file of libraries/, with the packages of its array types, its names of functions, and the way from vectors to
components. A library in the manner of NumPy is one line there.
"""

from __future__ import annotations

from typing import Any

from ..declared import discover
from ..errors import ArrayTypeError
from .fixed import Array as Array
from .fixed import AsStored as AsStored
from .fixed import Fixed as Fixed
from .fixed import Later as Later
from .fixed import Roomy as Roomy
from .fixed import contiguous as contiguous
from .fixed import frozen as frozen
from .interface import Library as Library

LIBRARIES: dict[str, Library] = {
    name: module.LIBRARY for name, module in discover.by_name(f"{__name__}.libraries").items()
}
"""Name of a library -> how to use it."""

NAMED: Library = LIBRARIES["xarray"]
LAZY: Any = LIBRARIES["dask"]
"""Arrays with named axes, and arrays that are computed later."""

OF_TYPES: dict[type, Any] = dict.fromkeys((float, int, bool))
"""What is in no package of arrays: numbers, of no library; and symbols, which `trace` adds."""

_BY_PACKAGE: dict[str, Library | None] = {
    "builtins": None,
    **{package: lib for lib in LIBRARIES.values() for package in lib.packages},
}


def library_of_type(kind: Any) -> Any:
    """The library that arrays of this type belong to; None for numbers and other objects."""
    if kind in OF_TYPES:
        return OF_TYPES[kind]
    package = str(kind.__module__).partition(".")[0]  # `str`, because torch.compile knows it no other way
    return _BY_PACKAGE[package] if package in _BY_PACKAGE else library_of_type(kind.__base__)


def library(*arrays: Array) -> Library:
    """The one library that `arrays` belong to; numbers belong to any. Raises ArrayTypeError if they are mixed."""
    common: Library | None = None
    for x in arrays:
        lib = library_of_type(type(x))
        if lib is None or lib is common:
            continue
        if lib is NAMED:
            raise ArrayTypeError(
                f"a {type(x).__name__} where axes have no names; expected a plain array: x.values; parameters, f, pdf, "
                f"f_angles, direction, angles, albedo and its kin, and gonio.remote_sensing take axes with names"
            )
        if common is not None:
            raise ArrayTypeError(
                f"arrays of different libraries in one call: {common.name} and {lib.name}; "
                f"expected one library; convert one side first"
            )
        common = lib
    return common or LIBRARIES["numpy"]
