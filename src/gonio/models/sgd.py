"""SGD: Bagher, Soler and Holzschuch's model, made to fit measured reflectances."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..distributions.sgd_facets import SGDFacets
from ..formula import tree
from ..formula.direction import Direction, half_and_cosine, polar_angle
from ..formula.distribution import Distribution
from ..formula.fields import param
from ..formula.warp import power_positive
from ._facets import Facets


class SGD(Facets):
    """Glossy lobe of the SGD model: f = (rho_s/pi) F(theta_d) D(theta_m) G1(theta_i) G1(theta_o) / (cos_i cos_o).

    D is `SGDFacets(alpha, p)`; F = F0 - F1 cos + (1 - F0)(1 - cos)^5 at the difference angle, which is no Fresnel
    reflectance but fits measurements; G1 = 1 + lam (1 - exp(c max(theta - theta0, 0)^k)), a fit to Smith's
    masking of each D, whose numbers come with those of D. F and G1 below 0 count as 0. The diffuse part is a
    `Lambertian` beside it. For a physical surface with this D take `Microfacet(SGDFacets(alpha, p), ...)`.

    Looks    `SGD(0.5, 0.01)` is a highlight with a sharp peak and a wide glow, as of car paint; `SGD(0.5, 0.5)` is
             satin.
    Shapes   all parameters: numbers or (..., C).
    Units    f: 1/sr; theta0: rad; the others: 1 (c: rad^-k).
    Error    rounding; D see `SGDFacets`.
    Source   Bagher, Soler & Holzschuch 2012, CGF 31(4):1509.

    Example
    >>> paint = gn.SGD(0.5, alpha=0.01)
    >>> print(paint.f_angles(0.5, 0.0, [0.5, 0.6, 0.7], np.pi).round(2))
    [27.97  3.25  0.72]
    """

    _single_scatter = Reflectance._single_scatter  # fitted to what was measured
    polarized, polarizes = Reflectance.polarized, False  # its Fresnel term has no amplitudes

    rho_s = param(0.5, 0.0, 10.0, "weight of the lobe")
    alpha = param(0.1, 1e-3, 2.0, "squared width of the distribution's tail", sampled="max")
    p = param(0.6, 0.0, 3.0, "fall-off of the distribution's peak", sampled="min")
    F0 = param(0.5, 0.0, 1.0, "reflectance term, constant part")
    F1 = param(0.0, -1.0, 1.0, "reflectance term, part that falls with the cosine")
    theta0 = param(0.2, -1.0, 1.5, "angle at which masking sets in", unit="rad")
    c = param(0.3, 0.0, 10.0, "masking: strength")
    k = param(4.0, 1.0, 60.0, "masking: steepness")
    lam = param(2.5, 0.0, 5.0, "masking: amplitude (the paper's lambda)")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "rho_s/pi stands where facets have 1/4, and rho_s is free: at normal incidence nearly "
        "4 rho_s (F0 - F1)/pi of the light returns",
    }

    @property
    def facets(self) -> Distribution:
        return tree.unchecked(SGDFacets, alpha=self.alpha, p=self.p)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        masked = self._G1(wi) * self._G1(wo)
        return self.rho_s * (1.0 / math.pi) * self._F(cos_d) * self.facets.D(wm) * masked / (wi.z * wo.z)

    def _F(self, cos: Any) -> Any:
        m = ops.clip(1.0 - cos, 0.0, 1.0)
        m2 = m * m
        return ops.maximum(self.F0 - self.F1 * cos + (1.0 - self.F0) * m2 * m2 * m, 0.0)

    def _G1(self, w: Direction) -> Any:
        rise = ops.minimum(self.c * power_positive(polar_angle(w) - self.theta0, self.k), 20.0)
        return ops.clip(1.0 + self.lam * (1.0 - ops.exp(rise)), 0.0, 1.0)

    def estimate(self, wo: Direction) -> Any:
        return self.rho_s * (4.0 / math.pi) * self._F(wo.z)
