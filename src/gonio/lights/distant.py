"""A source so far away that its light is parallel: the sun."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import ops
from ..base.angles import from_degrees
from ..base.light import Arrival, Light, channel_vector, spectrum
from ..errors import ParameterError
from ..formula.fields import param, vector


class DistantLight(Light):
    """Distant point source: L_i = E delta(theta_i - theta_s) delta(phi_i - phi_s)/sin(theta_s).

    Shapes   direction: (3,), to the light, of any length; irradiance: a number or (C,).
    Units    irradiance E on a plane perpendicular to the beam: W m-2.
    Error    rounding.
    Source   lecture 4, eq. 4.9 and 4.10 (docs/equations.md).
    """

    direction = vector((0.0, 0.0, 1.0), "direction to the light", unit=True)
    irradiance = param(1.0, 0.0, 1e30, "irradiance on a plane perpendicular to the beam", unit="W m-2")

    is_delta: ClassVar[bool] = True
    words: ClassVar[dict[str, str]] = {
        "distant:THETA,PHI[,E]": "parallel beam of irradiance E; default pi, which lights a white surface that faces "
        "it to radiance 1"
    }

    @classmethod
    def of_word(cls, numbers: Sequence[float]) -> Self:
        if len(numbers) < 2:
            raise ParameterError("expected distant:THETA,PHI[,E] in degrees, such as distant:45,-60")
        return cls(from_degrees(*numbers[:2]), spectrum(numbers[2:], math.pi))

    def arrival(self, position: Any) -> Arrival:
        lib = ops.library(position)
        return Arrival(lib.convert(np.array(self.direction), position), channel_vector(self.irradiance, position))
