"""Two slabs of OpenPBR, the standard for materials of film and design: its metal, and its glossy-diffuse base."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..distributions.ggx import GGX
from ..formula import tree
from ..formula.direction import Direction, half_and_cosine
from ..formula.distribution import Distribution
from ..formula.fields import param
from ..formula.fresnel.f82_tint import F82Tint
from ..formula.fresnel.schlick import Schlick
from ._compensated import CompensatedMirrors
from ._facets import Facets
from ._ggx_albedo import entering, lost_on_average, schlick_share_on_average


class OpenPBRMetal(Facets, oriented=True):
    """OpenPBR's metal: GGX facets with the F82 tint, f = specular_weight D F G/(4 cos(theta_i) cos(theta_o)).

    alpha_x = roughness^2 sqrt(2/(1 + (1 - a)^2)), alpha_y = (1 - a) alpha_x, at least 0.001; a is the anisotropy. A
    base of metalness M is `(1 - M) * OpenPBRGlossyDiffuse(...) + M * OpenPBRMetal(...)`.

    Looks    `OpenPBRMetal([1, 0.8, 0.3])` is satin gold; `specular_roughness=0.05` polishes it,
             `specular_roughness_anisotropy=0.9` brushes it.
    Shapes   all: numbers or (..., C).
    Units    f: 1/sr; all others: 1.
    Error    rounding. Light scattered twice or more is lost, which the specification leaves to the implementation.
    Source   Andersson et al. 2024, "OpenPBR Surface", specification 1.1, sections on microfacets and on metal; F82:
             Kutz, Hašan & Edmondson 2021.

    Example
    >>> gold = gn.OpenPBRMetal([1.0, 0.8, 0.3], specular_roughness=0.5)
    >>> print(gn.albedo(gold, gn.direction(0.5, 0.0)).round(3))
    [0.905 0.724 0.272]
    """

    base_color = param(0.8, 0.0, 1.0, "reflectance at normal incidence, times base_weight")
    specular_color = param(1.0, 0.0, 1.0, "tint of the edge, at cos theta = 1/7")
    specular_weight = param(1.0, 0.0, 1.0, "factor of the whole")
    specular_roughness = param(0.3, 0.0, 1.0, "alpha = roughness^2", sampled="max")
    specular_roughness_anisotropy = param(0.0, 0.0, 1.0, "1 - alpha_y/alpha_x")

    masking = "height_correlated"

    @property
    def facets(self) -> Distribution:
        thin, r = 1.0 - self.specular_roughness_anisotropy, self.specular_roughness
        along = r * r * ops.sqrt(2.0 / (1.0 + thin * thin))
        return tree.unchecked(GGX, alpha_x=ops.maximum(along, 1e-3), alpha_y=ops.maximum(thin * along, 1e-3))

    @property
    def fresnel(self) -> Any:
        return tree.unchecked(F82Tint, F0=self.base_color, tint=self.specular_color)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        G = self.G(wi, wo, wm)
        return self.specular_weight * self.facets.D(wm) * self.fresnel.F(cos_d) * G / (4.0 * wi.z * wo.z)

    def estimate(self, wo: Direction) -> Any:
        return self.specular_weight * super().estimate(wo)


class OpenPBRGlossyDiffuse(CompensatedMirrors):
    """OpenPBR's glossy-diffuse base: f = f_gloss + base_color (1 - E(mu_i))(1 - E(mu_o))/(pi (1 - E_avg)).

    f_gloss is `Microfacet(GGX(alpha), Schlick(F0))`, alpha = roughness^2 (at least 0.001), F0 = specular_weight
    ((ior - 1)/(ior + 1))^2; E is its albedo, E_avg the mean of that over diffuse light. This is the reciprocal one of
    the two forms that the specification offers; with base_color = 1 all light returns.
    Left out: the exact Fresnel term, in whose place is Schlick's, which rises to 1 at grazing also where F0 = 0;
    base_diffuse_roughness, anisotropy, and tints; the coat and the fuzz above this slab.

    Looks    `OpenPBRGlossyDiffuse([0.1, 0.2, 0.8])` is blue plastic; `specular_roughness=1` is nearly
             matt, `specular_ior=2.5` shines like lacquer.
    Shapes   all: numbers or (..., C).
    Units    f: 1/sr; all others: 1.
    Error    E, a fit: 7e-4; so is the albedo.
    Source   Andersson et al. 2024, "OpenPBR Surface", specification 1.1, section on the glossy-diffuse slab, after
             Kelemen & Szirmay-Kalos 2001.

    Example
    >>> plastic = gn.OpenPBRGlossyDiffuse([0.8, 0.1, 0.1], specular_roughness=0.3)
    >>> print(gn.albedo(plastic, gn.direction(0.5, 0.0)).round(3))
    [0.808 0.136 0.136]
    """

    base_color = param(0.8, 0.0, 1.0, "share that returns of the light that enters, times base_weight")
    specular_weight = param(1.0, 0.0, 1.0, "factor of the reflectance at normal incidence")
    specular_roughness = param(0.3, 0.0, 1.0, "alpha = roughness^2", sampled="max")
    specular_ior = param(1.5, 1.0, 3.0, "refractive index below over that above")

    @property
    def alpha(self) -> Any:
        """Slope scale of the interface.

        Example
        >>> print(round(gn.OpenPBRGlossyDiffuse(specular_roughness=0.3).alpha, 4))
        0.09
        """
        return ops.maximum(self.specular_roughness * self.specular_roughness, 1e-3)

    @property
    def fresnel(self) -> Any:
        amplitude = (self.specular_ior - 1.0) / (self.specular_ior + 1.0)
        return tree.unchecked(Schlick, F0=self.specular_weight * amplitude * amplitude)

    def other(self) -> type[_DiffuseBelow]:
        return _DiffuseBelow


class _DiffuseBelow(OpenPBRGlossyDiffuse):
    """The diffuse lobe, drawn from the cosine hemisphere."""

    lobes, polarized, polarizes = Reflectance.lobes, Reflectance.polarized, False

    def formula(self, wi: Direction, wo: Direction) -> Any:
        alpha, F0 = self.alpha, self.fresnel.F0
        mean = F0 * lost_on_average(alpha) + (1.0 - F0) * (1.0 - schlick_share_on_average(alpha))
        return self.base_color * (1.0 / math.pi) * entering(wi.z, alpha, F0) * entering(wo.z, alpha, F0) / mean

    def estimate(self, wo: Direction) -> Any:
        return self.base_color * entering(wo.z, self.alpha, self.fresnel.F0)
