"""ABC facets: the distribution of normals of Löw's microfacet model."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.distribution import Distribution, facing, facing_density
from ..formula.fields import param
from ..formula.smith import cotangent, smith_of_angles
from ..formula.special import expm1_over, log1p, log1p_over
from .gtr import power_law_nodes


class ABCFacets(Distribution):
    """Facets with the ABC power spectrum: D = N / (1 + B (1 - cos(theta_m)))^C.

    Their A is free; here N makes the integral of D cos(theta_m) 1. Near the pole it is GTR with alpha = sqrt(2/B) and
    gamma = C.

    Looks    `ABCFacets(1e3, 0.8)` is polished metal in a wide haze; `ABCFacets(1e3, 4)` is as narrow
             without the haze.
    Shapes   B, C: numbers or (..., C).
    Units    D: 1/sr; B, C: 1.
    Error    D: rounding. Lambda, by a 24-point rule: G1 relative 1e-6. Normals are drawn with the density D,
             of two that are opposite as they are seen.
    Source   Löw, Kronander, Ynnerman & Unger 2012, ACM TOG 31(1):9, doi:10.1145/2077341.2077350 (the microfacet
             model); N, Lambda (Smith's integral; they use V-grooves, masking="v_groove") derived here.

    Example
    >>> rough = gn.Microfacet(gn.ABCFacets(B=50.0, C=1.5))
    >>> print(rough.f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(3))
    [1.319 0.506 0.169]
    """

    B = param(1e3, 1.0, 2e6, "inverse squared width of the lobe's centre", sampled="min")
    C = param(1.5, 0.5, 10.0, "fall-off of the tails", sampled="min")

    def _whole(self) -> Any:
        """B times the integral of (1 + B x)^(-C) over [0, 1]."""
        end = log1p(self.B)
        return end * expm1_over((1.0 - self.C) * end)

    def _height(self) -> Any:
        end = log1p(self.B)
        next_moment = end * expm1_over((2.0 - self.C) * end)
        return 0.5 * self.B / (math.pi * ((1.0 + 1.0 / self.B) * self._whole() - next_moment / self.B))

    def _root(self, x: Any) -> Any:
        return ops.exp(-0.5 * self.C * ops.log(1.0 + self.B * x))

    def D(self, wm: Direction) -> Any:
        root = self._root((wm.x * wm.x + wm.y * wm.y) / (1.0 + wm.z))
        return self._height() * root * root  # in this order: the square alone may be too small for float32

    def Lambda(self, w: Direction) -> Any:
        height = self._height()

        def p(q: Any) -> Any:
            c2 = 1.0 / (1.0 + q)
            return height * c2 * c2 * ops.square(self._root(q * c2 / (1.0 + ops.sqrt(c2))))

        return smith_of_angles(p, cotangent(w), power_law_nodes(0.5 * ops.log(2.0 / self.B), self.C))

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        h = u1 * self._whole()
        v = h * log1p_over(ops.maximum((1.0 - self.C) * h, -1.0 + 1e-7))
        x = ops.minimum(v * expm1_over(v) / self.B, 1.0)
        return facing(wo, ops.sqrt(x * (2.0 - x) + 1e-30), u0, 1.0 - x)

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        root = self._root((wm.x * wm.x + wm.y * wm.y) / (1.0 + wm.z))
        return self.B * (0.5 / math.pi) / self._whole() * root * root * facing_density(wo, wm, cos_d)
