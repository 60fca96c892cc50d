"""Kernels, compiled once: kept in memory, and on disk for the next process (`cache_folder.py`).

A kernel's name is a digest of all that its code depends on: the program, the processor, the passes, the text of every
module of this folder and of trace/, and the compiler's library. File times are no part of it: repeatable builds make
them equal, copies make them differ.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
from collections.abc import Callable
from typing import Any

from ..trace import passes
from . import cache_folder, elf
from .llvm import machine
from .llvm.program import Program

Function = Callable[..., None]
"""kernel(args, outer, inner, grain), see `codegen`; arguments are numbers of `ctypes`, which it takes as they are."""

_KNOWN: dict[str, Any] = {}
_PROTOTYPE = ctypes.CFUNCTYPE(None)
_IMAGE, _OBJECT = b"i", b"o"


def kernel(program: Program) -> Function:
    """The compiled program: from memory, from disk, or compiled now. Raises what `function` raises."""
    return function(program.digest(), lambda: source(program), _PROTOTYPE)


def function(name: str, text: Callable[[], str], prototype: Any) -> Any:
    """`kernel` of the IR that `text` gives, as a Python function; `name` stands for the text.

    Raises DependencyError where llvmlite is needed and cannot be had, EngineError where no code may be run.
    """
    name = hashlib.sha256((name + _versions()).encode()).hexdigest()[:40]
    compiled = _KNOWN.get(name)
    if compiled is None:
        with machine.LOCK:
            compiled = _KNOWN.get(name)
            if compiled is None:
                address, keeper = _read(name) or _compiled(text(), name)
                compiled = _KNOWN[name] = prototype(address)
                compiled.keeper = keeper
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
    single = program.single or (machine.lane_bits() == 128 and machine.is_x86())
    return register if single else 2 * register


_Placed = tuple[int, Any]
"""The address of a function, and the object that keeps it in memory."""


def _read(name: str) -> _Placed | None:
    """A kernel from disk, if there is one in a form that this version writes."""
    data = cache_folder.read(name) or b""
    kind, entry, payload = data[:1], int.from_bytes(data[1:9], "little"), data[9:]
    if kind == _IMAGE and elf.POSSIBLE and entry < len(payload):
        return elf.mapped(payload, entry)
    if kind == _OBJECT and not entry and elf.is_object(payload):
        return machine.linked(payload)
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
    # A compiler that was edited since it was imported is not the one that the name stands for.
    if _SOURCES and machine.compiler() and _sources() == _SOURCES:
        cache_folder.write(name, kind + entry.to_bytes(8, "little") + payload)
    return placed


def _sources() -> str:
    """A digest of the modules of the compiler and of graphs; "" where they are no files."""
    here, total = os.path.dirname(__file__), hashlib.sha256()

    def fail(error: OSError) -> None:
        raise error

    try:
        folders = [here, os.path.join(here, "..", "trace")]
        walks = [walk for folder in folders for walk in os.walk(folder, onerror=fail)]
        files = [os.path.join(folder, name) for folder, _, names in walks for name in names]
        for path in sorted(path for path in files if path.endswith(".py")):
            with open(path, "rb", buffering=0) as file:
                text = file.read()
            total.update(len(text).to_bytes(8, "little") + text)
    except OSError:
        return ""
    return total.hexdigest()


_SOURCES = _sources()  # of the modules that are imported now: later the files may be others


def _versions() -> str:
    """All that the code of a program depends on, beside the program itself."""
    return repr((machine.compiler(), machine.processor(), machine.optimises(), passes.wanted(), _SOURCES))
