"""Angles that pairs of directions are measured and tabulated by: from directions to angles and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..base.angles import direction
from ..errors import ParameterError
from ..formula.direction import Direction, azimuth, half_difference, polar_angle


class Parameterisation(NamedTuple):
    """How pairs are described by angles [rad].

    axes      names of the angles; the last one only where turning both directions about the normal changes f
    turning   which angles are azimuths
    angles    of a pair, components in and numbers out; `all_axes` asks for the last one too
    pairs     wi and wo (..., 3) of angles, NumPy arrays
    """

    axes: tuple[str, ...]
    turning: tuple[str, ...]
    angles: Callable[[Direction, Direction, bool], list[Any]]
    pairs: Callable[..., tuple[np.ndarray, np.ndarray]]

    def names(self, count: int) -> tuple[str, ...]:
        """The axes of a grid with so many."""
        if self.axes[2:] == ("phi_i", "phi_o") and count == 3:
            return (*self.axes[:2], "phi")
        return self.axes[:count]


def azimuth_of(w: Direction) -> Any:
    """phi in [-pi, pi]; 0 along the normal, with a finite derivative there."""
    flat = w.x * w.x + w.y * w.y < 1e-30
    return ops.arctan2(ops.where(flat, 0.0 * w.y, w.y), ops.where(flat, 1.0, w.x))


def _angles(wi: Direction, wo: Direction, all_axes: bool) -> list[Any]:
    thetas = [polar_angle(wi), polar_angle(wo)]
    if all_axes:
        return [*thetas, azimuth_of(wi), azimuth_of(wo)]
    across, along = wi.x * wo.y - wi.y * wo.x, wi.x * wo.x + wi.y * wo.y
    return [*thetas, azimuth_of(Direction(along, across, 0.0))]


def _pairs_of_angles(theta_i: Any, theta_o: Any, phi: Any, phi_o: Any = None) -> tuple[np.ndarray, np.ndarray]:
    phi_i, phi_o = (0.0 * phi, phi) if phi_o is None else (phi, phi_o)
    return direction(theta_i, phi_i), direction(theta_o, phi_o)


def _relative(wi: Direction, wo: Direction, all_axes: bool) -> list[Any]:
    return [*_angles(wi, wo, False), *([azimuth_of(wi)] if all_axes else [])]


def _pairs_of_relative(theta_i: Any, theta_o: Any, phi: Any, phi_i: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    return direction(theta_i, phi_i + 0.0 * phi), direction(theta_o, phi_i + phi)


def _half(wi: Direction, wo: Direction, all_axes: bool) -> list[Any]:
    theta_h, theta_d, phi_d = half_difference(wi, wo)
    turn = [azimuth_of(Direction(wi.x + wo.x, wi.y + wo.y, 0.0))] if all_axes else []
    return [theta_h, theta_d, phi_d, *turn]


def _pairs_of_half(theta_h: Any, theta_d: Any, phi_d: Any, phi_h: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    along, across, mean = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    s, c, found = np.sin(theta_h), np.cos(theta_h), []
    for sign in (1.0, -1.0):
        x, y = s * mean + sign * c * along, sign * across
        turned = (np.cos(phi_h) * x - np.sin(phi_h) * y, np.sin(phi_h) * x + np.cos(phi_h) * y)
        found.append(np.stack(np.broadcast_arrays(*turned, c * mean - sign * s * along), -1))
    return found[0], found[1]


def _specular(wi: Direction, wo: Direction, all_axes: bool) -> list[Any]:
    s = ops.sqrt(wi.x * wi.x + wi.y * wi.y + 1e-30)
    cos_phi, sin_phi = azimuth(wi, s)
    forward = -(cos_phi * wo.x + sin_phi * wo.y)
    along = wi.z * forward - s * wo.z
    across = sin_phi * wo.x - cos_phi * wo.y
    radial = ops.arctan2(ops.sqrt(along * along + across * across + 1e-30), s * forward + wi.z * wo.z)
    turn = [azimuth_of(wi)] if all_axes else []
    return [polar_angle(wi), radial, azimuth_of(Direction(along, across, 0.0)), *turn]


def _pairs_of_specular(theta_i: Any, radial: Any, around: Any, phi_i: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    wi = direction(theta_i + 0.0 * radial + 0.0 * around, phi_i + 0.0 * around)
    along, across = np.sin(radial) * np.cos(around), np.sin(radial) * np.sin(around)
    forward = np.sin(theta_i) * np.cos(radial) + np.cos(theta_i) * along
    up = np.cos(theta_i) * np.cos(radial) - np.sin(theta_i) * along
    c, s = np.cos(phi_i), np.sin(phi_i)
    wo = np.broadcast_arrays(-c * forward + s * across, -s * forward - c * across, up)
    return wi, np.stack(wo, -1)


PARAMETERISATIONS = {
    "angles": Parameterisation(
        ("theta_i", "theta_o", "phi_i", "phi_o"), ("phi", "phi_i", "phi_o"), _angles, _pairs_of_angles
    ),
    "relative": Parameterisation(
        ("theta_i", "theta_o", "phi", "phi_i"), ("phi", "phi_i"), _relative, _pairs_of_relative
    ),
    "half_difference": Parameterisation(
        ("theta_h", "theta_d", "phi_d", "phi_h"), ("phi_d", "phi_h"), _half, _pairs_of_half
    ),
    "specular": Parameterisation(
        ("theta_i", "radial", "azimuth", "phi_i"), ("azimuth", "phi_i"), _specular, _pairs_of_specular
    ),
}
"""angles            of both directions; phi = phi_o - phi_i
relative          as angles, where phi stays beside phi_i instead of phi_o: lobes that turn with wi stay whole
half_difference   Rusinkiewicz' angles; phi_d is the azimuth of wi about the half vector, phi_h that of the half vector
specular          wo about the mirror direction s of wi: radial between wo and s, azimuth about s from the direction
                  in which theta grows (0: towards the horizon, pi: towards the normal) to s x that (pi/2)."""


def parameterisation(name: str) -> Parameterisation:
    """The one of this name. Raises ParameterError for another."""
    if name not in PARAMETERISATIONS:
        raise ParameterError(f"parameterisation={name!r}: expected one of {', '.join(map(repr, PARAMETERISATIONS))}")
    return PARAMETERISATIONS[name]
