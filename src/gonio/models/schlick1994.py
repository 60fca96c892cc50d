"""Schlick's inexpensive model of 1994: from a mirror to a diffuse surface by one roughness factor."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..distributions.ggx import GGX
from ..formula import tree
from ..formula.direction import Direction, azimuth, dot, half_and_cosine, half_vector, normalize, on_circle, reflect
from ..formula.fields import param
from ..formula.fresnel.schlick import Schlick


class _Single(Reflectance):
    """A single material: spectral factor S(u) = C + (1 - C)(1 - u)^5, roughness r."""

    C = param(0.5, 0.0, 1.0, "reflection factor at normal incidence")
    r = param(0.2, 1e-6, 1.0, "roughness factor of the paper: 0 a mirror, 1 diffuse", sampled="max")

    def S(self, u: Any) -> Any:
        return tree.unchecked(Schlick, F0=self.C).F(u)


class Schlick1994(_Single, oriented=True):
    """Diffuse and directional part of Schlick's model: f = S(u) (a/pi + b B/(4 pi v v')), S = C + (1 - C)(1 - u)^5.

    B = G(v) G(v') Z(t) A(w) + 1 - G(v) G(v'),  Z = r/(1 + r t^2 - t^2)^2,  A = sqrt(p/(p^2 - p^2 w^2 + w^2)),
    G(v) = v/(r - r v + v),  b = 4 r (1 - r),  a = 1 - b for r > 1/2, else 0. u = cos(theta_d), v and v' the cosines of
    both directions, t that of the half vector, w the cosine of its azimuth to d_x. For r < 1/2 the rest c = 1 - b
    is mirrored: the whole model is `Schlick1994(C, r, p) + Schlick1994Specular(C, r)`.

    Looks    `Schlick1994(0.5, 0.2)` is a soft highlight, `Schlick1994(0.5, 0.5)` satin with a bright rim,
             `Schlick1994(0.5, 1)` matt; `p=0.1` brushes it.
    Shapes   C, r, p: numbers or (..., C).
    Units    f: 1/sr; the rest: 1. Z/pi is GGX with alpha = sqrt(r).
    Error    rounding. A is not normalized: its mean over all azimuths is 1 for p = 1, 0.74 for p = 0.1.
    Source   Schlick 1994, "An inexpensive BRDF model for physically-based rendering", single material. Sampling, as a
             sum of the two terms of B, derived here.

    Example
    >>> satin = gn.Schlick1994(0.5, r=0.5)
    >>> print(gn.albedo(satin, gn.direction([0.0, 1.4], 0.0)).round(3))
    [0.322 1.48 ]
    """

    p = param(1.0, 1e-2, 1.0, "isotropy factor: 1 isotropic, smaller ones spread the lobe along y")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "shadowed light leaves again as (1 - G(v) G(v'))/(4 pi v v'), whose albedo grows without bound "
        "towards grazing: for C = 1, r = 0.5 it is 1.03 at 60 degrees, 5.6 at 85, 286 at 89.9",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.colour(wi, wo) * (self.obstructed(wi, wo) + self.spread(wi, wo))

    def colour(self, wi: Direction, wo: Direction) -> Any:
        """S(cos(theta_d)).

        Example
        >>> from gonio.authoring import Direction
        >>> up = Direction(0.0, 0.0, 1.0)
        >>> print(gn.Schlick1994(0.5).colour(up, up))
        0.5
        """
        H = wi + wo
        return self.S(0.5 * ops.sqrt(dot(H, H)))

    def obstructed(self, wi: Direction, wo: Direction) -> Any:
        """b G(v) G(v') Z A/(4 pi v v'), with G(v)/v = 1/(q + v), q = r (1 - v).

        Example
        >>> from gonio.authoring import Direction
        >>> up = Direction(0.0, 0.0, 1.0)
        >>> print(round(float(gn.Schlick1994(0.5, r=0.5).obstructed(up, up)), 4))
        0.1592
        """
        h = half_vector(wi, wo)
        A = ops.sqrt(self.p) * ops.sqrt(1.0 / self.ellipse(h, self.p))
        return self.r * (1.0 - self.r) * self.facets().D(h) * A / (self._gap(wi) * self._gap(wo))

    def spread(self, wi: Direction, wo: Direction) -> Any:
        """a/pi + b (1 - G(v) G(v'))/(4 pi v v'), so written that 1 - G G' has no cancellation.

        Example
        >>> from gonio.authoring import Direction
        >>> up = Direction(0.0, 0.0, 1.0)
        >>> print(round(float(gn.Schlick1994(0.5, r=0.8).spread(up, up)), 4))
        0.1146
        """
        q, k = self.r * (1.0 - wi.z), self.r * (1.0 - wo.z)
        blocked = (q * k + (q * wo.z + k * wi.z)) / (wi.z * wo.z) / (self._gap(wi) * self._gap(wo))
        a, b = ops.square(ops.maximum(2.0 * self.r - 1.0, 0.0)), 4.0 * self.r * (1.0 - self.r)
        return (a + 0.25 * b * blocked) * (1.0 / math.pi)

    def _gap(self, w: Direction) -> Any:
        return self.r * (1.0 - w.z) + w.z

    def facets(self) -> GGX:
        """The distribution of half vectors without A: Z/pi.

        Example
        >>> print(gn.Schlick1994(0.5, r=0.25).facets().alpha_x)
        0.5
        """
        alpha = ops.sqrt(self.r)
        return tree.unchecked(GGX, alpha_x=alpha, alpha_y=alpha)

    def ellipse(self, h: Direction, p: Any) -> Any:
        """p^2 sin^2(phi) + cos^2(phi) of the azimuth of h.

        Example
        >>> from gonio.authoring import Direction
        >>> print(round(float(gn.Schlick1994(0.5, p=0.5).ellipse(Direction(0.0, 0.6, 0.8), 0.5)), 4))
        0.25
        """
        cos_phi, sin_phi = azimuth(h, ops.sqrt(h.x * h.x + h.y * h.y + 1e-24))
        return p * p * sin_phi * sin_phi + cos_phi * cos_phi

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        return [(1.0, tree.unchecked(lobe, C=self.C, r=self.r, p=self.p)) for lobe in (_Obstructed, _Spread)]


class _Obstructed(Schlick1994):
    """The facets' part, sampled by its half vector: t as t Z(t) has it, azimuths more evenly than A, to bound it."""

    lobes = Reflectance.lobes

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.colour(wi, wo) * self.obstructed(wi, wo)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        x, y = ops.turn(u0)
        x = ops.sqrt(self.p) * x
        slope = ops.sqrt(self.r * u1 / ops.maximum(1.0 - u1, 1e-30) + 1e-30) / ops.sqrt(x * x + y * y)
        return reflect(wo, normalize(Direction(slope * x, slope * y, 1.0 + 0.0 * slope)))

    def density(self, wi: Direction, wo: Direction) -> Any:
        h, cos_d = half_and_cosine(wi, wo)
        around = ops.sqrt(self.p) / self.ellipse(h, ops.sqrt(self.p))
        return self.facets().D(h) * h.z * around / (4.0 * cos_d)

    def estimate(self, wo: Direction) -> Any:
        return self.S(wo.z) * 4.0 * self.r * (1.0 - self.r) * ops.square(wo.z / self._gap(wo))


class _Spread(Schlick1994):
    """Diffuse and re-emitted light, sampled uniformly: so it stays bounded where light leaves at grazing angles."""

    lobes = Reflectance.lobes

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.colour(wi, wo) * self.spread(wi, wo)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        z = 1.0 - u1
        return on_circle(ops.sqrt(ops.maximum(1.0 - z * z, 0.0)), u0, z)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return 0.5 / math.pi + 0.0 * wi.z

    def estimate(self, wo: Direction) -> Any:
        return math.pi * self.S(wo.z) * self.spread(Direction(wo.x, wo.y, 0.5 + 0.0 * wo.z), wo)


class Schlick1994Specular(_Single):
    """The mirror in Schlick's model: reflectance c S(u), c = (1 - 2 r)^2 for r < 1/2 and 0 above, as in `Schlick1994`.

    Looks    `Schlick1994Specular(0.5, 0.01)` is a clear mirror, brighter at the rim; from r = 1/2 on nothing is
             mirrored.
    Shapes   C, r: numbers or (..., C).
    Units    1.
    Error    rounding.
    Source   Schlick 1994, "An inexpensive BRDF model for physically-based rendering", single material.

    Example
    >>> mirror = gn.Schlick1994Specular(0.5, r=0.01)
    >>> print(mirror.delta_reflectance(gn.direction([0.0, 1.4], 0.0)).round(3))
    [0.48  0.669]
    """

    is_delta = True

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.0 * self.S(wo.z)

    def mirror(self, wo: Direction) -> Any:
        return self.S(wo.z) * ops.square(ops.maximum(1.0 - 2.0 * self.r, 0.0))

    def estimate(self, wo: Direction) -> Any:
        return self.mirror(wo)
