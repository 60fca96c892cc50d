"""Shifted gamma: a sharp peak on an exponential tail, made to fit measured reflectances."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.distribution import Distribution, facing_density, facing_slopes
from ..formula.fields import param
from ..formula.smith import cotangent, gauss, sinh_nodes, smith
from ..formula.special import expm1_over, log1p, log1p_over


class SGDFacets(Distribution):
    """Shifted gamma distribution: D = K exp(-t) t^(-p) / (pi cos^4(theta_m)), t = alpha + tan^2(theta_m)/alpha.

    K = 1/(alpha Gamma(1 - p, alpha)), with the incomplete gamma function. The peak is alpha wide, the tail
    sqrt(alpha), in slopes.

    Looks    `SGDFacets(0.02)` is metal with a sharp peak in a wide glow; `SGDFacets(0.3)` is satin.
    Shapes   alpha, p: numbers or (..., C).
    Units    D: 1/sr; alpha, p: 1.
    Error    K by 32-point Gauss-Legendre: relative 1e-10. Lambda, by a 20-point rule: G1 relative 1e-6. Normals are
             drawn with a density close to D cos, of two that are opposite as they are seen: weights stay below 3 times
             those of exact inversion.
    Source   Bagher, Soler & Holzschuch 2012, CGF 31(4):1509. Lambda is Smith's integral of this D; the paper fits a
             formula with four more parameters to it, which is the masking of `SGD`. Sampling derived here.

    Example
    >>> rough = gn.Microfacet(gn.SGDFacets(0.1, p=0.6))
    >>> print(rough.f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    [2.2923 0.6722 0.1313]
    """

    alpha = param(0.1, 1e-3, 2.0, "squared width of the tail", sampled="max")
    p = param(0.6, 0.0, 3.0, "fall-off of the peak", sampled="min")

    # In y = tan^2/alpha^2 the density is proportional to exp(-alpha y) (1 + y)^(-p).

    def _fall(self, q: Any) -> Any:
        return ops.exp(-q / self.alpha - self.p * ops.log(1.0 + q / self.alpha / self.alpha))

    def _whole(self) -> Any:
        """The integral of exp(-alpha y) (1 + y)^(-p) over y from 0 on."""
        end = log1p(36.0 / self.alpha)
        total: Any = 0.0
        for u, weight in _NODES:
            v = end * u
            grown = v * expm1_over(v)
            total = total + weight * ops.exp((1.0 - self.p) * v - self.alpha * grown)
        return end * total

    def D(self, wm: Direction) -> Any:
        z2 = wm.z * wm.z
        q = (wm.x * wm.x + wm.y * wm.y) / z2
        return self._fall(q) / z2 / z2 / (math.pi * self.alpha * self.alpha * self._whole())

    def Lambda(self, w: Direction) -> Any:
        height = 1.0 / (math.pi * self.alpha * self.alpha * self._whole())

        def slopes(q: Any) -> Any:
            return height * self._fall(q)

        width = ops.exp((0.5 + 0.5 * ops.clip(self.p - 0.5, 0.0, 1.0)) * ops.log(self.alpha))
        return smith(slopes, cotangent(w), sinh_nodes(20, width, ops.sqrt(22.0 * self.alpha)))

    # Drawn is y with density (1 + y)^(-p) up to 1/alpha, and exponential from there.

    def _parts(self) -> tuple[Any, Any]:
        end = log1p(1.0 / self.alpha)
        return end * expm1_over((1.0 - self.p) * end), ops.exp(-self.p * end) / self.alpha

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        peak, tail = self._parts()
        h = u1 * (peak + tail)
        in_peak = h < peak
        h_peak = ops.where(in_peak, h, 0.0)
        v = h_peak * log1p_over(ops.maximum((1.0 - self.p) * h_peak, -1.0 + 1e-7))
        left = ops.where(in_peak, 1.0, (1.0 - u1) * (peak + tail) / tail)
        y = ops.where(in_peak, v * expm1_over(v), (1.0 - ops.log(left)) / self.alpha)
        return facing_slopes(wo, self.alpha * ops.sqrt(y + 1e-30), u0)

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        peak, tail = self._parts()
        y = (wm.x * wm.x + wm.y * wm.y) / (wm.z * wm.z) / self.alpha / self.alpha
        end = 1.0 / self.alpha
        fall = ops.exp(-self.p * ops.log(1.0 + ops.minimum(y, end)) - self.alpha * ops.maximum(y - end, 0.0))
        density = fall / (math.pi * self.alpha * self.alpha * (peak + tail)) / wm.z / wm.z / wm.z
        return density * facing_density(wo, wm, cos_d)


_NODES = gauss(32)
