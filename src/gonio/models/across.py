"""Any reflectance, across the surface: what it would reflect, it transmits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..base.reflectance import Reflectance
from ..base.sides import choose
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import param, part
from ._wrapper import WrappedLobe
from .lambertian import Lambertian


class Across(WrappedLobe):
    """A reflectance as a transmittance: f(wi, wo) = of.f(wi mirrored at the surface, wo), wi behind and wo in front.

    The mirror direction of `of` becomes straight through, as in files of transmission, whose tables fit in unchanged. A
    Lambertian reflectance becomes `DiffuseTransmission`. From behind it is its own reverse, which for a reciprocal `of`
    is reciprocal too: f there is of.f with both directions mirrored at the plane x = 0.

    Looks    `Across(Microfacet(GGX(0.2)))` is a diffuser: a lamp behind it is a soft spot of light.
    Shapes   as `of`.
    Units    f: 1/sr.
    Error    none of its own.
    Source   definition; the same convention as in "WINDOW" files of LBNL.

    Example
    >>> diffuser = gn.Across(gn.Microfacet(gn.GGX(0.2)))
    >>> wo = gn.direction(0.3, 0.0)
    >>> print(diffuser.f(-wo, wo).round(3), diffuser.f(wo, wo))  # straight through; from in front
    2.176 0.0
    """

    sides = "across"
    of = part(Reflectance, Lambertian(0.5), "reflectance whose light goes through")

    @property
    def _flip(self) -> Any:
        """-1 where x is turned round."""
        return 1.0

    def turned(self, back: Any) -> Reflectance:
        return tree.unchecked(_Flipped, of=self.of, sign=choose(back, -self._flip, self._flip))

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for weight, lobe in self.of.lobes():
            yield weight, self if lobe is self.of else self._changed({"of": lobe})

    def _inside(self, wo: Direction) -> Direction:
        return Direction(self._flip * wo.x, wo.y, wo.z)

    def _lit(self, wi: Direction) -> Direction:
        """wi as `of` sees it, above; and back."""
        return Direction(self._flip * wi.x, wi.y, -wi.z)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.formula(self._lit(wi), self._inside(wo))

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return self._lit(self.of.warp(self._inside(wo), u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        return self.of.density(self._lit(wi), self._inside(wo))

    def mirror(self, wo: Direction) -> Any:
        return self.of.mirror(self._inside(wo))

    def mirrored(self, wo: Direction) -> Direction:
        return self._lit(self.of.mirrored(self._inside(wo)))

    def estimate(self, wo: Direction) -> Any:
        return self.of.estimate(self._inside(wo))


class _Flipped(Across):
    """`Across` as seen from behind."""

    sign = param(1.0, -1.0, 1.0, "-1 where x is turned round")

    @property
    def _flip(self) -> Any:
        return self.sign
