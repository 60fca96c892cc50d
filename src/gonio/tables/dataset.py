"""Measurements as `xarray.Dataset`s and back, without loss, in the layout of docs/data-model.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.measured import Measured, tabular_shape, tristimulus
from ..base.provenance import ORIGIN, derived, origin
from ..base.reflectance import Reflectance
from ..base.reradiation import warn_of_reradiation
from ..declared.arguments import checked
from ..errors import FormatError, ParameterError, held_by, shown
from ..formula import tree
from ..formula.fields import Ours
from . import dataset_layout
from .angle_systems import angle_system
from .axes import nodes_of
from .dataset_layout import NANOMETRES, RADIANS, ROW, from_text
from .gridded import Gridded
from .nodes import channels_named, f_at, needed
from .rows import ROW_ANGLES
from .scattered import Scattered

if TYPE_CHECKING:
    import xarray


@checked
def to_dataset(
    m: Reflectance, parameterization: str = "half_difference", resolution: Sequence[int] | None = None
) -> xarray.Dataset:
    """A reflectance as a dataset in gonio's layout; see docs/data-model.md.

    Measurements on a grid (MERL too) or in rows stay as they are, with uncertainty, validity and metadata. Other
    reflectances, and any if a `resolution` is given (nodes along each axis), are evaluated on a grid of the
    `parameterization`, by default with no more nodes than f needs: two along an axis that it does not depend on. Pairs
    below the horizon have no value. The dataset names the file that a measurement was read from, with its SHA-256. Of
    fluorescence it holds f alone, and a FluorescenceWarning says so.

    Raises ParameterError for a material with a delta lobe or with maps.

    Example
    >>> ds = gn.tables.to_dataset(gn.Lambertian(0.5), resolution=(4, 4, 8))
    >>> print(dict(ds.sizes))
    {'theta_h': 4, 'theta_d': 4, 'phi_d': 8}
    """
    warn_of_reradiation(m, "gn.save(m, 'm.json')")
    return dataset_of(m, parameterization, resolution)


def dataset_of(m: Reflectance, parameterization: str, resolution: Sequence[int] | None) -> xarray.Dataset:
    """`to_dataset`, of f alone."""
    table = m.as_grid() if isinstance(m, Measured) and resolution is None else None
    table = _on_grid(m, parameterization, resolution) if table is None else table
    return table.data.assign_attrs(provenance=dataset_layout.to_text(origin(m)))


@checked
def from_dataset(ds: xarray.Dataset, path: str = "") -> Gridded:
    """The measurement in a dataset in gonio's layout, made by `to_dataset` or by hand; see docs/data-model.md.

    Angles may be in degrees and wavelengths in um or m, by their `units`. Where `valid` is false there is no value.
    Raises FormatError, which names the missing or wrong variable or attribute.

    Example
    >>> ds = gn.tables.to_dataset(gn.Lambertian(0.5), resolution=(4, 4, 8))
    >>> print(gn.albedo(gn.tables.from_dataset(ds), [0, 0, 1]).round(4))
    0.4999
    """
    if not hasattr(type(ds), "data_vars"):
        raise ParameterError(
            f"from_dataset(ds={shown(ds)}): expected an xarray.Dataset, such as gn.tables.to_dataset(m) makes"
        )
    return _measurement(ds, path, copied=True)


def of_file(ds: xarray.Dataset, path: str) -> Gridded:
    """`from_dataset` of a dataset that a reader has just made: its arrays are not copied."""
    return _measurement(ds, path, copied=False)


def _measurement(ds: xarray.Dataset, path: str, copied: bool) -> Gridded:
    where = path or "dataset"
    version = str(ds.attrs.get("gonio_schema", ""))
    if not version:
        raise FormatError(
            f"{where}: has no attribute gonio_schema, expected {dataset_layout.VERSION!r}; docs/data-model.md says "
            f"what to add"
        )
    if version.partition(".")[0] != dataset_layout.VERSION.partition(".")[0]:
        raise FormatError(f"{where}: gonio_schema is {version!r}, expected {dataset_layout.VERSION!r}; update gonio")
    if "values" not in ds:
        raise FormatError(f"{where}: has no variable values; its variables: {', '.join(map(str, ds))}")
    with held_by(where):
        return _scattered(ds, path, where) if ROW in ds["values"].dims else _gridded(ds, path, where, copied)


def _gridded(ds: xarray.Dataset, path: str, where: str, copied: bool) -> Gridded:
    name = _text(ds, "parameterization", where)
    dims = [d for d in ds["values"].dims if d not in ("wavelength", "channel")]
    axes = angle_system(name).axes(len(dims) > 3)
    if set(dims) != set(axes):
        raise FormatError(f"{where}: values has dimensions {', '.join(map(str, dims))}, expected {', '.join(axes)}")
    values, u = _masked(ds, axes), _variable(ds, "uncertainty", axes)
    return Gridded(
        name,
        {axis: _scaled(ds, axis, RADIANS, where) for axis in axes},
        values if copied else Ours(values),
        uncertainty=u if copied or u is None else Ours(u),
        mirrored=bool(_flag(ds, "mirrored", where)),
        periods=_periods(ds, where),
        interpolation=_text(ds, "interpolation", where, "linear"),
        **_common(ds, path, where),
    )


def _scattered(ds: xarray.Dataset, path: str, where: str) -> Scattered:
    angles: dict[str, Any] = {angle: _scaled(ds, angle, RADIANS, where) for angle in ROW_ANGLES}
    return Scattered(
        **angles,
        values=_masked(ds, (ROW,)),
        uncertainty=_variable(ds, "uncertainty", (ROW,)),
        isotropic=_flag(ds, "isotropic", where),
        **_common(ds, path, where),
    )


def _common(ds: xarray.Dataset, path: str, where: str) -> dict[str, Any]:
    """The arguments that `Gridded` and `Scattered` share."""
    about = from_text(_text(ds, "about", where), where) if "about" in ds.attrs else {}
    if not isinstance(about, dict):
        raise FormatError(f"{where}: the attribute about is {about!r:.40}, expected a JSON object")
    if "provenance" in ds.attrs and (source := from_text(_text(ds, "provenance", where), where)):
        about[ORIGIN] = source
    return {
        "quantity": _text(ds, "quantity", where),
        "channels": _channel_names(ds, where),
        "outside": _text(ds, "outside", where, "hold"),
        "path": path,
        "about": about,
    }


def _channel_names(ds: xarray.Dataset, where: str) -> list[str | float] | None:
    dims = ds["values"].dims
    if "wavelength" in dims:
        return list(map(float, _scaled(ds, "wavelength", NANOMETRES, where)))
    return list(map(str, _coordinate(ds, "channel", where).values)) if "channel" in dims else None


def _coordinate(ds: xarray.Dataset, name: str, where: str) -> xarray.DataArray:
    if name not in ds.variables or ds[name].ndim != 1:
        raise FormatError(f"{where}: has no coordinate {name} with one dimension, expected one")
    return ds[name]


def _scaled(ds: xarray.Dataset, name: str, units: dict[str, float], where: str) -> np.ndarray:
    coordinate = _coordinate(ds, name, where)
    unit = coordinate.attrs.get("units")
    factor = units.get(str(unit).strip())
    if factor is None or coordinate.dtype.kind not in "iuf":
        raise FormatError(
            f"{where}: {name} holds {coordinate.dtype} in units {unit!r}, expected numbers in one of {', '.join(units)}"
        )
    values = coordinate.values.astype(float)
    return values if factor == 1.0 else values * factor


def _variable(ds: xarray.Dataset, name: str, axes: Sequence[str]) -> np.ndarray | None:
    """A variable with dimensions in the order of `axes`, channels last; None if the dataset has no such variable."""
    if name not in ds:
        return None
    expected = [*axes, *(d for d in ("wavelength", "channel") if d in ds["values"].dims)]
    if set(ds[name].dims) != set(expected):
        raise ParameterError(f"{name} has dimensions {ds[name].dims}, expected {', '.join(expected)}")
    values = ds[name].transpose(*expected).values
    if values.dtype.kind not in "iufb":
        raise ParameterError(f"{name} holds {values.dtype}, expected numbers")
    return values


def _masked(ds: xarray.Dataset, axes: Sequence[str]) -> np.ndarray:
    """The values, NaN where `valid` is false."""
    values, valid = _variable(ds, "values", axes), _variable(ds, "valid", axes)
    assert values is not None
    if values.dtype.kind != "f":
        values = values.astype(float)
    if valid is None or not (hidden := ~valid.astype(bool) & np.isfinite(values)).any():
        return values
    return np.where(hidden, values.dtype.type(np.nan), values)


def _periods(ds: xarray.Dataset, where: str) -> dict[str, float]:
    periods = from_text(_text(ds, "periods", where, "{}"), where)
    if not isinstance(periods, dict) or not all(type(x) in (int, float) and abs(x) < 1e9 for x in periods.values()):
        raise FormatError(f"{where}: the attribute periods is {periods!r:.60}, expected names of azimuths and radians")
    return periods


def _flag(ds: xarray.Dataset, name: str, where: str) -> bool | None:
    value = np.asarray(ds.attrs.get(name, 0))
    if value.size != 1 or value.dtype.kind not in "iufb" or value not in (0, 1):
        raise FormatError(f"{where}: the attribute {name} is {ds.attrs[name]!r:.40}, expected 0 or 1")
    return bool(value) if name in ds.attrs else None


def _text(ds: xarray.Dataset, name: str, where: str, default: str | None = None) -> str:
    value = ds.attrs.get(name, default)
    if not isinstance(value, str):
        raise FormatError(f"{where}: the attribute {name} is {value!r:.40}, expected text")
    return value


def _on_grid(m: Reflectance, parameterization: str, resolution: Sequence[int] | None = None) -> Gridded:
    """f of any reflectance on a grid of angles; NaN at pairs below the horizon."""
    tabular_shape(m)
    system = angle_system(parameterization)
    axes = nodes_of(system, not m.is_isotropic(), resolution, system.coarse)
    if resolution is None:
        axes = needed(m, system, axes)
    names, values = tristimulus(m.channel_names, f_at(m, *system.directions(axes)))
    channels = (names or channels_named(values.shape[-1])) if values.ndim > len(axes) else None
    table = Gridded(parameterization, axes, values, channels=channels, about={"made_of": repr(m)})
    return tree.with_notes(table, provenance=derived(m))
