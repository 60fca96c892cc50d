"""A reflectance turned about the normal: the brushing direction lies elsewhere."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..distributions.ggx import GGX
from ..formula.direction import Direction
from ..formula.fields import param, part
from ._wrapper import Reframed
from .microfacet import Microfacet


class Rotated(Reframed):
    """Another reflectance with its tangent turned by `angle` about the normal, from x towards y: f = of.f(R wi, R wo).

    R turns directions by -angle, so that the brushing direction of `of` lies at azimuth `angle`.

    Looks    `Rotated(Microfacet(GGX(0.05, 0.4)), 0.8)` is brushed metal whose highlight is drawn out along a slant;
             over isotropic materials it changes nothing.
    Shapes   angle: a number or (..., C), a map of brushing directions for example.
    Units    angle: rad.
    Error    rounding.
    Source   definition.

    Example
    >>> brushed = gn.Microfacet(gn.GGX(0.1, 0.4))
    >>> turned = gn.Rotated(brushed, np.pi / 2)
    >>> print(brushed.f_angles(0.0, 0.0, 0.4, 0.0).round(4), turned.f_angles(0.0, 0.0, 0.4, np.pi / 2).round(4))
    0.0896 0.0896
    """

    of = part(Reflectance, Microfacet(GGX(0.1, 0.4)), "reflectance before the turn")
    angle = param(0.0, -2.0 * math.pi, 2.0 * math.pi, "azimuth of its tangent", unit="rad")

    def light_within(self, wi: Direction) -> Direction:
        return _turned(wi, -self.angle)

    def light_outside(self, wi: Direction) -> Direction:
        return _turned(wi, self.angle)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.formula(self.light_within(wi), self.viewer_within(wo))

    def mirror(self, wo: Direction) -> Any:
        return self.of.mirror(self.viewer_within(wo))

    def diffuse(self) -> Any:
        return self.of.diffuse()


def _turned(w: Direction, angle: Any) -> Direction:
    c, s = ops.cos(angle), ops.sin(angle)
    return Direction(c * w.x - s * w.y, s * w.x + c * w.y, w.z)
