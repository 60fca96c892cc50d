"""Directions by the half vectors they make with a fixed one: coordinates in which lobes of mirror facets are smooth.

A facet of slopes (p, q), of normal (-p, -q, 1)/sqrt(1 + p^2 + q^2), mirrors the fixed direction w above the horizon
where (p + w.x/w.z)^2 + (q + w.y/w.z)^2 < 1/w.z^2: in a disc, with slope 0 inside. Polar coordinates (r, phi) of the
slopes in units of a lobe's scales, r = sinh(y), turn it into a rectangle, on which y runs from 0 to the disc's rim. The
horizon is then an edge and no kink, long tails are as short as logarithms, and a lobe is as wide as any other: the
facets that w sees are about as far from the pole as they are spread. Rules that converge exponentially, the trapezium
rule along phi and Gauss's along y, need some hundred nodes for what cells need thousands for.

Error    facets of GGX, Beckmann and StudentT, alpha from 0.001 to 1 along either axis, 0 to 89.99 degrees: of 5760
         albedos to 1e-4 none was off by more than 6e-5. The estimate is that of the rule of half as many nodes, so
         that it is mostly a hundred times the error; where a Fresnel term bends (total reflection) about the error.
Source   derived here; the disc follows from wo.z = 2 (wi . wm) wm.z - wi.z > 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, dot, normalize, reflect
from ..machine.caches import kept
from .by_polar_angle import is_even

SIZES = ((20, 28), (40, 56), (80, 112))
"""Nodes around half a circle, and along a radius, of the rules that are tried one after the other."""

HIGHEST = (3, 2)
"""Coefficients around the circle and along the radius that errors are estimated by."""


def coordinates(mean: Any, fixed: Direction, u0: Any, u1: Any, numbers: Any) -> tuple[Direction, Callable]:
    """The direction at 2 pi u0 about the pole, counted from the plane of the fixed direction, and at a share u1 of y.

    The pole lies at the slopes -s/(1 + s) along that plane, s = |(ax tx, ay ty)| with the tangents t of the fixed
    direction, in units of the scales: at 0 from the normal, among the visible facets at grazing.
    """
    ax, ay, reach = mean.hints.spread
    tx, ty = fixed.x / fixed.z, fixed.y / fixed.z
    sx, sy = ax * tx, ay * ty
    s = ops.sqrt(sx * sx + sy * sy + 1e-40)
    cos_0, sin_0 = ops.where(s > 1e-18, sx / s, 1.0), ops.where(s > 1e-18, sy / s, 0.0)
    phi = 2.0 * math.pi * u0
    cos_phi, sin_phi = ops.cos(phi), ops.sin(phi)
    dx, dy = ax * (cos_phi * cos_0 - sin_phi * sin_0), ay * (cos_phi * sin_0 + sin_phi * cos_0)
    px, py = -ax * sx / (1.0 + s), -ay * sy / (1.0 + s)
    # The rim is at 1/r = (b + sqrt(b^2 + a q))/q, where |pole + r (dx, dy) + (tx, ty)|^2 = 1 + tx^2 + ty^2.
    a, b = dx * dx + dy * dy, dx * (px + tx) + dy * (py + ty)
    q = 1.0 + 2.0 * s * s / (1.0 + s) - px * px - py * py
    inverse = ops.maximum((b + ops.sqrt(b * b + a * q)) / q, 1.0 / (1.0 + reach))  # the pole is within 1 of slope 0
    rim = ops.log((1.0 + ops.sqrt(1.0 + inverse * inverse)) / inverse)
    e = ops.exp(rim * u1)
    r, slope = 0.5 * (e - 1.0 / e), 0.5 * (e + 1.0 / e)
    wm = normalize(Direction(-px - dx * r, -py - dy * r, 1.0 + 0.0 * r))
    cos_d = dot(fixed, wm)
    area = 8.0 * math.pi * ax * ay * r * slope * rim * wm.z * wm.z * wm.z * cos_d
    return reflect(fixed, wm), lambda there: 1.0 / ops.maximum(area, 1e-300)


def rules(lobe: Reflectance) -> tuple[np.ndarray, ...]:
    """The nodes for a lobe, as `quadrature.NODES`, of finer and finer rules; none where slopes have no spread."""
    spread = lobe.hints.spread
    if spread is None:
        return ()
    even = is_even(lobe)
    return tuple(_rule(*size, even) for size in SIZES)


@kept
def _rule(around: int, along: int, even: bool) -> np.ndarray:
    """Nodes and weights ((around + 1) or 2 around times along, 2 + SUMS) of the trapezium rule times Gauss's.

    `even`: on the half of the circle that stands for the whole where both halves are equal. The further weights give
    coefficients of the highest waves around the circle and of the highest polynomials along the radius that the nodes
    can tell apart. The first wave is what the rule of every second node is wrong by.
    """
    count = around + 1 if even else 2 * around
    u0 = np.arange(count) / (2.0 * around)
    w0 = np.full(count, 0.5 / around)
    if even:
        w0[1:-1] *= 2.0
    turns = 2.0 * math.pi * u0
    third = np.cos((around - 2) * turns) if even else np.sin((around - 1) * turns)
    waves = [np.cos(around * turns), *(math.sqrt(2.0) * wave for wave in (np.cos((around - 1) * turns), third))]
    legendre = np.polynomial.legendre
    x, w1 = legendre.leggauss(along)
    u1, w1 = 0.5 * (x + 1.0), 0.5 * w1
    highest = [math.sqrt(2 * k + 1) * legendre.legval(x, np.eye(along)[k]) for k in range(along - HIGHEST[1], along)]
    weights = [(w0, w1), *((w0 * wave, w1) for wave in waves), *((w0, w1 * polynomial) for polynomial in highest)]
    columns = [*np.broadcast_arrays(u0[:, None], u1), *(np.outer(*pair) for pair in weights)]
    nodes = np.asfortranarray(np.stack([c.reshape(-1) for c in columns], axis=-1))
    nodes.flags.writeable = False
    return nodes
