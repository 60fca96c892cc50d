"""Smith's Lambda of any distribution of slopes, integrated by Gauss-Legendre nodes where it has no closed form.

The distribution looks the same from all sides, after stretching if need be. p(q) is the density of slopes at the
squared slope q = tan^2(theta_m): D = p / cos^4(theta_m), integral of p over the plane = 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import ops
from .direction import Direction

Nodes = Sequence[tuple[Any, Any]]
"""Slopes and their weights, for integrals over all slopes above 0."""


def cotangent(w: Direction, ax: Any = 1.0, ay: Any = 1.0) -> Any:
    """cot(theta) of w as seen by a surface of slope scale 1; at most 1e5, where Lambda < 1e-10."""
    sx, sy = ax * w.x, ay * w.y
    return ops.minimum(w.z / ops.sqrt(sx * sx + sy * sy + 1e-24), 1e5)


def smith(p: Callable[[Any], Any], a: Any, nodes: Nodes, spread: Any = 1.0) -> Any:
    """Lambda at cot(theta) = a of the slope density p; the nodes are multiplied by `spread`.

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
    """The same by nodes in [0, pi/2]: angles along the great circle of the normals perpendicular to w."""
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


_RULES = {count: _rule(count) for count in (6, 10, 16, 20, 22, 24, 32)}  # made once: compilers of formulas cannot


def gauss(count: int) -> Sequence[tuple[float, float]]:
    """Gauss-Legendre nodes and weights on [0, 1]."""
    return _RULES[count]
