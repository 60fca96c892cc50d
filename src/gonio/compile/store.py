"""Kernels, compiled once: kept in memory, and on disk for the next process (`cache_folder.py`).

On disk a kernel has two names. Its code is kept under a digest of all that machine code depends on: the IR, the
processor, the compiler's library, and the modules that make code of IR. The program has a name of its own, a digest of
all that the IR depends on: the graph, the processor, the passes, and every module of this folder and of trace/. Under
it lies a record, the name of the code. So a program that is known needs no IR, and where a module was edited whose IR
stays the same, none is compiled again. File times are no part of a name: repeatable builds make them equal, copies
make them differ.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import sys
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from ..machine.caches import Cache
from ..trace import passes
from . import cache_folder, elf
from .llvm import machine
from .llvm.program import Program

Function = Callable[..., None]
"""kernel(args, outer, inner, grain), see `codegen`; arguments are numbers of `ctypes`, which it takes as they are."""


def size(compiled: Any) -> int:
    """Bytes of memory of a kernel, about."""
    in_bytes: int = compiled.size
    return in_bytes


_KNOWN: Cache[str, Any] = Cache(size)
_PROTOTYPE = ctypes.CFUNCTYPE(None)
PAGE = 4096  # of memory: code begins on one of its own
_IMAGE, _OBJECT, _RECORD = b"i", b"o", b"r"
_CODE = re.compile(rb"[0-9a-f]{40}")


def kernel(program: Program) -> Function:
    """The compiled program: from memory, from disk, or compiled now. Raises what `function` raises."""
    return function(program.digest(), lambda: source(program), _PROTOTYPE)


def function(name: str, text: Callable[[], str], prototype: Any) -> Any:
    """`kernel` of the IR that `text` gives, as a Python function; `name` stands for the text.

    Raises DependencyError where llvmlite is needed and cannot be had, EngineError where no code may be run.
    """
    name = _digest(_versions() + name)
    compiled = _KNOWN.find(name)
    if compiled is None:
        with machine.LOCK:
            compiled = _KNOWN.find(name)
            if compiled is None:
                placed = _recorded(name) or _of_text(text(), name)
                compiled = prototype(placed.address)
                compiled.keeper, compiled.size = placed.keeper, PAGE + placed.size
                _KNOWN.keep(name, compiled)
    return compiled


def source(program: Program) -> str:
    """The LLVM IR of a program, for this processor."""
    from .llvm import codegen

    register = machine.lanes(program.dtype)
    return codegen.generate(program, _width(program), register, machine.root_times(program.dtype))


def assembly(program: Program) -> str:
    """The machine code of a program, for this processor, as text."""
    return machine.to_assembly(source(program))


def _width(program: Program) -> int:
    # Two vectors at a time: each waits for its own results, and the processor works on the other meanwhile. On x86 two
    # of four lanes would be one of eight.
    register = machine.lanes(program.dtype)
    soon = program.single or not machine.optimizes()
    single = soon or (machine.lane_bits() == 128 and machine.is_x86())
    return register if single else 2 * register


class _Placed(NamedTuple):
    """The address of a function, the object that keeps it in memory, and bytes of code."""

    address: int
    keeper: Any
    size: int


def _recorded(name: str) -> _Placed | None:
    """The kernel that the record of a program names, if both are on disk."""
    data = cache_folder.read(name) or b""
    return _read(data[1:].decode()) if data[:1] == _RECORD and _CODE.fullmatch(data, 1) else None


def _of_text(text: str, name: str) -> _Placed:
    """The kernel of an IR, from disk or compiled now, and a record of it under the name of its program."""
    code = _digest(_back() + text)
    placed = _read(code) or _compiled(text, code)
    if _as_imported(_SOURCES, _sources):
        cache_folder.write(name, _RECORD + code.encode())
    return placed


def _read(name: str) -> _Placed | None:
    """Code from disk, if there is some in a form that this version writes."""
    data = cache_folder.read(name) or b""
    kind, entry, payload = data[:1], int.from_bytes(data[1:9], "little"), data[9:]
    if kind == _IMAGE and elf.POSSIBLE and entry < len(payload):
        return _Placed(*elf.mapped(payload, entry), len(payload))
    if kind == _OBJECT and not entry and elf.is_object(payload):
        placed = machine.linked(payload)
        return placed and _Placed(*placed, len(payload))
    return None


def _compiled(text: str, name: str) -> _Placed:
    code = machine.to_object(text)
    flat = elf.flatten(code)
    if flat is None:
        kind, payload, entry = _OBJECT, code, 0
        placed = machine.linked(code)
        assert placed is not None  # the compiled text has a kernel
    else:
        kind, (payload, entry) = _IMAGE, flat
        placed = elf.mapped(payload, entry)
    if _as_imported(_BACK, _back_sources):
        cache_folder.write(name, kind + entry.to_bytes(8, "little") + payload)
    return _Placed(*placed, len(payload))


def _as_imported(before: str, now: Callable[[], str]) -> bool:
    """Whether modules are those that were imported: a name does not stand for what those do that were edited since."""
    return bool(before and machine.compiler()) and now() == before


def _sources() -> str:
    """A digest of the modules of the compiler, of graphs and of operations; "" where they are no files."""
    here = os.path.dirname(__file__)

    def fail(error: OSError) -> None:
        raise error

    try:
        folders = [here, *(os.path.join(here, "..", room) for room in ("trace", "arrays"))]
        walks = [walk for folder in folders for walk in os.walk(folder, onerror=fail)]
    except OSError:
        return ""
    files = [os.path.join(folder, name) for folder, _, names in walks for name in names]
    return _contents(sorted(path for path in files if path.endswith(".py")))


def _back_sources() -> str:
    """A digest of the modules that make code of IR, for `_read` to run; "" where they are no files."""
    return _contents(module.__file__ or "" for module in (machine, elf, sys.modules[__name__]))


def _contents(paths: Iterable[str]) -> str:
    total = hashlib.sha256()
    try:
        for path in paths:
            with open(path, "rb", buffering=0) as file:
                text = file.read()
            total.update(len(text).to_bytes(8, "little") + text)
    except OSError:
        return ""
    return total.hexdigest()


_SOURCES, _BACK = _sources(), _back_sources()  # of what is imported now: later the files may be others


def _versions() -> str:
    """All that the code of a program depends on, beside the program itself."""
    return repr((machine.compiler(), machine.processor(), machine.optimizes(), passes.wanted(), _SOURCES))


def _back() -> str:
    """All that the code of an IR depends on, beside the IR itself."""
    return repr((machine.compiler(), machine.processor(), machine.optimizes(), _BACK))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:40]
