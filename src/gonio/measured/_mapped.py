"""Binary tables: read, or where they are large mapped into memory, so that only what is looked at is read."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError, NotFoundError, ParameterError
from ..gridded import Gridded
from ..interface import Reflectance
from ..measurement import Measured, quantity_named, tabular_shape

MAPPED = 1 << 26
"""From so many bytes on, a file is mapped."""


def numbers(path: str | os.PathLike, dtype: str, shape: tuple[int, ...], offset: int = 0) -> np.ndarray:
    """The numbers of a file from a byte on, read-only. Raises NotFoundError, or FormatError where there are too few."""
    wanted = int(np.prod(shape, dtype=object)) * np.dtype(dtype).itemsize
    try:
        size = os.path.getsize(path)
        if size < offset + wanted:
            raise FormatError(f"{path}: cut short: {size} bytes, expected {offset + wanted}; fetch it again")
        if wanted >= MAPPED:
            return np.asarray(np.memmap(path, dtype, "r", offset, shape))
        with Path(path).open("rb") as file:
            file.seek(offset)
            found = np.fromfile(file, dtype, wanted // np.dtype(dtype).itemsize).reshape(shape)
    except OSError as error:
        raise NotFoundError(f"{path}: cannot be read: {error.strerror}") from None
    found.flags.writeable = False
    return found


def expect_channels(m: Reflectance, format: str) -> int:
    """How many channels m has, 1 or 3. Raises ParameterError for what no table of RGB can hold."""
    shape = tabular_shape(m)
    if shape not in ((), (1,), (3,)):
        raise ParameterError(
            f"{m!r:.80}: has {shape[0]} channels, expected 1 or 3 in {format} files; write some of them"
        )
    return shape[0] if shape else 1


class Mapped(Gridded):
    """A grid whose numbers stay in a file until f is asked for: nothing looks at them before."""

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
        self.__dict__.update(uncertainty=None, quantity=quantity_named(quantity), holes=True)
        Measured.__init__(
            self,
            path,
            dict(about or {}),
            stored=stored,
            channel=len(channels),
        )
