"""The interface of formulas to an array library, as NumPy and those in its manner have it."""

from __future__ import annotations

import operator
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from ..errors import ArrayTypeError, ShapeError
from .fixed import Array, Fixed
from .kinds import MATRIX, SCALAR, VECTOR
from .operations import Operation

WORD = (1 << 32) - 1
"""The bits of a whole number."""


def _imported(module: str, function: str, x: Array) -> Array:
    return getattr(import_module(module), function)(x)


class Library:
    """An array library in the manner of NumPy: the names of its functions, and the way from vectors to components."""

    # Libraries whose arrays hold one component each (Dr.Jit) evaluate a formula once per channel instead of
    # broadcasting over a channel axis.
    channel_loop = False

    def __init__(self, namespace: str, packages: tuple[str, ...] = (), special: str = ""):
        """`namespace`: the module with its functions. `packages`: where its array types are from, if from several.
        `special`: the module with special functions, if that is another."""
        self.namespace, self.packages, self.special = namespace, packages or (namespace,), special
        self._names: dict[str, str] = {}
        self._methods = {name[3:]: getattr(self, name) for name in dir(self) if name.startswith("op_")}

    def add(self, row: Operation) -> None:
        """Learn an elementary function: what it is called here, or how it is computed."""
        how = row.libraries.get(self.name, row.libraries.get("", row.name))
        if isinstance(how, str):
            self._names[row.name] = how
        else:
            self._methods[row.name] = partial(how, self)
        if row.special and self.special:
            self._methods[row.special] = partial(_imported, self.special, row.special)

    @property
    def name(self) -> str:
        return self.namespace.partition(".")[0]

    @property
    def module(self) -> ModuleType:
        if self.namespace not in sys.modules:
            __import__(self.namespace)
        return sys.modules[self.namespace]

    def function(self, name: str) -> Callable:
        """What this library has for the ops function `name`."""
        return self._methods[name] if name in self._methods else getattr(self.module, self._names.get(name, name))

    def dtype(self, x: Array) -> str:
        return str(x.dtype).rpartition(".")[2]

    def shape(self, x: Array) -> tuple[int, ...]:
        """Shape with the vector (or channel) axis last."""
        return tuple(x.shape)

    def convert(
        self, value: Array, like: Array, channel: int | None = None, shape: tuple[int, ...] | None = None
    ) -> Array:
        """A parameter with the dtype and device of `like`; where `channel_loop`, one channel of it over the batch."""
        if isinstance(value, Fixed):
            return self.fixed(value, like)
        return self.module.asarray(value, dtype=like.dtype)

    def vectors(self, values: np.ndarray, like: Array) -> Array:
        """Vectors (..., n) as an array of this library with the dtype and device of `like`."""
        return self.convert(values, like)

    def to_numpy(self, x: Array) -> np.ndarray:
        """The values of an array, without their derivatives."""
        return np.asarray(x)

    def known(self, x: Array) -> np.ndarray | None:
        """The values of an array where they can be read at once: None while a library compiles or differentiates by
        tracing, and where reading would wait for a device."""
        return None

    def fixed(self, value: Fixed, like: Array) -> Array:
        """Fixed numbers with the dtype and device of `like`, converted once."""
        return value.once(self.module.asarray, like.dtype)

    def entries(self, value: Fixed, index: Array, like: Array) -> Array:
        """Entries of fixed numbers with the dtype and device of `like`."""
        return self.op_take(self.fixed(value, like), index)

    def merge_channels(self, value: Array, how: str) -> Array:
        """The "mean", "max" or "min" over the channels of a parameter, for sampling."""
        return getattr(value, how)(-1, keepdims=True) if getattr(value, "ndim", 0) else value

    def split(self, w: Array, shape: tuple[int, ...], channels: bool) -> tuple[Array, ...]:
        """Components of `w`; with `channels` each keeps a last axis of length 1. `shape`: the whole batch's."""
        return tuple(w[..., i : i + 1] if channels else w[..., i] for i in range(w.shape[-1]))

    def assemble(
        self, kinds: Sequence[str], runs: list, like: Array, shape: tuple[int, ...], channels: bool
    ) -> list[Array]:
        """Undo `split` for the results of a kernel, of one run, or where `channel_loop` of one for each channel."""
        out = []
        for kind, result in zip(kinds, runs[0], strict=True):
            if kind == VECTOR:
                stacked = self.stack(result)
                out.append(stacked[..., 0, :] if channels else stacked)
            elif kind == MATRIX:
                stacked = self.stack([x for row in result for x in row])
                out.append(stacked.reshape((*self.shape(stacked)[:-1], 4, 4)))
            else:
                out.append(result[..., 0] if channels and kind == SCALAR else result)
        return out

    def of_pairs(self, values: Array | None, diagonal: Array, channels: int) -> Array:
        """Matrices (..., C, C) of values (..., C C), if any, and of (..., C) that are added to the diagonal."""
        matrices = diagonal[..., None] * self.convert(np.eye(channels), diagonal)
        return matrices if values is None else values.reshape((*self.shape(diagonal), channels)) + matrices

    def empty(self, like: Array, shape: tuple[int, ...], vectors: bool) -> Array:
        """A result for a batch without elements, `vectors` if it has a last axis of components or channels."""
        return self.module.zeros(shape, dtype=like.dtype)

    def broadcast(self, *arrays: Array) -> Sequence[Array]:
        """The arrays, broadcast against each other."""
        return self.module.broadcast_arrays(*arrays)

    def stack(self, components: Sequence[Array]) -> Array:
        """Components along a new last axis."""
        return self.module.stack(self.broadcast(*components), -1)

    def op_take(self, table: Array, index: Array) -> Array:
        return table[index]

    def op_stop_gradient(self, x: Array) -> Array:
        return x

    def word(self, x: Array) -> Array:
        """A whole number as one of 32 bits without a sign."""
        return np.uint32(x & WORD) if isinstance(x, (int, np.integer)) else x.astype("uint32")

    def of_words(self, function: Callable[[Array, Array], Array], a: Array, b: Array) -> Array:
        """A function of two whole numbers, modulo 2^32."""
        return function(self.word(a), self.word(b))

    def op_xor(self, a: Array, b: Array) -> Array:
        return self.of_words(operator.xor, a, b)

    def op_bit_and(self, a: Array, b: Array) -> Array:
        return self.of_words(operator.and_, a, b)

    def op_shift_left(self, a: Array, b: Array) -> Array:
        return self.of_words(operator.lshift, a, b)

    def op_shift_right(self, a: Array, b: Array) -> Array:
        return self.of_words(operator.rshift, a, b)

    def op_wrapped_sum(self, a: Array, b: Array) -> Array:
        return self.of_words(operator.add, a, b)

    def op_wrapped_product(self, a: Array, b: Array) -> Array:
        return self.of_words(operator.mul, a, b)

    def op_unit(self, word: Array, like: Array) -> Array:
        return self.op_shift_right(word, 8).astype(like.dtype) * 2.0**-24

    def op_nearest(self, table: Array, o: Sequence[Array], d: Sequence[Array], near: Array, far: Array) -> Any:
        raise ArrayTypeError(f"rays are shot by NumPy arrays alone; got {self.name} arrays; convert them first")

    op_blocked = op_nearest

    def op_loop(self, step: Callable[..., Any], *states: Array) -> Sequence[Array]:
        going, *values = step(*states)
        values = self._states(states, values)
        while going if isinstance(going, bool) else bool(going.any()):
            go_on, *new = step(*values)
            values = [self._taken(going, b, a) for a, b in zip(values, new, strict=True)]
            going = going & go_on
        return values

    def _states(self, before: Sequence[Array], after: Sequence[Array]) -> list[Array]:
        """States after a first step, plain numbers among them with the dtype of the others."""
        if len(before) != len(after):
            raise ShapeError(f"a step of a loop of {len(before)} states gives {len(after)}; expected (go_on, *states)")
        like = next((x for x in (*after, *before) if self._is_real(x)), None)
        return [self.convert(x, like) if type(x) is float and like is not None else x for x in after]

    def _is_real(self, x: Array) -> bool:
        return hasattr(x, "dtype") and self.dtype(x).startswith("float")

    def _taken(self, condition: Array, a: Array, b: Array) -> Array:
        if isinstance(condition, bool):
            return a if condition else b
        return self.function("where")(condition, a, b)
