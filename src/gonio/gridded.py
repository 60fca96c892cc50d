"""Values at the nodes of a grid of angles, interpolated: what most measurements and tables are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from . import ops, schema
from .errors import ParameterError
from .geometry import HORIZON, Direction
from .libraries import Fixed
from .marginal_warp import Slices, bracket
from .measurement import from_brdf, quantity_named, to_brdf
from .param import channels as channel_field
from .param import option, table
from .parameterisations import Parameterisation, parameterisation
from .sampled import KINDS, Sampled

if TYPE_CHECKING:
    import xarray

INSIDE = 1e-6
"""How far [rad] a direction may be beyond the outermost nodes and still count as between them."""

LEAST_KNOWN = 1e-3
"""Below this share of the weights among nodes with data, f is NaN."""


class _Axis(NamedTuple):
    """How an angle becomes a position among the nodes of an axis.

    spacing   "even", "even in square root", or "uneven": looked up
    start     first node, and what one step is, of even ones
    size      nodes, with the one that closes the circle
    period    of azimuths, else 0
    """

    spacing: str
    start: float
    step: float
    size: int
    period: float
    mirrored: bool
    first: float
    last: float


class Gridded(Sampled):
    """Values at the nodes of a grid of angles, linear between them along every axis.

    angles            theta_i, theta_o, phi = phi_o - phi_i; or theta_i, theta_o, phi_i, phi_o
    relative          theta_i, theta_o, phi; or with phi_i
    half_difference   theta_h, theta_d, phi_d; or with phi_h (Rusinkiewicz)
    specular          theta_i, radial, azimuth of wo about the mirror direction of wi; or with phi_i

    See `parameterisations.PARAMETERISATIONS`. Nodes [rad] are increasing, of any spacing; three axes mean an isotropic
    material. Azimuths wrap with their period (2 pi unless `periods` has another: pi for phi_d of a reciprocal table);
    `mirrored`: the third axis covers half of it, and the other half is its mirror image. Below the first node and above
    the last of another axis, `outside` says what f is: "hold" (the outermost value), "missing" (NaN) or "zero".
    Nodes without data (NaN) are left out and the weights of the others renormalised; f is NaN where these hold less
    than 1/1000 of the weight. "nearest" takes the value of the nearest node instead. Values are interpolated as BRDFs.

    Sampling: see `Sampled`.

    Shapes   values, uncertainty: (grid...) or (grid..., C). f: (...) or (..., C).
    Units    f: 1/sr; `values` those of `quantity`, a name in `measurement.QUANTITIES`.
    Error    at nodes rounding; between them that of linear interpolation, which depends on the data: `gn.tabulate`
             measures it.
    Source   definition; angles of half_difference: Rusinkiewicz 1998, "A new change of variables for efficient BRDF
             representation".
    """

    format = "table"
    breaks: ClassVar[dict[str, str]] = {
        "positivity": "measured values are kept as they are, with noise around 0",
        "reciprocity": "a table holds every pair of directions on its own",
        "energy": "measured values, and what is interpolated between them, are kept as they are",
        "furnace": "measured values, and what is interpolated between them, are kept as they are",
        "grazing": "beyond the outermost nodes nothing is known",
    }

    interpolation = option("linear", "nearest", doc="between nodes, or the value of the nearest")
    outside = option("hold", "missing", "zero", doc="beyond the outermost nodes")
    stored = table("the values as given, by the axes and channel")
    channel = channel_field("number of the channel")

    parameterisation: str
    """What the axes are."""
    axes: dict[str, np.ndarray]
    """Nodes [rad] of each axis, as given."""
    uncertainty: np.ndarray | None
    """Standard uncertainty of `stored`, or None."""
    is_mirrored: bool
    """Whether the third axis covers half of its period, and the other half is its mirror image."""
    periods: dict[str, float]
    values: Any  # what formulas look up, of bound materials only
    layout: tuple[_Axis, ...]
    width: int
    holes: bool

    def __init__(
        self,
        parameterisation: str,
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
        stored = _real(values)
        names = None if channels is None else tuple(channels)
        grid = self._lay_out(parameterisation, axes, mirrored, periods or {}, names)
        _check_values("values", stored, grid, names)
        if uncertainty is not None:
            uncertainty = _real(uncertainty).view()
            uncertainty.flags.writeable = False
            _check_values("uncertainty", uncertainty, grid, names)
        self.__dict__.update(uncertainty=uncertainty, quantity=quantity_named(quantity))
        super().__init__(
            path,
            dict(about or {}),
            interpolation=interpolation,
            outside=outside,
            stored=stored,
            channel=0.0 if names is None else len(names),
        )
        self.__dict__["holes"] = not np.isfinite(stored).all() or self._is_undetermined()

    def _is_undetermined(self) -> bool:
        """Whether f does not follow from what is stored at some nodes: where it was multiplied by a cosine of 0."""
        if "cos" not in self.quantity:
            return False
        return any((w[..., 2] <= HORIZON).any() for w in self.directions())

    def _lay_out(
        self,
        parameterisation: str,
        axes: Mapping[str, Any],
        mirrored: bool,
        periods: Mapping[str, float],
        names: tuple | None,
    ) -> tuple[int, ...]:
        """Set what the grid is; its shape."""
        held = {name: np.array(nodes, dtype=float).reshape(-1) for name, nodes in axes.items()}
        turning = _check_axes(parameterisation, held, mirrored)
        given = {name: float(periods.get(name, 2.0 * math.pi)) for name in turning}
        if unknown := set(periods) - set(given):
            raise ParameterError(f"periods={dict(periods)!r}: {unknown} are no azimuths; expected {list(given)}")
        layout = [_axis(n, x, given.get(n, 0.0), mirrored and k == 2) for k, (n, x) in enumerate(held.items())]
        self.__dict__.update(
            parameterisation=parameterisation,
            axes=held,
            is_mirrored=bool(mirrored),
            periods=given,
            layout=tuple(layout),
            width=1 if names is None else len(names),
            channel_names=names,
        )
        return tuple(map(len, held.values()))

    @property
    def valid(self) -> np.ndarray:
        """True where there is a value; shape of `stored`."""
        return np.isfinite(self.stored)

    @property
    def data(self) -> xarray.Dataset:
        """As stored, in the layout of docs/data-model.md: `values`, `valid`, `uncertainty`, by the axes and channel."""
        return schema.described(
            self.axes,
            list(self.axes),
            self.stored,
            self.uncertainty,
            self.channel_names,
            parameterisation=self.parameterisation,
            quantity=self.quantity,
            mirrored=self.is_mirrored,
            periods=self.periods,
            interpolation=self.interpolation,
            outside=self.outside,
            source=self.path,
            **schema.known(self.about, self.provenance),
        )

    @property
    def kind(self) -> Parameterisation:
        """What the axes are."""
        return parameterisation(self.parameterisation)

    def is_oriented(self) -> bool:
        """Whether there is an axis for the orientation of the sample."""
        return len(self.axes) == 4

    def directions(self) -> tuple[np.ndarray, np.ndarray]:
        """wi and wo (grid..., 3) at the nodes; a component z below 0 where the grid goes below the horizon."""
        return self.kind.pairs(*np.meshgrid(*self.axes.values(), indexing="ij"))

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes, shape of `stored`; NaN where there is no value, or one of a direction below ground."""
        return self._as_brdf(self.stored)

    def brdf_uncertainty(self) -> np.ndarray | None:
        """Standard uncertainty of `brdf`."""
        return None if self.uncertainty is None else self._as_brdf(self.uncertainty)

    def with_brdf(self, values: np.ndarray, uncertainty: np.ndarray | None = None, **about: Any) -> Gridded:
        """The same grid with other f [1/sr] at its nodes, kept in the same quantity; `about` is added to its own."""
        converted = [None if v is None else self._converted(v, from_brdf) for v in (values, uncertainty)]
        return Gridded(
            self.parameterisation,
            self.axes,
            converted[0],
            quantity=self.quantity,
            uncertainty=converted[1],
            channels=self.channel_names,
            mirrored=self.is_mirrored,
            periods=self.periods,
            interpolation=self.interpolation,
            outside=self.outside,
            path=self.path,
            about={**self.about, **about},
        )

    def redrawn(self, values: np.ndarray) -> Gridded:
        """As `with_brdf`, for many tables of much the same f with data at the same nodes: with this one's tables of
        sampling and compiled formulas, which take longer to make than an integral. f is what `with_brdf` gives.
        """
        found = self.with_brdf(values)
        found.__dict__["_kept"] = {**found._looked_up(), **{name: self._kept[name] for name in KINDS}}
        if found.holes == self.holes:
            found.__dict__["_identity"] = self.identity()
        return found

    def _as_brdf(self, values: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):
            return self._converted(np.where(np.isfinite(values), values, np.nan), to_brdf)

    def _converted(self, values: np.ndarray, convert: Any) -> np.ndarray:
        if self.quantity == "brdf":
            return np.asarray(values, dtype=float)
        wi, wo = self.directions()
        cosines = [w[..., 2] if self.channel_names is None else w[..., 2, None] for w in (wi, wo)]
        return convert(self.quantity, values, *cosines)

    def _looked_up(self) -> dict[str, Fixed]:
        """The nodes' f with the circles closed, flat, and the nodes of uneven axes."""
        kept = super()._looked_up()
        del kept["stored"]
        uneven = {
            f"nodes_{k}": Fixed(_closed(axis, nodes))
            for k, (axis, nodes) in enumerate(zip(self.layout, self.axes.values(), strict=True))
            if axis.spacing == "uneven"
        }
        return {**kept, "values": Fixed(self._flat), **uneven}

    def _flat(self) -> np.ndarray:
        values = self.brdf()
        for k, (axis, nodes) in enumerate(zip(self.layout, self.axes.values(), strict=True)):
            if axis.size > len(nodes):
                values = np.concatenate([values, values.take([0], axis=k)], axis=k)
        return np.ascontiguousarray(values).reshape(-1)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        corners, beyond = self.corners(wi, wo)
        value = self._combined(corners)
        if self.outside == "hold":
            return value
        return ops.where(beyond, math.nan if self.outside == "missing" else 0.0, value)

    def corners(self, wi: Direction, wo: Direction) -> tuple[Slices, Any]:
        """The nodes around a pair with their weights, as if none were without data; and whether it is beyond the grid.

        Of bound materials. Nodes are counted through the grid with its circles closed: `layout[k].size` along axis k.
        """
        corners: list[tuple[Any, Any]] = [(0, 1.0)]
        beyond: Any = False
        for k, angle in enumerate(self.kind.angles(wi, wo, len(self.layout) == 4)):
            axis = self.layout[k]
            if self.outside != "hold" and not axis.period and axis.size > 1:
                beyond = beyond | (angle < axis.first - INSIDE) | (angle > axis.last + INSIDE)
            around = self._around(k, angle)
            corners = [(at * axis.size + i, v * u) for at, v in corners for i, u in around]
        return corners, beyond

    def _around(self, k: int, angle: Any) -> Slices:
        """The nodes of axis k around an angle, with their weights; the nearest one alone, if that is wanted."""
        axis = self.layout[k]
        if axis.size == 1:
            return ((0, 1.0),)
        if axis.period:
            angle = angle - (0.0 if axis.mirrored else axis.start)
            angle = angle - axis.period * ops.floor(angle * (1.0 / axis.period))
            if axis.mirrored:
                angle = ops.minimum(angle, axis.period - angle) - axis.start
        elif axis.spacing == "even in square root":
            angle = ops.sqrt(ops.maximum(angle, 1e-12)) - axis.start  # the floor keeps the derivative finite at 0
        elif axis.spacing == "even":
            angle = angle - axis.start
        if axis.spacing == "uneven":
            around = bracket(self.__dict__[f"nodes_{k}"], axis.size, angle)
        else:
            position = ops.clip(angle * (1.0 / axis.step), 0.0, axis.size - 1.0)
            start = ops.minimum(ops.floor(position), axis.size - 2.0)
            i, w = ops.to_index(start), position - start
            around = ((i, 1.0 - w), (i + 1, w))
        if self.interpolation == "linear":
            return around
        (i, _), (_, w) = around
        return ((i + ops.to_index(ops.floor(w + 0.5)), 1.0),)

    def _combined(self, corners: Slices) -> Any:
        channel = ops.to_index(self.channel)
        values = [(ops.take(self.values, at * self.width + channel), weight) for at, weight in corners]
        if len(values) == 1:
            return values[0][0]
        if self.holes:
            return _of_known(values)
        total = values[0][0] * values[0][1]
        for value, weight in values[1:]:
            total = total + weight * value
        return total

    def _key(self) -> tuple:
        shape = (
            ("parameterisation", self.parameterisation),
            ("quantity", self.quantity),
            ("mirrored", self.is_mirrored),
            ("periods", self.periods),
        )
        nodes = tuple((f"nodes of {name}", x) for name, x in self.axes.items())
        names = (("channel_names", self.channel_names),)
        uncertainty = () if self.uncertainty is None else (("uncertainty", self.uncertainty),)
        return (*super()._key(), *shape, *nodes, *names, *uncertainty)

    def __repr__(self) -> str:
        if self.path:
            return super().__repr__()
        size = " x ".join(str(len(x)) for x in self.axes.values())
        made_of = f" of {self.about['made_of']:.200}" if "made_of" in self.about else ""
        return f"<{self.parameterisation} table of {size} nodes{made_of}>"


