"""Measurements in no grid: kept as the rows they are, looked up in a grid that is interpolated from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .errors import ParameterError
from .gridded import Gridded
from .interface import direction
from .measurement import quantity_named, to_brdf

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
    residual: Residual
    rows: np.ndarray
    """Angles (n, 4) [rad]: theta_i, phi_i, theta_o, phi_o."""
    measured: np.ndarray
    """The values of the rows, as given, in `quantity`."""
    measured_uncertainty: np.ndarray | None
    """Their standard uncertainty."""

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
        f = _brdf(quantity, rows, measured)
        four = _oriented(rows) if isotropic is None else not isotropic
        axes, mirrored = _grid(rows, four)
        nodes, uncertain = _interpolated(rows, f, _brdf(quantity, rows, spread), axes, four, mirrored, outside)
        super().__init__(
            "angles",
            axes,
            nodes,
            uncertainty=uncertain,
            channels=channels,
            mirrored=mirrored,
            path=path,
            about=about,
        )
        self.__dict__.update(
            rows=rows, measured=measured, measured_uncertainty=spread, quantity=quantity_named(quantity)
        )
        self.__dict__["residual"] = _residual(self, rows, f)

    @property
    def valid(self) -> np.ndarray:
        """True where a row has a value; shape of `measured`."""
        return np.isfinite(self.measured)

    @property
    def data(self) -> xarray.Dataset:
        """`values` by row (and channel or wavelength), as given, with the angles [rad] of each row."""
        import xarray

        dims: list[str] = ["row"]
        axes: dict[str, Any] = {n: ("row", x, {"units": "rad"}) for n, x in zip(ANGLES, self.rows.T, strict=True)}
        if self.channel_names is not None:
            spectral = not isinstance(self.channel_names[0], str)
            dims.append("wavelength" if spectral else "channel")
            axes[dims[-1]] = (dims[-1], list(self.channel_names), {"units": "nm"} if spectral else {})
        units = {"units": "1" if self.quantity == "reflectance factor" else "sr-1"}
        held = {"values": (dims, self.measured, {**units, "long_name": self.quantity})}
        if self.measured_uncertainty is not None:
            held["uncertainty"] = (dims, self.measured_uncertainty, {**units, "long_name": "standard uncertainty"})
        return xarray.Dataset(held, axes, {"quantity": self.quantity, "source": self.path})

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes of the grid."""
        return np.asarray(self.stored, dtype=float)

    def brdf_uncertainty(self) -> np.ndarray | None:
        """Standard uncertainty of `brdf`."""
        return self.uncertainty

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
        spread = () if self.measured_uncertainty is None else (("spread", self.measured_uncertainty),)
        return (*super()._key(), ("rows", self.rows), ("measured", self.measured), *spread)

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

    Where a polar angle is 0 one row stands for all azimuths. With azimuths on one side of the plane of incidence only
    (0 to pi) the grid of an isotropic material is mirrored.
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
        return Scattered(*rows.T, measured, uncertainty=spread, isotropic=not four, **more)
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


def _brdf(quantity: str, rows: np.ndarray, values: np.ndarray | None) -> Any:
    if values is None:
        return None
    cosines = [np.cos(rows[:, k]) if values.ndim == 1 else np.cos(rows[:, k, None]) for k in (0, 2)]
    return to_brdf(quantity, np.where(np.isfinite(values), values, np.nan), *cosines)


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
    azimuths = [_turned(phi_i), _turned(phi_o)] if four else [_turned(phi_o - phi_i)]
    poles = [(theta_i, theta_o)] if not four else [(theta_i,), (theta_o,)]
    sets = []
    for phi, polar in zip(azimuths, poles, strict=True):
        free = np.any([theta <= SAME for theta in polar], axis=0)
        sets.append((phi, free, _distinct(phi[~free]) if (~free).any() else np.zeros(1)))
    axes = [_distinct(theta_i), _distinct(theta_o), *(nodes for _, _, nodes in sets)]
    size = math.prod(map(len, axes))
    if size > 4 * len(rows) + 64:
        return None
    index = np.full(tuple(map(len, axes)), -1)
    for row, (i, o) in enumerate(zip(_of(axes[0], theta_i), _of(axes[1], theta_o), strict=True)):
        at = [slice(None) if free[row] else int(_of(nodes, phi[row])) for phi, free, nodes in sets]
        if (index[(i, o, *at)] >= 0).any():
            return None
        index[(i, o, *at)] = row
    if (index < 0).any():
        return None
    one_side = not four and len(axes[2]) > 1 and axes[2][-1] <= math.pi + SAME and axes[2][0] <= SAME
    return axes, index, bool(one_side)


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
) -> tuple[np.ndarray, np.ndarray | None]:
    """f at the nodes of a grid (grid...[, C]), and its standard uncertainty: that of the nearest row."""
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import KDTree

    known = np.isfinite(f if f.ndim == 1 else f.sum(axis=-1))
    if not known.any():
        raise ParameterError("values: none of the rows holds a number; expected at least one measurement")
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
    return found.reshape(shape), None if spreads is None else spreads[nearest].reshape(shape)


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


def _residual(m: Gridded, rows: np.ndarray, f: np.ndarray) -> Residual:
    wi, wo = direction(rows[:, 0], rows[:, 1]), direction(rows[:, 2], rows[:, 3])
    off = np.abs(m.f(wi, wo) - f) / np.nanmean(np.abs(f))
    off = off[np.isfinite(off)]
    return Residual(float(np.sqrt(np.mean(off**2))), float(off.max())) if off.size else Residual(math.nan, math.nan)
