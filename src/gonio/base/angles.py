"""Polar angles and azimuths of unit vectors, and back: the public pair `direction` and `angles`."""

from __future__ import annotations

from typing import Any

from ..arrays import ops


def direction(theta: Any, phi: Any) -> Any:
    """Unit vectors (sin theta cos phi, sin theta sin phi, cos theta), shape (..., 3); angles [rad] broadcast.

    Example
    >>> print(gn.direction([0.0, 0.5], 0.0).round(4))
    [[0.     0.     1.    ]
     [0.4794 0.     0.8776]]
    """
    theta, phi = ops.plain(theta), ops.plain(phi)
    # Numbers become arrays of the other's library.
    theta, phi = (b * 0.0 + a if isinstance(a, (int, float)) else a for a, b in ((theta, phi), (phi, theta)))
    lib = ops.library(theta, phi)
    s = ops.sin(theta)
    return lib.stack([s * ops.cos(phi), s * ops.sin(phi), ops.cos(theta) + 0.0 * phi])


def angles(w: Any) -> tuple[Any, Any]:
    """theta in [0, pi] and phi in (-pi, pi] [rad] of vectors (..., 3); any length. phi = 0 at the poles.

    Example
    >>> theta, phi = gn.angles([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]])
    >>> print(theta.round(4), phi.round(4))
    [0.     0.6435] [0.     1.5708]
    """
    lib, (w,) = ops.as_arrays(w)
    x, y, z = lib.split(w, lib.shape(w)[:-1], False)
    return ops.arctan2(ops.sqrt(x * x + y * y), z), ops.arctan2(y + 0.0, x + 0.0)
