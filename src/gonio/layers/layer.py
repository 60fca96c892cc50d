"""The layers that a stack is made of: interfaces and media."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ..arrays import ops
from ..declared.arguments import checked
from ..errors import ParameterError, shown
from ..formula.fields import option, param
from ..formula.parametrised import Parametrised


class Layer(Parametrised):
    """Base of what `gonio.Stack` is made of: see `Interface`, `RoughInterface`, `Medium`.

    Source   Jakob, d'Eon, Jakob & Marschner 2014, "A comprehensive framework for rendering layered materials", ACM TOG
             33(4):118: layers by their matrices of reflection and transmission.

    Example
    >>> print([kind.__name__ for kind in gn.Interface.__base__.__subclasses__()])
    ['Interface', 'RoughInterface', 'Medium']
    """

    _noun: ClassVar[str] = "a layer"


class Interface(Layer):
    """A smooth interface between two media: Fresnel's reflectance, and Snell's refraction of the rest.

    Shapes   eta: a number or (C,).
    Units    1.
    Error    rounding.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 1.5.2.

    Example
    >>> varnished = gn.Stack([gn.Interface(1.5)], gn.Lambertian(0.5))
    >>> print(varnished.delta_reflectance([0, 0, 1]).round(4))
    0.04
    """

    eta = param(1.5, 0.3, 3.5, "refractive index below the interface over that above it")


class RoughInterface(Layer):
    """A rough interface between two media: GGX facets that reflect and refract, each by Fresnel and Snell.

    Facets lose the light that they scatter more than once. further = "kept" gives it back as a lobe to both sides,
    l(wi) l(wo) over the mean of l, where l(w) is what they lose of light from w: nothing is absorbed. "lost" does not.

    Shapes   eta, alpha: numbers or (C,).
    Units    1.
    Error    see `Stack`.
    Source   Walter, Marschner, Li & Torrance 2007, "Microfacet models for refraction through rough surfaces", EGSR,
             with Smith's masking G = G_1(wi) G_1(wo); the lobe as that of Kulla & Conty 2017, over the whole sphere.

    Example
    >>> ground = gn.Stack([gn.RoughInterface(1.5, alpha=0.3)], gn.Lambertian(1.0))
    >>> print(gn.albedo(ground, gn.direction([0.0, 1.2], 0.0)).round(3))
    [1. 1.]
    """

    eta = param(1.5, 0.3, 3.5, "refractive index below the interface over that above it; not within 0.01 of 1")
    alpha = param(0.2, 0.03, 1.0, "slope scale of the facets; below, an Interface")
    further = option("kept", "lost", doc="fate of light that facets scatter more than once")

    def validate(self) -> None:
        eta = ops.library(self.eta).known(self.eta) if ops.dtype_of(self.eta) else self.eta
        if eta is not None and np.min(np.abs(np.asarray(eta) - 1.0)) < 0.01:
            rule = "facets between equal media refract nothing, and f grows without bound"
            raise ParameterError(f"RoughInterface(eta={self.eta!r}): {rule}; expected eta at least 0.01 from 1")


class Medium(Layer):
    """A slab of particles that absorb and scatter, with the index of the medium above it.

    Particles scatter by Henyey & Greenstein's phase function, (1 - g^2)/(4 pi (1 + g^2 - 2 g cos)^(3/2)), cos that of
    the angle between the ways before and after.

    Shapes   depth, albedo, g: numbers or (C,).
    Units    1; depth = (absorption + scattering coefficient) times thickness.
    Error    see `Stack`.
    Source   Henyey & Greenstein 1941, Astrophysical Journal 93:70.

    Example
    >>> snow = gn.Stack([gn.Medium(1e4, albedo=1.0, g=0.8)])
    >>> print(gn.albedo(snow, [0, 0, 1]).round(2))
    1.0
    """

    depth = param(1.0, 0.0, 1e6, "optical depth, straight through once")
    albedo = param(0.9, 0.0, 1.0, "share of light that a particle scatters")
    g = param(0.0, -0.95, 0.95, "mean cosine of the scattering angle")

    @classmethod
    @checked
    def kubelka_munk(cls, K: Any, S: Any) -> Medium:
        """The medium of Kubelka & Munk's coefficients K and S of diffuse light, both times the thickness: of absorption
        K/2, and of isotropic scattering 4 S/3.

        So a thick layer that hardly absorbs has their albedo, 1 - sqrt(2 K/S), and one that does not absorb their
        transmission, 1/(1 + S). Their two fluxes are these media with a single cosine, 1/2.

        Shapes   K, S: numbers or (C,).
        Units    1: coefficients times thickness.
        Error    of the albedo for diffuse light, beside 1 + K/S - sqrt((K/S)^2 + 2 K/S): 5e-4 at K/S = 0.01, 4e-3 at
                 0.1, 9e-3 at 1.
        Source   Kubelka & Munk 1931, Z. tech. Physik 12:593; both limits: van de Hulst 1980, Multiple Light Scattering.

        Example
        >>> print(gn.Medium.kubelka_munk(K=2.0, S=3.0))
        Medium(depth=5.0, albedo=0.8, g=0.0)
        """
        absorbed, scattered = 0.5 * np.asarray(K, float), 4.0 / 3.0 * np.asarray(S, float)
        depth = absorbed + scattered
        if not (
            np.isfinite(depth).all() and (absorbed >= 0.0).all() and (scattered >= 0.0).all() and (depth > 0.0).all()
        ):
            rule = "expected two numbers that are not negative, and not both 0"
            raise ParameterError(f"Medium.kubelka_munk(K={shown(K)}, S={shown(S)}): {rule}")
        return cls(depth[()], (scattered / depth)[()])


AnyLayer = Interface | RoughInterface | Medium
"""A layer of any kind."""
