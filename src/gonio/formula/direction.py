"""Directions in the local frame (z = surface normal), as components, and the few constructions on them.

`Direction` holds three components of any one batch shape, of any array library; formulas use `w.x, w.y, w.z`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..arrays import ops

HORIZON = 1e-6
"""Cosine below which a direction counts as below the horizon (0.2 seconds of arc above it)."""


class Direction(NamedTuple):
    """Components of a direction (or of any vector) in the local frame; z is along the surface normal."""

    x: Any
    y: Any
    z: Any


NORMAL = Direction(0.0, 0.0, 1.0)


def dot(a: Direction, b: Direction) -> Any:
    """a . b, summed from the smallest-in-practice components (x, y) to z."""
    return a.x * b.x + a.y * b.y + a.z * b.z


def cross(a: Direction, b: Direction) -> Direction:
    """a x b."""
    return Direction(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


def add(a: Direction, b: Direction) -> Direction:
    """a + b."""
    return Direction(a.x + b.x, a.y + b.y, a.z + b.z)


def scale(s: Any, a: Direction) -> Direction:
    """s a."""
    return Direction(s * a.x, s * a.y, s * a.z)


def normalize(a: Direction) -> Direction:
    """a / |a|."""
    return scale(1.0 / ops.sqrt(dot(a, a)), a)


def half_vector(wi: Direction, wo: Direction) -> Direction:
    """wm = (wi + wo) / |wi + wo|, the normal of a facet that mirrors wi into wo."""
    return normalize(add(wi, wo))


def half_and_cosine(wi: Direction, wo: Direction) -> tuple[Direction, Any]:
    """The half vector wm, and wo . wm = |wi + wo|/2: above 0, and the same to the last digit for wi and wo exchanged.

    Near grazing, where wi and wo are almost opposite, the sum of products loses even its sign to rounding.
    """
    total = add(wi, wo)
    twice = ops.sqrt(dot(total, total))
    # Not `minimum`: LLVM, as Dr.Jit has it, cannot compile that of numbers that are the same in all lanes.
    return scale(1.0 / twice, total), ops.where(twice > 2.0, 1.0, 0.5 * twice)


def reflect(w: Direction, wm: Direction) -> Direction:
    """Mirror image of w about wm: 2 (w . wm) wm - w."""
    d = 2.0 * dot(w, wm)
    return Direction(d * wm.x - w.x, d * wm.y - w.y, d * wm.z - w.z)


def mirror(w: Direction) -> Direction:
    """Mirror image of w about the surface normal."""
    return Direction(-w.x, -w.y, w.z)


def select(condition: Any, a: Direction, b: Direction) -> Direction:
    """a where the condition holds, else b, component by component."""
    return Direction(ops.where(condition, a.x, b.x), ops.where(condition, a.y, b.y), ops.where(condition, a.z, b.z))


def polar_angle(w: Direction) -> Any:
    """theta of a unit vector, accurate also near the pole, with a finite derivative there."""
    return ops.arctan2(ops.sqrt(w.x * w.x + w.y * w.y + 1e-20), w.z)


def azimuth(w: Direction, sin_theta: Any) -> tuple[Any, Any]:
    """(cos phi, sin phi) of w, whose distance from the pole is `sin_theta`; phi = 0 at the pole."""
    pole = sin_theta < 1e-10
    safe = ops.where(pole, 1.0, sin_theta)
    return ops.where(pole, 1.0, w.x / safe), ops.where(pole, 0.0, w.y / safe)


def frame(n: Direction) -> tuple[Direction, Direction]:
    """Two unit vectors that complete n to a right-handed frame (t, b, n): x and y, turned as z is turned into n.

    n must not point along the negative z axis.
    Source: Duff et al. 2017, JCGT 6(1), "Building an orthonormal basis, revisited", for n.z > 0.
    """
    a = -1.0 / (1.0 + n.z)
    b = n.x * n.y * a
    return Direction(1.0 + n.x * n.x * a, b, -n.x), Direction(b, 1.0 + n.y * n.y * a, -n.y)


class HalfDifference(NamedTuple):
    """Rusinkiewicz' angles [rad] of a pair of directions."""

    theta_h: Any
    theta_d: Any
    phi_d: Any


def half_difference(wi: Direction, wo: Direction) -> HalfDifference:
    """Half and difference angles (theta_h, theta_d, phi_d) of a pair.

    wi is expressed in the frame whose z is the half vector and whose x lies in the plane of the half vector
    and the normal, turned away from the normal; phi_d in [-pi, pi] is its azimuth. At theta_h = 0 the x axis
    is d_x, at theta_d = 0 phi_d is 0; all three have finite derivatives everywhere above the horizon.
    Source: Rusinkiewicz 1998, "A new change of variables for efficient BRDF representation", EGSR.
    """
    total = add(wi, wo)
    length = ops.sqrt(dot(total, total))
    h = scale(1.0 / length, total)
    s = ops.sqrt(h.x * h.x + h.y * h.y + 1e-30)
    cos_phi, sin_phi = azimuth(h, s)
    # Half the difference is the part of wi perpendicular to h: it has no cancellation where theta_d is small,
    # and exchanging wi and wo negates it exactly.
    d = Direction(0.5 * (wi.x - wo.x), 0.5 * (wi.y - wo.y), 0.5 * (wi.z - wo.z))
    across = d.y * cos_phi - d.x * sin_phi  # along the axis perpendicular to half vector and normal
    along = h.z * (d.x * cos_phi + d.y * sin_phi) - s * d.z
    sin2 = across * across + along * along
    theta_d = ops.arctan2(ops.sqrt(sin2 + 1e-30), 0.5 * length)
    phi_d = ops.arctan2(across, ops.where(sin2 < 1e-30, 1.0, along))
    return HalfDifference(ops.arctan2(s, h.z), theta_d, phi_d)
