"""Cook and Torrance's model of 1982, as it was printed."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..distributions.beckmann import Beckmann
from ..formula import tree
from ..formula.direction import Direction, half_and_cosine
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution
from ..formula.fields import param, part
from ..formula.fresnel import as_fresnel
from ..formula.fresnel.dielectric import Dielectric
from ..formula.fresnel_term import Fresnel
from ._facets import Facets


class CookTorrance(Facets):
    """Cook and Torrance's model of 1982 as printed: f = F D G / (pi cos(theta_i) cos(theta_o)).

    D = exp(-(tan(theta_m)/m)^2) / (m^2 cos^4(theta_m)),  G = min(1, 2 z_m z_o/(wo . wm), 2 z_m z_i/(wo . wm)).
    The projected facets of this D add up to pi, so that D/pi is the Beckmann distribution and f is exactly 4 times
    what energy balance gives: `Microfacet(Beckmann(m), F, masking="v_groove")`, which is the one to use. The paper's
    R is s times this and d times a diffuse part: `s * CookTorrance(...) + d * Lambertian(...)`.

    Looks    `CookTorrance(0.1, Conductor([0.2, 0.9, 1.1], [3.9, 2.5, 2.2]))` is polished copper; `m=0.4` is a dull
             casting of it.
    Shapes   m and the Fresnel term's parameters: numbers or (..., C).
    Units    f: 1/sr; m: 1, sqrt(2) times the RMS slope.
    Error    rounding.
    Source   Cook & Torrance 1982, ACM TOG 1(1):7, with the mean F of both polarizations; D is Beckmann's.

    Example
    >>> copper = gn.CookTorrance(0.4, gn.material("copper").fresnel)
    >>> print(copper.f_angles(0.5, 0.0, 0.5, np.pi).round(3))
    [2.402 1.607 1.349]
    """

    m = param(0.2, ALPHA_LOW, ALPHA_HIGH, "slope scale of the facets (the paper's m)", sampled="max")
    fresnel = part(Fresnel, Dielectric(1.5), "reflectance of a facet", coerce=as_fresnel)

    masking = "v_groove"

    breaks: ClassVar[dict[str, str]] = {
        "energy": "as printed it reflects 4 times what a surface of such facets does: with F = 1 and m = 0.1 the "
        "albedo at normal incidence is 4.0; Microfacet(Beckmann(m), F, masking='v_groove') is the same without the 4",
    }

    @property
    def facets(self) -> Distribution:
        return tree.unchecked(Beckmann, alpha_x=self.m, alpha_y=self.m)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        D = math.pi * self.facets.D(wm)  # as printed, without the 1/pi of a normalized distribution
        return self.fresnel.F(cos_d) * D * self.G(wi, wo, wm) / (math.pi * wi.z * wo.z)

    def without_fresnel(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        return 4.0 * super().without_fresnel(wi, wo, wm)
