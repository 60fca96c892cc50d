"""Smith's masking with masking and shadowing independent."""

from __future__ import annotations

from typing import Any

from ..direction import Direction
from ..distribution import Distribution


def separable(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, masking and shadowing independent: G = 1/((1 + Lambda_i)(1 + Lambda_o)). Source: Walter et al. 2007."""
    return (wi.z * wo.z) / (d.projected_area(wi) * d.projected_area(wo))
