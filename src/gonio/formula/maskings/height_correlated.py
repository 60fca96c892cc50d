"""Smith's masking with the heights of facets correlated."""

from __future__ import annotations

from typing import Any

from ..direction import Direction
from ..distribution import Distribution


def height_correlated(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, heights correlated: G = 1/(1 + Lambda_i + Lambda_o). Source: Heitz 2014, JCGT 3(2), section 6."""
    both = wi.z * wo.z
    return both / (d.projected_area(wi) * wo.z + d.projected_area(wo) * wi.z - both)
