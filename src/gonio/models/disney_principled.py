"""Disney's principled model of 2012: eleven sliders for most materials."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..distributions.ggx import GGX
from ..formula import tree
from ..formula.direction import Direction, dot, half_and_cosine, half_vector, reflect
from ..formula.distribution import facing, facing_density
from ..formula.fields import option, param
from ..formula.special import expm1_over, less_fifth_power
from ._facets import Facets


class _Disney(Reflectance, oriented=True):
    """The parameters of the model and of each of its lobes."""

    base_color = param(0.5, 0.0, 1.0, "colour of the surface, linear")
    metallic = param(0.0, 0.0, 1.0, "blends from a dielectric (0) to a metal (1)")
    subsurface = param(0.0, 0.0, 1.0, "blends from the diffuse lobe to that of light scattered below the surface")
    specular = param(0.5, 0.0, 1.0, "reflectance at normal incidence, over 0.08")
    roughness = param(0.5, 0.0, 1.0, "alpha = roughness^2; of the diffuse lobe too", sampled="max")
    specular_tint = param(0.0, 0.0, 1.0, "how far the reflection of a dielectric takes the tint")
    anisotropic = param(0.0, 0.0, 1.0, "alpha_x/alpha_y from 1 to 10")
    sheen = param(0.0, 0.0, 1.0, "a gain towards grazing, for cloth")
    sheen_tint = param(0.5, 0.0, 1.0, "how far the sheen takes the tint")
    clearcoat = param(0.0, 0.0, 1.0, "strength of a second reflection, over 1/4")
    clearcoat_gloss = param(1.0, 0.0, 1.0, "alpha of that from 0.1 to 0.001", sampled="min")
    tint = param(1.0, 0.0, 10.0, "base_color over its luminance; `DisneyPrincipled.from_rgb` works it out")
    masking = option("remapped", "anisotropic", doc="G of the notes of 2012, or of later versions")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "its lobes are added with no regard to each other, and the diffuse one alone gains towards grazing: "
        "with base_color = 1 and roughness = 1 the albedo is 1.44 at 85 degrees, with sheen and clearcoat 1.57",
    }


class DisneyPrincipled(_Disney):
    """Burley's principled model: a diffuse lobe with retro-reflection and sheen, GGX facets, and a clearcoat.

    f = (1 - metallic) (base_color/pi mix(f_d, f_ss, subsurface) + sheen c_sheen F_H)
        + D_s mix(c_0, 1, F_H) G_s + clearcoat/4 D_r mix(0.04, 1, F_H) G_r,  F_H = (1 - wm . wi)^5

    f_d = (1 + (F_D90 - 1)(1 - cos theta_i)^5)(the same of theta_o), F_D90 = 1/2 + 2 cos(theta_d)^2 roughness. D_s is
    GGX with alpha = roughness^2, D_r GTR1 with alpha from 0.1 to 0.001. masking "remapped": Smith's, separable, with
    alpha = (1/2 + roughness/2)^2, as first published; "anisotropic": with the facets' own, as in disney.brdf since.

    A formula sees one channel, the tints need all: `tint` is base_color over its luminance 0.3 R + 0.6 G + 0.1 B. It
    is 1 for gray; `DisneyPrincipled.from_rgb(base_color, ...)` works it out.

    Looks    `DisneyPrincipled([0.8, 0.2, 0.1])` is red plastic; `metallic=1, roughness=0.2` makes it a tinted metal;
             `sheen=1, roughness=1` a cloth with a pale rim.
    Shapes   all but `masking`: numbers or (..., C).
    Units    f: 1/sr; all others: 1.
    Error    rounding.
    Source   Burley 2012, "Physically based shading at Disney", sections 5.3 to 5.6 and their addenda, and the authors'
             disney.brdf. Sampling derived here.

    Example
    >>> plastic = gn.DisneyPrincipled([0.8, 0.2, 0.1], roughness=0.4)
    >>> metal = plastic.replace(metallic=1.0)
    >>> for m in (plastic, metal):
    ...     print(gn.albedo(m, gn.direction(0.5, 0.0)).round(3))
    ...
    [0.836 0.237 0.137]
    [0.728 0.182 0.091]
    """

    @classmethod
    def from_rgb(cls, base_color: Any, **others: Any) -> Self:
        """The material of a colour (..., 3), linear RGB, and its tint.

        Example
        >>> m = gn.DisneyPrincipled.from_rgb([0.8, 0.2, 0.1], sheen=1.0)
        >>> print(m.tint.round(3))
        [2.162 0.541 0.27 ]
        """
        rgb = np.asarray(base_color, dtype=float)
        luminance = (rgb * [0.3, 0.6, 0.1]).sum(-1, keepdims=True)
        tint = np.where(luminance > 0.0, rgb / np.where(luminance > 0.0, luminance, 1.0), 1.0)
        return cls(base_color=base_color, tint=np.minimum(tint, 10.0), **others)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        matte, mirrors, coat = (lobe.formula(wi, wo) for _, lobe in self.lobes())
        return matte + mirrors + coat

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        values = {name: self.__dict__[name] for name in self.fields}
        return [(1.0, tree.unchecked(lobe, **values)) for lobe in (_Matte, _DisneyFacets, _Clearcoat)]


class _Matte(_Disney):
    """Diffuse or subsurface lobe, and sheen, drawn from the cosine hemisphere: nothing of a metal."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        cos_d, grazing = _difference(wi, wo)
        bright = cos_d * cos_d * self.roughness
        gi, go = less_fifth_power(wi.z), less_fifth_power(wo.z)
        edge = 0.5 + 2.0 * bright  # F_D90
        diffuse = (gi + edge * (1.0 - gi)) * (go + edge * (1.0 - go))
        below = (gi + bright * (1.0 - gi)) * (go + bright * (1.0 - go))
        below = 1.25 * (below * (1.0 / (wi.z + wo.z) - 0.5) + 0.5)
        base = self.base_color * (1.0 / math.pi) * (diffuse + self.subsurface * (below - diffuse))
        return (1.0 - self.metallic) * (base + self.sheen * _toward(self.tint, self.sheen_tint) * grazing)

    def estimate(self, wo: Direction) -> Any:
        return (1.0 - self.metallic) * (self.base_color + 0.3 * self.sheen)


