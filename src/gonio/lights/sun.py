"""The sun as a disk of the sky: shadows and highlights have its size."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.light import FAR, Light
from ..errors import ParameterError
from ..formula.direction import Direction
from ..formula.fields import param
from ..formula.projected import disk_projected
from ..formula.world import vector
from ._cone import cone, cone_solid_angle, in_cone
from ._words import Word, spectrum, towards

SUN_RADIUS = 0.004652
"""Angular radius [rad] of the sun at its mean distance: 695 700 km over 149.6 million km."""


class SunLight(Light):
    r"""Disk of the sky of constant radiance: $L = E/(\pi \sin^2\alpha)$ within the angle alpha of its direction.

    E is the irradiance of a plane that faces it: as alpha goes to 0 it becomes a `DistantLight` of the same irradiance.
    `sample` is uniform in the cone.

    Looks    `SunLight([-0.8, -0.7, 0.8], 3.1, radius=0.3)`, large as a sun through haze: soft edges, a round
             highlight.
    Shapes   direction: (3,), to the light, of any length; irradiance: a number or (C,); radius: a number.
    Units    irradiance: W m-2; radius: rad.
    Error    rounding.
    Source   definition; the default radius: 695 700 km at 149.6 million km.

    Example
    >>> sun = gn.SunLight([0.0, 0.0, 1.0], irradiance=1000.0)
    >>> print(sun.incident([0.0, 0.0, 1.0]).round(-4), gn.irradiance(sun, [0, 0, 0], [0.0, 0.6, 0.8]).round(2))
    [14710000.] 800.0
    """

    direction = vector((0.0, 0.0, 1.0), "direction to the light", unit=True)
    irradiance = param(1.0, 0.0, 1e30, "irradiance on a plane perpendicular to its direction", unit="W m-2")
    radius = param(SUN_RADIUS, 1e-6, 0.5 * math.pi, "angle between its centre and its edge", unit="rad")

    has_edges: ClassVar[bool] = True
    can_sample: ClassVar[bool] = True

    @property
    def _sin2(self) -> Any:
        sin = ops.sin(1.0 * self.radius)
        return sin * sin

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        L = self.irradiance / (math.pi * self._sin2)
        return ops.where(in_cone(self.direction.unit, self._sin2, w), L, 0.0), FAR

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        return cone(self.direction.unit, self._sin2, u0, u1)

    def density(self, p: Direction, w: Direction) -> Any:
        inside = in_cone(self.direction.unit, self._sin2, w)
        return ops.where(inside, 1.0 / cone_solid_angle(self._sin2), 0.0)

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        axis, sin2 = self.direction.unit, self._sin2
        tan = ops.sqrt(sin2 / ops.maximum(1.0 - sin2, 1e-12))
        return self.irradiance / (math.pi * sin2) * disk_projected(axis, axis, tan, n)

    def strength(self, p: Direction) -> Any:
        return self.irradiance


UPPER_LEFT = (-0.8, -0.7, 0.8)


def _of_numbers(numbers: list[float]) -> SunLight:
    if len(numbers) == 1:
        raise ParameterError("expected sun, or sun:THETA,PHI[,E]")
    direction = towards(*numbers[:2]) if numbers else UPPER_LEFT
    return SunLight(direction, spectrum(numbers[2:], math.pi))


WORDS = [
    Word(
        "sun[:THETA,PHI[,E]]",
        "the sun's disk, of irradiance E; default: upper left, pi",
        _of_numbers,
        "in degrees, such as sun:45,-60",
    )
]
