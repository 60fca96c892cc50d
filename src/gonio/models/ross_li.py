"""Ross–Li: the sum of kernels that satellites' BRDF and albedo products are made of, and the kernels themselves."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

from ..arrays import ops
from ..formula.direction import Direction, dot, length
from ..formula.fields import option, param
from ._power_cosine import PowerCosine

HOT_SPOT_WIDTH = math.radians(1.5)
"""Half width xi_0 [rad] of the hot spot in `ross_thick_hotspot`, as fitted to POLDER's measurements."""


def phase_angle(wi: Direction, wo: Direction) -> Any:
    """Angle between two directions [rad] in [0, pi], without cancellation where it is small; 0 is back-scatter."""
    return 2.0 * ops.arctan2(length(wi - wo), length(wi + wo))


def scattering_by_leaves(xi: Any) -> Any:
    """(pi/2 - xi) cos(xi) + sin(xi): single scattering by leaves of all orientations, at phase angle xi [rad]."""
    return (0.5 * math.pi - xi) * ops.cos(xi) + ops.sin(xi)


def ross_thick(wi: Direction, wo: Direction) -> Any:
    """K = ((pi/2 - xi) cos(xi) + sin(xi)) / (cos(theta_i) + cos(theta_o)) - pi/4: a dense layer of leaves."""
    return scattering_by_leaves(phase_angle(wi, wo)) / (wi.z + wo.z) - 0.25 * math.pi


def ross_thin(wi: Direction, wo: Direction) -> Any:
    """K = ((pi/2 - xi) cos(xi) + sin(xi)) / (cos(theta_i) cos(theta_o)) - pi/2: few leaves."""
    return scattering_by_leaves(phase_angle(wi, wo)) / (wi.z * wo.z) - 0.5 * math.pi


def ross_thick_hotspot(wi: Direction, wo: Direction) -> Any:
    """K = 4/(3 pi) (K_ross_thick + pi/4) (1 + 1/(1 + xi/xi_0)) - 1/3, xi_0 = 1.5 degrees: with leaves' shadows.

    Normalized as in the paper: f_vol is 3 pi/4 = 2.36 times that of `ross_thick`. Source: Maignan et al. 2004.
    """
    xi = phase_angle(wi, wo)
    hot_spot = 1.0 + 1.0 / (1.0 + xi * (1.0 / HOT_SPOT_WIDTH))
    return (4.0 / (3.0 * math.pi)) * scattering_by_leaves(xi) * hot_spot / (wi.z + wo.z) - 1.0 / 3.0


def li_sparse_r(wi: Direction, wo: Direction, h_b: Any = 2.0, b_r: Any = 1.0) -> Any:
    """K = O - sec_i - sec_o + (1 + cos(xi)) sec_i sec_o/2, of the angles theta': crowns and their shadows, sparse."""
    _, excess = _crowns(wi, wo, h_b, b_r)
    return 0.5 * excess


def li_dense_r(wi: Direction, wo: Direction, h_b: Any = 2.0, b_r: Any = 2.5) -> Any:
    """K = (1 + cos(xi)) sec_i sec_o/(sec_i + sec_o - O) - 2, of the angles theta': crowns that hide the ground."""
    area, excess = _crowns(wi, wo, h_b, b_r)
    return excess / area


def _crowns(wi: Direction, wo: Direction, h_b: Any, b_r: Any) -> tuple[Any, Any]:
    """A = sec_i + sec_o - O and (1 + cos(xi)) sec_i sec_o - 2 A, of the angles with tan(theta') = b/r tan(theta)."""
    ti, to = _stretched_tangents(wi, b_r), _stretched_tangents(wo, b_r)
    sec_i, sec_o = ops.sqrt(dot(ti, ti)), ops.sqrt(dot(to, to))
    secants = sec_i + sec_o
    apart, across = ti - to, ti.x * to.y - ti.y * to.x  # D, and tan tan sin(phi)
    cos_t = h_b * ops.sqrt(dot(apart, apart) + across * across + 1e-36) / secants
    # O = sec_i + sec_o - A = (t - sin(t) cos(t)) secants/pi, and A = secants (1 + seen)/2. Shadows overlap where
    # cos(t) < 1; at 1 arcs have no derivative, but O has: 0.
    overlap = cos_t < 1.0
    c = ops.where(overlap, cos_t, 0.0)
    s = ops.sqrt(1.0 - c * c)
    seen = ops.where(overlap, (2.0 / math.pi) * (ops.arctan2(c, s) + c * s), 1.0)
    # (1 + cos(xi)) sec_i sec_o - secants, without cancellation towards the zenith, and towards grazing.
    low = (ti.x * to.x + ti.y * to.y) + _secant_minus_1(ti, sec_i) * _secant_minus_1(to, sec_o)
    total = Direction(ti.x / sec_i + to.x / sec_o, ti.y / sec_i + to.y / sec_o, 1.0 / sec_i + 1.0 / sec_o)
    high = 0.5 * dot(total, total) * sec_i * sec_o - secants
    return 0.5 * secants * (1.0 + seen), ops.where(secants < 8.0, low, high) - secants * seen


