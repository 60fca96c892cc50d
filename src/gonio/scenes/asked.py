"""What all pictures may be asked, declared once."""

from __future__ import annotations

from typing import Annotated

from ..declared.arguments import ABOVE_ZERO, Declared

Size = Annotated[int, Declared("width and height of the picture, in pixels", 1, 16384)]
Samples = Annotated[
    int,
    Declared(
        "points averaged in each pixel; the most where there is a tolerance",
        1,
        1 << 20,
        usual="32, with a tolerance 65536",
    ),
]
PixelTolerance = Annotated[
    float, Declared("go on until the standard error is this share of the mean radiance", ABOVE_ZERO, unit="share")
]
Backdrop = Annotated[bool, Declared("lights with extent are seen behind everything, such as the sky")]
