"""A clear dielectric coat over any reflectance: smooth, as varnish that has flowed, or rough."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..base.reradiation import along_normal
from ..base.results import NO_HINTS, Hints
from ..errors import ParameterError
from ..formula import tree
from ..formula.direction import HORIZON, NORMAL, Direction, select
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW
from ..formula.exchange import Entire
from ..formula.fields import option, param, part
from ..formula.fresnel.dielectric import Dielectric, dielectric_transmittance
from ..formula.mueller import Mueller, diattenuator, scaled_to
from ._wrapper import WrappedLobe, Wrapper
from .ideal_specular import IdealSpecular
from .lambertian import Lambertian
from .microfacet import ggx_mirrors

ETA_HIGH, TAU_HIGH = 3.0, 50.0


def _panel(n: int, power: float, falling: bool = False) -> list[tuple[float, float]]:
    """Gauss–Legendre nodes and weights on [0, 1], crowded at 0 (or 1, if `falling`) by a power."""
    t, w = np.polynomial.legendre.leggauss(n)
    t, w = 0.5 * (t + 1.0), 0.5 * w
    nodes, weights = t**power, w * t ** (power - 1.0)
    weights = weights / weights.sum()
    return list(zip((1.0 - nodes if falling else nodes).tolist(), weights.tolist(), strict=True))


class _Coat(Wrapper, costs=8):
    """The light reflected by the coat, and the base as it is seen through it."""

    wraps = "base"

    base = part(Reflectance, Lambertian(0.5), "reflectance under the coat")
    eta = param(1.5, 1.0, ETA_HIGH, "refractive index of the coat over that in front of it")
    tau = param(0.0, 0.0, TAU_HIGH, "optical depth of the coat, straight through once")
    internal = option("followed", "lost", doc="fate of light that the coat reflects back to the base")

    @abstractmethod
    def below(self) -> type[_Below]:
        """Class of the lobes of the base."""

    @abstractmethod
    def surface(self) -> Reflectance:
        """The coat by itself, without absorption."""

    @abstractmethod
    def T(self, w: Direction) -> Any:
        """Share of light from w that enters the coat, as of light inside that leaves along w."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        (_, surface), *below = self.lobes()
        total = surface.formula(wi, wo)
        for _, lobe in below:
            total = total + lobe.formula(wi, wo)
        return total

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        (_, surface), *below = self.lobes()
        total = surface.polarized(wi, wo)
        for _, lobe in below:
            total = total + lobe.polarized(wi, wo)
        return total

    @property
    def polarizes(self) -> bool:
        return True

    def reradiated(self, light: Any, wi: Direction, wo: Direction) -> Any:
        """Light refracts, and is absorbed, with the numbers of the wavelength that it has on its way in, and out."""
        ti, to = refracted(wi, light.eta), refracted(wo, self.eta)
        into, out = light.T(wi) * ops.exp(-light.tau / ti.z), self.T(wo) * ops.exp(-self.tau / to.z)
        return into * self.sent(light, ti, to) * out / (self.eta * self.eta)

    def sent(self, light: Any, ti: Direction, to: Direction) -> Any:
        """What the base re-radiates under the coat."""
        return self.base.reradiated(light.base, ti, to)

    @abstractmethod
    def over_dye(self) -> type[_OverDye]:
        """Class of this coat over a dye that it sends light back to."""

    def _with_rounds(self, matrix: Callable[[str, Any], Any], prefix: str = "") -> Any:
        if self.internal == "lost" or not self.base._glows_evenly:
            return super()._with_rounds(matrix, prefix)
        coat = {name: self.__dict__[name] for name in self.fields}
        return tree.unchecked(self.over_dye(), **coat, rounds=matrix(prefix, self))

    def to_and_fro(self, channels: int) -> Any:
        """What leaves the base at a wavelength o of light that arrives there first at i, (..., C, C), but for the light
        that was never re-radiated: [D (1 - R D)^-1]_oi - [o = i] rho_i/(1 - rho_i R_i), D the base's matrix."""
        sent = math.pi * along_normal(self.base, channels)
        albedo = self.base.diffuse()
        rho = 0.0 if albedo is None else ops.minimum(albedo, 1.0)
        coat = {name: self.__dict__[name] for name in self.fields}
        R = tree.unchecked(self.below(), **(coat | {"weight": 1.0, "rho": rho})).R()
        like = next((x for x in (sent, rho, R) if ops.library(x).name != "numpy"), np.ones(1))
        lib = ops.library(like)
        sent, rho, R = (x if ops.library(x) is lib else lib.convert(np.asarray(x, float), like) for x in (sent, rho, R))
        one, flat, pairs = (lib.convert(x, like) for x in (np.eye(channels), np.ones(channels), np.ones(channels**2)))
        sent, rho, R = sent * pairs, (rho * flat)[..., None], (R * flat)[..., None]
        D = sent.reshape(*sent.shape[:-1], channels, channels) + rho * one
        more = D @ lib.module.linalg.inv(one - R * D) - rho / (1.0 - rho * R) * one
        known = lib.known(more)
        if known is not None and not (known >= -1e-9).all():
            raise ParameterError(
                f"{type(self).__name__}: its base, {self.base!r:.60}, sends back more light than arrives, so that what "
                f"goes to and fro under the coat grows without end; expected no more photons than arrive: "
                f"gn.photon_albedo(base, wi)"
            )
        return more

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        yield 1.0, self.surface()
        albedo = self.base.diffuse()
        rho = 0.0 if albedo is None else ops.minimum(albedo, 1.0)
        coat = {name: self.__dict__[name] for name in self.below().fields if name in self.fields}
        for weight, lobe in self.base.lobes():
            yield 1.0, tree.unchecked(self.below(), **(coat | {"base": lobe, "weight": weight, "rho": rho}))


