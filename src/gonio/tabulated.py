"""Any reflectance as a table: values on a grid of angles, interpolated, with sampling and the error this makes."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from . import ops
from .errors import MissingDataWarning, ParameterError
from .geometry import Direction, dot, half_difference, half_vector, polar_angle, reflect
from .integrate import integrate
from .interface import Reflectance, direction
from .marginal_warp import MarginalWarp, Slices, both, bracket, gather, tables
from .measurement import Measured
from .param import channels, option, table
from .quadrature import lattice
from .warp import cosine_hemisphere, cosine_hemisphere_density

if TYPE_CHECKING:
    import xarray

COSINE_SHARE = 0.2
"""Share of samples that is cosine-distributed: weights are at most 5 pi f."""

RESOLUTION = {
    ("half_difference", False): (90, 46, 36),
    ("half_difference", True): (45, 23, 24, 32),
    ("angles", False): (46, 46, 72),
    ("angles", True): (19, 19, 36, 36),
}
VIEWS, TURNS, ROWS, COLUMNS = 16, 16, 32, 64  # what samples are drawn from: polar angles, azimuths of wo; their tables
GRAZING = 0.01  # cosine; the grids end there


class ResamplingError(NamedTuple):
    """How much a table differs from what it was made of, at pairs of directions with cosines above 0.1.

    mean, largest   of |f - true f|/true f, where true f is at least 1/1000 of its mean, else relative to that
    albedo          largest difference of albedos at polar angles from 0 to 80 degrees
    """

    mean: float
    largest: float
    albedo: float


class Tabulated(Measured):
    """Values of a reflectance on a grid, linear between the nodes along every axis; `gonio.tabulate` makes them.

    half_difference   theta_h, spaced as its square root, theta_d, phi_d, and phi_h if anisotropic: for glossy materials
    angles            theta_i, theta_o, phi_o - phi_i, or theta_i, theta_o, phi_i, phi_o if anisotropic

    Azimuths wrap. A reciprocal material's table is reciprocal: phi_d has period pi, or the exchange of both directions
    maps the grid onto itself. Where a direction would be below the horizon, nodes hold what is next to them.

    Sampling: half vectors, by tables of f cos(theta_i) seen from 16 polar angles (and 16 azimuths), mixed with the
    cosine hemisphere; the density is exact.

    Shapes   values: (grid..., C). f: (...), or (..., C) if the material had channels.
    Units    f: 1/sr.
    Error    of the grid, in `error`. By default mean, largest and albedo's for GGX(0.1), glass: half_difference 6e-3,
             7e-2, 7e-3, angles 1e-2, 13 (at the peak), 0.12; for 0.3 Lambertian + GGX(0.3): 6e-4, 4e-2, 1e-3 and
             1e-3, 0.3, 7e-4.
    Source   definition; angles of half_difference: Rusinkiewicz 1998, "A new change of variables for efficient BRDF
             representation".
    """

    format = "table"
    seam = COSINE_SHARE
    breaks: ClassVar[dict[str, str]] = {
        "energy": "values between nodes are linear interpolations, which may lie above those of the material",
    }

    parameterisation = option("half_difference", "angles", doc="what the axes of the grid are")
    values = table("f at the nodes, by the axes and channel")
    lobe = table("density of half vectors that samples are drawn from, by azimuth and polar angle of wo")
    lobe_conditional = table("its integral along a row")
    lobe_marginal = table("its integral over the rows")
    lobe_integral = table("its mean: the albedo")
    thetas = table("polar angles of wo of these tables [rad]")
    phis = table("azimuths of wo of these tables [rad]; one if isotropic")
    channel = channels("number of the channel")

    error: ResamplingError
    grid: tuple[int, ...]
    """Nodes along each axis; those of azimuths include the first again at the end."""
    period: float
    """Of phi_d [rad]: pi for reciprocal materials, else 2 pi."""
    width: int
    """How many channels are stored."""

    @property
    def valid(self) -> np.ndarray:
        """True where the table holds a number; shape of `values`."""
        return np.isfinite(self.values)

    @property
    def data(self) -> xarray.Dataset:
        """`values`, by the axes of the grid [rad] and channel."""
        import xarray

        axes = dict(zip(_axes(self.parameterisation, len(self.grid) == 4), self._nodes(), strict=True))
        names = (*axes, "channel")
        held = {"values": (names, self.values, {"units": "sr-1", "long_name": "BRDF"})}
        return xarray.Dataset(held, {n: (n, x, {"units": "rad"}) for n, x in axes.items()}, {"quantity": self.quantity})

    def _nodes(self) -> list[np.ndarray]:
        return _nodes(self.parameterisation, self.grid, self.period)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        corners: list[tuple[Any, Any]] = [(0, 1.0)]
        for position, count in zip(self._positions(wi, wo), self.grid, strict=True):
            position = ops.clip(position, 0.0, count - 1.0)
            start = ops.minimum(ops.floor(position), count - 2.0)
            i, w = ops.to_index(start), position - start
            corners = [(at * count + i + step, v * u) for at, v in corners for step, u in ((0, 1.0 - w), (1, w))]
        channel, total = ops.to_index(self.channel), None
        for at, weight in corners:
            term = weight * ops.take(self.values, at * self.width + channel)
            total = term if total is None else total + term
        return total

    def _positions(self, wi: Direction, wo: Direction) -> list[Any]:
        """Where a pair lies along each axis, in cells."""
        turn = 2.0 * math.pi
        if self.parameterisation == "angles":
            angles = [polar_angle(wi) / (0.5 * math.pi), polar_angle(wo) / (0.5 * math.pi)]
            if len(self.grid) == 4:
                angles += [_wrapped(_azimuth(wi), turn), _wrapped(_azimuth(wo), turn)]
            else:
                across, along = wi.x * wo.y - wi.y * wo.x, wi.x * wo.x + wi.y * wo.y
                angles.append(_wrapped(_azimuth(Direction(along, across, 0.0)), turn))
        else:
            theta_h, theta_d, phi_d = half_difference(wi, wo)
            # The floor keeps the derivative finite at the pole.
            angles = [ops.sqrt(ops.maximum(theta_h * (2.0 / math.pi), 1e-12)), theta_d / (0.5 * math.pi)]
            angles.append(_wrapped(phi_d, self.period))
            if len(self.grid) == 4:
                angles.append(_wrapped(_azimuth(Direction(wi.x + wo.x, wi.y + wo.y, 0.0)), turn))
        return [x * (count - 1.0) for x, count in zip(angles, self.grid, strict=True)]

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        diffuse = u0 < COSINE_SHARE
        flat = cosine_hemisphere(ops.minimum(u0 * (1.0 / COSINE_SHARE), 1.0), u1)
        at, phi_o = self._seen_from(wo)
        u = ops.clip((u0 - COSINE_SHARE) / (1.0 - COSINE_SHARE), 0.0, 1.0)
        x, y = self._lobe.sample(at, u1, u)
        theta, phi = (0.5 * math.pi) * x * x, (2.0 * y - 1.0) * math.pi + phi_o
        s = ops.sin(theta)
        wi = reflect(wo, Direction(s * ops.cos(phi), s * ops.sin(phi), ops.cos(theta)))
        return Direction(*(ops.where(diffuse, a, b) for a, b in zip(flat, wi, strict=True)))

    def density(self, wi: Direction, wo: Direction) -> Any:
        wm = half_vector(wi, wo)
        at, phi_o = self._seen_from(wo)
        sin_m = ops.sqrt(wm.x * wm.x + wm.y * wm.y + 1e-20)
        x = ops.sqrt(polar_angle(wm) * (2.0 / math.pi))
        turned = (_azimuth(wm) - phi_o + math.pi) * (0.5 / math.pi)
        solid = (8.0 * math.pi**2) * x * sin_m * dot(wo, wm)  # of wi, per area of the square
        lobe = self._lobe.eval(at, x, turned - ops.floor(turned)) / ops.maximum(solid, 1e-12)
        return COSINE_SHARE * cosine_hemisphere_density(wi) + (1.0 - COSINE_SHARE) * lobe

    def estimate(self, wo: Direction) -> Any:
        return gather(self.lobe_integral, self._seen_from(wo)[0], 1, 0)

    def _seen_from(self, wo: Direction) -> tuple[Slices, Any]:
        """The sampling tables to interpolate, and the azimuth that theirs are counted from."""
        theta = bracket(self.thetas, VIEWS, polar_angle(wo))
        if len(self.grid) == 3:
            return theta, _azimuth(wo)
        return both(bracket(self.phis, TURNS + 1, _azimuth(wo)), theta, VIEWS), 0.0

    @property
    def _lobe(self) -> MarginalWarp:
        count = VIEWS if len(self.grid) == 3 else VIEWS * (TURNS + 1)
        return MarginalWarp(self.lobe, self.lobe_conditional, self.lobe_marginal, (ROWS, COLUMNS), count)

    def __repr__(self) -> str:
        size = " x ".join(map(str, self.grid))
        return f"<{self.parameterisation} table of {size} nodes of {self.about['made_of']:.200}>"


def tabulate(
    m: Reflectance,
    parameterisation: str = "half_difference",
    resolution: Sequence[int] | None = None,
    anisotropic: bool | None = None,
    channels: Sequence[int] | None = None,
) -> Tabulated:
    """A reflectance as a table, with the error that this makes: see `Tabulated` and its `error`.

    `resolution`: nodes along each axis. `anisotropic`: whether the table has an axis more, found out if not given.
    `channels`: numbers of the channels to keep, all if not given. Holes of a measurement are filled from what is next
    to them. Raises ParameterError for a material with a delta lobe or with maps: no such table could hold it.
    """
    if m.has_delta:
        raise ParameterError(f"{m!r:.80}: a table cannot hold a perfect mirror; tabulate the material without it")
    shape = m.f([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]).shape
    if len(shape) > 1:
        raise ParameterError(f"{m!r:.80}: values have shape {shape}, expected one material, without maps")
    four = not m.is_isotropic() if anisotropic is None else anisotropic
    if (parameterisation, four) not in RESOLUTION:
        raise ParameterError(f"parameterisation={parameterisation!r}: expected 'half_difference' or 'angles'")
    nodes = tuple(resolution or RESOLUTION[parameterisation, four])
    axes = _axes(parameterisation, four)
    if len(nodes) != len(axes) or not all(isinstance(n, (int, np.integer)) and n >= 2 for n in nodes):
        raise ParameterError(f"resolution={resolution!r}: expected {len(axes)} whole numbers from 2: {', '.join(axes)}")
    if parameterisation == "angles" and (nodes[0] != nodes[1] or (four and nodes[2] != nodes[3])):
        raise ParameterError(f"resolution={resolution!r}: expected as many nodes for wo as for wi, for reciprocity")
    keep = _Kept(m, shape, channels)
    reciprocal = keep.reciprocal()
    period = math.pi if reciprocal and parameterisation == "half_difference" else 2.0 * math.pi
    grid = tuple(int(n) + axis.startswith("phi") for n, axis in zip(nodes, axes, strict=True))
    values = _on_grid(keep, parameterisation, grid, period)
    if reciprocal and parameterisation == "angles":
        back = values.transpose(1, 0, 3, 2, 4) if four else values.transpose(1, 0, 2, 3)[:, :, ::-1]
        values = 0.5 * (values + back)
    phis = np.linspace(-math.pi, math.pi, TURNS + 1) if four else np.zeros(1)
    thetas = np.linspace(0.0, math.radians(88.0), VIEWS)
    kinds = ("lobe", "lobe_conditional", "lobe_marginal", "lobe_integral")
    sampled: dict[str, Any] = dict(zip(kinds, tables(_lobes(keep, phis, thetas)), strict=True))
    made = Tabulated(
        "",
        {"made_of": repr(m)},
        parameterisation=parameterisation,
        values=values,
        thetas=thetas,
        phis=phis,
        channel=keep.width if shape else 0.0,
        **sampled,
    )
    names = m.channel_names
    if names is not None and channels is not None:
        names = tuple(names[c] for c in channels)
    made.__dict__.update(grid=grid, period=period, width=keep.width, channel_names=names)
    made.__dict__["breaks"] = {**Tabulated.breaks, **m.breaches()}
    made.__dict__["error"] = _compared(keep, made)
    return made


class _Kept:
    """A reflectance with a channel axis, some of its channels left out."""

    def __init__(self, m: Reflectance, shape: tuple[int, ...], chosen: Sequence[int] | None):
        count = shape[0] if shape else 1
        self.m, self.chosen = m, list(range(count)) if chosen is None else list(chosen)
        if not self.chosen or not all(c in range(count) for c in self.chosen):
            raise ParameterError(f"channels={chosen!r}: expected numbers from 0 to {count - 1}")
        self.plain, self.width = not shape, len(self.chosen)

    def f(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        f = self.m.f(wi, wo)
        return f[..., None] if self.plain else f[..., self.chosen]

    def reciprocal(self) -> bool:
        wi, wo = _lattice_pairs(512)
        return np.allclose(self.f(wi, wo), self.f(wo, wi), rtol=1e-6, atol=1e-12, equal_nan=True)


def _axes(parameterisation: str, four: bool) -> tuple[str, ...]:
    if parameterisation == "angles":
        return ("theta_i", "theta_o", "phi_i", "phi_o") if four else ("theta_i", "theta_o", "phi")
    return ("theta_h", "theta_d", "phi_d", "phi_h") if four else ("theta_h", "theta_d", "phi_d")


def _nodes(parameterisation: str, grid: tuple[int, ...], period: float) -> list[np.ndarray]:
    """Angles [rad] of the nodes along each axis."""
    unit = [np.linspace(0.0, 1.0, n) for n in grid]
    first, second = 0.5 * math.pi * unit[0], 0.5 * math.pi * unit[1]
    if parameterisation == "half_difference":
        first = 0.5 * math.pi * unit[0] ** 2
    return [first, second, period * unit[2], *(2.0 * math.pi * u for u in unit[3:])]


def _on_grid(keep: _Kept, parameterisation: str, grid: tuple[int, ...], period: float) -> np.ndarray:
    """f (grid..., C) at the nodes, those without a value filled from what is next to them."""
    values = np.empty((*grid, keep.width))
    first, *others = _nodes(parameterisation, grid, period)
    for i, x in enumerate(first):
        angles = np.meshgrid(x, *others, indexing="ij")
        pair = (_pairs_of_angles if parameterisation == "angles" else _pairs_of_half)(*(a[0] for a in angles))
        wi, wo = pair
        up = (wi[..., 2] >= 0.999 * GRAZING) & (wo[..., 2] >= 0.999 * GRAZING)
        values[i] = np.nan
        values[i][up] = keep.f(wi[up], wo[up])
    return np.stack([_filled(values[..., c]) for c in range(keep.width)], axis=-1)


def _pairs_of_angles(theta_i: Any, theta_o: Any, phi: Any, phi_o: Any = None) -> tuple[np.ndarray, np.ndarray]:
    theta_i, theta_o = (np.minimum(theta, math.acos(GRAZING)) for theta in (theta_i, theta_o))
    phi_i, phi_o = (0.0 * phi, phi) if phi_o is None else (phi, phi_o)
    return direction(theta_i, phi_i), direction(theta_o, phi_o)


def _pairs_of_half(theta_h: Any, theta_d: Any, phi_d: Any, phi_h: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    along, across, mean = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    s, c, found = np.sin(theta_h), np.cos(theta_h), []
    for sign in (1.0, -1.0):
        x, y = s * mean + sign * c * along, sign * across
        turned = (np.cos(phi_h) * x - np.sin(phi_h) * y, np.sin(phi_h) * x + np.cos(phi_h) * y)
        found.append(np.stack(np.broadcast_arrays(*turned, c * mean - sign * s * along), -1))
    return found[0], found[1]


def _filled(values: np.ndarray) -> np.ndarray:
    """An array with its NaNs replaced, from the edges of what is known inwards, by the mean of known neighbours."""
    values = values.copy()
    while (missing := np.isnan(values)).any():
        total, count = np.zeros(values.shape), np.zeros(values.shape)
        for axis in range(values.ndim):
            for there, here in ((slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None))):
                to, of = ([slice(None)] * values.ndim for _ in range(2))
                to[axis], of[axis] = here, there
                known = ~missing[tuple(of)]
                total[tuple(to)] += np.where(known, values[tuple(of)], 0.0)
                count[tuple(to)] += known
        reached = missing & (count > 0)
        if not reached.any():
            raise ParameterError("tabulate: the material has no value at any node of the grid; expected some")
        values[reached] = total[reached] / count[reached]
    return values


def _lobes(keep: _Kept, phis: np.ndarray, thetas: np.ndarray) -> np.ndarray:
    """f cos(theta_i) (phis, thetas, ROWS, COLUMNS) by half vector, per area of the square of their angles."""
    y, x = np.meshgrid(np.linspace(0.0, 1.0, ROWS), np.linspace(0.0, 1.0, COLUMNS), indexing="ij")
    theta = 0.5 * math.pi * x * x
    density = np.zeros((len(phis), len(thetas), ROWS, COLUMNS))
    for i, phi_o in enumerate(phis):
        for k, theta_o in enumerate(thetas):
            wo, wm = direction(theta_o, phi_o), direction(theta, (2.0 * y - 1.0) * math.pi)
            cos_d = wm @ wo
            wi = 2.0 * cos_d[..., None] * wm - wo
            up = (wi[..., 2] > GRAZING) & (cos_d > 0.0)
            f = np.zeros(up.shape)
            f[up] = np.maximum(np.nan_to_num(keep.f(wi[up], np.broadcast_to(wo, wi[up].shape)).mean(axis=-1)), 0.0)
            density[i, k] = f * wi[..., 2] * cos_d * np.sin(theta) * x * (8.0 * math.pi**2)
    mean = density.mean(axis=(-2, -1), keepdims=True)
    return density + np.where(mean > 0.0, 1e-3 * mean, 1.0)


def _lattice_pairs(count: int, least: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions whose cosines are at least `least`, evenly spread."""
    u = lattice(count, 4)
    theta = np.arccos(1.0 - (1.0 - least) * u[:, :2])
    return direction(theta[:, 0], 2.0 * math.pi * u[:, 2]), direction(theta[:, 1], 2.0 * math.pi * u[:, 3])


def _compared(keep: _Kept, made: Tabulated) -> ResamplingError:
    wi, wo = _lattice_pairs(1 << 15)
    true, found = keep.f(wi, wo), made.f(wi, wo).reshape(len(wi), -1)
    off = np.abs(found - true) / np.maximum(np.abs(true), 1e-3 * np.nanmean(np.abs(true)) + 1e-30)
    w = direction(np.radians([0.0, 20.0, 40.0, 60.0, 80.0]), 0.3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)
        before, after = (integrate(m, w, 1e-3).reshape(len(w), -1) for m in (keep.m, made))
    change = np.abs(after - (before if keep.plain else before[:, keep.chosen]))
    return ResamplingError(float(np.nanmean(off)), float(np.nanmax(off)), float(change.max()))


def _azimuth(w: Direction) -> Any:
    """phi in [-pi, pi]; 0 along the normal, with a finite derivative there."""
    flat = w.x * w.x + w.y * w.y < 1e-30
    return ops.arctan2(ops.where(flat, 0.0 * w.y, w.y), ops.where(flat, 1.0, w.x))


def _wrapped(phi: Any, period: float) -> Any:
    """An angle above -period as a share of the period."""
    return ops.where(phi < 0.0, phi + period, phi) * (1.0 / period)
