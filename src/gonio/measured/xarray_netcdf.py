"""netCDF-4 files in gonio's own layout (docs/data-model.md): what any measurement can be kept in without loss.

Read and written through xarray with h5netcdf. Other HDF5 files are recognised by what is in them: NASA's MCD43A1 is
read by `mcd43`. Before anything is read, every array is compared with the length of the file, and links to other files
are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..dataset import from_dataset, to_dataset
from ..errors import DependencyError, FormatError
from ..files import replacing
from ..interface import Reflectance
from . import mcd43

if TYPE_CHECKING:
    import xarray

NAME = "netCDF"
SUFFIXES = (".nc", ".nc4")
DESCRIPTION = "netCDF-4 in gonio's own layout: every measurement, with uncertainty and provenance, without loss"
ORACLE = "own generator; xarray, h5py"

MAGIC = b"\x89HDF\r\n\x1a\n"
CLASSIC = (b"CDF\x01", b"CDF\x02", b"CDF\x05")
COMPRESSED = 1100
"""No file's arrays are more than this many times as long as the file: deflate's limit is 1032."""
SMALL = 2**20
"""Bytes of arrays that any file may hold, as of constants that were never stored."""
DAMAGE = (
    OSError,
    RuntimeError,
    KeyError,
    ValueError,
    TypeError,
    AttributeError,
    IndexError,
    OverflowError,
    MemoryError,
)
"""What h5py and h5netcdf raise on damaged files."""


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is HDF5, or netCDF of an older kind."""
    return head.startswith((MAGIC, *CLASSIC))


def read(path: Path, **options: Any) -> Reflectance:
    """The measurement in a file; `options` are those of `mcd43.read`, for files of that kind.

    Raises FormatError where the file is damaged or has another layout, DependencyError without h5netcdf.
    """
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise FormatError(f"{path}: netCDF of the classic kind, expected netCDF-4; convert it: nccopy -k nc4")
    names = _inspected(path)
    if mcd43.describes(names):
        return mcd43.read_dataset(_opened(path), str(path), **options)
    if options:
        raise FormatError(f"{path}: holds no MCD43A1 kernel weights, which alone have the options {', '.join(options)}")
    return from_dataset(_opened(path), str(path))


def write(
    m: Reflectance, path: Path, parameterisation: str = "half_difference", resolution: Sequence[int] | None = None
) -> None:
    """Write a reflectance; `parameterisation` and `resolution` are for those on no grid, see `to_dataset`.

    Raises ParameterError for delta lobes and maps, DependencyError without h5netcdf.
    """
    _libraries()
    ds = to_dataset(m, parameterisation, resolution)
    encoding: dict[Any, dict[str, Any]] = {
        name: {"_FillValue": None} for name in ds.variables if ds[name].dtype.kind == "f"
    }
    for name in ds.data_vars:
        encoding.setdefault(name, {}).update(zlib=True, complevel=4, shuffle=True, fletcher32=True)
    with replacing(path) as temporary:
        ds.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)


def _libraries() -> Any:
    try:
        import h5netcdf  # noqa: F401
        import h5py
    except ImportError as error:
        raise DependencyError(f"netCDF files need {error.name}; pip install h5netcdf h5py") from None
    return h5py


def _inspected(path: Path) -> list[str]:
    """Names of the datasets in a file, none of which is longer than the file allows."""
    h5py, size = _libraries(), path.stat().st_size
    names: list[str] = []
    total = 0
    try:
        with h5py.File(path, "r") as file:
            waiting = [file]
            seen = set()
            while waiting:
                group = waiting.pop()
                for name in group:
                    link = group.get(name, getlink=True)
                    if not isinstance(link, h5py.HardLink):
                        raise FormatError(f"{path}: {name} is a link to elsewhere, expected the data itself")
                    found = group[name]
                    address = h5py.h5o.get_info(found.id).addr
                    if address in seen:
                        continue
                    seen.add(address)
                    if isinstance(found, h5py.Group):
                        waiting.append(found)
                        continue
                    if isinstance(found, h5py.Dataset):
                        names.append(found.name.lstrip("/"))
                        total += _bytes(found, path)
    except DAMAGE as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{path}: HDF5 file that is damaged or cut short: {error}; fetch it again") from None
    if total > COMPRESSED * size + SMALL:
        raise FormatError(f"{path}: says that it holds {total} bytes of numbers, which {size} bytes of file cannot")
    return names


def _bytes(found: Any, path: Path) -> int:
    """Memory that an array takes, or one of its chunks if that is more."""
    if found.external or found.is_virtual:
        raise FormatError(f"{path}: {found.name} is kept in other files, expected the data itself")
    cells = 1 if found.shape is not None else 0
    for n in found.shape or ():
        cells *= int(n)
    chunk = 1
    for n in found.chunks or ():
        chunk *= int(n)
    return max(cells, chunk) * int(found.dtype.itemsize)


def _opened(path: Path) -> xarray.Dataset:
    import xarray

    try:
        return xarray.load_dataset(path, engine="h5netcdf", decode_times=False, decode_coords=False)
    except DAMAGE as error:
        raise FormatError(f"{path}: netCDF file that is damaged or not laid out as such: {error}") from None
