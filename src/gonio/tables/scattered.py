"""Measurements in no grid: rows of angles and values, looked up in a grid that is interpolated from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from ..arrays import frozen
from ..base.angles import direction
from ..base.measured import Measured
from ..base.provenance import derived as derived_from
from ..base.quantities import quantity_named, suspect_units, to_brdf
from ..declared.arguments import checked
from ..errors import ParameterError
from ..formula import tree
from ..formula.fields import Ours
from ..formula.state import derived, freeze, note
from . import dataset_layout
from .angle_systems import SYSTEMS
from .gridded import Gridded, real
from .interpolation import Rows, interpolated
from .rows import ROW_ANGLES, SAME, as_grid, grid_for, oriented

if TYPE_CHECKING:
    import xarray


class Residual(NamedTuple):
    """Difference of the grid from its rows, relative to the mean f: root mean square, and largest."""

    rms: float
    largest: float


class Scattered(Gridded):
    """Measurements at any pairs of directions, n rows of angles and values.

    Looked up in a grid of angles: at its nodes, f is interpolated from the 24 nearest rows by radial basis functions
    (|r|, exact at rows), over the projections of both directions on the surface; between nodes linearly. A node further
    from all rows than twice the usual distance between rows (of 10 000 of them, about) has the value of the nearest row
    if `outside` is "hold", and none if it is "missing". If light came from one azimuth only, the material counts as
    isotropic: rows are turned together with wi, and, if all lie in the plane of incidence or on one side of it,
    mirrored at it. Each channel is interpolated from the rows with a number in it; NaN where none has.

    Shapes   theta_i, phi_i, theta_o, phi_o: (n,); values, uncertainty: (n,) or (n, C).
    Units    angles: rad; f: 1/sr; values: those of `quantity`.
    Error    of the grid at the rows, in `residual`; rows that repeat a pair of directions count as their mean.
    Source   `scipy.interpolate.RBFInterpolator`; Wahba 1990, "Spline Models for Observational Data", SIAM.

    Example
    >>> theta_o = np.linspace(0.0, 1.4, 15)
    >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), 0.1 + 0.1 * theta_o)
    >>> print(m.f_angles(0.5, 0.0, [0.3, 0.75], np.pi).round(4))
    [0.13  0.175]
    """

    format = "rows"
    rows: np.ndarray = note()
    """Angles (n, 4) [rad]: theta_i, phi_i, theta_o, phi_o."""

    @checked
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
        if not np.isfinite(measured).any():
            raise ParameterError("values: none of the rows holds a number; expected at least one measurement")
        axes, mirrored = grid_for(rows, oriented(rows) if isotropic is None else not isotropic)
        names = None if channels is None else tuple(channels)
        quantity_named(quantity)
        if not path:  # a file has been looked at by its reader
            suspect_units(quantity, measured, names)
        self._lay_out("angles", axes, mirrored, {}, names)
        self._hold(rows=rows, uncertainty=spread, quantity=quantity, holes=outside == "missing")
        Measured.__init__(
            self,
            path,
            dict(about or {}),
            outside=outside,
            stored=Ours(measured),
            channel=0.0 if names is None else len(names),
        )

    @derived
    def nodes(self) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
        """f [1/sr] at the nodes of the grid, its standard uncertainty, and the number of the nearest row.

        Example
        >>> theta_o = np.linspace(0.0, 1.4, 15)
        >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), 0.1 + 0.1 * theta_o)
        >>> f, uncertainty, nearest = m.nodes
        >>> print(f.shape == nearest.shape, uncertainty)
        True None
        """
        f, u = self.row_brdf()
        rows = Rows(self.rows, f, u, tree.is_oriented(self), self.is_mirrored, self.outside)
        nodes: tuple = freeze(interpolated(rows, self.axes))
        return nodes

    @derived
    def residual(self) -> Residual:
        """Difference of the grid from the rows.

        Example
        >>> theta_o = np.linspace(0.0, 1.4, 15)
        >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), 0.1 + 0.1 * theta_o)
        >>> print(m.residual.largest < 0.01)
        True
        """
        true, _ = self.row_brdf()
        wi, wo = (direction(self.rows[:, k], self.rows[:, k + 1]) for k in (0, 2))
        off = np.abs(self.f(wi, wo) - true) / np.nanmean(np.abs(true))
        off = off[np.isfinite(off)]
        return Residual(float(np.sqrt(np.mean(off**2))), float(off.max())) if off.size else Residual(math.nan, math.nan)

    def rough_albedo(self) -> float:
        """The albedo of a matt surface as bright as nine tenths of the rows are at least: most scans are of peaks.

        Example
        >>> theta_o = np.linspace(0.0, 1.4, 15)
        >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), np.full(15, 0.1))
        >>> print(round(m.rough_albedo(), 2))
        0.31
        """
        f = self.row_brdf()[0]
        f = f[np.isfinite(f)]
        return math.pi * float(np.quantile(f, 0.1)) if f.size else math.nan

    def _replaced(self, grouped: dict[str, Any]) -> Self:
        """A copy with other fields; another `outside` needs another grid."""
        if grouped.get("outside", self.outside) == self.outside:
            return super()._replaced(grouped)
        other = self._made_of()  # of this class, whose own constructor may take the rows of a file
        Scattered.__init__(other, **{**self._arguments_of_rows(), "outside": grouped["outside"]})
        attributes = self.__dict__
        other._hold(**{n: attributes[n] for n in self._beside if n in attributes and n not in other.__dict__})
        return other._replaced(grouped)

    def _with_stored(self, values: Any, uncertainty: Any, **other: Any) -> Gridded:
        new = Scattered(**{**self._arguments_of_rows(), "values": values, "uncertainty": uncertainty, **other})
        return tree.with_notes(new, provenance=derived_from(self))

    def _arguments_of_rows(self) -> dict[str, Any]:
        """The arguments of `Scattered` that made this."""
        same = ("quantity", "uncertainty", "outside", "path", "about")
        renamed = {"values": self.stored, "channels": self.channel_names, "isotropic": not tree.is_oriented(self)}
        rows = dict(zip(ROW_ANGLES, self.rows.T, strict=True))
        return {**rows, **{name: getattr(self, name) for name in same}, **renamed}

    def row_brdf(self) -> tuple[np.ndarray, np.ndarray | None]:
        """f [1/sr] of the rows, (n,) or (n, C), and its standard uncertainty.

        Example
        >>> theta_o = np.linspace(0.0, 1.4, 15)
        >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), 0.1 + 0.1 * theta_o)
        >>> f, uncertainty = m.row_brdf()
        >>> print(f[:3].round(3))
        [0.1  0.11 0.12]
        """
        cosines = [np.cos(self.rows[:, k] if self.stored.ndim == 1 else self.rows[:, k, None]) for k in (0, 2)]
        values = (None if x is None else np.where(np.isfinite(x), x, np.nan) for x in (self.stored, self.uncertainty))
        f, u = (None if x is None else to_brdf(self.quantity, x, *cosines) for x in values)
        assert f is not None
        return f, u

    @property
    def data(self) -> xarray.Dataset:
        """As given, in the layout of docs/data-model.md: `values`, `valid`, `uncertainty`, angles by measurement.

        Example
        >>> theta_o = np.linspace(0.0, 1.4, 15)
        >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), 0.1 + 0.1 * theta_o)
        >>> print(dict(m.data.sizes))
        {'measurement': 15}
        """
        rows = dict(zip(ROW_ANGLES, self.rows.T, strict=True))
        return self._dataset(rows, [dataset_layout.ROW], isotropic=not tree.is_oriented(self))

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes of the grid.

        Example
        >>> theta_o = np.linspace(0.0, 1.4, 15)
        >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), 0.1 + 0.1 * theta_o)
        >>> print(m.brdf().shape == tuple(len(nodes) for nodes in m.axes.values()))
        True
        """
        return self.nodes[0]

    def brdf_uncertainty(self) -> np.ndarray | None:
        """Standard uncertainty of `brdf`.

        Example
        >>> theta_o = np.linspace(0.0, 1.4, 15)
        >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), 0.1 + 0.1 * theta_o)
        >>> print(m.brdf_uncertainty())
        None
        """
        return self.nodes[1]

    def with_brdf(self, values: np.ndarray, uncertainty: np.ndarray | None = None, **about: Any) -> Gridded:
        """The grid, without its rows, with other f [1/sr] at its nodes.

        Example
        >>> theta_o = np.linspace(0.0, 1.4, 15)
        >>> m = gn.Scattered(np.full(15, 0.5), np.zeros(15), theta_o, np.full(15, np.pi), 0.1 + 0.1 * theta_o)
        >>> print(m.with_brdf(0.5 * m.brdf()).f_angles(0.5, 0.0, 0.3, np.pi).round(4))
        0.065
        """
        return self.with_table(values, uncertainty, quantity="brdf", about={**self.about, **about})

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
    uncertainty: Any = None,
    channels: Sequence[str | float] | None = None,
    isotropic: bool | None = None,
    **others: Any,
) -> Gridded:
    """Rows (n,) of angles [rad] with their values: a `Gridded` if they are the nodes of a grid of `angles`, each once,
    else `Scattered`. `others`: further arguments of both, which are quantity, outside, path and about.

    Where a polar angle is 0, one row stands for all azimuths, or there is one for each. If all azimuths of an isotropic
    material are on one side of the plane of incidence (0 to pi), its grid is mirrored.
    """
    rows, measured, spread = _rows((theta_i, phi_i, theta_o, phi_o), values, uncertainty, channels)
    four = oriented(rows) if isotropic is None else not isotropic
    others["channels"] = channels
    grid = as_grid(rows, four)
    if grid is None:
        columns = dict(zip(ROW_ANGLES, rows.T, strict=True))
        return Scattered(**columns, values=measured, uncertainty=spread, isotropic=not four, **others)
    nodes, index, mirrored = grid
    axes = dict(zip(SYSTEMS["angles"].axes(four), nodes, strict=True))
    u = None if spread is None else spread[index]
    return Gridded("angles", axes, measured[index], uncertainty=u, mirrored=mirrored, **others)


