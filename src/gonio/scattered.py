"""Measurements in no grid: kept as the rows they are, looked up in a grid that is interpolated from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from . import schema
from .errors import ParameterError
from .gridded import Gridded
from .interface import direction
from .measurement import Measured, quantity_named, to_brdf

if TYPE_CHECKING:
    import xarray

SAME = 1e-6
"""Angles [rad] closer than this are one node."""

NEIGHBOURS = 24
"""How many of the nearest measurements a value is interpolated from."""

ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")

RESOLUTION = {3: (24, 37, 37), 4: (13, 19, 16, 36)}
"""Nodes of the grid, by its number of axes, where the rows do not say which; azimuths of three axes are mirrored."""


class Residual(NamedTuple):
    """How much the grid differs from the rows it was made of: root mean square, and largest, relative to the mean f."""

    rms: float
    largest: float


class Scattered(Gridded):
    """Measurements at any pairs of directions, n rows of angles and values.

    Looked up in a grid of angles: at its nodes, f is interpolated from the 24 nearest rows by radial basis functions
    (|r|, exact at rows), over the projections of both directions on the surface; between nodes linearly. A node
    further from all rows than twice the distance usual between rows has the value of the nearest row where `outside`
    is "hold", and none where it is "missing". Rows of one orientation are taken as an isotropic material's: turned
    together with wi, and, if all lie in the plane of incidence or on one side of it, mirrored at it.

    Shapes   theta_i, phi_i, theta_o, phi_o: (n,); values, uncertainty: (n,) or (n, C).
    Units    angles: rad; f: 1/sr; values: those of `quantity`.
    Error    of the grid against the rows, in `residual`; rows that repeat a pair of directions count as their mean.
    Source   `scipy.interpolate.RBFInterpolator`; Wahba 1990, "Spline Models for Observational Data", SIAM.
    """

    format = "rows"
    rows: np.ndarray
    """Angles (n, 4) [rad]: theta_i, phi_i, theta_o, phi_o."""

    def __init__(
        self,
        theta_i: Any,
        phi_i: Any,
        theta_o: Any,
        phi_o: Any,
        values: Any,
        *,
        quantity: str = "brdf",
        uncertainty: Any = None,
        channels: Sequence[str | float] | None = None,
        isotropic: bool | None = None,
        outside: str = "hold",
        path: str = "",
        about: Mapping[str, Any] | None = None,
    ):
        rows, measured, spread = _rows((theta_i, phi_i, theta_o, phi_o), values, uncertainty, channels)
        if not np.isfinite(measured).all(axis=tuple(range(1, measured.ndim))).any():
            raise ParameterError("values: none of the rows holds a number; expected at least one measurement")
        axes, mirrored = _grid(rows, _oriented(rows) if isotropic is None else not isotropic)
        names = None if channels is None else tuple(channels)
        self._lay_out("angles", axes, mirrored, {}, names)
        self.__dict__.update(
            rows=rows, uncertainty=spread, quantity=quantity_named(quantity), holes=outside == "missing"
        )
        Measured.__init__(
            self,
            path,
            dict(about or {}),
            outside=outside,
            stored=measured,
            channel=0.0 if names is None else len(names),
        )

    @cached_property
    def nodes(self) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
        """f [1/sr] at the nodes of the grid, its standard uncertainty, and the number of the nearest measurement."""
        spread = None if self.uncertainty is None else self._of_rows(self.uncertainty)
        f = self._of_rows(self.stored)
        return _interpolated(self.rows, f, spread, self.axes, self.is_oriented(), self.is_mirrored, self.outside)

    @cached_property
    def residual(self) -> Residual:
        """How far the grid is from the rows."""
        true = self._of_rows(self.stored)
        wi, wo = (direction(self.rows[:, k], self.rows[:, k + 1]) for k in (0, 2))
        off = np.abs(self.f(wi, wo) - true) / np.nanmean(np.abs(true))
        off = off[np.isfinite(off)]
        return Residual(float(np.sqrt(np.mean(off**2))), float(off.max())) if off.size else Residual(math.nan, math.nan)

    def _replaced(self, grouped: dict[str, Any]) -> Self:
        """As the base's; with another `outside` the grid is made anew."""
        if grouped.get("outside", self.outside) == self.outside:
            return super()._replaced(grouped)
        return type(self)(
            self.rows[:, 0],
            self.rows[:, 1],
            self.rows[:, 2],
            self.rows[:, 3],
            self.stored,
            quantity=self.quantity,
            uncertainty=self.uncertainty,
            channels=self.channel_names,
            isotropic=not self.is_oriented(),
            outside=grouped["outside"],
            path=self.path,
            about=self.about,
        )._replaced(grouped)

    def _of_rows(self, values: np.ndarray) -> np.ndarray:
        """Values or uncertainties of the rows as BRDFs."""
        cosines = [np.cos(self.rows[:, k]) if values.ndim == 1 else np.cos(self.rows[:, k, None]) for k in (0, 2)]
        return to_brdf(self.quantity, np.where(np.isfinite(values), values, np.nan), *cosines)

    @property
    def data(self) -> xarray.Dataset:
        """As given, in the layout of docs/data-model.md: `values`, `valid`, `uncertainty`, angles by measurement."""
        return schema.described(
            dict(zip(ANGLES, self.rows.T, strict=True)),
            [schema.ROW],
            self.stored,
            self.uncertainty,
            self.channel_names,
            parameterisation=self.parameterisation,
            quantity=self.quantity,
            isotropic=not self.is_oriented(),
            outside=self.outside,
            source=self.path,
            **schema.known(self.about, self.provenance),
        )

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes of the grid."""
        return self.nodes[0]

    def brdf_uncertainty(self) -> np.ndarray | None:
        """Standard uncertainty of `brdf`."""
        return self.nodes[1]

    def with_brdf(self, values: np.ndarray, uncertainty: np.ndarray | None = None, **about: Any) -> Gridded:
        """The grid, without its rows, with other f [1/sr] at its nodes."""
        return Gridded(
            self.parameterisation,
            self.axes,
            values,
            uncertainty=uncertainty,
            channels=self.channel_names,
            mirrored=self.is_mirrored,
            outside=self.outside,
            path=self.path,
            about={**self.about, **about},
        )

    def _key(self) -> tuple:
        return (*super()._key(), ("rows", self.rows))

    def __repr__(self) -> str:
        return super().__repr__() if self.path else f"<{len(self.rows)} measurements in no grid>"


def gridded_or_scattered(
    theta_i: Any,
    phi_i: Any,
    theta_o: Any,
    phi_o: Any,
    values: Any,
    *,
    quantity: str = "brdf",
    uncertainty: Any = None,
    channels: Sequence[str | float] | None = None,
    isotropic: bool | None = None,
    outside: str = "hold",
    path: str = "",
    about: Mapping[str, Any] | None = None,
) -> Gridded:
    """Rows (n,) of angles [rad] with their values: a `Gridded` if they are the nodes of a grid of `angles`, each once,
    else `Scattered`.

    Where a polar angle is 0 one row stands for all azimuths, or there is one for each. With azimuths on one side of
    the plane of incidence only (0 to pi) the grid of an isotropic material is mirrored.
    """
    rows, measured, spread = _rows((theta_i, phi_i, theta_o, phi_o), values, uncertainty, channels)
    four = _oriented(rows) if isotropic is None else not isotropic
    more: dict[str, Any] = {
        "quantity": quantity,
        "channels": channels,
        "outside": outside,
        "path": path,
        "about": about,
    }
    found = _as_grid(rows, four)
    if found is None:
        theta_i, phi_i, theta_o, phi_o = rows.T
        return Scattered(theta_i, phi_i, theta_o, phi_o, measured, uncertainty=spread, isotropic=not four, **more)
    axes, index, mirrored = found
    names = ("theta_i", "theta_o", "phi_i", "phi_o") if four else ("theta_i", "theta_o", "phi")
    return Gridded(
        "angles",
        dict(zip(names, axes, strict=True)),
        measured[index],
        uncertainty=None if spread is None else spread[index],
        mirrored=mirrored,
        **more,
    )


def _rows(
    angles: Sequence[Any], values: Any, uncertainty: Any, channels: Sequence | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Angles (n, 4), values and uncertainties, checked."""
    held = np.array(values, dtype=float)
    n = len(held) if held.ndim else 0
    if n == 0:
        raise ParameterError("values: got no rows, expected at least one measurement")
    expected = (n,) if channels is None else (n, len(channels))
    if held.shape != expected:
        raise ParameterError(f"values: got shape {held.shape}, expected {expected}: rows, and channels")
    rows = np.stack(np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in angles), np.zeros(n))[:4], axis=-1)
    if rows.shape != (n, 4) or not np.isfinite(rows).all():
        raise ParameterError(f"angles: expected {n} finite numbers [rad] each of {', '.join(ANGLES)}")
    for k in (0, 2):
        low, high = rows[:, k].min(), rows[:, k].max()
        if low < -SAME or high > 0.5 * math.pi + SAME:
            raise ParameterError(
                f"{ANGLES[k]}: from {low:g} to {high:g}, expected 0 to pi/2 rad; convert degrees with numpy.radians, "
                f"and turn a negative polar angle into a positive one on the other side"
            )
    spread = None if uncertainty is None else np.array(np.broadcast_to(uncertainty, expected), dtype=float)
    return rows, held, spread


