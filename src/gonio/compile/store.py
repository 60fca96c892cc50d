"""Kernels, compiled once: kept in memory, and on disk for the next process.

The folder is `GONIO_CACHE_DIR`, or `gonio` in the user's folder for caches. A file is named by everything its code
depends on (the program, the processor, the versions) and holds a checksum: what is damaged is compiled anew, what
cannot be written is not kept. Files are written under another name and renamed, so that processes may share the folder.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from .. import files
from ..errors import Error
from . import image, machine
from .program import Program

MAGIC = b"gonio kernel 1\n"
FILES_KEPT = 2000

Function = Callable[[int, int, int, int], None]
"""kernel(args, outer, inner, grain), see `codegen`"""

_KNOWN: dict[str, Any] = {}
_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, *[ctypes.c_int64] * 3)


def kernel(program: Program) -> Function:
    """The compiled program: from memory, from disk, or compiled now."""
    return function(program.digest(), lambda: source(program), _PROTOTYPE)


def function(name: str, text: Callable[[], str], prototype: Any) -> Any:
    """`kernel` of the IR that `text` gives, as a Python function; `name` stands for the text."""
    name = hashlib.sha256((name + _versions()).encode()).hexdigest()[:40]
    found = _KNOWN.get(name)
    if found is None:
        address, keeper = _read(name) or _compiled(text(), name)
        found = prototype(address)
        found.keeper = keeper
        _KNOWN[name] = found
    return found


def source(program: Program) -> str:
    """The LLVM IR of a program, for this processor."""
    from . import codegen  # needed to compile only

    return codegen.generate(program, _width(program), machine.lane_bits() == 512)


def assembly(program: Program) -> str:
    """The machine code of a program, for this processor, as text."""
    return machine.to_assembly(source(program))


def _width(program: Program) -> int:
    # Two vectors at a time: each waits for its own results, and the processor works on the other meanwhile.
    return 2 * machine.lanes(program.dtype)


_Placed = tuple[int, Any]
"""The address of a function, and what keeps it in memory."""


def _compiled(text: str, name: str) -> _Placed:
    code = machine.to_object(text)
    flat = image.flatten(code)
    if flat is not None:
        payload, entry = flat
        placed = _from_image(payload, entry)
        if placed is not None:
            _write(name, b"i" + entry.to_bytes(8, "little") + payload)
            return placed
    _write(name, b"o" + bytes(8) + code)
    return machine.linked(code)


def _from_image(payload: bytes, entry: int) -> _Placed | None:
    placed = image.mapped(payload)
    return None if placed is None else (placed[0] + entry, placed[1])


@cache
def _versions() -> str:
    """What the code of a program depends on beside the program itself."""
    here = Path(__file__).parent
    sources = [
        os.stat(here / f"{part}.py")
        for part in ("codegen", "access", "divisions", "program", "lanes", "elementary", "image", "machine", "store")
    ]
    stamps = [(s.st_mtime_ns, s.st_size) for s in sources]
    return repr((machine.compiler(), machine.processor(), stamps))


@cache
def folder() -> Path | None:
    """Where kernels are kept; None if that is nowhere safe: a folder that cannot be made or belongs to another user."""
    given = os.environ.get("GONIO_CACHE_DIR")
    if given is not None:
        home = Path(given)
    elif os.name == "nt":
        home = Path(os.environ.get("LOCALAPPDATA", Path.home())) / "gonio" / "kernels"
    elif sys.platform == "darwin":
        home = Path.home() / "Library" / "Caches" / "gonio" / "kernels"
    else:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gonio" / "kernels"
    try:
        home.mkdir(mode=0o700, parents=True, exist_ok=True)
        if os.name == "posix" and home.stat().st_uid != os.getuid():
            return None
    except (OSError, RuntimeError):
        return None
    return home


def _read(name: str) -> _Placed | None:
    home = folder()
    if home is None:
        return None
    try:
        data = (home / name).read_bytes()
    except OSError:
        return None
    head, body = data[: len(MAGIC) + 32], data[len(MAGIC) + 32 :]
    if head != MAGIC + hashlib.sha256(body).digest() or len(body) < 10:
        return None
    kind, entry, payload = body[:1], int.from_bytes(body[1:9], "little"), body[9:]
    return _from_image(payload, entry) if kind == b"i" else machine.linked(payload)


def _write(name: str, body: bytes) -> None:
    home = folder()
    if home is None:
        return
    with suppress(OSError, Error):
        with files.replacing(home / name) as path:
            path.write_bytes(MAGIC + hashlib.sha256(body).digest() + body)
        _prune(home)


def _prune(home: Path) -> None:
    """Remove the older half of the files where there are too many."""
    kept = list(home.iterdir())
    if len(kept) > FILES_KEPT:
        for path in sorted(kept, key=lambda p: p.stat().st_mtime)[: len(kept) // 2]:
            path.unlink(missing_ok=True)