class Coated(_Coat):
    """A smooth clear coat over a base: a mirror of the coat's Fresnel reflectance F, and the base through the coat,

    f = (1 - F_i)(1 - F_o)/eta^2 exp(-tau (1/cos(theta_i') + 1/cos(theta_o'))) (f_base(wi', wo') + f_more),

    wi', wo' refracted by Snell's law. Beams widen on their way out: radiance shrinks by eta^2.
    internal = "followed" adds the light that the coat sends back to the base. Of Lambertian lobes, of albedo rho
    together, f_more = rho/pi rho R/(1 - rho R), where R is the share of diffuse light that the coat reflects inside,
    absorption included; a mirror k below becomes k/(1 - k F). Both are exact for these bases alone. Other lobes count
    as mirrors, with k their estimated albedo and F the smaller of F_i and F_o: so energy is conserved over any base,
    and almost all light is there again over narrow lobes. Wide ones lose the light that the coat reflects totally: over
    perfect mirrors of GGX(0.1) 93 % returns at normal incidence and 71 % at 60 degrees, of GGX(0.3) 61 % and 49 %; of
    a base that is nearly diffuse without being `Lambertian`, R = 0.6 of the reflected light is lost. "lost" leaves all
    of it out.

    Fluorescence of the base passes the coat with the eta and tau of its wavelength on either way. Of a base that glows
    alike in all directions, with the matrix D, all goes to and fro that the coat sends back, and excites again:
    F_oi = T_o [D (1 - R D)^-1]_oi T_i / (pi eta_o^2). What glows otherwise, as a glossy base, passes the coat once.

    Looks    `Coated(Lambertian([0.6, 0.1, 0.05]))` is varnished red: a mirror image of the surroundings over a deeper
             colour; with `tau=[0.1, 0.4, 1.5]` the varnish is amber.
    Shapes   eta, tau: numbers or (..., C); eta may differ by channel (dispersion), sampling takes the mean.
    Units    f: 1/sr; tau: 1, the coat's absorption coefficient times its thickness.
    Error    rounding; R: below 1e-6, by a quadrature with 24 nodes. White Lambertian base, tau = 0: the albedo is 1
             within 1e-6.
    Source   Weidlich & Wilkie 2007, "Arbitrarily layered micro-facet surfaces" (layers, absorption along slanted
             paths; without eta^2); Elias, Simonot & Menu 2001, "Bidirectional reflectance of a diffuse background
             covered by a partly absorbing layer"; R: Saunderson 1942, J. Opt. Soc. Am. 32(12):727. Derived here.

    Example
    >>> varnished = gn.Coated(gn.Lambertian([0.6, 0.1, 0.05]), eta=1.5)
    >>> print(varnished.f_angles(0.3, 0.0, 0.8, 1.0).round(4))
    [0.1204 0.0137 0.0066]
    >>> print(varnished.delta_reflectance([0, 0, 1]).round(4))
    [0.04 0.04 0.04]
    """

    def below(self) -> type[_Below]:
        return _BelowSmooth

    def over_dye(self) -> type[_OverDye]:
        return _SmoothOverDye

    def surface(self) -> Reflectance:
        return tree.unchecked(IdealSpecular, reflectance=tree.unchecked(Dielectric, eta=self.eta))

    def T(self, w: Direction) -> Any:
        return dielectric_transmittance(w.z, self.eta)


