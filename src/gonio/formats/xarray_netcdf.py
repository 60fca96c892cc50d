"""netCDF-4 files in gonio's own layout (docs/data-model.md), which holds any measurement without loss.

Read and written through xarray with h5netcdf. Other HDF5 files are recognized by their content: NASA's MCD43A1 is
read by `mcd43`. A process of its own reads a file first (`hdf`): damaged files can stop the HDF5 library, or
never end. It compares every array with the length of the file, and refuses links to other files. A file is made in
memory, and then written: the HDF5 library does not survive a full disk.
"""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.reflectance import Reflectance
from ..errors import FormatError, needed
from ..files import replacing
from ..machine.aside import apart
from ..tables.dataset import of_file
from . import mcd43, neural
from ._reading import hdf
from ._reading.own_layout import AS_STORED, NEEDED, Parameterization, Resolution, encoded, steady

if TYPE_CHECKING:
    import xarray

NAME = "netCDF"
SUFFIXES = (".nc", ".nc4")
DESCRIPTION = "netCDF-4 in gonio's own layout: every measurement, with uncertainty and provenance, without loss"
ORACLE = "own generator; xarray, h5py"
NO_LAYOUT = "variables by gonio's own names: see `tables.dataset_layout`"

CLASSIC = (b"CDF\x01", b"CDF\x02", b"CDF\x05")


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is HDF5 and no `neural` network, or netCDF of an older kind."""
    return head.startswith((neural.MAGIC, *CLASSIC)) and not neural.matches(head, size)


def read(
    path: Path,
    time: mcd43.Day = None,
    band: mcd43.Band = None,
    quality: mcd43.Quality = "any",
) -> Reflectance:
    """The measurement in a file.

    Raises FormatError where the file is damaged or has another layout, DependencyError without h5netcdf.
    """
    with path.open("rb") as file:
        if file.read(len(neural.MAGIC)) != neural.MAGIC:
            advice = "`nccopy -k nc4 old.nc new.nc`, or `ncks -4 old.nc new.nc`"
            raise FormatError(f"{path}: netCDF of the classic kind, expected netCDF-4; convert it: {advice}")
    _libraries()
    return apart(steady, path, lambda: _measurement(path, time, band, quality))


def _measurement(path: Path, time: Any, band: Any, quality: str) -> Reflectance:
    names = hdf.inspected("hdf5", path, json.dumps([sorted(NEEDED | mcd43.NEEDED), mcd43.PREFIXES]))["names"]
    group = mcd43.group(names)
    if group is not None:
        return mcd43.read_dataset(_opened(path, names, group=group, phony_dims="sort"), str(path), time, band, quality)
    for name, value in (("time", time), ("band", band), ("quality", None if quality == "any" else quality)):
        if value is not None:
            rule = "holds no MCD43A1 kernel weights, which alone have days, bands and quality"
            raise FormatError(f"{path}: {name}={value!r:.60}: {rule}")
    return of_file(_opened(path, names, phony_dims="access"), str(path))


def write(
    m: Reflectance, path: Path, parameterization: Parameterization = "half_difference", resolution: Resolution = None
) -> None:
    """Write a reflectance; see `to_dataset`.

    Raises ParameterError for delta lobes and maps, DependencyError without h5netcdf.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.nc", resolution=(4, 4, 6))
    >>> print(gn.load("white.nc").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    _libraries()
    ds, encoding = encoded(m, parameterization, resolution)
    for name in ds.data_vars:
        encoding.setdefault(name, {}).update(zlib=True, complevel=4, shuffle=True)
    content = apart(_content, ds, encoding)
    with replacing(path) as temporary:
        temporary.write_bytes(content.getbuffer())


def _content(ds: xarray.Dataset, encoding: Any) -> io.BytesIO:
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        ds.dump_to_store(H5NetCDFStore(file), encoding=encoding)
    return content


def _libraries() -> None:
    with needed("netCDF files need h5netcdf and h5py", "pip install h5netcdf h5py"):
        import h5netcdf  # noqa: F401  (whether they are there)
        import h5py  # noqa: F401  (whether they are there)


def _opened(path: Path, names: list[str], **options: Any) -> xarray.Dataset:
    """The arrays that are needed, of those with these names; others are not opened."""
    import xarray

    arrays = {name.rpartition("/")[2] for name in names}
    others = [x for x in arrays - NEEDED - mcd43.NEEDED if not x.startswith(tuple(mcd43.PREFIXES))]
    options |= {"drop_variables": others, **AS_STORED}
    try:
        with xarray.open_dataset(path, engine="h5netcdf", **options) as ds:
            if "group" not in options:
                if "gonio_schema" not in ds.attrs:  # `of_file` refuses it without its numbers
                    return ds
                _refuse_nameless(ds, path)
            return ds.load()
    except FormatError:
        raise
    except Exception as error:  # h5py, h5netcdf and xarray raise any of damaged files
        raise FormatError(f"{path}: netCDF file that is damaged or not laid out as such: {error}") from None


def _refuse_nameless(ds: xarray.Dataset, path: Path) -> None:
    """FormatError where an array has a dimension without a name: one array without any makes others lose theirs."""
    for name, variable in ds.variables.items():
        if any(str(dim).startswith("phony_dim_") for dim in variable.dims):
            rule = "expected those of docs/data-model.md; remove what was added without dimensions, or give it some"
            raise FormatError(f"{path}: {name} has a dimension without a name, {rule}")
