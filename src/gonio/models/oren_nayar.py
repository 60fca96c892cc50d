"""Oren and Nayar's rough diffuse surface: Lambertian facets that shadow, hide and light each other."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.fields import param
from ._rough_diffuse import _RoughDiffuse


class _OrenNayar(_RoughDiffuse):
    """The functions A (C1) and B of the standard deviation of the facets' slope angles."""

    rho = param(0.5, 0.0, 1.0, "albedo of a facet")
    sigma = param(0.3, 0.0, 0.5 * math.pi, "standard deviation of the slope angles", unit="rad", sampled="max")

    @property
    def A(self) -> Any:
        s2 = self.sigma * self.sigma
        return 1.0 - 0.5 * s2 / (s2 + 0.33)

    @property
    def B(self) -> Any:
        s2 = self.sigma * self.sigma
        return 0.45 * s2 / (s2 + 0.09)

    @property
    def back(self) -> Any:
        return self.B / self.A

    def estimate(self, wo: Direction) -> Any:
        return self.rho * (self.A + 0.5 * self.B * (1.0 - wo.z))


class OrenNayar(_OrenNayar):
    """Rough diffuse surface, the full model: long V-grooves with Lambertian sides, and light that is reflected twice.

    f = rho/pi (C1 + C2 cos(phi) tan(beta) + C3 (1 - |cos(phi)|) tan((alpha + beta)/2))
        + 0.17 rho^2/pi sigma^2/(sigma^2 + 0.13) (1 - cos(phi) (2 beta/pi)^2)

    with phi = phi_i - phi_o, alpha = max(theta_i, theta_o), beta = min(theta_i, theta_o),
    C1 = 1 - 0.5 sigma^2/(sigma^2 + 0.33),   C2 = 0.45 sigma^2/(sigma^2 + 0.09) sin(alpha) where cos(phi) >= 0, with
    sin(alpha) - (2 beta/pi)^3 for sin(alpha) elsewhere,   C3 = 0.125 sigma^2/(sigma^2 + 0.09) (4 alpha beta/pi^2)^2

    Looks    `OrenNayar([0.7, 0.3, 0.15], 0.5)` is terracotta: seen with the light flatter than Lambertian,
             with a brighter rim; `OrenNayar(0.5, 0)` is Lambertian.
    Shapes   rho, sigma: numbers or (..., C).
    Units    f: 1/sr; rho: 1, the albedo of a facet; sigma: rad, standard deviation of the facets' slope angles.
    Error    rounding: 4e-7 relative in float32, away from where f changes its sign.
    Source   Oren & Nayar 1994, "Generalization of Lambert's reflectance model", SIGGRAPH. Sampling derived here.

    Example
    >>> clay = gn.OrenNayar(0.5, sigma=0.5)
    >>> print((np.pi * clay.f_angles([0.0, 1.2], 0.0, [0.0, 1.2], 0.0)).round(3))
    [0.42  0.801]
    """

    breaks: ClassVar[dict[str, str]] = {
        "energy": "the published fit exceeds the integral that it stands for: at rho = 1 and grazing incidence the "
        "albedo reaches 1.05 (sigma = 0.3); it stays below 1 for rho < 0.94",
        "positivity": "for sigma > 0.66 the fit is negative where light and viewer graze on opposite sides, unless "
        "rho is large: f = -0.08 rho at sigma = pi/2 for small rho",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        # 1e-14: divisions by both sines have derivatives that must stay representable in float32 at the pole.
        si, so = ops.sqrt(wi.x * wi.x + wi.y * wi.y + 1e-14), ops.sqrt(wo.x * wo.x + wo.y * wo.y + 1e-14)
        cos_phi = (wi.x * wo.x + wi.y * wo.y) / (si * so)
        sin_phi = (wi.x * wo.y - wi.y * wo.x) / (si * so)
        # Everything in elevations 1 - 2 theta/pi: near grazing, where tan(beta) is huge, nothing cancels.
        ei, eo = ops.arctan2(wi.z, si) * (2.0 / math.pi), ops.arctan2(wo.z, so) * (2.0 / math.pi)
        e = ops.maximum(ei, eo)
        b = 1.0 - e  # 2 beta/pi
        cos_alpha, cos_beta = ops.minimum(wi.z, wo.z), ops.maximum(wi.z, wo.z)
        sin_alpha, sin_beta = ops.maximum(si, so), ops.minimum(si, so)
        less_cube = e * (1.0 + b + b * b) - cos_alpha * cos_alpha / (1.0 + sin_alpha)  # sin(alpha) - b^3
        forward = ops.where(cos_phi >= 0.0, sin_alpha, less_cube) * cos_phi * sin_beta / cos_beta
        ab = (1.0 - ei) * (1.0 - eo)
        beside = sin_phi * sin_phi / (1.0 + ops.absolute(cos_phi))  # 1 - |cos(phi)|
        aside = 0.125 / 0.45 * ab * ab * beside * (si + so) / (wi.z + wo.z)
        s2 = self.sigma * self.sigma
        twice = 0.17 * self.rho * s2 / (s2 + 0.13) * (1.0 - cos_phi * b * b)
        return self.rho * (1.0 / math.pi) * (self.A + self.B * (forward + aside) + twice)


class QualitativeOrenNayar(_OrenNayar):
    """Rough diffuse surface, the short form: f = rho/pi (A + B max(0, cos(phi_i - phi_o)) sin(alpha) tan(beta)).

    A = 1 - 0.5 sigma^2/(sigma^2 + 0.33),   B = 0.45 sigma^2/(sigma^2 + 0.09),
    alpha = max(theta_i, theta_o),   beta = min(theta_i, theta_o)

    Looks    `QualitativeOrenNayar(0.5, 0.5)` is clay: seen with the light flatter, with a brighter rim;
             `QualitativeOrenNayar(0.5, 0)` is Lambertian.
    Shapes   rho, sigma: numbers or (..., C).
    Units    f: 1/sr; rho: 1, the albedo of a facet; sigma: rad, standard deviation of the facets' slope angles.
    Error    rounding: 2e-7 relative in float32. Light that is reflected twice is left out: see `OrenNayar`, `EON`.
    Source   Oren & Nayar 1994, "Generalization of Lambert's reflectance model", SIGGRAPH. Sampling derived here.

    Example
    >>> clay = gn.QualitativeOrenNayar(0.5, sigma=0.5)
    >>> print((np.pi * clay.f_angles([0.0, 1.2], 0.0, [0.0, 1.2], 0.0)).round(3))
    [0.392 0.789]
    """

    breaks: ClassVar[dict[str, str]] = {
        "energy": "the published fit: at grazing incidence the albedo is rho (A + B/2), which reaches 1.015 rho at "
        "sigma = 0.2; it stays below 1 for rho < 0.98",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        s = ops.maximum(wi.x * wo.x + wi.y * wo.y, 0.0)  # sin(alpha) tan(beta) = sin sin / max(cos, cos)
        return self.rho * (1.0 / math.pi) * (self.A + self.B * s / ops.maximum(wi.z, wo.z))
