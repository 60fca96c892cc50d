"""V-grooves: symmetric, parallel, of one slope."""

from __future__ import annotations

import math
from typing import Annotated

from ..declared.arguments import Declared, checked
from .height_field import HeightField


@checked
def v_grooves(slope: Annotated[float, Declared("of both facets, up and down", 1e-6, 30.0)]) -> HeightField:
    """Symmetric V-grooves along y, side by side: facets of two slopes, +slope and -slope along x.

    Source: Torrance & Sparrow 1967, JOSA 57(9), "Theory for off-specular reflection from roughened surfaces".

    Example
    >>> print(gn.surfaces.v_grooves(0.6))
    <surface: V-grooves of slope 0.6>
    """
    return HeightField([[0.0, slope]], turn=math.pi, title=f"V-grooves of slope {slope:g}")
