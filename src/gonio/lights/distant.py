"""A source so far away that its light is parallel: the sun."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..base.light import FAR, Light
from ..formula.direction import Direction
from ..formula.fields import param
from ..formula.world import vector
from ._words import Word, spectrum, towards


class DistantLight(Light):
    """Distant point source: L_i = E delta(theta_i - theta_s) delta(phi_i - phi_s)/sin(theta_s).

    Looks    `DistantLight([-0.8, -0.7, 0.8], 3.1)` draws a sharp line between day and night, and a highlight as
             narrow as the gloss.
    Shapes   direction: (3,), to the light, of any length; irradiance: a number or (C,).
    Units    irradiance E on a plane perpendicular to the beam: W m-2.
    Error    rounding.
    Source   lecture 4, eq. 4.9 and 4.10 (docs/equations.md).

    Example
    >>> sun = gn.DistantLight(gn.direction(0.5, 0.0), irradiance=1000.0)
    >>> up = [0, 0, 1]
    >>> print(gn.reflected_radiance(gn.Lambertian(0.5), sun, up, normal=up).round(2))
    139.67
    """

    direction = vector((0.0, 0.0, 1.0), "direction to the light", unit=True)
    irradiance = param(1.0, 0.0, 1e30, "irradiance on a plane perpendicular to the beam", unit="W m-2")

    is_delta: ClassVar[bool] = True

    def beam(self, p: Direction) -> tuple[Direction, Any, Any]:
        return self.direction.unit, self.irradiance, FAR


WORDS = [
    Word(
        "distant:THETA,PHI[,E]",
        "parallel beam of irradiance E; default pi, which lights a white surface that faces it to radiance 1",
        lambda numbers: DistantLight(towards(*numbers[:2]), spectrum(numbers[2:], math.pi)),
        "in degrees, such as distant:45,-60",
    )
]
