"""Machine code without a linker: an ELF object becomes one block of bytes that runs wherever it is put.

A kernel calls nothing and refers to its own constants only, relative to where it stands. So the sections of its
object file are laid side by side, references between them are filled in, and the result is stored and mapped into
memory as it is: neither LLVM nor a linker is needed to run a kernel a second time.
"""

from __future__ import annotations

import ctypes
import mmap
import struct
import sys
from functools import cache
from typing import Any, NamedTuple

ALIGN = 64
_X86_64 = 62
_RELATIVE = (2, 4)  # R_X86_64_PC32, R_X86_64_PLT32: 32 bits, symbol + addend - place
_PROGRAM, _RELOCATIONS, _ALLOCATED = 1, 4, 2


class _Section(NamedTuple):
    name: int
    kind: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    align: int
    entry: int


def flatten(code: bytes) -> tuple[bytes, int] | None:
    """The image of an object file and where in it `kernel` starts; None where it refers to anything outside."""
    if code[:6] != b"\x7fELF\x02\x01" or struct.unpack_from("<H", code, 18)[0] != _X86_64:
        return None
    (start,) = struct.unpack_from("<Q", code, 40)
    size, count, names = struct.unpack_from("<HHH", code, 58)
    sections = [_Section(*struct.unpack_from("<IIQQQQIIQQ", code, start + i * size)) for i in range(count)]
    image, places = bytearray(), {}
    for i, s in enumerate(sections):
        if s.kind == _PROGRAM and s.flags & _ALLOCATED and not _name(code, sections[names], s.name).startswith(b".eh"):
            image.extend(bytes(-len(image) % max(s.align, ALIGN)))
            places[i] = len(image)
            image.extend(code[s.offset : s.offset + s.size])
    entry = None
    for s in sections:
        if s.kind != _RELOCATIONS or s.info not in places:
            continue
        symbols = sections[s.link]
        for at in range(s.offset, s.offset + s.size, 24):
            offset, info, addend = struct.unpack_from("<QQq", code, at)
            _, _, _, home, value, _ = struct.unpack_from("<IBBHQQ", code, symbols.offset + 24 * (info >> 32))
            if (info & 0xFFFFFFFF) not in _RELATIVE or home not in places:
                return None
            place = places[s.info] + offset
            struct.pack_into("<i", image, place, places[home] + value + addend - place)
    for s in sections:
        if s.kind == 2:  # the table of symbols
            for at in range(s.offset, s.offset + s.size, 24):
                name, _, _, home, value, _ = struct.unpack_from("<IBBHQQ", code, at)
                if _name(code, sections[s.link], name) == b"kernel" and home in places:
                    entry = places[home] + value
    return None if entry is None else (bytes(image), entry)


def _name(code: bytes, strings: _Section, at: int) -> bytes:
    start = strings.offset + at
    return code[start : code.index(b"\0", start)]


@cache
def _libc() -> Any:
    libc = ctypes.CDLL(None)
    libc.mprotect.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]
    return libc


def mapped(image: bytes) -> tuple[int, Any] | None:
    """The address of an image in executable memory, and what keeps it there; None where that is not allowed."""
    if not sys.platform.startswith("linux"):
        return None
    memory = mmap.mmap(-1, len(image), prot=mmap.PROT_READ | mmap.PROT_WRITE)
    memory.write(image)
    pointer = ctypes.c_char.from_buffer(memory)
    address = ctypes.addressof(pointer)
    if _libc().mprotect(address, len(image), mmap.PROT_READ | mmap.PROT_EXEC):
        return None
    return address, (memory, pointer)
