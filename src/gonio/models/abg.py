"""The ABg lobe of optical design programs."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Self

from ..arrays import ops
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import param
from ._smooth_scatter import SmoothScatter, deviation2, ring_integral
from .abc import ABC
from .harvey_shack import HarveyShack

_NARROWEST = 1e-4  # |D| of the narrowest lobe to sample


class ABg(SmoothScatter):
    """Scatter by a polished surface, as optical design programs have it: f = A/(B + |D|^g).

    D = (wi + wo) projected on the surface, so that |D| = |beta - beta_0| in direction cosines: 0 at the mirror
    direction. f is A/B there, and A |D|^-g far from it. g = 0 is a matt surface with f = A/(B + 1). The mirror itself
    is an `IdealSpecular` beside it.

    Looks    `ABg(0.001, 0.001, 1.5)` is a mirror's soft haze; `ABg(0.0025, 0.001, 1.8)` is a polished surface's.
    Shapes   A, B, g: numbers or (..., C).
    Units    f, A: 1/sr; B, g: 1. B = 0, where f has no bound, is refused: the smallest B is 1e-10.
    Error    rounding of |D|, 1e-7 in float32: 1e-5 relative for |D| > 0.1; next to the mirror, for lobes that are
             narrower than that, as much as f changes over it.
    Source   the manual of FRED, "ABg", Photon Engineering, for the form and its terms. Sampling derived here, from
             that of `ABC` with the knee B^(1/g): f over density is within a factor 2^|g/2 - 1| of constant, times
             the change of the arcs.

    Example
    >>> mirror = gn.ABg(A=0.0025, B=0.001, g=1.8)
    >>> print(mirror.f_angles(0.5, 0.0, [0.3, 0.49, 0.5], np.pi).round(4))
    [0.0516 2.0841 2.5   ]
    """

    A = param(1e-3, 0.0, 1e3, "height of the tails: f where |D| = 1, if B is small", unit="sr-1")
    B = param(1e-3, 1e-10, 1e3, "knee: |D|^g where f is half its peak", sampled="max")
    g = param(1.5, 0.0, 8.0, "slope of the tails in a plot of log f over log |D|, downwards", sampled="min")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "A scales the lobe freely: its albedo is not bounded by 1; for polished optics it is below 0.05",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        d2 = deviation2(wi, wo)
        mirror = d2 < 1e-30
        tail = ops.power(ops.where(mirror, 1.0, d2), 0.5 * self.g)
        return self.A / (self.B + ops.where(mirror & (self.g > 0.0), 0.0, tail))

    def _knee(self) -> Any:
        """|D| where f is half its peak, or the nearest that can be sampled."""
        log = ops.log(self.B) / ops.maximum(self.g, 0.05)
        return ops.exp(ops.clip(log, math.log(_NARROWEST), math.log(10.0)))

    def _lobe(self, wo: Direction) -> ABC:
        knee = self._knee()
        return tree.unchecked(ABC, B=1.0 / (knee * knee), C=0.5 * self.g)

    def estimate(self, wo: Direction) -> Any:
        knee = self._knee()
        B = 1.0 / (knee * knee)
        peak = self.A / (self.B + ops.power(knee, self.g)) * 2.0
        return math.pi * peak / B * ring_integral(B, 0.5 * self.g, 1.0) + 0.0 * wo.z

    @classmethod
    def from_harvey_shack(cls, m: HarveyShack) -> Self:
        """The ABg lobe of the same peak and the same tails as a `HarveyShack` with P = Q = 0.

        A = b0 L^g, B = L^g, g = -s. It is the same function for g = 2. For other g both are the same where |D| is much
        smaller or much larger than L; at |D| = L ABg is 2^(g/2 - 1) times as large as the other, or 1/that if below 1.

        Example
        >>> lobe = gn.ABg.from_harvey_shack(gn.HarveyShack(b0=4.0, L=0.1, s=-2.0))
        >>> print(round(float(lobe.A), 6), round(float(lobe.B), 6), lobe.g)
        0.04 0.01 2.0
        """
        B = ops.power(m.L, -m.s)
        return cls(A=m.b0 * B, B=B, g=-m.s)

    def to_harvey_shack(self) -> HarveyShack:
        """The `HarveyShack` lobe of the same peak and the same tails: b0 = A/B, L = B^(1/g), s = -g.

        Example
        >>> lobe = gn.ABg(A=0.04, B=0.01, g=2.0).to_harvey_shack()
        >>> print(lobe.b0, round(float(lobe.L), 6), lobe.s)
        4.0 0.1 -2.0
        """
        return HarveyShack(b0=self.A / self.B, L=ops.power(self.B, 1.0 / self.g), s=-self.g)
