"""Measurements as pairs of directions, one per row: between rows of a file and `Gridded` or `Scattered`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import FormatError, ParameterError
from ..geometry import HORIZON
from ..gridded import Gridded
from ..interface import Reflectance, angles
from ..measurement import from_brdf, tabular_shape, to_brdf, tristimulus
from ..scattered import Scattered, gridded_or_scattered

RESOLUTION = (18, 18, 72)
"""Nodes of theta_i, theta_o (from 0 to below 90 degrees) and of azimuths that a model is written at."""

LEVEL = 0.5 * math.pi + 1e-6

SIDES = ("front", "back")


class Pairs(NamedTuple):
    """Pairs of directions with values; uncertainty and channels None where there are none.

    angles    (n, 4) [rad]: theta_i, phi_i, theta_o, phi_o
    values    (n,), or (n, C) with C channels, of `quantity`
    """

    angles: np.ndarray
    values: np.ndarray
    quantity: str = "brdf"
    uncertainty: np.ndarray | None = None
    channels: tuple[str | float, ...] | None = None

    def only(self, which: Any) -> Pairs:
        spread = None if self.uncertainty is None else self.uncertainty[which]
        return self._replace(angles=self.angles[which], values=self.values[which], uncertainty=spread)

    def columns(self) -> np.ndarray:
        """The values, channels side by side: (n, C)."""
        return self.values.reshape(len(self.values), -1)


def upright(theta: np.ndarray, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same directions with theta >= 0: a negative polar angle leans to the other side."""
    return np.abs(theta), np.where(theta < 0.0, phi + math.pi, phi)


def material(
    pairs: Pairs,
    path: str,
    about: Mapping[str, Any],
    side: str = "front",
    isotropic: bool | None = None,
    outside: str = "hold",
) -> Gridded:
    """What the pairs were measured on: a `Gridded` where they fill a grid, else `Scattered`.

    Only pairs with both directions on the `side` asked for; the others (transmission, the other side) are kept as
    they are in `about["other_pairs"]`, to be written again. Angles on the back are counted from its own normal.
    Isotropic, if that is not said, where all light comes from one azimuth; of a grid it is kept in `about["phi_i"]`.
    Raises FormatError where nothing is left.
    """
    if side not in SIDES:
        raise ParameterError(f"side={side!r}: expected one of {', '.join(map(repr, SIDES))}")
    a = pairs.angles
    if not np.isfinite(a).all():
        raise FormatError(f"{path}: row {np.argmin(np.isfinite(a).all(axis=1)) + 1} has no finite angles")
    theta_i, phi_i = upright(a[:, 0], a[:, 1])
    theta_o, phi_o = upright(a[:, 2], a[:, 3])
    if max(theta_i.max(initial=0.0), theta_o.max(initial=0.0)) > math.pi + 1e-6:
        raise FormatError(f"{path}: a polar angle is {np.degrees(max(theta_i.max(), theta_o.max())):g} degrees")
    front_i, front_o = theta_i <= LEVEL, theta_o <= LEVEL
    here = front_i & front_o if side == "front" else ~front_i & ~front_o
    if not here.any():
        raise FormatError(
            f"{path}: none of {len(a)} rows is reflection on the {side}: expected both directions on that side; "
            f"gonio reads no transmission yet; try side={SIDES[side == 'front']!r}"
        )
    if side == "back":
        theta_i, theta_o = math.pi - theta_i, math.pi - theta_o
    about = dict(about)
    if not here.all():
        about["other_pairs"] = pairs.only(~here)
    kept = pairs._replace(angles=np.stack([theta_i, phi_i, theta_o, phi_o], axis=1)).only(here)
    theta_i, phi_i, theta_o, phi_o = kept.angles.T
    try:
        return _as_grid(kept, path, about, isotropic, outside) or gridded_or_scattered(
            theta_i,
            phi_i,
            theta_o,
            phi_o,
            kept.values,
            quantity=kept.quantity,
            uncertainty=kept.uncertainty,
            channels=kept.channels,
            isotropic=isotropic,
            outside=outside,
            path=path,
            about=about,
        )
    except ParameterError as error:
        raise FormatError(f"{path}: {error}") from None


