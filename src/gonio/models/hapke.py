"""Hapke's model of planetary regolith: particles, the opposition surge, and macroscopic roughness."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, dot, length, select
from ..formula.fields import option, param
from ..formula.special import expm1_over


class Hapke(Reflectance):
    """Regolith: r = w/(4 pi) mu_0e/(mu_0e + mu_e) ((1 + B(g)) P(g) + H(mu_0e) H(mu_e) - 1) S, and f = r/cos(theta_i).

    g is the phase angle, 0 for back-scatter. Particles: P = (1 + c)/2 (1 - b^2)/(1 - 2 b cos(g) + b^2)^(3/2) +
    (1 - c)/2 (1 - b^2)/(1 + 2 b cos(g) + b^2)^(3/2), a lobe backward and one forward; c = 1 or -1 leaves one
    Henyey–Greenstein function. Opposition surge by shadows: B = B0/(1 + tan(g/2)/h). Roughness: the effective cosines
    mu_0e, mu_e and the shadowing S of facets whose mean slope angle is theta_bar, for theta_i < theta_o and
    theta_i > theta_o. H as in 1981, (1 + 2 x)/(1 + 2 gamma x), or of 2002, better for w near 1.
    r is the bidirectional reflectance, radiance over the irradiance of a plane perpendicular to the beam. I/F (the
    radiance factor) = pi r = pi f cos(theta_i); the reflectance factor (REFF, BRF) = pi f.

    Looks    `Hapke()` is a dark, rough soil, flat as the full moon; `Hapke(0.9, 0.3, 0.2, theta_bar=0)` is bright
             smooth dust.
    Shapes   w, b, c, B0, h, theta_bar: numbers or (..., C).
    Units    f: 1/sr; theta_bar: rad; the others: 1.
    Error    rounding. White isotropic particles (w = 1, b = 0, no surge, smooth) should reflect 1: they reflect up to
             1.04 with the H of 1981, 1.014 with that of 2002.
    Source   Hapke 1981, J. Geophys. Res. 86(B4):3039; roughness: Hapke 1984, Icarus 59:41; surge: Hapke 1986, Icarus
             67:264; H: Hapke 2002, Icarus 157:523; the phase function as in Hapke 2012, Theory of Reflectance and
             Emittance Spectroscopy, 2nd ed. Equations as in three independent descriptions. c here = 2 c - 1 of
             McGuire & Hapke 1995. No coherent backscatter, no porosity.

    Example
    >>> soil = gn.Hapke(w=0.3, b=0.3, c=0.2, B0=1.0, h=0.06, theta_bar=0.35)
    >>> print((np.pi * soil.f_angles(0.5, 0.0, [0.5, 0.6, 0.8], 0.0)).round(4))
    [0.1599 0.1285 0.1101]
    """

    w = param(0.3, 0.0, 1.0, "single-scattering albedo of the particles")
    b = param(0.3, 0.0, 0.9, "width of the lobes of the phase function: 0 is isotropic")
    c = param(0.2, -1.0, 1.0, "share of the lobes: 1 is all backward, -1 all forward")
    B0 = param(1.0, 0.0, 3.0, "height of the opposition surge; above 1 is beyond shadows")
    h = param(0.06, 1e-3, 1.0, "angular half width of the opposition surge")
    theta_bar = param(0.35, 0.0, 1.0, "mean slope angle of the macroscopic roughness", unit="rad")
    multiple_scattering = option("1981", "2002", doc="which approximation of Chandrasekhar's H function")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "the multiple scattering is that of isotropic particles, and the surge adds light: w = 1, b = 0.5, "
        "c = 1, B0 = 1, h = 1, theta_bar = 0 reflects 1.46 times the light that arrives along the normal",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        mu_i, mu_o, shadowing = self._rough(wi, wo)
        gamma = self._gamma()
        hi, ho = self._H_minus_1(mu_i, gamma), self._H_minus_1(mu_o, gamma)
        surge, phase = self._towards(wi, wo)
        scattered = (1.0 + surge) * phase + (hi + ho + hi * ho)
        return self.w * (0.25 / math.pi) * scattered * shadowing / (mu_i + mu_o)

    def estimate(self, wo: Direction) -> Any:
        return self.w / ops.square(1.0 + self._gamma()) + 0.0 * wo.z

    # Particles.

    def _gamma(self) -> Any:
        absorbing = self.w < 1.0  # at 1 the square root has no derivative
        return ops.where(absorbing, ops.sqrt(ops.where(absorbing, 1.0 - self.w, 1.0)), 0.0)

    def _H_minus_1(self, x: Any, gamma: Any) -> Any:
        """H - 1, for w may be small and H H - 1 cancels."""
        if self.multiple_scattering == "1981":
            return 2.0 * x * self.w / ((1.0 + gamma) * (1.0 + 2.0 * gamma * x))
        r0 = self.w / ops.square(1.0 + gamma)  # (1 - gamma)/(1 + gamma)
        loss = self.w * x * (r0 + (0.5 - r0 * x) * ops.log((1.0 + x) / x))
        return loss / (1.0 - loss)

    def _towards(self, wi: Direction, wo: Direction) -> tuple[Any, Any]:
        """B(g) and P(g). 2 - 2 cos(g) = |wi - wo|^2, 2 + 2 cos(g) = |wi + wo|^2, tan(g/2) their ratio's root."""
        apart, total = wi - wo, wi + wo
        surge = self.B0 / (1.0 + length(apart) / (length(total) * self.h))
        narrow = ops.square(1.0 - self.b)
        back, forward = narrow + self.b * dot(apart, apart), narrow + self.b * dot(total, total)
        lobes = (1.0 + self.c) / (back * ops.sqrt(back)) + (1.0 - self.c) / (forward * ops.sqrt(forward))
        return surge, 0.5 * (1.0 - self.b) * (1.0 + self.b) * lobes

    # Macroscopic roughness. With "near" for the direction closer to the zenith and "far" for the other, Hapke's two
    # cases are one; S mu_0e/cos(theta_i) is symmetric in them, so that the correction is reciprocal.

    def _rough(self, wi: Direction, wo: Direction) -> tuple[Any, Any, Any]:
        """Both effective cosines, and S mu_0e/cos(theta_i)."""
        swap = wi.z < wo.z
        near, far = select(swap, wo, wi), select(swap, wi, wo)
        slope = ops.tan(self.theta_bar)
        chi = 1.0 / ops.sqrt(1.0 + math.pi * slope * slope)
        rise_n, rise_f = (slope * ops.sqrt(a.x * a.x + a.y * a.y + 1e-30) for a in (near, far))
        (not_1n, not_2n), (not_1f, not_2f) = _one_minus_E(rise_n / near.z), _one_minus_E(rise_f / far.z)
        tan_half, cos2_half, sin2_half, straight = _relative_azimuth(near, far)
        # The parts of Hapke's equations, without cancellation at grazing, where all E are near 1.
        rest = not_1f + not_1n + straight * (1.0 - not_1n)  # 2 - E1f - (psi/pi) E1n
        hidden = not_2n - not_2f  # E2f - E2n
        mu_n = near.z + rise_n * (cos2_half * (1.0 - not_2f) - sin2_half * hidden) / rest
        mu_f = far.z + rise_f * (hidden + cos2_half * (1.0 - not_2n)) / rest
        eta_n = near.z + rise_n * (1.0 - not_2n) / (1.0 + not_1n)
        eta_f = far.z + rise_f * (1.0 - not_2f) / (1.0 + not_1f)
        x = 2.0 * tan_half  # exp(-x): the share of shadows that are not seen
        lit = x * expm1_over(-x) + ops.exp(-x) * near.z / eta_n
        return chi * mu_n, chi * mu_f, chi * (mu_n / eta_n) * (mu_f / eta_f) / lit


