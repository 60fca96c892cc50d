"""Directions in the local frame (z = surface normal), as components, and the few constructions on them.

`Direction` holds three components of any one batch shape, of any array library; formulas use `w.x, w.y, w.z`.
"""

from __future__ import annotations

from typing import Any, NamedTuple, NoReturn

from ..arrays import ops

HORIZON = 1e-6
"""Cosine below which a direction counts as below the horizon (0.2 seconds of arc above it)."""


class _Components(NamedTuple):
    x: Any
    y: Any
    z: Any


class Direction(_Components):
    """A direction, or any vector, of the local frame by its components; z is along the surface normal.

    Operators are those of vectors: `a + b`, `a - b`, `-a`, `s * a`, `a * s` and `a / s` for a number s (a Dr.Jit array
    must stand on the right: `a * s`). In place of `a * b` write `dot(a, b)` or `cross(a, b)`.

    Example
    >>> from gonio.authoring import Direction
    >>> wi, wo = Direction(0.6, 0.0, 0.8), Direction(-0.6, 0.0, 0.8)
    >>> print(wi + wo, 0.5 * wo)
    Direction(x=0.0, y=0.0, z=1.6) Direction(x=-0.3, y=0.0, z=0.4)
    """

    __slots__ = ()
    __array_ufunc__ = None  # array * direction is computed by the direction

    def __add__(self, other: tuple[Any, ...]) -> Direction:
        if type(other) is not Direction:
            raise TypeError(f"a direction + {type(other).__name__}; expected a direction on either side")
        return Direction(self.x + other.x, self.y + other.y, self.z + other.z)

    def __radd__(self, other: Any) -> NoReturn:
        raise TypeError(f"{type(other).__name__} + a direction; expected a direction on either side")

    def __sub__(self, other: Direction) -> Direction:
        if type(other) is not Direction:
            raise TypeError(f"a direction - {type(other).__name__}; expected a direction on either side")
        return Direction(self.x - other.x, self.y - other.y, self.z - other.z)

    def __neg__(self) -> Direction:
        return Direction(-self.x, -self.y, -self.z)

    def __mul__(self, s: Any) -> Direction:
        if isinstance(s, tuple):
            raise TypeError("a direction times a direction; expected dot(a, b) or cross(a, b)")
        return Direction(s * self.x, s * self.y, s * self.z)

    __rmul__ = __mul__

    def __truediv__(self, s: Any) -> Direction:
        if isinstance(s, tuple):
            raise TypeError("a direction divided by a direction; expected a number below")
        return Direction(self.x / s, self.y / s, self.z / s)

    def __eq__(self, other: object) -> NoReturn:
        raise TypeError("directions have no ==; compare their components, or dot(a, b)")

    __ne__ = __eq__

    def __bool__(self) -> NoReturn:
        raise TypeError("a direction is neither true nor false; compare its components")


NORMAL = Direction(0.0, 0.0, 1.0)
BEHIND = Direction(0.0, 0.0, -1.0)


def dot(a: Direction, b: Direction) -> Any:
    """a . b, summed from the smallest-in-practice components (x, y) to z.

    Example
    >>> from gonio.authoring import Direction, dot
    >>> print(dot(Direction(0.6, 0.0, 0.8), Direction(0.0, 0.0, 1.0)))
    0.8
    """
    return a.x * b.x + a.y * b.y + a.z * b.z