def _as_grid(pairs: Pairs, path: str, about: Mapping[str, Any], isotropic: bool | None, outside: str) -> Gridded | None:
    """The grid of which every node has its row, also where several are the same direction along the normal."""
    theta_i, phi_i, theta_o, phi_o = pairs.angles.T
    columns = {"theta_i": theta_i, "theta_o": theta_o, "phi_i": phi_i, "phi_o": phi_o}
    one_azimuth = bool((phi_i == phi_i[0]).all())
    if isotropic and not one_azimuth:
        return None
    if isotropic is not False and one_azimuth:
        phi = phi_o - phi_i if phi_i[0] else phi_o
        if -math.pi - 1e-6 <= phi.min() and phi.max() <= 0.0:
            phi = 0.0 - phi
        columns = {"theta_i": theta_i, "theta_o": theta_o, "phi": phi}
        about = {**about, "phi_i": float(phi_i[0])} if phi_i[0] else about
    found = grid(columns)
    if found is None:
        return None
    axes, order = found
    if any(np.ptp(axes[name]) > 2.0 * math.pi + 1e-6 for name in axes if name.startswith("phi")):
        return None
    mirrored = "phi" in axes and half_circle(axes["phi"])
    return gridded("angles", axes, order, pairs, mirrored=mirrored, outside=outside, path=path, about=about)


def half_circle(nodes: np.ndarray) -> bool:
    """Whether azimuths are between 0 and pi, so that the other half must follow from them."""
    return bool(len(nodes) > 1 and nodes[0] >= 0.0 and nodes[-1] <= math.pi + 1e-6)


def gridded(name: str, axes: Mapping[str, np.ndarray], order: np.ndarray, pairs: Pairs, **options: Any) -> Gridded:
    """The grid whose nodes, in their order, are the rows `order` (see `grid`)."""
    shape = tuple(len(x) for x in axes.values())
    values, spread = (
        None if v is None else v[order].reshape(*shape, *v.shape[1:]) for v in (pairs.values, pairs.uncertainty)
    )
    return Gridded(name, axes, values, quantity=pairs.quantity, uncertainty=spread, channels=pairs.channels, **options)


def grid(columns: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], np.ndarray] | None:
    """Nodes of the axes whose every combination is one row, and the numbers of the rows in that order; else None."""
    axes, at = {}, []
    size, count = 1, len(next(iter(columns.values())))
    for name, column in columns.items():
        axes[name], index = np.unique(column, return_inverse=True)
        at.append(index.reshape(-1))
        size *= len(axes[name])
    if size != count:
        return None
    place = np.ravel_multi_index(tuple(at), tuple(len(x) for x in axes.values()))
    order = np.empty(count, dtype=np.intp)
    order[place] = np.arange(count)
    return (axes, order) if (place[order] == np.arange(count)).all() else None


def of(m: Reflectance, resolution: Sequence[int] | None = None, incident: tuple[float, float] | None = None) -> Pairs:
    """The pairs that a measurement holds, with its values as stored; of anything else f at a grid of angles, and of
    anything at the grid that is asked for.

    Nodes of a grid that are below the horizon, or hold no number, are left out; both halves of mirrored data are
    there. `resolution`: see `RESOLUTION`; anisotropic materials get as many azimuths of wi. `incident`: theta_i and
    phi_i [rad], which are the only ones then.
    Raises ParameterError for a material with a delta lobe or with maps.
    """
    if isinstance(m, Scattered) and resolution is None:
        return _lit_from(incident, Pairs(m.rows, m.stored, m.quantity, m.uncertainty, m.channel_names))
    if isinstance(m, Gridded) and resolution is None:
        return _lit_from(incident, _of_grid(m))
    tabular_shape(m)
    counts = RESOLUTION if resolution is None else tuple(resolution)
    if len(counts) != 3 or not all(isinstance(n, (int, np.integer)) and n >= 1 for n in counts):
        raise ParameterError(f"resolution={resolution!r}: expected whole numbers of theta_i, theta_o and azimuths")
    thetas = [np.radians(90.0 / n * np.arange(n)) for n in counts[:2]]
    turns = np.radians(360.0 / counts[2] * np.arange(counts[2]))
    lit = (
        [[thetas[0]], [np.zeros(1) if m.is_isotropic() else turns]]
        if incident is None
        else np.reshape(incident, (2, 1, 1))
    )
    nodes = np.meshgrid(lit[0], lit[1], thetas[1], turns, indexing="ij")
    rows = np.stack([x.reshape(-1) for x in nodes], axis=1)
    f = tristimulus(m, m.f_angles(*rows.T))
    names = None if f.ndim == 1 else m.channel_names or _numbered(f.shape[1])
    return Pairs(rows, f, channels=names)


