"""Schlick's approximation of Fresnel reflectance."""

from __future__ import annotations

from typing import Any

from ...arrays import ops
from ..fields import param
from ..fresnel_term import Fresnel


class Schlick(Fresnel):
    """Schlick's approximation: F = F0 + (1 - F0)(1 - cos theta)^5.

    Looks    `Schlick([0.5, 0.1, 0.6])` is anodised violet, white at the rim; `Schlick(0.04)` is black
             glass.
    Shapes   F0: a number or (..., C).
    Units    1.
    Error    against the exact dielectric, eta = 1.5: at most 0.045 (near 86 degrees).
    Source   Schlick 1994, Computer Graphics Forum 13(3):233.

    Example
    >>> print(gn.Schlick(0.04).F(np.cos([0.0, 1.0, 1.5])).round(4))
    [0.04   0.0597 0.7052]
    """

    F0 = param(0.04, 0.0, 1.0, "reflectance at normal incidence")

    def F(self, cos_theta: Any) -> Any:
        m = ops.clip(1.0 - cos_theta, 0.0, 1.0)
        m2 = m * m
        return self.F0 + (1.0 - self.F0) * m2 * m2 * m