def _secant_minus_1(t: Direction, secant: Any) -> Any:
    return (t.x * t.x + t.y * t.y) / (secant + 1.0)


def _stretched_tangents(w: Direction, b_r: Any) -> Direction:
    """The direction to theta' (b/r times the tangent), as a vector of height 1; its length is sec(theta')."""
    return Direction(b_r * w.x / w.z, b_r * w.y / w.z, 1.0 + 0.0 * w.z)


VOLUMETRIC: dict[str, Callable[..., Any]] = {k.__name__: k for k in (ross_thick, ross_thin, ross_thick_hotspot)}
GEOMETRIC: dict[str, Callable[..., Any]] = {k.__name__: k for k in (li_sparse_r, li_dense_r)}
WHITE_SKY = {
    "ross_thick": 0.19,
    "ross_thin": 3.14,
    "ross_thick_hotspot": 0.10,
    "li_sparse_r": -1.38,
    "li_dense_r": -0.29,
}
"""The kernels' means over all cos(theta) dw of light and viewer, for the papers' crowns."""


class RossLi(PowerCosine):
    """Kernel-driven surface of soil and plants: BRF = f_iso + f_vol K_vol + f_geo K_geo, and f = BRF/pi.

    K_vol (`ross_thick`, `ross_thin`, `ross_thick_hotspot`) is scattering by leaves, K_geo (`li_sparse_r`,
    `li_dense_r`) the shadows of spheroids h/b high with the ratio of axes b/r: functions of this module. In the papers
    relative azimuth 0 is back-scatter, as phi_o - phi_i = 0 is here. Weights of MODIS' and VIIRS' albedo products
    (MCD43A1, VNP43) are those of the defaults; the papers' Li-dense has h_b = 2, b_r = 2.5.
    A fit is one of the weights, as those of the products; `by` asks for h_b or b_r too.

    Looks    `RossLi(0.2, 0.1, 0.03)` is a field; `RossLi(0.2, 0, 0.05)` is sparse shrubs, brightest where no shadow is
             seen.
    Shapes   f_iso, f_vol, f_geo, h_b, b_r: numbers or (..., C).
    Units    f: 1/sr; the others: 1. With light and viewer at the zenith K is 0, of `ross_thick_hotspot` 1/3.
    Error    rounding. Sampling is uniform over the hemisphere, for kernels grow as 1/cos(theta).
    Source   Wanner, Li & Strahler 1995, J. Geophys. Res. 100(D10):21077; the reciprocal Li kernels and MODIS'
             defaults: Lucht, Schaaf & Strahler 2000, IEEE TGRS 38(2):977; hot spot: Maignan, Bréon & Lacaze 2004,
             Remote Sens. Environ. 90:210. Equations as in two independent descriptions of them.

    Example
    >>> field = gn.RossLi(f_iso=0.2, f_vol=0.1, f_geo=0.03)
    >>> print((np.pi * field.f_angles(0.7, 0.0, 0.7, [0.0, np.pi])).round(4))
    [0.2362 0.1393]
    >>> print(gn.remote_sensing.white_sky_albedo(field).round(4))
    0.1776
    """

    f_iso = param(0.2, 0.0, 2.0, "weight of the constant")
    f_vol = param(0.1, -2.0, 2.0, "weight of the volumetric kernel")
    f_geo = param(0.03, -2.0, 2.0, "weight of the geometric kernel")
    h_b = param(2.0, 0.1, 10.0, "height of the crowns' centres over their vertical half axis", fitted=False)
    b_r = param(1.0, 0.1, 10.0, "vertical over horizontal half axis of the crowns", fitted=False)
    volumetric = option("ross_thick", "ross_thin", "ross_thick_hotspot", doc="kernel of scattering by leaves")
    geometric = option("li_sparse_r", "li_dense_r", doc="kernel of crowns' shadows")

    breaks: ClassVar[dict[str, str]] = {
        "positivity": "a sum of signed kernels: with f_iso = 0.1, f_geo = 0.1 the BRF at 45 degrees in the forward "
        "direction is -0.08",
        "energy": "kernels grow without bound towards grazing, and their weights are free: f_iso = 0.5, f_vol = 2 "
        "reflects twice the light that arrives at 80 degrees",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        k_vol = VOLUMETRIC[self.volumetric](wi, wo)
        k_geo = GEOMETRIC[self.geometric](wi, wo, self.h_b, self.b_r)
        return (self.f_iso + self.f_vol * k_vol + self.f_geo * k_geo) * (1.0 / math.pi)

    def exponent(self, wo: Direction) -> Any:
        return 0.0

    def estimate(self, wo: Direction) -> Any:
        spread = ops.absolute(self.f_vol) + ops.absolute(self.f_geo)
        k_vol, k_geo = WHITE_SKY[self.volumetric], WHITE_SKY[self.geometric]
        white_sky = self.f_iso + k_vol * self.f_vol + k_geo * self.f_geo
        return ops.maximum(white_sky, 0.1 * (self.f_iso + spread)) + 0.0 * wo.z
