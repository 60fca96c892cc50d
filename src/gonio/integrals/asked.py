"""What all integrals may be asked, declared once."""

from __future__ import annotations

import math
from typing import Annotated, Any

from ..declared.arguments import BELOW_ONE, Declared
from .over_hemisphere import TIGHTEST

Incidence = Annotated[Any, Declared("where the light comes from", unit="direction")]
Zenith = Annotated[Any, Declared("polar angle of the sun", 0.0, 0.5 * math.pi, "rad")]
Azimuth = Annotated[Any, Declared("azimuth of the sun", -2.0 * math.pi, 2.0 * math.pi, "rad")]
Tolerance = Annotated[
    float, Declared("error of the result, absolute, relative where it is above 1", TIGHTEST, BELOW_ONE)
]
ReturnError = Annotated[bool, Declared("its estimated error, too")]
