"""Zarr in gonio's own layout (docs/data-model.md), as a folder or zipped: for large measurements, and object stores.

Zarr 2 is written; 2 and 3 are read, after `zarr_store` has looked at what there is.
"""

from __future__ import annotations

import base64
import contextlib
import os
import stat
import struct
import zipfile
from pathlib import Path
from typing import Any

from .. import files
from ..base.reflectance import Reflectance
from ..errors import FormatError, needed
from ..files import replacing, replacing_folder
from ..machine.aside import apart
from ..tables.dataset import of_file
from ._reading.own_layout import AS_STORED, NEEDED, Parameterization, Resolution, encoded, steady
from ._reading.zarr_store import CHUNK, DESCRIBING, inspected
from ._reading.zarr_tasks import finished

NAME = "Zarr"
SUFFIXES = (".zarr", ".zip")
DESCRIPTION = "Zarr in gonio's own layout, a folder or zipped: every measurement, without loss"
ORACLE = "own generator; xarray, zarr"
NO_LAYOUT = "variables by gonio's own names: see `tables.dataset_layout`"

ROOTS = ("zarr.json", ".zgroup")
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
    return of_file(apart(_dataset, _library(), path), str(path))


def _dataset(zarr: Any, path: Path) -> Any:
    try:
        return steady(path, lambda: _opened(zarr, path))
    except FormatError:
        raise
    except (zipfile.BadZipFile, NotImplementedError) as error:
        raise FormatError(f"{path}: zip file that is damaged or cut short: {error}") from None
    except Exception as error:  # zarr, numcodecs and xarray raise any of damaged files
        raise FormatError(f"{path}: Zarr store that is damaged or incomplete: {error}") from None


def write(
    m: Reflectance, path: Path, parameterization: Parameterization = "half_difference", resolution: Resolution = None
) -> None:
    """Write a reflectance as a folder, or zipped if the name ends in ".zip"; see `to_dataset`.

    Raises ParameterError for delta lobes and maps, DependencyError without zarr.
    """
    _library()
    ds, encoding = encoded(m, parameterization, resolution)
    if path.suffix.lower() != ".zip":
        with replacing_folder(path, _foreign) as temporary:
            apart(_fill, temporary, ds, encoding)
        return
    with replacing(path) as temporary:
        folder = temporary.with_name("store")
        apart(_fill, folder, ds, encoding)
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as packed:
            for name in sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()):
                packed.writestr(zipfile.ZipInfo(name), (folder / name).read_bytes())


def _fill(folder: Path, ds: Any, encoding: dict[Any, dict[str, Any]]) -> None:
    """Write a store with all of its chunks, those of zeros too."""
    options: dict[str, Any] = {"mode": "w", "zarr_format": 2, "consolidated": True, "write_empty_chunks": True}
    with finished():
        ds.to_zarr(folder, encoding=encoding, **options)


def target(path: Path) -> Path:
    """As `files.target`: a folder is replaced only if it is a store, and nothing else is in it."""
    return files.target(path) if path.suffix.lower() == ".zip" else files.target_folder(path, _foreign)


def _foreign(folder: Path) -> str | None:
    """The reason, in words, why a folder may not be replaced as a store; None if it may."""
    if not any((folder / root).is_file() and not (folder / root).is_symlink() for root in ROOTS):
        return f"is a folder, and no Zarr store, which would have {' or '.join(ROOTS)}"
    disk = folder.stat().st_dev
    waiting = [(folder, folder)]
    while waiting:
        at, array = waiting.pop()
        names = os.listdir(at)
        if not {*DESCRIBING}.isdisjoint(names):
            array = at
        for name in names:
            entry = at / name
            status = entry.lstat()
            if stat.S_ISDIR(status.st_mode) and status.st_dev == disk:
                waiting.append((entry, array))
                continue
            is_part = name in DESCRIBING or CHUNK.fullmatch(entry.relative_to(array).as_posix())
            if not is_part or not stat.S_ISREG(status.st_mode):
                return f"holds {str(entry.relative_to(folder))!r:.100}, which is no part of a Zarr store"
    return None


def _library() -> Any:
    with needed("Zarr stores need zarr", "pip install 'gonio[io]'"):
        import zarr
    return zarr


def _opened(zarr: Any, path: Path) -> Any:
    """The dataset in a store that `inspected` has nothing against, loaded: the arrays that are needed."""
    import xarray

    names = sorted(NEEDED & inspected(path))
    kind = zarr.storage.LocalStore if path.is_dir() else zarr.storage.ZipStore
    with contextlib.closing(kind(path, read_only=True)) as store, finished():
        group = zarr.open_group(store, mode="r", use_consolidated=False)
        variables = {name: _variable(group[name]) for name in names}
        return xarray.decode_cf(xarray.Dataset(variables, attrs=dict(group.attrs)), **AS_STORED)


def _variable(array: Any) -> Any:
    """An array as xarray has it: dimensions, values and attributes, as the libraries that write them note them."""
    attributes = dict(array.attrs)
    dims = attributes.pop("_ARRAY_DIMENSIONS", None) or getattr(array.metadata, "dimension_names", None)
    if array.metadata.zarr_format == 2 and array.fill_value is not None:
        attributes["_FillValue"] = array.fill_value
    elif isinstance(missing := attributes.get("_FillValue"), str) and array.dtype.kind == "f":
        attributes["_FillValue"] = struct.unpack("<d", base64.standard_b64decode(missing))[0]
    return tuple(dims or ()), array[...], attributes
