"""Lommel–Seeliger: light that is scattered once in a deep layer of dark powder."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.fields import param
from ._deep_layer import DeepLayer


class LommelSeeliger(DeepLayer):
    """Dark powder, such as the Moon's: f = w / (4 pi (cos(theta_i) + cos(theta_o))).

    The albedo is w/2 (1 - z ln((1 + z)/z)), z = cos(theta). `Chandrasekhar` adds light that is scattered again.

    Looks    `LommelSeeliger(0.2)` is the Moon: seen with the light a full disc, at the rim no darker than in the
             middle.
    Shapes   w: a number or (..., C).
    Units    f: 1/sr; w: 1.
    Error    rounding.
    Source   Seeliger 1887; Hapke 1981, J. Geophys. Res. 86(B4):3039, with isotropic particles, scattered once.

    Example
    >>> moon = gn.LommelSeeliger(0.2)
    >>> print((moon.f_angles([0.0, 1.5], 0.0, [0.0, 1.5], 0.0) * np.cos([0.0, 1.5])).round(4))
    [0.008 0.008]
    """

    w = param(0.5, 0.0, 1.0, "single-scattering albedo: the share of light that a particle scatters")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.w * (0.25 / math.pi) / (wi.z + wo.z)

    def estimate(self, wo: Direction) -> Any:
        return 0.5 * self.w * (1.0 - wo.z * ops.log(1.0 + 1.0 / wo.z))
