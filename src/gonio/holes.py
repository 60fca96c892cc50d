"""Arrays with holes (NaN), filled where a table has to hold a number everywhere."""

from __future__ import annotations

import numpy as np

from .errors import ParameterError


def filled(values: np.ndarray) -> np.ndarray:
    """An array with its NaNs replaced, from the edges of what is known inwards, by the mean of known neighbours.

    Raises ParameterError where nothing is known.
    """
    values = values.copy()
    while (missing := np.isnan(values)).any():
        total, count = np.zeros(values.shape), np.zeros(values.shape)
        for axis in range(values.ndim):
            for there, here in ((slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None))):
                to, of = ([slice(None)] * values.ndim for _ in range(2))
                to[axis], of[axis] = here, there
                known = ~missing[tuple(of)]
                total[tuple(to)] += np.where(known, values[tuple(of)], 0.0)
                count[tuple(to)] += known
        reached = missing & (count > 0)
        if not reached.any():
            raise ParameterError("the material has no value at any node of the grid; expected some")
        values[reached] = total[reached] / count[reached]
    return values
