"""The limits of a goniometer, and the pairs of directions that it can set."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...base.angles import direction
from ...declared.arguments import ABOVE_ZERO, Declared, check_fields, checked
from ...declared.notebooks import repr_html
from ...errors import ParameterError, TooLargeError
from ...numerics.unique_rows import unique_rows

TURN = (-2.0 * math.pi, 2.0 * math.pi, "rad")
"""Bounds of azimuths."""

POLAR, STEP = (0.0, math.radians(75.0)), math.radians(2.5)
"""Usual range of polar angles, and their step."""

MOST = 2_000_000
"""Pairs of directions that a goniometer may have to choose from."""

LightRange = Annotated[
    tuple[float, float], Declared("least and largest polar angle of the light", 0.0, 0.5 * math.pi, "rad")
]
ViewRange = Annotated[
    tuple[float, float], Declared("least and largest polar angle of the detector", 0.0, 0.5 * math.pi, "rad")
]
Azimuths = Annotated[
    tuple[float, float],
    Declared(
        "least and largest azimuth of the detector from the light's; half a turn is forwards, as mirrors are", *TURN
    ),
]
OwnAzimuths = Annotated[
    tuple[float, float],
    Declared("of the light's own azimuth; without it 0 for isotropic materials, else to half a turn", *TURN),
]
PolarStep = Annotated[float, Declared("between polar angles", ABOVE_ZERO, math.pi, "rad")]
AzimuthStep = Annotated[float, Declared("between azimuths", ABOVE_ZERO, math.pi, "rad")]
Shadow = Annotated[
    float, Declared("least angle between light and detector, where the one hides the other", 0.0, 0.25 * math.pi, "rad")
]


@dataclass(frozen=True)
class Goniometer:
    """Limits of an instrument, from which pairs of directions are chosen: regular steps between them.

    Units    rad.

    Example
    >>> arm = gn.planning.Goniometer(theta_o=(0.0, np.radians(60.0)), in_plane=True, least_angle=np.radians(10.0))
    >>> wi, wo = arm.pairs()
    >>> print(len(wi), np.degrees(gn.angles(wo)[0].max()).round(1))
    1323 60.0
    """

    _repr_html_ = repr_html

    theta_i: LightRange = POLAR
    theta_o: ViewRange = POLAR
    phi: Azimuths = (0.0, math.pi)
    phi_i: OwnAzimuths | None = None
    step_theta: PolarStep = STEP
    step_phi: AzimuthStep = 2.0 * STEP
    in_plane: Annotated[bool, Declared("only the plane of incidence, backwards and forwards")] = False
    least_angle: Shadow = 2.0 * STEP

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("theta_i", "theta_o", "phi", "phi_i"):
            limits = getattr(self, name)
            if limits is not None and limits[0] > limits[1]:
                raise ParameterError(f"Goniometer({name}={limits}): expected the least angle first, then the largest")
        for name in ("step_theta", "step_phi"):
            if (step := getattr(self, name)).is_integer():
                instead = f"in degrees? numpy.radians({step:g}) = {math.radians(step):.4g}"
                raise ParameterError(f"Goniometer({name}={step:g}): expected no whole number of radians; {instead}")

    @checked
    def pairs(self, isotropic: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """The pairs of directions wi, wo (N, 3) that it can set, each once.

        Raises ParameterError where there is none, TooLargeError where there are more than two million.

        Example
        >>> coarse = gn.planning.Goniometer(step_theta=np.radians(25.0), step_phi=np.radians(90.0), least_angle=0.0)
        >>> wi, wo = coarse.pairs()
        >>> print(len(wi), gn.planning.Goniometer().pairs()[0].shape)
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


def _steps(limits: tuple[float, float], step: float) -> np.ndarray:
    low, high = limits
    return low + step * np.arange(math.floor((high - low) / step + 1e-6) + 1)
