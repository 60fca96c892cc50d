"""The interface of distributions of facet normals: D, Lambda, sampling. Each is a file of distributions/.

Every model with facets is D F G / (4 cos cos): F of fresnel/, G of maskings/. `alpha` is the slope scale.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any, ClassVar, NamedTuple

from ..arrays import ops
from .direction import Direction, azimuth, normalize, on_circle
from .parametrised import Parametrised

ALPHA_LOW, ALPHA_HIGH = 1e-3, 1.0


class Spread(NamedTuple):
    """How the slopes of facets spread: the scales along x and y, and the slope, in units of these, that none exceeds.

    "None": no more than 1 of 1e16, which no integral in double precision sees.

    Example
    >>> print(gn.GGX(0.1).slope_spread)
    Spread(alpha_x=0.1, alpha_y=0.1, reach=inf)
    """

    alpha_x: Any
    alpha_y: Any
    reach: float = math.inf


class Distribution(Parametrised):
    """Base of the distributions of facet normals, normalized to one: integral of D(wm) cos(theta_m) dwm = 1.

    Example
    >>> facets = gn.distributions()["GGX"](0.3)
    >>> print(facets, isinstance(facets, gn.GGX))
    GGX(alpha_x=0.3) True
    """

    _noun: ClassVar[str] = "a distribution of facet normals"
    _reflects: ClassVar[str] = "gn.Microfacet({})"
    _known_elsewhere: ClassVar[dict[str, str]] = dict.fromkeys(
        ("__call__", "f", "pdf", "sample", "eval"), "gn.Microfacet(distribution), which has f, pdf and sample"
    )

    @property
    def slope_spread(self) -> Spread | None:
        """How slopes spread, where D and Lambda are smooth functions of them; None for other distributions.

        Example
        >>> print(gn.Beckmann(0.1, 0.4).slope_spread, gn.BlinnFacets(40.0).slope_spread)
        Spread(alpha_x=0.1, alpha_y=0.4, reach=7.0) None
        """
        return None

    @abstractmethod
    def D(self, wm: Direction) -> Any:
        """Area of facets per solid angle of their normals and per area of the surface [1/sr]."""
        raise self._lacks("D")

    def Lambda(self, w: Direction) -> Any:
        """Smith's auxiliary function of this distribution: G1 = 1/(1 + Lambda)."""
        raise self._lacks("Lambda")

    def projected_area(self, w: Direction) -> Any:
        """Area of the facets that face w, as w sees it, hidden ones included, per area of the surface: the integral of
        D max(w . wm, 0) over all wm. It is cos(theta)/G1 = (1 + Lambda) cos(theta)."""
        return (1.0 + self.Lambda(w)) * w.z

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        """A facet normal for two uniform numbers; its density is `normal_density`."""
        raise self._lacks("warp_normal")

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        """Density [1/sr] of `warp_normal`: of the normals visible from wo, D_v = G1 D cos_d/cos(theta_o).

        Where these cannot be drawn in closed form it is a density close to D cos(theta_m) times `facing_density`.
        `cos_d`: wo . wm, as `half_and_cosine` has it.
        """
        return self.D(wm) * cos_d / self.projected_area(wo)


def stretched(w: Direction, ax: Any, ay: Any) -> Direction:
    """w as seen by a surface of slope scale 1: slopes along x divided by ax, along y by ay.

    Example
    >>> from gonio.authoring import Direction, stretched
    >>> print(stretched(Direction(0.5, 0.0, 0.75), 0.25, 0.25))
    Direction(x=0.125, y=0.0, z=0.75)
    """
    return Direction(ax * w.x, ay * w.y, w.z)


def from_slopes(r: Any, u: Any, ax: Any = 1.0, ay: Any = 1.0) -> Direction:
    """The normal of a facet whose slope is r, in units of ax and ay, in the direction 2 pi u.

    Example
    >>> from gonio.authoring import from_slopes
    >>> wm = from_slopes(1.0, 0.0, 0.3, 0.3)
    >>> print((wm.x / wm.z).round(4))
    0.3
    """
    return normalize(stretched(on_circle(r, u, 1.0 + 0.0 * r), ax, ay))


# Normals opposite to each other, wm and its image in the axis of the surface, are as frequent in distributions that
# look the same from all sides, or do so stretched. Drawn among both in the proportion in which wo sees them, normals
# that face away are never drawn, whatever the density of their tilt.


