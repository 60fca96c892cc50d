"""Phong's lobe: as written in 1975, as a BRDF, and in its two physical forms."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, dot, half_and_cosine, half_vector, mirror, reflect
from ..formula.fields import param
from ..formula.warp import around, power_cosine, power_cosine_density, power_positive


class _MirrorLobe(Reflectance):
    """A lobe (s . wi)^n about the mirror direction s of wo, and its sampling."""

    n: Any

    def cos_to_mirror(self, wi: Direction, wo: Direction) -> Any:
        return dot(mirror(wo), wi)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return around(mirror(wo), power_cosine(self.n, u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        return power_cosine_density(self.n, self.cos_to_mirror(wi, wo))


class Phong(_MirrorLobe):
    """Phong's lobe as the lecture writes it, taken as a BRDF: f = rho_s max(s . wo, 0)^n, s the mirror image of wi.

    Reciprocal, but nothing bounds its energy: at normal incidence the albedo is 2 pi rho_s/(n + 2).

    Looks    `Phong(1, 4)` is a broad, dull shine; `Phong(1, 200)` is a small spot of the same height, and so of much
             less light.
    Shapes   rho_s, n: numbers or (..., C).
    Units    f and rho_s: 1/sr (rho_s is no albedo); n: 1.
    Error    rounding.
    Source   lecture 4, section 4.1.3 (docs/equations.md), after Phong 1975, Commun. ACM 18(6):311.

    Example
    >>> m = gn.Phong(1.0, n=20.0)
    >>> print(m.f_angles(0.5, 0.0, [0.5, 0.8], np.pi).round(4))
    [1.    0.401]
    """

    rho_s = param(1.0, 0.0, 1.0, "height of the lobe", unit="sr-1")
    n = param(4.0, 0.0, 1e4, "exponent: the larger, the narrower", sampled="min")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "nothing normalizes rho_s (s.wo)^n: its albedo at normal incidence is 2 pi rho_s/(n + 2), "
        "which exceeds 1 for n < 2 pi rho_s - 2; ModifiedPhong carries the factor (n + 2)/(2 pi)",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.rho_s * power_positive(self.cos_to_mirror(wi, wo), self.n)

    def estimate(self, wo: Direction) -> Any:
        return self.rho_s * (2.0 * math.pi) / (self.n + 2.0) + 0.0 * wo.z

    def mirror(self, wo: Direction) -> Any:
        return self.rho_s * (2.0 * math.pi) / (self.n + 1.0) * wo.z  # as n goes to infinity


class OriginalPhong(_MirrorLobe):
    """Phong's lobe used for radiance without a cosine, as in eq. 4.7: f = rho_s max(s . wo, 0)^n / cos(theta_i).

    Looks    `OriginalPhong(1, 4)` is a broad, dull shine; `OriginalPhong(1, 200)` is a small spot; towards the rim
             neither fades, as `Phong` does.
    Shapes   rho_s, n: numbers or (..., C).
    Units    f and rho_s: 1/sr; n: 1.
    Error    rounding.
    Source   Phong 1975, Commun. ACM 18(6):311; lecture 4, eq. 4.7 (docs/equations.md).

    Example
    >>> m = gn.OriginalPhong(0.5, n=20.0)
    >>> print((m.f_angles([0.5, 1.4], 0.0, [0.5, 1.4], np.pi) * np.cos([0.5, 1.4])).round(4))
    [0.5 0.5]
    """

    rho_s = param(1.0, 0.0, 1.0, "radiance of the lobe's centre under unit irradiance", unit="sr-1")
    n = param(4.0, 0.0, 1e4, "exponent: the larger, the narrower", sampled="min")

    breaks: ClassVar[dict[str, str]] = {
        "reciprocity": "the light's cosine is missing, which acts as a division by cos(theta_i) alone: exchanging "
        "light and viewer changes the value",
        "energy": "divided by cos(theta_i), the lobe reflects more light than arrives towards grazing incidence",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.rho_s * power_positive(self.cos_to_mirror(wi, wo), self.n) / wi.z

    def estimate(self, wo: Direction) -> Any:
        return self.rho_s * (2.0 * math.pi) / (self.n + 1.0) + 0.0 * wo.z

    def mirror(self, wo: Direction) -> Any:
        return self.rho_s * (2.0 * math.pi) / (self.n + 1.0) + 0.0 * wo.z  # as n goes to infinity


class ModifiedPhong(_MirrorLobe):
    """Phong's lobe normalized: f = rho_s (n + 2)/(2 pi) max(s . wo, 0)^n; rho_s is the albedo at normal incidence.

    Looks    `ModifiedPhong(0.5, 10)` is a broad shine, `ModifiedPhong(0.5, 1000)` a small, bright spot.
    Shapes   rho_s, n: numbers or (..., C).
    Units    f: 1/sr; rho_s, n: 1.
    Error    rounding.
    Source   Lafortune & Willems 1994, "Using the modified Phong reflectance model for physically based rendering",
             K.U. Leuven report CW 197.

    Example
    >>> m = gn.ModifiedPhong(0.5, n=20.0)
    >>> print(gn.albedo(m, gn.direction([0.0, 1.2], 0.0)).round(3))
    [0.5   0.183]
    """

    rho_s = param(0.5, 0.0, 1.0, "albedo at normal incidence, the largest of any incidence")
    n = param(20.0, 0.0, 1e4, "exponent: the larger, the narrower", sampled="min")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        lobe = power_positive(self.cos_to_mirror(wi, wo), self.n)
        return self.rho_s * (self.n + 2.0) * (0.5 / math.pi) * lobe

    def estimate(self, wo: Direction) -> Any:
        return self.rho_s + 0.0 * wo.z

    def mirror(self, wo: Direction) -> Any:
        return self.rho_s * wo.z  # as n goes to infinity


class BlinnPhong(Reflectance):
    """Blinn's lobe about the half vector, normalized: f = rho_s (n + 2)(n + 4)/(8 pi (2^(-n/2) + n)) (wm . z)^n.

    rho_s is the albedo at normal incidence.

    Looks    `BlinnPhong(0.5, 20)` is a broad shine, `BlinnPhong(0.5, 2000)` a small, bright spot.
    Shapes   rho_s, n: numbers or (..., C).
    Units    f: 1/sr; rho_s, n: 1.
    Error    rounding.
    Source   Blinn 1977, "Models of light reflection"; the factor is the reciprocal of the integral of
             (wm . z)^n cos(theta) at normal incidence, derived in tests/models/test_reference.py.

    Example
    >>> m = gn.BlinnPhong(0.5, n=gn.radiometry.roughness.blinn_phong_n_from_alpha(0.2))
    >>> print(gn.albedo(m, [0, 0, 1]).round(3))
    0.5
    """

    rho_s = param(0.5, 0.0, 1.0, "albedo at normal incidence")
    n = param(40.0, 0.0, 1e4, "exponent: the larger, the narrower", sampled="min")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        norm = (self.n + 2.0) * (self.n + 4.0) / (8.0 * math.pi * (ops.exp(-0.5 * math.log(2.0) * self.n) + self.n))
        return self.rho_s * norm * power_positive(half_vector(wi, wo).z, self.n)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return reflect(wo, power_cosine(self.n, u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        return power_cosine_density(self.n, wm.z) / (4.0 * cos_d)

    def estimate(self, wo: Direction) -> Any:
        return self.rho_s + 0.0 * wo.z

    def mirror(self, wo: Direction) -> Any:
        return self.rho_s * wo.z * wo.z  # as n goes to infinity
