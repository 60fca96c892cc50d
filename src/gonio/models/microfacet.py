"""Microfacet reflection: mirror facets with a chosen distribution of normals, Fresnel term and masking."""

from __future__ import annotations

from typing import Any

from ..distributions.ggx import GGX
from ..formula.direction import Direction
from ..formula.distribution import Distribution
from ..formula.fields import option, part
from ..formula.fresnel import as_fresnel
from ..formula.fresnel.constant import Constant
from ..formula.fresnel_term import Fresnel
from ..formula.maskings import MASKINGS
from ._facets import Facets


class Microfacet(Facets):
    """Rough mirror: f = D(wm) F(wo . wm) G(wi, wo) / (4 cos(theta_i) cos(theta_o)), wm = (wi + wo)/|wi + wo|.

    Looks    `Microfacet(GGX(0.05), Conductor([0.14, 0.37, 1.4], [4.0, 2.4, 1.6]))` is polished gold; `GGX(0.4)` makes
             it satin, `GGX(0.05, 0.4)` brushed.
    Shapes   the parts' parameters: numbers or (..., C).
    Units    f: 1/sr.
    Error    rounding: 2e-6 relative in float32 for alpha above 0.05. Light scattered twice or more is lost: with
             F = 1 and GGX at alpha = 1 (height_correlated) 1 - ln 2 = 0.31 of it returns at normal incidence.
    Source   Torrance & Sparrow 1967; Cook & Torrance 1982; with the factor 4: Walter et al. 2007, EGSR.
    """

    distribution = part(Distribution, GGX(0.2), "distribution of the facets' normals")
    fresnel = part(Fresnel, Constant(1.0), "reflectance of a facet", coerce=as_fresnel)
    masking = option("height_correlated", *MASKINGS, doc="which facets are lit and seen")

    @property
    def facets(self) -> Distribution:
        return self.distribution

    def G(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        return MASKINGS[self.masking](self.distribution, wi, wo, wm)

    def mirror(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z)
