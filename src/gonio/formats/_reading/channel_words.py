"""Channels of measurements in rows: wavelengths from rows of one each, and names of columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

import numpy as np

from ...base.reflectance import Reflectance
from ...declared.arguments import Declared
from ...errors import FormatError, ParameterError
from ...numerics.unique_rows import unique_rows
from . import plain_text

SHORTEST, LONGEST = 1e-3, 1e9
"""Wavelengths [nm] of channels are between these."""

Wavelengths = Annotated[
    Sequence[float] | None,
    Declared("wavelengths of the channels, for materials without any", SHORTEST, LONGEST, "nm"),
]

_WAVELENGTH = re.compile(r"(?<!\d)(\d+(?:\.\d*)?|\.\d+)\s*nm", re.ASCII | re.IGNORECASE)


def of_names(names: Sequence[str]) -> tuple[str | float, ...]:
    """Channels of columns: wavelengths [nm] if all names are such as "450nm", else the names."""
    matches = [match for name in names if (match := _WAVELENGTH.fullmatch(name))]
    return tuple(float(match[1]) for match in matches) if len(matches) == len(names) else tuple(names)


def name_of(channel: str | float) -> str:
    """The name of a channel's column; the inverse of `of_names`."""
    return channel if isinstance(channel, str) else f"{plain_text.number(channel)}nm"


def by_channel(
    geometry: np.ndarray, channel: np.ndarray, columns: dict[str, np.ndarray], where: str
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Rows of one channel each as rows of one geometry each, with the channels side by side; NaN for missing rows.

    `geometry` (n, k) and `channel` (n,) are those of each row. Geometries keep the order of their first rows, one that
    was measured twice stays twice; channels rise. Returns both, and the columns as (geometries, channels...).
    Raises FormatError where most of these cells would be empty.
    """
    channels, at = np.unique(channel, return_inverse=True)
    _, kinds, _ = unique_rows(geometry)
    keys = np.stack([kinds, _times_before(kinds * len(channels) + at)], axis=1)
    first, place, _ = unique_rows(keys)
    order = np.argsort(first)
    rank = np.argsort(order)
    cell = rank[place] * len(channels) + at
    if len(first) * len(channels) > 16 * len(cell) + 64:
        raise FormatError(
            f"{where}: {len(first)} pairs of directions and {len(channels)} wavelengths, but only {len(cell)} values, "
            f"expected about the same pairs for all wavelengths; split the file by wavelength"
        )
    wide = {}
    for name, column in columns.items():
        cells = np.full((len(first) * len(channels), *column.shape[1:]), np.nan)
        cells[cell] = column
        wide[name] = cells.reshape(len(first), len(channels), *column.shape[1:])
    return geometry[first[order]], channels, wide


def _times_before(kinds: np.ndarray) -> np.ndarray:
    """For each number, how often it occurred before."""
    order = np.argsort(kinds, kind="stable")
    starts = np.flatnonzero(np.diff(kinds[order], prepend=-1))
    counts = np.arange(len(kinds)) - np.repeat(starts, np.diff(starts, append=len(kinds)))
    return counts[np.argsort(order)]


def wavelengths_of(m: Reflectance, asked: Sequence[float] | None, channels: int) -> list[float]:
    """Wavelengths [nm] of the channels, as asked for, else the material's. Raises ParameterError without any."""
    names = list(m.channel_names or ()) if asked is None else list(asked)
    if len(names) != channels or any(isinstance(n, str) for n in names):
        raise ParameterError(
            f"{m!r:.80}: has {channels} channels{f' {names}' if names else ''}, expected a wavelength for each in this "
            f"format; give wavelengths=[...] in nm"
        )
    return [float(n) for n in names]
