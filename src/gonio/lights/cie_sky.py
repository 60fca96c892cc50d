"""The fifteen standard skies of the CIE: overcast, partly cloudy, clear and turbid."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from ..arrays import ops
from ..base.light import FAR, Light
from ..errors import ParameterError
from ..formula.direction import Direction, cross, dot
from ..formula.fields import Field, param
from ..formula.text import shown
from ..formula.world import vector
from ._cone import upper_hemisphere, upper_hemisphere_density
from ._words import Word, towards

GRADATIONS = ((4.0, -0.7), (1.1, -0.8), (0.0, -1.0), (-1.0, -0.55), (-1.0, -0.32), (-1.0, -0.15))
"""a and b: how radiance changes between zenith and horizon."""

INDICATRICES = (
    (0.0, -1.0, 0.0),
    (2.0, -1.5, 0.15),
    (5.0, -2.5, 0.3),
    (10.0, -3.0, 0.45),
    (16.0, -3.0, 0.3),
    (24.0, -2.8, 0.15),
)
"""c, d and e: how it changes with the angle from the sun."""

TYPES = (
    (1, 1),
    (1, 2),
    (2, 1),
    (2, 2),
    (3, 1),
    (3, 2),
    (3, 3),
    (3, 4),
    (4, 2),
    (4, 3),
    (4, 4),
    (5, 4),
    (5, 5),
    (6, 5),
    (6, 6),
)
"""Gradation and indicatrix of the types 1 to 15."""


class _Type(Field):
    accepts, range = "int", "1 to 15"

    def check(self, owner: str, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 1 <= value <= len(TYPES):
            raise ParameterError(f"{owner}({self.name}={shown(value)}): expected a whole number from 1 to {len(TYPES)}")
        return int(value)


class CIESky(Light):
    r"""Standard sky of the CIE, above the horizon of the world; the sun itself is not part of it.

    $$L = L_z \frac{f(\chi)\, \varphi(Z)}{f(Z_s)\, \varphi(0)}, \quad \varphi(Z) = 1 + a e^{b/\cos Z}, \quad
    f(\chi) = 1 + c (e^{d \chi} - e^{d \pi/2}) + e \cos^2 \chi$$

    Z is the angle from the zenith, $\chi$ that from the sun, $Z_s$ that of the sun from the zenith. Types: 1 overcast,
    2 the same brighter towards the sun, 3 and 4 overcast with less gradation, 5 uniform, 6 to 11 partly cloudy, ever
    clearer, 12 clear, 13 clear and polluted, 14 and 15 cloudless and turbid.

    Looks    `CIESky(12, [-0.6, -0.6, 0.6], 0.15)`: a clear sky, brightest about the sun and pale above the horizon;
             black below.
    Shapes   sun: (3,), the direction to the sun, of any length; zenith: a number or (C,).
    Units    zenith L_z: W m-2 sr-1, or cd m-2, and then the results are photometric too.
    Error    rounding.
    Source   CIE S 011/E:2003 (ISO 15469:2004), the parameters as in Darula & Kittler 2002, "CIE general sky standard
             defining luminance distributions", Proc. eSim.

    Example
    >>> sky = gn.CIESky(1, zenith=3.0)  # overcast: the zenith is three times as bright as the horizon
    >>> print(sky.incident(gn.direction([0.0, 1.57], 0.0)).round(2).ravel(), gn.irradiance(sky).round(2))
    [3. 1.] 7.35
    """

    type: Any = _Type(12, "the standard's number of the sky")
    sun = vector((0.0, -0.7, 0.7), "direction to the sun", unit=True)
    zenith = param(1.0, 0.0, 1e30, "radiance of the zenith", unit="W m-2 sr-1")

    has_horizon: ClassVar[bool] = True

    def validate(self) -> None:
        if self.like() is None and not np.asarray(self.sun)[2] > 0.0:
            raise ParameterError(f"CIESky(sun={self.sun}): the sun is below the horizon; expected z above 0")

    def _relative(self, w: Direction) -> Any:
        """L/L_z above the horizon."""
        gradation, indicatrix = TYPES[self.type - 1]
        (a, b), (c, d, e), sun = GRADATIONS[gradation - 1], INDICATRICES[indicatrix - 1], self.sun.unit

        def f(cos: Any, sin: Any) -> Any:
            return 1.0 + c * (ops.exp(d * ops.arctan2(sin, cos)) - math.exp(0.5 * math.pi * d)) + e * cos * cos

        across = cross(sun, w)
        around = f(dot(sun, w), ops.sqrt(dot(across, across) + 1e-20))
        at_zenith = f(sun.z, ops.sqrt(sun.x * sun.x + sun.y * sun.y + 1e-20))
        up = ops.maximum(w.z, 1e-3)  # b < 0: nearer to the horizon the exponential is 0
        return around / at_zenith * (1.0 + a * ops.exp(b / up)) / (1.0 + a * math.exp(b))

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        above = w.z > 0.0
        safe = Direction(w.x, w.y, ops.where(above, w.z, 1.0))
        return self.zenith * ops.where(above, self._relative(safe), 0.0), FAR

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        return upper_hemisphere(u0, u1)

    def density(self, p: Direction, w: Direction) -> Any:
        return upper_hemisphere_density(w)

    def strength(self, p: Direction) -> Any:
        return math.pi * self.zenith


def _of_numbers(numbers: list[float]) -> CIESky:
    if numbers[0] != int(numbers[0]):
        raise ParameterError(f"cie: type {numbers[0]:g}, expected a whole number from 1 to 15")
    if len(numbers) not in (3, 4):
        raise ParameterError("expected cie:TYPE,THETA,PHI[,L]")
    return CIESky(int(numbers[0]), towards(*numbers[1:3]), *numbers[3:])


WORDS = [
    Word(
        "cie:TYPE,THETA,PHI[,L]",
        "CIE sky 1 to 15, the sun there",
        _of_numbers,
        "such as cie:12,45,-60",
    )
]
