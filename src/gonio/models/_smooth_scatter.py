"""What the models of scatter by smooth surfaces share: the deviation D from the mirror direction, and its sampling."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.fresnel_term import Fresnel
from ..formula.special import expm1_over
from .abc import ABC


def deviation2(wi: Direction, wo: Direction) -> Any:
    """|D|^2, D = (wi + wo) projected on the surface: 0 at the mirror direction."""
    dx, dy = wi.x + wo.x, wi.y + wo.y
    return dx * dx + dy * dy


def ring_integral(B: Any, C: Any, end: Any) -> Any:
    """Integral of 2 B x (1 + B x^2)^(-C) over x from 0 to `end`; 1/(C - 1) for end -> infinity where C > 1."""
    base, power = 1.0 + B * end * end, 1.0 - C
    log = ops.log(base)
    near = ops.absolute(power * log) < 0.3
    # Of large powers exp(power log) would lose digits in float32.
    far = (ops.power(base, power) - 1.0) / ops.where(near, 1.0, power)
    return ops.where(near, log * expm1_over(ops.where(near, power * log, 0.0)), far)


def mean_reflectance(fresnel: Fresnel, wi: Direction, wo: Direction) -> Any:
    """sqrt(F(theta_i) F(theta_o)): Rayleigh-Rice's Q at the mirror direction, and the same for both directions."""
    return ops.sqrt(fresnel.F(wi.z) * fresnel.F(wo.z) + 1e-30)


class SmoothScatter(Reflectance):
    """Sampling in proportion to (1 + |D|^2/width^2)^(-C): no sample is lost (see `ABC`)."""

    @abstractmethod
    def _lobe(self, wo: Direction) -> ABC:
        """The lobe whose `warp` and `density` are taken."""

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return self._lobe(wo).warp(wo, u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return self._lobe(wo).density(wi, wo)
