"""NumPy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..fixed import Array, Fixed, contiguous
from ..interface import Library
from ..packets import BLOCKED, NEAREST, shot


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

    def op_nearest(self, table: Array, o: Sequence[Array], d: Sequence[Array], near: Array, far: Array) -> Any:
        return shot(table, NEAREST, *o, *d, near, far)

    def op_blocked(self, table: Array, o: Sequence[Array], d: Sequence[Array], near: Array, far: Array) -> Any:
        return shot(table, BLOCKED, *o, *d, near, far)[0]

    def of_words(self, function: Callable[[Array, Array], Array], a: Array, b: Array) -> Array:
        with np.errstate(over="ignore"):  # of single numbers NumPy warns
            return super().of_words(function, a, b)


LIBRARY = NumPy("numpy", special="scipy.special")
