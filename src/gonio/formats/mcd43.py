"""MODIS' albedo product MCD43A1: weights of the Ross-Thick and Li-Sparse-Reciprocal kernels, by band, day and pixel.

Variables BRDF_Albedo_Parameters_<band> (time, y, x, parameter), or without time, hold the parameters iso, vol, geo in
this order: stored numbers times their `scale_factor` (0.001), `_FillValue` (32767, NaN) is no data. Two containers are
read: HDF4-EOS, NASA's tiles of 2400 x 2400 pixels, with pyhdf (`pip install 'gonio[hdf4]'`), and netCDF-4 or HDF5 of
AppEEARS and h4toh5, all in one group.
Checked against a real netCDF file (LP DAAC's AppEEARS, one pixel, 365 days); HDF4 and groups on own files only, with
the names, numbers and attributes of that file: no tile and no description of one was at hand.
"""

from __future__ import annotations

import importlib.util
import json
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from ..arrays import frozen, ops
from ..base.measured import Measured
from ..errors import DependencyError, FormatError, ParameterError
from ..formula.state import note
from ..models.ross_li import RossLi
from ._options import Declared
from ._reading import hdf

if TYPE_CHECKING:
    import xarray

NAME = "MCD43A1"
SUFFIXES = (".hdf",)
DESCRIPTION = "MODIS' Ross-Li kernel weights: HDF4 (needs pyhdf), netCDF-4"
ORACLE = "real file (AppEEARS)"

HDF4 = b"\x0e\x03\x13\x01"
PREFIX = "BRDF_Albedo_Parameters_"
QUALITY = "BRDF_Albedo_Band_Mandatory_Quality_"
BANDS = {f"Band{k}": nm for k, nm in enumerate((645.0, 858.5, 469.0, 555.0, 1240.0, 1640.0, 2130.0), start=1)}
"""MODIS' land bands -> centre wavelength [nm]; the others, vis, nir and shortwave, are broad."""
PREFIXES, NEEDED = [PREFIX, QUALITY], frozenset({"time"})
"""Beginnings of names, and names, of the arrays that are read."""
KERNELS = ("f_iso", "f_vol", "f_geo")

MOST = 1 << 25
"""Most numbers that are read by default: 268 MB in memory. A tile has five times as many."""


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is HDF4; `xarray_netcdf` recognises netCDF-4."""
    return head.startswith(HDF4)


def read(
    path: Path,
    rows: Annotated[tuple[int, int] | None, Declared("first row of pixels and last + 1, counted from 0", 0)] = None,
    columns: Annotated[tuple[int, int] | None, Declared("first column and last + 1, counted from 0", 0)] = None,
) -> MCD43:
    """The kernel weights of a tile, or of some of its pixels: all by default, if they take at most 268 MB.

    Raises DependencyError without pyhdf, FormatError for a damaged file or another product, ParameterError for pixels
    that the file has not, and where `rows` and `columns` are needed to choose among too many.
    """
    import xarray

    if importlib.util.find_spec("pyhdf") is None:
        raise DependencyError(
            f"{path}: HDF4 is read with pyhdf; install it: pip install 'gonio[hdf4]'; or order the product as netCDF-4 "
            f"from AppEEARS, or convert it: `h4tonccf_nc4 old.hdf new.nc` (hdfeos.org), `h4toh5 old.hdf new.h5`"
        )
    window = [rows, columns]
    most = MOST if None in window else sys.maxsize
    asked = {"prefixes": PREFIXES, "window": window, "most": most}
    with tempfile.TemporaryDirectory() as folder:
        report = hdf.inspected("hdf4", path, folder, json.dumps(asked))
        shape = next((shape for name, shape in report["shapes"].items() if name.startswith(PREFIX)), None)
        if shape is None:
            raise FormatError(f"{path}: HDF4 without {PREFIX}*, expected MODIS' product MCD43A1, the only one in HDF4")
        if not report["arrays"]:
            size = f"{path}: holds {shape[0]} rows and {shape[1]} columns of pixels"
            if report["count"] > most:
                choice = "say which are wanted: rows=(start, end), columns=(start, end)"
                raise ParameterError(f"{size}, {8e-6 * report['count']:.0f} MB of weights; {choice}")
            raise ParameterError(f"{size}; got rows={rows!r:.40}, columns={columns!r:.40}, expected some of these")
        variables = {}
        for number, (name, attributes) in enumerate(report["arrays"].items()):
            values = _scaled(np.load(Path(folder) / f"{number}.npy"), attributes, name, path)
            if values.ndim in (2, 3):
                variables[name] = (("time", "y", "x", "kernel")[: values.ndim + 1], values[None])
    try:
        ds = xarray.Dataset(variables, attrs=report["attributes"])
    except ValueError as error:
        raise FormatError(f"{path}: bands that do not lie on the same pixels: {error}") from None
    return read_dataset(ds, str(path))


def _scaled(stored: np.ndarray, attributes: dict[str, Any], name: str, path: Path) -> np.ndarray:
    """Weights of stored numbers by HDF4's rule, scale_factor (stored - add_offset); flags as they are."""
    if not name.startswith(PREFIX):
        return stored
    usual = {"scale_factor": 0.001, "add_offset": 0.0, "_FillValue": 32767}
    scale, offset, fill = (attributes.get(key, value) for key, value in usual.items())
    if not all(isinstance(x, (int, float)) for x in (scale, offset, fill)) or stored.dtype.kind not in "iuf":
        raise FormatError(f"{path}: {name} has attributes {attributes!r:.80} and {stored.dtype}, expected numbers")
    return np.where(stored == fill, np.nan, scale * (stored - offset))


