"""A mirror with one reflectance at every angle."""

from __future__ import annotations

from typing import Any

from ..fields import param
from ..fresnel_term import Fresnel


class Constant(Fresnel):
    """A mirror with the same reflectance at every angle: F = reflectance.

    Looks    `Constant(0.5)` is a gray mirror, no brighter at the rim than in the middle.
    Shapes   reflectance: a number or (..., C).
    Units    1.
    Error    none.
    Source   definition (k of lecture 4, eq. 4.5, docs/equations.md).

    Example
    >>> dim = gn.Microfacet(gn.GGX(0.1), gn.Constant(0.8))
    >>> print(dim == gn.Microfacet(gn.GGX(0.1), 0.8))
    True
    """

    reflectance = param(1.0, 0.0, 1.0, "reflectance at every angle")

    def F(self, cos_theta: Any) -> Any:
        return self.reflectance + 0.0 * cos_theta
