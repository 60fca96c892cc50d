"""Tensor files: named arrays of numbers, the container of RGL's material files.

Layout, little-endian: 12 bytes "tensor_file\\0"; version u8 major, u8 minor; u32 number of fields; per field
u16 length of the name, the name, u16 number of axes, u8 type, u64 offset of the data in the file, u64 length
of each axis; then the data, each field at a multiple of 8 bytes.
Source: Dupuy & Jakob 2018 (the material files of that paper); checked against files of their database.
"""

from __future__ import annotations

import io
import math
import os
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ...errors import FormatError, NotFoundError, ParameterError
from ...files import replacing

MAGIC = b"tensor_file\0"
VERSION = (1, 0)
_NAMES = ("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")
TYPES = {code: np.dtype(name) for code, name in enumerate(_NAMES, start=1)}
_START = len(MAGIC) + 2 + 4
_SMALLEST_ENTRY = 2 + 2 + 1 + 8
_MOST_AXES = 32


class _FieldHeader(NamedTuple):
    """A field in the header: type, offset of its data in the file, shape."""

    dtype: np.dtype
    offset: int
    shape: tuple[int, ...]


class FieldInFile:
    """A field that stays in its file until it is asked for, and is read only if the file is still the same."""

    def __init__(self, path: str, stamp: tuple[int, ...], entry: _FieldHeader):
        self.path, self.stamp, self.dtype, self.shape = path, stamp, entry.dtype, entry.shape
        self.offset, self.ndim, self.nbytes = entry.offset, len(entry.shape), _bytes(entry)

    def rows(self) -> Iterator[np.ndarray]:
        """The entries along its first axis, one after the other, each a new array.

        Raises NotFoundError where the file is gone, FormatError where it has changed since its header was read.
        """
        with opened(self.path) as file:
            for k in range(self.shape[0]):
                row = np.empty(self.shape[1:], self.dtype)
                self._fill(file, row, self.offset + k * row.nbytes)
                yield row

    def read(self) -> np.ndarray:
        """The whole field, read-only. Raises the errors of `rows`."""
        field = np.empty(self.shape, self.dtype)
        with opened(self.path) as file:
            self._fill(file, field, self.offset)
        field.flags.writeable = False
        return field

    def _fill(self, file: BinaryIO, out: np.ndarray, offset: int) -> None:
        file.seek(offset)
        count = file.readinto(out.reshape(-1).view(np.uint8))  # type: ignore[attr-defined]  # BinaryIO does not declare it
        if stamp(file) != self.stamp or count < out.nbytes:
            raise FormatError(f"{self.path}: has changed since it was loaded; load it again")


def opened(path: str | os.PathLike) -> BinaryIO:
    """The file of this name. Raises NotFoundError."""
    try:
        return open(path, "rb")
    except OSError as error:
        raise NotFoundError(f"{path}: cannot be read: {error.strerror}") from None


def stamp(file: BinaryIO) -> tuple[int, ...]:
    """The identity of an open file's content: length, time of the last change, number on its disk."""
    status = os.fstat(file.fileno())
    return status.st_size, status.st_mtime_ns, status.st_ino


class _Header:
    """The numbers at the start of a file, read one after the other, never beyond its end."""

    def __init__(self, file: BinaryIO, size: int, name: str):
        self.file, self.size, self.name, self.at = file, size, name, 0

    def bytes(self, count: int, part: str) -> bytes:
        end = self.at + count
        piece = self.file.read(count) if end <= self.size else b""
        if len(piece) < count:
            need = f"{part} needs bytes {self.at} to {end}, the file has {self.size}"
            raise FormatError(f"{self.name}: truncated: {need}; fetch it again")
        self.at = end
        return piece

    def numbers(self, code: str, part: str) -> tuple[Any, ...]:
        layout = "<" + code
        return struct.unpack(layout, self.bytes(struct.calcsize(layout), part))