def group(names: Iterable[str]) -> str | None:
    """The group of this product in a file with datasets of these names, "" for its root; None without the product."""
    paths = (name.rpartition("/") for name in names)
    return next((folder for folder, _, name in paths if name.startswith(PREFIX)), None)


def read_dataset(ds: xarray.Dataset, path: str, time: int | None = None) -> MCD43:
    """The kernel weights of one day: that with the number `time`, or the first with data in every band.

    One pixel has channels alone; several are maps (y, x). Raises FormatError where variables do not fit, ParameterError
    where there is no such day.
    """
    weights, bands = _weights(ds, path)
    if time is None:
        valid = np.isfinite(weights).all(axis=-2)  # time, y, x, band
        whole, some = valid.all(axis=-1).any(axis=(1, 2)), valid.any(axis=(1, 2, 3))
        if not some.any():
            raise FormatError(f"{path}: holds no weights, only missing values; choose another pixel or period")
        time = int(np.argmax(whole if whole.any() else some))
    if not -len(weights) <= time < len(weights):
        raise ParameterError(f"time={time}: {path} holds {len(weights)} days, expected 0 to {len(weights) - 1}")
    flags = {band: ds[QUALITY + band].values for band in bands if QUALITY + band in ds}
    about = {**{k: str(v) for k, v in ds.attrs.items()}, "time": time, "days": len(weights)}
    if "time" in ds.variables and (dates := ds["time"].values.ravel()).dtype.kind in "iuf" and len(dates) > time:
        about["date"] = f"{dates[time]:g} {ds['time'].attrs.get('units', '')}".strip()
    if quality := {b: np.squeeze(q[time]).tolist() for b, q in flags.items() if q.shape[:1] == weights.shape[:1]}:
        about["quality"] = quality
    try:
        return MCD43(weights, bands, time, path, about)
    except ParameterError as error:
        raise FormatError(f"{path}: {error}") from None


