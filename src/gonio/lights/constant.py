"""The same radiance from every direction: an overcast day, or the furnace of a test."""

from __future__ import annotations

import math
from typing import Any

from ..base.light import FAR, Light
from ..formula.direction import Direction
from ..formula.fields import param
from ..formula.warp import uniform_sphere
from ._words import Word, spectrum


class ConstantLight(Light):
    """Constant illumination: L(w) = radiance.

    Looks    `ConstantLight(0.7)` has no shadows: matt things look flat, metal shows an even world.
    Shapes   radiance: a number or (C,).
    Units    radiance: W m-2 sr-1.
    Error    none.
    Source   lecture 4, eq. 4.11 (docs/equations.md).

    Example
    >>> sky = gn.ConstantLight([0.3, 0.5, 1.0])
    >>> up = [0, 0, 1]
    >>> print(gn.reflected_radiance(gn.Lambertian(0.5), sky, up, normal=up).round(3))
    [0.15 0.25 0.5 ]
    """

    radiance = param(1.0, 0.0, 1e30, "radiance", unit="W m-2 sr-1")

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        return self.radiance, FAR

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        return uniform_sphere(u0, u1)

    def density(self, p: Direction, w: Direction) -> Any:
        return 0.25 / math.pi

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        return math.pi * self.radiance

    def strength(self, p: Direction) -> Any:
        return math.pi * self.radiance


WORDS = [
    Word("constant[:L]", "radiance L from everywhere; default 1", lambda numbers: ConstantLight(spectrum(numbers, 1.0)))
]
