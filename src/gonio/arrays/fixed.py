"""Constant numbers of materials, converted once for each array library."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = Any  # an array of any library, or a number


def frozen(array: Any) -> Any:
    """The array, read-only from now on, as are those that it is a view of; anything but a NumPy array as it is."""
    owner = array
    while isinstance(owner, np.ndarray):
        owner.flags.writeable = False
        owner = owner.base
    return array


def contiguous(numbers: np.ndarray, dtype: Any) -> np.ndarray:
    """The numbers in one piece of memory, for `Fixed.once`.

    A Python function, because torch.compile cannot compare NumPy's own as the key of a lookup.
    """
    return np.ascontiguousarray(numbers, dtype)


class Fixed:
    """Constant numbers, with their conversions for array libraries; `numbers` may be a function that computes them."""

    def __init__(self, numbers: np.ndarray | Callable[[], np.ndarray]):
        self._numbers = frozen(numbers)
        self._conversions: dict[tuple, Array] = {}

    @property
    def numbers(self) -> np.ndarray:
        """The numbers, as a NumPy array."""
        if callable(self._numbers):
            self._numbers = frozen(self._numbers())
        return self._numbers

    def once(self, make: Callable[..., Array], *args: Any) -> Array:
        """`make(numbers, *args)`, computed at the first call and kept."""
        self._make(make, *args)
        return self._conversions[make, *args]

    def _make(self, make: Callable[..., Array], *args: Any) -> None:
        if (make, *args) not in self._conversions:
            self._conversions[make, *args] = frozen(make(self.numbers, *args))

    # As torch.compiler.assume_constant_result does: torch.compile calls this instead of tracing it, then looks the
    # result up. The numbers must not become an input of its graph: it makes NumPy arrays there writeable.
    _make._dynamo_marked_constant = True  # type: ignore[attr-defined]  # PyTorch looks for this attribute


class Roomy(Fixed):
    """A table padded by one entry, because kernels gather pairs: it is handed to them without a copy.

    The copy of a large table would decide how much memory it takes.
    """

    @property
    def whole(self) -> np.ndarray:
        """The numbers with the padding."""
        return super().numbers

    @property
    def numbers(self) -> np.ndarray:
        return self.whole[:-1]


class AsStored(Fixed):
    """A large table of single precision, of which NumPy converts what is looked up: never the whole to double."""


class Later:
    """Fixed numbers for NumPy, converted at their first lookup, since some take long to make."""

    def __init__(self, numbers: Fixed, dtype: np.dtype):
        self._numbers, self._dtype = numbers, dtype

    def take(self, index: Array) -> Array:
        """The entries at these places."""
        if isinstance(self._numbers, AsStored):
            return np.take(self._numbers.numbers, index).astype(self._dtype, copy=False)
        return np.take(self._numbers.once(contiguous, self._dtype), index)
