"""What netCDF and Zarr in gonio's own layout share: how they are encoded and opened."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..dataset import to_dataset
from ..interface import Reflectance

if TYPE_CHECKING:
    import xarray

AS_STORED: dict[str, Any] = {"decode_times": False, "decode_coords": False}
"""Options of xarray with which a file is opened."""


def encoded(
    m: Reflectance, parameterisation: str, resolution: Sequence[int] | None
) -> tuple[xarray.Dataset, dict[Any, dict[str, Any]]]:
    """The dataset to write, see `to_dataset`, and its encodings: NaN is kept as such, no other number stands for it."""
    ds = to_dataset(m, parameterisation, resolution)
    return ds, {name: {"_FillValue": None} for name in ds.variables if ds[name].dtype.kind == "f"}