class RoughCoated(_Coat):
    """A rough clear coat over a base: GGX facets of the coat, and the base through it as in `Coated`.

    A coat's reflectance F, where light passes, is now the mean over the facets seen, F(wo . wm) with their density;
    this much is reflected, or lost to facets behind (as in `Microfacet`). Refraction is that of the flat surface: the
    base is tinted and dimmed as under the rough coat, but not blurred, and a mirror below stays a mirror.

    Looks    `RoughCoated(Lambertian([0.05, 0.3, 0.1]), alpha=0.4)` is green satin paint with a wide, soft
             highlight; `alpha=0.05` makes it plastic with a sharp one.
    Shapes   alpha, eta, tau: numbers or (..., C).
    Units    f: 1/sr; alpha, tau: 1.
    Error    F: 8e-3. White Lambertian base, tau = 0: the albedo is 1 less the facets' loss, 0.9995 at normal
             incidence and 0.95 at 80 degrees for alpha = 0.1, 0.98 and 0.96 for 0.4.
    Source   as `Coated`; facets: Walter et al. 2007, EGSR; those seen: Heitz 2014, JCGT 3(2). F is derived here.

    Example
    >>> satin = gn.RoughCoated(gn.Lambertian([0.6, 0.1, 0.05]), alpha=0.2)
    >>> print(satin.f_angles(0.5, 0.0, 0.5, [0.0, np.pi]).round(3))
    [[0.122 0.016 0.009]
     [0.226 0.12  0.113]]
    """

    alpha = param(0.1, ALPHA_LOW, ALPHA_HIGH, "slope scale of the coat", sampled="max")

    caps, turns = _panel(3, 1.5, True), [(math.cos(math.pi * u), w) for u, w in _panel(3, 1.35, True)]

    def below(self) -> type[_Below]:
        return _BelowRough

    def over_dye(self) -> type[_OverDye]:
        return _RoughOverDye

    def surface(self) -> Reflectance:
        return ggx_mirrors(self.alpha, tree.unchecked(Dielectric, eta=self.eta))

    def T(self, w: Direction) -> Any:
        # Facets seen from w, with their density: a cap of directions about s, w as a facet of slope scale 1 sees it.
        # These nodes err by at most 8e-3, and never let more pass than the facets do not reflect, plus 2e-5 (eta from
        # 1.02 to 3, all alpha).
        across2 = self.alpha * self.alpha * (w.x * w.x + w.y * w.y)
        length = ops.sqrt(w.z * w.z + across2)
        sx, sz = ops.sqrt(across2 + 1e-20) / length, w.z / length
        total = 0.0
        for u, weight in self.caps:
            v = u * (1.0 + sz)
            z, r2 = 1.0 - v, v * (2.0 - v)
            r = ops.sqrt(r2)
            for turn, share in self.turns:
                along = sx * r * turn
                hz = sz + z
                h2 = self.alpha * self.alpha * (sx * sx + 2.0 * along + r2) + hz * hz
                cos = length * (1.0 + along + sz * z) / ops.sqrt(h2)
                total = total + weight * share * dielectric_transmittance(ops.minimum(cos, 1.0), self.eta)
        return total


def refracted(w: Direction, eta: Any) -> Direction:
    """The direction w inside a coat of index eta, by Snell's law."""
    return Direction(w.x / eta, w.y / eta, ops.sqrt((eta - 1.0) * (eta + 1.0) + w.z * w.z) / eta)


def passage(w: Direction, eta: Any) -> Mueller:
    """What the flat surface of a coat does to polarized light on its way in or out, over its transmittance."""
    ct = refracted(w, eta).z
    return diattenuator(eta * w.z + ct, w.z + eta * ct)  # t_s ~ 1/(c + eta c_t), t_p ~ 1/(eta c + c_t)


