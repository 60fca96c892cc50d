"""MODIS' albedo product MCD43A1: weights of the Ross-Thick and Li-Sparse-Reciprocal kernels, by band, day and pixel.

Variables BRDF_Albedo_Parameters_<band> (time, y, x, parameter), or without time, hold the parameters iso, vol, geo in
this order: stored numbers times their `scale_factor` (0.001), `_FillValue` (32767, NaN) is no data. Flags
BRDF_Albedo_Band_Mandatory_Quality_<band> (time, y, x) are 0 for a full inversion, 1 for a magnitude inversion, which
scales an older shape; whether there was snow stands in another product, MCD43A2. Two containers are
read: HDF4-EOS, NASA's tiles of 2400 x 2400 pixels, with pyhdf (`pip install 'gonio[hdf4]'`), and netCDF-4 or HDF5 of
AppEEARS and h4toh5, all in one group.
Checked against a real netCDF file (LP DAAC's AppEEARS, one pixel, 365 days); HDF4 and groups on own files only, with
the names, numbers and attributes of that file: no tile and no description of one was at hand.
"""

from __future__ import annotations

import datetime
import importlib.util
import json
import math
import re
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from ..arrays import frozen, ops
from ..base.measured import Measured
from ..declared.arguments import Declared
from ..errors import DependencyError, FormatError, MissingDataWarning, NotFoundError, ParameterError, held_by, warn
from ..formula import tree
from ..formula.state import Held, immutable, note
from ..formula.text import listed, shown
from ..models.ross_li import RossLi
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
BANDS = {
    "Band1": ("red", 645.0),
    "Band2": ("nir", 858.5),
    "Band3": ("blue", 469.0),
    "Band4": ("green", 555.0),
    "Band5": ("swir1240", 1240.0),
    "Band6": ("swir1640", 1640.0),
    "Band7": ("swir2130", 2130.0),
    "vis": ("vis", math.nan),
    "nir": ("broad_nir", math.nan),
    "shortwave": ("shortwave", math.nan),
}
"""Bands as the file names them -> the channel's name, and the centre wavelength [nm] of MODIS' land bands; the others
are broad: 300 to 700, 700 to 5000 and 300 to 5000 nm. "nir" is Band2, as beside red, though the file calls the broad
one so."""
NEAREST = 25.0
"""How far [nm] a band may be from the wavelength that is asked for."""
PREFIXES, NEEDED = [PREFIX, QUALITY], frozenset({"time", "y", "x"})
"""Beginnings of names, and names, of the arrays that are read."""
KERNELS = ("f_iso", "f_vol", "f_geo")

MOST = 1 << 25
"""Most numbers that are read by default: 268 MB in memory. A tile has five times as many."""