def _of_known(values: Slices) -> Any:
    """The weighted mean of values that are numbers; NaN where these have next to no weight."""
    total: Any = 0.0
    known: Any = 0.0
    for value, weight in values:
        there = value == value
        weight = ops.where(there, weight, 0.0)
        total, known = total + weight * ops.where(there, value, 0.0), known + weight
    enough = known > LEAST_KNOWN
    return ops.where(enough, total / ops.where(enough, known, 1.0), math.nan)


def _closed(axis: _Axis, nodes: np.ndarray) -> np.ndarray:
    """The nodes of an uneven axis, with the first again at the end where the circle is closed; azimuths from it."""
    if not axis.period:
        return nodes
    return np.append(nodes, nodes[0] + axis.period)[: axis.size] - nodes[0]


def _check_axes(name: str, axes: Mapping[str, np.ndarray], mirrored: bool) -> list[str]:
    """The azimuths among the axes; ParameterError where the axes do not fit the parameterisation."""
    kind = parameterisation(name)
    expected = kind.names(len(axes))
    if len(axes) not in (3, 4) or tuple(axes) != expected:
        listed = " or ".join(", ".join(kind.names(n)) for n in (3, 4))
        raise ParameterError(f"axes: got {', '.join(axes)}, expected for {name!r}: {listed}, in this order")
    if mirrored and len(axes) == 4:
        raise ParameterError("mirrored=True: expected three axes; a plane of symmetry says nothing of four")
    for axis, nodes in axes.items():
        low, high = (
            (-4.0 * math.pi, 4.0 * math.pi) if axis in kind.turning else (0.0, _HIGHEST.get(axis, 0.5 * math.pi))
        )
        if not len(nodes) or not np.isfinite(nodes).all() or not (np.diff(nodes) > 0.0).all():
            raise ParameterError(f"axes: {axis} is {_short(nodes)}, expected increasing, finite nodes [rad]")
        if nodes[0] < low - INSIDE or nodes[-1] > high + INSIDE:
            raise ParameterError(
                f"axes: {axis} runs from {nodes[0]:g} to {nodes[-1]:g}, expected {low:g} to {high:g} rad; "
                f"convert degrees with numpy.radians"
            )
    return [axis for axis in axes if axis in kind.turning]


