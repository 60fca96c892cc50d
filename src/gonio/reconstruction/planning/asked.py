"""What all plans and reconstructions may be asked, declared once."""

from __future__ import annotations

from typing import Annotated

from ...declared.arguments import BELOW_ONE, Declared

Noise = Annotated[
    float, Declared("relative standard uncertainty of a value that comes without one", 0.0, BELOW_ONE, "share")
]
Floor = Annotated[float, Declared("absolute standard uncertainty of a value that comes without one", 0.0, unit="1/sr")]
