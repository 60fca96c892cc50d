"""Another light, turned about the vertical: a day that passes, a table that turns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..arrays import ops
from ..base.light import ORIGIN, Light, _OfLight
from ..errors import ParameterError
from ..formula.direction import Direction
from ..formula.fields import param, part
from .constant import ConstantLight
from .function import FunctionLight


class TurnedLight(_OfLight, has_text=True):
    r"""A light turned by an angle about the world's z axis, counterclockwise as seen from above: with R the rotation,
    $L(p, \omega) = L_0(R^{-1} p, R^{-1} \omega)$, and so for beams.

    The angle is a parameter as others are: one formula, compiled once, lights all pictures of a turntable.

    Looks    `TurnedLight(EnvironmentLight.studio(), 2.0)`: the studio, with the sun to the right.
    Shapes   light: any light but a `FunctionLight`; angle: a number.
    Units    angle: rad; the light's own.
    Errors   ParameterError for a `FunctionLight`, which can turn its directions itself.
    Error    rounding.
    Source   a rotation keeps solid angles, so that densities are those of the light.

    Example
    >>> sun = gn.TurnedLight(gn.DistantLight([1.0, 0.0, 1.0], irradiance=3.0), 0.5 * np.pi)
    >>> print(sun.arrival([0.0, 0.0, 0.0]).w.round(4))
    [0.     0.7071 0.7071]
    """

    light = part(Light, ConstantLight(1.0), "the light that is turned")
    angle = param(0.0, -1e6, 1e6, "by how much it is turned", unit="rad")

    def validate(self) -> None:
        if not self.light.is_formula():
            cure = f"turn the directions in its function, or write a formula in place of the {FunctionLight.__name__}"
            raise ParameterError(f"TurnedLight: {type(self.light).__name__} is no formula on components; {cure}")

    def _turned(self, v: Direction, back: bool = False) -> Direction:
        """A vector of the light in the world, or of the world in the light."""
        cos, sin = ops.cos(1.0 * self.angle), ops.sin(1.0 * self.angle)
        sin = -sin if back else sin
        return Direction(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z)

    def _place(self, p: Direction) -> Direction:
        return self._turned(p, back=True)

    def _inwards(self, w: Direction) -> Direction:
        return self._turned(w, back=True)

    def _outwards(self, w: Direction) -> Direction:
        return self._turned(w)

    def _moved(self, by: Sequence[float]) -> Light:
        back = Direction(*map(float, self._turned(Direction(*by), back=True)))
        light = self.light.moved(back)
        return self if light is self.light else _TurnedAbout(light, self.angle, back.x, back.y, self.angle)


class _TurnedAbout(TurnedLight, has_text=False):
    """A light turned about a vertical elsewhere: at the angle that it had when it was moved it is where it should be,
    and a change of the angle takes it round that vertical."""

    axis_x = param(0.0, -1e30, 1e30, "where the vertical is, in the light, along x", unit="m")
    axis_y = param(0.0, -1e30, 1e30, "and along y", unit="m")
    since = param(0.0, -1e6, 1e6, "the angle that it was moved at", unit="rad")

    def _place(self, p: Direction) -> Direction:
        at, more = self._turned(p, back=True), self.angle - self.since
        x, y, sin, rest = self.axis_x, self.axis_y, ops.sin(1.0 * more), 1.0 - ops.cos(1.0 * more)
        return Direction(at.x + x * rest - y * sin, at.y + y * rest + x * sin, at.z)


def turned(light: Light, angle: float) -> Light:
    """A light turned by an angle [rad]; a `FunctionLight` by turning the directions that it is asked for."""
    if light.is_formula():
        return TurnedLight(light, angle)
    cos, sin = math.cos(angle), math.sin(angle)

    def of(w: Any) -> Any:
        x, y, z = w[..., 0], w[..., 1], w[..., 2]
        return light.incident(ops.library(w).stack(Direction(cos * x + sin * y, cos * y - sin * x, z)), ORIGIN)

    return FunctionLight(of)
