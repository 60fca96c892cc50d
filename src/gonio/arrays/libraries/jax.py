"""JAX."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..fixed import Array, Fixed
from ..together import Together


class Jax(Together):
    def fixed(self, value: Fixed, like: Array) -> Array:
        from jax import ensure_compile_time_eval

        with ensure_compile_time_eval():  # inside jit or grad too the kept value is an array, not a tracer
            return super().fixed(value, like)

    def known(self, x: Array) -> np.ndarray | None:
        from jax.core import Tracer

        if isinstance(x, Tracer) or any(device.platform != "cpu" for device in x.devices()):
            return None
        return np.asarray(x)

    def op_to_index(self, x: Array) -> Array:
        return self.module.nan_to_num(x, nan=0.0, posinf=0.0, neginf=0.0).astype("int32")

    def op_stop_gradient(self, x: Array) -> Array:
        from jax.lax import stop_gradient

        return stop_gradient(x)

    def op_loop(self, step: Callable[..., Any], *states: Array) -> Sequence[Array]:
        from jax.lax import while_loop

        going, *found = step(*states)
        arrays = self.broadcast(*map(self.module.asarray, (going, *self._states(states, found))))

        def stepped(now: Sequence[Array]) -> tuple[Array, ...]:
            going, *before = now
            go_on, *after = step(*before)
            chosen = (self.module.where(going, b, a).astype(a.dtype) for a, b in zip(before, after, strict=True))
            return going & go_on, *chosen

        return [self.op_stop_gradient(x) for x in while_loop(lambda now: now[0].any(), stepped, tuple(arrays))[1:]]


LIBRARY = Jax("jax.numpy", packages=("jax", "jaxlib"), special="jax.scipy.special")
