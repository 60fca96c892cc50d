"""netCDF-4 files in gonio's own layout (docs/data-model.md): what any measurement can be kept in without loss.

Read and written through xarray with h5netcdf. Other HDF5 files are recognised by what is in them: NASA's MCD43A1 is
read by `mcd43`. A process of its own reads a file first (`_hdf`): damaged files can stop the HDF5 library, or
never end. It compares every array with the length of the file, and refuses links to other files.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..dataset import from_dataset
from ..errors import DependencyError, FormatError
from ..files import replacing
from ..interface import Reflectance
from . import _hdf, mcd43, neural
from ._xarray import AS_STORED, encoded

if TYPE_CHECKING:
    import xarray

NAME = "netCDF"
SUFFIXES = (".nc", ".nc4")
DESCRIPTION = "netCDF-4 in gonio's own layout: every measurement, with uncertainty and provenance, without loss"
ORACLE = "own generator; xarray, h5py"

MAGIC = b"\x89HDF\r\n\x1a\n"
CLASSIC = (b"CDF\x01", b"CDF\x02", b"CDF\x05")


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is HDF5 and no `neural` network, or netCDF of an older kind."""
    return head.startswith((MAGIC, *CLASSIC)) and not neural.matches(head, size)


def read(path: Path, time: int | None = None) -> Reflectance:
    """The measurement in a file. `time`: number of the day, of MCD43A1 files; see `mcd43.read_dataset`.

    Raises FormatError where the file is damaged or has another layout, DependencyError without h5netcdf.
    """
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise FormatError(
                f"{path}: netCDF of the classic kind, expected netCDF-4; convert it: `nccopy -k nc4 old.nc new.nc`, "
                f"or `ncks -4 old.nc new.nc`"
            )
    _libraries()
    group = mcd43.group(_hdf.inspected("hdf5", path)["names"])
    if group is not None:
        return mcd43.read_dataset(_opened(path, group=group, phony_dims="sort"), str(path), time)
    if time is not None:
        raise FormatError(f"{path}: time={time}: holds no MCD43A1 kernel weights, which alone have days")
    return from_dataset(_opened(path), str(path))


def write(
    m: Reflectance, path: Path, parameterisation: str = "half_difference", resolution: Sequence[int] | None = None
) -> None:
    """Write a reflectance; `parameterisation` and `resolution`: see `to_dataset`.

    Raises ParameterError for delta lobes and maps, DependencyError without h5netcdf.
    """
    _libraries()
    ds, encoding = encoded(m, parameterisation, resolution)
    for name in ds.data_vars:
        encoding.setdefault(name, {}).update(zlib=True, complevel=4, shuffle=True)
    with replacing(path) as temporary:
        ds.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)


def _libraries() -> None:
    try:
        import h5netcdf  # noqa: F401
        import h5py  # noqa: F401
    except ImportError as error:
        raise DependencyError(f"netCDF files need {error.name}; pip install h5netcdf h5py") from None


def _opened(path: Path, **options: Any) -> xarray.Dataset:
    import xarray

    try:
        return xarray.load_dataset(path, engine="h5netcdf", **AS_STORED, **options)
    except Exception as error:  # h5py, h5netcdf and xarray raise any of damaged files
        raise FormatError(f"{path}: netCDF file that is damaged or not laid out as such: {error}") from None
