"""f in a plane, as figures draw it: curves that end where the data end, and what was measured there."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..base.shown_channels import is_rgb
from ..formula import tree
from ..pictures.colour import LUMINANCE, RELATIVE_XYZ, XYZ
from ..tables.gridded import Gridded
from ..tables.scattered import Scattered

USUAL = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
"""Angles of incidence [degrees] of the slices."""

VIEWS = np.linspace(-89.5, 89.5, 1433)
"""Viewing angles [degrees] of a slice, negative on the side of the light."""

APART = 1.0
"""Angle [degrees] up to which a measured direction counts as one of a slice."""


MOST = 1 << 25
"""Numbers of a table up to which figures look at each of them."""


class Slice(NamedTuple):
    """f [1/sr] in the plane of incidence, or across it, as one number (`one_number`).

    theta     angle of incidence [degrees]
    f         at VIEWS; NaN where there are no data
    views     viewing angles [degrees] of what was measured
    measured  f there
    u         standard uncertainty of `measured`, or None
    """

    theta: float
    f: np.ndarray
    views: np.ndarray
    measured: np.ndarray
    u: np.ndarray | None


def one_number(m: Reflectance) -> tuple[Callable[[np.ndarray], np.ndarray], str]:
    """The function from f (..., C) to (...) by which a material of C channels is drawn as one curve, and its name."""
    count, names = m.channels or 1, m.channel_names
    if count == 1:
        return (lambda f: f[..., 0]), ""
    if names in (XYZ, RELATIVE_XYZ):
        return (lambda f: f[..., 1]), "luminance Y"
    if count == 3 and is_rgb(m):
        return (lambda f: f @ LUMINANCE), "luminance"
    if names is None or isinstance(names[0], str):
        return _mean, f"mean of {count} channels"
    return _mean, f"mean of {count} wavelengths, {min(names):.4g} to {max(names):.4g} nm"


def units_of(materials: Iterable[Reflectance]) -> str:
    """The names of the numbers by which materials are drawn."""
    return " or ".join(dict.fromkeys(words for m in materials if (words := one_number(m)[1])))


def _mean(f: np.ndarray) -> np.ndarray:
    """The mean of the channels that have data."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # where no channel has data the mean is NaN
        return np.asarray(np.nanmean(f, axis=-1))


def _nodes(m: Reflectance) -> np.ndarray | None:
    """Polar angles of incidence [degrees] of a measurement that is made of some; None of others."""
    if isinstance(m, Scattered):
        return np.unique(np.degrees(m.rows[:, 0]).round(2))
    axes = getattr(m, "axes", {})
    return np.unique(np.degrees(axes["theta_i"])) if "theta_i" in axes else None


def lit_range(m: Reflectance) -> tuple[float, float]:
    """Lowest and highest angle of incidence [degrees] of which there are data."""
    nodes = _nodes(m)
    return (0.0, 90.0) if nodes is None else (float(nodes.min()), min(float(nodes.max()), 90.0))


def incidences(m: Reflectance) -> list[float]:
    """Angles of incidence [degrees] to draw: the usual ones, or those next to them that were measured."""
    nodes = _nodes(m)
    if nodes is None:
        return list(USUAL)
    nodes = nodes[nodes < 89.5] if (nodes < 89.5).any() else nodes
    if len(nodes) <= len(USUAL):
        return nodes.tolist()
    return sorted({float(nodes[np.abs(nodes - theta).argmin()]) for theta in USUAL})


def plane(m: Reflectance) -> float:
    """Azimuth of the light [rad]: pi, or the one next to it at which an oriented measurement was lit."""
    if isinstance(m, Scattered) and tree.is_oriented(m):
        return _nearest(np.pi, m.rows[:, 1])
    if isinstance(m, Gridded) and "phi_i" in m.axes:
        return _nearest(np.pi, m.axes["phi_i"])
    return math.pi


def _nearest(phi: float, azimuths: np.ndarray) -> float:
    return float(azimuths[np.cos(azimuths - phi).argmax()])


def bounded(m: Reflectance) -> Reflectance:
    """The material, without values beyond the outermost nodes of a measurement."""
    return m.replace(outside="missing") if isinstance(m, Gridded) and m.outside == "hold" else m


def viewed_from(phi: float, views: np.ndarray, turn: float = 0.0, through: bool = False) -> np.ndarray:
    """Directions (N, 3) of viewing angles [degrees], in the plane of the light's azimuth, or in one turned from it.

    through   seen from the other side: angles are those from the inward normal
    """
    polar = np.radians(np.abs(views))
    return direction(math.pi - polar if through else polar, np.where(views < 0.0, phi, phi + math.pi) + turn)


