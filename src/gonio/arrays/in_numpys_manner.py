"""Array libraries in the manner of NumPy: NumPy itself, PyTorch, JAX, and (as they are) CuPy and the like."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import numpy as np

from .kinds import SCALAR, VECTOR

Array = Any  # an array of any library, or a number


def frozen(array: Any) -> Any:
    """The array, read-only from now on, as are those that it is a view of; anything but a NumPy array as it is."""
    owner = array
    while isinstance(owner, np.ndarray):
        owner.flags.writeable = False
        owner = owner.base
    return array


def contiguous(numbers: np.ndarray, dtype: Any) -> np.ndarray:
    """The numbers in one piece of memory, to be made `once`.

    A function of Python's: where torch.compile looks up what was made, it cannot compare NumPy's own.
    """
    return np.ascontiguousarray(numbers, dtype)


class Fixed:
    """Numbers that never change, with what libraries made of them; `numbers` may be a function that makes them."""

    def __init__(self, numbers: np.ndarray | Callable[[], np.ndarray]):
        self._numbers = frozen(numbers)
        self._made: dict[tuple, Array] = {}

    @property
    def numbers(self) -> np.ndarray:
        """The numbers, as a NumPy array."""
        found = self._numbers
        if callable(found):
            found = self._numbers = frozen(found())
        return found

    def once(self, make: Callable[..., Array], *args: Any) -> Array:
        """`make(numbers, *args)`, as it was when first asked for."""
        self._make(make, *args)
        return self._made[make, *args]

    def _make(self, make: Callable[..., Array], *args: Any) -> None:
        if (make, *args) not in self._made:
            self._made[make, *args] = frozen(make(self.numbers, *args))

    # What torch.compiler.assume_constant_result does: torch.compile does not trace this but calls it, and then finds
    # what was made. The numbers must not become an input of its graph: NumPy arrays there are made writeable.
    _make._dynamo_marked_constant = True  # type: ignore[attr-defined]


class Roomy(Fixed):
    """Numbers that are made with one more behind them, which is none: kernels, which read two at a time, need no copy.

    Of large tables a copy is what decides how much memory they take.
    """

    @property
    def whole(self) -> np.ndarray:
        """The numbers, and the one behind them."""
        return super().numbers

    @property
    def numbers(self) -> np.ndarray:
        return self.whole[:-1]


class Later:
    """Fixed numbers for NumPy, converted when they are looked up: what is not may take long to make."""

    def __init__(self, numbers: Fixed, dtype: np.dtype):
        self._numbers, self._dtype = numbers, dtype

    def take(self, index: Array) -> Array:
        """The entries at these places."""
        return np.take(self._numbers.once(contiguous, self._dtype), index)


class Library:
    """An array library in the manner of NumPy: what its functions are called, and how vectors become components."""

    # Libraries whose arrays hold one component each (Dr.Jit) evaluate a formula once per channel instead of
    # broadcasting over a channel axis.
    channel_loop = False

    def __init__(self, namespace: str, **names: str):
        self.namespace = namespace
        self._names = names
        self._own = {name[3:]: getattr(self, name) for name in dir(self) if name.startswith("op_")}

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
        return self._own[name] if name in self._own else getattr(self.module, self._names.get(name, name))

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

    def fixed(self, value: Fixed, like: Array) -> Array:
        """Fixed numbers with the dtype and device of `like`, converted once."""
        return value.once(self.module.asarray, like.dtype)

    def entries(self, value: Fixed, index: Array, like: Array) -> Array:
        """Entries of fixed numbers with the dtype and device of `like`."""
        return self.op_take(self.fixed(value, like), index)

    def merge_channels(self, value: Array, how: str) -> Array:
        """The "mean", "max" or "min" over the channels of a parameter, as it was given: what sampling uses."""
        return getattr(value, how)(-1, keepdims=True) if getattr(value, "ndim", 0) else value

    def split(self, w: Array, shape: tuple[int, ...], channels: bool) -> tuple[Array, ...]:
        """Components of `w`; with `channels` each keeps a last axis of length 1. `shape`: the whole batch's."""
        if channels:
            return tuple(w[..., i : i + 1] for i in range(w.shape[-1]))
        return tuple(w[..., i] for i in range(w.shape[-1]))

    def assemble(
        self, kinds: Sequence[str], runs: list, like: Array, shape: tuple[int, ...], channels: bool
    ) -> list[Array]:
        """Undo `split` for what a kernel returned, once per run (a channel, where `channel_loop`)."""
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

    def op_take(self, table: Array, index: Array) -> Array:
        return table[index]

    def op_stop_gradient(self, x: Array) -> Array:
        return x


