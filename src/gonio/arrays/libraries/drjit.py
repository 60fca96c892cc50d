"""Dr.Jit: arrays of components rather than of vectors, evaluated once per channel."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..fixed import Array, Fixed
from ..interface import WORD, Library
from ..kinds import MATRIX, VALUE, VECTOR


def _table(numbers: np.ndarray, kind: type, dtype: str) -> Array:
    flat = np.ascontiguousarray(numbers, dtype=dtype)
    return flat if kind is float else kind(flat)


class DrJit(Library):
    """Dr.Jit: `Array3f` and the like, whose components are `Float`, and `TensorXf` of shape (..., 3)."""

    channel_loop = True

    def _float(self, like: Array) -> Any:
        """The type of one component of `like`."""
        return self.module.array_t(like) if self.module.is_tensor_v(like) else self.module.value_t(like)

    def dtype(self, x: Array) -> str:
        return self.module.type_v(x).name.lower()

    def shape(self, x: Array) -> tuple[int, ...]:
        if self.module.is_tensor_v(x):
            return tuple(x.shape)
        if self.module.depth_v(x) == 1 and self.module.is_jit_v(x):
            return ()  # a Float: one value per lane, no channels
        width = self.module.width(x[0]) if self.module.depth_v(x) > 1 else 1
        return (len(x),) if width == 1 else (width, len(x))

    def _lanes(self, values: np.ndarray, like: Array) -> Array:
        kind = self._float(like)
        if kind is float or values.size == 1:
            return kind(float(values.reshape(-1)[0]))
        return kind(np.ascontiguousarray(values, dtype=self.dtype(like)).reshape(-1))

    def convert(
        self, value: Array, like: Array, channel: int | None = None, shape: tuple[int, ...] | None = None
    ) -> Array:
        if isinstance(value, (int, float)):
            return self._float(like)(value)
        if isinstance(value, np.ndarray):
            if value.ndim:
                value = value[..., min(channel or 0, value.shape[-1] - 1)]
            if value.size > 1 and shape is not None:
                value = np.broadcast_to(value, shape)
            return self._lanes(value, like)
        if self.module.is_tensor_v(value):
            return self._components(value, [min(channel or 0, value.shape[-1] - 1)], shape, like)[0]
        if self.module.depth_v(value) > 1 or not self.module.is_jit_v(value):
            value = value[min(channel or 0, len(value) - 1)]
        return self._float(like)(value)

    def vectors(self, values: np.ndarray, like: Array) -> Array:
        values = np.ascontiguousarray(values, dtype=self.dtype(like))
        if self.module.is_tensor_v(like):
            return type(like)(values)
        return self.stack([self._lanes(x, like) for x in np.moveaxis(values, -1, 0)])

    def fixed(self, value: Fixed, like: Array) -> Array:
        return value.once(_table, self._float(like), self.dtype(like))

    def merge_channels(self, value: Array, how: str) -> Array:
        if isinstance(value, (int, float, np.ndarray)):
            return super().merge_channels(value, how)
        if not self.shape(value):
            return value
        n = self.shape(value)[-1]
        join = {"mean": lambda a, b: a + b, "max": self.module.maximum, "min": self.module.minimum}[how]
        total = self.convert(value, value, 0)
        for c in range(1, n):
            total = join(total, self.convert(value, value, c))
        total = total / n if how == "mean" else total
        return type(value)(total, (*value.shape[:-1], 1)) if self.module.is_tensor_v(value) else total

    def _components(
        self, w: Array, which: Iterable[int], shape: tuple[int, ...] | None, like: Array
    ) -> tuple[Array, ...]:
        """Components of the vectors of a tensor, over a batch of this shape."""
        dr, kind, n, batch = self.module, self._float(like), w.shape[-1], tuple(w.shape[:-1])
        index, count = dr.uint32_array_t(kind), len(w.array) // n
        if shape is None or batch == shape or count == 1:
            lanes = dr.arange(index, count)
        else:
            places = np.broadcast_to(np.arange(count, dtype=np.uint32).reshape(batch), shape)
            lanes = index(np.ascontiguousarray(places).reshape(-1))
        return tuple(kind(dr.gather(self._float(w), w.array, lanes * n + i)) for i in which)

    def split(self, w: Array, shape: tuple[int, ...], channels: bool) -> tuple[Array, ...]:
        if not self.module.is_tensor_v(w):
            return tuple(w[i] for i in range(len(w)))
        return self._components(w, range(w.shape[-1]), shape, w)

    def assemble(
        self, kinds: Sequence[str], runs: list, like: Array, shape: tuple[int, ...], channels: bool
    ) -> list[Array]:
        out = []
        for i, kind in enumerate(kinds):
            if kind == VALUE and channels:
                out.append(self._gathered([run[i] for run in runs], like, (*shape, len(runs))))
            elif kind == VECTOR:
                out.append(self._gathered(runs[0][i], like, (*shape, len(runs[0][i]))))
            elif kind == MATRIX:  # a tensor, whatever the directions are: there are no arrays of matrices by channel
                parts = [x for run in runs for row in run[i] for x in row]
                axes = (len(runs), 4, 4) if channels else (4, 4)
                out.append(self._gathered(parts, self._tensor(like), (*shape, *axes)))
            elif self.module.is_tensor_v(like):
                out.append(self._gathered([runs[0][i]], like, shape))
            else:
                out.append(runs[0][i])
        return out

    def _gathered(self, components: Sequence[Array], like: Array, shape: tuple[int, ...]) -> Array:
        """One array of the kind of `like` from its components."""
        dr, n = self.module, len(components)
        if dr.is_tensor_v(like):
            masks = dr.is_mask_v(components[0])
            tensor = dr.mask_t(like) if masks else type(like)
            count = int(np.prod(shape, dtype=int)) // n
            flat = dr.zeros(dr.array_t(tensor), count * n)
            lanes = dr.arange(dr.uint32_array_t(self._float(like)), count)
            for i, component in enumerate(components):
                dr.scatter(flat, type(flat)(component), lanes * n + i)  # choices of plain numbers are float32
            return tensor(flat, shape)
        if n == len(like):
            return type(like)(*components)
        name = "ArrayXf" if self.dtype(like) == "float32" else "ArrayXf64"
        return getattr(sys.modules[type(like).__module__], name)(*components)

    def of_pairs(self, values: Array | None, diagonal: Array, channels: int) -> Array:
        batch = self.shape(diagonal)[:-1]
        on_diagonal = self.split(diagonal, batch, True)
        elements = [0.0 * on_diagonal[0]] * channels**2 if values is None else list(self.split(values, batch, True))
        elements[:: channels + 1] = [a + b for a, b in zip(elements[:: channels + 1], on_diagonal, strict=True)]
        # A tensor, whatever the directions are, as for matrices in `assemble`.
        return self._gathered(elements, self._tensor(diagonal), (*batch, channels, channels))

    def _tensor(self, like: Array) -> Array:
        """A tensor of the kind of `like`, of whatever shape."""
        if self.module.is_tensor_v(like):
            return like
        name = "TensorXf" if self.dtype(like) == "float32" else "TensorXf64"
        return getattr(sys.modules[type(like).__module__], name)([0.0])

    def empty(self, like: Array, shape: tuple[int, ...], vectors: bool) -> Array:
        # Dr.Jit cannot compute with batches without elements.
        if self.module.is_tensor_v(like) or len(shape) > 2:
            return self.module.zeros(type(self._tensor(like)), shape)
        return self.module.zeros(type(like) if vectors else self._float(like), 0)

    def stack(self, components: Sequence[Array]) -> Array:
        like = next(c for c in components if self.module.is_array_v(c))
        if self.module.is_tensor_v(like):
            parts = [c + self.module.zeros(type(like), 1) if not self.module.is_tensor_v(c) else c for c in components]
            shape = tuple(np.broadcast_shapes(*(tuple(c.shape) for c in parts)))
            flat = [(c + self.module.zeros(type(like), shape)).array for c in parts]
            return self._gathered(flat, like, (*shape, len(flat)))
        kind = f"Array{len(components)}f" + ("64" if self.dtype(like) == "float64" else "")
        return getattr(sys.modules[type(like).__module__], kind)(*components)

    def op_where(self, condition: Array, a: Array, b: Array) -> Array:
        return self.module.select(condition, a, b)

    def op_take(self, table: Array, index: Array) -> Array:
        if isinstance(table, np.ndarray):
            return float(table[int(index)])
        return self.module.gather(type(table), table, index)

    def op_to_index(self, x: Array) -> Array:
        x = self.module.select(self.module.isfinite(x), x, 0)
        return self.module.uint32_array_t(type(x))(x)

    def op_stop_gradient(self, x: Array) -> Array:
        return self.module.detach(x)

    def word(self, x: Array) -> Array:
        return x & WORD if isinstance(x, int) else self.module.uint32_array_t(type(x))(x)

    def op_unit(self, word: Array, like: Array) -> Array:
        return type(like)(self.op_shift_right(word, 8)) * 2.0**-24

    def op_loop(self, step: Callable[..., Any], *states: Array) -> Sequence[Array]:
        dr = self.module
        going, *after = step(*states)
        after = self._states(states, after)
        like = next(x for x in (*after, *states, going) if dr.is_array_v(x))
        real = next((type(x) for x in (*after, *states) if self._is_real(x)), dr.float_array_t(like))
        kinds = {bool: dr.mask_t(like), int: dr.uint32_array_t(like), float: real}
        arrays = [kinds[type(x)](x) if type(x) in kinds else x for x in (going, *after)]
        states = dr.while_loop(tuple(arrays), lambda going, *_: going, lambda _, *now: tuple(step(*now)))
        return [dr.detach(x) for x in states[1:]]

    def _is_real(self, x: Array) -> bool:
        return self.module.is_array_v(x) and self.module.is_float_v(x)


LIBRARY = DrJit("drjit", packages=("drjit", "mitsuba"))
