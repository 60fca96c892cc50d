"""What tells one work from another: a hash of the content of all that goes in, for whoever keeps results and goes on.

Stores of fits, journals, tables and the checkpoints of pictures are of one work by this and by nothing else: never by
texts for people, which leave numbers out, nor by names and times of files, under which other numbers may stand.
"""

from __future__ import annotations

import hashlib
import inspect
import os
from collections.abc import Iterator, Mapping, Set
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from ..arrays import Fixed, ops
from ..arrays.labels import is_named
from ..declared.version import __version__
from ..evaluate.tracing import content
from ..formula.fields import Field, Part
from ..formula.parametrised import Parametrised
from ..formula.state import Note
from ..formula.value import Value

ORIGIN = {"path", "about", "provenance"}
"""Notes that say where numbers are from: the same numbers from elsewhere are the same work."""

OWN = __name__.partition(".")[0]
BLOCK = 1 << 20


def identity(*parts: Any) -> str:
    """A hash of parts by their content, and of the version of gonio: equal for equal parts, in any process.

    Numbers and arrays go in bit by bit with their kind, values with all that formulas depend on and with what they
    note, but for where they are from; files (`File`) with their bytes. Classes and functions that are not gonio's go in
    with their code, and with what this reads of the module that they are in.

    Example
    >>> from gonio.base.identity import identity
    >>> first, other = (gn.Lambertian(np.linspace(0.1, x, 200)) for x in (0.2, 0.3))
    >>> print(repr(first) == repr(other), identity(first) == identity(other), len(identity(first)))
    True False 64
    """
    whole = hashlib.sha256()
    for kind, data in _pieces((__version__, *parts), ()):
        whole.update(f"{kind} {len(data)} ".encode())
        whole.update(data)
    return whole.hexdigest()


class File:
    """A file by its bytes, or a folder by those of all files in it, as a part of an identity."""

    def __init__(self, path: str | os.PathLike[str]):
        self.path = Path(path)

    def pieces(self) -> Iterator[tuple[str, bytes]]:
        """Names and hashes. Raises OSError where it cannot be read."""
        files = sorted(x for x in self.path.rglob("*") if x.is_file()) if self.path.is_dir() else [self.path]
        for file in files:
            found = hashlib.sha256()
            with file.open("rb") as opened:
                while block := opened.read(BLOCK):
                    found.update(block)
            yield str(file.relative_to(self.path)), found.digest()


def _pieces(value: Any, within: tuple[int, ...]) -> Iterator[tuple[str, Any]]:
    """The kinds and bytes that a value comes to; `within`: the numbers of objects that it is in."""
    if value is None or isinstance(value, (bool, int, float, complex, str)):
        yield type(value).__name__, (value if isinstance(value, str) else repr(value)).encode(errors="surrogatepass")
    elif isinstance(value, (bytes, bytearray, memoryview)):
        yield "bytes", bytes(value)
    elif isinstance(value, np.ndarray):
        yield from _of_array(value, within)
    elif isinstance(value, np.generic):
        yield from _of_array(np.asarray(value), within)
    elif isinstance(value, File):
        yield "files", b""
        yield from value.pieces()
    elif isinstance(value, Fixed):
        yield from _of_array(value.numbers, within)
    elif id(value) in within:
        yield "again", str(within.index(id(value))).encode()
    else:
        kind, inner = _taken_apart(value)
        inner = list(inner)
        yield kind, str(len(inner)).encode()
        for x in inner:
            yield from _pieces(x, (*within, id(value)))


def _of_array(array: np.ndarray, within: tuple[int, ...]) -> Iterator[tuple[str, Any]]:
    yield "array", f"{array.dtype.str} {array.shape}".encode()
    if np.ma.isMaskedArray(array):
        yield "mask", np.ma.getmaskarray(array).tobytes()
        array = array.filled()
    if array.dtype.hasobject:
        for x in array.reshape(-1).tolist():
            yield from _pieces(x, within)
    else:
        yield "numbers", memoryview(np.ascontiguousarray(array).reshape(-1).view(np.uint8))


def _taken_apart(value: Any) -> tuple[str, Any]:
    """The kind of an object, and what it consists of."""
    if isinstance(value, Parametrised):
        held = content(value)
        return "value", (held.structure, held.leaves, held.tables, list(_notes(value)))
    if isinstance(value, Mapping):
        return "mapping", sorted(value.items(), key=lambda pair: repr(pair[0]))
    if isinstance(value, Set):
        return "set", sorted(identity(x) for x in value)
    if isinstance(value, (tuple, list)):
        named = type(value) if hasattr(value, "_fields") else "sequence"
        return "sequence", (named, *value)
    if isinstance(value, type):
        return "class", _of_class(value)
    if isinstance(value, MethodType):
        return "method", (value.__func__, value.__self__)
    if isinstance(value, FunctionType):
        return "function", _of_function(value)
    if isinstance(value, CodeType):
        return "code", (value.co_code, value.co_consts, value.co_names, value.co_varnames)
    if isinstance(value, (ModuleType, BuiltinFunctionType)):
        return "name", (getattr(value, "__module__", None), value.__name__)
    if is_named(value):
        return "named array", (value.dims, value.values)
    if ops.library_of_type(type(value)) is not None:
        return "array", (ops.to_numpy(value),)
    kind, *rest = value.__reduce_ex__(4)
    return "object", (kind, *(list(x) if isinstance(x, Iterator) else x for x in rest))


def _notes(value: Value) -> Iterator[tuple[str, Any]]:
    """What a value and its parts note beside what formulas depend on."""
    for name, declared in value._beside.items():
        if isinstance(declared, Note) and name in value.__dict__ and name not in ORIGIN:
            yield name, value.__dict__[name]
    for name, field in value.fields.items():
        if isinstance(field, Part):
            yield name, list(_notes(value.__dict__[name]))


def _is_own(thing: Any) -> bool:
    return f"{thing.__module__}.".startswith(f"{OWN}.")


def _of_class(kind: type) -> Iterator[Any]:
    """The name of a class; of one that is not gonio's, and is no formula of another library's, its code too."""
    yield f"{kind.__module__}.{kind.__qualname__}"
    if issubclass(kind, Value):
        for base in kind.__mro__:
            if issubclass(base, Value) and not _is_own(base):
                for name, x in vars(base).items():
                    x = getattr(x, "__func__", getattr(x, "fget", getattr(x, "function", x)))
                    if isinstance(x, Field):
                        yield name, type(x), vars(x)
                    elif isinstance(x, (FunctionType, bool, int, float, str, np.ndarray)) and name != "__doc__":
                        yield name, x


def _of_function(function: FunctionType) -> Iterator[Any]:
    """The name of a function; of one that is not gonio's, its code and what this reads too."""
    yield f"{function.__module__}.{function.__qualname__}"
    if _is_own(function):
        return
    code = function.__code__
    yield from (code, function.__defaults__, function.__kwdefaults__)
    for name, x in inspect.getclosurevars(function).nonlocals.items():
        yield name, x
    for name in code.co_names:
        x = function.__globals__.get(name)
        if isinstance(x, (bool, int, float, str, tuple, np.ndarray)) or (
            isinstance(x, FunctionType) and x.__module__ == function.__module__
        ):
            yield name, x