class NumPy(Library):
    def fixed(self, value: Fixed, like: Array) -> Array:
        return value.once(contiguous, like.dtype)

    def entries(self, value: Fixed, index: Array, like: Array) -> Array:
        return value.numbers.take(index).astype(like.dtype, copy=False)  # large tables are not converted whole

    def op_take(self, table: Array, index: Array) -> Array:
        return table.take(index)

    def op_erf(self, x: Array) -> Array:
        from scipy.special import erf

        return erf(x)

    def op_erfinv(self, x: Array) -> Array:
        from scipy.special import erfinv

        return erfinv(x)

    def op_to_index(self, x: Array) -> Array:
        # NaN has no index: it looks up entry 0, and the NaN of the direction is restored by the caller.
        return np.nan_to_num(x, nan=0.0, posinf=0.0, neginf=0.0).astype(np.intp)


def _tensor(numbers: np.ndarray, dtype: Any, device: Any) -> Array:
    import torch

    with torch.inference_mode(False):  # what is kept serves calls with gradients too
        return torch.tensor(numbers, dtype=dtype, device=device)


class Torch(Library):
    @property
    def module(self) -> ModuleType:
        import torch  # torch.compile is quick with this, and slow with `sys.modules`

        return torch

    def convert(
        self, value: Array, like: Array, channel: int | None = None, shape: tuple[int, ...] | None = None
    ) -> Array:
        if isinstance(value, Fixed):
            return self.fixed(value, like)
        if isinstance(value, (int, float)):
            return self.module.full((), value, dtype=like.dtype, device=like.device)
        if isinstance(value, self.module.Tensor):
            return value.to(dtype=like.dtype, device=like.device)
        return self.module.tensor(value, dtype=like.dtype, device=like.device)

    def fixed(self, value: Fixed, like: Array) -> Array:
        return value.once(_tensor, like.dtype, like.device)

    def to_numpy(self, x: Array) -> np.ndarray:
        return x.detach().cpu().numpy()

    def broadcast(self, *arrays: Array) -> Sequence[Array]:
        return self.module.broadcast_tensors(*arrays)

    def merge_channels(self, value: Array, how: str) -> Array:
        if not isinstance(value, self.module.Tensor):
            return super().merge_channels(value, how)
        return getattr(value, {"mean": "mean"}.get(how, "a" + how))(-1, keepdim=True) if value.ndim else value

    def _pair(self, a: Array, b: Array) -> tuple[Array, Array]:
        like = a if isinstance(a, self.module.Tensor) else b
        return self.convert(a, like), self.convert(b, like)

    def op_maximum(self, a: Array, b: Array) -> Array:
        return self.module.maximum(*self._pair(a, b))

    def op_minimum(self, a: Array, b: Array) -> Array:
        return self.module.minimum(*self._pair(a, b))

    def op_arctan2(self, y: Array, x: Array) -> Array:
        return self.module.arctan2(*self._pair(y, x))

    def op_power(self, x: Array, y: Array) -> Array:
        return self.module.pow(x, y)

    def op_to_index(self, x: Array) -> Array:
        return self.module.nan_to_num(x, 0.0, 0.0, 0.0).long()

    def op_stop_gradient(self, x: Array) -> Array:
        return x.detach()


class Jax(Library):
    def fixed(self, value: Fixed, like: Array) -> Array:
        from jax import ensure_compile_time_eval

        with ensure_compile_time_eval():  # inside jit or grad too what is kept is an array, not a tracer
            return super().fixed(value, like)

    def op_erf(self, x: Array) -> Array:
        from jax.scipy.special import erf

        return erf(x)

    def op_erfinv(self, x: Array) -> Array:
        from jax.scipy.special import erfinv

        return erfinv(x)

    def op_to_index(self, x: Array) -> Array:
        return self.module.nan_to_num(x, nan=0.0, posinf=0.0, neginf=0.0).astype("int32")

    def op_stop_gradient(self, x: Array) -> Array:
        from jax.lax import stop_gradient

        return stop_gradient(x)
