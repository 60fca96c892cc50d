"""Pairs of directions with values, one per row of a file, and the `Gridded` or `Scattered` made of them.

The way back, from any reflectance to pairs, is `pairs_of_material`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...errors import FormatError, ParameterError
from ...tables.gridded import Gridded
from ...tables.rows import ROW_ANGLES
from ...tables.scattered import Scattered, gridded_or_scattered

LEVEL = 0.5 * math.pi + 1e-6
"""Polar angles [rad] up to here are above the surface."""

TURNS = 16.0 * math.pi
"""Azimuths [rad] beyond are damage."""

SIDES = ("front", "back")


class Pairs(NamedTuple):
    """Pairs of directions with values; uncertainty and channels None where there are none.

    angles    (n, 4) [rad]: theta_i, phi_i, theta_o, phi_o
    values    (n,), or (n, C) with C channels, of `quantity`
    """

    angles: np.ndarray
    values: np.ndarray
    quantity: str = "brdf"
    uncertainty: np.ndarray | None = None
    channels: tuple[str | float, ...] | None = None

    def only(self, which: Any) -> Pairs:
        spread = None if self.uncertainty is None else self.uncertainty[which]
        return self._replace(angles=self.angles[which], values=self.values[which], uncertainty=spread)

    def columns(self) -> np.ndarray:
        """The values, channels side by side: (n, C)."""
        return self.values[:, None] if self.values.ndim == 1 else self.values

    def numbers(self) -> list[np.ndarray]:
        """Angles, values and uncertainties as they are, each (n, ...)."""
        spread = [] if self.uncertainty is None else [self.uncertainty.reshape(len(self.angles), -1)]
        return [self.angles, self.columns(), *spread]

    def known(self) -> Pairs:
        """Those with a number in some channel."""
        there = np.isfinite(self.columns()).any(axis=1)
        return self if there.all() else self.only(there)


def upright(angles: np.ndarray, where: str, highest: float = math.pi + 1e-6) -> np.ndarray:
    """The same directions (n, 4) with polar angles >= 0: a negative one leans to the other side.

    `highest`: `LEVEL` for files that hold reflection only. Raises FormatError, with the row, where an angle is no
    number, a polar one larger, or an azimuth beyond 8 turns.
    """
    limits = np.array([highest, TURNS, highest, TURNS])
    good = np.abs(angles) <= limits
    if not good.all():
        row, k = np.argwhere(~good)[0]
        raise FormatError(
            f"{where}, row {row + 1}: {ROW_ANGLES[k]} is {np.degrees(angles[row, k]):g} degrees, "
            f"expected at most {np.degrees(limits[k]):.0f} to either side"
        )
    theta, phi = angles[:, [0, 2]], angles[:, [1, 3]]
    found = np.empty((len(angles), 4))
    found[:, [0, 2]], found[:, [1, 3]] = np.abs(theta), np.where(theta < 0.0, phi + math.pi, phi)
    return found


def material(
    pairs: Pairs,
    path: str,
    about: Mapping[str, Any],
    side: str = "front",
    isotropic: bool | None = None,
    outside: str = "hold",
) -> Gridded:
    """What the pairs were measured on: a `Gridded` where they fill a grid, else `Scattered`.

    Only pairs with both directions on the `side` asked for; the others (transmission, the other side) are kept as
    they are in `about["other_pairs"]`, to be written again. Angles on the back are counted from its own normal.
    Isotropic, if that is not said, where all light comes from one azimuth; of a grid it is kept in `about["phi_i"]`.
    Raises FormatError where nothing is left, or no number, and what `upright` raises.
    """
    if side not in SIDES:
        raise ParameterError(f"side={side!r}: expected one of {', '.join(map(repr, SIDES))}")
    theta_i, phi_i, theta_o, phi_o = upright(pairs.angles, path).T
    front_i, front_o = theta_i <= LEVEL, theta_o <= LEVEL
    here = front_i & front_o if side == "front" else ~front_i & ~front_o
    if not here.any():
        raise FormatError(
            f"{path}: none of {len(here)} rows is reflection on the {side}: expected both directions on that side; "
            f"gonio reads no transmission yet; try side={SIDES[side == 'front']!r}"
        )
    if side == "back":
        theta_i, theta_o = math.pi - theta_i, math.pi - theta_o
    about = dict(about)
    if not here.all():
        about["other_pairs"] = pairs.only(~here)
    kept = pairs._replace(angles=np.stack([theta_i, phi_i, theta_o, phi_o], axis=1)).only(here)
    if not np.isfinite(kept.values).any():
        raise FormatError(f"{path}: holds no value that is a number, expected at least one measurement")
    found = _found(kept, path, about, isotropic, outside)
    if isinstance(found, Scattered):
        _not_pasted(kept, np.flatnonzero(here), path, about, isotropic, outside)
    return found


def _found(pairs: Pairs, path: str, about: Mapping[str, Any], isotropic: bool | None, outside: str) -> Gridded:
    theta_i, phi_i, theta_o, phi_o = pairs.angles.T
    try:
        return _as_grid(pairs, path, about, isotropic, outside) or gridded_or_scattered(
            theta_i,
            phi_i,
            theta_o,
            phi_o,
            pairs.values,
            quantity=pairs.quantity,
            uncertainty=pairs.uncertainty,
            channels=pairs.channels,
            isotropic=isotropic,
            outside=outside,
            path=path,
            about=about,
        )
    except ParameterError as error:
        raise FormatError(f"{path}: {error}") from None


def _not_pasted(pairs: Pairs, numbers: np.ndarray, path: str, *more: Any) -> None:
    """FormatError where all rows are there several times, or some are and the others fill a grid.

    A few equal rows in no grid may be measured so, and count as their mean. `numbers`: of the rows in the file.
    """
    twice, once, all_twice = repeated(np.column_stack(pairs.numbers()))
    if twice is None:
        return
    first, again = (int(numbers[k]) + 1 for k in twice)
    if all_twice and len(once) > 1:
        raise FormatError(
            f"{path}: every row is there several times: row {again} repeats row {first}; expected each once: remove "
            f"the copies"
        )
    if not isinstance(_found(pairs.only(once), path, *more), Scattered):
        raise FormatError(_twice(path, first, again))


def _twice(path: str, first: int, again: int) -> str:
    return (
        f"{path}: row {again} repeats row {first}, and the others are the nodes of a grid; expected each node once: "
        f"remove one of the two"
    )


def repeated(rows: np.ndarray) -> tuple[tuple[int, int] | None, np.ndarray, bool]:
    """The first row (n, k) that repeats one before it: the numbers of these, from 0; every row that does not; and
    whether each row is there several times. NaN is NaN here, and 0 is -0."""
    exact = np.ascontiguousarray(rows + 0.0)
    packed = exact.view(np.dtype((np.void, exact.dtype.itemsize * exact.shape[1]))).reshape(-1)
    _, first, which, count = np.unique(packed, return_index=True, return_inverse=True, return_counts=True)
    of = first[which.reshape(-1)]
    again = np.flatnonzero(of != np.arange(len(rows)))
    if not len(again):
        return None, first, False
    return (int(of[again[0]]), int(again[0])), np.sort(first), bool((count > 1).all())


def _as_grid(pairs: Pairs, path: str, about: Mapping[str, Any], isotropic: bool | None, outside: str) -> Gridded | None:
    """The grid of which every node has its row, also where several are the same direction along the normal."""
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
        about = {**about, "phi_i": float(phi_i[0])} if phi_i[0] else about
    found = grid(columns)
    if found is None:
        return None
    axes, order = found
    turns = [nodes for name, nodes in axes.items() if name.startswith("phi")]
    if any(np.ptp(nodes) > 2.0 * math.pi + 1e-6 or np.abs(nodes).max() > 4.0 * math.pi for nodes in turns):
        return None
    mirrored = "phi" in axes and half_circle(axes["phi"])
    return gridded("angles", axes, order, pairs, mirrored=mirrored, outside=outside, path=path, about=about)


def half_circle(nodes: np.ndarray) -> bool:
    """Whether azimuths are between 0 and pi, so that the other half must follow from them."""
    return bool(len(nodes) > 1 and nodes[0] >= 0.0 and nodes[-1] <= math.pi + 1e-6)


def gridded(name: str, axes: Mapping[str, np.ndarray], order: np.ndarray, pairs: Pairs, **options: Any) -> Gridded:
    """The grid whose nodes, in their order, are the rows `order` (see `grid`)."""
    shape = tuple(len(x) for x in axes.values())
    values, spread = (
        None if v is None else v[order].reshape(*shape, *v.shape[1:]) for v in (pairs.values, pairs.uncertainty)
    )
    return Gridded(name, axes, values, quantity=pairs.quantity, uncertainty=spread, channels=pairs.channels, **options)


def grid(columns: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], np.ndarray] | None:
    """Nodes of the axes whose every combination is one row, and the numbers of the rows in that order; else None."""
    axes, at = {}, []
    size, count = 1, len(next(iter(columns.values())))
    for name, column in columns.items():
        axes[name], index = np.unique(column, return_inverse=True)
        at.append(index.reshape(-1))
        size *= len(axes[name])
    if size != count:
        return None
    place = np.ravel_multi_index(tuple(at), tuple(len(x) for x in axes.values()))
    order = np.argsort(place)
    return (axes, order) if (place[order] == np.arange(count)).all() else None


def grid_of(
    columns: Mapping[str, np.ndarray], pairs: Pairs, path: str
) -> tuple[dict[str, np.ndarray], np.ndarray] | None:
    """As `grid`. Raises FormatError for rows that were one but for a repeated row."""
    found = grid(columns)
    if found is None:
        twice, once, _ = repeated(np.column_stack([*columns.values(), *pairs.numbers()]))
        if twice is not None and grid({name: column[once] for name, column in columns.items()}) is not None:
            raise FormatError(_twice(path, twice[0] + 1, twice[1] + 1))
    return found
