"""Systems of angles in which pairs of directions are measured and tabulated."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..base.angles import direction
from ..errors import ParameterError
from ..formula.direction import Direction, azimuth, from_half_difference, half_difference, polar_angle


class Angle(NamedTuple):
    """An angle of a pair of directions.

    meaning   in words
    highest   the largest [rad], from 0; None for azimuths
    power     of the even spacing of default nodes: 2 where f changes fastest near 0
    """

    meaning: str
    highest: float | None = None
    power: int = 1


RIGHT = 0.5 * math.pi
ANGLES = {
    "theta_i": Angle("polar angle of the direction to the light", RIGHT),
    "phi_i": Angle("azimuth of the direction to the light"),
    "theta_o": Angle("polar angle of the direction to the viewer", RIGHT),
    "phi_o": Angle("azimuth of the direction to the viewer"),
    "phi": Angle("azimuth of the viewer minus that of the light"),
    "theta_h": Angle("polar angle of the half vector", RIGHT, 2),
    "theta_d": Angle("angle between the half vector and the direction to the light", RIGHT),
    "phi_d": Angle("azimuth of the direction to the light about the half vector"),
    "phi_h": Angle("azimuth of the half vector"),
    "radial": Angle("angle between the direction to the viewer and the mirror direction of the light", math.pi, 2),
    "azimuth": Angle("azimuth of the viewer about the mirror direction of the light, 0 towards the horizon"),
}
"""The angles of all systems by name; files use these names for columns, variables and axes."""

AZIMUTHS = tuple(name for name, angle in ANGLES.items() if angle.highest is None)


class NodeCounts(NamedTuple):
    """Numbers of nodes along the isotropic axes of a system, and along its oriented axes."""

    isotropic: tuple[int, ...]
    oriented: tuple[int, ...]


class AngleSystem(NamedTuple):
    """A description of pairs of directions by angles [rad].

    title      in words, for people
    isotropic  axes for isotropic materials, which do not change as both directions turn about the normal
    oriented   axes for other materials; such a turn changes the angles that are not among the isotropic axes
    angles     (wi, wo, oriented) -> angles of a pair, components in and numbers out; four if `oriented`
    pairs      angles, NumPy arrays -> wi and wo (..., 3)
    coarse     default nodes of a dataset
    fine       default nodes of `gonio.repair.resample`
    tabulated  default nodes of `gonio.tables.tabulate`; None if it makes no such tables
    exchange   axis -> the axis that has its angle when wi and wo are exchanged, with a sign and a shift; without axes
               whose angle then follows from several
    """

    name: str
    title: str
    isotropic: tuple[str, ...]
    oriented: tuple[str, ...]
    angles: Callable[[Direction, Direction, bool], list[Any]]
    pairs: Callable[..., tuple[np.ndarray, np.ndarray]]
    coarse: NodeCounts
    fine: NodeCounts
    tabulated: NodeCounts | None = None
    exchange: Mapping[str, tuple[str, float, float]] = MappingProxyType({})

    def axes(self, oriented: bool) -> tuple[str, ...]:
        return self.oriented if oriented else self.isotropic

    @property
    def turned(self) -> tuple[str, ...]:
        """The oriented axes along which a turn of both directions about the normal moves a pair."""
        return tuple(name for name in self.oriented if name not in self.isotropic)

    def nodes(
        self, counts: Sequence[int], periods: Mapping[str, float] = MappingProxyType({})
    ) -> dict[str, np.ndarray]:
        """`counts` nodes of each axis: azimuths around their period (2 pi), others from 0 to the largest."""
        grid = {}
        for name, count in zip(self.axes(len(counts) == len(self.oriented)), counts, strict=True):
            _, highest, power = ANGLES[name]
            if highest is None:
                grid[name] = periods.get(name, 2.0 * math.pi) * np.arange(count) / count
            else:
                grid[name] = highest * np.linspace(0.0, 1.0, count) ** power
        return grid

    def directions(self, axes: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """wi and wo (grid..., 3) at the nodes of a grid; z is below 0 where it goes below the horizon."""
        return self.pairs(*np.meshgrid(*axes.values(), indexing="ij"))


POLE = 1e-30
"""Square of the length along the surface up to which a direction has no azimuth."""


def azimuth_of(w: Direction) -> Any:
    """phi in [-pi, pi]; 0 along the normal, with a finite derivative there."""
    flat = w.x * w.x + w.y * w.y < POLE
    return ops.arctan2(ops.where(flat, 0.0 * w.y, w.y), ops.where(flat, 1.0, w.x))


def _angles(wi: Direction, wo: Direction, oriented: bool) -> list[Any]:
    thetas = [polar_angle(wi), polar_angle(wo)]
    if oriented:
        return [*thetas, azimuth_of(wi), azimuth_of(wo)]
    i, o = _flat(wi), _flat(wo)
    return [*thetas, azimuth_of(Direction(i.x * o.x + i.y * o.y, i.x * o.y - i.y * o.x, 0.0))]


def _flat(w: Direction) -> Direction:
    """The part of w along the surface; x if w is the normal, whose azimuth is 0."""
    pole = w.x * w.x + w.y * w.y < POLE
    return Direction(ops.where(pole, 1.0, w.x), ops.where(pole, 0.0, w.y), 0.0)


def _pairs_of_angles(theta_i: Any, theta_o: Any, phi: Any, phi_o: Any = None) -> tuple[np.ndarray, np.ndarray]:
    phi_i, phi_o = (0.0 * phi, phi) if phi_o is None else (phi, phi_o)
    return direction(theta_i, phi_i), direction(theta_o, phi_o)


def _relative(wi: Direction, wo: Direction, oriented: bool) -> list[Any]:
    return [*_angles(wi, wo, False), *([azimuth_of(wi)] if oriented else [])]


def _pairs_of_relative(theta_i: Any, theta_o: Any, phi: Any, phi_i: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    return direction(theta_i, phi_i + 0.0 * phi), direction(theta_o, phi_i + phi)


def _half(wi: Direction, wo: Direction, oriented: bool) -> list[Any]:
    theta_h, theta_d, phi_d = half_difference(wi, wo)
    turn = [azimuth_of(Direction(wi.x + wo.x, wi.y + wo.y, 0.0))] if oriented else []
    return [theta_h, theta_d, phi_d, *turn]


def _pairs_of_half(theta_h: Any, theta_d: Any, phi_d: Any, phi_h: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    wi, wo = from_half_difference(theta_h, phi_h, theta_d, phi_d)
    pair = [np.stack(np.broadcast_arrays(*w), -1) for w in (wi, wo)]
    return pair[0], pair[1]


def _specular(wi: Direction, wo: Direction, oriented: bool) -> list[Any]:
    s = ops.sqrt(wi.x * wi.x + wi.y * wi.y + 1e-30)
    cos_phi, sin_phi = azimuth(wi, s)
    forward = -(cos_phi * wo.x + sin_phi * wo.y)
    along = wi.z * forward - s * wo.z
    across = sin_phi * wo.x - cos_phi * wo.y
    radial = ops.arctan2(ops.sqrt(along * along + across * across + 1e-30), s * forward + wi.z * wo.z)
    turn = [azimuth_of(wi)] if oriented else []
    return [polar_angle(wi), radial, azimuth_of(Direction(along, across, 0.0)), *turn]


def _pairs_of_specular(theta_i: Any, radial: Any, around: Any, phi_i: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    wi = direction(theta_i + 0.0 * radial + 0.0 * around, phi_i + 0.0 * around)
    along, across = np.sin(radial) * np.cos(around), np.sin(radial) * np.sin(around)
    forward = np.sin(theta_i) * np.cos(radial) + np.cos(theta_i) * along
    up = np.cos(theta_i) * np.cos(radial) - np.sin(theta_i) * along
    c, s = np.cos(phi_i), np.sin(phi_i)
    wo = np.broadcast_arrays(-c * forward + s * across, -s * forward - c * across, up)
    return wi, np.stack(wo, -1)


_EXCHANGED = {"theta_i": ("theta_o", 1.0, 0.0), "theta_o": ("theta_i", 1.0, 0.0), "phi": ("phi", -1.0, 0.0)}

SYSTEMS = {
    system.name: system
    for system in (
        AngleSystem(
            "angles",
            "polar angles and azimuths of both directions",
            ("theta_i", "theta_o", "phi"),
            ("theta_i", "theta_o", "phi_i", "phi_o"),
            _angles,
            _pairs_of_angles,
            coarse=NodeCounts((31, 31, 36), (13, 13, 24, 24)),
            fine=NodeCounts((46, 46, 72), (19, 19, 36, 36)),
            tabulated=NodeCounts((46, 46, 72), (19, 19, 36, 36)),
            exchange={**_EXCHANGED, "phi_i": ("phi_o", 1.0, 0.0), "phi_o": ("phi_i", 1.0, 0.0)},
        ),
        AngleSystem(
            "relative",  # lobes that turn with wi stay whole, which they do not on axes phi_i and phi_o
            "polar angles of both directions, the azimuth between them, and that of the light",
            ("theta_i", "theta_o", "phi"),
            ("theta_i", "theta_o", "phi", "phi_i"),
            _relative,
            _pairs_of_relative,
            coarse=NodeCounts((31, 31, 36), (13, 13, 24, 24)),
            fine=NodeCounts((46, 46, 72), (19, 19, 36, 36)),
            exchange=_EXCHANGED,
        ),
        AngleSystem(
            "half_difference",  # Rusinkiewicz'
            "half and difference angles",
            ("theta_h", "theta_d", "phi_d"),
            ("theta_h", "theta_d", "phi_d", "phi_h"),
            _half,
            _pairs_of_half,
            coarse=NodeCounts((46, 31, 36), (23, 16, 24, 16)),
            fine=NodeCounts((90, 46, 72), (45, 23, 36, 32)),
            tabulated=NodeCounts((90, 46, 36), (45, 23, 24, 32)),
            exchange={
                "theta_h": ("theta_h", 1.0, 0.0),
                "theta_d": ("theta_d", 1.0, 0.0),
                "phi_d": ("phi_d", 1.0, math.pi),
                "phi_h": ("phi_h", 1.0, 0.0),
            },
        ),
        AngleSystem(
            "specular",  # azimuth: pi towards the normal, pi/2 towards s x the direction of azimuth 0
            "angles about the mirror direction",
            ("theta_i", "radial", "azimuth"),
            ("theta_i", "radial", "azimuth", "phi_i"),
            _specular,
            _pairs_of_specular,
            coarse=NodeCounts((19, 46, 24), (10, 23, 16, 16)),
            fine=NodeCounts((31, 61, 36), (16, 41, 24, 24)),
        ),
    )
}
"""All systems by name."""


def angle_system(name: str) -> AngleSystem:
    """The system of this name. Raises ParameterError for another."""
    if name not in SYSTEMS:
        raise ParameterError(f"parameterization={name!r}: expected one of {', '.join(map(repr, SYSTEMS))}")
    return SYSTEMS[name]
