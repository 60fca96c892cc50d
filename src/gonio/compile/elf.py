"""Machine code without a linker: an ELF object becomes one block of bytes that runs wherever it is put.

A kernel calls nothing and refers only to its own constants, by relative addresses. So the sections of its object file
are laid side by side, references between them are filled in, and the result is stored and mapped into memory as it is:
neither LLVM nor a linker is needed to run a kernel a second time.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import struct
import sys
from functools import cache
from typing import Any, NamedTuple

from ..errors import EngineError

POSSIBLE = sys.platform.startswith("linux")
ALIGN = 64
_X86_64 = 62
_RELATIVE = (2, 4)  # R_X86_64_PC32, R_X86_64_PLT32: 32 bits, symbol + addend - place
_PROGRAM, _RELOCATIONS, _EMPTY, _ALLOCATED = 1, 4, (0, 8), 2
_OTHER_OBJECTS = (b"\xcf\xfa\xed\xfe", b"\x64\x86", b"\x64\xaa")  # Mach-O, and COFF of two processors


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


def is_object(code: bytes) -> bool:
    """Whether bytes are an object file: by their beginning, and of ELF also by its sections, which LLVM needs whole."""
    return bool(_sections(code)) or code.startswith(_OTHER_OBJECTS)


def _sections(code: bytes) -> list[_Section]:
    """The sections of a 64-bit ELF object; none where the bytes are no such object, or cut off."""
    if code[:6] != b"\x7fELF\x02\x01" or len(code) < 64:
        return []
    (start,) = struct.unpack_from("<Q", code, 40)
    size, count = struct.unpack_from("<HH", code, 58)
    if size != 64 or start + size * count > len(code):
        return []
    sections = [_Section(*struct.unpack_from("<IIQQQQIIQQ", code, start + i * size)) for i in range(count)]
    return sections if all(s.kind in _EMPTY or s.offset + s.size <= len(code) for s in sections) else []


def flatten(code: bytes) -> tuple[bytes, int] | None:
    """The image of an object file and the offset of `kernel` in it; None where it refers to anything outside."""
    sections = _sections(code)
    if not POSSIBLE or not sections or struct.unpack_from("<H", code, 18)[0] != _X86_64:
        return None
    (names,) = struct.unpack_from("<H", code, 62)
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
    libc = ctypes.CDLL(None, use_errno=True)
    libc.mprotect.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]
    return libc


def mapped(image: bytes, entry: int) -> tuple[int, Any]:
    """The address of byte `entry` of an image in executable memory, and the object that keeps it there.

    Raises EngineError where that is not allowed.
    """
    try:
        memory = mmap.mmap(-1, len(image), prot=mmap.PROT_READ | mmap.PROT_WRITE)
    except OSError as error:
        raise EngineError(f"no memory can be had for code ({error.strerror})") from None
    memory.write(image)
    pointer = ctypes.c_char.from_buffer(memory)
    address = ctypes.addressof(pointer)
    if _libc().mprotect(address, len(image), mmap.PROT_READ | mmap.PROT_EXEC):
        reason = os.strerror(ctypes.get_errno())
        raise EngineError(f"this system does not allow memory to be made executable ({reason})")
    return address + entry, (memory, pointer)


def require_executable() -> None:
    """Raises EngineError where memory may not be made executable: LLVM's loader would crash. Only Linux is asked."""
    if POSSIBLE:
        mapped(bytes(1), 0)
