"""Minnaert's law: a power of both cosines, for planets and for velvet."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.fields import param
from ._power_cosine import PowerCosine


class Minnaert(PowerCosine):
    """Limb darkening by a power law: f = B0/pi (cos(theta_i) cos(theta_o))^(k - 1).

    B0 is planetary science's normalization: pi f at normal incidence, seen along the normal. The albedo is
    2 B0/(k + 1) cos(theta)^(k - 1); k = 1 is Lambertian, the Moon at full phase has k near 1/2.

    Looks    `Minnaert(0.5, 2)` has a dark rim; `Minnaert(0.5, 0.5)` is, seen with the light, flat as the
             full moon; `Minnaert(0.5, 1)` is Lambertian.
    Shapes   B0, k: numbers or (..., C).
    Units    f: 1/sr; B0, k: 1.
    Error    rounding: 1e-5 relative in float32, at k = 10 towards grazing.
    Source   Minnaert 1941, "The reciprocity principle in lunar photometry", Astrophysical Journal 93.

    Example
    >>> flat = gn.Minnaert(0.5, k=0.5)
    >>> print((flat.f_angles([0.0, 1.4], 0.0, [0.0, 1.4], 0.0) * np.cos([0.0, 1.4])).round(4))
    [0.1592 0.1592]
    """

    B0 = param(0.5, 0.0, 1.0, "reflectance factor along the normal")
    k = param(1.0, 0.0, 10.0, "exponent: below 1 the limb is bright, above 1 dark", sampled="min")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "for k < 1 the albedo 2 B0/(k + 1) cos(theta)^(k - 1) grows without bound towards grazing, and at "
        "normal incidence it is 2 B0/(k + 1)",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.B0 * (1.0 / math.pi) * ops.power(wi.z * wo.z, self.k - 1.0)

    def exponent(self, wo: Direction) -> Any:
        return self.k

    def estimate(self, wo: Direction) -> Any:
        return 2.0 * self.B0 / (self.k + 1.0) * ops.power(wo.z, self.k - 1.0)