def f_in_plane(m: Reflectance, theta: float, views: np.ndarray, turn: float = 0.0, through: bool = False) -> np.ndarray:
    """f [1/sr] as one number at viewing angles [degrees], see `viewed_from`, of a material that is `bounded`."""
    (number, _), phi = one_number(m), plane(m)
    f = m.f(direction(math.radians(theta), phi), viewed_from(phi, views, turn, through))
    return np.asarray(number(with_channels(f, 1)), float)


def slices_of(m: Reflectance, thetas: Sequence[float] | None = None, turn: float = 0.0) -> list[Slice]:
    """The slices of a material of one place, at angles of incidence [degrees], by default those of `incidences`.

    turn  angle [rad] by which the plane of the views is turned from that of incidence, towards larger azimuths
    """
    phi, of_nodes, within = plane(m), _measured(m, turn), bounded(m)
    return [
        Slice(theta, f_in_plane(within, theta, VIEWS, turn), *of_nodes(theta, phi))
        for theta in (incidences(m) if thetas is None else thetas)
    ]


def _measured(
    m: Reflectance, turn: float
) -> Callable[[float, float], tuple[np.ndarray, np.ndarray, np.ndarray | None]]:
    """A function that gives the viewing angles of what was measured near a plane, f there, and its uncertainty."""
    number, _ = one_number(m)
    if isinstance(m, Scattered):
        f, u = m.row_brdf()
        all_wi, all_wo = (direction(m.rows[:, k], m.rows[:, k + 1]) for k in (0, 2))
    elif isinstance(m, Gridded) and "theta_i" in m.axes and m.stored.size <= MOST:
        f, u, axis = m.brdf(), m.brdf_uncertainty(), list(m.axes).index("theta_i")
    else:
        return lambda theta, phi: _NOTHING

    def near(theta: float, phi: float) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        if isinstance(m, Scattered):
            chosen = np.abs(np.degrees(m.rows[:, 0]) - theta) <= APART
            wi, wo = all_wi[chosen], all_wo[chosen]
            values, spread = (None if x is None else with_channels(x, 1)[chosen] for x in (f, u))
        else:
            k = int(np.abs(np.degrees(m.axes["theta_i"]) - theta).argmin())
            if abs(math.degrees(m.axes["theta_i"][k]) - theta) > APART:
                return _NOTHING
            pairs = m.system.directions({**m.axes, "theta_i": m.axes["theta_i"][k : k + 1]})
            wi, wo = (w.reshape(-1, 3) for w in np.broadcast_arrays(*pairs))
            parts = (None if x is None else with_channels(np.take(x, k, axis), len(m.axes) - 1) for x in (f, u))
            values, spread = (None if x is None else x.reshape(len(wi), -1) for x in parts)
        views, inside = _seen_in_plane(wi, wo, phi, turn, tree.is_oriented(m))
        assert values is not None
        values = number(values)
        inside &= np.isfinite(values)
        u_of = None if spread is None else number(spread)[inside]  # of luminance: as if errors of channels were one
        return views[inside], values[inside], u_of

    return near


_NOTHING = (np.zeros(0), np.zeros(0), None)


def _seen_in_plane(
    wi: np.ndarray, wo: np.ndarray, phi: float, turn: float, is_oriented: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Viewing angles [degrees] of pairs of directions, and which of them lie in the plane of the light's azimuth,
    turned by an angle."""
    across = np.array([math.cos(phi), math.sin(phi)])
    flat = np.hypot(wi[:, 0], wi[:, 1])
    is_steep = flat < math.sin(math.radians(APART))
    towards = np.where(is_steep[:, None], across, wi[:, :2] / np.maximum(flat, 1e-9)[:, None])
    along, aside = (wo[:, :2] * towards).sum(-1), wo[:, 1] * towards[:, 0] - wo[:, 0] * towards[:, 1]
    c, s = math.cos(turn), math.sin(turn)
    along, off = c * along + s * aside, c * aside - s * along
    inside = (np.abs(off) <= math.sin(math.radians(APART))) & (wo[:, 2] > 1e-6)
    if is_oriented:
        inside &= (towards @ across) >= math.cos(math.radians(APART))
    theta = np.degrees(np.arccos(np.clip(wo[:, 2], -1.0, 1.0)))
    return np.where(along > 0.0, -theta, theta), inside


def spans(slices: list[Slice]) -> list[tuple[float, float]]:
    """Ranges of the viewing angle [degrees] in which no slice has data."""
    missing = np.all([np.isnan(s.f) for s in slices], axis=0)
    if missing.all():
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]]).astype(int)))
    angles: Any = np.concatenate([VIEWS[:1], 0.5 * (VIEWS[1:] + VIEWS[:-1]), VIEWS[-1:]])
    angles[0], angles[-1] = -90.0, 90.0
    return [(float(angles[a]), float(angles[b])) for a, b in edges.reshape(-1, 2) if b - a > 8]
