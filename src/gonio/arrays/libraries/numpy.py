"""NumPy."""

from __future__ import annotations

import numpy as np

from ..fixed import Array, Fixed, contiguous
from ..interface import Library


class NumPy(Library):
    def known(self, x: Array) -> np.ndarray:
        return x

    def fixed(self, value: Fixed, like: Array) -> Array:
        return value.once(contiguous, like.dtype)

    def entries(self, value: Fixed, index: Array, like: Array) -> Array:
        return value.numbers.take(index).astype(like.dtype, copy=False)  # large tables are not converted whole

    def op_take(self, table: Array, index: Array) -> Array:
        return table.take(index)

    def op_to_index(self, x: Array) -> Array:
        # NaN has no index: it looks up entry 0, and the NaN of the direction is restored by the caller.
        return np.nan_to_num(x, nan=0.0, posinf=0.0, neginf=0.0).astype(np.intp)


LIBRARY = NumPy("numpy", special="scipy.special", absolute="abs")