def _rows(
    angles: Sequence[Any], values: Any, uncertainty: Any, channels: Sequence | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Angles (n, 4), values and uncertainties, checked."""
    measured = _double("values", values)
    n = len(measured) if measured.ndim else 0
    if n == 0:
        raise ParameterError("values: got no rows, expected at least one measurement")
    expected = (n,) if channels is None else (n, len(channels))
    if measured.shape != expected:
        raise ParameterError(f"values: got shape {measured.shape}, expected {expected}: rows, and channels")
    columns = [_double(name, a) for name, a in zip(ROW_ANGLES, angles, strict=True)]
    fitting = all(a.shape in ((), (1,), (n,)) for a in columns)
    rows = np.stack(np.broadcast_arrays(*columns, np.zeros(n))[:4], axis=-1) if fitting else np.zeros(0)
    if not fitting or not np.isfinite(rows).all():
        raise ParameterError(f"angles: expected {n} finite numbers [rad] each of {', '.join(ROW_ANGLES)}")
    for k in (0, 2):
        low, high = rows[:, k].min(), rows[:, k].max()
        if low < -SAME or high > 0.5 * math.pi + SAME:
            raise ParameterError(
                f"{ROW_ANGLES[k]}: from {low:g} to {high:g}, expected 0 to pi/2 rad; convert degrees with "
                f"numpy.radians, and turn a negative polar angle into a positive one on the other side"
            )
    for k in (1, 3):
        largest = np.abs(rows[:, k]).max()
        if largest > 4.0 * math.pi:
            raise ParameterError(
                f"{ROW_ANGLES[k]}: up to {largest:g}, expected at most two turns, 4 pi rad; convert degrees with "
                f"numpy.radians"
            )
    spread = None
    if uncertainty is not None:
        u = _double("uncertainty", uncertainty)
        try:
            spread = frozen(np.array(np.broadcast_to(u, expected)))
        except ValueError:
            raise ParameterError(f"uncertainty: got shape {u.shape}, expected {expected} or a number") from None
    return frozen(rows), frozen(measured), spread


def _double(what: str, values: Any) -> np.ndarray:
    return real(what, values).astype(float, copy=False)
