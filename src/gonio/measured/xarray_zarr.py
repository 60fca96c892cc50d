"""Zarr in gonio's own layout (docs/data-model.md), as a folder or zipped: for large measurements, and object stores.

Zarr 2 is written, 2 and 3 are read, through xarray. Before anything is read, every array's description is checked: how
large it is beside the files, and that its codecs are known ones (one of those that Zarr 2 may name runs what it reads);
and every packed chunk: how large it says that it was, and is (blosc reads on beyond the end of one that is cut short).
"""

from __future__ import annotations

import json
import os
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..dataset import from_dataset
from ..errors import DependencyError, FormatError
from ..files import replacing, replacing_folder
from ..interface import Reflectance
from ._xarray import AS_STORED, encoded

NAME = "Zarr"
SUFFIXES = (".zarr", ".zip")
DESCRIPTION = "Zarr in gonio's own layout, a folder or zipped: every measurement, without loss"
ORACLE = "own generator; xarray, zarr"

ROOTS = ("zarr.json", ".zgroup")
COMPRESSED = 1100
"""No store's arrays are more than this many times as long as its files, plus `SMALL`."""
SMALL = 2**20
DESCRIPTIONS = 2**24
"""Longest description of an array or a group that is read, in bytes."""
CODECS = {
    *("blosc", "zstd", "gzip", "zlib", "lz4", "crc32", "crc32c", "adler32", "fletcher32"),
    *("bytes", "endian", "transpose", "shuffle", "delta", "vlen-utf8", "numcodecs.zlib", "numcodecs.shuffle"),
}
CLAIM = 18
"""Bytes of a packed chunk in which it says how large it was, see `_claimed`."""
ZIPPED = b"PK\x03\x04"


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is a zipped store."""
    return head.startswith(ZIPPED) and any(root.encode() in head for root in (*ROOTS, ".zattrs", ".zmetadata"))


def matches_folder(path: Path) -> bool:
    """Whether a folder is a store."""
    return any((path / root).is_file() for root in ROOTS)


def read(path: Path) -> Reflectance:
    """The measurement in a store.

    Raises FormatError where it is damaged or has another layout, DependencyError without zarr.
    """
    zarr = _library()
    try:
        ds = _opened(zarr, path)
    except FormatError:
        raise
    except (zipfile.BadZipFile, NotImplementedError) as error:
        raise FormatError(f"{path}: zip file that is damaged or cut short: {error}") from None
    except Exception as error:  # zarr, numcodecs and xarray raise any of damaged files
        raise FormatError(f"{path}: Zarr store that is damaged or incomplete: {error}") from None
    return from_dataset(ds, str(path))


def write(
    m: Reflectance, path: Path, parameterisation: str = "half_difference", resolution: Sequence[int] | None = None
) -> None:
    """Write a reflectance as a folder, or zipped if the name ends in ".zip".

    `parameterisation` and `resolution`: see `to_dataset`. Raises ParameterError for
    delta lobes and maps, DependencyError without zarr.
    """
    _library()
    ds, encoding = encoded(m, parameterisation, resolution)
    if path.suffix.lower() != ".zip":
        with replacing_folder(path) as temporary:
            ds.to_zarr(temporary, mode="w", zarr_format=2, consolidated=True, encoding=encoding)
        return
    with replacing(path) as temporary, tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        ds.to_zarr(folder, mode="w", zarr_format=2, consolidated=True, encoding=encoding)
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as packed:
            for name in sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()):
                packed.writestr(zipfile.ZipInfo(name), (folder / name).read_bytes())


def _library() -> Any:
    try:
        import zarr
    except ImportError as error:
        raise DependencyError(f"Zarr stores need {error.name}; pip install 'gonio[io]'") from None
    return zarr


def _opened(zarr: Any, path: Path) -> Any:
    """The dataset in a store that `_inspect` has nothing against, loaded."""
    import xarray

    _inspect(path)
    options: dict[str, Any] = {"consolidated": False, "chunks": None, **AS_STORED}
    if path.is_dir():
        return xarray.open_zarr(str(path), **options).load()
    with zarr.storage.ZipStore(path, mode="r") as store:
        return xarray.open_zarr(store, **options).load()


def _inspect(path: Path) -> None:
    """FormatError where an array is larger than the store allows, or has codecs that are not known."""
    total, size = 0, 0
    arrays: dict[Path, tuple[set[str], int]] = {}
    chunks: list[tuple[Path, int, bytes]] = []
    for name, stored, length, content in _files(path):
        size += stored
        if not _is_description(name):
            if not Path(name).name.startswith("."):
                chunks.append((Path(name), length, content))
            continue
        for at, array in _arrays(name, json.loads(content)):
            taken = _bytes(array, f"{path}, {at}")
            total += taken
            folder = Path(at).parent if at == name else Path(at)
            codecs, most = arrays.get(folder, (set(), 0))  # several files may describe it, and not say the same
            arrays[folder] = codecs | {*_codecs(array)}, max(most, taken)
    if total > COMPRESSED * size + SMALL:
        raise FormatError(f"{path}: says that it holds {total} bytes of numbers, which {size} bytes of files cannot")
    for chunk, length, content in chunks:
        codecs, taken = next((arrays[folder] for folder in chunk.parents if folder in arrays), (set(), 0))
        claimed = _claimed(content, codecs)
        if claimed > taken + SMALL:
            raise FormatError(f"{path}: {chunk} says that it unpacks to {claimed} bytes, expected at most {taken}")
        if "blosc" in codecs and (length < CLAIM or int.from_bytes(content[12:16], "little") > length):
            raise FormatError(f"{path}: {chunk} is cut short: it has {length} bytes, expected what its header says")


def _files(path: Path) -> Iterator[tuple[str, int, int, bytes]]:
    """Every file of a store: name, bytes stored, bytes it has, and the whole of descriptions, of others the start."""
    if path.is_dir():
        for folder, _, names in os.walk(path):
            for each in names:
                file = Path(folder) / each
                name, length = str(file.relative_to(path)), file.stat().st_size
                with file.open("rb") as content:
                    yield name, length, length, content.read(_looked_at(name, length, path))
        return
    with zipfile.ZipFile(path) as packed:
        for entry in packed.infolist():
            if entry.file_size > COMPRESSED * entry.compress_size + SMALL:
                raise FormatError(f"{path}: {entry.filename} unpacks to {entry.file_size} bytes, more than zip allows")
            with packed.open(entry) as content:
                looked_at = _looked_at(entry.filename, entry.file_size, path)
                yield entry.filename, entry.compress_size, entry.file_size, content.read(looked_at)


def _is_description(name: str) -> bool:
    return Path(name).name in ("zarr.json", ".zarray", ".zmetadata")


def _looked_at(name: str, length: int, path: Path) -> int:
    """How many bytes of a file are looked at before the store is read."""
    if not _is_description(name):
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
    if "data_type" in array and codecs[-1:] == ["crc32c"]:  # which is put behind what others make
        codecs.pop()
    if "blosc" in codecs[:-1]:
        raise FormatError(f"{where}: is coded by {', '.join(codecs)}, expected blosc to be the last of them")
    if any(int(n) < 1 for n in chunks or []):
        raise FormatError(f"{where}: chunks of {chunks!r:.60}, expected at least 1 along every axis")
    return max(_product(array["shape"]), _product(chunks or [])) * _item_size(array)


def _codecs(array: dict[str, Any]) -> list[str]:
    """Names of what an array is coded by, in the order of writing."""
    if "data_type" in array:
        return [c.get("name") for c in array.get("codecs", [])]
    return [c.get("id") for c in [*(array.get("filters") or []), array.get("compressor")] if c]


def _item_size(array: dict[str, Any]) -> int:
    kind = array.get("data_type", array.get("dtype"))
    if isinstance(kind, dict):
        return int(kind.get("configuration", {}).get("length_bytes", 8))
    if "data_type" in array:
        return 8
    return np.dtype(str(kind)).itemsize


def _product(counts: Sequence[int]) -> int:
    total = 1
    for n in counts:
        total *= max(int(n), 0)
    return total
