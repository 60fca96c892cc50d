"""gonio's own layout in netCDF and Zarr: encoding, options of opening, names of the arrays that are read."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from ...base.reflectance import Reflectance
from ...declared.arguments import Declared
from ...errors import FormatError
from ...tables.angle_systems import SYSTEMS
from ...tables.dataset import dataset_of
from ...tables.dataset_layout import ANGLES, ROW

if TYPE_CHECKING:
    import xarray

Content = TypeVar("Content")

Parameterization = Annotated[
    str, Declared("angles of the grid that a material without a grid is put on", words=(*SYSTEMS,))
]
Resolution = Annotated[
    Sequence[int] | None,
    Declared("nodes along each axis of the grid; without it a measurement keeps its own", 2, lengths=(3, 4)),
]

AS_STORED: dict[str, Any] = {"decode_times": False, "decode_coords": False}
"""Options of xarray for opening a file."""

NEEDED = frozenset({"values", "valid", "uncertainty", "wavelength", "channel", ROW, *ANGLES})
"""Names of the arrays that are read; others are never unpacked."""


def encoded(
    m: Reflectance, parameterization: str, resolution: Sequence[int] | None
) -> tuple[xarray.Dataset, dict[Any, dict[str, Any]]]:
    """The dataset to write, see `to_dataset`, and its encodings: NaN stays NaN, no other number stands for it."""
    ds = dataset_of(m, parameterization, resolution)
    return ds, {name: {"_FillValue": None} for name in ds.variables if ds[name].dtype.kind == "f"}


def steady(path: Path, read: Callable[[], Content]) -> Content:
    """The result of `read`, which reads a file or folder, again if that is replaced meanwhile.

    Raises the errors of `read`, and FormatError where the file is replaced all the time.
    """
    for attempt in range(100):
        descriptor = os.open(path, os.O_RDONLY)  # as long as it is open, no other file has its number
        try:
            content = read()
            if _is_same(descriptor, path):
                return content
        except Exception:
            if _is_same(descriptor, path):
                raise
        finally:
            os.close(descriptor)
        time.sleep(1e-4 * attempt)
    raise FormatError(f"{path}: is replaced by others all the time; read it when they are done")


def _is_same(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except FileNotFoundError:
        return False
