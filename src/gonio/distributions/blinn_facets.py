"""Blinn's facets: a power of the cosine."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.distribution import Distribution, facing, facing_density
from ..formula.fields import param
from ..formula.smith import cotangent
from ..formula.warp import power_cosine_density, power_positive, power_tilt
from .student_t import student_lambda


class BlinnFacets(Distribution):
    """Facets with Phong's and Blinn's lobe: D = (n + 2)/(2 pi) cos(theta_m)^n.

    In slopes it is Student's t-distribution with gamma = n/2 + 2 and alpha^2 = 2/(n + 2): n = 0, equal numbers of
    facets in all directions, is GGX at alpha = 1.

    Looks    `BlinnFacets(200)` is metal with a round, even highlight; `BlinnFacets(5)` is dull.
    Shapes   n: a number or (..., C).
    Units    D: 1/sr; n: 1.
    Error    D: rounding. Lambda, by a 16-point rule: G1 relative 1e-6.
    Source   Blinn 1977, "Models of light reflection"; normalized by projected area: Walter et al. 2007, EGSR, whose
             Lambda is an approximation; here it is Smith's integral (see `StudentT`). Normals: density D cos,
             of two that are opposite as they are seen.

    Example
    >>> facets = gn.BlinnFacets(gn.radiometry.roughness.blinn_phong_n_from_alpha(0.3))
    >>> print(gn.Microfacet(facets).f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    [0.8842 0.6389 0.2406]
    """

    n = param(40.0, 0.0, 1e4, "exponent: the larger, the narrower", sampled="min")

    def D(self, wm: Direction) -> Any:
        return (self.n + 2.0) * (0.5 / math.pi) * power_positive(wm.z, self.n)

    def Lambda(self, w: Direction) -> Any:
        k = 0.5 * self.n + 1.0
        return student_lambda(cotangent(w) * ops.sqrt(k), k)

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        sin_theta, cos_theta = power_tilt(self.n + 1.0, u1)
        return facing(wo, sin_theta, u0, cos_theta)

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        return power_cosine_density(self.n + 1.0, wm.z) * facing_density(wo, wm, cos_d)
