"""GGX mirrors that give back the light scattered more than once: three approximations in use.

A microfacet model counts the first reflection only. Its loss, 1 - E, is up to 0.69 of the light at alpha = 1.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..base.reflectance import Reflectance
from ..distributions.ggx import GGX
from ..formula import tree
from ..formula.direction import Direction
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution
from ..formula.fields import param, part
from ..formula.fresnel import as_fresnel
from ..formula.fresnel.constant import Constant
from ..formula.fresnel.schlick import Schlick
from ..formula.fresnel_term import Fresnel
from ..formula.mueller import Mueller
from ..formula.smith import gauss
from ._compensated import CompensatedMirrors
from ._facets import Facets
from ._ggx_albedo import lost, lost_on_average, schlick_share


class KullaConty(CompensatedMirrors):
    """GGX facets, and a lobe for the light they lose: f = f_1 + F_ms (1 - E(mu_i))(1 - E(mu_o))/(pi (1 - E_avg)).

    f_1 is `Microfacet(GGX(alpha), fresnel)`, E its albedo for F = 1 and E_avg the mean of that over diffuse light.
    F_ms = F_avg^2 E_avg/(1 - F_avg (1 - E_avg)) adds up the reflections after the first, F_avg = 2 integral of F mu.
    Reciprocal; with F = 1 no light is lost.

    Looks    `KullaConty(1)` is rough metal as bright as it should be, where `Microfacet(GGX(1))` is too
             dark; `KullaConty(0.1)` is polished.
    Shapes   alpha and the Fresnel term's parameters: numbers or (..., C).
    Units    f: 1/sr; alpha: 1.
    Error    E, a fit: 5e-4; so is the albedo for F = 1. F_avg by 10-point Gauss–Legendre: 1e-4 for eta above 1.1.
    Source   Kulla & Conty 2017, "Revisiting physically based shading at Imageworks", after Kelemen & Szirmay-Kalos
             2001; F_ms with F_avg squared: Hill 2018, "A multi-faceted exploration, part 2", and derived here.

    Example
    >>> rough = gn.KullaConty(1.0, fresnel=1.0)
    >>> print(gn.albedo(rough, gn.direction(0.5, 0.0)).round(3))
    1.0
    >>> print(gn.albedo(gn.Microfacet(gn.GGX(1.0)), gn.direction(0.5, 0.0)).round(3))
    0.333
    """

    alpha = param(0.3, ALPHA_LOW, ALPHA_HIGH, "slope scale of the facets", sampled="max")
    fresnel = part(Fresnel, Constant(1.0), "reflectance of a facet", coerce=as_fresnel)

    def other(self) -> type[_Further]:
        return _Further


class _Further(KullaConty):
    """The further reflections of `KullaConty`: F_ms (1 - E(mu_i))(1 - E(mu_o))/(pi (1 - E_avg))."""

    lobes, polarized, polarizes = Reflectance.lobes, Reflectance.polarized, False

    def colour(self) -> Any:
        """F_ms = F_avg^2 E_avg/(1 - F_avg (1 - E_avg)): two reflections at least, each lets E_avg escape."""
        mean, escaping = average(self.fresnel, self.alpha), 1.0 - lost_on_average(self.alpha)
        return mean * mean * escaping / (1.0 - mean * (1.0 - escaping))

    def formula(self, wi: Direction, wo: Direction) -> Any:
        both = lost(wi.z, self.alpha) * lost(wo.z, self.alpha)
        return self.colour() / (math.pi * lost_on_average(self.alpha)) * both

    def estimate(self, wo: Direction) -> Any:
        return self.colour() * lost(wo.z, self.alpha)


class Turquin(Facets):
    """GGX facets, made brighter by their loss towards the viewer: f = f_1 (1 + F0 (1 - E(mu_o))/E(mu_o)).

    f_1 is `Microfacet(GGX(alpha), fresnel)`, E its albedo for F = 1, F0 the Fresnel term at normal incidence. With
    F = 1 every viewer in a uniform surround of radiance 1 sees radiance 1.

    Looks    `Turquin(0.4, [0.95, 0.64, 0.54])` is satin copper, as bright as it should be; `Turquin(1)` is
             rough metal where `Microfacet(GGX(1))` is too dark.
    Shapes   alpha and the Fresnel term's parameters: numbers or (..., C).
    Units    f: 1/sr; alpha: 1.
    Error    E, a fit: 5e-4, and the factor 1.6e-3 relative.
    Source   Turquin 2019, "Practical multiple scattering compensation for microfacet models", Industrial Light & Magic.

    Example
    >>> rough = gn.Turquin(1.0, fresnel=[1.0, 0.7, 0.3])
    >>> print(gn.albedo(rough, gn.direction(0.5, 0.0)).round(3))
    [0.824 0.473 0.144]
    """

    alpha = param(0.3, 0.04, ALPHA_HIGH, "slope scale of the facets; below, less than 1 % is lost", sampled="max")
    fresnel = part(Fresnel, Constant(1.0), "reflectance of a facet", coerce=as_fresnel)

    breaks: ClassVar[dict[str, str]] = {
        "reciprocity": "the factor depends on the viewer alone: with F = 1 and alpha = 1 it is 3.3 at normal view, "
        "1 at grazing",
        "energy": "light at grazing incidence loses little, and its reflection is made brighter all the same: with "
        "F = 1 and alpha = 1 its albedo is 2.2. A viewer sees no gain",
    }

    masking = "height_correlated"
    _single_scatter = Reflectance._single_scatter  # what they lose is given back

    @property
    def facets(self) -> Distribution:
        return tree.unchecked(GGX, alpha_x=self.alpha, alpha_y=self.alpha)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        loss = lost(wo.z, self.alpha)
        return super().formula(wi, wo) * (1.0 + self.fresnel.F(1.0 + 0.0 * self.alpha) * loss / (1.0 - loss))

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        # What is made brighter, light reflected more than once, is unpolarized.
        M = super().polarized(wi, wo)
        return M + Mueller.depolarizer(self.formula(wi, wo) - super().formula(wi, wo)) if self.polarizes else M


class FdezAguera(CompensatedMirrors):
    """GGX facets with Schlick's Fresnel term, and a diffuse lobe: f = f_1 + E_F F_avg (1 - E)/(pi (1 - F_avg (1 - E))).

    E and E_F are the albedos of `Microfacet(GGX(alpha))` for F = 1 and for F0, at the viewer's angle; F_avg is
    F0 + (1 - F0)/21. Made for prefiltered environments, where the second term takes the irradiance.

    Looks    `FdezAguera(1, [1, 0.7, 0.3])` is rough gold, its colour deeper than one reflection makes it;
             `FdezAguera(0.1)` is polished metal.
    Shapes   alpha, F0: numbers or (..., C).
    Units    f: 1/sr; alpha, F0: 1.
    Error    E and E_F, fits: 5e-4.
    Source   Fdez-Agüera 2019, "A multiple-scattering microfacet model for real-time image based lighting", JCGT
             8(1):45.

    Example
    >>> gold = gn.FdezAguera(1.0, F0=[1.0, 0.7, 0.3])
    >>> print(gn.albedo(gold, gn.direction(0.5, 0.0)).round(3))
    [0.923 0.436 0.129]
    """

    alpha = param(0.3, 0.04, ALPHA_HIGH, "slope scale of the facets; below, less than 1 % is lost", sampled="max")
    F0 = param(0.9, 0.0, 1.0, "reflectance of a facet at normal incidence")

    breaks: ClassVar[dict[str, str]] = {
        "reciprocity": "the second term depends on the viewer alone",
        "energy": "light at grazing incidence loses little at its first reflection, but gains the mean loss of "
        "light from everywhere: at alpha = 1, F0 = 1 the albedo there is 1.59. A viewer sees no gain",
    }

    @property
    def fresnel(self) -> Any:
        return tree.unchecked(Schlick, F0=self.F0)

    def other(self) -> type[_Diffuse]:
        return _Diffuse


class _Diffuse(FdezAguera):
    """The further reflections of `FdezAguera`: the same radiance to all sides, by where the viewer is."""

    lobes, polarized, polarizes = Reflectance.lobes, Reflectance.polarized, False

    def estimate(self, wo: Direction) -> Any:
        loss, schlick = lost(wo.z, self.alpha), schlick_share(wo.z, self.alpha)
        once = self.F0 * (1.0 - loss - schlick) + schlick
        mean = self.F0 + (1.0 - self.F0) * (1.0 / 21.0)
        return once * mean * loss / (1.0 - mean * loss)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.estimate(wo) * (1.0 / math.pi)


def average(fresnel: Fresnel, like: Any) -> Any:
    """Reflectance of a facet for diffuse light, 2 integral of F mu over [0, 1]; `like`: a number of its library."""
    total = 0.0 * like
    for mu, weight in gauss(10):
        total = total + 2.0 * weight * mu * fresnel.F(mu + 0.0 * like)
    return total
