"""Microfacet surfaces in pieces: what a distribution of normals is (D, Lambda, sampling), and the maskings (G).

Every model with facets is D F G / (4 cos cos) with these pieces. `alpha` is the slope scale of the surface. The
distributions are in distributions/, one file each. Where Smith's Lambda has no closed form it is integrated: `smith`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from . import ops
from .geometry import Direction, half_and_cosine, normalize
from .parametrised import Parametrised

ALPHA_LOW, ALPHA_HIGH = 1e-3, 1.0


class Distribution(Parametrised):
    """Base of the distributions of facet normals, normalised to one: integral of D(wm) cos(theta_m) dwm = 1."""

    def D(self, wm: Direction) -> Any:
        """Area of facets per solid angle of their normals and per area of the surface [1/sr]."""
        raise NotImplementedError

    def Lambda(self, w: Direction) -> Any:
        """Smith's auxiliary function of this distribution: G1 = 1/(1 + Lambda)."""
        raise NotImplementedError

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        """A facet normal for two uniform numbers; its density is `normal_density`."""
        raise NotImplementedError

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        """Density [1/sr] of `warp_normal`: of the normals visible from wo, D_v = G1 D cos_d/cos(theta_o).

        `cos_d`: wo . wm, as `half_and_cosine` has it.
        """
        return self.D(wm) * cos_d / ((1.0 + self.Lambda(wo)) * wo.z)


def stretched(w: Direction, ax: Any, ay: Any) -> Direction:
    """w as seen by a surface of slope scale 1: slopes along x divided by ax, along y by ay."""
    return Direction(ax * w.x, ay * w.y, w.z)


def from_slopes(r: Any, u: Any, ax: Any = 1.0, ay: Any = 1.0) -> Direction:
    """The normal of a facet whose slope is r, in units of ax and ay, in the direction 2 pi u."""
    phi = 2.0 * math.pi * u
    return normalize(Direction(ax * r * ops.cos(phi), ay * r * ops.sin(phi), 1.0 + 0.0 * r))


# Smith's Lambda of any distribution that looks the same from all sides, after stretching if need be. p(q) is the
# density of slopes at the squared slope q = tan^2(theta_m): D = p / cos^4(theta_m), integral of p over the plane = 1.

Nodes = Sequence[tuple[Any, Any]]
"""Slopes and their weights, for integrals over slopes from 0 on."""


def cotangent(w: Direction, ax: Any = 1.0, ay: Any = 1.0) -> Any:
    """cot(theta) of w as seen by a surface of slope scale 1; at most 1e5, beyond which Lambda < 1e-10."""
    sx, sy = ax * w.x, ay * w.y
    return ops.minimum(w.z / ops.sqrt(sx * sx + sy * sy + 1e-24), 1e5)


def smith(p: Callable[[Any], Any], a: Any, nodes: Nodes, spread: Any = 1.0) -> Any:
    """Lambda at cot(theta) = a of the slope density p, by nodes `spread` times as large as given.

    Lambda = (2/a) integral over y from 0 on of p(a^2 + y^2) (y - a arctan(y/a)) y dy, which is Smith's integral of the
    facets that turn away, over all slopes r = sqrt(a^2 + y^2) steeper than a, each averaged over its azimuths. In y
    nothing is singular at the end, and nodes depend on parameters only: kernels compute them once.
    Source: Smith 1967; Heitz 2014, JCGT 3(2), for isotropic slopes; this form is derived here.
    """
    total: Any = 0.0
    for node, weight in nodes:
        y = node * spread
        q = a * a + y * y
        t = y / (a + ops.sqrt(q))
        total = total + weight * y * y * p(q) * _turned_away(t * t)
    return 2.0 / a * spread * total


def smith_of_angles(p: Callable[[Any], Any], a: Any, angles: Nodes) -> Any:
    """The same by nodes in [0, pi/2]: the angle along the great circle of normals that w just grazes."""
    tangents = [(ops.tan(angle), weight) for angle, weight in angles]
    return smith(p, a, [(y, weight * (1.0 + y * y)) for y, weight in tangents], ops.sqrt(1.0 + a * a))


def _turned_away(z: Any) -> Any:
    """1 - (a/y) arctan(y/a), without cancellation, for z = tan^2(arctan(y/a)/2) in [0, 1]: relative 1e-9."""
    value: Any = 0.0
    for c in _TURNED_AWAY:
        value = value * z + c
    return value * z


_TURNED_AWAY = (  # Chebyshev approximation of (1 - (1 - z) arctan(sqrt(z))/sqrt(z))/z on [0, 1], highest power first
    0.00199390691001, -0.0132379240042, 0.0411740271882, -0.0822558567163, 0.12445997601, -0.162025402467,
    0.200875136179, -0.253832828135, 0.342848760643, -0.533333127649, 1.33333333249,
)  # fmt: skip


def sinh_nodes(count: int, width: Any, reach: Any) -> Nodes:
    """Gauss-Legendre nodes on [0, reach]: equally dense up to about `width`, then by ratio; denser still at 0."""
    end = reach / width
    span = ops.log(end + ops.sqrt(end * end + 1.0))
    nodes = []
    for t, weight in gauss(count):
        e = ops.exp(span * t**1.5)
        nodes.append((0.5 * width * (e - 1.0 / e), 0.75 * weight * t**0.5 * span * width * (e + 1.0 / e)))
    return nodes


def _rule(count: int) -> Sequence[tuple[float, float]]:
    t, w = np.polynomial.legendre.leggauss(count)
    return [(0.5 * (float(x) + 1.0), 0.5 * float(y)) for x, y in zip(t, w, strict=True)]


_RULES = {count: _rule(count) for count in (6, 16, 20, 22, 24, 32)}  # made once: compilers of formulas cannot


def gauss(count: int) -> Sequence[tuple[float, float]]:
    """Gauss-Legendre nodes and weights on [0, 1]."""
    return _RULES[count]


# Maskings: the fraction of facets wm that is both lit from wi and seen from wo.


def height_correlated(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, heights correlated: G = 1/(1 + Lambda_i + Lambda_o). Source: Heitz 2014, JCGT 3(2), section 6."""
    return 1.0 / (1.0 + d.Lambda(wi) + d.Lambda(wo))


def separable(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, masking and shadowing independent: G = 1/((1 + Lambda_i)(1 + Lambda_o)). Source: Walter et al. 2007."""
    return 1.0 / ((1.0 + d.Lambda(wi)) * (1.0 + d.Lambda(wo)))


def v_groove(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """V-shaped grooves: G = min(1, 2 z_m z_o/(wo . wm), 2 z_m z_i/(wo . wm)).

    Source: Torrance & Sparrow 1967; in this form Blinn 1977, "Models of light reflection".
    """
    _, cos_d = half_and_cosine(wi, wo)
    return ops.minimum(1.0, 2.0 * wm.z * ops.minimum(wi.z, wo.z) / cos_d)


MASKINGS: dict[str, Callable[..., Any]] = {f.__name__: f for f in (height_correlated, separable, v_groove)}