def _check_values(what: str, values: np.ndarray, grid: tuple[int, ...], names: tuple | None) -> None:
    expected = grid if names is None else (*grid, len(names))
    if values.shape != expected:
        raise ParameterError(f"{what}: got shape {values.shape}, expected {expected}: nodes of the axes, and channels")
    if names is not None and not names:
        raise ParameterError("channels: got none, expected names or wavelengths [nm]; None for values without channels")


def _real(values: Any) -> np.ndarray:
    """An array of floats; those of single and double precision as they are."""
    found = np.asarray(values)
    return found if found.dtype in (np.float32, np.float64) else found.astype(np.float64)


def _axis(name: str, nodes: np.ndarray, period: float, mirrored: bool) -> _Axis:
    closed = nodes
    if period and len(nodes) > 1:
        span = nodes[-1] - nodes[0]
        if mirrored and not -INSIDE <= nodes[0] <= nodes[-1] <= 0.5 * period + INSIDE:
            raise ParameterError(
                f"axes: {name} runs from {nodes[0]:g} to {nodes[-1]:g}, expected 0 to {0.5 * period:g} rad, "
                f"because the other half is mirrored"
            )
        if span > period + INSIDE:
            raise ParameterError(f"axes: {name} covers {span:g} rad, expected at most its period, {period:g}")
        if not mirrored and span < period - INSIDE:
            closed = np.append(nodes, nodes[0] + period)
    spacing, start, step = "uneven", float(nodes[0]), 1.0
    if len(closed) > 1:
        for kind, x in (("even", closed), ("even in square root", np.sqrt(np.maximum(closed, 0.0)))):
            even = np.linspace(x[0], x[-1], len(x))
            if np.abs(x - even).max() <= 1e-10 * (x[-1] - x[0]) and not (period and kind != "even"):
                spacing, start, step = kind, float(x[0]), float(x[-1] - x[0]) / (len(x) - 1)
                break
    return _Axis(spacing, start, step, len(closed), period, mirrored, float(nodes[0]), float(nodes[-1]))


_HIGHEST = {"radial": math.pi}


def _short(a: np.ndarray) -> str:
    return np.array2string(a, threshold=6, edgeitems=3, precision=4)