def _lit_from(incident: tuple[float, float] | None, pairs: Pairs) -> Pairs:
    if incident is None:
        return pairs
    off = np.abs(np.sin(0.5 * (pairs.angles[:, :2] - incident)))
    off[:, 1] *= np.sin(pairs.angles[:, 0])  # along the normal there is no azimuth
    return pairs.only(off.max(axis=1) < 1e-6)


def _numbered(count: int) -> tuple[str, ...]:
    return ("R", "G", "B") if count == 3 else tuple(map(str, range(count)))


def _of_grid(m: Gridded) -> Pairs:
    shape = tuple(len(x) for x in m.axes.values())
    values = m.stored.reshape(-1, *m.stored.shape[len(shape) :])
    spread = None if m.uncertainty is None else m.uncertainty.reshape(values.shape)
    if m.parameterisation == "angles":
        theta_i, theta_o, *phi = (x.reshape(-1) for x in np.meshgrid(*m.axes.values(), indexing="ij"))
        phi_i, phi_o = _turned(phi[0], m.about.get("phi_i", 0.0)) if len(phi) == 1 else phi
    else:
        wi, wo = (w.reshape(-1, 3) for w in m.directions())
        (theta_i, phi_i), (theta_o, phi_o) = angles(wi), angles(wo)
        level = np.minimum(wi[:, 2], wo[:, 2]) <= HORIZON
        values = np.where(level.reshape(-1, *(1,) * (values.ndim - 1)), np.nan, values)
    pairs = Pairs(np.stack([theta_i, phi_i, theta_o, phi_o], axis=1), values, m.quantity, spread, m.channel_names)
    if m.is_mirrored:
        pairs = _both_halves(pairs)
    known = np.isfinite(pairs.columns()).any(axis=1)
    return pairs if known.all() else pairs.only(known)


def _turned(phi: np.ndarray, phi_i: float) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths of wi and wo, those of wo with the digits in degrees that they were read with."""
    phi_o = phi + phi_i
    short = np.radians(np.round(np.degrees(phi_o), 10))
    return np.full_like(phi, phi_i), np.where(np.abs(short - phi_o) < 1e-14, short, phi_o) if phi_i else phi_o


def _both_halves(pairs: Pairs) -> Pairs:
    _, phi_i, _, phi_o = pairs.angles.T
    phi = phi_o - phi_i
    other = np.abs(np.sin(phi)) > 1e-6
    twice = pairs.only(np.concatenate([np.arange(len(phi)), np.flatnonzero(other)]))
    mirrored = np.mod(2.0 * phi_i - phi_o, 2.0 * math.pi)
    twice.angles[len(phi) :, 3] = mirrored[other]
    return twice


def as_quantity(pairs: Pairs, quantity: str) -> Pairs:
    """The same pairs with values of another quantity, without those that have none of it (along the surface)."""
    if quantity == pairs.quantity:
        return pairs
    cosines = [np.cos(pairs.angles[:, k]).reshape(-1, *(1,) * (pairs.values.ndim - 1)) for k in (0, 2)]

    def convert(v: np.ndarray) -> np.ndarray:
        return from_brdf(quantity, to_brdf(pairs.quantity, v, *cosines), *cosines)

    spread = None if pairs.uncertainty is None else convert(pairs.uncertainty)
    converted = pairs._replace(values=convert(pairs.values), uncertainty=spread, quantity=quantity)
    return converted.only(np.isfinite(converted.columns()).any(axis=1))


def with_others(pairs: Pairs, m: Reflectance) -> Pairs:
    """The pairs and those that were kept from the file (see `material`) as they were."""
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