class _DisneyFacets(_Disney, Facets):
    """GGX facets; the masking has the factor 1/(4 cos cos) in it."""

    polarized, polarizes = Reflectance.polarized, False  # its Fresnel term has no amplitudes

    smooth_maskings: ClassVar[tuple[str, ...]] = ("remapped", "anisotropic")

    def F0(self) -> Any:
        """Reflectance of a facet at normal incidence."""
        dielectric = 0.08 * self.specular * _toward(self.tint, self.specular_tint)
        return dielectric + self.metallic * (self.base_color - dielectric)

    @property
    def facets(self) -> GGX:
        """GTR2, which is GGX."""
        alpha, aspect = self.roughness * self.roughness, ops.sqrt(1.0 - 0.9 * self.anisotropic)
        return tree.unchecked(GGX, alpha_x=ops.maximum(alpha / aspect, 1e-3), alpha_y=ops.maximum(alpha * aspect, 1e-3))

    def formula(self, wi: Direction, wo: Direction) -> Any:
        _, grazing = _difference(wi, wo)
        if self.masking == "anisotropic":
            facets = self.facets
            G = 0.25 / (facets.projected_area(wi) * facets.projected_area(wo))
        else:
            rough = 0.5 + 0.5 * self.roughness
            G = _visible(wi, rough * rough) * _visible(wo, rough * rough)
        F0 = self.F0()
        return self.facets.D(half_vector(wi, wo)) * (F0 + (1.0 - F0) * grazing) * G

    def estimate(self, wo: Direction) -> Any:
        return self.F0() + (1.0 - self.F0()) * _fifth(1.0 - wo.z)


class _Clearcoat(_Disney):
    """The clearcoat, of index 1.5: GTR1 facets, drawn with density D cos(theta_m), of two opposite ones as seen."""

    def gloss(self) -> Any:
        """alpha of the clearcoat."""
        return 0.1 + self.clearcoat_gloss * (0.001 - 0.1)

    def D(self, wm: Direction) -> Any:
        """GTR1: tails longer than those of GGX."""
        a2 = self.gloss() * self.gloss()
        t = a2 * wm.z * wm.z + wm.x * wm.x + wm.y * wm.y
        return (a2 - 1.0) / (math.pi * ops.log(a2) * t)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        _, grazing = _difference(wi, wo)
        F, G = 0.04 + 0.96 * grazing, _visible(wi, 0.25) * _visible(wo, 0.25)
        return 0.25 * self.clearcoat * self.D(half_vector(wi, wo)) * F * G

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        a2 = self.gloss() * self.gloss()
        x = -u1 * ops.log(a2)
        sin2 = ops.clip(a2 * x * expm1_over(x) / (1.0 - a2), 1e-24, 1.0)
        return reflect(wo, facing(wo, ops.sqrt(sin2), u0, ops.sqrt(ops.maximum(1.0 - sin2, 0.0))))

    def density(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        return self.D(wm) * wm.z * facing_density(wo, wm, cos_d) / (4.0 * cos_d)

    def estimate(self, wo: Direction) -> Any:
        return 0.25 * self.clearcoat * (0.04 + 0.96 * _fifth(1.0 - wo.z))


def _difference(wi: Direction, wo: Direction) -> tuple[Any, Any]:
    """cos(theta_d), and (1 - cos(theta_d))^5 without cancellation."""
    total = wi + wo
    cos_d = ops.minimum(0.5 * ops.sqrt(dot(total, total)), 1.0)
    d = wi - wo
    return cos_d, _fifth(0.25 * dot(d, d) / (1.0 + cos_d))


def _fifth(x: Any) -> Any:
    x2 = x * x
    return x2 * x2 * x


def _toward(tint: Any, share: Any) -> Any:
    """From white to the tint."""
    return 1.0 + share * (tint - 1.0)


def _visible(w: Direction, alpha: Any) -> Any:
    """Smith's masking of GGX over 2 cos: 1/(cos + sqrt(cos^2 + alpha^2 sin^2))."""
    return 1.0 / (w.z + ops.sqrt(w.z * w.z + alpha * alpha * (w.x * w.x + w.y * w.y)))
