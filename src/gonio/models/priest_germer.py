"""Priest and Germer's polarimetric microfacet model: the first with a Mueller matrix for every pair of directions."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..distributions.beckmann import Beckmann
from ..formula import tree
from ..formula.direction import Direction
from ..formula.distribution import Distribution
from ..formula.fields import option, param
from ..formula.fresnel.conductor import Conductor
from ..formula.fresnel_term import Fresnel
from ..formula.maskings import MASKINGS
from ._facets import Facets


class PriestGermer(Facets):
    """Facets with Gaussian slopes, polarized: M = exp(-tan^2(theta_m)/(2 sigma^2)) J / (8 pi sigma^2 c_m^4 c_i c_o).

    c_m, c_i, c_o are the cosines of theta_m, theta_i, theta_o, and J is the Mueller matrix of a facet of index
    eta + ik, turned from the axes of the facet to those of the surface; f is the first element, with F in place of J.
    As it was published nothing is masked: `masking="none"`. Masked it is a `Microfacet` with `Beckmann(sqrt(2) sigma)`
    and `Conductor(eta, k)`.

    Looks    `PriestGermer(0.05, 1.2, 6.0)` is polished aluminium; `PriestGermer(0.3, 1.5, 0.0)` is black satin, too
             bright at the rim unless it is masked.
    Shapes   sigma, eta, k: numbers or (..., C).
    Units    f: 1/sr; all others: 1.
    Error    rounding.
    Source   Priest & Germer 2000, "Polarimetric BRDF in the microfacet model: theory and measurements", Proc. Military
             Sensing Symposia, Passive Sensors, 1:169. The paper's text was not seen: the form that later papers quote,
             and the turn of axes by vectors in place of spherical trigonometry.

    Example
    >>> paint = gn.PriestGermer(0.2, eta=1.5, k=0.0)
    >>> M = paint.mueller(gn.direction(1.0, 0.0), gn.direction(1.0, np.pi))
    >>> print(gn.polarization.dop(M[:, 0]).round(3))
    0.999
    """

    sigma = param(0.2, 1e-3, 0.7, "root mean square slope of the facets along any line", sampled="max")
    eta = param(1.5, 0.01, 20.0, "real part of the refractive index")
    k = param(0.0, 0.0, 50.0, "imaginary part of the refractive index (extinction)")
    masking = option("none", *MASKINGS, doc="which facets are lit and seen")

    breaks: ClassVar[dict[str, str]] = {
        "energy": 'with masking="none", as published, the highlight grows as 1/cos(theta) towards grazing',
    }

    @property
    def facets(self) -> Distribution:
        alpha = math.sqrt(2.0) * self.sigma
        return tree.unchecked(Beckmann, alpha_x=alpha, alpha_y=alpha)

    @property
    def fresnel(self) -> Fresnel:
        return tree.unchecked(Conductor, eta=self.eta, k=self.k)

    def G(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        return 1.0 if self.masking == "none" else super().G(wi, wo, wm)

    def mirror(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z)
