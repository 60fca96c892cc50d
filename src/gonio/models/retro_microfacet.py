"""Retro-reflection: mirror facets that send light back to where it came from, instead of to the other side."""

from __future__ import annotations

from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction, half_and_cosine, mirror
from .microfacet import Microfacet


class RetroMicrofacet(Microfacet):
    """Rough retro-reflector: f(wi, wo) = f_m(wi, mirror image of wo about the normal), f_m a `Microfacet`.

    The lobe of f_m about the mirror direction becomes one about the direction to the light, of the same albedo. It is
    reciprocal where normals to either side are as frequent, as in all of gonio's distributions. The half vector of the
    mirrored pair is the normal where wi = wo. For road signs and safety clothing, whose prisms or beads it does not
    follow further: towards grazing it falls off as f_m does.

    Looks    `RetroMicrofacet(GGX(0.1))` is a road sign: bright all over seen with the light, else dark; `GGX(0.5)`
             glows softly.
    Shapes   the parts' parameters: numbers or (..., C).
    Units    f: 1/sr.
    Error    as `Microfacet`.
    Source   Portsmouth, Raab, Belcour & Liu 2026, "The minimal retroreflective microfacet model", JCGT 15(1):60; the
             vector goes back to Belcour, Pacanowski, Delahaie, Laville-Geay & Eupherte 2014.
    """

    mirror = Reflectance.mirror  # its limit is no mirror

    def formula(self, wi: Direction, wo: Direction) -> Any:
        back = mirror(wo)
        wm, cos_d = half_and_cosine(wi, back)
        return self.distribution.D(wm) * self.fresnel.F(cos_d) * self.G(wi, back, wm) / (4.0 * wi.z * wo.z)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return super().warp(mirror(wo), u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return super().density(wi, mirror(wo))
