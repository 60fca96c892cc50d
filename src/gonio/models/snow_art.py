"""Snow by asymptotic radiative transfer: deep layers of grains that absorb little."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, length
from ..formula.fields import param


class SnowART(Reflectance):
    """Deep snow: BRF = R0 r_s^(u(theta_i) u(theta_o)/R0), u = 3/7 (1 + 2 cos(theta)), and f = BRF/pi.

    R0 = (1.247 + 1.186 (cos(theta_i) + cos(theta_o)) + 5.157 cos(theta_i) cos(theta_o) + p)/(4 (cos(theta_i) +
    cos(theta_o))) is snow that absorbs nothing, p = 11.1 exp(-0.087 T) + 1.1 exp(-0.014 T), T the scattering angle in
    degrees (0 is forward). r_s, the white-sky albedo, is exp(-sqrt(4 pi chi L/lambda)) for ice of the absorption index
    chi and the effective absorption length L, about 13 grain diameters.

    Looks    `SnowART(0.95)` is fresh snow, nearly white and matt; `SnowART([0.9, 0.92, 0.95])` is faintly blue; 0.5 is
             old, dirty snow.
    Shapes   r_s: a number or (..., C).
    Units    f: 1/sr; r_s: 1.
    Error    rounding. R0 reflects 0.993 to 1.018 of the light up to 80 degrees, and its white-sky albedo is 1.003;
             that of r_s = 0.7 is 0.707. The theory holds for r_s above about 0.5.
    Source   Kokhanovsky & Zege 2004, Appl. Opt. 43(7):1589; R0 and p: Kokhanovsky, Aoki, Hachikubo, Hori & Zege 2005,
             IEEE TGRS 43(7):1529. Constants as in three independent implementations.

    Example
    >>> snow = gn.SnowART([0.9, 0.92, 0.95])
    >>> print((np.pi * snow.f_angles(1.0, 0.0, 0.5, np.pi)).round(3))
    [0.895 0.916 0.947]
    """

    r_s = param(0.9, 0.01, 1.0, "white-sky albedo: how much of diffuse light is reflected")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "R0 is a fit that overshoots at grazing: for r_s = 1 it reflects 1.06 of the light that arrives at "
        "85 degrees, 1.20 at 89.9",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        apart, total = length(wi - wo), length(wi + wo)
        T = (360.0 / math.pi) * ops.arctan2(total, apart)
        p = 11.1 * ops.exp(-0.087 * T) + 1.1 * ops.exp(-0.014 * T)
        both = wi.z + wo.z
        R0 = (1.247 + 1.186 * both + 5.157 * wi.z * wo.z + p) / (4.0 * both)
        escape = (9.0 / 49.0) * (1.0 + 2.0 * wi.z) * (1.0 + 2.0 * wo.z)
        return R0 * ops.exp(ops.log(self.r_s) * escape / R0) * (1.0 / math.pi)

    def estimate(self, wo: Direction) -> Any:
        return self.r_s + 0.0 * wo.z
