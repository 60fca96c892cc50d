"""Measurements as rows, one pair of directions each: what formats that list pairs are read from and written as."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import FormatError, ParameterError
from ..geometry import HORIZON
from ..gridded import Gridded
from ..interface import Reflectance, angles
from ..measurement import from_brdf, tabular_shape, to_brdf
from ..scattered import Scattered, gridded_or_scattered

RESOLUTION = (10, 10, 13)
"""theta_i and theta_o from 0 to 80 degrees, phi_o - phi_i from 0 to 360: pairs to write of a model."""

RESOLUTION_ORIENTED = (7, 7, 9, 9)
"""The same with phi_i and phi_o, for anisotropic ones."""


class Rows(NamedTuple):
    """Pairs of directions and what was measured there.

    theta_i, phi_i, theta_o, phi_o   (n,) [rad]
    values, uncertainty              (n,) or (n, C); uncertainty None where it is not known
    """

    theta_i: np.ndarray
    phi_i: np.ndarray
    theta_o: np.ndarray
    phi_o: np.ndarray
    values: np.ndarray
    uncertainty: np.ndarray | None


def rows_of(m: Reflectance, resolution: Sequence[int] | None = None, quantity: str = "brdf") -> Rows:
    """The pairs that a measurement holds, or those of a grid of angles, with values of a quantity there.

    `resolution`: nodes of theta_i, theta_o, phi; or of theta_i, theta_o, phi_i, phi_o. Without it measurements in rows
    or on a grid keep their pairs, and their values as they were given if they are of this quantity. Raises
    ParameterError for a material with a delta lobe or with maps.
    """
    if isinstance(m, Scattered) and resolution is None:
        return _with(m.rows, m.quantity, m.stored, m.uncertainty, quantity)
    if isinstance(m, Gridded) and resolution is None:
        return _of_grid(m, quantity)
    tabular_shape(m)
    if resolution is None:
        resolution = RESOLUTION if m.is_isotropic() else RESOLUTION_ORIENTED
    if len(resolution) not in (3, 4) or min(resolution) < 1:
        raise ParameterError(f"resolution={resolution!r}: expected 3 or 4 numbers of nodes, theta_i, theta_o, phi ...")
    thetas = [np.radians(np.linspace(0.0, 80.0, n)) for n in resolution[:2]]
    phis = [np.radians(np.linspace(0.0, 360.0, n, endpoint=False)) for n in resolution[2:]]
    nodes = np.meshgrid(*thetas, *([np.zeros(1)] if len(phis) == 1 else []), *phis, indexing="ij")
    rows = np.stack([nodes[k].reshape(-1) for k in (0, 2, 1, 3)], axis=1)
    return _with(rows, "brdf", m.f_angles(*rows.T), None, quantity)


def _of_grid(m: Gridded, quantity: str) -> Rows:
    if m.parameterisation == "angles":
        nodes = list(np.meshgrid(*m.axes.values(), indexing="ij"))
        nodes = nodes if len(nodes) == 4 else [*nodes[:2], np.zeros_like(nodes[0]), nodes[2]]
        rows = np.stack([nodes[k].reshape(-1) for k in (0, 2, 1, 3)], axis=1)
    else:
        (theta_i, phi_i), (theta_o, phi_o) = (angles(w.reshape(-1, 3)) for w in m.directions())
        rows = np.stack([theta_i, phi_i, theta_o, phi_o], axis=1)
    up = (np.cos(rows[:, [0, 2]]) > -HORIZON).all(axis=1)
    values, uncertainty = (
        None if v is None else v.reshape(len(rows), *v.shape[len(m.axes) :])[up] for v in (m.stored, m.uncertainty)
    )
    return _with(rows[up], m.quantity, values, uncertainty, quantity)


def _with(rows: np.ndarray, of: str, values: Any, uncertainty: Any, quantity: str) -> Rows:
    """The rows, with values of one quantity turned into those of another where it is another."""
    cosines = np.cos(rows[:, [0, 2]]).T.reshape(2, -1, *(1,) * (np.ndim(values) - 1))
    held = [
        v if v is None or of == quantity else from_brdf(quantity, to_brdf(of, v, *cosines), *cosines)
        for v in (values, uncertainty)
    ]
    return Rows(*rows.T, *held)


def by_channel(
    geometry: np.ndarray, channel: np.ndarray, columns: dict[str, np.ndarray], where: str
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Rows of one geometry each, with the channels side by side; NaN where a channel has no row.

    `geometry` (n, k) and `channel` (n,) say which row is which; geometries come in the order in which they first occur,
    one that was measured twice twice, and channels rising. Returns them, and the columns as (geometries, channels...).
    Raises FormatError where most of these cells would be empty.
    """
    channels, at = np.unique(channel, return_inverse=True)
    kinds = np.unique(geometry, axis=0, return_inverse=True)[1].reshape(-1)
    keys = np.stack([kinds, _times_before(kinds * len(channels) + at)], axis=1)
    _, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    cell = rank[place.reshape(-1)] * len(channels) + at
    if len(first) * len(channels) > 16 * len(cell) + 64:
        raise FormatError(
            f"{where}: {len(first)} pairs of directions and {len(channels)} wavelengths, but only {len(cell)} values, "
            f"expected about the same pairs for all wavelengths; split the file by wavelength"
        )
    wide = {}
    for name, column in columns.items():
        held = np.full((len(first) * len(channels), *column.shape[1:]), np.nan)
        held[cell] = column
        wide[name] = held.reshape(len(first), len(channels), *column.shape[1:])
    return geometry[first[order]], channels, wide


