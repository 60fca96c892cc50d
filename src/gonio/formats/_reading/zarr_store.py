"""A Zarr store, looked at before anything is read from it.

Every array's description is checked: how large it is beside the files, and that its codecs are known ones (one of those
that Zarr 2 may name runs what it reads); and every packed chunk: that it is there, how large it says that it was, and
is (blosc reads on beyond the end of one that is cut short), and what it unpacks to where it does not say so. Zarr has
the fill value for a chunk that is not there. Here that is an error, unless it is NaN: a copy that was interrupted would
be read as zeros.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import os
import re
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError
from .own_layout import NEEDED

COMPRESSED = 1100  # no store's arrays are more than this many times as long as its files, plus `SMALL`
SMALL = 2**20
DESCRIPTIONS = 2**24  # most bytes that descriptions of arrays and groups may have, all together
DESCRIBING = ("zarr.json", ".zarray", ".zmetadata", ".zattrs", ".zgroup")
CHUNK = re.compile(r"c|(c[./])?\d+([./]\d+)*")
"""Key of a chunk, its place below the folder of its array."""
CODECS = {
    *("blosc", "zstd", "gzip", "zlib", "lz4", "crc32", "crc32c", "adler32", "fletcher32"),
    *("bytes", "endian", "transpose", "shuffle", "delta", "vlen-utf8", "numcodecs.zlib", "numcodecs.shuffle"),
}
PACKERS = {"blosc", "zstd", "gzip", "zlib", "numcodecs.zlib", "lz4"}
DEFLATE = 1032  # nothing that deflate packed is more than this many times as long unpacked
BLOCK = 2**17  # bytes that a block of zstd unpacks to at most
CLAIM = 18  # bytes of a packed chunk in which it says how large it was, see `_claimed`
ZSTD = b"\x28\xb5\x2f\xfd"


def inspected(path: Path) -> set[str]:
    """The names of the arrays in a store. Raises FormatError where one is larger than the store allows, has codecs that
    are not known, or is not there as a whole."""
    total, size, described = 0, 0, 0
    arrays: dict[Path, tuple[set[str], int]] = {}
    described_alone: list[tuple[Path, dict[str, Any]]] = []
    keys: dict[Path, set[str]] = {}
    chunks: list[tuple[Path, int, bytes]] = []
    for name, stored, length, content in _files(path):
        size += stored
        last = Path(name).name
        described += length if last in DESCRIBING else 0
        if described > DESCRIPTIONS:
            raise FormatError(f"{path}: descriptions have {described} bytes, expected at most {DESCRIPTIONS}")
        if last not in DESCRIBING[:3]:
            if not last.startswith("."):
                chunks.append((Path(name), length, content))
            continue
        for at, array in _arrays(name, json.loads(content)):
            taken = _bytes(array, f"{path}, {at}")
            total += taken
            folder = Path(at).parent if at == name else Path(at)
            if at == name:
                described_alone.append((folder, array))
            codecs, most = arrays.get(folder, (set(), 0))  # several files may describe it, and not say the same
            arrays[folder] = codecs | {*_codecs(array)}, max(most, taken)
    if total > COMPRESSED * size + SMALL:
        raise FormatError(f"{path}: says that it holds {total} bytes of numbers, which {size} bytes of files cannot")
    with _whole(path) as whole:
        for chunk, length, content in chunks:
            folder = next((folder for folder in chunk.parents if folder in arrays), Path())
            _expect_small(path, chunk, length, content, arrays.get(folder, (set(), 0)), whole)
            keys.setdefault(folder, set()).add(chunk.relative_to(folder).as_posix())
    for folder, array in described_alone:
        if folder.as_posix() in NEEDED:
            _refuse_lost(path, folder, array, keys.get(folder, set()))
    return {folder.as_posix() for folder, _ in described_alone}


def _expect_small(
    path: Path, chunk: Path, length: int, start: bytes, array: tuple[set[str], int], whole: Callable[[Path], bytes]
) -> None:
    """FormatError where a chunk unpacks to more than its array has, or is cut short."""
    codecs, taken = array
    claimed = _claimed(start, codecs)
    if "zstd" in codecs and not claimed:
        claimed = _blocks(whole(chunk))
    elif codecs & {"gzip", "zlib", "numcodecs.zlib"} and DEFLATE * length > taken + SMALL:
        claimed = _inflated(whole(chunk), taken + SMALL)
    if claimed > taken + SMALL:
        raise FormatError(f"{path}: {chunk} says that it unpacks to {claimed} bytes, expected at most {taken}")
    if "blosc" in codecs and (length < CLAIM or int.from_bytes(start[12:16], "little") > length):
        raise FormatError(f"{path}: {chunk} is cut short: it has {length} bytes, expected what its header says")


def _refuse_lost(path: Path, folder: Path, array: dict[str, Any], keys: set[str]) -> None:
    """FormatError where a chunk is not there and would be read as its fill value, if that is a number."""
    is_new = "data_type" in array
    kind = np.dtype(str(array["data_type"] if is_new else array["dtype"])).kind
    if kind == "f" and str(array.get("fill_value")).lower() == "nan":
        return
    grid = array["chunk_grid"]["configuration"]["chunk_shape"] if is_new else array["chunks"]
    counts = [-(-int(n) // int(k)) for n, k in zip(array["shape"], grid, strict=True)]
    coding = array.get("chunk_key_encoding") or {}
    is_prefixed = is_new and coding.get("name", "default") == "default"
    usual = coding.get("configuration", {}).get("separator", "/" if is_prefixed else ".")
    separator = usual if is_new else array.get("dimension_separator", ".")
    lost = f"{len(keys)} chunks" if math.prod(counts) > len(keys) else ""
    for index in itertools.product(*map(range, counts)) if not lost else ():
        key = separator.join([*(["c"] if is_prefixed else []), *map(str, index)]) or "0"
        if key not in keys:
            lost = f"no chunk {key}"
            break
    if lost:
        advice = f"copy it again; if its writer left out chunks of {array.get('fill_value')!r:.20}, have them written"
        says = f"{folder} has {lost}, expected {math.prod(counts)}"
        raise FormatError(f"{path}: is not whole: {says}; {advice}: xarray's write_empty_chunks=True")


def _files(path: Path) -> Iterator[tuple[str, int, int, bytes]]:
    """Every file of a store: name, bytes stored, bytes it has, and the whole of descriptions, of others the start."""
    if path.is_dir():
        for folder, folders, names in os.walk(path):
            for each in [*folders, *names]:
                file = Path(folder) / each
                status = file.lstat()
                if stat.S_ISDIR(status.st_mode):
                    continue
                name, length = file.relative_to(path).as_posix(), status.st_size
                if not stat.S_ISREG(status.st_mode):
                    raise FormatError(f"{path}: {name} is a link, a pipe or a device, expected a file; copy the store")
                with file.open("rb") as content:
                    yield name, length, length, content.read(_looked_at(name, length, path))
        return
    with zipfile.ZipFile(path) as packed:
        for entry in packed.infolist():
            if entry.is_dir():
                continue
            if Path(entry.filename).as_posix() != entry.filename:
                raise FormatError(f"{path}: {entry.filename!r} is a name that no store has; pack it again")
            if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise FormatError(f"{path}: {entry.filename} is packed as no store is; pack it again: zip -0 -r")
            if entry.file_size > COMPRESSED * entry.compress_size + SMALL:
                raise FormatError(f"{path}: {entry.filename} unpacks to {entry.file_size} bytes, more than zip allows")
            with packed.open(entry) as content:
                start = content.read(_looked_at(entry.filename, entry.file_size, path))
                yield entry.filename, entry.compress_size, entry.file_size, start


def _looked_at(name: str, length: int, path: Path) -> int:
    """How many bytes of a file are looked at before the store is read."""
    if Path(name).name not in DESCRIBING:
        return CLAIM
    if length > DESCRIPTIONS:
        raise FormatError(f"{path}: {name} has {length} bytes, expected a description of at most {DESCRIPTIONS}")
    return length


def _claimed(start: bytes, codecs: set[str]) -> int:
    """Bytes that a chunk would unpack to by its first ones, where these say so."""
    if len(start) < CLAIM:
        return 0
    if "blosc" in codecs:
        return int.from_bytes(start[4:8], "little")
    if "zstd" in codecs:
        is_single = start[4] >> 5 & 1
        digits = (is_single, 2, 4, 8)[start[4] >> 6]
        at = 6 - is_single + (0, 1, 2, 4)[start[4] & 3]
        return int.from_bytes(start[at : at + digits], "little") + (256 if digits == 2 else 0)
    return int.from_bytes(start[:4], "little") if "lz4" in codecs else 0


@contextlib.contextmanager
def _whole(path: Path) -> Iterator[Callable[[Path], bytes]]:
    """What reads a file of a store."""
    if path.is_dir():
        yield lambda name: (path / name).read_bytes()
        return
    with zipfile.ZipFile(path) as packed:
        yield lambda name: packed.read(name.as_posix())


def _inflated(content: bytes, most: int) -> int:
    """Bytes that deflate unpacks a chunk to, all members of gzip, counted until they are more than `most`."""
    size = 0
    while content and size <= most:
        stream = zlib.decompressobj(zlib.MAX_WBITS | 32)
        while content and not stream.eof and size <= most:
            size += len(stream.decompress(content, SMALL))
            content = stream.unconsumed_tail
        content = stream.unused_data if stream.unused_data.startswith(b"\x1f\x8b") else b""
    return size


def _blocks(content: bytes) -> int:
    """Bytes that zstd unpacks a chunk to at most, by its blocks (RFC 8878)."""
    size = at = 0
    while len(content) - at > CLAIM and content[at : at + 4] == ZSTD:
        described = content[at + 4]
        is_single = described >> 5 & 1
        at += 6 - is_single + (0, 1, 2, 4)[described & 3] + (is_single, 2, 4, 8)[described >> 6]
        is_last = False
        while at < len(content) and not is_last:
            header = int.from_bytes(content[at : at + 3], "little")
            is_last, kind, length = bool(header & 1), header >> 1 & 3, header >> 3
            size += length if kind < 2 else BLOCK
            at += 3 + (1 if kind == 1 else length)
        at += 4 * (described >> 2 & 1)
    return size


def _arrays(name: str, described: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """Descriptions of arrays: the one in a file, or those that a file collects."""
    if not isinstance(described, dict):
        raise FormatError(f"{name}: holds {described!r:.40}, expected a JSON object")
    if "shape" in described:
        yield name, described
    collected = described.get("consolidated_metadata") or described
    for at, inner in (collected.get("metadata") or {}).items() if isinstance(collected, dict) else ():
        if isinstance(inner, dict) and "shape" in inner:
            yield at, inner


def _bytes(array: dict[str, Any], where: str) -> int:
    """Memory that an array takes, or one of its chunks if that is more."""
    chunks = array.get("chunks")
    if "data_type" in array:
        chunks = array.get("chunk_grid", {}).get("configuration", {}).get("chunk_shape")
    codecs = _codecs(array)
    if unknown := {*codecs} - CODECS:
        raise FormatError(f"{where}: is coded by {', '.join(map(repr, unknown))}, expected one of {sorted(CODECS)}")
    if "data_type" in array and codecs[-1:] == ["crc32c"]:  # a checksum after the others' output
        codecs.pop()
    if not PACKERS.isdisjoint(codecs[:-1]):
        raise FormatError(f"{where}: is coded by {', '.join(codecs)}, expected what packs to be the last of them")
    if any(int(n) < 1 for n in chunks or []):
        raise FormatError(f"{where}: chunks of {chunks!r:.60}, expected at least 1 along every axis")
    count = max(math.prod(max(int(n), 0) for n in counts) for counts in (array["shape"], chunks or []))
    if isinstance(kind := array.get("data_type", array.get("dtype")), dict):
        return count * int(kind.get("configuration", {}).get("length_bytes", 8))
    return count * (8 if "data_type" in array else np.dtype(str(kind)).itemsize)


def _codecs(array: dict[str, Any]) -> list[str]:
    """Names of an array's codecs, in the order of writing."""
    if "data_type" in array:
        return [c.get("name") for c in array.get("codecs", [])]
    return [c.get("id") for c in [*(array.get("filters") or []), array.get("compressor")] if c]
