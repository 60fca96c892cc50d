"""What the models of deep scattering layers share: their sampling."""

from __future__ import annotations

from typing import Any

from ..formula.direction import Direction
from ._power_cosine import PowerCosine


class DeepLayer(PowerCosine):
    """Sampling of z_i/(z_i + z_o), z = cos(theta), by the power of z_i that has its slope at z_i = 1/2."""

    w: Any

    def exponent(self, wo: Direction) -> Any:
        return wo.z / (0.5 + wo.z)