def _times_before(kinds: np.ndarray) -> np.ndarray:
    """How often the number at each place has occurred before it."""
    order = np.argsort(kinds, kind="stable")
    starts = np.flatnonzero(np.diff(kinds[order], prepend=-1))
    counts = np.arange(len(kinds)) - np.repeat(starts, np.diff(starts, append=len(kinds)))
    times = np.empty_like(counts)
    times[order] = counts
    return times


def wavelengths_of(m: Reflectance, asked: Sequence[float] | None, channels: int) -> list[float]:
    """Wavelengths [nm] of the channels, as asked for or as the material has them. Raises ParameterError without any."""
    names = list(m.channel_names or ()) if asked is None else list(asked)
    if len(names) != channels or any(isinstance(n, str) for n in names):
        raise ParameterError(
            f"{m!r:.80}: has {channels} channels {names or ''}, expected a wavelength for each in this format; "
            f"give wavelengths=[...] in nm"
        )
    return [float(n) for n in names]


def measured(where: str, angles: np.ndarray, values: np.ndarray, **more: Any) -> Gridded:
    """What `gridded_or_scattered` makes of rows of theta_i, phi_i, theta_o, phi_o (n, 4) [rad] and their values.

    A negative polar angle leans to the other side. Raises FormatError where an angle is no number or below the horizon,
    and where there are no values.
    """
    rows = checked(where, angles)
    if not np.isfinite(values).any():
        raise FormatError(f"{where}: holds no value that is a number, expected at least one measurement")
    theta_i, phi_i, theta_o, phi_o = rows.T
    return gridded_or_scattered(theta_i, phi_i, theta_o, phi_o, values, **more)


def checked(where: str, angles: np.ndarray) -> np.ndarray:
    """Rows of theta_i, phi_i, theta_o, phi_o (n, 4) [rad], polar angles positive. Raises what `measured` does."""
    names = ("theta_i", "phi_i", "theta_o", "phi_o")
    for name, column in zip(names, angles.T, strict=True):
        limit = 0.5 * np.pi + 1e-6 if name.startswith("theta") else 16.0 * np.pi
        good = np.abs(column) <= limit
        if not good.all():
            worst = np.degrees(column[np.argmin(good)])
            raise FormatError(
                f"{where}: {name} is {worst:g} degrees, expected at most {np.degrees(limit):.0f} to either side"
            )
    (theta_i, phi_i), (theta_o, phi_o) = _upright(*angles.T[:2]), _upright(*angles.T[2:])
    return np.stack([theta_i, phi_i, theta_o, phi_o], axis=1)


def _upright(theta: np.ndarray, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same directions with theta >= 0: a negative angle leans to the other side."""
    return np.abs(theta), np.where(theta < 0.0, phi + np.pi, phi)
