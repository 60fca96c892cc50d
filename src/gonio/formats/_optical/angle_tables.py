"""Tables by angles, and values of any material at them: for formats of optical design software and of the RT-300S."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np

from ...arrays.kinds import with_channels
from ...base.measured import Total, tabular_shape, tristimulus
from ...base.reflectance import Reflectance
from ...declared.arguments import Declared
from ...errors import FormatError, ParameterError, expect_one_of
from ...formula import tree
from ...formula.state import note
from ...models._quarters import MirroredX, quarters
from ...pictures.colour import XYZ_OF_RGB
from ...tables.angle_systems import AZIMUTHS, SYSTEMS, angle_system
from ...tables.axes import fits
from ...tables.gridded import Gridded
from ...tables.nodes import above, bracketed, f_at, own_nodes
from ...tables.rows import ROW_ANGLES
from ...tables.scattered import Scattered
from .._layout import Layout
from .._reading import plain_text
from .._sides import read_as

SAME = 1e-8  # angles closer than this [degrees] are the same
ABSOLUTE = ("phi_i", "phi_o", "phi_h")
"""Azimuths of the sample; others are differences."""
FULLEST = 0.5
"""Rows that fill at least this share of the grid of their angles are a grid with holes, others are scattered."""


class Filing(NamedTuple):
    """The content of the file of a table; the quarters of a `Sheet` that it was read as, and all that were read."""

    content: Any = None
    read_as: tuple[str, ...] = ("front",)
    read_with: tuple[str, ...] = ("front",)


class Filed(Gridded):
    """A `Gridded` from a file; `filed` is the content of that file, from which it is written again unchanged."""

    filed: Any = note()
    filed_as: tuple[str, ...] = note(("front",))
    """The quarters of a `Sheet` that it was read as."""
    filed_with: tuple[str, ...] = note(("front",))
    """All that were read with it."""

    def __init__(self, *args: Any, filed: Filing | None = None, stated_totals: Iterable[Total] = (), **named: Any):
        super().__init__(*args, **named)
        content, read_as, read_with = filed or Filing()
        self._hold(filed=content, filed_as=read_as, filed_with=read_with, stated_totals=tuple(stated_totals))


class GridRequest(NamedTuple):
    """What a caller of a writer asked for: angles [degrees] by the file's words, the step, the channel."""

    angles: Mapping[str, Sequence[float] | None]
    step: float | None
    channel: Any

    @property
    def own_angles(self) -> bool:
        """Whether a table may keep its own."""
        return self.step is None and all(x is None for x in self.angles.values())


def as_filed(m: Reflectance, file_class: type, asked: GridRequest) -> Any:
    """The content of the file that m was read from, if it is of this kind and m is unchanged since; else None.

    None, too, where something is asked for. Raises ParameterError for a delta lobe and for maps, which no table of f
    holds.
    """
    parts = [*read_as(m)]
    for part, _ in parts:
        tabular_shape(part)
    first = next((part for part, _ in parts), None)
    if not isinstance(first, Filed) or not isinstance(first.filed, file_class):
        return None
    if not asked.own_angles or asked.channel is not None:
        return None
    for part, places in parts:
        if not isinstance(part, Filed) or part.filed is not first.filed or not {*part.filed_as} & {*places}:
            return None
    is_whole = first is m or {*quarters(m)} == {*first.filed_with}
    return first.filed if is_whole else None


def mirrored_x(
    axes: Mapping[str, np.ndarray], values: np.ndarray, half: bool, periods: Mapping[str, float] | None = None
) -> tuple[dict[str, np.ndarray], Any]:
    """A table with x of both directions turned round, from wo mirrored at the surface to `Across` seen from behind; it
    is its own inverse. `half`: the table is its own mirror image."""
    if half:
        return dict(axes), values
    new_axes = {}
    for k, (name, x) in enumerate(axes.items()):
        new_axes[name] = x
        if name not in AZIMUTHS:
            continue
        period = (periods or {}).get(name, 2.0 * math.pi)
        new_axes[name], values = (math.pi if name in ABSOLUTE else period) - x[::-1], np.flip(values, k)
        if x[0] >= 0.0 and x[-1] < period - SAME:  # an open circle stays within 0 and its period
            around = np.mod(new_axes[name], period)
            around[around > period - SAME] = 0.0
            order = np.argsort(around)
            new_axes[name], values = around[order], values.take(order, k)
    return new_axes, values


