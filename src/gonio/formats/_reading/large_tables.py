"""Large binary tables, read whole: a mapped file that is cut short later kills the program (SIGBUS)."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...base.measured import Measured, tabular_shape
from ...base.quantities import quantity_named
from ...base.reflectance import Reflectance
from ...errors import FormatError, ParameterError
from ...files import replacing
from ...formula.fields import Ours
from ...tables.gridded import Gridded

LARGE = 1 << 26
"""Size from which a table is not searched for holes: it may have some."""


def numbers(file: BinaryIO, path: Path, dtype: str, shape: tuple[int, ...], offset: int = 0) -> np.ndarray:
    """The numbers of an open file from a byte on, read-only. Raises FormatError if there are too few."""
    count = math.prod(shape)
    file.seek(offset)
    table = np.fromfile(file, dtype, count)
    if len(table) < count:
        expected = offset + count * table.itemsize
        raise FormatError(f"{path}: cut short: {offset + table.nbytes} bytes, expected {expected}; fetch it again")
    table.flags.writeable = False
    return table.reshape(shape)


def write(path: str | os.PathLike, *arrays: np.ndarray) -> None:
    """Write the bytes of arrays, one after the other; a failed write leaves an existing file as it was."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        for array in arrays:
            array.tofile(file)


def expect_channels(m: Reflectance, format: str) -> int:
    """The number of channels of m, 1 or 3. Raises ParameterError for a material that no table of RGB can hold."""
    shape = tabular_shape(m)
    if shape not in ((), (1,), (3,)):
        raise ParameterError(f"{m!r:.80}: has {shape[0]} channels, expected 1 or 3 in {format} files; choose some")
    return shape[0] if shape else 1


class Unscanned(Gridded):
    """A grid whose numbers are not looked at before f is asked for; its subclasses own the memory of `stored`."""

    def __init__(
        self,
        parameterization: str,
        axes: Mapping[str, Any],
        stored: np.ndarray,
        channels: Sequence[str | float],
        **notes: Any,
    ):
        """`notes`: path and about."""
        self._lay_out(parameterization, axes, False, {}, tuple(channels))
        self._hold(uncertainty=None, quantity=quantity_named("brdf"), holes=True)
        Measured.__init__(self, **notes, stored=Ours(stored), channel=len(channels))
