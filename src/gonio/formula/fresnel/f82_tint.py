"""Schlick's approximation with a dip near 82 degrees, as metals have one."""

from __future__ import annotations

import math
from typing import Any

from ...arrays import ops
from ..fields import param
from ..fresnel_term import Fresnel


class F82Tint(Fresnel):
    """Schlick's approximation with a dip where metals have one: F = F_S - b mu (1 - mu)^6, mu = cos theta, not below 0.

    F_S = F0 + (1 - F0)(1 - mu)^5, and b such that F = tint F_S at mu = 1/7, near 82 degrees. tint = 1 is `Schlick`.

    Looks    `F82Tint([0.9, 0.6, 0.3], [0.5, 0.8, 1])` is bronze whose red fades before the rim;
             `F82Tint(0.91, 0.87)` is about aluminium.
    Shapes   F0, tint: numbers or (..., C).
    Units    1.
    Error    against the exact conductor of eta, k with the same values at mu = 1 and 1/7: aluminium (1.37, 7.62) 0.018,
             gold (0.18, 3.43) 0.006; those of `Schlick` are 0.117 and 0.018. Cut off at 0 where both are small.
    Source   Kutz, Hašan & Edmondson 2021, "Novel aspects of the Adobe Standard Material"; the dip: Hoffman 2019.

    Example
    >>> aluminium = gn.F82Tint(F0=0.91, tint=0.95)
    >>> print(aluminium.F(np.array([1.0, 1 / 7, 0.0])).round(3))
    [0.91  0.904 1.   ]
    """

    F0 = param(0.9, 0.0, 1.0, "reflectance at normal incidence")
    tint = param(0.9, 0.0, 1.0, "reflectance at cos theta = 1/7, over that of Schlick's approximation")

    def F(self, cos_theta: Any) -> Any:
        m, edge = ops.clip(1.0 - cos_theta, 0.0, 1.0), 6.0 / 7.0
        m2 = m * m
        at_edge = self.F0 + (1.0 - self.F0) * edge**5
        # Near the edge by the distance from what F is there, for at the bottom of the dip little else is left.
        a = 7.0 * (edge - m)
        slope = (m - edge) * (m2 * m2 + edge * (m2 * m + edge * (m2 + edge * (m + edge))))  # m^5 - edge^5
        near = self.tint * at_edge + (1.0 - self.F0) * slope + (1.0 - self.tint) * at_edge * a * a * _dip(a)
        far = (
            self.F0 + (1.0 - self.F0) * m2 * m2 * m - (1.0 - self.tint) * at_edge * (1.0 + a) * m2 * m2 * m2 * edge**-6
        )
        return ops.maximum(ops.where(a * a < 0.25, near, far), 0.0)


def _dip(a: Any) -> Any:
    """(1 - (1 + a)(1 - a/6)^6)/a^2, the powers of a one by one."""
    total: Any = 0.0
    for k in range(7, 1, -1):
        total = total * a + -((-1) ** k) * (math.comb(6, k) / 6.0**k - math.comb(6, k - 1) / 6.0 ** (k - 1))
    return total
