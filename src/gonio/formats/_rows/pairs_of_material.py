"""Any reflectance as pairs of directions with values, for the writers of formats that list pairs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np

from ...base.angles import angles
from ...base.measured import Measured, tabular_shape, tristimulus
from ...base.quantities import from_brdf, to_brdf
from ...base.reflectance import Reflectance
from ...declared.arguments import Declared
from ...errors import ParameterError
from ...formula import tree
from ...formula.direction import HORIZON
from ...models._quarters import quarters
from ...tables.angle_systems import SYSTEMS
from ...tables.axes import fits
from ...tables.gridded import Gridded
from ...tables.nodes import channels_named, needed, own_nodes
from ...tables.scattered import Scattered
from .._sides import is_part
from .direction_pairs import LEVEL, Pairs, material, seen_from, together


class _DefaultGrid(NamedTuple):
    """The default grid of angles of a written model.

    isotropic   numbers of theta_i, theta_o, phi
    oriented    numbers of theta_i, theta_o, phi_i, phi_o: for anisotropic models
    last        largest polar angle [degrees]; None for a step below 90
    """

    isotropic: tuple[int, ...]
    oriented: tuple[int, ...]
    last: float | None = None

    def polar(self, count: int) -> np.ndarray:
        """Polar angles [rad], from 0."""
        last = 90.0 if self.last is None else self.last
        return np.radians(np.linspace(0.0, last, count, endpoint=self.last is not None))


FINE = _DefaultGrid((18, 18, 72), (18, 18, 72, 72))
COARSE = _DefaultGrid((10, 10, 13), (7, 7, 9, 9), last=80.0)

MOST = 1 << 21
"""Pairs up to which a measurement's own nodes take the place of the default ones."""

_GRID = Declared(
    "nodes of theta_i, theta_o, phi, or of theta_i, theta_o, phi_i, phi_o; without it a measurement keeps its pairs, "
    "or its angles if they are others, and no axis gets more nodes than f needs",
    1,
    lengths=(3, 4),
)
Resolution = Annotated[Sequence[int] | None, _GRID._replace(usual=FINE.isotropic)]
CoarseResolution = Annotated[Sequence[int] | None, _GRID._replace(usual=COARSE.isotropic)]


def pairs_of(
    m: Reflectance,
    resolution: Sequence[int] | None = None,
    quantities: Sequence[str] = ("brdf",),
    *,
    incident: tuple[float, float] | None = None,
    nodes: _DefaultGrid = FINE,
    as_held: bool = False,
) -> Pairs:
    """The pairs of a measurement, with its values as stored; of anything else, and where a resolution is given, f at
    a grid of angles. A grid of other angles, about the half vector or the mirror direction, is evaluated on one, too:
    as pairs in no grid it would be read again with what lies between its nodes lost.

    resolution    see `Resolution`; with three numbers anisotropic models have wi at the azimuths of wo. None: `nodes`,
                  or those of a measurement where it has such angles, but no more than f needs
    quantities    those of the format; values of another quantity become the first
    incident      theta_i and phi_i [rad] of the only direction of light
    as_held       a measured grid keeps its nodes above the horizon as they are; else it gives both halves of mirrored
                  data, and no nodes on the horizon or without a number

    Raises ParameterError for a material with a delta lobe, with maps, or without any number.
    """
    if isinstance(m, Scattered) and resolution is None:
        pairs = Pairs(m.rows, m.stored, m.quantity, m.uncertainty, m.channel_names)
    elif isinstance(m, Gridded) and resolution is None and m.parameterization in ("angles", "relative"):
        pairs = _of_grid(m, as_held)
    else:
        pairs = _of_model(m, resolution, incident, nodes)
    if pairs.quantity not in quantities:
        pairs = _as_quantity(pairs, quantities[0])
        pairs = pairs if as_held else pairs.finite()  # along the surface some quantities tell nothing
    if not np.isfinite(pairs.values).any():
        raise ParameterError(f"{m!r:.80}: has no values to write, expected a number at one pair of directions at least")
    if incident is None:
        return pairs
    off = np.abs(np.sin(0.5 * (pairs.angles[:, :2] - incident)))
    off[:, 1] *= np.sin(pairs.angles[:, 0])  # along the normal there is no azimuth
    return pairs.only(off.max(axis=1) < 1e-6)


def table_of(m: Reflectance, resolution: Sequence[int] | None = None) -> Gridded:
    """A measurement on a grid, or in rows, as it is; for anything else, and where a resolution is given, the table of
    its `pairs_of`."""
    if isinstance(m, Measured) and resolution is None and (table := m.as_grid()) is not None:
        return table
    return material(pairs_of(m, resolution), "", m.about if isinstance(m, Measured) else {})


