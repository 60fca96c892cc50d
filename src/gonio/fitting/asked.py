"""What all fits may be asked, declared once."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any

from ..declared.arguments import ABOVE_ZERO, Declared
from .losses import LOSSES, ROBUST

LossName = Annotated[
    str, Declared("what is compared; likelihood where the data have uncertainties, else cosine", words=(*LOSSES,))
]
RobustName = Annotated[
    str, Declared("by which outliers count less; its scale is that of the residuals", words=(*ROBUST,))
]
ThetaMax = Annotated[float, Declared("rows with a direction beyond it are left out", ABOVE_ZERO, 0.5 * math.pi, "rad")]
Starts = Annotated[int, Declared("starts of the solver; 1 goes from the numbers of the model alone", 1, 10_000)]
PerChannel = Annotated[
    bool | Iterable[str],
    Declared(
        "parameters with a number for each channel, true for all, false for none; without it those in which f is "
        "linear, and those of which the model has an array"
    ),
]
Scheduler = Annotated[
    Any,
    Declared(
        "of many materials or texels: processes, one on each core, or the address of a scheduler of Dask, "
        "tls://host:8786; tcp:// trusts everybody in its network"
    ),
]
By = Annotated[
    Iterable[str],
    Declared("parameters that are fitted; all without it, but those that fits keep (`param(..., fitted=False)`)"),
]
