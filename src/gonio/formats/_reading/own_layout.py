"""gonio's own layout in netCDF and Zarr: encoding, options of opening, names of the arrays that are read."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from ...base.reflectance import Reflectance
from ...errors import FormatError
from ...tables.angle_systems import SYSTEMS
from ...tables.dataset import to_dataset
from ...tables.dataset_layout import ANGLES, ROW
from .._options import Declared

if TYPE_CHECKING:
    import xarray

Found = TypeVar("Found")

Parameterisation = Annotated[
    str, Declared("angles of the grid that a material without a grid is put on", words=SYSTEMS)
]
Resolution = Annotated[
    Sequence[int] | None,
    Declared("nodes along each axis of the grid; without it a measurement keeps its own", 2, lengths=(3, 4)),
]

AS_STORED: dict[str, Any] = {"decode_times": False, "decode_coords": False}
"""Options of xarray with which a file is opened."""

NEEDED = frozenset({"values", "valid", "uncertainty", "wavelength", "channel", ROW, *ANGLES})
"""Names of the arrays that are read. What others would unpack to is nobody's business."""


def encoded(
    m: Reflectance, parameterisation: str, resolution: Sequence[int] | None
) -> tuple[xarray.Dataset, dict[Any, dict[str, Any]]]:
    """The dataset to write, see `to_dataset`, and its encodings: NaN is kept as such, no other number stands for it."""
    ds = to_dataset(m, parameterisation, resolution)
    return ds, {name: {"_FillValue": None} for name in ds.variables if ds[name].dtype.kind == "f"}


def steady(path: Path, read: Callable[[], Found]) -> Found:
    """The result of a function that reads a file or folder; where that is replaced meanwhile, it is read again.

    Raises what `read` does; FormatError where it is replaced all the time.
    """
    for attempt in range(100):
        opened = os.open(path, os.O_RDONLY)  # as long as it is open, no other has its number
        try:
            try:
                found = read()
            except Exception:
                if _is_still(opened, path):
                    raise
            else:
                if _is_still(opened, path):
                    return found
        finally:
            os.close(opened)
        time.sleep(1e-4 * attempt)
    raise FormatError(f"{path}: is replaced by others all the time; read it when they are done")


def _is_still(opened: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(opened), os.stat(path))
    except FileNotFoundError:
        return False