Day = Annotated[
    int | str | datetime.date | None,
    Declared(
        "day of an MCD43A1 file: its date, such as 2018-07-01, or its number, counted from 0; if not given the first "
        "with data in every band"
    ),
]
Band = Annotated[
    Sequence[float] | Sequence[str] | None,
    Declared(
        f"bands of an MCD43A1 file: {', '.join(name for name, _ in BANDS.values())}, Band1 to Band7, or wavelengths; "
        "all if not given",
        100.0,
        5000.0,
        "nm",
    ),
]
Quality = Annotated[
    str,
    Declared("weights of an MCD43A1 file that count: any, or those of full inversions alone", words=("any", "full")),
]


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is HDF4; `xarray_netcdf` recognizes netCDF-4."""
    return head.startswith(HDF4)


def read(
    path: Path,
    rows: Annotated[tuple[int, int] | None, Declared("first row of pixels and last + 1, counted from 0", 0)] = None,
    columns: Annotated[tuple[int, int] | None, Declared("first column and last + 1, counted from 0", 0)] = None,
    band: Band = None,
    quality: Quality = "any",
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
    return read_dataset(ds, str(path), None, band, quality)


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


def read_dataset(
    ds: xarray.Dataset,
    path: str,
    time: int | str | datetime.date | None = None,
    band: Sequence[float] | Sequence[str] | None = None,
    quality: str = "any",
) -> MCD43:
    """The kernel weights of one day: `time`, its date or number, or the first with data in every band.

    One pixel has channels alone; several are maps (y, x). Raises FormatError where variables do not fit, ParameterError
    where there is no such day, NotFoundError where there is no such band. A day without any weights is announced by a
    MissingDataWarning.
    """
    weights, bands = _weights(ds, path, quality)
    if band is not None:
        chosen = [_band(word, bands, path) for word in band]
        weights, bands = weights[..., chosen], tuple(bands[k] for k in chosen)
    days, asked = _days(ds, len(weights)), time
    if time is None:
        valid = np.isfinite(weights).all(axis=-2)  # time, y, x, band
        whole, some = valid.all(axis=-1).any(axis=(1, 2)), valid.any(axis=(1, 2, 3))
        if not some.any():
            raise FormatError(f"{path}: holds no weights, only missing values; choose another pixel or period")
        time = int(np.argmax(whole if whole.any() else some))
    time = _number(time, days, len(weights), path)
    if asked is not None and np.isnan(weights[time]).all():
        others = np.flatnonzero(np.isfinite(weights).any(axis=(1, 2, 3, 4)))
        nearest = others[np.abs(others - time).argmin()] if len(others) else None
        where = (
            "none has" if nearest is None else f"the nearest that has is {nearest if days is None else days[nearest]}"
        )
        what = " of full inversions" if quality == "full" else ""
        text = f"{path}: time={asked}: no weights{what} on this day, so that f is NaN; {where}"
        warn(text, MissingDataWarning)
    flags = {BANDS.get(band, (band,))[0]: ds[QUALITY + band].values for band in bands if QUALITY + band in ds}
    about = {**{k: str(v) for k, v in ds.attrs.items()}, "days": len(weights)}
    if flags := {b: np.squeeze(q[time]).tolist() for b, q in flags.items() if q.shape[:1] == weights.shape[:1]}:
        about["quality"] = flags
    places = {d: ds[d].values for d in ("y", "x") if d in ds.variables and ds[d].dims == (d,)}
    places = {d: x for d, x in places.items() if x.dtype.kind in "iuf" and len(x) == weights.shape[1 + "yx".index(d)]}
    with held_by(path):
        return MCD43(Days(weights, bands, days, places), time, path=path, about=about)


def _band(wanted: float | str, bands: tuple[str, ...], path: str) -> int:
    """The number of the band that is called so, by its own name or as the file names it, or is nearest."""
    names = [BANDS.get(band, (band, math.nan)) for band in bands]
    if isinstance(wanted, str):
        for k, (band, (name, _)) in enumerate(zip(bands, names, strict=True)):
            if wanted.lower() in {name.lower(), band.lower()} - ({"nir"} if band == "nir" else set()):
                return k
    else:
        distances = np.nan_to_num(np.abs(np.array([nm for _, nm in names]) - wanted), nan=np.inf)
        if distances.min() <= NEAREST:
            return int(distances.argmin())
    expected = ", ".join(
        name if math.isnan(nm) else f"{name} ({band}, {nm:g} nm)" for band, (name, nm) in zip(bands, names, strict=True)
    )
    raise NotFoundError(f"{path}: band={shown(wanted)}: no such band; it holds {expected:.500}")


def _days(ds: xarray.Dataset, count: int) -> np.ndarray | None:
    """The dates of so many days; None where the file does not say them."""
    if "time" not in ds.variables:
        return None
    numbers, units = ds["time"].values.ravel(), str(ds["time"].attrs.get("units", ""))
    since = re.match(r"days since (\d{4}-\d{2}-\d{2})", units)
    if since is None or len(numbers) != count or numbers.dtype.kind not in "iuf":
        return None
    if not (np.isfinite(numbers).all() and (np.abs(numbers) < 1e6).all()):
        return None
    try:  # in the Julian calendar, which AppEEARS names, dates a whole number of days apart have the same names
        return np.datetime64(since[1], "D") + np.floor(numbers).astype("timedelta64[D]")
    except ValueError:
        return None


def _number(time: int | str | datetime.date, days: np.ndarray | None, count: int, path: str) -> int:
    """The number of a day that is called by its date or its number."""
    held = f"{path} holds {count} days, numbered 0 to {count - 1}"
    if days is not None:
        held += f", {days[0]} to {days[-1]}"
    if isinstance(time, (int, np.integer)):
        if not -count <= time < count:
            raise ParameterError(f"time={time}: {held}")
        return int(time) % count
    text = str(time)[:10]
    if not re.fullmatch(r"\d{4}-\d{2}-\d{2}", text) or days is None:
        rule = (
            "a date such as 2018-07-01, or the number of a day"
            if days is not None
            else "the number of a day: it has no dates"
        )
        raise ParameterError(f"time={shown(str(time))}: expected {rule}; {held}")
    try:
        same = np.flatnonzero(days == np.datetime64(text, "D"))
    except ValueError as error:
        raise ParameterError(f"time={shown(str(time))}: {error}; {held}") from None
    if not len(same):
        raise ParameterError(f"time={text}: no such day; {held}")
    return int(same[0])


def _weights(ds: xarray.Dataset, path: str, quality: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """Weights (time, y, x, kernel, band), NaN where there are none of this quality, and the names of the bands."""
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
    if quality == "full":
        flags = {band: ds[QUALITY + band].values for band in bands if QUALITY + band in ds}
        if without := [
            b for b in bands if b not in flags or flags[b].shape != shape[:-1] or flags[b].dtype.kind not in "iuf"
        ]:
            raise FormatError(f"{path}: quality='full': no flags {QUALITY}* of {listed(without)}, expected one a pixel")
        full = np.stack([flags[band] == 0 for band in bands], axis=-1)
        values = np.where(full[..., None, :], values, np.nan)
    if (largest := np.nanmax(np.abs(values), initial=0.0)) > 32.0:
        missing = "the variables lack their scale_factor (0.001) or _FillValue (32767): add them"
        raise FormatError(f"{path}: weights reach {largest:g}, expected at most 32.766; {missing}")
    return values.reshape(-1, *values.shape[-4:]), tuple(bands)


class Days(NamedTuple):
    """What a file holds: weights (time, y, x, kernel, band), bands, dates, and coordinates of the pixels."""

    weights: Any
    bands: tuple[str, ...]
    dates: np.ndarray | None = None
    places: Any = None


class MCD43(RossLi, Measured):
    """A surface as MODIS saw it: the Ross-Li model with the weights of one day, a channel for each band.

    The parameters f_iso, f_vol, f_geo are those of the day `time`; NaN, and so f, where there was no retrieval.
    Channels have names, such as red, nir and shortwave; `wavelengths` are those of the bands that are not broad.

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
    """As the file names them."""
    wavelengths: tuple[float, ...] = note()
    """Centre wavelengths [nm] of the channels, NaN of broad ones."""
    time: int = note()
    """The number of the day."""
    days: np.ndarray | None = note(None)
    """The dates of all days (datetime64), where the file says them."""
    places: dict[str, Any] = note(Held())
    """Coordinates "y" and "x" of the pixels, where the file says them."""

    def __init__(self, held: Days, time: int, path: str = "", about: Any = None):
        bands, days = held.bands, held.dates
        weights = frozen(np.array(ops.numbers(held.weights), np.float64))
        names, wavelengths = zip(*(BANDS.get(band, (band, math.nan)) for band in bands), strict=True)
        about = {**dict(about or {}), "time": time} | ({} if days is None else {"date": str(days[time])})
        day = weights[time]  # y, x, kernel, band
        day = day[0, 0] if day.shape[:2] == (1, 1) else np.moveaxis(day, 2, 0)
        parameters = dict(zip(KERNELS, day, strict=True))
        self._hold(weights=weights, bands=bands, wavelengths=wavelengths, time=time, channel_names=names)
        self._hold(days=days, places=immutable(dict(held.places or {})))
        super().__init__(path, about, **{name: np.nan_to_num(values) for name, values in parameters.items()})
        for name, values in parameters.items():
            if np.isnan(values).any():
                self._hold(**{name: frozen(values.copy())})

    def on(self, time: int | str | datetime.date) -> MCD43:
        """The surface on another day of the file, called by its date or its number."""
        number = _number(time, self.days, len(self.weights), self.path or "the file")
        about = {name: x for name, x in self.about.items() if name != "quality"}  # the flags of the day that was read
        held = Days(self.weights, self.bands, self.days, self.places)
        new = MCD43(held, number, self.path, about)
        return tree.with_notes(new, provenance=self.provenance)

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
        axes: dict[str, Any] = {"kernel": list(KERNELS), "band": list(self.channel_names or ()), **self.places}
        axes |= {"wavelength": ("band", list(self.wavelengths), {"units": "nm"})}
        if self.days is not None:
            axes["time"] = self.days.astype("datetime64[ns]")
        return xarray.Dataset(variables, axes, {"quantity": self.quantity, "source": self.path})
