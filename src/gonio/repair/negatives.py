"""Removal of negative values: measurements scatter around zero, renderers expect none below."""

from __future__ import annotations

import numpy as np

from ..base.measured import Measured
from ..declared.arguments import checked
from ..errors import ParameterError
from ..tables.gridded import Gridded
from ._cells import GridCells

LARGEST = 1e6
"""The largest floor [1/sr]: a mirror's lobe of 1 mrad."""


@checked
def remove_negatives(m: Measured, floor: float | str = 0.0) -> Gridded:
    """The measurement with every f below a floor raised to it. Noise is removed on one side only, which is a bias.

    `floor`: f [1/sr], 0 or the noise floor of the instrument; or "uncertainty", the standard uncertainty of each cell.

    The bias is `albedo_after` - `albedo_before` of the record: for noise of standard deviation s around f = 0,
    s/sqrt(2 pi) = 0.40 s in every cell. `figures`: "lowest", the lowest f before. Uncertainties stay as they are.

    Example
    >>> axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0]}
    >>> m = gn.Gridded("angles", axes, np.array([[[0.1], [0.1]], [[-0.01], [0.1]]]))
    >>> m = gn.repair.remove_negatives(m)
    >>> print(m.brdf().ravel(), m.repairs[-1].figures["lowest"])
    [0.1 0.1 0.  0.1] -0.01
    """
    cells = GridCells(m)
    if isinstance(floor, str):
        if floor != "uncertainty":
            raise ParameterError(f"remove_negatives(floor={floor!r}): expected a number [1/sr] or 'uncertainty'")
        if cells.u is None:
            raise ParameterError("remove_negatives(floor='uncertainty'): there is none; give a number [1/sr]")
        least = cells.u
    else:
        least = np.array(floor, dtype=float)
        if not 0.0 <= floor <= LARGEST:
            raise ParameterError(f"remove_negatives(floor={floor!r}): expected 0 or a small positive number [1/sr]")
    with np.errstate(invalid="ignore"):
        f = np.where(cells.f < least, least, cells.f)
    lowest = float(np.nanmin(cells.f[cells.up], initial=np.inf))
    return cells.repaired("remove_negatives", {"floor": floor}, f, cells.u, {"lowest": lowest})
