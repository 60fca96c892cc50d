"""Measurements in no grid: kept as the rows they are, looked up in a grid that is interpolated from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from ..arrays import frozen, ops
from ..base.angles import direction
from ..base.measured import Measured
from ..base.quantities import quantity_named, to_brdf
from ..errors import ParameterError
from ..formula.fields import Ours
from ..formula.state import derived, note
from . import dataset_layout
from .angle_systems import SYSTEMS
from .gridded import Gridded
from .interpolation import interpolated
from .rows import ROW_ANGLES, SAME, as_grid, grid_for, oriented

if TYPE_CHECKING:
    import xarray


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
    together with wi, and, if all lie in the plane of incidence or on one side of it, mirrored at it. Each channel is
    interpolated from the rows that have a number in it; NaN where none has.

    Shapes   theta_i, phi_i, theta_o, phi_o: (n,); values, uncertainty: (n,) or (n, C).
    Units    angles: rad; f: 1/sr; values: those of `quantity`.
    Error    of the grid against the rows, in `residual`; rows that repeat a pair of directions count as their mean.
    Source   `scipy.interpolate.RBFInterpolator`; Wahba 1990, "Spline Models for Observational Data", SIAM.
    """

    format = "rows"
    rows: np.ndarray = note()
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
        if not np.isfinite(measured).any():
            raise ParameterError("values: none of the rows holds a number; expected at least one measurement")
        axes, mirrored = grid_for(rows, oriented(rows) if isotropic is None else not isotropic)
        names = None if channels is None else tuple(channels)
        self._lay_out("angles", axes, mirrored, {}, names)
        self._hold(rows=rows, uncertainty=spread, quantity=quantity_named(quantity), holes=outside == "missing")
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
        """f [1/sr] at the nodes of the grid, its standard uncertainty, and the number of the nearest measurement."""
        spread = None if self.uncertainty is None else self._of_rows(self.uncertainty)
        f = self._of_rows(self.stored)
        found = interpolated(self.rows, f, spread, self.axes, self.is_oriented(), self.is_mirrored, self.outside)
        for array in found:
            if array is not None:
                frozen(array)
        return found

    @derived
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
        made = type(self)(
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
        )
        return made.with_notes(provenance=self.provenance)._replaced(grouped)

    def _of_rows(self, values: np.ndarray) -> np.ndarray:
        """Values or uncertainties of the rows as BRDFs."""
        cosines = [np.cos(self.rows[:, k]) if values.ndim == 1 else np.cos(self.rows[:, k, None]) for k in (0, 2)]
        return to_brdf(self.quantity, np.where(np.isfinite(values), values, np.nan), *cosines)

    @property
    def data(self) -> xarray.Dataset:
        """As given, in the layout of docs/data-model.md: `values`, `valid`, `uncertainty`, angles by measurement."""
        return dataset_layout.described(
            dict(zip(ROW_ANGLES, self.rows.T, strict=True)),
            [dataset_layout.ROW],
            self.stored,
            self.uncertainty,
            self.channel_names,
            parameterisation=self.parameterisation,
            quantity=self.quantity,
            isotropic=not self.is_oriented(),
            outside=self.outside,
            source=self.path,
            **dataset_layout.known(self.about, self.provenance),
        )

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes of the grid."""
        return self.nodes[0]

    def brdf_uncertainty(self) -> np.ndarray | None:
        """Standard uncertainty of `brdf`."""
        return self.nodes[1]

    def with_brdf(self, values: np.ndarray, uncertainty: np.ndarray | None = None, **about: Any) -> Gridded:
        """The grid, without its rows, with other f [1/sr] at its nodes."""
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
    **known: Any,
) -> Gridded:
    """Rows (n,) of angles [rad] with their values: a `Gridded` if they are the nodes of a grid of `angles`, each once,
    else `Scattered`. `known`: the other arguments of both: quantity, outside, path, about.

    Where a polar angle is 0 one row stands for all azimuths, or there is one for each. With azimuths on one side of
    the plane of incidence only (0 to pi) the grid of an isotropic material is mirrored.
    """
    rows, measured, spread = _rows((theta_i, phi_i, theta_o, phi_o), values, uncertainty, channels)
    four = oriented(rows) if isotropic is None else not isotropic
    known["channels"] = channels
    grid = as_grid(rows, four)
    if grid is None:
        theta_i, phi_i, theta_o, phi_o = rows.T
        return Scattered(theta_i, phi_i, theta_o, phi_o, measured, uncertainty=spread, isotropic=not four, **known)
    nodes, index, mirrored = grid
    return Gridded(
        "angles",
        dict(zip(SYSTEMS["angles"].axes(four), nodes, strict=True)),
        measured[index],
        uncertainty=None if spread is None else spread[index],
        mirrored=mirrored,
        **known,
    )


def _rows(
    angles: Sequence[Any], values: Any, uncertainty: Any, channels: Sequence | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Angles (n, 4), values and uncertainties, checked."""
    held = _real("values", values)
    n = len(held) if held.ndim else 0
    if n == 0:
        raise ParameterError("values: got no rows, expected at least one measurement")
    expected = (n,) if channels is None else (n, len(channels))
    if held.shape != expected:
        raise ParameterError(f"values: got shape {held.shape}, expected {expected}: rows, and channels")
    columns = [_real(name, a) for name, a in zip(ROW_ANGLES, angles, strict=True)]
    rows = np.stack(np.broadcast_arrays(*columns, np.zeros(n))[:4], axis=-1)
    if rows.shape != (n, 4) or not np.isfinite(rows).all():
        raise ParameterError(f"angles: expected {n} finite numbers [rad] each of {', '.join(ROW_ANGLES)}")
    for k in (0, 2):
        low, high = rows[:, k].min(), rows[:, k].max()
        if low < -SAME or high > 0.5 * math.pi + SAME:
            raise ParameterError(
                f"{ROW_ANGLES[k]}: from {low:g} to {high:g}, expected 0 to pi/2 rad; convert degrees with "
                f"numpy.radians, and turn a negative polar angle into a positive one on the other side"
            )
    spread = None
    if uncertainty is not None:
        spread = frozen(np.array(np.broadcast_to(_real("uncertainty", uncertainty), expected)))
    return frozen(rows), frozen(held), spread


def _real(what: str, values: Any) -> np.ndarray:
    """A copy, in double precision."""
    try:
        return np.array(ops.numbers(values), dtype=float)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{what}: got {error}; expected an array of numbers") from None
