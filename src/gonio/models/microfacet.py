"""Microfacet reflection: mirror facets with a chosen distribution of normals, Fresnel term and masking."""

from __future__ import annotations

from typing import Any

from ..fresnel import Constant, Fresnel, as_fresnel
from ..geometry import Direction, dot, half_vector, reflect
from ..microfacet import GGX, MASKINGS, Distribution, GaussianFacets, check_masking, v_groove
from ..param import option, param, part
from ..reflectance import Reflectance


class _Facets(Reflectance):
    """Reflection by mirror facets: D F G / (4 cos cos), sampled by drawing a facet's normal."""

    fresnel: Any

    @property
    def facets(self) -> Distribution:
        """The distribution of normals."""
        raise NotImplementedError

    def G(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        """The fraction of facets wm that is both lit and seen."""
        raise NotImplementedError

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wm = half_vector(wi, wo)
        return self.facets.D(wm) * self.fresnel.F(dot(wo, wm)) * self.G(wi, wo, wm) / (4.0 * wi.z * wo.z)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return reflect(wo, self.facets.warp_normal(wo, u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        wm = half_vector(wi, wo)
        return self.facets.normal_density(wo, wm) / (4.0 * dot(wo, wm))

    def estimate(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z)


class Microfacet(_Facets):
    """Rough mirror: f = D(wm) F(wo . wm) G(wi, wo) / (4 cos(theta_i) cos(theta_o)), wm = (wi + wo)/|wi + wo|.

    Shapes   the parts' parameters: numbers or (..., C).
    Units    f: 1/sr.
    Error    rounding: 2e-6 relative in float32 for alpha above 0.05. Light scattered twice or more is lost: with
             F = 1 and GGX at alpha = 1 (height_correlated) 1 - ln 2 = 0.31 of it returns at normal incidence.
    Source   Torrance & Sparrow 1967; Cook & Torrance 1982; with the factor 4: Walter et al. 2007, EGSR.
    """

    distribution = part(Distribution, GGX(0.2), "distribution of the facets' normals")
    fresnel = part(Fresnel, Constant(1.0), "reflectance of a facet", coerce=as_fresnel)
    masking = option("height_correlated", "separable", "v_groove", doc="which facets are lit and seen")

    def validate(self) -> None:
        check_masking(self.distribution, self.masking)

    @property
    def facets(self) -> Distribution:
        return self.distribution

    def G(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        return MASKINGS[self.masking](self.distribution, wi, wo, wm)


class TorranceSparrow(_Facets):
    """Torrance and Sparrow's model of 1967: mirror facets with Gaussian angles, in long symmetric V-grooves.

    f = D(theta_m) F(wo . wm) G(wi, wo) / (4 cos(theta_i) cos(theta_o)),  D = exp(-(theta_m/alpha)^2)/N,
    G = min(1, 2 z_m z_o/(wo . wm), 2 z_m z_i/(wo . wm)). The paper adds a diffuse part: `+ Lambertian(...)`.

    Shapes   alpha and the Fresnel term's parameters: numbers or (..., C).
    Units    f: 1/sr; alpha: rad (the paper's 1/c).
    Error    rounding; N see `GaussianFacets`.
    Source   Torrance & Sparrow 1967, J. Opt. Soc. Am. 57(9):1105; with N where the paper has a free constant.
    """

    alpha = param(0.2, 1e-3, 1.0, "angular width of the facets (1/c)", unit="rad", sampled="max")
    fresnel = part(Fresnel, Constant(1.0), "reflectance of a facet", coerce=as_fresnel)

    @property
    def facets(self) -> Distribution:
        return GaussianFacets.unchecked(alpha=self.alpha)

    def G(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        return v_groove(self.facets, wi, wo, wm)
