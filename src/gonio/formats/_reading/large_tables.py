"""Large binary tables, read whole: a mapped file that is cut short later ends the program without words (SIGBUS)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...base.measured import Measured, tabular_shape
from ...base.quantities import quantity_named
from ...base.reflectance import Reflectance
from ...errors import FormatError, ParameterError
from ...formula.fields import Ours
from ...tables.gridded import Gridded

LARGE = 1 << 26
"""From so many bytes on, a table is not looked through for holes: it may have some."""


def numbers(file: BinaryIO, path: Path, dtype: str, shape: tuple[int, ...], offset: int = 0) -> np.ndarray:
    """The numbers of an open file from a byte on, read-only. Raises FormatError where there are too few."""
    count = math.prod(shape)
    file.seek(offset)
    found = np.fromfile(file, dtype, count)
    if len(found) < count:
        wanted = offset + count * found.itemsize
        raise FormatError(f"{path}: cut short: {offset + found.nbytes} bytes, expected {wanted}; fetch it again")
    found.flags.writeable = False
    return found.reshape(shape)


def expect_channels(m: Reflectance, format: str) -> int:
    """How many channels m has, 1 or 3. Raises ParameterError for what no table of RGB can hold."""
    shape = tabular_shape(m)
    if shape not in ((), (1,), (3,)):
        raise ParameterError(
            f"{m!r:.80}: has {shape[0]} channels, expected 1 or 3 in {format} files; write some of them"
        )
    return shape[0] if shape else 1


class Unscanned(Gridded):
    """A grid whose numbers nothing looks at before f is asked for.

    Subclasses see to it that nobody else can write to `stored`.
    """

    def __init__(
        self,
        parameterisation: str,
        axes: Mapping[str, Any],
        stored: np.ndarray,
        channels: Sequence[str | float],
        path: str = "",
        about: Mapping[str, Any] | None = None,
        quantity: str = "brdf",
    ):
        self._lay_out(parameterisation, axes, False, {}, tuple(channels))
        self._hold(uncertainty=None, quantity=quantity_named(quantity), holes=True)
        Measured.__init__(
            self,
            path,
            dict(about or {}),
            stored=Ours(stored),
            channel=len(channels),
        )