def _weights(ds: xarray.Dataset, path: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """Weights (time, y, x, kernel, band), NaN where there are none, and the names of the bands."""
    bands = {str(name).removeprefix(PREFIX): ds[name] for name in ds.data_vars if str(name).startswith(PREFIX)}
    shapes = {band: v.shape for band, v in bands.items()}
    if len(set(shapes.values())) != 1:
        raise FormatError(f"{path}: bands have shapes {shapes}, expected the same for all")
    if kinds := {str(v.dtype) for v in bands.values() if v.dtype.kind not in "iuf"}:
        raise FormatError(f"{path}: {PREFIX}* hold {', '.join(kinds)}, expected numbers")
    shape = next(iter(shapes.values()))
    if len(shape) not in (3, 4) or shape[-1] != len(KERNELS) or 0 in shape:
        raise FormatError(f"{path}: {PREFIX}* has shape {shape}, expected ([time,] y, x, 3)")
    values = np.stack([np.asarray(v.values, np.float64) for v in bands.values()], axis=-1)
    if (largest := np.nanmax(np.abs(values), initial=0.0)) > 32.0:
        missing = "the variables lack their scale_factor (0.001) or _FillValue (32767): add them"
        raise FormatError(f"{path}: weights reach {largest:g}, expected at most 32.766; {missing}")
    return values.reshape(-1, *values.shape[-4:]), tuple(bands)


class MCD43(RossLi, Measured):
    """A surface as MODIS saw it: the Ross-Li model with the weights of one day, a channel for each band.

    The parameters f_iso, f_vol, f_geo are those of the day `time`; NaN, and so f, where there was no retrieval. The
    broad bands vis, nir and shortwave overlap the others: channels are names then, and wavelengths [nm] if only bands
    1 to 7 are in the file.

    Shapes   weights: (time, y, x, 3, bands). f: (..., bands), and maps (y, x, bands) of several pixels.
    Units    f: 1/sr; weights: 1 (of reflectance factors).
    Error    of the product: see its quality flags, in `about`. Stored in steps of 0.001.
    Source   Schaaf et al. 2002, "First operational BRDF, albedo nadir reflectance products from MODIS", Remote Sens.
             Environ. 83:135; kernels: see `RossLi`.
    """

    format = NAME
    quantity = "weights of the kernels of reflectance factors"

    weights: np.ndarray = note()
    """Of all days in the file."""
    bands: tuple[str, ...] = note()
    time: int = note()

    def __init__(self, weights: Any, bands: tuple[str, ...], time: int, path: str = "", about: Any = None):
        weights = frozen(np.array(ops.numbers(weights), np.float64))
        spectral = all(band in BANDS for band in bands)
        names = tuple(BANDS[band] for band in bands) if spectral else bands
        day = weights[time]  # y, x, kernel, band
        day = day[0, 0] if day.shape[:2] == (1, 1) else np.moveaxis(day, 2, 0)
        parameters = dict(zip(KERNELS, day, strict=True))
        self._hold(weights=weights, bands=bands, time=time, channel_names=names)
        super().__init__(path, about, **{name: np.nan_to_num(values) for name, values in parameters.items()})
        for name, values in parameters.items():
            if np.isnan(values).any():
                self._hold(**{name: frozen(values.copy())})

    def on(self, time: int) -> MCD43:
        """The surface on another day of the file."""
        if not 0 <= time < len(self.weights):
            raise ParameterError(f"on({time}): the file holds {len(self.weights)} days, counted from 0")
        return MCD43(self.weights, self.bands, time, self.path, {**self.about, "time": time})

    @property
    def values(self) -> np.ndarray:
        """The weights of all days."""
        return self.weights

    @property
    def valid(self) -> np.ndarray:
        """True where the file holds weights; shape of `weights`."""
        return np.isfinite(self.weights)

    @property
    def data(self) -> xarray.Dataset:
        """Variable `weights` (time, y, x, kernel, band), of all days."""
        import xarray

        dims = ("time", "y", "x", "kernel", "band")
        variables = {"weights": (dims, self.weights, {"units": "1", "long_name": self.quantity})}
        axes = {"kernel": ("kernel", list(KERNELS)), "band": ("band", list(self.bands))}
        return xarray.Dataset(variables, axes, {"quantity": self.quantity, "source": self.path})
