"""Values at the nodes of a grid of angles, interpolated between them: the class of most measurements and tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..arrays import frozen
from ..base.provenance import derived
from ..base.quantities import from_brdf, quantity_named, suspect_units, to_brdf
from ..declared.arguments import checked
from ..errors import ParameterError
from ..formula import tree
from ..formula.direction import HORIZON
from ..formula.fields import Ours, kept, option, table
from ..formula.fields import channels as channel_field
from ..formula.spectrum import between
from ..formula.state import Held, note, state
from . import dataset_layout
from ._lookup import Interpolated
from .axes import laid_out
from .drawing import KINDS

if TYPE_CHECKING:
    import xarray

INCIDENCES, OBLIQUE = 5, math.radians(75.0)
"""Angles of incidence of a rough albedo, and the largest: beyond, noise is divided by a small cosine."""


class Gridded(Interpolated):
    """Values at the nodes of a grid of angles, linear between them along every axis.

    `parameterization` names the system of angles of the axes (`angle_systems.SYSTEMS`). Nodes [rad] are increasing, of
    any spacing; three axes mean an isotropic material. Azimuths wrap with their period (2 pi unless `periods` has
    another: pi for phi_d of a reciprocal table); `mirrored`: the third axis covers half of its period, and the other
    half is the mirror image. Beyond the outermost nodes of the other axes, f is the outermost value (`outside`:
    "hold"), NaN ("missing") or 0 ("zero").
    Nodes without data (NaN) are left out and the weights of the others renormalized; f is NaN where these hold less
    than 1/1000 of the weight. `interpolation`: "nearest" takes the value of the nearest node instead of "linear".
    Values are interpolated as BRDFs.

    Sampling: see `Sampled`.

    Shapes   values, uncertainty: (grid...) or (grid..., C). f: (...) or (..., C).
    Units    f: 1/sr; `values` those of `quantity`, a name in `quantities.QUANTITIES`.
    Error    at nodes rounding; between nodes that of linear interpolation, which `gn.tables.tabulate` measures.
    Source   definition; angles of half_difference: Rusinkiewicz 1998, "A new change of variables for efficient BRDF
             representation".

    Example
    >>> axes = {"theta_i": [0.0, 0.8, 1.5], "theta_o": [0.0, 0.8, 1.5], "phi": [0.0, np.pi]}
    >>> m = gn.Gridded("angles", axes, np.full((3, 3, 2), 0.1))
    >>> print(m.f_angles(0.3, 0.0, 0.5, 1.0).round(4), gn.albedo(m, [0, 0, 1]).round(4))
    0.1 0.3141
    """

    format = "table"
    breaks: ClassVar[dict[str, str]] = {
        "positivity": "measured values are kept as they are, with noise around 0",
        "reciprocity": "a table holds every pair of directions on its own",
        "energy": "measured values, and interpolations between them, are kept as they are",
        "furnace": "measured values, and interpolations between them, are kept as they are",
        "grazing": "beyond the outermost nodes nothing is known",
    }

    interpolation = option("linear", "nearest", doc="between nodes, or the value of the nearest")
    outside = option("hold", "missing", "zero", doc="beyond the outermost nodes")
    stored = table("the values as given, by the axes and channel")
    channel = channel_field("number of the channel")

    uncertainty: np.ndarray | None = note()
    """Standard uncertainty of `stored`, or None."""
    is_mirrored: bool = state()
    """Whether the third axis covers half of its period, and the other half is its mirror image."""
    periods: dict[str, float] = note()

    @checked
    def __init__(
        self,
        parameterization: str,
        axes: Mapping[str, Any],
        values: Any,
        *,
        quantity: str = "brdf",
        uncertainty: Any = None,
        channels: Sequence[str | float] | None = None,
        mirrored: bool = False,
        periods: Mapping[str, float] | None = None,
        interpolation: str = "linear",
        outside: str = "hold",
        path: str = "",
        about: Mapping[str, Any] | None = None,
    ):
        stored = real("values", values)
        names = None if channels is None else tuple(channels)
        grid = self._lay_out(parameterization, axes, mirrored, periods or {}, names)
        _check_values("values", stored, grid, names)
        if uncertainty is not None:
            uncertainty = real("uncertainty", uncertainty)
            _check_values("uncertainty", uncertainty, grid, names)
        quantity_named(quantity)
        if not path:  # a file has been looked at by its reader
            suspect_units(quantity, stored, names)
        self._hold(uncertainty=uncertainty, quantity=quantity)
        super().__init__(
            path,
            dict(about or {}),
            interpolation=interpolation,
            outside=outside,
            stored=Ours(stored),
            channel=0.0 if names is None else len(names),
        )
        times_zero = "cos" in self.quantity and any((w[..., 2] <= HORIZON).any() for w in self.directions())
        self._hold(holes=bool(times_zero or not np.isfinite(stored).all()))

    def _lay_out(
        self,
        parameterization: str,
        axes: Mapping[str, Any],
        mirrored: bool,
        periods: Mapping[str, float],
        names: tuple | None,
    ) -> tuple[int, ...]:
        """The shape of the grid, after its axes and channels are set."""
        nodes = Held({name: frozen(real(f"axes: {name}", x).astype(float).reshape(-1)) for name, x in axes.items()})
        layout, all_periods = laid_out(parameterization, nodes, mirrored, periods)
        self._hold(
            parameterization=parameterization,
            axes=nodes,
            is_mirrored=bool(mirrored),
            periods=Held(all_periods),
            layout=layout,
            width=1 if names is None else len(names),
            channel_names=names,
        )
        return tuple(map(len, nodes.values()))

    @property
    def valid(self) -> np.ndarray:
        """True where there is a value; shape of `stored`.

        Example
        >>> axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0]}
        >>> m = gn.Gridded("angles", axes, np.array([[[0.1], [0.1]], [[np.nan], [0.1]]]))
        >>> print(m.valid.sum(), "of", m.valid.size)
        3 of 4
        """
        return np.isfinite(self.stored)

    def as_grid(self) -> Gridded:
        """Itself.

        Example
        >>> m = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
        >>> print(m.as_grid() is m)
        True
        """
        return self

    @property
    def data(self) -> xarray.Dataset:
        """As stored, in the layout of docs/data-model.md: `values`, `valid`, `uncertainty`, by the axes and channel.

        Example
        >>> axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0]}
        >>> m = gn.Gridded("angles", axes, np.full((2, 2, 1), 0.1))
        >>> print(dict(m.data.sizes), m.data.attrs["quantity"])
        {'theta_i': 2, 'theta_o': 2, 'phi': 1} brdf
        """
        own = {"mirrored": self.is_mirrored, "periods": self.periods, "interpolation": self.interpolation}
        return self._dataset(self.axes, list(self.axes), **own)

    def _dataset(self, axes: Mapping[str, np.ndarray], dims: Sequence[str], **own: Any) -> xarray.Dataset:
        """The numbers as stored along `dims`, with the attributes of all measurements and these."""
        return dataset_layout.dataset(
            axes,
            dims,
            self.stored,
            self.uncertainty,
            self.channel_names,
            parameterization=self.parameterization,
            quantity=self.quantity,
            **own,
            outside=self.outside,
            source=self.path,
            about=self.about,
            provenance=self.provenance,
        )

    @property
    def _oriented(self) -> bool:  # type: ignore[override]  # asked of the object
        """Whether there is an axis for the orientation of the sample."""
        return len(self.layout) == 4

    def directions(self) -> tuple[np.ndarray, np.ndarray]:
        """wi and wo (grid..., 3) at the nodes; z is below 0 where the grid goes below the horizon.

        Example
        >>> axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0]}
        >>> wi, wo = gn.Gridded("angles", axes, np.full((2, 2, 1), 0.1)).directions()
        >>> print(wi.shape, np.arccos(wi[1, 0, 0, 2]).round(4))
        (2, 2, 1, 3) 0.8
        """
        return self.system.directions(self.axes)

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes, shape of `stored`; NaN where there is no value, or only f times a cosine of 0 or less.

        Nodes below the horizon keep their f: between nodes on both sides it is interpolated.

        Example
        >>> axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0]}
        >>> m = gn.Gridded("angles", axes, np.full((2, 2, 1), 0.5), quantity="reflectance factor")
        >>> print(m.brdf().round(4).ravel())
        [0.1592 0.1592 0.1592 0.1592]
        """
        return self._as_brdf(self.stored)

    def brdf_uncertainty(self) -> np.ndarray | None:
        """Standard uncertainty of `brdf`.

        Example
        >>> axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0]}
        >>> m = gn.Gridded("angles", axes, np.full((2, 2, 1), 0.1), uncertainty=np.full((2, 2, 1), 0.002))
        >>> print(m.brdf_uncertainty().ravel())
        [0.002 0.002 0.002 0.002]
        """
        return None if self.uncertainty is None else self._as_brdf(self.uncertainty)

    def rough_albedo(self) -> float:
        """The largest albedo at some angles of incidence, by the trapezoidal rule between the nodes.

        Of grids of polar angles and azimuths. Angles without a value count as black.

        Example
        >>> axes = {"theta_i": [0.0, 0.8], "theta_o": np.linspace(0.0, np.pi / 2.0, 10), "phi": [0.0, np.pi]}
        >>> m = gn.Gridded("angles", axes, np.full((2, 10, 2), 0.25), mirrored=True)
        >>> print(round(m.rough_albedo(), 2))
        0.78
        """
        if self.parameterization != "angles":
            return math.nan
        theta_i, theta_o, *azimuths = self.axes
        count = max(1, int((self.axes[theta_i] <= OBLIQUE).sum()))
        some = np.unique(np.linspace(0, count - 1, INCIDENCES).astype(int))
        one = [slice(1)] * (len(azimuths) - 1)  # of the sample's orientations
        axes = {**self.axes, theta_i: self.axes[theta_i][some]}
        axes |= {name: axes[name][at] for name, at in zip(azimuths, one, strict=False)}
        wi, wo = self.system.directions(axes)
        stored = self.stored[(some, slice(None), *one)].reshape(*wi.shape[:-1], self.width)
        f = np.nan_to_num(to_brdf(self.quantity, stored, wi[..., 2:], wo[..., 2:]), posinf=0.0, neginf=0.0)
        phi = self.axes[azimuths[-1]]
        mean = (f * self._shares(phi)[:, None]).sum(axis=-2).reshape(len(some), -1, self.width)
        polar = self.axes[theta_o]
        y = mean * (np.sin(polar) * np.maximum(np.cos(polar), 0.0))[:, None]
        total = 2.0 * math.pi * (0.5 * (y[:, 1:] + y[:, :-1]) * np.diff(polar)[:, None]).sum(axis=1)
        return float(total.max())

    def _shares(self, phi: np.ndarray) -> np.ndarray:
        """The share of a turn that each azimuth stands for."""
        if self.is_mirrored:
            edges = np.concatenate([[0.0], 0.5 * (phi[1:] + phi[:-1]), [math.pi]])
        else:
            period = next(iter(self.periods.values()), 2.0 * math.pi)
            middle = 0.5 * (np.append(phi, phi[0] + period)[1:] + phi)
            edges = np.concatenate([[middle[-1] - period], middle])
        return np.diff(edges) / (edges[-1] - edges[0])

    def with_brdf(self, values: np.ndarray, uncertainty: np.ndarray | None = None, **about: Any) -> Gridded:
        """The same grid with other f [1/sr] at its nodes, stored in the same quantity; `about` is added to its own.

        Example
        >>> m = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
        >>> print(gn.albedo(m.with_brdf(0.5 * m.brdf(), comment="dimmed"), [0, 0, 1]).round(4))
        0.25
        """
        f, u = Ours(self._converted(real("values", values), from_brdf)), None
        if uncertainty is not None:
            u = Ours(self._converted(real("uncertainty", uncertainty), from_brdf))
        return self.with_table(f, u, about={**self.about, **about})

    def with_table(self, values: Any, uncertainty: Any = None, **other: Any) -> Gridded:
        """A table like this one with other `values`, and with the arguments of `Gridded` that `other` names; its
        `provenance` says which file this one was read from.

        Example
        >>> axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0]}
        >>> m = gn.Gridded("angles", axes, np.full((2, 2, 1), 0.5))
        >>> print(m.with_table(m.stored, quantity="reflectance factor").brdf().round(4).ravel())
        [0.1592 0.1592 0.1592 0.1592]
        """
        like_this = Gridded(values=values, uncertainty=uncertainty, **{**self._arguments(), **other})
        return tree.with_notes(like_this, provenance=derived(self))

    def _arguments(self) -> dict[str, Any]:
        """The arguments of `Gridded` that made this table, but for the numbers in it."""
        same = ("parameterization", "axes", "quantity", "periods", "interpolation", "outside", "path", "about")
        renamed = {"channels": self.channel_names, "mirrored": self.is_mirrored}
        return {**{name: getattr(self, name) for name in same}, **renamed}

    def redrawn(self, values: np.ndarray) -> Gridded:
        """As `with_brdf`, but with this table's tables of sampling, which take longer to make than an integral.

        For many tables of much the same f with data at the same nodes; f is that of `with_brdf`.

        Example
        >>> m = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
        >>> print(gn.albedo(m.redrawn(0.5 * m.brdf()), [0, 0, 1]).round(4))
        0.25
        """
        table = self.with_brdf(values)
        return table._changed({}, {**table._looked_up(), **{name: self._kept[name] for name in KINDS}})

    def _as_brdf(self, values: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):
            return self._converted(np.where(np.isfinite(values), values, np.nan), to_brdf)

    def _converted(self, values: np.ndarray, convert: Any) -> np.ndarray:
        if self.quantity == "brdf":
            return np.asarray(values, dtype=float)
        wi, wo = self.directions()
        cosines = [w[..., 2] if self.channel_names is None else w[..., 2, None] for w in (wi, wo)]
        return convert(self.quantity, values, *cosines)

    def _between(self, known: np.ndarray, wavelengths: Any) -> Any:
        # Neighbouring wavelengths err alike, so that standard uncertainties are interpolated as values are.
        u = None if self.uncertainty is None else Ours(between(self.uncertainty, known, wavelengths))
        names = tuple(map(float, wavelengths)) if np.ndim(wavelengths) else None
        return self._with_stored(Ours(between(self.stored, known, wavelengths)), u, channels=names)

    def _with_stored(self, values: Any, uncertainty: Any, **other: Any) -> Gridded:
        """A measurement at the same pairs with other values, uncertainties and arguments."""
        return self.with_table(values, uncertainty, **other)

    def _key(self) -> tuple:
        compared = ("parameterization", "quantity", "is_mirrored", "periods", "channel_names", "uncertainty")
        nodes = ((f"nodes of {name}", x) for name, x in self.axes.items())
        values = ((name, getattr(self, name)) for name in compared)
        return (*super()._key(), *nodes, *(pair for pair in values if pair[1] is not None))

    def __repr__(self) -> str:
        if self.path:
            return super().__repr__()
        size = " x ".join(str(len(x)) for x in self.axes.values())
        made_of = f" of {self.about['made_of']:.200}" if "made_of" in self.about else ""
        return f"<{self.parameterization} table of {size} nodes{made_of}>"


def _check_values(what: str, values: np.ndarray, grid: tuple[int, ...], names: tuple | None) -> None:
    expected = grid if names is None else (*grid, len(names))
    if values.shape != expected:
        raise ParameterError(f"{what}: got shape {values.shape}, expected {expected}: nodes of the axes, and channels")
    if names is not None and not names:
        raise ParameterError("channels: got none, expected names or wavelengths [nm]; None for values without channels")


def real(what: str, values: Any) -> np.ndarray:
    """A read-only array of floats; single and double precision stay as they are."""
    try:
        array = kept(values)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{what}: got {error}; expected an array of numbers") from None
    return array if array.dtype in (np.float32, np.float64) else frozen(array.astype(np.float64))