def cross(a: Direction, b: Direction) -> Direction:
    """a x b.

    Example
    >>> from gonio.authoring import Direction, cross
    >>> print(cross(Direction(1.0, 0.0, 0.0), Direction(0.0, 1.0, 0.0)))
    Direction(x=0.0, y=0.0, z=1.0)
    """
    return Direction(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


def length(a: Direction) -> Any:
    """|a|, with a finite derivative at 0."""
    return ops.sqrt(dot(a, a) + 1e-30)


def normalize(a: Direction) -> Direction:
    """a / |a|.

    Example
    >>> from gonio.authoring import Direction, normalize
    >>> print(normalize(Direction(3.0, 0.0, 4.0)).x.round(4))
    0.6
    """
    unit: Direction = a * (1.0 / ops.sqrt(dot(a, a)))
    return unit


def half_vector(wi: Direction, wo: Direction) -> Direction:
    """wm = (wi + wo) / |wi + wo|, the normal of a facet that mirrors wi into wo.

    Example
    >>> from gonio.authoring import Direction, half_vector
    >>> print(half_vector(Direction(0.6, 0.0, 0.8), Direction(-0.6, 0.0, 0.8)).z.round(4))
    1.0
    """
    return normalize(wi + wo)


def half_and_cosine(wi: Direction, wo: Direction) -> tuple[Direction, Any]:
    """The half vector wm, and wo . wm = |wi + wo|/2: above 0, and the same to the last digit for wi and wo exchanged.

    Near grazing, where wi and wo are almost opposite, the sum of products loses even its sign to rounding.

    Example
    >>> from gonio.authoring import Direction, half_and_cosine
    >>> wm, cos_d = half_and_cosine(Direction(0.6, 0.0, 0.8), Direction(-0.6, 0.0, 0.8))
    >>> print(wm.z.round(4), cos_d.round(4))
    1.0 0.8
    """
    total = wi + wo
    twice = ops.sqrt(dot(total, total))
    # Not `minimum`: LLVM, as Dr.Jit has it, cannot compile that of numbers that are the same in all lanes.
    return total * (1.0 / twice), ops.where(twice > 2.0, 1.0, 0.5 * twice)


def reflect(w: Direction, wm: Direction) -> Direction:
    """Mirror image of w about wm: 2 (w . wm) wm - w.

    Example
    >>> from gonio.authoring import NORMAL, Direction, reflect
    >>> print(reflect(Direction(0.6, 0.0, 0.8), NORMAL))
    Direction(x=-0.6, y=0.0, z=0.8)
    """
    twice: Direction = wm * (2.0 * dot(w, wm))
    return twice - w


def mirror(w: Direction) -> Direction:
    """Mirror image of w about the surface normal.

    Example
    >>> from gonio.authoring import Direction, mirror
    >>> print(mirror(Direction(0.6, 0.0, 0.8)))
    Direction(x=-0.6, y=-0.0, z=0.8)
    """
    return Direction(-w.x, -w.y, w.z)


def select(condition: Any, a: Direction, b: Direction) -> Direction:
    """a where the condition holds, else b, component by component.

    Example
    >>> from gonio.authoring import NORMAL, Direction, select
    >>> w = Direction(0.6, 0.0, -0.8)
    >>> print(select(w.z > 0.0, w, NORMAL).z)
    1.0
    """
    return Direction(ops.where(condition, a.x, b.x), ops.where(condition, a.y, b.y), ops.where(condition, a.z, b.z))


def served(*directions: Direction) -> tuple[Any, ...]:
    """Whether any of these directions is below the horizon, and the directions; where one is, the normal for all.

    Kernels give these to formulas, `below, wi, wo = served(wi, wo)`: a value that is only masked after the formula
    still turns gradients into NaN. NaN is not below the horizon, and stays.
    """
    below = directions[0].z <= HORIZON
    for w in directions[1:]:
        below = below | (w.z <= HORIZON)
    return (below, *(select(below, NORMAL, w) for w in directions))


def raised(w: Direction) -> tuple[Any, Direction]:
    """Whether w is above the horizon, and w if it is, else the normal: wrappers may call formulas with that."""
    up = w.z > HORIZON
    return up, select(up, w, NORMAL)


def polar_angle(w: Direction) -> Any:
    """theta of a unit vector, accurate also near the pole, with a finite derivative there.

    Example
    >>> from gonio.authoring import Direction, polar_angle
    >>> print(polar_angle(Direction(np.sin(0.3), 0.0, np.cos(0.3))).round(4))
    0.3
    """
    return ops.arctan2(ops.sqrt(w.x * w.x + w.y * w.y + 1e-20), w.z)


def on_circle(radius: Any, u: Any, z: Any) -> Direction:
    """The vector at this height, this far from the z axis, at the azimuth 2 pi u.

    Example
    >>> from gonio.formula.direction import on_circle
    >>> print(on_circle(0.6, 0.25, 0.8).y.round(4))
    0.6
    """
    cos_phi, sin_phi = ops.turn(u)
    return Direction(radius * cos_phi, radius * sin_phi, z)


def azimuth(w: Direction, sin_theta: Any) -> tuple[Any, Any]:
    """(cos phi, sin phi) of w at the distance `sin_theta` from the pole; phi = 0 at the pole.

    Example
    >>> from gonio.authoring import Direction, azimuth
    >>> cos_phi, sin_phi = azimuth(Direction(0.36, 0.48, 0.8), np.array(0.6))
    >>> print(cos_phi.round(4), sin_phi.round(4))
    0.6 0.8
    """
    pole = sin_theta < 1e-10
    safe = ops.where(pole, 1.0, sin_theta)
    return ops.where(pole, 1.0, w.x / safe), ops.where(pole, 0.0, w.y / safe)


def frame(n: Direction) -> tuple[Direction, Direction]:
    """Two unit vectors that complete n to a right-handed frame (t, b, n): x and y, turned as z is turned into n.

    n must not point along the negative z axis.
    Source: Duff et al. 2017, JCGT 6(1), "Building an orthonormal basis, revisited", for n.z > 0.

    Example
    >>> from gonio.authoring import NORMAL, frame
    >>> t, b = frame(NORMAL)
    >>> print(t.x, b.y)
    1.0 1.0
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
    total = wi + wo
    twice = ops.sqrt(dot(total, total))
    h = total * (1.0 / twice)
    s = ops.sqrt(h.x * h.x + h.y * h.y + 1e-30)
    cos_phi, sin_phi = azimuth(h, s)
    # Half the difference is the part of wi perpendicular to h: it has no cancellation where theta_d is small,
    # and exchanging wi and wo negates it exactly.
    d = 0.5 * (wi - wo)
    across = d.y * cos_phi - d.x * sin_phi  # along the axis perpendicular to half vector and normal
    along = h.z * (d.x * cos_phi + d.y * sin_phi) - s * d.z
    sin2 = across * across + along * along
    theta_d = ops.arctan2(ops.sqrt(sin2 + 1e-30), 0.5 * twice)
    phi_d = ops.arctan2(across, ops.where(sin2 < 1e-30, 1.0, along))
    return HalfDifference(ops.arctan2(s, h.z), theta_d, phi_d)


def from_half_difference(theta_h: Any, phi_h: Any, theta_d: Any, phi_d: Any) -> tuple[Direction, Direction]:
    """wi and wo of half and difference angles, and of the azimuth of the half vector: the inverse of
    `half_difference`. The order is that of `gn.directions.from_half_difference`."""
    sin_d, mean = ops.sin(theta_d), ops.cos(theta_d)
    along, across = sin_d * ops.cos(phi_d), sin_d * ops.sin(phi_d)
    s, c, cos_phi, sin_phi = ops.sin(theta_h), ops.cos(theta_h), ops.cos(phi_h), ops.sin(phi_h)

    def turned(x: Any, y: Any, z: Any) -> Direction:
        return Direction(cos_phi * x - sin_phi * y, sin_phi * x + cos_phi * y, z)

    wi = turned(s * mean + c * along, across, c * mean - s * along)
    return wi, turned(s * mean - c * along, -across, c * mean + s * along)
