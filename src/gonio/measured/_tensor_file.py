"""The container that RGL's material files are stored in: named arrays of numbers, "tensor files".

Layout, little-endian: 12 bytes "tensor_file\\0"; version u8 major, u8 minor; u32 number of fields; per field
u16 length of the name, the name, u16 number of axes, u8 type, u64 offset of the data in the file, u64 length
of each axis; then the data, each field at a multiple of 8 bytes.
Source: Dupuy & Jakob 2018 (the material files of that paper); checked against files of their database.
"""

from __future__ import annotations

import math
import mmap
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError, NotFoundError, ParameterError
from ..files import replacing

MAGIC = b"tensor_file\0"
VERSION = (1, 0)
_NAMES = ("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")
TYPES = {code: np.dtype(name) for code, name in enumerate(_NAMES, start=1)}
_START = len(MAGIC) + 2 + 4
_SMALLEST_ENTRY = 2 + 2 + 1 + 8
_MOST_AXES = 32


class _Header:
    """Reads one number after the other from the start of a file, never beyond its end."""

    def __init__(self, data: bytes | mmap.mmap, name: str):
        self.data, self.name, self.at = data, name, 0

    def bytes(self, count: int, what: str) -> bytes:
        end = self.at + count
        if end > len(self.data):
            raise FormatError(
                f"{self.name}: truncated: {what} needs bytes {self.at} to {end}, "
                f"the file has {len(self.data)}; fetch it again"
            )
        piece, self.at = self.data[self.at : end], end
        return piece

    def number(self, code: str, what: str) -> int:
        layout = "<" + code
        return struct.unpack(layout, self.bytes(struct.calcsize(layout), what))[0]


def parse(data: bytes | mmap.mmap, name: str) -> dict[str, np.ndarray]:
    """The fields of a tensor file in their order, as read-only views of `data`; `name` is for error messages.

    Raises FormatError for whatever is not one, and never allocates more than `data` holds.
    """
    head = _Header(data, name)
    magic = head.bytes(len(MAGIC), "the signature")
    if magic != MAGIC:
        raise FormatError(f"{name}: not a tensor file: starts with {magic!r}, expected {MAGIC!r}")
    version = (head.number("B", "the version"), head.number("B", "the version"))
    if version != VERSION:
        raise FormatError(f"{name}: tensor file version {version[0]}.{version[1]}, expected 1.0")
    count = head.number("I", "the number of fields")
    most = (len(data) - _START) // _SMALLEST_ENTRY
    if count > most:
        raise FormatError(f"{name}: header says {count} fields, {len(data)} bytes can hold at most {most}")
    entries: dict[str, tuple[np.dtype, int, tuple[int, ...]]] = {}
    for i in range(count):
        field, *entry = _entry(head, i)
        if field in entries:
            raise FormatError(f"{name}: field {field!r} occurs twice, expected once")
        entries[field] = tuple(entry)  # type: ignore[assignment]
    return {field: _array(data, name, field, head.at, *entry) for field, entry in entries.items()}


def _entry(head: _Header, i: int) -> tuple[str, np.dtype, int, tuple[int, ...]]:
    """Name, type, offset and shape of the i-th field."""
    raw = head.bytes(head.number("H", f"field {i}"), f"the name of field {i}")
    try:
        field = raw.decode("utf-8")
    except UnicodeDecodeError:
        raise FormatError(f"{head.name}: field {i} is named {raw[:32]!r}, expected UTF-8 text") from None
    axes = head.number("H", f"field {field!r}")
    code = head.number("B", f"field {field!r}")
    offset = head.number("Q", f"field {field!r}")
    if axes > _MOST_AXES:
        raise FormatError(f"{head.name}: field {field!r} has {axes} axes, expected at most {_MOST_AXES}")
    if code not in TYPES:
        raise FormatError(f"{head.name}: field {field!r} has type {code}, expected 1 to {len(TYPES)}")
    shape = tuple(head.number("Q", f"the shape of field {field!r}") for _ in range(axes))
    return field, TYPES[code], offset, shape


def _array(
    data: bytes | mmap.mmap, name: str, field: str, start: int, dtype: np.dtype, offset: int, shape: tuple[int, ...]
) -> np.ndarray:
    end = offset + math.prod(shape) * dtype.itemsize
    if not start <= offset <= end <= len(data) or max(shape, default=0) > len(data):
        raise FormatError(
            f"{name}: field {field!r}, {dtype.name} of shape {shape}, lies at bytes {offset} to {end}; "
            f"expected between the header's end {start} and the file's end {len(data)}: truncated or damaged"
        )
    return np.ndarray(shape, dtype, buffer=data, offset=offset)


def read(path: Path) -> dict[str, np.ndarray]:
    """The fields of a tensor file."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise NotFoundError(f"{path}: cannot be read: {error.strerror}") from None
    return parse(data, str(path))


def expect(
    fields: Mapping[str, np.ndarray],
    where: str,
    name: str,
    shape: tuple[int | None, ...],
    dtype: str = "float32",
) -> np.ndarray:
    """The field of that name, which must have these axes (None: any length but 0) and this type.

    `where` names the file in the FormatError that is raised otherwise.
    """
    if name not in fields:
        raise FormatError(f"{where}: field {name!r} is missing; its fields: {', '.join(map(repr, fields)):.200}")
    a = fields[name]
    fits = a.ndim == len(shape) and all(
        n == want or (want is None and n > 0) for n, want in zip(a.shape, shape, strict=True)
    )
    if not fits or a.dtype != dtype:
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise FormatError(f"{where}: {name} is {a.dtype} of shape {a.shape}, expected {dtype} of shape ({wanted})")
    return a


def serialise(fields: Mapping[str, np.ndarray]) -> bytes:
    """A tensor file of these fields, in their order."""
    return b"".join(_pieces(fields))


def _pieces(fields: Mapping[str, np.ndarray]) -> Iterator[Any]:
    """A tensor file piece by piece: fields may be larger than memory."""
    codes = {dtype: code for code, dtype in TYPES.items()}
    arrays, names = [], [field.encode("utf-8") for field in fields]
    for field, array in fields.items():
        little = np.asarray(array).dtype.newbyteorder("<")
        if little not in codes:
            raise ParameterError(f"field {field!r} is {little.name}, expected an integer or floating-point type")
        arrays.append(np.ascontiguousarray(array, dtype=little).reshape(np.shape(array)))
    at = _START + sum(_SMALLEST_ENTRY + len(n) + 8 * a.ndim for n, a in zip(names, arrays, strict=True))
    yield MAGIC + bytes(VERSION) + struct.pack("<I", len(names))
    padding = []
    for name, array in zip(names, arrays, strict=True):
        padding.append(-at % 8)
        at += padding[-1]
        yield struct.pack("<H", len(name)) + name
        yield struct.pack(f"<HBQ{array.ndim}Q", array.ndim, codes[array.dtype], at, *array.shape)
        at += array.nbytes
    for before, array in zip(padding, arrays, strict=True):
        yield bytes(before)
        yield array.data.cast("B") if array.size else b""


def write(path: Path, fields: Mapping[str, np.ndarray]) -> None:
    """Write a tensor file; an existing file is replaced only when all is written."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.writelines(_pieces(fields))
