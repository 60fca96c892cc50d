"""Smith's masking with the heights of facets correlated."""

from __future__ import annotations

from typing import Any

from ..direction import Direction
from ..distribution import Distribution


def height_correlated(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, heights correlated: G = 1/(1 + Lambda_i + Lambda_o). Source: Heitz 2014, JCGT 3(2), section 6."""
    return 1.0 / (1.0 + d.Lambda(wi) + d.Lambda(wo))
