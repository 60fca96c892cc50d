"""Maps from the unit square to directions, with their densities per solid angle."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from .direction import Direction, frame, on_circle


def cosine_hemisphere(u0: Any, u1: Any) -> Direction:
    """Direction with density cos(theta)/pi: a uniform point of the disc (radius sqrt(u1), azimuth 2 pi u0), lifted.

    Example
    >>> from gonio.authoring import cosine_hemisphere
    >>> print(cosine_hemisphere(np.array(0.0), np.array(0.36)).x.round(4))
    0.6
    """
    return on_circle(ops.sqrt(u1), u0, ops.sqrt(ops.maximum(1.0 - u1, 0.0)))


def cosine_hemisphere_density(w: Direction) -> Any:
    """cos(theta) / pi [1/sr].

    Example
    >>> from gonio.authoring import NORMAL, cosine_hemisphere_density
    >>> print(round(cosine_hemisphere_density(NORMAL), 4))
    0.3183
    """
    return w.z * (1.0 / math.pi)


def uniform_sphere(u0: Any, u1: Any) -> Direction:
    """Direction with density 1/(4 pi): the azimuth 2 pi u0, z = 1 - 2 u1.

    Example
    >>> from gonio.formula.warp import uniform_sphere
    >>> print(uniform_sphere(np.array(0.0), np.array(0.2)).x.round(4))
    0.8
    """
    return on_circle(2.0 * ops.sqrt(ops.maximum(u1 * (1.0 - u1), 0.0)), u0, 1.0 - 2.0 * u1)


def power_cosine(n: Any, u0: Any, u1: Any) -> Direction:
    """Direction with density (n + 1)/(2 pi) cos(theta)^n.

    Example
    >>> from gonio.authoring import power_cosine
    >>> print(power_cosine(10.0, np.array(0.0), np.array(0.5)).z.round(4))
    0.9389
    """
    sin_theta, cos_theta = power_tilt(n, u1)
    return on_circle(sin_theta, u0, cos_theta)


def power_tilt(n: Any, u: Any) -> tuple[Any, Any]:
    """(sin(theta), cos(theta)) of a direction with density (n + 1)/(2 pi) cos(theta)^n."""
    cos_theta = ops.power(ops.maximum(1.0 - u, 1e-30), 1.0 / (n + 1.0))
    return ops.sqrt(ops.maximum(1.0 - cos_theta * cos_theta, 1e-30)), cos_theta


def power_cosine_density(n: Any, cos_theta: Any) -> Any:
    """(n + 1)/(2 pi) cos(theta)^n [1/sr]; 0 where the cosine is negative.

    Example
    >>> from gonio.authoring import power_cosine_density
    >>> print(power_cosine_density(10.0, np.array([1.0, 0.9, -0.5])).round(4))
    [1.7507 0.6104 0.    ]
    """
    return (n + 1.0) * (0.5 / math.pi) * power_positive(cos_theta, n)


def power_positive(x: Any, n: Any) -> Any:
    """max(x, 0)^n with finite derivatives where x <= 0.

    Example
    >>> from gonio.authoring import power_positive
    >>> print(power_positive(np.array([0.5, -0.5]), 3.0))
    [0.125 0.   ]
    """
    up = x > 1e-30
    return ops.where(up, ops.power(ops.where(up, x, 1.0), n), 0.0 * n)


def around(axis: Direction, w: Direction) -> Direction:
    """w, given in a frame whose z is `axis` (a unit vector above the horizon), in the frame of `axis`.

    Example
    >>> from gonio.authoring import NORMAL, Direction, around
    >>> print(around(NORMAL, Direction(0.6, 0.0, 0.8)))
    Direction(x=0.6, y=0.0, z=0.8)
    """
    t, b = frame(axis)
    turned: Direction = t * w.x + b * w.y + axis * w.z
    return turned