def _turned(phi: np.ndarray) -> np.ndarray:
    """Azimuths in [0, 2 pi), those that are a whole turn but for rounding at 0."""
    phi = np.mod(phi, 2.0 * math.pi)
    return np.where(phi > 2.0 * math.pi - SAME, 0.0, phi)


def _oriented(rows: np.ndarray) -> bool:
    """Whether light came from several azimuths, other than along the normal."""
    phi = _turned(rows[rows[:, 0] > SAME, 1])
    return len(_distinct(phi)) > 1 if len(phi) else False


def _distinct(x: np.ndarray) -> np.ndarray:
    """Increasing numbers, those closer than `SAME` taken as one."""
    x = np.unique(x)
    return x[np.concatenate([[True], np.diff(x) > SAME])]


def _of(nodes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The number of the node that each angle is."""
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    return np.searchsorted(middle, x)


def _as_grid(rows: np.ndarray, four: bool) -> tuple[list[np.ndarray], np.ndarray, bool] | None:
    """Nodes of the axes, which row is at each, and whether azimuths are mirrored; None if the rows are no grid."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    if four:
        turns = [(_turned(phi_i), theta_i <= SAME), (_turned(phi_o), theta_o <= SAME)]
    else:
        phi = _turned(phi_o - phi_i)
        turns = [(_turned(-phi) if phi[phi > SAME].min(initial=4.0) >= math.pi - SAME else phi, _polar(rows))]
    axes = [_distinct(theta_i), _distinct(theta_o)]
    axes += [_distinct(phi[~free]) if not free.all() else np.zeros(1) for phi, free in turns]
    size = math.prod(map(len, axes))
    if size > 4 * len(rows) + 64:
        return None
    index, taken = np.zeros(tuple(map(len, axes)), int), np.zeros(tuple(map(len, axes)), int)
    first, second = _of(axes[0], theta_i), _of(axes[1], theta_o)
    at = [_of(nodes, phi) for nodes, (phi, _) in zip(axes[2:], turns, strict=True)]
    anywhere = np.any([free for _, free in turns], axis=0)
    one = tuple(x[~anywhere] for x in (first, second, *at))
    index[one] = np.flatnonzero(~anywhere)
    np.add.at(taken, one, 1)
    own = _shared(first, second, at, turns, axes[2:]) & anywhere
    for row in np.flatnonzero(anywhere):
        around = [slice(None) if free[row] and not own[row] else k[row] for k, (_, free) in zip(at, turns, strict=True)]
        index[(first[row], second[row], *around)] = row
        taken[(first[row], second[row], *around)] += 1
    if (taken != 1).any():
        return None
    mirrored = not four and len(axes[2]) > 1 and axes[2][-1] <= math.pi + SAME
    return axes, index, bool(mirrored)


def _shared(first: np.ndarray, second: np.ndarray, at: list, turns: list, nodes: list) -> np.ndarray:
    """Whether a row along the normal is one of several at azimuths that are nodes, as grids are often written out."""
    on_nodes = [np.abs(x[k] - phi) <= SAME for x, k, (phi, _) in zip(nodes, at, turns, strict=True)]
    keys = [np.where(free, -1, k) for k, (_, free) in zip(at, turns, strict=True)]
    place = np.stack([first, second, *keys], axis=1)
    _, which, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
    return np.all(on_nodes, axis=0) & (count[which.reshape(-1)] > 1)


def _polar(rows: np.ndarray) -> np.ndarray:
    """Whether a direction is the normal, so that the azimuth between both is not determined."""
    return (rows[:, 0] <= SAME) | (rows[:, 2] <= SAME)


def _grid(rows: np.ndarray, four: bool) -> tuple[dict[str, np.ndarray], bool]:
    """Axes of a grid for rows in no grid, and whether its azimuths are mirrored."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    counts = RESOLUTION[4 if four else 3]
    thetas = []
    for theta, count in ((theta_i, counts[0]), (theta_o, counts[1])):
        own = _distinct(theta)
        thetas.append(own if len(own) <= count else np.linspace(own[0], own[-1], count))
    if four:
        turns = [2.0 * math.pi * np.arange(n) / n for n in counts[2:]]
        return dict(zip(("theta_i", "theta_o", "phi_i", "phi_o"), [*thetas, *turns], strict=True)), False
    phi = _turned(phi_o - phi_i)
    if np.minimum(phi, np.abs(phi - math.pi)).max() <= SAME:  # in the plane of incidence
        return {"theta_i": thetas[0], "theta_o": thetas[1], "phi": np.array([0.0, math.pi])}, True
    mirrored = phi.max() <= math.pi + SAME or phi[phi > SAME].min() >= math.pi - SAME
    turn = np.linspace(0.0, math.pi, counts[2]) if mirrored else math.pi * np.arange(2 * counts[2]) / counts[2]
    return {"theta_i": thetas[0], "theta_o": thetas[1], "phi": turn}, bool(mirrored)


def _places(rows: np.ndarray, four: bool, mirrored: bool) -> np.ndarray:
    """Where rows lie for interpolation: projections of the directions on the surface, turned together if isotropic."""
    theta_i, phi_i, theta_o, phi_o = rows.T
    wi, wo = direction(theta_i, phi_i), direction(theta_o, phi_o if four else phi_o - phi_i)
    if four:
        return np.concatenate([wi[:, :2], wo[:, :2]], axis=-1)
    across = np.abs(wo[:, 1]) if mirrored else wo[:, 1]
    return np.stack([np.sin(theta_i), wo[:, 0], across], axis=-1)


def _interpolated(
    rows: np.ndarray,
    f: np.ndarray,
    spread: np.ndarray | None,
    axes: Mapping[str, np.ndarray],
    four: bool,
    mirrored: bool,
    outside: str,
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """f at the nodes of a grid (grid...[, C]), its standard uncertainty: that of the nearest row; and which that is."""
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import KDTree

    known = np.isfinite(f if f.ndim == 1 else f.sum(axis=-1))
    nodes = np.meshgrid(*axes.values(), indexing="ij")
    grid = nodes[0].shape
    theta_i, theta_o, *phis = (x.reshape(-1) for x in nodes)
    phi_i, phi_o = phis if four else (0.0 * theta_i, phis[0])
    wanted = _places(np.stack([theta_i, phi_i, theta_o, phi_o], axis=-1), four, mirrored)
    places, values, spreads = _merged(
        _places(rows[known], four, mirrored), f[known], spread if spread is None else spread[known]
    )
    tree = KDTree(places)
    distance, nearest = tree.query(wanted)
    found = values[nearest]
    if len(places) > 1:
        usual = np.median(tree.query(places, k=2)[0][:, 1])
        near = distance <= 2.0 * usual
        if near.any():
            fit = RBFInterpolator(places, values, neighbors=min(NEIGHBOURS, len(places)), kernel="linear", degree=0)
            found[near] = fit(wanted[near])
        if outside == "missing":
            found[~near] = np.nan
    shape = (*grid, *f.shape[1:])
    spread = None if spreads is None else spreads[nearest].reshape(shape)
    return found.reshape(shape), spread, nearest.reshape(grid)


def _merged(
    places: np.ndarray, values: np.ndarray, spread: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Rows with those at the same place taken as their mean."""
    _, first, which = np.unique(np.round(places / SAME), axis=0, return_index=True, return_inverse=True)
    which = which.reshape(-1)
    if len(first) == len(places):
        return places, values, spread
    count = np.bincount(which).reshape(-1, *(1,) * (values.ndim - 1))
    mean = np.zeros((len(first), *values.shape[1:]))
    np.add.at(mean, which, values)
    if spread is not None:
        squares = np.zeros(mean.shape)
        np.add.at(squares, which, spread**2)
        spread = np.sqrt(squares) / count
    return places[first], mean / count, spread
