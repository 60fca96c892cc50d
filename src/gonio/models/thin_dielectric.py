"""Thin dielectric: a pane, whose two faces light bounces between."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import param, part
from ..formula.fresnel_term import Fresnel
from ..formula.mueller import Mueller
from ..formula.special import expm1_over
from .ideal_specular import IdealSpecular


class ThinDielectric(Reflectance):
    """A pane of glass or a film too thick to interfere: a mirror R, and light that goes on straight, T.

    R = F + (1 - F)^2 F a^2/(1 - F^2 a^2),  T = (1 - F)^2 a/(1 - F^2 a^2),  a = exp(-depth/cos_t)

    F is the reflectance of one face, a what passes the pane once, at the angle theta_t inside; light that bounces
    between the faces is followed to the end. Light that one face polarizes meets the other polarized: the series are
    those of s and of p, each with its own F, and R and T their means. `delta_mueller` has both, and the series of
    U + iV, with r_s r_p in place of F. It looks the same from both sides.

    Looks    `ThinDielectric(1.5)` is a window; `ThinDielectric(1.5, [0.6, 0.2, 0.5])` a green bottle's thin wall.
    Shapes   eta, depth: numbers or (..., C).
    Units    1; depth: the absorption coefficient times the thickness.
    Error    rounding. Mitsuba's `thindielectric`, and a `Stack` of two interfaces, take the series of the mean F, as if
             each bounce met unpolarized light. So R is up to 0.022 (8 %) too high for eta = 1.5, at 74 degrees, and
             0.077 for 2.4.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 1.5.2 for F; the geometric series is summed here, as in
             Stokes 1862, Proc. R. Soc. 11:545 ("pile of plates").

    Example
    >>> window = gn.ThinDielectric(1.5)
    >>> print(gn.albedo(window, [0, 0, 1]).round(4), gn.transmittance(window, [0, 0, 1]).round(4))
    0.0769 0.9231
    >>> through = window.delta_mueller(gn.direction(np.arctan(1.5), 0.0), across=True)  # at Brewster's angle
    >>> print(through[:2, :2].round(4))  # all of p passes
    [[ 0.8711 -0.1289]
     [-0.1289  0.8711]]
    """

    sides = "both"
    eta = param(1.5, 1.0, 5.0, "refractive index of the pane over that of its surroundings")
    depth = param(0.0, 0.0, 50.0, "absorption coefficient times thickness")

    def turned(self, back: Any) -> Reflectance:
        return self

    def formula(self, wi: Direction, wo: Direction) -> Any:
        raise self._lacks("formula")

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        yield (
            1.0,
            tree.unchecked(IdealSpecular, reflectance=tree.unchecked(_PaneReflectance, eta=self.eta, depth=self.depth)),
        )
        yield (
            1.0,
            tree.unchecked(_StraightLight, passed=tree.unchecked(_PaneTransmittance, eta=self.eta, depth=self.depth)),
        )


class _Pane(Fresnel):
    """A pane of index `eta`, which light passes once with exp(-depth/cos_t)."""

    eta = param(1.5, 1.0, 5.0, "refractive index of the pane over that of its surroundings")
    depth = param(0.0, 0.0, 50.0, "absorption coefficient times thickness")

    def bounces(self, cos_theta: Any) -> tuple[tuple[Any, ...], tuple[Any, ...], Any]:
        """Of s, of p and of both: the product of two amplitudes that one face reflects, and the sum over all bounces of
        what passes both faces; and what the pane lets pass once."""
        c = cos_theta
        ct = ops.sqrt((self.eta - 1.0) * (self.eta + 1.0) + c * c) / self.eta
        s, p = 1.0 / (c + self.eta * ct), 1.0 / (self.eta * c + ct)
        r_s, r_p = (c - self.eta * ct) * s, (self.eta * c - ct) * p
        T_s, T_p = (4.0 * self.eta * c * ct * x * x for x in (s, p))
        path = self.depth / ct
        a, missed = ops.exp(-path), 2.0 * path * expm1_over(-2.0 * path)  # 1 - a^2

        def twice(T: Any, other: Any) -> Any:
            lost = T + other - T * other  # 1 - (r r')^2, for r^2 = 1 - T
            return T * other / (lost + (1.0 - lost) * missed)

        return (r_s * r_s, r_p * r_p, r_s * r_p), (twice(T_s, T_s), twice(T_p, T_p), twice(T_s, T_p)), a

    @abstractmethod
    def shares(self, cos_theta: Any) -> tuple[Any, ...]:
        """What leaves of s, of p, and of U and V."""

    def F(self, cos_theta: Any) -> Any:
        s, p, _ = self.shares(cos_theta)
        return 0.5 * (s + p)

    def polarized(self, cos_theta: Any) -> Mueller:
        s, p, both = self.shares(cos_theta)
        a, b = 0.5 * (s + p), 0.5 * (s - p)
        return Mueller(((a, b, 0.0, 0.0), (b, a, 0.0, 0.0), (0.0, 0.0, both, 0.0), (0.0, 0.0, 0.0, both)))

    @property
    def polarizes(self) -> bool:
        return True


class _PaneReflectance(_Pane):
    """R of the pane."""

    def shares(self, cos_theta: Any) -> tuple[Any, ...]:
        F, passed, a = self.bounces(cos_theta)
        return tuple(f + t * f * a * a for f, t in zip(F, passed, strict=True))


class _PaneTransmittance(_Pane):
    """T of the pane."""

    def shares(self, cos_theta: Any) -> tuple[Any, ...]:
        _, passed, a = self.bounces(cos_theta)
        return tuple(t * a for t in passed)


class _StraightLight(Reflectance):
    """The light that goes on straight."""

    sides = "across"
    is_delta = True
    passed = part(Fresnel, None, "share of the light that passes")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.0 * self.passed.F(wo.z)

    def mirror(self, wo: Direction) -> Any:
        return self.passed.F(wo.z)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        mueller = self.passed.polarized(wo.z)
        assert mueller is not None
        return mueller

    @property
    def polarizes(self) -> bool:
        return True

    def estimate(self, wo: Direction) -> Any:
        return self.passed.F(wo.z)