def _of_model(
    m: Reflectance, resolution: Sequence[int] | None, incident: tuple[float, float] | None, nodes: _DefaultGrid
) -> Pairs:
    tabular_shape(m)
    isotropic = m.is_isotropic()
    usual = nodes.isotropic if isotropic else nodes.oriented
    asked = usual if resolution is None else resolution
    axes = {name: nodes.polar(n) for name, n in zip(("theta_i", "theta_o"), asked[:2], strict=True)}
    turns = [np.radians(np.linspace(0.0, 360.0, n, endpoint=False)) for n in (asked[-2], asked[-1])]
    if isotropic and len(asked) == 3:
        axes["phi"] = turns[1]
    else:
        axes |= {"phi_i": turns[0] if len(asked) == 4 else turns[1], "phi_o": turns[1]}
    fits(math.prod(map(len, axes.values())), f"resolution={tuple(asked)}")
    if resolution is None:
        axes = _suited(m, axes)
    theta_i, theta_o, *phi = axes.values()
    phi_i, phi_o = phi if len(phi) == 2 else (np.zeros(1), phi[0])
    if incident is not None:
        theta_i, phi_i = np.reshape(incident, (2, 1))
    rows = np.stack([x.reshape(-1) for x in np.meshgrid(theta_i, phi_i, theta_o, phi_o, indexing="ij")], axis=1)
    names, f = tristimulus(m.channel_names, m.f_angles(*rows.T))
    spread = None
    if isinstance(m, Gridded) and (u := m.brdf_uncertainty()) is not None:
        spread = m.with_brdf(u).f_angles(*rows.T)
    return Pairs(rows, f, "brdf", spread, None if f.ndim == 1 else names or channels_named(f.shape[1]))


