"""Ashikhmin and Shirley's model: an anisotropic Phong lobe, and the diffuse part that the gloss leaves over."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula import tree
from ..formula.direction import Direction, half_and_cosine, reflect
from ..formula.fields import param
from ..formula.fresnel.schlick import Schlick
from ..formula.special import less_fifth_power, log1p_over


class AshikhminShirley(Reflectance, oriented=True):
    """Anisotropic Phong lobe with Fresnel reflection, the specular part of Ashikhmin and Shirley's model.

    f = sqrt((n_u + 1)(n_v + 1))/(8 pi) h_z^(n_u cos^2(phi) + n_v sin^2(phi)) F(wo . h) / (wo . h max(cos_i, cos_o)),
    with the azimuth phi of the half vector h and Schlick's F = R_s + (1 - R_s)(1 - wo . h)^5. The complete model is
    `AshikhminShirley(R_s, n_u, n_v) + AshikhminShirleyDiffuse(R_d, R_s)`.

    Looks    `AshikhminShirley(0.05, 1000)` is a small, hard highlight that grows stronger at the rim;
             `AshikhminShirley(0.5, 10, 200)` is brushed metal, the highlight drawn out into a band.
    Shapes   R_s, n_u, n_v: numbers or (..., C). `AshikhminShirley(0.05, n=100)` is isotropic.
    Units    f: 1/sr; the rest: 1.
    Error    rounding.
    Source   Ashikhmin & Shirley 2000, "An anisotropic Phong BRDF model", with its sampling. The four quadrants of
             azimuth, which the paper samples one by one, are one map here.

    Example
    >>> brushed = gn.AshikhminShirley(R_s=0.5, n_u=10.0, n_v=200.0)
    >>> print(brushed.f_angles(0.0, 0.0, 0.3, [0.0, np.pi / 2]).round(4))
    [0.8451 0.0989]
    """

    R_s = param(0.05, 0.0, 1.0, "reflectance at normal incidence of a facet")
    n_u = param(100.0, 0.0, 1e4, "exponent along x: the larger, the narrower", alias="n", sampled="min")
    n_v = param("n_u", 0.0, 1e4, "exponent along y", sampled="min")

    def _normals(self, h: Direction) -> Any:
        """Density of half vectors: sqrt((n_u + 1)(n_v + 1))/(2 pi) h_z^(n_u cos^2(phi) + n_v sin^2(phi))."""
        s2 = h.x * h.x + h.y * h.y
        low = s2 < 0.5
        near = log1p_over(-ops.where(low, s2, 0.0))
        rate = ops.where(low, near, -ops.log(h.z * h.z) / ops.where(low, 1.0, s2))  # -log(h_z^2)/sin^2
        lobe = ops.exp(-0.5 * (self.n_u * h.x * h.x + self.n_v * h.y * h.y) * rate)
        return (0.5 / math.pi) * ops.sqrt((self.n_u + 1.0) * (self.n_v + 1.0)) * lobe

    def formula(self, wi: Direction, wo: Direction) -> Any:
        h, cos_d = half_and_cosine(wi, wo)
        fresnel = tree.unchecked(Schlick, F0=self.R_s).F(cos_d)
        return self._normals(h) * fresnel / (4.0 * cos_d * ops.maximum(wi.z, wo.z))

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        x, y = ops.turn(u0)
        x, y = x / ops.sqrt(self.n_u + 1.0), y / ops.sqrt(self.n_v + 1.0)
        r = ops.sqrt(x * x + y * y)
        cos_phi, sin_phi = x / r, y / r
        n = self.n_u * cos_phi * cos_phi + self.n_v * sin_phi * sin_phi
        cos_theta = ops.power(ops.maximum(1.0 - u1, 1e-30), 1.0 / (n + 1.0))
        sin_theta = ops.sqrt(ops.maximum(1.0 - cos_theta * cos_theta, 0.0))
        return reflect(wo, Direction(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta))

    def density(self, wi: Direction, wo: Direction) -> Any:
        h, cos_d = half_and_cosine(wi, wo)
        return self._normals(h) / (4.0 * cos_d)

    def estimate(self, wo: Direction) -> Any:
        return tree.unchecked(Schlick, F0=self.R_s).F(wo.z)


class AshikhminShirleyDiffuse(Reflectance):
    """Diffuse reflection below a glossy lobe: f = 28 rho/(23 pi) (1 - F0) (1 - (1 - z_i/2)^5) (1 - (1 - z_o/2)^5).

    z = cos(theta). To be added to a lobe of Fresnel reflectance F0 at normal incidence: both together conserve energy.

    Looks    `AshikhminShirleyDiffuse(0.5)` is matt and darkens at the rim, where a glossy lobe beside it takes over;
             `F0=0.9` leaves little of it.
    Shapes   rho, F0: numbers or (..., C).
    Units    f: 1/sr; rho (the paper's R_d), F0 (R_s): 1.
    Error    rounding: 4e-7 relative in float32.
    Source   Ashikhmin & Shirley 2000, "An anisotropic Phong BRDF model", Journal of Graphics Tools 5(2).

    Example
    >>> plastic = gn.AshikhminShirleyDiffuse(0.5, F0=0.05) + gn.AshikhminShirley(0.05, n=1000.0)
    >>> print(gn.albedo(plastic, gn.direction([0.0, 1.4], 0.0)).round(3))
    [0.51  0.523]
    """

    rho = param(0.5, 0.0, 1.0, "diffuse albedo of the substrate")
    F0 = param(0.04, 0.0, 1.0, "reflectance of the glossy lobe at normal incidence")

    @property
    def scale(self) -> Any:
        return self.rho * (1.0 - self.F0)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        passed = less_fifth_power(0.5 * wi.z) * less_fifth_power(0.5 * wo.z)
        return 28.0 / (23.0 * math.pi) * self.scale * passed

    def estimate(self, wo: Direction) -> Any:
        return self.scale * less_fifth_power(0.5 * wo.z)
