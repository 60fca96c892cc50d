"""Rough dielectric: a ground interface, whose facets reflect and refract."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..base.results import NO_HINTS
from ..base.sides import choose
from ..distributions.ggx import GGX
from ..errors import ParameterError, shown
from ..formula import tree
from ..formula.direction import NORMAL, Direction, dot, half_and_cosine, select
from ..formula.distribution import Distribution
from ..formula.fields import param, part
from ..formula.fresnel.dielectric import Dielectric
from ..formula.mueller import Mueller, about_facet, diattenuator
from ._between_media import BetweenMedia
from ._facets import Facets

NEAREST = 1e-3
"""How close to 1 the index of a rough interface may be: f grows as 1/(eta - 1)^2, and its half vectors lose digits."""

STEEP = {
    "grazing": "f_t ends where the facet that would refract stands upright: by a jump with GGX, which has such facets; "
    "with Beckmann's there is none"
}
"""Law that rough interfaces break."""


class RoughDielectric(BetweenMedia):
    """Ground glass, one interface: facets that reflect and refract, f = f_r + f_t on the whole sphere.

    f_r = D F G/(4 cos_i cos_o),  f_t = |wi.wm| |wo.wm| n_o^2 (1 - F) G D/(|cos_i cos_o| (n_i wi.wm + n_o wo.wm)^2)

    with wm along wi + wo above the surface and along -(n_i wi + n_o wo) across it, G the product of both G1. n is 1 in
    front and eta behind. From behind it is the interface of 1/eta, with total reflection beyond the critical angle.
    f_t is the radiance out over the irradiance in: light that enters the denser medium is compressed by n_o^2/n_i^2,
    so that f/n_o^2 is reciprocal, not f.

    Looks    `RoughDielectric(GGX(0.1), 1.5)` is the frosted surface of a block of glass; `GGX(0.01)` is almost clear.
    Shapes   eta and the distribution's parameters: numbers or (..., C).
    Units    f: 1/sr.
    Error    rounding: 1e-5 relative in float32 for eta to 1.5, 2e-4 at 2.4. Light scattered twice or more is lost: of
             GGX(0.3), eta = 1.5, 1.2 % at normal incidence, 10 % at 80 degrees; `KullaContyDielectric` returns it.
    Raises   ParameterError for eta within 1e-3 of 1, where f has no limit.
    Source   Walter, Marschner, Li & Torrance 2007, EGSR.

    Example
    >>> glass = gn.RoughDielectric(gn.GGX(0.2), 1.5)
    >>> through, wo = gn.direction(np.pi - 0.3, np.pi), gn.direction(0.5, 0.0)
    >>> print(glass.f(through, wo).round(3), glass.f(gn.direction(0.5, np.pi), wo).round(3))
    19.018 0.106
    """

    breaks = STEEP
    distribution = part(Distribution, GGX(0.2), "distribution of the facets' normals")
    eta = param(1.5, 0.2, 5.0, "refractive index behind the surface over that in front")

    def validate(self) -> None:
        refuse_equal_media(type(self).__name__, self.eta)

    @property
    def _single_scatter(self) -> Any:
        return self  # it absorbs nothing

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        return facets(self.distribution, self.eta)


def facets(distribution: Distribution, eta: Any) -> Iterable[tuple[Any, Reflectance]]:
    """The two lobes of an interface of facets."""
    yield 1.0, tree.unchecked(_Mirroring, distribution=distribution, eta=eta)
    yield 1.0, tree.unchecked(_Refracting, distribution=distribution, eta=eta)


def refuse_equal_media(kind: str, eta: Any) -> None:
    """Raises ParameterError where the two media of a rough interface are one."""
    if isinstance(eta, (float, np.ndarray)) and (np.abs(np.asarray(eta) - 1.0) < NEAREST).any():
        rule = f"no index between {1.0 - NEAREST:g} and {1.0 + NEAREST:g}: facets between equal media refract nothing"
        raise ParameterError(f"{kind}(eta={shown(eta)}): expected {rule}, and f has no limit there; leave it out")


def transmittance(c: Any, ct: Any, eta: Any) -> Any:
    """1 - F of an interface, of the cosines in front and behind that belong together: exact where it is small."""
    s, p = c + eta * ct, eta * c + ct
    return 2.0 * eta * c * ct * (1.0 / (s * s) + 1.0 / (p * p))


def refraction(c: Any, ct: Any, eta: Any) -> Mueller:
    """What refraction does to s and p, over its transmittance: t_s ~ 1/(c + eta c_t), t_p ~ 1/(eta c + c_t)."""
    return diattenuator(eta * c + ct, c + eta * ct)


def smooth_refraction(wo: Direction, eta: Any) -> Mueller:
    """`refraction` of a flat interface, of light that leaves along wo; as at the normal where it reflects all light."""
    square = ((eta - 1.0) * (eta + 1.0) + wo.z * wo.z) / (eta * eta)
    return refraction(wo.z, ops.sqrt(ops.where(square > 0.0, square, 1.0)), eta)


class _Interface(Facets):
    """What both lobes share."""

    distribution = part(Distribution, GGX(0.2), "distribution of the facets' normals")
    eta = param(1.5, 0.2, 5.0, "refractive index behind the surface over that in front")
    masking = "separable"

    @property
    def facets(self) -> Distribution:
        return self.distribution

    @property
    def fresnel(self) -> Any:
        return tree.unchecked(Dielectric, eta=self.eta)

    @property
    def index(self) -> Any:
        return self.eta

    @abstractmethod
    def _chance(self, wi: Direction, wo: Direction) -> Any:
        """The share of the light at a facet."""


class _Mirroring(_Interface):
    """The light that facets reflect."""

    _split = True

    def _chance(self, wi: Direction, wo: Direction) -> Any:
        return self.fresnel.F(half_and_cosine(wi, wo)[1])

    def mirror(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z)

    def estimate(self, wo: Direction) -> Any:
        reflected = self.fresnel.F(wo.z)
        return reflected + (1.0 - reflected) / (self.eta * self.eta)


class _Refracting(_Interface):
    """The light that facets refract, from behind."""

    sides = "across"

    hints = NO_HINTS

    def turned(self, back: Any) -> Reflectance:
        return self._changed({"eta": choose(back, 1.0 / self.eta, self.eta)})

    def facet(self, wi: Direction, wo: Direction) -> tuple[Any, Direction, Any, Any, Any]:
        """Whether a facet refracts wi into wo; its normal, wo . wm, -wi . wm, and the square of n_i wi + n_o wo."""
        t = wi * self.eta + wo
        square = dot(t, t)
        thinner = 1.0 - self.eta
        up = thinner / (ops.absolute(thinner) * ops.sqrt(square))
        wm = t * up
        both = dot(wi, wo)
        c, ct = up * (self.eta * both + 1.0), -up * (self.eta + both)
        met = (c > 0.0) & (ct > 0.0) & (wm.z > 0.0)
        return met, select(met, wm, NORMAL), ops.where(met, c, 1.0), ops.where(met, ct, 1.0), square

    def formula(self, wi: Direction, wo: Direction) -> Any:
        met, wm, c, ct, square = self.facet(wi, wo)
        f = c * ct * transmittance(c, ct, self.eta) * self.facets.D(wm) * self.G(-wi, wo, wm) / (-wi.z * wo.z * square)
        return ops.where(met, f, 0.0)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        _, _, c, ct, _ = self.facet(wi, wo)
        return about_facet(refraction(c, ct, self.eta), wi, wo, across=True) * self.formula(wi, wo)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        return smooth_refraction(wo, self.eta) * self.mirror(wo)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        wm = self.facets.warp_normal(wo, u0, u1)
        return refracted(wo, wm, self.eta)

    def density(self, wi: Direction, wo: Direction) -> Any:
        met, wm, c, ct, square = self.facet(wi, wo)
        density = self.facets.normal_density(wo, wm, c) * self.eta * self.eta * ct / square
        return ops.where(met, density, 0.0)

    def _chance(self, wi: Direction, wo: Direction) -> Any:
        met, _, c, ct, _ = self.facet(wi, wo)
        return ops.where(met, transmittance(c, ct, self.eta), 0.0)

    def mirror(self, wo: Direction) -> Any:
        return (1.0 - self.fresnel.F(wo.z)) / (self.eta * self.eta)

    def mirrored(self, wo: Direction) -> Direction:
        return refracted(wo, NORMAL, self.eta)

    def estimate(self, wo: Direction) -> Any:
        return self.mirror(wo)


def refracted(wo: Direction, wm: Direction, eta: Any) -> Direction:
    """The direction, behind a facet wm, of the light that it refracts into wo; the normal, where there is none."""
    c = dot(wo, wm)
    square = ((eta - 1.0) * (eta + 1.0) + c * c) / (eta * eta)
    through = square > 0.0
    ct = ops.sqrt(ops.where(through, square, 1.0))
    wi = wm * (c / eta - ct) - wo * (1.0 / eta)
    return select(through, wi, NORMAL)
