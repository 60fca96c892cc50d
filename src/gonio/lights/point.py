"""A small source at a place: irradiance falls with the squared distance."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..base.light import Light
from ..formula.direction import Direction
from ..formula.fields import param
from ..formula.world import vector
from ._beam import is_at, to_place
from ._words import Word, spectrum


class PointLight(Light):
    """Nearby point source: E = I cos(theta)/r^2 at distance r, from the direction of `position`.

    Looks    `PointLight([-1.5, -1.3, 1.0], 5.0)`, near: less than half of the sphere is lit, and the floor fades
             away.
    Shapes   position: (3,); intensity: a number or (C,).
    Units    position: m; intensity I: W sr-1.
    Error    rounding. At the light's own place the direction is undefined: an error, or NaN.
    Source   "nearby point source", slides B (docs/equations.md), whose N.S/r^2 has the 1/pi rolled into S.

    Example
    >>> lamp = gn.PointLight(position=[0.0, 0.0, 2.0], intensity=100.0)
    >>> up = [0, 0, 1]
    >>> print(gn.reflected_radiance(gn.Lambertian(0.5), lamp, up, normal=up, position=[0, 0, 0]).round(3))
    3.979
    """

    position = vector((0.0, 0.0, 1.0), "where the light is [m]")
    intensity = param(1.0, 0.0, 1e30, "radiant intensity", unit="W sr-1")

    is_delta: ClassVar[bool] = True

    def holds(self, p: Direction) -> Any:
        return is_at(self.position.vector, p)

    def beam(self, p: Direction) -> tuple[Direction, Any, Any]:
        w, r2, r = to_place(self.position.vector, p)
        return w, self.intensity / r2, r


def _of_numbers(numbers: list[float]) -> PointLight:
    position = numbers[:3]
    return PointLight(position, spectrum(numbers[3:], math.pi * sum(x * x for x in position)))


WORDS = [
    Word(
        "point:X,Y,Z[,I]",
        "point source of intensity I; default: irradiance pi at the centre of the sphere",
        _of_numbers,
        "in metres, such as point:2,-3,3",
    )
]
