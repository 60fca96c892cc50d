"""Hanrahan–Krueger: light that particles of a layer scatter once, under a smooth surface or without one."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, dot
from ..formula.fields import param
from ..formula.fresnel.dielectric import dielectric_transmittance
from ..formula.special import expm1_over


def scattered_once(depth: Any, albedo: Any, g: Any, wi: Direction, wo: Direction) -> Any:
    """f of a slab of particles, of what is scattered once: w p(wi, wo)/(mu_i + mu_o) (1 - exp(-tau (1/mu_i + 1/mu_o))),

    p = (1 - g^2)/(4 pi (1 + g^2 + 2 g wi.wo)^(3/2)): wi.wo is the cosine of light that turns back.
    """
    path = depth * (1.0 / wi.z + 1.0 / wo.z)
    return albedo * phase(g, wi, wo) * depth / (wi.z * wo.z) * expm1_over(-path)


def passed_once(depth: Any, albedo: Any, g: Any, wi: Direction, wo: Direction) -> Any:
    """The same lit from behind: w p(wi, wo) (exp(-tau/mu_i) - exp(-tau/mu_o))/(mu_i - mu_o), with mu_i = -wi.z."""
    a, b = -1.0 / wi.z, 1.0 / wo.z
    less, more = ops.minimum(a, b), ops.absolute(a - b)
    return albedo * phase(g, wi, wo) * depth * a * b * ops.exp(-depth * less) * expm1_over(-depth * more)


def phase(g: Any, wi: Direction, wo: Direction) -> Any:
    """Henyey & Greenstein's function; both directions point away from the particle."""
    # 1 + g^2 + 2 g wi.wo, by sums that keep their digits where it is small: at the peak
    less, more, along, apart = 1.0 - g, 1.0 + g, wi + wo, wi - wo
    d = ops.where(g > 0.0, less * less + g * dot(along, along), more * more - g * dot(apart, apart))
    return less * more / (4.0 * math.pi * d * ops.sqrt(d))


class HanrahanKrueger(Reflectance):
    """Single scattering in a layer under a smooth surface: f = T_i T_o/eta^2 w p(wi'.wo')/(mu_i' + mu_o') (1 - e),

    e = exp(-tau (1/mu_i' + 1/mu_o')). Directions wi', wo' in the layer are refracted by Snell's law, T_i and T_o are
    the shares that Fresnel lets through, p Henyey & Greenstein's (1 - g^2)/(4 pi (1 + g^2 + 2 g wi'.wo')^(3/2)).
    eta = 1 is a layer without a surface. What the surface reflects, what is scattered more than once, and what lies
    below are left out: `Stack` has them all.

    Looks    `HanrahanKrueger(1.0, -0.5, eta=1.0)` is chalky, brightest seen with the light; `g=0.8` is bright where the
             light is behind it; `eta=1.4` darkens the rim, as of a leaf or of skin.
    Shapes   w, g, tau, eta: numbers or (..., C).
    Units    f: 1/sr; w, g, tau, eta: 1.
    Error    rounding.
    Source   Hanrahan & Krueger 1993, "Reflection from layered surfaces due to subsurface scattering", SIGGRAPH; p:
             Henyey & Greenstein 1941. Radiance in the layer is eta^2 times that outside.

    Example
    >>> skin = gn.HanrahanKrueger([0.9, 0.6, 0.5], g=0.8, tau=1.0, eta=1.4)
    >>> print(skin.f_angles(1.2, 0.0, 1.2, [0.0, np.pi]).round(4))
    [[0.0011 0.0007 0.0006]
     [0.0025 0.0017 0.0014]]
    """

    w = param(0.5, 0.0, 1.0, "single-scattering albedo: the share of light that a particle scatters")
    g = param(0.3, -0.9, 0.9, "mean cosine of the scattering angle")
    tau = param(1e4, 0.0, 1e4, "optical depth of the layer, straight through once")
    eta = param(1.4, 1.0, 3.0, "refractive index of the layer over that in front of it")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        ti, to = _refracted(wi, self.eta), _refracted(wo, self.eta)
        passed = dielectric_transmittance(wi.z, self.eta) * dielectric_transmittance(wo.z, self.eta)
        return passed / (self.eta * self.eta) * scattered_once(self.tau, self.w, self.g, ti, to)


def _refracted(w: Direction, eta: Any) -> Direction:
    """The direction w inside the layer, by Snell's law."""
    return Direction(w.x / eta, w.y / eta, ops.sqrt((eta - 1.0) * (eta + 1.0) + w.z * w.z) / eta)
