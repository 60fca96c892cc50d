"""Lambertian: equally bright from everywhere."""

from __future__ import annotations

import math
from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.fields import param


class Lambertian(Reflectance):
    """Ideal diffuse reflection: f = rho / pi.

    Looks    `Lambertian(0.8)` is plaster, `Lambertian(0.04)` black velvet without its sheen; `Lambertian([0.6, 0.1,
             0.05])` is matt red.
    Shapes   rho: a number or (..., C).
    Units    f: 1/sr; rho: 1.
    Error    rounding.
    Source   Lambert 1760; lecture 4, eq. 4.2 (docs/equations.md).

    Example
    >>> red = gn.Lambertian([0.6, 0.1, 0.05])
    >>> print(red.f_angles(0.3, 0.0, 0.8, 1.0).round(4))
    [0.191  0.0318 0.0159]
    >>> print(gn.albedo(red, [0, 0, 1]).round(4))
    [0.6  0.1  0.05]
    """

    rho = param(0.5, 0.0, 1.0, "albedo: the fraction of light that is reflected")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.rho * (1.0 / math.pi)

    def estimate(self, wo: Direction) -> Any:
        return self.rho + 0.0 * wo.z

    def diffuse(self) -> Any:
        return self.rho
