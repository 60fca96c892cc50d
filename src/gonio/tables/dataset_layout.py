"""gonio's layout of measurements as `xarray.Dataset`s: names of variables and attributes, as in docs/data-model.md.

Nothing here knows the classes of measurements; `dataset` does.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FormatError, ParameterError
from .angle_systems import ANGLES

if TYPE_CHECKING:
    import xarray

VERSION = "1.0"
"""Version of the layout; its first number changes when older readers would misunderstand a file."""

ROW = "measurement"
"""Dimension of measurements in no grid."""

RADIANS = {"rad": 1.0, "radian": 1.0, "radians": 1.0, "degree": np.pi / 180.0, "degrees": np.pi / 180.0}
NANOMETRES = {"nm": 1.0, "um": 1e3, "µm": 1e3, "m": 1e9}


def dataset(
    axes: Mapping[str, np.ndarray],
    dims: Sequence[str],
    values: np.ndarray,
    uncertainty: np.ndarray | None,
    channels: Sequence[str | float] | None,
    **attributes: Any,
) -> xarray.Dataset:
    """A dataset of values (dims..., C); `axes` are coordinates [rad] along `dims`; empty provenance is left out."""
    import xarray

    along = dims if len(dims) == len(axes) else [dims[0]] * len(axes)
    coordinates: dict[str, Any] = {
        name: (dim, x, {"units": "rad", "long_name": ANGLES[name].meaning})
        for (name, x), dim in zip(axes.items(), along, strict=True)
    }
    dims = list(dims)
    if channels is not None:
        name, nodes, about = _channels(channels)
        dims.append(name)
        coordinates[name] = (name, nodes, about)
    units = {"units": "1" if attributes["quantity"] == "reflectance factor" else "sr-1"}
    beside = "valid" if uncertainty is None else "uncertainty valid"
    variables: dict[str, Any] = {
        "values": (dims, values, {**units, "long_name": attributes["quantity"], "ancillary_variables": beside}),
        "valid": (dims, np.isfinite(values), {"long_name": "whether there is a value"}),
    }
    if uncertainty is not None:
        variables["uncertainty"] = (dims, uncertainty, {**units, "long_name": "standard uncertainty of values"})
    texts = {name: _attribute(value) for name, value in attributes.items() if value or name != "provenance"}
    return xarray.Dataset(variables, coordinates, {"Conventions": "CF-1.11", "gonio_schema": VERSION, **texts})


def _channels(channels: Sequence[str | float]) -> tuple[str, np.ndarray, dict[str, str]]:
    """The coordinate along the channels: its name, wavelengths [nm] or names, and its attributes."""
    if all(isinstance(x, str) for x in channels):
        return "channel", np.array(channels, str), {"long_name": "channel"}
    if any(isinstance(x, str) for x in channels):
        raise ParameterError(f"channels {list(channels)!r:.80}: expected names alone, or wavelengths [nm] alone")
    about = {"units": "nm", "standard_name": "radiation_wavelength", "long_name": "wavelength in a vacuum"}
    return "wavelength", np.array(channels, float), about


def _attribute(value: Any) -> Any:
    """Text and numbers as netCDF and Zarr hold them; anything else as JSON."""
    if isinstance(value, bool):
        return int(value)
    return value if isinstance(value, (str, int, float)) else to_text(value)


def to_text(value: Any) -> str:
    """JSON from which `from_text` makes an equal value: with tuples, bytes, arrays, and keys of any kind."""
    return json.dumps(_tagged(value), ensure_ascii=False)


def from_text(text: str, where: str) -> Any:
    """The value that `to_text` wrote. Raises FormatError for another text."""
    try:
        return _untagged(json.loads(text))
    except (ValueError, TypeError, KeyError, RecursionError, AttributeError) as error:
        raise FormatError(f"{where}: {text[:40]!r} is not JSON as gonio writes it: {error}") from None


TAG = "gonio:"


def _tagged(value: Any) -> Any:
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, np.generic):
        return {f"{TAG}number": [str(value.dtype), _tagged(value.item())]}
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufU":
        return {f"{TAG}array": [str(value.dtype), list(value.shape), value.reshape(-1).tolist()]}
    if isinstance(value, bytes):
        return {f"{TAG}bytes": base64.b64encode(value).decode("ascii")}
    if isinstance(value, tuple):
        return {f"{TAG}tuple": [_tagged(x) for x in value]}
    if isinstance(value, list):
        return [_tagged(x) for x in value]
    if isinstance(value, Mapping):
        if all(isinstance(k, str) and not k.startswith(TAG) for k in value):
            return {k: _tagged(v) for k, v in value.items()}
        return {f"{TAG}items": [[_tagged(k), _tagged(v)] for k, v in value.items()]}
    raise ParameterError(
        f"{value!r:.60}: cannot be kept as metadata of a measurement; expected numbers, text, arrays, and lists and "
        f"dictionaries of them"
    )


def _untagged(value: Any) -> Any:
    if isinstance(value, list):
        return [_untagged(x) for x in value]
    if not isinstance(value, dict):
        return value
    items: list[Any] = [*value.items()]
    if len(items) != 1 or not items[0][0].startswith(TAG):
        return {k: _untagged(v) for k, v in items}
    kind, data = items[0][0].removeprefix(TAG), items[0][1]
    if kind == "number":
        return _dtype(data[0]).type(data[1])
    if kind == "array":
        return np.array(data[2], _dtype(data[0])).reshape(data[1])
    if kind == "bytes":
        return base64.b64decode(data, validate=True)
    if kind == "tuple":
        return tuple(_untagged(x) for x in data)
    if kind == "items":
        return {_untagged(k): _untagged(v) for k, v in data}
    raise ValueError(f"unknown kind {kind!r}")


def _dtype(name: str) -> np.dtype:
    dtype = np.dtype(name)
    if dtype.kind not in "biufU" or dtype.itemsize > 4096:
        raise ValueError(f"unknown dtype {name!r}")
    return dtype
