"""A small source that shines into a cone: a spotlight."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.light import Light
from ..errors import ParameterError
from ..formula.direction import Direction, dot
from ..formula.fields import param
from ..formula.world import vector
from ._beam import is_at, to_place


class SpotLight(Light):
    r"""Nearby point source that shines into a cone: $I(\theta) = I s(\theta)$, theta from its axis.

    s is 1 up to the angle `inner` and 0 from `outer` on; between them $s = t^2 (3 - 2t)$ with
    $t = (\cos\theta - \cos\theta_{outer})/(\cos\theta_{inner} - \cos\theta_{outer})$.

    Looks    `SpotLight([-2.0, -2.0, 2.5], [0.75, 0.65, -1.0], 30.0, inner=0.25, outer=0.33)` is a disk with a soft
             edge, an ellipse on the floor.
    Shapes   position, axis: (3,), the axis of any length; intensity: a number or (C,); inner, outer: numbers.
    Units    position: m; intensity: W sr-1; angles: rad.
    Error    rounding. At the light's own place the direction is undefined: an error, or NaN.
    Source   PBRT-4 section 12.2, for the fall between the angles.

    Example
    >>> lamp = gn.SpotLight([0.0, 0.0, 2.0], [0.0, 0.0, -1.0], intensity=100.0, inner=0.3, outer=0.5)
    >>> up = [0, 0, 1]
    >>> for x in (0.0, 0.8, 1.2):
    ...     print(gn.irradiance(lamp, [x, 0.0, 0.0], up).round(2))
    ...
    25.0
    14.5
    0.0
    """

    position = vector((0.0, 0.0, 1.0), "where the light is [m]")
    axis = vector((0.0, 0.0, -1.0), "where it shines to", unit=True)
    intensity = param(1.0, 0.0, 1e30, "radiant intensity within the inner angle", unit="W sr-1")
    inner = param(0.3, 0.0, math.pi, "angle from the axis up to which it is as bright as on the axis", unit="rad")
    outer = param(0.5, 0.0, math.pi, "angle from the axis from which on it is dark", unit="rad")

    is_delta: ClassVar[bool] = True

    def validate(self) -> None:
        if isinstance(self.inner, float) and isinstance(self.outer, float) and not self.inner < self.outer:
            raise ParameterError(
                f"SpotLight(inner={self.inner:g}, outer={self.outer:g}): expected the inner angle to be smaller"
            )

    def holds(self, p: Direction) -> Any:
        return is_at(self.position.vector, p)

    def beam(self, p: Direction) -> tuple[Direction, Any, Any]:
        w, r2, r = to_place(self.position.vector, p)
        start, end = ops.cos(1.0 * self.outer), ops.cos(1.0 * self.inner)
        t = ops.clip((-dot(w, self.axis.unit) - start) / (end - start), 0.0, 1.0)
        return w, self.intensity * t * t * (3.0 - 2.0 * t) / r2, r
