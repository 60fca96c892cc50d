"""Maignan's polarized reflectance of land: mirror leaves and soil, by one number fitted to satellite measurements."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, dot, half_and_cosine, length
from ..formula.fields import param
from ..formula.fresnel.dielectric import fresnel_dielectric, interface_mueller
from ..formula.mueller import Mueller, about_facet


class Maignan(Reflectance):
    """Light mirrored by land: f = C exp(-tan(alpha)) exp(-NDVI) F(alpha) / (4 pi (cos(theta_i) + cos(theta_o))).

    alpha is the angle of incidence on facets that mirror wi into wo, half of that between wi and wo, and F Fresnel's
    reflectance; the Mueller matrix has that of the facets in place of F. The published model is the polarized part
    alone, R_p = pi |(Q, U)| under unpolarized light, to which C is fitted; what leaves unpolarized is another model's:
    `RPV(...) + Maignan(...)`. A fit is one of C, as theirs; f depends on C exp(-ndvi) alone.

    Looks    `Maignan(10, 0, 2)` is dark gray, the brightest land; `Maignan()` is nearly black: it sends back 3 % of the
             light. What goes on away from the sun is polarized, what comes back is not.
    Shapes   C, ndvi, eta: numbers or (..., C).
    Units    f: 1/sr; all others: 1.
    Error    rounding.
    Source   Maignan, Bréon, Fédèle & Bouvier 2009, "Polarized reflectances of natural surfaces: spaceborne measurements
             and analytical modeling", Remote Sensing of Environment 113(12):2642. The paper's text was not seen: the
             formula as an independent description has it. R_p = pi f: mirrors of all orientations, without the
             exponentials, give F/(4 pi (cos(theta_i) + cos(theta_o))); tests/models/test_polarized_models.py.

    Example
    >>> meadow = gn.Maignan(C=6.0, ndvi=0.7)
    >>> M = meadow.mueller(gn.direction(1.0, 0.0), gn.direction(1.0, np.pi))
    >>> print((np.pi * M[:2, 0]).round(5))  # the reflectance factor, and what of it is horizontal
    [0.01126 0.01124]
    """

    C = param(5.0, 0.0, 10.0, "factor, of the kind of land")
    ndvi = param(0.5, -1.0, 1.0, "normalized difference vegetation index", fitted=False)
    eta = param(1.5, 1.0, 2.0, "refractive index of leaves and grains", fitted=False)

    def _without_fresnel(self, wi: Direction, wo: Direction) -> Any:
        """f of facets whose F is 1."""
        tan = length(wi - wo) / ops.sqrt(dot(wi + wo, wi + wo))
        return self.C * ops.exp(-tan - self.ndvi) / (4.0 * math.pi * (wi.z + wo.z))

    def formula(self, wi: Direction, wo: Direction) -> Any:
        _, cos_alpha = half_and_cosine(wi, wo)
        return fresnel_dielectric(cos_alpha, self.eta) * self._without_fresnel(wi, wo)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        _, cos_alpha = half_and_cosine(wi, wo)
        facet = interface_mueller(cos_alpha, (self.eta - 1.0) * (self.eta + 1.0))
        return about_facet(facet * self._without_fresnel(wi, wo), wi, wo)

    def estimate(self, wo: Direction) -> Any:
        return 0.05 * self.C * ops.exp(-self.ndvi) + 0.0 * wo.z