def as_lit(m: Reflectance) -> Reflectance:
    """A transmission, forward as in a `Sheet`, with azimuths of the side that is lit; and the other way round."""
    if isinstance(m, Scattered):
        rows = m.rows * [1.0, -1.0, 1.0, -1.0] + [0.0, math.pi, 0.0, math.pi]
        return Scattered(**{**m._arguments_of_rows(), **dict(zip(ROW_ANGLES, rows.T, strict=True))})
    if not isinstance(m, Gridded):
        return MirroredX(m)
    axes, values = mirrored_x(m.axes, m.stored, m.is_mirrored, m.periods)
    spread = None if m.uncertainty is None else mirrored_x(m.axes, m.uncertainty, m.is_mirrored, m.periods)[1]
    return m.with_table(values, spread, axes=axes)


def increasing(path: Any, name: str, nodes: Sequence[float], low: float, high: float) -> None:
    """Raises FormatError unless angles [degrees] increase, and lie between two."""
    x = np.asarray(nodes, dtype=float)
    if not x.size or not np.isfinite(x).all() or not (np.diff(x) > SAME).all():
        short = np.array2string(x, threshold=6, edgeitems=3, precision=6)
        raise FormatError(f"{path}: {name} is {short}, expected increasing angles in degrees")
    if x[0] < low or x[-1] > high:
        raise FormatError(f"{path}: {name} runs from {x[0]:g} to {x[-1]:g}, expected {low:g} to {high:g} degrees")
    if x[-1] - x[0] > 360.0:
        raise FormatError(f"{path}: {name} covers {x[-1] - x[0]:g} degrees, expected at most 360")


def without_ground(system: str, axes: Mapping[str, np.ndarray], values: np.ndarray) -> np.ndarray:
    """Values (grid..., C) with NaN for the zeros below the horizon, which only pad the table."""
    below = ~above(*angle_system(system).directions(axes))
    return np.where(below[..., None] & (values == 0.0), np.nan, values)


