"""The limits of a goniometer, and the pairs of directions that it can set."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.angles import direction
from ...declared.arguments import checked
from ...declared.notebooks import repr_html
from ...errors import ParameterError, TooLargeError, shown
from ...numerics.unique_rows import unique_rows

MOST = 2_000_000
"""Pairs of directions that a goniometer may have to choose from."""


@dataclass(frozen=True)
class Goniometer:
    """Limits of an instrument, from which pairs of directions are chosen: regular steps between them.

    theta_i, theta_o   least and largest polar angle of light and detector
    phi                least and largest azimuth of the detector from that of the light; pi is forwards, as in a mirror
    phi_i              least and largest azimuth of the light. Without it 0 for isotropic materials, for which it means
                       nothing, else 0 to pi
    step_theta         step of polar angles
    step_phi           step of azimuths
    in_plane           only the plane of incidence: phi of 0 and pi
    least_angle        least angle between light and detector, where the one hides the other

    Units    rad.

    Example
    >>> arm = gn.Goniometer(theta_o=(0.0, np.radians(60.0)), in_plane=True, least_angle=np.radians(10.0))
    >>> wi, wo = arm.pairs()
    >>> print(len(wi), np.degrees(gn.angles(wo)[0].max()).round(1))
    1323 60.0
    """

    _repr_html_ = repr_html

    theta_i: tuple[float, float] = (0.0, math.radians(75.0))
    theta_o: tuple[float, float] = (0.0, math.radians(75.0))
    phi: tuple[float, float] = (0.0, math.pi)
    phi_i: tuple[float, float] | None = None
    step_theta: float = math.radians(2.5)
    step_phi: float = math.radians(5.0)
    in_plane: bool = False
    least_angle: float = math.radians(5.0)

    def __post_init__(self) -> None:
        if not isinstance(self.in_plane, (bool, np.bool_)):
            raise ParameterError(f"Goniometer(in_plane={shown(self.in_plane)}): expected True or False")
        for name in ("theta_i", "theta_o"):
            object.__setattr__(self, name, _range(name, getattr(self, name), 0.0, 0.5 * math.pi))
        object.__setattr__(self, "phi", _range("phi", self.phi, -2.0 * math.pi, 2.0 * math.pi))
        if self.phi_i is not None:
            object.__setattr__(self, "phi_i", _range("phi_i", self.phi_i, -2.0 * math.pi, 2.0 * math.pi))
        for name in ("step_theta", "step_phi"):
            step = _number(name, getattr(self, name))
            if not 0.0 < step <= math.pi or step == round(step):
                raise _refused(name, step, "a step [rad] above 0, such as numpy.radians(5)")
            object.__setattr__(self, name, step)
        least = _number("least_angle", self.least_angle)
        if not 0.0 <= least < 0.25 * math.pi:
            raise _refused("least_angle", least, "an angle [rad] from 0 to pi/4")
        object.__setattr__(self, "least_angle", least)

    @checked
    def pairs(self, isotropic: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """The pairs of directions wi, wo (N, 3) that it can set, each once.

        Raises ParameterError where there is none, TooLargeError where there are more than two million.

        Example
        >>> wi, wo = gn.Goniometer(step_theta=np.radians(25.0), step_phi=np.radians(90.0), least_angle=0.0).pairs()
        >>> print(len(wi), gn.Goniometer().pairs()[0].shape)
        34 (33057, 3)
        """
        theta_i, theta_o = (_steps(limits, self.step_theta) for limits in (self.theta_i, self.theta_o))
        phi = _steps(self.phi, self.step_phi)
        if self.in_plane:
            phi = np.array([x for x in (0.0, math.pi) if self.phi[0] - 1e-9 <= x <= self.phi[1] + 1e-9])
        phi_i = self._azimuths(isotropic)
        count = len(theta_i) * len(theta_o) * len(phi) * len(phi_i)
        if count > MOST:
            raise TooLargeError(f"{self._told()}: {count} pairs of directions; expected at most {MOST}: larger steps")
        a, b, c, d = (x.ravel() for x in np.meshgrid(theta_i, theta_o, phi, phi_i, indexing="ij"))
        wi, wo = direction(a, d), direction(b, c + d)
        apart = np.arctan2(np.linalg.norm(np.cross(wi, wo), axis=-1), (wi * wo).sum(axis=-1))
        kept = np.flatnonzero(apart >= self.least_angle - 1e-9)
        if not len(kept):
            raise ParameterError(
                f"{self._told()}: no pair of directions is left of {count}; expected wider ranges, "
                f"or a smaller least_angle"
            )
        if isotropic:  # azimuths are turned together: what counts is the angle between
            key = np.stack([wi[kept, 2], wo[kept, 2], (wi * wo).sum(axis=-1)[kept]], axis=-1)
        else:
            key = np.concatenate([wi[kept], wo[kept]], axis=-1)
        kept = kept[np.sort(unique_rows(key.round(9) + 0.0)[0])]
        return wi[kept], wo[kept]

    def _azimuths(self, isotropic: bool) -> np.ndarray:
        if self.phi_i is None:
            return np.zeros(1) if isotropic else _steps((0.0, math.pi), self.step_phi)
        return _steps(self.phi_i, self.step_phi)

    def _told(self) -> str:
        parts = [
            f"{name} {math.degrees(x[0]):g} to {math.degrees(x[1]):g}"
            for name, x in (
                ("theta_i", self.theta_i),
                ("theta_o", self.theta_o),
                ("phi", self.phi),
                ("phi_i", self.phi_i),
            )
            if x is not None
        ]
        return f"goniometer, {', '.join(parts)} degrees{', in plane' if self.in_plane else ''}"


def _number(name: str, value: Any) -> float:
    try:
        number = float(value) if not isinstance(value, (str, bytes)) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ParameterError(f"Goniometer({name}={shown(value)}): expected a number [rad]")
    return number


def _range(name: str, value: Any, low: float, high: float) -> tuple[float, float]:
    """A range of angles within bounds."""
    try:
        first, last = value
    except (TypeError, ValueError):
        raise ParameterError(
            f"Goniometer({name}={shown(value)}): expected two angles [rad], (least, largest)"
        ) from None
    limits = _number(name, first), _number(name, last)
    for x in limits:
        if not low - 1e-9 <= x <= high + 1e-9:
            raise _refused(name, x, f"angles [rad] from {low:.4g} to {high:.4g}")
    if limits[0] > limits[1]:
        raise ParameterError(f"Goniometer({name}={shown(value)}): expected the least angle first, then the largest")
    return limits


def _refused(name: str, x: float, expected: str) -> ParameterError:
    degrees = f"; in degrees? numpy.radians({x:g}) = {math.radians(x):.4g}" if x >= 1.0 else ""
    return ParameterError(f"Goniometer({name}={x:g}): expected {expected}{degrees}")


def _steps(limits: tuple[float, float], step: float) -> np.ndarray:
    low, high = limits
    return low + step * np.arange(math.floor((high - low) / step + 1e-6) + 1)
