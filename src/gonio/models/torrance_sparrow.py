"""Torrance and Sparrow's model of 1967, from which all models with facets descend."""

from __future__ import annotations

from typing import Any

from ..distributions.gaussian_facets import GaussianFacets
from ..formula import tree
from ..formula.direction import Direction
from ..formula.distribution import Distribution
from ..formula.fields import param, part
from ..formula.fresnel import as_fresnel
from ..formula.fresnel.constant import Constant
from ..formula.fresnel_term import Fresnel
from ._facets import Facets


class TorranceSparrow(Facets):
    """Torrance and Sparrow's model of 1967: mirror facets with Gaussian angles, in long symmetric V-grooves.

    f = D(theta_m) F(wo . wm) G(wi, wo) / (4 cos(theta_i) cos(theta_o)),  D = exp(-(theta_m/alpha)^2)/N,
    G = min(1, 2 z_m z_o/(wo . wm), 2 z_m z_i/(wo . wm)). The paper adds a diffuse part: `+ Lambertian(...)`.

    Looks    `TorranceSparrow(0.05)` is polished metal, `TorranceSparrow(0.3)` a dull one, brightest at the rim with the
             light behind it.
    Shapes   alpha and the Fresnel term's parameters: numbers or (..., C).
    Units    f: 1/sr; alpha: rad (the paper's 1/c).
    Error    rounding; N see `GaussianFacets`.
    Source   Torrance & Sparrow 1967, J. Opt. Soc. Am. 57(9):1105; with N where the paper has a free constant.

    Example
    >>> dull = gn.TorranceSparrow(0.3)
    >>> print(dull.f_angles(1.2, 0.0, [1.2, 1.4], np.pi).round(3))
    [ 7.148 13.636]
    """

    alpha = param(0.2, 1e-3, 1.0, "angular width of the facets (1/c)", unit="rad", sampled="max")
    fresnel = part(Fresnel, Constant(1.0), "reflectance of a facet", coerce=as_fresnel)

    masking = "v_groove"

    @property
    def facets(self) -> Distribution:
        return tree.unchecked(GaussianFacets, alpha=self.alpha)

    def mirror(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z)