def from_rows(
    theta_i: np.ndarray, phi_i: np.ndarray, theta_o: np.ndarray, phi_o: np.ndarray, values: np.ndarray, **named: Any
) -> Gridded:
    """Rows of angles [degrees] and values (n,): a table if they fill half the grid of their angles, else scattered.

    One azimuth of incidence stands for all of them; then data on one side of the plane of incidence are mirrored. The
    mean stands for several values of a pair, and the normal has every azimuth.
    """
    around = phi_i if len(np.unique(phi_i)) > 1 else None
    turn = np.mod(np.round(phi_o if around is not None else phi_o - phi_i, 9), 360.0)
    mirrored = around is None and bool((turn <= 180.0).all() or ((turn >= 180.0) | (turn == 0.0)).all())
    if mirrored:
        turn = np.minimum(turn, 360.0 - turn)
    columns = [theta_i, theta_o, *([] if around is None else [np.mod(around, 360.0)]), turn]
    nodes, at = zip(*(np.unique(np.round(column, 8), return_inverse=True) for column in columns), strict=True)
    shape = tuple(map(len, nodes))
    if math.prod(shape) * FULLEST > len(values):
        named.pop("filed", None)
        a, b, c, d = (np.radians(x) for x in (theta_i, phi_i, theta_o, phi_o))
        return Scattered(a, b, c, d, values, isotropic=around is None, **named)
    table, count = np.zeros(shape), np.zeros(shape)
    np.add.at(table, at, values)
    np.add.at(count, at, 1.0)
    if nodes[1][0] == 0.0:  # values along the normal belong to every azimuth of wo
        for sums in (table, count):
            sums[:, 0] = sums[:, 0].sum(-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        table = table / count
    axes = dict(zip(SYSTEMS["angles"].axes(around is not None), map(np.radians, nodes), strict=True))
    return Filed("angles", axes, table, mirrored=mirrored, **named)


def on_grid(m: Reflectance, system: str, axes: Mapping[str, np.ndarray]) -> np.ndarray:
    """`values_at` the nodes of a grid, axes in the order of its system."""
    return values_at(m, *angle_system(system).directions(axes))


def own_table(m: Reflectance, system: str, asked: GridRequest) -> tuple[Gridded, np.ndarray] | None:
    """A measurement on such axes and its f (grid..., C), where no angles are asked for; else None."""
    if not isinstance(m, Gridded) or not asked.own_angles:
        return None
    if tuple(m.axes) != angle_system(system).axes(tree.is_oriented(m)):
        return None
    return m, m.brdf() if m.channel_names else m.brdf()[..., None]


def values_at(m: Reflectance, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f (grid..., C) at pairs of directions (grid..., 3), 0 below the horizon and NaN where m has no data."""
    return with_channels(f_at(m, wi, wo, below=0.0), np.broadcast(wi, wo).ndim - 1)


def spectral(m: Reflectance, f: np.ndarray, channel: Any = None) -> tuple[tuple, np.ndarray]:
    """Names of channels, (None,) or ("X", "Y", "Z"), and f (..., 1 or 3) for formats that hold just these.

    RGB becomes XYZ by `XYZ_OF_RGB`. `channel` picks one by name; ParameterError where it must and is not given.
    """
    names, f = channel_named(m, f, channel)
    if f.shape[-1] == 1:
        return (None,), f
    if tuple(names) == ("X", "Y", "Z"):
        return tuple(names), f
    if tuple(names) in (("R", "G", "B"), (0, 1, 2)):
        return ("X", "Y", "Z"), f @ XYZ_OF_RGB.T
    raise ParameterError(
        f"{m!r:.80}: channels {names!r:.80}: the format holds one, or X, Y, Z; choose one with channel="
    )


def channel_named(m: Reflectance, f: np.ndarray, channel: Any) -> tuple[tuple, np.ndarray]:
    """Names of the channels of f (..., C), and f, X, Y, Z of D65; those of one channel where it is not None.

    Raises ParameterError where there is none of that name.
    """
    names, f = tristimulus(m.channel_names, f)
    names = tuple(names or range(f.shape[-1]))
    if channel is None:
        return names, f
    expect_one_of(names, "channel", channel)
    return (channel,), f[..., [names.index(channel)]]


def totals(m: Reflectance, theta_i: Sequence[float], phi_i: Sequence[float]) -> np.ndarray:
    """Shares of light (phi_i, theta_i, C) that m reflects from directions [degrees] to all sides (TIS), by a product
    rule about the mirror direction, dense there. Against `gn.albedo`, GGX(0.02) to GGX(0.5) and diffuse, 0 to 85
    degrees: within 4e-4."""
    x, w = np.polynomial.legendre.leggauss(96)
    t, w = 0.5 * (x + 1.0), 0.5 * w
    radial, weight = math.pi * t**4, 4.0 * math.pi * t**3 * w
    around = (np.arange(256) + 0.5) * (2.0 * math.pi / 256)
    shares = []
    for phi, theta in itertools.product(np.radians(phi_i), np.radians(theta_i)):
        grid = np.meshgrid([theta], radial, around, [phi], indexing="ij")
        wi, wo = angle_system("specular").pairs(*grid)
        f = values_at(m, wi, wo)[0, :, :, 0] * (wo[0, :, :, 0, 2:])
        shares.append(np.nansum(f * (np.sin(radial) * weight)[:, None, None], axis=(0, 1)) * (2.0 * math.pi / 256))
    return np.reshape(shares, (len(phi_i), len(theta_i), -1))


def at_azimuths(phi: np.ndarray, nodes: np.ndarray, f: np.ndarray) -> np.ndarray:
    """f (theta_i, theta_o, nodes, C) at other azimuths [degrees] than its nodes, linear between these."""
    order = np.argsort(nodes)
    x, f = nodes[order], f[:, :, order]
    k, weight, _ = bracketed(x, np.mod(phi - x[0], 360.0) + x[0], 360.0)
    w = weight[:, None]
    return np.where(w == 0.0, f[:, :, k], (1.0 - w) * f[:, :, k] + w * f[:, :, (k + 1) % len(nodes)])


def reflected(theta: np.ndarray, phi: np.ndarray, table: np.ndarray) -> float:
    """Integral of bilinear values (theta, phi) over solid angle; angles [rad], azimuths of a circle or half of one.

    The circle is closed where it is open; half of one is mirrored. Exact in azimuth, and in theta for values that are
    linear between nodes: the solid angle's sine is integrated with them.
    """
    span = phi[-1] - phi[0]
    if span < math.pi + 1e-9:
        mean = np.trapezoid(table, phi, axis=1) * 2.0 if len(phi) > 1 else table[:, 0] * 2.0 * math.pi
    else:
        gap = max(2.0 * math.pi - span, 0.0)
        mean = np.trapezoid(table, phi, axis=1) + 0.5 * gap * (table[:, 0] + table[:, -1])
    a, b = theta[:-1], theta[1:]
    whole = np.cos(a) - np.cos(b)
    first = ((b - a) * np.cos(a) - (np.sin(b) - np.sin(a))) / (b - a)
    return float((mean[:-1] * first + mean[1:] * (whole - first)).sum())


class Angles(NamedTuple):
    """Lists [degrees] that writers use by default: `circle` without its end, `turns` every few of its steps, `side` the
    half circle of isotropic materials and the circle of others; and the step of theta_o."""

    theta_i: list[float]
    theta_o: list[float]
    half: list[float]
    circle: list[float]
    turns: list[float]
    side: list[float]
    step: float

    def to_grazing(self) -> list[float]:
        """theta_o up to 89 degrees."""
        return [*(x for x in self.theta_o if x < 89.0), 89.0]


OWN = 90  # most polar angles of a measurement that take the place of default ones
USUAL = 5.0  # degrees between the angles of a file, where a caller does not say

Step = Annotated[
    float | None,
    Declared("between angles of wo; angles of wi and azimuths are two steps apart", 1e-3, 90.0, "degrees", usual=USUAL),
]
AngleList = Sequence[float] | None


def rising(doc: str, low: float, high: float) -> Declared:
    """The declaration of a list of angles that a writer takes f at."""
    return Declared(doc, low, high, "degrees", rising=True)


IncidentAngles = Annotated[AngleList, rising("polar angles of wi", 0.0, 90.0)]
OutgoingAngles = Annotated[AngleList, rising("polar angles of wo", 0.0, 90.0)]
Channel = Annotated[
    float | str | None, Declared("the channel that is written: its name, its wavelength [nm] or its number")
]


def asked_or_usual(
    layout: Layout, parts: Sequence[Reflectance], asked: GridRequest
) -> tuple[dict[str, list[float]], bool]:
    """Angles of a written model [degrees], by the file's words, those asked for or the layout's usual ones; and whether
    the sample is turned: parts are anisotropic, or such angles asked for.

    Usual are theta_o every so many degrees (5 if not given), theta_i and azimuths every two of them, turns of the
    sample some 30; but if no step is asked for, the polar angles of a measurement are its own. Raises TooLargeError
    where so many angles do not fit into memory.
    """
    words = {axis.name: word for word, axis in layout.axes.items()}
    oriented = asked.angles.get(words.get("phi_i", "")) is not None or not all(m.is_isotropic() for m in parts)
    if oriented and "phi_i" not in words:
        raise ParameterError(f"{parts[0]!r:.80}: is anisotropic, and the format holds isotropic materials only")
    step = USUAL if asked.step is None else asked.step
    fits(85.0 / step * (40.0 / step) * (180.0 / step) * (12 if oriented else 1), f"{step=}")
    count = max(4, 2 * round(90.0 / step))
    circle = (np.arange(count) * (360.0 / count)).round(9).tolist()
    half, turns = [*circle[: count // 2], 180.0], circle[:: max(1, round(count / 12))]
    nodes = own_nodes(parts[0]) if asked.step is None else {}
    polar = {name: plain_text.degrees(x).tolist() for name, x in nodes.items() if len(x) <= OWN}
    theta_i = asked.angles.get(words["theta_i"]) or polar.get("theta_i", steps(80.0, min(2.0 * step, 80.0)))
    theta_o = polar.get("theta_o", steps(85.0, step))
    usual = Angles(list(theta_i), theta_o, half, circle, turns, circle if oriented else half, step)
    axes = {word: axis for word, axis in layout.of(oriented).items() if axis.usual is not None}
    angles = {word: list(asked.angles.get(word) or axis.usual(usual)) for word, axis in axes.items() if axis.usual}
    alone = {word: [axis.alone] for word, axis in axes.items() if axis.name == "phi_i" and not oriented}
    return angles | alone, oriented


def tabulated(layout: Layout, m: Reflectance, asked: GridRequest) -> tuple[dict[str, np.ndarray], np.ndarray, bool]:
    """Axes [rad], f (grid..., C), and whether they are mirrored: of a measurement on such axes its own, where no angles
    are asked for, else at `asked_or_usual` ones of the whole circle."""
    if table := own_table(m, layout.system, asked):
        return table[0].axes, table[1], table[0].is_mirrored
    axes = layout.nodes(*asked_or_usual(layout, [m], asked))
    return axes, on_grid(m, layout.system, axes), False


def steps(last: float, step: float) -> list[float]:
    """0, step, 2 step, ... up to `last` degrees, which is always there."""
    x = np.arange(0.0, last, step)
    x = x[x < last - 0.25 * step]
    return [*x.round(9).tolist(), float(last)]
