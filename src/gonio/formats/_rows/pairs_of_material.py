"""Any reflectance as pairs of directions with values: what formats that list pairs are written from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np

from ...base.angles import angles
from ...base.measured import Measured, tabular_shape, tristimulus
from ...base.quantities import from_brdf, to_brdf
from ...base.reflectance import Reflectance
from ...errors import ParameterError
from ...formula.direction import HORIZON
from ...tables.axes import fits
from ...tables.gridded import Gridded
from ...tables.nodes import channels_named
from ...tables.scattered import Scattered
from .._options import Declared
from .direction_pairs import Pairs, material


class Nodes(NamedTuple):
    """The grid of angles that a model is written at where the caller does not say.

    isotropic   numbers of theta_i, theta_o, phi
    oriented    numbers of theta_i, theta_o, phi_i, phi_o: for anisotropic models
    last        largest polar angle [degrees], or None: a step below 90
    """

    isotropic: tuple[int, ...]
    oriented: tuple[int, ...]
    last: float | None = None

    def polar(self, count: int) -> np.ndarray:
        """So many polar angles [rad], from 0."""
        last = 90.0 if self.last is None else self.last
        return np.radians(np.linspace(0.0, last, count, endpoint=self.last is not None))


FINE = Nodes((18, 18, 72), (18, 18, 72, 72))
COARSE = Nodes((10, 10, 13), (7, 7, 9, 9), last=80.0)

_GRID = Declared(
    "nodes of theta_i, theta_o, phi, or of theta_i, theta_o, phi_i, phi_o; without it a measurement keeps its pairs",
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
    nodes: Nodes = FINE,
    as_held: bool = False,
) -> Pairs:
    """The pairs that a measurement holds, with its values as stored; of anything else f at a grid of angles, and of
    anything at the grid that is asked for.

    `resolution`: see `Resolution`; three numbers have the azimuths of wo for wi too where a model is anisotropic. The
    grid of `nodes` where it is not given. `quantities`: what the format can hold; other values
    become the first of these. `incident`: theta_i and phi_i [rad], which are the only ones then.
    Of a grid both halves of mirrored data are there, and no nodes on the horizon or below it, or without a number;
    `as_held`: the nodes as they are, but for those below the horizon.
    Raises ParameterError for a material with a delta lobe, with maps, or without any number.
    """
    if isinstance(m, Scattered) and resolution is None:
        pairs = Pairs(m.rows, m.stored, m.quantity, m.uncertainty, m.channel_names)
    elif isinstance(m, Gridded) and resolution is None:
        pairs = _of_grid(m, as_held)
    else:
        pairs = _of_model(m, resolution, incident, nodes)
    if pairs.quantity not in quantities:
        pairs = _as_quantity(pairs, quantities[0])
        pairs = pairs if as_held else pairs.known()  # along the surface there may be none
    if not np.isfinite(pairs.values).any():
        raise ParameterError(f"{m!r:.80}: has no values to write, expected a number at one pair of directions at least")
    return pairs if incident is None else _lit_from(incident, pairs)


def table_of(m: Reflectance, resolution: Sequence[int] | None = None) -> Gridded:
    """A measurement as it is; of anything else, and where a resolution is asked for, the table of its `pairs_of`."""
    if isinstance(m, Gridded) and resolution is None:
        return m
    return material(pairs_of(m, resolution), "", m.about if isinstance(m, Measured) else {})


def _of_model(
    m: Reflectance, resolution: Sequence[int] | None, incident: tuple[float, float] | None, nodes: Nodes
) -> Pairs:
    tabular_shape(m)
    isotropic = m.is_isotropic()
    usual = nodes.isotropic if isotropic else nodes.oriented
    asked = usual if resolution is None else resolution
    theta_i, theta_o = (nodes.polar(n) for n in asked[:2])
    turns = [np.radians(np.linspace(0.0, 360.0, n, endpoint=False)) for n in (asked[-2], asked[-1])]
    phi_i, phi_o = turns if len(asked) == 4 else (np.zeros(1) if isotropic else turns[1], turns[1])
    if incident is not None:
        theta_i, phi_i = np.reshape(incident, (2, 1))
    fits(math.prod(map(len, (theta_i, phi_i, theta_o, phi_o))), f"resolution={tuple(asked)}")
    rows = np.stack([x.reshape(-1) for x in np.meshgrid(theta_i, phi_i, theta_o, phi_o, indexing="ij")], axis=1)
    names, f = tristimulus(m.channel_names, m.f_angles(*rows.T))
    return Pairs(rows, f, channels=None if f.ndim == 1 else names or channels_named(f.shape[1]))


def _lit_from(incident: tuple[float, float], pairs: Pairs) -> Pairs:
    off = np.abs(np.sin(0.5 * (pairs.angles[:, :2] - incident)))
    off[:, 1] *= np.sin(pairs.angles[:, 0])  # along the normal there is no azimuth
    return pairs.only(off.max(axis=1) < 1e-6)


def _of_grid(m: Gridded, as_held: bool) -> Pairs:
    shape = tuple(len(x) for x in m.axes.values())
    values = m.stored.reshape(-1, *m.stored.shape[len(shape) :])
    spread = None if m.uncertainty is None else m.uncertainty.reshape(values.shape)
    if "theta_o" in m.axes and (not m.is_oriented() or "phi_o" in m.axes):
        theta_i, theta_o, *phi = (x.reshape(-1) for x in np.meshgrid(*m.axes.values(), indexing="ij"))
        phi_i, phi_o = _turned(phi[0], m.about.get("phi_i")) if len(phi) == 1 else phi
        up = np.ones(len(theta_i), bool)
    else:
        wi, wo = (w.reshape(-1, 3) for w in m.directions())
        (theta_i, phi_i), (theta_o, phi_o) = angles(wi), angles(wo)
        up = np.minimum(wi[:, 2], wo[:, 2]) > (-HORIZON if as_held else HORIZON)
    rows = np.stack([theta_i, phi_i, theta_o, phi_o], axis=1)
    pairs = Pairs(rows, values, m.quantity, spread, m.channel_names).only(up)
    if as_held:
        return pairs
    return (_both_halves(pairs) if m.is_mirrored else pairs).known()


def _turned(phi: np.ndarray, phi_i: object) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths of wi and wo, those of wo with the digits in degrees that they were read with.

    `phi_i` is what `about` says, of grids that were read from one azimuth of wi (see `direction_pairs.material`).
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
    """The same pairs with values of another quantity; NaN where they do not tell it (along the surface)."""
    cosines = [np.cos(pairs.angles[:, k]).reshape(-1, *(1,) * (pairs.values.ndim - 1)) for k in (0, 2)]

    def convert(v: np.ndarray) -> np.ndarray:
        return from_brdf(quantity, to_brdf(pairs.quantity, v, *cosines), *cosines)

    spread = None if pairs.uncertainty is None else convert(pairs.uncertainty)
    return pairs._replace(values=convert(pairs.values), uncertainty=spread, quantity=quantity)


def with_others(pairs: Pairs, m: Reflectance) -> Pairs:
    """The pairs and those that were kept from the file (see `direction_pairs.material`) as they were."""
    others = getattr(m, "about", {}).get("other_pairs")
    if others is None or others.channels != pairs.channels or others.quantity != pairs.quantity:
        return pairs
    spread = None
    if pairs.uncertainty is not None and others.uncertainty is not None:
        spread = np.concatenate([pairs.uncertainty, others.uncertainty])
    return pairs._replace(
        angles=np.concatenate([pairs.angles, others.angles]),
        values=np.concatenate([pairs.values, others.values]),
        uncertainty=spread,
    )
