"""Diffuse transmission: equally bright from everywhere, lit from behind."""

from __future__ import annotations

import math
from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.fields import param


class DiffuseTransmission(Reflectance):
    """Ideal diffuse transmission: f = tau / pi where light and viewer are on different sides, else 0.

    A sum with `Lambertian` is paper, a leaf or a lampshade: `Lambertian(0.4) + DiffuseTransmission(0.3)` reflects in
    front only, `TwoSided(Lambertian(0.4), Lambertian(0.4)) + DiffuseTransmission(0.3)` from both sides.

    Looks    `DiffuseTransmission(0.5)` is a lampshade, as bright as it is lit from behind, and dark lit from in front.
    Shapes   tau: a number or (..., C).
    Units    f: 1/sr; tau: 1.
    Error    rounding.
    Source   definition, as Lambert's law (1760) for reflection.

    Example
    >>> leaf = gn.Lambertian([0.05, 0.12, 0.04]) + gn.DiffuseTransmission([0.04, 0.16, 0.02])
    >>> print(gn.fate(leaf, [0, 0, 1]).absorbed.round(2))
    [0.91 0.72 0.94]
    """

    sides = "across"
    tau = param(0.5, 0.0, 1.0, "transmittance: the fraction of light that is transmitted")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.tau * (1.0 / math.pi)

    def estimate(self, wo: Direction) -> Any:
        return self.tau + 0.0 * wo.z
