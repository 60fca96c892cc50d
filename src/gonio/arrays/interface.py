"""The interface of formulas to an array library, as NumPy and those in its manner have it."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from types import ModuleType

import numpy as np

from .fixed import Array, Fixed
from .kinds import SCALAR, VECTOR


def _imported(module: str, function: str, x: Array) -> Array:
    return getattr(import_module(module), function)(x)


class Library:
    """An array library in the manner of NumPy: the names of its functions, and the way from vectors to components."""

    # Libraries whose arrays hold one component each (Dr.Jit) evaluate a formula once per channel instead of
    # broadcasting over a channel axis.
    channel_loop = False

    def __init__(self, namespace: str, packages: tuple[str, ...] = (), special: str = "", **names: str):
        """`namespace`: the module with its functions. `packages`: where its array types are from, if from several.
        `special`: the module with erf, erfc and erfinv, if that is another. `names`: what it calls functions of `ops`,
        where that differs."""
        self.namespace, self.packages = namespace, packages or (namespace,)
        self._names = names
        self._methods = {name[3:]: getattr(self, name) for name in dir(self) if name.startswith("op_")}
        if special:
            self._methods |= {name: partial(_imported, special, name) for name in ("erf", "erfc", "erfinv")}

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
            else:
                out.append(result[..., 0] if channels and kind == SCALAR else result)
        return out

    def empty(self, like: Array, shape: tuple[int, ...], vectors: bool) -> Array:
        """A result for a batch without elements, `vectors` if it has a last axis of components or channels."""
        return self.module.zeros(shape, dtype=like.dtype)

    def broadcast(self, *arrays: Array) -> Sequence[Array]:
        """The arrays, broadcast against each other."""
        return self.module.broadcast_arrays(*arrays)

    def stack(self, components: Sequence[Array]) -> Array:
        """Components along a new last axis."""
        return self.module.stack(self.broadcast(*components), -1)

    def op_sin_turn(self, x: Array) -> Array:
        return self.function("sin")(x * (2.0 * math.pi))

    def op_cos_turn(self, x: Array) -> Array:
        return self.function("cos")(x * (2.0 * math.pi))

    def op_ierfc(self, x: Array) -> Array:
        x = self.function("where")(x > 30.0, 30.0, x)  # 0 from there on, infinity too; NaN stays
        return self.function("exp")(-x * x) * (1.0 / math.sqrt(math.pi)) - x * self.function("erfc")(x)

    def op_take(self, table: Array, index: Array) -> Array:
        return table[index]

    def op_stop_gradient(self, x: Array) -> Array:
        return x