def _one_minus_E(y: Any) -> tuple[Any, Any]:
    """1 - E1 and 1 - E2, E1 = exp(-2/(pi y)), E2 = exp(-1/(pi y^2)), y = tan(theta_bar) tan(theta)."""
    x = 1.0 / ops.maximum(y, 0.01)  # there E1 is 2e-28
    a, b = (2.0 / math.pi) * x, (1.0 / math.pi) * x * x
    return a * expm1_over(-a), b * expm1_over(-b)


def _relative_azimuth(a: Direction, b: Direction) -> tuple[Any, Any, Any, Any]:
    """tan(psi/2) up to 40, cos^2(psi/2), sin^2(psi/2), 1 - psi/pi of the relative azimuth psi in [0, pi]."""
    along, across = a.x * b.x + a.y * b.y, ops.absolute(a.x * b.y - a.y * b.x)
    product2 = along * along + across * across
    upright = product2 < 1e-30
    product = ops.sqrt(ops.where(upright, 1.0, product2))
    t = across / (product + ops.absolute(along))  # tan(psi/2), or its reciprocal where psi > pi/2
    small, large, angle = t * t / (1.0 + t * t), 1.0 / (1.0 + t * t), (2.0 / math.pi) * ops.arctan2(t, 1.0 + 0.0 * t)
    back = along >= 0.0
    return (
        ops.where(back, t, 1.0 / ops.maximum(t, 0.025)),
        ops.where(back, large, small),
        ops.where(back, small, large),
        ops.where(back, 1.0 - angle, angle),
    )
