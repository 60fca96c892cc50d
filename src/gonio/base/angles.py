"""Polar angles and azimuths of unit vectors, and back: the public pair `direction` and `angles`."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..errors import ParameterError


def direction(theta: Any, phi: Any) -> Any:
    """Unit vectors (sin theta cos phi, sin theta sin phi, cos theta), shape (..., 3); angles [rad] broadcast."""
    theta, phi = ops.plain(theta), ops.plain(phi)
    # Numbers become arrays of the other's library.
    theta, phi = (b * 0.0 + a if isinstance(a, (int, float)) else a for a, b in ((theta, phi), (phi, theta)))
    lib = ops.library(theta, phi)
    s = ops.sin(theta)
    return lib.stack([s * ops.cos(phi), s * ops.sin(phi), ops.cos(theta) + 0.0 * phi])


def from_degrees(theta: float, phi: float) -> Any:
    """The direction (3,) of angles in degrees. Raises ParameterError for theta below 0 or above 180."""
    if not 0.0 <= theta <= 180.0:
        raise ParameterError(f"theta is {theta:g} degrees, expected 0 (up) to 180 (down)")
    return direction(math.radians(theta), math.radians(phi))


def angles(w: Any) -> tuple[Any, Any]:
    """theta in [0, pi] and phi in (-pi, pi] [rad] of vectors (..., 3); any length. phi = 0 at the poles."""
    lib, (w,) = ops.as_arrays(w)
    x, y, z = lib.split(w, lib.shape(w)[:-1], False)
    return ops.arctan2(ops.sqrt(x * x + y * y), z), ops.arctan2(y + 0.0, x + 0.0)
