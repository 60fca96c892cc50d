"""Chandrasekhar's semi-infinite atmosphere: light scattered in a deep layer, any number of times."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.fields import param
from ._deep_layer import DeepLayer

STEP = 0.6
NODES = [math.sinh((j + 0.5) * STEP) for j in range(20)]


class Chandrasekhar(DeepLayer):
    """Deep layer of isotropic scatterers: f = w/(4 pi) H(z_i) H(z_o) / (z_i + z_o), z = cos(theta).

    H(z) = exp(-z/pi int_0^inf ln(1 - w arctan(t)/t) / (1 + z^2 t^2) dt) counts light that is scattered more than once;
    H = 1 is `LommelSeeliger`. The albedo is 1 - sqrt(1 - w) H(z): for w = 1 all light returns.

    Looks    `Chandrasekhar(1)` is white dust, a little flatter than plaster; `Chandrasekhar(0.3)` is dark and, seen
             with the light, as bright at the rim as in the middle.
    Shapes   w: a number or (..., C).
    Units    f: 1/sr; w: 1.
    Error    H: 1e-6 relative (20 nodes), 2e-6 at w = 1; rounding: 6e-7 in float32.
    Source   Chandrasekhar 1950, Radiative Transfer, chapters III and V. Quadrature and sampling derived here.

    Example
    >>> dust = gn.Chandrasekhar(1.0)
    >>> print(gn.albedo(dust, gn.direction([0.0, 1.0], 0.0)).round(3))
    [1. 1.]
    """

    w = param(0.9, 0.0, 1.0, "single-scattering albedo: the share of light that a particle scatters")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        # H has the factor (1 + z)/(1 + k z), where k solves w artanh(k) = k: the rest of the integral is smooth.
        # What the polynomial errs in k (2e-3) stays in that rest.
        x = 1.0 - self.w
        k2 = x * (3.0 - x * (2.4 - x * (0.117 - x * (0.211 - x * 0.494))))
        k = ops.sqrt(k2 + 1e-12)
        exponent = 0.0
        for j, t in enumerate(NODES):
            t2, once = t * t, 1.0 - math.atan(t) / t
            weight = STEP / math.pi * math.cosh((j + 0.5) * STEP)
            rest = weight * ops.log((x + self.w * once) * (t2 + 1.0) / (t2 + k2))
            exponent = exponent - rest * (wi.z / (1.0 + wi.z * wi.z * t2) + wo.z / (1.0 + wo.z * wo.z * t2))
        H2 = ops.exp(exponent) * (1.0 + wi.z) * (1.0 + wo.z) / ((1.0 + k * wi.z) * (1.0 + k * wo.z))
        return self.w * (0.25 / math.pi) * H2 / (wi.z + wo.z)

    def estimate(self, wo: Direction) -> Any:
        gamma = ops.sqrt(1.0 - self.w + 1e-12)
        return 1.0 - gamma * (1.0 + 2.0 * wo.z) / (1.0 + 2.0 * wo.z * gamma)
