"""What a file's measurement holds that is likely none: marks of missing values, and far more light than arrives."""

from __future__ import annotations

import numpy as np

from ..base.angles import direction
from ..base.measured import Measured
from ..base.quantities import mark_of_missing
from ..errors import MeaningWarning, warn
from ..tables.gridded import Gridded
from ..tables.scattered import Scattered
from ._reading.large_tables import Unscanned

BRIGHT = 4.0
"""Albedo from which it is told: a fourfold one is no error of an instrument."""


def warn_of(m: Measured, path: object, says_missing: bool) -> None:
    """Warn of a measurement from a file. `says_missing`: whether its user has said what stands for missing values."""
    if isinstance(m, Unscanned):
        return
    if isinstance(m, Gridded) and not says_missing:
        mark = mark_of_missing(m.stored, lambda: _places(m))
        if mark is not None:
            count = int(np.count_nonzero(m.stored == mark))
            text = f"{path}: {mark:g} stands in {count} of {m.stored.size} values, decades apart from all others: is it"
            warn(f"{text} the mark of a missing value? write nan in its place", MeaningWarning)
            return
    albedo = m.rough_albedo()
    if albedo > BRIGHT:
        text = f"{path}: reflects {albedo:.3g} times the light that arrives at some angle, expected at most once:"
        warn(f"{text} percent, another unit, or marks of missing values?", MeaningWarning)


def _places(m: Gridded) -> np.ndarray:
    """Both directions (..., 6) of each value."""
    if isinstance(m, Scattered):
        return np.concatenate([direction(m.rows[:, k], m.rows[:, k + 1]) for k in (0, 2)], axis=-1)
    return np.concatenate(m.directions(), axis=-1)
