"""Pairs of directions with values, one per row of a file, and the `Gridded` or `Scattered` made of them.

The way back, from any reflectance to pairs, is `pairs_of_material`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...base.reflectance import Reflectance
from ...errors import FormatError, held_by
from ...numerics.unique_rows import first_alike
from ...tables.gridded import Gridded
from ...tables.rows import ROW_ANGLES, as_grid, oriented
from ...tables.scattered import Scattered, gridded_or_scattered
from .. import _sides
from .._reading import channel_words

LEVEL = 0.5 * math.pi + 1e-6
"""Largest polar angle [rad] above the surface."""

TURNS = 16.0 * math.pi
"""Largest azimuth [rad] of an undamaged file."""


class Pairs(NamedTuple):
    """Pairs of directions with values.

    angles         (n, 4) [rad]: theta_i, phi_i, theta_o, phi_o
    values         (n,), or (n, C) with C channels, of `quantity`
    uncertainty    shape of `values`, or None
    """

    angles: np.ndarray
    values: np.ndarray
    quantity: str = "brdf"
    uncertainty: np.ndarray | None = None
    channels: tuple[str | float, ...] | None = None

    def only(self, which: Any) -> Pairs:
        """The pairs of these numbers, or of this mask."""
        spread = None if self.uncertainty is None else self.uncertainty[which]
        return self._replace(angles=self.angles[which], values=self.values[which], uncertainty=spread)

    def columns(self) -> np.ndarray:
        """The values, channels side by side: (n, C)."""
        return self.values[:, None] if self.values.ndim == 1 else self.values

    def numbers(self) -> list[np.ndarray]:
        """Angles, values and uncertainties, each (n, ...)."""
        spread = [] if self.uncertainty is None else [self.uncertainty.reshape(len(self.angles), -1)]
        return [self.angles, self.columns(), *spread]

    def by_channel(self, channel: np.ndarray, where: str) -> Pairs:
        """Rows of one channel (n,) each as rows of all channels: see `channel_words.by_channel`."""
        columns = {"values": self.values}
        if self.uncertainty is not None:
            columns["uncertainty"] = self.uncertainty
        rows, channels, columns = channel_words.by_channel(self.angles, channel, columns, where)
        values, spread = columns["values"], columns.get("uncertainty")
        return Pairs(rows, values, self.quantity, spread, tuple(channels.tolist()))

    def finite(self) -> Pairs:
        """The pairs with a number in some channel."""
        finite = np.isfinite(self.columns()).any(axis=1)
        return self if finite.all() else self.only(finite)


def together(parts: Sequence[Pairs]) -> Pairs:
    """The pairs of all parts, one after the other, with uncertainties where all have them."""
    spreads = [x for pairs in parts if (x := pairs.uncertainty) is not None]
    spread = np.concatenate(spreads) if len(spreads) == len(parts) else None
    angles, values = (np.concatenate([getattr(pairs, name) for pairs in parts]) for name in ("angles", "values"))
    return parts[0]._replace(angles=angles, values=values, uncertainty=spread)


def upright(angles: np.ndarray, where: str, highest: float = math.pi + 1e-6) -> np.ndarray:
    """The same directions (n, 4) with polar angles >= 0: a negative one leans to the other side.

    `highest` is the largest polar angle, `LEVEL` for files of reflection only. Raises FormatError, with the row, for
    larger ones, azimuths beyond 8 turns, and NaN.
    """
    limits = np.array([highest, TURNS, highest, TURNS])
    good = np.abs(angles) <= limits
    if not good.all():
        row, k = np.argwhere(~good)[0]
        raise FormatError(
            f"{where}, row {row + 1}: {ROW_ANGLES[k]} is {np.degrees(angles[row, k]):g} degrees, "
            f"expected at most {np.degrees(limits[k]):.0f} to either side"
        )
    theta, phi = angles[:, ::2], angles[:, 1::2]
    return np.stack([np.abs(theta), np.where(theta < 0.0, phi + math.pi, phi)], axis=-1).reshape(-1, 4)


def material(
    pairs: Pairs,
    path: str,
    about: Mapping[str, Any],
    side: str | None = "front",
    isotropic: bool | None = None,
    outside: str = "hold",
) -> Any:
    """The measurement of the pairs: a `Gridded` where they fill a grid, else `Scattered`; or a `Sheet` of several.

    `side`: see `_sides.Side`. Of the front it holds the pairs with both directions there; the others (transmission, the
    other side) stay as they are in `about["other_pairs"]`, to be written again. What is seen from behind, alone or as a
    part of a `Sheet`, is turned half a turn about the y axis. With isotropic=None a part is isotropic if all light
    comes from one azimuth, which grids keep in `about["phi_i"]`.
    Raises FormatError where no pair or no number is left, and the errors of `upright`.
    """
    angles = upright(pairs.angles, path)
    rows = by_quarter(angles)
    parts: dict[str, Reflectance] = {}
    wanted = _sides.wanted(rows, side, path)
    alone = len(wanted) == 1 and side != "both"
    for name in wanted:
        which, more = rows[name], dict(about)
        if alone and name == "front" and len(which) < len(angles):
            more["other_pairs"] = pairs.only(np.delete(np.arange(len(angles)), which))
        own = angles if len(which) == len(angles) else angles[which]
        own = seen_from(name, own)
        kept = (pairs if len(which) == len(angles) else pairs.only(which))._replace(angles=own)
        if not np.isfinite(kept.values).any():
            raise FormatError(f"{path}: holds no value that is a number, expected at least one measurement")
        named = {"outside": outside, "path": path, "about": more}
        with held_by(path):
            parts[name] = _grid_or_rows(kept, which, isotropic, named)
    return _sides.joined(parts, side)


def by_quarter(angles: np.ndarray) -> dict[str, np.ndarray]:
    """The numbers of the rows of each quarter of a `Sheet`, of those that have any, by polar angles from the front."""
    lit, seen = angles[:, 0] <= LEVEL, angles[:, 2] <= LEVEL
    masks = {"front": lit & seen, "back": ~lit & ~seen, "forward": lit & ~seen, "backward": ~lit & seen}
    return {name: np.flatnonzero(mask) for name, mask in masks.items() if mask.any()}


def seen_from(quarter: str, angles: np.ndarray) -> np.ndarray:
    """Angles (n, 4) of the sample as a part of a `Sheet` has them, and the other way round: it is its own inverse.

    Seen from behind, both directions are turned half a turn about the y axis; light from the other side is mirrored at
    the surface.
    """
    theta_i, phi_i, theta_o, phi_o = angles.T
    if quarter in ("back", "backward"):
        theta_i = math.pi - theta_i
    if quarter in ("back", "forward"):
        theta_o, phi_i, phi_o = math.pi - theta_o, math.pi - phi_i, math.pi - phi_o
    return np.stack([theta_i, phi_i, theta_o, phi_o], axis=1)


def _grid_or_rows(pairs: Pairs, numbers: np.ndarray, isotropic: bool | None, named: dict[str, Any]) -> Gridded:
    """The grid that the pairs fill, else `Scattered`. `numbers`: of the rows in the file; `named`: outside, path and
    about.

    Raises FormatError if every row has copies, and if the rows fill a grid without theirs: a few equal rows in no grid
    are taken for measurements, and count as their mean.
    """
    rows, path, copies = np.column_stack(pairs.numbers()), named["path"], None
    if (rows[1:] == rows[0]).all(axis=1).any():  # if every row has copies the first one has
        copies = repeated(rows)
        if copies.are_all and len(copies.once) > 1:
            first, again = (int(numbers[k]) + 1 for k in copies.pair)
            fault = f"every row is there several times: row {again} repeats row {first}; remove copies"
            raise FormatError(f"{path}: {fault}")
    if (table := _as_grid(pairs, isotropic, named)) is not None:
        return table
    options = {"quantity": pairs.quantity, "uncertainty": pairs.uncertainty, "channels": pairs.channels, **named}
    theta_i, phi_i, theta_o, phi_o = pairs.angles.T
    measurement = gridded_or_scattered(theta_i, phi_i, theta_o, phi_o, pairs.values, isotropic=isotropic, **options)
    if isinstance(measurement, Scattered) and (copies := copies or repeated(rows)).pair:
        once = pairs.only(copies.once)
        four = oriented(once.angles) if isotropic is None else not isotropic
        if as_grid(once.angles, four) is not None or _as_grid(once, isotropic, named) is not None:
            raise _copy_of_node(path, *(int(numbers[k]) + 1 for k in copies.pair))
    return measurement


def _copy_of_node(path: str, first: int, again: int) -> FormatError:
    return FormatError(
        f"{path}: row {again} repeats row {first}, and the others are the nodes of a grid; expected each node once: "
        f"remove one of the two"
    )


class Copies(NamedTuple):
    """The numbers, from 0, of the first row that repeats an earlier one and of this, or (); those of the rows that
    repeat none; and whether every row occurs several times."""

    pair: tuple[int, ...]
    once: np.ndarray
    are_all: bool


def repeated(rows: np.ndarray) -> Copies:
    """Of rows (n, k). NaN equals NaN here, and 0 equals -0."""
    earliest = first_alike(rows)
    is_first = earliest == np.arange(len(rows))
    once, again = np.flatnonzero(is_first), np.flatnonzero(~is_first)
    if not len(again):
        return Copies((), once, False)
    count = np.bincount(earliest)
    return Copies((int(earliest[again[0]]), int(again[0])), once, bool((count[once] > 1).all()))


def _as_grid(pairs: Pairs, isotropic: bool | None, named: dict[str, Any]) -> Gridded | None:
    """The grid with a row for every node, also where several nodes are the same direction along the normal."""
    theta_i, phi_i, theta_o, phi_o = pairs.angles.T
    columns = {"theta_i": theta_i, "theta_o": theta_o, "phi_i": phi_i, "phi_o": phi_o}
    one_azimuth = bool((phi_i == phi_i[0]).all())
    if isotropic and not one_azimuth:
        return None
    if isotropic is not False and one_azimuth:
        phi = phi_o - phi_i if phi_i[0] else phi_o
        if -math.pi - 1e-6 <= phi.min() and phi.max() <= 0.0:
            phi = 0.0 - phi
        columns = {"theta_i": theta_i, "theta_o": theta_o, "phi": phi}
        named = {**named, "about": {**named["about"], "phi_i": float(phi_i[0])}} if phi_i[0] else named
    if (axes_and_order := grid(columns)) is None:
        return None
    axes, order = axes_and_order
    turns = [nodes for name, nodes in axes.items() if name.startswith("phi")]
    if any(np.ptp(nodes) > 2.0 * math.pi + 1e-6 or np.abs(nodes).max() > 4.0 * math.pi for nodes in turns):
        return None
    mirrored = "phi" in axes and half_circle(axes["phi"])
    return gridded("angles", axes, order, pairs, mirrored=mirrored, **named)


def half_circle(nodes: np.ndarray) -> bool:
    """Whether azimuths cover 0 to pi only, so that the other half must follow from them."""
    return bool(len(nodes) > 1 and nodes[0] >= 0.0 and nodes[-1] <= math.pi + 1e-6)


def gridded(name: str, axes: Mapping[str, np.ndarray], order: np.ndarray, pairs: Pairs, **options: Any) -> Gridded:
    """The measurement on a grid whose nodes, in their order, are the rows `order` (see `grid`)."""
    shape = tuple(len(x) for x in axes.values())
    rows = slice(None) if (np.diff(order) == 1).all() else order
    values, spread = (
        None if v is None else v[rows].reshape(*shape, *v.shape[1:]) for v in (pairs.values, pairs.uncertainty)
    )
    return Gridded(name, axes, values, quantity=pairs.quantity, uncertainty=spread, channels=pairs.channels, **options)


def grid(columns: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], np.ndarray] | None:
    """Axes whose every combination of nodes has one row, and the numbers of the rows in that order; None without."""
    nodes, at = zip(*(np.unique(column, return_inverse=True) for column in columns.values()), strict=True)
    shape = tuple(map(len, nodes))
    if math.prod(shape) != at[0].size:
        return None
    place = np.ravel_multi_index(tuple(index.reshape(-1) for index in at), shape)
    order = np.argsort(place)
    return (dict(zip(columns, nodes, strict=True)), order) if (place[order] == np.arange(len(order))).all() else None


def grid_of(
    columns: Mapping[str, np.ndarray], pairs: Pairs, path: str
) -> tuple[dict[str, np.ndarray], np.ndarray] | None:
    """The same as `grid`. Raises FormatError for rows that fill a grid but for a repeated row."""
    axes_and_order = grid(columns)
    if axes_and_order is None:
        pair, once, _ = repeated(np.column_stack([*columns.values(), *pairs.numbers()]))
        if pair and grid({name: column[once] for name, column in columns.items()}) is not None:
            raise _copy_of_node(path, pair[0] + 1, pair[1] + 1)
    return axes_and_order
