"""Harvey and Shack's lobe of polished optics: the same for all angles of incidence, in direction cosines."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..formula import tree
from ..formula.direction import NORMAL, Direction
from ..formula.fields import param
from ._smooth_scatter import SmoothScatter, deviation2, ring_integral
from .abc import ABC


class HarveyShack(SmoothScatter):
    """Scatter by a polished surface: f = b0 m^P (1 + (|D|/(L m^Q))^2)^(s/2), m = (cos(theta_i) + cos(theta_o))/2.

    D = (wi + wo) projected on the surface, so that |D| = |beta - beta_0| in direction cosines: 0 at the mirror
    direction. With P = Q = 0 this is the common form with three parameters, the same for all angles of incidence.
    P = 2 makes it fall towards grazing as the Rayleigh-Rice factor cos(theta_i) cos(theta_o) does, and Q = 1 makes
    the lobe as wide in angles at all angles of incidence. The mirror itself is an `IdealSpecular` beside it.

    Looks    `HarveyShack(1, 0.1, -1.5)` is a mirror's soft haze; `HarveyShack(100, 0.01, -2.5)` is
             a bright core over a faint one, as of polished metal.
    Shapes   b0, L, s, P, Q: numbers or (..., C).
    Units    f, b0: 1/sr; L (in direction cosines), s, P, Q: 1.
    Error    rounding: 1e-5 relative in float32.
    Source   The form with three parameters: the manual of FRED, "Harvey-Shack", Photon Engineering; Harvey 1976,
             "Light-scattering characteristics of optical surfaces", PhD thesis, University of Arizona, has the lobe.
             P and Q: after Greynolds' extension as the same manual describes it; programs differ in the signs
             of its powers, those here are ours. Sampling as `ABC`.

    Example
    >>> mirror = gn.HarveyShack(b0=1.0, L=0.01, s=-1.5)
    >>> print(mirror.f_angles(0.5, 0.0, [0.3, 0.49, 0.5], np.pi).round(4))
    [0.0127 0.6505 1.    ]
    """

    b0 = param(1.0, 0.0, 1e6, "f at the mirror direction, at normal incidence", unit="sr-1")
    L = param(0.01, 1e-4, 10.0, "|D| of the knee, where the lobe begins to fall", sampled="max")
    s = param(-1.5, -8.0, -2e-3, "slope of the tails in a plot of log f over log |D|", sampled="max")
    P = param(0.0, 0.0, 4.0, "power of the mean cosine in the height of the lobe")
    Q = param(0.0, 0.0, 2.0, "power of the mean cosine in the width of the lobe", sampled="min")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "b0 scales the lobe freely: its albedo grows as b0 L^2 and is not bounded by 1; for polished "
        "optics it is below 0.05",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        log_mean = ops.log(0.5 * (wi.z + wo.z))
        scaled = deviation2(wi, wo) / (self.L * self.L) * ops.exp(-2.0 * self.Q * log_mean)
        return self.b0 * ops.exp(self.P * log_mean + 0.5 * self.s * ops.log(1.0 + scaled))

    def _lobe(self, wo: Direction) -> ABC:
        return tree.unchecked(ABC, B=1.0 / (self.L * self.L), C=-0.5 * self.s)

    def _whole(self, reach: Any) -> Any:
        B = 1.0 / (self.L * self.L)
        return math.pi * self.b0 / B * ring_integral(B, -0.5 * self.s, reach)

    def estimate(self, wo: Direction) -> Any:
        return self._whole(1.0) * ops.exp((self.P + 2.0 * self.Q) * ops.log(wo.z))

    def tis(self) -> Any:
        """Total integrated scatter [1] at normal incidence for P = Q = 0: the integral of f over the unit disc of D.

        2 pi b0 L^2 ((1 + 1/L^2)^((s + 2)/2) - 1)/(s + 2), and its limit at s = -2.

        Example
        >>> print(round(float(gn.HarveyShack(1.0, 0.01, -1.5).tis()), 6))
        0.01131
        """
        return self._whole(1.0 + 0.0 * NORMAL.z)