class _Below(WrappedLobe, _Coat):
    """A lobe of the base through the coat."""

    weight = param(1.0, 0.0, 1e9, "factor of the lobe")
    rho = param(0.0, 0.0, 1.0, "albedo of all Lambertian lobes of the base")

    total_nodes = nodes = _panel(12, 2.0)

    def R(self) -> Any:
        """Share of diffuse light from the base that the coat reflects, absorption both ways included."""
        # 2 mu' dmu' is integrated up to the critical angle, and beyond it over mu outside: mu' dmu' = mu dmu/eta^2.
        beyond = (self.eta - 1.0) * (self.eta + 1.0) / (self.eta * self.eta)
        edge, total = ops.sqrt(beyond + 1e-12), 0.0
        for mu, weight in self.total_nodes:
            total = total + 2.0 * mu * weight * beyond * ops.exp(-2.0 * self.tau / (edge * mu))
        for mu, weight in self.nodes:
            w = Direction(math.sqrt(1.0 - mu * mu) + 0.0 * self.eta, 0.0, mu)
            passed = ops.exp(-2.0 * self.tau / refracted(w, self.eta).z)
            total = total + 2.0 * mu * weight / (self.eta * self.eta) * (1.0 - self.T(w)) * passed
        return total

    def formula(self, wi: Direction, wo: Direction) -> Any:
        ti, to = refracted(wi, self.eta), refracted(wo, self.eta)
        f, albedo = self.base.formula(ti, to), self.base.diffuse()
        if albedo is None:
            k = self.weight * ops.minimum(self.base.estimate(ti), self.base.estimate(to))
            return self._passed(wi, wo, ti, to, k) / (self.eta * self.eta) * self.weight * f
        if self.internal == "followed":
            again = self.rho * self.R()
            f = f + albedo * again / (1.0 - again) * (1.0 / math.pi)
        return self._passed(wi, wo, ti, to, None) / (self.eta * self.eta) * self.weight * f

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        M = self.base.polarized(refracted(wi, self.eta), refracted(wo, self.eta))
        return self._through(M, wi, wo, self.formula(wi, wo))

    def polarized_mirror(self, wo: Direction) -> Mueller:
        to = refracted(wo, self.eta)
        wi = self._emerging(self.base.mirrored(to))
        wi = select(wi.z > HORIZON, wi, NORMAL)
        return self._through(self.base.polarized_mirror(to), wi, wo, self.mirror(wo))

    def _through(self, M: Mueller, wi: Direction, wo: Direction, f: Any) -> Mueller:
        """A Mueller matrix of the base between two passages, as bright as f: in s and p refraction turns nothing."""
        return scaled_to(passage(wo, self.eta) @ M @ passage(wi, self.eta), f)

    def _passed(self, wi: Direction, wo: Direction, ti: Direction, to: Direction, k: Any) -> Any:
        """T_i T_o with absorption, over 1 - k F where light goes to and fro between the coat and a mirror k."""
        (a, b), absorbed = (self.T(wi), self.T(wo)), ops.exp(-self.tau * (1.0 / ti.z + 1.0 / to.z))
        if self.internal == "lost" or k is None:
            return a * b * absorbed
        # With the smaller F no more leaves than arrives, whatever the base: (1 - F_o)/(1 - min(F_i, F_o)) <= 1.
        again = ops.clip(k, 0.0, 1.0) * absorbed
        return a * b * absorbed / ((1.0 - again) + again * ops.maximum(a, b))

    @property
    def hints(self) -> Hints:
        return NO_HINTS if self._wide() else super().hints

    def mirrored(self, wo: Direction) -> Direction:
        return self._emerging(self.base.mirrored(refracted(wo, self.eta)))

    def mirror(self, wo: Direction) -> Any:
        to = refracted(wo, self.eta)
        ti = self.base.mirrored(to)
        wi = self._emerging(ti)
        out = wi.z > HORIZON
        wi, ti = select(out, wi, NORMAL), select(out, ti, NORMAL)
        k = self.weight * self.base.mirror(to)
        return ops.where(out, k * self._passed(wi, wo, ti, to, k), 0.0)

    # Wide lobes are sampled outside the coat: of light that is diffuse inside more than half does not get out.

    def _wide(self) -> bool:
        return self.base.diffuse() is not None or type(self.base).warp is Reflectance.warp

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        if self._wide():
            return super().warp(wo, u0, u1)
        return self._emerging(self.base.warp(refracted(wo, self.eta), u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        if self._wide():
            return super().density(wi, wo)
        ti = refracted(wi, self.eta)
        return self.base.density(ti, refracted(wo, self.eta)) * wi.z / (self.eta * self.eta * ti.z)

    def _emerging(self, t: Direction) -> Direction:
        """The inverse of `refracted`; totally reflected light ends below the horizon."""
        x, y = self.eta * t.x, self.eta * t.y
        z2 = 1.0 - x * x - y * y
        out = (z2 > 0.0) & (t.z > 0.0)
        w = Direction(x, y, ops.sqrt(ops.where(out, z2, 1.0)))
        return select(out, w, Direction(t.x, t.y, -ops.absolute(t.z)))

    def estimate(self, wo: Direction) -> Any:
        to = refracted(wo, self.eta)
        inside = self.weight * self.base.estimate(to) * ops.exp(-2.0 * self.tau / to.z)
        eta2 = self.eta * self.eta
        leaving = 1.0 / (eta2 - self.rho * (eta2 - 1.0)) if self._wide() else 1.0  # R is about 1 - 1/eta^2
        return self.T(wo) * inside * leaving


class _BelowSmooth(_Below, Coated):
    """A lobe under the smooth coat."""


class _BelowRough(_Below, RoughCoated):
    """A lobe under the rough coat."""

    nodes = _panel(5, 2.0)


class _OverDye(_Coat):
    """A coat over a base that fluoresces alike in all directions, with what goes to and fro between them."""

    rounds: Any = Entire(0.0, "light of one band that leaves the base in another, however often it was there")

    def sent(self, light: Any, ti: Direction, to: Direction) -> Any:
        return self.rounds * (1.0 / math.pi)


class _SmoothOverDye(_OverDye, Coated):
    """A smooth coat."""


class _RoughOverDye(_OverDye, RoughCoated):
    """A rough coat."""
