"""Löw's ABC model for smooth surfaces: a heavy-tailed lobe in the projected deviation from the mirror direction."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, azimuth
from ..formula.fields import param
from ..formula.fresnel.dielectric import fresnel_dielectric
from ..formula.special import expm1_over, log1p_over


class ABC(Reflectance):
    """Glossy lobe of a smooth surface: f = A F(theta_d) (1 + B |D|^2)^(-C), D = (wi + wo) projected on the surface.

    D is 0 at the mirror direction. F is the exact dielectric Fresnel reflectance for index eta at the difference
    angle, cos^2(theta_d) = (z_i^2 + z_o^2)/2 + |D|^2/4. The diffuse part is a `Lambertian` beside it.

    Looks    `ABC(200, 2000, 1)` is a highlight in a wide glow, as of metallic paint; `ABC(50, 1e4, 1)` is
             a small one over a faint glow, as of polished plastic; `ABC(2, 50, 2)` is a faint sheen.
    Shapes   A, B, C, eta: numbers or (..., C).
    Units    f, A: 1/sr; B, C, eta: 1.
    Error    rounding: 3e-6 relative in float32.
    Source   Löw, Kronander, Ynnerman & Unger 2012, ACM TOG 31(1):9, doi:10.1145/2077341.2077350 (the model for
             smooth surfaces, from Rayleigh–Rice theory with the ABC power spectrum). Sampling derived here.

    Example
    >>> m = gn.ABC(A=50.0, B=1e4, C=1.0)
    >>> print(m.f_angles(0.5, 0.0, [0.4, 0.5, 0.6], np.pi).round(3))
    [0.025 2.062 0.028]
    """

    A = param(10.0, 0.0, 1e4, "height of the lobe, before Fresnel", unit="sr-1")
    B = param(1e3, 1e-3, 1e8, "inverse squared width of the lobe's centre", sampled="min")
    C = param(1.2, 1e-3, 4.0, "fall-off of the tails", sampled="min")
    eta = param(1.5, 1.0, 20.0, "refractive index behind the surface")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "A scales the lobe freely: its albedo grows as A/B and is not bounded by 1; the published fits "
        "stay below 0.54",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        dx, dy = wi.x + wo.x, wi.y + wo.y
        d2 = dx * dx + dy * dy
        cos_d = ops.sqrt(ops.minimum(0.5 * (wi.z * wi.z + wo.z * wo.z) + 0.25 * d2, 1.0))
        return self.A * fresnel_dielectric(cos_d, self.eta) * self._spectrum(d2)

    def _spectrum(self, d2: Any) -> Any:
        return ops.exp(-self.C * ops.log(1.0 + self.B * d2))

    # Sampling draws s = |D| from s (1 + B s^2)^(-C) on [0, 1 + r_o], which has an inverse, and D's angle uniformly
    # on the arc of that radius that stays inside the unit disc: no sample is lost. E is the normalization.

    def _whole(self, r: Any) -> tuple[Any, Any]:
        end = ops.log(1.0 + self.B * (1.0 + r) * (1.0 + r))
        return end, end * expm1_over((1.0 - self.C) * end)

    def _radius(self, r: Any, u: Any) -> Any:
        end, whole = self._whole(r)
        v = u * whole
        t = ops.maximum((1.0 - self.C) * v, -1.0 + 1e-7)
        x = ops.clip(v * log1p_over(t), 0.0, end)
        return ops.sqrt(x * expm1_over(x) / self.B + 1e-30)

    def _half_arc(self, s: Any, r: Any, inside: Any) -> Any:
        # cos = (s^2 + r^2 - 1)/(2 s r) by its half angle; `inside` = 1 - (s - r)^2.
        outside = (s + r) * (s + r) - 1.0
        return 2.0 * ops.arctan2(ops.sqrt(inside), ops.sqrt(ops.maximum(outside, 0.0) + 1e-30))

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        r = ops.sqrt(wo.x * wo.x + wo.y * wo.y + 1e-24)
        s = self._radius(r, u0)
        inside = ops.maximum(1.0 - (s - r) * (s - r), 1e-30)
        delta = self._half_arc(s, r, inside) * (2.0 * u1 - 1.0)
        a, b = s * ops.cos(delta), s * ops.sin(delta)
        ex, ey = azimuth(wo, r)
        x, y = ex * a - ey * b - wo.x, ey * a + ex * b - wo.y
        return Direction(x, y, ops.sqrt(ops.maximum(1.0 - x * x - y * y, 0.0)))

    def density(self, wi: Direction, wo: Direction) -> Any:
        r = ops.sqrt(wo.x * wo.x + wo.y * wo.y + 1e-24)
        dx, dy = wi.x + wo.x, wi.y + wo.y
        d2 = dx * dx + dy * dy
        _, whole = self._whole(r)
        s = ops.sqrt(d2 + 1e-30)
        # 1 - (s - r)^2 = z_i^2 + 2 (s r - D . wo), without cancellation at grazing.
        along, across = dx * wo.x + dy * wo.y, dx * wo.y - dy * wo.x
        ahead = along > 0.0
        gap = ops.where(ahead, across * across / ops.where(ahead, s * r + along, 1.0), s * r - along)
        arc = self._half_arc(s, r, wi.z * wi.z + 2.0 * gap)
        return self.B / whole * self._spectrum(d2) * wi.z / arc

    def estimate(self, wo: Direction) -> Any:
        s = self._radius(0.0 * wo.z, 0.5)
        cos_d = ops.sqrt(ops.minimum(wo.z * wo.z + 0.5 * s * s, 1.0))
        _, whole = self._whole(0.0 * wo.z)
        return math.pi * self.A / self.B * whole * fresnel_dielectric(cos_d, self.eta)
