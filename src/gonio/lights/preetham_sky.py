"""The clear sky in colour, by how hazy the air is: Preetham, Shirley and Smits."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from ..arrays import frozen, ops
from ..base.light import FAR, Light
from ..errors import ParameterError
from ..formula.direction import Direction, cross, dot
from ..formula.fields import channels, param
from ..formula.world import vector
from ..pictures.colour import RGB_OF_XYZ
from ._cone import upper_hemisphere, upper_hemisphere_density
from ._words import Word, towards

# Slope and value at 0, by turbidity, of the numbers A to E of the formula: of luminance and of chromaticity.
_LUMINANCE = ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703))
_X = ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452))
_Y = ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529))

# Chromaticity of the zenith: by powers of turbidity from the second down, and of the sun's angle from the third down.
_ZENITH_X = (
    (0.00166, -0.00375, 0.00209, 0.0),
    (-0.02903, 0.06377, -0.03202, 0.00394),
    (0.11693, -0.21196, 0.06052, 0.25886),
)
_ZENITH_Y = (
    (0.00275, -0.00610, 0.00317, 0.0),
    (-0.04214, 0.08970, -0.04153, 0.00516),
    (0.15346, -0.26756, 0.06670, 0.26688),
)


class PreethamSky(Light):
    r"""Clear or hazy sky above the horizon of the world, in linear sRGB; the sun itself is not part of it: `SunLight`.

    Luminance and chromaticity are each their value at the zenith times $F(\theta, \gamma)/F(0, \theta_s)$,
    $F(\theta, \gamma) = (1 + A e^{B/\cos\theta})(1 + C e^{D \gamma} + E \cos^2\gamma)$: theta from the zenith,
    gamma from the sun; A to E are linear in the turbidity.

    Looks    `PreethamSky(3.0, [-0.6, -0.6, 0.6], 0.05)`: a blue sky that whitens to the horizon and about the sun.
    Shapes   sun: (3,), the direction to the sun, of any length; results have three channels.
    Units    luminance of the result: `scale` times kcd m-2. For radiance divide by an efficacy of your own, such as
             683 lm/W times that of the sky's light.
    Error    rounding; the model is a fit for turbidities of 2 to 6 or so, less so near the sun.
    Source   Preetham, Shirley & Smits 1999, "A practical analytic model for daylight", SIGGRAPH, appendix A.2.

    Example
    >>> sky = gn.PreethamSky(3.0, sun=gn.direction(0.8, 0.0))
    >>> print(sky.incident(gn.direction(0.8, np.pi)).round(2))
    [ 2.66  5.37 10.47]
    """

    turbidity = param(3.0, 1.7, 10.0, "haze: 2 is very clear, 3 clear, 6 hazy, 10 foggy")
    sun = vector((0.0, -0.7, 0.7), "direction to the sun", unit=True)
    scale = param(1.0, 0.0, 1e30, "factor on the luminance", unit="kcd m-2")
    channel = channels("red, green, blue")

    has_horizon: ClassVar[bool] = True

    def validate(self) -> None:
        self._hold(channel=frozen(np.arange(3.0)))
        if self.like() is None and not np.asarray(self.sun)[2] > 0.0:
            raise ParameterError(f"PreethamSky(sun={self.sun}): the sun is below the horizon; expected z above 0")

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        above = w.z > 0.0
        safe = Direction(w.x, w.y, ops.where(above, w.z, 1.0))
        return self.scale * ops.where(above, self._rgb(safe), 0.0), FAR

    def _rgb(self, w: Direction) -> Any:
        """The channel's value."""
        sun, T = self.sun.unit, self.turbidity
        theta = ops.arctan2(ops.sqrt(sun.x * sun.x + sun.y * sun.y + 1e-20), sun.z)
        across = cross(sun, w)
        cos, gamma = dot(sun, w), ops.arctan2(ops.sqrt(dot(across, across) + 1e-20), dot(sun, w))
        up = ops.maximum(w.z, 1e-2)  # the exponential is 0 from there on

        def relative(numbers: Any) -> Any:
            A, B, C, D, E = (slope * T + start for slope, start in numbers)
            here = (1.0 + A * ops.exp(B / up)) * (1.0 + C * ops.exp(D * gamma) + E * cos * cos)
            return here / ((1.0 + A * ops.exp(B)) * (1.0 + C * ops.exp(D * theta) + E * sun.z * sun.z))

        chi = (4.0 / 9.0 - T / 120.0) * (math.pi - 2.0 * theta)
        zenith = (4.0453 * T - 4.9710) * (ops.sin(chi) / ops.cos(chi)) - 0.2155 * T + 2.4192
        luminance = ops.maximum(zenith, 0.0) * relative(_LUMINANCE)
        x, y = (_of_zenith(table, T, theta) * relative(f) for table, f in ((_ZENITH_X, _X), (_ZENITH_Y, _Y)))
        X, Z = luminance * x / y, luminance * (1.0 - x - y) / y
        red, green, blue = (ops.maximum(a * X + b * luminance + c * Z, 0.0) for a, b, c in RGB_OF_XYZ.tolist())
        return ops.where(self.channel < 0.5, red, ops.where(self.channel < 1.5, green, blue))

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        return upper_hemisphere(u0, u1)

    def density(self, p: Direction, w: Direction) -> Any:
        return upper_hemisphere_density(w)

    def strength(self, p: Direction) -> Any:
        return 10.0 * self.scale  # of a clear day, to its order of magnitude


def _of_zenith(table: tuple[tuple[float, ...], ...], T: Any, theta: Any) -> Any:
    total: Any = 0.0
    for row in table:
        cubic: Any = 0.0
        for number in row:
            cubic = cubic * theta + number
        total = total * T + cubic
    return total


WORDS = [
    Word(
        "clearsky:THETA,PHI[,T]",
        "clear sky, the sun there",
        lambda numbers: PreethamSky(*numbers[2:3] or [3.0], sun=towards(*numbers[:2]), scale=0.1),
        "in degrees, such as clearsky:45,-60",
    )
]