def facing(wo: Direction, radius: Any, u: Any, z: Any) -> Direction:
    """A normal (unnormalized) at this height, this far from the z axis, that faces wo.

    Its azimuth psi from that of wo has the density d/(pi (d + d')), d = max(1 + e cos(psi), 0), d' that of the opposite
    normal, e = tan(theta_m) tan(theta_o). At normal incidence it is uniform.
    Error    1e-9 in u (median 1e-16) in float64, 2e-7 in float32. Source: derived here.

    Example
    >>> from gonio.authoring import Direction
    >>> from gonio.formula.distribution import facing
    >>> print(facing(Direction(0.6, 0.0, 0.8), 0.5, np.array([0.25, 0.5]), 0.5).x.round(4))
    [0.1774 0.5   ]
    """
    s = ops.sqrt(wo.x * wo.x + wo.y * wo.y + 1e-24)
    v = 2.0 * u - 1.0
    psi = _facing_azimuth(radius * s / (ops.maximum(z, 1e-6) * wo.z), ops.absolute(v))
    across, (cos_phi, sin_phi) = ops.where(v < 0.0, -psi, psi), azimuth(wo, s)
    cos_psi, sin_psi = ops.turn(across * (0.5 / math.pi))
    return Direction(
        radius * (cos_phi * cos_psi - sin_phi * sin_psi), radius * (sin_phi * cos_psi + cos_phi * sin_psi), z
    )


def facing_slopes(wo: Direction, r: Any, u: Any, ax: Any = 1.0, ay: Any = 1.0) -> Direction:
    """The normal of a facet that faces wo, whose slope is r in units of ax and ay: `from_slopes` with such an azimuth.

    Example
    >>> from gonio.authoring import Direction
    >>> from gonio.formula.distribution import facing_slopes
    >>> wm = facing_slopes(Direction(0.6, 0.0, 0.8), 1.0, np.array(0.5), 0.3, 0.3)
    >>> print((wm.x / wm.z).round(4))
    0.3
    """
    return normalize(stretched(facing(stretched(wo, ax, ay), r, u, 1.0 + 0.0 * r), ax, ay))


def facing_density(wo: Direction, wm: Direction, cos_d: Any) -> Any:
    """The density of `facing` over that of normals at any azimuth: 2 d/(d + d').

    Example
    >>> from gonio.authoring import Direction
    >>> from gonio.formula.distribution import facing_density
    >>> print(facing_density(Direction(0.6, 0.0, 0.8), Direction(0.0, 0.0, 1.0), np.array(0.8)))
    1.0
    """
    return ops.minimum(cos_d / (wo.z * wm.z), 2.0)


def _facing_azimuth(e: Any, share: Any) -> Any:
    """The psi in [0, pi] of which `share` is below, of the density 2 d/(pi (d + d')).

    In eta, from the end where d vanishes, the rest is eta - c sin(eta) + s (1 - cos(eta)), c = min(e, 1), s^2 = e^2 - 1
    or 0: Kepler's equation for e <= 1. Where d' = 0, up to where eta = 2 arctan(1/s), it is linear.
    """
    steep = e > 1.0
    c, s = ops.minimum(e, 1.0), ops.where(steep, ops.sqrt(ops.where(steep, (e - 1.0) * (e + 1.0), 1.0)), 0.0)
    half = ops.arctan2(1.0 + 0.0 * s, s)
    rest = ops.maximum(math.pi * (1.0 - share), 1e-12)
    x = ops.minimum(rest / (2.0 * half), 1.0)
    root = ops.sqrt(x)
    b = 1.0 - c + (c - s * half) * root * ops.sqrt(ops.sqrt(root))  # right at both ends, and for e = 0
    eta = ops.stop_gradient(4.0 * half * x / (b + ops.sqrt(b * b + 4.0 * s * half * x)))
    for _ in range(2):  # Halley's steps
        cos, sin = ops.turn(eta * (0.25 / math.pi))
        bend = 2.0 * sin * (c * cos - s * sin)
        over, slope = eta - bend - 2.0 * half * x, 1.0 - c + 2.0 * sin * (c * sin + s * cos)
        square = slope * slope
        eta = eta - over * slope / ops.maximum(square - 0.5 * over * (s + bend), 0.25 * square)
    linear = rest > 2.0 * half
    return ops.where(linear, 0.5 * (math.pi - rest), 0.5 * math.pi + half - eta)
