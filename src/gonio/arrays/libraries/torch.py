"""PyTorch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import numpy as np

from ..fixed import Array, Fixed
from ..interface import WORD
from ..together import Together


def _tensor(numbers: np.ndarray, dtype: Any, device: Any) -> Array:
    import torch

    with torch.inference_mode(False):  # the kept tensor serves calls with gradients too
        return torch.tensor(numbers, dtype=dtype, device=device)


class Torch(Together):
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

    def known(self, x: Array) -> np.ndarray | None:
        if self.module.compiler.is_compiling() or x.device.type != "cpu":
            return None
        try:
            return x.detach().numpy()
        except RuntimeError:  # in torch.func's transformations, or without storage
            return None

    def broadcast(self, *arrays: Array) -> Sequence[Array]:
        return self.module.broadcast_tensors(*arrays)

    def one_interval(self, nodes: Array, count: int, x: Array) -> Array:
        return super().one_interval(nodes, count, x.contiguous())

    def _listed(self, numbers: Sequence[float], like: Array) -> Array:
        return self.module.tensor(numbers, dtype=like.dtype, device=like.device)

    def merge_channels(self, value: Array, how: str) -> Array:
        if not isinstance(value, self.module.Tensor):
            return super().merge_channels(value, how)
        return getattr(value, {"mean": "mean"}.get(how, "a" + how))(-1, keepdim=True) if value.ndim else value

    def pair(self, a: Array, b: Array) -> tuple[Array, Array]:
        like = a if isinstance(a, self.module.Tensor) else b
        return self.convert(a, like), self.convert(b, like)

    def op_maximum(self, a: Array, b: Array) -> Array:
        if isinstance(b, (int, float)):
            return a.clamp(min=b)
        return self.module.maximum(*self.pair(a, b))

    def op_minimum(self, a: Array, b: Array) -> Array:
        if isinstance(b, (int, float)):
            return a.clamp(max=b)
        return self.module.minimum(*self.pair(a, b))

    def op_take(self, table: Array, index: Array) -> Array:
        return self.module.take(table, index) if isinstance(index, self.module.Tensor) else table[index]

    def op_to_index(self, x: Array) -> Array:
        return self.module.nan_to_num(x, 0.0, 0.0, 0.0).long()

    def op_stop_gradient(self, x: Array) -> Array:
        return x.detach()

    def word(self, x: Array) -> Array:
        return (x if isinstance(x, int) else x.long()) & WORD  # PyTorch has few operations on 32 bits without a sign

    def of_words(self, function: Callable[[Array, Array], Array], a: Array, b: Array) -> Array:
        return super().of_words(function, a, b) & WORD

    def op_unit(self, word: Array, like: Array) -> Array:
        return self.op_shift_right(word, 8).to(like.dtype) * 2.0**-24

    def op_loop(self, step: Callable[..., Any], *states: Array) -> Sequence[Array]:
        with self.module.no_grad():
            return super().op_loop(step, *states)


LIBRARY = Torch("torch")