def entries(file: BinaryIO, size: int, name: str) -> dict[str, _FieldHeader]:
    """The fields in the header of a file of `size` bytes, which all lie within it; FormatError for other files."""
    head = _Header(file, size, name)
    magic = head.bytes(len(MAGIC), "the signature")
    if magic != MAGIC:
        raise FormatError(f"{name}: not a tensor file: starts with {magic!r}, expected {MAGIC!r}")
    version = head.numbers("BB", "the version")
    if version != VERSION:
        raise FormatError(f"{name}: tensor file version {version[0]}.{version[1]}, expected 1.0")
    (count,) = head.numbers("I", "the number of fields")
    most = (size - _START) // _SMALLEST_ENTRY
    if count > most:
        raise FormatError(f"{name}: header says {count} fields, {size} bytes can hold at most {most}")
    fields: dict[str, _FieldHeader] = {}
    for i in range(count):
        field, entry = _entry(head, i)
        if field in fields:
            raise FormatError(f"{name}: field {field!r} occurs twice, expected once")
        fields[field] = entry
    for field, entry in fields.items():
        end = entry.offset + _bytes(entry)
        if not head.at <= entry.offset <= end <= size or max(entry.shape, default=0) > size:
            raise FormatError(
                f"{name}: field {field!r}, {entry.dtype.name} of shape {entry.shape}, lies at bytes {entry.offset} to "
                f"{end}; expected between the header's end {head.at} and the file's end {size}: truncated or damaged"
            )
    return fields


def _bytes(entry: _FieldHeader) -> int:
    return math.prod(entry.shape) * entry.dtype.itemsize


def _entry(head: _Header, i: int) -> tuple[str, _FieldHeader]:
    """Name and entry of the i-th field."""
    (length,) = head.numbers("H", f"field {i}")
    raw = head.bytes(length, f"the name of field {i}")
    try:
        field = raw.decode("utf-8")
    except UnicodeDecodeError:
        raise FormatError(f"{head.name}: field {i} is named {raw[:32]!r}, expected UTF-8 text") from None
    axes, code, offset = head.numbers("HBQ", f"field {field!r}")
    if axes > _MOST_AXES:
        raise FormatError(f"{head.name}: field {field!r} has {axes} axes, expected at most {_MOST_AXES}")
    if code not in TYPES:
        raise FormatError(f"{head.name}: field {field!r} has type {code}, expected 1 to {len(TYPES)}")
    return field, _FieldHeader(TYPES[code], offset, head.numbers(f"{axes}Q", f"the shape of field {field!r}"))


def read(path: Path) -> dict[str, np.ndarray]:
    """The fields of a tensor file in their order, read-only; nothing is allocated on its header's word."""
    with opened(path) as file:
        data = file.read()
    fields = entries(io.BytesIO(data), len(data), str(path))
    return {field: np.ndarray(e.shape, e.dtype, buffer=data, offset=e.offset) for field, e in fields.items()}


def as_array(field: np.ndarray | FieldInFile) -> np.ndarray:
    """A field as an array."""
    return field.read() if isinstance(field, FieldInFile) else field


def expect(
    fields: Mapping[str, Any], where: str, name: str, shape: tuple[int | None, ...], dtype: str = "float32"
) -> Any:
    """The field of that name, an array or `FieldInFile`, of this type and shape (None: any length but 0).

    Raises FormatError for another one; `where` names the file.
    """
    if name not in fields:
        raise FormatError(f"{where}: field {name!r} is missing; its fields: {', '.join(map(repr, fields)):.200}")
    a = fields[name]
    fits = a.ndim == len(shape) and all(n == k or (k is None and n > 0) for n, k in zip(a.shape, shape, strict=True))
    if not fits or a.dtype != dtype:
        expected = ", ".join("n" if n is None else str(n) for n in shape)
        raise FormatError(f"{where}: {name} is {a.dtype} of shape {a.shape}, expected {dtype} of shape ({expected})")
    return a


def serialize(fields: Mapping[str, np.ndarray]) -> bytes:
    """A tensor file of these fields, in their order."""
    return b"".join(_pieces(fields))


def _pieces(fields: Mapping[str, np.ndarray | FieldInFile]) -> Iterator[Any]:
    """The pieces of a tensor file, whose fields may be larger than memory."""
    codes = {dtype: code for code, dtype in TYPES.items()}
    arrays: list[Any] = []
    names = [field.encode("utf-8") for field in fields]
    for field, array in fields.items():
        if isinstance(array, FieldInFile):
            arrays.append(array)
            continue
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
        for part in array.rows() if isinstance(array, FieldInFile) else [array]:
            yield part.data.cast("B") if part.size else b""


def write(path: Path, fields: Mapping[str, np.ndarray | FieldInFile]) -> None:
    """Write a tensor file; an existing file is replaced only when all is written."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.writelines(_pieces(fields))