def _suited(m: Reflectance, axes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """A measurement's own nodes in place of default ones, if they are not too many; of a model as many as f needs."""
    if not isinstance(m, Measured):
        return needed(m, SYSTEMS["angles"], axes)
    nodes = own_nodes(m)
    suited = {name: nodes.get(name, x) for name, x in axes.items()}
    return suited if math.prod(map(len, suited.values())) <= MOST else dict(axes)


def of_nodes(m: Gridded) -> Pairs:
    """A row for each node of a grid; `angles` (n, axes) are those of its own axes."""
    nodes = np.stack([x.reshape(-1) for x in np.meshgrid(*m.axes.values(), indexing="ij")], axis=1)
    values = m.stored.reshape(len(nodes), *m.stored.shape[len(m.axes) :])
    spread = None if m.uncertainty is None else m.uncertainty.reshape(values.shape)
    return Pairs(nodes, values, m.quantity, spread, m.channel_names)


def _of_grid(m: Gridded, as_held: bool) -> Pairs:
    pairs = of_nodes(m)
    up: Any = slice(None)
    if "theta_o" in m.axes and (not tree.is_oriented(m) or "phi_o" in m.axes):
        theta_i, theta_o, *phi = pairs.angles.T
        phi_i, phi_o = _turned(phi[0], m.about.get("phi_i")) if len(phi) == 1 else phi
    else:
        wi, wo = (w.reshape(-1, 3) for w in m.directions())
        (theta_i, phi_i), (theta_o, phi_o) = angles(wi), angles(wo)
        up = np.minimum(wi[:, 2], wo[:, 2]) > (-HORIZON if as_held else HORIZON)
    pairs = pairs._replace(angles=np.stack([theta_i, phi_i, theta_o, phi_o], axis=1)).only(up)
    if as_held:
        return pairs
    return (_both_halves(pairs) if m.is_mirrored else pairs).finite()


def _turned(phi: np.ndarray, phi_i: object) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths of wi and wo, those of wo with the digits in degrees that they were read with.

    `phi_i` is the entry of `about` of grids that were read from one azimuth of wi (see `direction_pairs.material`).
    """
    if not isinstance(phi_i, float) or not phi_i:
        return np.zeros_like(phi), phi
    phi_o = phi + phi_i
    short = np.radians(np.round(np.degrees(phi_o), 10))
    return np.full_like(phi, phi_i), np.where(np.abs(short - phi_o) < 1e-14, short, phi_o)


def _both_halves(pairs: Pairs) -> Pairs:
    _, phi_i, _, phi_o = pairs.angles.T
    phi = phi_o - phi_i
    other = np.abs(np.sin(phi)) > 1e-6
    twice = pairs.only(np.concatenate([np.arange(len(phi)), np.flatnonzero(other)]))
    mirrored = np.mod(2.0 * phi_i - phi_o, 2.0 * math.pi)
    twice.angles[len(phi) :, 3] = mirrored[other]
    return twice


def _as_quantity(pairs: Pairs, quantity: str) -> Pairs:
    """The same pairs with values of another quantity; NaN along the surface, where that may not follow."""
    cosines = [np.cos(pairs.angles[:, k]).reshape(-1, *(1,) * (pairs.values.ndim - 1)) for k in (0, 2)]

    def convert(v: np.ndarray) -> np.ndarray:
        return from_brdf(quantity, to_brdf(pairs.quantity, v, *cosines), *cosines)

    spread = None if pairs.uncertainty is None else convert(pairs.uncertainty)
    return pairs._replace(values=convert(pairs.values), uncertainty=spread, quantity=quantity)


def with_others(pairs: Pairs, m: Reflectance) -> Pairs:
    """The pairs, and those of the other side that were kept from the file (see `direction_pairs.material`)."""
    others = getattr(m, "about", {}).get("other_pairs")
    if others is None or others.channels != pairs.channels or others.quantity != pairs.quantity:
        return pairs
    return together([pairs, others])


def rows_of(
    m: Reflectance,
    resolution: Sequence[int] | None = None,
    quantities: Sequence[str] = ("brdf",),
    incident: tuple[float, float] | None = None,
) -> Pairs:
    """`pairs_of` a reflectance on both sides, with the angles of the sample: polar ones up to pi. Of one in front alone
    its pairs, and those of the other side that were kept from its file.

    Raises the errors of `pairs_of`, and ParameterError where parts have different channels.
    """
    if is_part(m):
        pairs = pairs_of(m, resolution, quantities, incident=incident)
        return pairs if incident is not None else with_others(pairs, m)
    parts = {q: part for q, part in quarters(m).items() if incident is None or _is_lit(q, incident)}
    if not parts:
        raise ParameterError(f"{m!r:.80}: has no light from theta_i = {incident and incident[0]:g}; choose another")
    held = {getattr(part, "quantity", quantities[0]) for part in parts.values()}
    quantities = quantities if len(held) == 1 else quantities[:1]
    each = []
    for quarter, part in parts.items():
        pairs = _lit_from(part, quarter, incident, resolution, quantities)
        angles = _short(seen_from(quarter, pairs.angles))
        behind = {"front": [], "back": [0, 2], "forward": [2], "backward": [0]}[quarter]
        on_its_side = (angles[:, behind] > LEVEL).all(axis=1)  # along the surface rows would be those in front
        each.append(pairs._replace(angles=angles).only(on_its_side))
    if len({pairs.channels for pairs in each}) > 1:
        several = " and ".join(sorted({f"{pairs.channels!r:.60}" for pairs in each}))
        raise ParameterError(f"{m!r:.80}: its parts have the channels {several}; expected the same")
    return together(each)


def _lit_from(
    m: Reflectance,
    quarter: str,
    incident: tuple[float, float] | None,
    resolution: Sequence[int] | None,
    quantities: Sequence[str],
) -> Pairs:
    """The pairs of a part, of one incident direction of the sample where that is given."""
    if incident is None:
        return pairs_of(m, resolution, quantities)
    theta_i, phi_i = seen_from(quarter, np.array([[*incident, 0.0, 0.0]]))[0, :2]
    if resolution is not None or not isinstance(m, Gridded) or tree.is_oriented(m):
        return pairs_of(m, resolution, quantities, incident=(theta_i, phi_i))
    azimuth = float(m.about.get("phi_i", 0.0)) if not isinstance(m, Scattered) else float(m.rows[0, 1])
    pairs = pairs_of(m, None, quantities, incident=(theta_i, azimuth))
    return pairs._replace(angles=pairs.angles + np.array([0.0, phi_i - azimuth, 0.0, phi_i - azimuth]))


def _is_lit(quarter: str, incident: tuple[float, float]) -> bool:
    return (quarter in ("front", "forward")) == (incident[0] <= LEVEL)


def _short(angles: np.ndarray) -> np.ndarray:
    """Angles [rad] with the few digits, in degrees or in radians, that they had before they were turned."""
    for short in (np.radians(np.round(np.degrees(angles), 10)), np.round(angles, 12)):
        angles = np.where(np.abs(short - angles) < 1e-14, short, angles)
    return angles
