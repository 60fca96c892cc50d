"""Mirror facets with a chosen distribution of normals, Fresnel term and masking: reflection, and retro-reflection."""

from __future__ import annotations

from typing import Any

from ..base.reflectance import Reflectance
from ..base.results import NO_HINTS
from ..distributions.ggx import GGX
from ..formula import tree
from ..formula.direction import Direction, half_and_cosine, mirror
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

    Example
    >>> brushed = gn.Microfacet(gn.GGX(0.05, 0.4), gn.material("gold").fresnel)
    >>> print(brushed.f_angles(0.5, 0.0, 0.5, np.pi).round(2))
    [5.03 3.76 1.89]
    >>> print(gn.albedo(brushed, gn.direction(0.5, 0.0)).round(3))
    [0.86  0.643 0.323]
    """

    distribution = part(Distribution, GGX(0.2), "distribution of the facets' normals")
    fresnel = part(Fresnel, Constant(1.0), "reflectance of a facet", coerce=as_fresnel)
    masking = option("height_correlated", *MASKINGS, doc="which facets are lit and seen")

    @property
    def facets(self) -> Distribution:
        return self.distribution

    def mirror(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z)


def ggx_mirrors(alpha: Any, fresnel: Fresnel) -> Microfacet:
    """Isotropic GGX facets of slope scale `alpha` with the height-correlated masking, for use in formulas."""
    facets = tree.unchecked(GGX, alpha_x=alpha, alpha_y=alpha)
    return tree.unchecked(Microfacet, distribution=facets, fresnel=fresnel, masking="height_correlated")


class RetroMicrofacet(Microfacet):
    """Rough retro-reflector: f(wi, wo) = f_m(wi, mirror image of wo about the normal), f_m a `Microfacet`.

    The lobe of f_m about the mirror direction becomes one about the direction to the light, of the same albedo. It is
    reciprocal where normals to either side are as frequent, as in all of gonio's distributions but tables that lean.
    The half vector of the mirrored pair is the normal where wi = wo. For road signs and safety clothing, whose prisms
    or beads it does not follow further: towards grazing it falls off as f_m does.

    Looks    `RetroMicrofacet(GGX(0.1))` is a road sign: bright all over seen with the light, else dark; `GGX(0.5)`
             glows softly.
    Shapes   the parts' parameters: numbers or (..., C).
    Units    f: 1/sr.
    Error    as `Microfacet`.
    Source   Portsmouth, Raab, Belcour & Liu 2026, "The minimal retroreflective microfacet model", JCGT 15(1):60; the
             vector goes back to Belcour, Pacanowski, Delahaie, Laville-Geay & Eupherte 2014.

    Example
    >>> sign = gn.RetroMicrofacet(gn.GGX(0.1))
    >>> print(sign.f_angles(0.5, 0.0, 0.5, [0.0, np.pi]).round(4))
    [10.3173  0.0183]
    """

    mirror = Reflectance.mirror  # its limit is no mirror
    polarized, polarizes = Reflectance.polarized, False  # each prism or bead reflects more than once
    hints = NO_HINTS  # its half vectors are about the direction to the light

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return super().formula(wi, mirror(wo))

    def without_fresnel(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        wo = mirror(wo)
        return super().without_fresnel(wi, wo, half_and_cosine(wi, wo)[0])

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return super().warp(mirror(wo), u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return super().density(wi, mirror(wo))
