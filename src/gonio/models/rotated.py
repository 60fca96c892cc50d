"""A reflectance turned about the normal: the brushing direction lies elsewhere."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..base.sides import choose
from ..distributions.ggx import GGX
from ..formula.direction import Direction
from ..formula.fields import param, part
from ..formula.mueller import Mueller, turned_axes
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

    of = part(Reflectance, Microfacet(GGX(0.1, 0.4)), "reflectance before the turn", sides="any")
    angle = param(0.0, -2.0 * math.pi, 2.0 * math.pi, "azimuth of its tangent", unit="rad")

    @property
    def sides(self) -> str:
        return str(self.of.sides)

    @property
    def index(self) -> Any:
        return self.of.index

    @property
    def _split(self) -> bool:
        return bool(self.of._split)

    def turned(self, back: Any) -> Reflectance:
        return self._changed({"of": self.of.turned(back), "angle": choose(back, -self.angle, self.angle)})

    def light_within(self, wi: Direction) -> Direction:
        return _turned(wi, -self.angle)

    def light_outside(self, wi: Direction) -> Direction:
        return _turned(wi, self.angle)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.formula(self.light_within(wi), self.viewer_within(wo))

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return self.light_outside(self.of.warp(self.viewer_within(wo), u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        return self.of.density(self.light_within(wi), self.viewer_within(wo))

    def _chance(self, wi: Direction, wo: Direction) -> Any:
        return self.of._chance(self.light_within(wi), self.viewer_within(wo))

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        return self._outside(self.of.polarized(self.light_within(wi), self.viewer_within(wo)), wi, wo)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        return self._outside(self.of.polarized_mirror(self.viewer_within(wo)), self.mirrored(wo), wo)

    def _outside(self, M: Mueller, wi: Direction, wo: Direction) -> Mueller:
        # Axes along increasing azimuth turn with the directions; at the pole, where the azimuth is 0, they do not.
        return _at_pole(wo, self.angle).transposed @ M @ _at_pole(wi, -self.angle)

    @property
    def _glows_evenly(self) -> bool:
        return bool(self.of._glows_evenly)

    def reradiated(self, light: Any, wi: Direction, wo: Direction) -> Any:
        return self.of.reradiated(light.of, light.light_within(wi), self.viewer_within(wo))

    def mirror(self, wo: Direction) -> Any:
        return self.of.mirror(self.viewer_within(wo))

    def diffuse(self) -> Any:
        return self.of.diffuse()


def _at_pole(w: Direction, angle: Any) -> Mueller:
    """To axes turned by an angle where w is the pole."""
    pole = w.x * w.x + w.y * w.y < 1e-20
    s = ops.sin(2.0 * angle)
    return turned_axes(ops.where(pole, ops.cos(2.0 * angle), 1.0), ops.where(pole, ops.where(w.z < 0.0, -s, s), 0.0))


def _turned(w: Direction, angle: Any) -> Direction:
    c, s = ops.cos(angle), ops.sin(angle)
    return Direction(c * w.x - s * w.y, s * w.x + c * w.y, w.z)
