"""What all fits may be asked, declared once."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated

from ..declared.arguments import Declared
from .losses import LOSSES, ROBUST

LossName = Annotated[
    str, Declared("what is compared; likelihood where the data have uncertainties, else cosine", words=(*LOSSES,))
]
RobustName = Annotated[
    str, Declared("by which outliers count less; its scale is that of the residuals", words=(*ROBUST,))
]
ThetaMax = Annotated[float, Declared("rows with a direction beyond it are left out", 0.0, 0.5 * math.pi, "rad")]
Starts = Annotated[int, Declared("starts of the solver; 1 goes from the numbers of the model alone", 1, 10_000)]
By = Annotated[
    Iterable[str],
    Declared("parameters that are fitted; all without it, but those that fits keep (`param(..., fitted=False)`)"),
]
