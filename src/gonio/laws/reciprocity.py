"""Reciprocity: light takes the same way back, f(wi, wo) = f(wo, wi). By Helmholtz.

Measured   largest |f(wi, wo) - f(wo, wi)| over the mean of both, at the same pairs
Holds if   <= 1e-4
Tolerance  formulas stay below 1e-9, interpolated tables below 1e-5
"""

from __future__ import annotations

import numpy as np

from ..base.reflectance import Reflectance
from ._probes import degrees, difference, largest, pairs, values
from ._verdict import Findings, at_most

ORDER = 12
TOLERANCE = 1e-4  # formulas in double precision stay below 1e-9, tables that are read by interpolation below 1e-5


def law(m: Reflectance) -> Findings:
    """The largest difference on exchanging the directions, relative to the mean of both values."""
    wi, wo = pairs()
    there, back = values(m, wi, wo), values(m, wo, wi)
    error = difference(there, back)
    value, (at, c) = largest(error)
    median = np.median(error[error > 0.0]) if value > 0.0 else 0.0
    why = (
        f"f(wi, wo) = {there[at, c]:.4g} but f(wo, wi) = {back[at, c]:.4g} sr-1; "
        f"of the pairs that differ, half do by more than {median:.2g}"
    )
    rule = "|f - f swapped|/mean = {value} <= {tolerance}"
    yield at_most("reciprocity", value, TOLERANCE, rule, degrees(wi[at], wo[at]), why)
